//! A library as the camera sees it.

use super::request::Fit;
use crate::analysis::characterization::{Signals, signals};
use crate::error::{Advice, Error, Result};
use crate::formats::data::{LoadedSensor, spectrum_file};
use crate::formats::{csv, files, spectral};
use crate::requests::notes::Note;
use crate::spectrum::{Observer, SpectralLibrary, WavelengthGrid};
use std::path::Path;

/// A library of spectra, and what they give in the camera and to the eye.
pub(super) struct SeenLibrary {
    /// Name of the file.
    pub(super) name: String,
    pub(super) library: SpectralLibrary,
    pub(super) signals: Signals,
    /// The label of each sample; empty where samples have none.
    pub(super) labels: Vec<String>,
    /// What came up as it was read.
    pub(super) notes: Vec<Note>,
}

/// Who looks at libraries.
pub(super) struct Viewer<'a> {
    pub(super) loaded: &'a LoadedSensor,
    pub(super) observer: Observer,
    pub(super) grid: WavelengthGrid,
}

impl Viewer<'_> {
    /// Reads the library to train on, with its labels.
    pub(super) fn see_training(&self, fit: &Fit) -> Result<SeenLibrary> {
        let labels = labels(fit)?;
        let seen = SeenLibrary { labels, ..self.see(&fit.library, fit)? };
        let (given, available) = (seen.labels.len(), seen.count());
        if given > 0 && given != available {
            return Err(Error::Usage(format!("there are {given} labels for {available} samples of {}", seen.name)));
        }
        Ok(seen)
    }

    /// Reads a library without labels.
    pub(super) fn see(&self, path: &Path, fit: &Fit) -> Result<SeenLibrary> {
        // Of two libraries the unit that is given is that of the one which does not say its own.
        let has_own_unit =
            |error: &Error| matches!(error, Error::Advised { advice: Advice::LeaveOut(["radiance_unit"]), .. });
        let is_one_of_two = fit.evaluate.as_ref().is_some_and(|other| *other != fit.library);
        let (library, warnings) = match spectral::read_library(path, fit.radiance_unit) {
            Err(error) if is_one_of_two && has_own_unit(&error) => spectral::read_library(path, None)?,
            read => read?,
        };
        let (sensor, response) = (&self.loaded.sensor, self.loaded.response()?);
        let signals = signals(&library, sensor, response, &self.observer, &self.grid)?;
        let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        let notes = warnings.into_iter().map(Note::Warning).collect();
        Ok(SeenLibrary { name, library, signals, labels: Vec::new(), notes })
    }
}

impl SeenLibrary {
    /// The number of samples.
    pub(super) fn count(&self) -> usize {
        self.library.radiance.nrows()
    }

    /// The labels that there are.
    pub(super) fn distinct_labels(&self) -> Vec<String> {
        let mut labels = self.labels.clone();
        labels.sort();
        labels.dedup();
        labels
    }
}

fn labels(fit: &Fit) -> Result<Vec<String>> {
    match &fit.labels {
        Some((file, column)) => {
            let found = spectrum_file(file);
            let bytes = files::read_file(&found).map_err(|error| spectral::with_near_name(error, Some(&found)))?;
            csv::text_column(&file.display().to_string(), &bytes, column)
        }
        None if fit.hold_out.is_empty() => Ok(Vec::new()),
        None => Err(Error::Usage("--hold-out names labels; give them with --labels FILE:COLUMN".into())),
    }
}
