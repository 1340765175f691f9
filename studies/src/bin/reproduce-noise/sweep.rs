//! Levels of light from the foot of the range to its top, each simulated at two sizes of frame.

use crate::camera::{self, Camera, LARGE, METHODS, SMALL};
use cyanometer::error::Result;
use cyanometer::numerics::moments::Moments;
use cyanometer_studies::frames;

/// What one frame showed: standard deviations of three channels at every stage.
pub struct Shot {
    /// Of three whole planes of codes, ADU.
    pub planes: [f64; 3],
    /// After each of [`METHODS`], ADU.
    pub rgb: [[f64; 3]; 3],
    /// After each of [`METHODS`], cd m⁻².
    pub xyz: [[f64; 3]; 3],
    /// Signal over noise of X, Y, Z in dB, after each of [`METHODS`].
    pub snr_db: [[f64; 3]; 3],
    /// The pixels at the sites of each class, after ECI.
    pub classes: [Moments; 3],
}

impl Shot {
    /// Draws a frame and takes it through every method.
    pub fn of(camera: &Camera, size: [usize; 2], electrons: [f64; 3], seed: u64) -> Result<Self> {
        let codes = frames::codes(&camera.electrons(size, electrons, seed)?)?;
        let planes = frames::stds(&frames::moments(&codes));
        let plane = frames::mosaicked(&codes)?;
        let mut shot = Self { planes, rgb: [[0.0; 3]; 3], xyz: [[0.0; 3]; 3], snr_db: [[0.0; 3]; 3], classes: empty() };
        for (index, method) in METHODS.into_iter().enumerate() {
            let rgb = frames::demosaicked(&plane, method)?;
            let xyz = frames::moments(&camera.xyz(&rgb)?);
            shot.rgb[index] = frames::stds(&frames::moments(&rgb));
            shot.xyz[index] = frames::stds(&xyz);
            shot.snr_db[index] = [0, 1, 2].map(|i| 20.0 * (xyz.mean[i] / shot.xyz[index][i]).log10());
            if index == 2 {
                shot.classes = camera::class_moments(&rgb);
            }
        }
        Ok(shot)
    }
}

fn empty() -> [Moments; 3] {
    [(); 3].map(|()| Moments::new(3))
}

/// A level of light, the same in the three classes.
pub struct Level {
    /// Signal electrons.
    pub electrons: f64,
    /// A frame of the paper's size.
    pub small: Shot,
    /// A large one.
    pub large: Shot,
}

/// Simulates levels; `first_seed` and those after it are used.
pub fn sweep(camera: &Camera, levels: &[f64], first_seed: u64) -> Result<Vec<Level>> {
    let level = |(index, &electrons): (usize, &f64)| {
        let seed = first_seed + 2 * index as u64;
        Ok(Level {
            electrons,
            small: Shot::of(camera, SMALL, [electrons; 3], seed)?,
            large: Shot::of(camera, LARGE, [electrons; 3], seed + 1)?,
        })
    };
    levels.iter().enumerate().map(level).collect()
}

/// Forty equal steps; the last is clipped in part.
pub fn even_levels() -> Vec<f64> {
    (1..=40).map(|step| TOP_E / 40.0 * f64::from(step)).collect()
}

/// The highest of [`even_levels`]. The paper does not name its levels; with this one, 40 even steps give the first row of
/// its Table 7.
pub const TOP_E: f64 = 39_600.0;

/// Twenty-five equal factors from 20 e⁻ up to full well.
pub fn even_factors() -> Vec<f64> {
    (0..25).map(|step| (20.0 * 2000.0_f64.powf(f64::from(step) / 24.0)).round()).collect()
}
