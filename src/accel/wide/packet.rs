//! Sixteen rays side by side: rays that run alike visit the same nodes, which are read and ordered once for all.
//!
//! A node's boxes are first asked about all rays at once, by a hull of origins and reciprocals of directions (after
//! S. Boulos et al., *Packet-based Whitted and Distribution Ray Tracing*, 2007); of several boxes that are left each is asked
//! about each ray. At a leaf the triangles' own boxes are asked about the hull, and what is left is tested against all rays
//! at once. Best hits are known by intervals, as in `best`; exact distances are found at the end, those of all rays
//! together.
//!
//! A few rays of sixteen that do not run as the others do go their own ways, one after another, and so do all where too few
//! run alike.

use std::marker::PhantomData;

use super::alone::Lone;
use super::best::{Place, decide};
use super::bundle::{ALL, Bundle, Numbers, RAYS};
use super::flight::FARTHEST_FIRST;
use super::node::{Child, Node, Tree};
use super::slabs::BoxMargins;
use super::walk::Entry;
use crate::accel::query::Goal;
use crate::accel::wave::Wave;
use crate::accel::{Hit, NO_PRIM, Ray, Shapes};
use crate::math::meetings::{Meetings, Plane, meet};
use crate::math::shear::RaySpace;
use crate::math::sight::RowSight;
use crate::math::simd::{Kernel, LANES, Lanewise, Simd};
use crate::math::triangle;
use crate::math::triangles::Verdicts;

/// Rays that run alike from which on they are a packet, without the others.
const ENOUGH: u32 = 8;

/// So many rays before they are taken they are fetched: a processor that foretells what is read does not see beyond a page.
const AHEAD: usize = 8 * RAYS;

/// A child still to be visited.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Branch {
    /// No ray enters its box before this distance.
    near: f32,
    child: u32,
    /// A bit for each ray that meets its box.
    rays: u32,
}

/// A wave of rays.
pub(super) struct InPackets<'w, W, B> {
    pub tree: &'w Tree,
    pub shapes: &'w Shapes,
    pub wave: &'w mut W,
    pub stack: &'w mut [Branch],
    /// For rays that go by themselves.
    pub entries: &'w mut [Entry],
    pub margins: PhantomData<B>,
}

/// Sixteen rays that run alike.
struct Packet<'w, W, B> {
    tree: &'w Tree,
    shapes: &'w Shapes,
    wave: &'w mut W,
    /// Number of its first ray.
    start: usize,
    rays: Bundle<B>,
    found: Found,
    /// Where their ranges end.
    t_max: Numbers,
    /// Rays that still look for something.
    active: u32,
}

/// What was found so far.
#[derive(Default)]
struct Found {
    /// [`NO_PRIM`] where nothing was found.
    prim: [u32; RAYS],
    /// Where that is, block and lane, so that nobody looks up its corners again.
    place: [u32; RAYS],
}

/// How far the rays look, in lanes: what every test changes and the next one needs.
struct Reach<S: Simd> {
    /// The exact distances of the best hits lie between these, as in `best`. Without a hit: infinite, and the end of the
    /// ray's range.
    low: Wide<S>,
    high: Wide<S>,
    /// Boxes are entered up to here.
    limit: Wide<S>,
    /// The greatest of these.
    farthest: f32,
}

/// A number of each ray, in lanes.
type Wide<S> = <<S as Simd>::Wide as Lanewise<RAYS>>::Lanes;

impl<W: Wave, B: BoxMargins> Kernel for InPackets<'_, W, B> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self { tree, shapes, wave, stack, entries, .. } = self;
        let mut packet = Packet {
            tree,
            shapes,
            wave,
            start: 0,
            rays: Bundle::<B>::empty(),
            found: Found::default(),
            t_max: [0.0; RAYS],
            active: 0,
        };
        let (count, mut lone) = (packet.wave.rays().len(), Lone::default());
        while packet.start < count {
            let alike = packet.gather(s);
            if alike != 0 {
                packet.trace(s, alike, stack);
            }
            let mut apart = ALL & !alike;
            for start in (packet.start..count.min(packet.start + RAYS)).step_by(LANES) {
                if apart != 0 {
                    lone.trace::<B, _, _>(s, tree, shapes, packet.wave, (start, apart), entries);
                }
                apart >>= LANES;
            }
            packet.start += RAYS;
        }
        lone.finish(s, packet.wave);
    }
}

