//! Progress display: a bar on a terminal, a plain line every few seconds elsewhere, nothing with `--quiet`.
//!
//! The bar covers load → build → render, or the parts of a measurement. Only work of known length has an estimated time left.

use super::interrupt;
use super::message::Messages;
use indicatif::{ProgressBar, ProgressStyle};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Interval of progress lines if stderr is no terminal.
const LINE_EVERY: Duration = Duration::from_secs(5);

/// Minimum elapsed time before the time left is estimated.
const TELLING: Duration = Duration::from_secs(1);

/// Progress of one picture.
pub(super) struct Progress<'a> {
    how: Display<'a>,
    /// Whether a signal ends the render, so that its tiles can be kept.
    cancellable: bool,
}

enum Display<'a> {
    Silent,
    Bar { bar: ProgressBar, messages: &'a Messages },
    Lines { name: String, messages: &'a Messages, stage: Mutex<Stage> },
}

struct Stage {
    doing: &'static str,
    started: Instant,
    last_line: Instant,
}

impl<'a> Progress<'a> {
    /// Progress of the picture of `name`.
    pub(super) fn new(name: &str, messages: &'a Messages, silent: bool, cancellable: bool) -> Self {
        use std::io::IsTerminal;
        let now = Instant::now();
        let how = if silent {
            Display::Silent
        } else if std::io::stderr().is_terminal() {
            let bar = messages.bars.add(ProgressBar::new_spinner());
            bar.set_prefix(name.to_owned());
            Display::Bar { bar, messages }
        } else {
            Display::Lines {
                name: name.into(),
                messages,
                stage: Mutex::new(Stage { doing: "", started: now, last_line: now }),
            }
        };
        Self { how, cancellable }
    }

    /// Begins a stage of unknown length: `loading`, `building`.
    pub(super) fn stage(&self, what: &str) {
        match &self.how {
            Display::Silent => {}
            Display::Bar { bar, .. } => {
                bar.set_style(style("{spinner} {prefix}: {msg} {elapsed}"));
                bar.set_message(what.to_owned());
                bar.enable_steady_tick(Duration::from_millis(120));
            }
            Display::Lines { .. } => {}
        }
    }

    /// Begins work of known length: `rendering`, `judging`; [`Self::advance`] reports its progress.
    pub(super) fn begin(&self, doing: &'static str) {
        match &self.how {
            Display::Silent => {}
            Display::Bar { bar, .. } => {
                bar.disable_steady_tick();
                bar.set_position(0);
                bar.reset_eta();
                bar.set_message(doing);
                bar.set_style(style("{prefix}: {msg} [{wide_bar}] {percent:>3} %  {elapsed} (ETA {eta})"));
            }
            Display::Lines { stage, .. } => {
                if let Ok(mut stage) = stage.lock() {
                    (stage.doing, stage.started) = (doing, Instant::now());
                }
            }
        }
    }

    /// Reports that work of unknown length continues.
    fn keep_alive(&self, doing: &'static str) {
        match &self.how {
            Display::Silent => {}
            Display::Bar { bar, .. } => {
                if bar.message() != doing {
                    self.stage(doing);
                }
            }
            Display::Lines { name, messages, stage } => {
                let Ok(mut stage) = stage.try_lock() else { return };
                if stage.last_line.elapsed() >= LINE_EVERY {
                    stage.last_line = Instant::now();
                    let seconds = stage.started.elapsed().as_secs();
                    messages.info("progress", format!("{name}: {doing}, for {seconds} s"));
                }
            }
        }
    }

    /// Reports that `done` of `total` parts are done.
    pub(super) fn advance(&self, done: usize, total: usize) {
        match &self.how {
            Display::Silent => {}
            Display::Bar { bar, .. } => {
                bar.set_length(total as u64);
                // Workers report out of order; the bar never moves back.
                if done as u64 > bar.position() {
                    bar.set_position(done as u64);
                }
            }
            Display::Lines { name, messages, stage } => {
                // If another worker is writing, there is nothing to add.
                let Ok(mut stage) = stage.try_lock() else { return };
                let elapsed = stage.started.elapsed();
                if stage.last_line.elapsed() >= LINE_EVERY && elapsed >= TELLING && done < total {
                    stage.last_line = Instant::now();
                    messages.info("progress", plain_line(name, stage.doing, done, total, elapsed));
                }
            }
        }
    }

    /// Removes the display.
    pub(super) fn finish(&self) {
        if let Display::Bar { bar, messages } = &self.how {
            bar.finish_and_clear();
            messages.bars.remove(bar);
        }
    }
}

impl Drop for Progress<'_> {
    fn drop(&mut self) {
        self.finish();
    }
}

impl crate::render::Progress for Progress<'_> {
    fn tiles(&self, done: usize, total: usize) {
        self.advance(done, total);
    }

    fn cancelled(&self) -> bool {
        self.cancellable && interrupt::raised()
    }

    fn plans(&self) {
        self.keep_alive("rendering parts to find out what it takes");
    }

    fn begins(&self) {
        self.begin("rendering");
    }
}

fn plain_line(name: &str, doing: &str, done: usize, total: usize, elapsed: Duration) -> String {
    let left = elapsed.as_secs_f64() * (total - done) as f64 / done.max(1) as f64;
    format!("{name}: {doing}, {} % done, about {left:.0} s left", 100 * done / total.max(1))
}

fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar()).progress_chars("=> ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_left_is_extrapolated_from_the_tiles_done() {
        let line = plain_line("a.obj", "rendering", 25, 100, Duration::from_secs(10));
        assert_eq!(line, "a.obj: rendering, 25 % done, about 30 s left");
        assert!(plain_line("a.obj", "rendering", 0, 0, Duration::ZERO).contains("0 %"));
    }
}
