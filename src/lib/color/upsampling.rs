//! Smooth spectra of colors \[Jakob2019].

#![allow(
    clippy::needless_range_loop,
    reason = "loops over wavelengths that the compiler turns into vectors index several arrays"
)]

use super::lab_from_xyz;
use crate::numerics::vectors::{self, Instructions, Kernel};
use crate::spectrum::{Curve, Observer};
use nalgebra::{Matrix3, Vector3};

/// Where spectra begin and end, nm.
pub const EXTENT_NM: [f64; 2] = [360.0, 830.0];

/// The whole wavelengths of that extent, nm.
pub fn whole_nm() -> impl Iterator<Item = f64> {
    (360..=830).map(f64::from)
}

/// Distance of the nodes on which spectra are summed, nm.
const STEP_NM: f64 = 5.0;
const NODES: usize = 95;
const LANES: usize = 4;
const BLOCKS: usize = NODES.div_ceil(LANES);
/// Nodes between which a smooth spectrum is taken as a polynomial.
const POINTS: usize = 8;

/// The largest of the three tristimulus values relative to white of the spectra that are solved for; colors are scaled to it.
const LEVEL: f64 = 0.25;

/// Spectra whose polynomial is steeper where it crosses zero, or has larger coefficients, are too narrow for the nodes.
const STEEPEST: f64 = 30.0;
const LARGEST: f64 = 200.0;

/// One number a node.
type Nodes = [[f64; LANES]; BLOCKS];

/// The wavelength as the polynomial takes it: −1 to 1.
fn place(wavelength_nm: f64) -> f64 {
    let [first, last] = EXTENT_NM;
    (2.0 * wavelength_nm - first - last) / (last - first)
}

/// A spectrum relative to that of white.
///
/// a · S(λ), S = ½ + x / (2 √(1 + x²)), x = c₀ + c₁ l + c₂ l²        \[Jakob2019]
///
/// l = −1 at 360 nm, 1 at 830 nm. The factor a is that of the unbounded spectra of \[PBRT4, Sec. 4.6.6], but for the level
/// that it scales to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SmoothSpectrum {
    /// The factor a; 0 of black.
    pub factor: f64,
    /// c₀, c₁, c₂.
    pub coefficients: [f64; 3],
}

impl SmoothSpectrum {
    const BLACK: Self = Self { factor: 0.0, coefficients: [0.0; 3] };

    /// Its value at a wavelength in nm.
    pub fn at(&self, wavelength_nm: f64) -> f64 {
        let [constant, linear, quadratic] = self.coefficients;
        let l = place(wavelength_nm);
        self.factor * sigmoid(constant + (linear + quadratic * l) * l)
    }
}

/// ½ + x / (2 √(1 + x²)), which loses no digits where it is small.
fn sigmoid(x: f64) -> f64 {
    let square = 1.0 + x * x;
    let tail = 0.5 / (square + x.abs() * square.sqrt());
    if x < 0.0 { tail } else { 1.0 - tail }
}

/// The same to 10⁻¹⁶ by a single division, and its derivative.
#[inline(always)]
fn quick_sigmoid(x: f64) -> (f64, f64) {
    let square = 1.0 + x * x;
    let derivative = 0.5 / (square * square.sqrt());
    (0.5 + x * square * derivative, derivative)
}

/// Adds products lane by lane.
#[inline(always)]
fn add(sums: &mut [f64; LANES], weights: &[f64; LANES], values: &[f64; LANES]) {
    for lane in 0..LANES {
        sums[lane] += weights[lane] * values[lane];
    }
}

/// The x of a value of the sigmoid, and its derivative.
#[inline(always)]
fn argument(value: f64) -> (f64, f64) {
    let product = value * (1.0 - value);
    let root = product.sqrt();
    ((value - 0.5) / root, 0.25 / (product * root))
}

/// Weights of three sums over wavelengths of a smooth spectrum.
#[derive(Debug, Clone, PartialEq)]
pub struct SmoothWeights([Nodes; 3]);

