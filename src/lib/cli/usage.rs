//! Complaints of the crate `clap` about the command line, in our words.
//!
//! It tells what is wrong by kind and context; of its text only the first line of what has no kind here is taken.

use super::advice::output_hint;
use crate::formats::foreign::number_complaint;
use crate::formats::keys;
use crate::names::nearest;
use clap::Command;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use std::path::Path;

/// The word that begins as an argument with one dash does, where a file is called so.
fn of_file<'a>(argument: &str, words: &'a [String]) -> Option<&'a str> {
    let is_one = |word: &&String| word.starts_with(argument) && !word.starts_with("--") && Path::new(word).is_file();
    words.iter().find(is_one).filter(|_| argument.starts_with('-')).map(String::as_str)
}

/// What to say of a file too many, where it may be no output: the option that takes it where it is a file of ours, or how many the program
/// takes.
fn too_many(argument: &str, command: &Command, words: &[String]) -> Option<String> {
    if argument.starts_with('-') || !Path::new(argument).is_file() {
        return None;
    }
    let has = |option: &str| command.get_arguments().any(|one| one.get_long() == option.strip_prefix("--"));
    let told = keys::kind_of_file(Path::new(argument)).and_then(|kind| kind.rsplit_once(", for "));
    if let Some((kind, option)) = told.filter(|(_, option)| has(option)) {
        return Some(format!("it is {kind}: give it as `{option} {argument}`"));
    }
    let ending = Path::new(argument).extension().map(|ending| ending.to_string_lossy().to_lowercase());
    if told.is_none() && ending.is_some_and(|ending| ["yaml", "yml"].contains(&ending.as_str())) {
        let options: Vec<&str> = YAML_OPTIONS.into_iter().filter(|option| has(option)).collect();
        if let [others @ .., last] = &options[..] {
            let all = if others.is_empty() { (*last).to_owned() } else { format!("{} or {last}", others.join(", ")) };
            return Some(format!("a YAML file is the value of {all}"));
        }
    }
    if told.is_none() && output_hint(argument, command, words).is_some() {
        return None;
    }
    match command.get_positionals().count() {
        1 => Some("the program takes one input".into()),
        2 => Some("the program takes two inputs".into()),
        _ => None,
    }
}

/// Options whose value is a YAML file.
const YAML_OPTIONS: [&str; 3] = ["--matrix", "--sensor", "--metadata"];

/// clap's complaint in one line about the arguments of `command`, which are these words.
pub(super) fn one_line(program: &str, error: &clap::Error, command: &Command, words: &[String]) -> String {
    let context = |kind| match error.get(kind) {
        Some(ContextValue::String(text)) => Some(text.clone()),
        Some(ContextValue::Strings(texts)) => Some(texts.join(", ")),
        _ => None,
    };
    let argument = context(ContextKind::InvalidArg).unwrap_or_default();
    let value = context(ContextKind::InvalidValue).unwrap_or_default();
    let problem = match error.kind() {
        ErrorKind::UnknownArgument => unknown(&argument, command, words),
        ErrorKind::InvalidValue if value.is_empty() => format!("{argument} needs a value"),
        ErrorKind::InvalidValue => {
            let choices = context(ContextKind::ValidValue);
            let hint = in_words(choices.as_ref().and_then(|list| near_value(&value, list)));
            let choices = choices.map_or(String::new(), |list| format!("; it is one of {list}"));
            format!("`{value}` is no value for {argument}{choices}{hint}")
        }
        ErrorKind::ValueValidation => {
            let reason = std::error::Error::source(error)
                .map_or(String::new(), |source| format!(": {}", number_complaint(&source.to_string())));
            let hint = respelled(&value, command, words).map_or(String::new(), |text| format!("; {text}"));
            format!("`{value}` is no value for {argument}{reason}{hint}")
        }
        ErrorKind::MissingRequiredArgument if is_always_needed(&argument, command) => {
            let last = words.last().filter(|last| {
                let ending = argument.strip_prefix("--output <FILE").and_then(|shown| shown.strip_suffix('>'));
                words.len() > 1 && ending.is_some_and(|ending| ending.starts_with('.') && last.ends_with(ending))
            });
            let hint = last.and_then(|last| output_hint(last, command, words));
            format!("{argument} is missing{}", hint.map_or(String::new(), |hint| format!("; {hint}")))
        }
        ErrorKind::MissingRequiredArgument => {
            let any = argument.trim_start_matches('<').replace(">>", ">").replace('|', " or ");
            let any = if argument.starts_with("<--") { any } else { argument };
            let idle = idle_option(command, words).unwrap_or("an option that is given");
            format!("{any} is missing, without which {idle} has no effect")
        }
        ErrorKind::TooManyValues => {
            let bare = argument.split([' ', '=']).next().unwrap_or(&argument).to_owned();
            format!("{bare} takes no value; leave `{value}` out")
        }
        ErrorKind::ArgumentConflict => {
            let other = context(ContextKind::PriorArg).unwrap_or_default();
            if argument == other || other.is_empty() {
                format!("{argument} is given twice")
            } else {
                format!("{argument} and {other} exclude each other")
            }
        }
        _ => {
            let text = error.to_string();
            text.lines().next().unwrap_or_default().trim_start_matches("error: ").to_owned()
        }
    };
    let joined = if problem.ends_with('?') { " See" } else { "; see" };
    format!("{problem}{joined} `{program} --help`")
}

