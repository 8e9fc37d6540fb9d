//! Exit codes, which tell a script whether a retry can help.

use crate::load::diagnostic::{OVER_MEMORY, RAISE_MEMORY};
use crate::load::{Diagnostic, LoadError};
use std::process::ExitCode;

/// Outcome of a command, from best to worst.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Exit {
    /// 0: done.
    #[default]
    Done,
    /// 1: could not do it (I/O, memory): a retry may help.
    Failed,
    /// 3: the input is bad, unsupported or empty: a retry is useless.
    Input,
    /// 2: the command line is wrong.
    Usage,
    /// 130: interrupted.
    Interrupted,
}

impl Exit {
    /// Exit code for the system.
    pub fn code(self) -> u8 {
        match self {
            Self::Done => 0,
            Self::Failed => 1,
            Self::Usage => 2,
            Self::Input => 3,
            Self::Interrupted => 130,
        }
    }
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit.code())
    }
}

/// Exit of a model that cannot be loaded. A retry can help if a file could not be read, or if all faults are about memory or a
/// missing root folder.
impl From<&LoadError> for Exit {
    fn from(error: &LoadError) -> Self {
        let is_not_of_the_file = |fault: &Diagnostic| match fault.code {
            // The fault is also raised for files that are too large whatever the memory.
            "file-too-large" => fault.remedy == RAISE_MEMORY,
            code => code == OVER_MEMORY || code == "root-missing",
        };
        match error {
            LoadError::Read { .. } => Self::Failed,
            LoadError::Input(faults) if !faults.is_empty() && faults.iter().all(is_not_of_the_file) => Self::Failed,
            LoadError::Input(_) => Self::Input,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_batch_ends_with_the_worst_of_its_files() {
        let ends = [Exit::Done, Exit::Input, Exit::Failed, Exit::Done];
        assert_eq!(ends.into_iter().max(), Some(Exit::Input));
        assert_eq!(Exit::Interrupted.max(Exit::Input).code(), 130);
    }
}
