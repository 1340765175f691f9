//! How uncertain one pixel is, and how its channels hang together: by formula, before any frame is made.
//!
//!     cargo run --example covariance_of_a_pixel

#![allow(clippy::print_stdout, reason = "an example talks")]

use cyanometer::camera::optics::Exposure;
use cyanometer::chain::{CameraSetup, ChainPrediction, ChainStage, Predictor, PredictorSettings};
use cyanometer::color::{Space, White};
use cyanometer::error::Result;
use cyanometer::formats::data::load_sensor;
use cyanometer::names::Named;
use cyanometer::stages::demosaic::Method;
use cyanometer::stages::to_xyz::ColorSettings;

/// XYZ from camera signals, rounded from what `fit-matrix sample_data/skies/sky912.exr` finds.
const XYZ_FROM_CAMERA: [[f64; 3]; 3] = [[8.7e-4, 4.5e-5, 4.4e-5], [3.7e-4, 3.1e-4, -2.6e-5], [1.0e-4, -1.6e-4, 5.3e-4]];

/// Predicts a uniform scene that gives the photosites of R, G and B so many electrons, demosaicked by a method.
pub fn predict(method: Method, electrons: [f64; 3]) -> Result<ChainPrediction> {
    let color = ColorSettings {
        is_relative: false,
        xyz_from_camera: XYZ_FROM_CAMERA,
        method: None,
        residual: None,
        space: Space::Xyz,
        white: White::D65,
        white_luminance: None,
    };
    // The same settings as the programs': `predict-noise --electrons 8000,12000,20000 --method eci --matrix FILE`.
    let exposure = Exposure { exposure_s: 0.033, f_number: 8.0, lens_transmittance: 1.0 };
    let camera = CameraSetup { method, ..CameraSetup::new(load_sensor("kaf-5101ce")?.sensor, exposure) };
    let mut predictor = Predictor::new(PredictorSettings {
        color: Some(color),
        // The mean of so many pixels is less uncertain, but not by the root of their number: neighbors share photosites.
        patch: Some([16, 16]),
        ..PredictorSettings::of(camera)
    })?;
    predictor.predict(electrons)
}

fn main() -> Result<()> {
    let prediction = predict(Method::EffectiveColor, [8000.0, 12_000.0, 20_000.0])?;
    for stage in
        prediction.stages.iter().filter(|stage| [ChainStage::Demosaicked, ChainStage::Xyz].contains(&stage.stage))
    {
        println!("{}, {}", stage.stage.name(), stage.unit);
        for (i, channel) in stage.channels.iter().enumerate() {
            // What the covariance is over the product of both standard deviations.
            let correlation = |j: usize| stage.covariance[i][j] / (stage.std[i] * stage.std[j]);
            let [a, b, c] = [0, 1, 2].map(correlation);
            let patch = stage.patch_mean_std.map_or(f64::NAN, |std| std[i]);
            println!(
                "  {channel}: {:8.2} ± {:.3}, mean of 16x16 pixels ± {patch:.4}, correlations {a:5.2} {b:5.2} {c:5.2}",
                stage.mean[i], stage.std[i]
            );
        }
    }
    if let Some(noise) = prediction.noise_delta_e {
        println!("the noise of a pixel is a color difference of {:.2} ΔE*ab, {:.2} JND", noise.mean, noise.jnd);
    }
    Ok(())
}
