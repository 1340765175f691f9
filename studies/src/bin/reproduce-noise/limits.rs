//! At how many pixels each approximation of the paper shows, and whether simulations agree.

use crate::camera::{self, Camera, METHODS, SMALL};
use crate::prediction::{Equation, Sites, effective_share, independent, of_frame, weights};
use cyanometer::error::Result;
use cyanometer::numerics::moments::Moments;
use cyanometer::propagation::gains;
use cyanometer::propagation::{self, Equations, Photosite};
use cyanometer::stages::demosaic::Method;
use cyanometer_studies::frames;
use nalgebra::Matrix3;

/// Levels at which approximations are looked at, e⁻.
pub const LEVELS: [f64; 4] = [0.0, 1000.0, 10_000.0, 30_000.0];

/// Frames that check them.
pub const SIZE: [usize; 2] = [1200, 800];
/// How many at each level.
pub const FRAMES: u64 = 3;

/// What the frames of one level showed.
struct Pool {
    electrons: Moments,
    codes: Moments,
    rgb: [Moments; 3],
    xyz: [Moments; 3],
    patches: [Moments; 3],
}

impl Pool {
    fn of(camera: &Camera, level: f64, first_seed: u64) -> Result<Self> {
        let empty = || [(); 3].map(|()| Moments::new(3));
        let mut pool =
            Self { electrons: Moments::new(3), codes: Moments::new(3), rgb: empty(), xyz: empty(), patches: empty() };
        for seed in first_seed..first_seed + FRAMES {
            let electrons = camera.electrons(SIZE, [level; 3], seed)?;
            let codes = frames::codes(&electrons)?;
            pool.electrons.merge(&frames::moments(&electrons));
            pool.codes.merge(&frames::moments(&codes));
            let plane = frames::mosaicked(&codes)?;
            for (index, method) in METHODS.into_iter().enumerate() {
                let rgb = frames::demosaicked(&plane, method)?;
                pool.rgb[index].merge(&frames::moments(&rgb));
                pool.patches[index].merge(&camera::patch_moments(&rgb, SMALL));
                pool.xyz[index].merge(&frames::moments(&camera.xyz(&rgb)?));
            }
        }
        Ok(pool)
    }
}

/// A variance as the approximation has it, as it is in a frame of any size and in those of the check, and what share of
/// the samples is as good as independent.
struct Variances {
    approximate: f64,
    exact: f64,
    of_frame: f64,
    share: f64,
}

/// Variances at a level, e⁻.
type At<'a> = Box<dyn Fn(f64) -> Option<Variances> + 'a>;

/// Variance and number of samples.
type Observed = Box<dyn Fn(&Pool) -> (f64, f64)>;

/// An approximation: what it says at a level, none where nothing can be said, and what was observed.
struct Case<'a> {
    name: &'static str,
    channel: &'static str,
    at: At<'a>,
    observed: Observed,
}

/// An approximation and where it shows.
pub struct Limit {
    /// What is approximated.
    pub name: &'static str,
    /// The channel looked at.
    pub channel: &'static str,
    /// Error of the standard deviation, relative, and the pixels at which it is three standard errors, at each level.
    pub errors: [Option<(f64, f64)>; 4],
    /// The check by simulation.
    pub check: Check,
}

/// A check by simulation.
pub struct Check {
    /// Where, e⁻.
    pub level: f64,
    /// Deviation from the exact standard deviation, in standard errors.
    pub z_exact: f64,
    /// Deviation from the approximation.
    pub z_approximate: f64,
}

fn variance(moments: &Moments, channel: usize) -> f64 {
    moments.covariance(channel, channel).unwrap_or(f64::NAN)
}

/// Three planes of one level are one sample.
fn of_three(moments: &Moments) -> (f64, f64) {
    ((0..3).map(|i| variance(moments, i)).sum::<f64>() / 3.0, 3.0 * moments.count as f64)
}

fn of_one(moments: &Moments, channel: usize) -> (f64, f64) {
    (variance(moments, channel), moments.count as f64)
}

