//! Flat fields whose light falls off towards the corners: colors are those of the scene, whatever part of a class is saturated.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::formats::input::{FrameReader, InputOptions};
use cyanometer::stream::RowSource;
use std::fs;
use support::fits::{chance, write_fits, write_sensor};
use support::workshop::Workshop;

const SIZE: [u32; 2] = [161, 121];
const BLACK: f64 = 500.0;
const WHITE: f64 = 16_000.0;

/// Codes by column and row.
type Codes = Box<dyn Fn(u32, u32) -> f64>;

/// The class R, G or B of a photosite of RGGB.
fn class(x: u32, y: u32) -> usize {
    (x % 2 + y % 2) as usize
}

/// What is left of light towards the corners: half of it in the farthest.
fn falloff(x: u32, y: u32) -> f64 {
    let [x, y] = [[x, SIZE[0]], [y, SIZE[1]]].map(|[at, side]| 2.0 * f64::from(at) / f64::from(side) - 1.0);
    1.0 - 0.25 * (x * x + y * y)
}

/// Codes of such light on R, G and B, of a camera of 2 e⁻ per ADU.
fn lit(levels: [f64; 3], seed: u64) -> impl Fn(u32, u32) -> f64 {
    move |x, y| {
        let signal = levels[class(x, y)] * falloff(x, y);
        (BLACK + signal + (6.0 * (0.5 * signal + 9.0)).sqrt() * chance(x, y, seed)).min(WHITE)
    }
}

/// Means of R, G and B over photosites without a mark, and how many these are.
fn means(shop: &Workshop, name: &str) -> ([f64; 3], u64) {
    let options = InputOptions { path: Some(shop.path(name)), ..InputOptions::default() };
    let mut reader = FrameReader::open(&options).unwrap();
    reader.keep_mask();
    let mut samples = Vec::new();
    reader.read(SIZE[1] as usize, &mut samples).unwrap();
    let (mut sums, mut counts) = ([0.0; 3], [0_u64; 3]);
    for (y, rows) in samples.chunks_exact(2 * SIZE[0] as usize).enumerate() {
        let (row, marks) = rows.split_at(SIZE[0] as usize);
        for (x, sample) in row.iter().enumerate().filter(|(x, _)| marks[*x] == 0.0) {
            let class = class(u32::try_from(x).unwrap(), u32::try_from(y).unwrap());
            sums[class] += f64::from(*sample);
            counts[class] += 1;
        }
    }
    ([0, 1, 2].map(|class| sums[class] / counts[class] as f64), counts.iter().sum())
}

/// Red of the flats is saturated in the middle, where light is brightest, or is defective there; in the corners alone its mean would be
/// a tenth less of that of green.
#[test]
fn saturated_and_defective_places_tilt_no_class() {
    let shop = Workshop::new();
    let scene = [4000.0, 6000.0, 3000.0];
    write_fits(&shop, "light.fits", SIZE, &[], lit(scene, 1));
    let listed = |keep: &dyn Fn(u32, u32) -> bool| {
        let places = (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| [x, y]));
        places.filter(|[x, y]| keep(*x, *y)).map(|[x, y]| format!("{x},{y}\n")).collect::<String>()
    };
    fs::write(shop.path("middle.txt"), listed(&|x, y| class(x, y) == 0 && falloff(x, y) > 0.9)).unwrap();
    let line = "correct-frame light.fits --black 500 --white 16000 --flat flat.fits -o out.exr";
    let dead = move |x: u32, y: u32| match class(x, y) == 0 && falloff(x, y) > 0.95 {
        true => BLACK,
        false => lit([7000.0; 3], 2)(x, y),
    };
    let cases: [(&str, Codes, &str); 4] = [
        ("whole", Box::new(lit([7000.0; 3], 2)), ""),
        ("saturated", Box::new(lit([18_000.0, 9000.0, 7000.0], 2)), ""),
        ("listed", Box::new(lit([7000.0; 3], 2)), "--defects middle.txt"),
        ("found", Box::new(dead), "--find-defects=4"),
    ];
    for (what, flat, more) in cases {
        write_fits(&shop, "flat.fits", SIZE, &[], flat);
        let said = shop.said(format!("{line} {more}").trim_end(), 0);
        assert_eq!(said.contains("photosites of the flats are saturated"), what == "saturated", "{what}: {said}");
        let ([red, green, blue], count) = means(&shop, "out.exr");
        assert!(what == "whole" || count < u64::from(SIZE[0] * SIZE[1]), "{what}");
        // Noise of a mean is 1 % over the root of 1000 photosites at most; the mean of 5000 photosites of a flat has less.
        for (ratio, truth) in [(red / green, scene[0] / scene[1]), (blue / green, scene[2] / scene[1])] {
            assert!((ratio / truth - 1.0).abs() < 2e-3, "{what}: {ratio} {truth}");
        }
    }
    // Red is saturated in every other cell, and blue in the others: no mean is of the same places for both.
    let is_full = |x: u32, y: u32| class(x, y) == 2 - 2 * (y / 2 % 2) as usize;
    write_fits(&shop, "flat.fits", SIZE, &[], |x, y| if is_full(x, y) { WHITE } else { 7000.0 });
    let refused = shop.said(line, 1);
    assert!(refused.contains("nowhere are the photosites of all classes side by side"), "{refused}");
}

