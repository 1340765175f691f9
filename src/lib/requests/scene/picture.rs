//! Pictures in R, G, B as scenes: spectra made up for their colors, lit by an illuminant.

use super::light::{Electrons, ImageRows, Light, Pixels, SceneImage};
use super::open::{Found, Sums, no_sample};
use super::request::Scene;
use crate::color::rgb::{Encoding, NamedPrimaries, Primaries, xyz_from_rgb};
use crate::color::upsampling::{EXTENT_NM, Moved, SmoothWeights, Upsampler, whole_nm};
use crate::error::{Error, Result};
use crate::formats::data;
use crate::formats::format::ColorTags;
use crate::formats::input::FrameReader;
use crate::frame::{Geometry, bare_name};
use crate::metadata::{FrameHeader, UpsamplingRecord};
use crate::names::Named;
use crate::requests::notes::Note;
use crate::spectrum::{Curve, Observer, WavelengthGrid, channel_wavelength_nm, fold};
use crate::stream::RowSource;
use crate::units::{CM2_PER_M2, LUMINOUS_EFFICACY_LM_PER_W, QuantityKind};
use nalgebra::{Matrix3, Vector3};
use std::sync::{Arc, Mutex, PoisonError};

/// Luminance of white where none is chosen, cd m⁻².
const WHITE_LUMINANCE: f64 = 1000.0;

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
    decoding: Decoding,
    xyz_from_rgb: Matrix3<f64>,
    upsampler: Upsampler,
    weights: SmoothWeights,
    losses: Losses,
}

/// How samples become linear light.
enum Decoding {
    /// Integers, looked up.
    Table(Vec<f64>),
    /// Floats.
    Formula(Encoding),
}

