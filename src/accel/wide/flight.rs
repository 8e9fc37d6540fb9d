//! Many rays in flight: while one waits for memory or a comparison, others proceed.
//!
//! Every ray has a slot with its own stack. A step of a ray at a node has no data-dependent branch: all children are pushed
//! in the order of their slots as seen from the ray's octant, and the top is popped. Rays at leaves wait until there are
//! enough of them. No ray's queries depend on the others, and hits are ordered by (t, prim): the answers are those of the
//! rays one after another.

use std::marker::PhantomData;

use super::best::{BlockHits, Seeker};
use super::node::{Child, Node, Tree};
use super::pending_hits::PendingHits;
use super::prepared::{PreparedRay, PreparedRays};
use super::slabs::BoxMargins;
use super::walk::{Entry, trace_alone};
use crate::accel::query_batch::QueryBatch;
use crate::accel::{Hit, NO_PRIM, Shapes};
use crate::math::simd::{Kernel, LANES, Order, Simd};
use bytemuck::Zeroable;

/// Number of rays in flight: one per bit of a word.
const SLOTS: usize = 32;

/// Fewest rays at leaves that are worth a pass over the leaves.
const LEAVES: u32 = 16;

/// Entries of a ray's stack: trees that may need as many or more are traced in another way.
pub(super) const DEPTH: usize = 128;

/// By octant and lane mask: the lanes in the mask, the farthest first as seen from that octant.
pub(super) static FARTHEST_FIRST: [[Order; 256]; LANES] = farthest_first();

const fn farthest_first() -> [[Order; 256]; LANES] {
    let mut table = [[0; 256]; LANES];
    let mut octant = 0;
    while octant < LANES {
        let mut mask = 0;
        while mask < 256 {
            let (mut order, mut place, mut rank) = (0, 0, LANES);
            while rank > 0 {
                rank -= 1;
                let lane = rank ^ octant;
                if mask >> lane & 1 == 1 {
                    order |= (lane as Order) << (4 * place);
                    place += 1;
                }
            }
            table[octant][mask] = order;
            mask += 1;
        }
        octant += 1;
    }
    table
}

/// A ray in flight.
#[derive(Clone, Debug)]
struct Slot {
    ray: PreparedRay,
    seeker: Seeker,
    /// Index above the top of the stack.
    top: usize,
    /// The stack, distances and children apart, so that eight entries are written at once; the first entry is never popped,
    /// and above the last there is room for surplus lanes of a write.
    near: [f32; DEPTH + LANES],
    children: [u32; DEPTH + LANES],
}

/// A batch of rays, and the slots in which they are traced.
pub(super) struct InFlight<'w, W, B> {
    pub flight: Flight<'w, W, B>,
    pub slots: &'w mut Slots,
}

/// A batch of rays with the tree they are traced through.
pub(super) struct Flight<'w, W, B> {
    pub tree: &'w Tree<'w>,
    /// Whether prefetching the next nodes pays.
    pub far: bool,
    pub shapes: &'w Shapes,
    pub batch: &'w mut W,
    /// Stack for rays that are traced alone.
    pub entries: &'w mut [Entry],
    pub margins: PhantomData<B>,
}

/// States of the slots, as bit masks.
struct SlotMasks {
    nodes: u32,
    leaves: u32,
    ended: u32,
}

/// Slots of all rays in flight.
#[derive(Clone, Debug)]
pub(super) struct Slots {
    slots: Box<[Slot; SLOTS]>,
    /// Packed child at which each ray is; [`Child::END`] also for empty slots.
    at: [u32; SLOTS],
    /// Bit mask of the slots that hold a ray.
    taken: u32,
}

impl Default for Slots {
    fn default() -> Self {
        let slot = |_| Slot {
            ray: PreparedRay::zeroed(),
            seeker: Seeker::new(&PreparedRay::zeroed(), 0.0, 0, NO_PRIM),
            top: LANES,
            near: [f32::NEG_INFINITY; DEPTH + LANES],
            children: [Child::END; DEPTH + LANES],
        };
        Self { slots: Box::new(std::array::from_fn(slot)), at: [Child::END; SLOTS], taken: 0 }
    }
}

