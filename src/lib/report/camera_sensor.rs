//! A measured camera as a sensor file, with what each number is from.

use crate::analysis::photon_transfer::{ClassFindings, HotTail, RowDrift};
use crate::camera::readout::{MOST_DCNU, ReadOut};
use crate::camera::sensor::{Origin, Provenance, SENSOR_SCHEMA, Sensor};
use crate::cfa::FilterArray;
use crate::error::{Error, Result};
use crate::numerics::variance_components::Interval;
use crate::requests::photon_transfer::{MeasuredCamera, frames_in_words};
use crate::units::QuantityKind;
use std::collections::BTreeMap;

/// The temperature that is assumed where none is known, K.
const ROOM_K: f64 = 295.0;

/// Fewer photosites that stand out may be chance.
const LEAST_HOT: usize = 3;

/// Numbers of the file with their origins.
#[derive(Default)]
struct Told(BTreeMap<String, Provenance>);

impl Told {
    fn tell(&mut self, key: &'static str, kind: Origin, why: impl Into<String>) {
        self.0.insert(format!("readout.{key}"), Provenance { kind, note: Some(why.into()) });
    }

    /// A number as it is measured; 0 where it is not told from none.
    fn taken(&mut self, camera: &MeasuredCamera, key: &'static str, from: &'static str) -> f64 {
        match pooled(&camera.classes, from) {
            Some(found) if found.value > 0.0 && found.low > 0.0 => {
                self.tell(key, Origin::Measured, shown(found));
                found.value
            }
            Some(found) => {
                self.tell(key, Origin::Assumed, format!("none is told from none: {}", shown(found)));
                0.0
            }
            None => {
                self.tell(key, Origin::Assumed, format!("none; {}", reason(&camera.classes, from)));
                0.0
            }
        }
    }

    /// A number of photosites that do not stand out.
    fn derived(&mut self, key: &'static str, of_most: f64) -> f64 {
        let why = "of photosites that do not stand out, behind the high-pass filter";
        let none = "none is told from none, of photosites that do not stand out";
        let (kind, why) = if of_most > 0.0 { (Origin::Derived, why) } else { (Origin::Assumed, none) };
        self.tell(key, kind, why);
        of_most
    }
}

