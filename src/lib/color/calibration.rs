//! From a camera's signals to XYZ by the matrices of its makers, as a DNG has them \[DNG2023, ch. 6, Mapping Camera Color
//! Space to CIE XYZ Space].

use super::temperature::{correlated, temperature_and_duv};
use super::{D50_XY, xyz_of_chromaticity};
use crate::spectrum::Observer;
use nalgebra::{Matrix3, Vector3};

/// Steps of the search for a white from D50 on, and where it ends, as Adobe's own program has them.
const MOST_STEPS: usize = 30;
const NEAR: f64 = 1e-7;

const NO_WHITE: &str = "no white of the exposure is that of AsShotNeutral by the matrices for its own temperature";

/// The matrices for one illuminant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Illuminated {
    /// Temperature of the illuminant, K; 0 where there is only one.
    pub temperature_k: f64,
    /// Its chromaticity, which counts where there are three.
    pub white_xy: Option<[f64; 2]>,
    /// Reference camera from XYZ, CM.
    pub color_matrix: Matrix3<f64>,
    /// This camera from the reference camera, CC.
    pub camera_calibration: Matrix3<f64>,
    /// XYZ under D50 from the signals of the reference camera, white 1, FM.
    pub forward_matrix: Option<Matrix3<f64>>,
}

/// What is known of the light of an exposure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Light {
    /// Signals of R, G and B of what is white, in any unit.
    Neutral([f64; 3]),
    /// Its chromaticity.
    White([f64; 2]),
}

/// A camera's matrices for one illuminant, two or three.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Calibration {
    /// That of the one or of the first illuminant.
    pub first: Illuminated,
    /// That of the second.
    pub second: Option<Illuminated>,
    /// That of the third.
    pub third: Option<Illuminated>,
    /// Gains before the converter, AB.
    pub analog_balance: [f64; 3],
}

/// A matrix for a white.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mapped {
    /// XYZ from signals, shares of white level less black level. The white whose largest signal is 1 has Y = 1.
    pub xyz_from_camera: Matrix3<f64>,
    /// Chromaticity of the white.
    pub white_xy: [f64; 2],
}

impl Calibration {
    /// The matrix for a light. XYZ are those of the scene under its own light: nothing adapts them to D50.
    ///
    /// XYZ = (AB · CC · CM)⁻¹ · camera, times the largest signal of the white of Y = 1
    ///
    /// # Errors
    ///
    /// What is wrong, in words: matrices that cannot be inverted, or a light that is none.
    pub fn mapped(&self, observer: &Observer, light: Light) -> Result<Mapped, String> {
        let white_xy = match light {
            Light::White(xy) => checked(xy)?,
            Light::Neutral(neutral) => self.white_of(observer, neutral)?,
        };
        let camera_from_xyz = self.camera_from_xyz(observer, white_xy);
        let white = camera_from_xyz * Vector3::from(xyz_of_chromaticity(white_xy, 1.0));
        let largest = white.max();
        if !(white.min() > 0.0 && largest.is_finite()) {
            return Err(format!("under the white {} they give a signal that is not above 0", in_words(white_xy)));
        }
        Ok(Mapped { xyz_from_camera: inverse(&camera_from_xyz)? * largest, white_xy })
    }