impl Slots {
    /// Bit masks of the slots at nodes, at leaves, and at their end.
    #[inline(always)]
    fn whereabouts<S: Simd>(&self, s: S) -> SlotMasks {
        let (mut leaves, mut ended) = (0, 0);
        for (i, at) in self.at.as_chunks().0.iter().enumerate() {
            leaves |= s.high_bits(at) << (LANES * i);
            ended |= s.find_word(Child::END, at) << (LANES * i);
        }
        SlotMasks { nodes: !leaves & self.taken, leaves: leaves & !ended, ended: ended & self.taken }
    }

    /// A slot, and the packed child at which its ray is.
    #[inline(always)]
    fn at(&mut self, number: u32) -> (&mut Slot, &mut u32) {
        let number = number as usize % SLOTS;
        (&mut self.slots[number], &mut self.at[number])
    }
}

/// Queue of the rays that are not in flight yet.
struct Queue {
    /// The eight prepared rays that contain the next one.
    ready: PreparedRays,
    /// Index of the next ray in the batch.
    next: usize,
}

impl<W: QueryBatch, B: BoxMargins> Kernel for InFlight<'_, W, B> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Self { mut flight, slots } = self;
        let (mut queue, mut pending) = (Queue { ready: PreparedRays::default(), next: 0 }, PendingHits::default());
        for number in 0..u32::BITS {
            flight.start(s, slots, number, &mut queue);
        }
        let mut met = [BlockHits::NOTHING; SLOTS];
        let mut nodes = slots.whereabouts(s).nodes;
        while slots.taken != 0 {
            flight.step(s, slots, nodes);
            let at = slots.whereabouts(s);
            nodes = at.nodes;
            if nodes == 0 || (at.leaves | at.ended).count_ones() >= LEAVES {
                let answered = flight.test(s, slots, at.leaves, &mut met);
                flight.renew(s, slots, at.ended | answered, &mut queue, &mut pending);
                nodes = slots.whereabouts(s).nodes;
            }
        }
        pending.finish(s, flight.batch);
    }
}

impl Slot {
    /// [`Self::pop`], eight entries at a time.
    #[inline(always)]
    fn pop_many<S: Simd>(&mut self, s: S) -> u32 {
        let mut top = self.top;
        let limit = s.splat(self.seeker.limit);
        loop {
            let bottom = (top - LANES) % DEPTH;
            let Some(eight) = self.near[bottom..].first_chunk() else { return Child::END };
            let within = s.at_most(s.load(eight), limit);
            if within != 0 {
                top = bottom + within.ilog2() as usize;
                break;
            }
            top -= LANES;
        }
        self.top = top;
        self.children[top % DEPTH]
    }

    /// Pops the next child that may hold a hit.
    #[inline(always)]
    fn pop(&mut self) -> u32 {
        let mut top = self.top;
        loop {
            top -= 1;
            if self.near[top % DEPTH] <= self.seeker.limit {
                break;
            }
        }
        self.top = top;
        self.children[top % DEPTH]
    }

    /// Pushes the children in `met`, the nearest last, for a ray with the given octant.
    #[inline(always)]
    fn push<S: Simd>(&mut self, s: S, octant: u32, node: &Node, near: S::Lanes, met: u32) {
        let order = FARTHEST_FIRST[octant as usize % LANES][met as usize % 256];
        let top = self.top % DEPTH;
        let (nears, children) = (self.near[top..].first_chunk_mut(), self.children[top..].first_chunk_mut());
        // There is room for eight entries above every top.
        if let (Some(nears), Some(children)) = (nears, children) {
            s.arrange(near, order, nears);
            s.arrange_words(&node.children, order, children);
            self.top = top + met.count_ones() as usize;
        }
    }
}

