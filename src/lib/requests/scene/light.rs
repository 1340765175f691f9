//! The light of a scene: expected electrons per pixel of its source, at the exposure for which it was opened.

use super::picture::Picture;
use crate::camera::response::Camera;
use crate::error::{Error, Result};
use crate::formats::input::FrameReader;
use crate::formats::radiance_unit::{Brightness, times_white};
use crate::formats::spectral::SpectralChannels;
use crate::frame::to_sample;
use crate::metadata::FrameHeader;
use crate::numerics::planes::{WeightedPlane, weighted_sums};
use crate::requests::notes::Note;
use crate::stages::render::Rendering;
use crate::stream::{Band, Outlet, RowSink, RowSource, fold, fold_into};
use crate::units::{Any, RadianceUnit};
use rayon::prelude::*;
use std::sync::{Arc, Mutex, PoisonError};

/// Where the light comes from, once opened.
pub(super) enum Light {
    /// The same everywhere: signal electrons, and what to call it.
    Uniform { electrons: [f64; 3], source: String },
    /// An image; its rows come one by one, and are multiplied with `factor`.
    Image { rows: ImageRows, factor: f64, width: usize, height: usize, source: String },
}

/// Electrons of R, G and B in the pixels of a row.
pub(super) type Electrons = Vec<[f64; 3]>;

pub(super) enum ImageRows {
    /// As the file is read; the first row was read to judge the sum over wavelengths.
    Streamed { first: Electrons, others: Box<SceneImage> },
    /// All rows, read once to find the brightest.
    Kept(Vec<Electrons>),
}

/// How the pixels of an image become signal electrons.
pub(super) enum Pixels {
    /// As sums of its planes; how bright they are may be judged meanwhile.
    Spectral(Vec<WeightedPlane>, Option<Judged>),
    /// As colors.
    Colored(Box<Picture>),
}

/// How bright the pixels of a spectral image are in the unit that they are taken to have.
#[derive(Clone)]
pub(super) struct Judged {
    name: String,
    unit: RadianceUnit,
    is_assumed: bool,
    /// What a sample of 1 is in white clouds, by the place of the plane.
    scales: Vec<(usize, f32)>,
    seen: Arc<Mutex<Brightness>>,
}

impl Judged {
    /// That of an image `name`, of the planes that count.
    pub(super) fn new(name: &str, spectral: &SpectralChannels, planes: &[WeightedPlane]) -> Self {
        let scale_of = |(&plane, &nm): (&usize, &f64)| {
            let counts = planes.iter().any(|weighted| weighted.plane == plane);
            counts.then(|| (plane, to_sample(times_white(spectral.unit.in_w_per_cm2_sr_nm(nm)))))
        };
        Self {
            name: name.to_owned(),
            unit: spectral.unit,
            is_assumed: spectral.is_assumed,
            scales: spectral.channels.iter().zip(&spectral.wavelength_nm).filter_map(scale_of).collect(),
            seen: Arc::default(),
        }
    }

    /// Looks at a row of planes of `width` samples; refuses one that is too bright where the unit is assumed.
    fn see(&self, samples: &[f32], width: usize) -> Result<()> {
        let mut times = vec![0.0_f32; width];
        for (plane, scale) in &self.scales {
            for (times, sample) in times.iter_mut().zip(&samples[plane * width..][..width]) {
                let value = sample * scale;
                *times = if value > *times { value } else { *times };
            }
        }
        let row = Brightness::of(times.into_iter().map(f64::from));
        if self.is_assumed {
            return row.judge(&self.name, self.unit, true).map(|_| ());
        }
        let mut all = self.seen.lock().unwrap_or_else(PoisonError::into_inner);
        *all = all.plus(row);
        Ok(())
    }

    /// A warning of pixels that were seen, where the unit is stated.
    pub(super) fn note(&self) -> Option<Note> {
        let all = *self.seen.lock().unwrap_or_else(PoisonError::into_inner);
        all.judge(&self.name, self.unit, false).ok().flatten().map(Note::Warning)
    }
}

/// An image whose pixels become signal electrons.
pub(super) struct SceneImage {
    reader: FrameReader,
    pixels: Pixels,
    /// Rows that were read.
    rows_read: usize,
}

impl SceneImage {
    /// An image, seen so.
    pub(super) fn new(reader: FrameReader, pixels: Pixels) -> Self {
        Self { reader, pixels, rows_read: 0 }
    }

    /// Gives the electrons of the next `rows` rows to `take`, band by band.
    fn fold(&mut self, rows: usize, mut take: impl FnMut(&Band, Vec<Electrons>)) -> Result<()> {
        let (pixels, first, source) = (&self.pixels, self.rows_read, Named::of(self.reader.header()));
        self.rows_read += rows;
        fold([&mut self.reader as &mut dyn RowSource], rows, |band| {
            take(band, pixels.electrons(band, first, &source)?);
            Ok(())
        })
    }

