//! One tile in progress: its pixels as squares, and the squares that some of their quadrants became.

use super::judge::{Color, Judge, Span};
use super::lattice::{Found, Lattice, Point, Step};
use crate::accel::Accel;
use crate::render::frame::{Frame, Sum};
use crate::render::layers::LayerSum;
use crate::render::observer::Observer;
use crate::render::sampling::Adaptive;
use crate::render::tile::{Convergence, PixelFacts, TOGETHER, Tile, TilePixels};
use crate::render::whitted::{Sample, Tracer};
use std::ops::Range;

/// Offsets of the corners of a square, in sides.
const CORNERS: [Step; 4] = [(0, 0), (1, 0), (0, 1), (1, 1)];

/// A pixel, or a quadrant that became a square.
#[derive(Clone, Copy)]
struct Square {
    /// Upper left corner.
    at: Step,
    side: u32,
    /// Indices of the corner points, in the order of [`CORNERS`].
    corners: [u32; 4],
    middle: u32,
    quadrants: [Quadrant; 4],
}

/// A quarter of a square, at one of its corners.
#[derive(Clone, Copy)]
enum Quadrant {
    /// The mean of the corner and the middle; with the range of the points in it or on its border, and whether one was added
    /// since it was judged.
    Flat(Span, bool),
    /// Index of the square that the quadrant became.
    Split(u32),
}

/// A tile in progress.
pub(super) struct Plot {
    pub tile: Tile,
    pub lattice: Lattice,
    /// The pixels, in the order of the tile's places, then the squares split off them.
    squares: Vec<Square>,
    /// Index of the square of each pixel, row by row.
    pixels: Vec<u32>,
    /// Colour of each pixel, in the order of the squares, when all its quadrants were last judged.
    looked: Vec<Option<Color>>,
    /// Points traced or received since quadrants were last judged.
    fresh: Vec<Point>,
    /// Number of rays traced here.
    rays: u64,
}

impl Plot {
    /// Makes a tile none of whose points are traced; the lattice has `2 << levels` steps in a pixel.
    #[expect(clippy::cast_possible_truncation, reason = "a tile has a thousand pixels")]
    pub(super) fn new(tile: Tile, how: &Adaptive) -> Self {
        let (levels, least) = (how.levels.min(Adaptive::MAX_LEVELS), how.min_levels.min(how.levels));
        let lattice = Lattice::new(2 << levels);
        let pixels = vec![0; tile.pixels()];
        let looked = vec![None; pixels.len()];
        let mut plot = Self { tile, lattice, squares: Vec::new(), pixels, looked, fresh: Vec::new(), rays: 0 };
        let side = plot.lattice.pixel;
        for (number, (x, y)) in tile.places().enumerate() {
            let pixel = plot.pixel(x, y);
            plot.pixels[pixel] = number as u32;
            let corners = plot.corners((x * side, y * side), side);
            plot.square((x * side, y * side), side, corners);
        }
        for i in 0..plot.pixels.len() {
            plot.quarter(i, least);
        }
        plot
    }

    fn pixel(&self, x: u32, y: u32) -> usize {
        ((y - self.tile.y0) * (self.tile.x1 - self.tile.x0) + x - self.tile.x0) as usize
    }

    /// Splits a square and all of its quadrants, `times` levels deep.
    fn quarter(&mut self, i: usize, times: u32) {
        for quadrant in 0..if times > 0 { 4 } else { 0 } {
            let new = self.split(i, quadrant);
            self.quarter(new, times - 1);
        }
    }

    /// Indices of the corners of a square.
    fn corners(&mut self, (x, y): Step, side: u32) -> [u32; 4] {
        CORNERS.map(|(right, down)| self.lattice.point((x + right * side, y + down * side)))
    }

    /// Adds a square, and returns its index.
    fn square(&mut self, (x, y): Step, side: u32, corners: [u32; 4]) -> usize {
        let middle = self.lattice.middle((x + side / 2, y + side / 2));
        let quadrants = [Quadrant::Flat(Span::NOTHING, false); 4];
        self.squares.push(Square { at: (x, y), side, corners, middle, quadrants });
        self.squares.len() - 1
    }

