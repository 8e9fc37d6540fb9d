//! Sixteen rays side by side: rays that run alike visit the same nodes, which are read and ordered once for all.
//!
//! A node's boxes are first asked about all rays at once, by interval arithmetic over origins and reciprocals of
//! directions (S. Boulos et al., *Packet-based Whitted and Distribution Ray Tracing*, 2007). Rounding is monotonic: the
//! least and the greatest distance of the interval bound what any of the rays would compute, so what the interval misses
//! every ray misses, without a margin of its own. A box that is left is asked about each ray. At a leaf the triangles'
//! own boxes are asked about the interval, and what is left is tested against all rays at once.
//!
//! Rays that do not run alike go their own ways, one after another.

use std::marker::PhantomData;

use super::bundle::{ALL, Bundle, Numbers, RAYS};
use super::flight::FARTHEST_FIRST;
use super::node::{Child, Node, Tree};
use super::slabs::BoxMargins;
use super::walk::{Entry, ask_by_itself};
use crate::accel::probe::Outcome;
use crate::accel::query::Goal;
use crate::accel::wave::Wave;
use crate::accel::{Hit, NO_PRIM, NoProbe, Ray, Shapes};
use crate::math::shear::RaySpace;
use crate::math::simd::{Kernel, LANES, Lanewise, Pick, Simd};
use crate::math::triangle::{self, Triangle};
use crate::math::triangles::{Plane, RayRow, corners_of};

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
    /// Rays that still look for something.
    active: u32,
}

/// The best hits so far.
#[derive(Default)]
struct Found {
    t: Numbers,
    /// [`NO_PRIM`] where nothing was found; hits then count up to `t`.
    prim: [u32; RAYS],
    /// `t` in double precision, where `exact` says so: for triangles of blocks.
    t_f64: [f64; RAYS],
    exact: u32,
    /// Where those triangles are, so that nobody looks up their corners again: block and lane.
    place: [u32; RAYS],
}

/// A triangle in a block.
#[derive(Clone, Copy, Debug)]
struct Place {
    index: u32,
    lane: usize,
    prim: u32,
}

impl Place {
    /// Block and lane; there are fewer than 2²⁷ blocks.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "a lane is below 8")]
    fn packed(self) -> u32 {
        self.index * LANES as u32 + self.lane as u32
    }
}

impl<W: Wave, B: BoxMargins> Kernel for InPackets<'_, W, B> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self { tree, shapes, wave, stack, entries, .. } = self;
        let mut packet =
            Packet { tree, shapes, wave, start: 0, rays: Bundle::<B>::empty(), found: Found::default(), active: 0 };
        let count = packet.wave.rays().len();
        while packet.start < count {
            if packet.gather(s) {
                packet.trace(s, stack);
            } else {
                for i in packet.start..count.min(packet.start + RAYS) {
                    ask_by_itself::<B, _, _, _>(s, tree, shapes, packet.wave, i, entries, &mut NoProbe);
                }
            }
            packet.start += RAYS;
        }
    }
}

impl<'w, W: Wave, B: BoxMargins> Packet<'w, W, B> {
    /// The next sixteen rays, if there are as many and they run alike.
    #[inline(always)]
    fn gather<S: Simd>(&mut self, s: S) -> bool {
        let Some(rays) = self.wave.rays()[self.start..].first_chunk::<RAYS>() else { return false };
        if self.tree.extent > B::COORDINATES {
            return false;
        }
        self.found.t = self.rays.spread(s, rays);
        self.wave.adapt_t_min(self.start, &mut self.rays.t_min);
        self.rays.prepare(s, &self.found.t)
    }

    /// From the root to every leaf that any ray may hit.
    #[inline(always)]
    fn trace<S: Simd>(&mut self, s: S, stack: &mut [Branch]) {
        let tree = self.tree;
        let side = |k: usize, last: bool| {
            if (self.rays.octant >> k & 1 == 1) == last { tree.bounds.lo[k] } else { tree.bounds.hi[k] }
        };
        let (first, last) =
            ([side(0, false), side(1, false), side(2, false)], [side(0, true), side(1, true), side(2, true)]);
        self.active = self.rays.meet(s, first, last);
        if self.active == 0 {
            return self.wave.take_all(self.start, &[Hit::MISS; RAYS]);
        }
        self.found.prim = [NO_PRIM; RAYS];
        self.found.exact = 0;
        self.rays.bound(s, tree);
        let row =
            RayRow::new(s.wide(), &self.rays.origin, self.rays.common, &self.rays.dir, self.rays.z, self.rays.reach);
        let mut limit = self.rays.farthest(s);
        let mut top = 0;
        self.push(s, &tree.nodes[0], self.active, limit, stack, &mut top);
        while top > 0 {
            top -= 1;
            let branch = stack[top];
            let rays = branch.rays & self.active;
            if branch.near > limit || rays == 0 {
                continue;
            }
            let changed = match Child::unpack(branch.child) {
                Child::Node(node) => {
                    self.push(s, &tree.nodes[node as usize], rays, limit, stack, &mut top);
                    continue;
                }
                Child::Block(block, count) => self.test(s, block, count, rays, limit, &row),
                Child::Run(run) => self.test_run(run, rays),
            };
            if changed != 0 {
                self.narrow(s, changed);
                if self.active == 0 {
                    break;
                }
                limit = self.rays.farthest(s);
            }
        }
        self.answer(s);
    }

