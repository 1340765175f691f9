//! Reports of measured cameras: as text, JSON, YAML and Markdown.

use super::camera_defects::{defects_of, outstanding, patterns_of};
use super::{check_yaml_name, form_of, in_brackets, in_digits, table, unwritable};
use crate::analysis::photon_transfer::{ClassFindings, Finding, PatternView};
use crate::error::Result;
use crate::formats::places::named;
use crate::formats::plots::{PlotFormat, write_plot};
use crate::formats::{output, register, yaml_writer};
use crate::names::Named;
use crate::numerics::variance_components::Interval;
use crate::requests::photon_transfer::{MeasuredCamera, frames_in_words};
use crate::requests::values;
use crate::text::visible;
use clap::Args;
use serde_json::{Map, Value, json};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// The form of a report of a camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CameraFormat {
    /// A table for people.
    Text,
    /// JSON.
    Json,
    /// YAML.
    Yaml,
    /// Markdown.
    Markdown,
}

impl Named for CameraFormat {
    const ALL: &'static [Self] = &[Self::Text, Self::Json, Self::Yaml, Self::Markdown];

    fn name(self) -> &'static str {
        match self {
            Self::Text => "text",
            Self::Json => "json",
            Self::Yaml => "yaml",
            Self::Markdown => "markdown",
        }
    }

    fn other_names(self) -> &'static [&'static str] {
        match self {
            Self::Text => &["txt"],
            Self::Yaml => &["yml"],
            Self::Markdown => &["md"],
            Self::Json => &[],
        }
    }
}

/// Where a report of a camera goes, and in which form.
#[derive(Debug, Clone, Args)]
pub struct CameraOutputs {
    /// Form of the report; by default that of the ending of its file, or text
    #[arg(long, value_parser = values::choice::<CameraFormat>())]
    pub output_format: Option<CameraFormat>,
    /// Draw photon transfer, response, linearity, signal to noise, and the patterns, as SVG or PNG; reports in JSON and YAML have the patterns' curves then
    #[arg(long, value_name = "FILE.svg|png")]
    pub plot: Option<PathBuf>,
    /// Write what was measured as a sensor file, for --sensor, by the name of the file, which says of each number whether it was measured, derived or assumed
    #[arg(long, value_name = "FILE")]
    pub sensor_out: Option<PathBuf>,
    /// File for the report; by default standard output
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
}

impl CameraOutputs {
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
        check_yaml_name(self.sensor_out.as_deref(), "sensor")?;
        register::announce(&[self.output.as_deref(), self.plot.as_deref(), self.sensor_out.as_deref()])
    }

    /// Whether a figure is asked for.
    pub fn draws(&self) -> bool {
        self.plot.is_some()
    }

    /// Writes report and plot.
    ///
    /// # Errors
    ///
    /// [`crate::error::Error::Data`] when the form cannot hold it, and those of the disk.
    pub fn write(&self, camera: &MeasuredCamera) -> Result<()> {
        if let Some(plot) = &self.plot {
            write_plot(plot, &super::camera_page(camera))?;
        }
        // What was measured is told whether or not a sensor follows.
        let form = form_of(self.output_format, self.output.as_deref())?.unwrap_or(CameraFormat::Text);
        output::write_text(self.output.as_deref(), &camera_report(camera, form)?)?;
        let Some(path) = &self.sensor_out else { return Ok(()) };
        let mut sensor = super::sensor_of(camera)?;
        if let Some(stem) = named(Some(path)).and_then(Path::file_stem) {
            sensor.name = stem.to_string_lossy().into_owned();
        }
        output::write_text(Some(path), &yaml_writer::write("the sensor", &sensor)?)
    }
}

/// Writes what was measured of a camera.
///
/// # Errors
///
/// [`crate::error::Error::Data`] when the form cannot hold it.
pub fn camera_report(camera: &MeasuredCamera, format: CameraFormat) -> Result<String> {
    match format {
        CameraFormat::Json => {
            serde_json::to_string_pretty(&document(camera)).map(|text| text + "\n").map_err(unwritable)
        }
        CameraFormat::Yaml => yaml_writer::document("the report", &document(camera)),
        CameraFormat::Markdown => Ok(markdown(camera)),
        CameraFormat::Text => Ok(visible(&text(camera)).into_owned()),
    }
}

fn document(camera: &MeasuredCamera) -> Value {
    let channels: Vec<Value> =
        camera.classes.iter().zip(&camera.patterns).map(|(class, views)| channel(class, views)).collect();
    json!({
        "list": camera.list,
        "frames": {"flats": camera.frames[0], "darks": camera.frames[1]},
        "temperature_k": camera.temperature_k,
        "confidence": camera.confidence,
        "corrected": camera.corrected,
        "channels": channels,
    })
}

fn channel(class: &ClassFindings, views: &[Option<PatternView>; 2]) -> Value {
    let mut all = Map::new();
    all.insert("name".into(), class.name.clone().into());
    let mut undetermined = Map::new();
    for Finding { key, found, .. } in &class.findings {
        let value = match found {
            Ok(Interval { value, low, high }) => json!({"value": value, "low": low, "high": high}),
            Err(why) => {
                undetermined.insert((*key).into(), why.clone().into());
                Value::Null
            }
        };
        all.insert((*key).into(), value);
    }
    all.insert("undetermined".into(), undetermined.into());
    all.insert("curve".into(), json!(class.curve));
    all.insert("darks".into(), json!(class.darks));
    let deviations = class.linearity.as_ref().map(|linearity| &linearity.deviations);
    all.insert("linearity".into(), json!(deviations));
    all.insert("defects".into(), defects_of(class, views));
    if let Some(patterns) = patterns_of(views) {
        all.insert("patterns".into(), patterns);
    }
    all.insert("doubts".into(), json!(class.doubts));
    all.insert("notes".into(), json!(class.notes));
    all.into()
}

