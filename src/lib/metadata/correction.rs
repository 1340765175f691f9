//! What corrections took off a frame of codes, as its metadata keep it.

use super::converter::AdcRecord;
use super::illumination::Illumination;
use super::records::{NoiseRecord, PoissonKind, is_false, is_no_charge};
use crate::camera::levels::BlackLevel;
use crate::names::{Named, serde_by_name};
use crate::numerics::averages::Combine;
use crate::random::Source;
use crate::units::QuantityKind;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// What was taken back of a frame of codes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CorrectionRecord {
    /// What was subtracted as a constant, or by site, ADU.
    pub black_adu: BlackLevel,
    /// Whether what rows and columns add came off with it.
    #[serde(default, skip_serializing_if = "is_false")]
    pub black_deltas: bool,
    /// How many dark frames were subtracted sample by sample.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub dark_frames: u32,
    /// The averages that were subtracted, each times its weight; none of records that know `dark_frames` alone, whose mean it
    /// was.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub masters: Vec<MasterRecord>,
    /// Charge transfer efficiency that was undone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cte: Option<f64>,
    /// The flat field by which samples were divided.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flat: Option<FlatRecord>,
    /// How defective photosites were told.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub defects: Option<DefectsRecord>,
}

impl CorrectionRecord {
    /// That of a level alone.
    pub fn of_black(black_adu: BlackLevel, black_deltas: bool) -> Self {
        Self { black_adu, black_deltas, dark_frames: 0, masters: Vec::new(), cte: None, flat: None, defects: None }
    }

    /// Whether anything was subtracted.
    pub fn took_black(&self) -> bool {
        self.black_adu.uniform() != Some(0.0) || self.black_deltas || self.took_frames()
    }

    /// Whether frames were subtracted.
    pub fn took_frames(&self) -> bool {
        self.dark_frames > 0 || !self.masters.is_empty()
    }

    /// Whether samples are those of the converter less what is the same at all of a class, so that their level still tells
    /// what they were.
    pub fn is_a_shift(&self) -> bool {
        !self.took_frames() && self.is_plain() && !self.black_deltas
    }

    /// Whether nothing but levels and frames came off.
    pub fn is_plain(&self) -> bool {
        self.cte.is_none() && self.flat.is_none() && self.defects.is_none()
    }

    /// The same with what was subtracted later.
    #[must_use]
    pub fn and_black(self, black: BlackLevel, black_deltas: bool) -> Self {
        let ([a, b, c, d], [e, f, g, h]) = (self.black_adu.sites(), black.sites());
        let sum = BlackLevel::Sites([a + e, b + f, c + g, d + h]);
        let black_adu = sum.uniform().map_or(sum, BlackLevel::from);
        Self { black_adu, black_deltas: self.black_deltas || black_deltas, ..self }
    }
}

/// What frames without light tell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MasterKind {
    /// Bias and dark signal.
    Dark,
    /// The bias: frames of next to no exposure.
    Bias,
}

impl Named for MasterKind {
    const ALL: &'static [Self] = &[Self::Dark, Self::Bias];

    fn name(self) -> &'static str {
        match self {
            Self::Dark => "dark",
            Self::Bias => "bias",
        }
    }
}

serde_by_name!(MasterKind);

/// How frames were averaged.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AverageRecord {
    /// How many.
    pub frames: u32,
    /// How.
    pub combine: Combine,
    /// Standard deviations beyond which samples were clipped.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clip: Option<f64>,
}

/// The exposures of one scene that a frame is the average of.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ExposuresRecord {
    /// How many.
    pub frames: u32,
    /// How they were averaged.
    pub combine: Combine,
    /// Standard deviations beyond which samples were clipped.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clip: Option<f64>,
    /// What their samples were.
    pub quantity: QuantityKind,
    /// Whether each was demosaicked before.
    #[serde(default, skip_serializing_if = "is_false")]
    pub demosaicked: bool,
    /// What levels differ by, in standard deviations of a sample, where a median or clipped mean is no longer that of samples alike.
    #[serde(default, skip_serializing_if = "is_none_apart")]
    pub unlike_levels: f64,
    /// How far codes were cut off at 0, where more than next to none was.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cut_off: Option<CutOffRecord>,
}

/// Codes that are cut off at 0, of exposures that are averaged.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CutOffRecord {
    /// The share of them that is 0.
    pub share: f64,
    /// What the average is too high by, ADU, as far as codes are of one normal law.
    pub excess_adu: f64,
}