    /// Splits a quadrant off as a square. One of its corners is the old square's, the opposite one the old middle.
    #[expect(clippy::cast_possible_truncation, reason = "a tile has a thousand pixels")]
    fn split(&mut self, i: usize, quadrant: usize) -> usize {
        let Square { at: (x, y), side, corners: old, middle, .. } = self.squares[i];
        let half = side / 2;
        let at = (x + CORNERS[quadrant].0 * half, y + CORNERS[quadrant].1 * half);
        let corners = std::array::from_fn(|corner| match corner {
            _ if corner == quadrant => old[quadrant],
            _ if corner == 3 - quadrant => middle,
            _ => self.lattice.point((at.0 + CORNERS[corner].0 * half, at.1 + CORNERS[corner].1 * half)),
        });
        let new = self.square(at, half, corners);
        self.squares[i].quadrants[quadrant] = Quadrant::Split(new as u32);
        new
    }

    /// Traces these points; `None` when cancelled.
    pub(super) fn trace<A: Accel, P: Observer>(
        &mut self,
        frame: &Frame,
        tracer: &mut Tracer<A, P>,
        points: &[Point],
    ) -> Option<()> {
        let pixel = self.lattice.pixel;
        for points in points.chunks(TOGETHER) {
            tracer.reset(points.len(), frame.settings.layers, &frame.media);
            let eye = frame.eye(tracer.center());
            tracer.primary_rays.send(&eye, points.iter().map(|point| Lattice::place(frame, pixel, point.at)));
            if !tracer.trace() {
                return None;
            }
            for (i, point) in points.iter().enumerate() {
                self.lattice.store(point.number, tracer.samples[i], tracer.firsts.get(i).copied());
            }
        }
        self.fresh.extend(points);
        self.rays += points.len() as u64;
        Some(())
    }

    /// Takes over a sample on the border of this tile.
    pub(super) fn take_border_point(&mut self, found: &Found, layers: bool) {
        let number = self.lattice.number(found.at);
        self.lattice.store(number, found.sample, layers.then_some(found.first));
        self.fresh.push(Point { at: found.at, number });
    }

    /// Judges every pixel that has new samples, and splits those of its quadrants that are worth it.
    pub(super) fn look(&mut self, judge: &Judge) {
        let mut touched = vec![false; self.pixels.len()];
        for Point { at, number } in std::mem::take(&mut self.fresh) {
            let Some(color) = self.color(judge, number) else { continue };
            let (columns, rows) = self.pixels_at(at);
            for (x, y) in rows.flat_map(|y| columns.clone().map(move |x| (x, y))) {
                let pixel = self.pixels[self.pixel(x, y)] as usize;
                if judge.looks_at_all() {
                    self.reach(pixel, at, color);
                }
                touched[pixel] = true;
            }
        }
        for pixel in (0..touched.len()).filter(|&pixel| touched[pixel]) {
            let Sum { radiance, through, .. } = self.sum(pixel);
            let color = judge.color(&Sample { radiance, through });
            // A quadrant not worth splitting before may be so in a pixel that has turned out darker.
            let is_other = self.looked[pixel].is_none_or(|looked| judge.is_other(looked, color));
            let all = is_other || !judge.looks_at_all();
            if all {
                self.looked[pixel] = Some(color);
            }
            self.refine(judge, pixel, color, all);
        }
    }

    fn color(&self, judge: &Judge, number: u32) -> Option<Color> {
        self.lattice.sample(number).map(|sample| judge.color(sample))
    }

    /// Columns and rows of the pixels that contain a point or touch it.
    fn pixels_at(&self, (x, y): Step) -> (Range<u32>, Range<u32>) {
        let (side, tile) = (self.lattice.pixel, self.tile);
        let beside = |at: u32, from: u32, to: u32| {
            let last = at / side;
            (last - u32::from(at.is_multiple_of(side) && last > 0)).max(from)..(last + 1).min(to)
        };
        (beside(x, tile.x0, tile.x1), beside(y, tile.y0, tile.y1))
    }

    /// Adds the colour at a point to the quadrants that contain or touch it.
    fn reach(&mut self, i: usize, at: Step, color: Color) {
        let Square { at: (x, y), side, .. } = self.squares[i];
        let half = side / 2;
        for (quadrant, (right, down)) in CORNERS.into_iter().enumerate() {
            let (left, top) = (x + right * half, y + down * half);
            if !(left..=left + half).contains(&at.0) || !(top..=top + half).contains(&at.1) {
                continue;
            }
            match &mut self.squares[i].quadrants[quadrant] {
                Quadrant::Flat(span, is_new) => {
                    span.add(color);
                    *is_new = true;
                }
                &mut Quadrant::Split(square) => self.reach(square as usize, at, color),
            }
        }
    }

