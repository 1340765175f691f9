//! The front door, and what every program says of itself: its line in the list, its manual page, its completions.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::cli::programs::{APART, PROGRAMS};
use std::fs;
use std::os::unix::process::CommandExt;
use std::process::Command;
use support::workshop::{BAD_DATA, BAD_USAGE, Workshop, path_of, programs};

const FRONT: &str = "cyanometer";

fn text(shop: &Workshop, line: &str) -> String {
    String::from_utf8(shop.run(line, &[])).unwrap()
}

/// The long options that a program's help lists, without those of clap.
fn options(shop: &Workshop, program: &str) -> Vec<String> {
    let help = text(shop, &format!("{program} --help"));
    let longs = help.lines().filter_map(|line| {
        let line = line.trim_start();
        let line = if line.starts_with('-') { line } else { return None };
        let (_, long) = line.split_once("--")?;
        Some(long.split(|c: char| !(c.is_ascii_alphanumeric() || c == '-')).next()?.to_owned())
    });
    longs.filter(|long| !["help", "version"].contains(&long.as_str())).collect()
}

#[test]
fn the_list_holds_every_program_in_its_own_words() {
    let shop = Workshop::new();
    let mut known: Vec<&str> = PROGRAMS.into_iter().chain([FRONT]).collect();
    known.sort_unstable();
    assert_eq!(known, programs(), "PROGRAMS in src/lib/cli/programs.rs and src/bin differ");
    let list = text(&shop, FRONT);
    for program in PROGRAMS {
        let help = text(&shop, &format!("{program} --help"));
        let about = help.split("\n\n").next().unwrap().replace('\n', " ");
        let line = list.lines().find(|line| line.starts_with(&format!("  {program} "))).unwrap();
        assert!(about.len() > 20 && line.ends_with(&format!("  {about}")), "{line}\n{about}");
    }
    assert!(shop.files().is_empty());
}

#[test]
fn every_program_has_a_manual_page_and_completions_with_its_options() {
    let shop = Workshop::new();
    for program in programs() {
        let options = options(&shop, &program);
        assert!(program == FRONT || options.len() > 3, "{program}: {options:?}");
        let manual = text(&shop, &format!("{program} --manual"));
        let about = text(&shop, &format!("{program} --summary"));
        let plain = manual.replace("\\*(Aq", "'").replace('\\', "");
        assert!(plain.contains(&format!("{program} - {about}")), "{program}: {manual}");
        for shell in ["bash", "zsh", "fish"] {
            let script = text(&shop, &format!("{program} --completions {shell}"));
            assert!(script.contains(&program), "{program}: {shell}");
            for option in &options {
                // fish has the names without their hyphens.
                let name = if shell == "fish" { format!("-l {option}") } else { format!("--{option}") };
                assert!(script.contains(&name), "{program}: no {name} for {shell}");
            }
        }
        for option in &options {
            assert!(plain.contains(&format!("--{option}")), "{program}: no --{option} in its manual page");
        }
        let refused = shop.attempt(&format!("{program} --completions tcsh"), &[]);
        assert_eq!(refused.status.code(), Some(BAD_USAGE), "{program}");
    }
}

/// What people type in place of `list`, `keys` and `template` is answered, and keys are found by their names.
#[test]
fn the_front_door_answers_what_people_type() {
    let shop = Workshop::new();
    let told = |words: &str| text(&shop, &format!("{FRONT} {words}"));
    for (typed, meant) in [
        ("--list sensors imx219", "list sensors imx219"),
        ("--list observers", "list observers"),
        ("--template sensor", "template sensor"),
        ("--describe-keys", "keys"),
        ("--keys", "keys"),
    ] {
        assert_eq!(told(typed), told(meant), "{typed}");
    }
    assert_eq!(text(&shop, "render-radiance --list nikon d850 --size 8x6"), told("list sensors nikon d850"));
    assert_eq!(text(&shop, "predict-noise --list"), told("list sensors"));
    let found = told("keys sensor Full_Well");
    assert!(found.contains("readout.full_well_e: number; e-") && found.lines().count() < 6, "{found}");
    assert!(told("keys full_well_e").contains("readout.full_well_e: number"));
    for (typed, said) in [
        (
            "keys sensor imx219",
            "there is no key `imx219` in such files; `cyanometer keys sensor` describes all; `cyanometer list sensors imx219` tells of \
             that sensor",
        ),
        ("keys bananas", "keys knows no `bananas`; name one of sensor, matrix, metadata, or a part of a key"),
        (
            "--template",
            "template prints one file; name one of sensor, matrix, metadata, as in `cyanometer template sensor`",
        ),
    ] {
        assert_eq!(shop.said(&format!("{FRONT} {typed}"), BAD_USAGE).trim_end(), format!("{FRONT}: {said}"), "{typed}");
    }
}

