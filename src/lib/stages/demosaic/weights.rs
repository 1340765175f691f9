//! The table of weights: what each demosaicked value is made of, site by site.
//!
//! About a uniform scene every method is a linear filter whose stencils repeat with the 2×2 phases of the color filter
//! array. The table is built from the definition of each method in [HP2005, App. A] as a sum of sites, apart from the
//! filters themselves; tests drive impulses through the filters and get it back. Propagation takes its covariances
//! from it.

use super::malvar;
use super::method::Method;
use super::stencil::{PHASES, Stencil};
use crate::cfa::{CfaPattern, Class};
use nalgebra::Matrix3;
use std::collections::BTreeSet;
use std::sync::OnceLock;

/// What surrounds the pixels of one phase.
struct Surroundings {
    pattern: CfaPattern,
    phase: [isize; 2],
}

impl Surroundings {
    fn class(&self, [x, y]: [isize; 2]) -> Class {
        self.pattern.class((self.phase[0] + x) as i64, (self.phase[1] + y) as i64)
    }

    /// The sites of class `wanted` that a method takes the mean of at a site of another class: those beside it, above
    /// and below it, or diagonal to it.
    fn neighbors(&self, [x, y]: [isize; 2], wanted: Class) -> Vec<[isize; 2]> {
        let sides = [[x - 1, y], [x + 1, y], [x, y - 1], [x, y + 1]];
        let diagonals = [[x - 1, y - 1], [x + 1, y - 1], [x - 1, y + 1], [x + 1, y + 1]];
        let near: Vec<_> = sides.into_iter().filter(|&site| self.class(site) == wanted).collect();
        if near.is_empty() { diagonals.to_vec() } else { near }
    }

    /// Green at a site, bilinear, or through the differences G − X at its four neighbors as ECI has it.
    fn green(&self, site: [isize; 2], through_differences: bool) -> Stencil {
        if self.class(site) == Class::Green {
            return Stencil::site(site);
        }
        let [x, y] = site;
        let neighbors = [[-1, 0], [1, 0], [0, -1], [0, 1]];
        let mean = neighbors.iter().fold(Stencil::zero(), |sum, [dx, dy]| {
            let sum = sum.plus(0.25, &Stencil::site([x + dx, y + dy]));
            if through_differences {
                sum.plus(-0.125, &Stencil::site(site)).plus(-0.125, &Stencil::site([x + 2 * dx, y + 2 * dy]))
            } else {
                sum
            }
        });
        if through_differences { mean.plus(1.0, &Stencil::site(site)) } else { mean }
    }

    /// Red or blue at the pixel itself, as the part that is always there and the part in proportion to the slope ρ of
    /// a hue:
    ///
    /// X̂ = mean of xᵢ + ρ (ĝ₀ − mean of ĝᵢ)
    ///
    /// over the neighbors i of that class. Bilinear interpolation is ρ = 0, effective color interpolation ρ = 1, and
    /// smooth hue transition, X̂ = ĝ₀ · mean of xᵢ/ĝᵢ, is ρ = x̄/ḡ to first order about its means.
    fn chrominance(&self, wanted: Class, through_differences: bool) -> (Stencil, Stencil) {
        let here = [0, 0];
        if self.class(here) == wanted {
            return (Stencil::site(here), Stencil::zero());
        }
        let neighbors = self.neighbors(here, wanted);
        let share = 1.0 / neighbors.len() as f64;
        let mean = neighbors.iter().fold(Stencil::zero(), |sum, &site| sum.plus(share, &Stencil::site(site)));
        let slope = neighbors.iter().fold(self.green(here, through_differences), |sum, &site| {
            sum.plus(-share, &self.green(site, through_differences))
        });
        (mean, slope)
    }
}

/// The greens that smooth hue transition restores `wanted` from at the pixels of a phase: that of the pixel itself, and
/// those of the neighbors whose hues it takes the mean of; none where `wanted` is measured.
pub fn greens_of_hue(pattern: CfaPattern, phase: usize, wanted: Class) -> (Stencil, Vec<Stencil>) {
    let surroundings = Surroundings { pattern, phase: PHASES[phase] };
    let green = |site| surroundings.green(site, false);
    let neighbors = match surroundings.class([0, 0]) {
        here if here == wanted => Vec::new(),
        _ => surroundings.neighbors([0, 0], wanted),
    };
    (green([0, 0]), neighbors.into_iter().map(green).collect())
}

