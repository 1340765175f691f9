//! Read-out settings of sensor files: which numbers count, what metadata keep of them, and what is of another gain.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::formats::yaml::{parse_metadata, parse_sensor, parse_sensor_at, settings_of};
use std::fs;
use support::workshop::Workshop;

const SENSOR: &str = "\
schema: cyanometer-sensor/2
name: my camera
provenance:
  readout.prnu: {kind: measured}
  readout.read_noise_e: {kind: measured}
  readout.adu_per_e: {kind: measured}
  readout.settings.read_noise_e: {kind: assumed}
readout:
  setting: ISO 100
  width: 64
  height: 48
  cfa: grbg
  full_well_e: 12000
  dark_current_e_per_s: 4
  temperature_k: 298
  dcnu: 0.1
  prnu: 0.006
  read_noise_e: 3.1
  bits: 12
  bias_adu: 128
  adu_per_e: 0.25
  settings:
    - {name: iso400, adu_per_e: 1.0, read_noise_e: 2.2, full_well_e: 3200}
    - {name: 800, adu_per_e: 2.0, full_well_e: 1500, bias_adu: 140, row_noise_e: 0.4}
xyz_from_camera: [[1, 0, 0], [0, 2, 0], [0, 0, 4]]
";

/// Every number of a setting is that of its entry, or else that of the read-out; so is what is told of it.
#[test]
fn a_setting_has_the_numbers_of_its_entry_and_the_others_of_the_read_out() {
    let at = |setting: Option<&str>| parse_sensor_at("s.yaml", SENSOR.as_bytes(), setting).unwrap();
    let (own, told) = at(None);
    let numbers = own.readout().unwrap().clone();
    assert_eq!((numbers.adu_per_e, numbers.setting.as_deref()), (0.25, Some("ISO 100")));
    assert_eq!(
        told,
        ["its `readout` counts as it stands; it has the settings `ISO 100`, `iso400`, `800` too (--setting)"]
    );
    // By its name it is the same, and nothing is left to tell.
    assert_eq!(at(Some("iso  100")), (own.clone(), vec![]));
    assert!(own.assumed().next().is_none());
    let (iso400, told) = at(Some("ISO400"));
    let of_400 = iso400.readout().unwrap().clone();
    let mut expected = numbers.clone();
    expected.setting = Some("iso400".into());
    (expected.adu_per_e, expected.read_noise_e, expected.full_well_e) = (1.0, 2.2, 3200.0);
    assert_eq!((of_400, told), (expected, vec![]));
    // XYZ of an ADU are those of the electrons that it stands for, of which there are a quarter.
    assert_eq!(iso400.xyz_from_camera, Some([[0.25, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 1.0]]));
    // What is told of numbers that the entry has is told of these.
    assert_eq!(iso400.assumed().collect::<Vec<_>>(), ["readout.read_noise_e"]);
    assert_eq!(iso400.provenance.keys().collect::<Vec<_>>(), ["readout.prnu", "readout.read_noise_e"]);
    let (iso800, _) = at(Some("800"));
    let of_800 = iso800.readout().unwrap();
    assert_eq!((of_800.bias_adu, of_800.row_noise_e, of_800.read_noise_e), (140.0, 0.4, 3.1));
    assert_eq!(settings_of(SENSOR.as_bytes()), ["ISO 100", "iso400", "800"]);
}

#[test]
fn what_no_setting_can_be_is_refused() {
    let said = |text: &str, setting: Option<&str>| {
        parse_sensor_at("s.yaml", text.as_bytes(), setting).unwrap_err().to_string()
    };
    assert_eq!(
        said(SENSOR, Some("iso 640")),
        "s.yaml: it has no setting `iso 640`; there are `ISO 100`, `iso400`, `800`, and nothing is told between them; give \
         another `setting`"
    );
    let with = |entry: &str| SENSOR.replace("{name: iso400, ", &format!("{{{entry}, "));
    assert!(said(&with("nam: iso400"), None).contains("entry 1 of `readout.settings` has no `name`"));
    assert!(said(&with("name: ' iso 100'"), None).contains("two settings are named ` iso 100`"));
    assert!(said(&with("name: '800'"), None).contains("two of `readout.settings` are named `800`"));
    assert!(said(&with("name: a, cfa: rggb"), None).contains("in the setting `a`, `cfa` is what no setting changes"));
    // An entry is looked at also where another counts.
    let wrong = said(&with("name: a, red_noise_e: 3"), None);
    let expected = "in the setting `a`: unknown key `readout.red_noise_e`; did you mean `readout.read_noise_e`?";
    assert!(wrong.contains(expected), "{wrong}");
    let wrong = said(&with("name: a, bias_adu: 5000"), Some("800"));
    assert!(wrong.contains("in the setting `a`: `bias_adu` is 5000; the largest code of 12 bits is 4095"), "{wrong}");
    // The other form of a dark current takes the place of the one, which needs a pitch.
    let wrong = said(&with("name: a, dark_current_na_per_cm2: 0.1"), Some("800"));
    assert!(wrong.contains("in the setting `a`: `dark_current_na_per_cm2` is that of an area"), "{wrong}");
    let plain =
        SENSOR.split("  settings:").next().unwrap().replace("  readout.settings.read_noise_e: {kind: assumed}\n", "");
    assert!(said(&plain, Some("iso400")).contains("it has the setting `ISO 100` alone, not `iso400`"));
    assert!(said(&plain.replace("  setting: ISO 100\n", ""), Some("iso400")).contains("it has no settings"));
    let misspelled = SENSOR.replace("readout.settings.read_noise_e:", "readout.settings.red_noise_e:");
    assert!(said(&misspelled, None).contains("which no sensor file has"));
}

