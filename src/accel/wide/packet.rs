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

use super::flight::FARTHEST_FIRST;
use super::node::{Block, Child, Node, Tree};
use super::slabs::{BoxMargins, backwards};
use super::walk::{Entry, ask_by_itself};
use crate::accel::probe::Outcome;
use crate::accel::query::{Goal, Query};
use crate::accel::wave::{Wave, begin, end};
use crate::accel::{Hit, NO_PRIM, Probe, Shapes};
use crate::math::Vec3;
use crate::math::shear::main_axis;
use crate::math::simd::{Kernel, LANES, Pick, Row, Simd};
use crate::math::triangles::{Plane, RayRow, corners_of, reach};

/// Rows of a packet.
const ROWS: usize = 2;

/// Rays of a packet.
pub(super) const RAYS: usize = ROWS * LANES;

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
pub(super) struct InPackets<'w, W, P, B> {
    pub tree: &'w Tree,
    pub shapes: &'w Shapes,
    pub wave: &'w mut W,
    pub stack: &'w mut [Branch],
    /// For rays that go by themselves.
    pub entries: &'w mut [Entry],
    pub probe: &'w mut P,
    pub margins: PhantomData<B>,
}

/// Rays by axis, row and lane.
#[derive(Clone, Copy)]
struct Packet<B> {
    origin: [[Row; 3]; ROWS],
    dir: [[Row; 3]; ROWS],
    inverse: [[Row; 3]; ROWS],
    from: [Row; ROWS],
    limit: [Row; ROWS],
    /// The origins between which the others lie, by axis: the one first met by a box's first plane, and the other.
    origins: [[f32; 2]; 3],
    /// Least and greatest reciprocal.
    inverses: [[f32; 2]; 3],
    first: [Pick; 3],
    last: [Pick; 3],
    octant: usize,
    /// Axis of the largest component of every direction.
    z: usize,
    least_from: f32,
    reach: f32,
    /// What was hit last with a distance that is certain in `f64`, and that distance.
    met: [u32; RAYS],
    met_at: [[f64; LANES]; ROWS],
    margins: PhantomData<B>,
}

impl<W: Wave, P: Probe, B: BoxMargins> Kernel for InPackets<'_, W, P, B> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self { tree, shapes, wave, stack, entries, probe, .. } = self;
        let mut queries: Vec<Query<W::Goal>> = Vec::with_capacity(RAYS);
        let mut packet = Packet::<B>::empty();
        let mut start = 0;
        while start < wave.rays().len() {
            let count = RAYS.min(wave.rays().len() - start);
            if packet.gather(s, tree, wave, start) {
                packet.trace(s, tree, shapes, wave, start, stack, &mut queries, probe);
            } else {
                for i in start..start + count {
                    ask_by_itself::<B, _, _, _>(s, tree, shapes, wave, i, entries, probe);
                }
            }
            start += count;
        }
    }
}

/// Every lane of a row.
const ALL: u32 = (1 << LANES) - 1;

#[inline(always)]
fn least(row: &Row) -> f32 {
    row.iter().fold(f32::INFINITY, |a, &b| if b < a { b } else { a })
}

#[inline(always)]
fn greatest(row: &Row) -> f32 {
    row.iter().fold(f32::NEG_INFINITY, |a, &b| if b > a { b } else { a })
}

impl<B: BoxMargins> Packet<B> {
    /// The next sixteen rays, if there are as many and they run alike: to the same octant, no component zero, the same
    /// one the largest.
    #[inline(always)]
    fn gather<S: Simd, W: Wave>(&mut self, s: S, tree: &Tree, wave: &W, start: usize) -> bool {
        if start + RAYS > wave.rays().len() || tree.extent > B::COORDINATES {
            return false;
        }
        let dir = wave.rays()[start].dir;
        (self.z, self.octant) = (main_axis(dir), octant_of(dir));
        let mut alike = ALL;
        for row in 0..ROWS {
            let mut rays = [[0.0; LANES]; LANES];
            for (place, numbers) in rays.iter_mut().enumerate() {
                let i = start + row * LANES + place;
                let ray = &wave.rays()[i];
                let ([ox, oy, oz], [dx, dy, dz]) = (ray.origin.to_array(), ray.dir.to_array());
                *numbers = [ox, oy, oz, wave.t_min(i), dx, dy, dz, ray.t_max];
            }
            alike &= self.take_row(s, row, s.transpose(&rays));
        }
        if alike == ALL {
            self.bound(s, tree);
        }
        alike == ALL
    }

