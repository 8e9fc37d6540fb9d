//! The command line: words -> jobs -> messages and exit codes.
//!
//! `args` holds what was typed, `job` its validated meaning; one file per command does the work. Only this module prints. stdout
//! carries only the requested output, everything else goes to stderr.

mod again;
mod archives;
mod args;
mod bench;
mod camera;
mod cost_layers;
mod diff;
mod dry_run;
mod empty_picture;
mod exit;
mod explain;
mod folders;
mod generate;
mod inspect;
mod interrupt;
mod job;
mod memory;
mod message;
mod meter;
mod moment;
mod output_name;
mod outputs;
mod panics;
mod parallel_inputs;
mod parse;
mod picture;
mod profile;
mod progress;
mod read;
mod render;
mod sampling;
mod sequence;
mod shell;
mod shot;
mod stats;
mod study;
mod summary;
mod surroundings;
mod trace;
mod up_to_date;
mod verify;
mod version;
mod viewed;
mod writable;

pub use exit::Exit;

use args::{Cli, Command, RenderArgs};
use clap::{Args, CommandFactory, FromArgMatches, Subcommand};
use message::{Messages, Severity};
use std::ffi::{OsStr, OsString};
use std::io::{self, Write};
use std::path::Path;

/// Runs the command line `words`, the first of which is the program's name.
pub fn run(words: impl IntoIterator<Item = OsString>) -> Exit {
    let words = JOINED.iter().fold(with_render(words.into_iter().collect()), with_joined);
    let format = message::Format::asked_for(&words);
    let command = match render_alone(&words).map_or_else(|| any_command(words), Ok) {
        Ok(command) => command,
        Err(e) => return misunderstood(&e, format),
    };
    if let Some(level) = command.simd()
        && let Err(chosen) = level.choose()
    {
        let text = format!("--simd {}: this process has begun with {}", level.word(), chosen.word());
        return Messages::new(format, false).wrong(job::UsageError(text));
    }
    interrupt::install(format);
    panics::install();
    memory::keep_freed();
    // Panics outside of a model's own guard are reported, too.
    panics::guard("meshray", &Messages::new(format, false), || carry_out(command))
}

fn carry_out(command: Command) -> Exit {
    match command {
        Command::Render(args) => render_command(&args),
        Command::Inspect(args) => inspect::run(&args),
        Command::Bench(args) => bench::run(&args),
        Command::Verify(args) => verify::run(&args),
        Command::Explain(args) => explain::run(&args),
        Command::Study(args) => study::run(&args),
        Command::Trace(args) => trace::run(&args),
        Command::Diff(args) => diff::run(&args),
        Command::Generate(args) => generate::run(&args),
        Command::Completions { shell } => shell::completions(shell),
        Command::Man => shell::man(),
    }
}

/// Parses `meshray render …` without the other commands; `None` unless the words are valid. Errors and help are left to the full
/// parser, since listing the flags of all commands takes half a millisecond.
fn render_alone(words: &[OsString]) -> Option<Command> {
    let words = words.get(1..).filter(|words| words.first().is_some_and(|word| word == "render"))?;
    let matches = RenderArgs::augment_args(clap::Command::new("render")).try_get_matches_from(words).ok()?;
    RenderArgs::from_arg_matches(&matches).ok().map(|args| Command::Render(Box::new(args)))
}

/// Parses the words. `-1` after a flag with a value is taken as the value, so that the flag's own parser reports the fault.
fn any_command(words: Vec<OsString>) -> Result<Command, clap::Error> {
    let with_negative = |arg: clap::Arg| {
        let has_value = arg.get_action().takes_values() && !arg.is_positional();
        if has_value { arg.allow_negative_numbers(true) } else { arg }
    };
    let grammar = Cli::command().mut_subcommands(|command| command.mut_args(with_negative));
    Cli::from_arg_matches(&grammar.try_get_matches_from(words)?).map(|cli| cli.command)
}

/// Reports a parse error, or prints the requested help.
fn misunderstood(error: &clap::Error, format: message::Format) -> Exit {
    if error.use_stderr() && format == message::Format::Json {
        let fault = message::of_parser(&error.render().to_string());
        return Messages::new(format, false).fail(&fault, Exit::Usage);
    }
    // Flush, so that failures are noticed; a closed pipe is no fault.
    let printed = error.print().and_then(|()| io::stdout().flush());
    match printed {
        _ if error.use_stderr() => Exit::Usage,
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => Messages::default().unprintable(&e),
        _ => Exit::Done,
    }
}