    /// Puts the children that some ray meets on the stack, the nearest last.
    #[inline(always)]
    fn push<S: Simd>(&self, s: S, node: &Node, rays: u32, limit: f32, stack: &mut [Branch], top: &mut usize) {
        let bundle = &self.rays;
        let pick = |p: Pick| s.pick(&node.planes, p);
        let first = [pick(bundle.first[0]), pick(bundle.first[1]), pick(bundle.first[2])];
        let last = [pick(bundle.last[0]), pick(bundle.last[1]), pick(bundle.last[2])];
        let (near, met) = bundle.meets_any(s, first, last, limit);
        if met == 0 {
            return;
        }
        let near = s.store(near);
        let mut order = FARTHEST_FIRST[bundle.octant % LANES][met as usize % 256];
        for _ in 0..met.count_ones() {
            let slot = (order & 7) as usize;
            order >>= 8;
            let rays = bundle.meet_child(s, node, slot) & rays;
            stack[*top] = Branch { near: near[slot], child: node.children[slot], rays };
            *top += usize::from(rays != 0);
            if rays != 0 {
                self.tree.prefetch(s, node.children[slot]);
            }
        }
    }

    /// After hits of these rays: how far they still look, if they do.
    #[inline(always)]
    fn narrow<S: Simd>(&mut self, s: S, rays: u32) {
        let wide = s.wide();
        if W::Goal::ANY {
            self.active &= !rays;
            wide.put(rays, wide.splat(f32::NEG_INFINITY), &mut self.rays.limit);
        } else {
            let limit = Bundle::<B>::widened(s, &self.found.t);
            wide.put(rays, wide.load(&limit), &mut self.rays.limit);
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
        limit: f32,
        row: &RayRow<S::Wide, RAYS>,
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
        let (_, met) = self.rays.meets_any(s, first, last, limit);
        let mut lanes = met & ((1 << count) - 1);
        let mut changed = 0;
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize % LANES;
            lanes &= lanes - 1;
            let corners = corners_of(&block.corners, lane);
            let mut verdicts = row.verdicts(s.wide(), &corners);
            if verdicts.unsure & rays != 0 {
                verdicts = row.closer_verdicts(s.wide(), &corners);
            }
            if (verdicts.hit | verdicts.unsure) & rays != 0 {
                let place = Place { index, lane, prim: block.prims[lane] };
                let hit = self.meet(s, place, &corners, verdicts.hit & rays, verdicts.unsure & rays);
                changed |= hit;
                if W::Goal::ANY {
                    rays &= !hit;
                }
            }
        }
        changed
    }

    /// Offers the hits of rays that meet a triangle for certain, and of those that may; which of them are the best now.
    #[inline(always)]
    fn meet<S: Simd>(&mut self, s: S, place: Place, corners: &Triangle, certain: u32, unsure: u32) -> u32 {
        let (s, prim) = (s.wide(), place.prim);
        let left_out = s.find_word(prim, &self.rays.exclude);
        if !self.wave.goal(self.start).wants(self.shapes, prim) {
            return 0;
        }
        let met = Plane::of(corners).meet(s, &self.rays.origin, &self.rays.dir, &self.rays.bounds);
        let known = certain & met.sure & !left_out;
        let (t_min, best) = (s.load(&self.rays.t_min), s.load(&self.found.t));
        let better = s.less(t_min, met.t) & s.less(met.t, best) & known;
        s.put(better, met.t, &mut self.found.t);
        s.put_f64(better, met.t_f64, &mut self.found.t_f64);
        s.put_word(better, prim, &mut self.found.prim);
        s.put_word(better, place.packed(), &mut self.found.place);
        self.found.exact |= better;
        // The scalar form decides about equal distances, and about what lanes cannot.
        let equal = s.at_most(t_min, met.t) & s.at_most(met.t, best) & known & !better;
        let mut open = equal | (certain & !met.sure | unsure) & !left_out;
        let mut changed = better;
        while open != 0 {
            let ray = open.trailing_zeros() as usize % RAYS;
            open &= open - 1;
            changed |= self.meet_exactly(ray, place, corners, certain >> ray & 1 == 1);
        }
        changed
    }

