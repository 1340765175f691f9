//! The data sheet of a camera: its numbers, each with its interval or with what would tell it, and the curves.

use super::curve::Values;
use super::hot::HotTail;
use super::level::Level;
use super::linearity::Linearity;
use super::row_drift::RowDrift;
use super::stuck::StuckSite;
use super::suspects::Suspect;
use crate::numerics::variance_components::Interval;

/// A number that was measured, or why it was not.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// Its name in reports.
    pub key: &'static str,
    /// What it is, for people.
    pub what: &'static str,
    /// Its unit; empty for a number without one.
    pub unit: &'static str,
    /// The number; or which frames would tell it.
    pub found: Result<Interval, String>,
}

/// A level as the curve shows it.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct CurvePoint {
    /// Exposure time in s.
    pub exposure_s: Option<f64>,
    /// Photons per photosite.
    pub photons: Option<f64>,
    /// Mean.
    pub mean_adu: f64,
    /// Mean above no light.
    pub signal_adu: f64,
    /// Temporal variance above that of no light.
    pub variance_adu2: f64,
    /// What that scatters by: a standard deviation.
    pub variance_error_adu2: f64,
    /// The share of its samples at the largest code or beyond.
    pub clipped: f64,
    /// Whether gain and responsivity are fitted to it.
    pub is_fitted: bool,
}

/// A dark level as the curve of the dark current shows it.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct DarkPoint {
    /// Exposure time in s.
    pub exposure_s: Option<f64>,
    /// Mean.
    pub mean_adu: f64,
    /// Temporal variance.
    pub variance_adu2: f64,
}

impl CurvePoint {
    /// Of a flat of such a signal and variance above those of no light.
    pub fn of(flat: &Level, [signal_adu, variance_adu2]: [f64; 2], is_fitted: bool) -> Self {
        Self {
            exposure_s: flat.condition.exposure_s,
            photons: flat.condition.photons,
            mean_adu: flat.mean,
            signal_adu,
            variance_adu2,
            variance_error_adu2: flat.variance_variance.sqrt(),
            clipped: flat.at_ends[0],
            is_fitted,
        }
    }
}

impl DarkPoint {
    /// Of a dark.
    pub fn of(dark: &Level) -> Self {
        Self { exposure_s: dark.condition.exposure_s, mean_adu: dark.mean, variance_adu2: dark.variance }
    }
}

/// What was measured of a class.
#[derive(Debug, Clone)]
pub struct ClassFindings {
    /// The class.
    pub name: String,
    /// Numbers, in the order of reports.
    pub findings: Vec<Finding>,
    /// The photon transfer curve.
    pub curve: Vec<CurvePoint>,
    /// Darks of the flats' temperature.
    pub darks: Vec<DarkPoint>,
    /// Deviations from the straight line.
    pub linearity: Option<Linearity>,
    /// What the fits give, in samples.
    pub values: Option<Values>,
    /// The conditions, by their places, and the signals above no light, on which the patterns under light and in the dark were
    /// measured.
    pub stacks: [Option<(usize, f64)>; 2],
    /// What a careful user should know.
    pub notes: Vec<String>,
    /// What may make numbers wrong.
    pub doubts: Vec<String>,
    /// Levels that may not be what they are said to be.
    pub suspects: Vec<Suspect>,
    /// Photosites that hold one value, and were left out.
    pub stuck: Vec<StuckSite>,
    /// Columns and rows of photosites that are full, or reach the largest code, under light far below that, and were left out.
    pub early: Vec<[usize; 2]>,
    /// Hot photosites apart from all others, where there are some.
    pub hot: Option<HotTail>,
    /// The drift of the black level along the rows of its grids, in e-², where there is one.
    pub drift: Option<RowDrift>,
}

impl ClassFindings {
    /// A number by its name.
    pub fn get(&self, key: &str) -> Option<Interval> {
        self.findings.iter().find(|finding| finding.key == key)?.found.clone().ok()
    }
}

/// A number, or which frames would tell it.
pub type Found = Result<Interval, String>;

/// A number under its key.
pub fn finding(key: &'static str, found: Found) -> Finding {
    let named = KEYS.iter().find(|(known, ..)| *known == key);
    let (_, what, unit) = named.copied().unwrap_or((key, key, ""));
    Finding { key, what, unit, found }
}

/// Every number: its key, what it is, its unit.
pub const KEYS: [(&str, &str, &str); 31] = [
    ("gain_adu_per_e", "system gain K", "ADU/e-"),
    ("responsivity_adu_per_photon", "responsivity R", "ADU/photon"),
    ("quantum_efficiency", "quantum efficiency", ""),
    ("black_level_adu", "black level", "ADU"),
    ("dark_noise_adu", "temporal dark noise", "ADU"),
    ("dark_noise_e", "temporal dark noise", "e-"),
    ("row_noise_e", "temporal noise of rows", "e-"),
    ("column_noise_e", "temporal noise of columns", "e-"),
    ("pixel_noise_e", "temporal noise of photosites", "e-"),
    ("threshold_e", "absolute sensitivity threshold", "e-"),
    ("threshold_photons", "absolute sensitivity threshold", "photons"),
    ("saturation_e", "saturation capacity", "e-"),
    ("saturation_photons", "saturation capacity", "photons"),
    ("full_well_e", "full well", "e-"),
    ("snr_max", "largest signal-to-noise ratio", ""),
    ("dynamic_range", "dynamic range", ""),
    ("linearity_error_min", "linearity error, least", ""),
    ("linearity_error_max", "linearity error, largest", ""),
    ("prnu", "photo response non-uniformity", ""),
    ("prnu_row", "of rows", ""),
    ("prnu_column", "of columns", ""),
    ("prnu_pixel", "of photosites", ""),
    ("dsnu_e", "dark signal non-uniformity", "e-"),
    ("dsnu_row_e", "of rows", "e-"),
    ("dsnu_column_e", "of columns", "e-"),
    ("dsnu_pixel_e", "of photosites", "e-"),
    ("dark_current_e_per_s", "dark current, from means", "e-/s"),
    ("dark_current_from_variance_e_per_s", "dark current, from variances", "e-/s"),
    ("dark_current_doubling_k", "dark current doubles in", "K"),
    ("dsnu_offset_e", "dark pattern of photosites that no time adds", "e-"),
    ("dcnu", "dark current non-uniformity", ""),
];

/// An interval of what is not below 0 over another of which it is independent.
pub fn over(of: Interval, by: Interval) -> Interval {
    over_correlated(of, by, 0.0)
}

/// The same where the errors of both have such a correlation.
pub fn over_correlated(of: Interval, by: Interval, correlation: f64) -> Interval {
    let found = of.over(by, correlation);
    Interval { low: found.low.max(0.0), ..found }
}
