//! Fitting a matrix to a chart of known colors, seen by the camera.

mod doubts;
mod expected;
mod seen;

use super::super::described::{Described, DescribedWithBlack, SaidExposure};
use super::super::notes::Note;
use super::super::options::Selection;
use super::super::values;
use super::exposure::ChartExposure;
use crate::analysis::characterization::regression::residuals;
use crate::analysis::characterization::{
    CameraMatrix, ChartRecord, MATRIX_UNIT, MatrixUncertainty, RELATIVE_MATRIX_UNIT, Signals, Training,
};
use crate::analysis::chart::fit::{ChartMatrix, Misfit, Patch, fit};
use crate::analysis::chart::judgment::{Judgment, judge};
use crate::camera::levels::BlackLevel;
use crate::cfa::FilterArray;
use crate::color::{chromaticity, rows_of};
use crate::error::{Error, Result};
use crate::formats::chart::{DEFAULT_REFERENCE, Light, Reference, load_reference};
use crate::formats::data;
use crate::formats::input::{FrameReader, InputOptions};
use crate::requests::values::LightColor;
use clap::Args;
use expected::Expected;
use nalgebra::{DMatrix, Matrix3, Vector3};
use seen::{Seen, Turned, see_frame, see_table};
use std::path::{Path, PathBuf};

/// Share of white by which the references of a chart and what no matrix does are never off.
const MOST_MISFIT: f64 = 0.1;

/// A chart, as a frame or as a table, the colors that it has, and the light on it.
#[derive(Debug, Clone, Args)]
pub struct ChartFit {
    /// Frame of a ColorChecker, a CFA plane of ADU such as a DNG: fit the matrix to its 24 patches
    #[arg(long, value_name = "FRAME", conflicts_with = "patches")]
    pub chart: Option<PathBuf>,
    /// Centers of the corner patches in pixels from the frame's first sample: dark skin, bluish green, black, white
    #[arg(long, value_name = "X,Y,X,Y,X,Y,X,Y", value_parser = values::corners, allow_hyphen_values = true)]
    pub corners: Option<[[f64; 2]; 4]>,
    /// CSV of means of patches: columns R, G, B, where known name, std_R, std_G, std_B, cov_RG, cov_RB, cov_GB
    #[arg(long, value_name = "FILE.csv")]
    pub patches: Option<PathBuf>,
    /// What of its file is the frame of the chart.
    #[command(flatten)]
    pub selection: Selection,
    /// Filter array of the frame of the chart, where that does not say it: rggb, bggr, grbg, gbrg
    #[arg(long, value_name = "PATTERN", value_parser = str::parse::<FilterArray>)]
    pub cfa: Option<FilterArray>,
    /// Black and white level, ADU, of the frame of the chart, where that does not say them, or of the means in --patches, which
    /// without are shares of white level less black level
    #[arg(long, value_name = "BLACK,WHITE", value_parser = values::levels)]
    pub levels: Option<[f64; 2]>,
    /// Colors of the patches: colorchecker (made from November 2014 on), colorchecker-2005 (before), or a CSV of X,Y,Z, x,y,Y or
    /// L,a,b with a column name, or of reflectances
    #[arg(long, value_name = "NAME|FILE.csv", default_value = DEFAULT_REFERENCE)]
    pub reference: String,
    /// Light that the colors of --reference are for, and the white of its L*a*b*
    #[arg(long, value_name = "LIGHT", default_value = "d50", value_parser = values::light)]
    pub reference_light: LightColor,
    /// Light on the chart, or of --from-raw: a, d50, d55, d65, d75, e, a temperature such as 3200K, or a file of its spectrum.
    /// Reflectances are seen in it; colors are adapted to it from the light of the reference, which is the default
    #[arg(long, value_name = "LIGHT|FILE")]
    pub illuminant: Option<String>,
    /// The same by its temperature in K: below 4000 K a black body, above CIE daylight
    #[arg(long, value_name = "K", value_parser = values::temperature, conflicts_with = "illuminant")]
    pub temperature: Option<String>,
    /// Luminance in cd/m2 of a perfect diffuser in the light of the chart, for a matrix to absolute XYZ
    #[arg(long, value_name = "CD_PER_M2", value_parser = values::positive)]
    pub luminance: Option<f64>,
    /// YAML file whose metadata replace those that come with the frame of the chart
    #[arg(long, value_name = "FILE")]
    pub metadata: Option<PathBuf>,
    /// Exposure of the frame of the chart, where that does not say it.
    #[command(flatten)]
    pub exposure: ChartExposure,
    /// Let the noise of the patches alone weigh them: no error of references and matrix is estimated beside it
    #[arg(long)]
    pub no_misfit: bool,
}

