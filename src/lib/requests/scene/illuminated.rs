//! A picture in R, G, B, lit by an illuminant.

use super::light::{ImageRows, Light, Pixels, SceneImage, no_sample};
use super::picture::{Decoding, Picture, white_radiance};
use super::request::Scene;
use super::sums::{Found, Sums, gap};
use crate::color::rgb::{Encoding, NamedPrimaries, Primaries, xyz_from_rgb};
use crate::color::upsampling::{SmoothWeights, Upsampler};
use crate::error::{Error, Result};
use crate::formats::data;
use crate::formats::format::ColorTags;
use crate::formats::input::FrameReader;
use crate::frame::Geometry;
use crate::metadata::{FrameHeader, UpsamplingRecord};
use crate::names::Named;
use crate::requests::notes::Note;
use crate::stream::RowSource;
use crate::units::QuantityKind;

/// Luminance of white where none is chosen, cd m⁻².
const WHITE_LUMINANCE: f64 = 1000.0;

/// Luminances that differ by no more are one; files hold them in 32 bits.
const SAME_LUMINANCE: f64 = 1e-6;

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
        let told = told_white(&reader);
        let told_luminance = told.map(|(luminance, _)| luminance);
        let white_luminance = self.picture.luminance.or(told_luminance).unwrap_or(WHITE_LUMINANCE);
        let (sampled_nm, white) = white_radiance(&light, &observer, white_luminance).ok_or_else(no_light)?;
        let light_name = format!("illuminant {illuminant}");
        let seen = sums.camera(&sampled_nm, &light_name, &mut found.notes)?;
        found.notes.extend(gap(&sampled_nm, &light_name));
        found.metadata.quadrature_error = seen.quadrature_error(&white);
        self.tell(&header, illuminant, told, found);
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
            kind @ (QuantityKind::Srgb | QuantityKind::LinearSrgb) => ColorTags {
                primaries: Some(NamedPrimaries::Srgb.chromaticities()),
                encoding: Some(if kind == QuantityKind::Srgb { Encoding::Srgb } else { Encoding::Linear }),
                ..ColorTags::default()
            },
            _ => {
                let next = match header.metadata.quantity {
                    QuantityKind::ExpectedElectrons => "; it is rendered already, for `add-noise`",
                    _ => "",
                };
                let holds = header.holds();
                let problem = format!("it holds {holds}, neither spectral radiance nor a picture in R, G, B{next}");
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

    /// What a user should know of a scene of a picture; of its white the luminance that its file tells, and where.
    fn tell(&self, header: &FrameHeader, illuminant: &str, told: Option<(f64, &str)>, found: &mut Found) {
        /// More channels are not named one by one.
        const MOST_NAMED: usize = 16;
        let chosen = self.picture.luminance;
        let white_luminance = chosen.or(told.map(|(luminance, _)| luminance)).unwrap_or(WHITE_LUMINANCE);
        let name = &header.name;
        let others = &header.geometry.channels[3..];
        if !others.is_empty() {
            let named = match others {
                [first, second, third, .., last] if others.len() > MOST_NAMED => {
                    format!("{first}, {second}, {third}, … {last}, {} in all,", others.len())
                }
                _ => others.join(", "),
            };
            found
                .notes
                .push(Note::Warning(format!("{name}: channels {named} are left out; colors are taken as stored")));
        }
        found.notes.push(Note::Remark(format!(
            "{name}: its spectra are made up by Jakob and Hanika (2019), metamers of its colors under d65; white has \
             {white_luminance} cd/m2 under {illuminant}"
        )));
        let known = match (chosen, told) {
            (Some(chosen), Some((told, place))) if (chosen / told - 1.0).abs() > SAME_LUMINANCE => {
                Some(Note::Warning(format!(
                    "{name}: its white has {told} cd/m2 by its own {place}, and {chosen} by --luminance, which counts"
                )))
            }
            (Some(_), _) => None,
            (None, Some((told, place))) => {
                Some(Note::Remark(format!("{name}: its white has {told} cd/m2 by its own {place}")))
            }
            (None, None) => {
                let text =
                    format!("{name}: white is taken to have {white_luminance} cd/m2; --luminance says otherwise");
                Some(if self.level.expose_to.is_some() { Note::Remark(text) } else { Note::Warning(text) })
            }
        };
        found.notes.extend(known);
    }
}

/// The luminance of white that a picture tells, and where: of one that the toolchain made in its metadata, else in its own tags.
fn told_white(reader: &FrameReader) -> Option<(f64, &'static str)> {
    let of_tags = reader.colors().white_luminance.map(|luminance| (luminance, "attribute (whiteLuminance)"));
    let metadata = &reader.header().metadata;
    match metadata.quantity {
        QuantityKind::Srgb | QuantityKind::LinearSrgb => {
            metadata.white_luminance().map(|luminance| (luminance, "metadata")).or(of_tags)
        }
        _ => of_tags,
    }
}
