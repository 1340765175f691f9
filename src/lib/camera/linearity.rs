//! How codes bend away from the charge, and what makes them straight again: "a linearization step" of \[HP2005, Sec. 2].

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;
use std::sync::Mutex;

/// What turns a code, in ADU above the bias, into one that is proportional to charge.
///
/// It is the same for all photosites, rises everywhere, and is kept once, however many sensors and records have it.
///
/// # Examples
///
/// ```
/// use cyanometer::camera::linearity::Linearization;
///
/// // A response that sags by 2 % at 10 000 ADU.
/// let raised = Linearization::polynomial(vec![1.0, 2e-6])?;
/// assert_eq!(raised.linear(10_000.0), 10_200.0);
/// assert!((raised.bent(10_200.0, [0.0, 16_383.0]) - 10_000.0).abs() < 1e-9);
/// let measured = Linearization::table(vec![0.0, 100.0, 200.0], vec![0.0, 100.0, 202.0])?;
/// assert_eq!(measured.linear(150.0), 151.0);
/// # Ok::<(), String>(())
/// ```
#[derive(Clone, Copy, PartialEq)]
pub struct Linearization(&'static Curve);

/// A curve as files have it, in ADU above the bias.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged, try_from = "Keys")]
enum Curve {
    /// c₁ x + c₂ x² + …
    Polynomial { polynomial: Vec<f64> },
    /// Straight between points, and on beyond the first and the last.
    Table { codes: Vec<f64>, linear: Vec<f64> },
}

/// What files may have of a curve.
#[derive(Deserialize)]
#[serde(expecting = "a linearization is `polynomial`, or `codes` and `linear`")]
struct Keys {
    polynomial: Option<Vec<f64>>,
    codes: Option<Vec<f64>>,
    linear: Option<Vec<f64>>,
}

impl TryFrom<Keys> for Curve {
    type Error = &'static str;

    fn try_from(keys: Keys) -> Result<Self, Self::Error> {
        match keys {
            Keys { polynomial: Some(polynomial), codes: None, linear: None } => Ok(Self::Polynomial { polynomial }),
            Keys { polynomial: None, codes: Some(codes), linear: Some(linear) } => Ok(Self::Table { codes, linear }),
            Keys { polynomial: Some(_), .. } => {
                Err("a linearization is `polynomial`, or `codes` and `linear`, but not both; leave one of them out")
            }
            Keys { .. } => Err("a linearization is `polynomial`, or `codes` and `linear`"),
        }
    }
}

/// Most coefficients of a polynomial.
const MOST_COEFFICIENTS: usize = 16;
/// Most points of a table: one for each code of 16 bits.
const MOST_POINTS: usize = 1 << 16;

impl Curve {
    fn check(&self) -> Result<(), String> {
        match self {
            Self::Polynomial { polynomial } => match polynomial.as_slice() {
                [] => Err("a linearization has no coefficients".into()),
                [first, ..] if *first <= 0.0 => {
                    Err(format!("a linearization begins with the coefficient {first} of its codes; it must be above 0"))
                }
                all if all.len() > MOST_COEFFICIENTS => {
                    Err(format!("a linearization has {} coefficients; {MOST_COEFFICIENTS} at most", all.len()))
                }
                all if all.iter().any(|c| !c.is_finite()) => {
                    Err("a linearization has a coefficient without end".into())
                }
                _ => Ok(()),
            },
            Self::Table { codes, linear } => {
                if codes.len() != linear.len() {
                    let (codes, linear) = (codes.len(), linear.len());
                    return Err(format!("a linearization has {codes} `codes` and {linear} `linear` values of them"));
                }
                if !(2..=MOST_POINTS).contains(&codes.len()) {
                    return Err(format!("a linearization has {} points; it must have 2 to {MOST_POINTS}", codes.len()));
                }
                for values in [codes, linear] {
                    if let Some(pair) = values.windows(2).find(|pair| !(pair[0] < pair[1] && pair[1].is_finite())) {
                        return Err(format!("a linearization goes from {} to {}; it must rise", pair[0], pair[1]));
                    }
                }
                Ok(())
            }
        }
    }

    /// The segment of a table in which a code lies, as its first point.
    fn segment(codes: &[f64], x: f64) -> usize {
        codes.partition_point(|code| *code <= x).clamp(1, codes.len() - 1) - 1
    }

    fn at(&self, x: f64) -> f64 {
        match self {
            Self::Polynomial { polynomial } => x * polynomial.iter().rev().fold(0.0, |sum, c| sum * x + c),
            Self::Table { codes, linear } => {
                let i = Self::segment(codes, x);
                linear[i] + (x - codes[i]) * self.slope(x)
            }
        }
    }

    fn slope(&self, x: f64) -> f64 {
        match self {
            Self::Polynomial { polynomial } => {
                polynomial.iter().enumerate().rev().fold(0.0, |sum, (power, c)| sum * x + (power + 1) as f64 * c)
            }
            Self::Table { codes, linear } => {
                let i = Self::segment(codes, x);
                (linear[i + 1] - linear[i]) / (codes[i + 1] - codes[i])
            }
        }
    }

    /// The code that is made straight to `y`, which some code of a rising part is; none where no formula tells it.
    fn inverse(&self, y: f64) -> Option<f64> {
        match self {
            Self::Polynomial { polynomial } => match polynomial.as_slice() {
                [first] => Some(y / first),
                // The root between the slope at 0 and that at the code, which is √(c₁² + 4 c₂ y).
                [first, second] => Some(2.0 * y / (first + (first * first + 4.0 * second * y).max(0.0).sqrt())),
                _ => None,
            },
            Self::Table { codes, linear } => {
                let i = Self::segment(linear, y);
                let share = (y - linear[i]) / (linear[i + 1] - linear[i]);
                Some(codes[i] + share * (codes[i + 1] - codes[i]))
            }
        }
    }
}

/// All curves that were met.
static KEPT: Mutex<Vec<&'static Curve>> = Mutex::new(Vec::new());

impl Linearization {
    /// c₁ x + c₂ x² + … of codes x above the bias.
    ///
    /// # Errors
    ///
    /// What is wrong, in words.
    pub fn polynomial(coefficients: Vec<f64>) -> Result<Self, String> {
        Self::kept(Curve::Polynomial { polynomial: coefficients })
    }

    /// Straight between points, codes above the bias and what they should be.
    ///
    /// # Errors
    ///
    /// What is wrong, in words.
    pub fn table(codes: Vec<f64>, linear: Vec<f64>) -> Result<Self, String> {
        Self::kept(Curve::Table { codes, linear })
    }

    fn kept(curve: Curve) -> Result<Self, String> {
        curve.check()?;
        let mut kept = KEPT.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some(known) = kept.iter().find(|known| ***known == curve) {
            return Ok(Self(known));
        }
        let new: &'static Curve = Box::leak(Box::new(curve));
        kept.push(new);
        Ok(Self(new))
    }

    /// Makes sure that it rises from the first to the second code above the bias.
    ///
    /// # Errors
    ///
    /// Where it does not, in words.
    pub fn check_rises(self, [from, to]: [f64; 2]) -> Result<(), String> {
        let mut x = from;
        while x <= to {
            if self.slope(x) <= 0.0 {
                return Err(format!("the linearization falls from {x} ADU above the bias on; it must rise up to {to}"));
            }
            x += 1.0;
        }
        Ok(())
    }

    /// A code above the bias made straight.
    pub fn linear(self, x: f64) -> f64 {
        self.0.at(x)
    }

    /// Codes above the bias at which it is not smooth, in ascending order.
    pub fn knots(self) -> &'static [f64] {
        match self.0 {
            Curve::Polynomial { .. } => &[],
            Curve::Table { codes, .. } => codes,
        }
    }

    /// How many straight ADU one of the code makes at a code above the bias.
    pub fn slope(self, x: f64) -> f64 {
        self.0.slope(x)
    }

    /// [`Self::linear`] between two codes, and along its tangents beyond them.
    pub fn extended(self, x: f64, [from, to]: [f64; 2]) -> f64 {
        let within = x.clamp(from, to);
        let beyond = x - within;
        self.linear(within) + if beyond == 0.0 { 0.0 } else { beyond * self.slope(within) }
    }

    /// The code above the bias that is made straight to `y`: the inverse of [`Self::extended`].
    pub fn bent(self, y: f64, [from, to]: [f64; 2]) -> f64 {
        for end in [from, to] {
            let at = self.linear(end);
            if (y <= at) == (end == from) {
                return end + (y - at) / self.slope(end);
            }
        }
        if let Some(found) = self.0.inverse(y) {
            return found;
        }
        let (mut low, mut high) = (from, to);
        let mut x = from + (to - from) * (y - self.linear(from)) / (self.linear(to) - self.linear(from));
        // Newton's steps, or halves where they lead out.
        for _ in 0..100 {
            let excess = self.linear(x) - y;
            if excess > 0.0 {
                high = x
            } else {
                low = x
            }
            let newton = x - excess / self.slope(x);
            let next = if newton > low && newton < high { newton } else { f64::midpoint(low, high) };
            if (next - x).abs() <= 4.0 * f64::EPSILON * x.abs().max(1.0) {
                return next;
            }
            x = next;
        }
        x
    }
}

