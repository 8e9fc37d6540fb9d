//! Cuts polygons into triangles by ear clipping with exact signs.
//!
//! G. H. Meisters, "Polygons Have Ears", 1975; signs by J. R. Shewchuk, "Adaptive Precision Floating-Point Arithmetic
//! and Fast Robust Geometric Predicates", 1997 (the crate `robust`).
//!
//! The polygon is projected along the axis of its Newell normal's largest component. An ear is cut only where no other corner
//! lies in it or on its diagonal, so corners on straight runs stay corners of some triangle and no T-junction arises. A
//! polygon with n corners whose boundary does not cross itself, bridges to holes included, gives n − 2 triangles of positive
//! area. Spikes that stick out are dropped first. A polygon that touches itself in corners is split there into parts that are
//! cut one by one (`lobes`). Where no ear is left, three fallbacks follow: straight corners are cut off with triangles of no
//! area; a quad that crosses itself is cut along its shorter diagonal like every warped quad; a larger polygon that crosses
//! itself loses its first convex corner whatever lies inside; after [`MAX_FORCED`] of those the rest becomes a fan. Every
//! corner is still used; which parts are covered twice or lost there is undefined.

mod blockers;
mod lobes;

use super::DVec3;
use blockers::Blockers;
use robust::{Coord, orient2d};
use std::collections::VecDeque;

/// Corners cut off by force before a self-crossing polygon is finished as a fan; bounds the time.
pub const MAX_FORCED: u32 = 64;

/// Kind of the polygon, as found by cutting it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The boundary does not cross itself: every triangle is an ear.
    Exact,
    /// The polygon has spikes or no area: some triangles have no area.
    Degenerate,
    /// The polygon crosses itself: the triangles are a guess.
    Crossing,
}

/// Twice the area vector of the polygon (M. Newell), towards the side from which it is counter-clockwise; zero without area.
pub fn newell(points: &[DVec3]) -> DVec3 {
    let Some((&first, &last)) = points.first().zip(points.last()) else { return DVec3::ZERO };
    // Relative to one corner, so that distant coordinates do not cancel.
    let cross = |a: DVec3, b: DVec3| (a - first).cross(b - first);
    points.windows(2).map(|w| cross(w[0], w[1])).sum::<DVec3>() + cross(last, first)
}

/// Ear clipper; reuses its buffers for every polygon.
#[derive(Debug, Default)]
pub struct EarClipper {
    flat: Vec<Coord<f64>>,
    /// Indices of the corners being cut; entries of the other lists for other corners are meaningless.
    ring: Vec<u32>,
    prev: Vec<u32>,
    next: Vec<u32>,
    /// Whether a corner is strictly convex; other corners can block ears.
    convex: Vec<bool>,
    alive: Vec<bool>,
    blockers: Blockers,
    /// Corners to examine, each with the value of `ticket` that makes the entry valid.
    queue: VecDeque<(u32, u32)>,
    ticket: Vec<u32>,
    left: usize,
}

impl EarClipper {
    /// Appends triangles, as corner indices into `points`, to `out`, with the orientation of the polygon.
    ///
    /// Coordinates must be finite. Corners equal to the previous one are left out; triangles with two equal corners are never
    /// made.
    pub fn cut(&mut self, points: &[DVec3], out: &mut Vec<[u32; 3]>) -> Outcome {
        let ring = distinct_neighbours(points);
        match ring.len() {
            0..3 => Outcome::Degenerate,
            3 => {
                out.push([ring[0], ring[1], ring[2]]);
                Outcome::Exact
            }
            _ => {
                let normal = any_normal(points);
                let start = out.len();
                let outcome = self.cut_seen(points, &ring, |p| project(p, normal), out);
                if outcome != Outcome::Crossing {
                    return outcome;
                }
                // The projection of a warped face along an axis may cross itself where that along its normal does not. Its
                // coordinates are rounded, which bends straight runs, but a warped face has none.
                let (first, second) = normal.normalize().any_orthonormal_pair();
                let first_try = out.split_off(start);
                let along_normal = |p: DVec3| Coord { x: p.dot(first), y: p.dot(second) };
                let outcome = self.cut_seen(points, &ring, along_normal, out);
                if outcome == Outcome::Crossing {
                    out.truncate(start);
                    match shorter_diagonal(points, &ring) {
                        Some(pair) => out.extend(pair),
                        None => out.extend(first_try),
                    }
                }
                outcome
            }
        }
    }

