//! Numbers at the ends of their ranges: what each part gives there, against references in 60 digits, and how long it takes.
//!
//! With CYANOMETER_EXTREMES=FILE each case appends a row to the table of docs/stability.md; `scripts/stability` makes it so.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::analysis::characterization::Signals;
use cyanometer::analysis::characterization::regression::{FitSettings, fit};
use cyanometer::analysis::statistics::{Saturated, measure};
use cyanometer::camera::linearity::Linearization;
use cyanometer::camera::optics::{Exposure, Vignetting};
use cyanometer::camera::readout::ReadOut;
use cyanometer::cfa::CfaPattern;
use cyanometer::chain::{CameraSetup, Predictor, PredictorSettings, uniform_frame};
use cyanometer::color::{Space, White, lab_from_xyz, xyy_from_xyz, xyz_from_lab};
use cyanometer::frame::Geometry;
use cyanometer::metadata::Scene;
use cyanometer::numerics::least_squares::Problem;
use cyanometer::numerics::moments::Moments;
use cyanometer::propagation::Equations;
use cyanometer::random::Source;
use cyanometer::random::poisson::{quantile, tails};
use cyanometer::spectrum::{Curve, WavelengthGrid, fold};
use cyanometer::stages::adc::{AdcSettings, Digitize};
use cyanometer::stages::black::Black;
use cyanometer::stages::demosaic::{Demosaic, Method};
use cyanometer::stages::noise::AddNoise;
use cyanometer::stages::noise::{NoiseSettings, rectified_mean, rectified_mean_square};
use cyanometer::stages::to_xyz::ColorSettings;
use cyanometer::stages::transfer::Transfer;
use cyanometer::stream::MemoryFrame;
use cyanometer::units::QuantityKind;
use nalgebra::DMatrix;
use rayon::prelude::*;
use std::fmt::Write as _;
use std::fs::OpenOptions;
use std::io::Write as _;
use std::time::Instant;
use support::{expected, header, readout};

/// References made by tests/reference/extremes.py: kind, inputs, values.
fn references(kind: &str) -> Vec<(Vec<String>, Vec<f64>)> {
    let lines = include_str!("reference/extremes.csv").lines();
    let found: Vec<_> = lines
        .filter_map(|line| line.strip_prefix(kind)?.strip_prefix(','))
        .map(|rest| {
            let (inputs, values) = rest.split_once(',').unwrap();
            let values = values.split(' ').map(|value| value.parse().unwrap()).collect();
            (inputs.split(' ').map(str::to_owned).collect(), values)
        })
        .collect();
    assert!(!found.is_empty(), "no references of {kind}");
    found
}

fn number(text: &str) -> f64 {
    text.parse().unwrap()
}

/// |a − b| relative to b; 0 where both are the same, however large or small.
fn off(found: f64, reference: f64) -> f64 {
    if found == reference { 0.0 } else { (found - reference).abs() / reference.abs() }
}

/// Tells a case: what is expected and why, and what was found within so many seconds.
fn told(part: &str, case: &str, expected: &str, found: &str, error: Option<f64>, seconds: f64) {
    let Some(path) = std::env::var_os("CYANOMETER_EXTREMES") else { return };
    let mut file = OpenOptions::new().append(true).create(true).open(path).unwrap();
    let error = error.map_or("—".to_owned(), |error| if error == 0.0 { "0".into() } else { format!("{error:.1e}") });
    let time = match seconds {
        s if s < 1e-6 => "< 1 µs".to_owned(),
        s if s < 1e-3 => format!("{:.0} µs", s * 1e6),
        s if s < 1.0 => format!("{:.1} ms", s * 1e3),
        s => format!("{s:.1} s"),
    };
    let mut line = String::new();
    write!(line, "{part} | {case} | {expected} | {found} | {error} | {time}").unwrap();
    writeln!(file, "{line}").unwrap();
}

/// Runs a case that gives what was found and its error, which must stay within `bound`.
#[track_caller]
fn case(part: &str, case: &str, expected: &str, bound: f64, run: impl FnOnce() -> (String, f64)) {
    let start = Instant::now();
    let (found, error) = run();
    told(part, case, expected, &found, Some(error), start.elapsed().as_secs_f64());
    assert!(error <= bound, "{case}: {found}, off by {error:e}, more than {bound:e}");
}

/// Runs a case that is either as it should be or not.
#[track_caller]
fn fact(part: &str, case: &str, expected: &str, run: impl FnOnce() -> (String, bool)) {
    let start = Instant::now();
    let (found, holds) = run();
    told(part, case, expected, &found, None, start.elapsed().as_secs_f64());
    assert!(holds, "{case}: {found}");
}

// --- rates -----------------------------------------------------------------------------------------------------------

