//! Packets of sixteen or thirty-two rays: rays that run alike visit the same nodes, which are loaded and ordered once for
//! all.
//!
//! A node's boxes are first tested against all rays at once, by an interval ray (`interval_ray`) of origins and reciprocal
//! directions (after S. Boulos et al., *Packet-based Whitted and Distribution Ray Tracing*, 2007); if several boxes remain,
//! each is tested against each ray. At a leaf the boxes of single triangles are tested against the interval, and each
//! remaining triangle against all rays at once. Best hits are known by intervals, as in `best`; exact distances are computed
//! at the end, for all rays together. Data that rays from one origin share for a block are kept for the next packets
//! (`block_cache`).
//!
//! A packet waits mostly for itself: each test decides which is next. So where there are enough registers, thirty-two rays
//! take little more time than sixteen as long as they stay together; where less than half of them visit what the packet
//! visits, the next packets are narrow.
//!
//! A few rays that diverge from their packet are traced one by one, and so are all rays where too few run alike.

use std::marker::PhantomData;

use super::best::{Best, TriangleSlot, decide};
use super::block_cache::BlockCache;
use super::entry_point::{EntryPoint, GROUP, State};
use super::flight::FARTHEST_FIRST;
use super::node::{Block, Child, Node, Tree};
use super::packet_rays::{PacketRays, all};
use super::single::SingleRays;
use super::slabs::BoxMargins;
use super::walk::Entry;
use crate::accel::filter::those;
use crate::accel::query::Goal;
use crate::accel::query_batch::{Pencil, QueryBatch};
use crate::accel::{Hit, NO_PRIM, Ray, Shapes};
use crate::math::Vec3;
use crate::math::fan::Fan;
use crate::math::meetings::{Meetings, Plane, meet};
use crate::math::shear::RaySpace;
use crate::math::sight::{RowSight, Rows};
use crate::math::simd::{BROAD, Kernel, LANES, Lanewise, Simd, WIDE};
use crate::math::triangle;
use crate::math::triangles::Verdicts;

/// Prefetch distance, in rays: the hardware prefetcher does not cross page boundaries.
const AHEAD: usize = 128;

/// Fewest rays of sixteen that run alike and make a packet, without the others.
const ENOUGH: u32 = 8;

/// The same for packets of thirty-two: rays that diverge may make a packet of their own.
const ENOUGH_BROAD: u32 = 24;

/// Number of narrow packets after a broad one with low occupancy; doubled with each further one.
const PATIENCE: usize = 8;

/// A child still to be visited.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct StackEntry {
    /// Lower bound of the distance at which any ray enters the box.
    near: f32,
    child: u32,
    /// Bit mask of the rays that meet the box.
    rays: u32,
}

/// A batch of rays to be traced in packets.
pub(super) struct InPackets<'w, W, B> {
    pub tree: &'w Tree<'w>,
    pub shapes: &'w Shapes,
    pub batch: &'w mut W,
    pub stack: &'w mut [StackEntry],
    pub cache: &'w mut BlockCache,
    /// Stack for rays that are traced alone.
    pub entries: &'w mut [Entry],
    pub margins: PhantomData<B>,
}

/// Tree, memory and batch that all packets share.
struct PacketTrace<'w, W> {
    tree: &'w Tree<'w>,
    shapes: &'w Shapes,
    batch: &'w mut W,
    stack: &'w mut [StackEntry],
    cache: &'w mut BlockCache,
    entries: &'w mut [Entry],
    entry_point: EntryPoint,
    single: SingleRays,
}

/// Packet of `N` rays that run alike.
#[repr(C, align(64))]
struct Packet<B, const N: usize> {
    rays: PacketRays<B, N>,
    found: Found<N>,
    /// End of each ray's range.
    t_max: [f32; N],
    /// Index of the first ray in the batch.
    start: usize,
    /// Bit mask of the rays that are not answered yet.
    active: u32,
}

/// Best hits so far.
#[repr(C, align(64))]
struct Found<const N: usize> {
    /// Prim that is hit, or [`NO_PRIM`].
    prim: [u32; N],
    /// Packed block and lane of the hit, so that its corners are not looked up again.
    place: [u32; N],
}

