//! The noise of a photosite in numbers, and what a user may set of it.

use crate::error::Result;
use crate::metadata::{FrameHeader, NoiseRecord, PoissonKind};
use crate::random::Source;

/// The numbers that the noise of a photosite follows from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseModel {
    /// Mean dark signal Q_DC before non-uniformity, e⁻ [HP2005, Eq. 7].
    pub dark_e: f64,
    /// Relative rms of the dark current over photosites; 0 when left out.
    pub dcnu: f64,
    /// Relative rms of the response over photosites, rows and columns apart; 0 when left out.
    pub prnu: f64,
    /// Read noise of a photosite by itself, rms e⁻; 0 when left out.
    pub read_noise_e: f64,
    /// Full well, e⁻.
    pub full_well_e: f64,
    /// Whether the dark signal has shot noise.
    pub dark_shot: bool,
    /// Whether the light signal has shot noise.
    pub signal_shot: bool,
    /// How Poisson numbers are drawn.
    pub poisson: PoissonKind,
    /// What rows and columns share, and offsets of photosites.
    pub lines: LineNoise,
    /// Photosites that are unlike most.
    pub tails: Tails,
}

/// The tails of dark current and of read noise: photosites that are unlike most; 0 what is left out or not there.
///
/// The dark signal of a hot photosite is max(0, Q_DC (1 + dcnu n) + hot t), and the reading of one with a trap is off by −a, 0 or
/// a, in a quarter, a half and a quarter of the exposures, a = rts t′; t and t′ are exponential numbers of mean 1.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Tails {
    /// Share of hot photosites.
    pub hot_share: f64,
    /// Mean excess of their dark signal, e⁻.
    pub hot_e: f64,
    /// Share of photosites with a trap.
    pub rts_share: f64,
    /// Mean amplitude of their jumps, e⁻.
    pub rts_e: f64,
    /// Amplitude of the jumps of photosites that all have the same, e⁻.
    pub trap_e: f64,
    /// Whether photosites of the model are few of a frame, so that what sums over them leave out counts by their share.
    pub are_few: bool,
}

impl Tails {
    /// Whether all photosites are alike.
    pub fn is_none(&self) -> bool {
        !self.has_hot() && !self.has_rts()
    }

    /// Whether some photosites are hot.
    pub fn has_hot(&self) -> bool {
        self.hot_share > 0.0 && self.hot_e > 0.0
    }

    /// Whether some photosites have a trap.
    pub fn has_rts(&self) -> bool {
        self.rts_share > 0.0 && self.rts_e > 0.0
    }

    /// Variance of jumps that are alike at all photosites, e².
    pub fn trap_variance(&self) -> f64 {
        0.5 * self.trap_e * self.trap_e
    }

    /// The mean of what hot photosites add to the dark signal, over all, e⁻.
    pub fn mean_hot_e(&self) -> f64 {
        self.hot_share * self.hot_e
    }
}

/// Noise of sensors that are read by row and column, rms; 0 what is left out or not there.
///
/// A photosite in row r and column c has the sensitivity max(0, 1 + prnu n + prnu_row n_r + prnu_column n_c), and to what is
/// read of it are added dsnu n′ + row_noise m_r + column_noise m_c + dsnu_row n′_r + dsnu_column n′_c, all n and m standard
/// normal numbers. Those of a row serve all its photosites, of whatever class. So does black_drift (z_j cos(πt/2) + z_j+1 sin(πt/2))
/// with z_j a normal number of each knot, j the last knot of each `black_drift_rows` rows of the sensor up to r, and t
/// from 0 to 1 between two of them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LineNoise {
    /// Of a row in one exposure, e⁻.
    pub row_noise_e: f64,
    /// Of a column in one exposure, e⁻.
    pub column_noise_e: f64,
    /// Drift of the black level along the rows of one exposure, e⁻.
    pub black_drift_e: f64,
    /// Rows from one of its knots to the next; 0 where there is none.
    pub black_drift_rows: f64,
    /// Fixed offsets of photosites, e⁻.
    pub dsnu_e: f64,
    /// Fixed offsets of rows, e⁻.
    pub dsnu_row_e: f64,
    /// Fixed offsets of columns, e⁻.
    pub dsnu_column_e: f64,
    /// Relative response of rows.
    pub prnu_row: f64,
    /// Relative response of columns.
    pub prnu_column: f64,
}

impl LineNoise {
    /// Whether there is none.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Whether photosites of a row or of a column have any in common.
    pub fn has_lines(&self) -> bool {
        Self { dsnu_e: 0.0, ..*self } != Self::default()
    }

    /// Whether rows or columns differ in response.
    pub fn has_gains(&self) -> bool {
        self.prnu_row > 0.0 || self.prnu_column > 0.0
    }

    /// Whether anything is added to a row or a column.
    pub fn has_line_offsets(&self) -> bool {
        Self { dsnu_e: 0.0, prnu_row: 0.0, prnu_column: 0.0, ..*self } != Self::default()
    }
}

/// The last knot of the drift of the black level up to a row of the sensor, and the weights of it and the next.
///
/// j = ⌊r/L⌋,  t = r/L − j,  cos(πt/2) and sin(πt/2), L = `black_drift_rows`, so that the variance is the same everywhere
pub fn knots(row: i64, black_drift_rows: f64) -> (i64, [f64; 2]) {
    let place = row as f64 / black_drift_rows;
    let knot = place.floor();
    let angle = std::f64::consts::FRAC_PI_2 * (place - knot);
    #[expect(clippy::cast_possible_truncation, reason = "no farther than the row")]
    (knot as i64, [libm::cos(angle), libm::sin(angle)])
}

