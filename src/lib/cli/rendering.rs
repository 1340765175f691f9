//! The work of `render-radiance`: from a request to a frame.

use super::Session;
use super::options::Output;
use crate::camera::optics::{Exposure, Vignetting};
use crate::camera::sensor::{Camera, Sensor};
use crate::cfa::CfaPattern;
use crate::error::{Error, Result};
use crate::formats::files::{FileId, regular_file};
use crate::formats::input::{FrameReader, InputOptions};
use crate::formats::output::FrameWriter;
use crate::formats::spectral::{self, Radiances, SpectralChannels};
use crate::formats::{csv::SpectralTable, data};
use crate::frame::Geometry;
use crate::metadata::{FrameHeader, Metadata, Scene};
use crate::numerics::planes::{WeightedPlane, weighted_sums};
use crate::numerics::quadrature::Rule;
use crate::spectrum::{WavelengthGrid, chart_columns};
use crate::stages::render::Rendering;
use crate::stream::{Counts, RowSource};
use crate::units::{QuantityKind, RadianceUnit};
use std::path::PathBuf;

/// What is to be rendered, and how.
#[derive(Debug, Clone)]
pub struct Request {
    /// Spectrum, library or spectral image.
    pub input: Option<PathBuf>,
    /// Part of a multi-part EXR.
    pub part: usize,
    /// Sensor, name or file.
    pub sensor: String,
    /// Size of the frame.
    pub size: Option<[usize; 2]>,
    /// Exposure time in s.
    pub exposure_s: f64,
    /// Relative aperture.
    pub f_number: f64,
    /// Transmittance of the lens.
    pub lens_transmittance: f64,
    /// Focal length in mm, where vignetting is wanted.
    pub vignetting_focal_length_mm: Option<f64>,
    /// Fraction of full well to expose to.
    pub expose_to: Option<f64>,
    /// Electrons given outright.
    pub electrons: Option<[f64; 3]>,
    /// Start, end and step of the wavelengths in nm.
    pub wavelengths: [f64; 3],
    /// Rule of summation.
    pub quadrature: Rule,
    /// Unit of the radiance.
    pub radiance_unit: Option<RadianceUnit>,
    /// Column of a table.
    pub column: Option<String>,
    /// Sample of a library.
    pub sample: Option<usize>,
    /// Photosites of a source pixel.
    pub patch: Option<[usize; 2]>,
    /// Pattern of the plane that is wanted.
    pub cfa: Option<CfaPattern>,
}

impl Default for Request {
    /// The default sensor behind the paper's lens, at its exposure, and its wavelengths.
    fn default() -> Self {
        Self {
            input: None,
            part: 0,
            sensor: data::DEFAULT_SENSOR.into(),
            size: None,
            exposure_s: 0.033,
            f_number: 8.0,
            lens_transmittance: 1.0,
            vignetting_focal_length_mm: None,
            expose_to: None,
            electrons: None,
            wavelengths: [360.0, 830.0, 1.0],
            quadrature: Rule::Rectangle,
            radiance_unit: None,
            column: None,
            sample: None,
            patch: None,
            cfa: None,
        }
    }
}

/// Reads `START:END:STEP`.
///
/// # Errors
///
/// What is expected, in words.
pub fn wavelengths(text: &str) -> std::result::Result<[f64; 3], String> {
    let numbers: Option<Vec<f64>> = text.split(':').map(|part| part.trim().parse().ok()).collect();
    match numbers.as_deref() {
        Some([start_nm, end_nm, step_nm]) => {
            let (start_nm, end_nm, step_nm) = (*start_nm, *end_nm, *step_nm);
            let grid = WavelengthGrid { start_nm, end_nm, step_nm, ..WavelengthGrid::default() };
            grid.points().map(|_| [start_nm, end_nm, step_nm]).map_err(|error| error.to_string())
        }
        _ => Err("give START:END:STEP in nm, such as 360:830:1".into()),
    }
}

/// Where the light comes from, once opened.
enum Light {
    /// The same everywhere: signal electrons, and what to call it.
    Uniform { electrons: [f64; 3], source: String },
    /// An image; its rows come one by one, and are multiplied with `factor`.
    Image { rows: ImageRows, factor: f64, width: usize, height: usize, source: String },
}

/// A request whose light is open and whose exposure is settled.
struct Prepared {
    sensor: Sensor,
    exposure: Exposure,
    light: Light,
    brightest_e: Option<f64>,
    quadrature_error: Option<[f64; 3]>,
    metadata: Metadata,
    input: Option<(FileId, String)>,
}

