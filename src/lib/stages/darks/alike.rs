//! Whether frames show the same photosites, and what makes their dark signals differ.

use crate::camera::levels::OF_ONE_SCALE;
use crate::camera::readout::ReadOut;
use crate::cfa::FilterArray;
use crate::error::Result;
use crate::metadata::{FrameHeader, Metadata};
use crate::units::QuantityKind;

/// Makes sure that a frame holds codes of photosites as the converter gave them, or another program's samples.
pub(in crate::stages) fn check_codes(frame: &FrameHeader) -> Result<()> {
    let (metadata, holds) = (&frame.metadata, frame.holds());
    if metadata.demosaic.is_some() {
        return Err(frame.refuse(format!("it holds {holds}; corrections come before demosaicking")));
    }
    if metadata.correction.is_some() {
        return Err(frame.refuse(format!("it holds {holds} that is corrected already; correction is done once")));
    }
    match metadata.quantity {
        QuantityKind::Adu | QuantityKind::Unspecified => Ok(()),
        QuantityKind::ExpectedElectrons | QuantityKind::Electrons => {
            Err(frame.out_of_order(format!("it holds {holds}, not ADU"), "digitize"))
        }
        _ => Err(frame.refuse(format!("it holds {holds}, not ADU of photosites"))),
    }
}

/// Name and scene of a frame on which light fell, as its metadata tell.
pub(super) fn lit(frame: &FrameHeader) -> Option<(String, String)> {
    let scene = frame.metadata.scene.as_ref()?;
    (!scene.is_dark()).then(|| (frame.name.clone(), scene.source.clone()))
}

/// Whether the metadata of a frame tell its scene, or what it was taken as, and its sensor.
pub(super) fn says_enough(frame: &FrameHeader) -> bool {
    (frame.metadata.scene.is_some() || frame.metadata.taken_as.is_some()) && says_enough_of_sensor(frame)
}

/// Whether the metadata of a frame tell which sensor drew its noise, or its camera; one without noise has any.
pub(super) fn says_enough_of_sensor(frame: &FrameHeader) -> bool {
    let metadata = &frame.metadata;
    metadata.noise.is_some() || metadata.camera.is_some() || metadata.scene.is_some() && metadata.sensor.is_some()
}

/// Makes sure that a dark frame shows the photosites of `frame`, of the same sensor as far as metadata tell.
pub(in crate::stages) fn check_alike(frame: &FrameHeader, dark: &FrameHeader) -> Result<()> {
    let differs = |what: &str, its: String, theirs: String| {
        Err(dark.refuse(format!("its {what} is {its}, but that of {} is {theirs}", frame.name)))
    };
    let (a, b) = (&frame.geometry, &dark.geometry);
    if [a.width, a.height] != [b.width, b.height] {
        return differs("size", format!("{}x{}", b.width, b.height), format!("{}x{}", a.width, a.height));
    }
    if a.origin != b.origin {
        let place = |[column, row]: [i32; 2]| format!("{column},{row}");
        return differs("place on the sensor", place(b.origin), place(a.origin));
    }
    if a.channels.len() != b.channels.len() {
        return differs("number of planes", b.channels.len().to_string(), a.channels.len().to_string());
    }
    let (a, b) = (frame.metadata.cfa, dark.metadata.cfa);
    if a != b {
        let name = |cfa: Option<FilterArray>| cfa.map_or("none".to_owned(), |cfa| cfa.to_string());
        return differs("pattern", name(b), name(a));
    }
    let sensor = |metadata: &Metadata| metadata.sensor.as_ref().map(|sensor| sensor.name.clone());
    if let (Some(a), Some(b)) = (sensor(&frame.metadata), sensor(&dark.metadata))
        && a != b
    {
        return differs("sensor", b, a);
    }
    if let (Some(a), Some(b)) = (&frame.metadata.camera, &dark.metadata.camera)
        && a != b
    {
        return differs("camera", b.clone(), a.clone());
    }
    if let Some((key, unit, its, theirs)) = other_codes(&frame.metadata, &dark.metadata) {
        return differs(key, format!("{theirs} {unit}"), format!("{its} {unit}"));
    }
    let whites = frame.metadata.white_level_adu.zip(dark.metadata.white_level_adu);
    if let Some([a, b]) = whites.map(|(a, b)| [a.largest(), b.largest()])
        && (a > OF_ONE_SCALE * b || b > OF_ONE_SCALE * a)
    {
        return Err(dark.refuse(format!(
            "its white level is {b} ADU, but that of {} is {a} ADU: their codes are of different scales",
            frame.name
        )));
    }
    let seed = |metadata: &Metadata| metadata.noise.as_ref().map(|noise| noise.sensor_seed);
    match (seed(&frame.metadata), seed(&dark.metadata)) {
        (Some(a), Some(b)) if a != b => differs("sensor seed", b.to_string(), a.to_string()),
        _ => Ok(()),
    }
}

