//! Adaptive sampling of a tile: five rays in a square, and smaller squares in those of its quadrants where they differ.
//!
//! A pixel is ¼ of the sum over its corners X of (X + E)/2, E being its middle; where X and E differ, the quadrant's part
//! is that of a square of its own, whose corners are X, E and the middles of two edges: at most three new rays, and fewer
//! where a neighbour has traced a middle. Points lie on a lattice that all pixels share, and a ray depends on nothing but
//! its point, so that those on the border of two tiles are the same in both.

use super::eyes::Place;
use super::frame::{Frame, Sum, compared, on_lens, pixel_key};
use super::layers::{Facts, LayerSum};
use super::observer::Observer;
use super::sampling::Adaptive;
use super::tile::{End, PixelFacts, TOGETHER, Tile, TilePixels};
use super::whitted::{Sample, Tracer};
use crate::accel::Accel;
use std::collections::HashMap;

/// A point of the lattice: steps from the tile's upper left corner.
type Step = (u32, u32);

/// Where the corners of a square are, in its sides.
const CORNERS: [Step; 4] = [(0, 0), (1, 0), (0, 1), (1, 1)];

/// A square, or a quadrant of one that became a square.
struct Square {
    /// Its upper left corner.
    at: Step,
    side: u32,
    /// Points, in the order of [`CORNERS`].
    corners: [usize; 4],
    middle: usize,
    /// Its quadrants that became squares.
    quadrants: [Option<usize>; 4],
}

/// What was found at the points of the lattice.
struct Lattice {
    /// Steps in a pixel.
    pixel: u32,
    numbers: HashMap<Step, usize>,
    /// Points that wait to be traced.
    waiting: Vec<Step>,
    samples: Vec<Sample>,
    facts: Vec<Facts>,
}

/// Renders one tile; `None` when cancelled.
pub(super) fn render<A: Accel, P: Observer>(
    frame: &Frame,
    how: &Adaptive,
    tracer: &mut Tracer<A, P>,
    tile: Tile,
) -> Option<TilePixels> {
    let levels = how.levels.min(Adaptive::MAX_LEVELS);
    let mut lattice = Lattice::new(2 << levels);
    let side = lattice.pixel;
    let pixel = |(x, y): (u32, u32)| ((x - tile.x0) * side, (y - tile.y0) * side);
    let mut squares: Vec<Square> = tile.places().map(|at| lattice.square(pixel(at), side)).collect();
    let pixels = squares.len();
    let mut begin = 0;
    for level in 0..=levels {
        lattice.trace(frame, tracer, tile)?;
        let end = squares.len();
        for i in if level < levels { begin..end } else { end..end } {
            for quadrant in lattice.split(frame, how, &squares[i]) {
                let (x, y) = squares[i].at;
                let half = squares[i].side / 2;
                let at = (x + CORNERS[quadrant].0 * half, y + CORNERS[quadrant].1 * half);
                squares[i].quadrants[quadrant] = Some(squares.len());
                squares.push(lattice.square(at, half));
            }
        }
        begin = end;
    }
    Some(lattice.gather(frame, tile, &squares, pixels))
}

impl Lattice {
    fn new(pixel: u32) -> Self {
        let (waiting, samples, facts) = (Vec::new(), Vec::new(), Vec::new());
        Self { pixel, numbers: HashMap::new(), waiting, samples, facts }
    }

    /// The number of a point, which is traced with the next ones if it has not been.
    fn point(&mut self, at: Step) -> usize {
        let next = self.numbers.len();
        *self.numbers.entry(at).or_insert_with(|| {
            self.waiting.push(at);
            next
        })
    }

    fn square(&mut self, (x, y): Step, side: u32) -> Square {
        let corners = CORNERS.map(|(right, down)| self.point((x + right * side, y + down * side)));
        let middle = self.point((x + side / 2, y + side / 2));
        Square { at: (x, y), side, corners, middle, quadrants: [None; 4] }
    }

