//! What leaving out saves that a scene does not need: one picture rendered with and without it.

use super::clock::{Spread, processor_seconds};
use crate::render::{Job, render};

/// One picture rendered both ways.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pruning {
    /// Seconds of processor time of a rendering as usual.
    pub usual: Spread,
    /// The same with every code path on (`--no-prune`).
    pub everything: Spread,
    /// Whether the pixels were the same bits in all renderings.
    pub same: bool,
}

impl Pruning {
    /// Renders each of two jobs so many times on one thread, in turn. `None` when the thread cannot be started.
    pub fn measure(usual: &Job, everything: &Job, passes: usize) -> Option<Self> {
        let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().ok()?;
        let mut found = Self { same: true, ..Self::default() };
        let reference = alone.install(|| render(usual, &())).picture;
        for _ in 0..passes {
            for (job, seconds) in [(usual, &mut found.usual), (everything, &mut found.everything)] {
                let (rendered, spent) = alone.install(|| processor_seconds(|| render(job, &())));
                seconds.push(spent);
                found.same &= rendered.picture == reference;
            }
        }
        Some(found)
    }

    /// The part of the time with everything on that leaving out saves; negative where it costs.
    pub fn saved(&self) -> f64 {
        1.0 - self.usual.median() / self.everything.median()
    }

    /// What was found, in a sentence.
    pub fn sentence(&self) -> String {
        use super::report::number::seconds;
        let pixels = if self.same { "the pixels are the same" } else { "the pixels DIFFER" };
        let saves = match 100.0 * self.saved() {
            saved if saved >= 0.5 => format!("saves {saved:.0} % of rendering this picture"),
            _ => "saves nothing that can be told in rendering this picture".into(),
        };
        let passes = match self.usual.len() {
            1 => "one pass only, so of unknown spread".into(),
            n => format!("medians of {n} interleaved"),
        };
        format!(
            "leaving out what the scene does not need {saves}: {} of processor time, {} with everything on (--no-prune), \
             {passes}; {pixels}",
            seconds(self.usual.median()),
            seconds(self.everything.median()),
        )
    }
}
