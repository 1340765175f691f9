//! What of the noise of pixels is drawn anew in each exposure, and what is the same in all: beside sums over all that rows, columns and
//! photosites have, and beside frames.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use cyanometer::camera::readout::ReadOut;
use cyanometer::camera::taps::{TapLayout, Taps};
use cyanometer::chain::{
    CameraSetup, ChainPrediction, ChainStage, Predictor, PredictorSettings, StagePrediction, uniform_frame,
};
use cyanometer::color::{Space, White};
use cyanometer::metadata::{FrameHeader, Scene};
use cyanometer::numerics::normal::{cumulative, density};
use cyanometer::propagation::{Equations, FramePrediction, Repeated};
use cyanometer::stages::demosaic::Method;
use cyanometer::stages::noise::NoiseSettings;
use cyanometer::stages::to_xyz::ColorSettings;
use cyanometer::stream::Stage;

/// A camera of such a read-out that no noise has but what is set.
fn camera(set: impl FnOnce(&mut ReadOut)) -> CameraSetup {
    let mut sensor = support::sensor();
    let readout = sensor.readout.as_mut().unwrap();
    (readout.dark_current_na_per_cm2, readout.dark_current_e_per_s) = (None, Some(0.0));
    (readout.dcnu, readout.prnu, readout.read_noise_e) = (0.0, 0.0, 0.0);
    (readout.width, readout.height, readout.full_well_e) = (64, 48, 1e5);
    set(readout);
    readout.check().unwrap();
    let exposure = cyanometer::camera::optics::Exposure { exposure_s: 0.1, ..support::EXPOSURE };
    CameraSetup { method: Method::Bilinear, ..CameraSetup::new(sensor, exposure) }
}

fn lab() -> ColorSettings {
    ColorSettings {
        xyz_from_camera: [[8.7e-4, 4.5e-5, 4.4e-5], [3.7e-4, 3.1e-4, -2.6e-5], [1.0e-4, -1.6e-4, 5.3e-4]],
        method: None,
        is_relative: false,
        residual: None,
        space: Space::Lab,
        white: White::D65,
        white_luminance: None,
    }
}

fn predicted(setup: &CameraSetup, light: [f64; 3]) -> ChainPrediction {
    let settings = PredictorSettings { color: Some(lab()), ..PredictorSettings::of(setup.clone()) };
    Predictor::new(settings).unwrap().predict(light).unwrap()
}

fn stage(found: &ChainPrediction, wanted: ChainStage) -> &StagePrediction {
    found.stages.iter().find(|stage| stage.stage == wanted).unwrap()
}

/// The head of demosaicked frames.
fn demosaicked(setup: &CameraSetup, light: [f64; 3]) -> FrameHeader {
    let scene = Scene { expected_electrons: Some(light), ..Scene::uniform("test", light) };
    let stages = setup.stages(&setup.plane([64, 48], scene).unwrap()).unwrap();
    stages.demosaic.header().clone()
}

/// Codes of normal charges.
struct Codes {
    bits: i32,
    bias_adu: f64,
    adu_per_e: f64,
    /// All that is added, e².
    all_e2: f64,
}

impl Codes {
    /// Mean and mean square of what a photosite reads at such a mean level, beside so much noise.
    fn read(&self, level: f64, std: f64) -> [f64; 2] {
        let top = 2_f64.powi(self.bits) - 1.0;
        let below = (level - 9.0 * std).floor().clamp(0.0, top);
        let (mut first, mut second) = (below, below * below);
        let mut code = below + 1.0;
        while code <= top && code < level + 9.0 * std + 2.0 {
            let share = cumulative((level - code + 0.5) / std);
            first += share;
            second += share * (2.0 * code - 1.0);
            code += 1.0;
        }
        [first, second]
    }

    fn variance(&self) -> f64 {
        let [first, second] = self.read(self.bias_adu, self.adu_per_e * self.all_e2.sqrt());
        second - first * first
    }

