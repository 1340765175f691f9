//! The pixels of pictures in R, G, B: from samples to electrons by way of spectra that are made up.

use crate::color::rgb::Encoding;
use crate::color::upsampling::{EXTENT_NM, Moved, SmoothWeights, Upsampler, whole_nm};
use crate::error::{Error, Result};
use crate::frame::bare_name;
use crate::metadata::FrameHeader;
use crate::requests::notes::Note;
use crate::spectrum::{Curve, Observer, WavelengthGrid, channel_wavelength_nm, fold};
use crate::units::{CM2_PER_M2, LUMINOUS_EFFICACY_LM_PER_W};
use nalgebra::{Matrix3, Vector3};
use std::sync::{Arc, Mutex, PoisonError};

/// What is lost of the colors of a picture while it is read.
#[derive(Clone, Default)]
pub(super) struct Losses(Arc<Mutex<Moved>>);

impl Losses {
    fn add(&self, moved: Moved) {
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        *all = all.plus(moved);
    }

    /// A warning, where there are any.
    pub(super) fn note(&self) -> Option<Note> {
        let Moved { pixels, delta_e } = *self.0.lock().unwrap_or_else(PoisonError::into_inner);
        (pixels > 0).then(|| {
            Note::Warning(format!(
                "{pixels} pixels have colors that no smooth spectrum has; they were moved towards the gray of their luminance, \
                 by up to {delta_e:.1} ΔE*ab"
            ))
        })
    }
}

/// How the colors of a picture become electrons.
pub(super) struct Picture {
    pub(super) decoding: Decoding,
    pub(super) xyz_from_rgb: Matrix3<f64>,
    pub(super) upsampler: Upsampler,
    pub(super) weights: SmoothWeights,
    pub(super) losses: Losses,
}

/// How samples become linear light.
pub(super) enum Decoding {
    /// Integers, looked up.
    Table(Vec<f64>),
    /// Floats.
    Formula(Encoding),
}

impl Decoding {
    pub(super) fn of(encoding: Encoding, full_scale: Option<f32>) -> Self {
        let Some(full_scale) = full_scale.map(f64::from) else { return Self::Formula(encoding) };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "255 or 65535")]
        let codes = 0..=full_scale as u32;
        Self::Table(codes.map(|code| encoding.decode(f64::from(code) / full_scale)).collect())
    }

    fn light(&self, sample: f32) -> f64 {
        match self {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "codes of the table")]
            Self::Table(light) => light.get(sample as usize).copied().unwrap_or(f64::NAN),
            Self::Formula(encoding) => encoding.decode(f64::from(sample)),
        }
    }
}

impl Picture {
    /// The electrons of row `y` of a picture of the channels R, G, B and others.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] for samples that are not finite, or whose light is not.
    pub(super) fn electrons(&self, row: &[f32], width: usize, y: usize, name: &str) -> Result<Vec<[f64; 3]>> {
        let color = |x: usize| -> Result<[f64; 3]> {
            let rgb = [0, 1, 2].map(|channel| row[channel * width + x]);
            let [red, green, blue] = rgb.map(|sample| self.decoding.light(sample));
            let xyz = self.xyz_from_rgb * Vector3::new(red, green, blue);
            if !xyz.iter().all(|value| value.is_finite()) {
                let problem = format!("its pixel {x},{y} is {rgb:?}; no light has such a color");
                return Err(Error::format(name, problem));
            }
            Ok(xyz.into())
        };
        let colors: Vec<[f64; 3]> = (0..width).map(color).collect::<Result<_>>()?;
        let mut electrons = vec![[0.0; 3]; width];
        self.losses.add(self.upsampler.sums(&colors, &self.weights, &mut electrons));
        // Weights between nodes may be below zero, by less than the error of the sum.
        electrons.iter_mut().flatten().for_each(|e| *e = e.max(0.0));
        Ok(electrons)
    }
}

/// Whether a frame is a picture: it has R, G, B, and no spectral channels.
pub(super) fn is_one(frame: &FrameHeader) -> bool {
    let channels = &frame.geometry.channels;
    let has_rgb =
        channels.len() >= 3 && channels.iter().zip(["R", "G", "B"]).all(|(name, wanted)| bare_name(name) == wanted);
    has_rgb && !channels.iter().any(|channel| channel_wavelength_nm(channel).is_some())
}

/// The radiance of white of a luminance in cd m⁻², W cm⁻² sr⁻¹ nm⁻¹, at the wavelengths in nm of its light and all whole ones
/// between; none where the light is none that is seen.
pub(super) fn white_radiance(light: &Curve, observer: &Observer, luminance: f64) -> Option<(Vec<f64>, Vec<f64>)> {
    let own = light.wavelengths_nm();
    let (first, last) = (own[0].max(EXTENT_NM[0]), own[own.len() - 1].min(EXTENT_NM[1]));
    let mut sampled_nm: Vec<f64> =
        whole_nm().chain(own.iter().copied()).filter(|nm| (first..=last).contains(nm)).collect();
    sampled_nm.sort_by(f64::total_cmp);
    sampled_nm.dedup();
    let lightness = &observer.matching[1];
    let grid = WavelengthGrid::default();
    let (nm, widths) = if grid.is_coarser_than(own) {
        grid.points_between(sampled_nm.iter().chain(lightness.wavelengths_nm()).copied())
    } else {
        grid.points().ok()?
    };
    let weights: Vec<f64> = nm.iter().zip(&widths).map(|(&nm, width)| lightness.at(nm) * width).collect();
    let power: Vec<f64> = sampled_nm.iter().map(|&nm| light.at(nm)).collect();
    let folded = fold(&sampled_nm, &nm, &weights).weights;
    let seen: f64 = folded.iter().zip(&power).map(|(weight, power)| weight * power).sum();
    let factor = luminance / (LUMINOUS_EFFICACY_LM_PER_W * CM2_PER_M2 * seen);
    factor.is_finite().then(|| (sampled_nm, power.into_iter().map(|power| power * factor).collect()))
}
