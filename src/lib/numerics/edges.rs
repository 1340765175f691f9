//! Sums over the edges that lie half-way between whole numbers.

use super::gauss::{NODES, panel};

/// Widest panel, in units of the scale: of what changes as a normal law does, 12 nodes leave 10⁻¹².
const WIDEST: f64 = 4.0;

/// Step of a derivative in units of the scale.
const STEP: f64 = 0.05;

/// Places that derivatives at both ends take.
const OF_ENDS: f64 = 8.0;

/// The least scale, in steps from one edge to the next: what derivatives at the ends leave is then below 3·10⁻⁸ of a step.
const LEAST_SCALE: f64 = 5.0;

/// How many places [`over`] takes of so many edges where `scale` is as [there](over); none where it takes each.
fn panels(edges: f64, scale: f64) -> Option<f64> {
    let panels = (edges / (WIDEST * scale)).ceil();
    (scale >= LEAST_SCALE && panels * NODES as f64 + OF_ENDS < edges).then_some(panels)
}

/// Goes through places and weights of the sum of a function over the edges k + ½, k from `first` to before `last`, whole numbers; of one that
/// changes over no less than `scale`, as a normal law over its standard deviation, through fewer. Returns how many.
///
/// Σ f(k + ½) = ∫ f − \[f′]/24 + 7 \[f‴]/5760 − … between the ends, by Euler and Maclaurin; the function is asked for up to `scale`/10 beyond
/// these.
pub fn over(first: f64, last: f64, scale: f64, mut add: impl FnMut(f64, f64)) -> u64 {
    let mut count = 0;
    let mut add = |edge: f64, weight: f64| {
        count += 1;
        add(edge, weight);
    };
    let Some(panels) = panels(last - first, scale) else {
        let mut code = first;
        while code < last {
            add(code + 0.5, 1.0);
            code += 1.0;
        }
        return count;
    };
    let width = (last - first) / panels;
    let mut index = 0.0;
    while index < panels {
        panel(first + index * width, first + (index + 1.0) * width).for_each(|(edge, weight)| add(edge, weight));
        index += 1.0;
    }
    // First and third derivatives by differences.
    let step = STEP * scale;
    let [first_factor, third_factor] = [1.0 / (24.0 * 12.0 * step), 7.0 / (5760.0 * 2.0 * step.powi(3))];
    for (end, sign) in [(last, 1.0), (first, -1.0)] {
        for (steps, of_first, of_third) in [(1.0, 8.0, -2.0), (2.0, -1.0, 1.0)] {
            let factor = sign * (third_factor * of_third - first_factor * of_first);
            for (edge, side) in [(end + steps * step, 1.0), (end - steps * step, -1.0)] {
                add(edge, side * factor);
            }
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::normal::cumulative;

    /// A law that ends anywhere, of any width, times a power: one by one.
    #[test]
    fn sums_are_those_of_the_edges_one_by_one() {
        for scale in [0.5, 4.9, 5.0, 8.0, 40.0, 700.0] {
            for center in [-300.2, 0.0, 17.3, 250.9, 1400.0] {
                let of = |edge: f64| (1.0 + 0.01 * edge) * cumulative((center - edge) / scale);
                let (mut found, mut places) = (0.0, 0);
                let taken = over(0.0, 1000.0, scale, |edge, weight| {
                    found += weight * of(edge);
                    places += 1;
                });
                let expected: f64 = (0..1000).map(|code| of(f64::from(code) + 0.5)).sum();
                assert_eq!(taken, places);
                assert!((found - expected).abs() < 3e-8 * expected.max(1.0), "{scale} {center}: {found} {expected}");
                assert_eq!(taken < 1000, scale >= 5.0, "{taken}");
            }
        }
    }
}
