//! Reports of noise budgets.

use super::photon_transfer::photon_transfer;
use super::{ReportFormat, finished, form_of, in_digits, shown, table, unwritable};
use crate::camera::optics::Exposure;
use crate::chain::{ChainPrediction, ChainStage, StagePrediction};
use crate::error::Result;
use crate::formats::plots::{PlotFormat, write_plot};
use crate::formats::{output, register, yaml_writer};
use crate::names::Named;
use crate::requests::prediction::{Budgets, Conditions, PredictedNoise, SamplePrediction};
use crate::requests::values;
use crate::text::visible;
use clap::Args;
use serde::Serialize;
use std::fmt::Write;
use std::path::PathBuf;

/// Where a report of noise budgets goes, in which form, and its plot.
#[derive(Debug, Clone, Default, Args)]
pub struct BudgetOutputs {
    /// Form of the report; by default that of the ending of its file, or text, and csv for a sweep or all samples
    #[arg(long, value_parser = values::choice::<ReportFormat>())]
    pub output_format: Option<ReportFormat>,
    /// Draw the photon transfer curve, with its read, shot and fixed-pattern regimes, as SVG or PNG
    #[arg(long, value_name = "FILE.svg|png", conflicts_with = "all_samples")]
    pub plot: Option<PathBuf>,
    /// File for the report; by default standard output
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
}

impl BudgetOutputs {
    /// Refuses, before any work, what cannot be written.
    ///
    /// # Errors
    ///
    /// Those of [`PlotFormat::of_path`] and [`register::announce`].
    pub fn check(&self) -> Result<()> {
        if let Some(plot) = &self.plot {
            PlotFormat::of_path(plot)?;
        }
        form_of(self.output_format, self.output.as_deref())?;
        register::announce(&[self.output.as_deref(), self.plot.as_deref()])
    }

    /// Writes report and plot.
    ///
    /// # Errors
    ///
    /// Those of [`prediction`], of the curve and of the disk.
    pub fn write(&self, found: &mut PredictedNoise) -> Result<()> {
        let text = prediction(found, form_of(self.output_format, self.output.as_deref())?)?;
        if let Some(plot) = &self.plot {
            write_plot(plot, &photon_transfer(&found.transfer_curve()?))?;
        }
        output::write_text(self.output.as_deref(), &text)
    }
}

/// What was predicted, with what it was predicted for.
#[derive(Serialize)]
struct Whole<'a> {
    #[serde(flatten)]
    conditions: &'a Conditions,
    #[serde(flatten)]
    budgets: Document<'a>,
}

