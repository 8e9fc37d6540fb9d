//! The interface of all programs that are compared.

use meshray::accel::{Pencil, Ray};

/// Answer to a ray: the prim hit, or `NO_PRIM`; for any-hit queries 0 or `NO_PRIM`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Answer {
    pub prim: u32,
    pub t: f32,
}

/// A built structure of one program.
pub(crate) trait Tracer {
    /// Name as printed.
    fn name(&self) -> String;

    /// Finds first hits, or any hits; `coherent` is a hint for programs that accept one.
    fn trace(&self, any: bool, coherent: bool, rays: Rays, answers: &mut [Answer]);
}

/// Rays in a packet.
pub(crate) const PACKET: usize = 16;

/// Sixteen rays side by side: origins, directions, ends.
pub(crate) type Packet = [[f32; PACKET]; 7];

/// The same rays one after another, in packets, and by axis, so that each program gets the layout that suits it.
#[derive(Clone, Copy)]
pub(crate) struct Rays<'a> {
    pub all: &'a [Ray],
    pub packets: &'a [Packet],
    /// Directions by axis, if all rays have the same origin.
    pub pencil: Option<Pencil<'a>>,
}

/// Groups rays into packets; the last one is padded with copies of its last ray.
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

/// Directions of rays, by axis.
pub(crate) fn directions(rays: &[Ray]) -> [Vec<f32>; 3] {
    [0, 1, 2].map(|k| rays.iter().map(|ray| ray.dir[k]).collect())
}
