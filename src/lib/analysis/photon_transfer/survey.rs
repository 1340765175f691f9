//! What frames of one condition tell: temporal and fixed-pattern variance of each grid of photosites, apart, and what each
//! scatters by.
//!
//! L frames y_k of one light and exposure are read in step. At a photosite ȳ is their mean and a_k = y_k − ȳ; over the n
//! photosites ā_k is what light and read-out drifted by as a whole, and β_k = Σ a_k (ȳ − m)/Σ (ȳ − m)² what light drifted by in
//! proportion, which shows where it is uneven. What is left is temporal noise,
//!
//! σ² = Σ_k Σ (a_k − ā_k − β_k (ȳ − m))²/((L − 1)(n − 2)),
//!
//! of two frames half the variance of their difference \[EMVA1288, Eq. 10]. Row and column noise make samples of a frame
//! correlated: what σ² and m scatter by is told from the scatter of rows and of columns beside that of photosites, clustered both
//! ways \[CameronEtAl2011].

use super::marks::{is_marked, split_off, without_marks};
use super::prints::{Print, Prints};
use super::settings::Ends;
use super::site_survey::SiteSurvey;
use super::sites::Site;
use super::stuck::Stuck;
use super::tally::Tally;
use crate::error::{Error, Result};
use crate::frame::Geometry;
use crate::metadata::FrameHeader;
use crate::numerics::vectors::{self, Kernel};
use crate::stream::RowSource;
use rayon::prelude::*;
use std::sync::{Mutex, PoisonError};

/// What frames of one condition tell.
#[derive(Debug, Clone)]
pub struct Survey {
    /// The frames' geometry.
    pub geometry: Geometry,
    /// The grids, as [`Site::of`] has them.
    pub sites: Vec<SiteSurvey>,
    /// The mean of the frames, laid out as `[row][channel][column]`, where it was kept.
    pub picture: Option<Vec<f32>>,
    /// The bits that codes have, of the first rows.
    pub bits: u32,
    /// Means of the sites of each 2x2, row by row, of the first frame's first plane.
    pub quad: [f64; 4],
    /// What tells each frame from all others; none where noise does not.
    pub prints: Vec<Print>,
}

/// How frames are surveyed.
#[derive(Debug, Clone, Copy, Default)]
pub struct Asked<'a> {
    /// Where codes end.
    pub ends: Ends,
    /// The mean from which on a photosite counts as full, where it is known.
    pub full: Option<f64>,
    /// Photosites that are left out.
    pub stuck: Option<&'a Stuck>,
    /// Whether the mean of the frames is kept.
    pub keeps: bool,
}

/// Reads all rows of frames of one condition, which are alike; at two or more. `top` is the largest code, where it is known; the
/// mean of the frames is kept where `keeps` says so. Memory is a few rows of each, and that mean.
///
/// # Errors
///
/// Those of the frames; [`Error::Data`] for samples that are not finite, and for grids of fewer than 2x2.
pub fn survey<S: RowSource>(frames: &mut [S], top: Option<f64>, keeps: bool) -> Result<Survey> {
    survey_as(frames, &Asked { ends: Ends { top, ..Ends::default() }, keeps, ..Asked::default() })
}

