//! Matrices and differences of colors as text.

use super::table;
use crate::analysis::characterization::CameraMatrix;
use crate::color::difference::DifferenceReport;
use crate::text::percent_in_decimals;
use std::fmt::Write;

/// A matrix with what its file says of how well it is known.
pub(super) fn matrix_text(matrix: &CameraMatrix, out: &mut String) {
    let unit = matrix.unit.as_deref().unwrap_or_default();
    let _ = writeln!(out, "XYZ from R, G, B [{unit}], {}", matrix.method.as_deref().unwrap_or("method unknown"));
    for (i, (name, row)) in ["X", "Y", "Z"].iter().zip(matrix.xyz_from_camera).enumerate() {
        let _ = write!(out, "{name} {:>14.6e} {:>14.6e} {:>14.6e}", row[0], row[1], row[2]);
        let _ = match &matrix.uncertainty {
            Some(known) => {
                let [a, b, c] = known.standard_error[i];
                writeln!(out, "   standard error {a:.1e} {b:.1e} {c:.1e}")
            }
            None => writeln!(out),
        };
    }
    if matrix.uncertainty.is_none() && matrix.training.is_some() {
        out.push_str("no standard errors: without any one of the samples the matrix would not be determined\n");
    }
    if let Some(condition) = matrix.condition {
        let rank = matrix.rank.map_or(String::new(), |rank| format!(", rank {rank}"));
        let _ = writeln!(out, "condition number {condition:.2}{rank}");
    }
    if let Some(training) = &matrix.training {
        let [x, y, z] = training.relative_rms.map(|rms| 100.0 * rms);
        let [dx, dy] = training.max_chromaticity_error;
        let held = if training.held_out.is_empty() {
            String::new()
        } else {
            format!(", without {}", training.held_out.join(", "))
        };
        let kept = training.white_sample.map_or(String::new(), |sample| format!(", sample {sample} kept exact"));
        let what = if training.samples.is_none() && matrix.method.as_deref().is_some_and(|m| m.starts_with("max-ign")) {
            "observations of the responses alone, judged on"
        } else {
            "samples of"
        };
        let _ = writeln!(out, "{} {what} {}{held}{kept}", training.count, training.library);
        let _ = writeln!(out, "rms error of X, Y, Z: {x:.3} %, {y:.3} %, {z:.3} %");
        let _ = writeln!(out, "largest error of x, y: {dx:.5}, {dy:.5}");
    }
}

/// A table of differences: one row per formula and heading.
pub(super) fn differences_text(rows: &[(String, DifferenceReport)], out: &mut String) {
    let mut columns: Vec<Vec<String>> =
        ["", "min", "mean", "median", "p95", "max", "<1/10", "<1/4", "<1/2"].map(|heading| vec![heading.into()]).into();
    for (name, report) in rows {
        for (formula, found) in report.formulas() {
            let summary = found.summary;
            columns[0].push(format!("{name}{formula}"));
            let numbers = [summary.min, summary.mean, summary.median, summary.p95, summary.max];
            for (column, number) in columns[1..6].iter_mut().zip(numbers) {
                column.push(format!("{number:.4}"));
            }
            let shares = [found.below_tenth, found.below_quarter, found.below_half];
            for (column, share) in columns[6..].iter_mut().zip(shares) {
                column.push(format!("{} %", percent_in_decimals(share, 1)));
            }
        }
    }
    table(&columns, out);
}
