//! The other programs, which stand beside the one that runs: their names, what each says of itself, and how they are run.

use super::documents::SUMMARY;
pub use super::roster::{APART, OWN, PROGRAMS};
use super::{complain, show};
use crate::error::{Error, Result};
use crate::formats::own_program::own_program;
use crate::names::nearest;
use std::ffi::{OsStr, OsString};
use std::io::Write;
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::{Command, ExitCode, Stdio};

/// Behind the list of programs.
const USUAL: &str = "
The usual pipeline:
  fit-matrix sky912.exr -o matrix.yaml
  render-radiance clear_zenith.csv | add-noise --seed 7 | digitize | mosaic | demosaic | to-xyz --matrix matrix.yaml -o xyz.exr

`cyanometer demo` runs it on skies that it carries; `cyanometer list` tells which sensors, spectra, lights and charts are known,
`cyanometer keys` what sensor files, matrix files and metadata may hold, and `cyanometer template sensor|matrix|metadata` prints
such a file to begin with. `PROGRAM --help` tells what each takes, as `cyanometer PROGRAM --help` does, with examples.
";

/// What starts a program: the file beside the one that runs, which is called `cyanometer-PROGRAM` where a system keeps its plain
/// name for any package's (Debian's alternatives); or, where there is none, the front door, which can be most of them.
pub(super) fn command(program: &str) -> Result<Command> {
    let this = own_program().map_err(|e| Error::disk(program, "find", e))?;
    let own = this.with_file_name(format!("{}-{program}", env!("CARGO_PKG_NAME")));
    let plain = this.with_file_name(program);
    if own.is_file() {
        Ok(Command::new(own))
    } else if plain.is_file() || APART.contains(&program) {
        Ok(Command::new(plain))
    } else {
        let mut command = Command::new(this);
        command.arg0(program);
        Ok(command)
    }
}

/// The name under which this process was called, without directories.
pub fn called() -> Option<String> {
    let path = PathBuf::from(std::env::args_os().next()?);
    Some(path.file_name()?.to_str()?.to_owned())
}

/// Becomes the program that the first word names, where there is one; the words behind it are its own. Where it cannot be
/// started, that is said, and the status to exit with is given.
///
/// Called first of all, so that the program finds all as the shell gave it.
pub fn hand_over(front: &'static str) -> Option<ExitCode> {
    let mut words = std::env::args_os().skip(1);
    let mut program = words.next()?;
    let mut help = None;
    if program == "help" {
        // `cyanometer help measure`, as other front doors have it.
        help = Some(OsString::from("--help"));
        program = words.next().unwrap_or_default();
        let is_other =
            program.to_string_lossy().starts_with('-') || OWN.into_iter().any(|known| OsStr::new(known) == program);
        if program.is_empty() || is_other {
            let error = own_program().map(|this| Command::new(this).arg0(front).args(help).exec());
            complain(front, &Error::disk(front, "run", error.unwrap_or_else(|error| error)).to_string());
            return Some(ExitCode::FAILURE);
        }
    }
    let Some(known) = PROGRAMS.into_iter().find(|known| OsStr::new(known) == program) else {
        return unknown(&program.to_string_lossy()).map(|problem| {
            complain(front, &problem);
            ExitCode::from(2)
        });
    };
    let error = become_program(known, help.into_iter().chain(words));
    complain(front, &error.to_string());
    Some(ExitCode::from(error.exit_status()))
}

/// A complaint of a word where a program is wanted, if it is none that is known and no option.
fn unknown(word: &str) -> Option<String> {
    /// Letters of a name in which it may be off, one for so many.
    const LETTERS: usize = 3;
    if word.starts_with('-') || word.is_empty() || OWN.contains(&word) {
        return None;
    }
    let bare = word.to_ascii_lowercase().replace(['_', ' '], "-");
    let known = || PROGRAMS.into_iter().chain(OWN);
    // A part of a name is meant rather than one that looks like it.
    let begins = |known: &&str| bare.len() >= LETTERS && known.split('-').any(|part| part == bare);
    let meant = known().find(begins).or_else(|| nearest(&bare, known(), |known| known.len().div_ceil(LETTERS)));
    let told = meant.map_or_else(
        || format!("; `{}` alone lists the programs", env!("CARGO_PKG_NAME")),
        |meant| format!("; did you mean `{meant}`?"),
    );
    Some(format!("there is no program `{word}`{told}"))
}

/// Gives the process to a program; comes back where that is impossible.
pub fn become_program(program: &str, words: impl IntoIterator<Item: AsRef<OsStr>>) -> Error {
    match command(program) {
        Ok(mut command) => {
            let failure = command.args(words).exec();
            Error::disk(&command.get_program().to_string_lossy(), "run", failure)
        }
        Err(error) => error,
    }
}

/// Lists the programs, each with what it says of itself.
///
/// # Errors
///
/// [`Error::Disk`] where the list cannot be written.
pub fn list() -> Result<()> {
    let width = PROGRAMS.iter().map(|program| program.len()).max().unwrap_or_default();
    let mut text = String::new();
    for program in PROGRAMS {
        text.push_str(&format!("  {program:width$}  {}\n", summary(program)));
    }
    text.push_str(USUAL);
    show(|| std::io::stdout().write_all(text.as_bytes()))
}

/// What a program says of itself in a line.
fn summary(program: &str) -> String {
    let ask = |mut command: Command| command.arg(SUMMARY).stdin(Stdio::null()).stderr(Stdio::null()).output().ok();
    let said = command(program).ok().and_then(ask).filter(|done| done.status.success());
    let said = said.map(|done| String::from_utf8_lossy(&done.stdout).trim_end().to_owned());
    said.unwrap_or_else(|| "(it is not beside this program, or does not run)".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn programs_that_are_not_there_are_told_by_their_nearest() {
        for (word, meant) in [
            ("measur", Some("measure")),
            ("Measure", Some("measure")),
            ("render", Some("render-radiance")),
            ("add_noise", Some("add-noise")),
            ("noise", Some("add-noise")),
            ("digitise", Some("digitize")),
            ("lst", Some("list")),
            ("sky.csv", None),
        ] {
            let told = unknown(word).unwrap();
            let wanted = meant.map_or("; `cyanometer` alone lists the programs".to_owned(), |meant| {
                format!("; did you mean `{meant}`?")
            });
            assert_eq!(told, format!("there is no program `{word}`{wanted}"));
        }
        assert_eq!(["--version", "list", ""].map(unknown), [None, None, None]);
    }
}
