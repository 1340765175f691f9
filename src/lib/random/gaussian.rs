//! Normal numbers by inverse transform: the quantile Φ⁻¹(u) of a uniform number of 64 bits.
//!
//! The number that a 64-bit word w stands for is u = (w + ½)/2⁶⁴; its quantile lies within ±9.2. A word and its
//! complement give quantiles of opposite sign, to the bit. In the body of the distribution (|z| < 3.6) the upper half
//! of the word decides, in single precision; in the tails all 64 bits do, in double precision. There the quantile is
//! taken with AS 241 \[Wichura1988], whose relative error is below 10⁻¹⁵.
//!
//! Error of the body: |ẑ − Φ⁻¹(u)| < 10⁻⁶, a fifth of it from what the lower half of the word would add at its rim.

#![expect(clippy::excessive_precision, reason = "coefficients have the digits that they were published or found with")]

use super::philox::VECTOR;

/// Upper halves of words whose tail is at least this many 2⁻³² belong to the body: 1.38·10⁻⁴, |z| ≤ 3.63.
const BODY: u32 = 593_960;

/// z/x over ζ = −ln(1 − x²), x = 2u − 1, about ζ = 3.75: minimax of degree 10 over 0 to 7.5. With these coefficients,
/// which are rounded to single precision, the relative error is 1.1·10⁻⁷.
const QUANTILE: [f32; 11] = [
    2.547_342_1,
    0.327_983_02,
    -0.009_929_239,
    -0.000_470_005_56,
    0.000_196_041_35,
    -2.280_209_8e-5,
    1.585_234_8e-7,
    3.863_860_9e-7,
    -5.077_489_7e-8,
    -1.867_774_8e-9,
    6.832_489e-10,
];

/// (ln(1 + f) − f)/f² for f from √½ − 1 to √2 − 1: minimax of degree 6, with these coefficients an absolute error of the
/// logarithm of 4·10⁻⁸.
const LOGARITHM: [f32; 7] =
    [-0.500_005_84, 0.333_352_6, -0.249_614_65, 0.198_882_78, -0.173_259_98, 0.163_356_4, -0.100_346_13];

/// Natural logarithm of a normal number above 0, absolute error below 10⁻⁷ (1 + |ln y|).
#[inline(always)]
fn logarithm(y: f32) -> f32 {
    const SQRT_HALF: u32 = 0x3f35_04f3;
    let bits = y.to_bits().wrapping_sub(SQRT_HALF);
    let exponent = (bits.cast_signed() >> 23) as f32;
    let f = f32::from_bits((bits & 0x007f_ffff).wrapping_add(SQRT_HALF)) - 1.0;
    // Sums of pairs rather than one after another: they do not wait for each other.
    let [c0, c1, c2, c3, c4, c5, c6] = LOGARITHM;
    let square = f * f;
    let low = (c0 + c1 * f) + (c2 + c3 * f) * square;
    let high = (c4 + c5 * f) + c6 * square;
    let sum = low + high * (square * square);
    // ln 2 in two parts, so that the product with the exponent is exact.
    exponent * 0.693_359_4 + ((exponent * -2.121_944_4e-4 + f) + square * sum)
}

/// Distance of a word's upper half from the nearer end of its range.
#[inline(always)]
fn tail(high: u32) -> u32 {
    high ^ (high.cast_signed() >> 31).cast_unsigned()
}

/// Whether the upper half of a word leaves its quantile to [`quantile`].
#[inline(always)]
pub(super) fn is_in_tail(high: u32) -> bool {
    tail(high) < BODY
}

/// Quantile by the upper half of a word, in the body.
#[cfg(test)]
pub(super) fn body(high: u32) -> f32 {
    from_zeta(zeta(high), high)
}

/// ζ of the upper half of a word, less 3.75.
#[inline(always)]
fn zeta(high: u32) -> f32 {
    // Below 2³¹, it converts as a signed number, which every set of instructions can.
    let share = tail(high).cast_signed() as f32 + 0.5;
    let y = share * TWO_TO_MINUS_30 * (1.0 - share * (0.25 * TWO_TO_MINUS_30));
    -logarithm(y) - 3.75
}

/// The quantile by ζ.
#[inline(always)]
fn from_zeta(zeta: f32, high: u32) -> f32 {
    let from_median = (0x7fff_ffff - tail(high)).cast_signed() as f32 + 0.5;
    let [c0, c1, c2, c3, c4, c5, c6, c7, c8, c9, c10] = QUANTILE;
    let square = zeta * zeta;
    let fourth = square * square;
    let low = (c0 + c1 * zeta) + (c2 + c3 * zeta) * square;
    let middle = (c4 + c5 * zeta) + (c6 + c7 * zeta) * square;
    let last = (c8 + c9 * zeta) + c10 * square;
    let sum = low + fourth * (middle + last * fourth);
    let size = from_median * (0.5 * TWO_TO_MINUS_30) * sum;
    f32::from_bits(size.to_bits() | (!high & 0x8000_0000))
}

