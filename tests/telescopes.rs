//! Frames that other programs wrote, as calibration takes them: what their headers tell of each other, and what contradicts.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::frame::Geometry;
use cyanometer::metadata::{FrameHeader, Metadata, TakenAs};
use std::fs;
use support::fits::write_fits;
use support::workshop::{BAD_DATA, BAD_USAGE, Workshop};

const SIZE: [usize; 2] = [16, 12];

/// A FITS of codes about a level, which `seed` scatters, with these cards.
fn write(shop: &Workshop, name: &str, [level, seed]: [u32; 2], cards: &[(&str, &str)]) {
    let [width, height] = SIZE.map(|side| u32::try_from(side).unwrap());
    write_fits(shop, name, [width, height], cards, |x, y| {
        let place = y * width + x;
        f64::from(level + (place * 7919 + seed * 104_729 + place * place * (seed + 3)) % 11)
    });
}

/// A light frame of 2 s, and a dark frame with these cards.
fn night(dark: &[(&str, &str)]) -> Workshop {
    let shop = Workshop::new();
    write(&shop, "light.fits", [900, 1], &[("EXPTIME", "2.0"), ("IMAGETYP", "'Light Frame'"), ("INSTRUME", "'A'")]);
    write(&shop, "dark.fits", [100, 2], &[&[("INSTRUME", "'A'")], dark].concat());
    shop
}

const DARK: (&str, &str) = ("IMAGETYP", "'Dark Frame'");

#[test]
fn times_are_compared_where_no_aperture_is_told() {
    let line = "correct-frame light.fits --dark dark.fits -o out.exr";
    let shop = night(&[DARK, ("EXPTIME", "2.0")]);
    assert_eq!(shop.said(line, 0), "");
    assert_eq!(shop.sidecar("out.exr").exposure_time_s, Some(2.0));
    assert_eq!(shop.sidecar("out.exr").taken_as, Some(TakenAs::Light));
    let shop = night(&[DARK, ("EXPTIME", "30.0")]);
    let differ = "its exposure is 30 s, but that of light.fits is 2 s; their dark signals differ\n";
    assert_eq!(shop.said(line, 0), format!("correct-frame: warning: dark.fits: {differ}"));
    // What was converted still tells it.
    for end in ["tiff", "exr"] {
        for name in ["light", "dark"] {
            let to = format!("correct-frame {name}.fits --black 0 -o {name}.{end}");
            shop.said(&to, 0);
            assert!(shop.read(&format!("{name}.{end}")).1.exposure_time_s.is_some(), "{end}");
        }
    }
}

/// What a cooler and a clock are off by hardly changes a dark signal: 0.2 K is 2 % of it.
#[test]
fn conditions_that_are_nearly_the_same_are_not_told() {
    let shop = Workshop::new();
    let camera = [("INSTRUME", "'A'"), ("EXPTIME", "2.0"), ("CCD-TEMP", "-10.0")];
    write(&shop, "light.fits", [900, 1], &[&camera[..], &[("IMAGETYP", "'Light Frame'")]].concat());
    let cases = [
        ("2.0", "-9.9", false),
        ("2.0015", "-9.8", false),
        ("2.0", "-10.2", false),
        ("2.003", "-10.0", true),
        ("2.0", "-9.7", true),
    ];
    for (time, temperature, is_told) in cases {
        write(&shop, "dark.fits", [100, 2], &[DARK, camera[0], ("EXPTIME", time), ("CCD-TEMP", temperature)]);
        let told = shop.said("correct-frame light.fits --dark dark.fits -o out.exr", 0);
        assert_eq!(told.contains("their dark signals differ"), is_told, "{time} s, {temperature}: {told}");
    }
}

