//! What programs tell of frames that do not go together, of descriptions that contradict them, and of charts that are turned.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::camera::optics::Exposure;
use cyanometer::formats::chart::load_reference;
use cyanometer::frame::{Geometry, to_sample};
use cyanometer::metadata::{FrameHeader, HistoryEntry, Metadata};

use cyanometer::units::QuantityKind;
use nalgebra::{Matrix3, Vector3};
use std::fs;
use support::TREE;
use support::workshop::{BAD_DATA, BAD_USAGE, Workshop};

/// A light frame, dark frames and a bias frame, each an exposure of its own but for `same`, which has the number of the light.
fn exposed() -> Workshop {
    let shop = Workshop::new();
    shop.run("render-radiance --electrons 1000,2000,3000 --size 16x12 --cfa rggb -o scene.exr", &[]);
    shop.run("render-radiance --dark --size 16x12 --cfa rggb -o unlit.exr", &[]);
    shop.run("render-radiance --dark --exposure 2 --size 16x12 --cfa rggb -o long.exr", &[]);
    for (scene, frame, name) in [
        ("scene", 0, "light"),
        ("unlit", 0, "same"),
        ("unlit", 1, "dark"),
        ("unlit", 2, "other"),
        ("long", 3, "bias"),
        ("scene", 4, "flat"),
    ] {
        shop.pipe(&format!("add-noise {scene}.exr --seed 5 --frame {frame} | digitize -o {name}.exr"));
    }
    fs::copy(shop.path("dark.exr"), shop.path("copy.exr")).unwrap();
    fs::copy(shop.path("dark.exr.yaml"), shop.path("copy.exr.yaml")).unwrap();
    shop
}

/// The error that a matrix makes of the scene's own spectrum goes with the frames: of a matrix that is fitted to this spectrum alone
/// it is none, and of one that gives 1.1 times its Y it is 10 %.
#[test]
fn what_a_matrix_is_off_by_of_the_scene_is_told() {
    let shop = Workshop::new();
    shop.run("fit-matrix sky912.exr -o m.yaml", &[]);
    shop.pipe("render-radiance clear_zenith.csv --size 16x12 --expose-to 0.5 -o scene.exr --quiet");
    shop.pipe("digitize scene.exr --quiet | to-xyz --matrix m.yaml -o xyz.exr --quiet");
    let error = shop.sidecar("xyz.exr").color.unwrap().scene_error.unwrap();
    let scene = shop.sidecar("xyz.exr").scene.unwrap();
    let (samples, _) = shop.read("xyz.exr");
    for k in 0..3 {
        // Rounding to a code moves a channel by up to 1e-3 of it at half of full well.
        let found = f64::from(samples[16 * k]) / scene.true_xyz.unwrap()[k] - 1.0;
        assert!((found - error[k]).abs() < 2e-3, "{k}: {found} {}", error[k]);
    }
    let noisy = "add-noise | digitize | demosaic | to-xyz --matrix m.yaml | measure";
    let report = String::from_utf8(shop.pipe(&format!("mosaic scene.exr | {noisy}"))).unwrap();
    let y = format!("{:+.2} % of Y", 100.0 * error[1]);
    assert!(report.contains("of this scene's spectrum the matrix is off by") && report.contains(&y), "{report}");
    // Of a scene without a spectrum nothing but the library's is known.
    let other = format!("render-radiance --electrons 1000,2000,3000 --size 16x12 | mosaic | {noisy}");
    let report = String::from_utf8(shop.pipe(&other)).unwrap();
    assert!(report.contains("and may be by more of spectra unlike these"), "{report}");
}

#[test]
fn colors_far_above_their_white_are_told() {
    let shop = Workshop::new();
    shop.run("fit-matrix sky912.exr -o m.yaml", &[]);
    shop.pipe("render-radiance clear_zenith.csv --size 16x12 --expose-to 0.5 --quiet | digitize -o codes.exr --quiet");
    let far = shop.said("to-xyz codes.exr --matrix m.yaml --space lab --white-luminance 100 -o lab.exr", 0);
    let near = shop.said("to-xyz codes.exr --matrix m.yaml --space lab --white-luminance 5000 -o near.exr", 0);
    let told = "192 colors are more than ten times as bright as their white";
    assert_eq!((far.contains(told), near.contains("as their white")), (true, false), "{far}{near}");
}

#[test]
fn a_check_of_a_frame_without_noise_says_so() {
    let shop = Workshop::new();
    let told = |rest: &str| {
        let line = format!("render-radiance --electrons 1000,2000,3000 --size 64x48 | {rest} | measure --check");
        String::from_utf8(shop.pipe(&line)).unwrap().contains("no law of noise was tested")
    };
    assert!(told("add-noise --without dcsn,dcnu,ssn,prnu,ron"));
    assert!(!told("add-noise"));
}

#[test]
fn noise_that_stands_in_two_frames_is_told() {
    let shop = exposed();
    let correct = |rest: &str, status| shop.said(&format!("correct-frame light.exr {rest} -o out.exr"), status);
    assert_eq!(correct("--dark dark.exr --dark other.exr", 0), "");
    // What comes off a frame may come off its flats.
    assert_eq!(correct("--dark dark.exr --flat flat.exr --flat-dark dark.exr", 0), "");
    assert_eq!(
        correct("--dark dark.exr --dark copy.exr", BAD_DATA),
        "correct-frame: copy.exr: its samples are those of dark.exr, by the digests of both; copies of one exposure do not count as \
         two\n"
    );
    // Without its sidecar a copy is told by the seed and the number of its exposure.
    fs::remove_file(shop.path("copy.exr.yaml")).unwrap();
    let twice = "its noise is that of dark.exr, of seed 5 and frame 1, and does not average out; draw it with another `add-noise \
                 --frame`\n";
    for rest in ["--dark dark.exr --dark copy.exr", "--bias dark.exr --bias copy.exr"] {
        assert_eq!(correct(rest, BAD_DATA), format!("correct-frame: copy.exr: {twice}"));
    }
    assert_eq!(
        correct("--dark same.exr", 0),
        "correct-frame: warning: same.exr: its noise is in part that of light.exr, of seed 5 and frame 0, and predictions take the \
         two for independent; draw one of them with another `add-noise --frame`\n"
    );
}