/// Reach of the rays, in lanes: the state that every test updates and the next one needs.
struct Reach<T: Lanewise<N>, const N: usize> {
    /// Bounds of the exact distances of the best hits, as in `best`. Without a hit: infinite, and the end of the ray's range.
    low: T::Lanes,
    high: T::Lanes,
    /// Distances up to which boxes are entered.
    limit: T::Lanes,
    /// Largest of `limit`.
    farthest: f32,
}

/// View of triangles by the rays.
enum Seen<T: Lanewise<N>, const N: usize> {
    /// All rays from one origin.
    Together(Fan<T, N>),
    Apart(RowSight<T, N>),
}

/// Average number of rays per visit of a packet.
#[derive(Clone, Copy, Debug, Default)]
struct Occupancy {
    visits: u32,
    /// Rays over all visits, summed.
    rays: u32,
}

impl<W: QueryBatch, B: BoxMargins> Kernel for InPackets<'_, W, B> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self { tree, shapes, batch, stack, cache, entries, .. } = self;
        let (mut narrow, mut broad) = (Packet::<B, WIDE>::empty(), Packet::<B, BROAD>::empty());
        if let Some(Pencil { origin, .. }) = batch.pencil() {
            broad.start_at(origin);
            narrow.start_at(origin);
        }
        cache.clear();
        let (entry_point, single) = (EntryPoint::new(), SingleRays::default());
        let mut trace = PacketTrace { tree, shapes, batch, stack, cache, entries, entry_point, single };
        let (count, mut start) = (trace.batch.rays().len(), 0);
        let (mut apart, mut patience) = (0_usize, PATIENCE);
        while start < count {
            if let Some(pencil) = trace.batch.pencil()
                && trace.entry_point.is_passed(start)
            {
                trace.entry_point.find::<B, _>(s, tree, &pencil, start);
                if trace.entry_point.state == State::Closed {
                    trace.batch.take_all(start, &[Hit::MISS; GROUP]);
                    start += GROUP;
                    continue;
                }
            }
            if S::BROAD_FITS && apart == 0 && start + BROAD <= count {
                let alike = broad.gather(s, s.broad(), &trace, start);
                if alike.count_ones() >= ENOUGH_BROAD {
                    let occupancy = broad.pass(s, s.broad(), &mut trace, alike);
                    (apart, patience) =
                        if occupancy.is_close::<BROAD>() { (0, PATIENCE) } else { (patience, 2 * patience) };
                    start += BROAD;
                    continue;
                }
                apart = BROAD / WIDE;
            }
            let alike = narrow.gather(s, s.wide(), &trace, start);
            narrow.pass(s, s.wide(), &mut trace, if alike.count_ones() >= ENOUGH { alike } else { 0 });
            (start, apart) = (start + WIDE, apart.saturating_sub(1));
        }
        trace.single.finish(s, trace.batch);
    }
}

impl Occupancy {
    /// Whether on average at least half of `N` rays take part in a visit: then they are faster together than in halves.
    fn is_close<const N: usize>(self) -> bool {
        2 * u64::from(self.rays) >= u64::from(self.visits) * N as u64
    }
}

impl<B: BoxMargins, const N: usize> Packet<B, N> {
    fn empty() -> Self {
        Self {
            start: 0,
            rays: PacketRays::empty(),
            found: Found { prim: [NO_PRIM; N], place: [0; N] },
            t_max: [0.0; N],
            active: 0,
        }
    }

    /// Prepares for rays of a pencil only.
    fn start_at(&mut self, origin: Vec3) {
        self.rays.start_at(origin);
        self.t_max = [f32::MAX; N];
    }

