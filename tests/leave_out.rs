//! What is left out changes nothing: the same result to the bit, or within the bound that is stated.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::camera::optics::Vignetting;
use cyanometer::cfa::CfaPattern;
use cyanometer::formats::data::load_sensor;
use cyanometer::frame::Geometry;
use cyanometer::numerics::planes::{WeightedPlane, weighted_sums};
use cyanometer::propagation::{self, Equations, FramePrediction};
use cyanometer::spectrum::{Along, Between, WavelengthGrid};
use cyanometer::stages::adc::{AdcSettings, Digitize};
use cyanometer::stages::black::Black;
use cyanometer::stages::correct::{CorrectFrame, CorrectionSettings};
use cyanometer::stages::mosaic::Mosaic;
use cyanometer::stages::noise::{AddNoise, NoiseSettings};
use cyanometer::stages::render::Rendering;
use cyanometer::stream::MemoryFrame;
use cyanometer::units::QuantityKind;
use support::*;

const SIGNAL: [f64; 3] = [4448.1, 16_599.3, 30_000.7];

fn rendered(
    size: [usize; 2],
    patch: [usize; 2],
    vignetting: Option<Vignetting>,
    cfa: Option<CfaPattern>,
) -> MemoryFrame {
    let channels: &[&str] = if cfa.is_some() { &["Y"] } else { &["R", "G", "B"] };
    let mut header = header(QuantityKind::ExpectedElectrons, Geometry::new(size[0], size[1], channels));
    header.metadata.cfa = cfa.map(Into::into);
    let mut sink = MemoryFrame::new(header.clone(), Vec::new());
    let rendering = Rendering { header, patch, vignetting, cfa };
    let row = vec![SIGNAL; size[0].div_ceil(patch[0])];
    rendering.draw(0, &vec![row; rendering.source_rows()], &mut sink, &mut |_| ()).unwrap();
    sink
}

#[test]
fn one_photosite_stands_for_a_uniform_scene() {
    for cfa in [None, Some(CfaPattern::Gbrg)] {
        let every = rendered([33, 20], [1, 1], None, cfa);
        assert_same(&rendered([33, 20], [33, 20], None, cfa), &every, "a uniform scene");
    }
}

#[test]
fn the_plane_that_a_mosaic_keeps_is_all_that_it_needs() {
    for pattern in CfaPattern::ALL {
        for vignetting in [None, Some(Vignetting::new(33, 20, 6.8, 1.0))] {
            let planes = rendered([33, 20], [33, 20], vignetting.clone(), None);
            let mosaicked = through(&planes, &Mosaic::new(&planes.header, Some(pattern)).unwrap());
            assert_same(&rendered([33, 20], [33, 20], vignetting, Some(pattern)), &mosaicked, pattern.name());
        }
    }
}

/// Left out below half a unit in the last place of a sample, 2⁻²⁵: a product may be rounded to a neighbor, no further.
#[test]
fn vignetting_of_no_field_is_nothing() {
    let point = Vignetting::new(1, 1, 6.8, 50.0);
    assert!(point.is_negligible());
    assert_same(&rendered([1, 1], [1, 1], Some(point), None), &rendered([1, 1], [1, 1], None, None), "a point");
    let narrow = Vignetting::new(40, 30, 6.8, 2000.0);
    assert!(narrow.is_negligible() && !Vignetting::new(40, 30, 6.8, 500.0).is_negligible());
    let plain = rendered([40, 30], [40, 30], None, None);
    for (with, without) in rendered([40, 30], [40, 30], Some(narrow), None).samples.iter().zip(&plain.samples) {
        assert!(without.to_bits() - with.to_bits() <= 1, "{with} {without}");
    }
}

#[test]
fn wavelengths_that_no_class_responds_to_add_nothing() {
    let loaded = load_sensor(&format!("{TREE}/sample_data/sensors/kaf-5101ce.yaml")).unwrap();
    let grid = WavelengthGrid { start_nm: 300.0, end_nm: 1100.0, ..WavelengthGrid::default() };
    let kept = loaded.response().unwrap().weights_on(&loaded.sensor, &EXPOSURE, &grid).unwrap();
    let (all_nm, widths) = grid.points().unwrap();
    assert!(kept.left_out > 0 && kept.left_out + kept.wavelengths_nm.len() == all_nm.len());
    let all = loaded.response().unwrap().electron_weights(&loaded.sensor, &EXPOSURE, &all_nm, &widths).unwrap();
    let radiance = |nm: f64| 1e-6 * (1.5 + (nm / 37.0).sin());
    for (all, kept_weights) in all.iter().zip(&kept.weights) {
        let sum =
            |nm: &[f64], weights: &[f64]| -> f64 { nm.iter().zip(weights).map(|(nm, w)| w * radiance(*nm)).sum() };
        assert_eq!(sum(&all_nm, all).to_bits(), sum(&kept.wavelengths_nm, kept_weights).to_bits());
    }
    // The same of the planes of a spectral image.
    let (camera, _) = kept.camera(&all_nm);
    let channels: Vec<usize> = (0..all_nm.len()).collect();
    let between = Between::new(&all_nm, Along::Wavelength, false);
    let planes = camera.planes(&channels, &between, &vec![1.0; channels.len()]);
    assert_eq!(planes.len(), kept.wavelengths_nm.len());
    let width = 37;
    let samples: Vec<f32> = (0..all_nm.len() * width).map(|i| 1e-6 * scatter(i, i / width, 0)).collect();
    let every: Vec<WeightedPlane> = channels
        .iter()
        .map(|&plane| {
            let found = planes.iter().find(|known| known.plane == plane);
            WeightedPlane { plane, weights: found.map_or([0.0; 3], |known| known.weights) }
        })
        .collect();
    let sums = |planes: &[WeightedPlane]| {
        let mut found = Vec::new();
        weighted_sums(&samples, width, planes, |sums| found.push(sums.map(f64::to_bits)));
        found
    };
    assert_eq!(sums(&planes), sums(&every));
    // And what a camera makes of the spectra one by one.
    for x in 0..width {
        let radiance: Vec<f64> = channels.iter().map(|plane| f64::from(samples[plane * width + x])).collect();
        assert_eq!(camera.electrons(&radiance).map(f64::to_bits), sums(&planes)[x]);
    }
}

