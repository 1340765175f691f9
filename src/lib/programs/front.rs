//! `cyanometer`: the front door to the other programs, and most of them themselves.

use super::by_name;
use crate::cli::{self, demo, pages, programs};
use crate::error::{Error, Result};
use clap::Parser;
use std::ffi::OsString;
use std::path::Path;
use std::process::ExitCode;

const PROGRAM: &str = env!("CARGO_PKG_NAME");

/// List the programs, run one of them, or tell what is known by name and what files hold
///
/// Without arguments the programs are listed, each with what it does. The name of a program runs it with the arguments behind the
/// name.
///
/// `demo [DIRECTORY]` runs the chain on skies that this program carries and shows each command; the directory that takes the
/// files is `cyanometer-demo` unless it is named.
///
/// `list [sensors|matrices|observers|spectra|illuminants|charts] [WORD]` tells which are known, or those of which a word is told:
/// where they were found, what each is, and what sensors have and lack.
///
/// `keys [sensor|matrix|metadata] [WORD]` describes all keys of such files, or those with a word in their names; `template sensor|matrix|metadata` prints one to begin with.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    /// Program to run, or what to do
    #[arg(value_parser = programs::PROGRAMS.into_iter().chain(programs::OWN).collect::<Vec<_>>())]
    program: Option<String>,
    /// Arguments of the program
    arguments: Vec<OsString>,
    /// `list`, as programs have their options.
    #[arg(long, hide = true, exclusive = true, num_args = 0.., value_name = "WORD")]
    list: Option<Vec<OsString>>,
    /// `template`, likewise.
    #[arg(long, hide = true, exclusive = true, num_args = 0.., value_name = "WORD")]
    template: Option<Vec<OsString>>,
    /// `keys`, as all programs have them.
    #[arg(long, alias = "keys", hide = true)]
    describe_keys: bool,
}

/// Becomes the program by whose name it was called, or the one that the first word names, or does what its own arguments say.
pub fn main() -> ExitCode {
    if let Some(main) = programs::called().as_deref().and_then(by_name) {
        return main();
    }
    programs::hand_over(PROGRAM)
        .unwrap_or_else(|| cli::start(PROGRAM, |_: &Arguments| cli::General::default(), |arguments, _| run(arguments)))
}

fn run(Arguments { program, arguments, list, template, describe_keys }: &Arguments) -> Result<()> {
    if let Some(words) = list {
        return pages::list(words);
    }
    if let Some(words) = template {
        return pages::template(words);
    }
    if *describe_keys {
        return pages::keys(&[]);
    }
    match (program.as_deref(), &arguments[..]) {
        (None, _) => programs::list(),
        (Some("demo"), []) => demo::run(Path::new("cyanometer-demo")),
        (Some("demo"), [directory]) => demo::run(Path::new(directory)),
        (Some("demo"), _) => Err(Error::Usage("demo takes one directory".into())),
        (Some("list"), words) => pages::list(words),
        (Some("keys"), words) => pages::keys(words),
        (Some("template"), words) => pages::template(words),
        (Some(program), words) => Err(programs::become_program(program, words)),
    }
}