enum ImageRows {
    /// As the file is read.
    Streamed(Box<SpectralRows>),
    /// All rows, read once to find the brightest.
    Kept(std::vec::IntoIter<Vec<[f64; 3]>>),
}

/// Rows of a spectral image as signal electrons.
struct SpectralRows {
    reader: FrameReader,
    planes: Vec<WeightedPlane>,
    samples: Vec<f32>,
    /// The first row, where it was read to judge the sum over wavelengths.
    ahead: Option<Vec<[f64; 3]>>,
}

impl SpectralRows {
    fn next(&mut self) -> Result<Vec<[f64; 3]>> {
        if let Some(row) = self.ahead.take() {
            return Ok(row);
        }
        self.samples.clear();
        self.reader.read(1, &mut self.samples)?;
        let header = self.reader.header();
        let mut row = Vec::with_capacity(header.geometry.width);
        weighted_sums(&self.samples, header.geometry.width, &self.planes, |electrons| row.push(electrons));
        row.into_iter().map(|electrons| checked(electrons, &header.name)).collect()
    }

    /// Reads the first row ahead, and gives the radiance of its brightest pixel.
    fn brightest_ahead(&mut self, spectral: &SpectralChannels) -> Result<Vec<f64>> {
        let row = self.next()?;
        let radiance = self.radiance(spectral, brightest(&row));
        self.ahead = Some(row);
        Ok(radiance)
    }

    /// The radiance of a pixel of the row that was read last, W cm⁻² sr⁻¹ nm⁻¹.
    fn radiance(&self, spectral: &SpectralChannels, x: usize) -> Vec<f64> {
        let (width, factor) = (self.reader.header().geometry.width, spectral.unit.in_w_per_cm2_sr_nm());
        spectral.channels.iter().map(|channel| f64::from(self.samples[channel * width + x]) * factor).collect()
    }
}

/// The place of the brightest of some pixels.
fn brightest(electrons: &[[f64; 3]]) -> usize {
    let largest = |x: usize| electrons[x].iter().copied().fold(0.0, f64::max);
    (0..electrons.len()).max_by(|&a, &b| largest(a).total_cmp(&largest(b)).then(b.cmp(&a))).unwrap_or_default()
}

/// What a camera makes of radiances on one set of wavelengths, and the same at twice the step.
struct Seen {
    camera: Camera,
    coarse: Option<Camera>,
    rule: Rule,
}

impl Seen {
    fn quadrature_error(&self, radiance: &[f64]) -> Option<[f64; 3]> {
        self.camera.quadrature_error(self.rule, self.coarse.as_ref()?, radiance)
    }
}

/// A uniform scene behind a camera.
#[derive(Debug, Clone)]
pub struct Uniform {
    /// The sensor.
    pub sensor: Sensor,
    /// The exposure.
    pub exposure: Exposure,
    /// Signal electrons of R, G and B.
    pub electrons: [f64; 3],
    /// Estimated relative error of them by the sum over wavelengths; none where no spectrum was summed or none is possible.
    pub quadrature_error: Option<[f64; 3]>,
}

/// Electrons that can be.
fn checked(electrons: [f64; 3], name: &str) -> Result<[f64; 3]> {
    if electrons.iter().all(|e| (0.0..f64::INFINITY).contains(e)) {
        Ok(electrons)
    } else {
        Err(Error::format(name, "its radiance is negative or not finite, so that no electrons can be expected of it"))
    }
}

impl Request {
    /// Renders the frame to an output.
    ///
    /// # Errors
    ///
    /// Those of readers, sensor files and writers; [`Error::Usage`] where the request makes no sense.
    pub fn render(&self, session: &Session, output: &Output) -> Result<()> {
        let mut prepared = self.prepare(session)?;
        let rendering = self.rendering(&mut prepared)?;
        self.write(session, output, rendering, prepared.light, prepared.input)
    }

    /// Sensor, exposure and signal electrons of a uniform scene, without a frame.
    ///
    /// # Errors
    ///
    /// As [`Self::render`]; [`Error::Usage`] for a spectral image of which no sample was chosen.
    pub fn uniform(&self, session: &Session) -> Result<Uniform> {
        let prepared = self.prepare(session)?;
        match prepared.light {
            Light::Uniform { electrons, .. } => {
                let factor = if self.expose_to.is_some() { prepared.exposure.exposure_s } else { 1.0 };
                let Prepared { sensor, exposure, quadrature_error, .. } = prepared;
                Ok(Uniform { sensor, exposure, electrons: electrons.map(|e| e * factor), quadrature_error })
            }
            Light::Image { source, .. } => {
                Err(Error::Usage(format!("{source}: it holds many spectra; choose one with --sample N")))
            }
        }
    }

