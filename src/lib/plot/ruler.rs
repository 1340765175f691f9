//! Rulers: from values to places along an axis, and the ticks between.

use super::figure::{Axis, Scale};

/// Values of a larger magnitude are not shown, and differences smaller than its inverse are none: arithmetic with them
/// would overflow.
const LARGEST: f64 = 1e100;

/// An axis whose range is settled.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ruler {
    scale: Scale,
    /// The ends: values, or their decimal logarithms.
    low: f64,
    high: f64,
}

/// A mark on an axis.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tick {
    /// The place, from 0 at the low end to 1 at the high one.
    pub place: f64,
    /// What stands beside it; minor ticks have nothing.
    pub label: Option<String>,
}

impl Ruler {
    /// Settles the range: as given, or from `values` with some room.
    pub fn new(axis: &Axis, values: impl Iterator<Item = f64>) -> Self {
        let scale = axis.scale;
        let given = axis.range.and_then(|(low, high)| Some((position(scale, low)?, position(scale, high)?)));
        if let Some((low, high)) = given.filter(|(low, high)| is_wide(*low, *high)) {
            return Self { scale, low, high };
        }
        let places = values.filter_map(|value| position(scale, value));
        let (low, high) =
            places.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (f64::min(low, v), f64::max(high, v)));
        let (low, high) = if low > high {
            (0.0, 1.0)
        } else if is_wide(low, high) {
            let room = 0.05 * (high - low);
            // The inverse of what is positive stays so.
            let highest = if scale == Scale::Reciprocal { 0.5 * high } else { f64::INFINITY };
            (low - room, (high + room).min(highest))
        } else {
            let room = match scale {
                Scale::Log10 => 0.5,
                Scale::Reciprocal => 0.1 * low.abs(),
                Scale::Linear if low.abs() < 1.0 / LARGEST => 1.0,
                Scale::Linear => 0.1 * low.abs(),
            };
            (low - room, high + room)
        };
        Self { scale, low, high }
    }

    /// From the low end to the high one: the difference of values, or of their decimal logarithms.
    pub fn span(&self) -> f64 {
        self.high - self.low
    }

    /// The values at both ends.
    pub fn ends(&self) -> [f64; 2] {
        [self.low, self.high].map(|place| match self.scale {
            Scale::Linear => place,
            Scale::Log10 => 10_f64.powf(place),
            Scale::Reciprocal => -place.recip(),
        })
    }

    /// Where a value lies: 0 at the low end, 1 at the high one. `None` for what the axis cannot show.
    pub fn place(&self, value: f64) -> Option<f64> {
        Some((position(self.scale, value)? - self.low) / (self.high - self.low))
    }

    /// The same for the end of a range, which stops at the ends of the axis. `None` only for NaN.
    pub fn place_within(&self, value: f64) -> Option<f64> {
        let at = match self.scale {
            _ if value.is_nan() => return None,
            Scale::Log10 if value <= 0.0 => f64::NEG_INFINITY,
            Scale::Log10 => value.log10(),
            Scale::Reciprocal if value <= 0.0 => f64::NEG_INFINITY,
            Scale::Reciprocal => -value.recip(),
            Scale::Linear => value,
        };
        Some(((at.clamp(self.low, self.high) - self.low) / (self.high - self.low)).clamp(0.0, 1.0))
    }

    /// Ticks, of which at most about `count` have labels.
    pub fn ticks(&self, count: f64) -> Vec<Tick> {
        match self.scale {
            Scale::Linear => {
                let values = round_values(self.low, self.high, count);
                let labels = plain_labels(&values);
                let tick = |(value, label): (&f64, String)| self.tick(*value, Some(label));
                values.iter().zip(labels).filter_map(tick).collect()
            }
            Scale::Log10 => self.log_ticks(count),
            Scale::Reciprocal => self.reciprocal_ticks(count, None),
        }
    }

    /// The same between both ends, each of which is a tick with as many digits as tell them apart; others stand at least so far `apart`
    /// from them.
    pub fn ticks_between_ends(&self, count: f64, apart: f64) -> Vec<Tick> {
        let [from, to] = self.ends();
        let labels = end_labels(from, to, self.scale != Scale::Linear);
        let mut ticks = match self.scale {
            Scale::Reciprocal => self.reciprocal_ticks(count, Some(apart)),
            Scale::Linear | Scale::Log10 => self.ticks(count),
        };
        for (place, label) in [0.0, 1.0].into_iter().zip(labels) {
            // A round number at the end is written as those beside it.
            let same = ticks.iter().any(|tick| tick.label.is_some() && (tick.place - place).abs() < 1e-6);
            if !same {
                ticks.retain(|tick| (tick.place - place).abs() >= apart);
                ticks.push(Tick { place, label: Some(label) });
            }
        }
        ticks.sort_by(|a, b| a.place.total_cmp(&b.place));
        ticks
    }

    fn tick(&self, value: f64, label: Option<String>) -> Option<Tick> {
        // Room for rounding: an end of the range is a tick.
        let place = self.place(value).filter(|place| (-1e-9..=1.0 + 1e-9).contains(place))?;
        Some(Tick { place: place.clamp(0.0, 1.0), label })
    }

    /// Decades with the numbers between them; on short axes the numbers between have labels too.
    fn log_ticks(&self, count: f64) -> Vec<Tick> {
        #[expect(clippy::cast_possible_truncation, reason = "logarithms of doubles are within ±324")]
        let (first, last) = ((self.low - 1e-9).floor() as i32, (self.high + 1e-9).ceil() as i32);
        let span = self.high - self.low;
        if span < 0.7 {
            let values = round_values(10_f64.powf(self.low), 10_f64.powf(self.high), count);
            let labels = plain_labels(&values);
            return values.iter().zip(labels).filter_map(|(value, label)| self.tick(*value, Some(label))).collect();
        }
        #[expect(clippy::cast_possible_truncation, reason = "at most 200 decades")]
        let stride = (span / count.max(1.0)).ceil().max(1.0) as i32;
        // All numbers of an axis are written alike.
        let is_plain = (self.low - 1e-9).ceil() >= PLAIN.0 && (self.high + 1e-9).floor() <= PLAIN.1;
        let style = if is_plain { plain_decade } else { decade_label };
        let mut ticks = Vec::new();
        for decade in first..=last {
            if stride > 1 {
                let label = (decade.rem_euclid(stride) == 0).then(|| style(1, decade));
                ticks.extend(self.tick(10_f64.powi(decade), label));
                continue;
            }
            for digit in 1..=9 {
                let labeled = digit == 1 || (span < 2.0 && (digit == 2 || digit == 5));
                let label = labeled.then(|| style(digit, decade));
                ticks.extend(self.tick(f64::from(digit) * 10_f64.powi(decade), label));
            }
        }
        ticks
    }

    /// Round numbers, the roundest first, each where it has room beside those before, and so far from the ends.
    fn reciprocal_ticks(&self, count: f64, from_ends: Option<f64>) -> Vec<Tick> {
        const DIGITS: [f64; 9] = [1.0, 2.0, 5.0, 3.0, 4.0, 1.5, 6.0, 8.0, 2.5];
        /// Numbers this much alike are as good as evenly spread.
        const NARROW: f64 = 1.5;
        let [from, to] = [self.low, self.high].map(|place| (-place).max(1.0 / LARGEST).recip());
        if to < NARROW * from {
            let values = round_values(from, to, count);
            let labels = plain_labels(&values);
            return values.iter().zip(labels).filter_map(|(value, label)| self.tick(*value, Some(label))).collect();
        }
        let [lowest, highest] = [from, to].map(f64::log10);
        #[expect(clippy::cast_possible_truncation, reason = "logarithms within ±100")]
        let decades = (lowest - 1e-9).floor() as i32..=(highest + 1e-9).floor() as i32;
        /// On a bar, times the height of a line.
        const LINES: f64 = 1.4;
        let apart = from_ends.map_or(f64::INFINITY, |least| LINES * least).min(count.max(1.0).recip());
        let mut ticks: Vec<Tick> = Vec::new();
        for digit in DIGITS {
            // Quotients by whole powers are the doubles next to what they stand for.
            let of_decade = |decade: i32| match decade {
                0.. => digit * 10_f64.powi(decade),
                _ => digit / 10_f64.powi(-decade),
            };
            for value in decades.clone().map(of_decade) {
                let Some(tick) = self.tick(value, Some(value.to_string())) else { continue };
                let to_end = tick.place.min(1.0 - tick.place);
                // A round number at an end is that end.
                let is_free = from_ends.is_none_or(|least| to_end >= least || to_end < 1e-6);
                if is_free && ticks.iter().all(|other| (other.place - tick.place).abs() >= apart) {
                    ticks.push(tick);
                }
            }
        }
        ticks.sort_by(|a, b| a.place.total_cmp(&b.place));
        ticks
    }
}

