//! Numbers that look wrong, by every way in which they come: no program takes them without a word.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::camera::readout::ReadOut;
use cyanometer::camera::taps::{TapLayout, Taps};
use cyanometer::stages::adc::{AdcSettings, Digitize};
use cyanometer::stages::bounds::Bounds;
use cyanometer::stages::noise::{AddNoise, NoiseSettings};
use cyanometer::stream::MemoryFrame;
use std::fs;
use support::workshop::{BAD_DATA, Workshop};
use support::{expected, through};

/// Replaces a text in a file, which must have it.
#[track_caller]
fn edit(shop: &Workshop, file: &str, from: &str, to: &str) {
    let text = fs::read_to_string(shop.path(file)).unwrap();
    assert!(text.contains(from), "{file}: {text}");
    fs::write(shop.path(file), text.replace(from, to)).unwrap();
}

/// One plane of codes with what belongs to it.
fn codes() -> Workshop {
    let shop = Workshop::new();
    shop.pipe("render-radiance --electrons 1000,2000,3000 --size 16x12 --cfa rggb | add-noise | digitize -o plane.exr");
    shop
}

#[test]
fn exposures_and_lenses_in_other_units_are_told_by_whatever_way_they_come() {
    let shop = codes();
    let long = "an exposure of 33 s is long; 33 ms is 0.033 s";
    let small = "an f-number of 2800 is that of no lens; in thousandths it is 2.8";
    let short = "a focal length of 0.05 mm is that of few lenses; 0.05 m is 50 mm";
    // By options.
    let scene = "--electrons 1,2,3 --size 8x6";
    for (line, wanted) in [
        (format!("render-radiance {scene} --f-number 2800 -o a.exr"), small),
        (format!("render-radiance {scene} --exposure 33 -o a.exr"), long),
        (format!("render-radiance {scene} --vignetting --focal-length 0.05 -o a.exr"), short),
        ("predict-noise --electrons 1,2,3 --f-number 2800".into(), small),
        ("fit-matrix sky912.exr --f-number 2800 -o m.yaml".into(), small),
    ] {
        assert!(shop.said(&line, 0).contains(wanted), "{line}");
    }
    shop.run("predict-noise --electrons 1,2,3 --f-number 180", &[]);
    // Times of the night are set; by day they fill the sensor.
    shop.run("predict-noise --electrons 1,2,3 --exposure 30", &[]);
    let day = shop.said("render-radiance SAMPLES/skies/clear_zenith.csv --size 8x6 --exposure 30 -o a.exr", 0);
    assert!(day.contains("the exposure is 30 s, and 30 ms is 0.03 s"), "{day}");
    assert!(shop.said("measure plane.exr --exposure 40", 2).contains("exposure time in s is 0.033"));
    fs::write(shop.path("night.raw"), vec![1; 8 * 6 * 2]).unwrap();
    let raw = "correct-frame night.raw --raw 8x6:u16le --cfa rggb --black 0 --white 65535 -o b.exr";
    assert_eq!(shop.said(&format!("{raw} --exposure 120"), 0), "");
    assert!(shop.said(&format!("{raw} --exposure 33"), 0).contains(long));
    // By metadata: the sidecar of a frame that another program of ours wrote, a file that is given, and one without a history.
    fs::copy(shop.path("plane.exr.yaml"), shop.path("given.yaml")).unwrap();
    for file in ["given.yaml", "plane.exr.yaml"] {
        edit(&shop, file, "exposure_s: 0.033", "exposure_s: 33.0");
        edit(&shop, file, "f_number: 8.0", "f_number: 2800.0");
    }
    let said = shop.said("measure plane.exr --metadata given.yaml", 0);
    assert!(said.contains(long) && said.contains(small), "{said}");
    let said = shop.said("measure plane.exr", 0);
    assert!(
        said.contains("its `exposure.exposure_s` is 33.0, but 0.033 in the file of the frame; the sidecar counts"),
        "{said}"
    );
    fs::write(shop.path("short.yaml"), "schema: cyanometer/1\nquantity: adu\nexposure_time_s: 33.0\n").unwrap();
    let said = shop.said("measure plane.exr --metadata short.yaml", 0);
    assert!(said.contains(long), "{said}");
}

