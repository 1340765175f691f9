//! Reports of fitted matrices and of how well they do.

use super::chart;
use super::matrix_text::{differences_text, matrix_text};
use super::trade_off::trade_off;
use super::{ReportFormat, check_yaml_name, finished, in_form, shown, table, unwritable};
use crate::analysis::characterization::CameraMatrix;
use crate::analysis::characterization::noise_aware::TradeOff;
use crate::color::difference::{Difference, DifferenceReport};
use crate::error::{Error, Result};
use crate::formats::plots::{PlotFormat, write_plot};
use crate::formats::{files, output, register, yaml_writer};
use crate::requests::fit::{
    Characterization, ChartFound, Conditions, Evaluation, Fit, Group, MatrixFound, MatrixRequest, NoiseReport,
};
use crate::requests::values;
use clap::Args;
use serde::Serialize;
use std::fmt::Write;
use std::path::PathBuf;

/// Where a matrix and its report go, in which form, and the plot.
#[derive(Debug, Clone, Default, Args)]
pub struct MatrixOutputs {
    /// Form of what goes to standard output; by default yaml, and text with --evaluate or --noise-weight, or of a
    /// chart whose matrix goes to a file
    #[arg(long, value_parser = values::one_of(&[ReportFormat::Yaml, ReportFormat::Json, ReportFormat::Text, ReportFormat::Csv]))]
    pub output_format: Option<ReportFormat>,
    /// Draw the trade-off of --noise-weight, as SVG or PNG
    #[arg(long, value_name = "FILE.svg|png")]
    pub plot: Option<PathBuf>,
    /// Matrix file to write, as YAML; reports go to standard output
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
}

impl MatrixOutputs {
    /// Refuses, before any work, what the fit does not give or what cannot be written.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`]; those of [`PlotFormat::of_path`] and [`register::announce`].
    pub fn check(&self, fit: &Fit) -> Result<()> {
        if let Some(plot) = &self.plot {
            PlotFormat::of_path(plot)?;
            if fit.noise_weight.is_none() {
                return Err(Error::Usage("--plot draws the trade-off of --noise-weight; give that too".into()));
            }
        }
        if self.output_format == Some(ReportFormat::Csv) && fit.evaluate.is_none() && fit.noise_weight.is_none() {
            return Err(Error::Usage(
                "csv has one row for each sample of --evaluate LIBRARY, or for each weight of --noise-weight; give one of \
                 them too"
                    .into(),
            ));
        }
        register::announce(&[self.output.as_deref(), self.plot.as_deref()])
    }

    /// Refuses, before any work, what the request does not give or what cannot be written.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`]; those of [`Self::check`].
    pub fn check_request(&self, request: &MatrixRequest) -> Result<()> {
        if let Some(fit) = &request.fit {
            return self.check(fit);
        }
        if self.plot.is_some() {
            return Err(Error::Usage(
                "--plot draws the trade-off of --noise-weight, which a chart or a raw has not".into(),
            ));
        }
        if self.output_format == Some(ReportFormat::Csv) && request.raw.from_raw.is_some() {
            return Err(Error::Usage("csv has one row for each patch of a chart; a raw file has none".into()));
        }
        register::announce(&[self.output.as_deref()])
    }

    /// Writes matrix file and report, of a chart as text where nothing else is asked for.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for a matrix file of the name of another kind; those of [`Self::write`] and [`chart::chart`].
    pub fn write_found(&self, found: &MatrixFound) -> Result<()> {
        match found {
            MatrixFound::Fitted(found) => self.write(found),
            MatrixFound::OfChart(found) => self.write_chart(found),
            MatrixFound::Own(matrix, _) => {
                let matrix = CameraMatrix::clone(matrix);
                self.write(&Characterization { matrix, evaluation: None, trade_off: Vec::new(), notes: Vec::new() })
            }
        }
    }

    /// Writes the matrix file of a chart, and its report.
    fn write_chart(&self, found: &ChartFound) -> Result<()> {
        check_yaml_name(self.output.as_deref(), "matrix")?;
        let to_file = files::named(self.output.as_deref());
        let file = matrix(&found.matrix)?;
        if let Some(path) = to_file {
            output::write_text(Some(path), &file)?;
        }
        match (to_file, self.output_format) {
            (None, None) => output::write_text(None, &file),
            (_, format) => output::write_text(None, &chart::chart(found, format.unwrap_or(ReportFormat::Text))?),
        }
    }