/// A value along its scale; `None` for what the scale cannot show.
fn position(scale: Scale, value: f64) -> Option<f64> {
    match scale {
        Scale::Linear => (value.abs() <= LARGEST).then_some(value),
        Scale::Log10 => (1.0 / LARGEST..=LARGEST).contains(&value).then(|| value.log10()),
        Scale::Reciprocal => (1.0 / LARGEST..=LARGEST).contains(&value).then(|| -value.recip()),
    }
}

/// Whether places between the ends can be told apart.
fn is_wide(low: f64, high: f64) -> bool {
    high - low > (1e-9 * low.abs().max(high.abs())).max(1.0 / LARGEST)
}

/// Multiples of 1, 2 or 5 times a power of ten within a range, at most about `count` of them.
fn round_values(low: f64, high: f64, count: f64) -> Vec<f64> {
    let rough = (high - low) / count.max(1.0);
    let power = 10_f64.powf(rough.log10().floor());
    let factor = [1.0, 2.0, 5.0].into_iter().find(|factor| factor * power >= rough * (1.0 - 1e-9)).unwrap_or(10.0);
    let step = factor * power;
    let first = (low / step - 1e-9).ceil();
    // Adding zero makes −0 a 0.
    let values = (0..100).map(|index| (first + f64::from(index)) * step + 0.0);
    values.take_while(|value| *value <= high + 1e-9 * step).collect()
}