/// The same, as it is asked. Where a frame has the layer of marks behind its channels, samples that these call saturated are at the top,
/// whatever they are.
///
/// # Errors
///
/// As [`survey`].
pub fn survey_as<S: RowSource>(frames: &mut [S], asked: &Asked) -> Result<Survey> {
    let header = without_marks(frames[0].header());
    let sites = Site::of(&header);
    if sites.iter().any(|site| site.size.iter().any(|extent| *extent < MIN_EXTENT)) {
        let [columns, rows] = [header.geometry.width, header.geometry.height];
        return Err(header.refuse(format!("{columns}x{rows} photosites are too few for statistics of each class")));
    }
    let geometry = &header.geometry;
    let step = rows_at_once(frames, geometry);
    let rows_from = |first: usize| step.min(geometry.height - first);
    let mut sums = Sums::new(&header, &sites, frames.len(), asked);
    let [mut ahead, mut band] = [Band::new(frames.len()), Band::new(frames.len())];
    ahead.read(frames, rows_from(0), geometry)?;
    let mut done = 0;
    while done < geometry.height {
        std::mem::swap(&mut ahead, &mut band);
        let rows = band.rows;
        // The next rows are decoded as these are summed.
        let (read, ()) = rayon::join(|| ahead.read(frames, rows_from(done + rows), geometry), || sums.add(done, &band));
        read?;
        done += rows;
    }
    let Sums { tallies, picture, bits, quad, prints, .. } = sums;
    let sites: Vec<SiteSurvey> = tallies.into_iter().map(Tally::finish).collect();
    if sites.iter().any(|site| !(site.mean.is_finite() && site.variance.is_finite())) {
        return Err(Error::format(&header.name, "it, or one with it, holds samples that are not finite"));
    }
    let (quad, prints) = (quad.means(), prints.finish());
    Ok(Survey { geometry: header.geometry, sites, picture, bits, quad, prints })
}

/// Rows of each frame that are read at once: of many frames few, which stay in the cache, but no fewer than their files have in one piece.
fn rows_at_once<S: RowSource>(frames: &[S], geometry: &Geometry) -> usize {
    /// Samples of all frames together.
    const CACHED: usize = 1 << 17;
    let natural = frames.iter().map(RowSource::natural_rows).max().unwrap_or(1);
    let few = CACHED / (geometry.row_samples() * frames.len()).max(1);
    geometry.band_rows(natural, 1).min(few.max(natural)).max(1)
}

/// Rows of all frames.
struct Band {
    rows: usize,
    /// Those of each frame, laid out as `[row][channel][column]`.
    samples: Vec<Vec<f32>>,
    /// Marks of each frame, `[row][column]`; empty where it has none.
    marks: Vec<Vec<f32>>,
}

/// Buffers of frames that the next survey takes: memory that is touched for the first time costs more than what is done in it.
static KEPT: Mutex<Vec<Vec<f32>>> = Mutex::new(Vec::new());
/// So many of so many samples at most are kept.
const KEPT_FRAMES: usize = 16;
const KEPT_SAMPLES: usize = 1 << 16;

impl Band {
    fn new(frames: usize) -> Self {
        let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
        let samples = (0..frames).map(|_| kept.pop().unwrap_or_default()).collect();
        Self { rows: 0, samples, marks: vec![Vec::new(); frames] }
    }

    /// Reads so many rows of frames of such a geometry, the layer of marks apart.
    fn read<S: RowSource>(&mut self, frames: &mut [S], rows: usize, geometry: &Geometry) -> Result<()> {
        self.rows = rows;
        if rows == 0 {
            return Ok(());
        }
        frames.par_iter_mut().zip(&mut self.samples).zip(&mut self.marks).try_for_each(|((frame, samples), marks)| {
            samples.clear();
            frame.read(rows, samples)?;
            if is_marked(frame.header()) {
                split_off(samples, marks, rows, geometry);
            }
            Ok(())
        })
    }
}

impl Drop for Band {
    fn drop(&mut self) {
        let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
        let room = KEPT_FRAMES.saturating_sub(kept.len());
        kept.extend(self.samples.drain(..).filter(|samples| samples.capacity() <= KEPT_SAMPLES).take(room));
    }
}

/// What is summed over rows.
struct Sums<'a> {
    geometry: &'a Geometry,
    sites: &'a [Site],
    tallies: Vec<Tally>,
    picture: Option<Vec<f32>>,
    bits: u32,
    quad: Quad,
    prints: Prints,
}

