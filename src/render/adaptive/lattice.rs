//! The lattice of points that all pixels share, and the samples of one tile's points.

use crate::render::frame::{Frame, on_lens, pixel_key};
use crate::render::layers::FirstSurface;
use crate::render::primary_rays::CameraSample;
use crate::render::sampling::Adaptive;
use crate::render::whitted::Sample;
use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

/// Lattice coordinates of a point: steps from the picture's upper left corner.
pub(super) type Step = (u32, u32);

/// A point, with its index in a tile.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    pub at: Step,
    pub number: u32,
}

/// The sample of a point's ray.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    pub at: Step,
    pub sample: Sample,
    pub first: FirstSurface,
}

/// The points of a tile and of its border.
pub(super) struct Lattice {
    /// Steps in a pixel.
    pub pixel: u32,
    /// Indices of all points but the middles of squares, which no other square shares.
    numbers: HashMap<Step, u32, BuildHasherDefault<Spread>>,
    /// Sample of each point; `None`: not traced yet.
    samples: Vec<Option<Sample>>,
    /// First surface at each point; empty unless layers are wanted.
    firsts: Vec<FirstSurface>,
    /// Points to trace: asked for, but not yet traced.
    pub wanted: Vec<Point>,
}

impl Lattice {
    pub(super) fn new(pixel: u32) -> Self {
        Self { pixel, numbers: HashMap::default(), samples: Vec::new(), firsts: Vec::new(), wanted: Vec::new() }
    }

    /// Index of a point, which is added to the wanted ones if it is new.
    pub(super) fn point(&mut self, at: Step) -> u32 {
        let next = self.next();
        let number = self.number(at);
        if number == next {
            self.wanted.push(Point { at, number });
        }
        number
    }

    /// Index of the middle of a new square, which is added to the wanted points.
    pub(super) fn middle(&mut self, at: Step) -> u32 {
        let number = self.next();
        self.samples.push(None);
        self.wanted.push(Point { at, number });
        number
    }

    /// Index of a point that other squares may share, assigned if it is new.
    pub(super) fn number(&mut self, at: Step) -> u32 {
        let next = self.next();
        let number = *self.numbers.entry(at).or_insert(next);
        if number == next {
            self.samples.push(None);
        }
        number
    }

    #[expect(clippy::cast_possible_truncation, reason = "a tile has a thousand pixels")]
    fn next(&self) -> u32 {
        self.samples.len() as u32
    }

    /// Sample of the point with this index; `None`: not traced yet.
    pub(super) fn sample(&self, number: u32) -> Option<&Sample> {
        self.samples[number as usize].as_ref()
    }

    /// First surface at the point, where layers are wanted.
    pub(super) fn first(&self, number: u32) -> FirstSurface {
        self.firsts.get(number as usize).copied().unwrap_or(FirstSurface::NONE)
    }

    /// Index of a traced point that is not the middle of a square.
    fn traced(&self, at: Step) -> Option<u32> {
        self.numbers.get(&at).copied().filter(|&number| self.sample(number).is_some())
    }

    /// Stores the sample of the point with this index.
    pub(super) fn store(&mut self, number: u32, sample: Sample, first: Option<FirstSurface>) {
        self.samples[number as usize] = Some(sample);
        if let Some(first) = first {
            self.firsts.resize(self.samples.len(), FirstSurface::NONE);
            self.firsts[number as usize] = first;
        }
    }

    /// Sample at a traced point that is not the middle of a square.
    pub(super) fn found(&self, at: Step) -> Option<Found> {
        let number = self.traced(at)?;
        self.sample(number).map(|&sample| Found { at, sample, first: self.first(number) })
    }

    /// Samples in lattice row `y`.
    pub(super) fn row(&self, y: u32) -> impl Iterator<Item = Found> {
        self.numbers.keys().filter(move |&&(_, row)| row == y).filter_map(|&at| self.found(at))
    }

    /// Visits the traced points on the border of a square, except its corners.
    ///
    /// Where the middle of an edge was not traced, no point of that edge was: squares get smaller by halves.
    pub(super) fn on_border(&self, (x, y): Step, side: u32, each: &mut impl FnMut(Step, u32)) {
        let ends = [((x, y), (1, 0)), ((x, y + side), (1, 0)), ((x, y), (0, 1)), ((x + side, y), (0, 1))];
        for (at, along) in ends {
            self.on_edge(at, along, side, each);
        }
    }

    fn on_edge(&self, (x, y): Step, along: Step, length: u32, each: &mut impl FnMut(Step, u32)) {
        let half = length / 2;
        let middle = (x + along.0 * half, y + along.1 * half);
        if half > 0
            && let Some(number) = self.traced(middle)
        {
            each(middle, number);
            self.on_edge((x, y), along, half, each);
            self.on_edge(middle, along, half, each);
        }
    }

    /// Position of a point in the picture, exact; its ray depends on nothing else.
    pub(super) fn place(frame: &Frame, pixel: u32, (x, y): Step) -> CameraSample {
        /// Upper bound of the steps in a pixel of any lattice.
        const FINEST: u32 = 2 << Adaptive::MAX_LEVELS;
        let finest = |steps: u32| steps.wrapping_mul(FINEST / pixel);
        let key = pixel_key(frame.settings.seed, (finest(x), finest(y)));
        let lens = on_lens(frame.settings.lens, key, 0);
        CameraSample { x: f64::from(x) / f64::from(pixel), y: f64::from(y) / f64::from(pixel), lens }
    }
}

/// Hashes points for a table: the keys are our own, so that no attacker can aim at collisions.
#[derive(Default)]
struct Spread(u64);

impl Hasher for Spread {
    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|&byte| self.write_u32(byte.into()));
    }

    fn write_u32(&mut self, n: u32) {
        self.0 = (self.0.rotate_left(32) ^ u64::from(n)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }

    fn finish(&self) -> u64 {
        self.0 ^ (self.0 >> 32)
    }
}