#[test]
fn darks_are_scaled_by_times_alone() {
    let shop = night(&[DARK, ("EXPTIME", "8.0")]);
    write(&shop, "bias.fits", [60, 3], &[("EXPTIME", "0.0"), ("IMAGETYP", "'Bias Frame'"), ("INSTRUME", "'A'")]);
    let line = "correct-frame light.fits --dark dark.fits --bias bias.fits --scale-dark -o out.exr";
    let scaled = shop.said(line, 0);
    assert!(scaled.contains("its temperature is not known"), "{scaled}");
    // w = 2/8 of the dark, 3/4 of the bias.
    let of = |name: &str| shop.read(name).0;
    let (made, light, dark, bias) = (of("out.exr"), of("light.fits"), of("dark.fits"), of("bias.fits"));
    for (at, made) in made.iter().enumerate().take(SIZE[0] * SIZE[1]) {
        assert!((made - (light[at] - 0.25 * dark[at] - 0.75 * bias[at])).abs() < 1e-3, "{at}");
    }
    // A time that no file tells is said, and needs no f-number.
    let shop = night(&[DARK, ("EXPTIME", "8.0")]);
    write(&shop, "light.fits", [900, 1], &[("INSTRUME", "'A'")]);
    write(&shop, "bias.fits", [60, 3], &[("INSTRUME", "'A'")]);
    let missing = shop.said(line, BAD_DATA);
    assert!(missing.contains("`exposure_time_s`") && missing.ends_with("give --exposure S\n"), "{missing}");
    shop.said(&format!("{line} --exposure 2"), 0);
    let other = of_two_times(&night(&[DARK, ("EXPTIME", "8.0")]), "--exposure 3");
    assert!(other.contains("light.fits: the exposure time in s is 2 by its metadata"), "{other}");
}

fn of_two_times(shop: &Workshop, rest: &str) -> String {
    shop.said(&format!("correct-frame light.fits --dark dark.fits {rest} -o out.exr"), BAD_USAGE)
}

#[test]
fn what_a_frame_was_taken_as_is_what_it_is_used_as() {
    let dark = |shop: &Workshop, status| shop.said("correct-frame light.fits --dark dark.fits -o out.exr", status);
    for (card, taken) in [
        (("IMAGETYP", "'Flat Field'"), "a flat"),
        (("IMAGETYP", "'LIGHT'"), "a light frame"),
        (("OBSTYPE", "'OBJECT'"), "a light frame"),
        (("FRAME", "'Flat'"), "a flat"),
    ] {
        let refused = dark(&night(&[card]), BAD_DATA);
        let begin =
            format!("correct-frame: dark.fits: it was taken as {taken}, by its own header or metadata (`taken_as`)");
        assert!(refused.starts_with(&begin), "{refused}");
    }
    for card in [DARK, ("IMAGETYP", "'DARKFLAT'"), ("FRAME", "'Dark'"), ("IMAGETYP", "'masterDark'")] {
        assert_eq!(dark(&night(&[card]), 0), "", "{card:?}");
    }
    let bias = dark(&night(&[("IMAGETYP", "'zero'")]), 0);
    assert!(bias.contains("it was taken as a bias frame and is used as a dark frame"), "{bias}");
    let both = dark(&night(&[DARK, ("FRAME", "'Light'")]), 0);
    assert!(
        both.contains("it was taken as `Dark Frame` by IMAGETYP and as `Light` by FRAME; neither is believed"),
        "{both}"
    );
    let shop = night(&[DARK]);
    let flat = shop.said("correct-frame light.fits --black 50 --flat dark.fits -o out.exr", BAD_DATA);
    assert!(flat.contains("it was taken as a dark frame") && flat.contains("is given as a flat"), "{flat}");
    write(&shop, "light.fits", [900, 1], &[DARK, ("INSTRUME", "'A'")]);
    assert!(dark(&shop, 0).contains("light.fits: no light fell on it: it is a dark frame itself"));
}

/// A light frame with these cards and a dark one with those.
fn pair(light: &[(&str, &str)], dark: &[(&str, &str)]) -> Workshop {
    let shop = night(&[&[DARK, ("EXPTIME", "2.0")], dark].concat());
    let own = [("EXPTIME", "2.0"), ("IMAGETYP", "'Light Frame'"), ("INSTRUME", "'A'")];
    write(&shop, "light.fits", [900, 1], &[&own, light].concat());
    shop
}