/// What fell off towards the corners was raised there, and its noise with it: of a sensor of 1 e⁻ per ADU the variance at a red photosite is
/// that of light and read noise, and rounding, over g², and what the one flat field adds, where half the light falls.
#[test]
fn sigma_is_that_of_the_light_at_each_place() {
    let shop = Workshop::new();
    let variance = |signal: f64| signal + 36.0 + 1.0 / 12.0;
    let exposed = |level: f64, seed| {
        move |x: u32, y: u32| {
            let signal = level * falloff(x, y);
            BLACK + signal + (6.0 * (signal + 36.0)).sqrt() * chance(x, y, seed)
        }
    };
    write_sensor(&shop, SIZE, 0.0, [0.0, 0.0, 6.0]);
    write_fits(&shop, "light.fits", SIZE, &[("EXPTIME", "1.0")], exposed(4000.0, 1));
    write_fits(&shop, "flat.fits", SIZE, &[("EXPTIME", "1.0")], exposed(7000.0, 2));
    shop.said("correct-frame light.fits --black 500 --sensor s.yaml --flat flat.fits -o c.exr", 0);
    shop.said("demosaic c.exr --method bi --sigma -o d.exr", 0);
    let frame = shop.frame_with("d.exr", &["sigma.R"]);
    let reds = || (0..SIZE[1]).step_by(2).flat_map(|y| (0..SIZE[0]).step_by(2).map(move |x| [x, y]));
    // The mean of the flat field is that of whole cells.
    let in_cells = || reds().filter(|[x, y]| x + 1 < SIZE[0] && y + 1 < SIZE[1]);
    let mean = in_cells().map(|[x, y]| falloff(x, y)).sum::<f64>() / in_cells().count() as f64;
    for from in [0.5, 0.6, 0.7, 0.8, 0.9] {
        let (mut told, mut true_variance, mut count) = (0.0, 0.0, 0.0);
        for [x, y] in reds().filter(|[x, y]| (from..from + 0.1).contains(&falloff(*x, *y))) {
            let light = falloff(x, y);
            let [signal, flat] = [4000.0, 7000.0].map(|level| level * light);
            let share = light / mean;
            true_variance += (variance(signal) + signal * signal * variance(flat) / (flat * flat)) / (share * share);
            let row = (4 * y as usize + 3) * SIZE[0] as usize;
            told += f64::from(frame.samples[row + x as usize]).powi(2);
            count += 1.0;
        }
        // Levels scatter by 2 %, and their means over 100 photosites and more by a tenth of that.
        assert!(
            count > 100.0 && (told / true_variance - 1.0).abs() < 0.01,
            "{from}: {} of {count}",
            told / true_variance
        );
    }
}

/// What a dark frame has above a level is less than its noise of 3.3 ADU. Light on 78 % of a frame, or on 31 % in its middle, has no such
/// scatter from one photosite to the next, though the standard deviation over all photosites is half of it and more than their mean.
#[test]
fn dark_frames_are_no_flats() {
    let shop = Workshop::new();
    write_fits(&shop, "light.fits", SIZE, &[], lit([4000.0; 3], 1));
    let line = "correct-frame light.fits --black 500 --white 16000 --flat flat.fits -o out.exr";
    write_fits(&shop, "flat.fits", SIZE, &[], |x, y| BLACK + 0.5 + 8.0 * chance(x, y, 2));
    let refused = shop.said(line, 1);
    assert!(refused.contains("flat.fits: its mean is 0.") && refused.contains(" and scatters by 3."), "{refused}");
    for edge in [0.75, 0.9] {
        let bright = lit([7000.0; 3], 2);
        let dark = |x: u32, y: u32| BLACK + 8.0 * chance(x, y, 2);
        let flat = |x: u32, y: u32| if falloff(x, y) > edge { bright(x, y) } else { dark(x, y) };
        write_fits(&shop, "flat.fits", SIZE, &[], flat);
        shop.said(line, 0);
    }
}