    /// Loads the sensor, opens the light and settles the exposure.
    fn prepare(&self, session: &Session) -> Result<Prepared> {
        let loaded = data::load_sensor(&self.sensor)?;
        let [start_nm, end_nm, step_nm] = self.wavelengths;
        let grid = WavelengthGrid { start_nm, end_nm, step_nm, quadrature: self.quadrature };
        let mut exposure = Exposure {
            exposure_s: self.exposure_s,
            f_number: self.f_number,
            lens_transmittance: self.lens_transmittance,
        }
        .checked()?;
        if self.expose_to.is_some() {
            // The signal is proportional to time: work it out for 1 s, then choose.
            exposure.exposure_s = 1.0;
        }
        let mut metadata = Metadata::new(QuantityKind::ExpectedElectrons);
        let mut input = self.input.as_deref().and_then(regular_file);
        let mut quadrature_error = None;
        let mut light = match self.electrons {
            Some(electrons) => {
                let source = if electrons == [0.0; 3] { "dark" } else { "--electrons" };
                Light::Uniform { electrons, source: source.into() }
            }
            None => {
                let weights = loaded.response.weights_on(&loaded.sensor, &exposure, &grid)?;
                if weights.left_out > 0 {
                    metadata.leave_out(
                        "render-radiance",
                        format!(
                            "{} of {} wavelengths",
                            weights.left_out,
                            weights.left_out + weights.wavelengths_nm.len()
                        ),
                        "no class responds there",
                    );
                }
                let coarse = grid.doubled();
                let coarse = coarse.and_then(|grid| loaded.response.weights_on(&loaded.sensor, &exposure, &grid).ok());
                let camera = |sampled_nm: &[f64], name: &str| {
                    let (camera, uncovered) = weights.camera(sampled_nm);
                    if uncovered > 1e-6 {
                        session.warn(&format!(
                            "{name}: it covers {} to {} nm; {:.2} % of the sensor's response lies beyond, where its \
                             radiance is taken as zero",
                            sampled_nm[0],
                            sampled_nm[sampled_nm.len() - 1],
                            100.0 * uncovered
                        ));
                    }
                    let coarse = coarse.as_ref().map(|weights| weights.camera(sampled_nm).0);
                    Seen { camera, coarse, rule: grid.quadrature }
                };
                let (opened, error) = self.open_light(session, camera, &mut input, &mut metadata)?;
                quadrature_error = error;
                opened
            }
        };
        let mut brightest_e = None;
        if let Some(fraction) = self.expose_to {
            let (kept, brightest) = light.keep_and_find_brightest()?;
            light = kept;
            if brightest <= 0.0 {
                return Err(Error::Data("the scene is dark: no exposure reaches a fraction of full well".into()));
            }
            exposure.exposure_s = fraction * loaded.sensor.full_well_e / brightest;
            exposure = exposure.checked()?;
            brightest_e = Some(fraction * loaded.sensor.full_well_e);
            session.note(&format!("exposure {} s", exposure.exposure_s));
        }
        if let Some([red, green, blue]) = quadrature_error {
            session.note(&format!(
                "the sum over wavelengths is off by about {red:.1e} of R, {green:.1e} of G, {blue:.1e} of B, as twice the \
                 step tells"
            ));
        }
        metadata.quadrature_error = quadrature_error;
        Ok(Prepared { sensor: loaded.sensor, exposure, light, brightest_e, quadrature_error, metadata, input })
    }