impl<'w, W: Wave, B: BoxMargins> Packet<'w, W, B> {
    /// Takes the next sixteen rays, if there are as many; those that run alike, if they are worth a packet, or none.
    #[inline(always)]
    fn gather<S: Simd>(&mut self, s: S) -> u32 {
        let rays = &self.wave.rays()[self.start..];
        if let Some(later) = rays.get(AHEAD..AHEAD + RAYS) {
            s.prefetch(later);
        }
        let Some(rays) = rays.first_chunk::<RAYS>() else { return 0 };
        self.t_max = self.rays.spread(s, rays);
        self.wave.adapt_t_min(self.start, &mut self.rays.t_min);
        let alike = self.rays.prepare(s, self.tree, &self.t_max);
        match alike.count_ones() {
            16 => ALL,
            ENOUGH..16 => {
                self.rays.fill(s, alike, &mut self.t_max);
                alike
            }
            _ => 0,
        }
    }

    /// From the root to every leaf that any of these rays may hit. The others get an answer, too, which means nothing.
    #[inline(always)]
    fn trace<S: Simd>(&mut self, s: S, alike: u32, stack: &mut [Branch]) {
        let tree = self.tree;
        let side = |k: usize, last: bool| {
            if (self.rays.octant >> k & 1 == 1) == last { tree.bounds.lo[k] } else { tree.bounds.hi[k] }
        };
        let (first, last) =
            ([side(0, false), side(1, false), side(2, false)], [side(0, true), side(1, true), side(2, true)]);
        let wide = s.wide();
        let high = wide.load(&self.t_max);
        let limit = B::widened_lanes(wide, high);
        self.active = self.rays.meet(wide, first, last, limit) & alike;
        if self.active == 0 {
            return (self.start..self.start + RAYS).for_each(|i| self.wave.take(i, Hit::MISS));
        }
        self.found.prim = [NO_PRIM; RAYS];
        self.rays.bound(s, tree);
        let sight = RowSight::new(wide, &self.rays.origin, self.rays.common, &self.rays.dir, self.rays.z);
        let low = wide.splat(f32::INFINITY);
        let limit = wide.choose(self.active, limit, wide.splat(f32::NEG_INFINITY));
        let mut reach: Reach<S> = Reach { low, high, limit, farthest: wide.greatest(limit) };
        let (mut top, mut branch) = (0, Branch { near: 0.0, child: 0, rays: self.active });
        loop {
            let mut nearer = false;
            if Child::is_leaf(branch.child) {
                self.visit(s, branch, &mut reach, &sight);
                if W::Goal::ANY && self.active == 0 {
                    break;
                }
            } else {
                let below = top;
                self.push(s, &tree.nodes[branch.child as usize], branch.rays, &reach, stack, &mut top);
                nearer = top > below;
            }
            // Those that meet the nearest child were just found; rays that need no more have no limit above zero.
            if !nearer && !drop_unneeded(s, &reach, stack, &mut top) {
                break;
            }
            top -= 1;
            branch = stack[top];
        }
        self.answer(s);
    }

    /// Tests a leaf.
    #[inline(always)]
    fn visit<S: Simd>(&mut self, s: S, branch: Branch, reach: &mut Reach<S>, sight: &RowSight<S::Wide, RAYS>) {
        let wide = s.wide();
        let (block, count) = Child::block(branch.child);
        let changed = self.test(s, block, count, branch.rays, reach, sight);
        if changed == 0 {
            return;
        }
        if W::Goal::ANY {
            self.active &= !changed;
            reach.limit = wide.choose(changed, wide.splat(f32::NEG_INFINITY), reach.limit);
        } else {
            reach.limit = wide.choose(changed, B::widened_lanes(wide, reach.high), reach.limit);
        }
        reach.farthest = wide.greatest(reach.limit);
    }

