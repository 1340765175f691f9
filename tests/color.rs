//! Characterization on the sky library, and on a camera whose matrix is known.
#![allow(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

use cyanometer::analysis::characterization::evaluation::{
    EvaluationSettings, Filling, SampleEvaluation, SampleExposure, evaluate,
};
use cyanometer::analysis::characterization::regression::{FitSettings, FittedMatrix, Regression, fit, residuals};
use cyanometer::analysis::characterization::training::{average_sample, spanning_subset};
use cyanometer::analysis::characterization::{Signals, responses, signals};
use cyanometer::camera::optics::Exposure;
use cyanometer::camera::response::SpectralResponse;
use cyanometer::camera::sensor::Sensor;
use cyanometer::color::difference::Difference;
use cyanometer::color::{Space, White, lab_about, lab_from_xyz, matrix};
use cyanometer::error::Result;
use cyanometer::formats::{data, spectral};
use cyanometer::frame::Geometry;
use cyanometer::metadata::{FrameHeader, Metadata, Scene};
use cyanometer::numerics::significance;
use cyanometer::propagation::sampling::{Place, Sampling, SamplingBasis};
use cyanometer::propagation::{self, Equations, FramePrediction, Prediction};
use cyanometer::spectrum::{Curve, SpectralLibrary, WavelengthGrid};
use cyanometer::stages::adc::{AdcSettings, Digitize};
use cyanometer::stages::demosaic::Method;
use cyanometer::stages::demosaic::weights::WeightTable;
use cyanometer::stages::noise::{AddNoise, NoiseSettings};
use cyanometer::stages::to_xyz::ColorSettings;
use cyanometer::stream::Stage;
use cyanometer::units::QuantityKind;
use std::path::Path;

fn sky_library() -> SpectralLibrary {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("sample_data/skies/sky912.exr");
    let (library, warnings) = spectral::read_library(&path, None).unwrap();
    assert!(warnings.is_empty(), "{warnings:?}");
    library
}

/// Least squares on some samples.
fn sky_rad_ls(signals: &Signals, samples: &[usize]) -> Result<FittedMatrix> {
    fit(signals, signals, &FitSettings { training: samples.to_vec(), ..FitSettings::default() }, None)
}

/// The matrix in the default sensor's file is what its comment says: the fit to all skies, to half a unit of the seventh digit.
#[test]
fn the_default_sensors_matrix_is_the_fit_to_the_sky_library() {
    let loaded = data::load_sensor(data::DEFAULT_SENSOR).unwrap();
    let library = sky_library();
    let observer = data::load_observer().unwrap();
    let grid = WavelengthGrid::default();
    let found = signals(&library, &loaded.sensor, loaded.response().unwrap(), &observer, &grid).unwrap();
    let all: Vec<usize> = (0..912).collect();
    let fitted = sky_rad_ls(&found, &all).unwrap();
    let stated = loaded.sensor.xyz_from_camera.unwrap();
    for (row, stated) in fitted.xyz_from_camera.iter().zip(stated) {
        for (element, stated) in row.iter().zip(stated) {
            assert!((element / stated - 1.0).abs() < 5e-7, "{element} {stated}");
        }
    }
    assert!((100.0..300.0).contains(&fitted.condition), "{}", fitted.condition);
    assert_eq!((fitted.count, fitted.rank), (912, 3));
}

/// A camera whose response to energy is a mixture of the color-matching functions obeys Luther's condition: the fit
/// must find the mixture again, exactly, from any training set that determines it.
#[test]
fn a_colorimetric_camera_is_characterized_without_error() {
    const MIXTURE: [[f64; 3]; 3] = [[0.5, 0.1, 0.0], [0.2, 0.6, 0.1], [0.0, 0.1, 0.4]];
    let loaded = data::load_sensor(data::DEFAULT_SENSOR).unwrap();
    let observer = data::load_observer().unwrap();
    let wavelengths: Vec<f64> = (360..=830).map(f64::from).collect();
    // Quantum efficiency counts photons, the observer energy: their ratio is the wavelength.
    let efficiency = MIXTURE.map(|weights| {
        let value = |nm: &f64| {
            let sum: f64 = observer.matching.iter().zip(weights).map(|(curve, w)| w * curve.at(*nm)).sum();
            0.3 * sum * 400.0 / nm
        };
        Curve::new(wavelengths.clone(), wavelengths.iter().map(value).collect()).unwrap()
    });
    let response = SpectralResponse::absolute(efficiency, None);
    let found = signals(&sky_library(), &loaded.sensor, &response, &observer, &WavelengthGrid::default()).unwrap();
    let six = [0, 17, 240, 505, 721, 900];
    let (relative_rms, _) = residuals(&sky_rad_ls(&found, &six).unwrap().xyz_from_camera, &found, &six);
    // Rounding of doubles times the condition number of a handful of skies, some 10⁴.
    assert!(relative_rms.iter().all(|rms| *rms < 1e-11), "{relative_rms:?}");
}

