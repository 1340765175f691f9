//! Completions for shells: options, and the values that are known by name.

use super::roster;
use crate::cfa::CfaPattern;
use crate::color::rgb::NamedPrimaries;
use crate::formats::inventory::{Kind, Known, known};
use crate::formats::keys::KeyPage;
use crate::names::Named;
use clap::builder::PossibleValuesParser;
use clap::{Arg, Command};
use clap_complete::Shell;

/// What the last cell of a sensor says that has no read-out.
const NO_READOUT: &str = "none";

/// A script that completes the program's options in a shell, and of their values those that are known by name, as
/// `cyanometer list` has them when the script is made.
///
/// # Errors
///
/// Which shells there are.
pub(super) fn script(shell: &str, command: &Command) -> Result<String, String> {
    let shell: Shell = match shell {
        "bash" => Shell::Bash,
        "zsh" => Shell::Zsh,
        "fish" => Shell::Fish,
        other => return Err(format!("there are no completions for `{other}`; known are bash, zsh and fish")),
    };
    let mut command = command.clone();
    let program = command.get_name().to_owned();
    let values: Vec<Values> = command.get_arguments().filter_map(Values::of).collect();
    for Values { id, words, .. } in &values {
        // The crate takes what lives as long as the process, which ends with the script.
        let parser = PossibleValuesParser::new(words.iter().map(|word| &*word.clone().leak()));
        command = command.mut_arg(id, |option| option.value_parser(parser));
    }
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut command, program.as_str(), &mut script);
    let mut script = String::from_utf8_lossy(&script).into_owned();
    for Values { words, .. } in values.iter().filter(|values| values.takes_files) {
        let (without, with) = beside_files(shell, words);
        script = script.replace(&without, &with);
    }
    for option in command.get_arguments() {
        script = with_endings(shell, option, script);
    }
    if program == env!("CARGO_PKG_NAME") {
        script = of_front(shell, script);
    }
    match (shell, spectra(&program)) {
        (Shell::Zsh, Some(names)) => script = with_spectra(&script, &names),
        (Shell::Fish, Some(names)) => script += &format!("complete -c {program} -F -a \"{names}\"\n"),
        _ => {}
    }
    if shell == Shell::Bash {
        // A word that begins no option is a file, which bash completes where nothing else is offered; the crate offers options.
        let options = "COMPREPLY=( $(compgen -W \"${opts}\" -- \"${cur}\") )\n            return 0\n            ;;";
        let offered = spectra(&program).map_or(String::new(), |names| {
            format!("COMPREPLY=($(compgen -W \"{names}\" -- \"${{cur}}\"; compgen -f -- \"${{cur}}\"))\n            ")
        });
        script = script.replace(options, &format!("{offered}return 0\n            ;;"));
        if program != env!("CARGO_PKG_NAME") {
            script = script.replace(" || ${COMP_CWORD} -eq 1 ]]", " ]]");
        }
    }
    Ok(script)
}

