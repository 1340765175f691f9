//! Frames that count as one and are not equally bright, dark frames that are cut off at code 0, flats whose noise shows, and codes that lie
//! several ADU apart: what is predicted of them holds, or it is said that it does not.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use std::fs;
use support::fits::{chance, write_fits, write_sensor};
use support::workshop::{BAD_DATA, Workshop};

const SIZE: [u32; 2] = [96, 96];

/// A noisy exposure of so many electrons on all photosites, or a dark frame, as a program's user makes it.
fn expose(shop: &Workshop, sensor: &str, electrons: f64, frame: u32, name: &str) {
    let scene =
        if electrons > 0.0 { format!("--electrons {electrons},{electrons},{electrons}") } else { "--dark".into() };
    shop.pipe(&format!(
        "render-radiance --quiet {sensor}{scene} --size {}x{} | mosaic | add-noise --frame {frame} | digitize --quiet -o {name}",
        SIZE[0], SIZE[1]
    ));
}

/// Twilight flats: of levels 1 to 10 the median as they are is that of one, and of levels 9 % apart nearly so, 27 % more than is told; a standard
/// deviation over 2304 photosites is known to 1.5 %.
#[test]
fn flats_are_brought_to_one_level_before_their_median() {
    let shop = Workshop::new();
    expose(&shop, "", 20_000.0, 0, "light.tiff");
    for frame in 1..=5 {
        expose(&shop, "", 0.0, frame, &format!("d{frame}.tiff"));
    }
    let levels = [8000.0, 9000.0, 10_000.0, 3000.0, 30_000.0, 8000.0, 8000.0];
    for (number, level) in levels.into_iter().enumerate() {
        expose(&shop, "", level, 10 + u32::try_from(number).unwrap(), &format!("f{number}.tiff"));
    }
    let darks = "--dark d1.tiff --dark d2.tiff --flat-dark d3.tiff --flat-dark d4.tiff --flat-dark d5.tiff";
    let said = "each was brought to one level before they were combined";
    for (flats, combine, is_leveled) in [
        ([0, 1, 2].as_slice(), "median", true),
        (&[3, 1, 4], "median", true),
        (&[3, 0, 2, 4], "median", true),
        (&[0, 1, 2, 3, 4, 5], "clipped --clip 1.5", true),
        (&[0, 5, 6], "median", false),
    ] {
        let flats: Vec<String> = flats.iter().map(|number| format!("--flat f{number}.tiff")).collect();
        let line = format!("correct-frame -v light.tiff {darks} {} --combine {combine} -o c.exr", flats.join(" "));
        let told = shop.said(&line, 0);
        assert_eq!(told.contains(said), is_leveled, "{line}: {told}");
        assert!(!told.contains("warning"), "{line}: {told}");
        let report = shop.attempt("measure --check c.exr", &[]);
        assert!(report.status.success(), "{line}: {}", String::from_utf8_lossy(&report.stdout));
        let shares = shop.sidecar("c.exr").correction.unwrap().flat.unwrap().levels;
        assert_eq!(shares.len(), if is_leveled { flats.len() } else { 0 }, "{shares:?}");
        let mean = shares.iter().sum::<f64>() / shares.len() as f64;
        assert!(!is_leveled || (mean - 1.0).abs() < 1e-12, "{shares:?}");
    }
    // One of which is dark is none.
    let line = format!(
        "correct-frame light.tiff {darks} --flat f0.tiff --flat f1.tiff --flat bare.fits --combine median -o x.exr"
    );
    write_fits(&shop, "bare.fits", SIZE, &[("BAYERPAT", "'RGGB'")], |_, _| 100.0);
    let told = shop.said(&line, BAD_DATA);
    assert!(told.contains("bare.fits") && told.contains("a flat field is lit"), "{told}");
}

