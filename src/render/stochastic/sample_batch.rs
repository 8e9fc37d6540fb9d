//! Positions of samples in their pixels, and the rays through them.

use crate::accel::Accel;
use crate::math::simd::{Kernel, Level, Simd};
use crate::render::draws::Stream;
use crate::render::frame::{Frame, pixel_keys};
use crate::render::observer::Observer;
use crate::render::primary_rays::CameraSample;
use crate::render::roulette::Roulette;
use crate::render::sampling::{Filter, Stochastic};
use crate::render::sobol;
use crate::render::whitted::Tracer;

/// One sample of a pixel.
#[derive(Clone, Copy)]
pub(in crate::render) struct SampleRequest {
    /// Column and row.
    pub pixel: (u32, u32),
    /// Key of the pixel's random sequence.
    pub key: u32,
    /// Index in the pixel's sequence.
    pub index: u32,
}

/// Samples that are traced together, as columns.
#[derive(Default)]
pub(in crate::render) struct SampleBatch {
    keys: Vec<u32>,
    indices: Vec<u32>,
    /// Position from the upper left corner of the picture: of the pixel, then of the sample.
    x: Vec<f64>,
    y: Vec<f64>,
}

impl SampleBatch {
    /// Traces all these samples together; `None` when cancelled.
    pub(in crate::render) fn trace<A: Accel, P: Observer>(
        &mut self,
        frame: &Frame,
        how: &Stochastic,
        tracer: &mut Tracer<A, P>,
        roulette: Roulette,
        wanted: impl Iterator<Item = SampleRequest>,
    ) -> Option<()> {
        self.clear();
        let Self { keys, indices, x, y } = self;
        // Nested iterators are fast with internal iteration, and slow with `next`.
        wanted.for_each(|SampleRequest { pixel, key, index }| {
            keys.push(key);
            indices.push(index);
            x.push(f64::from(pixel.0));
            y.push(f64::from(pixel.1));
        });
        self.send(frame, how, roulette, tracer)
    }

    /// Traces the sample of this index of each pixel in these columns and rows.
    pub(in crate::render) fn trace_each<A: Accel, P: Observer>(
        &mut self,
        frame: &Frame,
        how: &Stochastic,
        tracer: &mut Tracer<A, P>,
        index: u32,
        columns: &[u32],
        rows: &[u32],
    ) -> Option<()> {
        self.clear();
        let Self { keys, indices, x, y } = self;
        *keys = pixel_keys(frame.settings.seed, (columns, rows));
        indices.resize(keys.len(), index);
        x.extend(columns.iter().map(|&column| f64::from(column)));
        y.extend(rows.iter().map(|&row| f64::from(row)));
        self.send(frame, how, Roulette::default(), tracer)
    }

    fn clear(&mut self) {
        self.keys.clear();
        self.indices.clear();
        self.x.clear();
        self.y.clear();
    }

    fn send<A: Accel, P: Observer>(
        &mut self,
        frame: &Frame,
        how: &Stochastic,
        roulette: Roulette,
        tracer: &mut Tracer<A, P>,
    ) -> Option<()> {
        let Self { keys, indices, x, y } = self;
        tracer.reset(keys.len(), frame.settings.layers, &frame.media);
        tracer.roulette = roulette;
        let eye = frame.eye(tracer.center());
        let streams = keys.iter().zip(&*indices).map(|(&key, &index)| Stream { key, index });
        if frame.settings.lens.is_some() {
            let pixels = x.iter().zip(&*y);
            tracer.by_chance.fill(true);
            tracer
                .primary_rays
                .send(&eye, streams.clone().zip(pixels).map(|(stream, (&x, &y))| through(how, stream, [x, y])));
        } else {
            Level::best().run(Draw { filter: how.filter, keys, indices, x, y });
            tracer.primary_rays.send_columns(&eye, x, y);
        }
        tracer.streams.extend(streams);
        tracer.trace().then_some(())
    }
}

/// Position of a sample in the picture and on the lens, for the pixel with this corner. The first two coordinates are the same
/// without a lens.
fn through(how: &Stochastic, Stream { key, index }: Stream, [x, y]: [f64; 2]) -> CameraSample {
    let [across, down, u, v] = sobol::point(index, key);
    CameraSample { x: x + how.filter.place(across), y: y + how.filter.place(down), lens: [u, v] }
}

/// Kernel that moves samples from the corners of their pixels to their positions.
struct Draw<'a> {
    filter: Filter,
    keys: &'a [u32],
    indices: &'a [u32],
    x: &'a mut [f64],
    y: &'a mut [f64],
}

impl Kernel for Draw<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        // The filter is matched outside the loop, which is then branch-free.
        match self.filter {
            Filter::Box => self.each(|u| u),
            Filter::Tent => self.each(|u| Filter::Tent.place(u)),
        }
    }
}

impl Draw<'_> {
    #[inline(always)]
    fn each(self, place: impl Fn(f64) -> f64) {
        let samples = self.x.iter_mut().zip(self.y).zip(self.keys.iter().zip(self.indices));
        for ((x, y), (&key, &index)) in samples {
            let [across, down] = sobol::square(index, key);
            *x += place(across);
            *y += place(down);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_drawn_side_by_side_lie_where_those_drawn_alone_do() {
        for filter in Filter::ALL.iter().copied() {
            let how = Stochastic { filter, ..Stochastic::default() };
            for count in [0, 1, 63, 64, 500] {
                let keys: Vec<u32> = (0..count).map(|i| sobol::mix(7, i)).collect();
                let indices: Vec<u32> = (0..count).map(|i| i * i % 257).collect();
                let mut x: Vec<f64> = (0..count).map(f64::from).collect();
                let mut y: Vec<f64> = (0..count).map(|i| f64::from(3 * i)).collect();
                let alone: Vec<CameraSample> = (0..count as usize)
                    .map(|i| through(&how, Stream { key: keys[i], index: indices[i] }, [x[i], y[i]]))
                    .collect();
                Level::best().run(Draw { filter, keys: &keys, indices: &indices, x: &mut x, y: &mut y });
                assert!(alone.iter().zip(x.iter().zip(&y)).all(|(place, (&x, &y))| [place.x, place.y] == [x, y]));
            }
        }
    }
}
