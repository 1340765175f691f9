//! How much of a code what is a photosite's own spreads over, which hides how codes are rounded from what is shared.

use super::counts::Charge;
use super::law::Law;
use crate::metadata::AdcRecord;
use crate::numerics::normal::cumulative;
use crate::stages::noise::NoiseModel;
use std::f64::consts::TAU;

/// What of a photosite's own spread blurs codes, e⁻: shot noise counts as far as whole electrons are no whole codes.
pub(super) fn blur_e(model: &NoiseModel, adc: &AdcRecord, expected_e: f64) -> f64 {
    /// ADU per electron up to which codes take several electrons.
    const FEW: f64 = 0.2;
    let law = Law::of(model, expected_e);
    let counts = if model.signal_shot { expected_e } else { 0.0 } + if model.dark_shot { model.dark_e } else { 0.0 };
    let own = law.read_noise_e.hypot(law.least_pattern_std());
    if adc.adu_per_e > FEW {
        return own.max(law.blur_by_turns_e(adc));
    }
    let shot = 2.0 * counts * (1.0 - (TAU * adc.adu_per_e).cos()) / (TAU * adc.adu_per_e).powi(2);
    own.hypot(shot.sqrt())
}

/// Whether what is a photosite's own blurs codes as much as a normal law of `least` codes.
///
/// A share p of photosites has no sensitivity to light, or to dark current, and less blurs these: what they leave of a ripple counts by
/// p, of its square by p², so that σ² may be less by −ln p/2π².
pub(super) fn is_blurred(own: &NoiseModel, law: &Law, adc: &AdcRecord, expected_e: f64, least: f64) -> bool {
    let blurs = |model: &NoiseModel, expected_e: f64, least_square: f64| {
        (adc.adu_per_e * blur_e(model, adc, expected_e)).powi(2) >= least_square
    };
    let square = least * least;
    let bare = |charge: &Charge| {
        // Those of next to no sensitivity are as many again.
        let share = (2.0 * cumulative(-1.0 / charge.pattern)).min(1.0);
        charge.is_rectified(law.full_well_e).then(|| square + share.ln() / (0.5 * TAU.powi(2)))
    };
    let without_dark = NoiseModel { dark_e: 0.0, ..*own };
    blurs(own, expected_e, square)
        && bare(&law.dark).is_none_or(|square| blurs(&without_dark, expected_e, square))
        && bare(&law.light).is_none_or(|square| blurs(own, 0.0, square))
}
