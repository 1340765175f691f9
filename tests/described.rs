//! What a user says of frames that do not say it: on every program that reads them, and with the same effect.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::camera::optics::Exposure;
use std::fs;
use support::dng::{dng, dng_as_told};
use support::workshop::{BAD_USAGE, Workshop, programs};

/// What describes a frame, and what of a file is taken for it.
const OPTIONS: [&str; 7] = ["--cfa", "--black", "--white", "--exposure", "--f-number", "--channel", "--crop"];

/// Programs that have not all of these, and what they have; their pages say why.
const FEWER: [(&str, &[&str]); 7] = [
    // Read no frames of a camera.
    ("render-radiance", &["--cfa", "--exposure", "--f-number"]),
    ("predict-noise", &["--cfa", "--white", "--exposure", "--f-number"]),
    ("cyanometer", &[]),
    // Three planes of colors: --white is the white that they refer to.
    ("color-difference", &["--white", "--crop"]),
    // Demosaicked planes, behind no array; --white is that of colors.
    ("to-xyz", &["--black", "--white", "--exposure", "--f-number", "--channel", "--crop"]),
    // Of a chart, whose levels are --levels; the others are those of a library.
    ("fit-matrix", &["--cfa", "--white", "--exposure", "--f-number", "--channel", "--crop"]),
    // A raw image is one plane.
    ("import-raw", &["--cfa", "--black", "--white", "--exposure", "--f-number", "--crop"]),
];

#[test]
fn every_program_that_reads_frames_takes_all_that_describes_them() {
    let shop = Workshop::new();
    for program in programs() {
        let help = String::from_utf8(shop.run(&format!("{program} --help"), &[])).unwrap();
        let has = |option: &&&str| help.lines().any(|line| line.split([' ', ',']).any(|word| word == **option));
        let found: Vec<&str> = OPTIONS.iter().filter(has).copied().collect();
        let expected = FEWER.iter().find(|(of, _)| *of == program).map_or(&OPTIONS[..], |(_, options)| options);
        assert_eq!(found, expected, "{program}");
    }
}

/// Flats and darks as a camera's software stores them: codes alone, in folders that tell which is which.
fn codes_alone(shop: &Workshop) {
    for (folder, electrons) in [("flats", [2000, 4000, 8000]), ("darks", [0, 0, 0])] {
        fs::create_dir_all(shop.path("own").join(folder)).unwrap();
        fs::create_dir_all(shop.path("bare").join(folder)).unwrap();
        for (level, light) in electrons.iter().enumerate().take(if folder == "darks" { 1 } else { 3 }) {
            for i in 0..2 {
                let name = format!("{folder}/{light}-{i}");
                let frame = level * 2 + i + if folder == "darks" { 10 } else { 0 };
                let codes = shop.pipe(&format!(
                    "render-radiance --electrons {light},{light},{light} --size 64x48 --exposure 0.01 | mosaic | \
                     add-noise --frame {frame} | digitize"
                ));
                fs::write(shop.path(&format!("own/{name}.exr")), codes).unwrap();
                let samples = shop.read(&format!("own/{name}.exr")).0;
                let bytes: Vec<u8> =
                    samples.iter().flat_map(|code| code.to_string().parse::<u16>().unwrap().to_le_bytes()).collect();
                fs::write(shop.path(&format!("bare/{name}.raw")), bytes).unwrap();
            }
        }
    }
    // Of frames that tell no levels a list says which are of one light.
    let row = |light: &str, i: usize| format!("flats/{light}-{i}.raw,flat,{light}\n");
    let flats = ["2000", "4000", "8000"].iter().flat_map(|light| [row(light, 0), row(light, 1)]);
    let list = "file,kind,level\n".to_owned() + &flats.collect::<String>();
    fs::write(shop.path("bare/list.csv"), list + "darks/0-0.raw,dark,\ndarks/0-1.raw,dark,\n").unwrap();
}

/// The number of each class of a report in JSON.
fn gains(report: &[u8]) -> Vec<(String, f64)> {
    let report: serde_json::Value = serde_json::from_slice(report).unwrap();
    let channels = report["channels"].as_array().unwrap();
    let gain = |channel: &serde_json::Value| channel["gain_adu_per_e"]["value"].as_f64().unwrap();
    channels.iter().map(|channel| (channel["name"].as_str().unwrap().into(), gain(channel))).collect()
}

