//! The uncertainty that a frame carries for each of its pixels, against the scatter of many exposures of many sensors.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::analysis::statistics::patches::expected_electrons;
use cyanometer::camera::levels::WhiteLevel;
use cyanometer::cfa::{CfaPattern, Class};
use cyanometer::color::{Space, White};
use cyanometer::error::Error;
use cyanometer::frame::mirror;
use cyanometer::metadata::{BlackNoise, FrameHeader, Scene};
use cyanometer::propagation::pixels::PixelNoise;
use cyanometer::propagation::{Equations, FramePrediction, Photosite, of_frame};
use cyanometer::sigma::{COVARIANCE_LAYER, WithSigma};
use cyanometer::stages::adc::{AdcSettings, Digitize};
use cyanometer::stages::black::Black;
use cyanometer::stages::demosaic::stencil::phase;
use cyanometer::stages::demosaic::weights::WeightTable;
use cyanometer::stages::demosaic::{Demosaic, Method};
use cyanometer::stages::mosaic::Mosaic;
use cyanometer::stages::noise::{AddNoise, NoiseSettings};
use cyanometer::stages::to_xyz::{ColorSettings, ToXyz};
use cyanometer::stream::{MemoryFrame, Stage};
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use support::chain::color_settings;
use support::{at, expected, sensor, through};

const WIDTH: usize = 26;
const HEIGHT: usize = 18;

/// A scene that darkens toward its corners and turns from red to blue across: a tenth within any pixel's reach.
fn scene() -> MemoryFrame {
    expected(WIDTH, HEIGHT, |x, y, class| {
        let (dx, dy) = (x as f32 / WIDTH as f32 - 0.5, y as f32 / HEIGHT as f32 - 0.5);
        let fall_off = 1.0 / (1.0 + dx * dx + dy * dy).powi(2);
        let level = [6000.0 - 3000.0 * dx, 9000.0, 12_000.0 + 6000.0 * dx][class as usize];
        level * fall_off
    })
}

fn plane(scene: &MemoryFrame, seed: u64) -> MemoryFrame {
    let settings = NoiseSettings { seed, sensor_seed: seed, ..Default::default() };
    let mosaic = through(scene, &Mosaic::new(&scene.header, None).unwrap());
    let electrons = through(&mosaic, &AddNoise::new(&mosaic.header, &settings).unwrap());
    through(&electrons, &Digitize::new(&electrons.header, &AdcSettings::default()).unwrap())
}

fn demosaicking(plane: &MemoryFrame, method: Method) -> Demosaic {
    Demosaic::new(&plane.header, method, Black::Auto, None).unwrap()
}

fn demosaicked(plane: &MemoryFrame, method: Method) -> MemoryFrame {
    through(plane, &WithSigma::of_demosaicking(demosaicking(plane, method)).unwrap())
}

fn coloring(camera: &FrameHeader, space: Space) -> WithSigma<ToXyz> {
    WithSigma::of_conversion(ToXyz::new(camera, &color_settings(space)).unwrap(), camera).unwrap()
}

/// Many exposures of as many sensors, demosaicked with standard deviations or turned into colors with them.
fn exposures(method: Method, space: Option<Space>) -> Vec<MemoryFrame> {
    let scene = scene();
    // What a stage knows does not hang on the seeds.
    let first = plane(&scene, 0);
    let camera = demosaicking(&first, method);
    let with_sigma = WithSigma::of_demosaicking(demosaicking(&first, method)).unwrap();
    let color = space.map(|space| coloring(camera.header(), space));
    let expose = |seed: u64| {
        let plane = plane(&scene, seed);
        match &color {
            None => through(&plane, &with_sigma),
            Some(color) => through(&through(&plane, &camera), color),
        }
    };
    (0..FRAMES).into_par_iter().map(expose).collect()
}

const FRAMES: u64 = 500;

/// Groups of pixels that a wrong gain would show in: the four phases within, and the rim.
fn group(x: usize, y: usize) -> usize {
    let inner = |place: usize, length: usize| (3..length - 3).contains(&place);
    if inner(x, WIDTH) && inner(y, HEIGHT) { phase(x as i64, y as i64) } else { 4 }
}