#[test]
fn skies_that_do_not_determine_a_matrix_are_refused() {
    let loaded = data::load_sensor(data::DEFAULT_SENSOR).unwrap();
    let observer = data::load_observer().unwrap();
    let found =
        signals(&sky_library(), &loaded.sensor, loaded.response().unwrap(), &observer, &WavelengthGrid::default())
            .unwrap();
    for (samples, complaint) in
        [(&[0, 1][..], "only 2 of the 3"), (&[5, 5, 5, 5], "only 1 of the 3"), (&[0, 1, 912], "no sample 912")]
    {
        let message = sky_rad_ls(&found, samples).unwrap_err().to_string();
        assert!(message.contains(complaint), "{message}");
    }
}

/// The numbers of a CSV table under a comment and a head.
fn reference(name: &str) -> Vec<Vec<f64>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference").join(name);
    let text = std::fs::read_to_string(path).unwrap();
    text.lines().skip(2).map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect()).collect()
}

fn close(ours: f64, theirs: f64) -> bool {
    (ours - theirs).abs() <= 1e-9 * theirs.abs().max(1.0)
}

/// 400 pairs: any color, dark ones on the straight part of the curve, neutral ones, ones out of gamut with negative
/// stimuli, and pairs that hardly differ.
#[test]
fn colors_and_differences_are_those_of_colour_science() {
    let rows = reference("color_differences.csv");
    assert_eq!(rows.len(), 400);
    for row in rows {
        let three = |at: usize| [row[at], row[at + 1], row[at + 2]];
        let white = three(0);
        let labs = [lab_from_xyz(three(3), white), lab_from_xyz(three(6), white)];
        for (ours, theirs) in labs.iter().flatten().zip(&row[9..15]) {
            assert!(close(*ours, *theirs), "{ours} {theirs}");
        }
        // From their L*a*b*, so that a hue of gray, which is rounding alone, is theirs too.
        let found = Difference::between(three(9), three(12));
        for (ours, theirs) in [found.delta_e_76, found.delta_e_94, found.delta_e_2000].iter().zip(&row[15..]) {
            assert!(close(*ours, *theirs), "{ours} {theirs} {row:?}");
        }
    }
}

#[test]
fn tristimulus_values_of_skies_are_those_of_colour_science() {
    let found = sky_signals().1;
    for row in reference("sky_xyz.csv") {
        let sample = (0..912).find(|&sample| sample as f64 == row[0]).unwrap();
        for (ours, theirs) in found.xyz.row(sample).iter().zip(&row[1..]) {
            assert!((ours / theirs - 1.0).abs() < 1e-9, "{ours} {theirs}");
        }
    }
}

/// The default sensor with what it and the observer make of the sky library and of single wavelengths.
fn sky_signals() -> (Sensor, Signals, Signals) {
    let loaded = data::load_sensor(data::DEFAULT_SENSOR).unwrap();
    let (observer, grid) = (data::load_observer().unwrap(), WavelengthGrid::default());
    let found = signals(&sky_library(), &loaded.sensor, loaded.response().unwrap(), &observer, &grid).unwrap();
    let alone = responses(&loaded.sensor, loaded.response().unwrap(), &observer, &grid).unwrap();
    (loaded.sensor, found, alone)
}

#[test]
fn the_sample_that_is_kept_is_exact_whichever_it_is() {
    let (_, found, alone) = sky_signals();
    let twenty: Vec<usize> = (0..20).map(|i| i * 45).collect();
    for regression in Regression::ALL.into_iter().filter(|regression| regression.keeps_a_sample()) {
        let training = if regression.is_trained() { twenty.clone() } else { Vec::new() };
        for kept in (0..912).step_by(7) {
            let settings =
                FitSettings { regression, training: training.clone(), kept: Some(kept), ..FitSettings::default() };
            let fitted = fit(&found, &alone, &settings, None).unwrap();
            let signal = found.camera.row(kept).transpose();
            let given = matrix(&fitted.xyz_from_camera) * nalgebra::Vector3::new(signal[0], signal[1], signal[2]);
            for (ours, truth) in given.iter().zip(found.xyz.row(kept).iter()) {
                assert!((ours / truth - 1.0).abs() < 1e-12, "{regression:?} {kept}: {ours} {truth}");
            }
        }
    }
}