/// Makes sure that a dark frame is like `frame` and was taken at the same sensitivity and settings, by which its codes mean the same charges.
///
/// # Errors
///
/// As [`check_alike`].
pub(in crate::stages) fn check_setting(frame: &FrameHeader, dark: &FrameHeader) -> Result<()> {
    check_alike(frame, dark)?;
    if let (Some(a), Some(b)) = (frame.metadata.iso_speed, dark.metadata.iso_speed)
        && !is_same(a, b)
    {
        return Err(dark.refuse(format!("its sensitivity is ISO {b}, but that of {} is ISO {a}", frame.name)));
    }
    let settings = frame.metadata.camera_settings.as_ref().zip(dark.metadata.camera_settings.as_ref());
    match settings.and_then(|(a, b)| a.other_than(b)) {
        Some((what, theirs, its)) => {
            Err(dark.refuse(format!("its {what} is {its}, but that of {} is {theirs}", frame.name)))
        }
        None => Ok(()),
    }
}

/// What makes the codes of two frames of one sensor mean other charges, as far as both tell: its key and unit, and both numbers.
fn other_codes(a: &Metadata, b: &Metadata) -> Option<(&'static str, &'static str, f64, f64)> {
    let both = |of: fn(&Metadata) -> Option<f64>| of(a).zip(of(b));
    let slopes = both(Metadata::adu_per_e).map(|(a, b)| ("adu_per_e", "ADU per electron", a, b));
    let biases = both(Metadata::bias_adu).map(|(a, b)| ("bias_adu", "ADU", a, b));
    slopes.into_iter().chain(biases).find(|(.., a, b)| !is_same(*a, *b))
}

/// What makes the dark signal of two frames differ.
pub(super) fn differences(frame: &FrameHeader, dark: &FrameHeader) -> Vec<String> {
    /// Coolers hold a temperature to this, in K; a dark signal changes by 2 %.
    const NEAR_K: f64 = 0.2;
    /// Times are told to such a share.
    const NEAR_TIME: f64 = 1e-3;
    /// What the sums of kelvins and degrees leave.
    const ROUNDING: f64 = 1e-6;
    let (times, temperatures) = (
        dark.metadata.time_s().zip(frame.metadata.time_s()),
        dark.metadata.temperature_k().zip(frame.metadata.temperature_k()),
    );
    let pairs = [
        ("exposure", "s", times.filter(|(a, b)| (a - b).abs() > (NEAR_TIME + ROUNDING) * b.abs())),
        ("temperature", "K", temperatures.filter(|(a, b)| (a - b).abs() > NEAR_K + ROUNDING)),
    ];
    let warn = |(what, unit, differing): (&str, &str, Option<(f64, f64)>)| {
        let (its, theirs) = differing?;
        Some(format!(
            "{}: its {what} is {its} {unit}, but that of {} is {theirs} {unit}; their dark signals differ",
            dark.name, frame.name
        ))
    };
    let added = |frame: &FrameHeader| frame.readout().map(ReadOut::added_e).ok();
    let other = added(dark).zip(added(frame)).and_then(|(its, theirs)| {
        let mut both = its.into_iter().zip(theirs);
        let ((key, its), (_, theirs)) = both.find(|((_, its), (_, theirs))| its != theirs)?;
        Some(format!(
            "{}: its {key} is {its}, but that of {} is {theirs}, which predictions take for both",
            dark.name, frame.name
        ))
    });
    pairs.into_iter().filter_map(warn).chain(other).collect()
}

/// Equal but for what a text with seven digits may have lost.
pub(super) fn is_same(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-6 * b.abs()
}