/// The names of programs are completed behind `cyanometer`.
#[test]
fn the_front_door_completes_the_programs() {
    let shop = Workshop::new();
    for (shell, begin) in
        [("bash", "opts=\""), ("zsh", "':program"), ("fish", "complete -c cyanometer -n __fish_use_subcommand")]
    {
        let script = text(&shop, &format!("{FRONT} --completions {shell}"));
        let line =
            script.lines().find(|line| line.trim_start().starts_with(begin) && line.contains("measure")).unwrap();
        assert!(PROGRAMS.iter().all(|program| line.contains(program)), "{shell}: {line}");
    }
}

/// What is known by name is completed beside files, and words that an option takes as they are.
#[test]
fn values_that_are_known_by_name_are_completed() {
    let shop = Workshop::new();
    for (program, option, known, unknown, files) in [
        ("render-radiance", "sensor", &["kaf-5101ce", "nikon-d850"][..], "d65", true),
        ("add-noise", "readout", &["kaf-5101ce", "imx219"], "nikon-d850", true),
        ("render-radiance", "illuminant", &["d65", "a"], "3200K", true),
        ("render-radiance", "primaries", &["rec2020"], "NAME", false),
        ("fit-matrix", "reference", &["colorchecker"], "d65", true),
        ("to-xyz", "white", &["d50", "e"], "X", false),
        ("to-xyz", "adapt-to", &["d75"], "LIGHT", false),
        ("predict-noise", "matrix", &["sensor"], "FILE", true),
        ("to-xyz", "matrix", &["sensor"], "FILE", true),
        ("demosaic", "cfa", &["grbg"], "PATTERN", false),
        ("demosaic", "black", &["auto", "none"], "N", false),
    ] {
        for shell in ["bash", "zsh", "fish"] {
            let script = text(&shop, &format!("{program} --completions {shell}"));
            let (begin, end, with_files) = match shell {
                "bash" => (format!("--{option})\n"), ";;", "; compgen -f --"),
                "zsh" => (format!("--{option}=["), "\\\n", "_files"),
                _ => (format!(" -l {option} "), "\ncomplete", "-r -F -a"),
            };
            let part = script.split(&begin).nth(1).unwrap().split(end).next().unwrap();
            // Behind what the option is for.
            let part =
                if shell == "zsh" { part.rsplit(':').next().unwrap().to_owned() + part } else { part.to_owned() };
            let has = |word: &str| {
                let words = part.replace("\\t''", " ").replace(['(', ')', '"', '\n', '\''], " ");
                words.split_whitespace().any(|one| one == word)
            };
            assert!(known.iter().all(|word| has(word)), "{shell} {program} --{option}: {part}");
            assert!(shell == "zsh" || !has(unknown), "{shell} {program} --{option} has {unknown}: {part}");
            assert_eq!(part.contains(with_files), files, "{shell} {program} --{option}: {part}");
        }
    }
}

/// A manual page has the sections that others have, in their order.
#[test]
fn manual_pages_have_their_sections() {
    let shop = Workshop::new();
    const SECTIONS: [&str; 8] =
        ["NAME", "SYNOPSIS", "DESCRIPTION", "EXAMPLES", "\"EXIT STATUS\"", "ENVIRONMENT", "FILES", "\"SEE ALSO\""];
    for program in programs() {
        let page = text(&shop, &format!("{program} --manual"));
        let places: Vec<Option<usize>> = SECTIONS.iter().map(|name| page.find(&format!(".SH {name}\n"))).collect();
        assert!(places.iter().all(Option::is_some) && places.is_sorted(), "{program}: {places:?}");
        // What has no name comes before options, as in help.
        if let Some(arguments) = page.find(".SH ARGUMENTS\n") {
            let options = page.find(".SH OPTIONS\n").unwrap_or_else(|| page.find(".SH EXAMPLES\n").unwrap());
            assert!(places[2] < Some(arguments) && arguments < options, "{program}: {page}");
        }
        let inputs = page.matches("\n[\\fIINPUT\\fR]").count();
        let first =
            page.split(".SH ARGUMENTS\n").nth(1).and_then(|behind| behind.split(".SH ").next()).unwrap_or_default();
        assert_eq!(first.matches("\n[\\fIINPUT\\fR]").count(), inputs, "{program}: {page}");
        let synopsis = page.split(".SH SYNOPSIS\n").nth(1).unwrap().lines().next().unwrap();
        assert!(
            synopsis.len() < 200 && synopsis.starts_with(&format!("\\fB{}\\fR ", program.replace('-', "\\-"))),
            "{synopsis}"
        );
        let see = page.split(".SH \"SEE ALSO\"\n").nth(1).unwrap();
        let own = format!("\\fB{}\\fR(1)", program.replace('-', "\\-"));
        assert!(see.contains("(1)") && !see.split(", ").any(|one| one.trim() == own), "{program}: {see}");
    }
}

