//! Frames of sensors that are read by row and column, through several amplifiers, and whose black level drifts, to test with.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use super::alarms::{judge, over_seeds, regions_among};
use super::chain::{demosaicked, digitized, less_darks, noisy, plane_of, settings, with_readout};
use super::{at, expected};
use cyanometer::analysis::statistics::{Laws, Region, RegionReport, Saturated, measure};
use cyanometer::camera::readout::ReadOut;
use cyanometer::camera::taps::{TapLayout, Taps};
use cyanometer::metadata::Scene;
use cyanometer::numerics::significance::{of_chi_square, of_smallest};
use cyanometer::propagation::Equations;
use cyanometer::propagation::covariance::symmetric;
use cyanometer::propagation::pixels::PixelNoise;
use cyanometer::stages::demosaic::Method;
use cyanometer::stream::MemoryFrame;
use rayon::prelude::*;

/// Seeds of which a third is tried, or all.
pub const SEEDS: u64 = 900;

/// The read-out of a CMOS sensor whose rows and columns are as noisy as its photosites.
pub fn cmos(readout: &mut ReadOut) {
    readout.dark_current_na_per_cm2 = None;
    readout.dark_current_e_per_s = Some(60.0);
    readout.dcnu = 0.15;
    readout.prnu = 0.006;
    readout.read_noise_e = 6.0;
    readout.row_noise_e = 4.0;
    readout.column_noise_e = 2.0;
    readout.dsnu_e = 5.0;
    readout.dsnu_row_e = 1.5;
    readout.dsnu_column_e = 7.0;
    readout.prnu_row = 0.002;
    readout.prnu_column = 0.004;
    readout.full_well_e = 30_000.0;
    readout.bits = 14;
    readout.bias_adu = 500.0;
    readout.adu_per_e = 0.4;
}

/// The frame of a uniform scene.
pub fn scene(size: [usize; 2], electrons: [f32; 3]) -> MemoryFrame {
    let mut frame = expected(size[0], size[1], |_, _, class| electrons[class as usize]);
    frame.header.metadata.scene = Some(Scene::uniform("test", electrons.map(f64::from)));
    with_readout(&mut frame, cmos);
    frame
}

pub fn regions(frame: &MemoryFrame, regions: &[Region]) -> Vec<RegionReport> {
    regions_among(&mut Laws::default(), frame, regions, Equations::Exact)
}

/// Layouts with numbers of taps that differ in everything.
pub fn several_taps() -> [Taps; 5] {
    let of = |layout, count: usize| Taps {
        layout,
        gain: vec![1.0, 1.02, 0.97, 1.05][..count].to_vec(),
        offset_e: vec![3.0, -20.0, 11.0, 0.0][..count].to_vec(),
        read_noise_e: vec![4.0, 9.0, 14.0, 2.0][..count].to_vec(),
    };
    [
        of(TapLayout::Columns, 2),
        of(TapLayout::Columns, 3),
        of(TapLayout::LeftRight, 2),
        of(TapLayout::TopBottom, 2),
        of(TapLayout::Quadrants, 4),
    ]
}

/// The frame of a uniform scene of a sensor that is read through taps, whose middle is that of the frame.
pub fn tapped(size: [usize; 2], electrons: [f32; 3], taps: &Taps) -> MemoryFrame {
    let mut frame = scene(size, electrons);
    with_readout(&mut frame, |readout| {
        quiet_lines(readout);
        readout.dsnu_e = 5.0;
        (readout.width, readout.height) = (u32::try_from(size[0]).unwrap(), u32::try_from(size[1]).unwrap());
        readout.taps = Some(taps.clone());
    });
    frame
}

/// The same of a sensor whose rows and columns are as noisy as its photosites.
pub fn tapped_with_lines(size: [usize; 2], electrons: [f32; 3], taps: &Taps) -> MemoryFrame {
    let mut frame = tapped(size, electrons, taps);
    with_readout(&mut frame, |readout| {
        let taps = readout.taps.take();
        cmos(readout);
        readout.taps = taps;
    });
    frame
}

