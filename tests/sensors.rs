//! Sensor files: both forms, their keys, and what each program says of a part that is missing.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::camera::sensor::SENSOR_SCHEMA;
use cyanometer::cfa::{CfaPattern, FilterArray};
use cyanometer::formats::data::load_sensor;
use cyanometer::formats::yaml::{parse_metadata, parse_sensor, write_metadata};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use support::{TREE, sensor};
use tempfile::TempDir;

/// A sensor file of the first schema, as they were written before.
const FLAT: &str = "\
schema: cyanometer-sensor/1
name: small
description: made up
source: nowhere
width: 12
height: 8
pixel_pitch_um: 5.5
cfa: gbrg
quantum_efficiency: {file: qe.csv}
cover_glass: {file: glass.csv, column: T}
full_well_e: 9000
dark_current_e_per_s: 3
temperature_k: 290
dcnu: 0.1
prnu: 0.01
read_noise_e: 2.5
bits: 14
bias_adu: 64
adu_per_e: 1.5
xyz_from_camera: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
";

const HEAD: &str = "\
schema: cyanometer-sensor/2
name: small
description: made up
source: nowhere
";

const READOUT: &str = "\
readout:
  width: 12
  height: 8
  pixel_pitch_um: 5.5
  cfa: gbrg
  full_well_e: 9000
  dark_current_e_per_s: 3
  temperature_k: 290
  dcnu: 0.1
  prnu: 0.01
  read_noise_e: 2.5
  bits: 14
  bias_adu: 64
  adu_per_e: 1.5
";

const RESPONSE: &str = "\
response:
  quantum_efficiency: {file: qe.csv}
  cover_glass: {file: glass.csv, column: T}
";

const MATRIX: &str = "xyz_from_camera: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n";

/// A directory with a sensor of each kind.
struct Bench {
    directory: TempDir,
}

impl Bench {
    fn new() -> Self {
        let bench = Self { directory: TempDir::new().unwrap() };
        bench.write("qe.csv", "wavelength_nm,R,G,B,W\n360,0.1,0.2,0.3,0.5\n830,0.3,0.2,0.1,0.5\n");
        bench.write("glass.csv", "wavelength_nm,T\n360,0.9\n830,0.8\n");
        bench.write("flat.yaml", FLAT);
        bench.write("parts.yaml", &format!("{HEAD}{READOUT}{RESPONSE}{MATRIX}"));
        bench.write("readout.yaml", &format!("{HEAD}{READOUT}"));
        bench.write("response.yaml", &format!("{HEAD}{RESPONSE}"));
        bench.write("pitchless.yaml", &format!("{HEAD}{READOUT}{RESPONSE}").replace("  pixel_pitch_um: 5.5\n", ""));
        bench
    }

    fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).unwrap();
    }

    /// Runs a command line, split at spaces.
    fn attempt(&self, line: &str) -> Output {
        let line = line.replace("SAMPLES", &format!("{TREE}/sample_data"));
        let mut words = line.split(' ');
        let program = Path::new(env!("CARGO_BIN_EXE_add-noise")).with_file_name(words.next().unwrap());
        let mut command = Command::new(program);
        command.args(words).current_dir(self.directory.path()).env_remove("CYANOMETER_DATA");
        command.stdin(std::process::Stdio::null()).output().unwrap()
    }

    #[track_caller]
    fn run(&self, line: &str) -> String {
        let output = self.attempt(line);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && said.is_empty(), "{line}: {} {said}", output.status);
        String::from_utf8_lossy(&output.stdout).into_owned()
    }
}

#[test]
fn a_flat_file_is_the_same_sensor() {
    let bench = Bench::new();
    let load = |name: &str| load_sensor(&bench.path(name).display().to_string()).unwrap();
    let (flat, parts) = (load("flat.yaml"), load("parts.yaml"));
    assert_eq!(flat, parts);
    assert_eq!(flat.sensor.schema, SENSOR_SCHEMA);
    assert_eq!(flat.sensor.readout().unwrap().cfa, CfaPattern::Gbrg.into());
    // Either part alone is a sensor too.
    assert_eq!(load("readout.yaml").sensor.readout, flat.sensor.readout);
    assert!(load("readout.yaml").response.is_none());
    assert_eq!(load("response.yaml").response, flat.response);
    // A file with a matrix alone says something.
    assert!(parse_sensor("s", format!("{HEAD}{MATRIX}").as_bytes()).unwrap().check().is_ok());
}

