//! `meshray completions` and `meshray man`: made from the same definitions as the parser.

use super::Exit;
use super::args::Cli;
use super::message::Messages;
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
    // What `help` says stands in these pages.
    let command = Cli::command().disable_help_subcommand(true);
    let mut page = Vec::new();
    let mut rendered = clap_mangen::Man::new(command.clone()).render(&mut page);
    for sub in command.get_subcommands() {
        // clap holds names by reference; there are a dozen of them, for the life of the process.
        let name: &'static str = format!("meshray-{}", sub.get_name()).leak();
        rendered = rendered.and_then(|()| clap_mangen::Man::new(sub.clone().name(name)).render(&mut page));
    }
    rendered.map_or_else(|why| Messages::default().unprintable(&why), |()| show(&page))
}

fn show(text: &[u8]) -> Exit {
    Messages::default().print(&String::from_utf8_lossy(text)).err().unwrap_or_default()
}
