//! Photosites that are not like the others, hot, stuck or clipped, in what photon transfer finds of a camera.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::analysis::photon_transfer::{Condition, full_mean};
use cyanometer::camera::readout::ReadOut;
use rayon::prelude::*;
use support::misses::check_misses;
use support::photon_transfer::{FLAT_S, Kind, Shake, camera, found, level_in, levels};
use support::workshop::Workshop;

/// Cameras of which two in a hundred photosites are hot: dark current and patterns of the dark lie within their
/// intervals as often as is stated. Of n cameras so many may miss by chance: 4 standard deviations beyond 5 %.
#[test]
fn hot_photosites_widen_intervals_of_the_dark() {
    const OF_DARK: [&str; 4] = ["dsnu_e", "dsnu_pixel_e", "dark_current_e_per_s", "dcnu"];
    let count: u32 = std::env::var("CYANOMETER_CAMERAS").map_or(40, |count| count.parse().unwrap());
    let found: Vec<[Option<bool>; 4]> = (0..count)
        .into_par_iter()
        .map(|index| {
            let plain = camera(index, Kind::Ccd);
            // No photosite is full after the longest exposure, 1 s.
            let current = plain.dark_current_e_per_s.unwrap().min(plain.full_well_e / 50.0);
            let (share, hot) = (0.02, 5.0 * current);
            let readout = ReadOut {
                dark_current_e_per_s: Some(current),
                hot_pixel_share: share,
                hot_pixel_dark_current_e_per_s: hot,
                ..plain
            };
            let [flats, darks] = levels(&readout, index);
            let found = found(&flats, &darks);
            let mean = current + share * hot;
            // An exponential law has a variance of the square of its mean.
            let variance = (readout.dcnu * mean).powi(2) + share * (2.0 - share) * hot * hot;
            let of_flats = variance.sqrt() * FLAT_S;
            let truths = [of_flats, of_flats, mean, variance.sqrt() / mean];
            let holds = |(key, truth): (&str, f64)| {
                let interval = found.get(key)?;
                Some((interval.low..=interval.high).contains(&truth))
            };
            [0, 1, 2, 3].map(|place| holds((OF_DARK[place], truths[place])))
        })
        .collect();
    for (place, key) in OF_DARK.iter().enumerate() {
        check_misses(key, found.iter().map(|held| held[place]));
    }
}

/// Hot photosites that are full in the longer darks, and as many as are at the largest code there: dark current and its pattern are
/// those of shorter darks, or the reason is that.
#[test]
fn full_hot_photosites_do_not_count_in_dark_current() {
    const OF_DARK: [&str; 2] = ["dark_current_e_per_s", "dcnu"];
    let found: Vec<[Option<bool>; 2]> = (0..40_u32)
        .into_par_iter()
        .map(|index| {
            let plain = camera(index, Kind::Ccd);
            let current = plain.dark_current_e_per_s.unwrap().min(plain.full_well_e / 50.0);
            // Of a hundred hot photosites one has 4.6 times the mean: full after a quarter of a second, or half of one.
            let (share, hot) = (0.02, 0.6 * plain.full_well_e);
            let readout = ReadOut {
                dark_current_e_per_s: Some(current),
                hot_pixel_share: share,
                hot_pixel_dark_current_e_per_s: hot,
                ..plain
            };
            let [flats, mut darks] = levels(&readout, index);
            let full = full_mean(&flats);
            for (place, exposure_s) in (0..).zip([0.003, 0.006, 0.01, 0.05]) {
                let condition = Condition { exposure_s: Some(exposure_s), ..darks[0].condition };
                darks.push(level_in((&readout, index, Shake::default()), condition, 0.0, [4, 500 + 4 * place], full));
            }
            let found = found(&flats, &darks);
            let mean = current + share * hot;
            let variance = (readout.dcnu * mean).powi(2) + share * (2.0 - share) * hot * hot;
            let truths = [mean, variance.sqrt() / mean];
            [0, 1].map(|place| {
                let interval = found.get(OF_DARK[place])?;
                Some((interval.low..=interval.high).contains(&truths[place]))
            })
        })
        .collect();
    for (place, key) in OF_DARK.iter().enumerate() {
        let known = check_misses(key, found.iter().map(|held| held[place]));
        assert!(known >= 20, "{key} is known of {known} cameras alone");
    }
}

