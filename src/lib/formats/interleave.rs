//! Rows of planes as rows of pixels.

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
    let unfit: u32 =
        samples.iter().map(|sample| u32::from(!(0..=i32::from(u16::MAX)).contains(&rounded(sample * scale)))).sum();
    interleave(samples, row, channels, |sample| {
        let fitting = rounded(sample * scale).clamp(0, i32::from(u16::MAX));
        let [low, high, ..] = fitting.to_le_bytes();
        order([low, high])
    });
    unfit.into()
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
