//! Wall-clock and processor time: what the time of a picture was spent on.
//!
//! Stages are told apart by a handful of readings a picture, so that a profile costs nothing when it was not requested.

use std::iter::Sum;
use std::ops::{Add, AddAssign, Sub};
use std::time::{Duration, Instant};

/// Time spent on a piece of work.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Spent {
    /// Wall-clock time.
    pub wall: Duration,
    /// Processor time, all threads together; zero where the system does not report it (anything but Unix and Windows).
    pub cpu: Duration,
}

impl Add for Spent {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { wall: self.wall + other.wall, cpu: self.cpu + other.cpu }
    }
}

impl AddAssign for Spent {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

/// Time of a stage without one of its parts; never negative, though two clocks may disagree.
impl Sub for Spent {
    type Output = Self;

    fn sub(self, part: Self) -> Self {
        Self { wall: self.wall.saturating_sub(part.wall), cpu: self.cpu.saturating_sub(part.cpu) }
    }
}

impl Sum for Spent {
    fn sum<I: Iterator<Item = Self>>(parts: I) -> Self {
        parts.fold(Self::default(), Add::add)
    }
}

/// A running watch.
#[derive(Clone, Copy, Debug)]
pub struct Stopwatch {
    whose: Scope,
    wall: Instant,
    cpu: Duration,
}

/// Whose processor time a watch measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Scope {
    Process,
    Thread,
}

impl Stopwatch {
    /// Starts a watch for the time of all threads together.
    pub fn of_all_threads() -> Self {
        Self::start(Scope::Process)
    }

    /// Starts a watch for the time of this thread; call [`Self::read`] on the same thread.
    pub fn of_this_thread() -> Self {
        Self::start(Scope::Thread)
    }

    fn start(whose: Scope) -> Self {
        Self { whose, wall: Instant::now(), cpu: processor(whose) }
    }

    /// Time since the start.
    pub fn read(&self) -> Spent {
        Spent { wall: self.wall.elapsed(), cpu: processor(self.whose).saturating_sub(self.cpu) }
    }

    /// Time since the start or the last lap.
    pub fn lap(&mut self) -> Spent {
        let spent = self.read();
        self.wall += spent.wall;
        self.cpu += spent.cpu;
        spent
    }
}

/// Processor time of the process so far, from before its first instruction.
pub fn processor_since_start() -> Duration {
    processor(Scope::Process)
}

#[cfg(unix)]
fn processor(whose: Scope) -> Duration {
    use nix::time::{ClockId, clock_gettime};
    let time = clock_gettime(match whose {
        Scope::Process => ClockId::CLOCK_PROCESS_CPUTIME_ID,
        Scope::Thread => ClockId::CLOCK_THREAD_CPUTIME_ID,
    });
    time.map(Duration::from).unwrap_or_default()
}

/// Processor time; for a thread the wall-clock time, as Windows counts threads in whole ticks, about sixty-four a second.
#[cfg(not(unix))]
fn processor(whose: Scope) -> Duration {
    static FIRST: std::sync::LazyLock<Instant> = std::sync::LazyLock::new(Instant::now);
    match whose {
        Scope::Thread => FIRST.elapsed(),
        #[cfg(windows)]
        Scope::Process => cpu_time::ProcessTime::now().as_duration(),
        #[cfg(not(windows))]
        Scope::Process => Duration::ZERO,
    }
}

/// Peak memory of the process, in bytes; only Linux reports it.
pub fn peak_memory() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spin() {
        let start = Instant::now();
        while start.elapsed() < Duration::from_millis(5) {
            std::hint::black_box(start);
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_sleeping_thread_spends_time_on_the_wall_and_none_of_the_processor() {
        let watch = Stopwatch::of_this_thread();
        std::thread::sleep(Duration::from_millis(40));
        let spent = watch.read();
        assert!(spent.wall >= Duration::from_millis(40) && spent.cpu < Duration::from_millis(30), "{spent:?}");
    }

    #[test]
    fn laps_add_up_to_the_whole() {
        let whole = Stopwatch::of_this_thread();
        let mut laps = whole;
        spin();
        let first = laps.lap();
        spin();
        let both = first + laps.lap();
        let all = whole.read();
        assert!(first.wall >= Duration::from_millis(5) && both.wall <= all.wall && both.cpu <= all.cpu);
        assert!(both.wall >= Duration::from_millis(10), "{both:?}");
    }

    #[test]
    fn what_is_left_of_a_stage_is_never_negative() {
        let (short, long) = (Duration::from_millis(1), Duration::from_millis(3));
        let left = Spent { wall: long, cpu: short } - Spent { wall: short, cpu: long };
        assert_eq!(left, Spent { wall: long - short, cpu: Duration::ZERO });
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn memory_once_held_stays_in_the_peak() {
        let before = peak_memory().unwrap();
        let block = vec![1u8; 64 << 20];
        std::hint::black_box(&block);
        drop(block);
        assert!(peak_memory().unwrap() >= before.max(64 << 20));
    }
}
