//! What to do about an error, in the options of the program that met it.

use crate::error::{Advice, Error};
use crate::formats::data::spectrum_file;
use crate::formats::files::hint_of_missing;
use clap::Command;
use std::ffi::OsString;
use std::io;
use std::path::Path;

/// What supplies a key that metadata lack, the better choice first; it counts where the program has all its options.
const SUPPLIES: [(&str, &str); 14] = [
    ("sensor", "--sensor NAME|FILE, or all of --bits, --bias and --slope"),
    ("sensor.readout", "one that has it, --readout NAME|FILE, or a sensor that has it, --sensor NAME|FILE"),
    ("sensor.readout", "a sensor that has it, --sensor NAME|FILE"),
    ("sensor.response", "a sensor that has it, --sensor NAME|FILE"),
    ("sensor", "--sensor NAME|FILE"),
    ("exposure", "--exposure S and --f-number N"),
    ("exposure_time_s", "--exposure S"),
    ("white_level_adu", "--white-luminance CD_PER_M2"),
    ("white_level_adu", "--white N"),
    ("black_level_adu", "--black N, 0 where it is off already"),
    ("dark_signal_e", "--black N, 0 where it is off already"),
    ("adc", "--black N, or --black auto where the level is known"),
    ("cfa", "--cfa PATTERN"),
    ("color.white", "--white-luminance CD_PER_M2"),
];

/// What the names of reports end in.
const REPORTS: [&str; 6] = ["txt", "text", "json", "yaml", "yml", "csv"];

/// An error in words, with what to do about it in options that `command` has.
pub(super) fn advised(error: &Error, command: &Command) -> String {
    match error {
        Error::MissingKey { key, .. } => match supply(key, command) {
            Some(supply) => format!("{error}; give {supply}"),
            None => error.to_string(),
        },
        Error::Advised { error, advice } => {
            format!(
                "{}; {}",
                advised(error, command),
                advice.in_words(|setting| match advice {
                    // Whether the option stands there with a value or without.
                    Advice::LeaveOut(_) => long(setting),
                    Advice::Give(_) | Advice::Change(_) => option(setting, command),
                })
            )
        }
        Error::Disk { file, action: "open", source } if source.kind() == io::ErrorKind::NotFound => {
            let words: Vec<OsString> = std::env::args_os().skip(1).collect();
            let path = Path::new(file);
            let hint = misplaced(file, command, &in_text(&words)).or_else(|| known_spectrum(path));
            let hint = hint.or_else(|| hint_of_missing(path));
            hint.map_or_else(|| error.to_string(), |hint| format!("{error}; {hint}"))
        }
        _ => error.to_string(),
    }
}

/// Arguments as texts.
pub(super) fn in_text(words: &[OsString]) -> Vec<String> {
    words.iter().map(|word| word.to_string_lossy().into_owned()).collect()
}

/// What a word may be that was taken for the name of an input, where there is no such file: the value of an option before it that takes
/// one behind `=` alone, or the last of several, an output.
fn misplaced(word: &str, command: &Command, words: &[String]) -> Option<String> {
    let place = words.iter().position(|one| one == word)?;
    let before = words.get(place.checked_sub(1)?)?;
    let Some(long) = before.strip_prefix("--") else {
        let is_last = place + 1 == words.len() && !before.starts_with('-');
        return is_last.then(|| output_hint(word, command, words)).flatten();
    };
    let option = command.get_arguments().find(|argument| argument.get_long() == Some(long));
    let takes_behind = option.is_some_and(clap::Arg::is_require_equals_set);
    takes_behind.then(|| format!("a value of --{long} stands behind `=`, as in `--{long}={word}`"))
}

/// What a name of no file is that is known as one of a spectrum, to programs that read frames.
fn known_spectrum(path: &Path) -> Option<String> {
    let named = [path.to_owned(), path.with_extension("csv")];
    let known = named.into_iter().find(|path| spectrum_file(path) != *path)?;
    let name = known.display();
    Some(format!("a spectrum of that name comes with the programs: `render-radiance {name}` makes a frame of it"))
}

/// How an output is named, where a word that is none of an option looks like one and no output is named otherwise.
pub(super) fn output_hint(word: &str, command: &Command, words: &[String]) -> Option<String> {
    let is_named = words.iter().any(|one| one.starts_with("--output") || one.starts_with("-o"));
    let takes_one = command.get_arguments().any(|one| one.get_long() == Some("output") && one.get_short() == Some('o'));
    let ending = Path::new(word).extension().map(|end| end.to_string_lossy().to_ascii_lowercase());
    let is_file = ending.is_some_and(|end| !has("output-format", command) || REPORTS.contains(&end.as_str()));
    let is_file = is_file && !word.starts_with('-');
    (takes_one && is_file && !is_named).then(|| format!("for an output write `-o {word}`"))
}

