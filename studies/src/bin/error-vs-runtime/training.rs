//! How many spectra a matrix is fitted on.

use crate::Study;
use crate::bench::{Work, quantile, timed};
use crate::page::{Section, digits, time};
use cyanometer::analysis::characterization::Signals;
use cyanometer::analysis::characterization::evaluation::{
    EvaluationSettings, Filling, SampleExposure, evaluate, noise_free,
};
use cyanometer::analysis::characterization::regression::{FitSettings, Weights, fit};
use cyanometer::analysis::characterization::training::spanning_subset;
use cyanometer::color::Space;
use cyanometer::color::difference::DELTA_E_PER_JND;
use cyanometer::error::{Error, Result};
use cyanometer::plot::{Axis, Color, Marks, Panel, Plot};
use cyanometer::random::philox::philox4x32_10;
use cyanometer::stages::demosaic::Method;
use cyanometer::stages::noise::NoiseSettings;
use cyanometer_studies::camera::{Camera, EXPOSURE, Matrix, color_settings};
use cyanometer_studies::frames::median;
use cyanometer_studies::pages::Table;
use std::hint::black_box;

const COUNTS: [usize; 11] = [3, 4, 5, 7, 10, 20, 40, 80, 160, 320, 912];

/// A number of training spectra.
struct Training {
    count: usize,
    /// Mean ΔE*ab over all skies of the matrix from chosen spectra; none where they do not determine it.
    chosen: f64,
    /// Mean ΔE*ab of the same matrix over the measured skies.
    measured: f64,
    /// The same as `chosen` of matrices from spectra drawn by lot: median, and what 90 % do not exceed.
    drawn: [f64; 2],
    /// Share of the draws that determine no matrix.
    refused: f64,
    choose: f64,
    fit: f64,
}

/// Error and time against the number of spectra.
fn figure(found: &[Training], total: usize) -> Plot {
    let spectra = || Axis::log10("training spectra");
    let mut error = Panel::new(spectra(), Axis::log10(&format!("mean ΔE*ab of all {total} skies")));
    let mut time = Panel::new(spectra(), Axis::log10("CPU time, ms"));
    let line = |of: &dyn Fn(&Training) -> f64| {
        let points = found.iter().filter(|t| t.fit.is_finite()).map(|t| [t.count as f64, of(t)]);
        Marks::LineAndPoints(points.filter(|[_, value]| value.is_finite()).collect())
    };
    error.add("chosen by k-medoids", Color::Blue, line(&|t| t.chosen));
    error.add("drawn by lot: median", Color::Vermillion, line(&|t| t.drawn[0]));
    error.add("drawn by lot: 90 % are better", Color::Green, line(&|t| t.drawn[1]));
    time.add("choice and fit", Color::Blue, line(&|t| 1e3 * (t.choose + t.fit)));
    time.add("fit alone", Color::Vermillion, line(&|t| 1e3 * t.fit));
    let mut plot = Plot::new("Training spectra of a matrix", error);
    plot.panels.push(time);
    plot
}

