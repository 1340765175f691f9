//! The command line: start, complain, exit; what a program says beside its output.

mod advice;
mod completions;
pub mod demo;
mod documents;
pub mod examples;
mod exposing;
mod frames;
mod general;
mod help;
mod history;
mod memory;
mod over_frames;
pub mod pages;
pub mod programs;
mod roster;
mod session;
mod signals;
mod usage;
mod wildcards;
mod words;

pub use frames::Turn;
pub use general::{General, ProgressWhen};
pub use history::history_entry;
pub use memory::Memory;
pub use session::Session;

use crate::error::{Error, Result};
use crate::formats::atomic::remove_pending_now;
use crate::formats::inventory::{self, Kind};
use crate::formats::places::STDOUT_NAME;
use crate::formats::{keys, pipe, register, standard};
use crate::metadata::METADATA_TEMPLATE;
use crate::numerics::vectors::Instructions;
use clap::{Command, CommandFactory, FromArgMatches};
use std::io::Write;
use std::process::ExitCode;
use words::complain;

/// Exit status after an internal error, as Rust's programs have it.
const PANICKED: i32 = 101;

/// Parses the arguments, runs a program, and says in one line what went wrong.
pub fn start<A: CommandFactory + FromArgMatches>(
    program: &'static str,
    general: impl FnOnce(&A) -> General,
    body: impl FnOnce(&A, &Session) -> Result<()>,
) -> ExitCode {
    std::panic::set_hook(Box::new(move |panic| {
        let place = panic.location().map_or(String::new(), |at| format!(" at {}:{}", at.file(), at.line()));
        complain(program, &format!("internal error{place}; please report it with the command that led to it"));
        remove_pending_now();
        std::process::exit(PANICKED);
    }));
    memory::complain_as(program);
    signals::tidy_up_first();
    register::keep();
    let command = help::arranged(program, &A::command());
    if let Some(text) = documents::asked_for(std::env::args_os().skip(1), &command) {
        let text = text.map_err(Error::Usage);
        return ended(program, text.and_then(|text| show(|| std::io::stdout().write_all(&text))));
    }
    for (option, text) in [("metadata_template", METADATA_TEMPLATE), ("describe_keys", &keys::tables())] {
        if asks_for(option, &command) {
            return ended(program, show(|| std::io::stdout().write_all(text.as_bytes())));
        }
    }
    if asks_for("list_sensors", &command) {
        let words = std::env::args_os().map(|word| word.to_string_lossy().into_owned());
        let of = words.skip_while(|word| word != "--list").skip(1);
        let page = inventory::page(Kind::Sensors, &of.take_while(|word| !word.starts_with('-')).collect::<Vec<_>>());
        return ended(program, show(|| std::io::stdout().write_all(page.as_bytes())));
    }
    let words = wildcards::expanded(std::env::args_os().skip(1), &command);
    let all = std::iter::once(program.into()).chain(words.iter().cloned());
    let parsed = command.version(version(program)).try_get_matches_from(all);
    let parsed = parsed.and_then(|matches| A::from_arg_matches(&matches));
    let arguments = match parsed {
        Ok(arguments) => arguments,
        Err(error) if !error.use_stderr() => return ended(program, show(|| error.print())),
        Err(error) => {
            complain(program, &usage::one_line(program, &error, &A::command(), &advice::in_text(&words)));
            pipe::pass_failure_on();
            return ExitCode::from(2);
        }
    };
    let session = Session::new(program, words, general(&arguments));
    session.settle_threads();
    let done = Instructions::allowed().and_then(|_| body(&arguments, &session));
    session.warn_of_doubts();
    match done {
        Ok(()) | Err(Error::ClosedPipe) => ExitCode::SUCCESS,
        Err(error) => {
            if !matches!(error, Error::Upstream) {
                complain(program, &advice::advised(&error, &A::command()));
            }
            pipe::pass_failure_on();
            ExitCode::from(error.exit_status())
        }
    }
}

/// What `--version` says behind the name of a program: the project, its version, and the commit that `build.rs` found for a
/// release, or that the build was told in `CYANOMETER_COMMIT`.
fn version(program: &str) -> &'static str {
    let project = if program == env!("CARGO_PKG_NAME") { "" } else { concat!("(", env!("CARGO_PKG_NAME"), ") ") };
    let commit = option_env!("CYANOMETER_COMMIT").filter(|commit| !commit.is_empty());
    let commit = commit.map_or(String::new(), |commit| format!(" ({commit})"));
    String::leak(format!("{project}{}{commit}", env!("CARGO_PKG_VERSION")))
}

/// Whether a text is wanted that an option prints, whatever else the program would need.
fn asks_for(id: &str, command: &Command) -> bool {
    let option = command.get_arguments().find(|argument| argument.get_id() == id);
    let long = option.and_then(|option| option.get_long()).map(|long| format!("--{long}"));
    long.is_some_and(|long| std::env::args_os().skip(1).take_while(|word| word != "--").any(|word| *word == *long))
}

/// Writes what was asked for instead of a frame, as help.
fn show(print: impl FnOnce() -> std::io::Result<()>) -> Result<()> {
    standard::open_stdout()?;
    print().and_then(|()| std::io::stdout().flush()).map_err(|e| Error::disk(STDOUT_NAME, "write", e))
}

/// The status after something that was shown; a closed pipe is no error.
fn ended(program: &str, shown: Result<()>) -> ExitCode {
    match shown {
        Ok(()) | Err(Error::ClosedPipe) => ExitCode::SUCCESS,
        Err(error) => {
            complain(program, &error.to_string());
            ExitCode::from(error.exit_status())
        }
    }
}
