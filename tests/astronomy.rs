//! Frames of cameras that tell little of themselves: dark and bias frames that cannot be theirs, samples that are saturated where nothing
//! tells, and standard deviations that need no more than is used.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use std::fs;
use support::fits::{chance, write_fits, write_sensor};
use support::workshop::{BAD_DATA, Workshop};

const SIZE: [u32; 2] = [384, 32];

/// A FITS of the codes `of` column and row, by the camera A, with these cards beside.
fn write(shop: &Workshop, name: &str, cards: &[(&str, &str)], of: impl Fn(u32, u32) -> f64) {
    write_fits(shop, name, SIZE, &[&[("INSTRUME", "'A'")], cards].concat(), of);
}

/// A sky that rises from `low` to `high` ADU along the rows, over a bias of 500 ADU and a read noise of 5 ADU.
fn sky(low: f64, high: f64, seed: u64) -> impl Fn(u32, u32) -> f64 {
    move |x, y| {
        let signal = low + (high - low) * f64::from(x) / f64::from(SIZE[0]);
        500.0 + signal + (6.0 * (25.0 + 0.5 * signal)).sqrt() * chance(x, y, seed)
    }
}

#[test]
fn darks_of_another_scale_or_gain_are_told() {
    let shop = Workshop::new();
    let darks: [(&str, f64, f64, Option<&str>); 5] = [
        ("good", 1.0, 1.0, None),
        ("shifted", 4.0, 1.0, Some("its codes are multiples of 1, those of what came off of 4")),
        ("scaled", 4.01, 1.0, Some("of it its mean is below that of what came off")),
        ("loud", 1.0, 5.0, Some("what came off scatters more than it in")),
        ("doubled", 2.02, 1.0, Some("2 times its black level")),
    ];
    for (name, scale, gain, told) in darks {
        let bright = name == "doubled";
        write(&shop, "light.fits", &[], if bright { sky(3000.0, 9000.0, 1) } else { sky(0.0, 9000.0, 1) });
        // A half of the frame lies below what was scaled, and one scatters by less than what is loud.
        let least = [("scaled", 3000.0), ("loud", 300.0)].into_iter().find(|(of, _)| *of == name);
        if let Some((_, high)) = least {
            write(&shop, "light.fits", &[], sky(0.0, high, 1));
        }
        // Factors that are no whole numbers leave no step, where codes are not rounded first.
        let whole = move |code: f64| if scale.fract() == 0.0 { code.round() } else { code };
        let codes = move |seed| move |x, y| scale * whole(500.0 + gain * 5.0 * 6_f64.sqrt() * chance(x, y, seed));
        write(&shop, "dark.fits", &[], codes(2));
        write(&shop, "other.fits", &[], codes(3));
        write(&shop, "third.fits", &[], codes(4));
        for more in [
            "",
            "--dark other.fits",
            "--dark other.fits --combine median",
            "--dark other.fits --dark third.fits --combine median",
        ] {
            let line = format!("correct-frame light.fits --white 16383 -o out.exr --dark dark.fits {more}");
            let said = shop.said(line.trim_end(), 0);
            // Nothing but a black level tells it of light that is bright throughout, as a mean of two is of less noise.
            match told.filter(|_| !bright) {
                Some(told) => assert!(said.contains(told), "{name} {more}: {said}"),
                None => assert_eq!(said, "", "{name} {more}"),
            }
        }
        let metadata =
            "schema: cyanometer/1\nquantity: adu\ncamera: A\ncfa: rggb\nblack_level_adu: 500\nwhite_level_adu: 16383\n";
        fs::write(shop.path("light.fits.yaml"), metadata).unwrap();
        let said = shop.said("correct-frame light.fits --dark dark.fits -o out.exr", 0);
        assert!(told.map_or(said.is_empty(), |told| said.contains(told)), "{name}: {said}");
        fs::remove_file(shop.path("light.fits.yaml")).unwrap();
    }
}