#[test]
fn frames_of_other_photosites_do_not_go_together() {
    let subframe = |x: &'static str, y: &'static str| [("XORGSUBF", x), ("YORGSUBF", y)];
    let [up, down] = ["'BOTTOM-UP'", "'TOP-DOWN'"].map(|order| [("ROWORDER", order)]);
    let untold = [("ROWORDER", "''")];
    let line = "correct-frame light.fits --dark dark.fits -o out.exr";
    for (light, dark, wanted) in [
        (
            &subframe("0", "0")[..],
            &subframe("32", "0")[..],
            "dark.fits: it begins at column 32 and row 0 of the sensor, and light.fits at column 0",
        ),
        (&subframe("8", "4"), &subframe("8", "6"), "dark.fits: it begins at column 8 and row 6 of the sensor"),
        (
            &up,
            &untold,
            "dark.fits: it does not tell which row it begins with (ROWORDER), and light.fits begins with the lowest",
        ),
        (&untold, &up, "dark.fits: it begins with the lowest row (ROWORDER), and light.fits does not tell"),
        (&subframe("8", "4"), &subframe("8", "4"), ""),
        (&subframe("8", "4"), &[], ""),
        (&up, &up, ""),
        (&up, &down, ""),
        (&down, &untold, ""),
    ] {
        let shop = pair(light, dark);
        let status = if wanted.is_empty() { 0 } else { BAD_DATA };
        let said = shop.said(line, status);
        assert!(said.contains(wanted), "{light:?}, {dark:?}: {said}");
        if wanted.is_empty() {
            assert!(shop.sidecar("out.exr").capture.is_some());
        }
        let status = shop.attempt("average-frames light.fits dark.fits -o out.exr", &[]).status.success();
        assert!(wanted.is_empty() || !status);
    }
}

#[test]
fn what_came_off_already_comes_off_no_more() {
    let calibrated = |steps: &'static str| [("CALSTAT", steps)];
    let raw: &[(&str, &str)] = &[];
    for (light, dark, wanted) in [
        (&calibrated("'BD'")[..], raw, "light.fits: its file tells that a bias was taken off"),
        (&calibrated("'D'"), raw, "light.fits: its file tells that a dark was taken off"),
        (raw, &calibrated("'B'"), "dark.fits: its file tells that a bias was taken off"),
        (&calibrated("'B'"), raw, "light.fits: its file tells that a bias was taken off"),
        (&calibrated("'B'"), &calibrated("'B'"), ""),
        (&calibrated("'F'"), raw, ""),
    ] {
        let shop = pair(light, dark);
        let status = if wanted.is_empty() { 0 } else { BAD_DATA };
        let said = shop.said("correct-frame light.fits --dark dark.fits -o out.exr", status);
        assert!(said.contains(wanted), "{light:?}, {dark:?}: {said}");
    }
    let shop = pair(&calibrated("'BDF'"), raw);
    write(&shop, "flat.fits", [800, 4], &[("IMAGETYP", "'Flat'"), ("INSTRUME", "'A'")]);
    let divided = shop.said("correct-frame light.fits --black 0 --flat flat.fits -o out.exr", BAD_DATA);
    assert!(
        divided.contains("that a flat was taken off or divided out before")
            && divided.contains("it is divided by a flat"),
        "{divided}"
    );
    let stack = pair(&[("STACKCNT", "20")], raw).said("measure light.fits", 0);
    assert!(stack.contains("light.fits: it is combined of 20 exposures (STACKCNT), and nothing tells how"), "{stack}");
}

#[test]
fn a_copy_of_the_frame_corrects_nothing() {
    let shop = night(&[DARK]);
    write(&shop, "copy.fits", [900, 1], &[("INSTRUME", "'A'"), ("OBSERVER", "'me'")]);
    for rest in ["--dark copy.fits", "--dark dark.fits --flat copy.fits --flat-dark dark.fits", "--bias copy.fits"] {
        let refused = shop.said(&format!("correct-frame light.fits {rest} -o out.exr"), BAD_DATA);
        assert!(refused.contains("copy.fits: its samples are those of light.fits, every one"), "{refused}");
    }
    assert!(!shop.path("out.exr").exists());
}

#[test]
fn a_dark_that_is_no_dark_is_told_by_its_level() {
    // Nothing tells what it is, as of all frames of cameras: that alone is no warning.
    let shop = night(&[]);
    let line = "correct-frame light.fits --dark dark.fits -o out.exr";
    assert_eq!(shop.said(line, 0), "");
    let told = shop.said(&format!("{line} -v"), 0);
    assert!(told.contains("dark.fits: the metadata do not tell whether it is a dark frame of the sensor"), "{told}");
    // One that tells no camera beside one that does is doubtful.
    write(&shop, "dark.fits", [100, 2], &[]);
    assert!(shop.said(line, 0).contains("warning: dark.fits: the metadata do not tell"));
    write(&shop, "dark.fits", [1000, 2], &[("INSTRUME", "'A'")]);
    let below = shop.said(line, 0);
    assert!(
        below.contains("warning: light.fits: its mean is 904.0 ADU") && below.contains("below that of what came off"),
        "{below}"
    );
}

