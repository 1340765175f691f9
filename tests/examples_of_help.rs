//! The examples that help and manual pages show run as they stand; and what help looks like.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::cli::examples::{EXAMPLES, Example, of};
use std::path::Path;
use std::process::{Command, Output};
use support::TREE;
use support::workshop::{BAD_USAGE, Workshop, path_of, programs};

/// What the examples name and no example makes: dark frames, flats, another program's plane, a second raw file,
/// frames to compare.
const SET_UP: &str = "
time=$(sed -n 's/.*exposure_s: *//p' plane.tiff.yaml | head -n 1)
for i in 1 2; do
  render-radiance --dark --exposure $time --size 640x480 | add-noise --frame $i | digitize | mosaic -o d$i.exr
done
cp plane.dng plane2.dng

mkdir frames
echo file,kind,photons > list.csv
for e in 0 1000 4000 8000 16000 24000 32000; do
  for i in 1 2; do
    render-radiance --electrons $e,$e,$e --size 64x48 | add-noise --frame $e$i | digitize | mosaic -o frames/$e-$i.exr
    if [ $e = 0 ]; then kind=dark; else kind=flat; fi
    echo frames/$e-$i.exr,$kind,$((2 * e)) >> list.csv
  done
done

demosaic plane.tiff | to-xyz --matrix matrix.yaml -o reference.exr
demosaic plane.tiff -o demosaicked.exr
";

/// The example before which the set-up is made: all before it made what that needs.
const FIRST_TO_NEED_IT: &str = "import-raw";

fn sh(directory: &Path, script: &str) -> Output {
    let programs = path_of("measure").parent().unwrap().to_owned();
    let path = format!("{}:{}", programs.display(), std::env::var("PATH").unwrap());
    let mut command = Command::new("sh");
    command.args(["-e", "-c", script]).current_dir(directory).env("PATH", path).env_remove("CYANOMETER_DATA");
    command.output().unwrap()
}

#[track_caller]
fn runs(directory: &Path, script: &str) {
    let done = sh(directory, script);
    let said = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success() && said.is_empty(), "{script}: {} {said}", done.status);
}

#[test]
fn every_example_runs_without_a_warning() {
    let shop = Workshop::new();
    let directory = shop.path("");
    let mut known: Vec<&str> = EXAMPLES.iter().map(|(program, _)| *program).collect();
    known.sort_unstable();
    assert_eq!(known, programs());
    for (program, examples) in EXAMPLES {
        assert!(examples.len() >= 2, "{program}");
        if program == FIRST_TO_NEED_IT {
            runs(&directory, SET_UP);
            foreign(&shop);
        }
        for Example { command, .. } in examples {
            assert!(command.contains(program), "{program}: {command}");
            runs(&directory, command);
        }
    }
}

/// Makes `foreign.png`, a plane of another program, which says nothing of itself.
fn foreign(shop: &Workshop) {
    use image::codecs::png::PngEncoder;
    use image::{ExtendedColorType, ImageEncoder};
    let codes: Vec<u8> =
        (0..640 * 480_u32).flat_map(|i| u16::try_from((i * 7919) % 900 + 64).unwrap().to_ne_bytes()).collect();
    let file = std::fs::File::create(shop.path("foreign.png")).unwrap();
    PngEncoder::new(file).write_image(&codes, 640, 480, ExtendedColorType::L16).unwrap();
}

#[test]
fn help_and_manual_page_show_the_examples() {
    let shop = Workshop::new();
    for program in programs() {
        let text = |word: &str| String::from_utf8(shop.run(&format!("{program} {word}"), &[])).unwrap();
        let (help, short) = (text("--help"), text("-h"));
        let whole = help.replace(" \\\n      ", " ");
        let manual = text("--manual").replace("\\(aq", "'").replace('\\', "");
        for Example { reason, command } in of(&program) {
            assert!(whole.contains(&format!("  # {reason}\n  {command}\n")), "{program}: {help}");
            assert!(manual.contains(&format!("{reason}:\n")) && manual.contains(command), "{program}: {manual}");
        }
        assert!(!short.contains("Examples:") && short.lines().count() < help.lines().count(), "{program}");
    }
}