impl ExposuresRecord {
    /// That of an average of frames of such a quantity.
    pub fn of(
        AverageRecord { frames, combine, clip }: AverageRecord,
        quantity: QuantityKind,
        demosaicked: bool,
    ) -> Self {
        Self { frames, combine, clip, quantity, demosaicked, unlike_levels: 0.0, cut_off: None }
    }

    /// How they were averaged.
    pub fn average(&self) -> AverageRecord {
        let Self { frames, combine, clip, .. } = *self;
        AverageRecord { frames, combine, clip }
    }
}

/// Exposures of one seed in which noise was drawn, one after another.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct DrawnExposures {
    /// The seed.
    pub seed: u64,
    /// The number of the first.
    pub first: u32,
    /// The number of the last.
    pub last: u32,
}

impl DrawnExposures {
    /// A single one.
    pub fn one(seed: u64, number: u32) -> Self {
        Self { seed, first: number, last: number }
    }

    /// The first exposure that is in both.
    pub fn common(self, other: Self) -> Option<u32> {
        let first = self.first.max(other.first);
        (self.seed == other.seed && first <= self.last.min(other.last)).then_some(first)
    }
}

/// Exposures that came so far, none of them twice.
#[derive(Debug, Clone, Default)]
pub struct ExposureSet(BTreeMap<(u64, u32), u32>);

impl ExposureSet {
    /// Takes in a run; where one of its exposures is there already, gives that one's number instead.
    ///
    /// # Errors
    ///
    /// The number of an exposure that came before.
    pub fn insert(&mut self, run: DrawnExposures) -> Result<(), u32> {
        let DrawnExposures { seed, first, last } = run;
        let before = self.0.range((seed, 0)..=(seed, last)).next_back();
        let before = before.map(|(&(seed, first), &last)| DrawnExposures { seed, first, last });
        match before.and_then(|before| before.common(run)) {
            Some(number) => Err(number),
            None => {
                self.0.insert((seed, first), last);
                Ok(())
            }
        }
    }

    /// All as runs, in order.
    pub fn runs(&self) -> Vec<DrawnExposures> {
        let mut runs: Vec<DrawnExposures> = Vec::new();
        for (&(seed, first), &last) in &self.0 {
            match runs.last_mut().filter(|run| run.seed == seed && run.last.checked_add(1) == Some(first)) {
                Some(run) => run.last = last,
                None => runs.push(DrawnExposures { seed, first, last }),
            }
        }
        runs
    }
}

/// An average that was subtracted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MasterRecord {
    /// What its frames tell.
    pub kind: MasterKind,
    /// How they were averaged.
    pub average: AverageRecord,
    /// What it was multiplied by.
    pub weight: f64,
    /// Exposure of the frames in s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exposure_s: Option<f64>,
    /// Temperature of the sensor in K.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature_k: Option<f64>,
    /// The noise that was drawn in them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<MasterNoise>,
    /// What tells its frames from others: a digest of theirs, or of the seeds and numbers of their exposures.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub identity: Option<String>,
}

/// The noise that was drawn in averaged frames, but for seeds and numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MasterNoise {
    /// Sources drawn.
    pub sources: Vec<Source>,
    /// Mean dark signal before non-uniformity, e⁻.
    pub dark_e: f64,
    /// Mean excess of the dark signal of hot photosites, e⁻; 0 where there are none.
    #[serde(default, skip_serializing_if = "is_no_charge")]
    pub hot_pixel_e: f64,
    /// How Poisson numbers were drawn.
    pub poisson: PoissonKind,
}

impl MasterNoise {
    /// That of a frame.
    pub fn of(noise: &NoiseRecord) -> Self {
        Self {
            sources: noise.sources.clone(),
            dark_e: noise.dark_e,
            hot_pixel_e: noise.hot_pixel_e,
            poisson: noise.poisson,
        }
    }

    /// As a record of a frame; seeds and temperature, on which no moments hang, are 0.
    pub fn record(&self) -> NoiseRecord {
        let Self { sources, dark_e, hot_pixel_e, poisson } = self.clone();
        NoiseRecord {
            sources,
            seed: 0,
            sensor_seed: 0,
            frame: 0,
            temperature_k: 0.0,
            dark_e,
            hot_pixel_e,
            poisson,
            cte: None,
            smear_per_row: 0.0,
        }
    }
}