/// A matrix fitted to a chart, with what was found out about it.
#[derive(Debug, Clone, PartialEq)]
pub struct ChartFound {
    /// The matrix.
    pub matrix: CameraMatrix,
    /// How it does on the patches.
    pub judgment: Judgment,
    /// What came up.
    pub notes: Vec<Note>,
}

/// So many times smaller residuals tell that a chart is turned: those of charts as they are given are some hundredths of white,
/// and those of charts that are turned several times as large.
const MUCH_BETTER: f64 = 2.0;

impl ChartFit {
    /// The light that is named, if one is.
    pub(super) fn light(&self) -> Result<Option<Light>> {
        self.illuminant.as_deref().or(self.temperature.as_deref()).map(Light::load).transpose()
    }

    /// Makes sure that what describes the frame of a chart has one to describe.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`].
    pub(super) fn check(&self) -> Result<()> {
        let Selection { part, raw, channel, crop } = &self.selection;
        let SaidExposure { exposure_s, f_number, lens_transmittance } = self.exposure.0;
        let of_frame: [(&'static [&'static str], bool); 10] = [
            (&["corners"], self.corners.is_some()),
            (&["cfa"], self.cfa.is_some()),
            (&["metadata"], self.metadata.is_some()),
            (&["part"], *part > 0),
            (&["raw"], raw.is_some()),
            (&["channel"], channel.is_some()),
            (&["crop"], crop.is_some()),
            (&["exposure"], exposure_s.is_some()),
            (&["f_number"], f_number.is_some()),
            (&["lens_transmittance"], lens_transmittance.is_some()),
        ];
        match of_frame.into_iter().find(|(_, is_given)| *is_given) {
            Some((option, _)) if self.chart.is_none() => {
                let problem = "no frame of a chart is named, --chart FRAME, which alone is described so";
                Err(Error::Usage(problem.into()).leave_out(option))
            }
            _ => Ok(()),
        }
    }

    /// Fits the matrix to the chart; none where no chart is named.
    ///
    /// # Errors
    ///
    /// Those of readers and of [`fit`]; [`Error::Usage`] where patches and reference do not go together, or the light of
    /// reflectances is missing.
    pub fn run(&self) -> Result<Option<ChartFound>> {
        let (seen, turned) = match (&self.chart, self.corners, &self.patches) {
            (Some(_), None, _) => {
                return Err(Error::Usage(
                    "--chart needs --corners X,Y,X,Y,X,Y,X,Y, which tell where the chart is: column and row of the centers of dark \
                     skin, bluish green, black and white, in pixels from the frame's first sample"
                        .into(),
                ));
            }
            (Some(frame), Some(corners), _) => see_frame(self.open(frame)?, corners)?,
            (_, _, Some(table)) => (see_table(table, self.levels)?, Vec::new()),
            _ if self.levels.is_some() => {
                let problem = "levels are those of a chart; give --chart or --patches";
                return Err(Error::Usage(problem.into()).leave_out(&["levels"]));
            }
            _ => return Ok(None),
        };
        let reference = load_reference(&self.reference)?;
        let observer = data::load_observer()?;
        let expected = Expected::new(&reference, self.reference_light, self.light()?, &observer)?;
        let patches = matched(&seen, &expected, &reference)?;
        for Turned { corners, seen: turned } in &turned {
            let [as_it_is, turned] = [residual(&patches), residual(&matched(turned, &expected, &reference)?)];
            let gain = as_it_is / turned;
            // Where no matrix at all has the colors, no corner is the one that was missed.
            if as_it_is.is_finite() && gain > MUCH_BETTER {
                return Err(Error::Usage(format!(
                    "{}: --corners begin at another patch than dark skin: turned, the chart fits its colors {gain:.1} times \
                     better; give --corners {}",
                    seen.source,
                    corners.as_flattened().iter().map(f64::to_string).collect::<Vec<_>>().join(",")
                )));
            }
        }
        let misfit = if self.no_misfit { Misfit::None } else { Misfit::Estimated };
        let found = fit(&patches, misfit)?;
        if found.misfit > MOST_MISFIT {
            return Err(Error::Data(format!(
                "{}: the matrix misses the colors of the chart by {:.2} of white, which those of a chart are never off by; check \
                 --corners (dark skin, bluish green, black, white) or the order of the patches",
                seen.source, found.misfit
            )));
        }
        let Some(judgment) = judge(&found, &patches, expected.white) else {
            return Err(Error::Data("the matrix gives colors that are not finite".into()));
        };
        let mut notes: Vec<Note> = seen.notes.iter().chain(&expected.notes).cloned().collect();
        notes.extend(doubts(&seen, &expected, &found));
        let neutral = expected.neutral.unwrap_or(expected.white);
        notes.extend(doubts::of_neutrals(&seen.source, &patches, neutral, seen.range_adu));
        notes.extend(doubts::of_names(&seen.source, &patches, expected.white));
        notes.extend(doubts::of_classes(&seen.source, &found, &observer, seen.frame.is_some())?);
        let matrix = self.matrix(&seen, &expected, &reference, &patches, &found)?;
        Ok(Some(ChartFound { matrix, judgment, notes }))
    }

    /// Opens the frame of the chart, as it is described.
    fn open(&self, frame: &Path) -> Result<FrameReader> {
        let options = InputOptions { metadata: self.metadata.clone(), ..self.selection.of(frame) };
        let [black, white_level_adu] = [0, 1].map(|end| self.levels.map(|levels| levels[end]));
        let black_level_adu = black.map(BlackLevel::Uniform);
        let described = Described { cfa: self.cfa, white_level_adu, ..Described::default() };
        let mut reader = DescribedWithBlack { described, black_level_adu }.open(&options)?;
        self.exposure.0.apply(reader.header_mut())?;
        Ok(reader)
    }

    /// The matrix file.
    fn matrix(
        &self,
        seen: &Seen,
        expected: &Expected,
        reference: &Reference,
        patches: &[Patch],
        found: &ChartMatrix,
    ) -> Result<CameraMatrix> {
        let scale = self.scale(seen)?;
        let xyz_from_camera = rows_of(&(found.xyz_from_camera * Matrix3::from_diagonal(&Vector3::from(scale))));
        let signals = Signals {
            camera: DMatrix::from_fn(patches.len(), 3, |i, j| patches[i].signal[j]),
            xyz: DMatrix::from_fn(patches.len(), 3, |i, j| patches[i].reference[j]),
        };
        let all: Vec<usize> = (0..patches.len()).collect();
        let (relative_rms, max_chromaticity_error) = residuals(&rows_of(&found.xyz_from_camera), &signals, &all);
        let covariance = |a: usize, b: usize| found.covariance[(a, b)] * scale[a % 3] * scale[b % 3];
        let inverse = found.xyz_from_camera.try_inverse();
        let of_white = inverse.map(|inverse| inverse * Vector3::from(expected.white));
        let saturation_y = of_white.map(|signal| signal.max().recip()).filter(|y| *y > 0.0 && y.is_finite());
        let unit = if self.luminance.is_some() { MATRIX_UNIT } else { RELATIVE_MATRIX_UNIT };
        let frame = seen.frame.as_ref().map(|frame| &frame.metadata);
        Ok(CameraMatrix {
            method: Some(format!("chart, total least squares; XYZ in the light {}", expected.light)),
            sensor: frame.and_then(|frame| frame.camera_names().next().map(str::to_owned)),
            white_xy: Some(chromaticity(expected.white)),
            condition: Some(found.condition),
            rank: Some(3),
            training: Some(Training {
                relative_rms,
                max_chromaticity_error,
                ..Training::of(format!("the chart in {}", seen.source), patches.len())
            }),
            uncertainty: Some(MatrixUncertainty {
                method: if found.misfit > 0.0 { "noise of the patches and misfit" } else { "noise of the patches" }
                    .into(),
                standard_error: [0, 1, 2].map(|i| [0, 1, 2].map(|j| covariance(3 * i + j, 3 * i + j).max(0.0).sqrt())),
                covariance: [0, 1, 2].map(|i| [0, 1, 2].map(|j| [0, 1, 2].map(|k| covariance(3 * i + j, 3 * i + k)))),
                element_covariance: Some(std::array::from_fn(|a| std::array::from_fn(|b| covariance(a, b)))),
            }),
            chart: Some(ChartRecord {
                reference: reference.name.clone(),
                light: expected.light.clone(),
                left_out: seen
                    .left_out
                    .iter()
                    .map(|(index, why)| format!("{}: {why}", expected.names[*index]))
                    .collect(),
                misfit: found.misfit,
                chi_squared_per_degree: found.chi_squared / found.degrees as f64,
                chi_squared_per_degree_of_noise: found.chi_squared_of_noise.map(|sum| sum / found.degrees as f64),
                degrees: found.degrees,
                saturation_y,
            }),
            ..CameraMatrix::of_codes(unit, xyz_from_camera, frame, seen.range_adu)
        })
    }

    /// What each class's elements are multiplied with for the unit of the file.
    fn scale(&self, seen: &Seen) -> Result<[f64; 3]> {
        let Some(luminance) = self.luminance else { return Ok([1.0; 3]) };
        let Some(frame) = &seen.frame else {
            let problem = "absolute XYZ take the exposure of a frame, which means of patches do not have";
            return Err(Error::Usage(problem.into()).leave_out(&["luminance"]));
        };
        let exposure_s_sr = frame.exposure()?.exposure_s_sr();
        let black = frame.uniform_black_adu()?;
        let white = frame.metadata.white_level_adu.ok_or_else(|| frame.missing("white_level_adu"))?;
        Ok([luminance * exposure_s_sr / white.range_above(black); 3])
    }
}

