//! Which samples of a library the matrix is fitted on, which are held out, and which is kept exact.

use super::library::SeenLibrary;
use super::request::{Fit, TrainingChoice};
use crate::analysis::characterization::regression::FitSettings;
use crate::analysis::characterization::training::{CHOSEN_BY, average_sample, spanning_subset};
use crate::error::{Error, Result};
use crate::names::Named;

/// What is fitted, and how its samples were chosen.
pub(super) struct Plan {
    pub(super) settings: FitSettings,
    /// The way in which training samples were chosen, where a number of them was asked for.
    pub(super) chosen_by: Option<String>,
}

impl Plan {
    /// Chooses the samples of a library that `fit` asks for.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for samples and labels that there are not, or that are held out; [`Error::Data`] for a library that
    /// holds too little.
    pub(super) fn new(fit: &Fit, seen: &SeenLibrary) -> Result<Self> {
        let candidates = candidates(fit, seen)?;
        let training = training_samples(fit, seen, &candidates)?;
        let chosen_by = matches!(fit.train, Some(TrainingChoice::Count(_))).then(|| CHOSEN_BY.to_owned());
        let kept = kept_sample(fit, seen, &candidates)?;
        let (regression, weights, ridge) = (fit.regression, fit.weights.clone(), fit.ridge);
        Ok(Self { settings: FitSettings { regression, training, kept, weights, ridge }, chosen_by })
    }
}

/// Whether a sample is held out by its label.
fn is_held_out(fit: &Fit, seen: &SeenLibrary, sample: usize) -> bool {
    seen.labels.get(sample).is_some_and(|label| fit.hold_out.contains(label))
}

/// The samples that are not held out.
fn candidates(fit: &Fit, seen: &SeenLibrary) -> Result<Vec<usize>> {
    if let Some(unknown) = fit.hold_out.iter().find(|label| !seen.labels.contains(label)) {
        let known = seen.distinct_labels().join(", ");
        return Err(Error::Usage(format!("no sample has the label `{unknown}`; there are {known}")));
    }
    let candidates: Vec<usize> = (0..seen.count()).filter(|&sample| !is_held_out(fit, seen, sample)).collect();
    if candidates.is_empty() {
        return Err(Error::Usage("all samples are held out; none is left to train on".into()));
    }
    Ok(candidates)
}

fn training_samples(fit: &Fit, seen: &SeenLibrary, candidates: &[usize]) -> Result<Vec<usize>> {
    match &fit.train {
        Some(_) if !fit.regression.is_trained() => Err(Error::Usage(format!(
            "{} is fitted on the responses alone; it has no training samples",
            fit.regression.name()
        ))),
        None if !fit.regression.is_trained() => Ok(Vec::new()),
        None => Ok(candidates.to_vec()),
        Some(TrainingChoice::List(list)) => match list.iter().find(|&&sample| is_held_out(fit, seen, sample)) {
            Some(held) => Err(Error::Usage(format!("sample {held} is held out; leave it out of --train"))),
            None => Ok(list.clone()),
        },
        Some(TrainingChoice::Count(count)) => spanning_subset(&seen.library, candidates, *count),
    }
}

/// The sample whose color stays exact, where the regression keeps one.
fn kept_sample(fit: &Fit, seen: &SeenLibrary, candidates: &[usize]) -> Result<Option<usize>> {
    match (fit.regression.keeps_a_sample(), fit.white_sample) {
        (true, Some(sample)) if is_held_out(fit, seen, sample) => {
            Err(Error::Usage(format!("sample {sample} is held out; keep another exact with --white-sample")))
        }
        (true, Some(sample)) => Ok(Some(sample)),
        (true, None) => Ok(Some(average_sample(&seen.signals, candidates)?)),
        (false, None) => Ok(None),
        (false, Some(_)) => Err(Error::Usage(format!(
            "{} keeps no sample exact; leave out --white-sample, or choose another --regression",
            fit.regression.name()
        ))),
    }
}