impl<W: QueryBatch, B: BoxMargins> Flight<'_, W, B> {
    /// Puts the next ray that meets a box of the root into a slot, if there is one; answers the rays before it, which miss.
    #[inline(always)]
    fn start<S: Simd>(&mut self, s: S, slots: &mut Slots, number: u32, queue: &mut Queue) {
        while queue.next < self.batch.rays().len() {
            let i = queue.next;
            let lane = i % LANES;
            if lane == 0 {
                queue.ready.take::<B, _, _>(s, self.tree, self.batch, i);
            }
            queue.next += 1;
            if queue.ready.allowed >> lane & 1 == 0 {
                trace_alone::<B, _>(self.tree, self.shapes, self.batch, i, self.entries);
                continue;
            }
            let (ray, root) = (&queue.ready.rays[lane], &self.tree.nodes[0]);
            let (near, met) = ray.slabs.meets(s, root, ray.slabs.limit);
            if met != 0 {
                let (slot, at) = slots.at(number);
                let seeker = Seeker::new(ray, queue.ready.t_min[lane], i, queue.ready.exclude[lane]);
                (slot.ray, slot.seeker) = (*ray, seeker);
                slot.top = LANES;
                // From the prepared ray: the copy in the slot is still being written.
                slot.push(s, ray.slabs.octant, root, near, met);
                *at = slot.pop();
                slots.taken |= 1 << number;
                return;
            }
            self.batch.take(i, Hit::MISS);
        }
        slots.taken &= !(1 << number);
    }

    /// Moves every ray at a node on to its next child.
    #[inline(always)]
    fn step<S: Simd>(&self, s: S, slots: &mut Slots, nodes: u32) {
        if self.far {
            self.step_each::<S, true>(s, slots, nodes);
        } else {
            self.step_each::<S, false>(s, slots, nodes);
        }
    }

    /// Steps each ray; with `FAR` the next nodes are prefetched.
    #[inline(always)]
    fn step_each<S: Simd, const FAR: bool>(&self, s: S, slots: &mut Slots, mut nodes: u32) {
        let tree_nodes = self.tree.nodes;
        while nodes != 0 {
            let (slot, at) = slots.at(nodes.trailing_zeros());
            nodes &= nodes - 1;
            let node = &tree_nodes[*at as usize];
            let (near, met) = slot.ray.slabs.meets(s, node, slot.seeker.limit);
            slot.push(s, slot.ray.slabs.octant, node, near, met);
            *at = slot.pop();
            if FAR {
                let (node, block) = Child::either(*at);
                s.prefetch_either(Child::is_leaf(*at), (self.tree.blocks, block), (self.tree.nodes, node));
            }
        }
    }

    /// Tests every ray at a leaf and moves it on; returns a mask of the rays answered by that. All are tested before any hit
    /// is processed: which rays hit is unpredictable, and this way no test waits for the outcome of another.
    #[inline(always)]
    fn test<S: Simd>(&self, s: S, slots: &mut Slots, mut leaves: u32, met: &mut [BlockHits; SLOTS]) -> u32 {
        let (mut turn, mut open, mut answered) = (leaves, 0, 0);
        while turn != 0 {
            let number = turn.trailing_zeros();
            turn &= turn - 1;
            let (slot, at) = slots.at(number);
            let met = &mut met[number as usize % SLOTS];
            *met = slot.seeker.meet(s, &slot.ray.sight, self.tree, *at);
            open |= u32::from(met.open != 0) << number;
        }
        while open != 0 {
            let number = open.trailing_zeros();
            open &= open - 1;
            let (slot, at) = slots.at(number);
            let (block, _) = Child::block(*at);
            let done =
                slot.seeker.take::<B, _>(self.tree, self.shapes, self.batch, block, &met[number as usize % SLOTS]);
            answered |= u32::from(done) << number;
        }
        leaves &= !answered;
        while leaves != 0 {
            let (slot, at) = slots.at(leaves.trailing_zeros());
            leaves &= leaves - 1;
            *at = slot.pop_many(s);
        }
        answered
    }

    /// Answers the rays that have ended, and refills their slots.
    #[inline(always)]
    fn renew<S: Simd>(
        &mut self,
        s: S,
        slots: &mut Slots,
        mut ended: u32,
        queue: &mut Queue,
        pending: &mut PendingHits,
    ) {
        while ended != 0 {
            let number = ended.trailing_zeros();
            ended &= ended - 1;
            let (slot, at) = slots.at(number);
            *at = Child::END;
            pending.answer(s, self.tree, self.batch, slot.seeker.number, slot.seeker.found());
            self.start(s, slots, number, queue);
        }
    }
}