    /// Answers the gathered rays, or as many as there are: those in `alike` as a packet, the others one by one.
    #[inline(always)]
    fn pass<S: Simd, T: Lanewise<N>, W: QueryBatch>(
        &mut self,
        s: S,
        wide: T,
        trace: &mut PacketTrace<W>,
        alike: u32,
    ) -> Occupancy {
        let occupancy = if alike == 0 { Occupancy::default() } else { self.trace(s, wide, alike, trace) };
        let (mut apart, count) = (all::<N>() & !alike, trace.batch.rays().len());
        for start in (self.start..count.min(self.start + N)).step_by(LANES) {
            if apart & all::<LANES>() != 0 {
                trace.single.trace::<B, _, _>(s, trace.tree, trace.shapes, trace.batch, (start, apart), trace.entries);
            }
            apart >>= LANES;
        }
        occupancy
    }

    /// Loads the rays from `start` on, if there are enough, and returns a mask of those that run alike.
    #[inline(always)]
    fn gather<S: Simd, T: Lanewise<N>, W: QueryBatch>(
        &mut self,
        s: S,
        wide: T,
        trace: &PacketTrace<W>,
        start: usize,
    ) -> u32 {
        self.start = start;
        if let Some(Pencil { dirs, .. }) = trace.batch.pencil() {
            return if self.rays.turn(dirs, start) { self.rays.prepare(wide, trace.tree, &self.t_max) } else { 0 };
        }
        let rays = &trace.batch.rays()[start..];
        if let Some(later) = rays.get(AHEAD..AHEAD + N) {
            s.prefetch(later);
        }
        let Some(rays) = rays.first_chunk::<N>() else { return 0 };
        self.t_max = self.rays.spread(s, wide, rays);
        trace.batch.adapt_t_min(start, &mut self.rays.t_min);
        self.rays.prepare(wide, trace.tree, &self.t_max)
    }

    /// Traverses from the root to every leaf that any ray in `alike` may hit. The other rays get meaningless answers.
    #[inline(always)]
    fn trace<S: Simd, T: Lanewise<N>, W: QueryBatch>(
        &mut self,
        s: S,
        wide: T,
        alike: u32,
        trace: &mut PacketTrace<W>,
    ) -> Occupancy {
        let (tree, mut occupancy) = (trace.tree, Occupancy::default());
        if alike != all::<N>() {
            self.rays.fill(wide, alike, &mut self.t_max);
        }
        let side = |k: usize, last: bool| {
            if (self.rays.octant >> k & 1 == 1) == last { tree.bounds.lo[k] } else { tree.bounds.hi[k] }
        };
        let (first, last) =
            ([side(0, false), side(1, false), side(2, false)], [side(0, true), side(1, true), side(2, true)]);
        let high = wide.load(&self.t_max);
        let limit = B::widened_lanes(wide, high);
        self.active = self.rays.meet(wide, first, last, limit) & alike;
        if self.active == 0 {
            trace.batch.take_all(self.start, &[Hit::MISS; N]);
            return occupancy;
        }
        self.found.prim = [NO_PRIM; N];
        self.rays.bound(wide, tree);
        let (rays, per_length) = (&self.rays, self.rays.per_length());
        let sight = match rays.common {
            Some(from) => {
                trace.cache.set_viewpoint((from, rays.z, rays.octant));
                Seen::Together(Fan::new(wide, from, &rays.dir, rays.z, per_length))
            }
            None => Seen::Apart(RowSight::new(wide, &rays.origin, &rays.dir, rays.z, per_length)),
        };
        let low = wide.splat(f32::INFINITY);
        let limit = wide.choose(self.active, limit, wide.splat(f32::NEG_INFINITY));
        let mut reach: Reach<T, N> = Reach { low, high, limit, farthest: wide.latest(limit) };
        let (mut top, mut branch) =
            (0, StackEntry { near: 0.0, child: trace.entry_point.of(self.start, N), rays: self.active });
        loop {
            let mut nearer = false;
            occupancy.visits += 1;
            occupancy.rays += branch.rays.count_ones();
            if Child::is_leaf(branch.child) {
                self.visit(s, wide, trace, branch, &mut reach, &sight);
                if W::Goal::ANY && self.active == 0 {
                    break;
                }
            } else {
                let below = top;
                // The entry point is not a node of the tree.
                let node = tree.nodes.get(branch.child as usize).unwrap_or(&trace.entry_point.node);
                self.push(s, wide, (tree, node), branch.rays, &reach, (trace.stack, &mut top));
                nearer = top > below;
            }
            // Rays that meet the nearest child were just found, and answered rays have no limit above zero.
            if !nearer && !drop_unneeded(wide, &reach, trace.stack, &mut top) {
                break;
            }
            top -= 1;
            branch = trace.stack[top];
        }
        self.answer(s, wide, trace);
        occupancy
    }