    /// The matrix for a light by FM, with XYZ adapted to D50, which [`Mapped::white_xy`] then is.
    ///
    /// XYZ = FM · diag(1 / (AB · CC)⁻¹ n) · (AB · CC)⁻¹ · camera        n: signals of the white, the largest 1
    ///
    /// # Errors
    ///
    /// Those of [`Self::mapped`]; that a matrix FM is missing.
    pub fn mapped_forward(&self, observer: &Observer, light: Light) -> Result<Mapped, String> {
        let missing = || {
            let has = match (&self.second, &self.third) {
                (_, Some(_)) => "ColorMatrix1, ColorMatrix2 and ColorMatrix3",
                (Some(_), None) => "ColorMatrix1 and ColorMatrix2",
                (None, None) => "ColorMatrix1",
            };
            format!("it has no ForwardMatrix for each of its illuminants, but {has}, which `--own-matrix color` takes")
        };
        if self.sets().any(|set| set.forward_matrix.is_none()) {
            return Err(missing());
        }
        let Mapped { xyz_from_camera, white_xy } = self.mapped(observer, light)?;
        let neutral = inverse(&xyz_from_camera)? * Vector3::from(xyz_of_chromaticity(white_xy, 1.0));
        let shares = self.shares(observer, white_xy);
        let forward = self.mixed(shares, |set| set.forward_matrix.unwrap_or_else(Matrix3::identity));
        let analog_balance = Matrix3::from_diagonal(&Vector3::from(self.analog_balance));
        let reference = inverse(&(analog_balance * self.mixed(shares, |set| set.camera_calibration)))?;
        let gains = Matrix3::from_diagonal(&(reference * neutral).map(f64::recip));
        Ok(Mapped { xyz_from_camera: forward * gains * reference, white_xy: D50_XY })
    }

    fn sets(&self) -> impl Iterator<Item = &Illuminated> {
        std::iter::once(&self.first).chain(&self.second).chain(&self.third)
    }

    /// What the illuminants have, by the shares of each.
    fn mixed(&self, shares: [f64; 3], of: impl Fn(&Illuminated) -> Matrix3<f64>) -> Matrix3<f64> {
        if self.second.is_none() {
            return of(&self.first);
        }
        self.sets().zip(shares).fold(Matrix3::zeros(), |sum, (set, share)| sum + of(set) * share)
    }

    /// Camera from XYZ for a white, AB · CC · CM. Of two illuminants CM and CC are linear in the reciprocal of its correlated color
    /// temperature between theirs, and constant beyond; of three they are means by the weights of the DNG SDK.
    pub fn camera_from_xyz(&self, observer: &Observer, white_xy: [f64; 2]) -> Matrix3<f64> {
        self.at_shares(self.shares(observer, white_xy))
    }

    /// The same by the shares of the illuminants.
    fn at_shares(&self, shares: [f64; 3]) -> Matrix3<f64> {
        let analog_balance = Matrix3::from_diagonal(&Vector3::from(self.analog_balance));
        analog_balance * self.mixed(shares, |set| set.camera_calibration) * self.mixed(shares, |set| set.color_matrix)
    }

    /// The shares of the illuminants for a white.
    fn shares(&self, observer: &Observer, white_xy: [f64; 2]) -> [f64; 3] {
        let places = || {
            let of = |set: &Illuminated| Some(temperature_and_duv(observer, set.white_xy?));
            Some([of(&self.first)?, of(self.second.as_ref()?)?, of(self.third.as_ref()?)?])
        };
        match places() {
            Some(places) => shares_of_three(temperature_and_duv(observer, white_xy), places),
            None => of_two(self.share_of_first(observer, white_xy)),
        }
    }

    fn share_of_first(&self, observer: &Observer, white_xy: [f64; 2]) -> f64 {
        let Some(second) = &self.second else { return 1.0 };
        let reciprocals = [self.first.temperature_k, second.temperature_k].map(f64::recip);
        if reciprocals[0] == reciprocals[1] {
            return 1.0;
        }
        let at = correlated(observer, white_xy).temperature_k.recip();
        ((at - reciprocals[1]) / (reciprocals[0] - reciprocals[1])).clamp(0.0, 1.0)
    }

    /// The chromaticity whose signals are in proportion to `neutral`: the matrix depends on it, so that it is guessed, from D50
    /// on, until it stays, or, where it goes to and fro, sought between the last two.
    fn white_of(&self, observer: &Observer, neutral: [f64; 3]) -> Result<[f64; 2], String> {
        if !neutral.iter().all(|signal| *signal > 0.0 && signal.is_finite()) {
            return Err("AsShotNeutral has a number that is not above 0".into());
        }
        if self.third.is_some() {
            return self.white_among_three(observer, neutral);
        }
        let mut last = D50_XY;
        for _ in 0..MOST_STEPS {
            let next = self.white_at(of_two(self.share_of_first(observer, last)), neutral)?;
            if (next[0] - last[0]).abs() + (next[1] - last[1]).abs() < NEAR {
                return Ok(next);
            }
            last = if self.second.is_some() { next } else { return Ok(next) };
        }
        self.consistent_white(observer, neutral, self.share_of_first(observer, last))
    }