/// The read-out of a measured camera as a sensor, each number with its origin: measured, derived from what was measured, or assumed.
///
/// # Errors
///
/// [`Error::Data`] where there is no gain or black level, and for frames that were corrected, or of electrons, which tell nothing of a
/// converter.
#[allow(clippy::too_many_lines, reason = "key after key, as a sensor file has them")]
pub fn sensor_of(camera: &MeasuredCamera) -> Result<Sensor> {
    let metadata = &camera.head.metadata;
    let lacking = |what: &str| Error::Data(format!("{}: no sensor file follows: {what}", camera.list));
    if metadata.quantity == QuantityKind::Electrons {
        return Err(lacking("the frames are of electrons, before any converter"));
    }
    if metadata.correction.is_some() || metadata.adc.is_some_and(|adc| adc.is_linearized) {
        return Err(lacking("the frames were corrected, and a sensor file is of what the camera gives"));
    }
    let said = metadata
        .white_level_adu
        .map(|white| white.largest())
        .ok_or_else(|| lacking("the largest code is not known").give(&["white"]))?;
    let top = camera.largest.unwrap_or(said);
    let mut told = Told::default();
    let pooled = |key: &str| pooled(&camera.classes, key);
    let needed = |key: &str| pooled(key).ok_or_else(|| lacking(&reason(&camera.classes, key)));
    let gain = needed("gain_adu_per_e")?;
    let bias_adu = needed("black_level_adu")?;
    told.tell("adu_per_e", Origin::Measured, shown(gain));
    told.tell("bias_adu", Origin::Measured, shown(bias_adu));
    let bits = bits_of(top);
    let of_bits =
        if f64::from(bits).exp2() - 1.0 == top { "the largest code" } else { "the least that hold the largest code" };
    told.tell("bits", Origin::Derived, of_bits);
    // Wells are alike behind all filters: those that were filled tell.
    let full_well_e = match pooled_of(&camera.classes, "full_well_e", false) {
        Some(full) => {
            told.tell("full_well_e", Origin::Measured, shown(full));
            full.value
        }
        None => {
            // Of all charge, that of the dark too.
            let reached = |class: &ClassFindings| class.curve.iter().map(|point| point.mean_adu).fold(0.0, f64::max);
            let reached = camera.classes.iter().map(reached).fold(0.0, f64::max);
            let reached = (reached - bias_adu.value).max(0.0) / gain.value;
            let range = (top - bias_adu.value) / gain.value;
            let why = reason(&camera.classes, "full_well_e");
            let told_as = match range > reached {
                true => format!("the range of the converter; what was reached is {reached:.0}; {why}"),
                false => format!("what was reached; {why}"),
            };
            told.tell("full_well_e", Origin::Assumed, told_as);
            reached.max(range)
        }
    };
    let row_noise_e = told.taken(camera, "row_noise_e", "row_noise_e");
    let column_noise_e = told.taken(camera, "column_noise_e", "column_noise_e");
    let prnu = match of_most(camera, 0, "prnu_pixel") {
        Some(of_most) => told.derived("prnu", of_most),
        None => told.taken(camera, "prnu", "prnu_pixel"),
    };
    let Dark { dark_current_e_per_s, dcnu, dsnu_e, hot_pixel_share, hot_pixel_dark_current_e_per_s } =
        dark_of(camera, gain.value, &mut told);
    let lines = [("prnu_column", 0, 0), ("prnu_row", 0, 1), ("dsnu_column_e", 1, 0), ("dsnu_row_e", 1, 1)];
    let [prnu_column, prnu_row, dsnu_column_e, dsnu_row_e] = lines.map(|(key, stack, axis)| {
        let found = lines_of(camera, stack, axis) / if stack == 1 { gain.value } else { 1.0 };
        let why = "as the high-pass filter shows it, so that what varies smoothly does not count, nor photosites that stand out";
        told.tell(
            key,
            if found > 0.0 { Origin::Derived } else { Origin::Assumed },
            if found > 0.0 { why } else { "none is told from none" },
        );
        found
    });
    let dark_noise = needed("dark_noise_e")?;
    let [black_drift_e, black_drift_rows] = drift_of(camera, &mut told);
    // Frames are off by a drift as a whole besides, which is in no variance within them.
    let of_pixels = pooled("pixel_noise_e").filter(|_| black_drift_e > 0.0);
    let of_lines = row_noise_e.hypot(column_noise_e);
    let (read_noise_e, why) = match of_pixels {
        Some(noise) => (noise.value, format!("temporal noise of photosites, {}", shown(noise))),
        None => (
            (dark_noise.value.powi(2) - of_lines * of_lines).max(0.0).sqrt(),
            format!("dark noise {}, less that of rows and columns", shown(dark_noise)),
        ),
    };
    told.tell("read_noise_e", Origin::Derived, why);
    match camera.temperature_k {
        Some(_) => told.tell("temperature_k", Origin::Measured, "said with the frames"),
        None => told.tell("temperature_k", Origin::Assumed, "a room's: no frame says it"),
    }
    let geometry = &camera.head.geometry;
    let three = geometry.channels.len() > 1;
    let is_told = metadata.cfa.is_some();
    let of_cfa = if is_told { "said with the frames" } else { "no frame says it" };
    told.tell("cfa", if is_told { Origin::Measured } else { Origin::Assumed }, of_cfa);
    let whole = |extent: usize| u32::try_from(extent).map_err(|_| lacking("the frames are too large"));
    let readout = ReadOut {
        setting: None,
        width: whole(geometry.width)?,
        height: whole(geometry.height)?,
        pixel_pitch_um: None,
        cfa: metadata.cfa.unwrap_or(if three {
            "rggb".parse().unwrap_or(FilterArray::Monochrome)
        } else {
            FilterArray::Monochrome
        }),
        full_well_e,
        dark_current_na_per_cm2: None,
        dark_current_e_per_s: Some(dark_current_e_per_s),
        temperature_k: camera.temperature_k.unwrap_or(ROOM_K),
        dcnu,
        prnu,
        read_noise_e,
        row_noise_e,
        column_noise_e,
        black_drift_e,
        black_drift_rows,
        dsnu_e,
        dsnu_row_e,
        dsnu_column_e,
        prnu_row,
        prnu_column,
        hot_pixel_share,
        hot_pixel_dark_current_e_per_s,
        rts_share: 0.0,
        rts_amplitude_e: 0.0,
        smear_line_s: 0.0,
        blooming: 0.0,
        bits,
        bias_adu: bias_adu.value,
        adu_per_e: gain.value,
        linearization: None,
        taps: None,
    };
    let percent = camera.confidence * 100.0;
    let source = format!("photon-transfer of {}; intervals hold with {percent} %", frames_in_words(camera.frames));
    let sensor = Sensor {
        schema: SENSOR_SCHEMA.into(),
        name: "measured".into(),
        description: None,
        source: Some(source),
        provenance: told.0,
        readout: Some(readout),
        response: None,
        xyz_from_camera: None,
    };
    sensor.check().map_err(|problem| lacking(&problem))?;
    Ok(sensor)
}

