//! Two-level structure: a tree for each object, and one over the places of objects.

use super::{InstancedObjects, PlacedObject, PrimLocation};
use crate::accel::bvh::tree::{Below, Stack as PlaceStack, Tree as PlaceTree};
use crate::accel::intersector::Exact;
use crate::accel::query::{Closest, Culling, Goal, Next, Occluded, Query};
use crate::accel::slabs::BoxRay;
use crate::accel::stats::listed_once;
use crate::accel::wide::split::Item;
use crate::accel::wide::{Splitting, Stack};
use crate::accel::{
    Accel, Hit, HitQueries, IntersectFilter, NO_PRIM, OccludedFilter, Probe, Ray, Shapes, StructureStats, Wide,
};
use crate::math::aabb::Aabb;
use rayon::prelude::*;

/// Two-level structure: one tree over the shapes that are not instanced, one per object, and a hierarchy of boxes over the
/// places of objects.
///
/// Prims are numbered as in the flattened scene, in rays and in hits.
#[derive(Clone, Debug)]
pub struct TwoLevel<'a> {
    instanced: &'a InstancedObjects,
    /// Tree over the shapes that are not instanced.
    stored: Wide<'a>,
    /// One tree per object, in the object's own frame.
    objects: Vec<Wide<'a>>,
    /// Tree over the places, by index. Its root is node 0; there is none without places.
    places: PlaceTree,
}

/// Scratch memory of walks through both levels.
#[derive(Debug)]
pub struct LevelScratch {
    stored: Stack,
    places: PlaceStack,
    object: Option<Stack>,
    rays: Vec<Ray>,
    after: Vec<Hit>,
}

impl<'a> TwoLevel<'a> {
    /// Builds all trees; the same for every number of threads.
    pub fn build(shapes: &'a Shapes, instanced: &'a InstancedObjects, splitting: Splitting) -> Self {
        let objects = instanced.objects().par_iter().map(|o| Wide::build(o.shapes(), splitting)).collect();
        let mut items: Vec<Item> = (0..).zip(instanced.placed()).map(|(i, p)| Item::new(p.place.bounds, i)).collect();
        let mut places = PlaceTree::of_places();
        if !items.is_empty() {
            places.add(&mut items, 1);
        }
        Self { instanced, stored: Wide::build(shapes, splitting), objects, places }
    }

    /// Shapes that are not instanced.
    pub fn shapes(&self) -> &Shapes {
        self.stored.shapes()
    }

    /// Sizes of all trees together, each counted once; the depths of both levels are added.
    pub fn summary(&self) -> StructureStats {
        let mut sum = self.stored.summary();
        let (mut above, mut below) = (0, sum.depth);
        sum.bytes += self.places.bytes() as u64;
        if !self.instanced.is_empty() {
            self.places.each(0, 0, &mut |_, depth, node| match node {
                Below::Children(_) => sum.n_in += 1,
                Below::Leaf(_) => above = above.max(depth + 1),
            });
        }
        for stats in self.objects.iter().map(Wide::summary) {
            sum.n_in += stats.n_in;
            sum.n_v += stats.n_v;
            sum.n_oiv += stats.n_oiv;
            sum.bytes += stats.bytes;
            below = below.max(above + stats.depth);
        }
        sum.depth = below;
        sum
    }

    /// Visits everything: each tree holds what it should, each place is in exactly one leaf, and each placed corner is in the
    /// boxes above its place and, transformed back, no farther from the original corner than boxes are widened.
    pub fn check(&self) -> Result<StructureStats, String> {
        self.stored.check()?;
        for (i, object) in self.objects.iter().enumerate() {
            object.check().map_err(|e| format!("object {i}: {e}"))?;
        }
        let mut leaves = vec![0u32; self.instanced.placed().len()];
        let leaf = |places: &[u32]| {
            places.iter().fold(Aabb::EMPTY, |b, &i| {
                leaves[i as usize] += 1;
                b.union(self.instanced.placed()[i as usize].place.bounds)
            })
        };
        if !self.instanced.is_empty()
            && let Some((node, content)) = self.places.fault(0, leaf)
        {
            let bounds = self.places.bounds(node);
            return Err(format!("node {node} of the places is {bounds:?}, below it is {content:?}"));
        }
        listed_once(&leaves, "leaves of places")?;
        for (i, placed) in self.instanced.placed().iter().enumerate() {
            self.holds(placed).map_err(|e| format!("place {i}: {e}"))?;
        }
        Ok(self.summary())
    }

    fn holds(&self, PlacedObject { object, place, .. }: &PlacedObject) -> Result<(), String> {
        for &corner in &self.instanced.objects()[*object as usize].shapes().vertices {
            let there = place.corner(corner);
            let off = (place.carried(there) - corner.as_dvec3()).abs();
            let outside = place.bounds.union(Aabb { lo: there, hi: there }) != place.bounds;
            if outside || off.cmpgt(place.room.as_dvec3()).any() {
                let (bounds, room) = (place.bounds, place.room);
                return Err(format!("{corner} stands at {there} in {bounds:?}, {off} from itself of {room}"));
            }
        }
        Ok(())
    }

    /// Continues a query, already answered for the stored shapes, through the placed objects.
    fn walk<G: Goal, P: Probe>(&self, query: &mut Query<G>, scratch: &mut LevelScratch, probe: &mut P) {
        let (false, Some(stack)) = (self.instanced.is_empty(), &mut scratch.object) else { return };
        let ray = BoxRay::new(query);
        self.places.walk(0, &ray, query, &mut scratch.places, probe, |places, query, probe| {
            places.iter().any(|&i| {
                let placed = &self.instanced.placed()[i as usize];
                let opaque = self.instanced.objects()[placed.object as usize].opaque;
                let tree = &self.objects[placed.object as usize];
                query.opaque = Some(opaque);
                (opaque || query.goal.wants_transparent())
                    && tree.walk_placed(&placed.place, placed.first, query, stack, probe)
            })
        });
    }