/// The options that supply a key, or metadata that hold it.
fn supply(key: &str, command: &Command) -> Option<String> {
    let of_key = |known: &str| key.strip_prefix(known).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'));
    let known = SUPPLIES.into_iter().filter(|(known, _)| of_key(known)).map(|(_, supply)| supply);
    let mut usable = known.filter(|supply| options_of(supply).all(|option| has(option, command)));
    let in_metadata =
        || has("metadata", command).then(|| "--metadata FILE with it beside all else that is known".to_owned());
    usable.next().map(str::to_owned).or_else(in_metadata)
}

/// The names of the options that a text mentions.
fn options_of(text: &str) -> impl Iterator<Item = &str> {
    let words = text.split([' ', ',']);
    words.filter_map(|word| word.strip_prefix("--"))
}

fn has(option: &str, command: &Command) -> bool {
    command.get_arguments().any(|argument| argument.get_long() == Some(option))
}

/// A setting as the command line calls it: `white_luminance` is `--white-luminance`; an option whose value must follow an
/// equals sign is shown with it.
fn option(setting: &str, command: &Command) -> String {
    let long = long(setting);
    let argument = command.get_arguments().find(|argument| argument.get_long() == long.strip_prefix("--"));
    match argument.filter(|argument| argument.is_require_equals_set()).and_then(|argument| argument.get_value_names()) {
        Some([value, ..]) => format!("{long}={value}"),
        _ => long,
    }
}

/// The name of the option of a setting.
fn long(setting: &str) -> String {
    format!("--{}", setting.replace('_', "-"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Arg;

    fn program(options: &[&'static str]) -> Command {
        options.iter().fold(Command::new("test"), |command, option| command.arg(Arg::new(*option).long(*option)))
    }

    #[test]
    fn an_output_that_is_a_report_ends_as_one() {
        let output = Arg::new("output").long("output").short('o');
        let command = Command::new("test").arg(output).arg(Arg::new("form").long("output-format"));
        assert_eq!(output_hint("c.exr", &command, &[]), None);
        assert_eq!(output_hint("c.json", &command, &[]).as_deref(), Some("for an output write `-o c.json`"));
    }

    #[test]
    fn what_was_taken_for_an_input_may_be_another_word() {
        let command = Command::new("test")
            .arg(Arg::new("output").long("output").short('o'))
            .arg(Arg::new("patches").long("patches").num_args(0..=1).require_equals(true))
            .arg(Arg::new("sigma").long("sigma"));
        for (line, word, wanted) in [
            ("a.exr --patches 3x3", "3x3", Some("a value of --patches stands behind `=`, as in `--patches=3x3`")),
            ("a.exr b.exr", "b.exr", Some("for an output write `-o b.exr`")),
            ("a.exr b.exr", "a.exr", None),
            ("a.exr b", "b", None),
            ("a.exr b.exr -o c.exr", "b.exr", None),
            ("--sigma a.exr", "a.exr", None),
            ("a.exr", "a.exr", None),
        ] {
            let words: Vec<String> = line.split(' ').map(str::to_owned).collect();
            assert_eq!(misplaced(word, &command, &words).as_deref(), wanted, "{line}");
        }
    }

    #[test]
    fn a_missing_key_is_supplied_by_options_that_the_program_has() {
        let said = |key, options: &[&'static str]| {
            advised(&Error::MissingKey { file: "a.exr".into(), key }, &program(options))
        };
        let missing = "a.exr: its sensor has no `bits`";
        let all = "; give --sensor NAME|FILE, or all of --bits, --bias and --slope";
        assert_eq!(said("sensor.bits", &["sensor", "bits", "bias", "slope"]), format!("{missing}{all}"));
        assert_eq!(said("sensor.bits", &["sensor"]), format!("{missing}; give --sensor NAME|FILE"));
        assert_eq!(
            said("sensor.bits", &["metadata"]),
            format!("{missing}; give --metadata FILE with it beside all else that is known")
        );
        assert_eq!(said("sensor.bits", &[]), missing);
        assert_eq!(said("sensors", &["sensor"]), "a.exr: the metadata has no `sensors`");
        let exposure = "a.exr: the metadata has no `exposure`";
        assert_eq!(
            said("exposure", &["exposure", "metadata"]),
            format!("{exposure}; give --metadata FILE with it beside all else that is known")
        );
    }

    #[test]
    fn settings_are_called_by_their_options() {
        let command = program(&["black", "white-luminance"])
            .arg(Arg::new("patches").long("patches").require_equals(true).num_args(0..=1).value_name("WxH"));
        let wrong = || Error::Usage("it is wrong".into());
        let said = |error: Error| advised(&error, &command);
        assert_eq!(said(wrong().give(&["black", "dark", "cte"])), "it is wrong; give --black, --dark or --cte");
        assert_eq!(said(wrong().give(&["patches"])), "it is wrong; give --patches=WxH");
        assert_eq!(said(wrong().leave_out(&["patches"])), "it is wrong; leave out --patches");
        let both = wrong().leave_out(&["black", "white_luminance"]);
        assert_eq!(both.to_string(), "it is wrong; leave out `black` and `white_luminance`");
        assert_eq!(both.exit_status(), 2);
        assert_eq!(said(both), "it is wrong; leave out --black and --white-luminance");
        assert_eq!(said(wrong().change(&["exposure"])), "it is wrong; give another --exposure");
    }
}