/// Counts are exact: the very count of the reference, at every word and on both sides of every switch of algorithm.
#[test]
fn counts_of_poisson() {
    let references = references("quantile");
    let mut rates: Vec<&str> = references.iter().map(|(inputs, _)| inputs[0].as_str()).collect();
    rates.dedup();
    for rate in rates {
        let of_rate = references.iter().filter(|(inputs, _)| inputs[0] == rate);
        let expected = "the count of the reference at all words: the law's inverse is exact";
        case("Poisson numbers", &format!("mean {rate}, 9 words from 0 to 2⁶⁴ − 1"), expected, 0.0, || {
            let (mut worst, mut last) = (0.0_f64, 0.0);
            for (inputs, values) in of_rate {
                last = quantile(number(rate), inputs[1].parse().unwrap());
                worst = worst.max((last - values[0]).abs());
            }
            (format!("{last} at the largest word"), worst)
        });
    }
    let expected = "no count is told from its neighbors by a double: the expansion about the mean, within 12 σ";
    case("Poisson numbers", "mean 1e15, 3 words", expected, 12.0, || {
        let found = [0, 1 << 63, u64::MAX].map(|word| (quantile(1e15, word) - 1e15) / 1e15_f64.sqrt());
        (format!("{:.2}, {:.2}, {:.2} σ", found[0], found[1], found[2]), found[0].abs().max(found[2].abs()))
    });
    fact("Poisson numbers", "mean 0, −1, infinite", "0, 0, infinite", || {
        let found = [0.0, -1.0, f64::INFINITY].map(|rate| quantile(rate, u64::MAX));
        (format!("{found:?}"), found == [0.0, 0.0, f64::INFINITY])
    });
    // Loader's and Temme's forms, rounding included: 1e-13 of the smaller tail (see the module).
    for (inputs, values) in references_of_tails() {
        let case_name = format!("P(X ≤ {0}), P(X > {0}) at mean {1}", inputs[0], inputs[1]);
        let (count, rate) = (number(&inputs[0]), number(&inputs[1]));
        case("Poisson tails", &case_name, "the smaller tail to 1e-12 of itself", 1e-12, || {
            let (below, above) = tails(count, rate);
            let error = if values[0] < values[1] { off(below, values[0]) } else { off(above, values[1]) };
            (format!("{below:.6e}, {above:.6e}"), error)
        });
    }
}

fn references_of_tails() -> Vec<(Vec<String>, Vec<f64>)> {
    // Tails below the smallest normal double have not all its digits.
    references("tails").into_iter().filter(|(_, values)| values[0].min(values[1]) > 1e-290).collect()
}

/// Frames with expected electrons at the ends: finite counts, clipped at full well, and refusals of what is no rate.
#[test]
fn rates_of_frames() {
    for rate in [0.0_f32, 1e-38, 1e-9, 1e6, 1e9, 1e15, 3.4e38] {
        let case = format!("a frame that expects {rate:e} e⁻");
        fact("Poisson numbers", &case, "finite electrons, at most full well and read noise", || {
            let light = expected(16, 16, |_, _, _| rate);
            let stage = AddNoise::new(&light.header, &NoiseSettings::default()).unwrap();
            let samples = light.through(&stage).unwrap().0.samples;
            let largest = samples.iter().copied().fold(f32::MIN, f32::max);
            let readout = readout();
            let most = readout.full_well_e + 10.0 * readout.read_noise_e;
            (format!("at most {largest} e⁻"), samples.iter().all(|e| e.is_finite() && f64::from(*e) < most))
        });
    }
    fact(
        "Poisson numbers",
        "a frame that expects NaN, −1, ∞ e⁻",
        "NaN stays, −1 is 0, ∞ is full well; counted",
        || {
            let light = expected(3, 2, |x, _, _| [f32::NAN, -1.0, f32::INFINITY][x]);
            let stage = AddNoise::new(&light.header, &NoiseSettings::default()).unwrap();
            let (noisy, counts) = light.through(&stage).unwrap();
            let odd = noisy.samples.iter().filter(|e| !e.is_finite()).count();
            (format!("{odd} of {} samples not finite; {counts:?}", noisy.samples.len()), odd == 6)
        },
    );
}

// --- dark current, optics --------------------------------------------------------------------------------------------

#[test]
fn dark_current_from_1_to_1000_kelvin() {
    let readout = readout();
    let scale = {
        let (kelvin, law) = references("dark").into_iter().find(|(kelvin, _)| kelvin[0] == "300.0").unwrap();
        readout.dark_current_e_per_s(number(&kelvin[0])) / law[0]
    };
    for (kelvin, law) in references("dark") {
        let kelvin = number(&kelvin[0]);
        let expected =
            "the law's shape relative to 300 K, to the rounding of an exponent of up to 6706; a clean zero below";
        // The exponent E/2kT is rounded to 2⁻⁵³ of itself and its exponential by as many parts.
        let bound = 4.0 * f64::EPSILON * (1.0 + 6710.0 / kelvin);
        case("dark current", &format!("{kelvin} K"), expected, bound, || {
            let found = readout.dark_current_e_per_s(kelvin);
            let reference = law[0] * scale;
            let error = if reference < f64::MIN_POSITIVE { found.abs() } else { off(found, reference) };
            (format!("{found:.6e} e⁻/s"), error)
        });
    }
    for (kelvin, exposure_s) in [(1.0, 1e5), (300.0, 1e-9), (1000.0, 1e5)] {
        let case = format!("a dark frame of {exposure_s:e} s at {kelvin} K");
        fact("dark current", &case, "finite electrons, at most full well and read noise", || {
            let mut dark = expected(8, 8, |_, _, _| 0.0);
            dark.header.metadata.exposure.as_mut().unwrap().exposure_s = exposure_s;
            let settings = NoiseSettings { temperature_k: Some(kelvin), ..NoiseSettings::default() };
            let samples = dark.through(&AddNoise::new(&dark.header, &settings).unwrap()).unwrap().0.samples;
            let most = readout.full_well_e + 10.0 * readout.read_noise_e;
            let mean = samples.iter().map(|e| f64::from(*e)).sum::<f64>() / samples.len() as f64;
            (format!("{mean:.1} e⁻ on average"), samples.iter().all(|e| e.is_finite() && f64::from(*e) < most))
        });
    }
}