/// What may be meant, behind a complaint.
fn in_words(meant: Option<String>) -> String {
    meant.map_or(String::new(), |meant| format!("; did you mean `{meant}`?"))
}

/// The complaint of an argument that is none here.
fn unknown(argument: &str, command: &Command, words: &[String]) -> String {
    let hint = in_words(meant(argument, command, words).or_else(|| near_option(argument, command)));
    let hint = if hint.is_empty() { elsewhere(argument).unwrap_or_default() } else { hint };
    let hint = output_hint(argument, command, words).map_or(hint, |output| format!("; {output}"));
    let hint = too_many(argument, command, words).map_or(hint, |taken| format!("; {taken}"));
    let hint = in_quotes(argument, command, words).map_or(hint, |quoted| format!("; write {quoted}"));
    let hint = of_file(argument, words).map_or(hint, |file| format!("; for the file write `./{file}`"));
    let hint = negative_value(argument, words)
        .map_or(hint, |value| format!("; a value that begins with - stands behind =: {value}"));
    let argument = one_dash(argument, words).unwrap_or(argument);
    format!("unknown option or extra argument `{argument}`{hint}")
}

/// Where an option is at home that this program lacks, behind a complaint.
fn elsewhere(argument: &str) -> Option<String> {
    let typed = argument.strip_prefix("--")?;
    if typed == "list" {
        return Some("; `cyanometer list` tells the spectra, sensors and tables that come with the programs".into());
    }
    if typed == "template" {
        return Some("; `cyanometer template sensor`, `… matrix` or `… metadata` prints a file to fill in".into());
    }
    let (program, _) = ELSEWHERE.into_iter().find(|(_, options)| options.contains(&typed))?;
    Some(format!("; it is an option of `{program}`"))
}

/// An option with a value behind an equals sign that was taken for an option of its own: `--size -5x480`.
fn negative_value(argument: &str, words: &[String]) -> Option<String> {
    let typed = argument.strip_prefix('-').filter(|rest| rest.starts_with(|c: char| c.is_ascii_digit() || c == '.'))?;
    let place = words.iter().position(|word| word.strip_prefix('-').is_some_and(|rest| rest.starts_with(typed)))?;
    let option = words.get(place.checked_sub(1)?).filter(|word| word.starts_with("--") && !word.contains('='))?;
    Some(format!("{option}={}", words[place]))
}

