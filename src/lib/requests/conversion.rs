//! Turning camera frames into colors, by a matrix file or the matrix that comes with the frame.

use super::notes::Note;
use super::options::WhiteChoice;
use super::values;
use crate::analysis::characterization::CameraMatrix;
use crate::camera::optics::Exposure;
use crate::color::{Space, White};
use crate::error::{Error, Result};
use crate::formats::data;
use crate::metadata::{FrameHeader, Metadata};
use crate::names::Named;
use crate::stages::to_xyz::{ColorSettings, ToXyz};
use clap::Args;
use std::path::PathBuf;

/// Y of a relative white that must be one in cd/m².
const BRIGHT_WHITE: f64 = 10.0;

/// Which colors are made of a frame, and by which matrix.
#[derive(Debug, Clone, Args)]
#[command(mut_arg("white", |option| option.help(
    "White of lab and srgb: d65, e, or its X,Y,Z on the scale of the XYZ: cd/m2, or relative"
)))]
#[command(mut_arg("white_luminance", |option| option.help(
    "Luminance of the white d65 or e in cd/m2; by default that at which the camera saturates. Of relative XYZ it is 1"
)))]
pub struct Conversion {
    /// Matrix file, as fit-matrix or import-raw --write-matrix makes it; by default that of the frame's sensor, or of the raw
    /// file that it comes from
    #[arg(long, value_name = "FILE")]
    pub matrix: Option<PathBuf>,
    /// Color space
    #[arg(long, default_value = Space::Xyz.name(), value_parser = values::choice::<Space>())]
    pub space: Space,
    /// The white of L\*a\*b\* and sRGB.
    #[command(flatten)]
    pub white: WhiteChoice,
    /// Black level that is left in the frame, in ADU, for one whose metadata do not state it; 0 where it is off
    #[arg(long, value_name = "N", value_parser = values::number)]
    pub black: Option<f64>,
    /// Exposure time in s, for a frame whose metadata do not state it
    #[arg(id = "exposure", long, value_name = "S", value_parser = values::seconds)]
    pub exposure_s: Option<f64>,
    /// Relative aperture, for a frame whose metadata do not state it
    #[arg(long, value_name = "N", value_parser = values::f_number)]
    pub f_number: Option<f64>,
    /// Transmittance of the lens, 0 to 1, for a frame whose metadata do not state it
    #[arg(long, value_name = "FRACTION", value_parser = values::fraction)]
    pub lens_transmittance: Option<f64>,
}

impl Conversion {
    /// The matrix of a file, before any frame is waited for.
    ///
    /// # Errors
    ///
    /// Those of [`data::load_matrix`].
    pub fn load_matrix(&self) -> Result<Option<CameraMatrix>> {
        self.matrix.as_deref().map(data::load_matrix).transpose()
    }

    /// The stage that converts a frame, into whose metadata the chosen black level and exposure go; with what came up.
    ///
    /// # Errors
    ///
    /// Those of [`Exposure::checked`] and [`ToXyz::new`]; [`Error::Usage`] for another black level than the metadata state,
    /// and where there is no matrix.
    pub fn stage(&self, matrix: Option<CameraMatrix>, frame: &mut FrameHeader) -> Result<(ToXyz, Vec<Note>)> {
        if let Some(black) = self.black {
            if frame.black_levels()?.is_some_and(|known| known.uniform() != Some(black)) {
                let problem = format!("{}: its metadata state another black level than {black}", frame.name);
                return Err(Error::Usage(problem).leave_out(&["black"]));
            }
            frame.metadata.set_black_adu(Some(black.into()));
        }
        let metadata = &mut frame.metadata;
        let known = metadata.exposure;
        let exposure_s = self.exposure_s.or(known.map(|e| e.exposure_s));
        let f_number = self.f_number.or(known.map(|e| e.f_number));
        let lens_transmittance = self.lens_transmittance.or(known.map(|e| e.lens_transmittance)).unwrap_or(1.0);
        if let Some((exposure_s, f_number)) = exposure_s.zip(f_number) {
            metadata.exposure = Some(Exposure { exposure_s, f_number, lens_transmittance }.checked()?);
        }
        let long = metadata.exposure.and_then(Exposure::doubt).filter(|_| self.exposure_s.is_some());
        let mut notes: Vec<Note> = long.map(Note::Warning).into_iter().collect();
        let matrix = match matrix {
            Some(matrix) => matrix,
            None => {
                let (matrix, note) = own_matrix(frame)?;
                notes.push(note);
                matrix
            }
        };
        notes.extend(self.doubts(&matrix, frame));
        let settings = ColorSettings {
            is_relative: matrix.is_relative(),
            xyz_from_camera: matrix.xyz_from_camera,
            residual: matrix.residual(),
            method: matrix.method,
            space: self.space,
            white: self.white.white,
            white_luminance: self.white.white_luminance,
        };
        Ok((ToXyz::new(frame, &settings)?, notes))
    }

    /// What may not be meant about a matrix and a frame.
    fn doubts(&self, matrix: &CameraMatrix, frame: &FrameHeader) -> Vec<Note> {
        let mut notes = Vec::new();
        if let (Some(file), Some(of_matrix), Some(sensor)) = (&self.matrix, &matrix.sensor, &frame.metadata.sensor)
            && *of_matrix != sensor.name
        {
            let of_frame = &sensor.name;
            let shown = file.display();
            let text = format!("{shown} was fitted for the sensor {of_matrix}, but the frame comes from {of_frame}");
            notes.push(Note::Warning(text));
        }
        notes.extend(doubt_of_white(self.white.white, matrix));
        notes
    }
}

/// A warning of a white that is too bright to be meant on the scale of relative XYZ.
pub(super) fn doubt_of_white(white: White, matrix: &CameraMatrix) -> Option<Note> {
    match white {
        White::Absolute([_, luminance, _]) if matrix.is_relative() && luminance > BRIGHT_WHITE => {
            Some(Note::Warning(format!(
                "the white has Y = {luminance}, but XYZ are relative: Y = 1 is the white by which the camera saturates"
            )))
        }
        _ => None,
    }
}

/// The matrix that comes with a frame: that of its sensor, or, where there is none or no exposure to use it with, that of
/// the raw file that it comes from.
///
/// # Errors
///
/// [`Error::Usage`] where there is none.
fn own_matrix(frame: &FrameHeader) -> Result<(CameraMatrix, Note)> {
    let Metadata { sensor, relative_matrix, exposure, .. } = &frame.metadata;
    let measured = sensor.as_ref().and_then(|sensor| Some((sensor.name.clone(), sensor.xyz_from_camera?)));
    match (measured, relative_matrix) {
        (Some((name, xyz_from_camera)), relative) if exposure.is_some() || relative.is_none() => {
            let note = format!("{}: no --matrix is named; that of its sensor, {name}, counts", frame.name);
            Ok((CameraMatrix::of_sensor(name, xyz_from_camera), Note::Remark(note)))
        }
        (_, Some(relative)) => {
            let note = format!("{}: no --matrix is named; XYZ are relative, by {}", frame.name, relative.method);
            Ok((CameraMatrix::relative(relative), Note::Remark(note)))
        }
        (_, None) => {
            let problem = format!("{}: neither its sensor nor its raw file tells a matrix", frame.name);
            Err(Error::Usage(problem).give(&["matrix"]))
        }
    }
}