#[test]
fn optics_wide_open_and_stopped_down() {
    for (inputs, values) in references("illumination") {
        let exposure = Exposure { exposure_s: 1.0, f_number: number(&inputs[0]), lens_transmittance: 1.0 };
        case("optics", &format!("irradiance per radiance at f/{}", inputs[0]), "π/(4N² + 1)", 1e-15, || {
            let found = exposure.image_illumination_sr();
            (format!("{found:.9e} sr"), off(found, values[0]))
        });
    }
    fact("optics", "f/0.1", "refused: no lens has it", || {
        let exposure = Exposure { exposure_s: 1.0, f_number: 0.1, lens_transmittance: 1.0 };
        let found = exposure.checked();
        (found.as_ref().map_or_else(ToString::to_string, |_| "accepted".into()), found.is_err())
    });
    for (inputs, values) in references("vignetting") {
        let tangent = number(&inputs[0]);
        let degrees = tangent.atan().to_degrees();
        case(
            "optics",
            &format!("cos⁴ at {degrees:.6}° off the axis"),
            "a rational form: no angle is formed",
            1e-14,
            || {
                // Two photosites, each half a pitch from the axis.
                let found = Vignetting::new(2, 1, 2000.0 * tangent, 1.0).row(0).next().unwrap();
                (format!("{found:.9e}"), off(found, values[0]))
            },
        );
    }
    fact("optics", "a sensor of one photosite", "on the axis: no vignetting", || {
        let found = Vignetting::new(1, 1, 6.8, 1e-6).row(0).next().unwrap();
        (format!("{found}"), found == 1.0)
    });
}

// --- moments ---------------------------------------------------------------------------------------------------------

fn moments(columns: &[Vec<f32>]) -> Moments {
    let mut moments = Moments::new(columns.len());
    moments.add(&columns.iter().map(Vec::as_slice).collect::<Vec<_>>());
    moments
}

#[test]
fn moments_far_from_zero() {
    let one = "moments";
    fact(
        one,
        "mean 10⁹, σ 10⁻³",
        "single precision holds one value there: σ is 0, not noise of rounding",
        || {
            let found = moments(&[(0..10_000_i16)
                .map(|i| cyanometer::frame::to_sample(1e9 + 1e-3 * f64::from(i % 3)))
                .collect()]);
            (
                format!("mean {}, variance {:?}", found.mean[0], found.covariance(0, 0)),
                found.covariance(0, 0) == Some(0.0),
            )
        },
    );
    case(one, "mean 2²⁴, neighbors one step apart", "the variance of ±1: nothing cancels", 1e-12, || {
        let found = moments(&[(0..10_000_u32).map(|i| (16_777_215 + i % 2) as f32).collect()]);
        let variance = found.covariance(0, 0).unwrap();
        (format!("variance {variance}"), off(variance, 0.25 * 10_000.0 / 9_999.0))
    });
    case(one, "2³⁰ samples, merged by halves", "the variance of a block: merging loses nothing", 1e-12, || {
        let block = moments(&[(0..1_024_u16).map(|i| 1e6 + f32::from(i)).collect()]);
        let mut all = block.clone();
        for _ in 0..20 {
            let half = all.clone();
            all.merge(&half);
        }
        let exact = (1024.0 * 1024.0 - 1.0) / 12.0 * (all.count as f64 / (all.count - 1) as f64);
        assert_eq!(all.count, 1 << 30);
        (format!("variance {:.6}", all.covariance(0, 0).unwrap()), off(all.covariance(0, 0).unwrap(), exact))
    });
    fact(one, "one sample", "a mean and no variance", || {
        let found = moments(&[vec![7.0]]);
        (format!("mean {}, variance {:?}", found.mean[0], found.covariance(0, 0)), found.covariance(0, 0).is_none())
    });
    fact(one, "all samples the same, 3.4e38", "variance 0, no overflow", || {
        let found = moments(&[vec![f32::MAX; 5000]]);
        let is_exact = found.mean[0] == f64::from(f32::MAX) && found.covariance(0, 0) == Some(0.0);
        (format!("mean {:e}, variance {:?}", found.mean[0], found.covariance(0, 0)), is_exact)
    });
    case(one, "two channels in proportion", "a correlation of 1, to rounding", 1e-12, || {
        let first: Vec<f32> = (0..50_000_u32).map(|i| (1000 + i.wrapping_mul(7919) % 4001) as f32).collect();
        let second = first.iter().map(|x| 4.0 * x).collect();
        let found = moments(&[first, second]);
        let c = |i, j| found.covariance(i, j).unwrap();
        let correlation = c(0, 1) / (c(0, 0) * c(1, 1)).sqrt();
        (format!("{correlation}"), off(correlation, 1.0))
    });
}

// --- regression ------------------------------------------------------------------------------------------------------

