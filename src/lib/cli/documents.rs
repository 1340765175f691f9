//! What is made of a program's definition of its arguments, and printed instead of running: its manual page, completions for
//! shells, its line in a list of programs.

use super::examples;
use clap::Command;
use clap_complete::Shell;
use clap_mangen::Man;
use std::ffi::OsString;
use std::io;

/// The only word of a command line that asks for the manual page.
const MANUAL: &str = "--manual";
/// The first word of a command line that asks for completions; the name of a shell follows.
const COMPLETIONS: &str = "--completions";
/// The only word of a command line that asks for one line about the program.
pub(super) const SUMMARY: &str = "--summary";

/// The text that a command line asks for, or why there is none; nothing where it asks for another thing. These options stand
/// in no help: an installation uses them.
pub(super) fn asked_for(
    mut words: impl Iterator<Item = OsString>,
    command: &Command,
) -> Option<Result<Vec<u8>, String>> {
    let first = words.next()?;
    let second = words.next();
    match (first.to_str()?, second) {
        (MANUAL, None) => Some(manual(command).map_err(|error| error.to_string())),
        (SUMMARY, None) => Some(Ok(summary(command).into_bytes())),
        (COMPLETIONS, shell) => Some(completions(&shell.unwrap_or_default().to_string_lossy(), command)),
        _ => None,
    }
}

/// A manual page of section 1, in roff.
fn manual(command: &Command) -> io::Result<Vec<u8>> {
    let project = env!("CARGO_PKG_NAME");
    let mut page = Vec::new();
    let source = concat!(env!("CARGO_PKG_NAME"), " ", env!("CARGO_PKG_VERSION"));
    // Examples are a section of their own.
    let command = command.clone().after_long_help(None::<&str>);
    Man::new(command.clone()).source(source).manual(project).render(&mut page)?;
    page.extend(examples::roff(command.get_name()).bytes());
    if command.get_name() != project {
        page.extend(format!(".SH \"SEE ALSO\"\n\\fB{project}\\fR(1)\n").bytes());
    }
    Ok(page)
}

fn summary(command: &Command) -> String {
    command.get_about().map(|about| format!("{about}\n")).unwrap_or_default()
}

/// A script that completes the program's options in a shell.
fn completions(shell: &str, command: &Command) -> Result<Vec<u8>, String> {
    let shell: Shell = match shell {
        "bash" => Shell::Bash,
        "zsh" => Shell::Zsh,
        "fish" => Shell::Fish,
        other => return Err(format!("there are no completions for `{other}`; known are bash, zsh and fish")),
    };
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut command.clone(), command.get_name(), &mut script);
    Ok(script)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Arg;

    fn asked(words: &str) -> Option<Result<String, String>> {
        let command = Command::new("mosaic").about("Keep one plane").arg(Arg::new("pattern").long("pattern"));
        let text = asked_for(words.split(' ').map(OsString::from), &command)?;
        Some(text.map(|bytes| String::from_utf8(bytes).unwrap()))
    }

    #[test]
    fn documents_are_asked_for_by_the_first_word_alone() {
        assert_eq!(asked("--summary").unwrap().unwrap(), "Keep one plane\n");
        assert!(asked("--manual").unwrap().unwrap().contains("\\-\\-pattern"));
        for shell in ["bash", "zsh", "fish"] {
            assert!(asked(&format!("--completions {shell}")).unwrap().unwrap().contains("pattern"), "{shell}");
        }
        assert!(asked("--completions").unwrap().unwrap_err().contains("bash, zsh and fish"));
        assert!(asked("--completions tcsh").unwrap().is_err());
        for other in ["a.exr --manual", "--manual a.exr", "--pattern rggb", "-o --manual"] {
            assert_eq!(asked(other), None, "{other}");
        }
    }
}