    /// As [`Self::fold`], and has `draw` write what it makes of them to a sink meanwhile.
    fn fold_into(
        &mut self,
        rows: usize,
        sink: &mut dyn RowSink,
        mut draw: impl FnMut(&Band, Vec<Electrons>, &mut Outlet<'_>) -> Result<()>,
    ) -> Result<()> {
        let (pixels, first, source) = (&self.pixels, self.rows_read, Named::of(self.reader.header()));
        self.rows_read += rows;
        fold_into([&mut self.reader as &mut dyn RowSource], rows, sink, |band, outlet| {
            draw(band, pixels.electrons(band, first, &source)?, outlet)
        })
    }

    /// The electrons of the next row.
    pub(super) fn next_row(&mut self) -> Result<Electrons> {
        let mut found = None;
        self.fold(1, |_, rows| found = rows.into_iter().next())?;
        Ok(found.unwrap_or_default())
    }

    /// The electrons of a pixel.
    pub(super) fn electrons_at(&mut self, [x, y]: [usize; 2]) -> Result<[f64; 3]> {
        let mut found = None;
        self.fold(y + 1, |_, rows| found = rows.last().map(|row| row[x]))?;
        Ok(found.unwrap_or_default())
    }

    /// The electrons of the next row, and the radiance of its brightest pixel, W cm⁻² sr⁻¹ nm⁻¹.
    pub(super) fn first_row(&mut self, spectral: &SpectralChannels) -> Result<(Electrons, Vec<f64>)> {
        let mut found = None;
        self.fold(1, |band, rows| {
            found = rows.into_iter().next().map(|row| {
                let radiance = radiance(band, 0, brightest(&row), spectral);
                (row, radiance)
            });
        })?;
        Ok(found.unwrap_or_default())
    }

    /// The electrons of a pixel, and its radiance, W cm⁻² sr⁻¹ nm⁻¹.
    pub(super) fn pixel(&mut self, [x, y]: [usize; 2], spectral: &SpectralChannels) -> Result<([f64; 3], Vec<f64>)> {
        let mut found = None;
        self.fold(y + 1, |band, rows| {
            if band.rows().end > y {
                found = rows.last().map(|row| (row[x], radiance(band, y, x, spectral)));
            }
        })?;
        Ok(found.unwrap_or_default())
    }
}

impl Pixels {
    /// The electrons of the rows of a band; the first that could be in it is row `first` of the image.
    fn electrons(&self, band: &Band, first: usize, source: &Named) -> Result<Vec<Electrons>> {
        let (window, name) = (band.window::<Any>(0), source.name.as_str());
        let of_row = |y: usize| {
            let row = match self {
                Self::Spectral(planes, _) => {
                    let mut row = Vec::with_capacity(window.width());
                    weighted_sums(window.all_channels(y), window.width(), planes, |electrons| row.push(electrons));
                    row
                }
                Self::Colored(picture) => picture.electrons(window.all_channels(y), window.width(), first + y, name)?,
            };
            let at = |x: usize| match self {
                Self::Spectral(planes, _) => {
                    let sample = |plane: usize| window.all_channels(y)[plane * window.width() + x];
                    source.pixel([x, first + y], planes.iter().map(|weighted| weighted.plane), sample)
                }
                Self::Colored(_) => source.pixel([x, first + y], [], |_| 0.0),
            };
            let of_pixel = |(x, electrons)| checked_at(electrons, name, || at(x));
            let row = row.into_iter().enumerate().map(of_pixel).collect::<Result<_>>()?;
            if let Self::Spectral(_, Some(judged)) = self {
                judged.see(window.all_channels(y), window.width())?;
            }
            Ok(row)
        };
        band.rows().into_par_iter().map(of_row).collect()
    }
}

/// What messages call an image and its channels.
struct Named {
    name: String,
    channels: Vec<String>,
}

impl Named {
    fn of(header: &FrameHeader) -> Self {
        Self { name: header.name.clone(), channels: header.geometry.channels.clone() }
    }

