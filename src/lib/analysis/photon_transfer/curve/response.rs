//! The response to light: the line through signals over photons.

use super::super::fit::{Line, Point};
use super::super::level::is_same_time;
use super::{Curve, Point4};

impl Curve {
    /// Whether fitted flats of known photons are three levels or more of one exposure time, so that all stand above the same dark charge.
    pub(super) fn are_of_one_time(&self) -> bool {
        /// Two levels make a line that none misses.
        const LEAST: usize = 3;
        let counted = || self.fitted.iter().map(|&flat| &self.flats[flat]).filter(|flat| flat.photons.is_some());
        let first = counted().find_map(|flat| flat.exposure_s);
        let is_first = |flat: &Point4| first.is_some() && is_same_time(flat.exposure_s, first);
        let mut photons: Vec<f64> = counted().filter_map(|flat| Some(flat.photons?.value)).collect();
        photons.sort_by(f64::total_cmp);
        photons.dedup();
        photons.len() >= LEAST && counted().all(is_first)
    }

    /// Photons, and the mean above no light; of darks that code 0 cuts off the mean itself, where that is enough, as what they have is above
    /// black.
    pub(super) fn response_points(&self) -> impl Iterator<Item = Point> + Clone {
        self.fitted.iter().enumerate().filter_map(|(place, &flat)| {
            let photons = self.flats[flat].photons?;
            let weight = self.weights.response.get(place).copied().unwrap_or(1.0 / photons.value.max(1.0));
            let y = match self.are_darks_clipped {
                true => self.flats[flat].mean.value,
                false => self.signal(flat),
            };
            let is_told = if self.are_darks_clipped { self.is_response_free } else { self.knows_black(flat) };
            is_told.then_some(Point { x: photons.value, y, weight })
        })
    }

    /// The line of the response, through none at no light where black is known.
    pub(super) fn response_line(&self) -> Option<Line> {
        if self.is_response_free {
            Line::through(self.response_points().collect::<Vec<_>>())
        } else {
            Line::through_zero(self.response_points())
        }
    }
}