/// Without what rows and columns share.
pub fn quiet_lines(readout: &mut ReadOut) {
    (readout.row_noise_e, readout.column_noise_e, readout.dsnu_e) = (0.0, 0.0, 0.0);
    (readout.dsnu_row_e, readout.dsnu_column_e) = (0.0, 0.0);
    (readout.prnu_row, readout.prnu_column) = (0.0, 0.0);
}

/// The frame of a uniform scene of a sensor whose black level drifts, by as much as photosites have of their own.
pub fn drifting(size: [usize; 2], electrons: [f32; 3], rows: f64) -> MemoryFrame {
    let mut frame = scene(size, electrons);
    with_readout(&mut frame, |readout| (readout.black_drift_e, readout.black_drift_rows) = (7.0, rows));
    frame
}

/// False alarms of the regions of frames come no more often than the level says.
pub fn regions_cover(what: &str, parts: &[Region], made: impl Fn(u64) -> Vec<MemoryFrame> + Sync + Send) {
    regions_cover_over(SEEDS, what, parts, made);
}

/// The same over fewer seeds, as of frames less dark frames of their own, each of which is predicted by itself.
pub fn regions_cover_over(
    seeds: u64,
    what: &str,
    parts: &[Region],
    made: impl Fn(u64) -> Vec<MemoryFrame> + Sync + Send,
) {
    for (index, corrected) in over_seeds(seeds, parts, made).iter().enumerate() {
        judge(&format!("{what}, {index}"), corrected, 0.0);
    }
}

/// An exposure of a scene at each stage before demosaicking, and less two dark frames.
pub fn before_demosaicking(scene: &MemoryFrame, seed: u64) -> Vec<MemoryFrame> {
    let electrons = noisy(scene, &settings(seed));
    let codes = digitized(&electrons);
    let plane = plane_of(&codes);
    let less = less_darks(&plane, scene, seed, 2);
    vec![electrons, codes, plane, less]
}

pub fn regions_or(frame: &MemoryFrame, region: Region) -> cyanometer::error::Result<()> {
    let mut source = MemoryFrame::new(frame.header.clone(), frame.samples.clone());
    measure(&mut source, &[region], Saturated::Kept, Equations::Exact, Some(0.5)).map(|_| ())
}

/// Standard deviations beside pixels against the scatter of 3000 frames, each of another sensor: chi-square of 2999.
pub fn sigma_covers(what: &str, scene: &MemoryFrame, methods: &[Method], places: &[[usize; 2]]) {
    for &method in methods {
        let made = |seed: u64| demosaicked(&plane_of(&digitized(&noisy(scene, &settings(seed)))), method);
        let frames = 3000;
        let all: Vec<Vec<[f64; 3]>> = (0..frames)
            .into_par_iter()
            .map(|seed| {
                let frame = made(seed);
                places.iter().map(|[x, y]| [0, 1, 2].map(|c| f64::from(at(&frame, *x, *y, c)))).collect()
            })
            .collect();
        let noise = PixelNoise::of(&made(0).header).unwrap();
        let n = frames as f64;
        let mut smallest = 1.0_f64;
        for (index, place) in places.iter().enumerate() {
            let mean = [0, 1, 2].map(|c| all.iter().map(|frame| frame[index][c]).sum::<f64>() / n);
            let predicted = symmetric(&noise.covariance(*place, mean).0);
            for c in 0..3 {
                let square: f64 = all.iter().map(|frame| (frame[index][c] - mean[c]).powi(2)).sum();
                let p = of_chi_square(square / predicted[(c, c)], n - 1.0);
                let ratio = square / (n - 1.0) / predicted[(c, c)];
                assert!(p > 1e-6, "{what} {method:?} {place:?} {c}: {ratio}");
                smallest = smallest.min(p);
            }
        }
        assert!(of_smallest(smallest, 3 * places.len()) > 1e-4, "{what} {method:?}: {smallest}");
    }
}
