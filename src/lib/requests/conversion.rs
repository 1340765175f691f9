//! Turning camera frames into colors, by a matrix file or the matrix that comes with the frame; and XYZ into other spaces.

use super::described::{SaidExposure, apply_black};
use super::notes::Note;
use super::options::{Output, WhiteChoice};
use super::values::{self, LightColor};
use crate::analysis::characterization::{CameraMatrix, RELATIVE_MATRIX_UNIT};
use crate::cfa::FilterArray;
use crate::color::adaptation::Adaptation;
use crate::color::saturation::Saturation;
use crate::color::temperature::Locus;
use crate::color::{self, Space, White, rows_of};
use crate::error::{Error, Result};
use crate::formats::data;
use crate::formats::format::SampleType;
use crate::formats::input::FrameReader;
use crate::formats::register;
use crate::metadata::{FrameHeader, Metadata};
use crate::names::Named;
use crate::stages::from_xyz::{Adapting, COVARIANCE_LAYER, FromXyz, XyzSettings, layers_of, scene_white};
use crate::stages::to_xyz::{ColorSettings, ToXyz, needs_white};
use crate::stream::RowSource;
use crate::units::{QuantityKind, RELATIVE_UNIT};
use clap::Args;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Y of a relative white that must be one in cd/m².
const BRIGHT_WHITE: f64 = 10.0;
/// Y of a white in cd/m² that must be a relative one, or a chromaticity.
const RELATIVE_WHITE: f64 = 2.0;

/// What stands for the matrix of the sensor in place of the name of a file.
pub(super) const OF_SENSOR: &str = "sensor";

/// Which colors are made of a frame, and by which matrix.
#[derive(Debug, Clone, Args)]
#[command(mut_arg("white", |option| option.help(
    "White of lab, luv, srgb and linear-srgb, of XYZ that are there already recorded with any space: d65, d50, e, or its X,Y,Z on the scale of the XYZ: cd/m2, or relative; by default the light of --adapt-to, that which XYZ record, or d65"
)))]
#[command(mut_arg("white_luminance", |option| option.help(
    "Luminance of the white d65, d50 or e in cd/m2; by default that at which the camera saturates, or of XYZ what they record. Of relative XYZ it is 1"
)))]
pub struct Conversion {
    /// Matrix file, as fit-matrix or import-raw --write-matrix makes it, or `sensor` for that of the frame's sensor; by default that,
    /// or that of the raw file that it comes from
    #[arg(long, value_name = "FILE|sensor")]
    pub matrix: Option<PathBuf>,
    /// Color space; cct is correlated color temperature in K, Duv and Y; linear-srgb is neither clipped nor encoded
    #[arg(long, default_value = Space::Xyz.name(), value_parser = values::choice::<Space>())]
    pub space: Space,
    /// Adapt colors to this light first, so that what is white in the scene becomes its white: an illuminant (d65, d50, a, e),
    /// a temperature (5500K), x,y or X,Y,Z
    #[arg(long, value_name = "LIGHT", value_parser = values::light)]
    pub adapt_to: Option<LightColor>,
    /// The light of the scene, that colors are adapted from; by default what the matrix or the frame tells
    #[arg(long, value_name = "LIGHT", value_parser = values::light, requires = "adapt_to")]
    pub scene_white: Option<LightColor>,
    /// Transform of the adaptation
    #[arg(long, value_name = "NAME", default_value = Adaptation::default().name(), value_parser = values::choice::<Adaptation>(), requires = "adapt_to")]
    pub adaptation: Adaptation,
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
    /// A warning of a picture in a file that other programs take for linear light.
    pub fn doubt_of(&self, output: &Output) -> Option<Note> {
        let text = "other programs take an EXR for linear light, and these are samples encoded for viewing; for a picture name a \
                    .png or .tiff, or let `preview` make one";
        (self.space == Space::Srgb && output.is_exr()).then(|| Note::Warning(text.into()))
    }

    /// The file of the matrix, where one is named.
    pub fn matrix_file(&self) -> Option<&Path> {
        self.matrix.as_deref().filter(|path| *path != Path::new(OF_SENSOR))
    }

    /// The matrix of a file, before any frame is waited for.
    ///
    /// # Errors
    ///
    /// Those of [`data::load_matrix`].
    pub fn load_matrix(&self) -> Result<Option<CameraMatrix>> {
        self.matrix_file().map(data::load_matrix).transpose()
    }