/// Without numbers of its own a file has none to fall back on.
#[test]
fn a_file_whose_read_out_leaves_the_gain_open_needs_a_choice() {
    let open = SENSOR.replace("  adu_per_e: 0.25\n", "").replace("  setting: ISO 100\n", "");
    let said = parse_sensor("s.yaml", open.as_bytes()).unwrap_err().to_string();
    assert_eq!(said, "s.yaml: its `readout` has no `adu_per_e` but in its settings: `iso400`, `800`; give `setting`");
    let (sensor, told) = parse_sensor_at("s.yaml", open.as_bytes(), Some("iso400")).unwrap();
    assert_eq!(sensor.readout().unwrap().adu_per_e, 1.0);
    let left_out = "is of a gain that its file does not tell";
    assert!(sensor.xyz_from_camera.is_none() && told[0].contains(left_out), "{told:?}");
    // What no setting has is missing.
    let less = open.replace("  bits: 12\n", "");
    let said = parse_sensor_at("s.yaml", less.as_bytes(), Some("iso400")).unwrap_err().to_string();
    assert!(said.contains("`bits`"), "{said}");
}

/// The programs, in a directory with the sensor.
struct Bench(Workshop);

impl Bench {
    fn new() -> Self {
        let shop = Workshop::new();
        fs::write(shop.path("s.yaml"), SENSOR).unwrap();
        Self(shop)
    }