/// Regressors with a condition number that is known: columns turned by a half, the second scaled down.
#[test]
fn regression_near_singular() {
    for condition in [1e1, 1e3, 9e3, 1.1e4, 1e8, 1e15] {
        let expected =
            if condition < 1e4 { "solved, off by rounding times the condition" } else { "refused: not determined" };
        let start = Instant::now();
        let count = 64_usize;
        // cos and sin over whole turns are orthogonal and of one length.
        let turn = |i: usize| std::f64::consts::TAU * i as f64 / count as f64;
        let regressors = DMatrix::from_fn(count, 2, |i, j| {
            let (u, v) = (turn(i).cos(), turn(i).sin() / condition);
            if j == 0 { u + v } else { u - v }
        });
        let truth = DMatrix::from_row_slice(2, 1, &[0.75, -0.5]);
        let responses = &regressors * &truth;
        let found =
            Problem { regressors: &regressors, responses: &responses, group: 1, penalty: None, equality: None }.solve();
        let seconds = start.elapsed().as_secs_f64();
        let case = format!("two columns, condition {condition:e}");
        match found {
            Ok(fit) => {
                let error = (&fit.coefficients - &truth).abs().max();
                told("regression", &case, expected, &format!("condition {:.4e}", fit.condition), Some(error), seconds);
                assert!(condition < 1e4 && error < 32.0 * f64::EPSILON * condition, "{case}: {error:e}");
                assert!(off(fit.condition, condition) < 1e-6, "{case}: {}", fit.condition);
            }
            Err(why) => {
                told("regression", &case, expected, &format!("refused at {:.4e}", why.condition), None, seconds);
                assert!(condition > 1e4, "{case}: {why:?}");
            }
        }
    }
    let signals = |camera: &[f64]| {
        let camera = DMatrix::from_row_slice(camera.len() / 3, 3, camera);
        Signals { xyz: camera.clone(), camera }
    };
    for (name, samples) in [
        ("samples that are all the same", vec![1.0, 2.0, 3.0, 1.0, 2.0, 3.0, 1.0, 2.0, 3.0, 1.0, 2.0, 3.0]),
        ("samples in proportion", vec![1.0, 2.0, 3.0, 2.0, 4.0, 6.0, 4.0, 8.0, 12.0, 8.0, 16.0, 24.0]),
        ("samples in a plane", vec![1.0, 0.0, 1.0, 0.0, 1.0, 1.0, 1.0, 1.0, 2.0, 2.0, 1.0, 3.0]),
        (
            "light of one wavelength that only green sees",
            vec![0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0, 3.0, 0.0, 0.0, 4.0, 0.0],
        ),
    ] {
        fact("regression", name, "refused: they do not determine a matrix", || {
            let signals = signals(&samples);
            let settings = FitSettings { training: vec![0, 1, 2, 3], ..FitSettings::default() };
            let found = fit(&signals, &signals, &settings, None);
            (found.as_ref().map_or_else(ToString::to_string, |_| "fitted".into()), found.is_err())
        });
    }
}

// --- demosaicking, converter, patterns, transfer -----------------------------------------------------------------------

#[test]
fn hues_about_no_green() {
    for green in [0.0_f32, 1e-30, -1.0, 1e-3] {
        let case = format!("SHTI of red 100, blue 50, green {green:e} above black");
        fact("demosaicking", &case, "finite: the bilinear value where the hue is none, counted", || {
            let mut header = header(QuantityKind::Adu, Geometry::new(8, 8, &["Y"]));
            header.metadata.cfa = Some(CfaPattern::Rggb.into());
            header.metadata.black_level_adu = Some(cyanometer::camera::levels::BlackLevel::Uniform(0.0));
            let plane = support::frame(header, |x, y, _| [100.0, green, green, 50.0][y % 2 * 2 + x % 2]);
            let stage = Demosaic::new(&plane.header, Method::SmoothHue, Black::Auto, None).unwrap();
            let (camera, counts) = plane.through(&stage).unwrap();
            let odd = camera.samples.iter().filter(|sample| !sample.is_finite()).count();
            (format!("{odd} samples not finite, {} fell back", counts.undefined_hue), odd == 0)
        });
    }
}

/// Codes against the rule itself, worked out sample by sample: the nearest whole number, ties away from zero, within the rails.
#[test]
fn converters_at_their_rails() {
    let charges: Vec<f32> = vec![-1e30, -1e6, -0.5, 0.0, 0.5, 1.0, 1.5, 2.5, 1e3, 65_535.4, 1e9, 3e38];
    for (bits, bias, slope) in
        [(1, 0.0, 1.0), (16, 0.0, 1.0), (8, -100.0, 1.0), (12, 0.0, 1e-9), (12, 0.0, 1e9), (16, 65_535.0, 2.0)]
    {
        let case = format!("{bits} bits, bias {bias}, {slope:e} ADU per e⁻, charges from −10³⁰ to 3·10³⁸");
        fact("converter", &case, "the nearest code, ties away from zero, within the rails, all finite", || {
            let header = header(QuantityKind::Electrons, Geometry::new(charges.len(), 1, &["Y"]));
            let frame = MemoryFrame::new(header, charges.clone());
            let settings = AdcSettings { bits: Some(bits), bias_adu: Some(bias), adu_per_e: Some(slope) };
            let stage = match Digitize::new(&frame.header, &settings) {
                Ok(stage) => stage,
                Err(refused) => return (format!("refused: {refused}"), true),
            };
            let codes = frame.through(&stage).unwrap().0.samples;
            let top = f64::from((1_u32 << bits) - 1);
            let ideal = |e: &f32| (bias + slope * f64::from(*e)).round().clamp(0.0, top);
            let wrong = charges.iter().zip(&codes).filter(|(e, code)| ideal(e) != f64::from(**code)).count();
            (format!("{wrong} of {} codes off", codes.len()), wrong == 0)
        });
    }
}

