//! Noise on an array of your own: expected electrons in, those of one exposure out, beside what the formulas predict.
//!
//!     cargo run --example noise_on_an_array

#![allow(clippy::print_stdout, reason = "an example talks")]

use cyanometer::camera::optics::Exposure;
use cyanometer::cfa::CfaPattern;
use cyanometer::error::Result;
use cyanometer::formats::data::load_sensor;
use cyanometer::frame::Geometry;
use cyanometer::metadata::{FrameHeader, Metadata};
use cyanometer::propagation::{Equations, Photosite};
use cyanometer::stages::noise::{AddNoise, NoiseModel, NoiseSettings};
use cyanometer::stream::{MemoryFrame, Stage};
use cyanometer::units::QuantityKind;
use ndarray::{Array2, s};

/// A wedge of light: each level, in electrons, fills so many columns.
const LEVELS_E: [f32; 4] = [10.0, 100.0, 1000.0, 10_000.0];
const WIDTH: usize = 128;
const COLUMNS: usize = WIDTH * LEVELS_E.len();
const ROWS: usize = 512;

/// Mean and standard deviation of a level, as drawn and as predicted.
pub type Row = [f64; 4];

/// Draws the noise of the wedge.
pub fn wedge() -> Result<Vec<Row>> {
    // What each photosite of the array would count on average. Your simulation stands here.
    let expected = Array2::from_shape_fn((ROWS, COLUMNS), |(_, column)| LEVELS_E[column / WIDTH]);

    // A frame is its samples, row by row, and a head that says what they are and which camera took them. `load_sensor`
    // also takes the path of a YAML file with a sensor of your own.
    let mut metadata = Metadata::new(QuantityKind::ExpectedElectrons);
    metadata.sensor = Some(load_sensor("kaf-5101ce")?.sensor);
    metadata.exposure = Some(Exposure { exposure_s: 0.033, f_number: 8.0, lens_transmittance: 1.0 });
    metadata.cfa = Some(CfaPattern::Rggb.into());
    let header = FrameHeader { name: "wedge".into(), geometry: Geometry::new(COLUMNS, ROWS, &["Y"]), metadata };
    let frame = MemoryFrame::new(header, expected.into_iter().collect());

    // One exposure: shot noise, dark current, fixed patterns, read noise. Another seed is another exposure, another
    // sensor_seed another sensor. The counts tell what was clipped.
    let settings = NoiseSettings { seed: 7, sensor_seed: 1, ..NoiseSettings::default() };
    let stage = AddNoise::new(&frame.header, &settings)?;
    let (noisy, _counts) = frame.through(&stage)?;

    // The head of what came out holds all that the noise follows from.
    let head = stage.header();
    let record = head.metadata.noise.as_ref().ok_or_else(|| head.missing("noise"))?;
    let photosite = Photosite::of_electrons(NoiseModel::of(head, record)?, Equations::Exact);

    let noisy = Array2::from_shape_fn((ROWS, COLUMNS), |(y, x)| f64::from(noisy.samples[y * COLUMNS + x]));
    let rows = LEVELS_E.iter().enumerate().map(|(i, &level)| {
        let drawn = noisy.slice(s![.., WIDTH * i..WIDTH * (i + 1)]);
        let predicted = photosite.moments(level.into()).moments;
        [drawn.mean().unwrap_or(f64::NAN), drawn.std(1.0), predicted.mean, predicted.std()]
    });
    Ok(rows.collect())
}

fn main() -> Result<()> {
    println!("expected light      drawn: mean      std   predicted: mean      std   (electrons)");
    for (level, [mean, std, predicted_mean, predicted_std]) in LEVELS_E.iter().zip(wedge()?) {
        println!("{level:14.0} {mean:16.2} {std:8.2} {predicted_mean:17.2} {predicted_std:8.2}");
    }
    Ok(())
}