#[test]
fn spanning_subsets_are_the_same_every_time_and_span() {
    let library = sky_library();
    let all: Vec<usize> = (0..912).collect();
    let twenty = spanning_subset(&library, &all, 20).unwrap();
    assert_eq!(twenty, spanning_subset(&library, &all, 20).unwrap());
    let found = sky_signals().1;
    assert_eq!(sky_rad_ls(&found, &twenty).unwrap().rank, 3);
    // What is chosen of a part lies within it.
    let part: Vec<usize> = (462..912).collect();
    assert!(spanning_subset(&library, &part, 20).unwrap().iter().all(|sample| *sample >= 462));
    assert!(average_sample(&found, &part).unwrap() >= 462);
    // A library of one spectrum at many levels has one spectrum.
    let mut same = library.clone();
    for sample in 0..912 {
        let row = library.radiance.row(17).to_owned() * (1.0 + sample as f64);
        same.radiance.row_mut(sample).assign(&row);
    }
    assert!(spanning_subset(&same, &all, 2).unwrap_err().to_string().contains("only 1 different spectra"));
}

/// Skies that differ by 10⁻¹² are one sky; two aerosols are enough; a ridge makes an answer of anything.
#[test]
fn ill_conditioned_training_sets_are_answered_or_refused() {
    let (_, mut found, _) = sky_signals();
    let two_aerosols: Vec<usize> = (0..552).collect();
    let fitted = sky_rad_ls(&found, &two_aerosols).unwrap();
    let (relative_rms, _) = residuals(&fitted.xyz_from_camera, &found, &two_aerosols);
    assert!(relative_rms.iter().all(|rms| *rms < 0.01), "{relative_rms:?}");
    let near: Vec<usize> = (0..20).collect();
    for sample in near.iter().copied() {
        for column in 0..3 {
            let wobble = 1.0 + 1e-12 * ((sample * 7 + column * 3) % 5) as f64;
            found.camera[(sample, column)] = found.camera[(0, column)] * wobble;
            found.xyz[(sample, column)] = found.xyz[(0, column)] * wobble;
        }
    }
    let refused = sky_rad_ls(&found, &near).unwrap_err().to_string();
    assert!(refused.contains("only 1 of the 3"), "{refused}");
    let with_ridge = FitSettings { training: near, ridge: 1e-3, ..FitSettings::default() };
    let tame = fit(&found, &found, &with_ridge, None).unwrap();
    // The one sky it knows comes out within the ridge.
    let (relative_rms, _) = residuals(&tame.xyz_from_camera, &found, &[0]);
    assert!(relative_rms.iter().all(|rms| *rms < 1e-3), "{relative_rms:?}");
}

fn evaluated(sensor: &Sensor, found: &Signals, method: Method, seed: u64) -> Vec<SampleEvaluation> {
    let all: Vec<usize> = (0..912).collect();
    let xyz_from_camera = sky_rad_ls(found, &all).unwrap().xyz_from_camera;
    let base = Exposure { exposure_s: 0.033, f_number: 8.0, lens_transmittance: 1.0 };
    let settings = EvaluationSettings {
        exposure: SampleExposure::Filled { base, fraction: 0.75, by: Filling::Time },
        noise: NoiseSettings { seed, sensor_seed: seed, ..NoiseSettings::default() },
        method,
        pattern: None,
        color: ColorSettings {
            is_relative: false,
            xyz_from_camera,
            method: None,
            residual: None,
            space: Space::Lab,
            white: White::D65,
            white_luminance: None,
        },
        patch: Some([20, 16]),
        columns: 38,
        dark_frames: 0,
    };
    evaluate(sensor, found, &settings).unwrap()
}

