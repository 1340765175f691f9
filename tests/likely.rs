//! Sensors as cameras have them, hot pixels, jumps and lines among them, from the dark to next to full: what is predicted of their codes holds,
//! and of most it is predicted.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::extremes::predicted_in;
use crate::support;
use crate::tails::{Random, report, scene};
use cyanometer::analysis::statistics::RegionReport;
use cyanometer::camera::optics::Exposure;
use cyanometer::camera::readout::ReadOut;
use cyanometer::chain::CameraSetup;
use cyanometer::propagation::Equations;
use cyanometer::stages::demosaic::Method;
use rayon::prelude::*;
use support::alarms::{corrected, judge};
use support::chain::{demosaicked, digitized, less_darks, noisy, plane_of, settings};

/// A sensor of 10 to 14 bits whose codes are from a tenth of its read noise to ten times as fine, whose full well is about its top code, and
/// which may have hot pixels of mean 10 to 1000 e⁻ in an exposure, jumps, lines and offsets; and its full well.
fn likely(random: &mut Random, exposure_s: f64) -> (impl Fn(&mut ReadOut) + use<>, f64) {
    let mut within = |low: f64, high: f64| random.within(low, high);
    let kind = within(0.0, 4.0);
    let bits = if kind < 1.0 {
        10
    } else if kind < 3.0 {
        12
    } else {
        14
    };
    let noise_e = within(0.8_f64.ln(), 10_f64.ln()).exp();
    let adu_per_e = within(0.15_f64.ln(), 6_f64.ln()).exp() / noise_e;
    let top = f64::from((1_u32 << bits) - 1);
    let bias = (top * within(0.01, 0.06)).round();
    let full_well_e = (top - bias) / adu_per_e * within(0.9, 1.3);
    let mut log = |low: f64, high: f64| within(low.ln(), high.ln()).exp();
    let [current, prnu, hot_share, hot_e] = [log(1.0, 100.0), log(2e-3, 0.015), log(1e-4, 0.01), log(10.0, 1000.0)];
    let [rts_share, rts, row, column] = [log(1e-3, 0.1), log(1.0, 6.0), log(0.05, 0.4), log(0.03, 0.2)];
    let [dsnu, dsnu_row, dsnu_column] = [log(0.2, 1.5), log(0.03, 0.2), log(0.05, 0.4)];
    let [prnu_row, prnu_column] = [log(1e-4, 1e-3), log(1e-4, 2e-3)];
    let [has_hot, has_rts, has_lines, has_offsets, has_gains] =
        [0.7, 0.6, 0.6, 0.7, 0.5].map(|share| random.within(0.0, 1.0) < share);
    let change = move |readout: &mut ReadOut| {
        readout.dark_current_na_per_cm2 = None;
        readout.dark_current_e_per_s = Some(current);
        (readout.dcnu, readout.prnu, readout.read_noise_e) = (0.1, prnu, noise_e);
        (readout.bits, readout.bias_adu, readout.adu_per_e) = (bits, bias, adu_per_e);
        readout.full_well_e = full_well_e;
        if has_hot {
            (readout.hot_pixel_share, readout.hot_pixel_dark_current_e_per_s) = (hot_share, hot_e / exposure_s);
        }
        if has_rts {
            (readout.rts_share, readout.rts_amplitude_e) = (rts_share, rts * noise_e);
        }
        if has_lines {
            (readout.row_noise_e, readout.column_noise_e) = (row * noise_e, column * noise_e);
        }
        if has_offsets {
            readout.dsnu_e = dsnu * noise_e;
            (readout.dsnu_row_e, readout.dsnu_column_e) = (dsnu_row * noise_e, dsnu_column * noise_e);
        }
        if has_gains {
            (readout.prnu_row, readout.prnu_column) = (prnu_row, prnu_column);
        }
    };
    (change, full_well_e)
}

/// Shares of full well that green is lit by.
const LIT: [f64; 5] = [0.0, 0.003, 0.05, 0.5, 0.8];

fn light(full_well_e: f64, share: f64) -> [f64; 3] {
    [0.6, 1.0, 0.8].map(|class| class * share * full_well_e)
}

fn sensors(default: u64) -> u64 {
    std::env::var("CYANOMETER_CAMERAS").map_or(default, |count| count.parse().unwrap())
}