/// The option without which nothing would be missing.
fn idle_option<'a>(command: &Command, words: &'a [String]) -> Option<&'a str> {
    let is_enough_without = |place: usize, of_it: usize| {
        let kept = words
            .iter()
            .enumerate()
            .filter(|(at, _)| !(place..place + of_it).contains(at))
            .map(|(_, word)| word.as_str());
        let parsed = command.clone().try_get_matches_from(std::iter::once("").chain(kept));
        parsed.is_ok()
    };
    let options = words.iter().enumerate().filter(|(_, word)| word.starts_with("--"));
    let has_value = |place: usize| words.get(place + 1).is_some_and(|next| !next.starts_with('-'));
    let mut idle =
        options.filter(|(place, _)| is_enough_without(*place, 1) || has_value(*place) && is_enough_without(*place, 2));
    idle.next().map(|(_, word)| word.split('=').next().unwrap_or(word))
}

/// An option with its value in quotes, where an argument too many is part of that: `--radiance-unit W m-2 sr-1 nm-1`.
fn in_quotes(argument: &str, command: &Command, words: &[String]) -> Option<String> {
    let place = words.iter().position(|word| word == argument && !word.starts_with('-'))?;
    let option = words.get(place.checked_sub(2)?).filter(|word| word.starts_with("--") && !word.contains('='))?;
    let rest = words[place..].iter().take_while(|word| !word.starts_with('-'));
    let value = std::iter::once(&words[place - 1]).chain(rest).map(String::as_str).collect::<Vec<_>>().join(" ");
    let is_taken = |value: &str| {
        let words = [String::new(), format!("{option}={value}")];
        let refused = command.clone().try_get_matches_from(words).err();
        !refused.is_some_and(|error| {
            matches!(error.kind(), ErrorKind::InvalidValue | ErrorKind::ValueValidation | ErrorKind::UnknownArgument)
        })
    };
    (is_taken(&value) && !is_taken("\u{1}")).then(|| format!("{option} '{value}'"))
}

/// What to write for a value that is none, as it would be taken: with points for decimal commas, commas for semicolons between numbers, the
/// letter x for another sign between the sides of a size; both where commas may be marks of thousands; nothing where none of these makes a
/// value of it. Where commas part the numbers of a list they are no others until its reader says so.
fn respelled(value: &str, command: &Command, words: &[String]) -> Option<String> {
    let points = value.replace(',', ".");
    // `0,5,1,5`: every second comma parts numbers.
    let parts: Vec<&str> = value.split(',').collect();
    let pairs = || parts.chunks(2).map(|pair| pair.join(".")).collect::<Vec<_>>().join(",");
    let candidates = [
        points.clone(),
        points.replace(';', ",").replace(' ', ""),
        value.replace(';', ",").replace(' ', ""),
        if parts.len() > 2 && parts.len().is_multiple_of(2) { pairs() } else { points.clone() },
        // `0:5`, `0-5`: of more numbers these may be other things.
        if parts.len() == 1 && value.matches([':', '-']).count() == 1 {
            value.replace([':', '-'], ",")
        } else {
            points.clone()
        },
        value.replace(['×', '*', 'X', ',', ';', ' '], "x").replace("xx", "x"),
    ];
    let given: Vec<usize> = (0..words.len()).filter(|place| words[*place].ends_with(value)).collect();
    let is_taken = |candidate: &String| {
        given.iter().any(|place| {
            let mut words: Vec<String> = std::iter::once(String::new()).chain(words.iter().cloned()).collect();
            let word = &mut words[place + 1];
            *word = format!("{}{candidate}", &word[..word.len() - value.len()]);
            let refused = command.clone().try_get_matches_from(words).err();
            // Another word may be wrong as well.
            let wrong = refused.as_ref().and_then(|error| error.get(ContextKind::InvalidValue));
            !matches!(wrong, Some(ContextValue::String(wrong)) if wrong == candidate || wrong == value)
        })
    };
    // What takes any word, as the name of a file, says nothing.
    let takes_any = is_taken(&"\u{1}".to_owned());
    let found = candidates.into_iter().find(|candidate| candidate != value && !takes_any && is_taken(candidate))?;
    // `1,753` may be 1753 as well.
    let whole = without_thousands(value).filter(|whole| is_taken(whole));
    let is_list = !value.contains(';') && value.contains(',');
    let takes_lists = is_list && LISTS.iter().any(|list| is_taken(&(*list).to_owned()));
    Some(match whole {
        _ if takes_lists && found.contains(',') => format!("where its commas are decimal, write {found}"),
        Some(whole) if takes_lists => format!("where one number is meant, write {whole} or {found}"),
        None if takes_lists && !found.contains('x') => format!("where one number is meant, write {found}"),
        Some(whole) => format!("write {whole}, or {found} where that is meant"),
        None => format!("write {found}"),
    })
}