/// Mean of (x − x̄)²/σ² over frames and pixels of each group and channel is 1 − 1/n; its error is that of a variance of
/// 500 frames by pixels, a quarter of which count since neighbors are correlated: √(2 · 4/(500 · 60)) = 1.6 % for a
/// phase. Levels that change by a tenth within reach move variances by their curvature, below 1 %.
#[test]
fn pixels_scatter_by_their_standard_deviation() {
    for method in Method::ALL {
        for space in [None, Some(Space::Xyz), Some(Space::Lab), Some(Space::Xyy)] {
            let frames = exposures(method, space);
            let sigmas = if space == Some(Space::Xyz) { 9 } else { 3 };
            let n = FRAMES as f64;
            let mut sums = [[0.0; 3]; 5];
            let mut counts = [0.0; 5];
            for y in 0..HEIGHT {
                for x in 0..WIDTH {
                    let group = group(x, y);
                    counts[group] += 1.0;
                    for (channel, sum) in sums[group].iter_mut().enumerate() {
                        let value = |frame: &MemoryFrame| f64::from(at(frame, x, y, channel));
                        let mean = frames.iter().map(value).sum::<f64>() / n;
                        let deviate = |frame: &MemoryFrame| {
                            let sigma = f64::from(at(frame, x, y, sigmas + channel));
                            ((value(frame) - mean) / sigma).powi(2)
                        };
                        *sum += frames.iter().map(deviate).sum::<f64>() / (n - 1.0);
                    }
                }
            }
            for (group, (sums, count)) in sums.iter().zip(counts).enumerate() {
                for (channel, sum) in sums.iter().enumerate() {
                    let found = sum / count;
                    assert!(
                        (found - 1.0).abs() < 5.0 * 0.016 + 0.01,
                        "{method:?}, {space:?}, group {group}, channel {channel}: {found}"
                    );
                }
            }
        }
    }
}

/// With the covariance of XYZ, the squared Mahalanobis distance from the mean is 3 on average.
#[test]
fn xyz_scatter_by_their_covariance() {
    let frames = exposures(Method::EffectiveColor, Some(Space::Xyz));
    assert_eq!(frames[0].header.geometry.channels[3..9], COVARIANCE_LAYER);
    let n = FRAMES as f64;
    let (mut sum, mut count) = (0.0, 0.0);
    for y in 0..HEIGHT {
        for x in 0..WIDTH {
            let value = |frame: &MemoryFrame| Vector3::from([0, 1, 2].map(|c| f64::from(at(frame, x, y, c))));
            let mean = frames.iter().map(value).sum::<Vector3<f64>>() / n;
            for frame in &frames {
                let [xx, xy, xz, yy, yz, zz] = [3, 4, 5, 6, 7, 8].map(|c| f64::from(at(frame, x, y, c)));
                let covariance = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
                let offset = value(frame) - mean;
                sum += (offset.transpose() * covariance.try_inverse().unwrap() * offset)[0];
                count += (n - 1.0) / n;
                // The layer of standard deviations is its diagonal.
                let sigma = f64::from(at(frame, x, y, 10));
                assert!((sigma * sigma / yy - 1.0).abs() < 1e-5);
            }
        }
    }
    // Variance of a squared distance of three dimensions is 6: √(6 · 4/(500 · 468))/3 = 0.3 %, and 1 % for changing levels.
    assert!((sum / count / 3.0 - 1.0).abs() < 0.025, "{}", sum / count);
}