/// Moments of the codes of a sky's photosites.
fn photosites(sensor: &Sensor, sky: &SampleEvaluation) -> [Prediction; 3] {
    let mut metadata = Metadata::new(QuantityKind::ExpectedElectrons);
    metadata.sensor = Some(sensor.clone());
    metadata.exposure = Some(sky.exposure);
    metadata.scene = Some(Scene::uniform("a sky", sky.electrons));
    let frame = FrameHeader { name: "a sky".into(), geometry: Geometry::new(8, 8, &["R", "G", "B"]), metadata };
    let noisy = AddNoise::new(&frame, &NoiseSettings::default()).unwrap();
    let codes = Digitize::new(noisy.header(), &AdcSettings::default()).unwrap();
    match propagation::of_frame(codes.header(), Equations::Exact) {
        Ok(FramePrediction::Planes(sites)) => sites,
        other => panic!("{other:?}"),
    }
}

/// The spread of L*a*b* over the pixels of each sky, Σ s² of the three, beside its exact law: mean and variance of a
/// quadratic form in correlated pixels, χ² by Satterthwaite. All 912 pass together, and their p-values are even.
#[test]
fn the_noise_of_every_sky_is_as_predicted() {
    let (sensor, found, _) = sky_signals();
    let fitted = sky_rad_ls(&found, &(0..912).collect::<Vec<_>>()).unwrap();
    for (method, seed) in
        [(Method::Bilinear, 1), (Method::SmoothHue, 4), (Method::EffectiveColor, 2), (Method::Malvar, 3)]
    {
        let skies = evaluated(&sensor, &found, method, seed);
        let reach = method.reach();
        let size = [20, 16];
        let frame = size.map(|pixels| pixels + 2 * reach);
        // The size of a patch is even, so that all have the same phases.
        let place = Place { frame, origin: [0, 0], corner: [reach; 2], size };
        // Only the weights of smooth hue transition depend on the sky.
        let weights_of = |hues| WeightTable::of(method, sensor.bayer().unwrap()).about(hues);
        let common = SamplingBasis::of(&weights_of([1.0; 2]), &place);
        let mut ps = Vec::new();
        for sky in &skies {
            let noise = sky.noise.unwrap();
            let by_formula = noise.predicted.unwrap();
            let simulated: f64 = noise.lab_std.iter().map(|std| std * std).sum();
            let expected: f64 = by_formula.lab_std.iter().map(|std| std * std).sum();
            // The law needs the moments of the photosites, which propagation gives for the sky's own frame.
            let sites = photosites(&sensor, sky);
            let to_xyz = matrix(&fitted.xyz_from_camera) / sky.exposure.exposure_s_sr();
            let to_lab = lab_about(sky.camera_xyz, sky.white).jacobian * to_xyz;
            let law = match method {
                Method::SmoothHue => Sampling::of(&weights_of(propagation::hues(sky.electrons)), &sites, &place),
                _ => common.sampling(&sites),
            };
            let law = law.through(&to_lab);
            let mean: f64 = [0, 1, 2].map(|i| law.covariance[(i, i)]).iter().sum();
            // Squares stand at 0, 3 and 5 of the six pairs.
            let squares = [0, 3, 5];
            let variance: f64 = squares.iter().flat_map(|&a| squares.map(|b| law.spread[a][b])).sum();
            // What is predicted for a pixel is the law's mean, but for the sample mean that is taken off.
            assert!((mean / expected - 1.0).abs() < 0.03, "{mean} {expected}");
            let freedom = 2.0 * mean * mean / variance;
            ps.push(significance::of_chi_square(simulated / mean * freedom, freedom));
        }
        let smallest = ps.iter().copied().fold(1.0, f64::min);
        assert!(significance::of_smallest(smallest, ps.len()) > 1e-3, "{method:?} {smallest}");
        // Even p-values: so many below 0.1 as binomial, within 4 standard deviations.
        let low = ps.iter().filter(|p| **p < 0.1).count() as f64;
        assert!((low - 91.2).abs() < 4.0 * (912.0_f64 * 0.1 * 0.9).sqrt(), "{method:?} {low}");
        // The mean distance: the mean of 912 ratios is 1 within 4 of its standard errors.
        let ratios: Vec<f64> = skies
            .iter()
            .map(|sky| sky.noise.unwrap())
            .map(|noise| noise.noise_delta_e / noise.predicted.unwrap().delta_e)
            .collect();
        let mean = ratios.iter().sum::<f64>() / 912.0;
        let error = (ratios.iter().map(|r| (r - mean).powi(2)).sum::<f64>() / 911.0 / 912.0).sqrt();
        assert!((mean - 1.0).abs() < 4.0 * error, "{method:?} {mean} {error}");
    }
}