    /// Visits a leaf and tests its prims.
    #[inline(always)]
    fn visit<S: Simd, T: Lanewise<N>, W: QueryBatch>(
        &mut self,
        s: S,
        wide: T,
        trace: &mut PacketTrace<W>,
        branch: StackEntry,
        reach: &mut Reach<T, N>,
        sight: &Seen<T, N>,
    ) {
        let changed = self.test(s, wide, trace, branch, reach, sight);
        if changed == 0 {
            return;
        }
        if W::Goal::ANY {
            self.active &= !changed;
            reach.limit = wide.choose(changed, wide.splat(f32::NEG_INFINITY), reach.limit);
        } else {
            reach.limit = wide.choose(changed, B::widened_lanes(wide, reach.high), reach.limit);
        }
        reach.farthest = wide.latest(reach.limit);
    }

    /// Pushes the children that any ray meets, the nearest last.
    #[inline(always)]
    fn push<S: Simd, T: Lanewise<N>>(
        &self,
        s: S,
        wide: T,
        (tree, node): (&Tree, &Node),
        rays: u32,
        reach: &Reach<T, N>,
        (stack, top): (&mut [StackEntry], &mut usize),
    ) {
        let bundle = &self.rays;
        let (near, met) = bundle.meets_any(s, &node.planes, reach.farthest);
        if met == 0 {
            return;
        }
        let (near, only) = (s.store(near), met.is_power_of_two());
        let mut order = FARTHEST_FIRST[bundle.octant % LANES][met as usize % 256];
        for _ in 0..met.count_ones() {
            let slot = (order & 7) as usize;
            order >>= 4;
            // Prefetched while the box is tested against the rays.
            let child = node.children[slot];
            let (at, block) = Child::either(child);
            s.prefetch_either(Child::is_leaf(child), (tree.blocks, block), (tree.nodes, at));
            // A single child is visited by all rays that visit the node: mostly some of them meet it.
            let met = if only { rays } else { bundle.meet_child(wide, node, slot, reach.limit) & rays };
            stack[*top] = StackEntry { near: near[slot], child, rays: met };
            *top += usize::from(met != 0);
        }
    }

    /// Tests the triangles of a block, and returns a mask of the rays with new hits.
    #[inline(always)]
    fn test<S: Simd, T: Lanewise<N>, W: QueryBatch>(
        &mut self,
        s: S,
        wide: T,
        trace: &mut PacketTrace<W>,
        branch: StackEntry,
        reach: &mut Reach<T, N>,
        sight: &Seen<T, N>,
    ) -> u32 {
        let (index, count) = Child::block(branch.child);
        let block = &trace.tree.blocks[index as usize];
        let used = (1 << count) - 1;
        match sight {
            Seen::Together(fan) => {
                let place = trace.cache.place(s, index, block, fan);
                let kept = trace.cache.at(place);
                let lanes = self.rays.meets_any(s, &kept.planes, reach.farthest).1 & used;
                self.test_each(wide, trace, (block, index, lanes), branch.rays, reach, (fan, &kept.ready))
            }
            Seen::Apart(rows) => {
                let lanes = self.rays.meets_any_triangle(s, block, reach.farthest) & used;
                if lanes == 0 {
                    return 0;
                }
                let ready = rows.ready(s, &block.corners);
                self.test_each(wide, trace, (block, index, lanes), branch.rays, reach, (rows, &ready))
            }
        }
    }

