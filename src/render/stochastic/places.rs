//! Where samples lie in their pixels, and the rays through these places.

use crate::accel::Accel;
use crate::render::draws::Stream;
use crate::render::eyes::Place;
use crate::render::frame::Frame;
use crate::render::observer::Observer;
use crate::render::sampling::Stochastic;
use crate::render::sobol;
use crate::render::whitted::Tracer;

/// A sample of a pixel.
#[derive(Clone, Copy)]
pub(super) struct Wanted {
    /// Column and row.
    pub pixel: (u32, u32),
    /// For all numbers of the pixel.
    pub key: u32,
    /// Its place in the pixel's sequence.
    pub index: u32,
}

/// Buffers.
#[derive(Default)]
pub(super) struct Places {
    many: sobol::Many,
    squares: Vec<[f64; 2]>,
}

impl Wanted {
    /// The place so far from the pixel's upper left corner, seen through a point of the lens.
    fn place(self, [x, y]: [f64; 2], lens: [f64; 2]) -> Place {
        Place { x: f64::from(self.pixel.0) + x, y: f64::from(self.pixel.1) + y, lens }
    }

    /// Where it goes through the picture and the lens. Its first two numbers are those without a lens.
    fn place_and_lens(self, how: &Stochastic) -> Place {
        let [x, y, u, v] = sobol::point(self.index, self.key);
        self.place([x, y].map(|number| how.filter.place(number)), [u, v])
    }
}

impl Places {
    /// Traces so many samples all together; `None` when cancelled.
    pub(super) fn trace<A: Accel, P: Observer>(
        &mut self,
        frame: &Frame,
        how: &Stochastic,
        tracer: &mut Tracer<A, P>,
        (wanted, count): (impl Iterator<Item = Wanted> + Clone, usize),
    ) -> Option<()> {
        tracer.reset(count, frame.settings.layers);
        let eye = frame.eye(tracer.center());
        // Nested iterators are quick from inside, and slow one after another.
        wanted.clone().for_each(|Wanted { key, index, .. }| tracer.streams.push(Stream { key, index }));
        if frame.settings.lens.is_some() {
            tracer.eyes.send(&eye, wanted.map(|sample| sample.place_and_lens(how)));
        } else {
            let Self { many, squares } = self;
            squares.clear();
            many.find(wanted.clone().map(|Wanted { key, index, .. }| (key, index)), squares);
            how.filter.place_each(squares.as_flattened_mut());
            let mut squares = squares.iter();
            let mut next = || squares.next().copied().unwrap_or_default();
            tracer.eyes.send(&eye, wanted.map(|sample| sample.place(next(), [0.5; 2])));
        }
        tracer.trace().then_some(())
    }
}
