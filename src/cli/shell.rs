//! `meshray completions` and `meshray man`: made from the same definitions as the parser.

use super::args::Cli;
use super::{Exit, print};
use clap::CommandFactory;
use clap_complete::Shell;

/// Prints a completion script.
pub(super) fn completions(shell: Shell) -> Exit {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "meshray", &mut script);
    show(&script)
}

/// Prints the manual page, the commands' pages behind it.
pub(super) fn man() -> Exit {
    let command = Cli::command();
    let mut page = Vec::new();
    let mut rendered = clap_mangen::Man::new(command.clone()).render(&mut page);
    for sub in command.get_subcommands().filter(|s| s.get_name() == "render" || s.get_name() == "inspect") {
        // clap holds names by reference; there are two of them, for the life of the process.
        let name: &'static str = format!("meshray-{}", sub.get_name()).leak();
        rendered = rendered.and_then(|()| clap_mangen::Man::new(sub.clone().name(name)).render(&mut page));
    }
    match rendered {
        Ok(()) => show(&page),
        Err(_) => Exit::Failed,
    }
}

fn show(text: &[u8]) -> Exit {
    match print(&String::from_utf8_lossy(text)) {
        Ok(()) => Exit::Done,
        Err(_) => Exit::Failed,
    }
}