    /// Puts the children that some ray meets on the stack, the nearest last.
    #[inline(always)]
    fn push<S: Simd>(&self, s: S, node: &Node, rays: u32, reach: &Reach<S>, stack: &mut [Branch], top: &mut usize) {
        let bundle = &self.rays;
        let (near, met) = bundle.meets_any_child(s, node, reach.farthest);
        if met == 0 {
            return;
        }
        let (near, only) = (s.store(near), met.is_power_of_two());
        let mut order = FARTHEST_FIRST[bundle.octant % LANES][met as usize % 256];
        for _ in 0..met.count_ones() {
            let slot = (order & 7) as usize;
            order >>= 8;
            // The only one is visited for the rays that visit the node: mostly there are some for it.
            let met = if only { rays } else { bundle.meet_child(s.wide(), node, slot, reach.limit) & rays };
            stack[*top] = Branch { near: near[slot], child: node.children[slot], rays: met };
            *top += usize::from(met != 0);
        }
    }

    /// Tests the triangles of a block, and tells which rays have new hits.
    #[inline(always)]
    fn test<S: Simd>(
        &mut self,
        s: S,
        index: u32,
        count: u32,
        mut rays: u32,
        reach: &mut Reach<S>,
        sight: &RowSight<S::Wide, RAYS>,
    ) -> u32 {
        let tree = self.tree;
        let block = &tree.blocks[index as usize];
        let [a, b, c] = &block.corners;
        let zero = s.splat(0.0);
        let (mut first, mut last) = ([zero; 3], [zero; 3]);
        for k in 0..3 {
            let (a, b, c) = (s.load(&a[k]), s.load(&b[k]), s.load(&c[k]));
            let (low, high) = (s.smaller(a, s.smaller(b, c)), s.greater(a, s.greater(b, c)));
            (first[k], last[k]) = if self.rays.octant >> k & 1 == 1 { (high, low) } else { (low, high) };
        }
        let (_, met) = self.rays.meets_any(s, first, last, reach.farthest);
        let mut lanes = met & ((1 << count) - 1);
        let mut changed = 0;
        if lanes == 0 {
            return 0;
        }
        let ready = sight.ready(s, &block.corners);
        while lanes != 0 {
            let lane = lanes.trailing_zeros();
            lanes &= lanes - 1;
            let look = sight.look(s.wide(), &ready, lane as usize);
            if (look.verdicts.hit | look.verdicts.unsure) & rays != 0 {
                let place = Place { block: index, lane, prim: block.prims[lane as usize % LANES] };
                let between = sight.distances(s.wide(), &look);
                let hit = self.take(s, place, rays, look.verdicts, between, reach);
                changed |= hit;
                if W::Goal::ANY {
                    rays &= !hit;
                }
            }
        }
        changed
    }

    /// Offers the hits of rays with a triangle, between two distances where they are certain; which of them are the best
    /// now.
    #[inline(always)]
    fn take<S: Simd>(
        &mut self,
        s: S,
        place: Place,
        rays: u32,
        verdicts: Verdicts,
        [low, high]: [Wide<S>; 2],
        reach: &mut Reach<S>,
    ) -> u32 {
        let (s, prim) = (s.wide(), place.prim);
        let rays = rays & !s.find_word(prim, &self.rays.exclude);
        if !self.wave.goal(self.start).wants(self.shapes, prim) {
            return 0;
        }
        let (hit, unsure) = (verdicts.hit & rays, verdicts.unsure & rays);
        let t_min = s.load(&self.rays.t_min);
        let better = s.less(t_min, low) & s.less(high, reach.low) & s.at_most(high, reach.high) & hit;
        // The exact test decides about distances that may be equal, and about what lanes cannot tell.
        let in_time = s.at_most(low, reach.high) & s.at_most(t_min, high);
        let mut open = hit & in_time & !better | unsure;
        (reach.low, reach.high) = (s.choose(better, low, reach.low), s.choose(better, high, reach.high));
        s.put_word(better, prim, &mut self.found.prim);
        s.put_word(better, place.packed(), &mut self.found.place);
        let mut changed = better;
        if open != 0 {
            let (mut low, mut high) = (s.store(reach.low), s.store(reach.high));
            while open != 0 {
                let ray = open.trailing_zeros() as usize % RAYS;
                open &= open - 1;
                let (i, best, certain) = (self.start + ray, self.found.prim[ray], hit >> ray & 1 == 1);
                if let Some((t, prim)) = decide(self.shapes, self.wave, i, best, place.prim, certain) {
                    (low[ray], high[ray]) = (t, t);
                    if prim == place.prim {
                        (self.found.prim[ray], self.found.place[ray]) = (prim, place.packed());
                    }
                    changed |= 1 << ray;
                }
            }
            (reach.low, reach.high) = (s.load(&low), s.load(&high));
        }
        changed
    }