    /// Writes matrix file, plot and report.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for a matrix file of the name of another kind; those of [`characterization`] and of the disk.
    pub fn write(&self, found: &Characterization) -> Result<()> {
        check_yaml_name(self.output.as_deref(), "matrix")?;
        let to_file = files::named(self.output.as_deref());
        if let Some(path) = to_file {
            output::write_text(Some(path), &matrix(&found.matrix)?)?;
        }
        if let Some(plot) = &self.plot {
            write_plot(plot, &trade_off(&found.trade_off))?;
        }
        let has_report = found.evaluation.is_some() || !found.trade_off.is_empty();
        let format = self.output_format.unwrap_or(if has_report { ReportFormat::Text } else { ReportFormat::Yaml });
        if to_file.is_none() || has_report || format != ReportFormat::Yaml {
            output::write_text(None, &characterization(found, format)?)?;
        }
        Ok(())
    }
}

/// Writes what was found; YAML without evaluation is the matrix file itself.
///
/// # Errors
///
/// [`crate::error::Error::Data`] when the form cannot hold it.
pub fn characterization(found: &Characterization, format: ReportFormat) -> Result<String> {
    if format == ReportFormat::Yaml && found.evaluation.is_none() && found.trade_off.is_empty() {
        return matrix(&found.matrix);
    }
    let csv = || match &found.evaluation {
        Some(evaluation) => samples_csv(evaluation),
        None => trade_off_csv(&found.trade_off),
    };
    in_form(&Whole::of(found), format, csv, || text(found))
}

/// Writes a matrix file.
///
/// # Errors
///
/// [`crate::error::Error::Data`] when the form cannot hold it.
pub fn matrix(matrix: &CameraMatrix) -> Result<String> {
    yaml_writer::write("the matrix", matrix)
}

/// The report as a document.
#[derive(Serialize)]
struct Whole<'a> {
    matrix: [[f64; 3]; 3],
    #[serde(skip_serializing_if = "Option::is_none")]
    unit: &'a Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    method: &'a Option<String>,
    condition: Option<f64>,
    rank: Option<usize>,
    training: &'a Option<crate::analysis::characterization::Training>,
    uncertainty: &'a Option<crate::analysis::characterization::MatrixUncertainty>,
    #[serde(skip_serializing_if = "Option::is_none")]
    evaluation: Option<&'a DifferenceReport>,
    #[serde(skip_serializing_if = "Option::is_none")]
    about: Option<&'a Conditions>,
    #[serde(skip_serializing_if = "Option::is_none")]
    noise: Option<&'a NoiseReport>,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    groups: &'a [Group],
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    trade_off: &'a [TradeOff],
}

impl<'a> Whole<'a> {
    fn of(found: &'a Characterization) -> Self {
        let evaluation = found.evaluation.as_ref();
        Self {
            matrix: found.matrix.xyz_from_camera,
            unit: &found.matrix.unit,
            method: &found.matrix.method,
            condition: found.matrix.condition,
            rank: found.matrix.rank,
            training: &found.matrix.training,
            uncertainty: &found.matrix.uncertainty,
            evaluation: evaluation.map(|evaluation| &evaluation.noise_free),
            about: evaluation.map(|evaluation| &evaluation.conditions),
            noise: evaluation.and_then(|evaluation| evaluation.noise.as_ref()),
            groups: evaluation.map(|evaluation| evaluation.groups.as_slice()).unwrap_or_default(),
            trade_off: &found.trade_off,
        }
    }
}

fn trade_off_csv(curve: &[TradeOff]) -> Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for point in curve {
        writer.serialize(point).map_err(unwritable)?;
    }
    finished(writer)
}

