//! Profile of a rendering: the time of each ray class in the structure, and of everything else.

use super::by_class::ByClass;
use super::observer::{Observer, Question};
use super::{Job, Progress, Rendered, render_with};
use crate::accel::{Hit, Probe, Ray};
use crate::stopwatch::{Spent, Stopwatch};
use std::time::{Duration, Instant};

/// Times of a rendering.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Profile {
    /// Work done once per picture: lights, sky, limits.
    pub prepare: Spent,
    /// All tiles.
    pub tiles: Spent,
    /// Share of the tiles' processor time that each ray class spent in the structure, in the order of [`super::CLASS_NAMES`].
    pub trace: [Duration; 4],
    /// Rays of each class.
    pub rays: [u64; 4],
}

impl Profile {
    /// Processor time of the tiles outside the structure: setting up rays, surfaces, shading, sums.
    pub fn shade(&self) -> Duration {
        self.tiles.cpu.saturating_sub(self.trace.iter().sum())
    }
}

/// Renders on all threads of the current rayon pool and times each slice of rays; same pixels.
pub fn render_profiled(job: &Job, progress: &dyn Progress) -> (Rendered, Profile) {
    let (mut watch, mut prepare) = (Stopwatch::of_all_threads(), Spent::default());
    let (rendered, clocks) = render_with::<Clock>(job, progress, || prepare = watch.lap());
    let tiles = watch.lap();
    let (trace, rays) = shares(clocks, tiles.cpu);
    (rendered, Profile { prepare, tiles, trace, rays })
}

/// Processor time and rays of each class: slices are timed by the wall clock, which is cheapest to read, and the excess that
/// waiting threads measure is removed from all classes in proportion.
fn shares(threads: Vec<ByClass<Clock>>, cpu: Duration) -> ([Duration; 4], [u64; 4]) {
    let (mut busy, mut walked, mut rays) = (Duration::ZERO, [Duration::ZERO; 4], [0; 4]);
    for mut thread in threads {
        busy += thread.primary.since_first();
        for ((clock, walked), rays) in thread.each_mut().into_iter().zip(&mut walked).zip(&mut rays) {
            *walked += clock.before + clock.walking;
            *rays += clock.rays;
        }
    }
    let most = if cpu.is_zero() { 1.0 } else { (cpu.as_secs_f64() / busy.as_secs_f64().max(1e-9)).min(1.0) };
    (walked.map(|w| w.mul_f64(most)), rays)
}

/// Time spent on the rays of one class.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Clock {
    /// Beginning of the first batch, beginning of this batch, and time of the last answer.
    first: Option<Instant>,
    pub(super) began: Option<Instant>,
    last: Option<Instant>,
    /// Time at which the last query began.
    asked: Option<Instant>,
    /// Time in the structure: in this batch, and in earlier ones.
    pub(super) walking: Duration,
    before: Duration,
    rays: u64,
}

impl Clock {
    /// Time from the first batch to the last answer, or to the beginning of the last batch if that is later.
    fn since_first(&self) -> Duration {
        let end = self.last.max(self.began);
        self.first.zip(end).map_or(Duration::ZERO, |(first, end)| end.saturating_duration_since(first))
    }
}

// Walks are not probed: the timed code is the code that runs without a clock.
impl Probe for Clock {
    const SILENT: bool = true;
}

impl Observer for Clock {
    const FILTERS_ALPHA: bool = true;

    fn asked(&mut self, _question: Question, rays: &[Ray], _after: &[Hit]) {
        self.rays += rays.len() as u64;
        self.asked = Some(Instant::now());
    }

    fn answered(&mut self, _hits: &[Hit]) {
        let now = Instant::now();
        self.walking += self.asked.map_or(Duration::ZERO, |asked| now.saturating_duration_since(asked));
        self.last = Some(now);
    }

    fn batch(&mut self, _samples: usize) {
        let now = Instant::now();
        self.first.get_or_insert(now);
        self.began = Some(now);
        self.before += std::mem::take(&mut self.walking);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::NO_PRIM;
    use crate::math::Vec3;

    fn ask(clock: &mut Clock, rays: usize) {
        let ray = Ray { origin: Vec3::ZERO, t_min: 0.0, dir: Vec3::Z, t_max: 1.0, exclude: NO_PRIM, sample: 0 };
        clock.asked(Question::Closest, &vec![ray; rays], &[]);
        std::thread::sleep(Duration::from_millis(4));
        clock.answered(&[]);
    }

    #[test]
    fn a_class_keeps_its_time_and_rays_over_all_batches() {
        let mut classes = ByClass::<Clock>::default();
        for _ in 0..2 {
            classes.each_mut().into_iter().for_each(|c| c.batch(1));
            ask(&mut classes.primary, 3);
            ask(&mut classes.shadow, 2);
            std::thread::sleep(Duration::from_millis(4));
        }
        let all = Duration::from_millis(100);
        let (walked, rays) = shares(vec![classes], all);
        assert_eq!(rays, [6, 4, 0, 0]);
        assert!(walked[0] >= Duration::from_millis(8) && walked[1] >= Duration::from_millis(8), "{walked:?}");
        assert_eq!(walked[2], Duration::ZERO);
    }

    #[test]
    fn the_classes_never_take_more_than_the_processors_gave() {
        let mut classes = ByClass::<Clock>::default();
        classes.each_mut().into_iter().for_each(|c| c.batch(1));
        ask(&mut classes.primary, 1);
        let cpu = Duration::from_micros(1);
        let (walked, _) = shares(vec![classes], cpu);
        assert!(walked.iter().sum::<Duration>() <= cpu, "{walked:?}");
    }
}