    /// Where something is wrong: a pixel, from 0, and the first of its planes whose sample is no finite number.
    fn pixel(
        &self,
        [x, y]: [usize; 2],
        planes: impl IntoIterator<Item = usize>,
        sample: impl Fn(usize) -> f32,
    ) -> String {
        let wrong = planes.into_iter().find(|plane| !sample(*plane).is_finite());
        let channel = wrong.and_then(|plane| {
            Some(format!(
                ", where its channel {} is {}; write a radiance there",
                self.channels.get(plane)?,
                sample(plane)
            ))
        });
        format!(" at pixel {x},{y}{}", channel.unwrap_or_default())
    }
}

/// The radiance of a pixel, W cm⁻² sr⁻¹ nm⁻¹.
fn radiance(band: &Band, y: usize, x: usize, spectral: &SpectralChannels) -> Vec<f64> {
    let window = band.window::<Any>(0);
    let sample = |index: usize| f64::from(window.row(y.cast_signed(), spectral.channels[index])[x]);
    let between = spectral.between();
    let factors = spectral.factors(&between);
    between.values(sample).into_iter().zip(factors).map(|(value, factor)| value * factor).collect()
}

/// The place of the brightest of some pixels.
pub(super) fn brightest(electrons: &[[f64; 3]]) -> usize {
    let largest = |x: usize| electrons[x].iter().copied().fold(0.0, f64::max);
    (0..electrons.len()).max_by(|&a, &b| largest(a).total_cmp(&largest(b)).then(b.cmp(&a))).unwrap_or_default()
}

/// A complaint of a sample that is not there.
pub(super) fn no_sample(name: &str, sample: usize, count: usize) -> Error {
    Error::Usage(format!("{name}: there is no sample {sample}; it has samples 0 to {}", count - 1))
}

/// Electrons that can be.
pub(super) fn checked(electrons: [f64; 3], name: &str) -> Result<[f64; 3]> {
    checked_at(electrons, name, String::new)
}

/// The same of a place in a file.
fn checked_at(electrons: [f64; 3], name: &str, place: impl Fn() -> String) -> Result<[f64; 3]> {
    if let Some(e) = electrons.into_iter().find(|e| !(0.0..f64::INFINITY).contains(e)) {
        let what = match e {
            _ if e < 0.0 => "negative, summed over what a class of photosites sees",
            _ if e > 0.0 => "endless at this exposure",
            _ => "no finite number",
        };
        let problem = format!("its radiance is {what}: no electrons can be expected of it{}", place());
        return Err(Error::format(name, problem));
    }
    match electrons.into_iter().find(|e| *e > f64::from(f32::MAX)) {
        Some(e) => {
            let problem = format!("its radiance makes {e:.1e} electrons, more than a sample holds{}", place());
            Err(Error::format(name, problem))
        }
        None => Ok(electrons),
    }
}

/// What a camera makes of radiances on one set of wavelengths, by the sum that was asked for and by the exact integral.
pub(super) struct Seen {
    pub(super) camera: Camera,
    pub(super) exact: Camera,
}

impl Seen {
    pub(super) fn quadrature_error(&self, radiance: &[f64]) -> Option<[f64; 3]> {
        self.camera.quadrature_error(&self.exact, radiance)
    }
}

impl Light {
    /// Draws a frame of the light.
    pub(super) fn draw(
        self,
        rendering: &Rendering,
        sink: &mut dyn RowSink,
        progress: &mut dyn FnMut(usize),
    ) -> Result<()> {
        let scaled = |row: Electrons, factor: f64| -> Electrons {
            row.into_iter().map(|electrons| electrons.map(|e| e * factor)).collect()
        };
        match self {
            Self::Uniform { electrons, .. } => rendering.draw(0, &[[electrons]], sink, progress),
            Self::Image { rows: ImageRows::Kept(rows), factor, .. } => {
                let shown = rows.into_iter().take(rendering.source_rows());
                let shown: Vec<Electrons> = shown.map(|row| scaled(row, factor)).collect();
                rendering.draw(0, &shown, sink, progress)
            }
            Self::Image { rows: ImageRows::Streamed { first, mut others }, factor, .. } => {
                rendering.draw(0, &[scaled(first, factor)], sink, progress)?;
                others.fold_into(rendering.source_rows() - 1, sink, |band, rows, outlet| {
                    let rows: Vec<Electrons> = rows.into_iter().map(|row| scaled(row, factor)).collect();
                    rendering.draw(1 + band.rows().start, &rows, outlet, progress)
                })
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
            Self::Image { rows, factor, width, height, source } => {
                let kept = match rows {
                    ImageRows::Streamed { first, mut others } => {
                        let mut kept = vec![first];
                        others.fold(height - 1, |_, rows| kept.extend(rows))?;
                        kept
                    }
                    ImageRows::Kept(rows) => rows,
                };
                let brightest = kept.iter().flatten().map(largest).fold(0.0, f64::max);
                Ok((Self::Image { rows: ImageRows::Kept(kept), factor, width, height, source }, brightest))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_that_are_no_numbers_are_told_by_their_place() {
        let source = Named { name: "a.exr".into(), channels: vec!["S0.400nm".into(), "S0.500nm".into()] };
        let samples = [1.0, f32::NAN];
        let at = source.pixel([3, 2], [0, 1], |plane| samples[plane]);
        assert_eq!(at, " at pixel 3,2, where its channel S0.500nm is NaN; write a radiance there");
        let told = checked_at([1.0, f64::NAN, 1.0], "a.exr", || at.clone()).unwrap_err().to_string();
        let wanted = "a.exr: its radiance is no finite number: no electrons can be expected of it at pixel 3,2, where";
        assert!(told.starts_with(wanted), "{told}");
        assert_eq!(source.pixel([0, 0], [0], |_| 1.0), " at pixel 0,0");
    }
}