/// A flat field.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FlatRecord {
    /// How its frames were averaged.
    pub average: AverageRecord,
    /// The light of each frame in shares of the mean, where all were brought to one level before their median or clipped mean.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub levels: Vec<f64>,
    /// What levels differ by from place to place, in standard deviations of a sample, where averages are no longer those of samples alike.
    #[serde(default, skip_serializing_if = "is_none_apart")]
    pub unlike_levels: f64,
    /// Means of its classes above what no light reads, in ADU, by which it was divided: of R, G and B, of the filters of
    /// another array in the order of their letters, of the one class there is, or of planes.
    pub means_adu: Vec<f64>,
    /// How many photosites each is the mean of: those of cells of the array without a saturated or defective one.
    pub photosites: Vec<u64>,
    /// Good photosites of each class beside these.
    #[serde(default, skip_serializing_if = "is_none_left")]
    pub left_out: Vec<u64>,
    /// How many rows of cells these are, and how many columns: (Σ n)²/Σ n² of n cells in each.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cell_lines: Option<[f64; 2]>,
    /// Column and row on the sensor of the corner of its frames, and their width and height.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub area: Option<[i64; 4]>,
    /// How many of the photosites that each mean is of each amplifier has read, where there are several.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tap_photosites: Vec<Vec<u64>>,
    /// The converters behind these, of a frame that is told as one of them reads it; not stored.
    #[serde(skip)]
    pub converters: Vec<AdcRecord>,
    /// Whether the metadata of all its frames say that they were lit evenly.
    pub even: bool,
    /// How they were lit, where that is not so.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub illumination: Option<Illumination>,
    /// Exposure of the frames in s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exposure_s: Option<f64>,
    /// Temperature of the sensor in K.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub temperature_k: Option<f64>,
    /// The noise that was drawn in them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<MasterNoise>,
    /// The level that was subtracted from it first, where it is one, ADU.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub black_adu: Option<f64>,
    /// The averages that were subtracted from it first; none where a level was.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub masters: Vec<MasterRecord>,
    /// Whether the dark frames among them came off the frame that was divided too.
    #[serde(default, skip_serializing_if = "is_false")]
    pub shares_masters: bool,
}

impl FlatRecord {
    /// Which shares of the photosites that the mean of a class is of each of the amplifiers has read whose converters are known; none where
    /// there is one.
    pub fn tap_shares(&self, class: usize) -> Option<Vec<f64>> {
        let of = |counts: &[u64]| counts.get(class).or(counts.first()).copied().unwrap_or_default() as f64;
        let all = of(&self.photosites).max(1.0);
        (!self.converters.is_empty()).then(|| self.tap_photosites.iter().map(|counts| of(counts) / all).collect())
    }
}

/// How defective photosites were told.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DefectsRecord {
    /// The map.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub map: Option<String>,
    /// A digest of a list of defects.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub digest: Option<String>,
    /// Standard deviations beyond which photosites were found defective.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub found_beyond: Option<f64>,
    /// What they were found in.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub found_in: Vec<String>,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands out references")]
fn is_none_apart(spread: &f64) -> bool {
    *spread == 0.0
}

fn is_none_left(counts: &[u64]) -> bool {
    counts.iter().all(|count| *count == 0)
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands out references")]
fn is_zero(count: &u32) -> bool {
    *count == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exposures_are_in_a_set_once() {
        let mut set = ExposureSet::default();
        let run = |seed, first, last| DrawnExposures { seed, first, last };
        for (run, wanted) in [
            (run(7, 3, 5), Ok(())),
            (run(7, 6, 6), Ok(())),
            (run(7, 0, 2), Ok(())),
            (run(8, 4, 4), Ok(())),
            (run(7, 5, 9), Err(6)),
            (run(7, 4, 4), Err(4)),
            (run(7, 0, u32::MAX), Err(6)),
            (run(6, 0, u32::MAX), Ok(())),
            (run(6, u32::MAX, u32::MAX), Err(u32::MAX)),
        ] {
            assert_eq!(set.insert(run), wanted, "{run:?}");
        }
        assert_eq!(set.runs(), [run(6, 0, u32::MAX), run(7, 0, 6), run(8, 4, 4)]);
    }
}
