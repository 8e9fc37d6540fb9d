//! `meshray completions` and `meshray man`, generated from the parser's definitions.

use super::Exit;
use super::args::Cli;
use super::message::Messages;
use clap::CommandFactory;
use clap_complete::Shell;

/// Prints a completion script.
pub(super) fn completions(shell: Shell) -> Exit {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "meshray", &mut script);
    print(&script)
}

/// Prints the manual page, followed by those of the commands.
pub(super) fn man() -> Exit {
    // The pages contain everything that `help` prints.
    let command = Cli::command().disable_help_subcommand(true);
    let mut page = Vec::new();
    let mut rendered = clap_mangen::Man::new(command.clone()).render(&mut page);
    for sub in command.get_subcommands() {
        // clap needs `'static` names; a dozen are leaked, for the life of the process.
        let name: &'static str = format!("meshray-{}", sub.get_name()).leak();
        rendered = rendered.and_then(|()| clap_mangen::Man::new(sub.clone().name(name)).render(&mut page));
    }
    rendered.map_or_else(|why| Messages::default().unprintable(&why), |()| print(&page))
}

fn print(text: &[u8]) -> Exit {
    Messages::default().print(&String::from_utf8_lossy(text)).err().unwrap_or_default()
}