/// One row per sample.
fn samples_csv(evaluation: &Evaluation) -> Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let formulas = ["delta_e_76", "jnd", "delta_e_94", "delta_e_2000"];
    let named =
        |prefix: &str, names: &[&str]| -> Vec<String> { names.iter().map(|name| format!("{prefix}{name}")).collect() };
    let mut head: Vec<String> = ["sample", "exposure_s", "f_number"].map(str::to_owned).to_vec();
    head.extend(named("electrons_", &["R", "G", "B"]));
    head.extend(named("white_", &["X", "Y", "Z"]));
    head.extend(named("true_", &["X", "Y", "Z"]));
    head.extend(named("camera_", &["X", "Y", "Z"]));
    head.extend(formulas.map(str::to_owned));
    let with_noise = evaluation.samples.iter().any(|sample| sample.noise.is_some());
    if with_noise {
        for what in ["patch_mean_", "pixel_mean_", "pixel_std_", "pixel_max_"] {
            head.extend(named(what, &formulas));
        }
        for what in ["std_", "predicted_std_"] {
            head.extend(named(what, &["X", "Y", "Z", "L", "a", "b"]));
        }
        head.extend(
            ["noise_delta_e", "predicted_delta_e", "predicted_delta_e_std", "predicted_patch_delta_e", "clipped"]
                .map(str::to_owned),
        );
    }
    if !evaluation.labels.is_empty() {
        head.push("label".into());
    }
    writer.write_record(&head).map_err(unwritable)?;
    let number = |value: f64| value.to_string();
    let of = |d: &Difference| [d.delta_e_76, d.jnd(), d.delta_e_94, d.delta_e_2000].map(number);
    for (index, sample) in evaluation.samples.iter().enumerate() {
        let mut row = vec![sample.sample.to_string()];
        row.extend([sample.exposure.exposure_s, sample.exposure.f_number].map(number));
        for three in [sample.electrons, sample.white, sample.xyz, sample.camera_xyz] {
            row.extend(three.map(number));
        }
        row.extend(of(&sample.noise_free));
        if let Some(noise) = &sample.noise {
            for difference in [&noise.patch_mean, &noise.pixel_mean, &noise.pixel_std, &noise.pixel_max] {
                row.extend(of(difference));
            }
            row.extend(noise.xyz_std.into_iter().chain(noise.lab_std).map(number));
            let maybe = |value: Option<f64>| value.map_or(String::new(), number);
            row.extend([0, 1, 2].map(|i| maybe(noise.predicted.map(|p| p.xyz_std[i]))));
            row.extend([0, 1, 2].map(|i| maybe(noise.predicted.map(|p| p.lab_std[i]))));
            row.push(number(noise.noise_delta_e));
            row.push(maybe(noise.predicted.map(|p| p.delta_e)));
            row.push(maybe(noise.predicted.map(|p| p.delta_e_std)));
            row.push(maybe(noise.predicted.map(|p| p.patch_delta_e)));
            row.push(noise.clipped.to_string());
        }
        if let Some(label) = evaluation.labels.get(index) {
            row.push(label.clone());
        }
        writer.write_record(&row).map_err(unwritable)?;
    }
    finished(writer)
}

fn text(found: &Characterization) -> String {
    let mut out = String::new();
    matrix_text(&found.matrix, &mut out);
    if let Some(evaluation) = &found.evaluation {
        evaluation_text(evaluation, &mut out);
    }
    if !found.trade_off.is_empty() {
        out.push_str("\ntrade-off of errors and noise, rms Delta E*ab of a pixel\n");
        let column = |heading: &str, of: &dyn Fn(&TradeOff) -> f64| -> Vec<String> {
            std::iter::once(heading.to_owned())
                .chain(found.trade_off.iter().map(|point| shown("", Some(of(point)))))
                .collect()
        };
        let columns = [
            column("noise weight", &|point| point.noise_weight),
            column("error of the matrix", &|point| point.model_delta_e),
            column("noise", &|point| point.noise_delta_e),
            column("together", &|point| point.model_delta_e.hypot(point.noise_delta_e)),
        ];
        table(&columns, &mut out);
    }
    out
}

fn evaluation_text(evaluation: &Evaluation, out: &mut String) {
    let about = &evaluation.conditions;
    let _ =
        writeln!(out, "\n{} samples of {}, {}; white {}", about.samples, about.library, about.exposure, about.white);
    out.push_str("without noise\n");
    differences_text(&[(String::new(), evaluation.noise_free)], out);
    if let (Some(noise), Some([width, height])) = (&evaluation.noise, about.patch) {
        let _ = writeln!(
            out,
            "with noise, {width}x{height} pixels of each sample, {}, seed {}",
            about.demosaic, about.seed
        );
        differences_text(
            &[
                ("patch mean ".into(), noise.patch_mean),
                ("pixel mean ".into(), noise.pixel_mean),
                ("pixel std ".into(), noise.pixel_std),
            ],
            out,
        );
        let predicted = noise.noise.predicted_jnd.map_or(String::new(), |jnd| format!(", predicted {jnd:.4}"));
        let _ = writeln!(
            out,
            "noise of a pixel, mean over the samples: {:.4} JND{predicted}; largest difference of a pixel {:.2} JND",
            noise.noise.simulated_jnd, noise.pixel_max.jnd.summary.max
        );
        if noise.clipped > 0 {
            let _ = writeln!(out, "{} photosites of the patches and their margins were clipped", noise.clipped);
        }
    }
    if !evaluation.groups.is_empty() {
        out.push_str("by group, JND without noise\n");
        let column = |heading: &str, of: &dyn Fn(&Group) -> String| -> Vec<String> {
            std::iter::once(heading.to_owned()).chain(evaluation.groups.iter().map(of)).collect()
        };
        let jnd = |of: fn(&crate::numerics::distribution::Summary) -> f64| {
            move |group: &Group| format!("{:.4}", of(&group.differences.jnd.summary))
        };
        let columns = [
            column("", &|group| group.name.clone()),
            column("samples", &|group| group.samples.to_string()),
            column("trained on", &|group| group.trained_on.to_string()),
            column("mean", &jnd(|summary| summary.mean)),
            column("median", &jnd(|summary| summary.median)),
            column("p95", &jnd(|summary| summary.p95)),
            column("max", &jnd(|summary| summary.max)),
        ];
        table(&columns, out);
    }
}