fn render_command(typed: &RenderArgs) -> Exit {
    let messages = Messages::new(typed.messages.into(), typed.quiet);
    let (mut expected_hash, mut made_of) = (None, None);
    let mut args = typed.clone();
    if let Some(picture) = &typed.again {
        match again::repeat(picture, typed) {
            Ok(repeat) => {
                repeat.warning.iter().for_each(|w| messages.say(Severity::Warning, w));
                if typed.strict && repeat.warning.is_some() {
                    return messages.fail(&read::not_strict(1, picture), Exit::Input);
                }
                args = repeat.args;
                (expected_hash, made_of) = (Some(repeat.hash), repeat.made_of);
            }
            Err((fault, exit)) => return messages.fail(&fault, exit),
        }
    }
    let mut doubtful = Vec::new();
    let (models, unfolded) = folders::unfold(&args.inputs, |severity, what| {
        messages.say(severity, what);
        doubtful.extend((severity == Severity::Warning).then(|| what.file.clone()));
    });
    if let Some(file) = doubtful.first().filter(|_| args.strict) {
        return messages.fail(&read::not_strict(doubtful.len(), file), Exit::Input);
    }
    if models.is_empty() && unfolded != Exit::Done {
        return unfolded;
    }
    (args.folders, args.inputs) = (folders::of(&args.inputs), models);
    match job::RenderJob::new(&args) {
        Ok(job) => {
            let job = job::RenderJob { expected_hash, made_of, again: typed.again.clone(), ..job };
            render::run(&job, &messages).max(unfolded)
        }
        Err(wrong) => messages.wrong(wrong),
    }
}

/// Expands `meshray MODEL` to `meshray render MODEL` if the first word is no command but looks like a file.
fn with_render(mut words: Vec<OsString>) -> Vec<OsString> {
    let Some(first) = words.get(1) else { return words };
    let is_command = first.to_str().is_some_and(|word| Command::has_subcommand(word) || word == "help");
    if !is_command && (is_file(first) || first == "-") {
        words.insert(1, "render".into());
    }
    words
}

fn is_file(word: &OsStr) -> bool {
    let letters = word.as_encoded_bytes();
    !letters.starts_with(b"-") && (letters.iter().any(|c| b"./\\".contains(c)) || Path::new(word).exists())
}

