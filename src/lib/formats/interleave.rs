//! Rows of planes as rows of pixels.

use crate::numerics::vectors::{self, Kernel};

/// Interleaves the channels of a row.
pub(super) fn interleave<const BYTES: usize>(
    samples: &[f32],
    row: &mut [u8],
    channels: usize,
    bytes: impl Fn(f32) -> [u8; BYTES] + Copy,
) {
    match channels {
        1 => interleave_known::<1, BYTES>(samples, row, bytes),
        3 => interleave_known::<3, BYTES>(samples, row, bytes),
        4 => interleave_known::<4, BYTES>(samples, row, bytes),
        _ => {
            let (places, _) = row.as_chunks_mut::<BYTES>();
            for (channel, line) in samples.chunks_exact(samples.len() / channels).enumerate() {
                for (place, sample) in places[channel..].iter_mut().step_by(channels).zip(line) {
                    *place = bytes(*sample);
                }
            }
        }
    }
}

/// Interleaves a number of channels that the compiler knows.
fn interleave_known<const CHANNELS: usize, const BYTES: usize>(
    samples: &[f32],
    row: &mut [u8],
    bytes: impl Fn(f32) -> [u8; BYTES],
) {
    let (places, _) = row.as_chunks_mut::<BYTES>();
    let (pixels, _) = places.as_chunks_mut::<CHANNELS>();
    for (channel, line) in samples.chunks_exact(pixels.len()).enumerate() {
        for (pixel, sample) in pixels.iter_mut().zip(line) {
            pixel[channel] = bytes(*sample);
        }
    }
}

/// Interleaves a row as 16-bit integers, of whose low and high byte `order` makes what is stored, and counts the samples that do
/// not fit.
pub(super) fn interleave_u16(
    samples: &[f32],
    row: &mut [u8],
    channels: usize,
    scale: f32,
    order: impl Fn([u8; 2]) -> [u8; 2] + Copy,
) -> u64 {
    if channels == 1 {
        let mut unfit = 0_u32;
        for (place, sample) in row.as_chunks_mut::<2>().0.iter_mut().zip(samples) {
            let whole = rounded(sample * scale);
            let fitting = whole.clamp(0, i32::from(u16::MAX));
            unfit += u32::from(fitting != whole);
            let [low, high, ..] = fitting.to_le_bytes();
            *place = order([low, high]);
        }
        return unfit.into();
    }
    let unfit: u32 =
        samples.iter().map(|sample| u32::from(!(0..=i32::from(u16::MAX)).contains(&rounded(sample * scale)))).sum();
    interleave(samples, row, channels, |sample| order(nearest_u16(sample * scale).to_le_bytes()));
    unfit.into()
}

/// The first of some samples that is finite and no whole number.
pub(super) fn between_codes(samples: &[f32]) -> Option<f32> {
    vectors::run(AnyBetween(samples)).then(|| samples.iter().copied().find(|sample| is_between(*sample)))?
}

/// Whether a sample is finite and no whole number. No branches, and no function, so that the loop over samples becomes vectors.
#[inline(always)]
fn is_between(sample: f32) -> bool {
    // Between 2²³ and 2²⁴ are whole numbers alone, as 1.5·2²³ and a size below 2²² is; larger samples are whole, or beyond all codes.
    const SHIFT: f32 = 12_582_912.0;
    const LARGEST: f32 = 4_194_304.0;
    (sample.abs() < LARGEST) & (sample + SHIFT - SHIFT != sample)
}

/// Whether any of some samples is between whole numbers.
struct AnyBetween<'a>(&'a [f32]);

impl Kernel for AnyBetween<'_> {
    type Output = bool;

    #[inline(always)]
    fn run(self) -> bool {
        self.0.iter().fold(false, |any, sample| any | is_between(*sample))
    }
}

/// The nearest integer of 16 bits, ties to even; of NaN 0.
pub(super) fn nearest_u16(value: f32) -> u16 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it lies between the ends")]
    let nearest = rounded(value).clamp(0, i32::from(u16::MAX)) as u16;
    nearest
}

/// The nearest integer, ties to even, for values from −1 to 65536; what is beyond becomes the nearer of these, and NaN
/// becomes −1.
fn rounded(value: f32) -> i32 {
    // 1.5·2²³: at this size a float's last bit is worth 1, so adding it rounds, and the integer stands in the lowest
    // bits. The compiler makes vectors of this, unlike of `round_ties_even`.
    const SHIFT: f32 = 12_582_912.0;
    #[expect(clippy::manual_clamp, reason = "`clamp` lets NaN pass, and here it must not")]
    let shifted = value.max(-1.0).min(65536.0) + SHIFT;
    shifted.to_bits().wrapping_sub(SHIFT.to_bits()).cast_signed()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_between_codes_are_found() {
        let whole = [0.0, -0.0, 1.0, -7.0, 65_535.0, 4_194_303.0, 8e9, f32::NAN, f32::INFINITY, f32::NEG_INFINITY];
        assert_eq!(between_codes(&whole.repeat(9)), None);
        for between in [0.5, -0.5, 1e-30, 65_535.5, 2_097_151.5, -1.25] {
            for place in [0, 7, 40, 89] {
                let mut samples = whole.repeat(9);
                samples[place] = between;
                assert_eq!(between_codes(&samples), Some(between), "{place}");
            }
        }
    }

    /// Ties to even, ends beyond the ends, 0 of NaN; the same and as many that do not fit of one channel as of three.
    #[test]
    fn samples_become_the_nearest_integers() {
        let values = [
            -1e9,
            -0.75,
            -0.5,
            -0.0,
            0.5,
            1.5,
            2.5,
            70.499,
            65_534.5,
            65_535.4,
            65_535.5,
            1e9,
            f32::INFINITY,
            f32::NAN,
            -3.0,
        ];
        let nearest = values.map(nearest_u16);
        let expected = values.map(|value| value.round_ties_even().clamp(0.0, 65_535.0));
        for ((value, nearest), expected) in values.iter().zip(nearest).zip(expected) {
            assert_eq!(f32::from(nearest), if value.is_nan() { 0.0 } else { expected }, "{value}");
        }
        let stored = |channels: usize| {
            let mut row = vec![0; 2 * values.len()];
            let unfit = interleave_u16(&values, &mut row, channels, 1.0, |bytes| bytes);
            let mut codes: Vec<u16> = row.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]])).collect();
            codes.sort_unstable();
            (codes, unfit)
        };
        let mut sorted = nearest.to_vec();
        sorted.sort_unstable();
        assert_eq!(stored(1), (sorted, 7));
        assert_eq!(stored(3), stored(1));
    }
}