/// Whether a number has no digits below that which a step begins with.
fn is_whole(step: f64, number: f64) -> bool {
    if step <= 0.0 || step.is_nan() {
        return true;
    }
    let parts = number / 10_f64.powi(decade_of(step));
    (parts - parts.round()).abs() < 1e-9 * parts
}

/// Labels for equally spaced values, with as many digits as tell them apart.
fn plain_labels(values: &[f64]) -> Vec<String> {
    let largest = values.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()));
    let step = match values {
        [first, second, ..] => second - first,
        // One alone is a multiple of a power of ten too, though not of that it begins with: 2.5·10⁸.
        _ => (0..16).map(|digit| largest / 10_f64.powi(digit)).find(|step| is_whole(*step, largest)).unwrap_or(largest),
    };
    if !(step > 0.0 && largest > 0.0) {
        return values.iter().map(|value| minus(&format!("{value}"))).collect();
    }
    let [magnitude, unit] = [largest, step].map(decade_of);
    values.iter().map(|value| written(*value, magnitude, unit)).collect()
}

/// The power of ten that a number above 0 begins with.
fn decade_of(value: f64) -> i32 {
    #[expect(clippy::cast_possible_truncation, reason = "logarithms of doubles are within ±324")]
    let decade = (value.log10() + 1e-9).floor() as i32;
    decade
}

/// Numbers of more digits than so, up to that power of ten, are plain: 1234570 beside 1234555.3.
const MANY_DIGITS: i32 = 5;
const MOST_PLAIN: i32 = 9;

/// A number in digits down to the power of ten `unit`, beside others up to that of `magnitude`.
fn written(value: f64, magnitude: i32, unit: i32) -> String {
    let digits = |below: i32| usize::try_from(below).unwrap_or(0);
    if value.abs() < 0.5 * 10_f64.powi(unit) {
        "0".into()
    } else if (-3..6).contains(&magnitude) || (6..=MOST_PLAIN).contains(&magnitude) && magnitude - unit >= MANY_DIGITS {
        minus(&format!("{value:.*}", digits(-unit)))
    } else {
        let rounds_up = |mantissa: f64| {
            let places = 10_f64.powi(magnitude - unit);
            (mantissa.abs() * places).round() >= 10.0 * places
        };
        // Of 9.99 too few digits may make 10.
        let magnitude = magnitude + i32::from(rounds_up(value / 10_f64.powi(magnitude)));
        let mantissa = value / 10_f64.powi(magnitude);
        minus(&format!("{mantissa:.*}·{}", digits(magnitude - unit), power_of_ten(magnitude)))
    }
}