/// A black level of the masked border counts the dark signal of a long exposure, 300 ADU here, which bias frames lack.
#[test]
fn bias_frames_beside_a_black_level_with_dark_signal_are_not_doubted() {
    let shop = Workshop::new();
    let metadata =
        "schema: cyanometer/1\nquantity: adu\ncamera: A\ncfa: rggb\nblack_level_adu: 800\nwhite_level_adu: 16383\n";
    fs::write(shop.path("light.fits.yaml"), metadata).unwrap();
    write(&shop, "light.fits", &[], sky(300.0, 9000.0, 1));
    write(&shop, "bias.fits", &[("IMAGETYP", "'Bias Frame'")], sky(0.0, 0.0, 2));
    assert_eq!(shop.said("correct-frame light.fits --bias bias.fits -o out.exr", 0), "");
    // Dark frames have that signal; and what is next to nothing has lost its bias.
    write(&shop, "dark.fits", &[("IMAGETYP", "'Dark Frame'")], sky(0.0, 0.0, 2));
    let told = "are these of another converter, or was their bias subtracted?";
    assert!(shop.said("correct-frame light.fits --dark dark.fits -o out.exr", 0).contains(told));
    write(&shop, "bias.fits", &[("IMAGETYP", "'Bias Frame'")], |x, y| 20.0 + 5.0 * chance(x, y, 3));
    assert!(shop.said("correct-frame light.fits --bias bias.fits -o out.exr", 0).contains(told));
}

fn sensor(shop: &Workshop, dark_current_e_per_s: f64) {
    write_sensor(shop, SIZE, dark_current_e_per_s, [0.1, 0.01, 3.0]);
}

#[test]
fn standard_deviations_need_the_time_of_dark_current_alone() {
    let shop = Workshop::new();
    write(&shop, "light.fits", &[], sky(300.0, 9000.0, 1));
    write(&shop, "dark.fits", &[("IMAGETYP", "'Dark Frame'")], sky(0.0, 0.0, 2));
    let line = "demosaic light.fits --black 500 --sensor s.yaml --sigma -o out.exr";
    sensor(&shop, 0.5);
    let missing = shop.said(line, BAD_DATA);
    assert!(missing.contains("`exposure_time_s`") && missing.ends_with("give --exposure S\n"), "{missing}");
    shop.said(&format!("{line} --exposure 120"), 0);
    assert_eq!(shop.sidecar("out.exr").exposure_time_s, Some(120.0));
    write(&shop, "light.fits", &[("EXPTIME", "120.0")], sky(300.0, 9000.0, 1));
    let by_option = shop.read("out.exr").0;
    shop.said(line, 0);
    assert_eq!(shop.read("out.exr").0, by_option);
    // Without dark current no time counts, neither of the frame nor of darks.
    sensor(&shop, 0.0);
    write(&shop, "light.fits", &[], sky(300.0, 9000.0, 1));
    shop.said(line, 0);
    shop.said("correct-frame light.fits --dark dark.fits --sensor s.yaml -o c.exr", 0);
    shop.said("demosaic c.exr --sigma -o out.exr", 0);
}