/// √(Σ x²); of one number that is not zero that number itself.
fn root_sum<const N: usize>(parts: [f64; N]) -> f64 {
    parts.into_iter().fold(0.0, |sum: f64, part| if part == 0.0 { sum } else { sum.hypot(part) })
}

impl NoiseModel {
    /// The model of a noise record.
    ///
    /// # Errors
    ///
    /// [`Error::MissingKey`](crate::error::Error::MissingKey) when the frame has no sensor, or that no read-out.
    pub fn of(frame: &FrameHeader, record: &NoiseRecord) -> Result<Self> {
        let readout = frame.readout()?;
        let drawn = |source| record.sources.contains(&source);
        let if_drawn = |source, value| if drawn(source) { value } else { 0.0 };
        Ok(Self {
            dark_e: record.dark_e,
            dcnu: if_drawn(Source::Dcnu, readout.dcnu),
            prnu: if_drawn(Source::Prnu, readout.prnu),
            read_noise_e: if_drawn(Source::Ron, readout.read_noise_e),
            full_well_e: readout.full_well_e,
            dark_shot: drawn(Source::Dcsn),
            signal_shot: drawn(Source::Ssn),
            poisson: record.poisson,
            lines: LineNoise {
                row_noise_e: if_drawn(Source::RowNoise, readout.row_noise_e),
                column_noise_e: if_drawn(Source::ColumnNoise, readout.column_noise_e),
                black_drift_e: if_drawn(Source::BlackDrift, readout.black_drift_e),
                black_drift_rows: if_drawn(Source::BlackDrift, readout.black_drift_rows),
                dsnu_e: if_drawn(Source::Dsnu, readout.dsnu_e),
                dsnu_row_e: if_drawn(Source::DsnuRow, readout.dsnu_row_e),
                dsnu_column_e: if_drawn(Source::DsnuColumn, readout.dsnu_column_e),
                prnu_row: if_drawn(Source::PrnuRow, readout.prnu_row),
                prnu_column: if_drawn(Source::PrnuColumn, readout.prnu_column),
            },
            tails: Tails {
                hot_share: if_drawn(Source::HotPixels, readout.hot_pixel_share),
                hot_e: if_drawn(Source::HotPixels, record.hot_pixel_e),
                rts_share: if_drawn(Source::Rts, readout.rts_share),
                rts_e: if_drawn(Source::Rts, readout.rts_amplitude_e),
                trap_e: 0.0,
                are_few: false,
            },
        })
    }

    /// Relative rms of the response over photosites, that of rows and columns included.
    pub fn response(&self) -> f64 {
        root_sum([self.prnu, self.lines.prnu_row, self.lines.prnu_column])
    }

    /// What is added anew to a photosite in each exposure, that of rows and columns included: rms e⁻.
    pub fn read_noise(&self) -> f64 {
        root_sum([self.read_noise_e, self.lines.row_noise_e, self.lines.column_noise_e, self.lines.black_drift_e])
    }

    /// Fixed offsets of photosites, those of rows and columns included: rms e⁻.
    pub fn offsets(&self) -> f64 {
        root_sum([self.lines.dsnu_e, self.lines.dsnu_row_e, self.lines.dsnu_column_e])
    }

    /// Covariance of the fixed offsets of a photosite in a frame of this noise and in another, e².
    pub fn offsets_shared_with(&self, other: &Self) -> f64 {
        let parts = |lines: &LineNoise| [lines.dsnu_e, lines.dsnu_row_e, lines.dsnu_column_e];
        parts(&self.lines).iter().zip(parts(&other.lines)).map(|(a, b)| a * b).sum()
    }

    /// All that is added to the charge of a photosite: rms e⁻.
    pub fn added(&self) -> f64 {
        root_sum([self.read_noise(), self.offsets()])
    }
}

/// What a user may set of the noise.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct NoiseSettings {
    /// Seed of the temporal noise.
    pub seed: u64,
    /// Seed of the fixed patterns.
    pub sensor_seed: u64,
    /// Number of the exposure.
    pub frame: u32,
    /// Sources to leave out; their means stay.
    pub without: Vec<Source>,
    /// Whether all are left out, so that the frame is the mean of noisy ones.
    pub clean: bool,
    /// Temperature in K, the sensor's own where none is given.
    pub temperature_k: Option<f64>,
    /// How to draw Poisson numbers.
    pub poisson: PoissonKind,
    /// Share of a packet that each move to the output takes along; none leaves transfer out.
    pub cte: Option<f64>,
}

/// Mean of max(0, N) for N normal with mean 1: a photosite has no negative sensitivity, so draws below zero count as
/// zero, which lifts the mean by σ φ(1/σ) − Φ(−1/σ) (10⁻⁸ at σ = 0.2).
pub fn rectified_mean(sigma: f64) -> f64 {
    use crate::numerics::normal::{cumulative, density};
    if sigma <= 0.0 { 1.0 } else { cumulative(1.0 / sigma) + sigma * density(1.0 / sigma) }
}

/// Mean square of max(0, N) for N normal with mean 1.
pub fn rectified_mean_square(sigma: f64) -> f64 {
    use crate::numerics::normal::{cumulative, density};
    if sigma <= 0.0 { 1.0 } else { (1.0 + sigma * sigma) * cumulative(1.0 / sigma) + sigma * density(1.0 / sigma) }
}