/// The neighbors that smooth hue transition restores `wanted` from at the pixels of a phase; the pixel itself where it is
/// measured.
pub fn sites_of_hue(pattern: CfaPattern, phase: usize, wanted: Class) -> Vec<[isize; 2]> {
    let surroundings = Surroundings { pattern, phase: PHASES[phase] };
    if surroundings.class([0, 0]) == wanted { vec![[0, 0]] } else { surroundings.neighbors([0, 0], wanted) }
}

/// The stencils of R, G and B in each phase.
type Stencils = [[Stencil; 3]; 4];

/// The weights of a method for one filter array; those of smooth hue transition hang on the hue of the scene.
///
/// # Examples
///
/// ```
/// use cyanometer::cfa::{CfaPattern, Class};
/// use cyanometer::stages::demosaic::Method;
/// use cyanometer::stages::demosaic::weights::WeightTable;
///
/// let weights = WeightTable::of(Method::Bilinear, CfaPattern::Rggb).about([1.0, 1.0]);
/// // The phase whose photosites are blue: there red is the mean of the four at the corners.
/// let blue = (0..4).find(|&phase| weights.class(phase, [0, 0]) == Class::Blue).unwrap();
/// let red = weights.stencil(blue, Class::Red as usize);
/// assert_eq!([[-1, -1], [1, -1], [-1, 1], [1, 1]].map(|corner| red.at(corner)), [0.25; 4]);
/// assert_eq!(red.at([0, 0]), 0.0);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct WeightTable {
    pattern: CfaPattern,
    fixed: Stencils,
    /// What is added in proportion to the ratio of the channel's mean to that of green.
    of_hue: Stencils,
}

impl WeightTable {
    /// The pattern of the plane.
    pub fn pattern(&self) -> CfaPattern {
        self.pattern
    }

    /// The weights of `method` on an array of `pattern`, worked out once.
    pub fn of(method: Method, pattern: CfaPattern) -> &'static Self {
        static TABLES: [[OnceLock<Box<WeightTable>>; CfaPattern::ALL.len()]; Method::ALL.len()] =
            [const { [const { OnceLock::new() }; CfaPattern::ALL.len()] }; Method::ALL.len()];
        TABLES[method as usize][pattern as usize].get_or_init(|| Box::new(Self::new(method, pattern)))
    }

    /// The weights of `method` on an array of `pattern`.
    pub fn new(method: Method, pattern: CfaPattern) -> Self {
        let zero = || PHASES.map(|_| Class::ALL.map(|_| Stencil::zero()));
        let (mut fixed, mut of_hue) = (zero(), zero());
        for (index, phase) in PHASES.into_iter().enumerate() {
            let surroundings = Surroundings { pattern, phase };
            for class in Class::ALL {
                let through_differences = method == Method::EffectiveColor;
                let green = || (surroundings.green([0, 0], through_differences), Stencil::zero());
                let chrominance = || surroundings.chrominance(class, through_differences);
                let (always, by_hue) = match method {
                    Method::Malvar => (malvar::stencil(class, |offset| surroundings.class(offset)), Stencil::zero()),
                    Method::Bilinear | Method::SmoothHue | Method::EffectiveColor if class == Class::Green => green(),
                    Method::Bilinear => (chrominance().0, Stencil::zero()),
                    Method::SmoothHue => chrominance(),
                    Method::EffectiveColor => {
                        let (mean, slope) = chrominance();
                        (mean.plus(1.0, &slope), Stencil::zero())
                    }
                };
                (fixed[index][class as usize], of_hue[index][class as usize]) = (always, by_hue);
            }
        }
        Self { pattern, fixed, of_hue }
    }

    /// The weights about a scene whose ratios of red and of blue to green are `hues`; only smooth hue transition
    /// depends on them.
    pub fn about(&self, hues: [f64; 2]) -> Weights {
        let ratio = [hues[0], 0.0, hues[1]];
        let stencil = |phase: usize, channel: usize| {
            self.fixed[phase][channel].clone().plus(ratio[channel], &self.of_hue[phase][channel])
        };
        Weights {
            pattern: self.pattern,
            stencils: [0, 1, 2, 3].map(|phase| [0, 1, 2].map(|channel| stencil(phase, channel))),
        }
    }

    /// The weights of R, G and B at the pixels of a phase, as far as they do not hang on hue.
    pub fn fixed(&self, phase: usize) -> &[Stencil; 3] {
        &self.fixed[phase]
    }

    /// What is added to [`Self::fixed`] in proportion to the ratio of the channel's mean to that of green.
    pub fn of_hue(&self, phase: usize) -> &[Stencil; 3] {
        &self.of_hue[phase]
    }

    /// The sites that any of R, G and B at the pixels of a phase is made of: offsets (column, row).
    pub fn sites(&self, phase: usize) -> Vec<[isize; 2]> {
        let stencils = self.fixed[phase].iter().chain(&self.of_hue[phase]);
        let sites: BTreeSet<_> = stencils.flat_map(Stencil::sites).map(|(offset, _)| offset).collect();
        sites.into_iter().collect()
    }

    /// The class of the site `offset` away from a pixel of a phase.
    pub fn class(&self, phase: usize, offset: [isize; 2]) -> Class {
        Surroundings { pattern: self.pattern, phase: PHASES[phase] }.class(offset)
    }

    /// Whether the weights hang on the hue of the scene.
    pub fn depends_on_hue(&self) -> bool {
        self.of_hue.iter().flatten().any(|stencil| stencil.sites().next().is_some())
    }
}

