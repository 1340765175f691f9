//! Variances of the photosites around a pixel, by its place where the flat field that divided them was lit unevenly.
//!
//! Where a share g of the mean light fell on the flat field, samples y were codes x = g y above black, and F = g ⟨F⟩: the variance of
//! y is 1/g² of that of codes x divided by a flat field of such light on a scale of its own. At a level of codes that changes with g by the
//! noise of the flat field alone, which goes as 1/g, as that of its shot noise does: a straight line between the variances at the least and
//! the greatest share.

use super::level_variance::LevelVariance;
use super::masters::Flat;
use super::photosite::Photosite;
use super::unpredictable::Predicted;
use crate::frame::Geometry;
use crate::metadata::{AverageRecord, Illumination};

/// Variances of photosites at any place and level.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PixelVariances {
    /// Of R, G and B, where the flat field is as bright as anywhere; there is none, or an even one, for the most part.
    brightest: [LevelVariance; 3],
    uneven: Option<Uneven>,
}

/// Light that is not the same everywhere.
#[derive(Debug, Clone, PartialEq)]
struct Uneven {
    illumination: Illumination,
    origin: [i32; 2],
    /// The inverse of the greatest share of light, and of the least.
    inverses: [f64; 2],
    darkest: [LevelVariance; 3],
}

impl PixelVariances {
    /// Those of such photosites, of a frame or an average of them, up to a level; flat fields were lit in such a way, or evenly.
    pub fn of(
        photosite: &Photosite,
        average: Option<&AverageRecord>,
        largest: f64,
        light: Option<(&Illumination, &Geometry)>,
    ) -> Self {
        let lit = |share| LevelVariance::of_classes(&photosite.flattened_by(share), average, largest);
        let Some((illumination, geometry)) = light else { return Self { brightest: lit(1.0), uneven: None } };
        let [least, most] = illumination.ends();
        let uneven = Uneven {
            illumination: illumination.clone(),
            origin: geometry.origin,
            inverses: [most, least].map(f64::recip),
            darkest: lit(least),
        };
        Self { brightest: lit(most), uneven: Some(uneven) }
    }

    /// The share of light at a pixel of the frame.
    pub fn share(&self, place: [usize; 2]) -> f64 {
        let Some(uneven) = &self.uneven else { return 1.0 };
        let on_sensor =
            |axis: usize| uneven.origin[axis].saturating_add(i32::try_from(place[axis]).unwrap_or(i32::MAX));
        uneven.illumination.at([on_sensor(0), on_sensor(1)])
    }

    /// The variances of R, G and B at such levels of codes above black, where such a share of light fell on the flat field, and whether they
    /// are known.
    pub fn at(&self, level: [f64; 3], share: f64) -> ([f64; 3], bool) {
        let mut are_told = true;
        let mut look_up = |variances: &[LevelVariance; 3], class: usize| {
            let (variance, is_told) = variances[class].told_at(level[class]);
            are_told &= is_told;
            variance
        };
        let variances = std::array::from_fn(|class| {
            let brightest = look_up(&self.brightest, class);
            let Some(Uneven { inverses: [from, to], darkest, .. }) = &self.uneven else { return brightest };
            let part = if to > from { (share.recip() - from) / (to - from) } else { 0.0 };
            brightest + part * (look_up(darkest, class) - brightest)
        });
        (variances, are_told)
    }
}

impl Photosite {
    /// The same, divided where the flat field had such a share of its light.
    fn flattened_by(&self, share: f64) -> Self {
        let flat = self.flat.map(|flat| Flat { expected_e: flat.expected_e.map(|light_e| share * light_e), ..flat });
        Self { flat, ..*self }
    }

    /// As [`Self::check_flat`], where light is as little as anywhere.
    pub(super) fn check_flat_in(&self, light: Option<&Illumination>) -> Predicted<()> {
        self.flattened_by(light.map_or(1.0, |light| light.ends()[0])).check_flat()
    }
}