/// Groups stand in the same order in all programs, what is general last; no option is without help, and none is long.
#[test]
fn options_stand_in_groups() {
    const ORDER: [&str; 11] = [
        "Arguments:",
        "Options:",
        "The scene:",
        "A picture in R, G, B as the scene:",
        "The sensor and the exposure:",
        "Noise:",
        "The evaluation of the matrix:",
        "A chart or a raw file instead of a library:",
        "The white and the light:",
        "The frame that is read:",
        "Output:",
    ];
    let shop = Workshop::new();
    for program in programs() {
        let help = String::from_utf8(shop.run(&format!("{program} --help"), &[])).unwrap();
        let (help, _) = help.split_once("\nExamples:").unwrap();
        let is_head = |line: &&str| line.ends_with(':') && !line.starts_with(' ');
        let heads: Vec<&str> = help.lines().filter(is_head).collect();
        let (general, others) = heads.split_last().unwrap();
        assert_eq!(*general, "General:", "{program}: {heads:?}");
        let places: Vec<usize> = others
            .iter()
            .map(|head| ORDER.iter().position(|known| known == head).unwrap_or_else(|| panic!("{program}: {head}")))
            .collect();
        assert!(places.is_sorted(), "{program}: {heads:?}");
        let (_, last) = help.split_once("\nGeneral:\n").unwrap();
        assert!(last.trim_end().contains("--help") && last.contains("--version"), "{program}: {last}");
        let talking: &[&str] =
            if program == "cyanometer" { &[] } else { &["--threads", "--quiet", "--verbose", "--progress"] };
        assert!(talking.iter().all(|option| last.contains(option)), "{program}: {last}");
    }
}

#[test]
fn names_are_read_in_any_case() {
    let shop = Workshop::new();
    std::fs::write(shop.path("codes.yaml"), "schema: cyanometer/1\nquantity: Expected_Electrons\ncfa: RGGB\n").unwrap();
    for line in [
        "render-radiance --electrons 900,2000,4000 --size 32x24 --CFA-- RGGB --sensor KAF-5101CE --format EXR -o plane.exr",
        "add-noise plane.exr --without PRNU,Ron --poisson GAUSSIAN -o noisy.exr --compression ZIP",
        "digitize noisy.exr -o codes.tiff --compression Deflate --sample-type U16 --progress NEVER",
        "demosaic codes.tiff --method ECI --black AUTO -o rgb.exr",
        "to-xyz rgb.exr --space XYY --white D65 -o xyy.exr",
        "to-xyz rgb.exr --adapt-to D50 --scene-white A --adaptation CAT16 -o adapted.exr",
        "predict-noise --electrons 900,2000,4000 --method Bilinear --pattern GBRG --equations EXACT --output-format JSON",
        "predict-noise --sweep 10:1000:3LOG --uncertainty 0.5% -o sweep.csv",
        "measure codes.tiff --output-format YAML",
        "preview codes.tiff --range FULL -o a.png",
        "preview codes.tiff --range 4Sigma -o b.png",
        "color-difference 50,1,2 51,1,2 --space LAB",
        "fit-matrix SAMPLES/skies/sky912.exr --regression SKY-RAD-SPPLS --weights Relative --radiance-unit uW/CM2/SR/NM",
        "preview codes.tiff --plane b --range FULL -o c.png",
        "measure rgb.exr --channel r",
        "measure plane.exr --metadata codes.yaml",
        "cyanometer list SENSORS Charts",
        "cyanometer keys Sensor",
    ] {
        let line = line.replace("--CFA--", "--cfa");
        let done = shop.attempt(&line, &[]);
        let said = String::from_utf8_lossy(&done.stderr).into_owned();
        // The unit of the library is known, and is another.
        let is_unit = line.contains("uW/CM2") && said.contains("its unit of radiance is");
        assert!(done.status.success() || is_unit, "{line}: {said}");
    }
}