/// Weights of three channels in each phase of an array: demosaicked R, G and B, or any linear mixture of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Weights {
    pattern: CfaPattern,
    stencils: Stencils,
}

impl Weights {
    /// The filter array.
    pub fn pattern(&self) -> CfaPattern {
        self.pattern
    }

    /// The weights of a channel at the pixels of a phase, an index into [`PHASES`].
    pub fn stencil(&self, phase: usize, channel: usize) -> &Stencil {
        &self.stencils[phase][channel]
    }

    /// The farthest row or column that has weight; at most [`REACH`](super::stencil::REACH).
    pub fn reach(&self) -> isize {
        let sites = self.stencils.iter().flatten().flat_map(Stencil::sites);
        sites.map(|([x, y], _)| x.abs().max(y.abs())).max().unwrap_or_default()
    }

    /// The class of the site `offset` away from a pixel of a phase.
    pub fn class(&self, phase: usize, offset: [isize; 2]) -> Class {
        Surroundings { pattern: self.pattern, phase: PHASES[phase] }.class(offset)
    }

    /// The weights of the channels that `matrix` makes of these.
    #[must_use]
    pub fn through(&self, matrix: &Matrix3<f64>) -> Self {
        let mixture = |stencils: &[Stencil; 3], row: usize| {
            (0..3).fold(Stencil::zero(), |sum, channel| sum.plus(matrix[(row, channel)], &stencils[channel]))
        };
        let stencils = self.stencils.each_ref().map(|phase| [0, 1, 2].map(|row| mixture(phase, row)));
        Self { pattern: self.pattern, stencils }
    }
}

#[cfg(test)]
mod tests {
    use super::super::stencil::phase;
    use super::*;
    use crate::frame::{Geometry, mirror};
    use crate::metadata::{FrameHeader, Metadata};
    use crate::stages::black::Black;
    use crate::stages::demosaic::Demosaic;
    use crate::stream::MemoryFrame;
    use crate::units::QuantityKind;

    const WIDTH: usize = 12;
    const HEIGHT: usize = 10;

    fn demosaicked(method: Method, pattern: CfaPattern, plane: impl Fn(usize, usize) -> f32) -> MemoryFrame {
        let mut metadata = Metadata::new(QuantityKind::Adu);
        metadata.cfa = Some(pattern.into());
        let header = FrameHeader { name: "test".into(), geometry: Geometry::new(WIDTH, HEIGHT, &["Y"]), metadata };
        let samples = (0..WIDTH * HEIGHT).map(|i| plane(i % WIDTH, i / WIDTH)).collect();
        let stage = Demosaic::new(&header, method, Black::None, None).unwrap();
        MemoryFrame::new(header, samples).through(&stage).unwrap().0
    }

    /// The weight that the table gives to a site of the frame in a channel of a pixel, edges mirrored.
    fn tabled(weights: &Weights, [x, y]: [usize; 2], channel: usize, site: [usize; 2]) -> f64 {
        let stencil = weights.stencil(phase(x as i64, y as i64), channel);
        let lands =
            |[dx, dy]: [isize; 2]| [mirror(x.cast_signed() + dx, WIDTH), mirror(y.cast_signed() + dy, HEIGHT)] == site;
        stencil.sites().filter(|(offset, _)| lands(*offset)).map(|(_, weight)| weight).sum()
    }