/// Root of the mean squared residual of patches by the matrix that fits them best; infinite where there is none.
fn residual(patches: &[Patch]) -> f64 {
    let Ok(found) = fit(patches, Misfit::Estimated) else { return f64::INFINITY };
    let squares = patches.iter().map(|patch| patch.residual(&found.xyz_from_camera).norm_squared());
    (squares.sum::<f64>() / patches.len() as f64).sqrt()
}

/// A name as it is compared: small letters and digits alone.
fn plain(name: &str) -> String {
    name.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

/// Patches with the colors that belong to them, by name, or by order where the patches have none.
fn matched(seen: &Seen, expected: &Expected, reference: &Reference) -> Result<Vec<Patch>> {
    let (count, known) = (seen.signals.len(), expected.names.len());
    if seen.names.is_none() && count != known {
        let (source, reference) = (&seen.source, &reference.name);
        return Err(Error::Usage(format!(
            "{source} has {count} patches and {reference} has {known}; they must be the same"
        )));
    }
    let place = |index: usize| match &seen.names {
        None => Ok(index),
        Some(names) => expected.names.iter().position(|name| plain(name) == plain(&names[index])).ok_or_else(|| {
            Error::Usage(format!("{}: the patch `{}` is not in {}", seen.source, names[index], reference.name))
        }),
    };
    let counts = (0..count).filter(|index| seen.left_out.iter().all(|(left_out, _)| left_out != index));
    let patch = |index: usize| {
        let place = place(index)?;
        Ok(Patch {
            name: expected.names[place].clone(),
            signal: seen.signals[index],
            covariance: seen.covariances[index],
            reference: Vector3::from(expected.xyz[place]),
        })
    };
    counts.map(patch).collect()
}

/// What may not be meant about a chart and the matrix that was found.
fn doubts(seen: &Seen, expected: &Expected, found: &ChartMatrix) -> Vec<Note> {
    let name = |index: usize| seen.names.as_ref().unwrap_or(&expected.names)[index].clone();
    let mut notes: Vec<Note> = seen
        .left_out
        .iter()
        .map(|(index, why)| Note::Warning(format!("{}: the patch {} is left out: {why}", seen.source, name(*index))))
        .collect();
    let range_adu = seen.range_adu.unwrap_or(1.0);
    notes.extend(doubts::of_patches(&seen.source, &seen.read, name, range_adu));
    if let Some(chi_squared) = found.chi_squared_of_noise {
        let ratio = chi_squared / found.degrees as f64;
        let text = if found.misfit > 0.0 {
            format!(
                "the patches are off by {:.1} times their noise; references and matrix are taken to be off by {:.5} of white",
                ratio.sqrt(),
                found.misfit
            )
        } else {
            format!("chi squared per degree of freedom is {ratio:.2} for the noise of the patches alone")
        };
        notes.push(Note::Remark(text));
    }
    notes
}