    /// Opens the radiance; gives a pixel's electrons at the exposure that `camera` was made for, and the error of the sum
    /// over wavelengths.
    fn open_light(
        &self,
        session: &Session,
        camera: impl Fn(&[f64], &str) -> Seen,
        input: &mut Option<(FileId, String)>,
        metadata: &mut Metadata,
    ) -> Result<(Light, Option<[f64; 3]>)> {
        let options = InputOptions { path: self.input.clone(), part: self.part, metadata: None, all_channels: true };
        match spectral::open(&options)? {
            Radiances::Table(table) => {
                let name = table.name().to_owned();
                let seen = camera(&table.wavelength_nm, &name);
                let radiance_of = |index: usize| -> Vec<f64> {
                    let unit = self.radiance_unit.or_else(|| table.unit_of(index)).unwrap_or_default();
                    table.values.row(index).iter().map(|value| value * unit.in_w_per_cm2_sr_nm()).collect()
                };
                let electrons_of = |index: usize| checked(seen.camera.electrons(&radiance_of(index)), &name);
                let count = table.columns.len();
                if self.patch.is_some() && count > 1 && self.column.is_none() && self.sample.is_none() {
                    let all: Vec<[f64; 3]> = (0..count).map(electrons_of).collect::<Result<_>>()?;
                    let width = chart_columns(count);
                    let error = seen.quadrature_error(&radiance_of(brightest(&all[..width])));
                    let rows: Vec<Vec<[f64; 3]>> = all.chunks(width).map(<[_]>::to_vec).collect();
                    let rows = ImageRows::Kept(rows.into_iter());
                    return Ok((Light::Image { rows, factor: 1.0, width, height: count / width, source: name }, error));
                }
                let index = self.choose(&table)?;
                let electrons = electrons_of(index)?;
                let source = if table.columns.len() > 1 { format!("{name}: {}", table.columns[index]) } else { name };
                Ok((Light::Uniform { electrons, source }, seen.quadrature_error(&radiance_of(index))))
            }
            Radiances::Image(reader) => {
                if self.column.is_some() {
                    return Err(Error::Usage("a spectral image has no columns; choose a pixel with --sample N".into()));
                }
                session.report_reader(&reader);
                *input = reader.file();
                let header = reader.header().clone();
                let spectral = SpectralChannels::of(&header, self.radiance_unit)?;
                let seen = camera(&spectral.wavelength_nm, &header.name);
                let planes = seen.camera.planes(&spectral.channels, spectral.unit.in_w_per_cm2_sr_nm());
                let all = spectral.channels.len();
                if planes.len() < all {
                    metadata.leave_out(
                        "render-radiance",
                        format!("{} of {all} spectral planes", all - planes.len()),
                        "no class responds to them",
                    );
                }
                let Geometry { width, height, .. } = header.geometry;
                let mut rows = SpectralRows { reader: *reader, planes, samples: Vec::new(), ahead: None };
                match self.sample {
                    None => {
                        let error = seen.quadrature_error(&rows.brightest_ahead(&spectral)?);
                        let rows = ImageRows::Streamed(Box::new(rows));
                        Ok((Light::Image { rows, factor: 1.0, width, height, source: header.name }, error))
                    }
                    Some(sample) if sample >= width * height => Err(Error::Usage(format!(
                        "{}: there is no sample {sample}; it has samples 0 to {}",
                        header.name,
                        width * height - 1
                    ))),
                    Some(sample) => {
                        for _ in 0..sample / width {
                            rows.next()?;
                        }
                        let electrons = rows.next()?[sample % width];
                        let radiance = rows.radiance(&spectral, sample % width);
                        let source = format!("{}: sample {sample}", header.name);
                        Ok((Light::Uniform { electrons, source }, seen.quadrature_error(&radiance)))
                    }
                }
            }
        }
    }

    /// The row of a table that is wanted.
    fn choose(&self, table: &SpectralTable) -> Result<usize> {
        let count = table.columns.len();
        match (&self.column, self.sample) {
            (Some(column), _) => table.column_index(Some(column)),
            (None, Some(sample)) if sample < count => Ok(sample),
            (None, Some(sample)) => Err(Error::Usage(format!(
                "{}: there is no sample {sample}; it has samples 0 to {}",
                table.name(),
                count - 1
            ))),
            (None, None) if count == 1 => Ok(0),
            (None, None) => Err(Error::Usage(format!(
                "{}: it holds {count} spectra; choose one with --column NAME or --sample N",
                table.name()
            ))),
        }
    }