/// Cameras whose black level drifts along rows by three times the noise of these: noise of rows, columns and photosites, gain and patterns lie
/// within their intervals as often as is stated.
#[test]
fn drift_along_rows_is_no_noise_of_rows() {
    const KEYS: [&str; 6] =
        ["row_noise_e", "column_noise_e", "pixel_noise_e", "gain_adu_per_e", "prnu_column", "dsnu_column_e"];
    let count: u32 = std::env::var("CYANOMETER_CAMERAS").map_or(40, |count| count.parse().unwrap());
    let found: Vec<([Option<bool>; 6], bool)> = (0..count)
        .into_par_iter()
        .map(|index| {
            let plain = camera(index, Kind::Cmos);
            let readout = ReadOut { black_drift_e: 3.0 * plain.row_noise_e, black_drift_rows: 40.0, ..plain };
            let [flats, darks] = levels(&readout, index);
            let found = found(&flats, &darks);
            let truths = [
                readout.row_noise_e,
                readout.column_noise_e,
                readout.read_noise_e,
                readout.adu_per_e,
                readout.prnu_column,
                readout.dsnu_column_e,
            ];
            let holds = |key: &str, truth: f64| {
                let interval = found.get(key)?;
                Some((interval.low..=interval.high).contains(&truth))
            };
            ([0, 1, 2, 3, 4, 5].map(|place| holds(KEYS[place], truths[place])), found.drift.is_some())
        })
        .collect();
    for (place, key) in KEYS.iter().enumerate() {
        check_misses(key, found.iter().map(|(held, _)| held[place]));
    }
    let told = found.iter().filter(|(_, is_told)| *is_told).count();
    assert!(told > found.len() / 2, "drift is told of {told} cameras alone");
}

/// Of a camera three photosites that hold the largest code, one value, and code 0 with light and without are named and left out: its
/// patterns are those without them, dead ones empty no report, and their neighbors do not stand out.
#[test]
fn stuck_photosites_are_named_and_left_out() {
    const STUCK: [([usize; 2], f32); 3] = [([20, 10], 4095.0), ([31, 21], 900.0), ([40, 30], 0.0)];
    let shop = Workshop::new();
    for folder in ["whole", "stuck"] {
        std::fs::create_dir(shop.path(folder)).unwrap();
    }
    for level in [0, 500, 2000, 5000, 10_000, 15_000, 20_000, 25_000, 30_000, 35_000] {
        for frame in 1..3 {
            let kind = if level == 0 { "dark" } else { "flat" };
            let name = format!("{kind}-{level}-{frame}.exr");
            shop.pipe(&format!(
                "render-radiance --electrons {level},{level},{level} --size 64x48 --cfa rggb | add-noise --frame {level}{frame} | \
                 digitize -o whole/{name}"
            ));
            let mut taken = shop.frame(&format!("whole/{name}"));
            for ([x, y], code) in STUCK {
                taken.samples[y * 64 + x] = code;
            }
            shop.write(&format!("stuck/{name}"), &taken.header, &taken.samples);
        }
    }
    let channels = |folder: &str| -> serde_json::Value {
        let told = shop.run(&format!("photon-transfer {folder} --output-format json"), &[]);
        serde_json::from_slice::<serde_json::Value>(&told).unwrap()["channels"].clone()
    };
    let [whole, stuck] = ["whole", "stuck"].map(channels);
    let mut places: Vec<[u64; 2]> = Vec::new();
    for (whole, stuck) in whole.as_array().unwrap().iter().zip(stuck.as_array().unwrap()) {
        for key in ["gain_adu_per_e", "prnu", "prnu_pixel", "dsnu_e", "dsnu_pixel_e", "dark_noise_e"] {
            let [own, wanted] = [stuck, whole].map(|channel| channel[key]["value"].as_f64().unwrap());
            assert!((own / wanted - 1.0).abs() < 0.02, "{} {key}: {own} {wanted}", whole["name"]);
        }
        for place in ["light", "dark"] {
            let [own, wanted] = [stuck, whole].map(|channel| channel["defects"][place]["count"].as_f64().unwrap());
            assert!((own - wanted).abs() <= 1.0, "{} {place}: {own} {wanted}", whole["name"]);
        }
        let sites = stuck["defects"]["stuck"]["sites"].as_array().unwrap();
        places.extend(sites.iter().map(|site| ["x", "y"].map(|axis| site[axis].as_u64().unwrap())));
        assert_eq!(whole["defects"]["stuck"]["count"], 0);
    }
    places.sort_unstable();
    assert_eq!(places, STUCK.map(|([x, y], _)| [x as u64, y as u64]));
}