#[test]
fn a_bias_that_is_exposed_for_long_is_told() {
    assert_eq!(
        exposed().said("correct-frame light.exr --bias bias.exr -o out.exr", 0),
        "correct-frame: warning: bias.exr: its exposure is 2 s, longer than that of light.exr, 0.033 s; a bias frame has next to \
         none, and its dark signal comes off too\ncorrect-frame: warning: light.exr: its mean is 1875.0 ADU, below that of what came \
         off, 2021.5 ADU; are these dark or bias frames of it?\n"
    );
}

#[test]
fn maps_that_mark_nothing_are_told() {
    let shop = exposed();
    let correct = |map: &str| shop.said(&format!("correct-frame light.exr --black auto --defects {map} -o out.exr"), 0);
    fs::write(shop.path("within.txt"), "15,11\n").unwrap();
    fs::write(shop.path("beyond.txt"), "16,11\n2000,3\n").unwrap();
    fs::write(shop.path("part.txt"), "x,y\n15,11\n2000,3\n").unwrap();
    assert!(
        correct("part.txt").contains("part.txt: it lists 2 photosites, 1 of them outside light.exr, whose 16x12 begin")
    );
    assert!(correct("within.txt").starts_with("correct-frame: warning: 1 defective photosite was interpolated"));
    assert_eq!(
        correct("beyond.txt"),
        "correct-frame: warning: beyond.txt: no photosite that it lists is in light.exr, whose 16x12 begin at column 0, row 0 of \
         the sensor\n"
    );
    let zero = FrameHeader {
        name: "zero".into(),
        geometry: Geometry::new(16, 12, &["Y"]),
        metadata: Metadata::new(QuantityKind::Unspecified),
    };
    shop.write("zero.exr", &zero, &[0.0; 16 * 12]);
    let warning = "correct-frame: warning: zero.exr: it is 0 everywhere, and marks no photosite as defective\n";
    assert_eq!(correct("zero.exr"), warning);
}

#[test]
fn a_black_level_that_is_not_that_of_the_metadata_is_told() {
    let shop = exposed();
    for line in ["correct-frame light.exr -o out.exr", "demosaic light.exr -o out.exr"] {
        let program = line.split(' ').next().unwrap();
        assert_eq!(shop.said(&format!("{line} --black 1757"), 0), "", "a level may be rounded");
        let warning = shop.said(&format!("{line} --black 1700"), 0);
        let begin =
            format!("{program}: warning: light.exr: --black 1700 is not the black level of its metadata, 1757.30");
        assert!(
            warning.starts_with(&begin)
                && warning.ends_with(", which --black auto takes; what is left of that counts as black further on\n"),
            "{warning}"
        );
    }
}

/// Frames without metadata: the array and the white level that are said of one hold for those beside it too, and advice names
/// options that there are.
#[test]
fn frames_beside_a_plain_one_are_as_it_is_described() {
    let shop = Workshop::new();
    for (name, level) in [("light", 900_u16), ("dark", 100), ("flat", 700)] {
        let codes: Vec<u8> = (0..48_u16).flat_map(|k| (level + k % 3).to_le_bytes()).collect();
        fs::write(shop.path(&format!("{name}.raw")), codes).unwrap();
    }
    let correct = |rest: &str, status| {
        shop.said(&format!("correct-frame light.raw --raw 8x6:u16le --cfa rggb --white 4095 {rest} -o out.exr"), status)
    };
    // That no metadata tell what they are is no doubt of them.
    let on_trust = "dark.raw: the metadata do not tell whether it is a dark frame of the sensor that took light.raw\n";
    assert_eq!(correct("--dark dark.raw", 0), "");
    assert!(correct("--dark dark.raw -v", 0).contains(on_trust));
    assert!(!correct("--bias dark.raw --flat flat.raw", 0).contains(on_trust));
    assert_eq!(
        correct("--dark dark.raw --flat flat.raw", BAD_DATA),
        "correct-frame: flat.raw: nothing tells what no light reads in it; give --flat-dark or --bias\n"
    );
    assert_eq!(
        correct("--dark dark.raw --scale-dark --exposure 1 --f-number 8", BAD_DATA),
        "correct-frame: dark.raw: nothing tells its exposure time; write `exposure_time_s` into dark.raw.yaml, as --metadata-template shows\n"
    );
}

#[test]
fn relative_xyz_have_no_bright_white() {
    let shop = Workshop::new();
    shop.write_colors("xyz.exr", QuantityKind::Xyz, &[[0.2, 0.3, 0.4]]);
    let text = "schema: cyanometer/1\nquantity: xyz\nunit: relative\n";
    fs::write(shop.path("relative.yaml"), text).unwrap();
    let line = "to-xyz xyz.exr --metadata relative.yaml --space lab -o out.exr --white";
    assert_eq!(shop.said(&format!("{line} 0.95,1,1.09"), 0), "");
    let warning = shop.said(&format!("{line} 95,100,109"), 0);
    assert!(warning.starts_with("to-xyz: warning: the white has Y = 100, but XYZ are relative"), "{warning}");
    // Absolute XYZ have none that is next to black.
    shop.write_colors("absolute.exr", QuantityKind::Xyz, &[[2000.0, 3000.0, 4000.0]]);
    let line = "to-xyz absolute.exr --space lab -o out.exr --white";
    assert_eq!(shop.said(&format!("{line} 9500,10000,10900"), 0), "");
    let warning = shop.said(&format!("{line} 0.95,1,1.09"), 0);
    assert!(warning.starts_with("to-xyz: warning: the white has Y = 1, but XYZ are absolute"), "{warning}");
    fs::copy(shop.path("relative.yaml"), shop.path("xyz.exr.yaml")).unwrap();
    let warning = shop.said("color-difference xyz.exr 0.2,0.3,0.5 --white 95,100,109", 0);
    assert!(warning.starts_with("color-difference: warning: the white has Y = 100, but XYZ are relative"), "{warning}");
}

/// Marks of all kinds are counted, each by itself.
#[test]
fn marks_are_told_by_kind() {
    let shop = Workshop::new();
    let mut metadata = Metadata::new(QuantityKind::Adu);
    metadata.history.push(HistoryEntry { program: "test".into(), version: "1".into(), arguments: Vec::new() });
    let geometry = Geometry::new(6, 1, &["Y", "mask"]);
    let header = FrameHeader { name: "marked".into(), geometry, metadata };
    shop.write("marked.exr", &header, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 0.0, 1.0, 2.0, 6.0, 9.0, 8.0]);
    let begin = "preview: warning: marked.exr: ";
    let expected = [
        "2 of the pixels read were made of saturated samples",
        "2 of the pixels read are, or used, defective photosites",
        "2 of the pixels read are beyond the model of a correction",
    ]
    .map(|text| format!("{begin}{text}; they are taken as they are\n"));
    assert_eq!(shop.said("preview marked.exr -o out.png", 0), expected.concat());
}