/// What single photosites differ by under light, a share, or in the dark, in samples, without those that stand out: where there are hot ones, or
/// too few others tell it from none. None where the number of all counts, or nothing tells one.
fn of_most(camera: &MeasuredCamera, stack: usize, from: &str) -> Option<f64> {
    let found = pooled(&camera.classes, from)?;
    let are_hot = camera.classes.iter().any(|class| class.hot.is_some());
    let views = camera.patterns.iter().map(|views| views[stack].as_ref().map(|view| view.rest));
    let views = views.collect::<Option<Vec<[f64; 2]>>>().filter(|_| are_hot || found.low <= 0.0)?;
    let count = views.len().max(1) as f64;
    let variance = views.iter().map(|[variance, _]| variance).sum::<f64>() / count;
    let scatter = views.iter().map(|[_, scatter]| scatter * scatter).sum::<f64>().sqrt() / count;
    (variance > 2.0 * scatter).then(|| variance.sqrt())
}

/// The dark current of a sensor file and the pattern of the dark, with what is of hot photosites apart.
struct Dark {
    dark_current_e_per_s: f64,
    dcnu: f64,
    dsnu_e: f64,
    hot_pixel_share: f64,
    hot_pixel_dark_current_e_per_s: f64,
}

/// Dark current, its non-uniformity and the pattern that no time adds; where there are hot photosites those of all others, with the hot
/// ones apart: a normal law of all would have negative dark currents.
fn dark_of(camera: &MeasuredCamera, gain: f64, told: &mut Told) -> Dark {
    let classes = camera.classes.len() as f64;
    let current = told.taken(camera, "dark_current_e_per_s", "dark_current_e_per_s");
    let hot: Vec<HotTail> = camera.classes.iter().filter_map(|class| class.hot).collect();
    let share = hot.iter().map(|tail| tail.share).sum::<f64>() / classes;
    let mean = hot.iter().map(|tail| tail.share * tail.excess_per_s).sum::<f64>() / classes / gain;
    let count: usize = hot.iter().map(|tail| tail.count).sum();
    let of_all = pooled(&camera.classes, "dcnu").filter(|found| current > 0.0 && found.value > 0.0);
    // What few make of all may be told still.
    let is_of_all = |found: &Interval| count < LEAST_HOT && found.low > 0.0 && found.value <= MOST_DCNU;
    let Some(of_all) = of_all.filter(|found| count > 0 && !is_of_all(found)) else {
        return dark_of_all(camera, gain, current, told);
    };
    let dsnu_e = match offset_of_most(&hot) {
        Some(offset) => told.derived("dsnu_e", offset / gain),
        None => told.taken(camera, "dsnu_e", "dsnu_offset_e"),
    };
    // What chance has above all of the dark current is no more than that.
    let (of_one, mean) = (mean / share, mean.min(current));
    let others = current - mean;
    // Per second, as a share of the current of others.
    let offset = dsnu_e * gain;
    let by_others = |tail: &HotTail| (tail.others - offset * offset).max(0.0) / tail.exposure_s.powi(2);
    let spread = |tail: &HotTail| tail.parted.map_or_else(|| by_others(tail), |[_, per_s2]| per_s2);
    let square = hot.iter().map(spread).sum::<f64>() / hot.len() as f64;
    let dcnu = if others > 0.0 { (square.sqrt() / (gain * others)).min(MOST_DCNU) } else { 0.0 };
    let by =
        format!("{count} photosites that stand out of the darks of {} s, by an exponential law", hot[0].exposure_s);
    told.tell("hot_pixel_share", Origin::Derived, by.clone());
    told.tell("hot_pixel_dark_current_e_per_s", Origin::Derived, by);
    let without = format!("without hot photosites, of which it was {}", crate::text::in_digits(current, 4));
    told.tell("dark_current_e_per_s", Origin::Derived, without);
    let all = crate::text::in_digits(of_all.value, 4);
    told.tell("dcnu", Origin::Derived, format!("that of most photosites; with hot ones it was {all}"));
    Dark {
        dark_current_e_per_s: others,
        dcnu,
        dsnu_e,
        hot_pixel_share: mean / of_one,
        hot_pixel_dark_current_e_per_s: of_one,
    }
}