impl SmoothWeights {
    /// Those that give the sums of `weights` at `wavelengths_nm`; what lies beyond [`EXTENT_NM`] is left out.
    ///
    /// A spectrum is taken between its nodes, 5 nm apart, as the polynomial through the eight nearest: of all that an
    /// [`Upsampler`] gives the sums are within 10⁻⁴ of those with the spectrum itself, within 10⁻⁵ of colors of sRGB.
    pub fn of(wavelengths_nm: &[f64], weights: &[Vec<f64>; 3]) -> Self {
        let mut nodes = [[[0.0; LANES]; BLOCKS]; 3];
        for (index, &nm) in wavelengths_nm.iter().enumerate() {
            if !(EXTENT_NM[0]..=EXTENT_NM[1]).contains(&nm) {
                continue;
            }
            let at = (nm - EXTENT_NM[0]) / STEP_NM;
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within the nodes")]
            let first = (at as usize + 1).saturating_sub(POINTS / 2).min(NODES - POINTS);
            for node in first..first + POINTS {
                let others = (first..first + POINTS).filter(|other| *other != node);
                let share: f64 = others.map(|other| (at - other as f64) / (node as f64 - other as f64)).product();
                for (nodes, weights) in nodes.iter_mut().zip(weights) {
                    nodes[node / LANES][node % LANES] += share * weights[index];
                }
            }
        }
        Self(nodes)
    }

    /// The sum of all weights of each.
    fn totals(&self) -> [f64; 3] {
        self.0.map(|nodes| nodes.as_flattened().iter().sum())
    }
}

/// What became of colors that no spectrum was found for.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Moved {
    /// How many there are.
    pub pixels: u64,
    /// The largest difference between color and spectrum, ΔE\*ab about the white of luminance 1.
    pub delta_e: f64,
}

impl Moved {
    /// Both together.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self { pixels: self.pixels + other.pixels, delta_e: self.delta_e.max(other.delta_e) }
    }
}

/// Finds smooth spectra of colors.
///
/// A color is scaled so that the largest of its tristimulus values, relative to those of white, is ¼; the spectrum that has it
/// is that of \[Jakob2019] and is scaled back. So twice the color is twice the spectrum at every wavelength, gray is flat, and no
/// color is too bright. The three coefficients are solved for by Newton's method to rounding from the solution of the linear
/// problem about gray, each color by itself.
///
/// Colors too pure for a spectrum that the nodes resolve, or beyond all that there is, are moved straight towards the gray of
/// their luminance, by the least of 1024 steps that finds one; those without luminance become black.
#[derive(Debug, Clone, PartialEq)]
pub struct Upsampler {
    matching: SmoothWeights,
    places: Nodes,
    /// Coefficients from x of the tristimulus values, where color is slight.
    start: Matrix3<f64>,
    white: [f64; 3],
    instructions: Instructions,
}

impl Upsampler {
    /// For colors as an observer sees them under an illuminant; none where one of the two is zero everywhere.
    pub fn new(observer: &Observer, illuminant: &Curve) -> Option<Self> {
        let wavelengths: Vec<f64> = whole_nm().collect();
        let sums = observer
            .matching
            .each_ref()
            .map(|curve| -> Vec<f64> { wavelengths.iter().map(|&nm| curve.at(nm) * illuminant.at(nm)).collect() });
        let xyz = sums.each_ref().map(|weights| weights.iter().sum::<f64>());
        let relative = [0, 1, 2].map(|i| sums[i].iter().map(|weight| weight / xyz[i]).collect());
        let matching = SmoothWeights::of(&wavelengths, &relative);
        let place_of = |node: usize| place(EXTENT_NM[0] + STEP_NM * node as f64);
        let places: Nodes = std::array::from_fn(|block| std::array::from_fn(|lane| place_of(block * LANES + lane)));
        let moment = |i: usize, power: i32| -> f64 {
            let nodes = matching.0[i].as_flattened().iter().zip(places.as_flattened());
            nodes.map(|(weight, place)| weight * place.powi(power)).sum()
        };
        let start = Matrix3::from_fn(|i, power| moment(i, [0, 1, 2][power])).try_inverse()?;
        let white = xyz.map(|value| value / xyz[1]);
        let is_sound = matching.totals().into_iter().chain(white).all(f64::is_finite);
        is_sound.then_some(Self { matching, places, start, white, instructions: Instructions::widest() })
    }

    /// XYZ of the illuminant, Y = 1.
    pub fn white(&self) -> [f64; 3] {
        self.white
    }

    /// Works on a narrower set of instructions than the widest there is; spectra are the same.
    #[must_use]
    pub fn on(self, instructions: Instructions) -> Self {
        Self { instructions, ..self }
    }

    /// The spectrum of a color of XYZ, Y = 1 of white, and what became of it; black where it is not finite.
    pub fn spectrum(&self, xyz: [f64; 3]) -> (SmoothSpectrum, Moved) {
        vectors::run_on(self.instructions, One { upsampler: self, xyz })
    }