    /// Cuts the polygon as projected by `see`.
    fn cut_seen(
        &mut self,
        points: &[DVec3],
        ring: &[u32],
        see: impl Fn(DVec3) -> Coord<f64>,
        out: &mut Vec<[u32; 3]>,
    ) -> Outcome {
        self.flat.clear();
        self.flat.extend(points.iter().map(|&p| see(p)));
        match convex_quad(&self.flat, points, ring) {
            Some(pair) => {
                out.extend(pair);
                Outcome::Exact
            }
            None => {
                let start = out.len();
                let outcome = self.clip(ring, out);
                if outcome != Outcome::Crossing {
                    return outcome;
                }
                self.cut_lobes(ring, start, out).unwrap_or(outcome)
            }
        }
    }

    /// Cuts a polygon that only touches itself in corners, part by part, and replaces the triangles appended from `start` on.
    /// `None`, with nothing changed, if it does not touch itself, or a part crosses itself.
    fn cut_lobes(&mut self, ring: &[u32], start: usize, out: &mut Vec<[u32; 3]>) -> Option<Outcome> {
        let rings = lobes::lobes(&self.flat, ring);
        if rings.len() < 2 {
            return None;
        }
        let (mut cut, mut outcome) = (Vec::new(), Outcome::Exact);
        for ring in &rings {
            outcome = outcome.max(self.clip(ring, &mut cut));
            if outcome == Outcome::Crossing {
                return None;
            }
        }
        out.truncate(start);
        out.append(&mut cut);
        Some(outcome)
    }

    fn clip(&mut self, ring: &[u32], out: &mut Vec<[u32; 3]>) -> Outcome {
        self.link(ring);
        let mut outcome = Outcome::Exact;
        let mut forced = 0;
        loop {
            // Cut queued ears, then examine every remaining corner once.
            self.clip_queued(out);
            if self.left <= 3 {
                return self.finish(outcome, out);
            }
            self.queue_all();
            if self.clip_queued(out) {
                continue;
            }

            // No ear is left: straight corners and spikes, then a corner by force.
            if self.clip_straight(out) {
                outcome = outcome.max(Outcome::Degenerate);
            } else {
                outcome = Outcome::Crossing;
                forced += 1;
                let i = self.first(|c, i| c.convex[i as usize]).or_else(|| self.first(|_, _| true));
                match i {
                    Some(i) if forced <= MAX_FORCED => self.remove(i, out),
                    _ => return self.fan(out),
                }
            }
        }
    }

    /// Builds the linked ring and the list of blockers.
    fn link(&mut self, ring: &[u32]) {
        // Not cleared: a polygon may fall into very many parts.
        let n = self.flat.len();
        for list in [&mut self.prev, &mut self.next, &mut self.ticket] {
            list.resize(n, 0);
        }
        self.alive.resize(n, false);
        self.convex.resize(n, false);
        self.ring.clear();
        self.ring.extend_from_slice(ring);
        self.ring.sort_unstable();
        self.left = ring.len();
        let followers = ring.iter().cycle().skip(1);
        for (&i, &j) in ring.iter().zip(followers) {
            self.next[i as usize] = j;
            self.prev[j as usize] = i;
            self.alive[i as usize] = true;
            self.ticket[i as usize] = 0;
        }
        self.drop_antennas(ring);
        for &i in ring {
            self.convex[i as usize] = self.alive[i as usize] && self.turn(i) > 0.0;
        }
        let blockers = ring.iter().copied().filter(|&i| self.alive[i as usize] && !self.convex[i as usize]);
        self.blockers.fill(blockers, &self.flat);
        self.queue.clear();
        self.queue_all();
    }

    /// Removes tips whose two neighbours coincide, unless they point into the polygon (a slit).
    fn drop_antennas(&mut self, ring: &[u32]) {
        for &start in ring {
            let mut tip = start;
            while self.left > 3 && self.alive[tip as usize] {
                let (a, b) = (self.prev[tip as usize], self.next[tip as usize]);
                if self.flat[a as usize] != self.flat[b as usize] || self.points_inwards(tip) {
                    break;
                }
                // What remains at the antenna's foot is one corner, perhaps the tip of a longer antenna.
                let after = self.next[b as usize];
                self.next[a as usize] = after;
                self.prev[after as usize] = a;
                self.alive[tip as usize] = false;
                self.alive[b as usize] = false;
                self.left -= 2;
                tip = a;
            }
        }
    }

