//! How often checks call honest frames wrong.

use crate::support::misses::trials;
use cyanometer::analysis::statistics::{Laws, Region, RegionReport, Saturated, measure_among};
use cyanometer::numerics::significance::of_smallest;
use cyanometer::propagation::Equations;
use cyanometer::stream::MemoryFrame;
use rayon::prelude::*;
use statrs::distribution::{Binomial, DiscreteCDF};
use std::sync::Mutex;

/// What is said of regions of a frame, the whole frame where there are none, whose laws are kept.
pub fn regions_among(
    laws: &mut Laws,
    frame: &MemoryFrame,
    parts: &[Region],
    equations: Equations,
) -> Vec<RegionReport> {
    let mut source = MemoryFrame::new(frame.header.clone(), frame.samples.clone());
    measure_among(laws, &mut source, parts, Saturated::Kept, equations, Some(0.5)).unwrap().regions
}

/// The smallest probability of a region, corrected for the number of tests.
pub fn corrected(region: &RegionReport) -> f64 {
    let smallest = region.tests.iter().map(|test| test.p).fold(1.0, f64::min);
    of_smallest(smallest, region.tests.len())
}

/// The corrected probabilities of so many seeds, for each part of each of the frames that are made of one. Laws hang on no seed, nor on
/// which of like sensors it is: each thread keeps its own.
pub fn over_seeds(most: u64, parts: &[Region], made: impl Fn(u64) -> Vec<MemoryFrame> + Sync + Send) -> Vec<Vec<f64>> {
    let laws: Mutex<Vec<Vec<Laws>>> = Mutex::default();
    let of = |seed: u64| -> Vec<f64> {
        let mut frames = made(seed);
        for noise in frames.iter_mut().filter_map(|frame| frame.header.metadata.noise.as_mut()) {
            noise.sensor_seed = 0;
        }
        let mut known = laws.lock().unwrap().pop().unwrap_or_default();
        known.resize_with(frames.len(), Laws::default);
        let reports =
            frames.iter().zip(&mut known).flat_map(|(frame, laws)| regions_among(laws, frame, parts, Equations::Exact));
        let found = reports.map(|region| corrected(&region)).collect();
        laws.lock().unwrap().push(known);
        found
    };
    let all: Vec<Vec<f64>> = (0..trials(most)).into_par_iter().map(of).collect();
    (0..all[0].len()).map(|i| all.iter().map(|trial| trial[i]).collect()).collect()
}

/// Fails when alarms come more often than the level, or more seldom than `share` of it: when so many, or so few, are as improbable as
/// one in 10⁴ by the binomial law.
pub fn judge(what: &str, corrected: &[f64], share: f64) {
    let n = corrected.len() as u64;
    for level in [0.05, 0.01, 1e-4] {
        let alarms = corrected.iter().filter(|p| **p < level).count() as u64;
        eprintln!("{what}, level {level}: {alarms} alarms of {n}");
        let at_least = 1.0 - alarms.checked_sub(1).map_or(0.0, |fewer| Binomial::new(level, n).unwrap().cdf(fewer));
        assert!(at_least > 1e-4, "{what}: {alarms} alarms of {n} at {level}");
        let at_most = Binomial::new(share * level, n).unwrap().cdf(alarms);
        assert!(at_most > 1e-4, "{what}: only {alarms} alarms of {n} at {level}");
    }
}