/// The same of such a dark current where no hot photosites are parted from all.
fn dark_of_all(camera: &MeasuredCamera, gain: f64, current: f64, told: &mut Told) -> Dark {
    let all_dcnu = if current > 0.0 { told.taken(camera, "dcnu", "dcnu") } else { 0.0 };
    if all_dcnu > MOST_DCNU {
        let why = format!("more than a normal law may have; {all_dcnu:.3} was measured");
        told.tell("dcnu", Origin::Assumed, why);
    }
    let hot: Vec<HotTail> = camera.classes.iter().filter_map(|class| class.hot).collect();
    let is_told = |key: &str| pooled(&camera.classes, key).is_none_or(|found| found.low > 0.0);
    let (from, of_others) = if all_dcnu > 0.0 {
        ("dsnu_offset_e", offset_of_most(&hot).filter(|_| !is_told("dsnu_offset_e")))
    } else {
        ("dsnu_pixel_e", of_most(camera, 1, "dsnu_pixel_e"))
    };
    let dsnu_e = match of_others {
        Some(of_others) => told.derived("dsnu_e", of_others / gain),
        None => told.taken(camera, "dsnu_e", from),
    };
    let dcnu = all_dcnu.min(MOST_DCNU);
    let (hot_pixel_share, hot_pixel_dark_current_e_per_s) = (0.0, 0.0);
    Dark { dark_current_e_per_s: current, dcnu, dsnu_e, hot_pixel_share, hot_pixel_dark_current_e_per_s }
}

/// What single photosites that do not stand out differ by at no time, in samples, where darks of two times tell it.
fn offset_of_most(hot: &[HotTail]) -> Option<f64> {
    let offsets: Vec<f64> = hot.iter().filter_map(|tail| Some(tail.parted?[0])).collect();
    (!offsets.is_empty()).then(|| (offsets.iter().sum::<f64>() / offsets.len() as f64).sqrt())
}