#[test]
fn keywords_that_contradict_each_other_are_told() {
    let of = |cards: &[(&str, &str)]| {
        let shop = Workshop::new();
        write(&shop, "a.fits", [900, 1], cards);
        shop.said("measure a.fits -o out.txt", 0)
    };
    let warned = |what: &str| format!("measure: warning: a.fits: {what}\n");
    assert_eq!(of(&[("EXPTIME", "2.0"), ("EXPOSURE", "2"), ("EXPOINUS", "2000000")]), "");
    assert_eq!(
        of(&[("EXPTIME", "2.0"), ("EXPOSURE", "3.0")]),
        warned("its exposure time in s is 2 by EXPTIME and 3 by EXPOSURE; EXPTIME counts")
    );
    assert_eq!(
        of(&[("EXPTIME", "2.0"), ("EXPTIME", "3.0")]),
        warned("its keyword EXPTIME stands there again with another value; the first counts")
    );
    assert_eq!(of(&[("EXPTIME", "2.0"), ("FOCALLEN", "400"), ("APTDIA", "71"), ("FOCRATIO", "5.6")]), "");
    assert_eq!(
        of(&[("EXPTIME", "2.0"), ("FOCALLEN", "400"), ("APTDIA", "100"), ("FOCRATIO", "8")]),
        warned("its f-number is 4 by FOCALLEN and APTDIA and 8 by FOCRATIO; FOCALLEN and APTDIA counts")
    );
    assert_eq!(
        of(&[("COLORTYP", "'GRBG'")]),
        warned("its filter array is `RGGB` by BAYERPAT and `GRBG` by COLORTYP; BAYERPAT counts")
    );
}

#[test]
fn a_white_level_comes_before_black_is_off() {
    let shop = night(&[DARK]);
    shop.said("correct-frame light.fits --dark dark.fits -o out.exr", 0);
    let refused = shop.said("demosaic out.exr --white 905 -o rgb.exr", BAD_USAGE);
    assert!(refused.contains("black came off its samples before a white level was known"), "{refused}");
    assert!(refused.ends_with("leave out --white\n"), "{refused}");
    let late = shop.said("demosaic out.exr --sensor kaf-5101ce -o rgb.exr", 0);
    assert!(late.contains("the full well of sensor kaf-5101ce comes too late to mark saturated samples"), "{late}");
    // Given in time it marks what is saturated.
    shop.said("correct-frame light.fits --dark dark.fits --white 905 -o out.exr", 0);
    assert!(shop.sidecar("out.exr").mask_bits.len() == 4);
}

#[test]
fn a_black_level_above_white_leaves_nothing() {
    let shop = night(&[]);
    for known in ["", "black_level_adu: 64\n"] {
        fs::write(
            shop.path("m.yaml"),
            format!("schema: cyanometer/1\nquantity: adu\ncfa: rggb\nwhite_level_adu: 4095\n{known}"),
        )
        .unwrap();
        for program in ["demosaic", "correct-frame"] {
            let line = format!("{program} light.fits --metadata m.yaml --black 15000 -o out.exr");
            let refused = shop.said(&line, BAD_USAGE);
            assert!(refused.contains("--black 15000 is not below the white level, 4095 ADU"), "{refused}");
        }
    }
}

/// Four black levels are those of the picture's first 2x2 photosites, whatever offsets the pattern has.
#[test]
fn black_levels_begin_at_the_corner_of_the_picture() {
    let shop = Workshop::new();
    for offsets in [["0", "0"], ["1", "0"], ["0", "1"], ["1", "1"]] {
        write(&shop, "a.fits", [900, 1], &[("XBAYROFF", offsets[0]), ("YBAYROFF", offsets[1])]);
        shop.said("correct-frame a.fits --black 10,20,30,40 -o out.exr", 0);
        let (before, after) = (shop.read("a.fits").0, shop.read("out.exr").0);
        for (place, (before, after)) in before.iter().zip(&after).enumerate() {
            let [x, y] = [place % SIZE[0], place / SIZE[0]];
            assert_eq!(before - after, [10.0, 20.0, 30.0, 40.0][2 * (y % 2) + x % 2], "{offsets:?} {x},{y}");
        }
    }
}

