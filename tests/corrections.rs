//! The slips of the paper that `docs/corrections.md` lists: each is shown, and the page must state the numbers found
//! here.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

mod support;

use cyanometer::camera::optics::Vignetting;
use cyanometer::camera::readout::silicon_band_gap_ev;
use cyanometer::cfa::{CfaPattern, Class};
use cyanometer::color::matrix;
use cyanometer::frame::{Geometry, mirror};
use cyanometer::propagation::gains;
use cyanometer::propagation::paper::{self, Coefficients};
use cyanometer::stages::black::Black;
use cyanometer::stages::demosaic::stencil::PHASES;
use cyanometer::stages::demosaic::stencil::Stencil;
use cyanometer::stages::demosaic::weights::WeightTable;
use cyanometer::stages::demosaic::{Demosaic, Method};
use cyanometer::units::QuantityKind;
use nalgebra::Matrix3;
use support::{TREE, frame, header, readout, sensor, through};

/// Fails unless the page states something.
#[track_caller]
fn says(text: &str) {
    let page = std::fs::read_to_string(format!("{TREE}/docs/corrections.md")).unwrap();
    // Lines may be broken anywhere.
    let flat: Vec<&str> = page.split_whitespace().collect();
    assert!(flat.join(" ").contains(text), "docs/corrections.md does not say “{text}”");
}

/// The share of variance that a channel keeps at equal variances of the photosites.
fn kept(method: Method) -> Matrix3<f64> {
    let weights = WeightTable::new(method, CfaPattern::Rggb).about([1.0, 1.0]);
    gains::mean_pixel(&weights).covariance([1.0; 3])
}

const MV_PER_E: f64 = 0.018;
const ADU_PER_MV: f64 = 3.268;

#[test]
fn the_range_of_columns_has_two_too_many() {
    let n: i32 = 2654;
    let printed = (-n / 2 - 1..=n / 2).count();
    assert_eq!(printed, 2656);
    says("2656 columns where there are 2654");
    // Illumination of the first column: printed offset N/2 + 1 against the centre's N/2 − 1/2.
    let pitch_um = 6.8;
    let falloff = |offset: f64| (1.0 + (offset * pitch_um / 50_000.0).powi(2)).powi(-2);
    let centre = f64::from(n) / 2.0 - 0.5;
    let first = Vignetting::new(2654, 1, pitch_um, 50.0).row(0).next().unwrap();
    assert!((first / falloff(centre) - 1.0).abs() < 1e-12);
    let error = falloff(f64::from(n) / 2.0 + 1.0) / falloff(centre) - 1.0;
    says(&format!("−{:.0}·10⁻⁶ of the illumination of the first column", -1e6 * error));
}

#[test]
fn the_sum_has_471_points() {
    assert_eq!((360..=830).count(), 471);
    says("471 points");
}

#[test]
fn the_format_is_not_that_of_the_pixels() {
    says(&format!("{:.1} mm × {:.1} mm", 2654.0 * 6.8e-3, 1996.0 * 6.8e-3));
}

#[test]
fn the_band_gap_varies() {
    let readout = readout();
    let signal = readout.dark_current_e_per_s(333.0) * MV_PER_E;
    assert!((signal - 40.0).abs() < 0.1, "{signal}");
    let thermal = 2.0 * 8.617_333e-5 * 333.0;
    let constant = signal * ((silicon_band_gap_ev(333.0) - 1.12) / thermal).exp();
    says(&format!("{signal:.2} mV s⁻¹; with 1.12 eV it is {constant:.0} mV s⁻¹"));
}

#[test]
fn the_cross_terms_are_missing() {
    let dark = readout().dark_current_e_per_s(333.0) * 0.033;
    let paper = (dark + (0.2 * dark).powi(2)).sqrt();
    let exact = (dark + (0.2 * dark).powi(2) + 0.04 * dark).sqrt();
    says(&format!("{paper:.2} e⁻ instead of {exact:.2} e⁻"));
    // With a read noise of 15.7 e⁻ Table 1's 23.0 e⁻ is not reached; 15.4 e⁻ gives it.
    let total = |read: f64| 17.08_f64.hypot(read);
    says(&format!("√(17.08² + 15.7²) = {:.1} e⁻", total(15.7)));
    says(&format!("15.4 e⁻ gives {:.1} e⁻", total(15.4)));
}

#[test]
fn response_has_the_non_uniformity_of_the_response() {
    let noise = |s: f64| (30_000.0 + (30_000.0 * s).powi(2)).sqrt();
    says(&format!("{:.0} e⁻ at 30 000 e⁻ where {:.0} e⁻ are meant", noise(0.2), noise(0.008)));
}