#[derive(Serialize)]
#[serde(untagged)]
enum Document<'a> {
    Scene(&'a ChainPrediction),
    Sweep { sweep: &'a [ChainPrediction] },
    Samples { samples: &'a [SamplePrediction] },
}

/// Writes noise budgets; where no form is given, as text for one scene, as CSV for many. Text also shows the relative error
/// of the sum over wavelengths, which the documents have among their conditions; that of many scenes is CSV too.
///
/// # Errors
///
/// [`crate::error::Error::Data`] when the form cannot hold it.
pub fn prediction(found: &PredictedNoise, format: Option<ReportFormat>) -> Result<String> {
    let PredictedNoise { conditions, budgets, .. } = found;
    let is_one = matches!(budgets, Budgets::Scene(_));
    let format = format.unwrap_or(if is_one { ReportFormat::Text } else { ReportFormat::Csv });
    let document = match budgets {
        Budgets::Scene(scene) => Document::Scene(scene),
        Budgets::Sweep(sweep) => Document::Sweep { sweep },
        Budgets::Samples(samples) => Document::Samples { samples },
    };
    let whole = Whole { conditions, budgets: document };
    match (format, budgets) {
        (ReportFormat::Json, _) => serde_json::to_string_pretty(&whole).map(|text| text + "\n").map_err(unwritable),
        (ReportFormat::Yaml, _) => yaml_writer::document("the report", &whole),
        (ReportFormat::Text, Budgets::Scene(scene)) => {
            let own = conditions.true_xyz.map_or(String::new(), |own| own_xyz(scene, own));
            let text =
                text(scene, conditions.quadrature_error) + "\n" + &own + &conditions.uncertainty.in_words() + "\n";
            Ok(visible(&text).into_owned())
        }
        (ReportFormat::Csv, Budgets::Scene(scene)) => stages_csv(scene),
        (_, Budgets::Sweep(levels)) => scenes_csv(&[], levels.iter().map(|scene| (Vec::new(), scene, None))),
        (_, Budgets::Samples(samples)) => {
            let lead = |one: &SamplePrediction| {
                let Exposure { exposure_s, f_number, .. } = one.exposure;
                vec![one.sample.to_string(), cell(Some(exposure_s)), cell(Some(f_number))]
            };
            scenes_csv(
                &["sample", "exposure_s", "f_number"],
                samples.iter().map(|one| (lead(one), &one.prediction, one.true_xyz)),
            )
        }
    }
}

fn cell(value: Option<f64>) -> String {
    value.map_or(String::new(), |value| value.to_string())
}

/// One row per stage and channel, the last column why a stage is void.
fn stages_csv(found: &ChainPrediction) -> Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let causes = found.stages.first().map(|stage| stage.causes.as_slice()).unwrap_or_default();
    let fixed = ["stage", "channel", "unit", "mean", "std", "temporal_std", "fixed_pattern_std", "snr_db"];
    let head = fixed.into_iter().map(str::to_owned);
    let of_causes = causes.iter().map(|entry| format!("variance_{}", entry.cause.name()));
    let head = head.chain(["patch_mean_std".to_owned()]).chain(of_causes).chain(["void".to_owned()]);
    writer.write_record(head).map_err(unwritable)?;
    for stage in &found.stages {
        for (i, channel) in stage.channels.iter().enumerate() {
            let numbers = [
                Some(stage.mean[i]),
                Some(stage.std[i]),
                stage.temporal_std.map(|std| std[i]),
                stage.fixed_pattern_std.map(|std| std[i]),
                stage.snr_db[i],
                stage.patch_mean_std.map(|std| std[i]),
            ];
            let of_causes = (0..causes.len()).map(|cause| cell(stage.causes.get(cause).map(|entry| entry.variance[i])));
            let words = [stage.stage.name().to_owned(), channel.clone(), stage.unit.clone()];
            let void = stage.void.unwrap_or_default().to_owned();
            let row = words.into_iter().chain(numbers.map(cell)).chain(of_causes).chain([void]);
            writer.write_record(row).map_err(unwritable)?;
        }
    }
    finished(writer)
}

/// One row per scene, `lead` in front; the last column names the stages that are void.
fn scenes_csv<'a>(
    lead: &[&str],
    found: impl Iterator<Item = (Vec<String>, &'a ChainPrediction, Option<[f64; 3]>)> + Clone,
) -> Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let first = found.clone().next();
    let own = first.as_ref().and_then(|(.., own)| *own).map(|_| ["true_X", "true_Y", "true_Z"]);
    let own = own.into_iter().flatten().map(str::to_owned);
    let first = first.map(|(_, scene, _)| scene);
    let stages = first.map(|scene| scene.stages.as_slice()).unwrap_or_default();
    let each = |stage: &StagePrediction| {
        let name = stage.stage.name();
        let channels = stage.channels.clone();
        channels.into_iter().flat_map(move |channel| {
            ["mean", "std", "snr_db", "patch_mean_std"].map(|what| format!("{name}_{channel}_{what}"))
        })
    };
    let head = lead.iter().copied().chain(["electrons_R", "electrons_G", "electrons_B"]).map(str::to_owned);
    let delta_e = first.and_then(|scene| scene.noise_delta_e).map(|_| ["noise_delta_e", "noise_delta_e_std"]);
    let delta_e = delta_e.into_iter().flatten().map(str::to_owned);
    let head = head.chain(stages.iter().flat_map(each)).chain(delta_e).chain(own).chain(["void".to_owned()]);
    writer.write_record(head).map_err(unwritable)?;
    for (lead, scene, own) in found {
        let signal = scene.electrons.map(|e| cell(Some(e)));
        let cells = scene.stages.iter().flat_map(|stage| {
            (0..3).flat_map(move |i| {
                let patch = stage.patch_mean_std.map(|std| std[i]);
                [Some(stage.mean[i]), Some(stage.std[i]), stage.snr_db[i], patch].map(cell)
            })
        });
        let delta_e = scene.noise_delta_e.map(|found| [found.mean, found.std].map(|value| cell(Some(value))));
        let own = own.into_iter().flatten().map(|value| cell(Some(value)));
        let void = scene.stages.iter().filter(|stage| stage.void.is_some()).map(|stage| stage.stage.name());
        let void = void.collect::<Vec<_>>().join(" ");
        let row = lead.into_iter().chain(signal).chain(cells).chain(delta_e.into_iter().flatten()).chain(own);
        let row = row.chain([void]);
        writer.write_record(row).map_err(unwritable)?;
    }
    finished(writer)
}

