//! Worker threads and their processor affinity.
//!
//! A pool that has one thread for every processor of the process pins each thread to its own. Left to itself, Linux wakes
//! the threads of a short job on the processor of their waker: while one works the other waits for the same processor, idle
//! threads that look for work before they sleep keep it from being moved, and another processor stays idle. Building over
//! 70,000 triangles took two threads as long as one that way.

use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

/// Builds a pool of `threads` threads; 0 means as many as there are processors that this process may use.
///
/// Threads that are started by its threads inherit their affinity, unless they are started in [`anywhere`].
///
/// # Errors
/// If the system starts no more threads.
pub fn pool(threads: usize) -> Result<ThreadPool, ThreadPoolBuildError> {
    let processors = processors::all();
    let threads = if threads == 0 { available() } else { threads };
    let keep = move |thread: usize| {
        if let Some(processor) = processors.get(thread).filter(|_| processors.len() == threads) {
            processors::keep_to(&[*processor]);
        }
    };
    ThreadPoolBuilder::new().num_threads(threads).start_handler(keep).build()
}

/// Number of processors that this process may use, at least 1; fewer where a container limits their time.
pub fn available() -> usize {
    let anywhere = || std::thread::available_parallelism().map_or(1, usize::from);
    self::anywhere(anywhere)
}

/// Runs `work`, which starts threads of its own: they run on any processor, whatever this thread is pinned to.
pub fn anywhere<T>(work: impl FnOnce() -> T) -> T {
    /// Restores the affinity of the thread, also when the work panics.
    struct Back(Vec<usize>);
    impl Drop for Back {
        fn drop(&mut self) {
            processors::keep_to(&self.0);
        }
    }
    let (here, all) = (processors::of_this_thread(), processors::all());
    if here.is_empty() || here == all {
        return work();
    }
    let _back = Back(here);
    processors::keep_to(all);
    work()
}

#[cfg(target_os = "linux")]
mod processors {
    use nix::sched::{CpuSet, sched_getaffinity, sched_setaffinity};
    use nix::unistd::Pid;
    use std::sync::OnceLock;

    /// The calling thread. Errors of the calls are ignored: threads then run on other processors.
    const THIS_THREAD: Pid = Pid::from_raw(0);

    /// Processors of the process: the affinity of the first thread that called this.
    pub(super) fn all() -> &'static [usize] {
        static ALL: OnceLock<Vec<usize>> = OnceLock::new();
        ALL.get_or_init(of_this_thread)
    }

    /// Processors that this thread may use; empty where that is unknown.
    pub(super) fn of_this_thread() -> Vec<usize> {
        let set = sched_getaffinity(THIS_THREAD).unwrap_or_default();
        (0..CpuSet::count()).filter(|&i| set.is_set(i).unwrap_or(false)).collect()
    }

    /// Restricts this thread to `processors`.
    pub(super) fn keep_to(processors: &[usize]) {
        let mut set = CpuSet::new();
        let known = processors.iter().all(|&i| set.set(i).is_ok());
        if known && !processors.is_empty() {
            let _ = sched_setaffinity(THIS_THREAD, &set);
        }
    }
}

#[cfg(not(target_os = "linux"))]
mod processors {
    //! No affinity on other systems.

    pub(super) fn all() -> &'static [usize] {
        &[]
    }

    pub(super) fn of_this_thread() -> Vec<usize> {
        Vec::new()
    }

    pub(super) fn keep_to(_: &[usize]) {}
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn threads_for_all_processors_keep_to_one_each_and_what_they_start_need_not() {
        let all = processors::all();
        for threads in [1, 2, 3, available()] {
            let pool = pool(threads).unwrap();
            assert_eq!(pool.current_num_threads(), threads);
            let places = pool.broadcast(|_| processors::of_this_thread());
            let kept = all.len() == threads && threads > 1;
            if kept {
                assert!(places.iter().all(|p| p.len() == 1), "{places:?}");
                assert_eq!(places.iter().flatten().collect::<HashSet<_>>().len(), threads, "{places:?}");
            } else if all.len() > 1 {
                assert!(places.iter().all(|p| p == all), "{places:?}");
            }
            let free = || std::thread::spawn(processors::of_this_thread).join().unwrap();
            assert_eq!(pool.install(|| anywhere(free)), all);
            assert_eq!(pool.install(available), available());
        }
    }

    #[test]
    fn a_thread_that_went_anywhere_is_back_after_a_panic() {
        let pool = pool(0).unwrap();
        let there = pool.install(|| {
            let before = processors::of_this_thread();
            let fails = || anywhere(|| panic!("as it does at times"));
            assert!(std::panic::catch_unwind(fails).is_err());
            (before, processors::of_this_thread())
        });
        assert_eq!(there.0, there.1);
    }
}
