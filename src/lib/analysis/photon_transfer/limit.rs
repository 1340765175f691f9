//! What saturates: photosites that are full, or the converter, which has no larger code.

use super::curve::{Curve, LEAST_VARIANCE, may_be_largest};
use super::level::Level;
use super::reasons::{CLIPPED, Reasons};
use super::settings::{Corrected, Settings};
use super::sheet::{Found, over};
use crate::numerics::variance_components::Interval;

/// Where flats end, and what ends there.
#[derive(Debug, Clone)]
pub struct Limit {
    /// What a report calls the saturation capacity.
    pub saturation: &'static str,
    /// What is to be said of it.
    pub told: Option<String>,
    what: What,
    /// Whether the brightest flat has no noise of light left.
    is_reached: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum What {
    Converter(f64),
    Photosites,
    /// Of so many codes, one or the other.
    Either(f64),
    /// One or the other, as frames that were corrected do not tell which.
    Corrected,
    Nothing,
}

impl Limit {
    /// As the flats from the one of the largest variance on show it.
    pub fn of(curve: &Curve, flats: &[Level], settings: &Settings) -> Self {
        /// Samples at the largest code beyond these are no hot photosites.
        const MANY: f64 = 0.01;
        /// What light adds to the variance of the brightest flat is less than such a share of the most that it adds, where it adds none.
        const FLAT: f64 = 0.02;
        let named = |saturation, told: Option<String>, what, is_reached| Self { saturation, told, what, is_reached };
        let (Some(peak), Some(last)) = (curve.saturated, flats.last()) else {
            return named("saturation capacity", None, What::Nothing, false);
        };
        let is_reached = curve.noise(flats.len() - 1) < FLAT * curve.noise(peak);
        if let Some(top) = settings.top.filter(|_| settings.are_codes && last.at_ends[0] > MANY) {
            let told = format!(
                "saturation is that of the converter, which ends at the code {top}: photosites may hold more, which a lower gain of the \
                 camera would tell"
            );
            return named("saturation capacity, of the converter", Some(told), What::Converter(top), is_reached);
        }
        if let Some(Corrected { is_marked, .. }) = settings.corrected {
            let end =
                if is_marked { "samples that are marked as saturated" } else { "the flat of the largest variance" };
            let told = format!(
                "saturation is that of {end}: whether photosites or the converter end there, frames as the camera gives them would tell"
            );
            return named("saturation capacity, of either", Some(told), What::Corrected, is_reached);
        }
        // Noise of the read-out is left where photosites are full, and none where the converter is.
        let is_one_code = settings.are_codes && settings.top.is_none() && last.variance < LEAST_VARIANCE;
        if is_one_code {
            let told = format!(
                "whether photosites or the converter end at {:.1} ADU is not known: the largest code, given by --white, would tell",
                last.mean
            );
            return named("saturation capacity, of either", Some(told), What::Either(last.mean), is_reached);
        }
        let told = "saturation is that of the photosites, which are full below the largest code".to_owned();
        let told = if settings.are_codes { told } else { "saturation is that of the photosites".to_owned() };
        named("saturation capacity, of the photosites", Some(told), What::Photosites, is_reached)
    }

    /// Saturation capacity in electrons, of light alone, and in photons, and the full well, of all charge.
    pub fn capacities(&self, reasons: Reasons, gain: Found, confidence: f64) -> [Found; 3] {
        let Reasons { curve, flats, .. } = reasons;
        let all = |why: String| [Err(why.clone()), Err(why.clone()), Err(why)];
        let gain = match gain {
            Ok(gain) => gain,
            Err(why) => return all(why),
        };
        let Some(peak) = curve.saturated else { return all(reasons.of_saturation()) };
        if !curve.knows_black(peak) {
            return all(reasons.of_darks());
        }
        // The largest variance lies between the neighbors of the level that has it, which may be any of these.
        let [first, last] = may_be_largest(flats, confidence);
        let among = first.saturating_sub(1)..=(last + 1).min(flats.len() - 1);
        let bracket = |of: &dyn Fn(usize) -> f64| Interval {
            value: of(peak),
            low: among.clone().map(of).fold(f64::INFINITY, f64::min),
            high: among.clone().map(of).fold(f64::NEG_INFINITY, f64::max),
        };
        let electrons = over(bracket(&|flat| curve.signal(flat)), gain);
        let photons = |flat: usize| flats[flat].condition.photons;
        let has_photons = among.clone().all(|flat| photons(flat).is_some());
        let in_photons = has_photons.then(|| bracket(&|flat| photons(flat).unwrap_or_default()));
        let why = || if curve.are_darks_clipped { CLIPPED.into() } else { reasons.of_darks() };
        let in_electrons = |(charge, room): (Interval, f64)| {
            let charge = over(charge, gain);
            Interval { high: charge.high + room / gain.value, ..charge }
        };
        let reached = curve.charge(flats.len() - 1).map(in_electrons).ok_or_else(why);
        [
            Ok(electrons),
            in_photons.ok_or_else(|| "the photons per photosite of the flats about saturation are not known".into()),
            reached.and_then(|reached| self.full_well(reached.low).map(|()| reached)),
        ]
    }

    /// Whether the brightest flat tells the full well; its charge is no less than `reached_e`.
    fn full_well(&self, reached_e: f64) -> Result<(), String> {
        match self.what {
            What::Converter(top) => {
                Err(format!("the converter ends first, at the code {top}: it is no less than {reached_e:.0} e-"))
            }
            What::Either(mean) => Err(format!(
                "photosites or the converter end at {mean:.1} ADU: it is no less than {reached_e:.0} e-, and the largest code, given by \
                 --white, would tell which"
            )),
            What::Corrected => Err(format!(
                "photosites or the converter end first: it is no less than {reached_e:.0} e-, and frames as the camera gives them would tell \
                 which"
            )),
            What::Photosites if self.is_reached => Ok(()),
            _ => Err("no flat is so bright that every photosite is full: flats of more light would tell".into()),
        }
    }
}