#[test]
fn the_front_door_runs_a_program_with_its_own_arguments_status_and_history() {
    let shop = Workshop::new();
    let electrons = "render-radiance --electrons 100,200,300 --size 8x6";
    let made = shop.run(&format!("{FRONT} {electrons}"), &[]);
    assert_eq!(made, shop.run(electrons, &[]));
    assert_eq!(text(&shop, &format!("{FRONT} measure --help")), text(&shop, "measure --help"));
    assert_eq!(text(&shop, &format!("{FRONT} help measure")), text(&shop, "measure --help"));
    assert_eq!(text(&shop, &format!("{FRONT} help")), text(&shop, &format!("{FRONT} --help")));
    // What stands behind the name is not said again below.
    let page = text(&shop, "mosaic --manual");
    assert_eq!(page.matches("Keep of three planes what a Bayer color filter array lets through").count(), 1, "{page}");
    assert_eq!(shop.run(&format!("{FRONT} -- {electrons}"), &[]), made);
    for (line, status, said) in [
        ("measure missing.exr", BAD_DATA, "measure: missing.exr: cannot open"),
        ("measure --colour", BAD_USAGE, "measure: unknown option"),
        ("meassure", BAD_USAGE, "did you mean `measure`?"),
        ("demo a b", BAD_USAGE, "cyanometer: demo takes one directory"),
    ] {
        let done = shop.attempt(&format!("{FRONT} {line}"), &[]);
        let complaint = String::from_utf8_lossy(&done.stderr).into_owned();
        assert_eq!(done.status.code(), Some(status), "{line}: {complaint}");
        assert!(complaint.contains(said) && complaint.lines().count() == 1, "{line}: {complaint}");
    }
}

/// Alone in its directory, the front door is each program but those apart, by the name of a link to it, with the project's before it
/// or not, and by its first word. Of those apart it misses the files, and nothing of the same name is looked for elsewhere.
#[test]
fn one_executable_is_most_programs() {
    let shop = Workshop::new();
    fs::copy(path_of(FRONT), shop.path(FRONT)).unwrap();
    // A process that another test starts meanwhile may hold the copy open for writing until it has become its own program.
    let alone = |name: &str, arguments: &[&str]| loop {
        match Command::new(shop.path(FRONT)).arg0(name).args(arguments).output() {
            Err(error) if error.kind() == std::io::ErrorKind::ExecutableFileBusy => std::thread::yield_now(),
            done => break done.unwrap(),
        }
    };
    for program in PROGRAMS {
        let own = format!("{FRONT}-{program}");
        let calls = [(program, &["-V"][..]), (&own, &["-V"]), ("a/link", &[program, "-V"])];
        for (name, arguments) in calls {
            let said = String::from_utf8(alone(name, arguments).stdout).unwrap();
            let is_it = said.starts_with(&format!("{program} (cyanometer) "));
            assert_eq!(is_it, !APART.contains(&program), "{name} {arguments:?}: {said}");
        }
    }
    let done = alone(FRONT, &["stack-frames", "a.exr"]);
    let complaint = String::from_utf8_lossy(&done.stderr).into_owned();
    assert_eq!(done.status.code(), Some(BAD_DATA), "{complaint}");
    assert!(complaint.contains("stack-frames: cannot run: no such file"), "{complaint}");
    // Data are not beside it either, and nobody's own file is taken for one of them.
    for (file, is_told) in [("clear_zenith.csv", true), ("sample_data/skies/none.csv", true), ("./sky.csv", false)] {
        let done = alone("render-radiance", &[file]);
        let complaint = String::from_utf8_lossy(&done.stderr).into_owned();
        assert_eq!(done.status.code(), Some(BAD_DATA), "{complaint}");
        let said = "the sample data are not installed beside the programs (`scripts/install` does that): let CYANOMETER_DATA name";
        assert_eq!(complaint.contains(said), is_told, "{complaint}");
    }
    let list = String::from_utf8(alone(FRONT, &[]).stdout).unwrap();
    assert_eq!(list.matches("not beside this program").count(), APART.len(), "{list}");
}