    /// The sums of the spectra of colors of XYZ, Y = 1 of white.
    ///
    /// # Panics
    ///
    /// Where there are not as many sums as colors.
    pub fn sums(&self, colors: &[[f64; 3]], weights: &SmoothWeights, sums: &mut [[f64; 3]]) -> Moved {
        assert_eq!(colors.len(), sums.len());
        vectors::run_on(self.instructions, Many { upsampler: self, colors, weights, sums })
    }

    #[inline(always)]
    fn solve(&self, xyz: [f64; 3]) -> (SmoothSpectrum, Moved) {
        let color = [0, 1, 2].map(|i| xyz[i] / self.white[i]);
        if color == [0.0; 3] || !color.iter().all(|value| value.is_finite()) {
            return (SmoothSpectrum::BLACK, Moved::default());
        }
        if let Some(found) = self.reached(color) {
            return (found, Moved::default());
        }
        let gray = color[1];
        let at = |share: f64| color.map(|value| gray + share * (value - gray));
        let (mut share, mut found) = (0.0, SmoothSpectrum::BLACK);
        if gray > 0.0 {
            found = self.reached([gray; 3]).unwrap_or(SmoothSpectrum::BLACK);
            for halving in 1..=10 {
                let further = share + 0.5_f64.powi(halving);
                if let Some(spectrum) = self.reached(at(further)) {
                    (share, found) = (further, spectrum);
                }
            }
        }
        let [asked, given] = [color, if found.factor > 0.0 { at(share) } else { [0.0; 3] }]
            .map(|color| Vector3::from(lab_from_xyz(color, [1.0; 3])));
        (found, Moved { pixels: 1, delta_e: (asked - given).norm() })
    }

    /// The spectrum of a color relative to white, where one is found that the nodes resolve.
    #[inline(always)]
    fn reached(&self, color: [f64; 3]) -> Option<SmoothSpectrum> {
        /// What is left of x of the tristimulus values, relative to 1 + |x|, from which one more step leaves nothing but
        /// rounding: each squares it.
        const CONVERGED: f64 = 1e-7;
        let largest = color[0].max(color[1]).max(color[2]);
        let factor = largest / LEVEL;
        let wanted = color.map(|value| value / factor);
        if !wanted.iter().all(|value| *value > 0.0) || !factor.is_normal() {
            return None;
        }
        let x = wanted.map(|value| argument(value).0);
        let mut coefficients = times(&self.start, x);
        let mut state = self.state(coefficients, x);
        for _ in 0..30 {
            let step = solved(&state.slopes, state.rest)?;
            if (0..3).all(|i| state.rest[i].abs() <= CONVERGED * (1.0 + x[i].abs())) {
                let coefficients = [0, 1, 2].map(|j| coefficients[j] - step[j]);
                return resolved(coefficients).then_some(SmoothSpectrum { factor, coefficients });
            }
            let mut share = 1.0;
            let (next, reached) = loop {
                let next = [0, 1, 2].map(|j| coefficients[j] - share * step[j]);
                let reached = self.state(next, x);
                // What is not a number is no progress.
                if reached.size() < state.size() {
                    break (next, reached);
                }
                share *= 0.5;
                if share < 0.01 {
                    return None;
                }
            };
            (coefficients, state) = (next, reached);
        }
        None
    }

    /// How far a spectrum is from the color whose tristimulus values have these x.
    #[inline(always)]
    fn state(&self, [constant, linear, quadratic]: [f64; 3], x: [f64; 3]) -> State {
        let [mut sigmoids, mut derivatives] = [[[0.0; LANES]; BLOCKS]; 2];
        let nodes = sigmoids.as_flattened_mut().iter_mut().zip(derivatives.as_flattened_mut());
        for ((sigmoid, derivative), l) in nodes.zip(self.places.as_flattened()) {
            let x = constant + (linear + quadratic * l) * l;
            (*sigmoid, *derivative) = quick_sigmoid(x);
        }
        let mut values = [[0.0; LANES]; 3];
        let mut slopes = [[[0.0; LANES]; 3]; 3];
        for block in 0..BLOCKS {
            let (sigmoid, l) = (&sigmoids[block], &self.places[block]);
            let constant = derivatives[block];
            let linear: [f64; LANES] = std::array::from_fn(|lane| constant[lane] * l[lane]);
            let quadratic: [f64; LANES] = std::array::from_fn(|lane| linear[lane] * l[lane]);
            for i in 0..3 {
                let weights = &self.matching.0[i][block];
                add(&mut values[i], weights, sigmoid);
                add(&mut slopes[i][0], weights, &constant);
                add(&mut slopes[i][1], weights, &linear);
                add(&mut slopes[i][2], weights, &quadratic);
            }
        }
        let reached = values.map(|lanes| argument(total(lanes)));
        State {
            rest: [0, 1, 2].map(|i| reached[i].0 - x[i]),
            slopes: [0, 1, 2].map(|i| slopes[i].map(|lanes| reached[i].1 * total(lanes))),
        }
    }

