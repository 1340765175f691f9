//! Fitting a matrix: from a library of spectra, with parts of it held out, to a matrix and how well it does.

mod chart;
mod evaluation;
mod exposure;
mod fitting;
mod library;
mod raw;
mod request;
mod training;

pub use chart::{ChartFit, ChartFound};
pub use exposure::ChartExposure;
pub use raw::RawMatrix;

pub use evaluation::{Conditions, DifferenceSummaries, Evaluation, Group, NoiseReport};
pub use request::{Fit, TrainingChoice};

use super::notes::Note;
use crate::analysis::characterization::noise_aware::TradeOff;
use crate::analysis::characterization::{CameraMatrix, responses};
use crate::error::{Error, Result};
use crate::formats::data;
use crate::spectrum::WavelengthGrid;
use clap::Args;
use fitting::Fitting;
use library::Viewer;
use std::path::Path;
use training::Plan;

/// A matrix from a library of spectra, from a chart, or from a raw file.
#[derive(Debug, Clone, Args)]
#[command(mut_group("Fit", |group| group.args(Fit::own_ids())))]
#[command(mut_arg("chart", |chart| chart.conflicts_with_all(Fit::own_ids())))]
#[command(mut_arg("patches", |patches| patches.conflicts_with_all(Fit::own_ids())))]
#[command(mut_arg("from_raw", |from_raw| from_raw.conflicts_with_all(Fit::own_ids())))]
#[command(mut_args(|option| match option.get_id().as_str() {
    "reference" | "reference_light" | "luminance" | "no_misfit" => option.conflicts_with_all(Fit::own_ids()),
    "illuminant" | "temperature" => option.conflicts_with_all(Fit::own_ids()),
    _ => option,
}))]
#[command(mut_arg("exposure", |exposure| exposure.help(
    "Exposure time in s of every sample; with --expose-to, the aperture is chosen instead of the time. With --chart it is that of \
     its frame, as are --f-number and --lens-transmittance"
)))]
#[command(mut_arg("library", |library| {
    library.required(false).required_unless_present_any(["chart", "patches", "from_raw"])
}))]
pub struct MatrixRequest {
    /// From spectra.
    #[command(flatten)]
    pub fit: Option<Fit>,
    /// From a chart.
    #[command(flatten)]
    pub chart: ChartFit,
    /// From a raw file.
    #[command(flatten)]
    pub raw: RawMatrix,
}

/// A matrix, with what is known of it by where it comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum MatrixFound {
    /// From spectra.
    Fitted(Box<Characterization>),
    /// From a chart.
    OfChart(Box<ChartFound>),
    /// From a raw file, with what came up.
    Own(Box<CameraMatrix>, Vec<Note>),
}

impl MatrixRequest {
    /// Makes the matrix.
    ///
    /// # Errors
    ///
    /// Those of [`Fit::run`], [`ChartFit::run`] and [`RawMatrix::run`]; [`Error::Usage`] where nothing to make one of is named.
    pub fn run(&self) -> Result<MatrixFound> {
        self.chart.check()?;
        if let Some(fit) = &self.fit {
            return fit.run().map(|found| MatrixFound::Fitted(Box::new(found)));
        }
        if let Some((matrix, notes)) = self.raw.run(&self.chart)? {
            return Ok(MatrixFound::Own(Box::new(matrix), notes));
        }
        let found = self.chart.run()?;
        found
            .map(|found| MatrixFound::OfChart(Box::new(found)))
            .ok_or_else(|| Error::Usage("name a library, a chart or a raw file".into()))
    }
}

impl MatrixFound {
    /// What came up.
    pub fn notes(&self) -> &[Note] {
        match self {
            Self::Fitted(found) => &found.notes,
            Self::OfChart(found) => &found.notes,
            Self::Own(_, notes) => notes,
        }
    }
}

/// A fitted matrix with what was found out about it.
#[derive(Debug, Clone, PartialEq)]
pub struct Characterization {
    /// The matrix.
    pub matrix: CameraMatrix,
    /// How it does on a library.
    pub evaluation: Option<Evaluation>,
    /// Matrices of other noise weights.
    pub trade_off: Vec<TradeOff>,
    /// What came up.
    pub notes: Vec<Note>,
}