#[test]
fn flats_and_darks_of_codes_alone_are_described() {
    let shop = Workshop::new();
    codes_alone(&shop);
    let measured = |line: &str| {
        let output = shop.attempt(&format!("photon-transfer {line} --output-format json --quiet"), &[]);
        assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
        gains(&output.stdout)
    };
    let bare = "bare/list.csv --raw 64x48:u16le --cfa grbg --white 65535 --exposure 0.01";
    let cfa = shop.frame("own/flats/2000-0.exr").header.metadata.cfa.unwrap();
    let bare = bare.replace("grbg", &cfa.to_string());
    assert_eq!(measured(&format!("{bare} --black 512")), measured("own"));
    // A part that begins at an odd photosite has the classes that it had.
    let crop = "--crop 3,5,40,30";
    assert_eq!(measured(&format!("{bare} {crop}")), measured(&format!("own {crop}")));
    let said = |line: &str| {
        let output = shop.attempt(&format!("photon-transfer {line}"), &[]);
        assert_eq!(output.status.code(), Some(BAD_USAGE));
        String::from_utf8(output.stderr).unwrap()
    };
    assert!(said("own --exposure 0.02").ends_with(
        "the exposure time in s is 0.01 by its metadata, which --metadata FILE can replace; leave out --exposure\n"
    ));
    assert!(said("own --f-number 5.6").contains("the f-number is 8 by its metadata"));
    assert!(said("own --black 1,2,3,4").contains("the black level is "));
    let list = fs::read_to_string(shop.path("bare/list.csv")).unwrap();
    let timed = list
        .replace("kind,level", "kind,level,exposure_s")
        .replace("0\n", "0,0.02\n")
        .replace("dark,\n", "dark,,0.02\n");
    fs::write(shop.path("bare/timed.csv"), timed).unwrap();
    let line = bare.replace("list.csv", "timed.csv");
    assert!(said(&line).ends_with("its exposure time is 0.02 s by the list, not 0.01 s; leave out --exposure\n"));
}

/// A plane among several channels is known by its name, and told.
#[test]
fn a_plane_behind_a_filter_array_is_found_by_its_name() {
    let shop = Workshop::new();
    shop.pipe("render-radiance --electrons 900,900,900 --size 8x6 | mosaic | add-noise | digitize -o plane.exr");
    let plane = shop.frame("plane.exr");
    let bare = "demosaic plane.exr --channel Y -o wanted.exr --quiet";
    shop.run(bare, &[]);
    for (names, found) in [
        (vec!["raw", "mask"], Some("raw")),
        (vec!["cfa.Y", "depth.Z"], Some("cfa.Y")),
        (vec!["R", "G", "B", "Bayer"], Some("Bayer")),
        (vec!["left", "right"], None),
        (vec!["raw", "cfa"], None),
    ] {
        let mut header = plane.header.clone();
        header.geometry = header.geometry.with_channels(&names);
        header.metadata = cyanometer::metadata::Metadata::new(cyanometer::units::QuantityKind::Unspecified);
        let row = plane.header.geometry.width;
        let samples: Vec<f32> =
            plane.samples.chunks(row).flat_map(|row| names.iter().flat_map(move |_| row.iter().copied())).collect();
        shop.write("several.exr", &header, &samples);
        fs::remove_file(shop.path("several.exr.yaml")).ok();
        let line = "demosaic several.exr --cfa grbg --black 78 --white 4095 -o found.exr";
        let Some(found) = found else {
            assert!(shop.said(line, BAD_USAGE).contains("take that with --channel NAME"), "{names:?}");
            continue;
        };
        let said = shop.said(line, 0);
        assert!(said.contains(&format!("its channel `{found}` is taken for the plane")), "{names:?}: {said}");
        let with_channel =
            format!("demosaic several.exr --channel {found} --cfa grbg --black 78 --white 4095 -o named.exr");
        shop.said(&with_channel, 0);
        assert_eq!(shop.frame("found.exr").samples, shop.frame("named.exr").samples, "{names:?}");
    }
}

/// Without the exposure that absolute XYZ take they are relative, by a matrix of whatever kind: D65 that saturates the camera has Y = 1.
#[test]
fn colors_of_an_unknown_exposure_are_relative() {
    let shop = Workshop::new();
    shop.pipe("render-radiance --electrons 9000,9000,9000 --size 8x6 | mosaic | add-noise | digitize -o plane.exr");
    shop.run("demosaic plane.exr -o rgb.exr", &[]);
    shop.run("to-xyz rgb.exr --matrix sensor -o xyz.exr", &[]);
    let absolute = shop.frame("xyz.exr");
    let rgb = shop.frame("rgb.exr");
    let mut header = rgb.header.clone();
    header.metadata.exposure = None;
    shop.write("bare.exr", &header, &rgb.samples);
    for matrix in ["", " --matrix sensor"] {
        let said = shop.said(&format!("to-xyz bare.exr{matrix} -o relative.exr"), 0);
        assert!(said.contains("its exposure is not known: XYZ are relative, Y = 1 for the D65"), "{said}");
        let relative = shop.frame("relative.exr");
        // One factor: that by which the recorded white of absolute XYZ has Y = 1.
        let white = absolute.header.metadata.color.as_ref().unwrap().white.unwrap()[1];
        for (relative, absolute) in relative.samples.iter().zip(&absolute.samples) {
            let off = f64::from(*relative) * white - f64::from(*absolute);
            assert!(off.abs() < 1e-5 * f64::from(*absolute).abs(), "{relative} {absolute} {white}");
        }
    }
}