#[test]
fn a_white_level_that_the_converter_tells_is_not_forgotten() {
    let shop = Workshop::new();
    shop.pipe("render-radiance --electrons 100000,100,100 --size 16x12 --cfa rggb --quiet | add-noise --quiet | digitize -o bright.exr --quiet");
    let told = "48 samples are saturated";
    assert!(shop.said("measure bright.exr", 0).contains(told));
    // White is told by the sidecar that counts, and by that alone.
    fs::copy(shop.path("bright.exr.yaml"), shop.path("given.yaml")).unwrap();
    edit(&shop, "given.yaml", "white_level_adu: 4095.0\n", "");
    assert!(shop.said("measure bright.exr --metadata given.yaml", 0).contains(told));
    fs::copy(shop.path("bright.exr.yaml"), shop.path("given.yaml")).unwrap();
    edit(&shop, "given.yaml", "white_level_adu: 4095.0", "white_level_adu: 65535.0");
    let said = shop.said("measure bright.exr --metadata given.yaml", BAD_DATA);
    assert!(
        said.contains("its `white_level_adu` is 65535, beyond the largest code of its converter of 12 bits, 4095"),
        "{said}"
    );
}

/// Numbers that look like chance and are the same every time.
struct Chance(u64);

impl Chance {
    fn word(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// From 0 to 1.
    fn share(&mut self) -> f64 {
        (self.word() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// None of three, or a number between two by its logarithm.
    fn log_or_none(&mut self, low: f64, high: f64) -> f64 {
        if self.word().is_multiple_of(3) { 0.0 } else { low * (high / low).powf(self.share()) }
    }
}

/// A read-out of any noise beside any bias.
fn any_readout(chance: &mut Chance) -> ReadOut {
    let mut readout = support::readout();
    let full_well_e = readout.full_well_e;
    for part in [
        &mut readout.read_noise_e,
        &mut readout.row_noise_e,
        &mut readout.column_noise_e,
        &mut readout.black_drift_e,
        &mut readout.dsnu_e,
        &mut readout.dsnu_row_e,
        &mut readout.dsnu_column_e,
    ] {
        *part = chance.log_or_none(1e-6, 0.03) * full_well_e;
    }
    readout.black_drift_rows = 2.0 + 60.0 * chance.share();
    (readout.rts_share, readout.rts_amplitude_e) = (chance.log_or_none(1e-4, 1.0), 0.03 * full_well_e * chance.share());
    (readout.hot_pixel_share, readout.hot_pixel_dark_current_e_per_s) =
        (chance.log_or_none(1e-4, 0.5), 1e6 * chance.share());
    readout.dcnu = 2.0 * chance.share();
    readout.temperature_k = 200.0 + 200.0 * chance.share();
    readout.bias_adu = [-200.0, 0.0, 3.0, 100.0, 1753.0, 4000.0][usize::try_from(chance.word() % 6).unwrap()];
    readout.adu_per_e = 1e-3 * 1e4_f64.powf(chance.share());
    if chance.word().is_multiple_of(4) {
        readout.taps = Some(Taps {
            layout: TapLayout::Columns,
            gain: vec![1.0, 0.8 + 0.4 * chance.share()],
            offset_e: vec![0.0, 200.0 * (chance.share() - 0.5)],
            read_noise_e: vec![readout.read_noise_e, 2.0 * readout.read_noise_e],
        });
    }
    readout
}

/// A dark frame of such a sensor, of three planes.
fn dark_frame(seed: u64) -> MemoryFrame {
    let mut chance = Chance(seed);
    let [width, height] = [(); 2].map(|()| 1 + usize::try_from(chance.word() % 40).unwrap());
    let mut dark = expected(width, height, |_, _, _| 0.0);
    dark.header.metadata.sensor.as_mut().unwrap().readout = Some(any_readout(&mut chance));
    let settings = NoiseSettings { seed, sensor_seed: seed, ..NoiseSettings::default() };
    let noisy = through(&dark, &AddNoise::new(&dark.header, &settings).unwrap());
    through(&noisy, &Digitize::new(&noisy.header, &AdcSettings::default()).unwrap())
}

/// No dark frame is below what its metadata let it be, whatever its noise, bias, gain and size; half of its codes are below it where
/// there is something to tell.
#[test]
fn no_dark_frame_is_below_the_least_mean_of_its_metadata() {
    let (mut known, mut told, mut nearest) = (0, 0, f64::INFINITY);
    for seed in 0..1600 {
        let frame = dark_frame(seed);
        let bounds = Bounds::of(&frame.header).unwrap();
        let count = frame.samples.len() as f64;
        let mean = frame.samples.iter().map(|code| f64::from(*code)).sum::<f64>() / count;
        let [low, high] = bounds.samples;
        assert!(frame.samples.iter().all(|code| (low..=high).contains(&f64::from(*code))), "{seed}");
        let Some(least) = bounds.mean else { continue };
        assert!(mean >= least, "{seed}: {mean} below {least}");
        nearest = nearest.min(mean - least);
        known += 1;
        told += u32::from(mean / 2.0 < least);
    }
    // Noise above the largest code tells nothing, nor half of a bias of 0.
    assert!(known > 800 && told > 200 && nearest >= 0.0, "{known} {told} {nearest}");
}

/// Writes a frame again with other samples under its metadata.
fn changed(shop: &Workshop, from: &str, to: &str, change: impl Fn(f32) -> f32) {
    let frame = shop.frame(from);
    let samples: Vec<f32> = frame.samples.iter().map(|sample| change(*sample)).collect();
    shop.write(to, &frame.header, &samples);
}

#[test]
fn samples_that_were_scaled_or_shifted_elsewhere_are_refused() {
    let shop = Workshop::new();
    shop.pipe("render-radiance --dark --size 64x48 --cfa rggb | add-noise | digitize -o dark.exr");
    shop.pipe("render-radiance --electrons 9000,15000,12000 --size 64x48 --cfa rggb | add-noise --frame 1 | digitize -o lit.exr");
    shop.run("correct-frame lit.exr --black auto -o corrected.exr", &[]);
    shop.run("correct-frame lit.exr --dark dark.exr -o less.exr --quiet", &[]);
    shop.run("demosaic lit.exr -o rgb.exr", &[]);
    shop.run("demosaic lit.exr --method shti -o hue.exr", &[]);
    shop.pipe("render-radiance --electrons 9000,15000,12000 --size 64x48 --cfa rggb | add-noise --frames 2..5 | digitize | average-frames -o mean.exr");
    for honest in ["dark", "lit", "corrected", "less", "rgb", "hue", "mean"] {
        shop.run(&format!("measure {honest}.exr"), &[]);
    }
    let below = "by the bias and the noise of its metadata no frame averages below";
    let beyond = "codes less what came off are";
    for (from, factor, shift, wanted) in [
        ("dark", 0.5, 0.0, below),
        ("dark", 0.0, 0.0, below),
        ("lit", 1.0, -1753.0, below),
        ("corrected", 1.0, -1753.0, below),
        ("corrected", 16.0, 0.0, beyond),
        ("less", 16.0, 0.0, beyond),
        ("mean", 16.0, 0.0, beyond),
        ("mean", 0.5, 0.0, below),
        ("rgb", 16.0, 0.0, beyond),
        ("rgb", 1.0, -1753.0, below),
        ("hue", 16.0, 0.0, beyond),
    ] {
        changed(&shop, &format!("{from}.exr"), "wrong.exr", |sample| {
            let moved = sample * factor + shift;
            if from == "lit" || from == "dark" { moved.round().max(0.0) } else { moved }
        });
        let said = shop.said("measure wrong.exr", BAD_DATA);
        assert!(said.contains(wanted), "{from} {factor} {shift}: {said}");
    }
}

#[test]
fn a_black_level_above_all_codes_is_told() {
    let shop = Workshop::new();
    shop.pipe("render-radiance --electrons 9000,15000,12000 --size 64x48 --cfa rggb | add-noise | digitize -o lit.exr");
    // A frame of another program, of which nothing is known.
    let mut header = shop.frame("lit.exr").header;
    let samples = shop.frame("lit.exr").samples;
    header.metadata = cyanometer::metadata::Metadata {
        cfa: header.metadata.cfa,
        ..cyanometer::metadata::Metadata::new(cyanometer::units::QuantityKind::Adu)
    };
    shop.write("raw.exr", &header, &samples);
    for line in ["demosaic raw.exr --black 20000 -o a.exr", "correct-frame raw.exr --black 20000 -o a.exr"] {
        let said = shop.said(line, 0);
        assert!(said.contains("far below what no light reads, 20000 ADU"), "{line}: {said}");
    }
    shop.run("demosaic raw.exr --black 1700 -o a.exr", &[]);
}

#[test]
fn darks_whose_bias_was_subtracted_are_told() {
    let shop = Workshop::new();
    shop.pipe("render-radiance --dark --size 64x48 --cfa rggb | add-noise | digitize -o dark.exr");
    shop.pipe("render-radiance --electrons 9000,15000,12000 --size 64x48 --cfa rggb | add-noise --frame 1 | digitize -o lit.exr");
    // Metadata of another program's darks say nothing of their level.
    let mut dark = shop.frame("dark.exr");
    dark.header.metadata = cyanometer::metadata::Metadata {
        cfa: dark.header.metadata.cfa,
        ..cyanometer::metadata::Metadata::new(cyanometer::units::QuantityKind::Adu)
    };
    let samples: Vec<f32> = dark.samples.iter().map(|code| code - 1753.0).collect();
    shop.write("shifted.exr", &dark.header, &samples);
    let said = shop.said("correct-frame lit.exr --dark shifted.exr -o a.exr", 0);
    assert!(said.contains("are these of another converter, or was their bias subtracted?"), "{said}");
}

/// A frame whose marks were dropped by a format, or by another program, is not taken for a complete one.
#[test]
fn saturation_that_nothing_marks_is_told_by_the_share_of_its_law() {
    let shop = Workshop::new();
    shop.run("fit-matrix sky912.exr -o m.yaml", &[]);
    shop.pipe("render-radiance --electrons 9000,15000,39000 --size 64x48 --cfa rggb --quiet | add-noise --quiet | digitize -o lit.exr --quiet");
    shop.pipe("demosaic lit.exr -o rgb.exr --quiet");
    shop.pipe("to-xyz rgb.exr --matrix m.yaml -o xyz.exr --quiet");
    for (name, whole) in [("rgb", "rgb.exr"), ("xyz", "xyz.exr")] {
        // Without the layer, and without what the sidecar counted.
        let mut frame = shop.frame(whole);
        assert!(frame.header.metadata.saturated_share.unwrap() > 1e-3);
        frame.header.metadata.samples = None;
        shop.write("bare.exr", &frame.header, &frame.samples);
        fs::remove_file(shop.path("bare.exr.yaml")).unwrap();
        let told = "% of its pixels are made of saturated samples, by the law of its scene, and nothing marks which";
        for (line, status) in [
            ("measure bare.exr", 0),
            ("measure bare.exr --check", BAD_DATA),
            ("preview bare.exr -o a.png", 0),
            ("color-difference bare.exr bare.exr", if name == "xyz" { 0 } else { BAD_DATA }),
        ] {
            let said = shop.said(line, status);
            assert!(said.contains(told), "{name}: {line}: {said}");
        }
        assert!(shop.said("measure bare.exr --check", BAD_DATA).contains("nothing can be checked"));
    }
    let mut frame = shop.frame("rgb.exr");
    frame.header.metadata.samples = None;
    shop.write("bare.tiff", &frame.header, &frame.samples);
    fs::remove_file(shop.path("bare.tiff.yaml")).unwrap();
    let said = shop.said("to-xyz bare.tiff --matrix m.yaml -o a.exr", 0);
    assert!(said.contains("by the law of its scene, and nothing marks which"), "{said}");
    // Nothing is said where next to nothing is saturated.
    shop.pipe("render-radiance --electrons 9000,15000,12000 --size 64x48 --cfa rggb | add-noise | digitize | demosaic -o dim.tiff");
    shop.run("measure dim.tiff --check", &[]);
}

/// Sensors of one name and another response, or another pitch: their signals are others.
#[test]
fn a_matrix_knows_the_response_that_it_was_fitted_for() {
    let shop = Workshop::new();
    let place = format!("{}/sample_data/sensors", support::TREE);
    for file in ["kaf-5101ce.yaml", "kaf5101ce_est_qe_1nm.csv", "bg39_1mm.csv"] {
        fs::copy(format!("{place}/{file}"), shop.path(file)).unwrap();
    }
    fs::copy(shop.path("kaf-5101ce.yaml"), shop.path("own.yaml")).unwrap();
    fs::copy(shop.path("kaf-5101ce.yaml"), shop.path("bare.yaml")).unwrap();
    fs::copy(shop.path("kaf-5101ce.yaml"), shop.path("fine.yaml")).unwrap();
    let table = fs::read_to_string(shop.path("kaf5101ce_est_qe_1nm.csv")).unwrap();
    fs::write(shop.path("kaf5101ce_est_qe_1nm.csv"), table.replace("wavelength_nm,R,G,B", "wavelength_nm,B,G,R"))
        .unwrap();
    edit(&shop, "fine.yaml", "pixel_pitch_um: 6.8 ", "pixel_pitch_um: 3.4 ");
    edit(&shop, "bare.yaml", "cover_glass: {file", "# cover_glass: {file");
    shop.run("fit-matrix sky912.exr -o m.yaml", &[]);
    let frame = |sensor: &str| {
        let scene = format!(
            "render-radiance clear_zenith.csv --sensor {sensor} --expose-to 0.5 --size 16x12 --cfa rggb --quiet"
        );
        shop.pipe(&format!("{scene} | add-noise | digitize | demosaic -o rgb.exr --quiet"));
        shop.said("to-xyz rgb.exr --matrix m.yaml -o xyz.exr", 0)
    };
    assert_eq!(frame("kaf-5101ce"), "");
    assert!(
        frame("own.yaml")
            .contains("m.yaml was fitted for another spectral response than that of the sensor kaf-5101ce")
    );
    let said = shop.said("predict-noise --electrons 1,2,3 --sensor own.yaml --matrix m.yaml", 0);
    assert!(said.contains("was fitted for another spectral response"), "{said}");
    fs::write(shop.path("kaf5101ce_est_qe_1nm.csv"), &table).unwrap();
    assert!(
        frame("bare.yaml").contains("m.yaml was fitted for another cover glass than that of the sensor kaf-5101ce")
    );
    assert!(
        frame("fine.yaml").contains("m.yaml was fitted for another pixel pitch than that of the sensor kaf-5101ce")
    );
    // A table of efficiencies that ends amid the light.
    let short: Vec<&str> = table.lines().take_while(|line| !line.starts_with("551,")).collect();
    fs::write(shop.path("kaf5101ce_est_qe_1nm.csv"), short.join("\n")).unwrap();
    let said = shop.said("render-radiance clear_zenith.csv --sensor own.yaml --size 8x6 -o a.exr", 0);
    assert!(
        said.contains("its quantum efficiency ends before it has faded, and is 0 beyond: of its largest, ")
            && said.contains("% at 550 nm"),
        "{said}"
    );
}

#[test]
fn a_pipe_among_the_frames_of_a_folder_is_not_waited_on() {
    let shop = Workshop::new();
    fs::create_dir(shop.path("frames")).unwrap();
    assert!(std::process::Command::new("mkfifo").arg(shop.path("frames/x.tiff")).status().unwrap().success());
    let said = shop.said("photon-transfer frames", BAD_DATA);
    assert!(said.contains("x.tiff: it is neither a file nor a directory, and would be waited on"), "{said}");
}

#[test]
fn tables_of_nothing_but_ends_of_lines_are_refused_at_once() {
    let shop = Workshop::new();
    for (mark, wanted) in [("\n", "it has more than 1048576 empty lines"), (",", "it has more than 1048576 columns")] {
        fs::write(shop.path("t.csv"), mark.repeat(1 << 22)).unwrap();
        let said = shop.said("render-radiance t.csv", BAD_DATA);
        assert!(said.contains(wanted), "{said}");
    }
}

#[test]
fn a_dark_signal_beyond_the_largest_code_is_what_leaves_no_white() {
    let shop = Workshop::new();
    shop.run("fit-matrix sky912.exr -o m.yaml", &[]);
    let said = shop.said("predict-noise --electrons 1,2,3 --exposure 33 --matrix m.yaml", BAD_DATA);
    assert!(said.contains("is no less than its white level") && !said.contains("a white of XYZ"), "{said}");
}

#[test]
fn too_many_open_files_are_told_as_such() {
    let shop = Workshop::new();
    shop.run("render-radiance --electrons 1,2,3 --size 8x6 -o a.exr", &[]);
    let line = format!("ulimit -n 5; exec {} a.exr -o b.exr", support::workshop::path_of("add-noise").display());
    let made = std::process::Command::new("sh").args(["-c", &line]).current_dir(shop.path("")).output().unwrap();
    let said = String::from_utf8_lossy(&made.stderr);
    assert!(
        !made.status.success() && said.contains("too many open files") && !said.contains("uncategorized"),
        "{said}"
    );
}

/// What two sources say of one thing.
#[test]
fn places_tags_comments_and_attributes_that_contradict_are_told() {
    let shop = Workshop::new();
    shop.run("fit-matrix sky912.exr -o m.yaml", &[]);
    shop.pipe("render-radiance clear_zenith.csv --expose-to 0.5 --size 32x24 --cfa rggb --quiet | add-noise | digitize | demosaic | to-xyz --matrix m.yaml -o xyz.exr --quiet");
    shop.run("measure xyz.exr", &[]);
    // Another place on the sensor.
    let mut frame = shop.frame("xyz.exr");
    frame.header.geometry.origin = [8, 4];
    shop.write("moved.exr", &frame.header, &frame.samples);
    let said = shop.said("color-difference xyz.exr moved.exr", 0);
    assert!(
        said.contains("moved.exr: it begins at column 8, row 4 of the sensor, but xyz.exr at column 0, row 0"),
        "{said}"
    );
    // Another light.
    shop.run("to-xyz xyz.exr --scene-white d65 --adapt-to d50 -o d50.exr", &[]);
    let said = shop.said("color-difference xyz.exr d50.exr", 0);
    assert!(said.contains("d50.exr: its white has x 0.3457, y 0.3585, that of xyz.exr x 0.3127, y 0.3290"), "{said}");
    shop.run("color-difference xyz.exr d50.exr --white d50", &[]);
    // A factor in a comment.
    let table = "# scale factor 1e-3\nwavelength_nm,L (W m-2 sr-1 nm-1)\n400,0.01\n700,0.01\n";
    fs::write(shop.path("t.csv"), table).unwrap();
    let said = shop.said("render-radiance t.csv --size 8x6 -o a.exr", 0);
    assert!(said.contains("its comment `scale factor 1e-3` tells of a factor, and none is applied"), "{said}");
}

/// Replaces bytes of a file by as many others.
#[track_caller]
fn patch(shop: &Workshop, file: &str, to: &str, changes: &[(&[u8], &[u8])]) {
    let mut bytes = shop.bytes(file);
    for (from, other) in changes {
        assert_eq!(from.len(), other.len());
        let at = bytes.windows(from.len()).position(|window| window == *from).unwrap();
        bytes[at..at + other.len()].copy_from_slice(other);
    }
    fs::write(shop.path(to), bytes).unwrap();
}

/// Another program's attributes: a time that is not that of our metadata, and the luminance of the white of a picture.
#[test]
fn attributes_of_files_are_heard() {
    let shop = codes();
    let [from, other] = [0.033_f32, 0.5].map(|time| [b"expTime\0float\0\x04\0\0\0", &time.to_le_bytes()[..]].concat());
    patch(&shop, "plane.exr", "timed.exr", &[(&from, &other)]);
    let said = shop.said("measure timed.exr", 0);
    assert!(
        said.contains(
            "timed.exr: its exposure time in s is 0.033, but 0.5 by the tags of the file, which do not count"
        ),
        "{said}"
    );
    shop.run("fit-matrix sky912.exr -o m.yaml", &[]);
    shop.run("demosaic plane.exr -o rgb.exr", &[]);
    shop.run("to-xyz rgb.exr --matrix m.yaml -o xyz.exr", &[]);
    let [from, other] =
        [1.0_f32, 200.0].map(|white| [b"whiteLuminance\0float\0\x04\0\0\0", &white.to_le_bytes()[..]].concat());
    let names: [(&[u8], &[u8]); 2] = [(b"chromaticities\0", b"chromaticitiez\0"), (b"cyanometer\0", b"cyanometeR\0")];
    patch(&shop, "xyz.exr", "picture.exr", &[(&from, &other), names[0], names[1]]);
    let told = "its white has 200 cd/m2 by its own attribute (whiteLuminance)";
    let said = shop.said("render-radiance picture.exr --expose-to 0.5 -v -o a.exr", 0);
    assert!(said.contains(told), "{said}");
    let said = shop.said("render-radiance picture.exr --luminance 1000 --expose-to 0.5 -o a.exr", 0);
    assert!(
        said.contains(
            "its white has 200 cd/m2 by its own attribute (whiteLuminance), and 1000 by --luminance, which counts"
        ),
        "{said}"
    );
}

/// Black levels of sites in the metadata of a DNG whose tags tell one level.
#[test]
fn black_levels_by_site_are_held_against_tags() {
    let shop = Workshop::new();
    shop.pipe("render-radiance --electrons 1000,2000,3000 --size 16x12 --cfa rggb | add-noise | digitize -o plane.dng");
    let mut bytes = shop.bytes("plane.dng");
    let key = b"black_level_adu: ";
    let first = bytes.windows(key.len()).position(|window| window == key).unwrap() + key.len();
    let last = first + bytes[first..].iter().position(|byte| *byte == b'\n').unwrap();
    let told = b"[1757,1757,60,60]";
    bytes[first..last].fill(b' ');
    bytes[first..first + told.len()].copy_from_slice(told);
    fs::write(shop.path("changed.dng"), bytes).unwrap();
    let said = shop.said("measure changed.dng", 0);
    let told = "changed.dng: its black levels in ADU are [1757.0, 1757.0, 60.0, 60.0], but [1757.30";
    assert!(said.contains(told) && said.contains("by the tags of the file, which do not count"), "{said}");
    assert!(!shop.said("measure plane.dng", 0).contains("by the tags"));
}

/// Linear sRGB and sRGB of ours are pictures whose white is as bright as they say.
#[test]
fn pictures_of_ours_tell_their_white() {
    let shop = Workshop::new();
    shop.run("fit-matrix sky912.exr -o m.yaml", &[]);
    shop.pipe(
        "render-radiance clear_zenith.csv --size 16x12 --expose-to 0.5 --cfa rggb --quiet | add-noise | digitize | demosaic | to-xyz \
         --matrix m.yaml -o xyz.exr --quiet",
    );
    for (space, name) in [("linear-srgb", "lin.exr"), ("linear-srgb", "lin.tiff"), ("srgb", "s.tiff")] {
        shop.run(&format!("to-xyz xyz.exr --space {space} --white-luminance 4000 -o {name}"), &[]);
        let said = shop.said(&format!("render-radiance {name} --expose-to 0.5 -v -o scene.exr"), 0);
        let encoding = if space == "srgb" { "srgb" } else { "linear" };
        assert!(said.contains(&format!("are taken as {encoding}, its primaries as srgb")), "{said}");
        assert!(said.contains(&format!("{name}: its white has 4000 cd/m2 by its own metadata")), "{said}");
        assert!(!said.contains("warning: "), "{said}");
        assert_eq!(shop.sidecar("scene.exr").scene.unwrap().upsampling.unwrap().white_luminance, 4000.0);
        let said = shop.said(&format!("render-radiance {name} --luminance 500 --expose-to 0.5 -o scene.exr"), 0);
        assert!(said.contains("4000 cd/m2 by its own metadata, and 500 by --luminance, which counts"), "{said}");
    }
    let attribute = [b"whiteLuminance\0float\0\x04\0\0\0", &4000.0_f32.to_le_bytes()[..]].concat();
    assert!(shop.bytes("lin.exr").windows(attribute.len()).any(|window| window == attribute));
}

/// Behind defects of a sensor with hot pixels it is said that these count: a hundredth of 800 e⁻ adds 8 e⁻² of shot noise to
/// 6.8² of reading, 0.165 of dark current and 1/12 of (1/0.12)² of rounding, a root of 1.153, and dark frames add to all alike.
#[test]
fn hot_pixels_beside_defects_are_told() {
    let shop = Workshop::new();
    let template = String::from_utf8(shop.run("cyanometer template sensor", &[])).unwrap();
    let hot = "readout:\n  hot_pixel_share: 0.01\n  hot_pixel_dark_current_e_per_s: 24242\n";
    fs::write(shop.path("plain.yaml"), &template).unwrap();
    fs::write(shop.path("hot.yaml"), template.replacen("readout:\n", hot, 1)).unwrap();
    fs::write(shop.path("list.txt"), "5,7\n").unwrap();
    let left = "were found and left out, but the standard deviations count them: they are up to 7.4 % too large";
    let listed = "if its list of defects names such, standard deviations are up to 7.4 % too large";
    for sensor in ["hot", "plain"] {
        let is_hot = sensor == "hot";
        for (name, electrons, frame) in [("codes", 400, 0), ("d1", 0, 1), ("d2", 0, 2), ("d3", 0, 3)] {
            let scene = format!("--electrons {electrons},{electrons},{electrons} --size 64x48 --sensor {sensor}.yaml");
            shop.pipe(&format!(
                "render-radiance {scene} | add-noise --frame {frame} | mosaic | digitize -o {name}.exr"
            ));
        }
        let darks = "correct-frame codes.exr --dark d1.exr --dark d2.exr --dark d3.exr";
        shop.said(&format!("{darks} --find-defects -o found.exr"), 0);
        assert_eq!(shop.said("demosaic found.exr --sigma -o rgb.exr", 0).contains(left), is_hot);
        assert!(!shop.said("demosaic found.exr -o rgb.exr", 0).contains("too large"));
        assert!(!shop.said("measure found.exr", 0).contains("too large"));
        assert_eq!(shop.said(&format!("{darks} --defects list.txt -o listed.exr"), 0).contains(listed), is_hot);
        assert_eq!(shop.said("measure listed.exr", 0).contains(listed), is_hot);
        assert_eq!(shop.said("demosaic listed.exr --sigma -o rgb.exr", 0).contains(listed), is_hot);
        shop.said(&format!("{darks} -o dark.exr"), 0);
        assert!(!shop.said("demosaic dark.exr --sigma -o rgb.exr", 0).contains("too large"));
    }
}