#[test]
fn curves_that_say_that_they_are_something_else_are_refused() {
    for (file, text, wanted) in [
        (
            "qe.csv",
            "nm,R (A/W),G (A/W),B (A/W)\n360,0.1,0.2,0.3\n830,0.3,0.2,0.1\n",
            "its `R (A/W)` is a responsivity S",
        ),
        ("qe.csv", "nm,R (%),G (%),B (%)\n360,0.1,0.2,0.3\n830,0.3,0.2,0.1\n", "its `R (%)` is in per cent"),
        ("qe.csv", "# Unit: %\nnm,R,G,B\n360,0.1,0.2,0.3\n830,0.3,0.2,0.1\n", "its `R` is in per cent"),
        ("glass.csv", "nm,T (%)\n360,0.1\n830,0.5\n", "its `T (%)` is in per cent"),
        (
            "glass.csv",
            "# optical density\nnm,T\n360,0.1\n830,0.5\n",
            "its `T` is a logarithm; a transmittance is wanted",
        ),
        ("glass.csv", "nm,T\nnm,reflectance\n360,0.1\n830,0.5\n", "its `T` is another share of light"),
        ("qe.csv", "nm,R,G,B\n360,0.1,0.2,0.3\n830,0.3,0.2,1.3\n", "it must lie within 0 and 1"),
    ] {
        let bench = Bench::new();
        bench.write(file, text);
        let refused = load_sensor(&bench.path("parts.yaml").display().to_string()).unwrap_err().to_string();
        assert!(refused.contains(wanted), "{refused}");
    }
}

#[test]
fn what_of_a_response_may_mislead_is_told() {
    let bench = Bench::new();
    let load = |name: &str| load_sensor(&bench.path(name).display().to_string());
    let doubts = |name: &str| load(name).unwrap().doubts().join("\n");
    assert_eq!(doubts("parts.yaml"), "");
    bench.write("qe.csv", "nm,R,G,B\n360,0.3,0.2,0.1\n830,0.1,0.2,0.3\n");
    let told = doubts("parts.yaml");
    assert!(
        told.contains("efficiencies of R and B up to 680 nm are ") && told.contains("the order of their names"),
        "{told}"
    );
    // All alike, at levels of their own.
    bench.write("qe.csv", "nm,R,G,B\n360,0.3,0.2,0.1\n830,0.3,0.2,0.1\n");
    bench.write("one.yaml", &format!("{HEAD}{READOUT}{RESPONSE}").replace("qe.csv}", "qe.csv, column: R}"));
    assert_eq!(doubts("parts.yaml"), "");
    let told = doubts("one.yaml");
    assert!(
        told.ends_with(
            "`column: R` of its quantum efficiency does not count: each class has a column of its own, R, G and B"
        ),
        "{told}"
    );
}

/// A responsivity in A/W counts energy.
#[test]
fn a_heading_per_watt_says_what_a_response_counts() {
    let bench = Bench::new();
    let load = |name: &str| load_sensor(&bench.path(name).display().to_string());
    let doubts = |name: &str| load(name).unwrap().doubts().join("\n");
    let bell = |nm: i32, peak: i32| (-(f64::from(nm - peak) / 40.0).powi(2)).exp();
    let row = |nm: i32| format!("{nm},{:.6},{:.6},{:.6}\n", 0.5 * bell(nm, 600), bell(nm, 540), 0.8 * bell(nm, 460));
    let rows: String = (360..=780).step_by(10).map(row).collect();
    bench.write("rel.csv", &format!("nm,R (A/W),G (A/W),B (A/W)\n{rows}"));
    let relative = format!("{HEAD}{READOUT}response:\n  relative_response: {{file: rel.csv}}\n");
    bench.write("rel.yaml", &relative);
    bench.write("quanta.yaml", &format!("{relative}  counts: quanta\n"));
    assert_eq!(doubts("rel.yaml"), "");
    let refused = load("quanta.yaml").unwrap_err().to_string();
    assert!(
        refused.contains("the heading `R (A/W)` of its response says that it counts energy, and `counts` quanta"),
        "{refused}"
    );
    bench.write("rel.csv", &format!("nm,R,G,B\n{rows}"));
    assert!(doubts("rel.yaml").contains("nobody says whether its response counts energy or quanta"));
    assert_eq!(doubts("quanta.yaml"), "");
}