/// The pixels of a crop were mirrored where their plane ends, as those of a region of it.
#[test]
fn a_crop_of_pixels_is_predicted_as_the_region_that_it_is() {
    let shop = Workshop::new();
    shop.pipe("render-radiance --electrons 3000,5000,2000 --size 60x44 | mosaic | add-noise | digitize | demosaic --method bi -o f.exr");
    shop.run("to-xyz f.exr --matrix sensor -o x.exr", &[]);
    shop.run("to-xyz f.exr --matrix sensor --crop 13,9,9,7 -o cropped.exr", &[]);
    for lines in [
        ["measure f.exr --region 13,9,9,7", "measure f.exr --crop 13,9,9,7"],
        ["measure x.exr --region 13,9,9,7", "measure cropped.exr"],
        ["measure x.exr --region 0,30,9,14", "measure x.exr --crop 0,30,9,14"],
    ] {
        let [region, crop] = lines.map(|line| {
            let report = shop.run(&format!("{line} --output-format json"), &[]);
            let report: serde_json::Value = serde_json::from_slice(&report).unwrap();
            report["regions"][0]["channels"].clone()
        });
        for (region, crop) in region.as_array().unwrap().iter().zip(crop.as_array().unwrap()) {
            for key in ["std", "predicted_std", "mean_error", "std_error"] {
                let [region, crop] = [region, crop].map(|channel| channel[key].as_f64().unwrap());
                assert!((region / crop - 1.0).abs() < 1e-6, "{lines:?} {key}: {region} {crop}");
            }
        }
    }
}

/// One channel of frames of three planes is measured as a camera without filters.
#[test]
fn a_channel_of_flats_is_measured_alone() {
    let shop = Workshop::new();
    fs::create_dir(shop.path("three")).unwrap();
    fs::create_dir(shop.path("green")).unwrap();
    for (i, (kind, light)) in [("flat", 4000), ("flat", 4000), ("flat", 8000), ("flat", 8000), ("dark", 0), ("dark", 0)]
        .into_iter()
        .enumerate()
    {
        let chain = format!(
            "render-radiance --electrons {light},{light},{light} --size 40x30 | add-noise --frame {i} | digitize"
        );
        fs::write(shop.path(&format!("three/{kind}{i}.exr")), shop.pipe(&chain)).unwrap();
    }
    let one = shop.attempt("photon-transfer three --channel G --output-format json --quiet", &[]).stdout;
    let all = shop.attempt("photon-transfer three --output-format json --quiet", &[]).stdout;
    let green = gains(&all).into_iter().find(|(name, _)| name == "G").unwrap().1;
    assert_eq!(gains(&one).into_iter().map(|(_, gain)| gain).collect::<Vec<_>>(), [green]);
    // What the complaint about an array of three planes advises can be done.
    let said = shop.attempt("photon-transfer three --cfa rggb", &[]);
    assert!(String::from_utf8_lossy(&said.stderr).contains("take that with --channel NAME, or leave out --cfa"));
}

#[test]
fn the_difference_of_crops_is_that_of_the_parts() {
    let shop = Workshop::new();
    let chain = "mosaic | add-noise --seed 3 | digitize | demosaic | to-xyz";
    for (name, seed) in [("a", 1), ("b", 2)] {
        let light = "render-radiance SAMPLES/skies/clear_zenith.csv --size 24x16 --expose-to 0.5";
        let xyz = shop.pipe(&format!("{light} | {}", chain.replace('3', &seed.to_string())));
        fs::write(shop.path(&format!("{name}.exr")), xyz).unwrap();
        // Statistics of a part by the program that cuts it.
        let cut = shop.run(&format!("to-xyz {name}.exr --crop 5,3,8,9 --space xyz"), &[]);
        fs::write(shop.path(&format!("{name}-part.exr")), cut).unwrap();
    }
    let report = |line: &str| shop.run(&format!("color-difference {line} --output-format json"), &[]);
    assert_eq!(report("a.exr b.exr --crop 5,3,8,9"), report("a-part.exr b-part.exr"));
    assert_ne!(report("a.exr b.exr --crop 5,3,8,9"), report("a.exr b.exr"));
    let said = |line: &str| String::from_utf8(shop.attempt(&format!("color-difference {line}"), &[]).stderr).unwrap();
    assert_eq!(
        said("1,2,3 2,3,4 --crop 0,0,1,1"),
        "color-difference: both are colors, of which there are no parts; leave out --crop\n"
    );
    assert!(said("a.exr b.exr --crop 20,0,8,8").contains("a.exr: "));
}