/// A DNG of a telescope's frame, whose description another program has written, names its camera and tells its time.
#[test]
fn a_dng_tells_camera_and_time() {
    let shop = night(&[DARK]);
    let (samples, mut metadata) = shop.read("light.fits");
    (metadata.black_level_adu, metadata.white_level_adu) = (Some(64.0.into()), Some(4095.0.into()));
    write_frame(&shop, "light.dng", &metadata, &samples);
    fs::remove_file(shop.path("light.dng.yaml")).unwrap();
    let mut bytes = shop.bytes("light.dng");
    let begin = b"schema: cyanometer/1";
    let at = bytes.windows(begin.len()).position(|window| window == begin).unwrap();
    bytes[at..at + begin.len()].copy_from_slice(b"a chart, noon, west.");
    fs::write(shop.path("light.dng"), bytes).unwrap();
    let told = shop.read("light.dng").1;
    assert_eq!((told.camera.as_deref(), told.exposure_time_s, told.exposure), (Some("A"), Some(2.0), None));
    assert_eq!(told.taken_as, None);
}

/// A plane of any samples with these metadata.
fn write_frame(shop: &Workshop, name: &str, metadata: &Metadata, samples: &[f32]) {
    let geometry = Geometry::new(SIZE[0], SIZE[1], &["Y"]);
    let header = FrameHeader { name: name.into(), geometry, metadata: metadata.clone() };
    shop.write(name, &header, samples);
}

/// A frame of codes, of which another program made others and kept their metadata.
#[test]
fn codes_that_another_program_scaled_are_no_codes() {
    let shop = Workshop::new();
    shop.run("render-radiance --electrons 1000,2000,3000 --size 16x12 --cfa rggb -o scene.exr", &[]);
    shop.run("add-noise scene.exr -o noisy.exr", &[]);
    shop.run("digitize noisy.exr --bits 12 -o codes.tiff", &[]);
    let (samples, metadata) = shop.read("codes.tiff");
    let largest = samples.iter().copied().fold(0.0, f32::max);
    assert!(largest * 16.0 > 4095.0);
    for (factor, wrong) in
        [(16.0, "but codes of its converter end at 4095"), (1.0 / 4095.0, "are whole numbers from 0 on")]
    {
        let scaled: Vec<f32> = samples.iter().map(|sample| sample * factor).collect();
        write_frame(&shop, "scaled.exr", &metadata, &scaled);
        let refused = shop.said("demosaic scaled.exr -o out.exr", BAD_DATA);
        assert!(refused.contains("scaled.exr: it has a sample of") && refused.contains(wrong), "{refused}");
    }
    // Of a frame of a camera the white level tells it.
    let mut of_camera = metadata;
    of_camera.adc = None;
    let scaled: Vec<f32> = samples.iter().map(|sample| sample * 16.0).collect();
    write_frame(&shop, "scaled.exr", &of_camera, &scaled);
    let refused = shop.said("demosaic scaled.exr -o out.exr", BAD_DATA);
    assert!(refused.contains("but its white level is 4095 ADU, by its metadata"), "{refused}");
}

#[test]
fn units_that_are_no_codes_are_refused_unless_metadata_say_so() {
    let shop = Workshop::new();
    for unit in ["'adu/s'", "'MJy/sr'"] {
        write(&shop, "flux.fits", [900, 1], &[("BUNIT", unit), ("EXPTIME", "2.0")]);
        for line in ["measure flux.fits", "demosaic flux.fits --black 0 -o a.exr", "preview flux.fits -o a.png"] {
            let said = shop.said(line, BAD_DATA);
            let named = format!("its samples are in `{}` (BUNIT), and neither in ADU", unit.trim_matches('\''));
            assert!(said.contains(&named) && said.contains("--metadata FILE with `quantity: adu`"), "{said}");
        }
    }
    fs::write(shop.path("m.yaml"), "schema: cyanometer/1\nquantity: adu\ncfa: rggb\n").unwrap();
    shop.run("demosaic flux.fits --metadata m.yaml --black 0 -o a.exr", &[]);
    write(&shop, "codes.fits", [900, 1], &[("BUNIT", "'counts'"), ("EXPTIME", "2.0")]);
    shop.run("demosaic codes.fits --black 0 -o a.exr", &[]);
}

