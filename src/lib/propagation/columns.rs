//! What photosites of a CCD have of others in their column: smear, and charge that spills over.

use super::law::Law;
use super::moments::Prediction;
use super::photosite::Photosite;
use super::unpredictable::{Predicted, Unpredictable};
use crate::cfa::{CfaPattern, Class, FilterArray};
use crate::metadata::FrameHeader;
use crate::stages::noise::smear::uniform_columns;

/// The share of photosites beyond full well from which on charge that spills counts: of 10⁷ photosites, one in a hundred frames.
const OVERFLOWING: f64 = 1e-9;

/// Why nothing is predicted where charge may spill.
const BLOOMS: &str =
    "charge spills over along columns from photosites beyond full well, more than one in 10⁹, into their neighbors";

/// Why nothing is predicted where charge has spilled.
pub(super) const BLOOMED: &str = "photosites are saturated by neighbors: charge has spilled over along their columns";

/// Half the difference of the smear of even and odd columns up to which photosites of a class are alike, as a share of their
/// noise: what it adds to their variance is below 4·10⁻⁶ of it, less than is seen in 10¹⁰ of them.
const ALIKE: f64 = 2e-3;

/// Why nothing is predicted where photosites of a class differ by their columns.
const UNEVEN: &str = "the smear of columns with red photosites and of those with blue ones differs by more than the 250th \
                      part of the noise, so that photosites of a class are not alike";

/// Why nothing is predicted of another array's mosaic.
const OF_ANOTHER: &str = "it is behind another filter array than its sensor has, by which its columns have smear";

/// Why nothing is predicted over a flat field of unknown smear.
const UNTIMED: &str = "it was divided by a flat field of a sensor with smear, and nothing tells the exposure of the flats, by which that goes; \
                       correct the frame with flats whose metadata tell it";

/// What photosites expect with smear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Smeared {
    /// Electrons of R, G and B, means over the columns that have them.
    pub expected_e: [f64; 3],
    /// What even columns are off the mean of all by, e⁻.
    off_e: f64,
    /// The columns of the flat field by which it was divided.
    of_flat: Option<FlatColumns>,
}

/// Columns of flats with smear.
#[derive(Debug, Clone, Copy, PartialEq)]
struct FlatColumns {
    /// The share of the light of each photosite of a column that all others take.
    share: f64,
    pattern: CfaPattern,
    rows: u32,
}

impl FlatColumns {
    /// What even columns are off the mean by, e⁻, of so much light.
    fn off_e(&self, expected_e: [f64; 3]) -> f64 {
        let [even, odd] = uniform_columns(self.pattern, self.rows, expected_e);
        0.5 * self.share * (even - odd)
    }
}

impl Smeared {
    /// What the photosites of a frame expect in a uniform scene of which they would expect so many electrons without smear.
    pub fn of(frame: &FrameHeader, expected_e: [f64; 3]) -> Predicted<Self> {
        let share = frame.metadata.noise.as_ref().map_or(0.0, |noise| noise.smear_per_row);
        if share <= 0.0 {
            return Ok(Self { expected_e, off_e: 0.0, of_flat: None });
        }
        let sensor = frame.metadata.sensor.as_ref().ok_or(Unpredictable::Missing("sensor"))?;
        let readout = sensor.readout.as_ref().ok_or(Unpredictable::Missing("sensor.readout"))?;
        let pattern = readout.cfa.bayer().ok_or(Unpredictable::Beyond(OF_ANOTHER))?;
        let smear = uniform_columns(pattern, readout.height, expected_e).map(|sum| share * sum);
        let mean = smear[0].midpoint(smear[1]);
        let mut with = expected_e.map(|e| e + mean);
        if let Some(plane) = plane_of(frame) {
            if plane != pattern {
                return Err(Unpredictable::Beyond(OF_ANOTHER));
            }
            // Red photosites lie in columns of one parity, blue ones in those of the other.
            for class in [Class::Red, Class::Blue] {
                with[class as usize] = expected_e[class as usize] + smear[column_of(pattern, class)];
            }
        }
        let of_flat = match frame.metadata.correction.as_ref().and_then(|correction| correction.flat.as_ref()) {
            Some(flat) => {
                let exposure_s = flat.exposure_s.filter(|exposure_s| *exposure_s > 0.0);
                let exposure_s = exposure_s.ok_or(Unpredictable::Beyond(UNTIMED))?;
                Some(FlatColumns { share: readout.smear_line_s / exposure_s, pattern, rows: readout.height })
            }
            None => None,
        };
        Ok(Self { expected_e: with, off_e: (smear[0] - smear[1]) / 2.0, of_flat })
    }

    /// Makes sure that photosites of a class are alike next to their noise: of a frame, or over a flat field whose columns differ too, or do
    /// not where smear was left out of it.
    pub fn check_even(&self, photosite: &Photosite, classes: &[Prediction; 3]) -> Predicted<()> {
        let off_e = |k: usize| match self.of_flat.zip(photosite.flat) {
            Some((columns, flat)) => {
                let in_both = self.off_e - self.expected_e[k] / flat.expected_e[k] * columns.off_e(flat.expected_e);
                self.off_e.abs().max(in_both.abs())
            }
            None => self.off_e.abs(),
        };
        let is_alike = |k: usize| off_e(k) * photosite.slope() <= ALIKE * classes[k].moments.std();
        if (0..3).all(|k| off_e(k) == 0.0 || is_alike(k)) { Ok(()) } else { Err(Unpredictable::Beyond(UNEVEN)) }
    }
}

/// The pattern of the plane that a frame is, or was demosaicked from; none of three planes.
fn plane_of(frame: &FrameHeader) -> Option<CfaPattern> {
    let metadata = &frame.metadata;
    metadata.demosaic.as_ref().map(|record| record.cfa).or_else(|| metadata.cfa.and_then(FilterArray::bayer))
}

/// The parity of the columns that have red or blue photosites.
fn column_of(pattern: CfaPattern, class: Class) -> usize {
    let is_first = [0, 1].iter().any(|row| pattern.row_classes([0, 0], *row)[0] == class);
    usize::from(!is_first)
}

/// Makes sure that next to no charge spills between the photosites of a frame.
pub(super) fn check_wells(frame: &FrameHeader, photosite: &Photosite, expected_e: [f64; 3]) -> Predicted<()> {
    let metadata = &frame.metadata;
    if metadata.bloomed_photosites.is_some_and(|count| count > 0) {
        return Err(Unpredictable::Beyond(BLOOMED));
    }
    let readout = metadata.sensor.as_ref().and_then(|sensor| sensor.readout.as_ref());
    if metadata.noise.is_none() || readout.is_none_or(|readout| readout.blooming <= 0.0) {
        return Ok(());
    }
    let full_well_e = photosite.model.full_well_e;
    let is_beyond = |expected_e: f64| {
        let share = if photosite.has_tails() {
            photosite.mean_of(expected_e, |site| Law::of(&site.model, expected_e).reaches(full_well_e))
        } else {
            Law::of(&photosite.model, expected_e).reaches(full_well_e)
        };
        // What is no number is not known to be little.
        share.is_nan() || share > OVERFLOWING
    };
    if expected_e.into_iter().any(is_beyond) { Err(Unpredictable::Beyond(BLOOMS)) } else { Ok(()) }
}
