//! The noise of a camera's codes as its raw files tell it, and what of the read-out follows.

/// Variance over the signal x from 0 at black to 1 at white, S x + O, of each class \[DNG2023, NoiseProfile].
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseProfile {
    /// S and O, in the order of the classes; of all classes where it is one pair.
    pub lines: Vec<[f64; 2]>,
}

/// What follows of a class, where the slope is shot noise alone: variance s K + σ² of a signal of s ADU above black.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClassReadOut {
    /// K = S · D, of D ADU from black to white.
    pub adu_per_e: f64,
    /// σ = √O · D at black: read noise, with all that is there without light.
    pub noise_at_black_adu: f64,
    /// σ / K = √O / S.
    pub noise_at_black_e: f64,
    /// D / K = 1/S: the charge that reads white. Full well may be more.
    pub saturation_e: f64,
}

impl NoiseProfile {
    /// What follows of the class of a number, where codes have so many ADU from black to white; none where the profile has no
    /// such class, or no signal would be told from its noise.
    pub fn read_out(&self, class: usize, range_adu: f64) -> Option<ClassReadOut> {
        let line = if self.lines.len() == 1 { self.lines.first() } else { self.lines.get(class) };
        let [slope, offset] = *line?;
        let adu_per_e = slope * range_adu;
        let noise_at_black_adu = offset.max(0.0).sqrt() * range_adu;
        let read_out = ClassReadOut {
            adu_per_e,
            noise_at_black_adu,
            noise_at_black_e: noise_at_black_adu / adu_per_e,
            saturation_e: 1.0 / slope,
        };
        let is_told = slope > 0.0 && adu_per_e > 0.0 && read_out.saturation_e.is_finite();
        (is_told && read_out.noise_at_black_e.is_finite()).then_some(read_out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A camera of 0.25 ADU per electron and 8 electrons of read noise, whose codes have 4000 ADU from black to white.
    #[test]
    fn a_camera_comes_back_from_its_profile() {
        let (gain, noise_e, range) = (0.25_f64, 8.0, 4000.0);
        let line = [gain / range, (gain * noise_e / range).powi(2)];
        let profile = NoiseProfile { lines: vec![line] };
        let found = profile.read_out(2, range).unwrap();
        let expected = [gain, gain * noise_e, noise_e, range / gain];
        let values = [found.adu_per_e, found.noise_at_black_adu, found.noise_at_black_e, found.saturation_e];
        assert!(
            values.iter().zip(expected).all(|(value, expected)| (value / expected - 1.0).abs() < 1e-12),
            "{values:?}"
        );
        let two = NoiseProfile { lines: vec![line, [0.0, 1e-6], [f64::NAN, 0.0], [1e-320, 0.0]] };
        assert_eq!(two.read_out(0, range), Some(found));
        // No shot noise, no number, next to nothing, no class.
        assert!((1..5).all(|class| two.read_out(class, range).is_none()));
    }
}