#[test]
fn the_demo_runs_in_an_empty_directory() {
    let shop = Workshop::new();
    let told = text(&shop, &format!("{FRONT} demo"));
    let commands = told.lines().filter(|line| line.starts_with("$ ")).count();
    assert!(commands > 8 && told.contains("pred. mean"), "{told}");
    for file in ["7-view.png", "4-mosaic.png", "6-xyz.exr", "6-xyz.exr.yaml", "matrix.yaml"] {
        assert!(!shop.bytes(&format!("cyanometer-demo/{file}")).is_empty());
    }
    assert_eq!(shop.files(), ["cyanometer-demo"]);
    // What lies there already is nobody's to overwrite.
    let again = shop.attempt(&format!("{FRONT} demo"), &[]);
    assert_eq!(again.status.code(), Some(BAD_USAGE));
    assert!(String::from_utf8_lossy(&again.stderr).contains("name a directory that is empty or new"));
}

/// The front door's own words are completed behind `list`, `keys` and `template`, and files by their endings where an option takes
/// such alone.
#[test]
fn words_and_endings_are_completed() {
    let shop = Workshop::new();
    for name in ["a.svg", "b.png", "c.exr", "png.csv"] {
        std::fs::write(shop.path(name), "").unwrap();
    }
    let complete = |program: &str, words: &[&str]| {
        let script = text(&shop, &format!("{program} --completions bash"));
        let (last, before) = words.split_last().unwrap();
        let all: Vec<String> = words.iter().map(|word| format!("'{word}'")).collect();
        let call = format!(
            "COMP_WORDS=({program} {}); COMP_CWORD={}; _{program} {program} '{last}' '{}'; printf '%s\\n' \"${{COMPREPLY[@]}}\"",
            all.join(" "),
            words.len(),
            before.last().unwrap_or(&program)
        );
        let output = std::process::Command::new("bash")
            .args(["-c", &format!("{script}\n{call}")])
            .current_dir(shop.path(""))
            .output()
            .unwrap();
        let mut found: Vec<String> = String::from_utf8_lossy(&output.stdout).lines().map(str::to_owned).collect();
        found.sort();
        found
    };
    assert_eq!(complete(FRONT, &["keys", ""]), ["matrix", "metadata", "sensor"]);
    assert_eq!(complete(FRONT, &["template", "s"]), ["sensor"]);
    assert_eq!(complete(FRONT, &["list", "s"]), ["sensors", "spectra"]);
    assert_eq!(complete(FRONT, &["meas"]), ["measure"]);
    // Files, which bash completes where nothing is offered.
    assert_eq!(complete(FRONT, &["measure", ""]), [""]);
    // Behind a program what its own script offers, where that is loaded; spectra by name beside files.
    let own = text(&shop, "render-radiance --completions bash");
    let front = text(&shop, &format!("{FRONT} --completions bash"));
    let behind = |words: &str, count: usize, last: &str, before: &str| {
        let call = format!(
            "COMP_WORDS=({FRONT} {words}); COMP_CWORD={count}; _{FRONT} {FRONT} '{last}' '{before}'; printf '%s\\n' \"${{COMPREPLY[@]}}\""
        );
        let bash =
            std::process::Command::new("bash").args(["-c", &format!("{own}\n{front}\n{call}")]).output().unwrap();
        String::from_utf8_lossy(&bash.stdout).lines().map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(behind("render-radiance --quadrature ''", 3, "", "--quadrature"), ["rectangle", "trapezoid", "simpson"]);
    assert!(behind("render-radiance sky9", 2, "sky9", "render-radiance").contains(&"sky912.exr".to_owned()));
    assert_eq!(behind("render-radiance --sensor kaf", 3, "kaf", "--sensor"), ["kaf-5101ce"]);
    let zsh = text(&shop, "fit-matrix --completions zsh");
    assert!(zsh.contains(r#"spectra\:spectrum\:("#) && zsh.contains("sky912.exr"), "{zsh}");
    let fish = text(&shop, "predict-noise --completions fish");
    assert!(
        fish.lines().any(|line| line.starts_with("complete -c predict-noise -F -a") && line.contains("sky912.exr"))
    );
    assert_eq!(complete("measure", &["--plot", ""]), ["a.svg", "b.png"]);
    assert_eq!(complete("preview", &["-o", ""]), ["b.png"]);
    let zsh = text(&shop, "measure --completions zsh");
    assert!(zsh.contains(r#":FILE.svg|png:_files -g "*.(svg|png)"'"#), "{zsh}");
    let fish = text(&shop, &format!("{FRONT} --completions fish"));
    assert!(fish.contains("__fish_seen_subcommand_from keys\" -f -a \"sensor matrix metadata\""), "{fish}");
}