    /// Continues the query of each ray from its known hit, and replaces that hit by any that precedes it.
    fn go_on<G: Goal, P: Probe>(
        &self,
        rays: &[Ray],
        hits: &mut [Hit],
        scratch: &mut LevelScratch,
        probe: &mut P,
        query: impl Fn(usize, &Hit) -> (f32, G),
    ) {
        for (i, (ray, hit)) in rays.iter().zip(hits).enumerate() {
            let known = Hit { prim: self.instanced.number(hit.prim), ..*hit };
            let (t_min, goal) = query(i, &known);
            let (mut query, usable) = Query::new(self.stored.shapes(), ray, t_min, goal);
            if usable {
                self.walk(&mut query, scratch, probe);
            }
            *hit = query.hit_by_winner().unwrap_or(known);
            if hit.is_some() && !known.is_some() {
                probe.found();
            }
        }
    }

    /// Rays with their excluded prims renumbered for the tree over the stored shapes.
    fn renumber(&self, rays: &[Ray], renumbered: &mut Vec<Ray>) {
        renumbered.clear();
        renumbered.extend(rays.iter().map(|ray| match self.instanced.find(ray.exclude) {
            PrimLocation::Stored(exclude) => Ray { exclude, ..*ray },
            PrimLocation::Placed(..) => Ray { exclude: NO_PRIM, ..*ray },
        }));
    }

    /// Hit that precedes the same stored prims as `after` does.
    fn after(&self, after: &Hit) -> Hit {
        match self.instanced.find(after.prim) {
            PrimLocation::Stored(prim) => Hit { prim, ..*after },
            // After the last stored prim with a lower number; if there is none, after all nearer hits.
            PrimLocation::Placed(placed, _) => match placed.before.checked_sub(1) {
                Some(prim) => Hit { prim, ..*after },
                None => Hit { prim: NO_PRIM, t: after.t.next_down(), ..*after },
            },
        }
    }
}

/// Filter that receives prim numbers of the stored tree and passes scene numbers on to another filter.
struct Numbered<'a, T: ?Sized> {
    instanced: &'a InstancedObjects,
    of: &'a T,
}

impl OccludedFilter for Numbered<'_, dyn OccludedFilter + '_> {
    fn stops(&self, ray: usize, prim: u32) -> bool {
        self.of.stops(ray, self.instanced.number(prim))
    }
}

impl IntersectFilter for Numbered<'_, dyn IntersectFilter + '_> {
    fn rejects(&self, ray: usize, prim: u32) -> bool {
        self.of.rejects(ray, self.instanced.number(prim))
    }

    fn rejects_of(&self, first: usize, rays: u32, prim: u32) -> u32 {
        self.of.rejects_of(first, rays, self.instanced.number(prim))
    }
}

impl Accel for TwoLevel<'_> {
    type Scratch = LevelScratch;

    fn scratch(&self) -> LevelScratch {
        let deepest = self.objects.iter().map(Wide::new_scratch).max_by_key(Stack::len);
        LevelScratch {
            stored: self.stored.new_scratch(),
            places: PlaceStack::default(),
            object: deepest,
            rays: Vec::new(),
            after: Vec::new(),
        }
    }

    fn first_hits<P: Probe>(&self, queries: &HitQueries, hits: &mut [Hit], scratch: &mut LevelScratch, probe: &mut P) {
        let HitQueries { rays, after, filter, .. } = *queries;
        self.renumber(rays, &mut scratch.rays);
        scratch.after.clear();
        scratch.after.extend(after.into_iter().flatten().map(|after| self.after(after)));
        let numbered = filter.map(|of| Numbered { instanced: self.instanced, of });
        let stored = HitQueries {
            rays: &scratch.rays,
            pencil: None,
            after: after.is_some().then_some(&scratch.after),
            filter: numbered.as_ref().map(|filter| filter as &dyn IntersectFilter),
        };
        self.stored.first_hits(&stored, hits, &mut scratch.stored, probe);
        let before = |i: usize, known: &Hit| Closest::before(known, Exact).passing(filter, i);
        match after {
            None => self.go_on(rays, hits, scratch, probe, |i, known| (rays[i].t_min, before(i, known))),
            Some(after) => self.go_on(rays, hits, scratch, probe, |i, known| {
                (rays[i].t_min.max(after[i].t), Next::after(&after[i], before(i, known)))
            }),
        }
    }

    fn occluded_filtered<P: Probe>(
        &self,
        rays: &[Ray],
        filter: Option<&dyn OccludedFilter>,
        occluded: &mut [bool],
        scratch: &mut LevelScratch,
        probe: &mut P,
    ) {
        self.renumber(rays, &mut scratch.rays);
        let numbered = filter.map(|of| Numbered { instanced: self.instanced, of });
        let stored = numbered.as_ref().map(|filter| filter as &dyn OccludedFilter);
        self.stored.occluded_filtered(&scratch.rays, stored, occluded, &mut scratch.stored, probe);
        for (i, (ray, occluded)) in rays.iter().zip(occluded).enumerate().filter(|(_, (_, occluded))| !**occluded) {
            let (mut query, usable) = Query::new(self.stored.shapes(), ray, ray.t_min, Occluded::by(filter, i, Exact));
            if usable {
                self.walk(&mut query, scratch, probe);
            }
            *occluded = query.goal.found;
            if *occluded {
                probe.found();
            }
        }
    }
}