/// Codes of 1 ADU per e⁻ over a bias of 500 ADU, of light that rises by `slope` from one side to the other.
fn write_lit(shop: &Workshop, name: &str, [level, slope]: [f64; 2], seed: u64) {
    write_fits(shop, name, SIZE, &[("BAYERPAT", "'RGGB'"), ("EXPTIME", "0.01")], |x, y| {
        let light = level * (1.0 + slope * (f64::from(x) / f64::from(SIZE[0]) - 0.5));
        500.0 + light + (6.0 * (light + 25.0)).sqrt() * chance(x, y, seed)
    });
}

/// Flats each of which is brighter on another side are of one level nowhere but in the middle: of light that differs by a twentieth there, 5 times
/// the noise of 10 000 e⁻, there is no median.
#[test]
fn flats_of_unlike_light_have_no_median() {
    let shop = Workshop::new();
    write_sensor(&shop, SIZE, 0.0, [0.0, 0.0, 5.0]);
    write_lit(&shop, "light.fits", [20_000.0, 0.0], 1);
    let line = "correct-frame light.fits --sensor s.yaml --black 500 --flat a.fits --flat b.fits --flat c.fits --combine median -o c.exr";
    for (slope, is_told) in [(0.0, false), (0.1, true)] {
        for (seed, (name, sign)) in (2..).map(|number| 10 * number).zip([("a", -1.0), ("b", 0.0), ("c", 1.0)]) {
            write_lit(&shop, &format!("{name}.fits"), [10_000.0 + 2000.0 * sign, slope * sign], seed);
        }
        let told = shop.said(line, 0);
        assert_eq!(told.contains("% of the flats their light differs, each brought to one level"), is_told, "{told}");
        let told = shop.said("demosaic c.exr --sigma -o r.exr", if is_told { BAD_DATA } else { 0 });
        assert_eq!(told.contains("the median or clipped mean of flats counts"), is_told, "{told}");
        assert!(!shop.said(&line.replace("median", "mean"), 0).contains("their light differs"));
    }
}

/// Exposures of a lamp that flickers by a tenth, or of one that does not: their median is the exposure in the middle.
#[test]
fn exposures_of_unlike_light_have_no_median() {
    let shop = Workshop::new();
    write_sensor(&shop, SIZE, 0.0, [0.0, 0.0, 5.0]);
    for (apart, is_told) in [(0.0, false), (0.002, false), (0.1, true)] {
        for (seed, (name, sign)) in (1..).map(|number| 10 * number).zip([("a", -1.0), ("b", 0.0), ("c", 1.0)]) {
            write_lit(&shop, &format!("{name}.fits"), [5000.0 * (1.0 + apart * sign), 0.5], seed);
        }
        for combine in ["median", "clipped", "mean"] {
            let told = shop.said(&format!("average-frames a.fits b.fits c.fits --combine {combine} -o m.exr"), 0);
            let is_told = is_told && combine != "mean";
            assert_eq!(told.contains("the light of the exposures differs, by"), is_told, "{apart} {combine}: {told}");
            let line = "demosaic m.exr --sensor s.yaml --black 500 --sigma -o r.exr";
            let told = shop.said(line, if is_told { BAD_DATA } else { 0 });
            assert_eq!(told.contains("exposures whose light differed by more than their noise"), is_told, "{told}");
        }
        assert!(shop.sidecar("m.exr").average.unwrap().unlike_levels <= 0.0);
    }
}