/// Options that people give to other programs than those that have them.
const ELSEWHERE: [(&str, &[&str]); 8] = [
    ("render-radiance", &["electrons", "exposure", "expose-to"]),
    ("add-noise", &["seed", "sensor-seed"]),
    ("digitize", &["bits", "slope", "bias"]),
    ("correct-frame", &["dark", "flat"]),
    ("demosaic", &["method"]),
    ("to-xyz", &["matrix", "space"]),
    ("measure", &["check"]),
    ("preview", &["false-color"]),
];

/// Lists of numbers, of which an option that takes such takes one.
const LISTS: [&str; 4] = ["1,2", "1,2,3", "1,2,3,4", "1,2,3,4,5,6,7,8"];

/// Numbers without marks of thousands, where all commas can be such, alone or between numbers: `8,000,12,000`.
fn without_thousands(value: &str) -> Option<String> {
    let parts: Vec<&str> = value.split(',').collect();
    let are_digits = |part: &str| part.bytes().all(|byte| byte.is_ascii_digit());
    let may_be = |pair: &[&str]| match pair {
        [before, behind] => {
            (1..=3).contains(&before.len()) && !before.starts_with('0') && behind.len() == 3 && are_digits(before)
        }
        _ => false,
    };
    let are_thousands = parts.chunks(2).all(|pair| may_be(pair) && are_digits(pair[1]));
    are_thousands.then(|| parts.chunks(2).map(<[&str]>::concat).collect::<Vec<_>>().join(","))
}

/// The option whose name is near to one that there is not: one begins with the other, or few letters differ.
fn near_option(argument: &str, command: &Command) -> Option<String> {
    let typed = argument.strip_prefix("--")?;
    let names = command.get_arguments().filter(|option| !option.is_hide_set()).filter_map(clap::Arg::get_long);
    let found = near(typed, &names.collect::<Vec<_>>())?;
    Some(format!("--{found}"))
}

/// The value of a list between commas that a typed one is another's name for, or is near to.
fn near_value(typed: &str, list: &str) -> Option<String> {
    let values: Vec<&str> = list.split(", ").collect();
    let bare = typed.to_lowercase().replace(['_', '-', ' '], "");
    let guess = GUESSED_VALUES.iter().find(|(guess, value)| *guess == bare && values.contains(value));
    guess.map(|(_, value)| *value).or_else(|| near(&typed.to_lowercase(), &values)).map(str::to_owned)
}

/// The known name that is near to a typed one.
fn near<'a>(typed: &str, known: &[&'a str]) -> Option<&'a str> {
    /// So many letters are enough to know a name by.
    const LETTERS: usize = 4;
    let begins = |long: &str, short: &str| short.len() >= LETTERS && long.starts_with(short);
    let known = || known.iter().copied();
    let longest_within = || known().filter(|name: &&str| begins(typed, name)).max_by_key(|name| name.len());
    let shortest_around = || known().filter(|name: &&str| begins(name, typed)).min_by_key(|name| name.len());
    // A letter of three may differ, of eight three.
    let farthest = |name: &str| (typed.chars().count().min(name.len()) + 1) / 3;
    nearest(typed, known(), farthest).or_else(longest_within).or_else(shortest_around)
}