    /// Tests the triangles of a mask, and returns a mask of the rays with new hits.
    #[inline(always)]
    fn test_each<T: Lanewise<N>, W: QueryBatch, R: Rows<T, N>>(
        &mut self,
        wide: T,
        trace: &PacketTrace<W>,
        (block, index, lanes): (&Block, u32, u32),
        mut rays: u32,
        reach: &mut Reach<T, N>,
        (sight, ready): (&R, &R::Ready),
    ) -> u32 {
        let (mut lanes, mut changed) = (lanes, 0);
        while lanes != 0 {
            let lane = lanes.trailing_zeros();
            lanes &= lanes - 1;
            let (verdicts, test) = sight.test(wide, ready, lane as usize);
            if (verdicts.hit | verdicts.unsure) & rays != 0 {
                let place = TriangleSlot { block: index, lane, prim: block.prims[lane as usize % LANES] };
                let between = sight.distances(wide, ready, lane as usize, &test);
                let hit = self.take(wide, trace, (place, rays), verdicts, between, reach);
                changed |= hit;
                if W::Goal::ANY {
                    rays &= !hit;
                }
            }
        }
        changed
    }

    /// Offers the hits of rays with a triangle, with bounds of the distance where they are certain; returns a mask of those
    /// that are now the best.
    #[inline(always)]
    fn take<T: Lanewise<N>, W: QueryBatch>(
        &mut self,
        s: T,
        trace: &PacketTrace<W>,
        (place, rays): (TriangleSlot, u32),
        verdicts: Verdicts,
        [low, high]: [T::Lanes; 2],
        reach: &mut Reach<T, N>,
    ) -> u32 {
        let prim = place.prim;
        let rays = rays & !s.find_word(prim, &self.rays.exclude);
        let opaque = !W::Goal::ANY || trace.shapes.opaque.get_or_set(prim);
        if !opaque && !trace.batch.goal(self.start).wants_transparent() {
            return 0;
        }
        let (mut hit, unsure) = (verdicts.hit & rays, verdicts.unsure & rays);
        let t_min = s.load(&self.rays.t_min);
        let mut better = s.less(t_min, low) & s.less(high, reach.low) & s.at_most(high, reach.high) & hit;
        if !W::Goal::ANY && better != 0 && trace.batch.filter().is_some() {
            let gone = self.passing(trace.shapes, trace.batch, prim, better);
            (better, hit) = (better & !gone, hit & !gone);
        }
        // The exact test decides on distances that may be equal, and on verdicts that lanes leave open.
        let in_time = s.at_most(low, reach.high) & s.at_most(t_min, high);
        let mut open = hit & in_time & !better | unsure;
        if !opaque && better != 0 {
            better = self.minding(trace.batch, prim, better);
        }
        (reach.low, reach.high) = (s.choose(better, low, reach.low), s.choose(better, high, reach.high));
        s.put_word(better, prim, &mut self.found.prim);
        s.put_word(better, place.packed(), &mut self.found.place);
        let mut changed = better;
        if open != 0 {
            let (mut low, mut high) = (s.store(reach.low), s.store(reach.high));
            while open != 0 {
                let ray = open.trailing_zeros() as usize % N;
                open &= open - 1;
                let (i, certain) = (self.start + ray, hit >> ray & 1 == 1);
                let best = Best {
                    low: low[ray],
                    high: high[ray],
                    place: TriangleSlot::unpacked(self.found.place[ray], self.found.prim[ray]),
                };
                if let Some(t) = decide(trace.tree, trace.shapes, &*trace.batch, i, best, place, certain) {
                    (low[ray], high[ray]) = (t, t);
                    (self.found.prim[ray], self.found.place[ray]) = (place.prim, place.packed());
                    changed |= 1 << ray;
                }
            }
            (reach.low, reach.high) = (s.load(&low), s.load(&high));
        }
        changed
    }

    /// Bit mask of those rays in `rays` that the filter lets pass through a prim that they hit.
    #[cold]
    #[inline(never)]
    fn passing<W: QueryBatch>(&self, shapes: &Shapes, batch: &W, prim: u32, rays: u32) -> u32 {
        let open = !shapes.opaque.get_or_set(prim);
        batch.filter().filter(|_| open).map_or(0, |filter| filter.rejects_of(self.start, rays, prim))
    }