/// A camera of 8 bits whose black is 0, 1.5 ADU of read noise: the mean of dark codes is 0.61 ADU, and light of 6 ADU reads 5.4 behind it.
#[test]
fn dark_frames_that_are_cut_off_at_code_zero_are_told() {
    let shop = Workshop::new();
    let readout = |bias: f64| {
        format!(
            "schema: cyanometer-sensor/2\nname: webcam\nreadout: {{width: 96, height: 96, cfa: rggb, full_well_e: 12000, dark_current_e_per_s: 0, \
             temperature_k: 273, dcnu: 0, prnu: 0, read_noise_e: 75, bits: 8, bias_adu: {bias}, adu_per_e: 0.02}}\n"
        )
    };
    for (bias, is_told) in [(0.0, true), (2.0, true), (9.0, false)] {
        fs::write(shop.path("web.yaml"), readout(bias)).unwrap();
        expose(&shop, "--sensor web.yaml ", 300.0, 0, "light.tiff");
        expose(&shop, "--sensor web.yaml ", 9000.0, 6, "flat.tiff");
        for frame in 1..=5 {
            expose(&shop, "--sensor web.yaml ", 0.0, frame, &format!("d{frame}.tiff"));
        }
        let line = "correct-frame light.tiff --dark d1.tiff --dark d2.tiff --dark d3.tiff --dark d4.tiff";
        for (more, what) in
            [("", "dark"), (" --combine median", "median"), (" --flat flat.tiff --flat-dark d5.tiff", "flat")]
        {
            let told = shop.said(&format!("{line}{more} -o c.exr"), 0);
            // Of medians of four hardly any is cut off at a bias of 2 ADU.
            let is_told = is_told && (what != "median" || bias == 0.0);
            assert_eq!(told.matches("where codes are cut off").count(), usize::from(is_told), "{bias} {what}: {told}");
            if what == "dark" && is_told {
                let excess: f64 =
                    told.split("their mean is ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
                // E max(x, 0) − μ of a normal law, σ φ(μ/σ) − μ Φ(−μ/σ); the light itself loses next to nothing.
                let truth = if bias == 0.0 { 0.598 } else { 0.064 };
                assert!((excess - truth).abs() < 0.03, "{bias}: {told}");
            }
        }
    }
}

/// Flats of 30 e⁻ and a read noise of 5 e⁻: four have a relative variance of 55/(4·900) = 1.5 %, by which what is divided by them is too bright.
#[test]
fn flats_whose_noise_shows_are_told() {
    let shop = Workshop::new();
    write_sensor(&shop, SIZE, 0.0, [0.0, 0.0, 5.0]);
    write_lit(&shop, "light.fits", [20_000.0, 0.0], 1);
    let line = "correct-frame light.fits --sensor s.yaml --black 500 --flat f0.fits --flat f1.fits --flat f2.fits --flat f3.fits -o c.exr";
    for (level, is_told) in [(30.0, true), (5000.0, false)] {
        (0..4).for_each(|flat| write_lit(&shop, &format!("f{flat}.fits"), [level, 0.2], 10 * (2 + flat)));
        let told = shop.said(line, 0);
        assert_eq!(told.contains("too bright, as the mean of 1/F is above"), is_told, "{level}: {told}");
        if is_told {
            let text = told.split("what is divided by them is ").nth(1).unwrap();
            let bias: f64 = text.split(' ').next().unwrap().parse().unwrap();
            // The size of a difference is that of normal numbers to 2 %, with 4600 of which it is known to as much; light differs by a tenth.
            assert!((bias / 1.53 - 1.0).abs() < 0.12, "{told}");
        }
    }
}

/// Codes of 12 bits times 16 have a variance of (16² − 1)/12 = 21.3 ADU² of rounding, as much as a read noise of 4.6 ADU.
#[test]
fn codes_that_lie_apart_are_told_beside_a_sensor() {
    let shop = Workshop::new();
    write_sensor(&shop, SIZE, 0.0, [0.0, 0.0, 5.0]);
    for (step, is_told) in [(1.0, false), (16.0, true)] {
        write_fits(&shop, "light.fits", SIZE, &[("BAYERPAT", "'RGGB'"), ("EXPTIME", "0.01")], |x, y| {
            ((4500.0 + 156.0 * chance(x, y, 1)) / step).round() * step
        });
        for line in [
            "demosaic light.fits --sensor s.yaml --black 500 --sigma -o r.exr",
            "correct-frame light.fits --sensor s.yaml --black 500 -o c.exr",
        ] {
            let told = shop.said(line, 0);
            let text = "its codes are multiples of 16, and those of its sensor lie 1 ADU apart: the predictions lack a variance of 21.2 ADU²";
            assert_eq!(told.contains(text), is_told, "{line}: {told}");
            assert!(!is_told || told.contains("a `read_noise_e` of 6.801 in"), "{line}: {told}");
        }
    }
}