    /// The covariance of two photosites that share so much of what is added: Var E(y | what is shared), by steps of 0.02 of its deviation.
    fn shared(&self, shared_e2: f64) -> f64 {
        let rest = self.adu_per_e * (self.all_e2 - shared_e2).sqrt();
        let (step, mut z) = (0.02, -8.0);
        let [mut mean, mut square] = [0.0; 2];
        while z < 8.0 {
            let [read, _] = self.read(self.bias_adu + self.adu_per_e * shared_e2.sqrt() * z, rest);
            let weight = step * density(z);
            mean += weight * read;
            square += weight * read * read;
            z += step;
        }
        square - mean * mean
    }
}

/// Noise and offsets of rows and columns at the ends of the codes: by sums outside the library, and what bilinear interpolation makes
/// of them. Green has (1 + ¼)/2 of what is a photosite's own, ¼ at four of its neighbors; of what rows share (1 + ⅜)/2, since two of these
/// lie in one row. Red has (1 + ½ + ½ + ¼)/4 and (1 + 1 + ½ + ½)/4.
#[test]
fn rows_and_columns_at_the_ends_of_the_codes_are_told_apart() {
    // Read noise, noise of rows and of columns, offsets of photosites, rows and columns.
    let sensors: [(i32, f64, f64, [f64; 6]); 5] = [
        (10, 4.0, 0.6, [5.0, 20.0, 0.0, 20.0, 0.0, 0.0]),
        (12, 0.0, 1.0, [3.0, 1.0, 0.0, 2.0, 0.0, 1.0]),
        (12, 2.0, 1.0, [3.0, 1.0, 0.0, 2.0, 0.0, 1.0]),
        (10, 1022.0, 0.7, [4.0, 6.0, 3.0, 5.0, 8.0, 2.0]),
        (10, 500.0, 0.7, [4.0, 6.0, 3.0, 5.0, 8.0, 2.0]),
    ];
    for (bits, bias_adu, adu_per_e, parts) in sensors {
        let [read, row, column, site, of_rows, of_columns] = parts;
        let setup = camera(|readout| {
            (readout.bits, readout.bias_adu, readout.adu_per_e) = (bits.unsigned_abs(), bias_adu, adu_per_e);
            (readout.read_noise_e, readout.row_noise_e, readout.column_noise_e) = (read, row, column);
            (readout.dsnu_e, readout.dsnu_row_e, readout.dsnu_column_e) = (site, of_rows, of_columns);
        });
        let all_e2 = parts.iter().map(|part| part * part).sum();
        let codes = Codes { bits, bias_adu, adu_per_e, all_e2 };
        let shared = |of: &[f64]| codes.shared(of.iter().map(|part| part * part).sum());
        let fixed = [shared(&[of_rows]), shared(&[of_columns]), shared(&[site, of_rows, of_columns])];
        let whole = [shared(&[row, of_rows]), shared(&[column, of_columns]), codes.variance()];
        let temporal = [0, 1, 2].map(|k| whole[k] - fixed[k]);
        let pixel = |[rows, columns, all]: [f64; 3], [of_own, of_lines]: [f64; 2]| {
            of_own * (all - rows - columns) + of_lines * (rows + columns)
        };
        let settings = PredictorSettings::of(setup.clone());
        let found = Predictor::new(settings).unwrap().predict([0.0; 3]).unwrap();
        let found = stage(&found, ChainStage::Demosaicked);
        let repeated = Repeated::of(&demosaicked(&setup, [0.0; 3]), Equations::Exact, 10).unwrap();
        for (k, gains) in [(0, [9.0 / 16.0, 3.0 / 4.0]), (1, [5.0 / 8.0, 11.0 / 16.0])] {
            let [anew, same] = [temporal, fixed].map(|part| pixel(part, gains));
            let all = anew + same;
            let [of_anew, of_same] = [found.temporal_std, found.fixed_pattern_std].map(|std| std.unwrap()[k].powi(2));
            // Nodes of the library are good to 10⁻⁶ of a covariance, its steps over offsets to 10⁻⁴.
            assert!((of_anew - anew).abs() < 2e-4 * all, "{bias_adu} {k}: {of_anew} {anew}");
            assert!((of_same - same).abs() < 2e-4 * all, "{bias_adu} {k}: {of_same} {same}");
            let causes: f64 = found.causes.iter().map(|entry| entry.variance[k]).sum();
            assert!((causes / found.std[k].powi(2) - 1.0).abs() < 1e-9);
            let FramePrediction::Pixels(pixels) = &repeated.variances else { panic!("no pixels") };
            let over_frames = pixels.covariance[(k, k)];
            assert!((over_frames - anew).abs() < 2e-4 * all, "{bias_adu} {k}: over frames {over_frames} {anew}");
        }
    }
}

