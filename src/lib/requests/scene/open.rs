//! Opens the light of a scene, and settles its exposure.

use super::light::{ImageRows, Judged, Light, Pixels, SceneImage, brightest, checked, no_sample};
use super::picture;
use super::request::Scene;
use super::sums::{Found, Sums, gap};
use crate::camera::optics::{Exposure, doubt_of_focal_length, is_long};
use crate::camera::readout::ReadOut;
use crate::camera::response::GridWeights;
use crate::camera::sensor::Sensor;
use crate::cfa::Class;
use crate::error::{Error, Result};
use crate::formats::csv::SpectralTable;
use crate::formats::data::{LoadedSensor, spectrum_file};
use crate::formats::input::{FrameReader, InputOptions};
use crate::formats::radiance_unit::{Brightness, times_white};
use crate::formats::spectral::{self, Radiances, SpectralChannels};
use crate::frame::Geometry;
use crate::requests::notes::{self, Note};
use crate::spectrum::{SpectralLibrary, chart_columns};
use crate::stream::RowSource;
use crate::text::{in_digits, ms_in_s};
use std::path::Path;

/// Error of a sum over wavelengths from which it is a warning.
const TOLD_ERROR: f64 = 1e-2;

/// A scene whose light is open and whose exposure is settled.
pub(super) struct Prepared {
    pub(super) sensor: Sensor,
    pub(super) exposure: Exposure,
    pub(super) light: Light,
    /// Electrons of the brightest class, where the exposure was chosen by them.
    pub(super) brightest_e: Option<f64>,
    pub(super) found: Found,
}

impl Scene {
    /// Loads the sensor, opens the light and settles the exposure.
    pub(super) fn prepare(&self) -> Result<Prepared> {
        let (loaded, doubts) = self.subject.sensor.load()?;
        let mut exposure = self.exposure.chosen()?;
        if self.level.expose_to.is_some() {
            // The signal is proportional to time: work it out for 1 s, then choose.
            exposure.exposure_s = 1.0;
        }
        let mut found = Found::none();
        found.notes.extend(doubts.into_iter().chain(self.doubts(exposure).map(Note::Warning)));
        let mut light = match self.level.given() {
            Some(electrons) => {
                let source = if electrons == [0.0; 3] { "dark" } else { "--electrons" };
                Light::Uniform { electrons, source: source.into() }
            }
            None => self.open_light(&loaded, &exposure, &mut found)?,
        };
        if self.picture.is_given() && found.upsampling.is_none() {
            let problem = "--rgb, --primaries, --illuminant and --luminance are for a picture in R, G, B, which this scene is not";
            return Err(Error::Usage(problem.into()));
        }
        let mut brightest_e = None;
        if let Some(fraction) = self.level.expose_to {
            let (kept, brightest) = light.keep_and_find_brightest()?;
            light = kept;
            if brightest <= 0.0 {
                return Err(Error::Data(
                    "the sensor sees none of its light: no exposure reaches a fraction of full well".into(),
                ));
            }
            let full_well_e = loaded.sensor.readout()?.full_well_e;
            exposure.exposure_s = fraction * full_well_e / brightest;
            exposure = exposure.checked()?;
            light.scale(exposure.exposure_s);
            brightest_e = Some(fraction * full_well_e);
            let text = format!("exposure {} s", exposure.exposure_s);
            found.notes.push(match is_long(exposure.exposure_s) {
                true => Note::Warning(format!("the scene takes an {text}; is the unit of its radiance right?")),
                false => Note::Remark(text),
            });
        }
        found.notes.extend(overfull(&light, loaded.sensor.readout.as_ref(), self.level.expose_to, exposure.exposure_s));
        found.notes.extend(found.metadata.quadrature_error.map(|error| inexact(error, self.wavelengths.is_some())));
        Ok(Prepared { sensor: loaded.sensor, exposure, light, brightest_e, found })
    }

    /// Warnings of an exposure and a lens that were given; a time that is to be chosen is 1 s here.
    fn doubts(&self, exposure: Exposure) -> impl Iterator<Item = String> {
        exposure.doubts().chain(self.vignetting_focal_length_mm().and_then(doubt_of_focal_length))
    }

    /// Opens the radiance at an exposure.
    fn open_light(&self, loaded: &LoadedSensor, exposure: &Exposure, found: &mut Found) -> Result<Light> {
        let sums = Sums::on(self.wavelengths, self.quadrature, loaded, exposure)?;
        let GridWeights { left_out, wavelengths_nm, .. } = &sums.weights;
        if *left_out > 0 {
            let all = left_out + wavelengths_nm.len();
            let what = format!("{left_out} of {all} wavelengths");
            found.metadata.leave_out("render-radiance", what, "no class responds there");
        }
        let path = self.subject.input.clone();
        found.notes.extend(path.as_deref().and_then(elsewhere).map(Note::Remark));
        let options = InputOptions { path, part: self.part, all_channels: true, ..InputOptions::default() };
        match spectral::open(&options)? {
            Radiances::Table(table) => self.light_of_table(&table, &sums, found),
            Radiances::Image(reader) if picture::is_one(reader.header()) => {
                self.light_of_picture(*reader, &sums, found)
            }
            Radiances::Image(reader) => self.light_of_image(*reader, &sums, found),
        }
    }