/// Random sensors, one frame of each level as codes, less dark frames and demosaicked: honest frames fail no more often than the level; no more
/// than one prediction of five is refused, most of them behind dark frames. CYANOMETER_CAMERAS sets how many sensors.
#[test]
fn likely_sensors_are_predicted() {
    const EXPOSURE_S: f64 = 0.033;
    let sensors = sensors(20);
    let of_sensor = |seed: u64| -> Vec<Option<RegionReport>> {
        let mut random = Random(u32::try_from(seed).unwrap(), 5);
        let (change, full_well_e) = likely(&mut random, EXPOSURE_S);
        let told = |frame: &cyanometer::stream::MemoryFrame| {
            let is_told = cyanometer::propagation::of_frame(&frame.header, Equations::Exact);
            if let Err(why) = &is_told {
                eprintln!("{seed}: {why}");
            }
            is_told.is_ok().then(|| report(frame))
        };
        let at = |(index, share): (usize, &f64)| {
            #[expect(clippy::cast_possible_truncation, reason = "samples are single precision")]
            let electrons = light(full_well_e, *share).map(|electrons| electrons as f32);
            let scene = scene([200, 160], electrons, &change);
            let plane = plane_of(&digitized(&noisy(&scene, &settings(seed * 100 + index as u64))));
            let less = less_darks(&plane, &scene, seed * 100 + index as u64, 3);
            [told(&plane), told(&less), told(&demosaicked(&plane, Method::Bilinear))]
        };
        LIT.iter().enumerate().flat_map(at).collect()
    };
    let reports: Vec<(u64, Option<RegionReport>)> = (0..sensors)
        .into_par_iter()
        .flat_map_iter(|seed| of_sensor(seed).into_iter().map(move |of| (seed, of)))
        .collect();
    let refused = reports.iter().filter(|(_, report)| report.is_none()).count();
    eprintln!("{refused} of {} refused", reports.len());
    assert!(5 * refused <= reports.len(), "{refused} of {}", reports.len());
    // What is made of one frame goes together.
    let of_frame = |made: &[(u64, Option<RegionReport>)]| {
        let told: Vec<f64> = made.iter().filter_map(|(_, report)| report.as_ref().map(corrected)).collect();
        let least = told.iter().copied().fold(1.0, f64::min) * told.len().max(1) as f64;
        if least < 1e-4 {
            eprintln!("sensor {}: {told:?}", made[0].0);
        }
        least
    };
    judge("likely sensors", &reports.chunks(3).map(of_frame).collect::<Vec<_>>(), 0.0);
}

/// How long predictions of such sensors take: `CYANOMETER_CAMERAS=200 cargo test --release --test all predictions_of_likely -- --ignored
/// --nocapture`.
#[test]
#[ignore = "a measurement"]
fn predictions_of_likely_sensors_take_milliseconds() {
    const EXPOSURE_S: f64 = 0.1;
    let mut found: Vec<(bool, f64)> = Vec::new();
    for seed in 0..sensors(200) {
        let mut random = Random(u32::try_from(seed).unwrap(), 6);
        let (change, full_well_e) = likely(&mut random, EXPOSURE_S);
        let mut sensor = support::sensor();
        let mut readout = support::readout();
        change(&mut readout);
        let has_tails = readout.hot_pixel_share > 0.0 || readout.rts_share > 0.0;
        sensor.readout = Some(readout);
        let exposure = Exposure { exposure_s: EXPOSURE_S, f_number: 8.0, lens_transmittance: 1.0 };
        let setup = CameraSetup::new(sensor, exposure);
        for share in LIT {
            let (seconds, refused) = predicted_in(&setup, light(full_well_e, share)).unwrap();
            if seconds > 0.1 || refused.is_some() {
                eprintln!("{seed} at {share}: {:.1} ms {}", 1e3 * seconds, refused.as_deref().unwrap_or_default());
            }
            found.push((has_tails, if refused.is_some() { f64::INFINITY } else { seconds }));
        }
    }
    for has_tails in [false, true] {
        let mut times: Vec<f64> = found.iter().filter(|(has, _)| *has == has_tails).map(|(_, time)| *time).collect();
        times.sort_by(f64::total_cmp);
        let above = |limit: f64| times.iter().filter(|time| **time > limit && time.is_finite()).count();
        let refused = times.iter().filter(|time| time.is_infinite()).count();
        let slowest = times.iter().filter(|time| time.is_finite()).fold(0.0, |most: f64, time| most.max(*time));
        let what = if has_tails { "with hot pixels or jumps" } else { "without" };
        eprintln!(
            "{what}: {} predictions, {refused} refused, median {:.2} ms, {} above 10 ms, {} above 0.1 s, slowest {slowest:.2} s",
            times.len(),
            1e3 * times[times.len() / 2],
            above(0.01),
            above(0.1)
        );
    }
}