/// A signal that the top code hides from all but few photosites: no part is more than the whole.
#[test]
fn parts_are_no_more_than_the_whole() {
    let setup = camera(|readout| {
        (readout.bits, readout.bias_adu, readout.adu_per_e, readout.full_well_e) = (12, 100.0, 4.0, 1430.0);
        (readout.prnu, readout.read_noise_e, readout.row_noise_e, readout.dsnu_e) = (0.005, 3.0, 1.5, 1.0);
    });
    let of_green = [900.0, 1000.0, 1100.0, 1200.0].map(|green_e| [500.0, green_e, 600.0]);
    for light in of_green.into_iter().chain([[5000.0; 3]]) {
        let found = predicted(&setup, light);
        for stage in [ChainStage::Demosaicked, ChainStage::Xyz].map(|wanted| stage(&found, wanted)) {
            for k in 0..3 {
                let whole = stage.std[k].powi(2);
                let parts = [stage.temporal_std, stage.fixed_pattern_std].map(|std| std.unwrap()[k].powi(2));
                // Causes that cancel are good to rounding.
                let all: f64 = stage.causes.iter().map(|entry| entry.variance[k].abs()).sum();
                let allowed = 1e-9 * whole + 1e-13 * all;
                assert!((parts[0] + parts[1] - whole).abs() <= allowed, "{light:?} {k}: {parts:?} {whole}");
            }
        }
    }
}

/// Temporal variances of L\*a\*b\* in frames of a sensor of much PRNU. Pixels share photosites: as many count as are red, a fourth, each
/// with N − 1 degrees of freedom; to first order alone they would be off by 25 % and more. Two taps alike change nothing.
#[test]
fn what_is_curved_in_a_color_is_told_apart() {
    const FRAMES: u32 = 12;
    let size = [96, 96];
    let light = [30_000.0, 50_000.0, 40_000.0];
    let setup = camera(|readout| {
        (readout.width, readout.height, readout.bits) = (96, 96, 14);
        (readout.bias_adu, readout.adu_per_e, readout.prnu, readout.read_noise_e) = (100.0, 0.16, 0.06, 3.0);
    });
    let found = predicted(&setup, light);
    let found = stage(&found, ChainStage::Lab);
    let [mut sums, mut squares] = [vec![0.0; 3 * size[0] * size[1]], vec![0.0; 3 * size[0] * size[1]]];
    for frame in 0..FRAMES {
        let of_frame =
            CameraSetup { noise: NoiseSettings { frame, seed: 5, ..NoiseSettings::default() }, ..setup.clone() };
        let expected = uniform_frame(of_frame.plane(size, Scene::uniform("test", light)).unwrap(), light).unwrap();
        let stages = of_frame.stages(&expected.header).unwrap();
        let (charge, _) = expected.through(&stages.add_noise).unwrap();
        let (codes, _) = charge.through(&stages.digitize).unwrap();
        let (rgb, _) = codes.through(&stages.demosaic).unwrap();
        let (colors, _) = rgb.through(&stages.to_xyz(&lab()).unwrap()).unwrap();
        for (index, sample) in colors.samples.iter().enumerate() {
            sums[index] += f64::from(*sample);
            squares[index] += f64::from(*sample).powi(2);
        }
    }
    let n = f64::from(FRAMES);
    let pixels = (size[0] * size[1]) as f64;
    let tolerance = 5.0 * (2.0 / (pixels / 4.0 * (n - 1.0))).sqrt();
    for k in 0..3 {
        // Planes lie row by row within each row of the frame.
        let of_channel = |index: &usize| index / size[0] % 3 == k;
        let variances = (0..sums.len()).filter(of_channel).map(|i| (squares[i] - sums[i] * sums[i] / n) / (n - 1.0));
        let measured = variances.sum::<f64>() / pixels;
        let told = found.temporal_std.unwrap()[k].powi(2);
        assert!((told / measured - 1.0).abs() < tolerance, "{k}: {told} {measured} {tolerance}");
        let of = |name: &str| found.causes.iter().find(|entry| entry.cause.name() == name).unwrap().variance[k];
        let before = told + of("curved_pattern");
        assert!((before / measured - 1.0).abs() > 2.0 * tolerance, "{k}: {before} {measured}");
    }
    let halves = camera(|readout| {
        (readout.width, readout.height, readout.bits) = (96, 96, 14);
        (readout.bias_adu, readout.adu_per_e, readout.prnu, readout.read_noise_e) = (100.0, 0.16, 0.06, 3.0);
        readout.taps = Some(Taps {
            layout: TapLayout::Columns,
            gain: vec![1.0, 1.0],
            offset_e: Vec::new(),
            read_noise_e: Vec::new(),
        });
    });
    let of_halves = predicted(&halves, light);
    let of_halves = stage(&of_halves, ChainStage::Lab);
    for k in 0..3 {
        let [told, alone] = [of_halves, found].map(|stage| stage.temporal_std.unwrap()[k]);
        // Pixels at an edge, 4 in 96, are made of fewer photosites.
        assert!((told / alone - 1.0).abs() < 0.04, "{k}: {told} {alone}");
    }
}