/// The script of the front door: programs alone at the first place; behind it what completes the program, or its own words.
fn of_front(shell: Shell, script: String) -> String {
    let own = [("list", of_all::<Kind>()), ("keys", of_all::<KeyPage>()), ("template", of_all::<KeyPage>())];
    match shell {
        Shell::Zsh => {
            let cases: String = own.iter().map(|(word, words)| format!("({word}) compadd {words};; ")).collect();
            let action = format!("Arguments of the program:{{case $words[1] in {cases}(*) _normal;; esac}}");
            script.replace("'::program", "':program").replace("Arguments of the program:_default", &action)
        }
        Shell::Bash => {
            let case = |(word, words): &(&str, String)| {
                format!(
                    "                {word})\n                    COMPREPLY=( $(compgen -W \"{words}\" -- \"${{cur}}\") )\n\
                     {:20}return 0\n{:20};;\n",
                    "", ""
                )
            };
            let cases: String = own.iter().map(case).collect();
            // A program's own script completes what stands behind its name, once it is loaded.
            let programs = roster::PROGRAMS.join("|");
            let of_program = format!(
                "                {programs})\n{:20}if [[ ${{COMP_CWORD}} -gt 1 ]]; then\n\
                 {:24}declare -F _comp_load >/dev/null && _comp_load \"${{COMP_WORDS[1]}}\" ||\n\
                 {:28}{{ declare -F __load_completion >/dev/null && __load_completion \"${{COMP_WORDS[1]}}\"; }}\n\
                 {:24}i=\"$(complete -p \"${{COMP_WORDS[1]}}\" 2>/dev/null)\"\n\
                 {:24}if [[ ${{i}} =~ -F\\ ([^\\ ]+) ]]; then\n\
                 {:28}COMP_WORDS=(\"${{COMP_WORDS[@]:1}}\"); COMP_CWORD=$((COMP_CWORD - 1))\n\
                 {:28}\"${{BASH_REMATCH[1]}}\" \"${{COMP_WORDS[0]}}\" \"${{cur}}\" \"${{prev}}\"\n\
                 {:24}fi\n{:24}return 0\n{:20}fi\n{:20};;\n",
                "", "", "", "", "", "", "", "", "", "", ""
            );
            let at_second =
                |cases: &str| format!("            case \"${{COMP_WORDS[1]}}\" in\n{cases}            esac\n");
            let previous = "            case \"${prev}\" in\n";
            let script = script.replacen(previous, &format!("{}{previous}", at_second(&cases)), 1);
            // Before the front door offers its own options.
            let options = "            if [[ ${cur} == -* ";
            script.replacen(options, &format!("{}{options}", at_second(&of_program)), 1)
        }
        _ => {
            // The crate completes no words but options in fish.
            let programs: Vec<&str> = roster::PROGRAMS.into_iter().chain(roster::OWN).collect();
            let begin = format!("complete -c {} -n", env!("CARGO_PKG_NAME"));
            let line = |(word, words): &(&str, String)| {
                format!("{begin} \"__fish_seen_subcommand_from {word}\" -f -a \"{words}\"\n")
            };
            let lines: String = own.iter().map(line).collect();
            let behind =
                programs.iter().filter(|program| !roster::OWN.contains(program)).copied().collect::<Vec<_>>().join(" ");
            let lines = lines
                + &format!("{begin} \"__fish_seen_subcommand_from {behind}\" -x -a \"(__fish_complete_subcommand)\"\n");
            format!("{script}{begin} __fish_use_subcommand -f -a \"{}\"\n{lines}", programs.join(" "))
        }
    }
}

/// The names of spectra that are known, of a program whose input is one.
fn spectra(program: &str) -> Option<String> {
    const TAKE_SPECTRA: [&str; 3] = ["render-radiance", "predict-noise", "fit-matrix"];
    let names = || known(Kind::Spectra).into_iter().map(|known| known.name).collect::<Vec<_>>().join(" ");
    TAKE_SPECTRA.contains(&program).then(names)
}

/// The script of zsh with names of spectra beside files where the input is completed.
fn with_spectra(script: &str, names: &str) -> String {
    let both = format!(":{{_alternative \"spectra\\:spectrum\\:({names})\" \"files\\:file\\:_files\"}}' \\");
    let is_input = |line: &str| line.starts_with("':") || line.starts_with("'*:");
    let line = |line: &str| match line.strip_suffix(":_files' \\") {
        Some(begin) if is_input(line) => begin.to_owned() + &both,
        _ => line.to_owned(),
    };
    script.lines().map(line).collect::<Vec<_>>().join("\n") + "\n"
}

/// The names of all values, blanks between them.
fn of_all<T: Named>() -> String {
    T::ALL.iter().map(|value| value.name()).collect::<Vec<_>>().join(" ")
}