#[allow(clippy::too_many_lines, reason = "a table of cases")]
fn cases(camera: &Camera) -> Vec<Case<'_>> {
    let exact = |level: f64| Sites::of(camera, [level; 3], Equations::Exact);
    let electrons =
        move |level: f64, equations| Photosite::of_electrons(camera.model, equations).moments(level).moments;
    let single = |approximate: f64, exact: f64| Some(Variances { approximate, exact, of_frame: exact, share: 1.0 });
    // Where green is not above its noise the first order is void.
    let holds = move |method: Method, sites: &Sites| {
        method != Method::SmoothHue || propagation::smooth_hue::FirstOrder::of(sites.mean, sites.variance).holds
    };
    let demosaicked = move |name, channel, index: usize, equation: Equation| Case {
        name,
        channel,
        at: Box::new(move |level| {
            let sites = exact(level);
            let weights = weights(equation.method(), &sites);
            let size = [1 << 16; 2];
            holds(equation.method(), &sites).then(|| Variances {
                approximate: equation.covariance(&sites, size)[(index, index)],
                exact: gains::mean_pixel(&weights).covariance(sites.variance)[(index, index)],
                of_frame: of_frame(equation.method(), &sites, SIZE)[(index, index)],
                share: effective_share(&weights, sites.variance)[index],
            })
        }),
        observed: Box::new(move |pool| of_one(&pool.rgb[crate::agreement::index_of(equation.method())], index)),
    };
    let through = move |name, channel, index: usize, method: Method| Case {
        name,
        channel,
        at: Box::new(move |level| {
            let sites = exact(level);
            let matrix = &camera.xyz_from_adu;
            let weights = weights(method, &sites);
            let rgb = gains::mean_pixel(&weights).covariance(sites.variance);
            let xyz = |covariance: Matrix3<f64>| (matrix * covariance * matrix.transpose())[(index, index)];
            holds(method, &sites).then(|| Variances {
                approximate: independent(matrix, &rgb)[(index, index)],
                exact: xyz(rgb),
                of_frame: xyz(of_frame(method, &sites, SIZE)),
                share: effective_share(&weights.through(matrix), sites.variance)[index],
            })
        }),
        observed: Box::new(move |pool| of_one(&pool.xyz[crate::agreement::index_of(method)], index)),
    };
    let patch = move |name, channel, index: usize, method: Method| Case {
        name,
        channel,
        at: Box::new(move |level| {
            let sites = exact(level);
            let weights = weights(method, &sites);
            let count = (SMALL[0] * SMALL[1]) as f64;
            let exact = gains::mean_patch_mean(&weights, SMALL).covariance(sites.variance)[(index, index)];
            let pixel = gains::mean_pixel(&weights).covariance(sites.variance)[(index, index)];
            Some(Variances { approximate: pixel / count, exact, of_frame: exact, share: 1.0 })
        }),
        observed: Box::new(move |pool| of_one(&pool.patches[crate::agreement::index_of(method)], index)),
    };
    vec![
        Case {
            name: "Eq. 11 drops the cross terms λs²",
            channel: "electrons",
            at: Box::new(move |level| {
                let variance = |equations| electrons(level, equations).variance;
                single(variance(Equations::Paper), variance(Equations::Exact))
            }),
            observed: Box::new(|pool| of_three(&pool.electrons)),
        },
        Case {
            name: "the converter's noise is nil (1/12 ADU²)",
            channel: "ADU",
            at: Box::new(move |level| {
                let before = electrons(level, Equations::Exact).variance * camera.adc.adu_per_e.powi(2);
                single(before, exact(level).variance[0])
            }),
            observed: Box::new(|pool| of_three(&pool.codes)),
        },
        demosaicked("BI: 0.53 for 9/16 (Eq. 39a as printed)", "R, B", 0, Equation::Bi39Printed),
        demosaicked("SHTI: all values independent (Eq. 15)", "R, B", 0, Equation::Shti15),
        demosaicked("SHTI: green left out (Eq. 48)", "R, B", 0, Equation::Shti48),
        demosaicked("ECI: Eq. 17 with Table 8", "R, B", 0, Equation::EciEqual),
        demosaicked("ECI: Eq. 16 with Table 8", "G", 1, Equation::EciEqual),
        through("XYZ: Eq. 19 after SHTI, no covariance", "X", 0, Method::SmoothHue),
        through("XYZ: Eq. 19 after SHTI, no covariance", "Y", 1, Method::SmoothHue),
        through("XYZ: Eq. 19 after SHTI, no covariance", "Z", 2, Method::SmoothHue),
        through("XYZ: Eq. 19 after ECI, no covariance", "Y", 1, Method::EffectiveColor),
        patch("error bar of the mean of 30×40 as σ/√n, BI", "R, B", 0, Method::Bilinear),
        patch("error bar of the mean of 30×40 as σ/√n, ECI", "R, B", 0, Method::EffectiveColor),
        patch("error bar of the mean of 30×40 as σ/√n, ECI", "G", 1, Method::EffectiveColor),
    ]
}