    /// Every site in turn is raised on a uniform scene and lowered by as much; half the difference of what the filter
    /// makes of the two, over the step, is the weight.
    fn check(method: Method, means: [f32; 3], step: f32, tolerance: f64) {
        for pattern in CfaPattern::ALL {
            let hues = [f64::from(means[0] / means[1]), f64::from(means[2] / means[1])];
            let weights = WeightTable::new(method, pattern).about(hues);
            for site in (0..WIDTH * HEIGHT).map(|i| [i % WIDTH, i / WIDTH]) {
                let [raised, lowered] = [step, -step].map(|by| {
                    demosaicked(method, pattern, |x, y| {
                        let mean = means[pattern.class(x as i64, y as i64) as usize];
                        if [x, y] == site { mean + by } else { mean }
                    })
                });
                for (i, (a, b)) in raised.samples.iter().zip(&lowered.samples).enumerate() {
                    let (x, channel, y) = (i % WIDTH, i / WIDTH % 3, i / WIDTH / 3);
                    let found = (f64::from(*a) - f64::from(*b)) / (2.0 * f64::from(step));
                    let expected = tabled(&weights, [x, y], channel, site);
                    assert!(
                        (found - expected).abs() < tolerance,
                        "{method:?} {pattern}: channel {channel} of {x},{y} takes {found} of {site:?}, not {expected}"
                    );
                }
            }
        }
    }

    /// All weights are whole multiples of 1/64 and the samples small whole numbers: nothing is rounded.
    #[test]
    fn impulses_through_the_linear_filters_give_the_table_back() {
        for method in Method::ALL.into_iter().filter(|method| *method != Method::SmoothHue) {
            check(method, [64.0, 128.0, 32.0], 64.0, 1e-12);
        }
    }

    /// A ratio's difference quotient over ±h is off by its third derivative: relative h²/ḡ² = 6·10⁻⁵ for a step of ½
    /// about 64, of weights below 4; eleven roundings of values up to 192 in single precision, half of them of either
    /// sign, add 11 · 2⁻²⁴ · 192 / ½ = 2.5·10⁻⁴.
    #[test]
    fn small_impulses_through_smooth_hue_give_its_linearization_back() {
        for means in [[64.0, 64.0, 64.0], [96.0, 64.0, 128.0], [32.0, 64.0, 16.0]] {
            check(Method::SmoothHue, means, 0.5, 5e-4);
        }
    }

    #[test]
    fn weights_keep_flat_fields() {
        for method in Method::ALL {
            let weights = WeightTable::new(method, CfaPattern::Rggb).about([1.5, 0.25]);
            let means = [1.5, 1.0, 0.25];
            for phase in 0..4 {
                for channel in 0..3 {
                    let value: f64 = weights
                        .stencil(phase, channel)
                        .sites()
                        .map(|(offset, weight)| weight * means[weights.class(phase, offset) as usize])
                        .sum();
                    assert!((value - means[channel]).abs() < 1e-14, "{method:?}: {value}");
                }
            }
        }
    }

    #[test]
    fn weights_reach_as_far_as_the_method_says() {
        for method in Method::ALL {
            let weights = WeightTable::new(method, CfaPattern::Gbrg).about([0.7, 1.3]);
            assert_eq!(weights.reach().unsigned_abs(), method.reach(), "{method:?}");
        }
    }

    #[test]
    fn mixtures_of_channels_mix_their_weights() {
        let weights = WeightTable::new(Method::EffectiveColor, CfaPattern::Grbg).about([1.0, 1.0]);
        let mixed = weights.through(&Matrix3::new(0.0, 0.0, 1.0, 2.0, 0.0, 0.0, 1.0, -1.0, 0.0));
        for phase in 0..4 {
            assert_eq!(mixed.stencil(phase, 0), weights.stencil(phase, 2));
            let stencil = weights.stencil(phase, 0);
            assert_eq!(mixed.stencil(phase, 1), &stencil.clone().plus(1.0, stencil));
        }
        assert!(WeightTable::new(Method::SmoothHue, CfaPattern::Rggb).depends_on_hue());
        assert!(!WeightTable::new(Method::EffectiveColor, CfaPattern::Rggb).depends_on_hue());
    }
}
