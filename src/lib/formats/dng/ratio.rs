//! Ratios of whole numbers near a real one.

/// The ratio of two numbers up to `most` that is nearest among the convergents of the continued fraction of `value`: the value
/// itself where such a ratio rounds to it, else off by no more than max(1, value) / `most`. What is larger than `most`, is
/// that; NaN and what is below zero, 0.
fn nearest(value: f64, most: u32) -> [u32; 2] {
    let limit = f64::from(most);
    if value.is_nan() || value <= 0.0 {
        return [0, 1];
    }
    if value >= limit {
        return [most, 1];
    }
    let ([mut before, mut last], mut rest) = ([[0.0, 1.0], [1.0, 0.0]], value);
    loop {
        let whole = rest.floor();
        let next = [whole * last[0] + before[0], whole * last[1] + before[1]];
        if !(next[0] <= limit && next[1] <= limit) {
            break;
        }
        (before, last) = (last, next);
        if last[0] / last[1] == value || rest == whole {
            break;
        }
        rest = 1.0 / (rest - whole);
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "whole and at most `most`")]
    last.map(|part| part as u32)
}

/// RATIONAL of a number that is not below zero.
pub(super) fn ratio(value: f64) -> [u32; 2] {
    nearest(value, u32::MAX)
}

/// SRATIONAL of a number.
pub(super) fn signed(value: f64) -> [i32; 2] {
    let [above, below] = nearest(value.abs(), i32::MAX.cast_unsigned()).map(u32::cast_signed);
    [if value < 0.0 { -above } else { above }, below]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimal_and_binary_fractions_come_out_as_they_were_meant() {
        for (value, expected) in [
            (1757.25, [7029, 4]),
            (0.033, [33, 1000]),
            (8.0, [8, 1]),
            (0.1, [1, 10]),
            (1.0 / 3.0, [1, 3]),
            (0.0, [0, 1]),
            (-1.0, [0, 1]),
            (f64::NAN, [0, 1]),
            (1e12, [u32::MAX, 1]),
            (1e-12, [0, 1]),
        ] {
            assert_eq!(ratio(value), expected, "{value}");
        }
        assert_eq!([signed(-10.5), signed(0.25), signed(-1e12)], [[-21, 2], [1, 4], [-i32::MAX, 1]]);
    }

    #[test]
    fn others_are_near() {
        for i in 1..2000 {
            let value = f64::from(i).powf(1.7).sqrt() * 0.3;
            let [above, below] = ratio(value).map(f64::from);
            assert!((above / below - value).abs() <= value.max(1.0) / f64::from(u32::MAX), "{value}");
        }
    }
}