/// The gains against weights that are spread out over the sites of small frames one by one.
#[test]
fn gains_agree_with_weights_site_by_site() {
    for (width, height) in [(26, 18), (7, 9), (2, 3)] {
        for method in Method::ALL {
            for cfa in CfaPattern::ALL {
                let mut frame = expected(width, height, |_, _, class| [4000.0, 8000.0, 6000.0][class as usize]);
                frame.header.geometry.origin = [1, 2];
                let mosaic = through(&frame, &Mosaic::new(&frame.header, Some(cfa)).unwrap());
                let settings = NoiseSettings { seed: 1, ..Default::default() };
                let noisy = AddNoise::new(&mosaic.header, &settings).unwrap().header().clone();
                let codes = Digitize::new(&noisy, &AdcSettings::default()).unwrap().header().clone();
                let camera = Demosaic::new(&codes, method, Black::Auto, None).unwrap().header().clone();
                let noise = PixelNoise::of(&camera).unwrap();
                let model =
                    cyanometer::stages::noise::NoiseModel::of(&codes, codes.metadata.noise.as_ref().unwrap()).unwrap();
                let adc = codes.metadata.adc.unwrap();
                let variances = [4000.0, 8000.0, 6000.0].map(|e| {
                    Photosite::of_electrons(model, Equations::Exact).digitized(adc).moments(e).moments.variance
                });
                let level = [4000.0, 8000.0, 6000.0].map(|e| e * adc.adu_per_e);
                let weights = WeightTable::new(method, cfa).about([0.5, 0.75]);
                for y in 0..height {
                    for x in 0..width {
                        let (found, holds) = noise.covariance([x, y], level);
                        assert!(holds);
                        let mut on_sites = vec![[0.0; 2]; width * height];
                        let place = phase(x as i64 + 1, y as i64 + 2);
                        for channel in [Class::Red, Class::Green] {
                            for ([dx, dy], weight) in weights.stencil(place, channel as usize).sites() {
                                let column = mirror(x.cast_signed() + dx, width);
                                let row = mirror(y.cast_signed() + dy, height);
                                on_sites[row * width + column][channel as usize] += weight;
                            }
                        }
                        let (mut red, mut green_red) = (0.0, 0.0);
                        for (site, [of_red, of_green]) in on_sites.iter().enumerate() {
                            let class = cfa.class((site % width) as i64 + 1, (site / width) as i64 + 2);
                            red += of_red * of_red * variances[class as usize];
                            green_red += of_red * of_green * variances[class as usize];
                        }
                        // The table of variances is off by less than 10⁻⁵ here.
                        assert!((found[0] / red - 1.0).abs() < 1e-5, "{method:?} {cfa} {x},{y}: {} {red}", found[0]);
                        assert!((found[1] - green_red).abs() < 1e-5 * red, "{method:?} {cfa} {x},{y}");
                    }
                }
            }
        }
    }
}

/// Blue twenty times green, green from its noise floor to well above it: everything stays finite, and pixels where
/// smooth hue transition divides by noise are counted.
#[test]
fn greens_lost_in_noise_are_finite_and_counted() {
    for (green, is_void) in [(0.0, true), (20.0, true), (50.0, true), (1900.0, false)] {
        let scene = expected(40, 30, |_, _, class| match class {
            Class::Blue => 20.0 * green,
            _ => green,
        });
        let plane = plane(&scene, 4);
        let stage = WithSigma::of_demosaicking(demosaicking(&plane, Method::SmoothHue)).unwrap();
        let (camera, counts) = plane.through(&stage).unwrap();
        assert!(camera.samples.iter().all(|sample| sample.is_finite()), "{green}");
        assert_eq!(counts.propagation_void > 600, is_void, "{green}: {}", counts.propagation_void);
        assert!(is_void || counts.propagation_void == 0);
    }
}

#[test]
fn what_is_missing_is_named() {
    let mut plane = plane(&scene(), 1);
    plane.header.metadata.sensor = None;
    let refused = WithSigma::of_demosaicking(demosaicking(&plane, Method::Bilinear)).unwrap_err();
    assert!(matches!(refused, Error::MissingKey { key: "sensor", .. }), "{refused}");
}

/// A frame without noise record, as a real camera's, has all of its sensor's noise.
#[test]
fn a_frame_without_noise_record_has_its_sensors_noise() {
    let scene = scene();
    let plane = plane(&scene, 9);
    let mut real = plane.clone();
    real.header.metadata.noise = None;
    let (known, guessed) = (demosaicked(&plane, Method::Malvar), demosaicked(&real, Method::Malvar));
    assert_eq!(known.samples, guessed.samples);
}