/// An interval with the digits that its width leaves, in per cent where that is how it is read.
fn shown(finding: &Finding, Interval { value, low, high }: Interval) -> [String; 3] {
    let is_share = finding.unit.is_empty() && !["snr_max", "dynamic_range"].contains(&finding.key);
    let (scale, unit) = if is_share { (100.0, " %") } else { (1.0, "") };
    let width = ((high - low) / 2.0).abs();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 2 and 9")]
    let digits = if width > 0.0 && value != 0.0 {
        ((value.abs() / width).log10().floor() + 3.0).clamp(2.0, 9.0) as u8
    } else {
        4
    };
    [value, low, high].map(|number| in_digits(number * scale, digits) + unit)
}

/// What each number is, with its symbol's part of another where it has one.
fn label(finding: &Finding) -> String {
    let part = finding.what.starts_with("of ");
    let unit = in_brackets(finding.unit);
    if part { format!("  {}{unit}", finding.what) } else { format!("{}{unit}", finding.what) }
}

fn heading(camera: &MeasuredCamera) -> String {
    let at = camera.temperature_k.map_or(String::new(), |kelvin| format!(" at {kelvin} K"));
    let [width, height] = [camera.head.geometry.width, camera.head.geometry.height];
    let percent = in_digits(camera.confidence * 100.0, 3);
    let percent = percent.trim_end_matches('0').trim_end_matches('.');
    let corrected = camera.corrected.as_ref().map_or(String::new(), |how| format!("; {how}"));
    format!(
        "{}: {} of {width}x{height}{at}; intervals hold with {percent} %{corrected}",
        camera.list,
        frames_in_words(camera.frames)
    )
}

fn text(camera: &MeasuredCamera) -> String {
    let mut out = heading(camera) + "\n";
    for (class, views) in camera.classes.iter().zip(&camera.patterns) {
        let _ = writeln!(out, "\n{}", class.name);
        let (told, untold): (Vec<&Finding>, Vec<&Finding>) =
            class.findings.iter().partition(|finding| finding.found.is_ok());
        let mut rows: Vec<[String; 4]> = vec![["".into(), "value".into(), "from".into(), "to".into()]];
        for finding in told {
            if let Ok(interval) = &finding.found {
                let [value, low, high] = shown(finding, *interval);
                rows.push([label(finding), value, low, high]);
            }
        }
        let width = rows.iter().map(|row| row[0].chars().count()).max().unwrap_or(0);
        for row in &mut rows {
            row[0] = format!("{:<width$}", row[0]);
        }
        let columns: Vec<Vec<String>> =
            (0..4).map(|column| rows.iter().map(|row| row[column].clone()).collect()).collect();
        table(&columns, &mut out);
        let mut reasons: Vec<(&str, Vec<&str>)> = Vec::new();
        for finding in untold {
            if let Err(why) = &finding.found {
                match reasons.iter_mut().find(|(known, _)| known == why) {
                    Some((_, keys)) => keys.push(finding.key),
                    None => reasons.push((why, vec![finding.key])),
                }
            }
        }
        for (why, keys) in reasons {
            let _ = writeln!(out, "not determined: {}: {why}", keys.join(", "));
        }
        for doubt in &class.doubts {
            let _ = writeln!(out, "in doubt: {doubt}");
        }
        for (view, place) in views.iter().zip(["under light", "in the dark"]) {
            out.push_str(&view.as_ref().map_or(String::new(), |view| outstanding(view, place) + "\n"));
        }
    }
    out
}

fn markdown(camera: &MeasuredCamera) -> String {
    let escaped = |text: &str| text.replace('|', "\\|");
    let mut out = format!("# Camera measured by photon transfer\n\n{}.\n", escaped(&heading(camera)));
    for (class, views) in camera.classes.iter().zip(&camera.patterns) {
        let _ = write!(out, "\n## {}\n\n| quantity | value | from | to |\n|:-|-:|-:|-:|\n", escaped(&class.name));
        for finding in &class.findings {
            if let Ok(interval) = &finding.found {
                let [value, low, high] = shown(finding, *interval);
                let _ = writeln!(out, "| {} | {value} | {low} | {high} |", label(finding).trim());
            }
        }
        let untold = class.findings.iter().filter_map(|finding| Some((finding.key, finding.found.as_ref().err()?)));
        let lines: Vec<String> = untold.map(|(key, why)| format!("- `{key}`: {why}\n")).collect();
        if !lines.is_empty() {
            let _ = write!(out, "\nNot determined:\n\n{}", lines.concat());
        }
        if !class.doubts.is_empty() {
            let doubts: Vec<String> = class.doubts.iter().map(|doubt| format!("- {}\n", escaped(doubt))).collect();
            let _ = write!(out, "\nIn doubt:\n\n{}", doubts.concat());
        }
        for (view, place) in views.iter().zip(["under light", "in the dark"]) {
            out.push_str(&view.as_ref().map_or(String::new(), |view| format!("\n{}.\n", outstanding(view, place))));
        }
    }
    out
}
