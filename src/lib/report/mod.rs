//! Reports: statistics and matrices as text, JSON, YAML and CSV, and as plots.

pub mod camera;
pub mod characterization;
pub mod chart;

mod camera_defects;
mod camera_page;
mod camera_patterns;
mod camera_sensor;
mod difference;
mod matrix_text;
mod over_frames;
mod photon_transfer;
mod portrait;
mod prediction;
mod raw_outputs;
mod sequence;
mod trade_off;

pub use camera::CameraOutputs;
pub use camera_page::camera_page;
pub use camera_sensor::sensor_of;
pub use difference::difference;
pub use over_frames::over_frames;
pub use photon_transfer::photon_transfer;
pub use portrait::portrait;
pub use prediction::{BudgetOutputs, prediction};
pub use raw_outputs::RawOutputs;
pub use sequence::{Findings, Reports};
pub use trade_off::trade_off;

use crate::analysis::statistics::check::{Subject, Test};
use crate::analysis::statistics::{ChannelReport, RegionReport, Report, Verdict};
use crate::error::{Error, Result};
use crate::formats::places::named;
use crate::formats::yaml_writer;
use crate::names::Named;
use crate::text::{in_digits, visible};
use std::fmt::Write;
use std::path::Path;

/// The form of a report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReportFormat {
    /// A table for people.
    Text,
    /// JSON.
    Json,
    /// YAML.
    Yaml,
    /// CSV, one row per region and channel; patches have their place after the predictions.
    Csv,
}

impl Named for ReportFormat {
    const ALL: &'static [Self] = &[Self::Text, Self::Json, Self::Yaml, Self::Csv];

    fn name(self) -> &'static str {
        match self {
            Self::Text => "text",
            Self::Json => "json",
            Self::Yaml => "yaml",
            Self::Csv => "csv",
        }
    }

    fn other_names(self) -> &'static [&'static str] {
        match self {
            Self::Text => &["txt"],
            Self::Yaml => &["yml"],
            Self::Json | Self::Csv => &[],
        }
    }
}

/// The form of a report: what was asked for, or that of which the name of its file ends.
///
/// # Errors
///
/// [`Error::Usage`] for a name that ends like that of another form.
pub fn form_of<F: Named>(asked: Option<F>, output: Option<&Path>) -> Result<Option<F>> {
    let ending = named(output).and_then(Path::extension).map(|ending| ending.to_string_lossy().to_lowercase());
    // Of several frames JSON has a line each.
    let ending = ending.map(|ending| if LINES.contains(&ending.as_str()) { "json".into() } else { ending });
    match ending.filter(|_| asked.is_none()) {
        None => Ok(asked),
        Some(ending) => match F::named(&ending) {
            None if OF_OTHERS.contains(&ending.as_str()) => {
                let known: Vec<&str> = F::ALL.iter().map(|form| form.name()).collect();
                let problem = format!("no report is written as .{ending}; there are {}", known.join(", "));
                Err(Error::Usage(problem).change(&["output"]))
            }
            found => Ok(found),
        },
    }
}

/// Refuses the name of another kind of file for one of YAML, which would take the place of a frame or a table.
///
/// # Errors
///
/// [`Error::Usage`].
pub fn check_yaml_name(output: Option<&Path>, what: &str) -> Result<()> {
    let ending = named(output).and_then(Path::extension).map(|ending| ending.to_string_lossy().to_lowercase());
    let is_yaml = |ending: &String| ["yaml", "yml"].contains(&ending.as_str());
    let is_other = |ending: &String| {
        !is_yaml(ending) && (OF_OTHERS.contains(&ending.as_str()) || LINES.contains(&ending.as_str()))
    };
    match (output, ending.filter(is_other)) {
        (Some(output), Some(_)) => {
            let shown = output.display();
            Err(Error::Usage(format!("{shown}: a {what} file is written as YAML; end its name in .yaml")))
        }
        _ => Ok(()),
    }
}

/// What names of files of JSON lines end in.
const LINES: [&str; 2] = ["jsonl", "ndjson"];

/// What names of files end in that no report should be written to.
const OF_OTHERS: [&str; 46] = [
    "json", "yaml", "yml", "csv", "tsv", "xls", "xlsx", "xlsm", "ods", "numbers", "parquet", "html", "htm", "xml",
    "md", "rst", "tex", "doc", "docx", "odt", "rtf", "pages", "ppt", "pptx", "odp", "epub", "pdf", "ps", "eps", "svg",
    "png", "jpg", "jpeg", "gif", "bmp", "webp", "exr", "tif", "tiff", "dng", "fits", "fit", "npy", "npz", "h5", "mat",
];