/// Values as people guess them, without marks between words, and what they are here; it counts where the option has the value.
const GUESSED_VALUES: [(&str, &str); 14] = [
    ("readnoise", "ron"),
    ("readoutnoise", "ron"),
    ("read", "ron"),
    ("readout", "ron"),
    ("shotnoise", "ssn"),
    ("shot", "ssn"),
    ("photonnoise", "ssn"),
    ("photonshotnoise", "ssn"),
    ("darkcurrent", "dcsn"),
    ("darkcurrentnoise", "dcsn"),
    ("darkshotnoise", "dcsn"),
    ("darknoise", "dcsn"),
    ("hotpixel", "hot_pixels"),
    ("hotpixels", "hot_pixels"),
];

/// Options as people guess them, and what they are here; it counts where the program has the option.
const GUESSES: [(&str, &str); 41] = [
    ("aperture", "--f-number"),
    ("fnumber", "--f-number"),
    ("time", "--exposure"),
    ("exposure-time", "--exposure"),
    ("shutter", "--exposure"),
    ("bit-depth", "--bits"),
    ("depth", "--bits"),
    ("gain", "--slope"),
    ("offset", "--bias"),
    ("width", "--size"),
    ("height", "--size"),
    ("resolution", "--size"),
    ("camera", "--sensor"),
    ("roi", "--region"),
    ("format", "--output-format"),
    ("colormap", "--false-color"),
    ("cmap", "--false-color"),
    ("algorithm", "--method"),
    ("bayer", "--cfa"),
    ("bayer", "--pattern"),
    ("layer", "--plane"),
    ("stretch", "--range"),
    ("scale", "--range"),
    ("limits", "--range"),
    ("max-width", "--fit"),
    ("thumbnail", "--fit"),
    ("colorspace", "--space"),
    ("color-space", "--space"),
    ("errors", "--sigma"),
    ("error-bars", "--sigma"),
    ("std", "--sigma"),
    ("uncertainty", "--sigma"),
    ("iso", "--setting"),
    ("bitdepth", "--bits"),
    ("read-noise", "--without"),
    ("no-prnu", "--without"),
    ("ccm", "--matrix"),
    ("illuminant", "--white"),
    ("whitepoint", "--white"),
    ("white-point", "--white"),
    ("no-noise", "--without"),
];

/// The word with one dash that an option of a letter was taken from: `-s` of `-size`.
fn one_dash<'a>(argument: &str, words: &'a [String]) -> Option<&'a str> {
    let letter = argument.strip_prefix('-').filter(|letter| letter.chars().count() == 1 && *letter != "-")?;
    let is_it = |word: &&String| word.strip_prefix('-').is_some_and(|rest| rest.len() > 1 && rest.starts_with(letter));
    words.iter().find(is_it).map(String::as_str)
}

/// What was meant by an option that there is not: one with two dashes, the value of one that takes few, another's name for it.
fn meant(argument: &str, command: &Command, words: &[String]) -> Option<String> {
    let has = |long: &str| command.get_arguments().any(|option| option.get_long() == Some(long));
    if let Some(word) = one_dash(argument, words) {
        let long = word.trim_start_matches('-').split('=').next().unwrap_or_default();
        return has(long).then(|| format!("-{word}"));
    }
    let typed = argument.strip_prefix("--")?;
    let by_value = command.get_arguments().find_map(|option| {
        let long = option.get_long()?;
        let is_one = option.get_possible_values().iter().any(|value| value.matches(typed, true));
        is_one.then(|| format!("--{long} {typed}"))
    });
    let by_name = || {
        let guess = GUESSES.iter().find(|(guess, option)| *guess == typed && has(&option[2..]));
        guess.map(|(_, option)| (*option).to_owned())
    };
    // `--unit` for `--radiance-unit`.
    let by_part = || {
        let one = typed.strip_suffix('s').unwrap_or(typed);
        let is_part =
            |long: &&str| long.split('-').count() > 1 && long.split('-').any(|part| part == typed || part == one);
        let mut found = command.get_arguments().filter_map(clap::Arg::get_long).filter(is_part);
        found.next().filter(|_| found.next().is_none()).map(|long| format!("--{long}"))
    };
    by_value.or_else(by_name).or_else(by_part)
}