    /// The white whose own matrices take `neutral` to it, among three illuminants: guess by guess from D50 on, and where these go to and fro
    /// by half of each step, a quarter, and so on.
    fn white_among_three(&self, observer: &Observer, neutral: [f64; 3]) -> Result<[f64; 2], String> {
        const HALVINGS: i32 = 5;
        let mut last = D50_XY;
        for halving in 0..HALVINGS {
            for _ in 0..MOST_STEPS << halving {
                let next = self.white_at(self.shares(observer, last), neutral)?;
                if (next[0] - last[0]).abs() + (next[1] - last[1]).abs() < NEAR {
                    return Ok(next);
                }
                let part = 0.5_f64.powi(halving);
                last = [0, 1].map(|axis| last[axis] + part * (next[axis] - last[axis]));
            }
        }
        Err(NO_WHITE.into())
    }

    /// The chromaticity of `neutral` by the matrices of the shares of the illuminants.
    fn white_at(&self, shares: [f64; 3], neutral: [f64; 3]) -> Result<[f64; 2], String> {
        let xyz = inverse(&self.at_shares(shares))? * Vector3::from(neutral);
        checked([xyz.x / xyz.sum(), xyz.y / xyz.sum()])
    }

    /// The white whose own share of the first illuminant is that by which it is found: by halves between a share and the one that
    /// follows from it, or from 0 to 1, where there is one, as what follows is continuous and no less than 0 and no more than 1.
    fn consistent_white(&self, observer: &Observer, neutral: [f64; 3], share: f64) -> Result<[f64; 2], String> {
        const HALVES: usize = 52;
        /// What a share may be off by: the temperature of a white is found to 10⁻⁶.
        const OFF: f64 = 1e-4;
        let rise = |share: f64| -> Result<f64, String> {
            Ok(self.share_of_first(observer, self.white_at(of_two(share), neutral)?) - share)
        };
        let next = share + rise(share)?;
        let [mut low, mut high] = [share.min(next), share.max(next)];
        if !(rise(low)? >= 0.0 && rise(high)? <= 0.0) {
            [low, high] = [0.0, 1.0];
        }
        for _ in 0..HALVES {
            let middle = low.midpoint(high);
            if rise(middle)? > 0.0 { low = middle } else { high = middle }
        }
        let found = low.midpoint(high);
        if rise(found)?.abs() > OFF {
            return Err(NO_WHITE.into());
        }
        self.white_at(of_two(found), neutral)
    }
}

/// The shares of two illuminants by that of the first.
fn of_two(share: f64) -> [f64; 3] {
    [share, 1.0 - share, 0.0]
}

/// The shares of three illuminants for a white, each of which lies at its correlated color temperature T in K and Duv:
///
/// w = 1/(d² + 10⁻⁸),  d² = (15 Duv − 15 Duvᵢ)² + (t − tᵢ)²,  t = min(1500 K / T, 1)
///
/// Of w/Σw the share is s = w² (3 − 2 w), of that max(0, s − 0.02), brought to a sum of 1: the weights of
/// Adobe's DNG SDK 1.7 (`CalculateTripleIlluminantWeights`), whose tint is 3000 Duv.
fn shares_of_three(white: [f64; 2], lights: [[f64; 2]; 3]) -> [f64; 3] {
    const PER_DUV: f64 = 15.0;
    const HOTTEST_T: f64 = 1500.0;
    const LEAST_SQUARE: f64 = 1e-8;
    const LEAST_SHARE: f64 = 0.02;
    let place = |[temperature_k, duv]: [f64; 2]| [PER_DUV * duv, (HOTTEST_T / temperature_k).min(1.0)];
    let own = place(white);
    let weights = lights.map(place).map(|[tint, t]| {
        let square = (tint - own[0]).powi(2) + (t - own[1]).powi(2);
        (square + LEAST_SQUARE).recip()
    });
    let sum: f64 = weights.iter().sum();
    let shares = weights.map(|weight| weight / sum).map(|w| (w * w * (3.0 - 2.0 * w) - LEAST_SHARE).max(0.0));
    let sum: f64 = shares.iter().sum();
    shares.map(|share| share / sum)
}

