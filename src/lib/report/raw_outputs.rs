//! What a raw file tells of its camera, written beside the frame: its matrix as a matrix file, its noise as a read-out.

use super::characterization;
use crate::analysis::characterization::CameraMatrix;
use crate::error::{Error, Result};
use crate::formats::input::FrameReader;
use crate::formats::output::write_text;
use crate::formats::places::{same_place, sidecar_path};
use crate::formats::{register, yaml_writer};
use crate::metadata::FrameHeader;
use crate::requests::RawFiles;
use crate::requests::batch::{Job, jobs};
use crate::requests::conversion::own_matrix;
use crate::requests::options::Output;
use crate::stream::RowSource;
use clap::Args;
use serde::Serialize;
use std::path::PathBuf;

/// Where matrix and read-out of a raw file go, beside the frame.
#[derive(Debug, Clone, Default, Args)]
pub struct RawOutputs {
    /// Matrix file to write, the camera's own for relative XYZ, for `to-xyz --matrix`; of several raws a name with {stem}
    #[arg(long, value_name = "FILE")]
    pub write_matrix: Option<PathBuf>,
    /// YAML file to write with what a DNG's own NoiseProfile tells of the read-out: gain, noise at black, saturation
    #[arg(long, value_name = "FILE")]
    pub write_readout: Option<PathBuf>,
}

impl RawOutputs {
    /// What is to be done with some raw files. Tells, before any is read, where the frames go and what is written beside them.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] where something would go where its frame or its sidecar goes; those of [`jobs`] and of
    /// [`register::announce`].
    pub fn jobs(&self, files: &RawFiles, output: &Output) -> Result<Vec<Job>> {
        let beside = [self.write_matrix.as_deref(), self.write_readout.as_deref()];
        let jobs = jobs(&files.raws, output.output.as_deref(), output.extension(), &beside)?;
        let mut outputs = Vec::new();
        for Job { frame, beside, .. } in &jobs {
            let sidecar = frame.as_deref().map(sidecar_path);
            for (path, what) in beside.iter().zip(["matrix", "read-out"]).filter(|(path, _)| path.is_some()) {
                if [frame, &sidecar].iter().any(|other| same_place(path.as_deref(), other.as_deref())) {
                    return Err(Error::Usage(format!(
                        "the {what} and the frame have the same place; name a file for each"
                    )));
                }
            }
            outputs.push(frame.as_deref());
            outputs.extend(beside.iter().map(Option::as_deref));
        }
        register::announce(&outputs)?;
        Ok(jobs)
    }

    /// What will be written of a raw file beside its frame, and where; nothing where nobody asked.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] where the file does not tell it.
    pub fn of(reader: &FrameReader, job: &Job) -> Result<Vec<(PathBuf, String)>> {
        let texts: [fn(&FrameReader) -> Result<String>; 2] = [matrix, read_out];
        let asked = job.beside.iter().zip(texts).filter_map(|(path, text)| path.clone().map(|path| (path, text)));
        asked.map(|(path, text)| Ok((path, text(reader)?))).collect()
    }

    /// Writes it.
    ///
    /// # Errors
    ///
    /// Those of the disk.
    pub fn write(texts: &[(PathBuf, String)]) -> Result<()> {
        texts.iter().try_for_each(|(path, text)| write_text(Some(path), text))
    }
}

fn matrix(reader: &FrameReader) -> Result<String> {
    let raw = reader.header();
    if let Some(matrix) = &raw.metadata.relative_matrix {
        return characterization::matrix(&CameraMatrix::relative(matrix, raw.metadata.camera.as_deref()));
    }
    // Of a frame of ours the sensor has one.
    let Ok((matrix, _)) = own_matrix(raw) else {
        return Err(raw.refuse(
            "it tells no matrix: that takes ColorMatrix1 and AsShotNeutral or AsShotWhiteXY (-v tells what is passed over); \
             leave out --write-matrix",
        ));
    };
    characterization::matrix(&matrix)
}

/// What a noise profile tells of the read-out, and what it cannot.
#[derive(Debug, Serialize)]
struct ReadOutDocument {
    schema: &'static str,
    method: &'static str,
    black_level_adu: f64,
    white_level_adu: f64,
    classes: Vec<ClassDocument>,
    not_told: [&'static str; 5],
}

/// What it tells of a class.
#[derive(Debug, Serialize)]
struct ClassDocument {
    class: String,
    slope: f64,
    offset: f64,
    adu_per_e: f64,
    noise_at_black_adu: f64,
    noise_at_black_e: f64,
    saturation_e: f64,
}

fn read_out(reader: &FrameReader) -> Result<String> {
    let raw = reader.header();
    let refuse = |what: &str| raw.refuse(format!("{what}; leave out --write-readout"));
    let Some(profile) = reader.noise_profile() else {
        return Err(refuse("it tells no noise: that takes the NoiseProfile of a DNG (-v tells what is passed over)"));
    };
    let (black, white) = levels(raw)?;
    let filters = raw.metadata.cfa.map(crate::cfa::FilterArray::filters).unwrap_or_default();
    let names: Vec<String> =
        if filters.is_empty() { vec!["Y".into()] } else { filters.iter().map(char::to_string).collect() };
    if profile.lines.len() > 1 && profile.lines.len() != names.len() {
        return Err(refuse(&format!(
            "its NoiseProfile has {} classes, and its filters {}",
            profile.lines.len(),
            names.len()
        )));
    }
    let class = |(index, class): (usize, String)| {
        let [slope, offset] = profile.lines[index.min(profile.lines.len() - 1)];
        let found = profile.read_out(index, white - black)?;
        Some(ClassDocument {
            class,
            slope,
            offset,
            adu_per_e: found.adu_per_e,
            noise_at_black_adu: found.noise_at_black_adu,
            noise_at_black_e: found.noise_at_black_e,
            saturation_e: found.saturation_e,
        })
    };
    let classes: Option<Vec<ClassDocument>> = names.into_iter().enumerate().map(class).collect();
    let document = ReadOutDocument {
        schema: "cyanometer-readout-profile/1",
        method: "NoiseProfile of the DNG: variance S x + O of x = (ADU - black) / (white - black); adu_per_e = S (white - black)",
        black_level_adu: black,
        white_level_adu: white,
        classes: classes.ok_or_else(|| refuse("its NoiseProfile has a class without shot noise"))?,
        not_told: ["full_well_e", "dark_current_e_per_s", "dcnu", "prnu", "temperature_k"],
    };
    yaml_writer::write("the read-out", &document)
}

/// The largest black level, from which a DNG counts its range, and the white level.
fn levels(raw: &FrameHeader) -> Result<(f64, f64)> {
    let black = raw.black_levels()?.ok_or_else(|| raw.missing("black_level_adu"))?;
    let white = raw.metadata.white_level_adu.ok_or_else(|| raw.missing("white_level_adu"))?;
    let size = [raw.geometry.width, raw.geometry.height];
    Ok((black.largest(size, |_, _| None)[0], white.largest()))
}