    /// Bit mask of those rays in `rays` for which a hit with a non-opaque prim counts.
    #[cold]
    #[inline(never)]
    fn minding<W: QueryBatch>(&self, batch: &W, prim: u32, rays: u32) -> u32 {
        those(rays, |ray| batch.goal(self.start + ray).counts_hit(false, prim))
    }

    /// Exact distances and barycentric coordinates of the hits of the rays in `left`.
    #[inline(always)]
    fn meet_each<T: Lanewise<N>>(&self, s: T, tree: &Tree, mut left: u32) -> Meetings<T::Lanes> {
        let mut corners = [[s.splat(0.0); 3]; 3];
        while left != 0 {
            let place = self.found.place[left.trailing_zeros() as usize % N];
            let mine = s.find_word(place, &self.found.place);
            left &= !mine;
            let (rows, lane) = TriangleSlot::rows(tree, place);
            for (corner, rows) in corners.iter_mut().zip(rows) {
                for k in 0..3 {
                    corner[k] = s.choose(mine, s.splat(rows[k][lane]), corner[k]);
                }
            }
        }
        let [o, d] = [&self.rays.origin, &self.rays.dir];
        meet(s, [s.load(&o[0]), s.load(&o[1]), s.load(&o[2])], [s.load(&d[0]), s.load(&d[1]), s.load(&d[2])], corners)
    }

    /// Hands over the answers, with all distances and barycentric coordinates computed together.
    #[inline(always)]
    fn answer<S: Simd, T: Lanewise<N>, W: QueryBatch>(&mut self, s: S, wide: T, trace: &mut PacketTrace<W>) {
        let (start, found, tree) = (self.start, &self.found, trace.tree);
        if W::Goal::ANY {
            trace.batch.take_all(start, &found.prim.map(|prim| Hit { prim, ..Hit::MISS }));
            return;
        }
        let hit = !wide.find_word(NO_PRIM, &found.prim) & all::<N>();
        if hit == 0 {
            return trace.batch.take_all(start, &[Hit::MISS; N]);
        }
        let zero = wide.splat(0.0);
        let place = found.place[hit.trailing_zeros() as usize % N];
        let Meetings { t, weights: [u, v], sure } = if hit & !wide.find_word(place, &found.place) == 0 {
            let bounds = self.rays.row_bounds();
            Plane::of(&TriangleSlot::corners(tree, place)).meet(wide, &self.rays.origin, &self.rays.dir, &bounds)
        } else {
            self.meet_each(wide, tree, hit)
        };
        let t = wide.choose(hit, t, wide.splat(f32::INFINITY));
        let (mut t, mut u, mut v) =
            (wide.store(t), wide.store(wide.choose(hit, u, zero)), wide.store(wide.choose(hit, v, zero)));
        let mut unsure = hit & !sure;
        while unsure != 0 {
            let ray = unsure.trailing_zeros() as usize % N;
            unsure &= unsure - 1;
            let Ray { origin, dir, .. } = trace.batch.ray(start + ray);
            let corners = TriangleSlot::corners(tree, found.place[ray]);
            (t[ray], u[ray], v[ray]) = triangle::place(&RaySpace::checked(origin, dir).0, &corners);
        }
        for (k, prim) in found.prim.as_chunks::<LANES>().0.iter().enumerate() {
            let [t, u, v] = [&t.as_chunks().0[k], &u.as_chunks().0[k], &v.as_chunks().0[k]];
            let rows = s.rows([s.load(t), s.load(u), s.load(v), s.load(&prim.map(f32::from_bits))]);
            trace.batch.take_all(start + LANES * k, &Hit::from_fours(rows));
        }
    }
}

/// Pops entries that no ray needs any more, and returns whether any is left: then the top entry is for the rays that need it.
#[inline(always)]
fn drop_unneeded<T: Lanewise<N>, const N: usize>(
    wide: T,
    reach: &Reach<T, N>,
    stack: &mut [StackEntry],
    top: &mut usize,
) -> bool {
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
