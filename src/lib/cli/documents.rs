//! What is made of a program's definition of its arguments, and printed instead of running: its manual page, completions for
//! shells, its line in a list of programs.

use super::roster::PROGRAMS;
use super::{completions, examples};
use clap::Command;
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
        (COMPLETIONS, shell) => {
            let script = completions::script(&shell.unwrap_or_default().to_string_lossy(), command);
            Some(script.map(String::into_bytes))
        }
        _ => None,
    }
}

/// A manual page of section 1, in roff.
fn manual(command: &Command) -> io::Result<Vec<u8>> {
    let project = env!("CARGO_PKG_NAME");
    let name = command.get_name();
    let mut page = Vec::new();
    let source = concat!(env!("CARGO_PKG_NAME"), " ", env!("CARGO_PKG_VERSION"));
    // Examples are a section of their own, as is what calls it.
    let plain = without_summary(command.clone().after_long_help(None::<&str>));
    let [arguments, options] = parted(plain);
    let man = Man::new(options).source(source).manual(project);
    man.render_title(&mut page)?;
    man.render_name_section(&mut page)?;
    page.extend(synopsis(command).bytes());
    man.render_description_section(&mut page)?;
    let mut first = Vec::new();
    Man::new(arguments).render_options_section(&mut first)?;
    page.extend(String::from_utf8_lossy(&first).replace(".SH OPTIONS", ".SH ARGUMENTS").bytes());
    man.render_options_section(&mut page)?;
    page.extend(examples::roff(name).bytes());
    page.extend(format!("{}{}{}", exit_status(name), ENVIRONMENT, files(command)).bytes());
    page.extend(see_also(name).bytes());
    Ok(page)
}

/// A program with its arguments alone, which come first as in help, and with its options alone.
fn parted(mut command: Command) -> [Command; 2] {
    // The option that gives help is among them from now on.
    command.build();
    [false, true].map(|is_of_options| {
        command.clone().mut_args(|argument| match argument.is_positional() == is_of_options {
            true => argument.hide(true),
            false => argument,
        })
    })
}

/// The same with a description that does not begin with what stands behind the name.
fn without_summary(command: Command) -> Command {
    let long = command.get_long_about().map(ToString::to_string).unwrap_or_default();
    let about = command.get_about().map(ToString::to_string).unwrap_or_default();
    match long.strip_prefix(&about).map(|rest| rest.trim_start().to_owned()) {
        Some(rest) if !rest.is_empty() => command.long_about(rest),
        _ => command,
    }
}

/// How the program is called: its arguments, and that it has options.
fn synopsis(command: &Command) -> String {
    let usage = command.clone().render_usage().to_string();
    let words = usage.trim_start_matches("Usage: ").split_whitespace().skip(1);
    let word = |word: &str| match word.strip_prefix("--") {
        Some(_) => format!("\\fB{}\\fR", escaped(word)),
        None => word
            .chars()
            .map(
                |c| if "[]|.<>()".contains(c) { c.to_string() } else { format!("\\fI{}\\fR", escaped(&c.to_string())) },
            )
            .collect::<String>(),
    };
    let words: Vec<String> = words.map(word).collect();
    format!(".SH SYNOPSIS\n\\fB{}\\fR {}\n", escaped(command.get_name()), words.join(" ").replace("\\fR\\fI", ""))
}

/// What the status says that the program ends with.
fn exit_status(program: &str) -> String {
    let check = if program == "measure" { ", or a prediction that does not hold (\\fB\\-\\-check\\fR)" } else { "" };
    format!(
        ".SH \"EXIT STATUS\"\n.TP\n\\fB0\\fR\nAll is done, perhaps with warnings.\n.TP\n\\fB1\\fR\nBad data, a file that cannot be read \
         or written{check}. What is not whole is not left behind.\n.TP\n\\fB2\\fR\nBad usage: nothing was done.\n.TP\n\\fB101\\fR\nAn error of the \
         program itself.\n"
    )
}

const ENVIRONMENT: &str = ".SH ENVIRONMENT\n.TP\n\\fBCYANOMETER_DATA\\fR\nDirectories, parted by colons, in which sensors, charts and \
                           spectra are looked for by name before all others.\n.TP\n\\fBCYANOMETER_VECTORS\\fR\nThe widest vector \
                           instructions allowed: baseline, avx2 or avx512. The numbers are the same.\n.TP\n\\fBTMPDIR\\fR\nDirectory of \
                           temporary files, /tmp by default.\n";

/// Files besides those that arguments name.
fn files(command: &Command) -> String {
    let sidecar = command.get_arguments().any(|option| option.get_long() == Some("resume"));
    let sidecar = if sidecar {
        ".TP\n\\fIFILE\\fR.yaml\nThe sidecar of a frame \\fIFILE\\fR, read and written with it: its metadata.\n"
    } else {
        ""
    };
    format!(
        ".SH FILES\n{sidecar}.TP\n\\fIPREFIX\\fR/share/cyanometer\nSensors, charts and spectra that are known by name, of programs in \
         \\fIPREFIX\\fR/bin; \\fBcyanometer list\\fR tells them.\n"
    )
}

/// The front door, and the programs that the examples name; of the front door all programs.
fn see_also(program: &str) -> String {
    let project = env!("CARGO_PKG_NAME");
    let commands = || examples::of(program).iter().flat_map(|example| example.command.split(' '));
    let is_near = |other: &&str| program == project || commands().any(|word| word == *other);
    let others = PROGRAMS.into_iter().filter(|other| *other != program).filter(is_near);
    let all = others.chain(Some(project).filter(|project| *project != program));
    let names: Vec<String> = all.map(|name| format!("\\fB{}\\fR(1)", escaped(name))).collect();
    format!(".SH \"SEE ALSO\"\n{}\n", names.join(", "))
}

fn escaped(text: &str) -> String {
    text.replace('-', "\\-")
}

fn summary(command: &Command) -> String {
    command.get_about().map(|about| format!("{about}\n")).unwrap_or_default()
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