/// Peak to peak of n normal deviates is about 2 σ times the quantile at 1 − 1/n (Bonferroni; within a tenth).
#[test]
fn blocks_average_the_non_uniformity_away() {
    let single = 2.0 * 5.1 * 0.008;
    let block = 2.0 * 2.9 * 0.008 / 146.0;
    says(&format!("{:.0} % between single photosites, but {:.2} % between", 100.0 * single, 100.0 * block));
}

#[test]
fn full_well_lies_above_the_top_code() {
    let code = 1753.0 + ADU_PER_MV * MV_PER_E * 40_000.0;
    says(&format!("{code:.0} > 4095"));
    // The top code begins to be left at half a code above it.
    let lost = (code - 4095.5) / (ADU_PER_MV * MV_PER_E);
    says(&format!("the top {lost:.0} e⁻ of charge"));
    // 4095 − 1753 = 2342 is what the paper calls ρ_sat/σ_nf.
    assert_eq!(4095 - 1753, 2342);
    assert!((40_000.0_f64 / 17.08 - 2342.0).abs() < 0.5);
    says(&format!("2342/720 = {:.3} ADU/mV", 2342.0_f64 / 720.0));
}

/// A flat field stays flat with the plus sign; with the printed minus sign its interpolated green is red and green added.
#[test]
fn the_difference_domain_takes_the_mean_of_its_neighbours() {
    let mut head = header(QuantityKind::Adu, Geometry::new(8, 8, &["Y"]));
    head.metadata.cfa = Some(CfaPattern::Rggb.into());
    let flat = frame(head, |_, _, _| 100.0);
    let stage = Demosaic::new(&flat.header, Method::EffectiveColor, Black::None, None).unwrap();
    assert!(through(&flat, &stage).samples.iter().all(|&sample| sample == 100.0));
    // As printed: K_R = G − (R − R)/2 = G, and the green at red is R + mean K_R.
    let value = 100.0_f64;
    let printed = value + (value - (value - value) / 2.0);
    assert!((printed - 2.0 * value).abs() < 1e-12);
    says("twice as bright");
}

#[test]
fn the_bookkeeping_of_populations_loses_degrees_of_freedom() {
    // Values that are as noisy as the measured ones (m = 1) must keep the variance; the weights add up to n′ − 2.
    let (all, own) = (1200.0_f64, 300.0);
    let sum = ((own - 1.0) + (all - own - 1.0)) / (all - 1.0);
    assert!((sum - (all - 2.0) / (all - 1.0)).abs() < 1e-15);
    says(&format!("{:.2} % of the variance", 100.0 * (1.0 - sum)));
    let three = (1.0 - (all - 3.0) / (all - 1.0)) * 100.0;
    says(&format!("{three:.2} % in Eqs. 41 and 51"));
}

#[test]
fn every_neighbour_has_its_share() {
    let printed = 3.0 / 16.0 + 1.0 / 4.0;
    says(&format!("{:.2} times too large at m = 4", printed / 0.25));
}

#[test]
fn the_mean_of_the_inverse_is_not_the_inverse_of_the_mean() {
    let (inverse, mean): (f64, f64) = (2.0 / 3.0 / 2.0 + 1.0 / 3.0 / 4.0, 2.0 / 3.0 * 2.0 + 1.0 / 3.0 * 4.0);
    assert!((mean - 2.66).abs() < 0.01 && (inverse - 5.0 / 12.0).abs() < 1e-15);
    assert!((kept(Method::Bilinear)[(0, 0)] - 9.0 / 16.0).abs() < 1e-15);
    assert!((0.25_f64 + 0.75 / 2.66 - 0.53).abs() < 0.003);
    says(&format!("{:.1} % too low", 100.0 * (1.0 - (0.53_f64 / 0.5625).sqrt())));
}

#[test]
fn roots_enclose_their_factors() {
    says(&format!("{:.1} times too small (Eq. 16), {:.0} times (Eq. 17)", 32.0_f64.sqrt(), 16.0_f64.sqrt()));
}

#[test]
fn the_term_of_correlation_has_a_variance() {
    // Eq. 54a at equal variances σ², signal 10 000 e⁻: as printed the last term lacks σ ≈ 131 e⁻.
    let sigma = (10_000.0 + 80.0_f64.powi(2) + 17.05_f64.powi(2) + 15.7_f64.powi(2)).sqrt();
    let term = 4.0 * 2.0_f64.sqrt() * -0.65 * 3.0_f64.sqrt();
    let meant = ((11.0 + term) / 8.0).sqrt();
    let printed = ((11.0 + term / sigma) / 8.0).sqrt();
    says(&format!("{:.0} % too large at 10 000 e⁻", 100.0 * (printed / meant - 1.0)));
}