/// The script with files of these endings alone, and directories, where what help shows of a value tells them: `FILE.svg|png`.
fn with_endings(shell: Shell, option: &Arg, script: String) -> String {
    let Some([shown]) = option.get_value_names() else { return script };
    let Some(endings) = shown.strip_prefix("FILE.") else { return script };
    match shell {
        Shell::Bash => {
            let names = option.get_long().map(|long| format!("--{long}"));
            let names = names.into_iter().chain(option.get_short().map(|short| format!("-{short}")));
            let files = "COMPREPLY=($(compgen -f \"${cur}\"))";
            let each = endings.replace('|', " ");
            let some = format!(
                "COMPREPLY=($(compgen -d -- \"${{cur}}\"; for end in {each}; do compgen -f -X \"!*.${{end}}\" -- \"${{cur}}\"; done))"
            );
            names.fold(script, |script, name| {
                let begin = format!("{name})\n                    ");
                script.replace(&format!("{begin}{files}"), &format!("{begin}{some}"))
            })
        }
        Shell::Zsh => script.replace(&format!(":{shown}:_files'"), &format!(":{shown}:_files -g \"*.({endings})\"'")),
        _ => script,
    }
}

/// Values of an option that are known by name.
struct Values {
    id: String,
    words: Vec<String>,
    /// Whether it takes files as well.
    takes_files: bool,
}

impl Values {
    /// What help shows of a value tells which there are: words in small letters are values themselves, others kinds of them.
    fn of(option: &Arg) -> Option<Self> {
        let long = option.get_long()?;
        let [shown] = option.get_value_names()? else { return None };
        let mut words: Vec<String> = Vec::new();
        for part in shown.split('|') {
            let is_value =
                part.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit()) && !shown.starts_with("FILE.");
            match part {
                "NAME" | "LIGHT" => words.extend(names(long)),
                "PATTERN" => words.extend(CfaPattern::ALL.iter().map(ToString::to_string)),
                part if is_value => words.push(part.to_owned()),
                _ => {}
            }
        }
        let takes_files = shown.split('|').any(|part| part.starts_with("FILE"));
        (!words.is_empty()).then(|| Self { id: option.get_id().to_string(), words, takes_files })
    }
}

/// The names that an option takes.
fn names(long: &str) -> Vec<String> {
    let of = |kind: Kind, is_one: fn(&Known) -> bool| -> Vec<String> {
        known(kind).into_iter().filter(is_one).map(|known| known.name).collect()
    };
    match long {
        "sensor" => of(Kind::Sensors, |_| true),
        "readout" => of(Kind::Sensors, |sensor| sensor.has.last().is_some_and(|readout| readout != NO_READOUT)),
        "reference" => of(Kind::Charts, |_| true),
        // Temperatures are too many.
        "illuminant" | "reference-light" | "adapt-to" | "scene-white" => {
            of(Kind::Illuminants, |light| !light.name.ends_with('K'))
        }
        "primaries" => NamedPrimaries::ALL.iter().map(|set| set.name().to_owned()).collect(),
        _ => Vec::new(),
    }
}

/// How the crate writes that an option takes these words and nothing else, and how it is written that it takes files as well.
fn beside_files(shell: Shell, words: &[String]) -> (String, String) {
    let line = words.join(" ");
    match shell {
        Shell::Zsh => {
            (format!(":({line})"), format!(":{{_alternative \"names\\:name\\:({line})\" \"files\\:file\\:_files\"}}"))
        }
        Shell::Fish => {
            let listed = words.iter().map(|word| format!("{word}\\t''")).collect::<Vec<_>>().join("\n");
            (format!("-r -f -a \"{listed}\""), format!("-r -F -a \"{listed}\""))
        }
        // Names first: the crate keeps what is offered in its order.
        _ => (
            format!("COMPREPLY=($(compgen -W \"{line}\" -- \"${{cur}}\"))"),
            format!("COMPREPLY=($(compgen -W \"{line}\" -- \"${{cur}}\"; compgen -f -- \"${{cur}}\"))"),
        ),
    }
}