/// The ends of a range, to a hundredth of the first digit of their distance; where they are `of_many_sizes`, each also to three digits of
/// its own. Zeros that all have behind the point are left out.
pub fn end_labels(low: f64, high: f64, of_many_sizes: bool) -> [String; 2] {
    let (span, largest) = (high - low, low.abs().max(high.abs()));
    if !(span > 0.0 && span.is_finite()) {
        return [low, high].map(|value| minus(&value.to_string()));
    }
    let shared = decade_of(span) - 2;
    let [low, high] = [low, high].map(|value| match of_many_sizes && value != 0.0 {
        false => written(value, decade_of(largest), shared),
        true => written(value, decade_of(value.abs()), shared.min(decade_of(value.abs()) - 2)),
    });
    let zeros = [&low, &high].map(|label| zeros_behind_point(label));
    match zeros {
        [Some(a), Some(b)] if !of_many_sizes => [without_zeros(&low, a.min(b)), without_zeros(&high, a.min(b))],
        [a, b] => [without_zeros(&low, a.unwrap_or(0)), without_zeros(&high, b.unwrap_or(0))],
    }
}

/// How many zeros end the digits behind the point of a number, before a power of ten; none of one without a point.
fn zeros_behind_point(label: &str) -> Option<usize> {
    let (_, behind) = label.split('·').next().unwrap_or_default().split_once('.')?;
    Some(behind.len() - behind.trim_end_matches('0').len())
}

/// A number without so many of the zeros that end its digits behind the point.
fn without_zeros(label: &str, count: usize) -> String {
    let (digits, power) = label.split_at(label.find('·').unwrap_or(label.len()));
    let kept = digits.get(..digits.len() - count).unwrap_or(digits);
    format!("{}{power}", kept.strip_suffix('.').unwrap_or(kept))
}

/// Logarithmic axes between these powers of ten have plain numbers, all others powers.
const PLAIN: (f64, f64) = (-3.0, 5.0);

/// A digit times a power of ten as a plain number: 0.02, 1000.
fn plain_decade(digit: i32, decade: i32) -> String {
    format!("{:.*}", usize::try_from(-decade).unwrap_or(0), f64::from(digit) * 10_f64.powi(decade))
}

/// A digit times a power of ten: 10⁴, 5·10⁴.
fn decade_label(digit: i32, decade: i32) -> String {
    if digit == 1 { power_of_ten(decade) } else { format!("{digit}·{}", power_of_ten(decade)) }
}

/// A power of ten as one writes it: 10⁻⁷.
pub fn power_of_ten(exponent: i32) -> String {
    let raise = |c| match c {
        '-' => '⁻',
        '0' => '⁰',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '4' => '⁴',
        '5' => '⁵',
        '6' => '⁶',
        '7' => '⁷',
        '8' => '⁸',
        _ => '⁹',
    };
    format!("10{}", exponent.to_string().chars().map(raise).collect::<String>())
}

