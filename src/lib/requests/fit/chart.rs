//! Fitting a matrix to a chart of known colors, seen by the camera.

use super::super::described::{Described, DescribedWithBlack, SaidExposure};
use super::super::notes::Note;
use super::super::options::Selection;
use super::super::values;
use super::chart_doubts;
use super::exposure::ChartExposure;
use crate::analysis::characterization::regression::residuals;
use crate::analysis::characterization::{
    CameraMatrix, ChartRecord, MATRIX_UNIT, MatrixUncertainty, RELATIVE_MATRIX_UNIT, Signals, Training,
};
use crate::analysis::chart::fit::{ChartMatrix, Misfit, Patch, fit};
use crate::analysis::chart::grid::Grid;
use crate::analysis::chart::judgment::{Judgment, judge};
use crate::analysis::chart::reading::{ChartReader, ReadPatch};
use crate::camera::levels::BlackLevel;
use crate::cfa::FilterArray;
use crate::color::adaptation::Adaptation;
use crate::color::{chromaticity, rows_of, xyz_of_chromaticity};
use crate::error::{Error, Result};
use crate::formats::chart::{Colors, DEFAULT_REFERENCE, Light, Reference, load_patches, load_reference};
use crate::formats::data;
use crate::formats::input::{FrameReader, InputOptions};
use crate::metadata::FrameHeader;
use crate::requests::values::LightColor;
use crate::stream::RowSource;
use clap::Args;
use nalgebra::{DMatrix, Matrix3, Vector3};
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

/// What a camera read of patches.
struct Seen {
    /// Where from.
    source: String,
    names: Option<Vec<String>>,
    signals: Vec<Vector3<f64>>,
    covariances: Vec<Matrix3<f64>>,
    /// Patches that do not count, and why.
    left_out: Vec<(usize, String)>,
    frame: Option<FrameHeader>,
    /// White level less black level, where means are not shares of it already.
    range_adu: Option<f64>,
    notes: Vec<Note>,
    /// What was read of the patches of a chart in a frame; none of a table.
    read: Vec<ReadPatch>,
}

/// What a camera read of the patches of a chart if it is turned.
struct Turned {
    corners: [[f64; 2]; 4],
    seen: Seen,
}

/// So many times smaller residuals tell that a chart is turned: those of charts as they are given are some hundredths of white,
/// and those of charts that are turned several times as large.
const MUCH_BETTER: f64 = 2.0;