/// XYZ of a spectrum itself, and how far those of the camera are off without noise.
fn own_xyz(found: &ChainPrediction, own: [f64; 3]) -> String {
    let Some(stage) = found.stages.iter().find(|stage| stage.stage == ChainStage::Xyz) else { return String::new() };
    let [x, y, z] = own.map(|value| shown("mean", Some(value)));
    let off: [String; 3] = std::array::from_fn(|i| match stage.mean[i] / own[i] - 1.0 {
        off if off.is_finite() => format!("{:+.2} %", 100.0 * off),
        _ => "?".into(),
    });
    format!("XYZ of the spectrum itself: {x} {y} {z}; those of the camera are off by {}\n", off.join(", "))
}

fn text(found: &ChainPrediction, quadrature_error: Option<[f64; 3]>) -> String {
    let mut out = String::new();
    let [red, green, blue] = found.electrons.map(|e| shown("mean", Some(e)));
    let _ = writeln!(out, "expected signal: R {red}, G {green}, B {blue} e-");
    if let Some([red, green, blue]) = quadrature_error {
        let [red, green, blue] = [red, green, blue].map(|error| in_digits(error, 2));
        let _ = writeln!(out, "relative error of the sum over wavelengths: R {red}, G {green}, B {blue}");
    }
    for stage in &found.stages {
        stage_text(stage, &mut out);
    }
    if let Some(noise) = &found.noise_delta_e {
        let _ = write!(
            out,
            "\ncolor difference that noise makes at a pixel: dE*ab {} +- {}, {} JND",
            shown("std", Some(noise.mean)),
            shown("std", Some(noise.std)),
            shown("std", Some(noise.jnd))
        );
        if let Some(patch) = noise.patch_mean {
            let _ = write!(out, "; in the mean of the patch dE*ab {}", shown("std", Some(patch)));
        }
        if let Some(pixels) = noise.pixels_needed {
            let _ = write!(out, "; pixels needed: {pixels}");
        }
        out.push('\n');
    }
    if let Some(first_order) = found.first_order.filter(|first_order| !first_order.holds) {
        let _ = writeln!(
            out,
            "\ngreen is {} times its noise: smooth hue transition divides by it, and its noise cannot be propagated to \
             first order",
            shown("snr_db", Some(first_order.green_over_noise))
        );
    }
    out
}

fn stage_text(stage: &StagePrediction, out: &mut String) {
    let _ = writeln!(out, "\n{} [{}]", stage.stage.name(), stage.unit);
    let mut lines: Vec<(String, [Option<f64>; 3])> =
        vec![("mean".into(), stage.mean.map(Some)), ("std".into(), stage.std.map(Some))];
    let mut part = |name: &str, values: Option<[f64; 3]>| {
        lines.extend(values.map(|values| (name.to_owned(), values.map(Some))));
    };
    part("bias of the mean", stage.bias);
    part("temporal std", stage.temporal_std);
    part("fixed-pattern std", stage.fixed_pattern_std);
    part("patch mean std", stage.patch_mean_std);
    if stage.snr_db.iter().any(Option::is_some) {
        lines.push(("SNR/dB".into(), stage.snr_db));
    }
    if let Some(shares) = stage.saturated {
        let only_there = |share: f64| (share > 0.0).then_some(share);
        lines.push(("saturated share".into(), shares.map(only_there)));
    }
    for entry in stage.causes.iter().filter(|entry| entry.variance.iter().any(|variance| *variance != 0.0)) {
        lines.push((format!("variance: {}", entry.cause.name().replace('_', " ")), entry.variance.map(Some)));
    }
    for (i, row) in stage.covariance.iter().enumerate() {
        if stage.covariance.iter().enumerate().any(|(j, other)| j != i && other[i] != 0.0) {
            lines.push((format!("covariance with {}", stage.channels[i]), row.map(Some)));
        }
    }
    if let Some(pixels) = stage.pixels_needed {
        lines.push(("pixels needed".into(), pixels.map(|count| count.map(|count| count as f64))));
    }
    let key = |name: &str| match name {
        "SNR/dB" => "snr_db",
        "pixels needed" => "clipped",
        _ => "std",
    };
    let mut columns: Vec<Vec<String>> =
        vec![std::iter::once(String::new()).chain(lines.iter().map(|(name, _)| name.clone())).collect()];
    for (i, channel) in stage.channels.iter().enumerate() {
        let cells = lines.iter().map(|(name, values)| shown(key(name), values[i]));
        columns.push(std::iter::once(channel.clone()).chain(cells).collect());
    }
    table(&columns, out);
    if let Some(why) = stage.void {
        let _ = writeln!(out, "void: {why}");
    }
}
