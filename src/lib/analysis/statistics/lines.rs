//! Means of rows and of columns before demosaicking, beside what photosites are predicted to share in them.
//!
//! Noise of rows that is taken for noise of photosites leaves means and variances of a frame as they are; means of rows show it. On a grid
//! of R rows and C columns, the photosites of a plane or those at one place of a 2×2 array, the mean squares of the analysis of
//! variance are \[Searle1992]
//!
//! - C Σ (x̄_r − x̄)²/(R − 1), of the expectation D + C R_kk
//! - R Σ (x̄_c − x̄)²/(C − 1), of the expectation D + R S_kk
//!
//! D what is a photosite's own, R_kk and S_kk what two share in a row and in a column. Each scatters as χ² of its degrees of freedom,
//! and by κ₄/(R C) besides, κ₄ the fourth cumulant of a photosite.

use super::check::{FEW, RARE, Subject, Test, rounding};
use super::region::Region;
use crate::cfa::{CfaPattern, Class};
use crate::frame::Window;
use crate::metadata::FrameHeader;
use crate::numerics::significance;
use crate::propagation::{FramePrediction, SiteCovariance};
use std::ops::Range;

/// Rows or columns of a grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Axis {
    Rows,
    Columns,
}

/// Sums over the rows and the columns of a region, grid by grid.
#[derive(Debug, Clone)]
pub(super) struct LineSums {
    region: Region,
    origin: [i32; 2],
    /// The array behind which a plane lies; none of planes that are each one grid.
    pattern: Option<CfaPattern>,
    /// Whether columns differ by their smear, as far as predictions leave that out.
    has_smear: bool,
    /// Sums of rows, by plane and by parity of row and column.
    rows: Vec<[Vec<f64>; 4]>,
    /// Sums of columns, by plane and by parity of the row.
    columns: Vec<[Vec<f64>; 2]>,
}

impl LineSums {
    /// None yet, of a region of a frame of photosites; none of what is demosaicked, nor behind another array than Bayer's.
    pub fn of(frame: &FrameHeader, region: Region) -> Option<Self> {
        let planes = frame.geometry.channels.len();
        let pattern = match frame.metadata.cfa.filter(|_| planes == 1) {
            Some(array) => Some(array.bayer()?),
            None => None,
        };
        let is_known = pattern.is_some() || planes == 3;
        (is_known && frame.metadata.demosaic.is_none()).then(|| Self {
            region,
            origin: frame.geometry.origin,
            pattern,
            has_smear: frame.metadata.noise.as_ref().is_some_and(|noise| noise.smear_per_row > 0.0),
            rows: vec![Default::default(); planes],
            columns: vec![[0, 1].map(|_| vec![0.0; region.width]); planes],
        })
    }

    /// Takes in rows of the frame.
    pub fn add_all(&mut self, window: Window<'_>, rows: Range<usize>) {
        rows.for_each(|y| self.add(window, y));
    }

    fn add(&mut self, window: Window<'_>, y: usize) {
        let Region { x, width, .. } = self.region;
        let odd_row = (y - self.region.y) % 2;
        for (plane, (rows, columns)) in self.rows.iter_mut().zip(&mut self.columns).enumerate() {
            let samples = &window.row(y.cast_signed(), plane)[x..][..width];
            columns[odd_row].iter_mut().zip(samples).for_each(|(sum, sample)| *sum += f64::from(*sample));
            // Lanes of even and of odd columns, which compilers make vectors of.
            let mut lanes = [0.0; 8];
            let (eights, rest) = samples.as_chunks::<8>();
            for of_row in eights.iter().map(<[f32; 8]>::as_slice).chain([rest]) {
                lanes.iter_mut().zip(of_row).for_each(|(lane, sample)| *lane += f64::from(*sample));
            }
            for odd_column in 0..2 {
                rows[2 * odd_row + odd_column].push(lanes.iter().skip(odd_column).step_by(2).sum());
            }
        }
    }

    /// Tests of rows and columns of the classes, or planes, of a frame; none of photosites that are told by their places.
    pub fn tests(&self, frame: &FrameHeader, prediction: Option<&FramePrediction>) -> Vec<Test> {
        let Some(FramePrediction::Planes(predictions)) = prediction else { return Vec::new() };
        let name = |k: usize| if self.pattern.is_some() { Class::ALL[k].letter() } else { frame.channel_name(k) };
        let sites = SiteCovariance::of(predictions);
        let of_class = |k: usize| {
            [Axis::Rows, Axis::Columns].map(|axis| {
                let own = sites.own[k];
                // Rows that drift are like those near them.
                let (shared, are_apart) = match axis {
                    Axis::Rows => (sites.row[(k, k)], sites.drift[(k, k)] == 0.0),
                    Axis::Columns => (sites.column[(k, k)], !self.has_smear),
                };
                let law = LineLaw { own, shared, fourth: predictions[k].fourth_of_own(own) };
                let is_resolved = own.max(0.0).sqrt() > rounding(predictions[k].moments.mean);
                let test = || law.test(axis, name(k), &self.grids(k, axis));
                if are_apart && is_resolved { test() } else { None }
            })
        };
        (0..3).flat_map(of_class).flatten().filter(Test::is_sound).collect()
    }

