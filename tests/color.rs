//! Characterisation on the sky library, and on a camera whose matrix is known.
#![allow(clippy::unwrap_used, reason = "a test that cannot set itself up has failed")]

use cyanometer::color::characterization::regression::{FitSettings, FittedMatrix, fit, residuals};
use cyanometer::color::characterization::{Signals, signals};
use cyanometer::error::Result;
use cyanometer::formats::{data, spectral};
use cyanometer::sensor::SpectralResponse;
use cyanometer::spectrum::{Curve, SpectralLibrary, WavelengthGrid};
use std::path::Path;

fn sky_library() -> SpectralLibrary {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("sample_data/skies/sky912.exr");
    spectral::read_library(&path, None).unwrap()
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
    let found = signals(&library, &loaded.sensor, &loaded.response, &observer, &grid).unwrap();
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

/// A camera whose response to energy is a mixture of the colour-matching functions obeys Luther's condition: the fit
/// must find the mixture again, exactly, from any training set that determines it.
#[test]
fn a_colorimetric_camera_is_characterised_without_error() {
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
    let response = SpectralResponse { quantum_efficiency: efficiency, cover_glass: None };
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
        signals(&sky_library(), &loaded.sensor, &loaded.response, &observer, &WavelengthGrid::default()).unwrap();
    for (samples, complaint) in
        [(&[0, 1][..], "only 2 of the 3"), (&[5, 5, 5, 5], "only 1 of the 3"), (&[0, 1, 912], "no sample 912")]
    {
        let message = sky_rad_ls(&found, samples).unwrap_err().to_string();
        assert!(message.contains(complaint), "{message}");
    }
}