/// Works out where each approximation shows, and checks it where its error is largest.
pub fn limits(camera: &Camera, first_seed: u64) -> Result<Vec<Limit>> {
    let mut pools = Vec::new();
    for (index, level) in LEVELS.into_iter().enumerate() {
        pools.push(Pool::of(camera, level, first_seed + FRAMES * index as u64)?);
    }
    let limit = |case: Case<'_>| {
        let found = LEVELS.map(&case.at);
        let error = |v: &Variances| (v.approximate / v.exact).sqrt() - 1.0;
        let errors = found
            .each_ref()
            .map(|variances| variances.as_ref().map(|v| (error(v), (3.0 / error(v)).powi(2) / 2.0 / v.share)));
        let size = |at: usize| errors[at].map_or(0.0, |(error, _)| error.abs());
        let at = (0..LEVELS.len()).fold(0, |best, at| if size(at) > size(best) { at } else { best });
        let (observed, count) = (case.observed)(&pools[at]);
        let z = |of_frame: f64, share: f64| ((observed / of_frame).sqrt() - 1.0) * (2.0 * count * share).sqrt();
        let (z_exact, z_approximate) = found[at].as_ref().map_or((f64::NAN, f64::NAN), |v| {
            (z(v.of_frame, v.share), z(v.of_frame * v.approximate / v.exact, v.share))
        });
        Limit {
            name: case.name,
            channel: case.channel,
            errors,
            check: Check { level: LEVELS[at], z_exact, z_approximate },
        }
    };
    Ok(cases(camera).into_iter().map(limit).collect())
}

/// What mirrored edges add to the standard deviation of a channel in frames of the paper's size.
pub struct Edge {
    /// Method and channel.
    pub what: String,
    /// Standard deviation over that of a large frame, minus one.
    pub error: f64,
    /// The same in standard errors of one frame.
    pub deviations: f64,
    /// Mean over many simulated frames, in standard errors: from the prediction with edges, and without.
    pub z: [f64; 2],
}

/// Frames that check the edges.
pub const EDGE_FRAMES: u64 = 400;

/// Works out what edges do at 10 000 e⁻.
pub fn edges(camera: &Camera, first_seed: u64) -> Result<Vec<Edge>> {
    let electrons = [10_000.0; 3];
    let mut sums = [[0.0; 3]; 3];
    for seed in first_seed..first_seed + EDGE_FRAMES {
        let plane = camera.plane(SMALL, electrons, seed)?;
        for (sums, method) in sums.iter_mut().zip(METHODS) {
            let moments = frames::moments(&frames::demosaicked(&plane, method)?);
            for (channel, sum) in sums.iter_mut().enumerate() {
                *sum += variance(&moments, channel) / EDGE_FRAMES as f64;
            }
        }
    }
    let sites = Sites::of(camera, electrons, Equations::Exact);
    let count = (SMALL[0] * SMALL[1]) as f64;
    let mut found = Vec::new();
    for (sums, method) in sums.iter().zip(METHODS) {
        let weights = weights(method, &sites);
        let large = gains::mean_pixel(&weights).covariance(sites.variance);
        let small = of_frame(method, &sites, SMALL);
        let share = effective_share(&weights, sites.variance);
        for (channel, name) in [(0, "R, B"), (1, "G")] {
            let at = (channel, channel);
            let error = (small[at] / large[at]).sqrt() - 1.0;
            let one = (2.0 * count * share[channel]).sqrt();
            let z = |predicted: f64| ((sums[channel] / predicted).sqrt() - 1.0) * one * (EDGE_FRAMES as f64).sqrt();
            found.push(Edge {
                what: format!("{} {name}", method.names()[0].to_uppercase()),
                error,
                deviations: error * one,
                z: [z(small[at]), z(large[at])],
            });
        }
    }
    Ok(found)
}