#[test]
fn samples_heaped_at_the_top_are_told_where_nothing_else_tells_them() {
    let shop = Workshop::new();
    write(&shop, "light.fits", &[], |x, y| sky(300.0, 9000.0, 1)(x, y).min(8000.0));
    let heap = "of its samples are at the largest value, 8000, as saturated ones are";
    for line in [
        "demosaic light.fits --black 500 -o rgb.tiff",
        "correct-frame light.fits --black 500 -o c.exr",
        "measure light.fits",
        "preview light.fits -o a.png",
    ] {
        let said = shop.said(line, 0);
        assert!(said.contains(heap) && said.contains("no white level tells that they are"), "{line}: {said}");
        assert_eq!(said.matches("largest value").count(), 1, "{said}");
    }
    let said = shop.said("demosaic light.fits --black 500 --white 16383 -o rgb.tiff", 0);
    assert!(said.contains(heap) && said.contains("their white level, 16383, is above it"), "{said}");
    // Parted from its sidecar, which knows nothing of it either.
    fs::remove_file(shop.path("rgb.tiff.yaml")).unwrap();
    let said = shop.said("measure rgb.tiff", 0);
    assert!(
        said.contains("at the largest value, 7500") && said.contains("the white level that was known marks none"),
        "{said}"
    );
    // What a level marks is told by that.
    let said = shop.said("demosaic light.fits --black 500 --white 8000 -o rgb.exr", 0);
    assert!(said.contains("pixels were made of saturated samples") && !said.contains("largest value"), "{said}");
    write(&shop, "light.fits", &[], sky(300.0, 9000.0, 1));
    assert_eq!(shop.said("demosaic light.fits --black 500 -o rgb.exr", 0), "");
    // Flats are cut off too.
    write(&shop, "dark.fits", &[], |x, y| 500.0 + 12.0 * chance(x, y, 5));
    write(&shop, "flat.fits", &[], |x, y| sky(3000.0, 9000.0, 2)(x, y).min(8000.0));
    let line = "correct-frame light.fits --dark dark.fits --flat flat.fits --flat-dark dark.fits -o c.exr";
    let said = shop.said(line, 0);
    assert!(said.contains("flat.fits: ") && said.contains("of its samples are at the largest value"), "{said}");
    let said = shop.said(&format!("{line} --white 8000"), 0);
    assert!(said.contains("photosites of the flats are saturated") && !said.contains("largest value"), "{said}");
    // All at the largest code of 12 bits.
    write(&shop, "light.fits", &[], |_, _| 4095.0);
    let said = shop.said("measure light.fits", 0);
    assert!(said.contains("12288 of its samples are at the largest value, 4095"), "{said}");
}

/// The sensor of the frames has a bias of 500 ADU.
#[test]
fn levels_far_from_the_bias_of_a_sensor_that_is_named_are_told() {
    let shop = Workshop::new();
    sensor(&shop, 0.0);
    write(&shop, "light.fits", &[], sky(300.0, 9000.0, 1));
    for (black, is_told) in [(0, true), (300, true), (480, false), (500, false), (700, false), (4000, true)] {
        let said = shop.said(&format!("demosaic light.fits --sensor s.yaml --black {black} -o rgb.exr"), 0);
        let told = format!("--black {black} is far from the bias of");
        assert_eq!(said.contains(&told), is_told, "{black}: {said}");
    }
    for (level, is_told) in [(100.0, true), (450.0, true), (495.0, false), (520.0, false)] {
        write(&shop, "dark.fits", &[], |x, y| level + 12.0 * chance(x, y, 5));
        let said = shop.said("correct-frame light.fits --sensor s.yaml --dark dark.fits -o c.exr", 0);
        assert_eq!(said.contains("ADU at least"), is_told, "{level}: {said}");
    }
    // A level that the file tells is held against it too.
    for (black, is_told) in [(0, true), (480, false), (4000, true)] {
        let metadata = format!("schema: cyanometer/1\nquantity: adu\ncfa: rggb\nblack_level_adu: {black}\n");
        fs::write(shop.path("light.fits.yaml"), metadata).unwrap();
        let auto = format!("light.fits: its black level, {black} ADU, is far from the bias of s, 500 ADU");
        let option = format!("light.fits: --black {black} is far from the bias of s, 500 ADU");
        for (line, told) in [
            ("demosaic light.fits -o rgb.exr".to_owned(), &auto),
            ("correct-frame light.fits --black auto -o c.exr".to_owned(), &auto),
            (format!("demosaic light.fits --black {black} -o rgb.exr"), &option),
        ] {
            let said = shop.said(&format!("{line} --sensor s.yaml"), 0);
            assert_eq!(said.contains(told), is_told, "{line}: {said}");
        }
    }
}