/// Keys of what is left out at 0 may be written out.
#[test]
fn what_is_nothing_may_be_said() {
    let plain = format!("{HEAD}{READOUT}");
    let said = plain.replace("  prnu:", "  row_noise_e: 0\n  rts_share: 0\n  prnu:");
    assert_ne!(said, plain);
    assert_eq!(parse_sensor("s", said.as_bytes()).unwrap(), parse_sensor("s", plain.as_bytes()).unwrap());
}

/// Texts of a sensor file with one word in place of another, and the complaint.
fn check_complaints(text: &str, cases: &[(&str, &str, &str)]) {
    for (right, wrong, complaint) in cases {
        assert!(text.contains(right), "{right}");
        let text = text.replace(right, wrong);
        let found = parse_sensor("s.yaml", text.as_bytes());
        let found = found.map_err(|error| error.to_string()).and_then(|sensor| sensor.check());
        let error = found.unwrap_err();
        assert!(error.contains(complaint), "{error}\n{complaint}");
        let ends = !complaint.contains("unknown key") || error.ends_with(complaint);
        assert!(ends, "{error}\n{complaint}");
    }
}

#[test]
fn an_unknown_key_is_answered_with_the_nearest_at_both_levels() {
    let cases = [
        ("name:", "nmae:", "unknown key `nmae`; did you mean `name`?"),
        ("  prnu:", "  pnru:", "unknown key `readout.pnru`; did you mean `readout.prnu`?"),
        ("  cover_glass:", "  coverglass:", "unknown key `response.coverglass`; did you mean `response.cover_glass`?"),
        ("source: nowhere", "bits: 14", "unknown key `bits`; did you mean `readout.bits`?"),
        ("  bits: 14", "  cover_glass: 14", "unknown key `readout.cover_glass`; did you mean `response.cover_glass`?"),
        ("source: nowhere", "read_noise: 3", "unknown key `read_noise`; did you mean `readout.read_noise_e`?"),
        ("source: nowhere", "observer: me", "unknown key `observer`"),
        (
            "{file: qe.csv}",
            "{file: qe.csv, color: R}",
            "`response.quantum_efficiency` has an unknown key `color`; did you mean `column`?",
        ),
        (
            "  quantum_efficiency:",
            "  qe:",
            "unknown key `response.qe`; here it is `quantum_efficiency`, electrons per photon, within `response`",
        ),
        (
            "{file: qe.csv}",
            "{file: qe.csv, gain: 2}",
            "`response.quantum_efficiency` has an unknown key `gain`; remove it",
        ),
        ("sensor/2", "sensor/1", "`readout` belongs to the schema `cyanometer-sensor/2`; name that one"),
        ("sensor/2", "sensor/3", "schema is `cyanometer-sensor/3`, not `cyanometer-sensor/2` or `cyanometer-sensor/1`"),
        (
            "prnu: 0",
            "prnu_percent: 0",
            "unknown key `readout.prnu_percent`; here it is `prnu`, a fraction of 1, per cent over 100",
        ),
        ("cfa: gbrg", "cfa: rgbw", "in `readout.cfa`, `rgbw` is no filter array; one is rggb"),
        ("bits: 14", "bits: 0", "`bits` is 0; it must be 1 to 16"),
        ("width: 12", "width: wide", "`readout.width` is `wide`, not a whole number from 0 on"),
    ];
    check_complaints(&format!("{HEAD}{READOUT}{RESPONSE}{MATRIX}"), &cases);
}

#[test]
fn an_unknown_key_of_the_first_schema_is_answered_too() {
    let cases = [
        ("prnu:", "pnru:", "unknown key `pnru`; did you mean `prnu`?"),
        ("source: nowhere", "read_noise: 3", "unknown key `read_noise`; did you mean `read_noise_e`?"),
        (
            "source: nowhere",
            "dsnu_e: 3",
            "unknown key `dsnu_e`; it is one of the schema `cyanometer-sensor/2`, where it stands in `readout`",
        ),
        (
            "source: nowhere",
            "read_noise_adu: 3",
            "unknown key `read_noise_adu`; here it is `read_noise_e`, in e-, ADU over `adu_per_e`",
        ),
        ("sensor/1", "sensor/2", "unknown key `width`; did you mean `readout.width`?"),
        ("cfa: gbrg", "cfa: monochrome", "`cfa` is `monochrome`; known are"),
    ];
    check_complaints(FLAT, &cases);
}