    #[inline(always)]
    fn sum(&self, spectrum: &SmoothSpectrum, weights: &SmoothWeights) -> [f64; 3] {
        let [constant, linear, quadratic] = spectrum.coefficients;
        let mut sigmoids = [[0.0; LANES]; BLOCKS];
        for (sigmoid, l) in sigmoids.as_flattened_mut().iter_mut().zip(self.places.as_flattened()) {
            *sigmoid = quick_sigmoid(constant + (linear + quadratic * l) * l).0;
        }
        let mut sums = [[0.0; LANES]; 3];
        for block in 0..BLOCKS {
            for (sums, weights) in sums.iter_mut().zip(&weights.0) {
                add(sums, &weights[block], &sigmoids[block]);
            }
        }
        sums.map(|lanes| spectrum.factor * total(lanes))
    }
}

/// How far a spectrum is from what it shall be: x of its tristimulus values less x of those wanted, and the derivatives.
struct State {
    rest: [f64; 3],
    slopes: [[f64; 3]; 3],
}

impl State {
    /// The largest distance; not a number where one is none.
    #[inline(always)]
    fn size(&self) -> f64 {
        self.rest.iter().fold(0.0, |size: f64, rest| if rest.abs() > size || rest.is_nan() { rest.abs() } else { size })
    }
}

#[inline(always)]
fn total(lanes: [f64; LANES]) -> f64 {
    (lanes[0] + lanes[1]) + (lanes[2] + lanes[3])
}

#[inline(always)]
fn times(matrix: &Matrix3<f64>, vector: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|i| matrix[(i, 0)] * vector[0] + matrix[(i, 1)] * vector[1] + matrix[(i, 2)] * vector[2])
}

/// Solves three equations by Cramer's rule; none where they are singular.
#[inline(always)]
fn solved(rows: &[[f64; 3]; 3], right: [f64; 3]) -> Option<[f64; 3]> {
    let cross =
        |a: [f64; 3], b: [f64; 3]| [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let minors = [cross(rows[1], rows[2]), cross(rows[2], rows[0]), cross(rows[0], rows[1])];
    let determinant = dot(rows[0], minors[0]);
    let solution =
        [0, 1, 2].map(|j| (right[0] * minors[0][j] + right[1] * minors[1][j] + right[2] * minors[2][j]) / determinant);
    solution.iter().all(|value| value.is_finite()).then_some(solution)
}

/// Whether the nodes resolve a spectrum.
#[inline(always)]
fn resolved([constant, linear, quadratic]: [f64; 3]) -> bool {
    // At its zeros the polynomial has the slope ±√(c₁² − 4 c₀ c₂).
    linear * linear - 4.0 * constant * quadratic <= STEEPEST * STEEPEST
        && [constant, linear, quadratic].iter().all(|value| value.abs() <= LARGEST)
}

struct One<'a> {
    upsampler: &'a Upsampler,
    xyz: [f64; 3],
}

impl Kernel for One<'_> {
    type Output = (SmoothSpectrum, Moved);

    #[inline(always)]
    fn run(self) -> Self::Output {
        self.upsampler.solve(self.xyz)
    }
}

struct Many<'a> {
    upsampler: &'a Upsampler,
    colors: &'a [[f64; 3]],
    weights: &'a SmoothWeights,
    sums: &'a mut [[f64; 3]],
}

impl Kernel for Many<'_> {
    type Output = Moved;

    #[inline(always)]
    fn run(self) -> Moved {
        let Self { upsampler, colors, weights, sums } = self;
        let mut moved = Moved::default();
        let mut last = ([0.0; 3], [0.0; 3], Moved::default());
        for (&color, sums) in colors.iter().zip(sums) {
            // Neighbors are often alike.
            if color != last.0 {
                let (spectrum, of_color) = upsampler.solve(color);
                last = (color, upsampler.sum(&spectrum, weights), of_color);
            }
            *sums = last.1;
            moved = moved.plus(last.2);
        }
        moved
    }
}