/// A raw file tells no exposure, and no array of its own kind: both are said, and a rectangle of it is taken.
#[test]
fn a_raw_file_is_described_and_cut() {
    let shop = Workshop::new();
    let strip: Vec<u8> = (0..120_u16).flat_map(|i| (300 + i * i % 977).to_le_bytes()).collect();
    let more: [(u16, &[u32]); 3] = [(50714, &[64]), (50717, &[4000]), (50829, &[2, 3, 10, 12])];
    fs::write(shop.path("raw.dng"), dng([12, 10], 16, 1, &strip, &more)).unwrap();
    shop.run("import-raw raw.dng -o whole.exr", &[]);
    shop.run("import-raw raw.dng --crop 1,2,5,4 --exposure 0.25 --f-number 4 -o part.exr", &[]);
    shop.run("measure whole.exr --crop 1,2,5,4 -o whole.json", &[]);
    shop.run("measure part.exr -o part.json", &[]);
    assert_eq!(shop.bytes("part.json"), shop.bytes("whole.json"));
    let part = shop.frame("part.exr").header;
    assert_eq!(part.geometry.origin, [4, 4]);
    let exposure = Exposure { exposure_s: 0.25, f_number: 4.0, lens_transmittance: 1.0 };
    assert_eq!(part.metadata.exposure, Some(exposure));
    let said = |line: &str| {
        String::from_utf8(shop.attempt(&format!("import-raw raw.dng {line} -o x.exr"), &[]).stderr).unwrap()
    };
    assert!(said("--black 65").contains("the black level is 64 by its metadata, which --metadata FILE can replace"));
    assert!(said("--crop half").contains("give active, full, default, or X,Y,W,H between commas"));
    assert!(said("--crop 8,0,2,2").contains("does not lie within the frame of 9x8"));
}

/// A level for each of the 2x2 sites, counted from the sensor's corner, whatever part of the frame is read.
#[test]
fn black_is_said_by_site() {
    let shop = Workshop::new();
    let codes: Vec<u8> = (0..96_u16).flat_map(|i| (100 + i * 37 % 501).to_le_bytes()).collect();
    fs::write(shop.path("a.raw"), codes).unwrap();
    let line = "--raw 12x8:u16le --cfa rggb --white 4095";
    let levels = [60.0, 61.5, -2.0, 64.0];
    let said = levels.map(|level| level.to_string()).join(",");
    fs::copy(shop.path("a.raw"), shop.path("b.raw")).unwrap();
    shop.run(&format!("stack-frames a.raw b.raw {line} --black {said} -o known.zarr"), &[]);
    let sites = levels.map(|level| format!("{level:?}")).join(", ");
    let text =
        format!("schema: cyanometer/1\nquantity: adu\ncfa: rggb\nwhite_level_adu: 4095\nblack_level_adu: [{sites}]\n");
    fs::write(shop.path("known.yaml"), text).unwrap();
    for (program, rest) in [("correct-frame", ""), ("demosaic", "--method bi ")] {
        for crop in ["", " --crop 3,1,8,6"] {
            shop.run(&format!("{program} a.raw {line} {rest}--black {said}{crop} -o a.exr"), &[]);
            shop.run(
                &format!("{program} a.raw --raw 12x8:u16le --metadata known.yaml {rest}--black auto{crop} -o b.exr"),
                &[],
            );
            assert_eq!(shop.read("a.exr").0, shop.read("b.exr").0, "{program}{crop}");
        }
    }
    let refused = String::from_utf8(shop.attempt(&format!("demosaic a.raw {line} --black 1,2,3 -o x.exr"), &[]).stderr);
    assert!(refused.unwrap().contains("give auto, none, a number, or four between commas"));
}

