//! What a raw file tells of its camera, written beside the frame: its matrix as a matrix file, its noise as a read-out.

use super::{characterization, check_yaml_name};
use crate::analysis::characterization::CameraMatrix;
use crate::camera::noise_profile::ClassReadOut;
use crate::camera::readout::ReadOut;
use crate::camera::sensor::{SENSOR_SCHEMA, Sensor};
use crate::cfa::FilterArray;
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
use std::path::PathBuf;

/// Where matrix and read-out of a raw file go, beside the frame.
#[derive(Debug, Clone, Default, Args)]
pub struct RawOutputs {
    /// Matrix file to write, the camera's own for relative XYZ, for `to-xyz --matrix`; of several raws a name with {stem}
    #[arg(long, value_name = "FILE")]
    pub write_matrix: Option<PathBuf>,
    /// Sensor file to write with what a DNG's own NoiseProfile tells of the read-out, gain and noise, for `demosaic --sigma
    /// --sensor` and others
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
        check_yaml_name(self.write_matrix.as_deref(), "matrix")?;
        check_yaml_name(self.write_readout.as_deref(), "sensor")?;
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

/// The temperature that is written where no dark current hangs on it, K.
const ROOM_K: f64 = 293.15;

/// What such a sensor file says of itself.
const DESCRIPTION: &str = "gain and noise that a raw file tells; full well is what reads white, and non-uniformity, dark current \
                           and temperature, which it does not tell, count as none";

/// A sensor file whose read-out is what the noise profile tells; what each class tells is in comments.
fn read_out(reader: &FrameReader) -> Result<String> {
    let raw = reader.header();
    let refuse = |what: &str| raw.refuse(format!("{what}; leave out --write-readout"));
    let Some((profile, told_adu)) = reader.noise_profile() else {
        return Err(refuse("it tells no noise: that takes the NoiseProfile of a DNG (-v tells what is passed over)"));
    };
    let (black, white) = levels(raw)?;
    let cfa = raw.metadata.cfa.unwrap_or(FilterArray::Monochrome);
    let filters = if cfa == FilterArray::Monochrome { vec!['Y'] } else { cfa.filters() };
    let count = profile.lines.len();
    if count > 1 && count != filters.len() {
        return Err(refuse(&format!("its NoiseProfile has {count} classes, and its filters {}", filters.len())));
    }
    // It is of the range that the tags tell, as the metadata of ours may have another.
    let class = |index| profile.read_out(index, told_adu.unwrap_or(white - black));
    let classes: Option<Vec<ClassReadOut>> = (0..filters.len()).map(class).collect();
    let classes = classes.ok_or_else(|| refuse("its NoiseProfile has a class without shot noise"))?;
    let sensor = Sensor {
        schema: SENSOR_SCHEMA.into(),
        name: format!("noise profile of {}", raw.name),
        description: Some(DESCRIPTION.into()),
        source: Some("NoiseProfile of the DNG: variance S x + O of x = (ADU - black) / (white - black)".into()),
        provenance: std::collections::BTreeMap::new(),
        readout: Some(mean_read_out(raw, cfa, [black, white], &classes)),
        response: None,
        xyz_from_camera: None,
    };
    sensor.check().map_err(|problem| refuse(&format!("its NoiseProfile tells no possible read-out: {problem}")))?;
    let mut text = "# By class:\n".to_owned();
    for ((index, filter), class) in filters.iter().enumerate().zip(&classes) {
        let [slope, offset] = profile.lines[index.min(count - 1)];
        let ClassReadOut { adu_per_e, noise_at_black_adu, noise_at_black_e, saturation_e } = class;
        text += &format!(
            "# {filter}: S {slope:e}, O {offset:e}: {adu_per_e:.6} ADU per e-, {noise_at_black_adu:.4} ADU or \
             {noise_at_black_e:.4} e- at black, {saturation_e:.1} e- at white\n"
        );
    }
    Ok(text + &yaml_writer::write("the read-out", &sensor)?)
}

/// The read-out of the mean class of a raw between black and white.
fn mean_read_out(raw: &FrameHeader, cfa: FilterArray, [black, white]: [f64; 2], classes: &[ClassReadOut]) -> ReadOut {
    let mean_of = |f: fn(&ClassReadOut) -> f64| classes.iter().map(f).sum::<f64>() / classes.len() as f64;
    let adu_per_e = mean_of(|class| class.adu_per_e);
    // Rounding is not read noise.
    let noise_adu = (mean_of(|class| class.noise_at_black_adu.powi(2)) - 1.0 / 12.0).max(0.0).sqrt();
    let [width, height] =
        [raw.geometry.width, raw.geometry.height].map(|extent| u32::try_from(extent).unwrap_or(u32::MAX));
    ReadOut {
        setting: None,
        width,
        height,
        pixel_pitch_um: None,
        cfa,
        full_well_e: (white - black) / adu_per_e,
        dark_current_na_per_cm2: None,
        dark_current_e_per_s: Some(0.0),
        temperature_k: ROOM_K,
        dcnu: 0.0,
        prnu: 0.0,
        read_noise_e: noise_adu / adu_per_e,
        row_noise_e: 0.0,
        column_noise_e: 0.0,
        black_drift_e: 0.0,
        black_drift_rows: 0.0,
        dsnu_e: 0.0,
        dsnu_row_e: 0.0,
        dsnu_column_e: 0.0,
        prnu_row: 0.0,
        prnu_column: 0.0,
        hot_pixel_share: 0.0,
        hot_pixel_dark_current_e_per_s: 0.0,
        rts_share: 0.0,
        rts_amplitude_e: 0.0,
        smear_line_s: 0.0,
        blooming: 0.0,
        bits: (1..16).find(|bits| f64::from((1_u32 << bits) - 1) >= white).unwrap_or(16),
        bias_adu: black,
        adu_per_e,
        linearization: None,
        taps: None,
    }
}

/// The largest black level, from which a DNG counts its range, and the white level.
fn levels(raw: &FrameHeader) -> Result<(f64, f64)> {
    let black = raw.black_levels()?.ok_or_else(|| raw.missing("black_level_adu"))?;
    let white = raw.metadata.white_level_adu.ok_or_else(|| raw.missing("white_level_adu"))?;
    let size = [raw.geometry.width, raw.geometry.height];
    Ok((black.largest(size, |_, _| None)[0], white.largest()))
}