#[cfg(test)]
mod tests {
    use super::super::rgb::{NamedPrimaries, xyz_from_rgb};
    use super::*;
    use crate::formats::data::{load_illuminant, load_observer};
    use crate::names::Named;

    fn upsampler() -> Upsampler {
        Upsampler::new(&load_observer().unwrap(), &load_illuminant("d65").unwrap()).unwrap()
    }

    /// XYZ of a spectrum under D65, Y = 1 of white, by the tables of 1 nm.
    fn seen(spectrum: &SmoothSpectrum) -> [f64; 3] {
        let (observer, d65) = (load_observer().unwrap(), load_illuminant("d65").unwrap());
        let sum = |curve: &Curve, relative: &dyn Fn(f64) -> f64| -> f64 {
            (360..=830).map(f64::from).map(|nm| curve.at(nm) * d65.at(nm) * relative(nm)).sum()
        };
        let white = sum(&observer.matching[1], &|_| 1.0);
        observer.matching.each_ref().map(|curve| sum(curve, &|nm| spectrum.at(nm)) / white)
    }

    fn cube(steps: u32) -> impl Iterator<Item = Vector3<f64>> {
        let part = move |index: u32| f64::from(index) / f64::from(steps);
        let (count, all) = (steps + 1, (steps + 1).pow(3));
        (0..all).map(move |i| Vector3::new(part(i % count), part(i / count % count), part(i / count / count)))
    }

    fn matrix(upsampler: &Upsampler, set: NamedPrimaries) -> Matrix3<f64> {
        xyz_from_rgb(&set.chromaticities(), upsampler.white()).unwrap()
    }

    /// All of sRGB, its corners too, and the same from 10⁻³⁰ to 10⁶ of white: by the tables of 1 nm each tristimulus value is
    /// that of the color within 10⁻⁶ of itself: what a polynomial through eight nodes leaves. None has to be moved.
    #[test]
    fn spectra_have_the_colors_of_srgb() {
        let upsampler = upsampler();
        let srgb = matrix(&upsampler, NamedPrimaries::Srgb);
        for rgb in cube(5).skip(1) {
            for scale in [1.0, 1e-30, 1e6] {
                let xyz = srgb * rgb * scale;
                let (spectrum, moved) = upsampler.spectrum(xyz.into());
                assert_eq!(moved, Moved::default(), "{rgb} {scale}");
                let made = seen(&spectrum);
                assert!((0..3).all(|i| (made[i] / xyz[i] - 1.0).abs() < 1e-6), "{rgb} {made:?} for {xyz}");
            }
        }
        assert_eq!(upsampler.spectrum([0.0; 3]), (SmoothSpectrum::BLACK, Moved::default()));
    }

    /// Of the primaries of wider sets no spectrum has the color. What is not moved is within 10⁻⁴, that of the nodes; what is
    /// keeps its luminance to that.
    #[test]
    fn colors_of_wide_gamuts_are_met_or_moved_at_their_luminance() {
        let upsampler = upsampler();
        for (set, moves) in [
            (NamedPrimaries::AdobeRgb, false),
            (NamedPrimaries::DisplayP3, true),
            (NamedPrimaries::Rec2020, true),
            (NamedPrimaries::AcesCg, true),
        ] {
            let matrix = matrix(&upsampler, set);
            let mut all = Moved::default();
            for rgb in cube(6).skip(1) {
                let xyz = matrix * rgb;
                let (spectrum, moved) = upsampler.spectrum(xyz.into());
                let made = seen(&spectrum);
                let is_met = |i: usize| (made[i] / xyz[i] - 1.0).abs() < 1e-4;
                assert!(is_met(1) && (moved.pixels > 0 || (is_met(0) && is_met(2))), "{rgb} {made:?} for {xyz}");
                all = all.plus(moved);
            }
            assert_eq!(all.pixels > 0, moves, "{} {all:?}", set.name());
        }
        let (dark, moved) = upsampler.spectrum([0.1, -0.1, 0.1]);
        assert!(dark.factor == 0.0 && moved.pixels == 1 && moved.delta_e > 10.0);
    }

