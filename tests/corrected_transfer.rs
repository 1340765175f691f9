//! Photon transfer of frames that were corrected: the same numbers where they are the same, and none that came off.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support::workshop::{BAD_DATA, Workshop};
use serde_json::Value;

const SENSOR: &str = "schema: cyanometer-sensor/2\nname: drawn\nreadout:\n  width: 96\n  height: 64\n  cfa: grbg\n  full_well_e: 12000\n  \
                      dark_current_e_per_s: 40\n  temperature_k: 298\n  dcnu: 0.2\n  prnu: 0.01\n  dsnu_e: 3\n  read_noise_e: 4.1\n  \
                      bits: 12\n  bias_adu: 128.25\n  adu_per_e: 0.25\n";
/// Light in e-, exposure time in s, and how many frames.
const TAKEN: [(u32, f64, u32); 12] = [
    (6000, 0.5, 8),
    (200, 0.5, 2),
    (1000, 0.5, 2),
    (2500, 0.5, 2),
    (4000, 0.5, 2),
    (8000, 0.5, 2),
    (11_000, 0.5, 2),
    (13_000, 0.5, 2),
    (15_000, 0.5, 2),
    (0, 0.01, 4),
    (0, 0.5, 8),
    (0, 2.0, 4),
];

/// Takes frames of a light and time into a folder, from such a number on, beginning with `kind`.
fn take(shop: &Workshop, folder: &str, (light, exposure_s, frames): (u32, f64, u32), first: u32) -> Vec<String> {
    std::fs::create_dir_all(shop.path(folder)).unwrap();
    let kind = if light == 0 { "dark" } else { "flat" };
    let one = |number: u32| {
        let name = format!("{kind}-{exposure_s}-{number}.exr");
        let lit = if light == 0 { "--dark".to_owned() } else { format!("--electrons {light},{light},{light}") };
        shop.pipe(&format!(
            "render-radiance --sensor drawn.yaml {lit} --exposure {exposure_s} --size 96x64 --quiet | mosaic --quiet | \
             add-noise --frame {number} --quiet | digitize --quiet -o {folder}/{name}"
        ));
        name
    };
    (first..first + frames).map(one).collect()
}

/// Frames of a camera in `raw`, their names, and darks and flats to correct them by in `masters`.
fn taken(shop: &Workshop, all: &[(u32, f64, u32)]) -> Vec<String> {
    std::fs::write(shop.path("drawn.yaml"), SENSOR).unwrap();
    let mut number = 0;
    let mut names = Vec::new();
    for &own in all {
        names.extend(take(shop, "raw", own, number));
        number += own.2;
    }
    for own in [(6000, 0.5, 8), (0, 0.01, 8), (0, 0.5, 8), (0, 2.0, 8)] {
        take(shop, "masters", own, number);
        number += own.2;
    }
    names
}

/// Corrects all frames into a folder, `DARKS` of the options the darks of each frame's time.
fn correct(shop: &Workshop, names: &[String], folder: &str, options: &str) {
    std::fs::create_dir(shop.path(folder)).unwrap();
    for name in names {
        let darks = name.split('-').nth(1).map(|time| format!("masters/dark-{time}-*.exr")).unwrap();
        let options = options.replace("DARKS", &darks);
        shop.run(&format!("correct-frame raw/{name} {options} --quiet -o {folder}/{name}"), &[]);
    }
}

fn measured(shop: &Workshop, folder: &str) -> Vec<Value> {
    let told = shop.run(&format!("photon-transfer {folder} --output-format json --quiet"), &[]);
    serde_json::from_slice::<Value>(&told).unwrap()["channels"].as_array().unwrap().clone()
}

fn number(channel: &Value, key: &str) -> f64 {
    channel[key]["value"].as_f64().unwrap_or_else(|| panic!("{key}: {}", channel[key]))
}

/// Off frames a level alone came: all numbers are those of the frames before, the black level among them.
#[test]
fn a_level_that_came_off_comes_back() {
    let shop = Workshop::new();
    let names = taken(&shop, &TAKEN);
    correct(&shop, &names, "less", "--black 128.25");
    let [raw, less] = ["raw", "less"].map(|folder| measured(&shop, folder));
    assert_eq!(raw, less);
    shop.run("photon-transfer less --sensor-out measured.yaml --quiet -o report.txt", &[]);
    assert!(std::fs::read_to_string(shop.path("measured.yaml")).unwrap().contains("bias_adu: 12"));
}