    /// Offers the hit of one ray by the scalar form.
    #[cold]
    #[inline(never)]
    fn meet_exactly(&mut self, ray: usize, place: Place, corners: &Triangle, certain: bool) -> u32 {
        let space = self.space(ray);
        if !certain && !triangle::is_hit(&space, corners) {
            return 0;
        }
        let meeting = triangle::meet(&space, corners);
        let taken = self.offer(ray, place.prim, meeting.t, meeting.t_f64);
        if taken != 0 {
            self.found.place[ray] = place.packed();
        }
        taken
    }

    /// Offers a hit in the order of all hits: by distance and prim, behind the one after which the search goes on.
    fn offer(&mut self, ray: usize, prim: u32, t: f32, t_f64: f64) -> u32 {
        let behind = |goal: &mut W::Goal| goal.offer(t, prim) == Outcome::Hit;
        let inside = self.rays.t_min[ray] <= t && (t, prim) < (self.found.t[ray], self.found.prim[ray]);
        if !inside || !behind(&mut self.wave.goal(self.start + ray)) {
            return 0;
        }
        (self.found.t[ray], self.found.t_f64[ray], self.found.prim[ray]) = (t, t_f64, prim);
        let bit = 1 << ray;
        self.found.exact = self.found.exact & !bit | u32::from(!t_f64.is_nan()) << ray;
        bit
    }

    /// Tests the prims of a run, one ray after another.
    #[cold]
    #[inline(never)]
    fn test_run(&mut self, run: u32, rays: u32) -> u32 {
        let mut changed = 0;
        for &prim in self.tree.run(run) {
            if !self.wave.goal(self.start).wants(self.shapes, prim) {
                continue;
            }
            let mut open = rays;
            while open != 0 {
                let ray = open.trailing_zeros() as usize % RAYS;
                open &= open - 1;
                if self.rays.exclude[ray] != prim {
                    let space = self.space(ray);
                    let distances = match self.shapes.triangles.get(prim as usize) {
                        Some(&corners) => {
                            [triangle::intersect(&space, &self.shapes.corners(corners)).unwrap_or(f32::NAN), f32::NAN]
                        }
                        None => self.shapes.other_distances(prim, &space, self.rays.t_min[ray] >= 0.0),
                    };
                    changed |= distances.into_iter().fold(0, |c, t| c | self.offer(ray, prim, t, f64::NAN));
                }
            }
        }
        changed
    }

    /// A ray in sheared space.
    fn space(&self, ray: usize) -> RaySpace {
        let Ray { origin, dir, .. } = self.wave.rays()[self.start + ray];
        RaySpace::checked(origin, dir).0
    }

    /// Gives the answers; weights of hits with the same triangle are found together.
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
        let missed = wide.find_word(NO_PRIM, &found.prim);
        let mut t = found.t;
        wide.put(missed, wide.splat(f32::INFINITY), &mut t);
        let (mut u, mut v) = ([0.0; RAYS], [0.0; RAYS]);
        let mut left = !missed & ALL;
        while left != 0 {
            let ray = left.trailing_zeros() as usize % RAYS;
            if found.exact >> ray & 1 == 0 {
                (u[ray], v[ray]) = self.shapes.barycentrics(found.prim[ray], &self.space(ray));
                left &= left - 1;
                continue;
            }
            let place = found.place[ray];
            let mine = wide.find_word(place, &found.place) & found.exact & !missed;
            left &= !mine;
            let block = &self.tree.blocks[place as usize / LANES];
            let plane = Plane::of(&corners_of(&block.corners, place as usize % LANES));
            let weights = plane.barycentrics(wide, &self.rays.origin, &self.rays.dir, &found.t_f64);
            wide.put(mine, wide.load(&weights[0]), &mut u);
            wide.put(mine, wide.load(&weights[1]), &mut v);
        }
        let mut hits = [Hit::MISS; RAYS];
        for half in 0..2 {
            let eight = |row: &Numbers| s.load(&row.as_chunks().0[half]);
            let prim = s.load(&found.prim.as_chunks::<LANES>().0[half].map(f32::from_bits));
            let rows = s.rows([eight(&t), eight(&u), eight(&v), prim]);
            for lane in 0..LANES {
                let [t, u, v, prim] = rows[lane];
                hits[LANES * half + lane] = Hit { t, u, v, prim: prim.to_bits() };
            }
        }
        self.wave.take_all(start, &hits);
    }
}