/// Sensors whose dark current differs so much that some photosites have none, which bends nothing of what rows and columns share: the
/// mean of a patch has of it what the straight codes have.
#[test]
fn photosites_without_dark_current_bend_nothing_of_rows_and_columns() {
    const SIDE: f64 = 20.0;
    let jumps = camera(|readout| {
        (readout.bits, readout.bias_adu, readout.adu_per_e, readout.full_well_e) = (14, 1000.0, 0.9, 15_000.0);
        (readout.dark_current_e_per_s, readout.dcnu, readout.prnu) = (Some(400.0), 0.3, 0.005);
        (readout.read_noise_e, readout.row_noise_e) = (3.0, 1.0);
        (readout.rts_share, readout.rts_amplitude_e) = (0.01, 8.0);
    });
    let columns = camera(|readout| {
        (readout.bits, readout.bias_adu, readout.adu_per_e, readout.full_well_e) = (12, 950.0, 0.0577, 24_000.0);
        (readout.dark_current_e_per_s, readout.dcnu, readout.prnu) = (Some(424.0), 0.45, 0.001);
        (readout.read_noise_e, readout.dsnu_column_e, readout.prnu_column) = (5.6, 8.75, 0.0005);
    });
    let rows = camera(|readout| {
        (readout.bits, readout.bias_adu, readout.adu_per_e, readout.full_well_e) = (12, 950.0, 0.14, 24_000.0);
        (readout.dark_current_e_per_s, readout.dcnu, readout.prnu) = (Some(424.0), 0.45, 0.001);
        (readout.read_noise_e, readout.dsnu_column_e, readout.prnu_row) = (5.6, 3.0, 0.01);
    });
    for (setup, light) in
        [(jumps, [1000.0, 2000.0, 1500.0]), (columns, [2861.0, 8090.0, 10_120.0]), (rows, [500.0, 800.0, 1000.0])]
    {
        let readout = setup.sensor.readout.clone().unwrap();
        let settings = PredictorSettings { patch: Some([20, 20]), ..PredictorSettings::of(setup) };
        let found = Predictor::new(settings).unwrap().predict(light).unwrap();
        for (wanted, slope) in [(ChainStage::Electrons, 1.0), (ChainStage::Adu, readout.adu_per_e)] {
            let stage = stage(&found, wanted);
            for (k, e) in light.into_iter().enumerate() {
                let of_line = |noise: f64, offset: f64, response: f64| {
                    slope * slope * (noise * noise + offset * offset + (e * response).powi(2))
                };
                let row = of_line(readout.row_noise_e, readout.dsnu_row_e, readout.prnu_row);
                let column = of_line(readout.column_noise_e, readout.dsnu_column_e, readout.prnu_column);
                let own = stage.std[k].powi(2) - row - column;
                let expected = own / (SIDE * SIDE) + (row + column) / SIDE;
                let told = stage.patch_mean_std.unwrap()[k].powi(2);
                assert!((told / expected - 1.0).abs() < 1e-6, "{wanted:?} {k}: {told} {expected}");
            }
        }
    }
}