/// Of frames less darks, and divided by a flat field: gain and noise hold the truth as before, patterns are what is left of them, saturation is
/// found by its marks, and dark current is not told.
#[test]
fn what_came_off_is_not_told_and_all_else_is() {
    let shop = Workshop::new();
    let names = taken(&shop, &TAKEN);
    correct(&shop, &names, "darks", "--dark DARKS");
    correct(&shop, &names, "flats", "--dark DARKS --flat masters/flat-*.exr --flat-dark masters/dark-0.5-*.exr");
    let [raw, darks, flats] = ["raw", "darks", "flats"].map(|folder| measured(&shop, folder));
    for (raw, (darks, flats)) in raw.iter().zip(darks.iter().zip(&flats)) {
        for own in [darks, flats] {
            let name = &raw["name"];
            for (key, truth) in [("gain_adu_per_e", 0.25), ("saturation_e", 11_980.0)] {
                let [low, high] = ["low", "high"].map(|end| own[key][end].as_f64().unwrap());
                assert!((0.97 * low..=1.03 * high).contains(&truth), "{name} {key}: {low} to {high}");
            }
            // The same differences of frames, and shares of them by sites.
            for (key, within) in [("gain_adu_per_e", 0.003), ("dark_noise_e", 0.003), ("saturation_e", 0.01)] {
                let ratio = number(own, key) / number(raw, key);
                assert!((ratio - 1.0).abs() < within, "{name} {key}: {ratio}");
            }
            for key in ["dark_current_e_per_s", "dcnu"] {
                let why = own["undetermined"][key].as_str().unwrap_or_else(|| panic!("{key}: {}", own[key]));
                assert!(why.contains("came off the frames"), "{why}");
            }
            let left = number(own, "dsnu_e") / number(raw, "dsnu_e");
            // Of eight frames the mean has a noise of 4.1 e- and what dark charge has, over √8.
            assert!(left < 0.8, "{name}: {left}");
        }
        assert!((number(darks, "prnu") / number(raw, "prnu") - 1.0).abs() < 0.05);
        // Eight flats of 6000 e- leave 77 e- of noise each.
        let left = number(flats, "prnu");
        let wanted = (6000.0_f64 / 8.0).sqrt() / 6000.0;
        assert!((left / wanted - 1.0).abs() < 0.15, "{}: {left} {wanted}", raw["name"]);
    }
    let said = shop.said("photon-transfer flats --sensor-out measured.yaml --quiet -o report.txt", BAD_DATA);
    assert!(said.contains("the frames were corrected, and a sensor file is of what the camera gives"), "{said}");
}

/// Frames of which some were corrected are not measured together, and photosites that were mended are left out.
#[test]
fn frames_are_corrected_alike_and_mended_photosites_left_out() {
    let shop = Workshop::new();
    let names = taken(&shop, &[(1000, 0.5, 2), (4000, 0.5, 2), (0, 0.5, 4)]);
    std::fs::write(shop.path("bad.csv"), "column,row\n10,20\n11,20\n40,31\n70,50\n").unwrap();
    correct(&shop, &names, "mended", "--dark DARKS --defects bad.csv");
    let said = String::from_utf8(shop.run("photon-transfer mended --quiet", &[])).unwrap();
    assert!(
        said.contains("the frames were corrected by dark frames, defects: patterns are those which that left"),
        "{said}"
    );
    let channels = measured(&shop, "mended");
    let left_out = channels.iter().map(|channel| {
        let notes = channel["notes"].as_array().unwrap().iter().filter_map(Value::as_str);
        let counts = notes.filter_map(|note| note.strip_prefix("photosites that are marked as defective, or were interpolated from others, are left out of all numbers: "));
        counts.map(|count| count.parse::<usize>().unwrap()).sum::<usize>()
    });
    assert_eq!(left_out.sum::<usize>(), 4);
    correct(&shop, &names, "mixed", "--dark DARKS");
    let one = &names[0];
    shop.run(&format!("correct-frame raw/{one} --black auto --quiet -o mixed/{one}"), &[]);
    let said = shop.said("photon-transfer mixed", BAD_DATA);
    assert!(said.contains("flats and darks are measured that were corrected alike"), "{said}");
}
