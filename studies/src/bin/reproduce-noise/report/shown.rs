//! Numbers as the page shows them, and where they are among the results.

use crate::Results;
use crate::agreement::{Agreement, Row};
use crate::camera::SMALL;
use crate::figures::HueLevel;
use crate::limits::Limit;
use crate::prediction::{Sites, effective_share, weights};
use cyanometer::error::{Error, Result};
use cyanometer::propagation::Equations;
use cyanometer::propagation::smooth_hue::FirstOrder;
use cyanometer::stages::demosaic::Method;
use cyanometer_studies::pages::number;

/// The maximum signal-to-noise ratios of the paper's X, Y, Z with BI, SHTI, ECI, in dB [HP2005, Secs. 4.2.1–4.2.3].
pub(super) const PAPER_SNR_DB: [[f64; 3]; 3] = [[44.2, 43.3, 40.5], [42.0, 43.4, 39.5], [41.7, 42.2, 40.6]];

/// A whole number in groups of three.
pub(super) fn grouped(value: f64) -> String {
    let digits = format!("{value:.0}");
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) && digits.len() > 4 {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}

/// Two digits and a power of ten for what is large.
pub(super) fn count(value: f64) -> String {
    if value < 1e5 {
        return grouped(if value < 100.0 { value } else { (value / 10.0).round() * 10.0 });
    }
    let power = value.log10().floor();
    const RAISED: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let raised: String =
        format!("{power:.0}").chars().filter_map(|c| c.to_digit(10)).map(|d| RAISED[d as usize]).collect();
    format!("{:.1}·10{raised}", value / 10.0_f64.powf(power))
}

pub(super) fn percent(value: f64) -> String {
    let decimals = match value.abs() * 100.0 {
        large if large >= 1.0 => 1,
        small if small >= 0.01 => 2,
        _ => 3,
    };
    if value.abs() < 5e-6 { "0".into() } else { format!("{} %", number(100.0 * value, decimals)) }
}

/// The three statistics; the residual as predicted minus observed.
pub(super) fn agreement(a: Agreement) -> String {
    format!("{} · {} · {}", number(-a.residual, 3), number(a.slope, 2), number(a.correlation, 3))
}

pub(super) fn printed(numbers: Option<[f64; 3]>) -> String {
    numbers.map_or("–".into(), |[residual, slope, correlation]| {
        format!("{} · {} · {}", number(residual, 3), number(slope, 2), number(correlation, 2))
    })
}

pub(super) fn size([width, height]: [usize; 2]) -> String {
    format!("{width}×{height}")
}

pub(super) fn find<'a>(results: &'a Results, what: &str, channel: &str) -> Result<&'a Row> {
    let found = results.rows.iter().find(|row| row.what.starts_with(what) && row.channel == channel);
    found.ok_or_else(|| Error::Data(format!("Table 7 has no row {what} {channel}")))
}

pub(super) fn limit<'a>(results: &'a Results, name: &str, channel: &str) -> Result<&'a Limit> {
    let found = results.limits.iter().find(|limit| limit.name.starts_with(name) && limit.channel == channel);
    found.ok_or_else(|| Error::Data(format!("there is no approximation {name} {channel}")))
}

/// The relative error of an approximation at the level of this number.
pub(super) fn error(limit: &Limit, level: usize) -> f64 {
    limit.errors[level].map_or(f64::NAN, |(error, _)| error)
}

pub(super) fn at_blue(results: &Results, blue: f64) -> Result<&HueLevel> {
    let found = results.hues.iter().find(|level| level.blue == blue);
    found.ok_or_else(|| Error::Data(format!("Fig. 6 has no level {blue}")))
}

/// How the paper's claim fares.
pub(super) fn verdict(is_so: bool, yes: &'static str, no: &'static str) -> String {
    format!("**{}**", if is_so { yes } else { no })
}

/// The sampling error of a standard deviation of red after ECI in one small frame, relative.
pub(super) fn sampling_error(results: &Results) -> f64 {
    let sites = Sites::of(&results.camera, [10_000.0; 3], Equations::Exact);
    let share = effective_share(&weights(Method::EffectiveColor, &sites), sites.variance)[0];
    1.0 / (2.0 * share * (SMALL[0] * SMALL[1]) as f64).sqrt()
}

/// The charge above which a sample is left at the top code, e⁻.
pub(super) fn highest_charge(results: &Results) -> f64 {
    let adc = &results.camera.adc;
    (f64::from(adc.top_code()) + 0.5 - adc.bias_adu) / adc.adu_per_e
}

/// The lowest level, e⁻ in each class, at which ratios have a first order.
pub(super) fn lowest_for_ratios(results: &Results) -> f64 {
    let holds = |e: f64| {
        let sites = Sites::of(&results.camera, [e; 3], Equations::Exact);
        FirstOrder::of(sites.mean, sites.variance).holds
    };
    (1..1000).map(f64::from).find(|&e| holds(e)).unwrap_or(f64::NAN)
}