/// One row of an array has no blue photosite: its mean is none, and 0 in metadata.
#[test]
fn a_row_of_a_frame_is_divided_by_that_of_a_flat() {
    let shop = Workshop::new();
    write_fits(&shop, "light.fits", SIZE, &[], lit([4000.0; 3], 1));
    write_fits(&shop, "flat.fits", SIZE, &[], lit([7000.0; 3], 2));
    let line = "correct-frame light.fits --crop 0,0,161,1 --black 500 --white 16000 --flat flat.fits -o out.exr";
    shop.said(line, 0);
    let flat = shop.sidecar("out.exr").correction.unwrap().flat.unwrap();
    assert!(flat.means_adu[0] > 3000.0 && flat.means_adu[1] > 3000.0, "{:?}", flat.means_adu);
    assert_eq!((flat.means_adu[2], flat.photosites), (0.0, vec![80, 80, 0]));
}

/// Flats of RGGB whose greens agree and whose red is a tenth above blue are said to be of GRBG or BGGR: of the first alone the greens
/// seem to differ, and the patterns that fit are named.
#[test]
fn flats_behind_another_pattern_are_told() {
    let shop = Workshop::new();
    write_fits(&shop, "light.fits", SIZE, &[], lit([4000.0, 6000.0, 3000.0], 1));
    write_fits(&shop, "flat.fits", SIZE, &[], lit([5500.0, 7000.0, 5000.0], 2));
    let doubts = |pattern: &str| {
        for name in ["light.fits", "flat.fits"] {
            let mut bytes = fs::read(shop.path(name)).unwrap();
            let card = b"BAYERPAT= '";
            let at = bytes.windows(card.len()).position(|window| window == card).unwrap() + card.len();
            bytes[at..at + 4].copy_from_slice(pattern.to_uppercase().as_bytes());
            fs::write(shop.path(name), bytes).unwrap();
        }
        shop.said("correct-frame light.fits --black 500 --white 16000 --flat flat.fits -o out.exr", 0)
    };
    let said = doubts("grbg");
    assert!(
        said.contains("flat.fits: photosites of each 2x2 of the sensor have ")
            && said.contains("the two greens of grbg differ by 9.")
            && said.contains("is the pattern rggb or bggr?"),
        "{said}"
    );
    for pattern in ["rggb", "bggr"] {
        let said = doubts(pattern);
        assert!(!said.contains("is the pattern"), "{said}");
    }
}

/// Flats of RGGB that nothing says the array of, or that are said to have none, are told, and what was divided by them as one class is not
/// demosaicked: its colors are gone.
#[test]
fn flats_of_colors_that_count_as_one_class_are_told() {
    let shop = Workshop::new();
    for (name, levels, seed) in
        [("light.fits", [4000.0, 6000.0, 3000.0], 1), ("flat.fits", [5500.0, 9000.0, 5000.0], 2)]
    {
        write_fits(&shop, name, SIZE, &[], lit(levels, seed));
        let mut bytes = fs::read(shop.path(name)).unwrap();
        let card = b"BAYERPAT= '";
        let at = bytes.windows(card.len()).position(|window| window == card).unwrap();
        bytes[at..at + 10].copy_from_slice(b"COMMENT   ");
        fs::write(shop.path(name), bytes).unwrap();
    }
    let line = "correct-frame light.fits --black 500 --white 16000 --flat flat.fits";
    let one = "Divided as photosites of one class, frames lose the colors of their light";
    let said = shop.said(&format!("{line} -o one.exr"), 0);
    assert!(
        said.contains("as behind filters, which nothing tells: is the array rggb or bggr?") && said.contains(one),
        "{said}"
    );
    let said = shop.said(&format!("{line} --cfa monochrome -o none.exr"), 0);
    assert!(said.contains("unlike a monochrome sensor") && said.contains(one), "{said}");
    let said = shop.said(&format!("{line} --cfa rggb -o three.exr"), 0);
    assert!(!said.contains("is the array"), "{said}");
    let refused = shop.said("demosaic one.exr --cfa rggb -o rgb.exr", 1);
    assert!(refused.contains("it was divided by a flat field as photosites of one class"), "{refused}");
    shop.said("demosaic three.exr -o rgb.exr", 0);
}
