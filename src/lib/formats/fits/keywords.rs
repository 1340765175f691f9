//! What keywords tell of the camera. Those of filter arrays are no part of the standard; programs agree on most of them.

use super::header::{Header, whole};
use super::units::{LENGTH, TEMPERATURE, TIME, number_of};
use crate::camera::levels::WhiteLevel;
use crate::camera::readout::LEAST_TEMPERATURE_K;
use crate::cfa::FilterArray;
use crate::formats::exposure::{self, ToldExposure};
use crate::metadata::{CameraSettings, CaptureRecord, FirstRow, Metadata, TakenAs};
use crate::text::{in_decimals, in_digits, visible};
use crate::units::QuantityKind;
use std::ops::RangeInclusive;

/// Keywords of one thing whose numbers differ by more than this contradict each other; what is less is written with other digits.
const SAME_NUMBER: f64 = 1e-3;

/// The same of f-numbers, which are told in names, 5.6, and computed, 400/71.
const SAME_APERTURE: f64 = 0.03;

/// Temperatures that sensors have; programs write others where they know none.
const SENSOR_K: RangeInclusive<f64> = LEAST_TEMPERATURE_K..=400.0;

/// What a header tells.
#[derive(Debug)]
pub(super) struct Told {
    pub metadata: Metadata,
    /// The first row of the array is the lowest of the picture.
    pub is_bottom_up: bool,
    /// The part that is the picture, where it is not all, and the keyword that tells it.
    pub picture: Option<(&'static str, [i64; 4])>,
    /// What was passed over, and why.
    pub notes: Vec<String>,
    /// What contradicts itself.
    pub doubts: Vec<String>,
}

/// Reads the keywords of an image of `channels` planes of integers or floats.
///
/// `BAYERPAT` (or `COLORTYP`) is the pattern of the picture from its top left corner, `XBAYROFF` and `YBAYROFF` columns and
/// rows of the pattern before the first; `ROWORDER` says whether the first row of the array is the top one or the lowest. A
/// file that has none is taken to begin with its top row, as cameras write it. A single plane of integers behind filters is one
/// of ADU.
pub(super) fn read(header: &Header, channels: usize, is_integer: bool) -> Told {
    let (mut notes, mut doubts) = (Vec::new(), doubts_of_repeated(header));
    doubts.extend(doubt_of_primary(header));
    let first_row = first_row(header, &mut notes, &mut doubts);
    let cfa = filters(header, channels, &mut notes, &mut doubts);
    let unit = header.text("BUNIT").map(str::trim).filter(|unit| !unit.is_empty());
    let of_unit = unit.map(quantity_of_unit);
    let of_filters = if cfa.is_some() && is_integer { QuantityKind::Adu } else { QuantityKind::Unspecified };
    let mut metadata = Metadata::new(of_unit.unwrap_or(of_filters));
    if let Some((unit, QuantityKind::Unspecified)) = unit.zip(of_unit) {
        // What is not taken for codes keeps its unit, by which it is refused.
        metadata.unit = visible(unit).into_owned();
    }
    metadata.cfa = cfa;
    metadata.white_level_adu = saturation(header, metadata.quantity, is_integer, &mut notes);
    metadata.camera = header.text("INSTRUME").map(|camera| visible(camera).into_owned());
    let exposure = told_exposure(header, &mut notes, &mut doubts);
    ToldExposure::describe(exposure, &mut metadata);
    metadata.taken_as = taken_as(header, &mut doubts);
    metadata.sensor_temperature_k = told_temperature(header, &mut notes, &mut doubts);
    metadata.camera_settings = told_settings(header);
    metadata.capture = Some(CaptureRecord {
        subframe: subframe(header),
        first_row: Some(first_row),
        calibrated: calibrated(header, &mut notes),
    });
    note_settings(header, &mut notes);
    doubts.extend(doubt_of_stack(header));
    Told { metadata, is_bottom_up: first_row == FirstRow::Bottom, picture: None, notes, doubts }
}

/// The code from which on samples are saturated, by `SATURATE`, of integers that may be codes.
fn saturation(
    header: &Header,
    quantity: QuantityKind,
    is_integer: bool,
    notes: &mut Vec<String>,
) -> Option<WhiteLevel> {
    let level = header.number("SATURATE")?;
    let may_be_codes = is_integer && matches!(quantity, QuantityKind::Adu | QuantityKind::Unspecified);
    if may_be_codes && level > 0.0 && level.is_finite() {
        notes.push(format!("its white level, {level} ADU, is its SATURATE"));
        return Some(level.into());
    }
    notes.push(format!("its SATURATE of {level} is passed over: no white level of codes is such"));
    None
}

/// Which row of the picture the array begins with. Programs write the words with a blank, a line or nothing between.
fn first_row(header: &Header, notes: &mut Vec<String>, doubts: &mut Vec<String>) -> FirstRow {
    let told = header.text("ROWORDER").filter(|order| !order.trim().is_empty());
    let letters =
        |order: &str| order.chars().filter(char::is_ascii_alphabetic).collect::<String>().to_ascii_uppercase();
    match (told, told.map(letters).as_deref()) {
        (_, Some("TOPDOWN")) => FirstRow::Top,
        (_, Some("BOTTOMUP")) => FirstRow::Bottom,
        (Some(other), _) => {
            let other = visible(other);
            doubts.push(format!(
                "its ROWORDER `{other}` is neither TOP-DOWN nor BOTTOM-UP; its first row is taken as the top one, and its filter array from \
                 there"
            ));
            FirstRow::Untold
        }
        _ => {
            notes.push("it has no ROWORDER; its first row is taken as the top one".into());
            FirstRow::Untold
        }
    }
}

/// Column and row of the sensor that the frame begins at; one keyword alone tells the other to be 0.
fn subframe(header: &Header) -> Option<[i64; 2]> {
    let [column, row] = ["XORGSUBF", "YORGSUBF"].map(|key| header.number(key).and_then(whole));
    (column.is_some() || row.is_some()).then(|| [column, row].map(Option::unwrap_or_default))
}

/// The letters of what came off before, by `CALSTAT`; of others than B, D and F nothing is known here.
fn calibrated(header: &Header, notes: &mut Vec<String>) -> Option<String> {
    let told = header.text("CALSTAT").map(str::trim).filter(|told| !told.is_empty())?;
    let known: String = told.to_ascii_uppercase().chars().filter(|letter| "BDF".contains(*letter)).collect();
    if known.is_empty() {
        notes.push(format!("its CALSTAT `{}` is passed over: B, D and F are known", visible(told)));
        return None;
    }
    Some(known)
}

/// A warning of a frame that several exposures were combined to, by programs that do not tell how.
fn doubt_of_stack(header: &Header) -> Option<String> {
    let told = ["STACKCNT", "NCOMBINE"].into_iter().filter_map(|key| Some((key, header.number(key)?)));
    let (key, count) = told.into_iter().find(|(_, count)| *count > 1.0)?;
    Some(format!(
        "it is combined of {count} exposures ({key}), and nothing tells how: its noise counts as that of one; average-frames combines the \
         exposures so that its noise is known"
    ))
}

/// What samples of a unit are: ADU and electrons, per pixel or not, in the spellings that programs have; unspecified of others.
fn quantity_of_unit(unit: &str) -> QuantityKind {
    const ADU: [&str; 14] = [
        "adu",
        "adus",
        "dn",
        "dns",
        "du",
        "count",
        "counts",
        "ct",
        "cts",
        "digitalnumber",
        "digitalnumbers",
        "analogdigitalunit",
        "analogtodigitalunit",
        "analogtodigitalunits",
    ];
    const ELECTRONS: [&str; 7] = ["electron", "electrons", "elec", "electr", "e-", "e", "el"];
    let lower = unit.to_ascii_lowercase().replace(" / ", "/").replace("/ ", "/").replace(" /", "/");
    let of_pixel = ["/pixel", "/pix", " pixel-1", " pix-1", " per pixel", " pixel**-1", " pix**-1"];
    let bare = of_pixel.iter().find_map(|end| lower.strip_suffix(end)).unwrap_or(&lower);
    let bare: String = bare.chars().filter(|letter| !" _".contains(*letter)).collect();
    let joined = bare.replace('-', "");
    if ADU.contains(&joined.as_str()) {
        QuantityKind::Adu
    } else if ELECTRONS.contains(&bare.as_str()) {
        QuantityKind::Electrons
    } else {
        QuantityKind::Unspecified
    }
}

/// The filter array of a single plane.
fn filters(header: &Header, channels: usize, notes: &mut Vec<String>, doubts: &mut Vec<String>) -> Option<FilterArray> {
    let told = ["BAYERPAT", "COLORTYP"].map(|key| header.text(key).map(str::to_ascii_uppercase));
    if let [Some(one), Some(other)] = &told
        && one != other
    {
        doubts.push(format!("its filter array is `{one}` by BAYERPAT and `{other}` by COLORTYP; BAYERPAT counts"));
    }
    let letters = told.into_iter().flatten().next()?;
    if ["MONO", "NONE", "RGB", "COLOR"].contains(&letters.as_str()) {
        return None;
    }
    if channels != 1 {
        notes.push(format!("its filter array (BAYERPAT) is passed over: it has {channels} planes, not one"));
        return None;
    }
    if ["XBINNING", "YBINNING"].iter().any(|key| header.number(key).is_some_and(|binning| binning > 1.0)) {
        notes.push("its filter array (BAYERPAT) is passed over: its photosites were binned".into());
        return None;
    }
    // Beyond any sensor an offset is damage, and so is a part of a photosite.
    let offset = |key: &str| whole(header.number(key).unwrap_or(0.0)).filter(|offset| offset.abs() < 1_000_000);
    let side = match letters.len() {
        4 => 2,
        36 => 6,
        _ => 0,
    };
    let array = offset("XBAYROFF").zip(offset("YBAYROFF")).and_then(|(x, y)| {
        // The first photosite has column x and row y of the pattern.
        FilterArray::beginning_at([-x, -y], side, side, &letters).ok()
    });
    if array.is_none() {
        notes.push(format!(
            "its filter array `{letters}` (BAYERPAT, XBAYROFF, YBAYROFF) is passed over: it is not known"
        ));
    }
    array
}

/// A doubt of each keyword that stands in the header again with another value.
fn doubts_of_repeated(header: &Header) -> Vec<String> {
    let doubt = |key: &String| format!("its keyword {key} stands there again with another value; the first counts");
    header.repeated.iter().map(doubt).collect()
}

/// A doubt of what the primary header alone tells, where the extension that is read does not inherit it.
fn doubt_of_primary(header: &Header) -> Option<String> {
    let keys = header.not_inherited.join(", ");
    (!keys.is_empty()).then(|| {
        format!(
            "its primary header has {keys}, and this part neither has them nor says INHERIT = T: they do not count; write \
             INHERIT = T into the part's header if they hold for it, INHERIT = F and the keywords themselves if not"
        )
    })
}

/// The first number of several keywords for one thing; a doubt of another that differs from it by more than a share.
fn first_of(what: &str, told: &[(&str, Option<f64>)], share: f64, doubts: &mut Vec<String>) -> Option<f64> {
    let mut known = told.iter().filter_map(|(key, number)| Some((*key, (*number)?)));
    let (first, counts) = known.next()?;
    let is_alike = |other: f64| (other - counts).abs() <= share * counts.abs().max(other.abs());
    if let Some((other, number)) = known.find(|(_, number)| !is_alike(*number)) {
        doubts.push(format!("its {what} is {counts} by {first} and {number} by {other}; {first} counts"));
    }
    Some(counts)
}

/// Exposure time in s.
fn told_time(header: &Header, notes: &mut Vec<String>, doubts: &mut Vec<String>) -> Option<f64> {
    let told = [("EXPTIME", "s"), ("EXPOSURE", "s"), ("EXPOINUS", "us")]
        .map(|(key, unit)| (key, number_of(header, key, &TIME, unit, notes, doubts)));
    first_of("exposure time in s", &told, SAME_NUMBER, doubts)
}

/// What the frame was taken as, by the words of capture programs and observatories; none where keywords differ.
fn taken_as(header: &Header, doubts: &mut Vec<String>) -> Option<TakenAs> {
    let told = ["IMAGETYP", "FRAME", "OBSTYPE"].into_iter().filter_map(|key| {
        let text = header.text(key)?;
        Some((key, text, kind_of(text)?))
    });
    let told: Vec<_> = told.collect();
    let (key, text, kind) = *told.first()?;
    if let Some((other, its, _)) = told.iter().find(|(.., other)| *other != kind) {
        doubts.push(format!(
            "it was taken as `{}` by {key} and as `{}` by {other}; neither is believed",
            visible(text),
            visible(its)
        ));
        return None;
    }
    Some(kind)
}

/// What a word for a kind of frame means: `Light Frame`, `DARKFLAT`, `zero`, `object` …; a dark frame of flats is one.
fn kind_of(text: &str) -> Option<TakenAs> {
    let text = text.to_ascii_lowercase();
    let has = |words: &[&str]| words.iter().any(|word| text.contains(word));
    let is = |words: &[&str]| words.contains(&text.as_str());
    match () {
        () if has(&["dark"]) => Some(TakenAs::Dark),
        () if has(&["bias"]) || is(&["zero", "offset"]) => Some(TakenAs::Bias),
        () if has(&["flat", "twilight"]) => Some(TakenAs::Flat),
        () if has(&["light"]) || is(&["object", "science"]) => Some(TakenAs::Light),
        () => None,
    }
}

/// The temperature of the sensor in K.
fn told_temperature(header: &Header, notes: &mut Vec<String>, doubts: &mut Vec<String>) -> Option<f64> {
    let kelvin = number_of(header, "CCD-TEMP", &TEMPERATURE, "degrees Celsius", notes, doubts)?;
    let is_possible = SENSOR_K.contains(&kelvin);
    if !is_possible {
        let kelvin = in_decimals(kelvin, 2);
        notes.push(format!("its CCD-TEMP, {kelvin} K, is passed over: it is no temperature of a sensor"));
    }
    is_possible.then_some(kelvin)
}

/// Exposure time and f-number, or the time alone; the transmittance of the lens, which no keyword has, is 1.
fn told_exposure(header: &Header, notes: &mut Vec<String>, doubts: &mut Vec<String>) -> Option<ToldExposure> {
    let exposure_s = told_time(header, notes, doubts);
    let told = [("FOCALLEN and APTDIA", told_ratio(header, notes, doubts)), ("FOCRATIO", header.number("FOCRATIO"))];
    let f_number = first_of("f-number", &told, SAME_APERTURE, doubts);
    exposure::of_parts(exposure_s, f_number, ["EXPTIME", "FOCALLEN and APTDIA, or FOCRATIO"], notes)
}

/// The focal length over the diameter of the aperture, both in mm as programs write them; none of what no lens has, which is told.
fn told_ratio(header: &Header, notes: &mut Vec<String>, doubts: &mut Vec<String>) -> Option<f64> {
    /// f-numbers that lenses and telescopes have.
    const LENSES: RangeInclusive<f64> = 0.3..=1000.0;
    let [length, diameter] =
        ["FOCALLEN", "APTDIA"].map(|key| number_of(header, key, &LENGTH, "mm", notes, doubts).filter(|mm| *mm > 0.0));
    let (length, diameter) = (length?, diameter?);
    let ratio = length / diameter;
    if LENSES.contains(&ratio) {
        return Some(ratio);
    }
    let in_meters = [("FOCALLEN", 1e3 * ratio), ("APTDIA", ratio / 1e3)];
    let likely = in_meters.iter().find(|(_, ratio)| LENSES.contains(ratio)).map_or(String::new(), |(key, ratio)| {
        format!(": {key} looks like m, with which it is {}", in_digits(*ratio, 3))
    });
    doubts.push(format!(
        "its FOCALLEN of {length} mm and APTDIA of {diameter} mm make an f-number of {}, which no lens has{likely}; they do not count, \
         --f-number tells it",
        in_digits(ratio, 3)
    ));
    None
}

/// What the camera was set to; none where no keyword tells.
fn told_settings(header: &Header) -> Option<CameraSettings> {
    let found = CameraSettings {
        gain: header.number("GAIN"),
        e_per_adu: header.number("EGAIN").filter(|gain| *gain > 0.0),
        offset: header.number("OFFSET").or_else(|| header.number("BLKLEVEL")),
        readout_mode: header.text("READOUTM").map(|mode| visible(mode.trim()).into_owned()),
        filter: header
            .text("FILTER")
            .map(str::trim)
            .filter(|name| !name.is_empty())
            .map(|name| visible(name).into_owned()),
    };
    let is_finite = |number: Option<f64>| number.is_none_or(f64::is_finite);
    let is_sound = [found.gain, found.e_per_adu, found.offset].into_iter().all(is_finite);
    (is_sound && found != CameraSettings::default()).then_some(found)
}

/// Notes what a user may want to write into metadata or a sensor file, and what has no agreed meaning.
fn note_settings(header: &Header, notes: &mut Vec<String>) {
    let mut found = Vec::new();
    if let Some(gain) = header.number("EGAIN").filter(|gain| *gain > 0.0) {
        found.push(format!("{gain} e-/ADU (EGAIN), which is an `adu_per_e` of {}", 1.0 / gain));
    }
    if let Some(gain) = header.number("GAIN") {
        found.push(format!("GAIN {gain} in units of the camera"));
    }
    if !found.is_empty() {
        notes.push(format!(
            "its header tells how the camera was set, which no number hangs on here, but frames of other settings are told by: {}",
            found.join(", ")
        ));
    }
    for key in ["PEDESTAL", "OFFSET", "BLKLEVEL"] {
        if let Some(level) = header.number(key).filter(|level| *level != 0.0) {
            notes.push(format!(
                "its {key} of {level} is not taken as the black level: programs disagree on its sign and scale"
            ));
        }
    }
}
