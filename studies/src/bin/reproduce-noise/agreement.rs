//! Table 7: how well equations agree with simulated noise.

use crate::camera::{Camera, LARGE, METHODS, SMALL};
use crate::prediction::{Equation, Sites, of_frame, roots};
use crate::sweep::Level;
use cyanometer::propagation::Equations;
use cyanometer::propagation::paper::{Coefficients, effective_color};
use cyanometer::stages::demosaic::Method;

/// The three statistics of Table 7.
#[derive(Clone, Copy)]
pub struct Agreement {
    /// Mean of O − P over the range of O, as the table's head has it.
    pub residual: f64,
    /// Slope of the regression of P on O.
    pub slope: f64,
    /// Correlation of O and P.
    pub correlation: f64,
}

impl Agreement {
    /// Of pairs of observed and predicted values.
    pub fn of(pairs: &[[f64; 2]]) -> Self {
        let n = pairs.len() as f64;
        let mean = |i: usize| pairs.iter().map(|pair| pair[i]).sum::<f64>() / n;
        let means = [mean(0), mean(1)];
        let product =
            |i: usize, j: usize| pairs.iter().map(|pair| (pair[i] - means[i]) * (pair[j] - means[j])).sum::<f64>();
        let observed = || pairs.iter().map(|pair| pair[0]);
        let range = observed().fold(f64::MIN, f64::max) - observed().fold(f64::MAX, f64::min);
        Self {
            residual: (means[0] - means[1]) / range,
            slope: product(0, 1) / product(0, 0),
            correlation: product(0, 1) / (product(0, 0) * product(1, 1)).sqrt(),
        }
    }
}

/// A row of Table 7.
pub struct Row {
    /// Stage and equations.
    pub what: &'static str,
    /// The channels that are pooled.
    pub channel: &'static str,
    /// The paper's numbers; none where the table has no such row.
    pub printed: Option<[f64; 3]>,
    /// By the paper's equations, up to full well: 30×40, large.
    pub paper: [Agreement; 2],
    /// The same without the levels that the converter clips.
    pub paper_below: [Agreement; 2],
    /// By exact moments, up to full well.
    pub exact: [Agreement; 2],
}

/// What a row is of.
#[derive(Clone, Copy)]
enum Stage {
    Planes,
    Camera(Equation),
    Xyz(Equation),
}