    /// Whether the tip of a spike points into the interior angle at its foot.
    fn points_inwards(&self, tip: u32) -> bool {
        let foot = self.prev[tip as usize];
        let (before, after) = (self.prev[foot as usize], self.next[self.next[tip as usize] as usize]);
        let (left_of_first, left_of_second) = (self.sign(before, foot, tip) > 0.0, self.sign(foot, after, tip) > 0.0);
        if self.sign(before, foot, after) > 0.0 {
            left_of_first && left_of_second
        } else {
            self.flat[before as usize] != self.flat[after as usize] && (left_of_first || left_of_second)
        }
    }

    /// Positive where the boundary turns left at corner i.
    fn turn(&self, i: u32) -> f64 {
        self.sign(self.prev[i as usize], i, self.next[i as usize])
    }

    fn sign(&self, a: u32, b: u32, c: u32) -> f64 {
        orient2d(self.flat[a as usize], self.flat[b as usize], self.flat[c as usize])
    }

    fn queue_all(&mut self) {
        for k in 0..self.ring.len() {
            let i = self.ring[k];
            if self.alive[i as usize] {
                self.enqueue(i);
            }
        }
    }

    fn enqueue(&mut self, i: u32) {
        self.ticket[i as usize] += 1;
        self.queue.push_back((i, self.ticket[i as usize]));
    }

    /// Cuts every ear the queue leads to, and returns whether there was one.
    ///
    /// The neighbours of a cut ear go to the end of the queue, which keeps triangles from becoming a fan of slivers.
    fn clip_queued(&mut self, out: &mut Vec<[u32; 3]>) -> bool {
        let before = self.left;
        while let Some((i, ticket)) = self.queue.pop_front() {
            if self.left > 3 && self.alive[i as usize] && ticket == self.ticket[i as usize] && self.is_ear(i) {
                self.remove(i, out);
            }
        }
        self.left < before
    }

    fn is_ear(&self, i: u32) -> bool {
        if !self.convex[i as usize] {
            return false;
        }
        let corners = [self.prev[i as usize], i, self.next[i as usize]];
        let triangle = corners.map(|corner| self.flat[corner as usize]);
        let blocks = |q: u32| self.alive[q as usize] && !self.convex[q as usize] && self.blocks(q, corners);
        !self.blockers.any(triangle, blocks)
    }

    /// Whether corner q lies in the closed triangle, but does not coincide with one of its corners (the two sides of a bridge
    /// to a hole share positions).
    fn blocks(&self, q: u32, [a, b, c]: [u32; 3]) -> bool {
        let same_place = |i: u32| self.flat[i as usize] == self.flat[q as usize];
        self.sign(a, b, q) >= 0.0
            && self.sign(b, c, q) >= 0.0
            && self.sign(c, a, q) >= 0.0
            && !(same_place(a) || same_place(b) || same_place(c))
    }

    /// Removes corner i from the ring and emits its triangle, unless two of its corners coincide.
    fn remove(&mut self, i: u32, out: &mut Vec<[u32; 3]>) {
        let (p, n) = (self.prev[i as usize], self.next[i as usize]);
        self.emit([p, i, n], out);
        self.next[p as usize] = n;
        self.prev[n as usize] = p;
        self.alive[i as usize] = false;
        self.left -= 1;
        for k in [p, n] {
            self.convex[k as usize] = self.turn(k) > 0.0;
            self.enqueue(k);
        }
    }

    fn emit(&self, t: [u32; 3], out: &mut Vec<[u32; 3]>) {
        let [a, b, c] = t.map(|i| self.flat[i as usize]);
        if a != b && b != c && c != a {
            out.push(t);
        }
    }

    /// Removes every straight corner and spike from the ring, and returns whether there was one.
    fn clip_straight(&mut self, out: &mut Vec<[u32; 3]>) -> bool {
        let before = self.left;
        for k in 0..self.ring.len() {
            let i = self.ring[k];
            if self.left > 3 && self.alive[i as usize] && self.turn(i) == 0.0 {
                self.remove(i, out);
            }
        }
        self.left < before
    }

    /// First remaining corner that satisfies `wanted`.
    fn first(&self, wanted: impl Fn(&Self, u32) -> bool) -> Option<u32> {
        self.ring.iter().copied().find(|&i| self.alive[i as usize] && wanted(self, i))
    }