/// Integers of 32 bits that differ by less than single precision tells are told; those of a sum of exposures are not.
#[test]
fn integers_that_single_precision_makes_alike_are_told() {
    let shop = Workshop::new();
    let write = |name: &str, of: fn(i32) -> i32| {
        let cards = [("SIMPLE", "T"), ("BITPIX", "32"), ("NAXIS", "2"), ("NAXIS1", "16"), ("NAXIS2", "12")];
        let cards = cards.map(|(key, value)| format!("{:<80}", format!("{key:<8}= {value}"))).concat();
        let mut bytes = format!("{cards}{:<80}{:<80}", "BAYERPAT= 'RGGB'", "END").into_bytes();
        bytes.resize(2880, b' ');
        bytes.extend((0..16 * 12).flat_map(|place| of(place).to_be_bytes()));
        bytes.resize(2 * 2880, 0);
        fs::write(shop.path(name), bytes).unwrap();
    };
    write("near.fits", |place| 1_000_000_000 + place % 64);
    write("sum.fits", |place| 60_000_000 + place * 7919 % 10_007);
    write("codes.fits", |place| 900 + place % 2);
    // Single precision has steps of 64 there.
    let near = shop.said("measure near.fits", 0);
    assert!(near.contains("near.fits: its samples have more digits than single precision"), "{near}");
    assert_eq!(near.matches("more digits").count(), 1, "{near}");
    for name in ["sum.fits", "codes.fits"] {
        assert!(!shop.said(&format!("measure {name}"), 0).contains("more digits"), "{name}");
    }
}

/// Flats through another filter than the frame are told, dark frames through any are not; exposures of a scene through two are no scene.
#[test]
fn flats_through_another_filter_are_told() {
    let shop = Workshop::new();
    let line = "correct-frame light.fits --dark dark.fits --flat flat.fits --flat-dark dark.fits -o out.exr";
    let told = "flat.fits: it was taken through the filter `R`, and light.fits through `V`";
    for (light, flat, is_told) in
        [("'V'", "'R'", true), ("'V'", "'v '", false), ("''", "'R'", false), ("'V'", "''", false)]
    {
        write(&shop, "light.fits", [900, 1], &[("INSTRUME", "'A'"), ("FILTER", light)]);
        write(&shop, "dark.fits", [100, 2], &[DARK, ("INSTRUME", "'A'"), ("FILTER", "'B'")]);
        write(&shop, "flat.fits", [2000, 3], &[("INSTRUME", "'A'"), ("IMAGETYP", "'Flat'"), ("FILTER", flat)]);
        let said = shop.said(line, 0);
        assert_eq!(said.contains(told), is_told, "{light} {flat}: {said}");
        assert!(is_told || !said.contains("filter"), "{said}");
    }
    write(&shop, "other.fits", [100, 5], &[DARK, ("INSTRUME", "'A'"), ("FILTER", "'V'")]);
    assert!(!shop.said("average-frames dark.fits other.fits -o mean.exr", 0).contains("filter"));
    write(&shop, "light.fits", [900, 1], &[("FILTER", "'V'")]);
    write(&shop, "other.fits", [900, 5], &[("FILTER", "'R'")]);
    let said = shop.said("average-frames light.fits other.fits -o mean.exr", BAD_DATA);
    assert!(said.contains("`camera_settings.filter` is R, but that of light.fits is V"), "{said}");
}

/// Overscan of the frame tells its black level, and what is picture is told with the rectangle that takes it.
#[test]
fn overscan_that_a_header_tells_is_the_border() {
    let shop = Workshop::new();
    let cards = [("INSTRUME", "'A'"), ("BIASSEC", "'[57:64,1:48]'"), ("DATASEC", "'[1:56,1:48]'")];
    write_fits(&shop, "light.fits", [64, 48], &cards, |x, y| {
        let level = if x < 56 { 900 } else { 300 };
        f64::from(level + (x * 7919 + y * 104_729) % 11)
    });
    let said = shop.said("correct-frame light.fits --black border -o out.exr", 0);
    assert!(
        said.contains("light.fits: its picture is 56x48 from 0,0 (DATASEC)") && said.contains("--crop 0,0,56,48"),
        "{said}"
    );
    assert_eq!(shop.sidecar("out.exr").masked_areas, [[56, 0, 8, 48]]);
    let (made, _) = shop.read("out.exr");
    let border: f64 = made.chunks(64).flat_map(|row| &row[56..64]).map(|left| f64::from(*left)).sum();
    assert!(border.abs() < 1e-2 && (made[0] - 600.0).abs() < 11.0, "{border} {}", made[0]);
    assert_eq!(shop.said("measure light.fits --crop 0,0,56,48", 0), "");
}