#[allow(clippy::too_many_lines, reason = "a study, told from top to bottom")]
pub fn study(study: &Study) -> Result<Section> {
    let camera = &study.camera;
    let total = camera.skies.library.radiance.nrows();
    let all: Vec<usize> = (0..total).collect();
    let (counts, draws) = if study.quick { (&COUNTS[..5], 3) } else { (&COUNTS[..], 40) };
    let measured = camera.measured_skies()?;
    let mut found = Vec::new();
    let mut subsets = Vec::new();
    for &count in counts {
        let (chosen, choose) = if count >= total {
            (all.clone(), 0.0)
        } else {
            timed(|| spanning_subset(&camera.skies.library, &all, count))?
        };
        let mut drawn = Vec::new();
        if count < total {
            for draw in 0..draws {
                drawn.push(judge(camera, &camera.skies.signals, &lot(total, count, study.seed(8) + draw))?);
            }
        }
        let refused = drawn.iter().filter(|error| error.is_nan()).count() as f64 / drawn.len().max(1) as f64;
        let valid: Vec<f64> = drawn.into_iter().filter(|error| error.is_finite()).collect();
        found.push(Training {
            count,
            chosen: judge(camera, &camera.skies.signals, &chosen)?,
            measured: judge(camera, &measured.signals, &chosen)?,
            drawn: [median(valid.clone()), quantile(valid, 0.9)],
            refused,
            choose,
            fit: f64::NAN,
        });
        subsets.push(chosen);
    }
    let mut works: Vec<Work<'_>> = Vec::new();
    for training in &subsets {
        works.push(Box::new(|| {
            black_box(matrix(camera, training))?;
            Ok(())
        }));
    }
    // What determines no matrix is not timed.
    let (good, mut works): (Vec<usize>, Vec<Work<'_>>) =
        works.into_iter().enumerate().filter(|(index, _)| found[*index].chosen.is_finite()).unzip();
    let times = study.bench.medians(&mut works)?;
    drop(works);
    for (index, time) in good.into_iter().zip(times) {
        found[index].fit = time;
    }

    let plot = figure(&found, total);
    let mut table = Table::new(&[
        "spectra",
        "chosen: mean ΔE\\*ab",
        "JND",
        "measured skies: mean ΔE\\*ab",
        "by lot: median ΔE\\*ab",
        "90 % are below",
        "no matrix",
        "time to choose",
        "time to fit",
    ]);
    for training in &found {
        let or_dash = |value: f64| if value.is_finite() { digits(value, 3) } else { "–".into() };
        table.row(&[
            training.count.to_string(),
            or_dash(training.chosen),
            or_dash(training.chosen / DELTA_E_PER_JND),
            or_dash(training.measured),
            or_dash(training.drawn[0]),
            or_dash(training.drawn[1]),
            if training.count < total { format!("{} %", digits(100.0 * training.refused, 2)) } else { "–".into() },
            if training.choose > 0.0 { time(training.choose) } else { "–".into() },
            if training.fit.is_finite() { time(training.fit) } else { "–".into() },
        ]);
    }
    let whole = found.last().map_or(f64::NAN, |t| t.chosen);
    let near = |of: &dyn Fn(&Training) -> f64| {
        let enough = found.iter().rev().take_while(|t| of(t) <= 1.25 * whole || !of(t).is_finite()).last();
        enough.map_or("no number here".to_owned(), |t| t.count.to_string())
    };
    let ends = |of: &dyn Fn(&Training) -> f64| {
        let values = || found.iter().map(of).filter(|value| value.is_finite());
        [values().fold(f64::INFINITY, f64::min), values().fold(0.0, f64::max)]
    };
    let (never, choices) = (ends(&|t| t.measured), ends(&|t| if t.choose > 0.0 { t.choose } else { f64::NAN }));
    let count_with = |measured: f64| {
        found.iter().find(|t| t.measured == measured).map_or("no number".to_owned(), |t| t.count.to_string())
    };
    let longest = found.iter().map(|t| t.fit).filter(|t| t.is_finite()).fold(0.0, f64::max);
    Ok(Section {
        title: "Training spectra of the matrix".into(),
        method: format!(
            "SkyRadLS, errors relative to luminance (`fit-matrix --train COUNT --weights relative`), judged without noise on all \
             {total} skies, each at three quarters of full well. Spectra are chosen by k-medoids, as the program does, or drawn by \
             lot {draws} times. Choosing is timed once. The time to fit includes the jackknife uncertainty that the matrix file states. Sets \
             whose signals are too much alike determine no matrix and are refused. The {} measured \
             skies are judged by the same matrices.",
            measured.library.radiance.nrows()
        ),
        figures: vec![(
            "training".into(),
            "Color error, and time, against the number of training spectra".into(),
            plot,
        )],
        tables: vec![(String::new(), table)],
        advice: format!(
            "Where all spectra are at hand, fit on all: {} and mean ΔE {}, without the {} to {} that choosing takes. Where each \
             must be measured first, {} chosen ones come within 25 % of that, and so does every larger number; drawn by lot it \
             takes {} for 90 % of the sets. Measured skies, which no fit has seen, have their \
             lowest mean ΔE ({}) with {} and their highest ({}) with {}: more computed spectra do not make up for another kind.",
            time(longest),
            digits(whole, 3),
            time(choices[0]),
            time(choices[1]),
            near(&|t| t.chosen),
            near(&|t| t.drawn[1]),
            digits(never[0], 3),
            count_with(never[0]),
            digits(never[1], 3),
            count_with(never[1]),
        ),
    })
}

/// Distinct numbers below `total` by lot.
fn lot(total: usize, count: usize, seed: u64) -> Vec<usize> {
    let mut all: Vec<(u32, usize)> = (0..total)
        .map(|i| {
            #[expect(clippy::cast_possible_truncation, reason = "small numbers")]
            let words = philox4x32_10([i as u32, 0, 0, 8], [seed as u32, (seed >> 32) as u32]);
            (words[0], i)
        })
        .collect();
    all.sort_unstable();
    all.into_iter().take(count).map(|(_, index)| index).collect()
}

fn matrix(camera: &Camera, training: &[usize]) -> Result<Matrix> {
    let settings = FitSettings { training: training.to_vec(), weights: Weights::Relative, ..FitSettings::default() };
    Ok(fit(&camera.skies.signals, &camera.responses, &settings, None)?.xyz_from_camera)
}

/// Mean ΔE*ab of skies; NaN where the training spectra determine no matrix.
fn judge(camera: &Camera, skies: &Signals, training: &[usize]) -> Result<f64> {
    let xyz_from_camera = match matrix(camera, training) {
        Ok(matrix) => matrix,
        Err(Error::Data(_)) => return Ok(f64::NAN),
        Err(error) => return Err(error),
    };
    let settings = EvaluationSettings {
        exposure: SampleExposure::Filled { base: EXPOSURE, fraction: 0.75, by: Filling::Aperture },
        noise: NoiseSettings::default(),
        method: Method::EffectiveColor,
        pattern: None,
        color: color_settings(xyz_from_camera, Space::Lab),
        patch: None,
        columns: camera.skies.library.columns,
        dark_frames: 1,
    };
    let skies = evaluate(&camera.sensor, skies, &settings)?;
    Ok(noise_free(&skies).map_or(f64::NAN, |report| report.delta_e_76.summary.mean))
}