impl Fit {
    /// Fits and evaluates.
    ///
    /// # Errors
    ///
    /// Those of readers; [`Error::Data`] where the matrix is not determined;
    /// [`Error::Usage`] where the request makes no sense.
    pub fn run(&self) -> Result<Characterization> {
        let exposure = self.exposure.chosen()?;
        self.check_white()?;
        let (loaded, doubts) = self.sensor.load()?;
        let viewer = Viewer { loaded: &loaded, observer: data::load_observer()?, grid: WavelengthGrid::default() };
        let seen = viewer.see_training(self)?;
        let plan = Plan::new(self, &seen)?;
        let responses = responses(&loaded.sensor, loaded.response()?, &viewer.observer, &viewer.grid)?;
        let fitting = Fitting { fit: self, sensor: &loaded.sensor, seen: &seen, responses, plan, exposure };
        let (fitted, trade_off) = fitting.fit()?;
        let mut notes = seen.notes.clone();
        // A time that is chosen for each sample is not looked at.
        let exposed = self.exposure.lens.exposed(self.exposure.exposure_s.unwrap_or(1.0))?;
        notes.extend(doubts.into_iter().chain(exposed.doubts().map(Note::Warning)));
        notes.push(Note::Remark(format!(
            "fitted {} observations, condition number {:.1}",
            fitted.count, fitted.condition
        )));
        let matrix = fitting.matrix(&fitted, viewer.grid)?;
        let evaluation = match &self.evaluate {
            None => None,
            Some(path) if is_same(path, &self.library) => Some(fitting.evaluation(&fitted, &seen)?),
            Some(path) => {
                let other = viewer.see(path, self)?;
                notes.extend(other.notes.iter().cloned());
                Some(fitting.evaluation(&fitted, &other)?)
            }
        };
        let full_well_e = loaded.sensor.readout()?.full_well_e;
        match evaluation.as_ref().map_or(0, |evaluation| evaluation.beyond_full_well(full_well_e)) {
            0 => {}
            count => notes.push(Note::Warning(format!(
                "{count} samples exceed full well at their exposure; the differences without noise do not show it"
            ))),
        }
        Ok(Characterization { matrix, evaluation, trade_off, notes })
    }
}

/// Whether two paths lead to one file.
fn is_same(one: &Path, other: &Path) -> bool {
    one == other || one.canonicalize().is_ok_and(|one| other.canonicalize().is_ok_and(|other| one == other))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::characterization::regression::Regression;
    use crate::color::White;
    use crate::requests::options::WhiteChoice;

    const SKIES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/sample_data/skies/");

    /// A fit of the 912 skies without noise, those of one aerosol held out.
    fn without_urban() -> Fit {
        let library = format!("{SKIES}sky912.exr");
        Fit {
            labels: Some((format!("{SKIES}sky912_meta.csv").into(), "aerosol".into())),
            hold_out: vec!["urban5".into()],
            evaluate: Some(library.clone().into()),
            noise_free: true,
            ..Fit::of(library)
        }
    }

    #[test]
    fn what_is_held_out_is_not_trained_on() {
        let found = without_urban().run().unwrap();
        let evaluation = found.evaluation.unwrap();
        let group = |name: &str| evaluation.groups.iter().find(|group| group.name == name).unwrap();
        let (held, trained, others) = (group("urban5 (held out)"), group("trained on"), group("never trained on"));
        assert_eq!((held.trained_on, held.samples), (0, others.samples));
        assert_eq!(held.differences, others.differences);
        assert_eq!((trained.trained_on, trained.samples + others.samples), (trained.samples, 912));
        let training = found.matrix.training.unwrap();
        assert_eq!((training.count, training.held_out.as_slice()), (trained.samples, &["urban5".to_owned()][..]));
        assert_eq!((evaluation.noise, found.trade_off.len()), (None, 0));
        assert!(matches!(&found.notes[..], [Note::Remark(text)] if text.starts_with("fitted ")), "{:?}", found.notes);
    }

    #[test]
    fn a_count_of_training_samples_leaves_the_held_out_alone() {
        let fit = Fit { train: Some(TrainingChoice::Count(12)), evaluate: None, ..without_urban() };
        let found = fit.run().unwrap();
        let training = found.matrix.training.unwrap();
        assert!(training.chosen_by.is_some() && found.evaluation.is_none());
        let all = without_urban().run().unwrap().matrix.training.unwrap().samples.unwrap();
        let chosen = training.samples.unwrap();
        assert!(chosen.len() == 12 && chosen.iter().all(|sample| all.contains(sample)), "{chosen:?}");
    }

    #[test]
    fn choices_that_contradict_each_other_are_refused() {
        let complaint = |fit: Fit| fit.run().unwrap_err().to_string();
        assert!(complaint(Fit { labels: None, ..without_urban() }).contains("--labels FILE:COLUMN"));
        assert!(complaint(Fit { hold_out: vec!["urban".into()], ..without_urban() }).contains("there are "));
        let untrained = Fit { regression: Regression::MaxIgnSppls, ..without_urban() };
        let train = Some(TrainingChoice::Count(12));
        assert!(complaint(Fit { train, ..untrained }).contains("has no training samples"));
        assert!(complaint(Fit { white_sample: Some(3), ..without_urban() }).contains("keeps no sample exact"));
        let white = WhiteChoice { white: Some(White::Absolute([1.0, 0.0, 1.0])), white_luminance: None };
        assert!(complaint(Fit { white, ..without_urban() }).contains("is impossible"));
    }
}
