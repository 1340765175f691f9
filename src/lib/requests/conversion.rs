//! Turning camera frames into colors, by a matrix file.

use super::notes::Note;
use super::options::WhiteChoice;
use super::values;
use crate::analysis::characterization::CameraMatrix;
use crate::camera::optics::Exposure;
use crate::color::Space;
use crate::error::{Error, Result};
use crate::formats::data;
use crate::metadata::FrameHeader;
use crate::names::Named;
use crate::stages::to_xyz::{ColorSettings, ToXyz};
use clap::Args;
use std::path::PathBuf;

/// Which colors are made of a frame, and by which matrix.
#[derive(Debug, Clone, Args)]
#[command(mut_arg("white", |option| option.help("White of lab and srgb: d65, e, or its absolute X,Y,Z in cd/m2")))]
pub struct Conversion {
    /// Matrix file, as fit-matrix makes it
    #[arg(long, value_name = "FILE")]
    pub matrix: PathBuf,
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
    /// The matrix, before any frame is waited for.
    ///
    /// # Errors
    ///
    /// Those of [`data::load_matrix`].
    pub fn load_matrix(&self) -> Result<CameraMatrix> {
        data::load_matrix(&self.matrix)
    }

    /// The stage that converts a frame, into whose metadata the chosen black level and exposure go; with what came up.
    ///
    /// # Errors
    ///
    /// Those of [`Exposure::checked`] and [`ToXyz::new`]; [`Error::Usage`] for another black level than the metadata state.
    pub fn stage(&self, matrix: CameraMatrix, frame: &mut FrameHeader) -> Result<(ToXyz, Vec<Note>)> {
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
        if let (Some(of_matrix), Some(of_frame)) = (&matrix.sensor, metadata.sensor.as_ref().map(|sensor| &sensor.name))
            && of_matrix != of_frame
        {
            let shown = self.matrix.display();
            let text = format!("{shown} was fitted for the sensor {of_matrix}, but the frame comes from {of_frame}");
            notes.push(Note::Warning(text));
        }
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
}