/// Six hot photosites of 19 200, two of each class, are no part of what a sensor file has of all others: of rows and columns, of which one
/// in a column of 60 makes 16 e-, of PRNU and of the pattern of the dark. Bounds are 3 standard deviations and more of patterns of so many rows,
/// columns and photosites.
#[test]
fn sensor_files_have_hot_photosites_apart() {
    const SENSOR: &str = "schema: cyanometer-sensor/2\nname: drawn\nreadout:\n  width: 160\n  height: 120\n  cfa: grbg\n  \
                          full_well_e: 12000\n  dark_current_e_per_s: 10\n  temperature_k: 298\n  dcnu: 0.2\n  prnu: 0.008\n  \
                          prnu_row: 0.002\n  prnu_column: 0.003\n  dsnu_e: 1.5\n  dsnu_row_e: 0.5\n  dsnu_column_e: 0.8\n  \
                          read_noise_e: 4.1\n  bits: 12\n  bias_adu: 128\n  adu_per_e: 0.25\n";
    const HOT: [[usize; 2]; 6] = [[20, 20], [61, 41], [31, 50], [91, 80], [40, 31], [120, 95]];
    /// Codes per second: 2000 e-.
    const EXCESS: f32 = 500.0;
    let shop = Workshop::new();
    std::fs::write(shop.path("drawn.yaml"), SENSOR).unwrap();
    std::fs::create_dir(shop.path("frames")).unwrap();
    let lit = |level: u32, frames: u32| (format!("--electrons {level},{level},{level}"), 0.5_f32, frames);
    let mut stacks = vec![lit(8000, 8)];
    stacks.extend([200, 1000, 2500, 4000, 5500, 7000].map(|level| lit(level, 2)));
    stacks.extend([(0.01, 4), (0.5, 8), (2.0, 4)].map(|(time, frames)| ("--dark".to_owned(), time, frames)));
    let mut number = 0;
    for (light, exposure_s, frames) in stacks {
        for _ in 0..frames {
            number += 1;
            let name = format!("frames/{number}.exr");
            shop.pipe(&format!(
                "render-radiance --sensor drawn.yaml {light} --exposure {exposure_s} --size 160x120 | mosaic | add-noise --frame {number} | \
                 digitize -o {name}"
            ));
            let mut taken = shop.frame(&name);
            for [x, y] in HOT {
                taken.samples[y * 160 + x] += (EXCESS * exposure_s).round();
            }
            shop.write(&name, &taken.header, &taken.samples);
        }
    }
    let told = shop.attempt("photon-transfer frames --sensor-out measured.yaml -q", &[]);
    assert!(told.status.success(), "{}", String::from_utf8_lossy(&told.stderr));
    let text = std::fs::read_to_string(shop.path("measured.yaml")).unwrap();
    let number = |key: &str| -> f64 {
        let own = text.lines().find_map(|line| line.strip_prefix(&format!("  {key}: ")));
        own.unwrap_or_else(|| panic!("no {key} in {text}")).parse().unwrap()
    };
    for (key, truth, share) in [
        ("dsnu_row_e", 0.5, 0.4),
        ("dsnu_column_e", 0.8, 0.35),
        ("dsnu_e", 1.5, 0.2),
        ("prnu", 0.008, 0.1),
        ("dark_current_e_per_s", 10.0, 0.1),
        ("dcnu", 0.2, 0.2),
    ] {
        let own = number(key);
        assert!((own / truth - 1.0).abs() < share, "{key}: {own}, {truth}");
    }
    assert!(number("hot_pixel_share") > 0.0 && number("hot_pixel_dark_current_e_per_s") > 1000.0, "{text}");
}