    /// The lines of the grids of a class: how many, how long they are, and Σ (x̄ − mean)² over them.
    fn grids(&self, k: usize, axis: Axis) -> Vec<Lines> {
        let Region { x, y, width, height } = self.region;
        let half = |extent: usize, parity: usize| (extent + 1 - parity) / 2;
        let Some(pattern) = self.pattern else {
            let [even, odd] = [0, 1].map(|odd_row| &self.columns[k][odd_row]);
            return match axis {
                // Rows of even columns and of odd ones are those of one grid.
                Axis::Rows => {
                    let rows = &self.rows[k];
                    let of_parity = |q: usize| rows[2 * q].iter().zip(&rows[2 * q + 1]).map(|(even, odd)| even + odd);
                    vec![Lines::of(of_parity(0).chain(of_parity(1)), width)]
                }
                Axis::Columns => vec![Lines::of(even.iter().zip(odd).map(|(even, odd)| even + odd), height)],
            };
        };
        let [x0, y0] = self.origin.map(i64::from);
        let class = |q: usize, p: usize| pattern.class(x0 + (x + p) as i64, y0 + (y + q) as i64) as usize;
        let places = (0..4).map(|place| [place / 2, place % 2]).filter(|[q, p]| class(*q, *p) == k);
        let lines = places.map(|[q, p]| match axis {
            Axis::Rows => Lines::of(self.rows[0][2 * q + p].iter().copied(), half(width, p)),
            Axis::Columns => Lines::of(self.columns[0][q].iter().skip(p).step_by(2).copied(), half(height, q)),
        });
        lines.filter(|lines| lines.count >= 2.0 && lines.length > 0.0).collect()
    }
}

/// Rows, or columns, of a grid.
struct Lines {
    count: f64,
    length: f64,
    /// Σ (x̄ − mean)².
    squares: f64,
}

impl Lines {
    fn of(sums: impl Iterator<Item = f64>, length: usize) -> Self {
        let length = length as f64;
        let means: Vec<f64> = sums.map(|sum| sum / length).collect();
        let count = means.len() as f64;
        let mean = means.iter().sum::<f64>() / count;
        Self { count, length, squares: means.iter().map(|of| (of - mean).powi(2)).sum() }
    }
}

/// How means of lines scatter.
struct LineLaw {
    own: f64,
    shared: f64,
    fourth: f64,
}

impl LineLaw {
    fn test(&self, axis: Axis, name: &str, grids: &[Lines]) -> Option<Test> {
        /// The share of the scatter that tails of photosites may make: few of them make up more, and no law is known.
        const OF_TAILS: f64 = 0.02;
        let Self { own, shared, fourth } = *self;
        let freedom: f64 = grids.iter().map(|lines| lines.count - 1.0).sum();
        let photosites: f64 = grids.iter().map(|lines| lines.count * lines.length).sum();
        // Of each grid the mean squares count by their degrees of freedom, over what they expect.
        let expects = |lines: &Lines| own / lines.length + shared;
        let sum: f64 = grids.iter().map(|lines| lines.squares / expects(lines)).sum();
        let expected = grids.iter().map(|lines| (lines.count - 1.0) * expects(lines)).sum::<f64>() / freedom;
        let of_own = grids.iter().map(|lines| (lines.count - 1.0) * own / lines.length).sum::<f64>() / freedom;
        // 2/ν, and κ₄/n of the mean square relative to its expectation.
        let relative = 2.0 / freedom;
        let of_tails = fourth / (own * own) / photosites * (of_own / expected).powi(2);
        let is_known =
            freedom >= FEW && expected > 0.0 && photosites * own >= RARE && of_tails.abs() <= OF_TAILS * relative;
        let freedom = 2.0 / (relative + of_tails);
        is_known.then(|| Test {
            subject: match axis {
                Axis::Rows => Subject::VarianceOfRowMeans,
                Axis::Columns => Subject::VarianceOfColumnMeans,
            },
            channels: vec![name.to_owned()],
            measured: expected * sum * relative / 2.0,
            expected,
            z: Some((sum * relative / 2.0 - 1.0) / (2.0 / freedom).sqrt()),
            bounded: None,
            degrees_of_freedom: Some(freedom),
            p: significance::of_chi_square(freedom * sum * relative / 2.0, freedom),
        })
    }
}