#[test]
fn a_filter_array_has_one_option_by_two_names() {
    let shop = Workshop::new();
    let scene = "render-radiance --electrons 900,2000,4000 --size 32x24";
    let made = |line: &str| shop.run(line, &[]);
    shop.run(&format!("{scene} -o planes.exr"), &[]);
    made("mosaic planes.exr --pattern gbrg -o one.exr");
    made("mosaic planes.exr --cfa GBRG -o other.exr");
    assert_eq!(shop.read("one.exr").0, shop.read("other.exr").0);
    assert_eq!(shop.read("one.exr").1.cfa, shop.read("other.exr").1.cfa);
    made(&format!("{scene} --pattern gbrg -o rendered.exr"));
    assert_eq!(shop.read("one.exr").0, shop.read("rendered.exr").0);
    let predicted =
        |option: &str| made(&format!("predict-noise --electrons 900,2000,4000 --output-format json {option}"));
    assert_eq!(predicted("--cfa bggr --patch 3x3"), predicted("--pattern bggr --patch 3x3"));
    assert_eq!(predicted("--cfa bggr --pattern bggr --patch 3x3"), predicted("--pattern bggr --patch 3x3"));
    for program in ["add-noise", "digitize", "correct-frame", "demosaic", "measure"] {
        for option in ["--cfa gbrg", "--pattern gbrg", "--cfa gbrg --pattern GBRG"] {
            let made = if program == "measure" { "-o report.txt" } else { "-o made.exr" };
            let input = if ["add-noise", "digitize", "measure"].contains(&program) { "one.exr" } else { "codes.exr" };
            shop.pipe("add-noise one.exr | digitize -o codes.exr");
            let black = if program == "correct-frame" { "--black auto" } else { "" };
            shop.run(format!("{program} -q {input} {option} {made} {black}").trim_end(), &[]);
        }
    }
    for line in [
        "mosaic planes.exr --cfa rggb --pattern bggr -o no.exr",
        "demosaic codes.exr --cfa gbrg --pattern bggr -o no.exr",
        "measure codes.exr --cfa gbrg --pattern bggr",
        "predict-noise --electrons 900,2000,4000 --cfa gbrg --pattern bggr",
        "render-radiance --electrons 900,2000,4000 --cfa gbrg --pattern bggr -o no.exr",
    ] {
        let refused = shop.attempt(line, &[]);
        let said = String::from_utf8_lossy(&refused.stderr);
        assert_eq!(refused.status.code(), Some(BAD_USAGE), "{line}: {said}");
        assert!(
            said.contains("two filter arrays are named") && said.ends_with("leave out --pattern\n"),
            "{line}: {said}"
        );
    }
}

#[test]
fn a_method_is_one_of_demosaicking_and_fit_matrix_has_regressions() {
    let shop = Workshop::new();
    let fit = "fit-matrix SAMPLES/skies/sky912.exr";
    let by = |option: &str| shop.run(&format!("{fit} {option}"), &[]);
    assert_eq!(by("--method sky-rad-sppls"), by("--regression sky-rad-sppls"));
    for (line, wanted) in [
        (
            "fit-matrix skies.exr --method eci",
            "`eci` is no value for --regression <NAME>: that is a demosaicking method;",
        ),
        ("fit-matrix skies.exr --demosaic sky-rad-ls", "that is a regression,"),
        (
            "demosaic plane.exr --method SKY-RAD-LS",
            "`SKY-RAD-LS` is no value for --method <METHOD>: that is a regression, `--regression` of fit-matrix;",
        ),
        (
            "predict-noise --electrons 1,2,3 --method max-ign-sppls",
            "here a demosaicking method is wanted; known here are bi, bilinear",
        ),
        ("fit-matrix skies.exr --regression ls", "it is one of sky-rad-ls, sky-rad-sppls"),
    ] {
        let refused = shop.attempt(line, &[]);
        let said = String::from_utf8_lossy(&refused.stderr);
        assert_eq!(refused.status.code(), Some(BAD_USAGE), "{line}: {said}");
        assert!(said.contains(wanted) && said.lines().count() == 1, "{line}: {said}");
    }
}