    /// What a program says that does its work.
    fn run(&self, line: &str) -> String {
        let output = self.0.attempt(line, &[]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{line}: {said}");
        said
    }

    /// What one says that does not.
    fn refused(&self, line: &str) -> String {
        let output = self.0.attempt(line, &[]);
        assert!(!output.status.success(), "{line}");
        String::from_utf8_lossy(&output.stderr).into_owned()
    }
}

/// Frames of a setting are those of a plain sensor file with its numbers, byte by byte, and say which it is.
#[test]
fn frames_of_a_setting_are_those_of_a_file_with_its_numbers() {
    let bench = Bench::new();
    let plain = SENSOR.split("  settings:").next().unwrap().replace("adu_per_e: 0.25", "adu_per_e: 1.0");
    let plain =
        plain.replace("read_noise_e: 3.1", "read_noise_e: 2.2").replace("full_well_e: 12000", "full_well_e: 3200");
    let plain =
        plain.replace("  setting: ISO 100\n", "").replace("  readout.settings.read_noise_e: {kind: assumed}\n", "");
    fs::write(bench.0.path("plain.yaml"), plain).unwrap();
    for (name, sensor) in [("a", "--sensor s.yaml --setting iso400"), ("b", "--sensor plain.yaml")] {
        bench.run(&format!("render-radiance --electrons 500,1000,3100 --size 64x48 {sensor} -o {name}.exr"));
        bench.run(&format!("add-noise {name}.exr -o {name}-noisy.exr"));
        bench.run(&format!("digitize {name}-noisy.exr -o {name}-codes.exr"));
    }
    let metadata = |file: &str| parse_metadata(file, &fs::read_to_string(bench.0.path(file)).unwrap()).unwrap();
    let [a, b] = ["a-codes.exr.yaml", "b-codes.exr.yaml"].map(metadata);
    assert_eq!(a.samples.unwrap().digest, b.samples.unwrap().digest);
    assert_eq!(a.predicted, b.predicted);
    let mut readout = a.sensor.unwrap().readout.unwrap();
    assert_eq!(readout.setting.take().as_deref(), Some("iso400"));
    assert_eq!(Some(readout), b.sensor.unwrap().readout);
    // The setting of a read-out that takes the place of the frame's.
    bench.run("add-noise b.exr --readout s.yaml --setting 800 -o c.exr");
    assert_eq!(metadata("c.exr.yaml").sensor.unwrap().readout.unwrap().setting.as_deref(), Some("800"));
    assert!(bench.refused("add-noise b.exr --setting 800 -o d.exr").contains("give --sensor or --readout"));
    let said = bench.refused("predict-noise --electrons 1,2,3 --sensor imx219 --setting 800");
    assert!(said.contains("it has no settings; leave out --setting"), "{said}");
    let said = bench.run("predict-noise --electrons 1,2,3 --sensor s.yaml -v");
    assert!(said.contains("it has the settings `ISO 100`, `iso400`, `800` too"), "{said}");
}

/// What is of another gain is told by the gain, whatever it is called.
#[test]
fn another_gain_is_told_by_its_number() {
    let bench = Bench::new();
    let frame = |name: &str, setting: &str, number: u32| {
        let light = if name.starts_with("dark") { "--dark" } else { "--electrons 500,1000,800" };
        let sensor = format!("--sensor s.yaml{setting}");
        bench.run(&format!("render-radiance {light} --size 64x48 --exposure 0.01 {sensor} -o rates.exr"));
        bench.run("mosaic rates.exr -o plane.exr");
        bench.run(&format!("add-noise --frame {number} plane.exr -o noisy.exr"));
        bench.run(&format!("digitize noisy.exr -o {name}.exr"));
    };
    frame("light", "", 0);
    frame("light400", " --setting iso400", 0);
    frame("dark", "", 1);
    frame("dark400", " --setting iso400", 2);
    frame("dark800", " --setting 800", 3);
    bench.run("correct-frame light.exr --dark dark.exr -o less.exr");
    let said = bench.refused("correct-frame light.exr --dark dark400.exr -o less.exr");
    let expected = "its adu_per_e is 1 ADU per electron, but that of light.exr is 0.25 ADU per electron";
    assert!(said.contains(expected), "{said}");
    // The same gain with another bias, and then other noise.
    bench.run("digitize noisy.exr --slope 0.25 -o biased.exr");
    let said = bench.refused("correct-frame light.exr --dark biased.exr -o less.exr");
    assert!(said.contains("its bias_adu is 140 ADU, but that of light.exr is 128 ADU"), "{said}");
    bench.run("digitize noisy.exr --slope 0.25 --bias 128 -o alike.exr");
    let said = bench.run("correct-frame light.exr --dark alike.exr -o less.exr");
    assert!(
        said.contains("its row_noise_e is 0.4, but that of light.exr is 0, which predictions take for both"),
        "{said}"
    );
    // The matrix of the file, of both settings: the same electrons have the same XYZ.
    let matrix = "schema: cyanometer-matrix/1\nsensor: my camera\nadu_per_e: 0.25\nunit: cd m-2 per (ADU s-1 sr-1)\n\
                  xyz_from_camera: [[1, 0, 0], [0, 2, 0], [0, 0, 4]]\n";
    fs::write(bench.0.path("m.yaml"), matrix).unwrap();
    for name in ["light", "light400"] {
        bench.run(&format!("demosaic {name}.exr -o {name}-rgb.exr"));
        bench.run(&format!("to-xyz {name}-rgb.exr -o {name}-xyz.exr"));
    }
    let said = bench.run("to-xyz light-rgb.exr --matrix m.yaml -o xyz.exr");
    assert!(!said.contains("ADU per electron"), "{said}");
    let said = bench.run("to-xyz light400-rgb.exr --matrix m.yaml -o xyz.exr");
    let expected = "m.yaml is for 0.25 ADU per electron, and the codes have 1: XYZ come out 4.0000 times what they are";
    assert!(said.contains(expected), "{said}");
    let said = bench.run("predict-noise --electrons 500,1000,800 --sensor s.yaml --setting 800 --matrix m.yaml");
    assert!(said.contains("XYZ come out 8.0000 times"), "{said}");
    let means = |file: &str| {
        let frame = bench.0.frame(file);
        let samples = frame.samples.chunks(64).map(|row| row.iter().copied().map(f64::from).sum::<f64>());
        let mut sums = [0.0_f64; 3];
        samples.enumerate().for_each(|(index, sum)| sums[index % 3] += sum);
        sums
    };
    let (a, b) = (means("light-xyz.exr"), means("light400-xyz.exr"));
    // Means of 768 photosites of a class at least, each off by up to 6 %: 0.2 % each of the two, five times their difference.
    a.iter().zip(&b).for_each(|(a, b)| assert!((a / b - 1.0).abs() < 0.015, "{a} {b}"));
    // A list of frames of several is no measurement.
    fs::create_dir_all(bench.0.path("pt/flats")).unwrap();
    for (name, number) in [("light", 0), ("light400", 1)] {
        fs::copy(bench.0.path(&format!("{name}.exr")), bench.0.path(&format!("pt/flats/{number}.exr"))).unwrap();
        fs::copy(bench.0.path(&format!("{name}.exr.yaml")), bench.0.path(&format!("pt/flats/{number}.exr.yaml")))
            .unwrap();
    }
    let said = bench.refused("photon-transfer pt");
    assert!(said.contains("its setting of the gain is not that of"), "{said}");
}