/// Colors of patches in a light.
struct Expected {
    names: Vec<String>,
    xyz: Vec<[f64; 3]>,
    white: [f64; 3],
    light: String,
    notes: Vec<Note>,
}

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
            (_, _, Some(table)) => (self.see_table(table)?, Vec::new()),
            _ if self.levels.is_some() => {
                let problem = "levels are those of a chart; give --chart or --patches";
                return Err(Error::Usage(problem.into()).leave_out(&["levels"]));
            }
            _ => return Ok(None),
        };
        let reference = load_reference(&self.reference)?;
        let expected = self.expected(&reference)?;
        let patches = matched(&seen, &expected, &reference)?;
        for Turned { corners, seen: turned } in &turned {
            let gain = residual(&patches) / residual(&matched(turned, &expected, &reference)?);
            if gain > MUCH_BETTER {
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
        notes.extend(chart_doubts::of_neutrals(&seen.source, &patches, expected.white, seen.range_adu));
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

    /// Means of a table.
    fn see_table(&self, path: &Path) -> Result<Seen> {
        let table = load_patches(path)?;
        let [black, white] = self.levels.unwrap_or([0.0, 1.0]);
        let range = white - black;
        if self.levels.is_none() && table.means.as_flattened().iter().any(|mean| *mean > 1.0) {
            let problem = "its means are above 1; shares of white level less black level are not";
            return Err(Error::format(&path.display().to_string(), problem).give(&["levels"]));
        }
        let share = |mean: &[f64; 3]| Vector3::from(mean.map(|value| (value - black) / range));
        let is_full = |mean: &[f64; 3]| mean.iter().any(|value| *value >= white);
        let full = table.means.iter().enumerate().filter(|(_, mean)| is_full(mean));
        Ok(Seen {
            source: path.display().to_string(),
            left_out: full.map(|(index, _)| (index, "its mean is at the white level".to_owned())).collect(),
            signals: table.means.iter().map(share).collect(),
            covariances: table.covariances.iter().map(|covariance| covariance / (range * range)).collect(),
            names: table.names,
            frame: None,
            range_adu: self.levels.map(|_| range),
            notes: Vec::new(),
            read: Vec::new(),
        })
    }

    /// The colors of a reference in the light of the chart.
    fn expected(&self, reference: &Reference) -> Result<Expected> {
        let observer = data::load_observer()?;
        let light = self.light()?;
        let names = reference.names.clone();
        let source = &reference.name;
        if let Colors::Reflectance(curves) = &reference.colors {
            let Some(light) = light else {
                let problem = format!("{source}: reflectances have a color in a light alone");
                return Err(Error::Usage(problem).give(&["illuminant"]));
            };
            let (xyz, white) = light.xyz(curves, &observer)?;
            return Ok(Expected { names, xyz, white, light: light.name(), notes: Vec::new() });
        }
        let from_xy = self.reference_light.xy(&observer);
        let white = xyz_of_chromaticity(from_xy, 1.0);
        let xyz = reference.colors_in(white).unwrap_or_default();
        let of_reference = match self.reference_light {
            LightColor::Illuminant(illuminant) => illuminant.to_string(),
            LightColor::Chromaticity([x, y]) => format!("x {x}, y {y}"),
        };
        let Some(light) = light else {
            let text = format!("XYZ are those of the chart in the light of its reference, {of_reference}");
            return Ok(Expected { names, xyz, white, light: of_reference, notes: vec![Note::Remark(text)] });
        };
        let white = match &light {
            Light::Illuminant(illuminant) => xyz_of_chromaticity(illuminant.white_xy(&observer), 1.0),
            Light::Measured(..) => light.xyz(&[], &observer)?.1,
        };
        let to_xy = chromaticity(white);
        let adaptation = Adaptation::Bradford.between(from_xy, to_xy).map_err(Error::Usage)?;
        let adapted = xyz.into_iter().map(|xyz| (adaptation * Vector3::from(xyz)).into()).collect();
        let mut notes = Vec::new();
        if to_xy != from_xy {
            let name = light.name();
            notes.push(Note::Warning(format!(
                "{source}: its colors are for {of_reference}; they are adapted to {name} by Bradford's transform, which is some \
                 Delta E off what reflectances would give"
            )));
        }
        Ok(Expected { names, xyz: adapted, white, light: light.name(), notes })
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

/// Means of the patches in a frame, and those that there would be if the corners were given from another on.
fn see_frame(mut reader: FrameReader, corners: [[f64; 2]; 4]) -> Result<(Seen, Vec<Turned>)> {
    let frame = reader.header().clone();
    let mut charts = Vec::new();
    for turns in 0..corners.len() {
        let mut corners = corners;
        corners.rotate_left(turns);
        let grid = Grid::new(corners).map_err(|problem| Error::Usage(format!("--corners: {problem}")))?;
        charts.push((corners, ChartReader::new(&frame, grid)?));
    }
    let range_adu = charts.first().map(|(_, chart)| chart.range_adu());
    frame.black_levels()?.into_iter().for_each(|black| reader.compare_masked(black));
    let height = frame.geometry.height;
    let step = frame.geometry.band_rows(frame.geometry.step_rows(reader.natural_rows()), 1);
    let (mut rows, mut done) = (Vec::new(), 0);
    while done < height {
        rows.clear();
        let count = step.min(height - done);
        reader.read(count, &mut rows)?;
        charts.iter_mut().for_each(|(_, chart)| chart.take(&rows));
        done += count;
    }
    let mut all = charts.into_iter().map(|(corners, chart)| (corners, chart.finish()));
    let read = all.next().map_or(Ok(Vec::new()), |(_, read)| read).map_err(|problem| frame.refuse(problem))?;
    let turned =
        all.filter_map(|(corners, read)| Some(Turned { corners, seen: seen_in(&frame, &read.ok()?, Vec::new()) }));
    let turned = turned.collect();
    let mut notes = super::super::notes::of_reader(&reader);
    let least = read.iter().flat_map(|patch| patch.count).min().unwrap_or(0);
    notes.push(Note::Remark(format!("{}: {least} photosites or more of each class in a patch", frame.name)));
    Ok((Seen { range_adu, ..seen_in(&frame, &read, notes) }, turned))
}

/// What was read of the patches of a chart in a frame.
fn seen_in(frame: &FrameHeader, read: &[ReadPatch], notes: Vec<Note>) -> Seen {
    let full = read.iter().enumerate().filter(|(_, patch)| patch.saturated > 0);
    Seen {
        source: frame.name.clone(),
        names: None,
        left_out: full.map(|(index, patch)| (index, format!("{} photosites are saturated", patch.saturated))).collect(),
        read: read.to_vec(),
        signals: read.iter().map(|patch| Vector3::from(patch.signal)).collect(),
        covariances: read
            .iter()
            .map(|patch: &ReadPatch| Matrix3::from_diagonal(&Vector3::from(patch.variance)))
            .collect(),
        frame: Some(frame.clone()),
        range_adu: None,
        notes,
    }
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
    notes.extend(chart_doubts::of_patches(&seen.source, &seen.read, name, range_adu));
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