impl<'a> Sums<'a> {
    fn new(header: &'a FrameHeader, sites: &'a [Site], frames: usize, asked: &Asked) -> Self {
        let Asked { ends, full, stuck, keeps } = *asked;
        let geometry = &header.geometry;
        let stand_ins = |place: usize| stuck.map_or_else(Vec::new, |stuck| stuck.stand_ins(place));
        let tally = |(place, site): (usize, &Site)| Tally::new(site, frames, ends, full, stand_ins(place));
        Self {
            geometry,
            sites,
            tallies: sites.iter().enumerate().map(tally).collect(),
            picture: keeps.then(|| vec![0.0; geometry.row_samples() * geometry.height]),
            bits: 0,
            quad: Quad::default(),
            prints: Prints::new(frames, geometry.height),
        }
    }

    /// Adds rows, the first of which is row `first` of the frames.
    fn add(&mut self, first: usize, Band { rows, samples, marks }: &Band) {
        let Self { geometry, sites, .. } = *self;
        let (planes, width) = (geometry.channels.len(), geometry.width);
        if first == 0 {
            self.bits = samples.iter().fold(0, |bits, samples| bits | vectors::run(Bits(samples)));
        }
        self.quad.add(first, &samples[0], geometry);
        for row in 0..*rows {
            let row_samples = geometry.row_samples();
            self.prints.add(first + row, samples, row * row_samples..(row + 1) * row_samples);
            let own = sites.iter().zip(&mut self.tallies).filter(|(site, _)| site.is_in_row(first + row));
            for (site, tally) in own {
                let plane = |row: usize| (row * planes + site.plane) * width;
                tally.mark(site, marks, row * width..(row + 1) * width);
                tally.add(site, samples, plane(row)..plane(row) + width);
                if let Some(picture) = &mut self.picture {
                    site.spread(tally.means(), &mut picture[plane(first + row)..][..width]);
                }
            }
        }
    }
}

/// The bits that any of some samples has.
struct Bits<'a>(&'a [f32]);

impl Kernel for Bits<'_> {
    type Output = u32;

    #[inline(always)]
    fn run(self) -> u32 {
        self.0.iter().fold(0, |bits, sample| bits | whole(*sample))
    }
}

/// A sample as a code; of what is no whole number all bits.
#[inline(always)]
fn whole(sample: f32) -> u32 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "what does not fit is no code")]
    let code = sample as u32;
    if f64::from(code) == f64::from(sample) { code } else { u32::MAX }
}

/// Sums over the sites of each 2x2 of a frame's first plane, row by row, and how many samples they are of.
#[derive(Default)]
struct Quad([(f64, f64); 4]);

impl Quad {
    /// Adds rows, the first of which is row `first` of the frame.
    fn add(&mut self, first: usize, band: &[f32], geometry: &Geometry) {
        for (y, row) in band.chunks_exact(geometry.row_samples()).enumerate() {
            let lanes = vectors::run(Lanes(&row[..geometry.width]));
            let of_row = &mut self.0[(first + y) % 2 * 2..][..2];
            for (parity, (sum, count)) in of_row.iter_mut().enumerate() {
                *sum += lanes.iter().skip(parity).step_by(2).sum::<f64>();
                *count += (geometry.width + 1 - parity).div_euclid(2) as f64;
            }
        }
    }

    fn means(&self) -> [f64; 4] {
        self.0.map(|(sum, count)| sum / f64::max(count, 1.0))
    }
}

/// Sums of a row in lanes, which compilers make vectors of; even ones are of even columns.
struct Lanes<'a>(&'a [f32]);

impl Kernel for Lanes<'_> {
    type Output = [f64; 8];

    #[inline(always)]
    fn run(self) -> [f64; 8] {
        let mut lanes = [0.0; 8];
        let (eights, rest) = self.0.as_chunks::<8>();
        for samples in eights {
            lanes.iter_mut().zip(samples).for_each(|(lane, sample)| *lane += f64::from(*sample));
        }
        lanes.iter_mut().zip(rest).for_each(|(lane, sample)| *lane += f64::from(*sample));
        lanes
    }
}

/// Fewer rows or columns have no variance between them worth the name.
const MIN_EXTENT: usize = 4;