    /// The stage that converts a frame, into whose metadata the chosen black level and exposure go; with what came up.
    ///
    /// # Errors
    ///
    /// Those of [`apply_black`], [`SaidExposure::apply`] and [`ToXyz::new`]; [`Error::Usage`] where there is no matrix, or no
    /// light of the scene to adapt from.
    pub fn stage(&self, matrix: Option<CameraMatrix>, frame: &mut FrameHeader) -> Result<(ToXyz, Vec<Note>)> {
        self.white.check()?;
        if let Some(black) = self.black {
            apply_black(frame, black.into())?;
        }
        let Self { exposure_s, f_number, lens_transmittance, .. } = *self;
        SaidExposure { exposure_s, f_number, lens_transmittance }.apply(frame)?;
        let mut notes = Vec::new();
        let matrix = match matrix {
            Some(matrix) => matrix,
            None if self.matrix.is_some() && self.matrix_file().is_none() => matrix_of_sensor(frame)?,
            None => {
                let (matrix, note) = own_matrix(frame)?;
                notes.push(note);
                matrix
            }
        };
        let matrix = match without_exposure(&matrix, frame) {
            Some((relative, note)) => {
                notes.push(note);
                relative
            }
            None => matrix,
        };
        notes.extend(self.doubts(&matrix, frame));
        let adapting = self.adapting(matrix.white_xy, &frame.name)?;
        let adaptation = adapting.map(|adapting| adapting.matrix()).transpose()?;
        let adapted = |rows| adaptation.map_or(rows, |by| rows_of(&(by * color::matrix(&rows))));
        let per_exposure = frame.metadata.exposure.filter(|_| !matrix.is_relative());
        let scene_error = per_exposure.and_then(|exposure| {
            frame.metadata.scene_error(&(color::matrix(&matrix.xyz_from_camera) / exposure.exposure_s_sr()))
        });
        let settings = ColorSettings {
            is_relative: matrix.is_relative(),
            xyz_from_camera: adapted(matrix.xyz_from_camera),
            residual: matrix.residual(),
            method: matrix.method,
            space: self.space,
            white: self.reference_white(adapting),
            white_luminance: self.white.white_luminance,
        };
        let mut stage = ToXyz::beside(frame, &settings, self.locus()?)?;
        if let Some(record) = &mut stage.header_mut().metadata.color {
            record.scene_white_xy = adapting.map(|adapting| adapting.to_xy).or(matrix.white_xy);
            record.adapted = adapting.map(Adapting::record);
            record.scene_error = scene_error;
            notes.extend(self.doubt_of_light(record.scene_white_xy, settings.white));
        }
        notes.extend(self.doubt_of_brightness(&stage, settings.white));
        Ok((stage, notes))
    }