    /// Emits the last triangle, and returns the final outcome.
    fn finish(&self, outcome: Outcome, out: &mut Vec<[u32; 3]>) -> Outcome {
        let Some(i) = self.first(|_, _| true) else { return outcome };
        self.emit([self.prev[i as usize], i, self.next[i as usize]], out);
        match self.turn(i) {
            turn if turn > 0.0 => outcome,
            0.0 => outcome.max(Outcome::Degenerate),
            _ => Outcome::Crossing,
        }
    }

    /// Cuts the rest of a hopeless polygon as a fan.
    fn fan(&self, out: &mut Vec<[u32; 3]>) -> Outcome {
        if let Some(apex) = self.first(|_, _| true) {
            let mut i = self.next[apex as usize];
            while self.next[i as usize] != apex {
                self.emit([apex, i, self.next[i as usize]], out);
                i = self.next[i as usize];
            }
        }
        Outcome::Crossing
    }
}

impl Outcome {
    /// The worse of two outcomes.
    fn max(self, other: Self) -> Self {
        match (self, other) {
            (Self::Crossing, _) | (_, Self::Crossing) => Self::Crossing,
            (Self::Degenerate, _) | (_, Self::Degenerate) => Self::Degenerate,
            _ => Self::Exact,
        }
    }
}

/// Indices of the corners that differ from the previous one.
fn distinct_neighbours(points: &[DVec3]) -> Vec<u32> {
    let before = points.iter().cycle().skip(points.len().saturating_sub(1));
    #[expect(clippy::cast_possible_truncation, reason = "corner numbers are u32")]
    let distinct = points.iter().zip(before).enumerate().filter(|(_, (p, q))| p != q).map(|(i, _)| i as u32);
    distinct.collect()
}

/// Newell normal; if loops cancel each other, the normal of the largest corner triangle; for a straight polygon the axis
/// along which it is shortest.
fn any_normal(points: &[DVec3]) -> DVec3 {
    let normal = newell(points);
    if normal != DVec3::ZERO {
        return normal;
    }
    let corner = |w: &[DVec3]| (w[1] - w[0]).cross(w[2] - w[0]);
    let corners = points.windows(3).map(corner).filter(|&c| c != DVec3::ZERO);
    corners.max_by(|a, b| a.length_squared().total_cmp(&b.length_squared())).unwrap_or_else(|| {
        let box_of = |pick: fn(DVec3, DVec3) -> DVec3| points.iter().copied().reduce(pick).unwrap_or_default();
        let size = box_of(DVec3::max) - box_of(DVec3::min);
        if size.x <= size.y && size.x <= size.z {
            DVec3::X
        } else if size.y <= size.z {
            DVec3::Y
        } else {
            DVec3::Z
        }
    })
}

/// Drops the axis of the normal's largest component; counter-clockwise stays counter-clockwise.
fn project(p: DVec3, normal: DVec3) -> Coord<f64> {
    let size = normal.abs();
    let (x, y, towards) = if size.x >= size.y && size.x >= size.z {
        (p.y, p.z, normal.x)
    } else if size.y >= size.z {
        (p.z, p.x, normal.y)
    } else {
        (p.x, p.y, normal.z)
    };
    if towards < 0.0 { Coord { x: y, y: x } } else { Coord { x, y } }
}

/// Cuts a strictly convex quad along its shorter diagonal; at equal length along the one from its first corner.
fn convex_quad(flat: &[Coord<f64>], points: &[DVec3], ring: &[u32]) -> Option<[[u32; 3]; 2]> {
    let &[a, b, c, d] = ring else { return None };
    let at = |i: u32| flat[i as usize];
    let left = |i, j, k| orient2d(at(i), at(j), at(k)) > 0.0;
    if !(left(a, b, c) && left(b, c, d) && left(c, d, a) && left(d, a, b)) {
        return None;
    }
    shorter_diagonal(points, ring)
}

fn shorter_diagonal(points: &[DVec3], ring: &[u32]) -> Option<[[u32; 3]; 2]> {
    let &[a, b, c, d] = ring else { return None };
    let length = |i: u32, j: u32| points[i as usize].distance_squared(points[j as usize]);
    Some(if length(b, d) < length(a, c) { [[a, b, d], [b, c, d]] } else { [[a, b, c], [a, c, d]] })
}

#[cfg(test)]
mod tests;