#[test]
fn pages_tell_keys_templates_and_what_is_known() {
    let shop = Workshop::new();
    let text = |line: &str| String::from_utf8(shop.run(line, &[])).unwrap();
    let keys = text("cyanometer keys");
    for page in ["sensor", "matrix", "metadata"] {
        assert!(keys.contains(&text(&format!("cyanometer keys {page}"))), "{page}");
    }
    for program in ["measure", "to-xyz", "fit-matrix", "color-difference"] {
        assert_eq!(text(&format!("{program} --describe-keys")), keys);
    }
    assert!(keys.lines().all(|line| line.chars().count() <= 100), "a line of keys is longer than 100 characters");
    assert_eq!(text("cyanometer template metadata"), text("measure --metadata-template"));
    // Templates are files that programs read.
    for page in ["sensor", "matrix"] {
        std::fs::write(shop.path(&format!("{page}.yaml")), text(&format!("cyanometer template {page}"))).unwrap();
    }
    text("predict-noise --sensor sensor.yaml --electrons 900,2000,4000 --matrix matrix.yaml");
    let list = text("cyanometer list");
    for known in [
        "  kaf-5101ce ",
        "built in",
        "Kodak KAF-5101CE",
        "clear_zenith.csv ",
        "912 spectra",
        "  d65 ",
        "  colorchecker-2005 ",
        "cie1931_2deg_1nm ",
        "  none; CYANOMETER_DATA names directories",
    ] {
        assert!(list.contains(known), "{known}: {list}");
    }
    // What is found is named as options take it.
    for line in text("cyanometer list spectra").lines().skip(1).filter(|line| line.contains("clear_zenith.csv")) {
        let name = line.split_whitespace().next().unwrap();
        text(&format!("predict-noise {name} --expose-to 0.5"));
    }
    std::fs::create_dir(shop.path("matrices")).unwrap();
    std::fs::rename(shop.path("matrix.yaml"), shop.path("matrices/mine.yaml")).unwrap();
    let mut command = shop.command("cyanometer list matrices");
    let found = command.env("CYANOMETER_DATA", shop.path("")).output().unwrap();
    let found = String::from_utf8(found.stdout).unwrap();
    assert!(found.contains("matrices/mine.yaml ") && found.contains("to XYZ"), "{found}");
    for line in
        ["cyanometer list lenses", "cyanometer keys lenses", "cyanometer template", "cyanometer template sensor matrix"]
    {
        let refused = shop.attempt(line, &[]);
        assert_eq!(refused.status.code(), Some(BAD_USAGE), "{line}");
        assert!(String::from_utf8_lossy(&refused.stderr).contains("name one of "), "{line}");
    }
}

/// The tables of docs/sensors.md are those that programs print.
#[test]
fn the_page_on_sensors_has_the_keys_that_are_read() {
    use cyanometer::formats::keys::KeyPage;
    let page = std::fs::read_to_string(format!("{TREE}/docs/sensors.md")).unwrap();
    for [path, kind, unit, default, needed, meaning] in KeyPage::Sensor.keys() {
        let row = format!("| `{path}` | {kind} | {unit} | {default} | {needed} | {} |", meaning.replace('|', "or"));
        assert!(page.contains(&row), "docs/sensors.md lacks the line\n{row}");
    }
    let rows = page.lines().filter(|line| line.starts_with("| `") && line.matches(" | ").count() == 5).count();
    assert_eq!(rows, KeyPage::Sensor.keys().count());
}
