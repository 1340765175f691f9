//! The matrix of a raw file's own tags for a light.

use super::super::notes::Note;
use super::chart::ChartFit;
use crate::analysis::characterization::CameraMatrix;
use crate::error::{Error, Result};
use crate::formats::chart::Light;
use crate::formats::data;
use crate::formats::dng::{OwnMatrix, own_matrix};
use crate::formats::input::{FrameReader, InputOptions};
use crate::names::Named;
use crate::requests::values;
use crate::stream::RowSource;
use clap::Args;
use std::path::PathBuf;

/// A raw file whose matrix is wanted, and which of its matrices.
#[derive(Debug, Clone, Args)]
pub struct RawMatrix {
    /// DNG whose own matrix is wanted, for the light of --illuminant or --temperature, or else that of the exposure
    #[arg(long, value_name = "FRAME.dng", conflicts_with_all = ["chart", "patches", "reference", "reference_light", "luminance", "no_misfit"])]
    pub from_raw: Option<PathBuf>,
    /// Which of its matrices: color, to XYZ under the light itself, or forward, to XYZ adapted to D50
    #[arg(long, value_name = "NAME", default_value = OwnMatrix::default().name(), value_parser = values::choice::<OwnMatrix>(), requires = "from_raw")]
    pub own_matrix: OwnMatrix,
}

impl RawMatrix {
    /// The matrix; none where no raw file is named.
    ///
    /// # Errors
    ///
    /// Those of [`own_matrix`] and [`Light::load`].
    pub fn run(&self, chart: &ChartFit) -> Result<Option<(CameraMatrix, Vec<Note>)>> {
        let Some(path) = &self.from_raw else { return Ok(None) };
        let observer = data::load_observer()?;
        let light = match chart.light()? {
            Some(Light::Illuminant(illuminant)) => Some(illuminant),
            Some(Light::Measured(name, _)) => {
                let problem =
                    format!("{name}: the matrices of a raw file are for a light by its color; name an illuminant");
                return Err(Error::Usage(problem).change(&["illuminant"]));
            }
            None => None,
        };
        let named = light.map(|light| (light.white_xy(&observer), light.to_string()));
        let found = own_matrix(path, named, self.own_matrix)?;
        let [x, y] = found.white_xy;
        let note = Note::Remark(format!("{}: {}; its white has x {x:.4}, y {y:.4}", path.display(), found.method));
        let options = InputOptions { path: Some(path.clone()), ..InputOptions::default() };
        // A file may tell a matrix whose samples are not read.
        let camera = FrameReader::open(&options).ok().and_then(|reader| reader.header().metadata.camera.clone());
        Ok(Some((CameraMatrix::relative(&found, camera.as_deref()), vec![note])))
    }
}
