//! Saving of pruning, which leaves out code paths that a scene does not need: one picture rendered with and without it.

use super::clock::{Spread, processor_seconds};
use crate::render::{Job, render};

/// Times of one picture rendered with and without pruning.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pruning {
    /// CPU seconds of a pruned rendering.
    pub usual: Spread,
    /// CPU seconds with every code path on (`--no-prune`).
    pub everything: Spread,
    /// Whether all renderings gave bit-identical pixels.
    pub same: bool,
}

impl Pruning {
    /// Renders each of the two jobs `passes` times on one thread, alternately. `None` if the thread cannot be started.
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

    /// Part of the unpruned time that pruning saves; negative where it costs time.
    pub fn saved(&self) -> f64 {
        1.0 - self.usual.median() / self.everything.median()
    }

    /// Result as a sentence.
    pub fn sentence(&self) -> String {
        use crate::number::seconds;
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_one_pass_shows_is_told_as_such_and_a_loss_is_no_saving() {
        let of = |usual: &[f64], everything: &[f64]| {
            let spread = |times: &[f64]| {
                let mut spread = Spread::default();
                times.iter().for_each(|&seconds| spread.push(seconds));
                spread
            };
            Pruning { usual: spread(usual), everything: spread(everything), same: true }.sentence()
        };
        let saved = of(&[1.0, 1.0, 1.0], &[4.0, 4.0, 4.0]);
        assert!(saved.contains("saves 75 %") && saved.contains("medians of 3 interleaved"), "{saved}");
        let lost = of(&[3.0], &[2.0]);
        assert!(lost.contains("saves nothing that can be told") && lost.contains("one pass only"), "{lost}");
    }
}