    /// Eight rays, by number and lane; a bit for each that runs like the first.
    #[inline(always)]
    fn take_row<S: Simd>(&mut self, s: S, row: usize, rays: [S::Lanes; LANES]) -> u32 {
        let [ox, oy, oz, t_min, dx, dy, dz, t_max] = rays;
        let (zero, one, most, least_normal) =
            (s.splat(0.0), s.splat(1.0), s.splat(f32::MAX), s.splat(f32::MIN_POSITIVE));
        let (origin, dir) = ([ox, oy, oz], [dx, dy, dz]);
        let coordinates = s.splat(B::COORDINATES);
        let mut alike = s.at_most(t_min, t_max);
        for k in 0..3 {
            let inverse = s.div(one, dir[k]);
            let size = s.abs(inverse);
            let back = s.less(dir[k], zero);
            alike &= s.at_most(s.abs(origin[k]), coordinates) & s.at_most(s.abs(dir[k]), most);
            alike &= s.at_most(size, most) & s.at_most(least_normal, size);
            alike &= if self.octant >> k & 1 == 1 { back } else { !back };
            self.origin[row][k] = s.store(origin[k]);
            self.dir[row][k] = s.store(dir[k]);
            self.inverse[row][k] = s.store(inverse);
        }
        let (x, y, z) = (s.abs(dx), s.abs(dy), s.abs(dz));
        let (first, third) = (s.at_most(y, x) & s.at_most(z, x), s.less(y, z));
        alike &= match self.z {
            0 => first,
            1 => !first & !third,
            _ => !first & third,
        };
        let (range, underflow) = (s.splat(B::RANGE), s.splat(B::UNDERFLOW));
        let from = s.sub(s.sub(t_min, s.mul(s.abs(t_min), range)), underflow);
        let reach = s.smaller(t_max, most);
        let limit = s.add(s.add(reach, s.mul(s.abs(reach), range)), underflow);
        // Not so for a ray that goes on behind nothing: a NaN would hide where the others start.
        alike &= s.at_most(s.abs(from), most);
        self.from[row] = s.store(from);
        self.limit[row] = s.store(limit);
        alike & ALL
    }

    #[inline(always)]
    fn empty() -> Self {
        Self {
            origin: [[[0.0; LANES]; 3]; ROWS],
            dir: [[[0.0; LANES]; 3]; ROWS],
            inverse: [[[0.0; LANES]; 3]; ROWS],
            from: [[0.0; LANES]; ROWS],
            limit: [[0.0; LANES]; ROWS],
            origins: [[0.0; 2]; 3],
            inverses: [[0.0; 2]; 3],
            first: [Pick::new(0); 3],
            last: [Pick::new(0); 3],
            octant: 0,
            z: 0,
            least_from: 0.0,
            reach: 0.0,
            met: [NO_PRIM; RAYS],
            met_at: [[0.0; LANES]; ROWS],
            margins: PhantomData,
        }
    }