/// Each program with a sensor that lacks what it needs: the command, and its complaint.
const COMPLAINTS: [(&str, &str); 20] = [
    (
        "render-radiance SAMPLES/skies/clear_zenith.csv --size 4x4 --sensor ./readout.yaml",
        "sensor small: its sensor has no `response`; give a sensor that has it, --sensor NAME|FILE",
    ),
    (
        "render-radiance SAMPLES/skies/clear_zenith.csv --size 4x4 --sensor ./response.yaml",
        "sensor small: its sensor has no `readout`; give one that has it, --readout NAME|FILE, or a sensor that has it, --sensor NAME|FILE",
    ),
    (
        "render-radiance SAMPLES/skies/clear_zenith.csv --size 4x4 --sensor ./pitchless.yaml",
        "sensor small: its sensor has no `readout.pixel_pitch_um`; give one that has it, --readout NAME|FILE, or a sensor that has it, --sensor NAME|FILE",
    ),
    (
        "render-radiance --dark --sensor ./response.yaml",
        "sensor small: its sensor has no `readout`; give one that has it, --readout NAME|FILE, or a sensor that has it, --sensor NAME|FILE",
    ),
    (
        "render-radiance --electrons 1,2,3 --size 4x4 --vignetting --sensor ./pitchless.yaml",
        "sensor small: its sensor has no `readout.pixel_pitch_um`; give one that has it, --readout NAME|FILE, or a sensor that has it, --sensor NAME|FILE",
    ),
    (
        "render-radiance SAMPLES/skies/clear_zenith.csv --size 4x4 --sensor ./mono.yaml",
        "sensor small: it has no color filters (monochrome); only the response of the classes R, G and B is followed",
    ),
    (
        "add-noise rates.exr",
        "rates.exr: its sensor has no `readout`; give one that has it, --readout NAME|FILE, or a sensor that has it, --sensor NAME|FILE",
    ),
    (
        "digitize rates.exr",
        "rates.exr: its sensor has no `readout.bits`; give --sensor NAME|FILE, or all of --bits, --bias and --slope",
    ),
    (
        "digitize rates.exr --bits 12",
        "rates.exr: its sensor has no `readout.bias_adu`; give --sensor NAME|FILE, or all of --bits, --bias and \
         --slope",
    ),
    (
        "demosaic codes.exr --sigma",
        "codes.exr: its sensor has no `readout`; give one that has it, --readout NAME|FILE, or a sensor that has it, --sensor NAME|FILE",
    ),
    (
        "measure rates.exr --check",
        "rates.exr: nothing can be checked: a prediction needs a uniform scene and metadata that say what was done to it, up \
         to XYZ, xyY or L*a*b*; here the metadata has no `sensor.readout`",
    ),
    (
        "fit-matrix SAMPLES/skies/sky912.exr --sensor ./response.yaml",
        "sensor small: its sensor has no `readout`; give one that has it, --readout NAME|FILE, or a sensor that has it, --sensor NAME|FILE",
    ),
    (
        "fit-matrix SAMPLES/skies/sky912.exr --sensor ./readout.yaml",
        "sensor small: its sensor has no `response`; give a sensor that has it, --sensor NAME|FILE",
    ),
    (
        "predict-noise --electrons 1,2,3 --sensor ./response.yaml",
        "sensor small: its sensor has no `readout`; give one that has it, --readout NAME|FILE, or a sensor that has it, --sensor NAME|FILE",
    ),
    (
        "predict-noise SAMPLES/skies/clear_zenith.csv --sensor ./readout.yaml",
        "sensor small: its sensor has no `response`; give a sensor that has it, --sensor NAME|FILE",
    ),
    (
        "predict-noise --electrons 1,2,3 --sensor ./mono.yaml",
        "sensor small: it has no color filters (monochrome); only Bayer arrays are followed",
    ),
    (
        "mosaic mono.exr",
        "mono.exr: its sensor has no color filters (monochrome); mosaics are made of Bayer arrays alone, such as --cfa \
         rggb",
    ),
    (
        "demosaic codes.exr --metadata ./x-trans.yaml",
        "codes.exr: its sensor has an X-Trans filter array; only Bayer arrays are demosaicked",
    ),
    (
        "add-noise rates-plane.exr --metadata ./x-trans-rates.yaml --sensor ./parts.yaml",
        "warning: rates-plane.exr: it has an X-Trans filter array, and sensor small has a Bayer filter array, gbrg\n\
         add-noise: rates-plane.exr: its sensor has an X-Trans filter array; only Bayer arrays are given noise",
    ),
    (
        "demosaic codes.exr --metadata ./sites.yaml --black none",
        "codes.exr: what is left of its black level differs among photosites, which three planes cannot tell; subtract it \
         with --black auto",
    ),
];

