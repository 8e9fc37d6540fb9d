//! What every program that is compared can do.

use meshray::accel::{Pencil, Ray};

/// What a ray met: the prim, or `NO_PRIM`; for rays that ask for any hit, 0 or `NO_PRIM`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Answer {
    pub prim: u32,
    pub t: f32,
}

/// A built structure of some program.
pub(crate) trait Tracer {
    /// As printed.
    fn name(&self) -> String;

    /// Asks for the first hits, or for any; `coherent` is what those who know may tell.
    fn trace(&self, any: bool, coherent: bool, rays: Rays, answers: &mut [Answer]);
}

/// Rays of a packet.
pub(crate) const PACKET: usize = 16;

/// Sixteen rays side by side: origins, directions, ends.
pub(crate) type Packet = [[f32; PACKET]; 7];

/// The same rays one after another, in packets, and by axis, so that each program finds them as it likes them.
#[derive(Clone, Copy)]
pub(crate) struct Rays<'a> {
    pub all: &'a [Ray],
    pub packets: &'a [Packet],
    /// The directions by axis, where all start at one place.
    pub pencil: Option<Pencil<'a>>,
}

/// Rays in packets; the last one may be filled up with what it has.
pub(crate) fn packets(rays: &[Ray]) -> Vec<Packet> {
    let packet = |rays: &[Ray]| {
        let mut packet = [[0.0; PACKET]; 7];
        for lane in 0..PACKET {
            let ray = &rays[lane.min(rays.len() - 1)];
            let [o, d] = [ray.origin, ray.dir];
            for (row, x) in packet.iter_mut().zip([o.x, o.y, o.z, d.x, d.y, d.z, ray.t_max]) {
                row[lane] = x;
            }
        }
        packet
    };
    rays.chunks(PACKET).map(packet).collect()
}

/// The directions of rays, by axis.
pub(crate) fn directions(rays: &[Ray]) -> [Vec<f32>; 3] {
    [0, 1, 2].map(|k| rays.iter().map(|ray| ray.dir[k]).collect())
}
