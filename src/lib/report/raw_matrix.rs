//! The matrix of a raw file, written as a matrix file.

use super::characterization;
use crate::analysis::characterization::CameraMatrix;
use crate::error::{Error, Result};
use crate::formats::output::write_text;
use crate::formats::places::{same_place, sidecar_path};
use crate::formats::register;
use crate::metadata::FrameHeader;
use clap::Args;
use std::path::{Path, PathBuf};

/// Where the matrix of a raw file goes, beside the frame.
#[derive(Debug, Clone, Default, Args)]
pub struct RawMatrixOutput {
    /// Matrix file to write, the camera's own for relative XYZ, for `to-xyz --matrix`
    #[arg(long, value_name = "FILE")]
    pub write_matrix: Option<PathBuf>,
}

impl RawMatrixOutput {
    /// Tells, before anything is read, where matrix and frame go.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] where the matrix would go where the frame or its sidecar goes; those of [`register::announce`].
    pub fn announce(&self, frame: Option<&Path>) -> Result<()> {
        let sidecar = frame.map(sidecar_path);
        if let Some(path) = &self.write_matrix
            && [frame, sidecar.as_deref()].iter().any(|other| same_place(Some(path), *other))
        {
            return Err(Error::Usage("the matrix and the frame have the same place; name a file for each".into()));
        }
        register::announce(&[frame, self.write_matrix.as_deref()])
    }

    /// What will be written of a raw file; nothing where nobody asked.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] where the file has no matrix.
    pub fn of(&self, raw: &FrameHeader) -> Result<Option<String>> {
        if self.write_matrix.is_none() {
            return Ok(None);
        }
        let Some(matrix) = &raw.metadata.relative_matrix else {
            return Err(raw.refuse(
                "it tells no matrix: that takes ColorMatrix1 and AsShotNeutral or AsShotWhiteXY (-v tells what is passed over); \
                 leave out --write-matrix",
            ));
        };
        characterization::matrix(&CameraMatrix::relative(matrix)).map(Some)
    }

    /// Writes it.
    ///
    /// # Errors
    ///
    /// Those of the disk.
    pub fn write(&self, text: Option<&str>) -> Result<()> {
        text.map_or(Ok(()), |text| write_text(self.write_matrix.as_deref(), text))
    }
}