    /// The chosen spectrum of a table, or all of them as a chart.
    fn light_of_table(&self, table: &SpectralTable, sums: &Sums<'_>, found: &mut Found) -> Result<Light> {
        let name = table.name().to_owned();
        let given = self.spectrum.radiance_unit;
        let between = table.between(given);
        let seen = sums.camera(&between.wavelength_nm, &name, &mut found.notes)?;
        found.notes.extend(gap(&table.wavelength_nm, &name));
        let radiance_of = |index: usize| table.radiances(index, given, &between);
        let electrons_of = |index: usize| checked(seen.camera.electrons(&radiance_of(index)?), &name);
        let warn = |index: usize, notes: &mut Vec<Note>| -> Result<()> {
            let (_, assumed) = table.radiance_unit(index, given)?;
            notes.extend(assumed.into_iter().chain(table.doubt_of_values(index)).map(Note::Warning));
            Ok(())
        };
        let count = table.columns.len();
        let is_chosen = self.spectrum.column.is_some() || self.spectrum.sample.is_some();
        if self.patch.is_some() && count > 1 && !is_chosen {
            let all: Vec<[f64; 3]> = (0..count).map(electrons_of).collect::<Result<_>>()?;
            let width = chart_columns(count);
            warn(0, &mut found.notes)?;
            found.metadata.quadrature_error = seen.quadrature_error(&radiance_of(brightest(&all[..width]))?);
            let rows = ImageRows::Kept(all.chunks(width).map(<[_]>::to_vec).collect());
            return Ok(Light::Image { rows, factor: 1.0, width, height: count / width, source: name });
        }
        let index = self.choose(table)?;
        warn(index, &mut found.notes)?;
        let electrons = electrons_of(index)?;
        let radiance = radiance_of(index)?;
        found.metadata.quadrature_error = seen.quadrature_error(&radiance);
        found.radiance = Some(SpectralLibrary::of_one(between.wavelength_nm, radiance));
        let source = if count > 1 { format!("{name}: {}", table.columns[index]) } else { name };
        Ok(Light::Uniform { electrons, source })
    }

    /// The chosen pixel of a spectral image, or all of them.
    fn light_of_image(&self, reader: FrameReader, sums: &Sums<'_>, found: &mut Found) -> Result<Light> {
        if self.spectrum.column.is_some() {
            return Err(Error::Usage("a spectral image has no columns; choose a pixel with --sample N".into()));
        }
        found.notes.extend(notes::of_reader(&reader));
        let header = reader.header().clone();
        let spectral = SpectralChannels::of(&header, self.spectrum.radiance_unit)?;
        found.notes.extend(spectral.warning.clone().map(Note::Warning));
        let between = spectral.between();
        let seen = sums.camera(&between.wavelength_nm, &header.name, &mut found.notes)?;
        found.notes.extend(gap(&spectral.wavelength_nm, &header.name));
        let planes = seen.camera.planes(&spectral.channels, &between, &spectral.factors(&between));
        let all = spectral.channels.len();
        if planes.len() < all {
            let what = format!("{} of {all} spectral planes", all - planes.len());
            found.metadata.leave_out("render-radiance", what, "no class responds to them");
        }
        let Geometry { width, height, .. } = header.geometry;
        // Of a chosen pixel the others do not matter.
        let is_drawn = self.spectrum.sample.is_none();
        found.judged = is_drawn.then(|| Judged::new(&header.name, &spectral, &planes));
        let mut image = SceneImage::new(reader, Pixels::Spectral(planes, found.judged.clone()));
        let Some(sample) = self.spectrum.sample else {
            let (first, radiance) = image.first_row(&spectral)?;
            found.metadata.quadrature_error = seen.quadrature_error(&radiance);
            if radiance.iter().any(|value| *value != 0.0) {
                let whose = format!("{}, the brightest pixel of its first row", header.name);
                found.doubt_of_radiance(&whose, &between.wavelength_nm, &radiance);
            }
            let rows = ImageRows::Streamed { first, others: Box::new(image) };
            return Ok(Light::Image { rows, factor: 1.0, width, height, source: header.name });
        };
        if sample >= width * height {
            return Err(no_sample(&header.name, sample, width * height));
        }
        let (electrons, radiance) = image.pixel([sample % width, sample / width], &spectral)?;
        let brightest = radiance.iter().copied().fold(0.0, f64::max);
        let bright =
            Brightness::of([times_white(brightest)]).judge(&header.name, spectral.unit, spectral.is_assumed)?;
        found.notes.extend(bright.map(Note::Warning));
        found.doubt_of_radiance(&format!("{}, sample {sample}", header.name), &between.wavelength_nm, &radiance);
        found.metadata.quadrature_error = seen.quadrature_error(&radiance);
        found.radiance = Some(SpectralLibrary::of_one(between.wavelength_nm, radiance));
        Ok(Light::Uniform { electrons, source: format!("{}: sample {sample}", header.name) })
    }