fn unwritable(error: impl std::fmt::Display) -> Error {
    Error::Data(format!("the report cannot be written: {error}"))
}

/// A report in one of the forms that all have: by its keys, or as its own table or text.
fn in_form(
    report: &impl serde::Serialize,
    format: ReportFormat,
    csv: impl FnOnce() -> Result<String>,
    text: impl FnOnce() -> String,
) -> Result<String> {
    match format {
        ReportFormat::Json => serde_json::to_string_pretty(report).map(|text| text + "\n").map_err(unwritable),
        ReportFormat::Yaml => yaml_writer::document("the report", report),
        ReportFormat::Csv => csv(),
        ReportFormat::Text => Ok(visible(&text()).into_owned()),
    }
}

/// The text of a table whose rows are all written.
fn finished(writer: csv::Writer<Vec<u8>>) -> Result<String> {
    String::from_utf8(writer.into_inner().map_err(unwritable)?).map_err(unwritable)
}

/// Writes statistics.
///
/// # Errors
///
/// [`Error::Data`] when the form cannot hold them.
pub fn render(report: &Report, format: ReportFormat) -> Result<String> {
    in_form(report, format, || csv(report), || text(report))
}

/// Column headings of the text and CSV forms, with the number of significant digits of text.
const COLUMNS: [(&str, &str); 12] = [
    ("mean", "mean"),
    ("std", "std"),
    ("min", "min"),
    ("max", "max"),
    ("snr_db", "SNR/dB"),
    ("clipped", "clipped"),
    ("predicted_mean", "pred. mean"),
    ("predicted_std", "pred. std"),
    ("z_mean", "z mean"),
    ("z_std", "z std"),
    ("mean_error", "mean err."),
    ("std_error", "std err."),
];

fn values(channel: &ChannelReport) -> [Option<f64>; 12] {
    [
        channel.mean,
        channel.std,
        channel.min,
        channel.max,
        channel.snr_db,
        channel.clipped.map(|count| count as f64),
        channel.predicted_mean,
        channel.predicted_std,
        channel.z_mean,
        channel.z_std,
        channel.mean_error,
        channel.std_error,
    ]
}

/// What samples are, in the CSV forms.
const UNIT_COLUMNS: [&str; 2] = ["quantity", "unit"];

/// What the check of a frame says, by column: the same in all rows of the frame.
fn verdict_cells(verdict: Verdict) -> [(&'static str, String); 3] {
    [
        ("as_predicted", verdict.passed.to_string()),
        ("tests", verdict.tests.to_string()),
        ("smallest_p", verdict.smallest_p.to_string()),
    ]
}

fn csv(report: &Report) -> Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    // Columns that were there first keep their places.
    let (first, errors) = COLUMNS.split_at(10);
    let keys = |columns: &[(&'static str, &'static str)]| columns.iter().map(|(key, _)| *key).collect::<Vec<_>>();
    let head = ["x", "y", "width", "height", "channel", "count"].into_iter().chain(keys(first));
    let of_patches = report.regions.iter().any(|region| region.patch.is_some());
    let last: &[&str] = if of_patches { &["sample", "patch_column", "patch_row"] } else { &[] };
    let verdict = report.check.map(verdict_cells);
    let of_verdict = verdict.iter().flatten().map(|(key, _)| *key);
    writer
        .write_record(head.chain(last.iter().copied()).chain(keys(errors)).chain(UNIT_COLUMNS).chain(of_verdict))
        .map_err(unwritable)?;
    for region in &report.regions {
        for channel in region.channels.iter().chain(&region.classes) {
            let numbers = values(channel).map(|value| value.map_or(String::new(), |v| v.to_string()));
            let (first, errors) = numbers.split_at(10);
            let place = [region.region.x, region.region.y, region.region.width, region.region.height];
            let cells = place
                .iter()
                .map(ToString::to_string)
                .chain([channel.name.clone(), channel.count.to_string()])
                .chain(first.iter().cloned())
                .chain(region.patch.into_iter().flat_map(|[column, row]| {
                    let sample = region.sample.map_or(String::new(), |sample| sample.to_string());
                    [sample, column.to_string(), row.to_string()]
                }))
                .chain(errors.iter().cloned())
                .chain([region.quantity.to_string(), region.unit.clone()])
                .chain(verdict.iter().flatten().map(|(_, cell)| cell.clone()));
            writer.write_record(cells).map_err(unwritable)?;
        }
    }
    finished(writer)
}