    /// Where the rays of a mask meet what they hit.
    #[inline(always)]
    fn meet_each<S: Lanewise<RAYS>>(&self, s: S, mut left: u32) -> Meetings<S::Lanes> {
        let mut corners = [[s.splat(0.0); 3]; 3];
        while left != 0 {
            let place = self.found.place[left.trailing_zeros() as usize % RAYS];
            let mine = s.find_word(place, &self.found.place);
            left &= !mine;
            let (rows, lane) = Place::rows(self.tree, place);
            for (corner, rows) in corners.iter_mut().zip(rows) {
                for k in 0..3 {
                    corner[k] = s.choose(mine, s.splat(rows[k][lane]), corner[k]);
                }
            }
        }
        let [o, d] = [&self.rays.origin, &self.rays.dir];
        meet(s, [s.load(&o[0]), s.load(&o[1]), s.load(&o[2])], [s.load(&d[0]), s.load(&d[1]), s.load(&d[2])], corners)
    }

    /// Gives the answers, all distances and weights together.
    #[inline(always)]
    fn answer<S: Simd>(&mut self, s: S) {
        let (start, found) = (self.start, &self.found);
        if W::Goal::ANY {
            for (ray, &prim) in found.prim.iter().enumerate() {
                self.wave.take(start + ray, Hit { prim, ..Hit::MISS });
            }
            return;
        }
        let wide = s.wide();
        let hit = !wide.find_word(NO_PRIM, &found.prim) & ALL;
        if hit == 0 {
            return (start..start + RAYS).for_each(|i| self.wave.take(i, Hit::MISS));
        }
        let (mut unsure, zero) = (hit, wide.splat(0.0));
        let place = found.place[hit.trailing_zeros() as usize % RAYS];
        let Meetings { t, weights: [u, v], sure } = if hit & !wide.find_word(place, &found.place) == 0 {
            let bounds = self.rays.row_bounds();
            Plane::of(&Place::corners(self.tree, place)).meet(wide, &self.rays.origin, &self.rays.dir, &bounds)
        } else {
            self.meet_each(wide, hit)
        };
        let t = wide.choose(unsure, t, wide.splat(f32::INFINITY));
        let (mut t, mut u, mut v) =
            (wide.store(t), wide.store(wide.choose(unsure, u, zero)), wide.store(wide.choose(unsure, v, zero)));
        unsure &= !sure;
        while unsure != 0 {
            let ray = unsure.trailing_zeros() as usize % RAYS;
            unsure &= unsure - 1;
            let Ray { origin, dir, .. } = self.wave.rays()[start + ray];
            let corners = Place::corners(self.tree, found.place[ray]);
            (t[ray], u[ray], v[ray]) = triangle::place(&RaySpace::checked(origin, dir).0, &corners);
        }
        for half in 0..2 {
            let eight = |row: &Numbers| s.load(&row.as_chunks().0[half]);
            let prim = s.load(&found.prim.as_chunks::<LANES>().0[half].map(f32::from_bits));
            let rows = s.rows([eight(&t), eight(&u), eight(&v), prim]);
            for (lane, [t, u, v, prim]) in rows.into_iter().enumerate() {
                self.wave.take(start + LANES * half + lane, Hit { t, u, v, prim: prim.to_bits() });
            }
        }
    }
}

/// Takes off the stack what no ray needs any more, and tells whether anything is left: on top of it a child, for the rays that
/// need it.
#[inline(always)]
fn drop_unneeded<S: Simd>(s: S, reach: &Reach<S>, stack: &mut [Branch], top: &mut usize) -> bool {
    let wide = s.wide();
    while *top > 0 {
        let branch = &mut stack[*top - 1];
        branch.rays &= wide.at_most(wide.splat(branch.near), reach.limit);
        if branch.rays != 0 {
            return true;
        }
        *top -= 1;
    }
    false
}