/// A relative matrix M diag(white − black)/H makes of each sample what M makes, standard deviations and covariances
/// included: doubles round to 10⁻¹⁶, and the floats that they end in by one last digit, 1.2·10⁻⁷, at most.
#[test]
fn relative_xyz_scale_as_absolute_ones_do() {
    let mut camera = {
        let first = plane(&scene(), 1);
        through(&first, &demosaicking(&first, Method::Bilinear))
    };
    let exposure = camera.header.metadata.exposure.unwrap();
    for white in [4095.0.into(), WhiteLevel::Classes([3000.0, 4000.0, 3500.0])] {
        camera.header.metadata.white_level_adu = Some(white);
        let black = camera.header.uniform_black_adu().unwrap();
        let [relative, absolute] = both([white.range_above(black); 3], exposure.exposure_s_sr());
        for space in [Space::Xyz, Space::Xyy, Space::Lab] {
            let made = [&relative, &absolute].map(|settings| {
                let stage = ToXyz::new(&camera.header, &ColorSettings { space, ..settings.clone() }).unwrap();
                through(&camera, &WithSigma::of_conversion(stage, &camera.header).unwrap())
            });
            for (a, b) in made[0].samples.iter().zip(&made[1].samples) {
                assert!((a - b).abs() <= 1.2e-7 * b.abs() + 1e-10, "{space:?}: {a} {b}");
            }
            let units = made.map(|frame| frame.header.metadata.unit);
            let wanted = match space {
                Space::Xyz => ["relative", "cd m-2"],
                Space::Xyy => ["1, 1, relative", "1, 1, cd m-2"],
                _ => ["1", "1"],
            };
            assert_eq!(units, wanted);
        }
    }
    // No exposure is asked for, but a white level is.
    let header = &mut camera.header;
    let [relative, absolute] = both([4000.0; 3], exposure.exposure_s_sr());
    header.metadata.exposure = None;
    assert!(ToXyz::new(header, &relative).is_ok());
    assert!(matches!(ToXyz::new(header, &absolute), Err(Error::MissingKey { key: "exposure", .. })));
    for (white, wanted) in
        [(None, "no `white_level_adu`"), (Some(WhiteLevel::Uniform(-1.0)), "is not above its black level")]
    {
        header.metadata.white_level_adu = white;
        let complaint = ToXyz::new(header, &relative).unwrap_err().to_string();
        assert!(complaint.contains(wanted), "{complaint}");
    }
}

/// The sensor's matrix, and what gives the same numbers as a relative one.
fn both(range_adu: [f64; 3], exposure_s_sr: f64) -> [ColorSettings; 2] {
    let absolute = ColorSettings {
        is_relative: false,
        xyz_from_camera: sensor().xyz_from_camera.unwrap(),
        method: None,
        residual: None,
        space: Space::Xyz,
        white: White::Absolute([3000.0, 3000.0, 4000.0]),
        white_luminance: None,
    };
    let scaled = |row: [f64; 3]| [0, 1, 2].map(|j| row[j] * range_adu[j] / exposure_s_sr);
    let relative =
        ColorSettings { is_relative: true, xyz_from_camera: absolute.xyz_from_camera.map(scaled), ..absolute.clone() };
    [relative, absolute]
}