fn text(report: &Report) -> String {
    let mut out = String::new();
    if report.regions.iter().any(|region| region.patch.is_some()) {
        patches_text(&report.regions, &mut out);
    } else {
        for region in &report.regions {
            region_text(region, &mut out);
            tests_text(&region.tests, &mut out);
        }
    }
    if tells_uncertainty(report) {
        let _ = writeln!(out, "{}", report.uncertainty.in_words());
    }
    report.check.iter().for_each(|verdict| verdict_text(verdict, &mut out));
    out
}

fn verdict_text(verdict: &Verdict, out: &mut String) {
    let outcome = if verdict.passed { "as predicted" } else { "not as predicted" };
    let _ = writeln!(
        out,
        "{outcome}: {} tests, smallest p {:.3e}, corrected {:.3e}, level {:e}",
        verdict.tests, verdict.smallest_p, verdict.corrected_p, verdict.level
    );
    if verdict.is_noiseless {
        let _ = writeln!(
            out,
            "the frame should hold no noise: its values were compared with those expected, but no law of noise was tested"
        );
    }
}

/// Whether a report has predicted standard deviations, or layers of them.
fn tells_uncertainty(report: &Report) -> bool {
    let channels = || report.regions.iter().flat_map(|region| region.channels.iter().chain(&region.classes));
    channels().any(|channel| channel.predicted_std.is_some() || channel.name.starts_with("sigma."))
}

/// A number in as many digits as a reader compares.
fn shown(key: &str, value: Option<f64>) -> String {
    let Some(value) = value else { return "-".into() };
    match key {
        "clipped" => format!("{value}"),
        "snr_db" | "z_mean" | "z_std" => format!("{value:.2}"),
        "mean_error" | "std_error" => in_digits(value, 2),
        _ => in_digits(value, 6),
    }
}

/// A unit behind what it is of; nothing of none.
pub(super) fn in_brackets(unit: &str) -> String {
    if unit.is_empty() { String::new() } else { format!(" [{unit}]") }
}

fn region_text(region: &RegionReport, out: &mut String) {
    let r = region.region;
    let mut line = format!(
        "{}x{} at {},{}: {} pixels of {}{}",
        r.width,
        r.height,
        r.x,
        r.y,
        region.count,
        region.quantity,
        in_brackets(&region.unit)
    );
    if region.not_finite > 0 {
        let _ = write!(line, ", {} not finite left out", region.not_finite);
    }
    if region.saturated > 0 {
        let left_out = if region.leaves_saturated_out { " left out" } else { "" };
        let _ = write!(line, ", {} saturated{left_out}", region.saturated);
    }
    out.push_str(&line);
    out.push('\n');
    let channels: Vec<&ChannelReport> = region.channels.iter().chain(&region.classes).collect();
    let mut columns: Vec<Vec<String>> =
        vec![std::iter::once(String::new()).chain(channels.iter().map(|channel| channel.name.clone())).collect()];
    for (index, (key, heading)) in COLUMNS.into_iter().enumerate() {
        let cells: Vec<Option<f64>> = channels.iter().map(|channel| values(channel)[index]).collect();
        if cells.iter().any(Option::is_some) {
            let texts = cells.into_iter().map(|value| shown(key, value));
            columns.push(std::iter::once(heading.to_owned()).chain(texts).collect());
        }
    }
    if columns.len() == 1 {
        out.push_str("no statistics: no pixel is left to count\n");
        return;
    }
    table(&columns, out);
    if region.channels.len() > 1
        && region.channels.len() <= 6
        && let Some(covariance) = &region.covariance
    {
        out.push_str("covariance\n");
        let names: Vec<String> =
            std::iter::once(String::new()).chain(region.channels.iter().map(|channel| channel.name.clone())).collect();
        let mut columns = vec![names];
        for (j, channel) in region.channels.iter().enumerate() {
            let cells = covariance.iter().map(|row| shown("covariance", Some(row[j])));
            columns.push(std::iter::once(channel.name.clone()).chain(cells).collect());
        }
        table(&columns, out);
    }
}