#[test]
fn patterns_up_to_100_per_cent() {
    for (inputs, values) in references("rectified") {
        let sigma = number(&inputs[0]);
        let expected = "the moments of a normal number that is not below zero";
        case("patterns", &format!("non-uniformity of {} %", 100.0 * sigma), expected, 1e-14, || {
            let (mean, square) = (rectified_mean(sigma), rectified_mean_square(sigma));
            (format!("mean 1 + {:.4e}", values[2]), off(mean, values[0]).max(off(square, values[1])))
        });
    }
}

#[test]
fn transfer_of_a_thousand_lines() {
    let line = |cte: f64, undone: bool| {
        let geometry = Geometry::new(1, 1000, &["Y"]);
        if undone { Transfer::undoing(cte, &geometry) } else { Transfer::new(cte, &geometry) }
    };
    for (cte, undone, accepted) in [
        (1.0, false, true),
        (0.9999, false, true),
        (0.9999, true, true),
        (0.99, true, false),
        (0.9, false, false),
        (0.9, true, false),
    ] {
        let verb = if undone { "undone" } else { "followed" };
        let expected =
            if accepted { "accepted" } else { "refused: errors would grow, or charge spread, beyond all use" };
        fact("charge transfer", &format!("{cte} over 1000 lines, {verb}"), expected, || {
            let found = line(cte, undone);
            (found.as_ref().map_or_else(ToString::to_string, |_| "accepted".into()), found.is_ok() == accepted)
        });
    }
    case("charge transfer", "0.9999 over 1000 lines and back", "what it was, to 10⁻⁹ of the largest", 1e-9, || {
        let pass = |transfer: &Transfer, lines: &[f64]| -> Vec<f64> {
            let mut passage = transfer.passage();
            (0..lines.len())
                .map(|y| {
                    passage.entering(y)[0] = lines[y];
                    passage.leaving(y)[0]
                })
                .collect()
        };
        let original: Vec<f64> = (0..1000_u32).map(|y| f64::from(y * 7919 % 1009)).collect();
        let moved = pass(&line(0.9999, false).unwrap(), &original);
        let back = pass(&line(0.9999, true).unwrap(), &moved);
        let worst = original.iter().zip(&back).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / 1008.0;
        (format!("line 999 loses {:.2} %", 100.0 * (1.0 - moved[999] / original[999].max(1.0))), worst)
    });
}

// --- wavelengths, colors ---------------------------------------------------------------------------------------------

/// Integrals of spectra whose value is known by hand, with a response of 1 between 400 and 700 nm.
#[test]
fn spectra_of_every_shape() {
    let grid = WavelengthGrid { start_nm: 400.0, end_nm: 700.0, ..WavelengthGrid::default() };
    let integral = |nm: &[f64], values: &[f64]| -> f64 {
        let (points, widths) = grid.points_between(nm.iter().copied());
        let folded = fold(nm, &points, &widths);
        folded.weights.iter().zip(values).map(|(w, v)| w * v).sum()
    };
    let shapes: [(&str, Vec<f64>, Vec<f64>, f64); 5] = [
        (
            "a line 0.002 nm wide between two steps",
            vec![399.0, 589.299, 589.3, 589.301, 701.0],
            vec![0.0, 0.0, 1.0, 0.0, 0.0],
            0.001,
        ),
        ("a step within 10⁻⁶ nm", vec![300.0, 550.0, 550.000_001, 800.0], vec![0.0, 0.0, 1.0, 1.0], 150.0 - 0.5e-6),
        ("two points", vec![400.0, 700.0], vec![1.0, 3.0], 600.0),
        ("a spectrum that ends inside the band", vec![300.0, 500.0], vec![2.0, 2.0], 200.0),
        ("a spectrum of one point", vec![500.0], vec![1.0], 0.0),
    ];
    for (name, nm, values, expected) in shapes {
        case("wavelengths", name, "the integral by hand", 1e-9, || {
            let found = integral(&nm, &values);
            (format!("{found}"), if expected == 0.0 { found.abs() } else { off(found, expected) })
        });
    }
    for (name, nm) in [
        ("wavelengths that descend", vec![500.0, 400.0]),
        ("a wavelength twice", vec![400.0, 500.0, 500.0]),
        ("a wavelength of 0, −1, NaN", vec![0.0, f64::NAN]),
    ] {
        fact("wavelengths", name, "refused", || {
            let found = Curve::new(nm.clone(), vec![1.0; nm.len()]);
            (found.as_ref().map_or_else(Clone::clone, |_| "accepted".into()), found.is_err())
        });
    }
}

