//! `cyanometer`: the front door to the other programs.

use clap::Parser;
use cyanometer::cli::{self, demo, programs};
use cyanometer::error::{Error, Result};
use std::ffi::OsString;
use std::path::Path;
use std::process::ExitCode;

#[global_allocator]
static MEMORY: cli::Memory = cli::Memory;

/// List the programs, run one of them, or run a demonstration
///
/// Without arguments the programs are listed, each with what it does. The name of a program runs it with the arguments behind the
/// name. `demo` runs the chain on skies that this program carries and shows each command; the directory that takes the files may
/// be named, and is `cyanometer-demo` otherwise.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    /// Program to run
    #[arg(value_parser = programs::PROGRAMS.into_iter().chain([programs::DEMO]).collect::<Vec<_>>())]
    program: Option<String>,
    /// Arguments of the program; of demo, a directory that is empty or new
    arguments: Vec<OsString>,
}

fn main() -> ExitCode {
    let program = env!("CARGO_BIN_NAME");
    programs::hand_over(program)
        .unwrap_or_else(|| cli::start(program, |_: &Arguments| cli::General::default(), |arguments, _| run(arguments)))
}

fn run(Arguments { program, arguments }: &Arguments) -> Result<()> {
    match (program.as_deref(), &arguments[..]) {
        (None, _) => programs::list(),
        (Some(programs::DEMO), []) => demo::run(Path::new("cyanometer-demo")),
        (Some(programs::DEMO), [directory]) => demo::run(Path::new(directory)),
        (Some(programs::DEMO), _) => Err(Error::Usage("demo takes one directory".into())),
        (Some(program), words) => Err(programs::become_program(program, words)),
    }
}