/// The sign that typographers use.
fn minus(number: &str) -> String {
    number.replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &Axis, count: f64) -> Vec<String> {
        Ruler::new(axis, std::iter::empty()).ticks(count).into_iter().filter_map(|tick| tick.label).collect()
    }

    #[test]
    fn linear_ticks_are_multiples_of_1_2_or_5() {
        let axis = |low, high| Axis::linear("").range(low, high);
        assert_eq!(labels(&axis(0.0, 10.0), 6.0), ["0", "2", "4", "6", "8", "10"]);
        assert_eq!(labels(&axis(-0.3, 0.2), 5.0), ["−0.3", "−0.2", "−0.1", "0", "0.1", "0.2"]);
        assert_eq!(labels(&axis(2.4996e8, 2.5004e8), 1.0), ["2.5·10⁸"]);
        assert_eq!(labels(&axis(0.1221, 0.1279), 2.0), ["0.125"]);
        assert_eq!(labels(&axis(980.0, 1022.0), 4.0), ["980", "1000", "1020"]);
        assert_eq!(labels(&axis(0.0, 2e6), 4.0), ["0", "0.5·10⁶", "1.0·10⁶", "1.5·10⁶", "2.0·10⁶"]);
        assert_eq!(labels(&axis(0.0, 2e-5), 2.0), ["0", "1·10⁻⁵", "2·10⁻⁵"]);
    }

    #[test]
    fn logarithmic_ticks_are_decades_with_minor_ones() {
        let axis = |low, high| Axis::log10("").range(low, high);
        assert_eq!(labels(&axis(0.01, 1e5), 10.0), ["0.01", "0.1", "1", "10", "100", "1000", "10000", "100000"]);
        assert_eq!(labels(&axis(1e-8, 1e8), 4.0), ["10⁻⁸", "10⁻⁴", "10⁰", "10⁴", "10⁸"]);
        assert_eq!(labels(&axis(3.0, 30.0), 8.0), ["5", "10", "20"]);
        assert_eq!(labels(&axis(1e4, 6e4), 8.0), ["10000", "20000", "50000"]);
        assert_eq!(labels(&axis(100.0, 300.0), 5.0), ["100", "150", "200", "250", "300"]);
        assert_eq!(labels(&axis(3e5, 4e6), 8.0), ["5·10⁵", "10⁶", "2·10⁶"]);
        let ticks = Ruler::new(&axis(1.0, 1000.0), std::iter::empty()).ticks(8.0);
        // 1…9 in each of three decades, and the end.
        assert_eq!(ticks.len(), 28);
        assert!((ticks[1].place - 2_f64.log10() / 3.0).abs() < 1e-12);
    }

    #[test]
    fn reciprocal_ticks_are_round_and_apart() {
        let axis = |low, high| Axis { scale: Scale::Reciprocal, ..Axis::linear("").range(low, high) };
        assert_eq!(labels(&axis(1000.0, 1e6), 8.0), ["1000", "1500", "2000", "3000", "10000"]);
        assert_eq!(labels(&axis(5590.0, 5632.0), 5.0), ["5590", "5600", "5610", "5620", "5630"]);
        let ruler = Ruler::new(&axis(2000.0, 10_000.0), std::iter::empty());
        // Mired: 500 to 100, of which 250 are 4000 K.
        assert!((ruler.place(4000.0).unwrap() - 250.0 / 400.0).abs() < 1e-12);
        assert_eq!([ruler.place(0.0), ruler.place(-5.0), ruler.place_within(-5.0)], [None, None, Some(0.0)]);
        assert_eq!(labels(&axis(0.1, 0.4), 4.0), ["0.1", "0.2", "0.4"]);
    }

    /// Whatever the range, both ends have numbers, and these differ by what the range does, to 1 %.
    #[test]
    fn ends_are_told_apart() {
        let value = |label: &str| -> f64 {
            let raised = |c: char| "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().position(|digit| digit == c).map(|digit| digit.to_string());
            let (digits, power) = label.split_once("·10").unwrap_or((label, "⁰"));
            let power: String = power.chars().map(|c| raised(c).unwrap_or_else(|| "-".into())).collect();
            format!("{}e{power}", digits.replace('−', "-")).parse().unwrap()
        };
        let scales = [Scale::Linear, Scale::Log10, Scale::Reciprocal];
        for scale in scales {
            for middle in [-4e9, -512.25, -1e-5, 0.0, 3e-12, 0.31, 5600.0, 65_535.0, 1e8, 2.5e30] {
                for part in [1e-7, 3.3e-5, 0.0127, 0.4, 1.0, 30.0] {
                    let room = if middle == 0.0 { part } else { part * f64::abs(middle) };
                    let (low, high) = match scale {
                        Scale::Linear => (middle - room, middle + room),
                        _ if middle <= 0.0 => continue,
                        _ => (middle / (1.0 + part), middle * (1.0 + part)),
                    };
                    let ruler = Ruler::new(&Axis { scale, ..Axis::linear("").range(low, high) }, std::iter::empty());
                    let ticks = ruler.ticks_between_ends(5.0, 0.1);
                    let [first, .., last] = ticks.as_slice() else { panic!("{ticks:?}") };
                    assert_eq!([first.place, last.place].map(f64::round), [0.0, 1.0]);
                    let [from, to] = [first, last].map(|tick| tick.label.as_deref().unwrap());
                    let off = [value(from) - low, value(to) - high].map(|off| f64::abs(off) / (high - low));
                    assert!(off.iter().all(|off| *off <= 0.0051), "{low} to {high}: {from} to {to}");
                    // Numbers on a bar stand apart.
                    let places: Vec<f64> = ticks.iter().filter(|t| t.label.is_some()).map(|tick| tick.place).collect();
                    assert!(
                        scale == Scale::Log10 || places.windows(2).all(|pair| pair[1] - pair[0] > 0.05),
                        "{ticks:?}"
                    );
                }
            }
        }
        for (low, high, wanted) in [
            (0.0, 10.0, ["0", "10"]),
            (3.0, 17.0, ["3", "17"]),
            (-0.5, 0.25, ["−0.50", "0.25"]),
            (4875.123, 4875.143, ["4875.123", "4875.143"]),
            (4875.31, 9123.77, ["4875", "9124"]),
            (0.0, 65_535.0, ["0", "65535"]),
            (-2e9, 2e9, ["−2·10⁹", "2·10⁹"]),
            (1_234_555.31, 1_234_576.2, ["1234555.3", "1234576.2"]),
            (1.0e-7, 1.2341e-7, ["1.000·10⁻⁷", "1.234·10⁻⁷"]),
        ] {
            assert_eq!(end_labels(low, high, false), wanted);
        }
        assert_eq!(end_labels(0.01, 12_345.6, true), ["0.01", "12346"]);
    }

    /// Of temperatures up to the farthest the upper end of the bar has numbers too: by inverses 20000 K lies at five sixths.
    #[test]
    fn numbers_cover_a_bar_of_inverses() {
        let axis = Axis { scale: Scale::Reciprocal, ..Axis::linear("").range(3384.0, 998_619.0) };
        let ruler = Ruler::new(&axis, std::iter::empty());
        for (count, apart) in [(4.7, 0.106), (7.1, 0.071), (12.0, 0.035)] {
            let ticks = ruler.ticks_between_ends(count, apart);
            let places: Vec<f64> = ticks.iter().map(|tick| tick.place).collect();
            assert!(places.windows(2).all(|pair| (apart..0.35).contains(&(pair[1] - pair[0]))), "{ticks:?}");
            assert!(ticks.iter().any(|tick| tick.label.as_deref() == Some("20000")), "{ticks:?}");
        }
    }

    #[test]
    fn places_are_proportional_to_values_or_their_logarithms() {
        let linear = Ruler::new(&Axis::linear("").range(-1.0, 3.0), std::iter::empty());
        assert_eq!(linear.place(0.0), Some(0.25));
        assert_eq!(linear.place(f64::NAN), None);
        assert_eq!(linear.place(f64::INFINITY), None);
        assert_eq!(linear.place_within(f64::INFINITY), Some(1.0));
        let log = Ruler::new(&Axis::log10("").range(1.0, 1e4), std::iter::empty());
        assert_eq!(log.place(100.0), Some(0.5));
        assert_eq!(log.place(0.0), None);
        assert_eq!(log.place(-1.0), None);
        assert_eq!(log.place_within(0.0), Some(0.0));
    }

    #[test]
    fn ranges_come_from_what_is_shown() {
        let ends = |axis: Axis, values: &[f64]| {
            let ruler = Ruler::new(&axis, values.iter().copied());
            (ruler.low, ruler.high)
        };
        assert_eq!(ends(Axis::linear(""), &[0.0, f64::NAN, 100.0]), (-5.0, 105.0));
        assert_eq!(ends(Axis::linear(""), &[7.0]), (6.3, 7.7));
        assert_eq!(ends(Axis::log10(""), &[-1.0, 0.0, 10.0]), (0.5, 1.5));
        assert_eq!(ends(Axis::linear(""), &[]), (0.0, 1.0));
        // Ranges that make no sense are as none.
        assert_eq!(ends(Axis::log10("").range(0.0, 5.0), &[]), (0.0, 1.0));
        assert_eq!(ends(Axis::linear("").range(5.0, 1.0), &[]), (0.0, 1.0));
        assert_eq!(ends(Axis::linear("").range(f64::NAN, 1.0), &[]), (0.0, 1.0));
    }

    #[test]
    fn extreme_axes_have_a_bounded_number_of_ticks() {
        for axis in [Axis::linear("").range(-1e100, 1e100), Axis::log10("").range(1e-100, 1e100)] {
            let ticks = labels(&axis, 10.0);
            assert!((2..=21).contains(&ticks.len()), "{ticks:?}");
        }
        let narrow = labels(&Axis::linear("").range(1e15, 1e15 + 2e7), 5.0);
        assert!((2..=8).contains(&narrow.len()), "{narrow:?}");
    }
}