/// Whether an argument, as clap shows it, is needed whatever options are given: of options those that are declared so.
fn is_always_needed(shown: &str, command: &Command) -> bool {
    let named = |long: &str| shown == format!("--{long}") || shown.starts_with(&format!("--{long} "));
    let option = command.get_arguments().find(|argument| argument.get_long().is_some_and(named));
    option.map_or(!shown.starts_with("<--"), clap::Arg::is_required_set)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::{Arg, ArgAction, ArgGroup};

    fn command() -> Command {
        Command::new("measure")
            .arg(Arg::new("input"))
            .arg(Arg::new("seed").long("seed").value_parser(clap::value_parser!(u8)))
            .arg(Arg::new("method").long("method").value_parser(["bi", "eci"]))
            .arg(Arg::new("share").long("share").short('f').value_parser(clap::value_parser!(f64)))
            .arg(Arg::new("sides").long("sides").value_parser(crate::requests::values::size))
            .arg(Arg::new("three").long("three").value_parser(crate::requests::values::three_numbers))
            .arg(Arg::new("unit").long("radiance-unit").value_parser(crate::requests::values::radiance_unit))
            .arg(Arg::new("black").long("black").value_parser(crate::requests::values::black_level))
            .arg(Arg::new("without").long("without").value_parser(["dcsn", "ssn", "ron", "row_noise"]))
            .arg(Arg::new("exposure").long("exposure"))
            .arg(Arg::new("free").long("noise-free").action(ArgAction::SetTrue))
            .arg(Arg::new("size").long("size").num_args(2))
            .arg(Arg::new("dark").long("dark").action(ArgAction::SetTrue).conflicts_with("seed"))
            .arg(Arg::new("level").long("level").num_args(1).require_equals(true))
            .arg(Arg::new("output").long("output").short('o').required(true))
            .arg(Arg::new("clip").long("clip").action(ArgAction::SetTrue).requires("dark"))
            .arg(Arg::new("kappa").long("kappa").action(ArgAction::SetTrue).requires("any"))
            .group(ArgGroup::new("any").args(["seed", "method"]).multiple(true))
    }

    fn two_of_black(value: &str, hint: &str) -> String {
        let hint = if hint.is_empty() { String::new() } else { format!("; {hint}") };
        format!(
            "`{value}` is no value for --black <black>: give a number, or four between commas for the 2x2 sites row by row{hint}"
        )
    }

    fn check(cases: &[(&str, &str)]) {
        for (line, wanted) in cases {
            let words = std::iter::once("measure").chain(line.split(' '));
            let error = command().try_get_matches_from(words).unwrap_err();
            let joined = if wanted.ends_with('?') { " See" } else { "; see" };
            let words: Vec<String> = line.split(' ').map(str::to_owned).collect();
            let said = one_line("measure", &error, &command(), &words);
            assert_eq!(said, format!("{wanted}{joined} `measure --help`"), "{line}");
        }
    }

    #[test]
    fn clap_says_what_is_expected_of_it() {
        check(&[
            ("--outptu a", "unknown option or extra argument `--outptu`; did you mean `--output`?"),
            ("a b --output c", "unknown option or extra argument `b`"),
            ("--sides 3x4 a b --output c", "unknown option or extra argument `b`"),
            ("--output c -size 1", "unknown option or extra argument `-size`; did you mean `--size`?"),
            ("--output c -x", "unknown option or extra argument `-x`"),
            ("--output c --eci", "unknown option or extra argument `--eci`; did you mean `--method eci`?"),
            ("--output c --width 4", "unknown option or extra argument `--width`; did you mean `--size`?"),
            ("--output c --aperture 8", "unknown option or extra argument `--aperture`"),
            ("a b.exr --output c", "unknown option or extra argument `b.exr`"),
            ("a b.exr", "unknown option or extra argument `b.exr`; for an output write `-o b.exr`"),
            ("--output", "--output <output> needs a value"),
            (
                "--output a --method ecii",
                "`ecii` is no value for --method <method>; it is one of bi, eci; did you mean `eci`?",
            ),
            ("--output a --seed x", "`x` is no value for --seed <seed>: a whole number is wanted"),
            ("--output a --seed 256", "`256` is no value for --seed <seed>: it lies within 0 and 255"),
            ("a", "--output <output> is missing"),
            ("--share 0,033", "`0,033` is no value for --share <share>: a number is wanted; write 0.033"),
            ("--share=0,033", "`0,033` is no value for --share <share>: a number is wanted; write 0.033"),
            ("-f0,033 --sides 3", "`0,033` is no value for --share <share>: a number is wanted; write 0.033"),
            ("--share 1,000,5", "`1,000,5` is no value for --share <share>: a number is wanted"),
        ]);
    }

    #[test]
    fn words_that_were_taken_for_others_are_told() {
        check(&[
            (
                "--three 1,5;2,5;3",
                "`1,5;2,5;3` is no value for --three <three>: give three numbers between commas; write 1.5,2.5,3",
            ),
            (
                "--three 1,5,2,5,3,5",
                "`1,5,2,5,3,5` is no value for --three <three>: give three numbers between commas; where its commas are decimal, write 1.5,2.5,3.5",
            ),
            ("--black 64,5", two_of_black("64,5", "where one number is meant, write 64.5").as_str()),
            ("--black 64,640", two_of_black("64,640", "where one number is meant, write 64640 or 64.640").as_str()),
            ("--black 64;5", two_of_black("64;5", "").as_str()),
            ("--black 1,2,3", two_of_black("1,2,3", "").as_str()),
            // The word behind the value of an option is no part of it where it is an option itself.
            ("--sides 8x8 --expose 1", "unknown option or extra argument `--expose`; did you mean `--exposure`?"),
            ("--sides 8x8 --observer 1", "unknown option or extra argument `--observer`"),
            (
                "a --list",
                "unknown option or extra argument `--list`; `cyanometer list` tells the spectra, sensors and tables that come with the programs",
            ),
            ("--seed 5 --foo 3", "unknown option or extra argument `--foo`"),
            ("--seed 5 --sidesize 3x3", "unknown option or extra argument `--sidesize`; did you mean `--sides`?"),
            (
                "a --radiance-unit W m-2 sr-1 nm-1",
                "unknown option or extra argument `m-2`; write --radiance-unit 'W m-2 sr-1 nm-1'",
            ),
            (
                "--without readnoise",
                "`readnoise` is no value for --without <without>; it is one of dcsn, ssn, ron, row_noise; did you mean `ron`?",
            ),
            (
                "--without poisson",
                "`poisson` is no value for --without <without>; it is one of dcsn, ssn, ron, row_noise",
            ),
            (
                "--sides 64×48",
                "`64×48` is no value for --sides <sides>: a size is WIDTHxHEIGHT in photosites, such as 1332x1000; write 64x48",
            ),
            ("--output a --output b", "--output <output> is given twice"),
            ("--output a --dark --seed 1", "--dark and --seed <seed> exclude each other"),
            ("--output a --clip", "--dark is missing, without which --clip has no effect"),
            (
                "--output a --kappa",
                "--seed <seed> or --method <method> is missing, without which --kappa has no effect",
            ),
            ("--output a --size 1", "2 values required for '--size <size> <size>' but 1 was provided"),
            ("--output a --level 1", "equal sign is needed when assigning values to '--level=<level>'"),
        ]);
    }
}