#[test]
fn a_program_says_which_key_it_lacks() {
    let bench = Bench::new();
    let mono = format!("{HEAD}{READOUT}{RESPONSE}").replace("cfa: gbrg", "cfa: monochrome");
    bench.write("mono.yaml", &mono.replace("{file: qe.csv}", "{file: qe.csv, column: W}"));
    let x_trans = "schema: cyanometer/1\nquantity: adu\ncfa: 6x6:GBGGRGRGRBGBGBGGRGGRGGBGBGBRGRGRGGBG\n";
    bench.write("x-trans.yaml", x_trans);
    bench.write("x-trans-rates.yaml", &x_trans.replace("adu", "expected_electrons"));
    let sites = "black_level_adu: [1, 2, 3, 4]\nblack_by_row: [0, 0.5, 0, 0.5, 0, 0.5]\n";
    bench.write("sites.yaml", &format!("schema: cyanometer/1\nquantity: adu\ncfa: rggb\n{sites}"));
    bench.run("render-radiance --electrons 10,20,30 --size 8x6 --sensor ./response.yaml -o rates.exr");
    bench.run("render-radiance --electrons 10,20,30 --size 8x6 --sensor ./mono.yaml -o mono.exr");
    // Without read-out a sensor has no pattern: rggb.
    bench.run("mosaic rates.exr -o rates-plane.exr");
    bench.run("digitize rates-plane.exr -q --bits 12 --bias 5 --slope 1 -o codes.exr");
    for (line, complaint) in COMPLAINTS {
        let output = bench.attempt(line);
        let program = line.split(' ').next().unwrap();
        assert_eq!(String::from_utf8_lossy(&output.stderr), format!("{program}: {complaint}\n"), "{line}");
        assert_eq!(output.status.code(), Some(1), "{line}");
        assert!(output.stdout.is_empty(), "{line}");
    }
}

/// What does not need the missing part goes through.
#[test]
fn a_part_that_is_not_needed_is_not_missed() {
    let bench = Bench::new();
    bench.run("render-radiance --dark --sensor ./readout.yaml -o rates.exr");
    bench.run("add-noise rates.exr -o noisy.exr");
    bench.run("digitize noisy.exr -o codes.exr");
    bench.run("mosaic codes.exr -o plane.exr");
    bench.run("demosaic plane.exr --sigma -o rgb.exr");
    bench.run("measure noisy.exr --check");
    bench.run("predict-noise --electrons 10,20,30 --sensor ./pitchless.yaml");
    // Another read-out than that of the frame.
    bench.run("render-radiance --electrons 10,20,30 --size 8x6 --sensor ./response.yaml -o other.exr");
    assert!(bench.run("measure other.exr").contains("10"));
    bench.run("preview other.exr -o other.png");
    bench.run("add-noise other.exr --sensor ./pitchless.yaml -o noise.exr");
    // A plane of an X-Trans sensor is measured, class by class.
    bench.run("mosaic codes.exr --pattern rggb -o any.exr");
    let array: FilterArray = "6x6:GBGGRGRGRBGBGBGGRGGRGGBGBGBRGRGRGGBG".parse().unwrap();
    bench.write("x-trans.yaml", &format!("schema: cyanometer/1\nquantity: adu\ncfa: {array}\nblack_level_adu: 64\n"));
    let report = bench.run("measure any.exr --metadata ./x-trans.yaml --output-format json");
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    let classes: Vec<_> =
        report["regions"][0]["classes"].as_array().unwrap().iter().map(|c| c["count"].clone()).collect();
    // Two periods of 8, 20 and 8, and below them twice the rows GBGGRG and RGRBGB.
    assert_eq!(classes, [22, 52, 22]);
    bench.run("correct-frame any.exr --metadata ./x-trans.yaml --black auto -o less.exr");
}