/// A black level that is said of a camera's frame counts in place of that of its tags, to the end: nothing is left of it, and white is as
/// much lower. One of 0, which files without any have by DNG, contradicts nothing.
#[test]
fn a_black_level_that_is_said_counts_to_the_end() {
    let shop = Workshop::new();
    let strip: Vec<u8> = (0..120_u16).flat_map(|i| (700 + i % 7).to_le_bytes()).collect();
    let white: (u16, &[u32]) = (50717, &[4000]);
    fs::write(shop.path("none.dng"), dng_as_told([12, 10], &strip, &[white])).unwrap();
    fs::write(shop.path("told.dng"), dng_as_told([12, 10], &strip, &[(50714, &[500]), white])).unwrap();
    let levels = |name: &str| {
        let metadata = shop.frame(name).header.metadata;
        [metadata.uniform_black_adu().unwrap(), metadata.white_level_adu.unwrap().largest()]
    };
    assert_eq!(shop.said("import-raw none.dng --black 100 -o plane.tiff", 0), "");
    assert_eq!(levels("plane.tiff"), [100.0, 4000.0]);
    assert!(shop.said("import-raw told.dng --black 100 -o plane.tiff", BAD_USAGE).contains("the black level is 500"));
    for file in ["none.dng", "told.dng"] {
        for program in ["demosaic", "correct-frame"] {
            let said = shop.said(&format!("{program} {file} --black 100 -o out.exr"), 0);
            assert!(said.contains("--black auto takes; it counts in place of that"), "{said}");
            assert!(!said.contains("it has no BlackLevel"), "{said}");
            assert_eq!(levels("out.exr"), [0.0, 3900.0], "{program} {file}");
            assert!((shop.frame("out.exr").samples[0] - 600.0).abs() < 10.0);
        }
    }
    assert!(shop.said("demosaic none.dng -o out.exr", 0).contains("it has no BlackLevel, which by DNG is then 0"));
}

/// Planes without metadata: what dark frames take off, white is left above; defects are filled within a class where the array is told,
/// and else that is said; planes of XYZ may be named so.
#[test]
fn plain_planes_keep_what_is_said_of_them() {
    let shop = Workshop::new();
    let raw = |name: &str, level: u16| {
        let codes = (0..192_u16).flat_map(|i| (level + i % 5).to_le_bytes());
        fs::write(shop.path(name), codes.collect::<Vec<u8>>()).unwrap();
    };
    [("light.raw", 3000), ("dark.raw", 500)].into_iter().for_each(|(name, level)| raw(name, level));
    let line = "correct-frame light.raw --raw 16x12:u16le --white 4000 -o out.exr";
    shop.said(&format!("{line} --cfa rggb --dark dark.raw"), 0);
    let metadata = shop.frame("out.exr").header.metadata;
    let white = metadata.white_level_adu.unwrap().largest();
    assert!((white - (4000.0 - 501.99)).abs() < 0.01, "{white}");
    assert_eq!(metadata.uniform_black_adu(), Some(0.0));
    fs::write(shop.path("list.csv"), "3,4\n").unwrap();
    let told = "nothing tells its filter array, and defects are filled from the photosites beside them";
    assert!(shop.said(&format!("{line} --black 500 --defects list.csv"), 0).contains(told));
    assert!(!shop.said(&format!("{line} --black 500 --defects list.csv --cfa monochrome"), 0).contains(told));
}

/// A frame of a camera that is larger than its sensor is one of another.
#[test]
fn frames_larger_than_their_sensor_are_told() {
    let shop = Workshop::new();
    let strip: Vec<u8> = (0..120_u16).flat_map(|i| (700 + i % 7).to_le_bytes()).collect();
    fs::write(shop.path("a.dng"), dng_as_told([12, 10], &strip, &[(50714, &[500]), (50717, &[4000])])).unwrap();
    for (size, is_told) in [([12, 10], false), ([12, 8], true), ([8, 10], true)] {
        let readout = format!(
            "width: {}, height: {}, cfa: rggb, full_well_e: 60000, dark_current_e_per_s: 0, temperature_k: 263, dcnu: 0, prnu: 0, \
             read_noise_e: 5, bits: 12, bias_adu: 500, adu_per_e: 0.1",
            size[0], size[1]
        );
        let sensor = format!("schema: cyanometer-sensor/2\nname: small\nreadout: {{{readout}}}\n");
        fs::write(shop.path("s.yaml"), sensor).unwrap();
        let said = shop.said("correct-frame a.dng --black auto --sensor s.yaml -o out.exr", 0);
        let told = format!("up to column 11 and row 9, and its sensor `small` has {}x{} of them", size[0], size[1]);
        assert_eq!(said.contains(&told), is_told, "{said}");
    }
}