/// A flag whose value is optional, and a test whether the following word is its value.
type Joined = (&'static str, fn(&OsStr) -> bool);

const JOINED: [Joined; 3] = [
    // A word that is no list of costs is taken for a mistyped one, unless it is a file.
    ("--layers", |word| word.to_str().is_some_and(|list| parse::costs(list).is_ok()) || !is_file(word)),
    ("--ortho", |word| word.to_str().is_some_and(|height| parse::ortho(height).is_ok()) || is_like_a_number(word)),
    ("--smooth", |word| word.to_str().is_some_and(|lean| parse::lean(lean).is_ok()) || is_like_a_number(word)),
];

/// Whether the word starts like a number and is no file: it is then taken for a mistyped value.
fn is_like_a_number(word: &OsStr) -> bool {
    let letters = word.as_encoded_bytes();
    letters.first().is_some_and(|c| c.is_ascii_digit() || b"+.".contains(c)) && !Path::new(word).exists()
}

/// Rewrites `--layers tests,steps` as `--layers=tests,steps`, while in `--layers ship.glb` the flag stands alone.
fn with_joined(mut words: Vec<OsString>, (flag, is_value): &Joined) -> Vec<OsString> {
    let flags = words.iter().position(|word| word == "--").unwrap_or(words.len());
    if let Some(at) = words[..flags].iter().position(|word| word == flag)
        && words[..flags].get(at + 1).is_some_and(|word| !word.as_encoded_bytes().starts_with(b"-") && is_value(word))
    {
        let value = words.remove(at + 1);
        words[at].push("=");
        words[at].push(value);
    }
    words
}

/// Writes to stdout; a closed pipe is no fault. Control characters, which file names may contain, are replaced.
fn print(text: &str) -> io::Result<()> {
    let steers = |c: char| c.is_control() && !matches!(c, '\n' | '\t');
    let text = text.replace(steers, "\u{fffd}");
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        result => result,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn a_model_alone_is_rendered() {
        let words = |line: &str| line.split(' ').map(OsString::from).collect::<Vec<_>>();
        assert_eq!(with_render(words("meshray a.glb -q")), words("meshray render a.glb -q"));
        assert_eq!(with_render(words("meshray inspect a.glb")), words("meshray inspect a.glb"));
        assert_eq!(with_render(words("meshray --help")), words("meshray --help"));
        assert_eq!(with_render(words("meshray rendr")), words("meshray rendr"));
        assert_eq!(with_render(words("meshray -")), words("meshray render -"));
    }

    #[test]
    fn words_of_render_mean_the_same_by_themselves_as_among_all_commands() {
        let words = |line: &str| line.split(' ').map(OsString::from).collect::<Vec<_>>();
        let among_all = |line: &str| any_command(words(line)).ok().map(|command| format!("{command:?}"));
        let alone = |line: &str| render_alone(&words(line)).map(|command| format!("{command:?}"));
        for line in [
            "meshray render a.glb -q",
            "meshray render a.glb b.obj --size 64x48 --eye=-1,2,3 --layers -o out/{stem}.exr",
            "meshray render --again a.png b.glb",
            "meshray render - --samples 4 --up z --messages json",
        ] {
            let understood = alone(line);
            assert!(understood.is_some() && understood == among_all(line), "{line}: {understood:?}");
        }
        for line in [
            "meshray inspect a.glb",
            "meshray render --help",
            "meshray render -V",
            "meshray render a.glb --sise 64x48",
            "meshray render --again a.png --samples 4",
            "meshray render",
            "meshray",
        ] {
            assert_eq!(alone(line), None, "{line}");
        }
    }

    #[test]
    fn a_flag_that_may_stand_alone_takes_its_value_but_no_file() {
        let words = |line: &str| line.split(' ').map(OsString::from).collect::<Vec<_>>();
        let joined = |line: &str| JOINED.iter().fold(words(line), with_joined);
        for (line, expected) in [
            ("meshray render a.glb --layers tests,ms -q", "meshray render a.glb --layers=tests,ms -q"),
            ("meshray render a.glb --layers tets -q", "meshray render a.glb --layers=tets -q"),
            ("meshray render --ortho 5 a.glb --smooth 60", "meshray render --ortho=5 a.glb --smooth=60"),
            ("meshray trace a.glb --ortho auto", "meshray trace a.glb --ortho=auto"),
            ("meshray render a.glb --ortho 0 --smooth 200", "meshray render a.glb --ortho=0 --smooth=200"),
            ("meshray render a.glb --ortho 5m", "meshray render a.glb --ortho=5m"),
        ] {
            assert_eq!(joined(line), words(expected));
        }
        for line in [
            "meshray render --layers a.glb",
            "meshray render a.glb --layers",
            "meshray render a.glb --layers -q",
            "meshray render --ortho a.glb",
            "meshray render -- --ortho 5",
        ] {
            assert_eq!(joined(line), words(line));
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_model_whose_name_is_no_text_is_rendered_too() {
        use std::os::unix::ffi::OsStringExt;
        let model = OsString::from_vec(b"n\xff.glb".to_vec());
        let words = with_render(vec!["meshray".into(), model.clone()]);
        assert_eq!(words, ["meshray".into(), "render".into(), model]);
    }

    #[test]
    fn the_short_help_shows_at_most_fifteen_flags() {
        let help = Cli::command().find_subcommand_mut("render").unwrap().render_help().to_string();
        let flags = help.lines().filter(|l| l.trim_start().starts_with('-')).count();
        assert!(flags <= 15, "{flags} flags\n{help}");
    }

    #[test]
    fn every_flag_has_a_heading() {
        let command = Cli::command();
        let render = command.find_subcommand("render").unwrap();
        for flag in render.get_opts() {
            assert!(flag.get_help_heading().is_some(), "{:?}", flag.get_long());
        }
    }
}