/// Metadata as the first release embedded them: the sensor flat, its unknown keys and all.
const OLD_METADATA: &str = "\
schema: cyanometer/1
quantity: adu
unit: ADU
cfa: rggb
black_level_adu: 1757.3066749999998
white_level_adu: 4095.0
sensor:
  schema: cyanometer-sensor/1
  name: kaf-5101ce
  description: Kodak KAF-5101CE full-frame color CCD behind 1 mm of BG39 glass
  source: '[HP2005], Table 1 and Secs. 3.2 to 3.4; quantum efficiency estimated, see its file'
  width: 2654
  height: 1996
  pixel_pitch_um: 6.8
  cfa: rggb
  quantum_efficiency:
    file: kaf5101ce_est_qe_1nm.csv
    sha256: 7f9ab3a1
  cover_glass:
    file: bg39_1mm.csv
    column: T_ext_1mm
    sha256: 90cd0ff2
  full_well_e: 40000.0
  dark_current_na_per_cm2: 0.068558
  temperature_k: 333.0
  dcnu: 0.2
  prnu: 0.008
  read_noise_e: 15.7
  bits: 12
  bias_adu: 1753.0
  adu_per_e: 0.058824
  xyz_from_camera:
  - - 0.0008720854
    - 4.497218e-05
    - 4.376235e-05
  - - 0.0003651138
    - 0.0003072667
    - -2.594576e-05
  - - 0.0001024814
    - -0.0001585348
    - 0.0005275197
  serial_number: 17
exposure:
  exposure_s: 0.033
  f_number: 8.0
  lens_transmittance: 1.0
correction:
  black_adu: 4.5
demosaic:
  method: eci
  cfa: rggb
  black: 1757.3066749999998
observer: me
";

#[test]
fn old_metadata_get_the_parts_of_their_sensor() {
    let metadata = parse_metadata("old", OLD_METADATA).unwrap();
    let found = metadata.sensor.clone().unwrap();
    let known = sensor();
    assert_eq!((&found.readout, &found.schema), (&known.readout, &known.schema));
    assert_eq!((found.xyz_from_camera, &found.source), (known.xyz_from_camera, &known.source));
    let files = found.response.unwrap();
    assert_eq!(files.quantum_efficiency.unwrap().sha256.as_deref(), Some("7f9ab3a1"));
    assert_eq!(files.cover_glass.unwrap().column.as_deref(), Some("T_ext_1mm"));
    assert_eq!(metadata.uniform_black_adu(), Some(1757.3066749999998));
    assert_eq!(metadata.correction.as_ref().unwrap().black_adu, 4.5.into());
    // What nobody knows of goes on, and the new form is read as it is written.
    let text = write_metadata(&metadata).unwrap();
    assert!(text.contains("observer: me") && text.contains("serial_number: 17"), "{text}");
    assert!(text.contains("  readout:\n    width: 2654\n") && text.contains("schema: cyanometer-sensor/2"), "{text}");
    assert!(!text.contains("cyanometer-sensor/1") && text.matches("width:").count() == 1, "{text}");
    assert_eq!(parse_metadata("new", &text).unwrap(), metadata);
    let complaint =
        |right: &str, wrong: &str| parse_metadata("old", &OLD_METADATA.replace(right, wrong)).unwrap_err().to_string();
    assert!(complaint("  bits: 12", "  bits: 40").contains("in `sensor`, `bits` is 40"));
    assert!(complaint("  bits: 12\n", "").contains("in `sensor`, it has no `bits`"));
}

/// A sidecar of the first release beside a frame of today.
#[test]
fn frames_made_before_go_on_down_the_chain() {
    let bench = Bench::new();
    bench.run("render-radiance --electrons 10,20,30 --size 8x6 -o rates.exr");
    bench.run("add-noise rates.exr --seed 3 -o noisy.exr");
    let sidecar =
        OLD_METADATA.lines().take_while(|line| !line.starts_with("correction")).collect::<Vec<_>>().join("\n");
    let sidecar = sidecar.replace("quantity: adu", "quantity: expected_electrons").replace("cfa: rggb\nblack", "black");
    let sidecar = sidecar.replace("unit: ADU", "unit: e-");
    bench.write("rates.exr.yaml", &sidecar);
    bench.run("add-noise rates.exr --seed 3 -o again.exr");
    let digest = |name: &str| {
        let text = fs::read_to_string(bench.path(name)).unwrap();
        parse_metadata(name, &text).unwrap().samples.unwrap().digest
    };
    assert_eq!(digest("noisy.exr.yaml"), digest("again.exr.yaml"));
}