    /// Finds what bounds all rays.
    #[inline(always)]
    fn bound<S: Simd>(&mut self, s: S, tree: &Tree) {
        let back = |k: usize| self.octant >> k & 1;
        (self.first, self.last) = (
            [Pick::new(back(0)), Pick::new(2 + back(1)), Pick::new(4 + back(2))],
            [Pick::new(1 - back(0)), Pick::new(3 - back(1)), Pick::new(5 - back(2))],
        );
        self.reach = 0.0;
        self.met = [NO_PRIM; RAYS];
        for k in 0..3 {
            let (a, b) = (s.load(&self.origin[0][k]), s.load(&self.origin[1][k]));
            let (lo, hi) = (least(&s.store(s.smaller(a, b))), greatest(&s.store(s.greater(a, b))));
            self.origins[k] = if self.octant >> k & 1 == 1 { [lo, hi] } else { [hi, lo] };
            let low = Vec3::from_array(std::array::from_fn(|i| if i == k { lo } else { tree.bounds.lo[i] }));
            let high = Vec3::from_array(std::array::from_fn(|i| if i == k { hi } else { tree.bounds.hi[i] }));
            self.reach = self.reach.max(reach(low, &tree.bounds)).max(reach(high, &tree.bounds));
            let (a, b) = (s.load(&self.inverse[0][k]), s.load(&self.inverse[1][k]));
            self.inverses[k] = [least(&s.store(s.smaller(a, b))), greatest(&s.store(s.greater(a, b)))];
        }
        self.least_from = least(&s.store(s.smaller(s.load(&self.from[0]), s.load(&self.from[1]))));
    }

    /// The distance beyond which no ray looks for hits.
    #[inline(always)]
    fn farthest<S: Simd>(&self, s: S) -> f32 {
        greatest(&s.store(s.greater(s.load(&self.limit[0]), s.load(&self.limit[1]))))
    }

    /// Which of eight boxes any ray may meet up to `limit`, and the least distances of that.
    #[inline(always)]
    fn meets_any<S: Simd>(&self, s: S, first: [S::Lanes; 3], last: [S::Lanes; 3], limit: f32) -> (S::Lanes, u32) {
        let (mut near, mut far) = (s.splat(self.least_from), s.splat(limit));
        for k in 0..3 {
            let (low, high) = (s.splat(self.inverses[k][0]), s.splat(self.inverses[k][1]));
            let first = s.sub(first[k], s.splat(self.origins[k][0]));
            let last = s.sub(last[k], s.splat(self.origins[k][1]));
            near = s.greater(s.smaller(s.mul(first, low), s.mul(first, high)), near);
            far = s.smaller(s.greater(s.mul(last, low), s.mul(last, high)), far);
        }
        let slack = s.add(s.mul(s.abs(far), s.splat(B::SLAB)), s.splat(B::UNDERFLOW));
        (near, s.at_most(near, s.add(far, slack)))
    }

    /// Which of these rays meet the box of a child.
    #[inline(always)]
    fn meets_each<S: Simd>(&self, s: S, node: &Node, slot: usize, of: u32) -> u32 {
        let back = |k: usize| self.octant >> k & 1;
        let plane = |k: usize, side: usize| node.planes[(2 * k + side) % 6][slot % LANES];
        let first = [plane(0, back(0)), plane(1, back(1)), plane(2, back(2))];
        let last = [plane(0, 1 - back(0)), plane(1, 1 - back(1)), plane(2, 1 - back(2))];
        let mut rays = 0;
        for row in 0..ROWS {
            if of >> (LANES * row) & ALL == 0 {
                continue;
            }
            let (mut near, mut far) = (s.load(&self.from[row]), s.load(&self.limit[row]));
            for k in 0..3 {
                let (origin, inverse) = (s.load(&self.origin[row][k]), s.load(&self.inverse[row][k]));
                near = s.greater(s.mul(s.sub(s.splat(first[k]), origin), inverse), near);
                far = s.smaller(s.mul(s.sub(s.splat(last[k]), origin), inverse), far);
            }
            let slack = s.add(s.mul(s.abs(far), s.splat(B::SLAB)), s.splat(B::UNDERFLOW));
            rays |= s.at_most(near, s.add(far, slack)) << (LANES * row);
        }
        rays & of
    }