#[test]
fn mosaicking_first_comes_to_the_same() {
    let light = expected(50, 31, |x, y, class| 30_000.0 * scatter(x, y, class as usize));
    let settings = NoiseSettings { seed: 3, sensor_seed: 5, ..NoiseSettings::default() };
    let noisy = |frame: &MemoryFrame| through(frame, &AddNoise::new(&frame.header, &settings).unwrap());
    let coded = |frame: &MemoryFrame| through(frame, &Digitize::new(&frame.header, &AdcSettings::default()).unwrap());
    let mosaicked = |frame: &MemoryFrame| through(frame, &Mosaic::new(&frame.header, None).unwrap());
    let first = coded(&noisy(&mosaicked(&light)));
    assert_same(&first, &mosaicked(&coded(&noisy(&light))), "mosaic last");
    assert_same(&first, &coded(&mosaicked(&noisy(&light))), "mosaic before the converter");
}

/// A dark signal that is left out has less than 10⁻⁹ of the variance of the read noise: it is at most 10⁻⁹ σ² e⁻, and the
/// standard deviation changes by less than 5·10⁻¹⁰ of it.
#[test]
fn dark_signal_far_below_the_read_noise_is_nothing() {
    let light = expected(4, 4, |_, _, class| [4448.0, 16_599.0, 30_000.0][class as usize]);
    let settings = NoiseSettings { temperature_k: Some(150.0), ..NoiseSettings::default() };
    let stage = AddNoise::new(&light.header, &settings).unwrap();
    let header = cyanometer::stream::Stage::header(&stage);
    assert!(header.metadata.left_out.iter().any(|entry| entry.what.starts_with("dark signal")));
    let dark_e = readout().dark_current_e_per_s(150.0) * EXPOSURE.exposure_s;
    assert!(dark_e > 0.0 && dark_e < 1e-9 * readout().read_noise_e.powi(2));
    let mut without = header.clone();
    without.metadata.scene = Some(cyanometer::metadata::Scene::uniform("test", SIGNAL));
    let mut with = without.clone();
    let record = with.metadata.noise.as_mut().unwrap();
    record.dark_e = dark_e;
    record.sources = cyanometer::random::Source::ALL.to_vec();
    let classes = |header| match propagation::of_frame(header, Equations::Exact) {
        Ok(FramePrediction::Planes(classes)) => classes,
        _ => panic!("planes of photosites are predicted"),
    };
    for (with, without) in classes(&with).iter().zip(&classes(&without)) {
        let read = readout().read_noise_e;
        assert!((with.moments.mean - without.moments.mean).abs() < 1.1e-9 * read * read);
        assert!((with.moments.std() / without.moments.std() - 1.0).abs() < 5e-10);
    }
}

#[test]
fn a_black_level_of_zero_is_nothing_to_subtract() {
    let header = header(QuantityKind::Adu, Geometry::new(37, 12, &["Y"]));
    let codes = frame(header, |x, y, _| if x == 5 { f32::NAN } else { (4095.0 * scatter(x, y, 0)).floor() - 7.0 });
    let correct = |black: f64| {
        let settings = CorrectionSettings { black: Black::Level(black.into()), cte: None };
        CorrectFrame::new(&codes.header, &settings, None).unwrap()
    };
    let stage = correct(0.0);
    let header = cyanometer::stream::Stage::header(&stage);
    assert!(header.metadata.left_out.iter().any(|entry| entry.what.contains("black")));
    let (corrected, counts) = through_cuts(&codes, &stage, &[5]);
    assert_eq!(counts.not_finite, 12);
    let plain = MemoryFrame::new(header.clone(), codes.samples.iter().map(|code| code - 0.0).collect());
    assert_same(&corrected, &plain, "a black level of zero");
    assert_eq!(corrected.header.metadata.black_level_adu, Some(0.0.into()));
}