/// What rows share of light that some photosites have no sensitivity to is the same whether readings jump or not, where no jump reaches
/// an end of the codes.
#[test]
fn gains_of_rows_beside_photosites_without_light_do_not_hang_on_jumps() {
    let shared = |rts_share: f64| {
        let setup = camera(|readout| {
            (readout.bits, readout.bias_adu, readout.adu_per_e) = (14, 1000.0, 0.9);
            (readout.prnu, readout.prnu_row, readout.read_noise_e) = (0.4, 0.01, 3.0);
            (readout.rts_share, readout.rts_amplitude_e) = (rts_share, 8.0 * f64::from(u8::from(rts_share > 0.0)));
        });
        let found = Predictor::new(PredictorSettings::of(setup)).unwrap().predict([1000.0, 2000.0, 500.0]).unwrap();
        stage(&found, ChainStage::Adu).covariance[0][1]
    };
    let [quiet, jumping] = [shared(0.0), shared(0.01)];
    // Rows that are brighter by u have the light E (1 + u + σ z) of sensitivities above zero: Φ(1/σ) of the slope of all.
    let first_order = 2e6 * (0.01 * 0.9 * 0.993_790_334_674_224_f64).powi(2);
    assert!((quiet / first_order - 1.0).abs() < 1e-3, "{quiet} {first_order}");
    assert!((jumping / quiet - 1.0).abs() < 1e-9, "{jumping} {quiet}");
}

/// Photosites without any sensitivity to light, one in 160, all of whose few dark counts are read as one code: what that does to their
/// mean is no noise. What is drawn anew is the mean variance of normal charges that full well clips, over all sensitivities: skewness of
/// counts of 20 600 and their rounding, 1/12 but at full well, are below a hundredth of it.
#[test]
fn photosites_without_light_have_their_code_for_good() {
    let (light, sigma, full_well_e, read_noise_e) = (20_600.0, 0.4, 22_500.0, 2.0);
    for dark_e in [0.0, 5.0, 10.0, 40.0] {
        let setup = camera(|readout| {
            (readout.bits, readout.bias_adu, readout.adu_per_e, readout.full_well_e) = (10, 20.0, 0.033, full_well_e);
            (readout.dark_current_e_per_s, readout.prnu, readout.read_noise_e) =
                (Some(10.0 * dark_e), sigma, read_noise_e);
        });
        let (step, mut z) = (1e-3, -1.0 / sigma);
        let mut expected = read_noise_e * read_noise_e;
        while z < 8.0 {
            let x = 1.0 + sigma * z;
            let [mean, variance] = [x * light + dark_e, x * x * light + dark_e];
            let (std, below) = (variance.sqrt(), full_well_e - mean);
            if std > 0.0 {
                let [share, peak] = [cumulative(below / std), std * density(below / std)];
                let first = below * share + peak;
                expected += step * density(z) * ((below * below + variance) * share + below * peak - first * first);
            }
            z += step;
        }
        let found = Predictor::new(PredictorSettings::of(setup)).unwrap().predict([light; 3]).unwrap();
        let found = stage(&found, ChainStage::Adu).temporal_std.unwrap()[1].powi(2) / 0.033_f64.powi(2);
        // 0.25 of a squared code is the most that rounding can be, 230 e².
        let of_rounding = 0.25 / 0.033_f64.powi(2);
        assert!((found - expected).abs() < 0.01 * expected + of_rounding, "{dark_e}: {found} {expected}");
    }
}