    /// Splits the quadrants of a pixel, and of the squares in it, that are worth it given the pixel's colour: judges `all` of
    /// them, or only those with new samples.
    fn refine(&mut self, judge: &Judge, i: usize, pixel: Color, all: bool) {
        let square = self.squares[i];
        for (quadrant, state) in square.quadrants.into_iter().enumerate() {
            match state {
                Quadrant::Split(square) => self.refine(judge, square as usize, pixel, all),
                Quadrant::Flat(span, is_new) if all || is_new => {
                    if self.is_split(judge, &square, quadrant, &span, pixel) {
                        let new = self.split(i, quadrant);
                        if judge.looks_at_all() {
                            self.look_back(judge, new);
                        }
                    } else {
                        self.squares[i].quadrants[quadrant] = Quadrant::Flat(span, false);
                    }
                }
                Quadrant::Flat(..) => {}
            }
        }
    }

    #[expect(clippy::cast_precision_loss, reason = "a few hundred steps")]
    fn is_split(&self, judge: &Judge, square: &Square, quadrant: usize, span: &Span, pixel: Color) -> bool {
        // Squares of the last level have sides of two steps.
        if square.side <= 2 {
            return false;
        }
        if judge.looks_at_all() {
            let part = 0.5 * square.side as f32 / self.lattice.pixel as f32;
            return judge.matters(pixel, span, part * part);
        }
        match (self.color(judge, square.corners[quadrant]), self.color(judge, square.middle)) {
            (Some(corner), Some(middle)) => judge.differs(corner, middle),
            _ => false,
        }
    }

    /// Adds the samples that neighbours have on its border to a new square.
    fn look_back(&mut self, judge: &Judge, i: usize) {
        let Square { at: (x, y), side, corners, .. } = self.squares[i];
        let mut known = Vec::new();
        for (number, (right, down)) in corners.into_iter().zip(CORNERS) {
            let at = (x + right * side, y + down * side);
            known.extend(self.color(judge, number).map(|color| (at, color)));
        }
        self.lattice.on_border((x, y), side, &mut |at, number| {
            known.extend(self.color(judge, number).map(|color| (at, color)));
        });
        known.into_iter().for_each(|(at, color)| self.reach(i, at, color));
    }

    /// Colour of a square: ¼ of the sum over its corners X of (X + E)/2, with split quadrants replaced by their squares.
    fn sum(&self, i: usize) -> Sum {
        let square = &self.squares[i];
        let point = |number: u32| {
            let mut sum = Sum::default();
            self.lattice.sample(number).into_iter().for_each(|sample| sum.add(sample));
            sum
        };
        let middle = point(square.middle);
        let mut color = Sum::default();
        for (corner, quadrant) in square.corners.into_iter().zip(square.quadrants) {
            color = match quadrant {
                Quadrant::Split(quadrant) => color.plus(self.sum(quadrant as usize), 0.25),
                Quadrant::Flat(..) => color.plus(point(corner), 0.125).plus(middle, 0.125),
            };
        }
        color
    }

    /// Collects the points of a square and of all squares in it.
    fn points(&self, i: usize, points: &mut Vec<u32>) {
        let square = &self.squares[i];
        points.push(square.middle);
        points.extend(square.corners);
        for quadrant in square.quadrants {
            if let Quadrant::Split(quadrant) = quadrant {
                self.points(quadrant as usize, points);
            }
        }
    }

    /// Gathers the pixels of the tile. Layers come from the five rays that every pixel has, the middle first.
    pub(super) fn gather(&self, frame: &Frame) -> TilePixels {
        let mut done = TilePixels { rays: self.rays, ..TilePixels::empty(self.tile) };
        let mut points = Vec::new();
        for i in 0..self.pixels.len() {
            let (pixel, veil) = self.sum(i).resolve(frame.background);
            done.beauty.push(pixel);
            if frame.has_veil {
                done.veil.push(veil);
            }
            points.clear();
            self.points(i, &mut points);
            points.sort_unstable();
            points.dedup();
            let count = u32::try_from(points.len()).unwrap_or(u32::MAX);
            done.facts.push(PixelFacts { count, spare: 0, error: 0.0, convergence: Convergence::Unknown });
            if frame.settings.layers {
                let mut sum = LayerSum::default();
                let five = std::iter::once(self.squares[i].middle).chain(self.squares[i].corners);
                five.for_each(|point| sum.add(&self.lattice.first(point)));
                done.layers.push(sum.pixel(frame.view.eye, frame.view.forward));
            }
        }
        done
    }
}