/// Quantiles by the upper halves of words, in the body.
#[inline(always)]
pub(super) fn bodies(normals: &mut [f32], high: &[u32]) {
    // In two loops, so that each keeps its coefficients in registers.
    for (normal, &high) in normals.iter_mut().zip(high) {
        *normal = zeta(high);
    }
    for (normal, &high) in normals.iter_mut().zip(high) {
        *normal = from_zeta(*normal, high);
    }
}

const TWO_TO_MINUS_30: f32 = 1.0 / 1_073_741_824.0;

/// The share of the normal law beyond a word, on the nearer side, and whether that side is the lower one.
pub(super) fn share(word: u64) -> (f64, bool) {
    let tail = word ^ (word.cast_signed() >> 63).cast_unsigned();
    // 2⁻⁶⁴, exactly.
    ((tail as f64 + 0.5) * f64::from_bits(0x3bf0_0000_0000_0000), word >> 63 == 0)
}

/// Quantile of the standard normal distribution at a word, in double precision.
///
/// # Examples
///
/// ```
/// use cyanometer::random::gaussian::quantile;
///
/// // A word is a place among 2⁶⁴; Φ(1.959964) = 0.975.
/// let word = (0.975 * 2f64.powi(64)) as u64;
/// assert!((quantile(word) - 1.959964).abs() < 1e-6);
/// ```
pub fn quantile(word: u64) -> f64 {
    let (share, is_lower) = share(word);
    let size = upper_quantile(share);
    if is_lower { -size } else { size }
}

/// Φ⁻¹(1 − `share`) for a share of at most ½: AS 241 (PPND16) \[Wichura1988].
fn upper_quantile(share: f64) -> f64 {
    let ratio = |r: f64, numerator: &[f64; 8], denominator: &[f64; 8]| {
        let sum = |coefficients: &[f64; 8]| coefficients.iter().rev().fold(0.0, |sum, c| sum * r + c);
        sum(numerator) / sum(denominator)
    };
    let q = 0.5 - share;
    if q <= 0.425 {
        return q * ratio(0.180_625 - q * q, &CENTER.0, &CENTER.1);
    }
    let r = (-libm::log(share)).sqrt();
    if r <= 5.0 { ratio(r - 1.6, &MIDDLE.0, &MIDDLE.1) } else { ratio(r - 5.0, &FAR.0, &FAR.1) }
}

/// Numerator and denominator of a rational approximation.
type Rational = ([f64; 8], [f64; 8]);

const CENTER: Rational = (
    [
        3.387_132_872_796_366_608,
        1.331_416_678_917_843_774_5e2,
        1.971_590_950_306_551_442_7e3,
        1.373_169_376_550_946_112_5e4,
        4.592_195_393_154_987_145_7e4,
        6.726_577_092_700_870_085_3e4,
        3.343_057_558_358_812_810_5e4,
        2.509_080_928_730_122_672_7e3,
    ],
    [
        1.0,
        4.231_333_070_160_091_125_2e1,
        6.871_870_074_920_579_083e2,
        5.394_196_021_424_751_107_7e3,
        2.121_379_430_158_659_586_7e4,
        3.930_789_580_009_271_061e4,
        2.872_908_573_572_194_267_4e4,
        5.226_495_278_852_854_561e3,
    ],
);
const MIDDLE: Rational = (
    [
        1.423_437_110_749_683_577_34,
        4.630_337_846_156_545_295_9,
        5.769_497_221_460_691_405_5,
        3.647_848_324_763_204_605_04,
        1.270_458_252_452_368_382_58,
        2.417_807_251_774_506_117_7e-1,
        2.272_384_498_926_918_458_33e-2,
        7.745_450_142_783_414_076_4e-4,
    ],
    [
        1.0,
        2.053_191_626_637_758_821_87,
        1.676_384_830_183_803_849_4,
        6.897_673_349_851_000_045_5e-1,
        1.481_039_764_274_800_745_9e-1,
        1.519_866_656_361_645_719_66e-2,
        5.475_938_084_995_344_946e-4,
        1.050_750_071_644_416_843_24e-9,
    ],
);
const FAR: Rational = (
    [
        6.657_904_643_501_103_777_2,
        5.463_784_911_164_114_369_9,
        1.784_826_539_917_291_335_8,
        2.965_605_718_285_048_912_3e-1,
        2.653_218_952_657_612_309_3e-2,
        1.242_660_947_388_078_438_6e-3,
        2.711_555_568_743_487_578_15e-5,
        2.010_334_399_292_288_132_65e-7,
    ],
    [
        1.0,
        5.998_322_065_558_879_376_9e-1,
        1.369_298_809_227_358_053_1e-1,
        1.487_536_129_085_061_485_25e-2,
        7.868_691_311_456_132_591e-4,
        1.846_318_317_510_054_681_8e-5,
        1.421_511_758_316_445_888_7e-7,
        2.044_263_103_389_939_785_64e-15,
    ],
);

