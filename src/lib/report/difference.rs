//! Reports of color differences.

use super::{ReportFormat, finished, in_digits, in_form, table, unwritable};
use crate::analysis::comparison::ComparisonReport;
use crate::color::difference::DifferenceSummary;
use crate::error::Result;
use std::fmt::Write;

/// The numbers of a formula by their keys, with the headings of the table.
fn values(formula: &DifferenceSummary) -> [(&'static str, &'static str, f64); 8] {
    [
        ("min", "min", formula.summary.min),
        ("mean", "mean", formula.summary.mean),
        ("median", "median", formula.summary.median),
        ("p95", "p95", formula.summary.p95),
        ("max", "max", formula.summary.max),
        ("below_tenth", "< 0.1", formula.below_tenth),
        ("below_quarter", "< 0.25", formula.below_quarter),
        ("below_half", "< 0.5", formula.below_half),
    ]
}

/// Writes a comparison of images or colors.
///
/// # Errors
///
/// [`crate::error::Error::Data`] when the form cannot hold it.
pub fn difference(report: &ComparisonReport, format: ReportFormat) -> Result<String> {
    in_form(report, format, || csv(report), || text(report))
}

/// One row per formula.
fn csv(report: &ComparisonReport) -> Result<String> {
    let formulas = report.differences.formulas();
    let mut writer = csv::Writer::from_writer(Vec::new());
    let keys = values(&formulas[0].1).map(|(key, _, _)| key);
    let about = ["count", "not_finite", "white_x", "white_y", "white_z"];
    writer.write_record(["formula"].into_iter().chain(keys).chain(about)).map_err(unwritable)?;
    let white = [0, 1, 2].map(|i| report.white.map_or(String::new(), |white| white[i].to_string()));
    for (name, formula) in formulas {
        let numbers = values(&formula).map(|(_, _, value)| value.to_string());
        let counts = [report.count, report.not_finite].map(|count| count.to_string());
        let cells = [name.to_owned()].into_iter().chain(numbers).chain(counts).chain(white.clone());
        writer.write_record(cells).map_err(unwritable)?;
    }
    finished(writer)
}

fn text(report: &ComparisonReport) -> String {
    let mut out = String::new();
    let [reference, color] = &report.sides;
    let _ = writeln!(out, "reference: {reference}");
    let _ = writeln!(out, "compared: {color}");
    let _ = match report.white {
        Some([x, y, z]) => writeln!(out, "white: XYZ {x:.3} {y:.3} {z:.3}"),
        None => writeln!(out, "white: none needed, both are L*a*b*"),
    };
    let left_out = match report.not_finite {
        0 => String::new(),
        count => format!(", {count} not finite left out"),
    };
    let _ = writeln!(out, "pixels: {}{left_out}", report.count);
    let formulas = report.differences.formulas();
    let mut columns: Vec<Vec<String>> =
        vec![std::iter::once(String::new()).chain(formulas.iter().map(|(name, _)| (*name).to_owned())).collect()];
    for (index, (_, heading, _)) in values(&formulas[0].1).into_iter().enumerate() {
        let cells = formulas.iter().map(|(_, formula)| in_digits(values(formula)[index].2, 4));
        columns.push(std::iter::once(heading.to_owned()).chain(cells).collect());
    }
    table(&columns, &mut out);
    out
}
