//! Statistics over frames as text, JSON, YAML and CSV.

use super::{
    ReportFormat, UNIT_COLUMNS, finished, in_brackets, in_form, shown, table, tests_text, unwritable, verdict_cells,
    verdict_text,
};
use crate::analysis::statistics::{RepeatedChannel, RepeatedRegion, RepeatedReport};
use crate::error::Result;
use std::fmt::Write;

/// Columns of the CSV form and of text, with their headings.
const COLUMNS: [(&str, &str); 17] = [
    ("mean", "mean"),
    ("temporal_std", "temporal"),
    ("fixed_std", "fixed"),
    ("std_of_means", "of means"),
    ("std_of_frame_means", "of frames"),
    ("clipped", "clipped"),
    ("predicted_mean", "mean"),
    ("predicted_temporal_std", "temporal"),
    ("predicted_fixed_std", "fixed"),
    ("predicted_std_of_means", "of means"),
    ("predicted_std_of_frame_means", "of frames"),
    ("z_mean", "mean"),
    ("z_temporal_std", "temporal"),
    ("z_std_of_means", "of means"),
    ("mean_error", "mean"),
    ("temporal_std_error", "temporal"),
    ("fixed_std_error", "fixed"),
];

fn values(channel: &RepeatedChannel) -> [Option<f64>; 17] {
    [
        channel.mean,
        channel.temporal_std,
        channel.fixed_std,
        channel.std_of_means,
        channel.std_of_frame_means,
        channel.clipped.map(|count| count as f64),
        channel.predicted_mean,
        channel.predicted_temporal_std,
        channel.predicted_fixed_std,
        channel.predicted_std_of_means,
        channel.predicted_std_of_frame_means,
        channel.z_mean,
        channel.z_temporal_std,
        channel.z_std_of_means,
        channel.mean_error,
        channel.temporal_std_error,
        channel.fixed_std_error,
    ]
}

/// Writes statistics over frames.
///
/// # Errors
///
/// [`crate::error::Error::Data`] when the form cannot hold them.
pub fn over_frames(report: &RepeatedReport, format: ReportFormat) -> Result<String> {
    in_form(report, format, || csv(report), || text(report))
}

fn csv(report: &RepeatedReport) -> Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let head = ["x", "y", "width", "height", "frames", "channel", "count"].into_iter();
    let verdict = report.check.map(verdict_cells);
    let of_verdict = verdict.iter().flatten().map(|(key, _)| *key);
    writer
        .write_record(head.chain(COLUMNS.map(|(key, _)| key)).chain(UNIT_COLUMNS).chain(of_verdict))
        .map_err(unwritable)?;
    for region in &report.regions {
        for channel in region.channels.iter().chain(&region.classes) {
            let place = [region.region.x, region.region.y, region.region.width, region.region.height];
            let cells = place
                .map(|place| place.to_string())
                .into_iter()
                .chain([report.frames.to_string(), channel.name.clone(), channel.count.to_string()])
                .chain(values(channel).map(|value| value.map_or(String::new(), |v| v.to_string())))
                .chain([region.quantity.to_string(), region.unit.clone()])
                .chain(verdict.iter().flatten().map(|(_, cell)| cell.clone()));
            writer.write_record(cells).map_err(unwritable)?;
        }
    }
    finished(writer)
}

fn text(report: &RepeatedReport) -> String {
    let mut out = String::new();
    for region in &report.regions {
        region_text(report.frames, region, &mut out);
        tests_text(&region.tests, &mut out);
    }
    let channels = || report.regions.iter().flat_map(|region| region.channels.iter().chain(&region.classes));
    if channels().any(|channel| channel.predicted_temporal_std.is_some()) {
        let _ = writeln!(out, "{}", report.uncertainty.in_words());
    } else if let Some(why) = &report.unpredicted {
        let _ = writeln!(out, "nothing is predicted: {why}");
    }
    report.check.iter().for_each(|verdict| verdict_text(verdict, &mut out));
    out
}

fn region_text(frames: u32, region: &RepeatedRegion, out: &mut String) {
    let r = region.region;
    let _ = write!(
        out,
        "{frames} frames of {}x{} at {},{}: {} pixels of {}{}",
        r.width,
        r.height,
        r.x,
        r.y,
        region.count,
        region.quantity,
        in_brackets(&region.unit)
    );
    if region.left_out > 0 {
        let _ = write!(out, ", {} left out", region.left_out);
    }
    out.push('\n');
    if region.count == 0 {
        out.push_str("no statistics: no pixel is left to count\n");
        return;
    }
    let channels: Vec<&RepeatedChannel> = region.channels.iter().chain(&region.classes).collect();
    let heads = |lead: &str| -> Vec<String> {
        std::iter::once(lead.to_owned()).chain(channels.iter().map(|channel| channel.name.clone())).collect()
    };
    for (lead, of) in [("", 0..6), ("predicted", 6..11), ("z", 11..14), ("error", 14..17)] {
        let mut columns = vec![heads(lead)];
        for index in of {
            let (key, heading) = COLUMNS[index];
            let cells: Vec<Option<f64>> = channels.iter().map(|channel| values(channel)[index]).collect();
            if cells.iter().any(Option::is_some) {
                let texts = cells.into_iter().map(|value| shown(digits(key), value));
                columns.push(std::iter::once(heading.to_owned()).chain(texts).collect());
            }
        }
        if columns.len() > 1 {
            table(&columns, out);
        }
    }
}

/// The key of a number of as many digits.
fn digits(key: &str) -> &str {
    match key {
        key if key.starts_with("z_") => "z_mean",
        key if key.ends_with("_error") => "mean_error",
        other => other,
    }
}