fn in_words([x, y]: [f64; 2]) -> String {
    format!("x {x:.4}, y {y:.4}")
}

/// A chromaticity that light can have, roughly.
fn checked(xy: [f64; 2]) -> Result<[f64; 2], String> {
    let [x, y] = xy;
    if x > 0.0 && y > 0.0 && x + y < 1.0 {
        Ok(xy)
    } else {
        Err(format!("the white of the exposure, {}, is no light", in_words(xy)))
    }
}

fn inverse(matrix: &Matrix3<f64>) -> Result<Matrix3<f64>, String> {
    matrix.try_inverse().ok_or_else(|| "they are singular: three signals would not give three stimuli".into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::D65_XY;
    use crate::color::adaptation::Adaptation;
    use crate::formats::data::load_observer;

    fn two() -> Calibration {
        let set = |temperature_k, color_matrix| Illuminated {
            temperature_k,
            white_xy: None,
            color_matrix,
            camera_calibration: Matrix3::identity(),
            forward_matrix: None,
        };
        // Of the size of a camera's, for A and D65.
        let warm = Matrix3::new(0.7, -0.1, -0.05, -0.45, 1.25, 0.22, -0.07, 0.17, 0.55);
        let cold = Matrix3::new(0.6, -0.05, -0.08, -0.5, 1.3, 0.2, -0.1, 0.2, 0.65);
        Calibration { first: set(2850.0, warm), second: Some(set(6500.0, cold)), third: None, analog_balance: [1.0; 3] }
    }

    /// A neutral made of a white leads back to it, and the matrix takes the neutral of largest signal 1 to Y = 1; the
    /// search ends within 10⁻⁷, each step being a few times nearer.
    #[test]
    fn a_neutral_leads_back_to_its_white() {
        let observer = load_observer().unwrap();
        let calibration = Calibration { analog_balance: [1.0, 0.8, 1.3], ..two() };
        for white in [D50_XY, D65_XY, [0.40, 0.39], [0.46, 0.41], [0.28, 0.29]] {
            let signals =
                calibration.camera_from_xyz(&observer, white) * Vector3::from(xyz_of_chromaticity(white, 3.7));
            let mapped = calibration.mapped(&observer, Light::Neutral(signals.into())).unwrap();
            assert!((0..2).all(|i| (mapped.white_xy[i] - white[i]).abs() < 1e-6), "{mapped:?}, not {white:?}");
            let known = calibration.mapped(&observer, Light::White(white)).unwrap();
            let xyz = known.xyz_from_camera * (signals / signals.max());
            let expected = Vector3::from(xyz_of_chromaticity(white, 1.0));
            assert!((xyz - expected).norm() < 1e-12, "{xyz} {expected}");
        }
    }

    /// A, D65, and a light between them that is green.
    const LIGHTS: [[f64; 2]; 3] = [[0.447_57, 0.407_45], [0.312_71, 0.329_02], [0.38, 0.42]];

    fn three() -> Calibration {
        let plain = two();
        let green = Matrix3::new(0.64, -0.02, -0.07, -0.4, 1.22, 0.2, -0.05, 0.16, 0.58);
        let lit = |set: Illuminated, white_xy| Illuminated { white_xy: Some(white_xy), ..set };
        let third = Illuminated { color_matrix: green, ..plain.first };
        let [first, second] = [plain.first, plain.second.unwrap()];
        let second = Some(lit(second, LIGHTS[1]));
        Calibration { first: lit(first, LIGHTS[0]), second, third: Some(lit(third, LIGHTS[2])), ..plain }
    }

    /// Shares by numpy, with the isotherms of Robertson's table, which are off by some K and 10⁻⁴ of Duv: a share is by 3·10⁻³.
    #[test]
    fn shares_of_three_lights_are_those_of_another_program() {
        let (observer, calibration) = (load_observer().unwrap(), three());
        for (white, wanted) in [
            (LIGHTS[0], [1.0, 0.0, 0.0]),
            (LIGHTS[1], [0.0, 1.0, 0.0]),
            (LIGHTS[2], [0.0, 0.0, 1.0]),
            ([0.35, 0.36], [0.01413, 0.98587, 0.0]),
            ([0.37, 0.38], [0.14256, 0.77479, 0.08265]),
            ([0.40, 0.40], [0.59933, 0.27488, 0.12579]),
        ] {
            let shares = calibration.shares(&observer, white);
            let off = (0..3).map(|i| (shares[i] - wanted[i]).abs()).fold(0.0, f64::max);
            assert!(off < 3e-3, "{white:?}: {shares:?}, not {wanted:?}");
            assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        }
    }

    /// Among three lights too a neutral made of a white leads back to it: the search ends within 10⁻⁷, of steps that are parts of what is
    /// left.
    #[test]
    fn a_neutral_leads_back_to_its_white_among_three_lights() {
        let (observer, calibration) = (load_observer().unwrap(), three());
        for white in [LIGHTS[0], LIGHTS[1], LIGHTS[2], [0.35, 0.36], [0.37, 0.38], [0.40, 0.40], [0.36, 0.40]] {
            let signals =
                calibration.camera_from_xyz(&observer, white) * Vector3::from(xyz_of_chromaticity(white, 3.7));
            let mapped = calibration.mapped(&observer, Light::Neutral(signals.into())).unwrap();
            assert!((0..2).all(|i| (mapped.white_xy[i] - white[i]).abs() < 1e-5), "{mapped:?}, not {white:?}");
        }
        let own = calibration.mapped(&observer, Light::White(LIGHTS[2])).unwrap().xyz_from_camera;
        let back = calibration.third.unwrap().color_matrix.try_inverse().unwrap();
        assert!((own / own[(0, 0)] - back / back[(0, 0)]).amax() < 1e-6);
        assert!(calibration.mapped_forward(&observer, Light::White(LIGHTS[2])).unwrap_err().contains("ColorMatrix3"));
    }

    #[test]
    fn beyond_the_illuminants_their_own_matrices_count_and_between_them_mireds() {
        let (observer, calibration) = (load_observer().unwrap(), two());
        let body = |temperature_k| crate::color::locus::planckian(&observer, temperature_k);
        let at = |temperature_k| calibration.camera_from_xyz(&observer, body(temperature_k));
        let second = calibration.second.unwrap().color_matrix;
        assert_eq!(at(2000.0), calibration.first.color_matrix);
        assert_eq!(at(9000.0), second);
        let middle = 2.0 / (1.0 / 2850.0 + 1.0 / 6500.0);
        let expected = (calibration.first.color_matrix + second) * 0.5;
        assert!((at(middle) - expected).norm() < 1e-4);
    }

    /// Forward matrices that are made of the color matrices for their own illuminant, adapted to D50: what is white becomes
    /// D50 of Y = 1 where its largest signal is 1, and at the illuminants all colors are those of the color matrix, adapted.
    #[test]
    fn forward_matrices_give_colors_under_d50() {
        let observer = load_observer().unwrap();
        let plain = Calibration { analog_balance: [1.0, 0.8, 1.3], ..two() };
        let with_forward = |set: Illuminated| {
            let white = crate::color::locus::planckian(&observer, set.temperature_k);
            let adaptation = Adaptation::Bradford.between(white, D50_XY).unwrap();
            let neutral = set.color_matrix * Vector3::from(xyz_of_chromaticity(white, 1.0));
            let back = set.color_matrix.try_inverse().unwrap();
            let forward = adaptation * back * Matrix3::from_diagonal(&neutral);
            Illuminated { forward_matrix: Some(forward), ..set }
        };
        assert!(
            plain
                .mapped_forward(&observer, Light::White(D65_XY))
                .unwrap_err()
                .ends_with(", which `--own-matrix color` takes")
        );
        let (first, second) = (with_forward(plain.first), plain.second.map(with_forward));
        let calibration = Calibration { first, second, ..plain };
        for white in [D65_XY, [0.40, 0.39]] {
            let mapped = calibration.mapped_forward(&observer, Light::White(white)).unwrap();
            let signals =
                calibration.camera_from_xyz(&observer, white) * Vector3::from(xyz_of_chromaticity(white, 1.0));
            let seen = mapped.xyz_from_camera * (signals / signals.max());
            assert!(
                (seen - Vector3::from(xyz_of_chromaticity(D50_XY, 1.0))).amax() < 1e-12 && mapped.white_xy == D50_XY
            );
        }
        for set in [Some(first), second].into_iter().flatten() {
            let white = crate::color::locus::planckian(&observer, set.temperature_k);
            let adapted = Adaptation::Bradford.between(white, D50_XY).unwrap()
                * calibration.mapped(&observer, Light::White(white)).unwrap().xyz_from_camera;
            let forward = calibration.mapped_forward(&observer, Light::White(white)).unwrap().xyz_from_camera;
            // The temperature of the white is found to 10⁻⁶.
            assert!((adapted - forward).amax() < 1e-5, "{adapted} {forward}");
        }
    }

    /// Matrices so unlike that guesses go to and fro: the white is still that of the matrices for its own temperature, so that they take the
    /// neutral to it.
    #[test]
    fn a_white_that_guesses_jump_about_is_found() {
        let observer = load_observer().unwrap();
        let far = |set: Illuminated, red: f64| {
            let mut color_matrix = set.color_matrix;
            color_matrix.row_mut(0).scale_mut(red);
            Illuminated { color_matrix, ..set }
        };
        let plain = two();
        let (first, second) = (far(plain.first, 1.4), plain.second.map(|second| far(second, 1.0 / 1.4)));
        let calibration = Calibration { first, second, ..plain };
        let mut jumps = 0;
        for white in [[0.36, 0.37], [0.40, 0.39]] {
            let signals =
                calibration.camera_from_xyz(&observer, white) * Vector3::from(xyz_of_chromaticity(white, 1.0));
            let mapped = calibration.mapped(&observer, Light::Neutral(signals.into())).unwrap();
            let found = crate::color::chromaticity((mapped.xyz_from_camera * signals).into());
            assert!((0..2).all(|i| (found[i] - mapped.white_xy[i]).abs() < 1e-4), "{found:?} {mapped:?}");
            let guess = |xy| {
                let inverse = calibration.camera_from_xyz(&observer, xy).try_inverse().unwrap();
                crate::color::chromaticity((inverse * signals).into())
            };
            let end = (0..MOST_STEPS).fold(D50_XY, |xy, _| guess(xy));
            jumps += usize::from((guess(end)[0] - end[0]).abs() > 1e-3);
        }
        assert!(jumps > 0);
    }

    #[test]
    fn what_is_no_light_or_no_matrix_is_told() {
        let observer = load_observer().unwrap();
        let told = |calibration: Calibration, light| calibration.mapped(&observer, light).unwrap_err();
        assert!(told(two(), Light::Neutral([0.0, 1.0, 1.0])).contains("AsShotNeutral"));
        assert!(told(two(), Light::White([0.9, 0.2])).contains("is no light"));
        let flat = Illuminated { color_matrix: Matrix3::repeat(1.0), ..two().first };
        let singular = Calibration { first: flat, second: None, ..two() };
        assert!(told(singular, Light::White(D65_XY)).contains("singular"));
    }
}
