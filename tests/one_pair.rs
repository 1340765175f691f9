//! Cameras of which one pair of darks is there: what its chance moves is moved in the gain too, and intervals hold with that.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::analysis::photon_transfer::{Condition, Level};
use cyanometer::camera::readout::ReadOut;
use cyanometer::numerics::quantiles::of_normal;
use cyanometer::numerics::variance_components::{MeanSquare, MeanSquares};
use rayon::prelude::*;
use support::misses::{CONFIDENCE, check_misses};
use support::photon_transfer::{Chance, FLAT_S, Kind, QUANTUM_EFFICIENCY, Shake, camera, found, level};

/// Temporal noise of photosites in the dark, and of rows, in electrons that are one code each: far beyond what rounding hides.
const PIXEL_E: f64 = 30.0;
const ROW_E: f64 = 9.0;

/// A sample of χ² over its degrees of freedom, after Wilson and Hilferty: of 30 and more right to a thousandth of its spread.
fn mean_of_squares(freedom: f64, chance: &mut Chance) -> f64 {
    let spread = 2.0 / (9.0 * freedom);
    (1.0 - spread + of_normal(chance.uniform()) * spread.sqrt()).powi(3)
}

/// A pair of frames whose temporal noise is drawn anew: of single photosites of such a variance, and of rows.
fn drawn(level: &Level, variance: f64, chance: &mut Chance) -> Level {
    let mut made = level.clone();
    let count = level.count();
    (made.variance, made.variance_variance) = (0.0, 0.0);
    for site in &mut made.sites {
        let [columns, rows] = site.size.map(|extent| extent as f64);
        let mut square =
            |expected: f64, freedom: f64| MeanSquare { value: expected * mean_of_squares(freedom, chance), freedom };
        let temporal = MeanSquares {
            rows: square(variance + columns * ROW_E * ROW_E, rows - 1.0),
            columns: square(variance, columns - 1.0),
            rest: square(variance, (rows - 1.0) * (columns - 1.0)),
        };
        let share = rows * columns / count;
        for part in [temporal.rows, temporal.columns, temporal.rest] {
            let of_all = share * part.freedom / (rows * columns - 2.0);
            made.variance += of_all * part.value;
            made.variance_variance += of_all * of_all * part.variance();
        }
        site.temporal = temporal;
    }
    made
}

/// Of eight flats of half to four times the variance of the dark, whose gain is off by as much as their one pair of darks is: 5 % of the intervals of
/// noise miss, where 7.5 % may by chance and 10 % did while both counted as independent; and no less than 2.5 %, 4 standard deviations to
/// either side.
#[test]
fn noise_of_one_pair_of_darks_moves_the_gain() {
    const DRAWS: u32 = 1200;
    let readout = ReadOut {
        bits: 14,
        bias_adu: 600.0,
        adu_per_e: 1.0,
        full_well_e: 15_000.0,
        read_noise_e: PIXEL_E,
        row_noise_e: ROW_E,
        dark_current_e_per_s: Some(1.0),
        ..camera(3, Kind::Ccd)
    };
    let dark = PIXEL_E * PIXEL_E;
    let condition = |signal_e: f64| Condition {
        is_lit: signal_e > 0.0,
        exposure_s: Some(FLAT_S),
        photons: (signal_e > 0.0).then_some(signal_e / QUANTUM_EFFICIENCY),
        temperature_k: None,
    };
    let of = |(place, signal_e): (u32, f64)| {
        (signal_e, level((&readout, 3, Shake::default()), condition(signal_e), signal_e, [2, 2 * place]))
    };
    let all: Vec<(f64, Level)> = (0..9).map(|place| (place, 0.5 * dark * f64::from(place))).map(of).collect();
    let whole = dark + ROW_E * ROW_E;
    let truths = [
        ("pixel_noise_e", (dark - 1.0 / 12.0).sqrt()),
        ("row_noise_e", ROW_E),
        ("dark_noise_e", (whole - 1.0 / 12.0).sqrt()),
        ("dark_noise_adu", whole.sqrt()),
        ("threshold_e", 0.5 + (0.25 + whole).sqrt()),
        ("gain_adu_per_e", 1.0),
    ];
    let held: Vec<[Option<bool>; 6]> = (0..DRAWS)
        .into_par_iter()
        .map(|draw| {
            let mut chance = Chance { camera: 40_000 + draw, drawn: 0 };
            let mut levels = all.iter().map(|(signal_e, level)| {
                // The mean is what was said, so that the variance alone is chance.
                let mean = all[0].1.mean + signal_e;
                Level { mean, ..drawn(level, dark + signal_e, &mut chance) }
            });
            let darks = [levels.next().unwrap()];
            let found = found(&levels.collect::<Vec<_>>(), &darks);
            truths.map(|(key, truth)| found.get(key).map(|interval| (interval.low..=interval.high).contains(&truth)))
        })
        .collect();
    let n = f64::from(DRAWS);
    let least = n * (1.0 - CONFIDENCE) - 4.0 * (n * CONFIDENCE * (1.0 - CONFIDENCE)).sqrt();
    for (place, (key, _)) in truths.iter().enumerate() {
        assert_eq!(check_misses(key, held.iter().map(|held| held[place])), held.len(), "{key}");
        if *key == "pixel_noise_e" || *key == "dark_noise_e" {
            let missed = held.iter().filter(|held| held[place] == Some(false)).count();
            assert!(missed as f64 >= least, "{key}: {missed} intervals missed alone");
        }
    }
}