/// Spread between columns, or rows, of the pattern under light or in the dark behind the high-pass filter; 0 where it is not told
/// from none.
fn lines_of(camera: &MeasuredCamera, stack: usize, axis: usize) -> f64 {
    let found: Vec<[f64; 2]> =
        camera.patterns.iter().filter_map(|views| Some(views[stack].as_ref()?.lines[axis])).collect();
    let count = found.len().max(1) as f64;
    let variance = found.iter().map(|[variance, _]| variance).sum::<f64>() / count;
    // Classes share rows and columns: of these no more is known than the class tells that has most.
    let of_one = found.iter().map(|[_, scatter]| *scatter).fold(f64::INFINITY, f64::min);
    let scatter = found.iter().map(|[_, scatter]| scatter * scatter).sum::<f64>().sqrt() / count;
    if variance > 2.0 * scatter.max(of_one) { variance.sqrt() } else { 0.0 }
}

/// The bits that hold a code.
fn bits_of(top: f64) -> u32 {
    (1..16).find(|bits| f64::from(*bits).exp2() > top).unwrap_or(16)
}

/// A number over all classes, each weighted by its certainty.
fn pooled(classes: &[ClassFindings], key: &str) -> Option<Interval> {
    pooled_of(classes, key, true)
}

/// The same; where it need not be `of_all`, over those that have it.
fn pooled_of(classes: &[ClassFindings], key: &str, of_all: bool) -> Option<Interval> {
    let found: Vec<Interval> = classes.iter().filter_map(|class| class.get(key)).collect();
    let weight = |interval: &Interval| 1.0 / ((interval.high - interval.low) / 2.0).powi(2).max(f64::MIN_POSITIVE);
    let all: f64 = found.iter().map(weight).sum();
    let mean =
        |of: fn(&Interval) -> f64| found.iter().map(|interval| weight(interval) / all * of(interval)).sum::<f64>();
    let value = mean(|interval| interval.value);
    let narrower = (found.len() as f64).sqrt();
    // Intervals that are cut off at 0 say nothing of how far below they reach.
    let at_zero = found.iter().filter(|interval| interval.low <= 0.0).count();
    let below = if 2 * at_zero >= found.len() { value * narrower } else { value - mean(|interval| interval.low) };
    let above = mean(|interval| interval.high) - value;
    ((found.len() == classes.len() || !of_all) && !found.is_empty()).then(|| Interval {
        value,
        low: value - below / narrower,
        high: value + above / narrower,
    })
}

/// Why a number is not known.
fn reason(classes: &[ClassFindings], key: &str) -> String {
    let of = |class: &ClassFindings| class.findings.iter().find(|finding| finding.key == key)?.found.clone().err();
    classes.iter().find_map(of).unwrap_or_else(|| "it was not measured".into())
}

/// The drift of the black level, rms in e-, and rows of the sensor from one knot to the next: 0 where none is told.
fn drift_of(camera: &MeasuredCamera, told: &mut Told) -> [f64; 2] {
    let found: Vec<RowDrift> = camera.classes.iter().filter_map(|class| class.drift).collect();
    let mean = |of: fn(&RowDrift) -> f64| found.iter().map(of).sum::<f64>() / found.len() as f64;
    if found.is_empty() {
        return [0.0; 2];
    }
    for key in ["black_drift_e", "black_drift_rows"] {
        told.tell(key, Origin::Derived, "by how means of rows of darks differ, over the rows between them");
    }
    let is_array = camera.head.geometry.channels.len() == 1;
    let period = camera.head.metadata.cfa.filter(|_| is_array).map_or(1, |array| array.period()[1]);
    [mean(|drift| drift.variance).sqrt(), (mean(|drift| drift.rows_per_knot) * period as f64).max(2.0)]
}

fn shown(interval: Interval) -> String {
    let digits = |value: f64| crate::text::in_digits(value, 4);
    format!("{} to {}", digits(interval.low), digits(interval.high))
}