/// The classes of a plane, which tell more than their mixture, or the channels.
fn channels(region: &RegionReport) -> &[ChannelReport] {
    if region.classes.is_empty() { &region.channels } else { &region.classes }
}

/// Writes a line per patch: its number, or column and row where that is not known; pixels; mean and spread of R, G and B
/// or of what was made of them. Layers of standard deviations are left to the other forms.
fn patches_text(regions: &[RegionReport], out: &mut String) {
    let Some(first) = regions.first() else { return };
    let (r, count) = (first.region, regions.len());
    let _ = writeln!(
        out,
        "{count} {}, {}x{} pixels of {}{} in each",
        if count == 1 { "patch" } else { "patches" },
        r.width,
        r.height,
        first.quantity,
        in_brackets(&first.unit)
    );
    let column = |heading: String, cell: &dyn Fn(&RegionReport) -> String| -> Vec<String> {
        std::iter::once(heading).chain(regions.iter().map(cell)).collect()
    };
    let mut columns = Vec::new();
    if regions.iter().all(|region| region.sample.is_some()) {
        columns.push(column("sample".into(), &|region| region.sample.map_or("-".into(), |sample| sample.to_string())));
    } else {
        for (axis, heading) in ["column", "row"].into_iter().enumerate() {
            let cell = |region: &RegionReport| region.patch.map_or("-".into(), |patch| patch[axis].to_string());
            columns.push(column(heading.into(), &cell));
        }
    }
    columns.push(column("count".into(), &|region| region.count.to_string()));
    if regions.iter().any(|region| region.not_finite > 0) {
        columns.push(column("not finite".into(), &|region| region.not_finite.to_string()));
    }
    if regions.iter().any(|region| region.saturated > 0) {
        columns.push(column("saturated".into(), &|region| region.saturated.to_string()));
    }
    for (index, channel) in channels(first).iter().take(3).enumerate() {
        for (wanted, (key, heading)) in COLUMNS.into_iter().enumerate() {
            if ["mean", "std", "z_std"].contains(&key) {
                let value = |region: &RegionReport| values(&channels(region)[index])[wanted];
                if regions.iter().any(|region| value(region).is_some()) {
                    columns.push(column(format!("{} {heading}", channel.name), &|region| shown(key, value(region))));
                }
            }
        }
    }
    table(&columns, out);
}

fn tests_text(tests: &[Test], out: &mut String) {
    if tests.is_empty() {
        return;
    }
    let column = |heading: &str, cell: &dyn Fn(&Test) -> String| -> Vec<String> {
        std::iter::once(heading.to_owned()).chain(tests.iter().map(cell)).collect()
    };
    let subject = |test: &Test| match test.subject {
        Subject::Mean => "mean".to_owned(),
        Subject::Variance => "variance".to_owned(),
        Subject::Correlation => "correlation".to_owned(),
        Subject::VarianceOfRowMeans => "variance of row means".to_owned(),
        Subject::VarianceOfColumnMeans => "variance of column means".to_owned(),
        Subject::Deviation => "deviation".to_owned(),
        Subject::VarianceOfMeans => "variance of means".to_owned(),
        Subject::CorrelationOfMeans => "correlation of means".to_owned(),
        Subject::TemporalVariance => "temporal variance".to_owned(),
        Subject::TemporalCorrelation => "temporal correlation".to_owned(),
        Subject::VarianceOfFrameMeans => "variance of frame means".to_owned(),
    };
    let columns = [
        column("test", &subject),
        column("of", &|test| test.channels.join(", ")),
        column("measured", &|test| shown("", Some(test.measured))),
        column("expected", &|test| shown("", Some(test.expected))),
        column("z", &|test| shown("z_mean", test.z)),
        column("freedom", &|test| shown("", test.degrees_of_freedom)),
        column("p", &|test| format!("{:.3e}", test.p)),
    ];
    table(&columns, out);
}

/// Writes columns of equal length, numbers flush right.
fn table(columns: &[Vec<String>], out: &mut String) {
    let widths: Vec<usize> =
        columns.iter().map(|column| column.iter().map(|cell| cell.chars().count()).max().unwrap_or(0)).collect();
    for row in 0..columns.first().map_or(0, Vec::len) {
        let cells: Vec<String> =
            columns.iter().zip(&widths).map(|(column, width)| format!("{:>width$}", column[row])).collect();
        let _ = writeln!(out, "{}", cells.join("  ").trim_end());
    }
}