#[test]
fn colors_at_and_beyond_the_ends() {
    let white = [95.047, 100.0, 108.883];
    for (inputs, values) in references("lab") {
        let xyz = [0, 1, 2].map(|i| number(&inputs[i]));
        case(
            "colors",
            &format!("L*a*b* of Y = {:e} of 100", xyz[1]),
            "CIE 1976, its straight part below zero too",
            1e-12,
            || {
                let lab = lab_from_xyz(xyz, white);
                // Differences of nearly equal f: relative to the f that they are differences of.
                let scale = (lab[0].abs() + 16.0) * 5.0;
                let worst = (0..3).map(|i| (lab[i] - values[i]).abs() / scale).fold(0.0, f64::max);
                let back = xyz_from_lab(lab, white);
                let closed = (0..3).map(|i| (back[i] - xyz[i]).abs() / (white[i] + xyz[i].abs())).fold(0.0, f64::max);
                (format!("L* {:.6}, back to XYZ within {closed:.1e}", lab[0]), worst.max(closed))
            },
        );
    }
    for (name, xyz) in [("black", [0.0; 3]), ("a negative sum", [-1.0, 0.5, -1.0])] {
        fact("colors", &format!("xyY of {name}"), "no chromaticity: that of the white stands in", || {
            let found = xyy_from_xyz(xyz, [0.3127, 0.329]);
            (format!("{found:?}"), found == [0.3127, 0.329, xyz[1]])
        });
    }
    fact("colors", "xyY of a negative Z, x + y > 1", "as it is: noise may lead there", || {
        let [x, y, _] = xyy_from_xyz([6.0, 5.0, -1.0], [0.3127, 0.329]);
        (format!("x + y = {}", x + y), (x + y - 1.1).abs() < 1e-15)
    });
}

/// The reads of a sensor with numbers at the ends: accepted ones work, others are refused with the key.
#[test]
fn sensors_at_the_ends() {
    type Change = fn(&mut ReadOut);
    let changes: [(&str, Change, bool); 8] = [
        ("read noise 0", |r| r.read_noise_e = 0.0, true),
        ("1 bit, bias 0", |r| (r.bits, r.bias_adu) = (1, 0.0), true),
        ("17 bits", |r| r.bits = 17, false),
        ("a slope of 1e-300", |r| r.adu_per_e = 1e-300, true),
        ("full well NaN", |r| r.full_well_e = f64::NAN, false),
        ("full well 1 e⁻", |r| r.full_well_e = 1.0, false),
        ("read noise above full well", |r| r.read_noise_e = 1e6, false),
        ("−20 K", |r| r.temperature_k = -20.0, false),
    ];
    for (name, change, accepted) in changes {
        fact("sensor files", name, if accepted { "accepted" } else { "refused with its key" }, || {
            let mut readout = readout();
            change(&mut readout);
            let found = readout.check();
            (found.clone().err().unwrap_or_else(|| "accepted".into()), found.is_ok() == accepted)
        });
    }
}

// --- whole cameras -----------------------------------------------------------------------------------------------------

/// Numbers that look like chance [Steele2014, SplitMix64].
struct Chance(u64);