/// What is predicted from the head alone, and the electrons that a patch's mean tells.
#[test]
fn relative_xyz_are_predicted_as_absolute_ones_are() {
    let electrons = [5000.0_f32, 9000.0, 12_000.0];
    let mut scene = expected(8, 8, |_, _, class| electrons[class as usize]);
    let electrons = electrons.map(f64::from);
    scene.header.metadata.scene = Some(Scene::uniform("test", electrons));
    let first = plane(&scene, 1);
    let camera = demosaicking(&first, Method::Bilinear).header().clone();
    let black = camera.uniform_black_adu().unwrap();
    let range = camera.metadata.white_level_adu.unwrap().less([black; 3]).classes();
    let exposure_s_sr = camera.metadata.exposure.unwrap().exposure_s_sr();
    for space in [Space::Xyz, Space::Xyy, Space::Lab] {
        let found = both(range, exposure_s_sr).map(|settings| {
            let header = ToXyz::new(&camera, &ColorSettings { space, ..settings }).unwrap().header().clone();
            let Ok(FramePrediction::Pixels(pixels)) = of_frame(&header, Equations::Exact) else { panic!("{space:?}") };
            (expected_electrons(&header, pixels.mean).unwrap(), pixels)
        });
        for (i, electrons) in electrons.into_iter().enumerate() {
            let [a, b] = found.each_ref().map(|(_, pixels)| pixels.mean[i]);
            assert!((a / b - 1.0).abs() < 1e-9, "{space:?}: {a} {b}");
            // Means of curved spaces have a bias of second order.
            assert!((found[0].0[i] / electrons - 1.0).abs() < 0.01, "{space:?}: {:?}", found[0].0);
            assert!((found[0].0[i] / found[1].0[i] - 1.0).abs() < 1e-9);
            for j in 0..3 {
                let [a, b] = found.each_ref().map(|(_, pixels)| pixels.covariance[(i, j)]);
                assert!((a - b).abs() < 1e-9 * found[1].1.covariance.norm(), "{space:?}: {a} {b}");
            }
        }
    }
}

/// What rows, columns and sites of 2×2 are off together: each by itself, one after another, goes through the demosaicking of a
/// level frame, so that its variance is the sum of the squares of what they make of a pixel.
#[test]
fn the_noise_of_a_measured_black_level_is_common_to_rows_columns_and_sites() {
    let scene = expected(WIDTH, HEIGHT, |_, _, _| 9000.0);
    let level = plane(&scene, 0);
    let noise = BlackNoise { row_adu2: 3.0, column_adu2: 5.0, site_adu2: 2.0 };
    for method in [Method::Bilinear, Method::EffectiveColor, Method::Malvar] {
        let stage = demosaicking(&level, method);
        let mut header = stage.header().clone();
        let without = PixelNoise::of(&header).unwrap();
        header.metadata.black_noise = Some(noise);
        let with = PixelNoise::of(&header).unwrap();
        let mut expected = vec![[0.0; 6]; WIDTH * HEIGHT];
        let mut add = |variance: f64, is_off: &dyn Fn(usize, usize) -> bool| {
            let mut frame = level.clone();
            for (index, sample) in frame.samples.iter_mut().enumerate() {
                *sample = if is_off(index % WIDTH, index / WIDTH) { 1.0 } else { 0.0 };
            }
            let raised = through(&frame, &Demosaic::new(&frame.header, method, Black::None, None).unwrap());
            for (pixel, sums) in expected.iter_mut().enumerate() {
                let value = |k: usize| f64::from(at(&raised, pixel % WIDTH, pixel / WIDTH, k));
                for (sum, [k, m]) in sums.iter_mut().zip([[0, 0], [0, 1], [0, 2], [1, 1], [1, 2], [2, 2]]) {
                    *sum += variance * value(k) * value(m);
                }
            }
        };
        (0..HEIGHT).for_each(|row| add(noise.row_adu2, &|_, y| y == row));
        (0..WIDTH).for_each(|column| add(noise.column_adu2, &|x, _| x == column));
        (0..4).for_each(|site| add(noise.site_adu2, &|x, y| phase(x as i64, y as i64) == site));
        for (pixel, expected) in expected.iter().enumerate() {
            let place = [pixel % WIDTH, pixel / WIDTH];
            let [with, without] = [&with, &without].map(|noise| noise.covariance(place, [4000.0; 3]).0);
            for ((with, without), expected) in with.iter().zip(without).zip(expected) {
                // Samples are single precision.
                assert!((with - without - expected).abs() < 1e-5, "{method:?} {place:?}: {with} {without} {expected}");
            }
        }
    }
}