    /// From the root to every leaf that any ray may hit.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "what a wave brings with it")]
    fn trace<'a, S: Simd, W: Wave, P: Probe>(
        &mut self,
        s: S,
        tree: &Tree,
        shapes: &'a Shapes,
        wave: &mut W,
        start: usize,
        stack: &mut [Branch],
        queries: &mut Vec<Query<'a, W::Goal>>,
        probe: &mut P,
    ) {
        let mut limit = self.farthest(s);
        let mut top = 0;
        let mut active = u32::from(u16::MAX);
        self.push(s, &tree.nodes[0], active, limit, stack, &mut top);
        if top == 0 {
            (start..start + RAYS).for_each(|i| wave.take(i, Hit::MISS));
            return;
        }
        queries.clear();
        queries.extend((start..start + RAYS).map(|i| begin(shapes, wave, i, probe).0));
        let rows = [
            RayRow::new(s, &self.origin[0], &self.dir[0], self.z, self.reach),
            RayRow::new(s, &self.origin[1], &self.dir[1], self.z, self.reach),
        ];
        while top > 0 {
            top -= 1;
            let branch = stack[top];
            let rays = branch.rays & active;
            if branch.near > limit || rays == 0 {
                continue;
            }
            match Child::unpack(branch.child) {
                Child::Node(node) => self.push(s, &tree.nodes[node as usize], rays, limit, stack, &mut top),
                Child::Block(block, count) => {
                    let block = &tree.blocks[block as usize];
                    let changed = self.test(s, block, count, rays, limit, &rows, queries, probe, &mut active);
                    if changed {
                        limit = self.farthest(s);
                    }
                }
                Child::Run(run) => {
                    for &prim in tree.run(run) {
                        let mut left = rays & active;
                        while left != 0 {
                            let ray = left.trailing_zeros() as usize % RAYS;
                            left &= left - 1;
                            let answered = queries[ray].test(prim, probe);
                            self.narrow(ray, &queries[ray], answered, &mut active);
                        }
                    }
                    limit = self.farthest(s);
                }
            }
            if active == 0 {
                break;
            }
        }
        self.answer(s, shapes, wave, start, queries, probe);
    }

    /// Gives the answers; weights of hits with the same triangle are found together.
    #[inline(always)]
    fn answer<S: Simd, W: Wave, P: Probe>(
        &self,
        s: S,
        shapes: &Shapes,
        wave: &mut W,
        start: usize,
        queries: &[Query<W::Goal>],
        probe: &mut P,
    ) {
        let mut left = 0;
        for (ray, query) in queries.iter().enumerate() {
            match query.best() {
                Some((_, prim)) if prim == self.met[ray] => left |= 1 << ray,
                _ => end(wave, start + ray, query, probe),
            }
        }
        while left != 0u32 {
            let prim = self.met[left.trailing_zeros() as usize % RAYS];
            let plane = Plane::of(&shapes.triangle(prim));
            for row in 0..ROWS {
                let mut mine = left >> (LANES * row) & ALL;
                if mine == 0 {
                    continue;
                }
                let [u, v] = plane.barycentrics(s, &self.origin[row], &self.dir[row], &self.met_at[row]);
                while mine != 0 {
                    let lane = mine.trailing_zeros() as usize % LANES;
                    mine &= mine - 1;
                    let ray = LANES * row + lane;
                    if let Some((t, best)) = queries[ray].best().filter(|b| b.1 == prim) {
                        wave.take(start + ray, Hit { t, u: u[lane], v: v[lane], prim: best });
                        probe.found();
                        left &= !(1 << ray);
                    }
                }
            }
        }
    }

    /// Puts the children that some ray meets on the stack, the nearest last.
    #[inline(always)]
    fn push<S: Simd>(&self, s: S, node: &Node, rays: u32, limit: f32, stack: &mut [Branch], top: &mut usize) {
        let first = [
            s.pick(&node.planes, self.first[0]),
            s.pick(&node.planes, self.first[1]),
            s.pick(&node.planes, self.first[2]),
        ];
        let last = [
            s.pick(&node.planes, self.last[0]),
            s.pick(&node.planes, self.last[1]),
            s.pick(&node.planes, self.last[2]),
        ];
        let (near, met) = self.meets_any(s, first, last, limit);
        if met == 0 {
            return;
        }
        let near = s.store(near);
        let mut order = FARTHEST_FIRST[self.octant % LANES][met as usize % 256];
        for _ in 0..met.count_ones() {
            let slot = (order & 7) as usize;
            order >>= 8;
            let rays = self.meets_each(s, node, slot, rays);
            if rays != 0 {
                stack[*top] = Branch { near: near[slot], child: node.children[slot], rays };
                *top += 1;
            }
        }
    }

    /// Notes how far a ray still looks after a test.
    #[inline(always)]
    fn narrow<G: Goal>(&mut self, ray: usize, query: &Query<G>, answered: bool, active: &mut u32) {
        let limit = &mut self.limit[ray / LANES][ray % LANES];
        if answered {
            *active &= !(1 << ray);
            *limit = f32::NEG_INFINITY;
        } else {
            *limit = B::widened(query.reach());
        }
    }

    /// Tests the triangles of a block, and tells whether anything was hit.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "what a wave brings with it")]
    fn test<S: Simd, G: Goal, P: Probe>(
        &mut self,
        s: S,
        block: &Block,
        count: u32,
        rays: u32,
        limit: f32,
        rows: &[RayRow<S>; ROWS],
        queries: &mut [Query<G>],
        probe: &mut P,
        active: &mut u32,
    ) -> bool {
        let [a, b, c] = &block.corners;
        let zero = s.splat(0.0);
        let (mut first, mut last) = ([zero; 3], [zero; 3]);
        for k in 0..3 {
            let (a, b, c) = (s.load(&a[k]), s.load(&b[k]), s.load(&c[k]));
            let (low, high) = (s.smaller(a, s.smaller(b, c)), s.greater(a, s.greater(b, c)));
            (first[k], last[k]) = if self.octant >> k & 1 == 1 { (high, low) } else { (low, high) };
        }
        let (_, met) = self.meets_any(s, first, last, limit);
        let mut lanes = met & ((1 << count) - 1);
        let mut changed = false;
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize % LANES;
            lanes &= lanes - 1;
            let corners = corners_of(&block.corners, lane);
            let (mut certain, mut unsure) = (0, 0);
            for (row, tested) in rows.iter().enumerate() {
                if rays >> (LANES * row) & ALL != 0 {
                    let verdicts = tested.verdicts(s, &corners);
                    certain |= verdicts.hit << (LANES * row);
                    unsure |= verdicts.unsure << (LANES * row);
                }
            }
            let open = (certain | unsure) & rays & *active;
            if open == 0 {
                continue;
            }
            let (prim, plane) = (block.prims[lane], Plane::of(&corners));
            for row in 0..ROWS {
                let mut mine = open >> (LANES * row) & ALL;
                if mine == 0 {
                    continue;
                }
                let met = plane.meet(s, &self.origin[row], &self.dir[row]);
                let sure = met.sure & certain >> (LANES * row);
                changed = true;
                while mine != 0 {
                    let place = mine.trailing_zeros() as usize % LANES;
                    mine &= mine - 1;
                    let ray = LANES * row + place;
                    let query = &mut queries[ray];
                    if sure >> place & 1 == 0 {
                        query.take(prim, &corners, certain >> ray & 1 == 1, probe);
                    } else if query.offer_met(prim, met.t[place]) == Outcome::Hit {
                        self.met[ray] = prim;
                        self.met_at[row][place] = met.t_f64[place];
                    }
                    let answered = query.is_answered();
                    self.narrow(ray, &queries[ray], answered, active);
                }
            }
        }
        changed
    }
}

#[inline(always)]
fn octant_of(dir: Vec3) -> usize {
    backwards(dir.x) | backwards(dir.y) << 1 | backwards(dir.z) << 2
}