impl Chance {
    fn word(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn share(&mut self) -> f64 {
        (self.word() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Between two numbers, each power of ten as often.
    fn log(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.share())
    }

    /// As [`Self::log`], and in one case of six 0.
    fn log_or_none(&mut self, low: f64, high: f64) -> f64 {
        if self.word().is_multiple_of(6) { 0.0 } else { self.log(low, high) }
    }
}

/// A camera of any numbers that a sensor file may have, one source of noise up to 10¹² times another, and a scene for it.
fn any_camera(chance: &mut Chance) -> (CameraSetup, [f64; 3]) {
    let mut sensor = support::sensor();
    let bits = u32::try_from(1 + chance.word() % 16).unwrap();
    let top = f64::from((1_u32 << bits) - 1);
    let full_well_e = chance.log(100.0, 1e6);
    let readout = sensor.readout.as_mut().unwrap();
    readout.full_well_e = full_well_e;
    readout.bits = bits;
    readout.adu_per_e = top / full_well_e * chance.log(1e-2, 1e2);
    readout.bias_adu = top * (chance.share() - 0.1);
    readout.read_noise_e = chance.log_or_none(1e-6, 0.3 * full_well_e);
    readout.prnu = chance.log_or_none(1e-6, 0.5);
    readout.dcnu = chance.log_or_none(1e-6, 2.0);
    readout.dark_current_na_per_cm2 = None;
    readout.dark_current_e_per_s = Some(chance.log_or_none(1e-6, 1e6));
    readout.temperature_k = 200.0 + 200.0 * chance.share();
    let exposure = Exposure { exposure_s: chance.log(1e-9, 1e5), f_number: 8.0, lens_transmittance: 1.0 };
    let mut setup = CameraSetup::new(sensor, exposure);
    setup.noise.seed = chance.word();
    setup.noise.sensor_seed = chance.word();
    setup.noise.without = Source::ALL[..5].iter().copied().filter(|_| chance.word().is_multiple_of(5)).collect();
    setup.method = Method::ALL[usize::try_from(chance.word()).unwrap() % Method::ALL.len()];
    let light = [0; 3].map(|_| chance.log_or_none(1e-6, 10.0 * full_well_e));
    (setup, light)
}

/// Alarms of a camera's frames at every stage, how many were judged and how many refused, and the longest that one took in s.
type Outcome = (Vec<String>, u32, u32, f64);

/// Judges a frame of each stage at a level.
fn judged(index: u64, (setup, light): (CameraSetup, [f64; 3]), level: f64) -> Outcome {
    let (mut alarms, mut judged, mut void, mut slowest) = (Vec::new(), 0, 0, 0.0_f64);
    let scene = Scene::uniform("any", light);
    let expected = uniform_frame(setup.plane([24, 20], scene).unwrap(), light).unwrap();
    let stages = setup.stages(&expected.header).unwrap();
    let charge = expected.through(&stages.add_noise).unwrap().0;
    let codes = charge.through(&stages.digitize).unwrap().0;
    let camera = codes.through(&stages.demosaic).unwrap().0;
    for (stage, frame) in [("electrons", charge), ("codes", codes), ("demosaicked", camera)] {
        let mut source = MemoryFrame::new(frame.header, frame.samples);
        let started = Instant::now();
        let found = measure(&mut source, &[], Saturated::Kept, Equations::Exact, Some(level));
        slowest = slowest.max(started.elapsed().as_secs_f64());
        match found.map(|report| report.check.unwrap()) {
            Ok(verdict) if verdict.passed => judged += 1,
            Ok(verdict) => {
                judged += 1;
                alarms.push(format!("camera {index}, {stage}: p = {:.1e}", verdict.corrected_p));
            }
            Err(refused) => {
                void += 1;
                assert!(refused.to_string().contains("nothing can be checked"), "camera {index}: {refused}");
            }
        }
    }
    (alarms, judged, void, slowest)
}

fn cameras() -> u64 {
    std::env::var("CYANOMETER_CAMERAS").map_or(1000, |count| count.parse().unwrap())
}

/// Frames of cameras drawn at random are as predicted, at every stage: alarms at a level of 10⁻³ come no more often than that.
/// What cannot be predicted is refused with the reason.
#[test]
fn cameras_drawn_at_random_are_as_predicted() {
    let start = Instant::now();
    let outcomes =
        (0..cameras()).into_par_iter().map(|index| judged(index, any_camera(&mut Chance(index)), LEVEL)).collect();
    tell_of_cameras("cameras", outcomes, start);
}

/// The same of sensors that are read by row and column.
#[test]
fn sensors_of_rows_and_columns_drawn_at_random_are_as_predicted() {
    let start = Instant::now();
    let of_rows = |index: u64| {
        let mut chance = Chance(index);
        let (mut setup, light) = any_camera(&mut chance);
        let readout = setup.sensor.readout.as_mut().unwrap();
        let full_well_e = readout.full_well_e;
        for part in [
            &mut readout.row_noise_e,
            &mut readout.column_noise_e,
            &mut readout.dsnu_e,
            &mut readout.dsnu_row_e,
            &mut readout.dsnu_column_e,
        ] {
            *part = chance.log_or_none(1e-6, 0.03) * full_well_e;
        }
        for part in [&mut readout.prnu_row, &mut readout.prnu_column] {
            *part = chance.log_or_none(1e-6, 0.05);
        }
        readout.check().unwrap();
        (setup, light)
    };
    let outcomes = (0..cameras() / 2).into_par_iter().map(|index| judged(index, of_rows(index), LEVEL)).collect();
    tell_of_cameras("sensors of rows and columns", outcomes, start);
}

/// The level at which frames of cameras at random are judged.
const LEVEL: f64 = 1e-3;

fn tell_of_cameras(what: &str, outcomes: Vec<Outcome>, start: Instant) {
    let (cameras, level) = (outcomes.len(), LEVEL);
    let alarms: Vec<&String> = outcomes.iter().flat_map(|(alarms, ..)| alarms).collect();
    let (judged, void) = outcomes.iter().fold((0, 0), |(judged, void), found| (judged + found.1, void + found.2));
    let slowest = outcomes.iter().map(|found| found.3).fold(0.0, f64::max);
    let expected = f64::from(judged) * level;
    let found = format!(
        "{} alarms among {judged} checks, {void} refused; the slowest took {:.0} ms",
        alarms.len(),
        1e3 * slowest
    );
    let what = format!("{cameras} {what} at random, each frame judged at a level of {level}");
    told("predictions", &what, "no more alarms than the level", &found, None, start.elapsed().as_secs_f64());
    // A Poisson number of this mean is above mean + 4 σ + 3 in fewer than one case of 10⁴.
    assert!((alarms.len() as f64) <= expected + 4.0 * expected.sqrt() + 3.0, "{found}\n{alarms:#?}");
}

// --- how long predictions take -----------------------------------------------------------------------------------------

/// Seconds that the processor has worked for this thread; of the clock where no system tells.
fn worked_s(since: Instant) -> f64 {
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let of_thread = told.and_then(|told| told.split(' ').next()?.parse::<f64>().ok()).map(|ns| ns * 1e-9);
    of_thread.unwrap_or_else(|| since.elapsed().as_secs_f64())
}

/// A camera as [`any_camera`], or of what few sensors have too: rows and columns, hot pixels and jumps, a bent converter; with dark
/// frames or none.
fn any_sensor(index: u64) -> (&'static str, CameraSetup, [f64; 3]) {
    let chance = &mut Chance(index.wrapping_mul(0x5851_f42d_4c95_7f2d));
    let (mut setup, light) = any_camera(chance);
    let readout = setup.sensor.readout.as_mut().unwrap();
    let full_well_e = readout.full_well_e;
    setup.dark_frames = [0, 0, 1, 7][usize::try_from(chance.word() % 4).unwrap()];
    let kind =
        ["plain", "rows and columns", "hot pixels and jumps", "bent converters"][usize::try_from(index % 4).unwrap()];
    let has_tails = kind == "hot pixels and jumps";
    if kind == "rows and columns" || has_tails && chance.word().is_multiple_of(4) {
        (readout.row_noise_e, readout.column_noise_e) =
            (chance.log_or_none(1e-6, 0.03) * full_well_e, chance.log_or_none(1e-6, 0.03) * full_well_e);
        readout.dsnu_e = chance.log_or_none(1e-6, 0.03) * full_well_e;
        (readout.prnu_row, readout.prnu_column) = (chance.log_or_none(1e-6, 0.05), chance.log_or_none(1e-6, 0.05));
    }
    let [has_hot, has_rts] = [(); 2].map(|()| !chance.word().is_multiple_of(3));
    if has_tails && has_hot {
        readout.hot_pixel_share = chance.log(1e-6, 1.0);
        readout.hot_pixel_dark_current_e_per_s = chance.log(1e-3, 1e3) * full_well_e / setup.exposure.exposure_s;
    }
    if has_tails && (has_rts || !has_hot) {
        (readout.rts_share, readout.rts_amplitude_e) = (chance.log(1e-6, 1.0), chance.log(1e-6, 0.3) * full_well_e);
    }
    if kind == "bent converters" {
        let top = f64::from((1_u32 << readout.bits) - 1);
        let bend = (chance.share() - 0.5) / top;
        readout.linearization = Some(Linearization::polynomial(vec![1.0, bend]).unwrap());
    }
    (kind, setup, light)
}

/// How long the prediction of one setting takes, CPU of all stages, and why it is refused where it is.
pub fn predicted_in(setup: &CameraSetup, light: [f64; 3]) -> Option<(f64, Option<String>)> {
    setup.sensor.readout().unwrap().check().ok()?;
    let color = ColorSettings {
        xyz_from_camera: [[0.4, 0.3, 0.2], [0.2, 0.7, 0.1], [0.0, 0.1, 0.9]],
        method: None,
        is_relative: false,
        residual: None,
        space: Space::Xyz,
        white: White::D65,
        white_luminance: None,
    };
    // Each in a thread of its own, which remembers nothing of others.
    std::thread::scope(|scope| {
        let run = || {
            let start = Instant::now();
            let before = worked_s(start);
            let mut predictor =
                Predictor::new(PredictorSettings { color: Some(color), ..PredictorSettings::of(setup.clone()) })
                    .ok()?;
            let refused = predictor.predict(light).err().map(|why| why.to_string());
            Some((worked_s(start) - before, refused))
        };
        scope.spawn(run).join().unwrap()
    })
}

/// How long predictions of random sensors take: `CYANOMETER_CAMERAS=2000 cargo test --release --test all predictions_take --
/// --ignored --nocapture`; CYANOMETER_FIRST is the number of the first; with CYANOMETER_TELL each is written out.
#[test]
#[ignore = "a measurement"]
fn predictions_take_milliseconds() {
    let first: u64 = std::env::var("CYANOMETER_FIRST").map_or(0, |first| first.parse().unwrap());
    let mut found: Vec<(&str, u64, f64)> = Vec::new();
    let (mut refused, mut not_accepted) = (0, 0);
    for index in first..first + cameras() {
        let (kind, setup, light) = any_sensor(index);
        if std::env::var_os("CYANOMETER_TELL").is_some() {
            let readout = setup.sensor.readout.as_ref().unwrap();
            eprintln!(
                "{index} {light:?} {:?} {:?} {:?} darks {} {:?} {:?}",
                readout, setup.exposure, setup.noise, setup.dark_frames, setup.method, setup.sensor.name
            );
        }
        let Some((seconds, why_refused)) = predicted_in(&setup, light) else {
            not_accepted += 1;
            continue;
        };
        refused += u32::from(why_refused.is_some());
        if seconds > 0.01 {
            let why = why_refused.map_or(String::new(), |why| format!(", refused: {why}"));
            eprintln!("{kind} {index}: {:.1} ms{why}", 1e3 * seconds);
        }
        found.push((kind, index, seconds));
    }
    eprintln!("{} predicted, {refused} of them refused; {not_accepted} are no sensors", found.len());
    let mut kinds: Vec<&str> = found.iter().map(|(kind, ..)| *kind).collect();
    kinds.sort_unstable();
    kinds.dedup();
    for kind in kinds {
        let mut times: Vec<(f64, u64)> =
            found.iter().filter(|(of, ..)| *of == kind).map(|(_, index, seconds)| (*seconds, *index)).collect();
        times.sort_by(|a, b| a.0.total_cmp(&b.0));
        let above = times.iter().filter(|(seconds, _)| *seconds > 0.01).count();
        let (median, (slowest, of)) = (times[times.len() / 2].0, times[times.len() - 1]);
        let told_of = format!(
            "median {:.2} ms, {above} above 10 ms, the slowest {:.1} ms (number {of})",
            1e3 * median,
            1e3 * slowest
        );
        eprintln!("{kind}: {} cameras, {told_of}", times.len());
        let what = format!("all stages of {} cameras at random, {kind}: CPU of one thread", times.len());
        told("predictions", &what, "none above 10 ms", &told_of, None, times.iter().map(|(seconds, _)| seconds).sum());
    }
}
