//! How a matrix does on the patches that it was fitted on, and on each of them without it.

use super::fit::{ChartMatrix, Misfit, Patch, fit};
use crate::color::difference::{Difference, DifferenceReport, Differences};
use crate::color::lab_from_xyz;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

/// How a patch comes out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct JudgedPatch {
    /// Its name.
    pub name: String,
    /// Signals of R, G and B.
    pub signal: [f64; 3],
    /// Their standard deviations.
    pub signal_std: [f64; 3],
    /// XYZ of the reference.
    pub reference_xyz: [f64; 3],
    /// XYZ by the matrix.
    pub xyz: [f64; 3],
    /// Standard deviations of these from the noise of the signals.
    pub xyz_std: [f64; 3],
    /// ΔE*ab from the reference.
    pub delta_e_76: f64,
    /// CIEDE2000.
    pub delta_e_2000: f64,
    /// ΔE*ab by the matrix that is fitted on the other patches; absent where these do not determine one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub delta_e_76_without_it: Option<f64>,
    /// CIEDE2000 by that matrix.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub delta_e_2000_without_it: Option<f64>,
}

/// How a matrix does on patches.
#[derive(Debug, Clone, PartialEq)]
pub struct Judgment {
    /// Each patch.
    pub patches: Vec<JudgedPatch>,
    /// Differences of all.
    pub differences: DifferenceReport,
    /// Differences by matrices that were fitted without the patch.
    pub without_it: Option<DifferenceReport>,
}

/// Judges a matrix on the patches that it was fitted on, about a white; none of no patches.
pub fn judge(found: &ChartMatrix, patches: &[Patch], white: [f64; 3]) -> Option<Judgment> {
    let lab = |xyz: Vector3<f64>| lab_from_xyz(xyz.into(), white);
    let difference =
        |patch: &Patch, matrix: &Matrix3<f64>| Difference::between(lab(patch.reference), lab(matrix * patch.signal));
    let own: Vec<Difference> = patches.iter().map(|patch| difference(patch, &found.xyz_from_camera)).collect();
    let without = |left_out: usize| {
        let others: Vec<Patch> = patches
            .iter()
            .enumerate()
            .filter(|(index, _)| *index != left_out)
            .map(|(_, patch)| patch.clone())
            .collect();
        let matrix = fit(&others, Misfit::Known(found.misfit)).ok()?.xyz_from_camera;
        Some(difference(&patches[left_out], &matrix))
    };
    let without: Vec<Option<Difference>> = (0..patches.len()).map(without).collect();
    let judged = patches.iter().zip(own.iter().zip(&without)).map(|(patch, (own, without))| {
        let matrix = &found.xyz_from_camera;
        let spread = matrix * patch.covariance * matrix.transpose();
        let std = |m: &Matrix3<f64>| [0, 1, 2].map(|k| m[(k, k)].max(0.0).sqrt());
        JudgedPatch {
            name: patch.name.clone(),
            signal: patch.signal.into(),
            signal_std: std(&patch.covariance),
            reference_xyz: patch.reference.into(),
            xyz: (matrix * patch.signal).into(),
            xyz_std: std(&spread),
            delta_e_76: own.delta_e_76,
            delta_e_2000: own.delta_e_2000,
            delta_e_76_without_it: without.map(|d| d.delta_e_76),
            delta_e_2000_without_it: without.map(|d| d.delta_e_2000),
        }
    });
    Some(Judgment {
        patches: judged.collect(),
        differences: Differences::of(&own).report()?,
        without_it: Differences::of(without.iter().flatten()).report(),
    })
}