    /// Neutrals are flat to the rounding of the tables, and twice the color is twice the spectrum to the bit.
    #[test]
    fn gray_is_flat_and_light_is_proportional() {
        let upsampler = upsampler();
        let (gray, _) = upsampler.spectrum(upsampler.white().map(|value| 0.18 * value));
        assert!([360.0, 450.0, 830.0].iter().all(|nm| (gray.at(*nm) - 0.18).abs() < 1e-12), "{gray:?}");
        let (once, _) = upsampler.spectrum([0.2, 0.1, 0.3]);
        let (twice, _) = upsampler.spectrum([0.4, 0.2, 0.6]);
        assert_eq!(twice, SmoothSpectrum { factor: 2.0 * once.factor, ..once });
    }

    /// Values that colour-science 0.4.7 prints for the coefficients −9·10⁻⁵, 8.5·10⁻², −20 of a wavelength in nm, to the digits that
    /// it prints.
    #[test]
    fn spectra_are_those_that_others_make_of_their_coefficients() {
        let [quadratic, linear, constant] = [-9e-5, 8.5e-2, -20.0];
        let coefficients = [
            (quadratic * 595.0 + linear) * 595.0 + constant,
            235.0 * (2.0 * quadratic * 595.0 + linear),
            235.0 * 235.0 * quadratic,
        ];
        let spectrum = SmoothSpectrum { factor: 1.0, coefficients };
        for (nm, value) in [(400.0, 0.314_304_6), (420.0, 0.413_332_0), (500.0, 0.5), (600.0, 0.093_133_2)] {
            assert!((spectrum.at(nm) - value).abs() < 1e-7, "{nm} nm: {}", spectrum.at(nm));
        }
    }

    /// Steps of 1/512 along edges of the cube and across it move no value of a spectrum between 410 and 690 nm by more than 0.1
    /// of the brightest: spectra of neighbors are neighbors, on one branch of solutions. Fastest are those near blue, by 0.06.
    #[test]
    fn spectra_of_neighbors_are_neighbors() {
        let upsampler = upsampler();
        let srgb = matrix(&upsampler, NamedPrimaries::Srgb);
        let corner = |bits: u8| Vector3::new(bits & 1, bits >> 1 & 1, bits >> 2).map(f64::from);
        let mut worst = 0.0_f64;
        for (from, to) in (1..8).flat_map(|from| (1..from).map(move |to| (from, to))) {
            let mut last: Option<Vec<f64>> = None;
            for step in 0..=512 {
                let rgb = corner(from).lerp(&corner(to), f64::from(step) / 512.0);
                let (spectrum, _) = upsampler.spectrum((srgb * rgb).into());
                let values: Vec<f64> = (41..=69).map(|nm| spectrum.at(f64::from(10 * nm))).collect();
                let most = values.iter().copied().fold(0.0, f64::max);
                if let Some(last) = last {
                    worst = values.iter().zip(&last).map(|(a, b)| (a - b).abs() / most).fold(worst, f64::max);
                }
                last = Some(values);
            }
        }
        assert!(worst < 0.1, "{worst}");
    }

    /// On all sets of instructions, in any company.
    #[test]
    fn sums_are_the_same_to_the_bit_and_those_of_the_spectra() {
        let upsampler = upsampler();
        let matrix = matrix(&upsampler, NamedPrimaries::DisplayP3);
        let colors: Vec<[f64; 3]> = cube(3).map(|rgb| (matrix * rgb).into()).collect();
        let wavelengths: Vec<f64> = (400..=700).map(f64::from).collect();
        let bell =
            |center: f64| wavelengths.iter().map(|nm| (-((nm - center) / 40.0).powi(2)).exp()).collect::<Vec<_>>();
        let curves = [bell(600.0), bell(540.0), bell(450.0)];
        let weights = SmoothWeights::of(&wavelengths, &curves);
        let on = |instructions: Instructions| {
            let mut sums = vec![[0.0; 3]; colors.len()];
            let moved = upsampler.clone().on(instructions).sums(&colors, &weights, &mut sums);
            (sums, moved)
        };
        let (sums, moved) = on(Instructions::Baseline);
        for instructions in Instructions::ALL {
            assert_eq!(on(instructions), (sums.clone(), moved));
        }
        for (color, sums) in colors.iter().zip(&sums) {
            let (spectrum, _) = upsampler.spectrum(*color);
            let mut alone = [[0.0; 3]];
            upsampler.sums(&[*color], &weights, &mut alone);
            assert_eq!(alone[0], *sums);
            for (curve, sum) in curves.iter().zip(sums) {
                let direct: f64 = wavelengths.iter().zip(curve).map(|(nm, weight)| weight * spectrum.at(*nm)).sum();
                assert!((sum - direct).abs() <= 1e-5 * direct, "{color:?}: {sum} for {direct}");
            }
        }
    }
}
