//! Reports of matrices that were fitted to charts.

use super::matrix_text::{differences_text, matrix_text};
use super::{ReportFormat, finished, in_form, table, unwritable};
use crate::analysis::characterization::CameraMatrix;
use crate::analysis::chart::judgment::JudgedPatch;
use crate::color::difference::DifferenceReport;
use crate::error::Result;
use crate::requests::fit::ChartFound;
use serde::Serialize;
use std::fmt::Write;

/// The report as a document.
#[derive(Serialize)]
struct Whole<'a> {
    matrix: [[f64; 3]; 3],
    #[serde(flatten)]
    about: About<'a>,
    evaluation: &'a DifferenceReport,
    #[serde(skip_serializing_if = "Option::is_none")]
    evaluation_without_the_patch: Option<&'a DifferenceReport>,
    patches: &'a [JudgedPatch],
}

/// What the matrix file says beside the matrix.
#[derive(Serialize)]
struct About<'a> {
    unit: &'a Option<String>,
    method: &'a Option<String>,
    white_xy: &'a Option<[f64; 2]>,
    condition: Option<f64>,
    training: &'a Option<crate::analysis::characterization::Training>,
    uncertainty: &'a Option<crate::analysis::characterization::MatrixUncertainty>,
    chart: &'a Option<crate::analysis::characterization::ChartRecord>,
}

impl<'a> Whole<'a> {
    fn of(found: &'a ChartFound) -> Self {
        let CameraMatrix { unit, method, white_xy, condition, training, uncertainty, chart, .. } = &found.matrix;
        Self {
            matrix: found.matrix.xyz_from_camera,
            about: About { unit, method, white_xy, condition: *condition, training, uncertainty, chart },
            evaluation: &found.judgment.differences,
            evaluation_without_the_patch: found.judgment.without_it.as_ref(),
            patches: &found.judgment.patches,
        }
    }
}

/// Writes what was found; csv has one row for each patch.
///
/// # Errors
///
/// [`crate::error::Error::Data`] when the form cannot hold it.
pub fn chart(found: &ChartFound, format: ReportFormat) -> Result<String> {
    in_form(&Whole::of(found), format, || csv(&found.judgment.patches), || text(found))
}

fn csv(patches: &[JudgedPatch]) -> Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let head = "name,R,G,B,std_R,std_G,std_B,reference_X,reference_Y,reference_Z,X,Y,Z,std_X,std_Y,std_Z,delta_e_76,\
                delta_e_2000,delta_e_76_without_it,delta_e_2000_without_it";
    writer.write_record(head.split(',')).map_err(unwritable)?;
    for patch in patches {
        let numbers = [patch.signal, patch.signal_std, patch.reference_xyz, patch.xyz, patch.xyz_std];
        let mut row = vec![patch.name.clone()];
        row.extend(numbers.as_flattened().iter().chain(&[patch.delta_e_76, patch.delta_e_2000]).map(f64::to_string));
        let maybe = [patch.delta_e_76_without_it, patch.delta_e_2000_without_it];
        row.extend(maybe.map(|value| value.map_or(String::new(), |value| value.to_string())));
        writer.write_record(&row).map_err(unwritable)?;
    }
    finished(writer)
}

fn text(found: &ChartFound) -> String {
    let mut out = String::new();
    matrix_text(&found.matrix, &mut out);
    if let Some(chart) = &found.matrix.chart {
        let _ = writeln!(out, "colors of {}, in the light {}", chart.reference, chart.light);
        if let Some(y) = chart.saturation_y {
            let _ = writeln!(out, "Y = 1 is a perfect diffuser at the chart; white saturates at Y = {y:.3}");
        }
        let of_noise = chart.chi_squared_per_degree_of_noise.map(|ratio| format!(", {ratio:.1} by noise alone"));
        let _ = writeln!(
            out,
            "chi squared per degree of freedom {:.2} ({} degrees){}",
            chart.chi_squared_per_degree,
            chart.degrees,
            of_noise.unwrap_or_default()
        );
        if chart.misfit > 0.0 {
            let _ = writeln!(out, "misfit of X, Y, Z beside the noise: {:.5} of white", chart.misfit);
        }
        for left_out in &chart.left_out {
            let _ = writeln!(out, "left out: {left_out}");
        }
    }
    out.push('\n');
    let column = |heading: &str, of: &dyn Fn(&JudgedPatch) -> String| -> Vec<String> {
        std::iter::once(heading.to_owned()).chain(found.judgment.patches.iter().map(of)).collect()
    };
    let number = |value: f64| format!("{value:.2}");
    let maybe = |value: Option<f64>| value.map_or_else(|| "-".into(), number);
    let mut columns = vec![column("patch", &|patch| patch.name.clone())];
    for (k, name) in ["X", "Y", "Z"].into_iter().enumerate() {
        columns.push(column(name, &|patch| format!("{:.4}", patch.reference_xyz[k])));
        columns.push(column("by matrix", &|patch| format!("{:.4}", patch.xyz[k])));
    }
    columns.push(column("Delta E*ab", &|patch| number(patch.delta_e_76)));
    columns.push(column("Delta E00", &|patch| number(patch.delta_e_2000)));
    columns.push(column("E*ab without it", &|patch| maybe(patch.delta_e_76_without_it)));
    columns.push(column("E00 without it", &|patch| maybe(patch.delta_e_2000_without_it)));
    table(&columns, &mut out);
    out.push('\n');
    let mut rows = vec![(String::new(), found.judgment.differences)];
    rows.extend(found.judgment.without_it.map(|report| ("without the patch: ".to_owned(), report)));
    differences_text(&rows, &mut out);
    out
}