/// Stage, equations, channels, and what the paper found.
type Template = (Stage, &'static str, &'static str, &'static [usize], Option<[f64; 3]>);

const TEMPLATES: [Template; 26] = {
    use Equation::{Bi14, Bi39, Bi39Printed, EciEqual, Shti15, Shti48};
    use Stage::{Camera, Planes, Xyz};
    const RB: &[usize] = &[0, 2];
    const BI14: &str = "BI, (11) and (14) mended";
    const BI39: &str = "BI, (11) and (39) mended";
    const BI39_PRINTED: &str = "BI, (11) and (39a) as printed, 0.53";
    const XYZ14: &str = "XYZ, (11), (14) mended and (19)";
    const XYZ39: &str = "XYZ, (11), (39) as printed and (19)";
    const SHTI15: &str = "SHTI, (11) and (15)";
    const SHTI48: &str = "SHTI, (11) and (48)";
    const XYZ15: &str = "XYZ, (11), (15) and (19)";
    const XYZ48: &str = "XYZ, (11), (48) and (19)";
    const ECI: &str = "ECI, (11), (16) and (17)";
    const XYZECI: &str = "XYZ, (11), (16), (17) and (20)";
    [
        (Planes, "PTC, (11)", "R-G-B", &[0, 1, 2], Some([0.010, 1.02, 0.98])),
        (Camera(Bi14), BI14, "R-B", RB, Some([0.006, 1.03, 0.98])),
        (Camera(Bi14), BI14, "G", &[1], Some([0.010, 1.04, 0.98])),
        (Camera(Bi39), BI39, "R-B", RB, None),
        (Camera(Bi39), BI39, "G", &[1], Some([0.010, 1.04, 0.98])),
        (Camera(Bi39Printed), BI39_PRINTED, "R-B", RB, Some([0.001, 1.02, 0.98])),
        (Xyz(Bi14), XYZ14, "X", &[0], Some([0.008, 1.05, 0.98])),
        (Xyz(Bi14), XYZ14, "Y", &[1], Some([0.006, 1.04, 0.98])),
        (Xyz(Bi14), XYZ14, "Z", &[2], Some([-0.002, 1.03, 0.97])),
        (Xyz(Bi39Printed), XYZ39, "X", &[0], Some([0.003, 1.03, 0.98])),
        (Xyz(Bi39Printed), XYZ39, "Y", &[1], Some([0.004, 1.02, 0.98])),
        (Xyz(Bi39Printed), XYZ39, "Z", &[2], Some([-0.008, 1.00, 0.97])),
        (Camera(Shti15), SHTI15, "R-B", RB, Some([0.012, 1.15, 0.97])),
        (Camera(Shti15), SHTI15, "G", &[1], None),
        (Camera(Shti48), SHTI48, "R-B", RB, Some([-0.045, 0.78, 0.97])),
        (Xyz(Shti15), XYZ15, "X", &[0], Some([0.003, 1.10, 0.97])),
        (Xyz(Shti15), XYZ15, "Y", &[1], Some([-0.024, 0.97, 0.97])),
        (Xyz(Shti15), XYZ15, "Z", &[2], Some([0.039, 1.27, 0.97])),
        (Xyz(Shti48), XYZ48, "X", &[0], Some([-0.053, 0.76, 0.97])),
        (Xyz(Shti48), XYZ48, "Y", &[1], Some([-0.062, 0.77, 0.97])),
        (Xyz(Shti48), XYZ48, "Z", &[2], Some([0.039, 0.87, 0.98])),
        (Camera(EciEqual), ECI, "R-B", RB, Some([0.004, 0.98, 0.97])),
        (Camera(EciEqual), ECI, "G", &[1], Some([0.012, 1.03, 0.97])),
        (Xyz(EciEqual), XYZECI, "X", &[0], Some([0.004, 0.99, 0.97])),
        (Xyz(EciEqual), XYZECI, "Y", &[1], Some([0.008, 1.01, 0.97])),
        (Xyz(EciEqual), XYZECI, "Z", &[2], Some([-0.007, 0.97, 0.97])),
    ]
};

/// The highest level that the converter does not clip: full well less five standard deviations and more.
pub const UNCLIPPED_E: f64 = 37_000.0;

/// The rows of Table 7 for equal signals.
pub fn rows(camera: &Camera, levels: &[Level]) -> Vec<Row> {
    TEMPLATES.iter().map(|template| row(camera, levels, template)).collect()
}

fn row(camera: &Camera, levels: &[Level], &(stage, what, channel, channels, printed): &Template) -> Row {
    let predicted = |electrons: f64, size: [usize; 2], equations: Equations| {
        let sites = Sites::of(camera, [electrons; 3], equations);
        let exact = |method: Method| of_frame(method, &sites, size);
        let matrix = &camera.xyz_from_adu;
        match (stage, equations) {
            (Stage::Planes, _) => sites.variance.map(f64::sqrt),
            (Stage::Camera(equation), Equations::Paper) => roots(&equation.covariance(&sites, size)),
            (Stage::Camera(equation), Equations::Exact) => roots(&exact(equation.method())),
            (Stage::Xyz(equation), Equations::Paper) => roots(&equation.xyz(camera, &sites, size)),
            (Stage::Xyz(equation), Equations::Exact) => {
                roots(&(matrix * exact(equation.method()) * matrix.transpose()))
            }
        }
    };
    let pairs = |equations: Equations, top: f64, large: bool| -> Vec<[f64; 2]> {
        let of_level = |level: &Level| {
            let shot = if large { &level.large } else { &level.small };
            let observed = match stage {
                Stage::Planes => shot.planes,
                Stage::Camera(equation) => shot.rgb[index_of(equation.method())],
                Stage::Xyz(equation) => shot.xyz[index_of(equation.method())],
            };
            let predicted = predicted(level.electrons, if large { LARGE } else { SMALL }, equations);
            channels.iter().map(|&i| [observed[i], predicted[i]]).collect::<Vec<_>>()
        };
        levels.iter().filter(|level| level.electrons <= top).flat_map(of_level).collect()
    };
    let both = |equations, top| [false, true].map(|large| Agreement::of(&pairs(equations, top, large)));
    Row {
        what,
        channel,
        printed,
        paper: both(Equations::Paper, f64::INFINITY),
        paper_below: both(Equations::Paper, UNCLIPPED_E),
        exact: both(Equations::Exact, f64::INFINITY),
    }
}

/// The place of a method in [`METHODS`].
pub fn index_of(method: Method) -> usize {
    METHODS.iter().position(|&other| other == method).unwrap_or_default()
}

/// A row of the skies: X, Y or Z.
pub struct SkyRow {
    /// The stimulus.
    pub channel: &'static str,
    /// The paper's numbers.
    pub printed: [f64; 3],
    /// By Eqs. 11, 16, 17, 20 and the mean coefficients of Table 8.
    pub paper: [Agreement; 2],
    /// By the same equations with the mean coefficients of our skies.
    pub own: [Agreement; 2],
    /// By exact moments.
    pub exact: [Agreement; 2],
}

/// Standard deviations of X, Y and Z from electrons and the size of the frame.
type Predicted<'a> = &'a dyn Fn(&[f64; 3], [usize; 2]) -> [f64; 3];

/// The last rows of Table 7: noise of XYZ of each sky, as simulated at two sizes and as predicted.
/// `own` are mean coefficients.
pub fn sky_rows(
    camera: &Camera,
    observed: &[[[f64; 3]; 2]],
    sizes: [[usize; 2]; 2],
    own: &Coefficients,
) -> Vec<SkyRow> {
    let matrix = &camera.xyz_from_adu;
    let by_paper =
        |e: &[f64; 3], size| roots(&Equation::EciSkies.xyz(camera, &Sites::of(camera, *e, Equations::Paper), size));
    let by_own = |e: &[f64; 3], _| {
        let covariance = effective_color(Sites::of(camera, *e, Equations::Paper).variance, own);
        roots(&(matrix * covariance * matrix.transpose()))
    };
    let exactly = |e: &[f64; 3], size| {
        let covariance = of_frame(Method::EffectiveColor, &Sites::of(camera, *e, Equations::Exact), size);
        roots(&(matrix * covariance * matrix.transpose()))
    };
    let agreement = |which: usize, channel: usize, predicted: Predicted<'_>| {
        let pair = |(e, o): (&[f64; 3], &[[f64; 3]; 2])| [o[which][channel], predicted(e, sizes[which])[channel]];
        Agreement::of(&camera.skies.iter().zip(observed).map(pair).collect::<Vec<_>>())
    };
    let printed = [("X", [0.062, 1.10, 0.99]), ("Y", [0.030, 1.03, 0.99]), ("Z", [-0.007, 0.95, 0.98])];
    let row = |(channel, (name, printed)): (usize, (&'static str, [f64; 3]))| SkyRow {
        channel: name,
        printed,
        paper: [0, 1].map(|which| agreement(which, channel, &by_paper)),
        own: [0, 1].map(|which| agreement(which, channel, &by_own)),
        exact: [0, 1].map(|which| agreement(which, channel, &exactly)),
    };
    printed.into_iter().enumerate().map(row).collect()
}