/// A chart of 24 patches as a camera with this matrix reads it, with some scatter.
fn chart(shop: &Workshop) {
    chart_told(shop, 100.0, f64::INFINITY);
}

/// The same with a black level that metadata tell, and cut off at a level; no light reads 100 ADU, and a perfect diffuser some 2000 above.
fn chart_told(shop: &Workshop, black: f64, cut: f64) {
    const SIDE: usize = 40;
    let white = [0.9642, 1.0, 0.8249];
    let colors = load_reference("colorchecker").unwrap().colors_in(white).unwrap();
    let xyz_from_camera = Matrix3::new(0.9, 0.1, 0.2, 0.3, 0.7, -0.1, 0.0, -0.2, 1.1);
    let camera_from_xyz = xyz_from_camera.try_inverse().unwrap();
    let mut metadata = Metadata::new(QuantityKind::Adu);
    metadata.cfa = Some("rggb".parse().unwrap());
    metadata.black_level_adu = Some(black.into());
    metadata.white_level_adu = Some(4100.0.into());
    let geometry = Geometry::new(6 * SIDE, 4 * SIDE, &["Y"]);
    let header = FrameHeader { name: "chart".into(), geometry, metadata };
    let (mut samples, mut state) = (Vec::new(), 1_u64);
    // Words of SplitMix64, as shares of 1.
    let mut chance = || {
        state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (state ^ (state >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (mixed ^ (mixed >> 31)) as f64 / u64::MAX as f64
    };
    for y in 0..4 * SIDE {
        for x in 0..6 * SIDE {
            let signal = camera_from_xyz * Vector3::from(colors[y / SIDE * 6 + x / SIDE]);
            let class = [0, 1, 1, 2][y % 2 * 2 + x % 2];
            samples.push(to_sample((100.0 + 2000.0 * signal[class] + 4.0 * chance() - 2.0).min(cut)));
        }
    }
    shop.write("chart.exr", &header, &samples);
}

/// Dark frames of a camera are brought to the temperature that the file of the frame tells, by [HP2005, Eq. 6] in electronvolts.
#[test]
fn temperatures_of_a_camera_count() {
    let shop = Workshop::new();
    let frame = |name: &str, temperature_k: f64, sample: f32| {
        let mut metadata = Metadata::new(QuantityKind::Adu);
        metadata.cfa = Some("rggb".parse().unwrap());
        metadata.black_level_adu = Some(100.0.into());
        metadata.white_level_adu = Some(4095.0.into());
        metadata.exposure = Some(Exposure { exposure_s: 1.0, f_number: 8.0, lens_transmittance: 1.0 });
        metadata.sensor_temperature_k = Some(temperature_k);
        let header = FrameHeader { name: name.into(), geometry: Geometry::new(4, 4, &["Y"]), metadata };
        shop.write(name, &header, &[sample; 16]);
    };
    frame("light.exr", 263.15, 1100.0);
    frame("dark.exr", 268.15, 300.0);
    assert!(
        shop.said("correct-frame light.exr --dark dark.exr -o c.exr", 0)
            .contains("dark.exr: its temperature is 268.15 K, but that of light.exr is 263.15 K")
    );
    shop.run("correct-frame light.exr --dark dark.exr --scale-dark --quiet -o c.exr", &[]);
    let current = |kelvin: f64| {
        let gap = 1.1557 - 7.021e-4 * kelvin * kelvin / (1108.0 + kelvin);
        kelvin.powf(1.5) * (-gap / (2.0 * 8.617_333e-5 * kelvin)).exp()
    };
    let expected = 1000.0 - 200.0 * current(263.15) / current(268.15);
    let (samples, metadata) = shop.read("c.exr");
    assert!((f64::from(samples[0]) - expected).abs() < 1e-3 * expected, "{} {expected}", samples[0]);
    assert_eq!(metadata.sensor_temperature_k, Some(263.15));
}

/// Frames that say nothing are described where they are averaged, stacked, or read as a chart.
#[test]
fn bare_frames_are_described() {
    let shop = Workshop::new();
    chart(&shop);
    let corners = "--corners 20,20,220,20,220,140,20,140";
    shop.run(&format!("fit-matrix --chart chart.exr {corners} -o m.yaml"), &[]);
    fs::write(shop.path("bare.yaml"), "schema: cyanometer/1\nquantity: unspecified\n").unwrap();
    let bare = format!("fit-matrix --chart chart.exr --metadata bare.yaml {corners} -o bare-m.yaml");
    let missing =
        |key: &str, supply: &str| format!("fit-matrix: chart.exr: the metadata has no `{key}`; give {supply}\n");
    assert_eq!(shop.said(&bare, BAD_DATA), missing("cfa", "--cfa PATTERN"));
    assert_eq!(shop.said(&format!("{bare} --cfa rggb"), BAD_DATA), missing("black_level_adu", "--levels"));
    shop.run(&format!("{bare} --cfa rggb --levels 100,4100"), &[]);
    let elements = |name: &str| {
        let text = String::from_utf8(shop.bytes(name)).unwrap();
        text.split("xyz_from_camera:").nth(1).unwrap().lines().take(10).collect::<Vec<_>>().join(" ")
    };
    assert_eq!(elements("bare-m.yaml"), elements("m.yaml"));
    // Corners are counted from the first sample of what is read; photosites keep their class.
    let part = "--crop 3,1,237,159 --corners 17,19,217,19,217,139,17,139";
    shop.run(&format!("fit-matrix --chart chart.exr {part} -o part-m.yaml"), &[]);
    assert_eq!(elements("part-m.yaml"), elements("m.yaml"));
    for option in ["--crop 0,0,1,1", "--channel G", "--cfa rggb", "--part 1", "--metadata bare.yaml"] {
        let name = option.split(' ').next().unwrap();
        assert_eq!(
            shop.said(&format!("fit-matrix SAMPLES/skies/sky912.exr {option} -o x.yaml"), BAD_USAGE),
            format!(
                "fit-matrix: no frame of a chart is named, --chart FRAME, which alone is described so; leave out {name}\n"
            )
        );
    }

    let header = FrameHeader {
        name: "bare".into(),
        geometry: Geometry::new(2, 2, &["Y"]),
        metadata: Metadata::new(QuantityKind::Unspecified),
    };
    shop.write("a.exr", &header, &[70.0, 80.0, 90.0, 100.0]);
    shop.write("b.exr", &header, &[72.0, 82.0, 92.0, 102.0]);
    let described = "--cfa rggb --black 64 --white 4095 --exposure 0.5 --f-number 8";
    shop.run(&format!("average-frames a.exr b.exr {described} -o mean.exr"), &[]);
    shop.run(&format!("stack-frames a.exr b.exr {described} -o both.zarr"), &[]);
    shop.run("stack-frames both.zarr --frames 1..2 -o second.exr", &[]);
    for (name, first) in [("mean.exr", 71.0), ("second.exr", 72.0)] {
        let (samples, metadata) = shop.read(name);
        assert_eq!((samples[0], metadata.quantity), (first, QuantityKind::Adu), "{name}");
        assert_eq!(metadata.cfa.map(|cfa| cfa.to_string()).as_deref(), Some("rggb"), "{name}");
        assert_eq!((metadata.black_level_adu, metadata.white_level_adu), (Some(64.0.into()), Some(4095.0.into())));
        assert_eq!(metadata.exposure.map(|exposure| exposure.exposure_s), Some(0.5), "{name}");
    }
    let three = "mosaic three.exr --pattern rggb --white 4095 -o x.dng";
    let planes = FrameHeader { geometry: Geometry::new(2, 2, &["R", "G", "B"]), ..header };
    shop.write("three.exr", &planes, &[70.0; 12]);
    assert_eq!(
        shop.said(three, BAD_DATA),
        "mosaic: three.exr: the metadata has no `black_level_adu`; give --black N, 0 where it is off already\n"
    );
    let colorless = shop.said(&format!("{three} --black 64"), 0);
    assert!(colorless.starts_with("mosaic: warning: the DNG has no colors"), "{colorless}");
    assert_eq!(colorless.lines().count(), 1);
}

#[test]
fn a_chart_that_is_turned_is_told() {
    let shop = Workshop::new();
    chart(&shop);
    let corners = ["20,20", "220,20", "220,140", "20,140"];
    let from = |first: usize| (0..4).map(|k| corners[(first + k) % 4]).collect::<Vec<_>>().join(",");
    shop.run(&format!("fit-matrix --chart chart.exr --corners {} -o m.yaml", from(0)), &[]);
    for first in 1..4 {
        let complaint = shop.said(&format!("fit-matrix --chart chart.exr --corners {}", from(first)), BAD_USAGE);
        let begin = "fit-matrix: chart.exr: --corners begin at another patch than dark skin: turned, the chart fits its colors ";
        let end = format!(" times better; give --corners {}\n", from(0));
        assert!(complaint.starts_with(begin) && complaint.ends_with(&end), "{complaint}");
    }
    // Absolute XYZ take an exposure, which metadata can supply.
    let absolute = format!("fit-matrix --chart chart.exr --luminance 100 -o m.yaml --corners {}", from(0));
    assert_eq!(
        shop.said(&absolute, BAD_DATA),
        "fit-matrix: chart.exr: the metadata has no `exposure`; give --exposure S and --f-number N\n"
    );
    let text = "schema: cyanometer/1\nquantity: adu\ncfa: rggb\nblack_level_adu: 100\nwhite_level_adu: 4100\nexposure: {exposure_s: \
                0.01, f_number: 8, lens_transmittance: 1}\n";
    fs::write(shop.path("chart.yaml"), text).unwrap();
    shop.run(&format!("{absolute} --metadata chart.yaml"), &[]);
    let by_metadata = shop.bytes("m.yaml");
    // As in other programs.
    shop.run(&format!("{absolute} --exposure 0.01 --f-number 8"), &[]);
    assert_eq!(shop.bytes("m.yaml"), by_metadata);
    assert_eq!(
        shop.said(&format!("{absolute} --exposure 0.01"), BAD_USAGE),
        "fit-matrix: chart.exr: an exposure is a time and an f-number, and one is not known; give --f-number\n"
    );
    assert_eq!(
        shop.said(&format!("{absolute} --metadata chart.yaml --exposure 0.02"), BAD_USAGE),
        "fit-matrix: chart.exr: the exposure time in s is 0.01 by its metadata, which --metadata FILE can replace; leave out \
         --exposure\n"
    );
    let table = "fit-matrix --patches none.csv --lens-transmittance 0.9";
    assert!(shop.said(table, BAD_USAGE).ends_with("which alone is described so; leave out --lens-transmittance\n"));
}

/// Neutral patches tell a black level that is off by 2 % of white, and none that is off by a quarter of a per cent; what is cut off below the
/// white level; corners that are a third of a patch off, along rows and along columns.
#[test]
fn a_chart_tells_its_levels_and_corners() {
    let shop = Workshop::new();
    let at = |[x, y]: [i32; 2]| {
        let corners = [[20, 20], [220, 20], [220, 140], [20, 140]];
        let corners = corners.map(|[left, top]| format!("{},{}", left + x, top + y)).join(",");
        shop.said(&format!("fit-matrix --chart chart.exr --corners {corners} -o m.yaml"), 0)
    };
    let neutral = "its neutral patches are not in proportion to their luminance: where no light is they would read R ";
    for (black, wanted) in [(95.0, None), (105.0, None), (60.0, Some("40 ± ")), (140.0, Some("-40 ± "))] {
        chart_told(&shop, black, f64::INFINITY);
        let told = at([0, 0]);
        match wanted {
            None => assert_eq!(told, "", "{black}"),
            Some(offset) => {
                assert!(told.contains(&format!("{neutral}{offset}")), "{black}: {told}");
                let side = if black < 100.0 { "too low by as much, or stray light" } else { "too high by as much" };
                assert!(told.contains(side), "{told}");
            }
        }
    }
    chart_told(&shop, 100.0, 1800.0);
    let told = at([0, 0]);
    let cut = "G of white scatter less than dimmer patches do and lie at 1800 ADU or below: they are cut off below the white level";
    assert!(told.contains(cut) && !told.contains(neutral), "{told}");
    chart(&shop);
    let edges = "patches scatter as those do across which an edge runs: the corners are off";
    for off in [[13, 0], [0, 13], [-13, 0], [13, 13]] {
        let told = at(off);
        assert!(told.contains(edges), "{off:?}: {told}");
    }
    for off in [[3, 0], [0, -3]] {
        assert_eq!(at(off), "", "{off:?}");
    }
}

/// Writes a table of three columns of named patches.
fn table(shop: &Workshop, name: &str, columns: &str, rows: &[(String, Vector3<f64>)]) {
    let row = |(name, [a, b, c]): &(String, [f64; 3])| format!("{name},{a},{b},{c}\n");
    let rows = rows.iter().map(|(name, values)| row(&(name.clone(), (*values).into())));
    fs::write(shop.path(name), format!("name,{columns}\n{}", rows.collect::<String>())).unwrap();
}

/// The patches of a ColorChecker under D50, and what a camera reads of them.
fn colors_and_signals() -> [Vec<(String, Vector3<f64>)>; 2] {
    let reference = load_reference("colorchecker").unwrap();
    let colors = reference.colors_in([0.9642, 1.0, 0.8249]).unwrap();
    let named = |of: &dyn Fn(Vector3<f64>) -> Vector3<f64>| {
        reference.names.iter().cloned().zip(colors.iter().map(|xyz| of(Vector3::from(*xyz)))).collect()
    };
    let camera_from_xyz = Matrix3::new(1.5, 0.25, 0.08, 0.58, 1.42, -0.33, 0.03, -0.25, 2.33).try_inverse().unwrap();
    [named(&|xyz| xyz), named(&|xyz| camera_from_xyz * xyz)]
}

/// Colors whose neutral patches are those of another light are told, with the name of the light where it has one, and their neutral patches
/// tell a black level all the same.
#[test]
fn a_reference_for_another_light_is_told() {
    let shop = Workshop::new();
    let [colors, signals] = colors_and_signals();
    table(&shop, "signals.csv", "R,G,B", &signals);
    let above: Vec<_> = signals.iter().map(|(name, signal)| (name.clone(), signal.add_scalar(0.02))).collect();
    table(&shop, "above.csv", "R,G,B", &above);
    // White by white, as von Kries has it: neutral patches go where the white goes.
    for (name, white) in [("d50", [0.9642, 0.8249]), ("d65", [0.9505, 1.0889]), ("c", [0.9807, 1.1823])] {
        let gains = Vector3::new(white[0] / 0.9642, 1.0, white[1] / 0.8249);
        let rows: Vec<_> = colors.iter().map(|(name, xyz)| (name.clone(), xyz.component_mul(&gains))).collect();
        table(&shop, &format!("{name}.csv"), "X,Y,Z", &rows);
    }
    let said = |patches: &str, more: &str| {
        shop.said(&format!("fit-matrix --patches {patches}.csv --reference {more} -o m.yaml"), 0)
    };
    for honest in ["d50.csv", "d65.csv --reference-light d65", "c.csv --reference-light 0.3101,0.3162"] {
        assert_eq!(said("signals", honest), "", "{honest}");
    }
    let told = said("signals", "d65.csv");
    assert!(told.starts_with("fit-matrix: warning: d65.csv: its neutral patches lie at x 0.31"), "{told}");
    let end = ", as in d65, not in d50, which its colors are taken to be for: give --reference-light d65\n";
    assert!(told.ends_with(end) && told.lines().count() == 1, "{told}");
    assert!(said("signals", "d50.csv --reference-light d65").contains("as in d50, not in d65"));
    assert!(said("signals", "c.csv").contains("give the light that they are for, --reference-light 0.31"));
    for light in ["d50.csv", "d65.csv"] {
        assert!(
            said("above", light).contains("its neutral patches are not in proportion to their luminance"),
            "{light}"
        );
    }
}

/// Red and blue that are exchanged, by columns of a table or by the pattern of a frame, fit as well; the matrix tells. Patterns whose greens are
/// red and blue are refused, and so is a table whose classes differ by noise alone.
#[test]
fn classes_that_are_exchanged_are_told() {
    let shop = Workshop::new();
    let [_, signals] = colors_and_signals();
    let exchanged: Vec<_> =
        signals.iter().map(|(name, signal)| (name.clone(), Vector3::new(signal[2], signal[1], signal[0]))).collect();
    table(&shop, "bgr.csv", "R,G,B", &exchanged);
    let told = shop.said("fit-matrix --patches bgr.csv -o m.yaml", 0);
    let begin = "fit-matrix: warning: bgr.csv: by the matrix the mean wavelengths of R, G and B are 4";
    let end = " nm, which is not the order of their names; check the columns R, G and B\n";
    assert!(told.starts_with(begin) && told.ends_with(end), "{told}");
    chart(&shop);
    let metadata = "schema: cyanometer/1\nquantity: adu\nblack_level_adu: 100\nwhite_level_adu: 4100\n";
    fs::write(shop.path("bare.yaml"), metadata).unwrap();
    let fit = "fit-matrix --chart chart.exr --metadata bare.yaml --corners 20,20,220,20,220,140,20,140 -o m.yaml --cfa";
    assert_eq!(shop.said(&format!("{fit} rggb"), 0), "");
    let told = shop.said(&format!("{fit} bggr"), 0);
    assert!(
        told.ends_with("which is not the order of their names; check the pattern of the filters, --cfa\n"),
        "{told}"
    );
    fs::remove_file(shop.path("m.yaml")).unwrap();
    for pattern in ["grbg", "gbrg"] {
        let told = shop.said(&format!("{fit} {pattern}"), BAD_DATA);
        let begin =
            format!("fit-matrix: chart.exr: of the patches of the chart the two greens of {pattern} differ by ");
        assert!(told.starts_with(&begin) && told.ends_with(": is the pattern rggb or bggr?\n"), "{told}");
    }
    let rows = signals.iter().enumerate().map(|(index, (name, signal))| {
        let noise = 1e-4 * [1.0, -1.0, 0.5][index % 3];
        format!("{name},{},{},{},1e-4,1e-4,1e-4\n", signal[0] + noise, signal[1], signal[0] - noise)
    });
    let text = format!("name,R,G,B,std_R,std_G,std_B\n{}", rows.collect::<String>());
    fs::write(shop.path("two.csv"), text).unwrap();
    assert!(shop.said("fit-matrix --patches two.csv -o m.yaml", BAD_DATA).contains("do not determine the matrix"));
    assert!(!shop.path("m.yaml").exists());
}

/// Names that are exchanged are told with what they would be off by; a patch that is dirty with how far it is off.
#[test]
fn patches_that_lie_far_from_the_fit_are_named() {
    let shop = Workshop::new();
    let [_, signals] = colors_and_signals();
    let said = |rows: &[(String, Vector3<f64>)]| {
        table(&shop, "signals.csv", "R,G,B", rows);
        shop.said("fit-matrix --patches signals.csv -o m.yaml", 0)
    };
    assert_eq!(said(&signals), "");
    let mut exchanged = signals.clone();
    (exchanged[3].0, exchanged[13].0) = (signals[13].0.clone(), signals[3].0.clone());
    let told = said(&exchanged);
    assert!(told.starts_with("fit-matrix: warning: signals.csv: "), "{told}");
    assert!(
        ["foliage ", "green ", "off: are their names exchanged?\n"].iter().all(|words| told.contains(words)),
        "{told}"
    );
    let mut dirty = signals.clone();
    dirty[9].1 *= 0.3;
    let told = said(&dirty);
    assert!(told.contains("far off are purple ") && told.lines().count() == 1, "{told}");
}

/// A matrix keeps what it was fitted to: sensitivity, for absolute XYZ, and the range between black and white.
#[test]
fn codes_unlike_those_of_the_chart_are_told() {
    let shop = Workshop::new();
    chart(&shop);
    for (name, iso, white) in [("same", 100, 4100), ("fast", 800, 4100), ("wide", 100, 16_100)] {
        let text = format!(
            "schema: cyanometer/1\nquantity: adu\ncfa: rggb\nblack_level_adu: 100\nwhite_level_adu: {white}\niso_speed: \
             {iso}\nexposure: {{exposure_s: 0.01, f_number: 8, lens_transmittance: 1}}\n"
        );
        fs::write(shop.path(&format!("{name}.yaml")), text).unwrap();
        shop.run(&format!("demosaic chart.exr --metadata {name}.yaml -o {name}.exr"), &[]);
    }
    let fit = "fit-matrix --chart chart.exr --metadata same.yaml --corners 20,20,220,20,220,140,20,140";
    shop.run(&format!("{fit} -o relative.yaml"), &[]);
    shop.run(&format!("{fit} --luminance 100 -o absolute.yaml"), &[]);
    let told = |frame: &str, matrix: &str| {
        let said = shop.said(&format!("to-xyz {frame}.exr --matrix {matrix}.yaml -o {frame}-{matrix}.exr"), 0);
        let begin = format!("to-xyz: warning: {frame}.exr: {matrix}.yaml was fitted ");
        said.strip_prefix(&begin).map_or_else(|| said.clone(), str::to_owned)
    };
    assert_eq!([told("same", "relative"), told("same", "absolute"), told("fast", "relative")], [""; 3]);
    assert_eq!(
        told("fast", "absolute"),
        "at ISO 100, and the frame has ISO 800: XYZ come out 8.0000 times what they are, as far as codes go with it\n"
    );
    let ranges = "to codes with 4000 ADU from black to white, and the codes have 16000";
    assert_eq!(
        told("wide", "relative"),
        format!(
            "{ranges}, by which they are divided: XYZ come out 0.2500 times what they are, unless codes go with that range\n"
        )
    );
    assert_eq!(
        told("wide", "absolute"),
        format!("{ranges}: XYZ come out 4.0000 times what they are if codes go with that range\n")
    );
    // The codes are the same.
    let [same, wide] = ["same-relative.exr", "wide-relative.exr"].map(|name| shop.read(name).0);
    assert!(same.iter().zip(&wide).all(|(same, wide)| (0.25 * same - wide).abs() <= 1e-6 * same.abs()));
    // Files that say nothing of it, such as those of older versions, are read.
    for (frame, matrix) in [("fast", "absolute"), ("wide", "relative"), ("wide", "absolute")] {
        let text = String::from_utf8(shop.bytes(&format!("{matrix}.yaml"))).unwrap();
        let is_kept = |line: &&str| !line.starts_with("iso_speed:") && !line.starts_with("range_adu:");
        let less: Vec<&str> = text.lines().filter(is_kept).collect();
        assert_eq!(text.lines().count() - less.len(), if matrix == "absolute" { 2 } else { 1 });
        fs::write(shop.path("old.yaml"), less.join("\n") + "\n").unwrap();
        assert_eq!(told(frame, "old"), "");
    }
}

/// Means of patches in ADU have the range that they are made shares of, shares have none; and a camera that is predicted has that of its
/// converter.
#[test]
fn ranges_of_means_of_patches_are_kept() {
    let shop = Workshop::new();
    let white = [0.9642, 1.0, 0.8249];
    let colors = load_reference("colorchecker").unwrap().colors_in(white).unwrap();
    for (name, black, range) in [("adu", 100.0, 4000.0), ("shares", 0.0, 1.0)] {
        let row = |[x, y, z]: &[f64; 3]| {
            let adu = [x + 0.1 * y, *y, z + 0.1 * y].map(|share| (black + range * 0.7 * share).to_string());
            adu.join(",") + "\n"
        };
        let rows: String = colors.iter().map(row).collect();
        fs::write(shop.path(&format!("{name}.csv")), format!("R,G,B\n{rows}")).unwrap();
    }
    shop.run("fit-matrix --patches adu.csv --levels 100,4100 -o adu.yaml", &[]);
    shop.run("fit-matrix --patches shares.csv -o shares.yaml", &[]);
    let kept = |name: &str| String::from_utf8(shop.bytes(name)).unwrap().contains("\nrange_adu: 4000.0\n");
    assert_eq!([kept("adu.yaml"), kept("shares.yaml")], [true, false]);
    let predict = "predict-noise --electrons 900,900,900 --output-format json --matrix";
    assert_eq!(shop.said(&format!("{predict} shares.yaml"), 0), "");
    let said = shop.said(&format!("{predict} adu.yaml"), 0);
    assert!(
        said.contains("adu.yaml was fitted to codes with 4000 ADU from black to white, and the codes have 2342"),
        "{said}"
    );
}

#[test]
fn a_matrix_of_another_camera_is_told() {
    let shop = Workshop::with_frames();
    let matrix = "schema: cyanometer-matrix/1\nsensor: Maker A1\nunit: relative XYZ per (white level - black level)\nxyz_from_camera: \
                  [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n";
    fs::write(shop.path("a1.yaml"), matrix).unwrap();
    let of_camera = |camera: &str| {
        let text = format!(
            "schema: cyanometer/1\nquantity: adu\nblack_level_adu: 0\nwhite_level_adu: 4095\ndemosaic: {{method: bi, cfa: rggb, black: \
             100}}\ncamera: {camera}\n"
        );
        fs::write(shop.path("rgb.yaml"), text).unwrap();
        shop.said("to-xyz rgb.exr --metadata rgb.yaml --matrix a1.yaml -o out.exr", 0)
    };
    assert_eq!(of_camera("MAKER A1"), "");
    assert_eq!(
        of_camera("Maker B2"),
        "to-xyz: warning: a1.yaml was fitted for the sensor Maker A1, but the frame comes from Maker B2\n"
    );
}

#[test]
fn pictures_that_are_no_raws_and_no_scenes_are_told() {
    let shop = Workshop::new();
    fs::write(shop.path("a.jpg"), [[0xFF, 0xD8, 0xFF, 0xE0].as_slice(), &[0; 600]].concat()).unwrap();
    fs::copy(shop.path("a.jpg"), shop.path("b.jpg")).unwrap();
    let complaint = shop.said("import-raw a.jpg b.jpg -o {stem}.exr", BAD_DATA);
    let lines: Vec<&str> = complaint.lines().collect();
    assert!(lines[0].contains("for measurements give the camera's raw file"), "{complaint}");
    assert_eq!(lines[2], "import-raw: 2 of 2 inputs failed");
    let gray = FrameHeader {
        name: "gray".into(),
        geometry: Geometry::new(2, 2, &["Y"]),
        metadata: Metadata::new(QuantityKind::Unspecified),
    };
    shop.write("gray.exr", &gray, &[0.5; 4]);
    let complaint = shop.said("render-radiance gray.exr -o out.exr", BAD_DATA);
    assert!(complaint.contains("of a gray picture store the plane three times, as R, G and B"), "{complaint}");
}

#[test]
fn a_sensor_has_one_linearization() {
    let shop = Workshop::new();
    let sensor = "schema: cyanometer-sensor/2\nname: two-curves\nreadout: {width: 8, height: 8, full_well_e: 30000, \
                  dark_current_e_per_s: 0.5, temperature_k: 293, dcnu: 0.1, prnu: 0.006, read_noise_e: 3, bits: 14, bias_adu: 512, \
                  adu_per_e: 0.4, linearization: {polynomial: [1.0], codes: [0, 1], linear: [0, 1]}}\n";
    fs::write(shop.path("s.yaml"), sensor).unwrap();
    let complaint = shop.said("render-radiance --dark --size 2x2 --sensor s.yaml -o out.exr", BAD_DATA);
    assert!(
        complaint.contains("a linearization is `polynomial`, or `codes` and `linear`, but not both"),
        "{complaint}"
    );
}

#[test]
fn descriptions_that_a_sensor_contradicts_are_told() {
    let shop = exposed();
    let bytes: Vec<u8> = (0..16 * 12_u16).flat_map(|i| (1800 + i).to_le_bytes()).collect();
    fs::write(shop.path("plain.raw"), bytes).unwrap();
    let demosaic = |rest: &str, status| {
        let line = format!("demosaic plain.raw --raw 16x12:u16le --sensor kaf-5101ce {rest} -o rgb.exr");
        shop.said(&line, status)
    };
    assert_eq!(demosaic("--black 1753 --cfa rggb --white 4095", 0), "");
    assert_eq!(
        demosaic("--black 1753 --cfa bggr --white 16383", 0),
        "demosaic: warning: plain.raw: it has a Bayer filter array, bggr, and sensor kaf-5101ce has a Bayer filter array, rggb\n\
         demosaic: warning: plain.raw: its white level, 16383 ADU, is beyond the last code of sensor kaf-5101ce, 4095\n"
    );
    let schema = "schema: cyanometer/1\nquantity: adu\n";
    for (key, meant) in [("white_levl_adu: 4095", "white_level_adu"), ("CFA: rggb", "cfa"), ("exposur: 1", "exposure")]
    {
        fs::write(shop.path("own.yaml"), format!("{schema}{key}\n")).unwrap();
        let written = key.split(':').next().unwrap();
        assert_eq!(
            demosaic("--metadata own.yaml", BAD_DATA),
            format!("demosaic: own.yaml: unknown key `{written}`; did you mean `{meant}`?\n")
        );
    }
    // What looks like none of ours is kept.
    fs::write(shop.path("own.yaml"), format!("{schema}observer: nobody\ncfa: rggb\nblack_level_adu: 1753\n")).unwrap();
    assert_eq!(demosaic("--metadata own.yaml", 0), "");
}

/// A TIFF has no layer of marks; its sidecar knows how many there would be.
#[test]
fn saturated_pixels_that_nothing_marks_are_told() {
    let shop = Workshop::with_frames();
    let bright = "render-radiance --electrons 3000,5000,90000 --size 8x6 --cfa rggb -o bright.exr";
    for line in [
        bright,
        "add-noise bright.exr -o noisy.exr",
        "digitize noisy.exr -o plane.exr",
        "demosaic plane.exr -o rgb.exr",
    ] {
        assert!(shop.attempt(&format!("{line} --quiet"), &[]).status.success(), "{line}");
    }
    for (file, is_told) in [("xyz.tiff", true), ("xyz.exr", false)] {
        let line = format!("to-xyz rgb.exr --matrix matrix.yaml --quiet -o {file}");
        assert!(shop.attempt(&line, &[]).status.success());
        let heard = shop.said(&format!("measure {file}"), 0);
        let told = "48 of its pixels were made of saturated samples, by its sidecar, and nothing marks which";
        assert_eq!(heard.contains(told), is_told, "{heard}");
    }
}

#[test]
fn a_comment_that_contradicts_the_heading_is_told() {
    let shop = Workshop::new();
    let table = "# unit: W m-2 sr-1 nm-1\nnm,radiance (mW m-2 sr-1 nm-1)\n360,10\n830,10\n";
    fs::write(shop.path("two.csv"), table).unwrap();
    let line = "render-radiance two.csv --size 2x2 -o out.exr";
    assert_eq!(
        shop.said(line, 0),
        "render-radiance: warning: two.csv: its heading says mW m-2 sr-1 nm-1, which counts, and a comment W m-2 sr-1 nm-1; \
         say which with --radiance-unit\n"
    );
    assert_eq!(shop.said(&format!("{line} --radiance-unit mW/m2/sr/nm"), 0), "");
}

/// Sidecars that somebody edited: a key that is misspelt, and what contradicts itself.
#[test]
fn edited_sidecars_are_told_of() {
    let shop = Workshop::with_frames();
    let sidecar = fs::read_to_string(shop.path("codes.exr.yaml")).unwrap();
    let edits: [(&str, &str, &str); 4] = [
        ("white_level_adu", "white_levl_adu", "unknown key `white_levl_adu`; did you mean `white_level_adu`?"),
        ("unit: ADU", "unit: e-", "its unit is `e-`, but that of its quantity, ADU, is `ADU`"),
        ("unit: ADU", "unit: electrons", "its unit is `electrons`, but that of its quantity, ADU, is `ADU`"),
        ("black_level_adu:", "black_level_adu: 0 # ", "its black level, 0 ADU, is below the bias of its converter, "),
    ];
    assert_eq!(shop.said("measure codes.exr", 0), "");
    for (old, new, told) in edits {
        assert!(sidecar.contains(old), "{sidecar}");
        fs::write(shop.path("codes.exr.yaml"), sidecar.replace(old, new)).unwrap();
        let heard = shop.said("measure codes.exr", 0);
        assert!(heard.contains(&format!("measure: warning: codes.exr.yaml: {told}")), "{heard}");
    }
}

/// f16 has 11 binary digits, codes of 14 bits have more.
#[test]
fn codes_that_f16_rounds_are_told() {
    let shop = Workshop::with_frames();
    let heard = shop.said("mosaic codes.exr --sample-type f16 -o half.exr", 0);
    let told =
        "f16 holds codes to 2048 as they are, and rounds those above, by steps of 2 at the white level, 4095 ADU; f32";
    assert!(heard.contains(told), "{heard}");
}

fn sidecar(shop: &Workshop) -> String {
    fs::read_to_string(shop.path("out.exr.yaml")).unwrap()
}

/// Patches beyond full well are told as a uniform scene is; so is an image that is cut.
#[test]
fn images_that_are_overexposed_or_cut_are_told() {
    let shop = Workshop::new();
    let skies = format!("{TREE}/sample_data/skies/sky912.exr");
    let heard = shop.said(&format!("render-radiance {skies} --patch 2x2 --exposure 1 -o out.exr"), 0);
    assert!(heard.contains("samples expect full well or more, and will be saturated"), "{heard}");
    assert!(sidecar(&shop).contains("saturated: "));
    assert_eq!(shop.said(&format!("render-radiance {skies} --patch 2x2 --expose-to 0.5 -o out.exr"), 0), "");
    let heard = shop.said(&format!("render-radiance {skies} --size 8x6 --expose-to 0.5 -o out.exr"), 0);
    assert!(heard.contains("--size 8x6 shows a corner of its 38x24 pixels in patches of 1x1"), "{heard}");
}

/// A column is named as people see it, without its unit.
#[test]
fn columns_are_found_without_their_units() {
    let shop = Workshop::new();
    let table = "nm,north [mW m-2 sr-1 nm-1],south [mW m-2 sr-1 nm-1]\n360,10,20\n830,10,20\n";
    fs::write(shop.path("two.csv"), table).unwrap();
    let digest = |column: &str| {
        let mut command = shop.command("render-radiance two.csv --size 2x2 -o out.exr --column");
        assert!(command.arg(column).output().unwrap().status.success(), "{column}");
        sidecar(&shop).lines().find(|line| line.contains("digest")).unwrap().to_owned()
    };
    assert_eq!(digest("south"), digest("south [mW m-2 sr-1 nm-1]"));
    assert_ne!(digest("north"), digest("south"));
}

/// Codes of one camera at several sensitivities are of several gains: they are not averaged, and are no photon transfer.
#[test]
fn exposures_of_several_sensitivities_do_not_go_together() {
    let shop = Workshop::new();
    for (name, iso_speed) in [("flat1.exr", 100.0), ("flat2.exr", 400.0)] {
        let mut metadata = Metadata::new(QuantityKind::Adu);
        metadata.cfa = Some("rggb".parse().unwrap());
        (metadata.camera, metadata.iso_speed) = (Some("A".into()), Some(iso_speed));
        let header = FrameHeader { name: name.into(), geometry: Geometry::new(4, 4, &["Y"]), metadata };
        shop.write(name, &header, &[1100.0; 16]);
    }
    let averaged = shop.said("average-frames flat1.exr flat2.exr -o mean.exr", BAD_DATA);
    assert!(averaged.contains("flat2.exr: its `iso_speed` is 400"), "{averaged}");
    let transfer = shop.said("photon-transfer .", BAD_DATA);
    assert!(transfer.contains("flat2.exr: its sensitivity (ISO) is not that of ./flat1.exr"), "{transfer}");
}

/// Who forgets `add-noise` hears of it where codes are made and where error bars are, each once; a clean frame is meant to have none.
#[test]
fn noise_that_was_not_drawn_is_told() {
    let shop = Workshop::new();
    shop.run("fit-matrix sky912.exr -o m.yaml", &[]);
    shop.run("render-radiance --electrons 900,1500,1200 --size 12x8 -o scene.exr", &[]);
    fs::copy(shop.path("scene.exr"), shop.path("other.exr")).unwrap();
    let codes =
        "digitize: warning: no noise was drawn: these are codes of what is expected; `add-noise` comes before\n";
    let bars = "warning: no noise was drawn; the standard deviations are those of noisy frames of the same scene\n";
    assert_eq!(shop.said("digitize scene.exr other.exr -o {stem}-codes.exr", 0), codes);
    shop.run("mosaic scene-codes.exr -o plane.exr", &[]);
    assert_eq!(shop.said("demosaic plane.exr -o rgb.exr", 0), "");
    assert_eq!(shop.said("demosaic plane.exr --sigma -o bars.exr", 0), format!("demosaic: {bars}"));
    assert_eq!(shop.said("to-xyz rgb.exr --matrix m.yaml -o xyz.exr", 0), "");
    assert_eq!(shop.said("to-xyz rgb.exr --matrix m.yaml --sigma -o xyz.exr", 0), format!("to-xyz: {bars}"));
    assert_eq!(shop.said("to-xyz bars.exr --matrix m.yaml --sigma -o xyz.exr", 0), "");
    for drawn in ["--seed 7", "--clean"] {
        shop.run(&format!("add-noise scene.exr {drawn} -o drawn.exr"), &[]);
        assert_eq!(shop.said("digitize drawn.exr -o drawn-codes.exr", 0), "");
        shop.run("mosaic drawn-codes.exr -o plane.exr", &[]);
        assert_eq!(shop.said("demosaic plane.exr --sigma -o bars.exr", 0), "");
    }
}