/// The mean of the four K_R about a red site has that site's red in each.
#[test]
fn differences_about_one_site_are_correlated() {
    let weights = WeightTable::new(Method::EffectiveColor, CfaPattern::Rggb).about([1.0, 1.0]);
    let red = (0..PHASES.len()).find(|&phase| weights.class(phase, [0, 0]) == Class::Red).unwrap();
    let mean_k = weights.stencil(red, Class::Green as usize).clone().plus(-1.0, &Stencil::site([0, 0]));
    let variance: f64 = mean_k.sites().map(|(_, weight)| weight * weight).sum();
    assert!((variance - 9.0 / 16.0).abs() < 1e-15);
    says("9/16 σ², not the 3/8 σ² of Eq. 53");
}

#[test]
fn the_last_term_of_eq_57_is_of_the_channel_itself() {
    // A clear sky at three quarters of full well: red 4448, green 16 599, blue 30 000 e⁻.
    let variance =
        [4448.0, 16_599.0, 30_000.0].map(|e: f64| e + (0.008 * e).powi(2) + 17.05_f64.powi(2) + 15.7_f64.powi(2));
    let r = Coefficients::effective(variance);
    let meant = paper::effective_color(variance, &r)[(0, 0)];
    let interpolated = |own: f64, r: f64| {
        let k = (variance[1] + own / 2.0) / 4.0;
        own + k + 2.0 * r * (own * k).sqrt()
    };
    let (at_red, at_blue) = (interpolated(variance[0], r.r1), interpolated(variance[2], r.r2));
    let printed = meant + 10.0 / 16.0 * r.r3[0] * variance[0].sqrt() * (at_red.sqrt() - at_blue.sqrt());
    let error = 100.0 * ((printed / meant).sqrt() - 1.0);
    says(&format!("{error:.1} % for red under a clear sky").replace('-', "−"));
}

#[test]
fn eq_58_has_80_for_82() {
    let without = paper::effective_color([1.0; 3], &Coefficients::NONE)[(0, 0)];
    assert!((without - 235.0 / 128.0).abs() < 1e-15);
    says(&format!("{:.2} % of the standard deviation", 100.0 * (1.0 - (233.0_f64 / 235.0).sqrt())));
}

#[test]
fn smooth_hue_correlates_red_and_blue() {
    let covariance = kept(Method::SmoothHue);
    let correlation = covariance[(0, 2)] / covariance[(0, 0)];
    says(&format!("their correlation is {correlation:.2}"));
}

#[test]
fn stimuli_of_independent_signals_are_not_independent() {
    let xyz = matrix(&sensor().xyz_from_camera.unwrap());
    let covariance = xyz * kept(Method::Bilinear) * xyz.transpose();
    let correlation = covariance[(0, 1)] / (covariance[(0, 0)] * covariance[(1, 1)]).sqrt();
    says(&format!("X and Y are correlated by {correlation:.2}"));
}

#[test]
fn eq_48_leaves_green_out_where_it_counts() {
    says(&format!("{:.0} % too low at equal signals", 100.0 * (1.0 - 0.75 / kept(Method::SmoothHue)[(0, 0)].sqrt())));
    let eq15 = paper::demosaicked(Method::SmoothHue, [1.0; 3], [1.0; 3], None).unwrap()[(0, 0)];
    says(&format!(
        "{:.0} % too high at equal signals",
        100.0 * ((eq15 / kept(Method::SmoothHue)[(0, 0)]).sqrt() - 1.0)
    ));
}

#[test]
fn the_sensors_signal_to_noise_ratio_has_non_uniformity() {
    let shot = 20.0 * 40_000.0_f64.sqrt().log10();
    let variance = 40_000.0 + 320.0_f64.powi(2) + 17.05_f64.powi(2) + 15.7_f64.powi(2);
    says(&format!("{shot:.0} dB of shot noise alone; by Eq. 11 {:.1} dB", 20.0 * (40_000.0 / variance.sqrt()).log10()));
}

/// Signs of the residuals of Table 7: with O − P they would be against those of the slopes' excess over 1.
#[test]
fn the_residuals_of_table_7_are_predicted_less_observed() {
    // Rows of SHTI and the skies, whose slopes differ from 1 by 0.05 and more: residual, slope.
    let rows = [
        (0.012, 1.15),
        (-0.045, 0.78),
        (0.003, 1.10),
        (0.039, 1.27),
        (-0.053, 0.76),
        (-0.062, 0.77),
        (0.039, 0.87),
        (0.062, 1.10),
        (-0.007, 0.95),
    ];
    let same = rows.iter().filter(|(residual, slope): &&(f64, f64)| residual * (slope - 1.0) > 0.0).count();
    assert_eq!((same, rows.len()), (8, 9));
    says("in 8 of the 9 rows");
}

/// Eq. 14 knows no edges; the frame mirrors, which counts some neighbours twice.
#[test]
fn edges_count_neighbours_twice() {
    assert_eq!((mirror(-1, 30), mirror(30, 30)), (1, 28));
}