    /// The row of a table that is wanted.
    fn choose(&self, table: &SpectralTable) -> Result<usize> {
        let count = table.columns.len();
        match (&self.spectrum.column, self.spectrum.sample) {
            (Some(column), _) => table.column_index(Some(column)),
            (None, Some(sample)) if sample < count => Ok(sample),
            (None, Some(sample)) => Err(no_sample(table.name(), sample, count)),
            (None, None) if count == 1 => Ok(0),
            (None, None) => {
                const SHOWN: usize = 8;
                // What holds no radiances is told first; a unit is asked for of the one that is chosen.
                let (first, likely) = (table.columns[0].as_str(), table.likely_radiances());
                if !likely.contains(&first) {
                    table
                        .radiance_unit(0, self.spectrum.radiance_unit)
                        .map_err(|error| beside(error, first, &likely))?;
                }
                if let Some(what) = table.uvspec() {
                    let problem = format!(
                        "{}: {what}; --column NAME or --sample N is for a column that is a radiance after all",
                        table.name()
                    );
                    return Err(Error::Usage(problem));
                }
                let names: Vec<&str> = table.columns.iter().take(SHOWN).map(String::as_str).collect();
                let more = if count > SHOWN { " ..." } else { "" };
                Err(Error::Usage(format!(
                    "{}: it holds {count} spectra, {}{more}; choose one with --column NAME or --sample N",
                    table.name(),
                    names.join(", ")
                )))
            }
        }
    }
}

/// A complaint of the first column of a table, with the columns that may hold radiances where it does not.
fn beside(error: Error, first: &str, likely: &[&str]) -> Error {
    match (error, likely) {
        (Error::Format { file, problem }, [column, others @ ..]) if *column != first => {
            let which = if others.is_empty() { "" } else { ", the first of several," };
            let advice = format!("`{column}`{which} may hold them: choose it with --column '{column}'");
            Error::Format { file, problem: format!("{problem}; {advice}") }
        }
        (error, _) => error,
    }
}

/// Where a spectrum lies that is not at hand but comes with the programs.
fn elsewhere(path: &Path) -> Option<String> {
    let found = spectrum_file(path);
    (found != path).then(|| format!("{}: {}", path.display(), found.display()))
}

/// A warning of light that fills photosites; none of light that does not, or that is not known before it is read.
fn overfull(light: &Light, readout: Option<&ReadOut>, expose_to: Option<f64>, exposure_s: f64) -> Option<Note> {
    let (Light::Uniform { electrons, source }, Some(readout)) = (light, readout) else { return None };
    let remedy = match source.as_str() {
        "--electrons" => "fewer of them keep",
        _ if expose_to.is_some() => "a fraction of full well below 1, as --expose-to 0.8, keeps",
        _ => "a shorter exposure, or --expose-to 0.8 in place of --exposure, keeps",
    };
    let is_of_night = source != "--electrons" && expose_to.is_none() && is_long(exposure_s);
    let unit = if is_of_night {
        format!("; the exposure is {exposure_s} s, and {}", ms_in_s(exposure_s))
    } else {
        String::new()
    };
    let full = Class::ALL.into_iter().zip(electrons).filter(|(_, e)| **e >= readout.full_well_e);
    let full: Vec<String> = full.map(|(class, e)| format!("{} expects {e:.0} e-", class.letter())).collect();
    (!full.is_empty()).then(|| {
        Note::Warning(format!(
            "{}, but full well is {} e-: these samples will be saturated; {remedy} them below{unit}",
            full.join(", "),
            readout.full_well_e
        ))
    })
}

/// What the sum over wavelengths is off by, of R, G and B, where these are `chosen` or not.
fn inexact([red, green, blue]: [f64; 3], chosen: bool) -> Note {
    let [r, g, b] = [red, green, blue].map(|error| in_digits(error, 2));
    let text = format!(
        "the sum over wavelengths is off by {r} of R, {g} of G, {b} of B from the integral between all samples"
    );
    if [red, green, blue].iter().any(|error| *error > TOLD_ERROR) {
        // Not every program that opens a scene has the option.
        let remedy = match chosen {
            true => "a smaller step of --wavelengths, or its default, brings",
            false => "a smaller step, as of `render-radiance --wavelengths 360:830:0.5`, brings",
        };
        Note::Warning(format!("{text}; {remedy} it closer"))
    } else {
        Note::Remark(text)
    }
}