impl Decoding {
    fn of(encoding: Encoding, full_scale: Option<f32>) -> Self {
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
    pub(super) fn electrons(&self, row: &[f32], width: usize, y: usize, name: &str) -> Result<Electrons> {
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

impl Scene {
    /// The pixels of a picture, or a chosen one, lit.
    pub(super) fn light_of_picture(&self, reader: FrameReader, sums: &Sums<'_>, found: &mut Found) -> Result<Light> {
        let header = reader.header().clone();
        let name = &header.name;
        if self.spectrum.column.is_some() || self.spectrum.radiance_unit.is_some() {
            let problem = format!("{name}: it is a picture in R, G, B; --column and --radiance-unit are for spectra");
            return Err(Error::Usage(problem));
        }
        let (encoding, primaries) = self.taken(&reader, found)?;
        let full_scale = match header.metadata.quantity {
            // The reader has divided by it.
            QuantityKind::Srgb => None,
            _ => reader.sample_type().and_then(|kind| kind.full_scale()),
        };
        let observer = data::load_observer()?;
        let (illuminant, light) = match &self.picture.illuminant {
            Some(chosen) => (chosen.as_str(), data::load_illuminant(chosen)?),
            None => ("d65", data::load_illuminant("d65")?),
        };
        let no_light = || Error::format(illuminant, "it has no power between 360 and 830 nm that an observer sees");
        let upsampler = Upsampler::new(&observer, &data::load_illuminant("d65")?).ok_or_else(no_light)?;
        let xyz_from_rgb = xyz_from_rgb(&primaries, upsampler.white()).ok_or_else(|| {
            header.refuse("its primaries lie on a line, or their white is none; give others with --primaries")
        })?;
        let white_luminance = self.picture.luminance.unwrap_or(WHITE_LUMINANCE);
        let (sampled_nm, white) = white_radiance(&light, &observer, white_luminance).ok_or_else(no_light)?;
        let seen = sums.camera(&sampled_nm, &format!("illuminant {illuminant}"), &mut found.notes)?;
        found.metadata.quadrature_error = seen.quadrature_error(&white);
        self.tell(&header, illuminant, white_luminance, found);
        found.upsampling = Some(UpsamplingRecord {
            method: "jakob-hanika-2019".into(),
            encoding: encoding.to_string(),
            primaries,
            illuminant: illuminant.into(),
            white_luminance,
        });
        let picture = Picture {
            decoding: Decoding::of(encoding, full_scale),
            xyz_from_rgb,
            upsampler,
            weights: SmoothWeights::of(&sampled_nm, &seen.camera.shares(&white)),
            losses: found.losses.clone(),
        };
        let Geometry { width, height, .. } = header.geometry;
        let mut image = SceneImage::new(reader, Pixels::Colored(Box::new(picture)));
        match self.spectrum.sample {
            Some(sample) if sample >= width * height => Err(no_sample(name, sample, width * height)),
            Some(sample) => {
                let electrons = image.electrons_at([sample % width, sample / width])?;
                Ok(Light::Uniform { electrons, source: format!("{name}: sample {sample}") })
            }
            None => {
                let rows = ImageRows::Streamed { first: image.next_row()?, others: Box::new(image) };
                Ok(Light::Image { rows, factor: 1.0, width, height, source: header.name })
            }
        }
    }

    /// How the samples of a picture are taken, by what was chosen, by what its file says, or by what is usual.
    fn taken(&self, reader: &FrameReader, found: &mut Found) -> Result<(Encoding, Primaries)> {
        let header = reader.header();
        let name = &header.name;
        let tags = match header.metadata.quantity {
            QuantityKind::Unspecified => reader.colors(),
            QuantityKind::Srgb => ColorTags {
                primaries: Some(NamedPrimaries::Srgb.chromaticities()),
                encoding: Some(Encoding::Srgb),
                unread: None,
            },
            _ => {
                let problem =
                    format!("it holds {}, neither spectral radiance nor a picture in R, G, B", header.holds());
                return Err(header.refuse(problem));
            }
        };
        let Some(kind) = reader.sample_type() else {
            return Err(header.refuse("its channels differ in how samples are stored; store R, G, B alike"));
        };
        let is_integer = kind.full_scale().is_some();
        if !is_integer && !kind.is_float() {
            let problem =
                format!("its samples are stored as {}, which no picture's are; give u8, u16 or floats", kind.name());
            return Err(header.refuse(problem));
        }
        let usual = if is_integer { Encoding::Srgb } else { Encoding::Linear };
        let encoding = self.picture.rgb.or(tags.encoding).unwrap_or(usual);
        let primaries = self.picture.primaries.or(tags.primaries).unwrap_or(NamedPrimaries::Srgb.chromaticities());
        let set = match NamedPrimaries::of(&primaries) {
            Some(set) => set.name().to_owned(),
            None => primaries.as_flattened().iter().map(f64::to_string).collect::<Vec<_>>().join(","),
        };
        let taken = format!("its samples, {}, are taken as {encoding}, its primaries as {set}", kind.name());
        let is_chosen = self.picture.rgb.is_some() && self.picture.primaries.is_some();
        found.notes.push(match tags.unread {
            Some(unread) if !is_chosen => {
                Note::Warning(format!("{name}: {unread} is not read; {taken}; --rgb and --primaries say otherwise"))
            }
            _ if self.picture.rgb.or(tags.encoding).is_none() => Note::Warning(format!(
                "{name}: it does not say how its samples stand for light; {taken}; --rgb says otherwise"
            )),
            _ => Note::Remark(format!("{name}: {taken}")),
        });
        Ok((encoding, primaries))
    }

    /// What a user should know of a scene of a picture.
    fn tell(&self, header: &FrameHeader, illuminant: &str, white_luminance: f64, found: &mut Found) {
        let name = &header.name;
        let others = &header.geometry.channels[3..];
        if !others.is_empty() {
            found.notes.push(Note::Warning(format!(
                "{name}: channels {} are left out; colors are taken as stored",
                others.join(", ")
            )));
        }
        found.notes.push(Note::Remark(format!(
            "{name}: its spectra are made up by Jakob and Hanika (2019), metamers of its colors under d65; white has \
             {white_luminance} cd/m2 under {illuminant}"
        )));
        if self.picture.luminance.is_none() {
            let text = format!("{name}: white is taken to have {white_luminance} cd/m2; --luminance says otherwise");
            found.notes.push(if self.level.expose_to.is_some() { Note::Remark(text) } else { Note::Warning(text) });
        }
    }
}

/// The radiance of white of a luminance in cd m⁻², W cm⁻² sr⁻¹ nm⁻¹, at the wavelengths in nm of its light and all whole ones
/// between; none where the light is none that is seen.
fn white_radiance(light: &Curve, observer: &Observer, luminance: f64) -> Option<(Vec<f64>, Vec<f64>)> {
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