    /// The stage that takes a frame of XYZ to another space, none of frames that hold something else; covariances come along
    /// where the frame has them and the output `holds_layers`. With `sigma` they must.
    ///
    /// # Errors
    ///
    /// Those of [`FromXyz::new`]; [`Error::Usage`] for options that are those of camera frames, and where there is no light of
    /// the scene to adapt from; [`Error::Format`] without the covariances that `sigma` asks for.
    pub fn stage_of_xyz(&self, reader: &mut FrameReader, sigma: bool, holds_layers: bool) -> Result<Option<FromXyz>> {
        if reader.header().metadata.quantity != QuantityKind::Xyz {
            doubt_of_picture(reader);
            return Ok(None);
        }
        self.white.check()?;
        let name = reader.header().name.clone();
        let of_cameras: [(&'static [&'static str], bool); 5] = [
            (&["matrix"], self.matrix.is_some()),
            (&["black"], self.black.is_some()),
            (&["exposure"], self.exposure_s.is_some()),
            (&["f_number"], self.f_number.is_some()),
            (&["lens_transmittance"], self.lens_transmittance.is_some()),
        ];
        if let Some((option, _)) = of_cameras.into_iter().find(|(_, is_given)| *is_given) {
            let problem = format!("{name}: it holds XYZ already, and this is an option for frames of a camera");
            return Err(Error::Usage(problem).leave_out(option));
        }
        if sigma {
            layers_of(self.space)?;
        }
        let is_wanted = self.space != Space::Srgb && (holds_layers || sigma);
        let has_covariance = is_wanted && reader.keep(&COVARIANCE_LAYER);
        if sigma && !has_covariance {
            let problem = "it has no layer `covariance.*`, from which the standard deviations of other colors follow; make it \
                           anew with `to-xyz --sigma`";
            return Err(reader.header().refuse(problem));
        }
        let settings = XyzSettings {
            space: self.space,
            white: self.white.white,
            white_luminance: self.white.white_luminance,
            adapting: self.adapting(scene_white(reader.header()), &name)?,
            locus: self.locus()?,
        };
        FromXyz::new(reader.header(), &settings).map(Some)
    }

    /// The white that is named, or what colors are adapted to, or D65.
    fn reference_white(&self, adapting: Option<Adapting>) -> White {
        self.white.white.or(adapting.map(Adapting::white)).unwrap_or_default()
    }

    /// What to say where the light of the colors is not the white that they are referred to.
    fn doubt_of_light(&self, light_xy: Option<[f64; 2]>, white: White) -> Option<Note> {
        /// Chromaticities that are nearer are those of one light.
        const NEAR: f64 = 0.005;
        let [x, y] = light_xy.filter(|_| needs_white(self.space))?;
        let [white_x, white_y] = color::chromaticity(white.xyz(1.0));
        let is_far = (x - white_x).abs().max((y - white_y).abs()) > NEAR;
        is_far.then(|| {
            let text = format!(
                "what is white in its light, x {x:.4}, y {y:.4}, is not that under the white {white}; --adapt-to {white} makes it so"
            );
            Note::Remark(text)
        })
    }

    /// What to say where the matrix does not tell how bright the white is by which the camera saturates.
    fn doubt_of_brightness(&self, stage: &ToXyz, white: White) -> Option<Note> {
        let [_, luminance, _] = stage.white_stands_in().then(|| stage.white())?;
        let text = format!(
            "by the matrix the white {white} has no signal in one of the classes; its luminance is that of equal signals that saturate, \
             {luminance:.4} cd/m2: --white-luminance says another"
        );
        Some(if needs_white(self.space) { Note::Warning(text) } else { Note::Remark(text) })
    }

    /// The adaptation that is asked for, from the light that is given or known.
    fn adapting(&self, known: Option<[f64; 2]>, frame: &str) -> Result<Option<Adapting>> {
        let Some(to) = self.adapt_to else { return Ok(None) };
        let observer = data::load_observer()?;
        let from_xy = self.scene_white.map(|light| light.xy(&observer)).or(known);
        let Some(from_xy) = from_xy else {
            let problem = format!("{frame}: neither matrix nor frame tells the light of the scene to adapt from");
            return Err(Error::Usage(problem).give(&["scene_white"]));
        };
        Ok(Some(Adapting { transform: self.adaptation, from_xy, to_xy: to.xy(&observer) }))
    }

    /// The black bodies that temperatures are told by, where these are asked for.
    fn locus(&self) -> Result<Option<Arc<Locus>>> {
        (self.space == Space::Cct).then(|| Ok(Arc::new(Locus::new(&data::load_observer()?)))).transpose()
    }

    /// What may not be meant about a matrix and a frame.
    fn doubts(&self, matrix: &CameraMatrix, frame: &FrameHeader) -> Vec<Note> {
        let mut notes = Vec::new();
        let mut known = frame.metadata.camera_names().peekable();
        if let (Some(file), Some(of_matrix), Some(of_frame)) =
            (self.matrix_file(), &matrix.sensor, known.peek().copied())
            && known.all(|name| !name.eq_ignore_ascii_case(of_matrix))
        {
            let shown = file.display();
            let text = format!("{shown} was fitted for the sensor {of_matrix}, but the frame comes from {of_frame}");
            notes.push(Note::Warning(text));
        }
        let sensor = frame.metadata.sensor.as_ref();
        if let Some((file, doubt)) = self.matrix_file().zip(sensor.and_then(|sensor| matrix.doubt_of_sensor(sensor))) {
            notes.push(Note::Warning(format!("{} {doubt}", file.display())));
        }
        let shown = self.matrix_file().map_or("the matrix of its sensor".into(), |file| file.display().to_string());
        let of_codes = matrix.doubts_of_codes(&frame.metadata).into_iter();
        notes.extend(of_codes.map(|doubt| Note::Warning(format!("{}: {shown} {doubt}", frame.name))));
        notes.extend(doubt_of_white(self.white.or_daylight(), matrix.is_relative()));
        if let Some(file) = self.matrix_file().filter(|_| matrix.is_relative()) {
            let text = format!("{}: XYZ are relative, Y = 1 for the white that saturates the camera", file.display());
            notes.push(Note::Remark(text));
        }
        if matrix.is_relative() && (self.exposure_s.is_some() || self.lens_transmittance.is_some()) {
            notes.push(Note::Warning(format!(
                "{}: its XYZ are relative, and no exposure changes them; absolute ones take a matrix from spectra, or from a chart \
                 whose luminance is known (`fit-matrix`)",
                frame.name
            )));
        }
        notes
    }

    /// What may not be meant about a frame of XYZ.
    pub fn doubt_of_xyz(&self, frame: &FrameHeader) -> Option<Note> {
        doubt_of_white(self.white.or_daylight(), frame.metadata.unit == RELATIVE_UNIT)
    }
}

