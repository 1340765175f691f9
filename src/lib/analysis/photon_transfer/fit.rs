//! Straight lines through points of unequal weight.

/// A straight line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Its value at 0.
    pub offset: f64,
    /// Its slope.
    pub slope: f64,
}

/// A point and its weight, the inverse of the variance of `y`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Where.
    pub x: f64,
    /// What was measured there.
    pub y: f64,
    /// What it counts.
    pub weight: f64,
}

impl Line {
    /// The value at a place.
    pub fn at(self, x: f64) -> f64 {
        self.offset + self.slope * x
    }

    /// The line of least squares through 0; none where no point is off 0.
    pub fn through_zero(points: impl IntoIterator<Item = Point>) -> Option<Self> {
        let (mut products, mut squares) = (0.0, 0.0);
        for Point { x, y, weight } in points {
            products += weight * x * y;
            squares += weight * x * x;
        }
        (squares > 0.0).then(|| Self { offset: 0.0, slope: products / squares })
    }

    /// The line of least squares; none where all points are in one place.
    pub fn through(points: impl IntoIterator<Item = Point> + Clone) -> Option<Self> {
        let (mut all, mut at, mut of) = (0.0, 0.0, 0.0);
        for Point { x, y, weight } in points.clone() {
            all += weight;
            at += weight * x;
            of += weight * y;
        }
        let (x_mean, y_mean) = (at / all, of / all);
        // What rounding leaves of places that are one is no distance.
        let spread: f64 = points.clone().into_iter().map(|point| point.weight * (point.x - x_mean).powi(2)).sum();
        if spread <= 1e-20 * all * x_mean * x_mean {
            return None;
        }
        let centered = points.into_iter().map(|point| Point { x: point.x - x_mean, y: point.y - y_mean, ..point });
        let Self { slope, .. } = Self::through_zero(centered)?;
        Some(Self { offset: y_mean - slope * x_mean, slope })
    }

    /// Σ weight (y − line)².
    pub fn chi_square(self, points: impl IntoIterator<Item = Point>) -> f64 {
        points.into_iter().map(|Point { x, y, weight }| weight * (y - self.at(x)).powi(2)).sum()
    }
}

/// The variance that all points of a fit have besides their own, so that Σ (y − line)² over both is as many as `freedom`
/// \[PauleMandel1982]; `misfit`
/// gives the sum for a variance, which falls as that grows. None where their own suffice.
pub fn variance_besides(freedom: f64, misfit: impl Fn(f64) -> f64, largest: f64) -> f64 {
    if misfit(0.0) <= freedom || misfit(largest) >= freedom {
        return if misfit(0.0) <= freedom { 0.0 } else { largest };
    }
    // On a logarithmic scale, thirty decades down.
    let (mut low, mut high) = (largest * 1e-30, largest);
    for _ in 0..200 {
        let middle = (low * high).sqrt();
        if misfit(middle) > freedom { low = middle } else { high = middle }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_go_through_their_points() {
        let points = [(1.0, 5.0), (2.0, 7.0), (4.0, 11.0)].map(|(x, y)| Point { x, y, weight: 1.0 / x });
        let line = Line::through(points).unwrap();
        assert!((line.offset - 3.0).abs() < 1e-12 && (line.slope - 2.0).abs() < 1e-12);
        assert!(line.chi_square(points) < 1e-20);
        assert_eq!(Line::through_zero([Point { x: 2.0, y: 3.0, weight: 7.0 }]).unwrap().slope, 1.5);
        assert_eq!(Line::through([Point { x: 2.0, y: 3.0, weight: 7.0 }]), None);
        let one_place = [1.0, 5.0, 9.0, 11.0].map(|y| Point { x: 0.033, y, weight: 1.0 / y });
        assert_eq!(Line::through(one_place), None);
    }

    /// Deviations of 1 and −1 with no variance of their own, of two points and a known line: 1 each.
    #[test]
    fn what_points_have_besides_is_found() {
        let found = variance_besides(2.0, |besides| 2.0 / (1e-9 + besides), 100.0);
        assert!((found - 1.0).abs() < 1e-6, "{found}");
        assert_eq!(variance_besides(2.0, |besides| 1.0 / (1.0 + besides), 100.0), 0.0);
    }
}
