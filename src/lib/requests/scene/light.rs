//! The light of a scene: expected electrons per pixel of its source, at the exposure for which it was opened.

use crate::camera::response::Camera;
use crate::error::{Error, Result};
use crate::formats::input::FrameReader;
use crate::formats::spectral::SpectralChannels;
use crate::numerics::planes::{WeightedPlane, weighted_sums};
use crate::numerics::quadrature::Rule;
use crate::stream::RowSource;

/// Where the light comes from, once opened.
pub(super) enum Light {
    /// The same everywhere: signal electrons, and what to call it.
    Uniform { electrons: [f64; 3], source: String },
    /// An image; its rows come one by one, and are multiplied with `factor`.
    Image { rows: ImageRows, factor: f64, width: usize, height: usize, source: String },
}

pub(super) enum ImageRows {
    /// As the file is read.
    Streamed(Box<SpectralRows>),
    /// All rows, read once to find the brightest.
    Kept(std::vec::IntoIter<Vec<[f64; 3]>>),
}

/// Rows of a spectral image as signal electrons.
pub(super) struct SpectralRows {
    reader: FrameReader,
    planes: Vec<WeightedPlane>,
    samples: Vec<f32>,
    /// The first row, where it was read to judge the sum over wavelengths.
    ahead: Option<Vec<[f64; 3]>>,
}

impl SpectralRows {
    /// Rows of an image, as the sums of these planes.
    pub(super) fn new(reader: FrameReader, planes: Vec<WeightedPlane>) -> Self {
        Self { reader, planes, samples: Vec::new(), ahead: None }
    }

    pub(super) fn next(&mut self) -> Result<Vec<[f64; 3]>> {
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
    pub(super) fn brightest_ahead(&mut self, spectral: &SpectralChannels) -> Result<Vec<f64>> {
        let row = self.next()?;
        let radiance = self.radiance(spectral, brightest(&row));
        self.ahead = Some(row);
        Ok(radiance)
    }

    /// The radiance of a pixel of the row that was read last, W cm⁻² sr⁻¹ nm⁻¹.
    pub(super) fn radiance(&self, spectral: &SpectralChannels, x: usize) -> Vec<f64> {
        let (width, factor) = (self.reader.header().geometry.width, spectral.unit.in_w_per_cm2_sr_nm());
        spectral.channels.iter().map(|channel| f64::from(self.samples[channel * width + x]) * factor).collect()
    }
}

/// The place of the brightest of some pixels.
pub(super) fn brightest(electrons: &[[f64; 3]]) -> usize {
    let largest = |x: usize| electrons[x].iter().copied().fold(0.0, f64::max);
    (0..electrons.len()).max_by(|&a, &b| largest(a).total_cmp(&largest(b)).then(b.cmp(&a))).unwrap_or_default()
}

/// Electrons that can be.
pub(super) fn checked(electrons: [f64; 3], name: &str) -> Result<[f64; 3]> {
    if electrons.iter().all(|e| (0.0..f64::INFINITY).contains(e)) {
        Ok(electrons)
    } else {
        Err(Error::format(name, "its radiance is negative or not finite, so that no electrons can be expected of it"))
    }
}

/// What a camera makes of radiances on one set of wavelengths, and the same at twice the step.
pub(super) struct Seen {
    pub(super) camera: Camera,
    pub(super) coarse: Option<Camera>,
    pub(super) rule: Rule,
}

impl Seen {
    pub(super) fn quadrature_error(&self, radiance: &[f64]) -> Option<[f64; 3]> {
        self.camera.quadrature_error(self.rule, self.coarse.as_ref()?, radiance)
    }
}

impl Light {
    /// The next row of the source; of a uniform scene its one pixel.
    pub(super) fn next_row(&mut self) -> Result<Vec<[f64; 3]>> {
        match self {
            Self::Uniform { electrons, .. } => Ok(vec![*electrons]),
            Self::Image { rows, factor, .. } => {
                let row = match rows {
                    ImageRows::Streamed(rows) => rows.next()?,
                    ImageRows::Kept(rows) => rows.next().unwrap_or_default(),
                };
                Ok(row.into_iter().map(|electrons| electrons.map(|e| e * *factor)).collect())
            }
        }
    }

    /// Multiplies the light.
    pub(super) fn scale(&mut self, by: f64) {
        match self {
            Self::Uniform { electrons, .. } => *electrons = electrons.map(|e| e * by),
            Self::Image { factor, .. } => *factor *= by,
        }
    }

    /// The largest electrons of any class and pixel; an image is read whole and kept for that, three numbers a pixel.
    pub(super) fn keep_and_find_brightest(self) -> Result<(Self, f64)> {
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
