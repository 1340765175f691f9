//! What `rawler` makes of a file, in words of ours. Nothing is checked here: the parent does that.

use super::wire::{Black, Filters, Head};
use crate::cfa::FILTERS;
use rawler::decoders::FormatHint;
use rawler::decoders::RawDecodeParams;
use rawler::formats::tiff::Rational;
use rawler::imgop::Rect;
use rawler::rawimage::RawPhotometricInterpretation;
use rawler::rawsource::RawSource;
use rawler::{CFA, RawImage, RawImageData};
use std::sync::Arc;

/// The number of what Fujifilm's layouts call the second green.
const SECOND_GREEN: u8 = 7;

/// Head and samples of the first raw image.
///
/// # Errors
///
/// What the decoder says.
pub(super) fn decode(bytes: Vec<u8>) -> Result<(Head, Vec<u16>), String> {
    let source = RawSource::new_from_shared_vec(Arc::new(bytes));
    let decoder = rawler::get_decoder(&source).map_err(|error| error.to_string())?;
    if decoder.format_hint() == FormatHint::DNG {
        return Err("it is a DNG".into());
    }
    let params = RawDecodeParams::default();
    let image = decoder.raw_image(&source, &params, false).map_err(|error| error.to_string())?;
    let exif = decoder.raw_metadata(&source, &params).map(|metadata| metadata.exif).unwrap_or_default();
    let images = decoder.raw_image_count().unwrap_or(1);
    let head = Head {
        width: image.width,
        height: image.height,
        samples_per_site: image.cpp,
        rotated: image.fuji_rotation_width.is_some(),
        filters: filters(&image)?,
        black: black(&image),
        white: image.whitelevel.0.iter().map(|level| f64::from(*level)).collect(),
        active: image.active_area.map(rectangle),
        default_crop: image.crop_area.map(rectangle),
        camera: format!("{} {}", image.clean_make, image.clean_model),
        matrices: matrices(&image),
        white_balance: [0, 1, 2].map(|class| Some(decimal(image.wb_coeffs[class])).filter(|factor| factor.is_finite())),
        exposure_s: exif.exposure_time.and_then(|time| ratio(&time)),
        f_number: exif.fnumber.and_then(|number| ratio(&number)),
        iso: exif.iso_speed_ratings.map(u32::from).or(exif.iso_speed).filter(|speed| *speed > 0),
        orientation: exif.orientation,
        images,
    };
    match image.data {
        RawImageData::Integer(samples) => Ok((head, samples)),
        RawImageData::Float(_) => Err("its samples are floats".into()),
    }
}

/// The filters, from the first site of the image on; none of a sensor without.
fn filters(image: &RawImage) -> Result<Option<Filters>, String> {
    let RawPhotometricInterpretation::Cfa(config) = &image.photometric else { return Ok(None) };
    let CFA { name, width, height, .. } = &config.cfa;
    if name.contains('E') {
        return Err("its filter array has a fourth color, emerald, which is not supported".into());
    }
    let letter = |code: u8| {
        let code = if code == SECOND_GREEN { 1 } else { code };
        FILTERS.chars().nth(code.into()).ok_or_else(|| format!("its filter array has a filter {code} without a name"))
    };
    let letters: Result<String, String> = config.cfa.flat_pattern().into_iter().map(letter).collect();
    Ok(Some(Filters { columns: *width, rows: *height, letters: letters? }))
}

fn black(image: &RawImage) -> Black {
    let levels = &image.blacklevel;
    Black {
        columns: levels.width,
        rows: levels.height,
        levels: levels.levels.iter().map(|level| ratio(level).unwrap_or(0.0)).collect(),
    }
}

/// The matrices, in the order of their illuminants.
fn matrices(image: &RawImage) -> Vec<(u16, Vec<f64>)> {
    let of = |matrix: &Vec<f32>| matrix.iter().copied().map(decimal).collect();
    let mut found: Vec<(u16, Vec<f64>)> =
        image.color_matrix.iter().map(|(illuminant, matrix)| (u16::from(*illuminant), of(matrix))).collect();
    found.sort_by_key(|(illuminant, _)| *illuminant);
    found
}

fn rectangle(rectangle: Rect) -> [usize; 4] {
    [rectangle.p.x, rectangle.p.y, rectangle.d.w, rectangle.d.h]
}

/// The value of a ratio; none of one without.
fn ratio(ratio: &Rational) -> Option<f64> {
    (ratio.d != 0).then(|| f64::from(ratio.n) / f64::from(ratio.d))
}

/// The decimal number that a single was written as.
fn decimal(number: f32) -> f64 {
    number.to_string().parse().unwrap_or(f64::NAN)
}