impl fmt::Debug for Linearization {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl Serialize for Linearization {
    fn serialize<S: Serializer>(&self, into: S) -> Result<S::Ok, S::Error> {
        self.0.serialize(into)
    }
}

impl<'de> Deserialize<'de> for Linearization {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        Self::kept(Curve::deserialize(from)?).map_err(serde::de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curves() -> [Linearization; 4] {
        [
            Linearization::polynomial(vec![1.0, 3e-6, -1e-11]).unwrap(),
            Linearization::polynomial(vec![1.02, -4e-6]).unwrap(),
            Linearization::polynomial(vec![0.98]).unwrap(),
            Linearization::table(vec![-50.0, 0.0, 700.0, 4000.0], vec![-51.0, 0.0, 690.0, 4100.0]).unwrap(),
        ]
    }

    #[test]
    fn bending_undoes_straightening_within_and_beyond() {
        let range = [-100.5, 16_283.5];
        for curve in curves() {
            for x in [-1e4, -100.5, -60.0, -0.25, 0.0, 1.0, 699.5, 3999.0, 12_345.6, 16_283.5, 1e5] {
                let found = curve.bent(curve.extended(x, range), range);
                assert!((found - x).abs() < 1e-9 * x.abs().max(1.0), "{curve:?} {x}: {found}");
            }
            assert_eq!(curve.extended(f64::INFINITY, range), f64::INFINITY);
            assert_eq!(curve.bent(f64::NEG_INFINITY, range), f64::NEG_INFINITY);
        }
    }

    #[test]
    fn slopes_are_those_of_the_curve() {
        for curve in curves() {
            for x in [-40.0, 10.0, 300.0, 2000.0, 5000.0] {
                let found = (curve.linear(x + 0.5) - curve.linear(x - 0.5)) / 1.0;
                assert!((curve.slope(x) / found - 1.0).abs() < 1e-7, "{curve:?} {x}");
            }
        }
    }

    #[test]
    fn what_does_not_rise_is_refused() {
        let wrong = |curve: Result<Linearization, String>, says: &str| {
            let complaint = curve.unwrap_err();
            assert!(complaint.contains(says), "{complaint}");
        };
        wrong(Linearization::polynomial(vec![]), "no coefficients");
        wrong(Linearization::polynomial(vec![-1.0]), "above 0");
        wrong(Linearization::polynomial(vec![1.0, f64::NAN]), "without end");
        wrong(Linearization::table(vec![0.0, 1.0], vec![0.0]), "2 `codes` and 1 `linear`");
        wrong(Linearization::table(vec![0.0], vec![0.0]), "2 to 65536");
        wrong(Linearization::table(vec![0.0, 2.0, 2.0], vec![0.0, 1.0, 2.0]), "from 2 to 2");
        let falls = Linearization::polynomial(vec![1.0, -1e-3]).unwrap();
        assert!(falls.check_rises([0.0, 400.0]).is_ok());
        assert!(falls.check_rises([0.0, 600.0]).unwrap_err().contains("falls from 500 ADU"));
    }

    #[test]
    fn one_curve_is_kept_once() {
        let [first, again] = [0, 1].map(|_| Linearization::polynomial(vec![1.0, 5e-7]).unwrap());
        assert!(std::ptr::eq(first.0, again.0));
        let text = serde_yaml::to_string(&first).unwrap();
        assert_eq!(serde_yaml::from_str::<Linearization>(&text).unwrap(), first);
        let table: Linearization = serde_yaml::from_str("{codes: [0, 10], linear: [0, 11]}").unwrap();
        assert_eq!(table.linear(20.0), 22.0);
        assert!(serde_yaml::from_str::<Linearization>("{codes: [0, 10]}").is_err());
    }
}