/// Fills a run with normal numbers; `low` gives the lower half of the word of a photosite. Lengths are multiples of
/// [`VECTOR`].
#[inline(always)]
pub(super) fn fill(normals: &mut [f32], high: &[u32], low: impl Fn(usize) -> u32) {
    bodies(normals, high);
    let (normals, high) = (normals.as_chunks_mut::<VECTOR>().0, high.as_chunks::<VECTOR>().0);
    for (first, (normals, high)) in normals.iter_mut().zip(high).enumerate() {
        if high.iter().fold(false, |any, &high| any | is_in_tail(high)) {
            for (lane, (normal, &high)) in normals.iter_mut().zip(high).enumerate() {
                if is_in_tail(high) {
                    *normal = of_tail(high, low(first * VECTOR + lane));
                }
            }
        }
    }
}

#[cold]
#[inline(never)]
fn of_tail(high: u32, low: u32) -> f32 {
    crate::frame::to_sample(quantile(u64::from(high) << 32 | u64::from(low)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_agree_with_an_independent_computation() {
        let table = include_str!("../../../tests/reference/normal_quantiles.csv");
        for row in table.lines().filter(|line| !line.starts_with('#')).skip(1) {
            let (word, expected) = row.split_once(',').unwrap();
            let word = u64::from_str_radix(word.trim_start_matches("0x"), 16).unwrap();
            let expected: f64 = expected.parse().unwrap();
            // AS 241 promises 10⁻¹⁶; its sums round a few times, and near the median ½ − u is known to 2⁻⁵⁴.
            let bound = 2e-15 * expected.abs() + 3e-16;
            assert!((quantile(word) - expected).abs() < bound, "{word:#x} {}", quantile(word));
        }
    }

    /// Coefficients as they are stored, their sum taken in double precision.
    fn sum(coefficients: &[f32], x: f64) -> f64 {
        coefficients.iter().rev().fold(0.0, |sum, &coefficient| sum * x + f64::from(coefficient))
    }

    /// The errors that the tables' docs give, which evaluation in single precision comes on top of.
    #[test]
    fn polynomials_are_as_near_as_said() {
        let mut quotient = 0.0_f64;
        for step in 1..=75_000 {
            let zeta = f64::from(step) * 1e-4;
            // 1 − x² = exp(−ζ), and the share beyond is (1 − x)/2.
            let x = (-libm::expm1(-zeta)).sqrt();
            let share = 0.5 * libm::exp(-zeta) / (1.0 + x);
            quotient = quotient.max((x * sum(&QUANTILE, zeta - 3.75) / upper_quantile(share) - 1.0).abs());
        }
        assert!((1.05e-7..1.15e-7).contains(&quotient), "{quotient:e}");
        let (first, last) = (std::f64::consts::FRAC_1_SQRT_2 - 1.0, std::f64::consts::SQRT_2 - 1.0);
        let mut logarithm = 0.0_f64;
        for step in 0..=100_000 {
            let f = first + (last - first) * f64::from(step) * 1e-5;
            logarithm = logarithm.max((f + f * f * sum(&LOGARITHM, f) - libm::log1p(f)).abs());
        }
        assert!((3.5e-8..4.5e-8).contains(&logarithm), "{logarithm:e}");
    }

    /// Every 4099th upper half, 2²⁰ of them, evenly over the range and all over each binade: both ends of the words that
    /// have it, which are farthest from its quantile.
    #[test]
    fn the_body_follows_the_quantile() {
        let (mut error, mut added) = (0.0_f64, 0.0_f64);
        for high in (0..=u32::MAX).step_by(4099).filter(|&high| !is_in_tail(high)) {
            let [first, last] = [0, u32::MAX].map(|low| quantile(u64::from(high) << 32 | u64::from(low)));
            let normal = f64::from(body(high));
            error = error.max((normal - first).abs()).max((normal - last).abs());
            added = added.max(0.5 * (last - first));
            assert_eq!(body(!high), -body(high));
        }
        assert!(error < 1e-6, "{error:e}");
        // A fifth of it.
        assert!((1.5e-7..2.5e-7).contains(&added), "{added:e}");
    }

    /// The body begins where its logarithm's range ends, and the tails are as rare as they should be.
    #[test]
    fn words_beyond_the_body_are_left_to_the_tails() {
        assert!(is_in_tail(0) && is_in_tail(u32::MAX) && is_in_tail(BODY - 1) && is_in_tail(!(BODY - 1)));
        assert!(!is_in_tail(BODY) && !is_in_tail(!BODY));
        assert!((body(!BODY) - 3.6363).abs() < 1e-3, "{}", body(!BODY));
    }
}