/// A warning of a white that is too bright to be meant on the scale of XYZ that are relative, or too dim on that of absolute ones.
pub(super) fn doubt_of_white(white: White, is_relative: bool) -> Option<Note> {
    match white {
        White::Absolute([_, luminance, _]) if !is_relative && luminance <= RELATIVE_WHITE => {
            Some(Note::Warning(format!(
                "the white has Y = {luminance}, but XYZ are absolute: Y = {luminance} cd/m2 is next to black; give X,Y,Z in cd/m2, or a \
             white by name and its luminance"
            )))
        }
        White::Absolute([_, luminance, _]) if is_relative && luminance > BRIGHT_WHITE => Some(Note::Warning(format!(
            "the white has Y = {luminance}, but XYZ are relative: Y = 1 is the white by which the camera saturates"
        ))),
        _ => None,
    }
}

/// The matrix of a frame's sensor, which is asked for.
fn matrix_of_sensor(frame: &FrameHeader) -> Result<CameraMatrix> {
    let sensor = frame.sensor()?;
    match sensor.xyz_from_camera {
        Some(xyz_from_camera) => Ok(CameraMatrix::of_sensor(sensor, xyz_from_camera)),
        None => {
            let problem =
                format!("{}: its sensor, {}, has no matrix of its own; name a file of one", frame.name, sensor.name);
            Err(Error::Usage(problem).change(&["matrix"]))
        }
    }
}

/// A matrix for absolute XYZ as one for relative XYZ, where the exposure of a frame is not known, and its levels are: Y = 1 is the D65 by which
/// the first class reaches its white level.
fn without_exposure(matrix: &CameraMatrix, frame: &FrameHeader) -> Option<(CameraMatrix, Note)> {
    if matrix.is_relative() || frame.metadata.exposure.is_some() {
        return None;
    }
    let range = frame.metadata.white_level_adu?.range_above(frame.uniform_black_adu().ok()?);
    let xyz_from_camera = color::matrix(&matrix.xyz_from_camera);
    let saturation = Saturation::of(&xyz_from_camera, [range; 3], White::D65.xyz(1.0));
    if !(range > 0.0 && range.is_finite() && saturation.luminance > 0.0) {
        return None;
    }
    let relative = CameraMatrix {
        unit: Some(RELATIVE_MATRIX_UNIT.into()),
        xyz_from_camera: rows_of(&(xyz_from_camera * (range / saturation.luminance))),
        range_adu: None,
        ..matrix.clone()
    };
    let note = format!(
        "{}: its exposure is not known: XYZ are relative, Y = 1 for the D65 that saturates the camera; --exposure S and --f-number N make \
         them cd/m2",
        frame.name
    );
    Some((relative, Note::Warning(note)))
}

/// Has the program warn of planes of 8 bits that no program of ours wrote: pictures have such, and mostly not in proportion to light.
fn doubt_of_picture(reader: &FrameReader) {
    let header = reader.header();
    let is_picture = header.metadata.history.is_empty()
        && header.leads_with_three_planes()
        && reader.sample_type() == Some(SampleType::U8);
    if is_picture {
        register::doubt(format!(
            "{}: its planes are of 8 bits, as those of pictures, which are gamma-encoded as a rule; they count as linear codes of a camera",
            header.name
        ));
    }
}

/// The matrix that comes with a frame: that of its sensor, or, where there is none or no exposure to use it with, that of
/// the raw file that it comes from.
///
/// # Errors
///
/// [`Error::Usage`] where there is none.
pub fn own_matrix(frame: &FrameHeader) -> Result<(CameraMatrix, Note)> {
    let Metadata { sensor, relative_matrix, exposure, .. } = &frame.metadata;
    let measured = sensor.as_ref().and_then(|sensor| Some((sensor, sensor.xyz_from_camera?)));
    match (measured, relative_matrix) {
        (Some((sensor, xyz_from_camera)), relative) if exposure.is_some() || relative.is_none() => {
            let note = format!("{}: no --matrix is named; that of its sensor, {}, counts", frame.name, sensor.name);
            Ok((CameraMatrix::of_sensor(sensor, xyz_from_camera), Note::Remark(note)))
        }
        (_, Some(relative)) => {
            let why = match measured {
                Some(_) => "cd/m2 take its exposure, --exposure S and --f-number N",
                None => "cd/m2 take a calibrated matrix, --matrix FILE",
            };
            // Of several files it is said once: it is the same of all.
            let method = &relative.method;
            let note = format!("XYZ are relative, Y = 1 for the white that saturates the camera, by {method}; {why}");
            Ok((CameraMatrix::relative(relative, frame.metadata.camera.as_deref()), Note::Warning(note)))
        }
        (_, None) => {
            let mut problem = format!("{}: neither its sensor nor its raw file tells a matrix", frame.name);
            if sensor.is_none() && frame.metadata.cfa != Some(FilterArray::Monochrome) {
                problem += "; of a DNG `import-raw FILE.dng -v` tells what its matrix lacks, and what makes one";
            }
            Err(Error::Usage(problem).give(&["matrix"]))
        }
    }
}