    /// Traces all points that wait.
    fn trace<A: Accel, P: Observer>(&mut self, frame: &Frame, tracer: &mut Tracer<A, P>, tile: Tile) -> Option<()> {
        for points in self.waiting.chunks(TOGETHER) {
            tracer.reset(points.len(), frame.settings.layers);
            let eye = frame.eye(tracer.center());
            tracer.eyes.send(&eye, points.iter().map(|&at| self.place(frame, tile, at)));
            if !tracer.trace() {
                return None;
            }
            self.samples.extend(&tracer.samples);
            self.facts.extend(&tracer.facts);
        }
        self.waiting.clear();
        Some(())
    }

    /// The place of a point in the picture, exactly.
    fn place(&self, frame: &Frame, tile: Tile, (x, y): Step) -> Place {
        /// Steps in a pixel that no lattice exceeds.
        const FINEST: u32 = 2 << Adaptive::MAX_LEVELS;
        let within = |steps: u32| f64::from(steps) / f64::from(self.pixel);
        let everywhere = |start: u32, steps: u32| start * FINEST + steps * (FINEST / self.pixel);
        let key = pixel_key(frame.settings.seed, (everywhere(tile.x0, x), everywhere(tile.y0, y)));
        let lens = on_lens(frame.settings.lens, key, 0);
        Place { x: f64::from(tile.x0) + within(x), y: f64::from(tile.y0) + within(y), lens }
    }

    /// The quadrants whose corner differs from the middle.
    fn split(&self, frame: &Frame, how: &Adaptive, square: &Square) -> impl Iterator<Item = usize> + use<> {
        let seen = |point: usize| compared(how, &self.samples[point], frame.background);
        let middle = seen(square.middle);
        let differs = |point: usize| seen(point).iter().zip(middle).any(|(x, e)| (x - e).abs() > how.threshold);
        let split = square.corners.map(differs);
        (0..4).filter(move |&quadrant| split[quadrant])
    }

    fn color(&self, squares: &[Square], square: &Square) -> Sum {
        let point = |number: usize| {
            let mut sum = Sum::default();
            sum.add(&self.samples[number]);
            sum
        };
        let middle = point(square.middle);
        let mut color = Sum::default();
        for (corner, quadrant) in square.corners.into_iter().zip(square.quadrants) {
            color = match quadrant {
                Some(quadrant) => color.plus(self.color(squares, &squares[quadrant]), 0.25),
                None => color.plus(point(corner), 0.125).plus(middle, 0.125),
            };
        }
        color
    }

    /// The points of a square and of all squares in it.
    fn points(squares: &[Square], square: &Square, points: &mut Vec<usize>) {
        points.push(square.middle);
        points.extend(square.corners);
        square.quadrants.iter().flatten().for_each(|&quadrant| Self::points(squares, &squares[quadrant], points));
    }

    /// Layers come of the five rays that every pixel has, the middle first.
    fn gather(&self, frame: &Frame, tile: Tile, squares: &[Square], pixels: usize) -> TilePixels {
        let mut done = TilePixels { tile, rays: self.samples.len() as u64, ..TilePixels::empty(tile) };
        let mut points = Vec::new();
        for square in &squares[..pixels] {
            done.beauty.push(self.color(squares, square).resolve(frame.background));
            points.clear();
            Self::points(squares, square, &mut points);
            points.sort_unstable();
            points.dedup();
            let count = u32::try_from(points.len()).unwrap_or(u32::MAX);
            done.facts.push(PixelFacts { count, error: 0.0, end: End::Unknown });
            if frame.settings.layers {
                let mut sum = LayerSum::default();
                std::iter::once(square.middle).chain(square.corners).for_each(|point| sum.add(&self.facts[point]));
                done.layers.push(sum.pixel(frame.view.eye, frame.view.forward));
            }
        }
        done
    }
}
