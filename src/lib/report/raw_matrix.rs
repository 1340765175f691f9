//! The matrix of a raw file, written as a matrix file.

use super::characterization;
use crate::analysis::characterization::CameraMatrix;
use crate::error::{Error, Result};
use crate::formats::output::write_text;
use crate::formats::places::{same_place, sidecar_path};
use crate::formats::register;
use crate::metadata::FrameHeader;
use crate::requests::batch::Job;
use clap::Args;
use std::path::PathBuf;

/// Where the matrix of a raw file goes, beside the frame.
#[derive(Debug, Clone, Default, Args)]
pub struct RawMatrixOutput {
    /// Matrix file to write, the camera's own for relative XYZ, for `to-xyz --matrix`; of several raws a name with {stem}
    #[arg(long, value_name = "FILE")]
    pub write_matrix: Option<PathBuf>,
}

impl RawMatrixOutput {
    /// Tells, before anything is read, where matrices and frames go.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] where a matrix would go where its frame or its sidecar goes; those of [`register::announce`].
    pub fn announce(&self, jobs: &[Job]) -> Result<()> {
        let mut outputs = Vec::new();
        for Job { frame, beside, .. } in jobs {
            let sidecar = frame.as_deref().map(sidecar_path);
            let matrix = beside.first().and_then(Option::as_deref);
            if let Some(path) = matrix
                && [frame, &sidecar].iter().any(|other| same_place(Some(path), other.as_deref()))
            {
                return Err(Error::Usage("the matrix and the frame have the same place; name a file for each".into()));
            }
            outputs.extend([frame.as_deref(), matrix]);
        }
        register::announce(&outputs)
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