    /// Settles size, metadata and layout of the frame.
    fn rendering(&self, prepared: &mut Prepared) -> Result<Rendering> {
        let Prepared { sensor, exposure, light, brightest_e, metadata, .. } = prepared;
        let (exposure, brightest_e, mut metadata) = (*exposure, *brightest_e, metadata.clone());
        let of_sensor = [sensor.width as usize, sensor.height as usize];
        let source_width = match light {
            Light::Uniform { .. } => None,
            Light::Image { width, .. } => Some(*width),
        };
        let (size, patch, source, uniform) = match light {
            Light::Uniform { electrons, source } => {
                if self.patch.is_some() {
                    return Err(Error::Usage(
                        "--patch is for the pixels of a spectral image, but the scene is uniform".into(),
                    ));
                }
                if self.expose_to.is_some() {
                    *electrons = electrons.map(|e| e * exposure.exposure_s);
                }
                let size = self.size.unwrap_or(of_sensor);
                (size, size, source.clone(), Some(*electrons))
            }
            Light::Image { factor, width, height, source, .. } => {
                if self.expose_to.is_some() {
                    *factor = exposure.exposure_s;
                }
                let patch = self.patch.unwrap_or([1, 1]);
                let whole = [*width * patch[0], *height * patch[1]];
                let size = self.size.unwrap_or(whole);
                if size[0] > whole[0] || size[1] > whole[1] {
                    return Err(Error::Usage(format!(
                        "{source}: its {width}x{height} pixels in patches of {}x{} make {}x{} photosites, fewer than \
                         --size {}x{}",
                        patch[0], patch[1], whole[0], whole[1], size[0], size[1]
                    )));
                }
                (size, patch, source.clone(), None)
            }
        };
        let vignetting = self
            .vignetting_focal_length_mm
            .map(|focal_length| Vignetting::new(size[0], size[1], sensor.pixel_pitch_um, focal_length));
        let is_negligible = vignetting.as_ref().is_some_and(Vignetting::is_negligible);
        let vignetting = vignetting.filter(|_| !is_negligible);
        if is_negligible {
            metadata.leave_out(
                "render-radiance",
                "vignetting",
                "it changes no sample by half a unit in the last place",
            );
        }
        if self.cfa.is_some() {
            metadata.leave_out("render-radiance", "two of the three planes at each photosite", "the mosaic drops them");
        }
        if vignetting.is_none() && patch[0] * patch[1] > 1 {
            metadata.leave_out(
                "render-radiance",
                "all photosites of a patch but one of each class",
                "without vignetting they expect the same",
            );
        }
        let is_uniform = uniform.is_some() && vignetting.is_none();
        metadata.cfa = self.cfa;
        metadata.sensor = Some(sensor.clone());
        metadata.exposure = Some(exposure);
        metadata.scene = Some(Scene {
            source,
            uniform: is_uniform,
            expected_electrons: uniform.filter(|_| is_uniform),
            vignetting_focal_length_mm: self.vignetting_focal_length_mm.filter(|_| !is_negligible),
            patch: uniform.is_none().then_some(patch),
            source_width,
            brightest_e,
        });
        let channels: &[&str] = if self.cfa.is_some() { &["Y"] } else { &["R", "G", "B"] };
        let geometry = Geometry::new(size[0], size[1], channels);
        let header = FrameHeader { name: "the frame".into(), geometry, metadata };
        Ok(Rendering { header, patch, vignetting, cfa: self.cfa })
    }

    fn write(
        &self,
        session: &Session,
        output: &Output,
        mut rendering: Rendering,
        mut light: Light,
        input: Option<(FileId, String)>,
    ) -> Result<()> {
        session.sign(&mut rendering.header);
        let mut writer = FrameWriter::create(&output.options(), &rendering.header, input.as_slice())?;
        let bar = session.progress(rendering.header.geometry.height);
        let next_row = || match &mut light {
            Light::Uniform { electrons, .. } => Ok(vec![*electrons]),
            Light::Image { rows, factor, .. } => {
                let row = match rows {
                    ImageRows::Streamed(rows) => rows.next()?,
                    ImageRows::Kept(rows) => rows.next().unwrap_or_default(),
                };
                Ok(row.into_iter().map(|electrons| electrons.map(|e| e * *factor)).collect())
            }
        };
        rendering.run(next_row, &mut writer, &mut |rows| bar.set_position(rows as u64))?;
        bar.finish_and_clear();
        writer.finish(Counts::default())?;
        Ok(())
    }
}

impl Light {
    /// The largest electrons of any class and pixel; an image is read whole and kept for that, three numbers a pixel.
    fn keep_and_find_brightest(self) -> Result<(Self, f64)> {
        let largest = |electrons: &[f64; 3]| electrons.iter().copied().fold(0.0, f64::max);
        match self {
            Self::Uniform { electrons, source } => {
                let brightest = largest(&electrons);
                Ok((Self::Uniform { electrons, source }, brightest))
            }
            Self::Image { mut rows, factor, width, height, source } => {
                let mut kept = Vec::with_capacity(height.min(1 << 16));
                let mut brightest = 0.0;
                for _ in 0..height {
                    let row = match &mut rows {
                        ImageRows::Streamed(rows) => rows.next()?,
                        ImageRows::Kept(rows) => rows.next().unwrap_or_default(),
                    };
                    brightest = row.iter().map(largest).fold(brightest, f64::max);
                    kept.push(row);
                }
                let rows = ImageRows::Kept(kept.into_iter());
                Ok((Self::Image { rows, factor, width, height, source }, brightest))
            }
        }
    }
}