/// Jumps alone make a fixed pattern of what their rounding does to the mean of each photosite: by sums over amplitudes and codes. The causes
/// add up.
#[test]
fn jumps_over_coarse_codes_are_a_fixed_pattern() {
    for (bias_adu, read_noise_e, amplitude_e, share) in [(100.3, 2.0, 10.0, 0.1), (100.2, 1.5, 25.0, 0.02)] {
        let codes = Codes { bits: 12, bias_adu, adu_per_e: 0.1, all_e2: read_noise_e * read_noise_e };
        let setup = camera(|readout| {
            (readout.bits, readout.bias_adu, readout.adu_per_e) = (12, bias_adu, codes.adu_per_e);
            (readout.read_noise_e, readout.rts_share, readout.rts_amplitude_e) = (read_noise_e, share, amplitude_e);
        });
        let (mut temporal, mut mean, mut square) = (0.0, 0.0, 0.0);
        let mut add = |weight: f64, jump_e: f64| {
            let at = |off_e: f64| codes.read(bias_adu + codes.adu_per_e * off_e, codes.adu_per_e * read_noise_e);
            let [down, still, up] = [at(-jump_e), at(0.0), at(jump_e)];
            let [first, second] = [0, 1].map(|k| 0.25 * (down[k] + up[k]) + 0.5 * still[k]);
            temporal += weight * (second - first * first);
            mean += weight * (first - bias_adu);
            square += weight * (first - bias_adu).powi(2);
        };
        add(1.0 - share, 0.0);
        let step = 1e-3;
        for index in 0..40_000 {
            let t = (f64::from(index) + 0.5) * step;
            add(share * step * (-t).exp(), amplitude_e * t);
        }
        let found = Predictor::new(PredictorSettings::of(setup)).unwrap().predict([0.0; 3]).unwrap();
        let stage = stage(&found, ChainStage::Adu);
        let [told, fixed] = [stage.temporal_std, stage.fixed_pattern_std].map(|std| std.unwrap()[0].powi(2));
        let expected = square - mean * mean;
        assert!((told / temporal - 1.0).abs() < 1e-6, "{bias_adu}: {told} {temporal}");
        assert!(expected > 1e-5 && (fixed - expected).abs() < 1e-7, "{bias_adu}: {fixed} {expected}");
        assert!(((told + fixed) / stage.std[0].powi(2) - 1.0).abs() < 1e-9);
    }
}

/// Of a few hot photosites that are full nothing but read noise is drawn anew, whose rounding is no noise: beside sums over codes. Of those
/// that are not full, one in 30 000, shot noise is.
#[test]
fn few_full_photosites_have_their_code_for_good() {
    let (share, excess_e, full_well_e, adu_per_e) = (0.01, 1e8, 3000.5, 0.973);
    for read_noise_e in [0.05, 0.15, 0.4] {
        let codes = Codes { bits: 12, bias_adu: 100.3, adu_per_e, all_e2: read_noise_e * read_noise_e };
        let setup = camera(|readout| {
            (readout.bits, readout.bias_adu, readout.adu_per_e) = (12, codes.bias_adu, adu_per_e);
            (readout.read_noise_e, readout.full_well_e) = (read_noise_e, full_well_e);
            (readout.hot_pixel_share, readout.hot_pixel_dark_current_e_per_s) = (share, 10.0 * excess_e);
        });
        let variance = |level: f64| {
            let [first, second] = codes.read(level, adu_per_e * read_noise_e);
            second - first * first
        };
        let of_full = variance(codes.bias_adu + adu_per_e * full_well_e);
        let of_filling = 0.5 * full_well_e.powi(2) / excess_e * adu_per_e * adu_per_e;
        let expected = (1.0 - share) * variance(codes.bias_adu) + share * (of_full + of_filling);
        let found = Predictor::new(PredictorSettings::of(setup)).unwrap().predict([0.0; 3]).unwrap();
        let found = stage(&found, ChainStage::Adu).temporal_std.unwrap()[1].powi(2);
        // What is drawn anew at those that fill is cut off by 1/60 of it.
        assert!((found - expected).abs() < 0.03 * share * of_filling, "{read_noise_e}: {found} {expected}");
    }
}
