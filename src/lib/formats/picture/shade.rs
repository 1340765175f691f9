//! From samples to gray and color.

use super::planes::{Choice, apart, level, rounded};
use super::reduce::Reduced;
use crate::color::{D65_XY, linear_srgb_from_xyz, srgb_decode, srgb_encode, xyz_of_chromaticity};
use crate::error::{Error, Result};
use crate::metadata::FrameHeader;
use crate::units::QuantityKind;
use nalgebra::Vector3;
use rayon::prelude::*;

/// Which samples become black and which white, or the ends of the false colors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Range {
    /// What no light reads, and the most that the stage can hold.
    Full,
    /// In each plane by itself, from so many standard deviations below its mean to as many above; of color temperatures, those of their
    /// inverses.
    Deviations(f64),
    /// From the sample that this share of all is below to another such one, of all planes of a color picture together; of XYZ, of its
    /// luminances.
    Shares(f64, f64),
    /// From one value to another, in the unit of the samples; of XYZ, of the luminance of white light.
    Values(f64, f64),
}

/// The plane of XYZ that is luminance.
const LUMINANCE: usize = 1;

/// From samples to display values.
pub(super) enum Shade {
    /// Each plane by itself, from its black to its white.
    Planes(Vec<(f64, f64)>),
    /// XYZ through the matrix to linear light of the primaries of sRGB, from its black to its white.
    Xyz(nalgebra::Matrix3<f64>, (f64, f64)),
    /// Encoded already.
    Encoded,
}

impl Shade {
    /// How the pixels of a picture are shown.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for a range that shows nothing; [`Error::Format`] for quantities that are no picture.
    pub fn new(frame: &FrameHeader, range: Range, choice: &Choice, reduced: &Reduced) -> Result<Self> {
        let nobodys = match only_value(reduced) {
            Some(value) => format!("all its samples are {}, which makes no range from black to white", level(value)),
            None => "its levels make no range from black to white".to_owned(),
        };
        let is_given = matches!(range, Range::Values(..));
        Self::of_range(frame, range, choice, reduced).map_err(|error| match error {
            Error::Usage(_) if !is_given => {
                let advice =
                    "name one with --range LOW,HIGH, or show a plane in false color (--false-color), which needs none";
                Error::Usage(format!("{}: {nobodys}; {advice}", frame.name))
            }
            other => other,
        })
    }

    fn of_range(frame: &FrameHeader, range: Range, choice: &Choice, reduced: &Reduced) -> Result<Self> {
        let planes = 0..reduced.planes;
        let none = || nothing(frame);
        let is_xyz = frame.metadata.quantity == QuantityKind::Xyz && reduced.planes == 3;
        match range {
            Range::Values(low, high) if is_xyz => Self::xyz(frame, (low, high)),
            Range::Shares(low, high) if is_xyz => {
                let ends = reduced.quantiles(LUMINANCE, [low, high]).ok_or_else(none)?;
                Self::xyz(frame, ends.into())
            }
            Range::Values(low, high) => Self::planes(frame, vec![(low, high); reduced.planes]),
            Range::Deviations(_) | Range::Full if !reduced.has_numbers() => Err(none()),
            Range::Deviations(count) => {
                let temperatures = choice.temperatures(frame);
                let about = |plane| match temperatures == Some(plane) {
                    true => about_inverse(reduced, plane, count),
                    false => {
                        let moments = reduced.moments(plane);
                        let spread = count * moments.std(0).unwrap_or(0.0);
                        (moments.mean[0] - spread, moments.mean[0] + spread)
                    }
                };
                Self::planes(frame, planes.map(about).collect())
            }
            Range::Shares(low, high) => {
                // One stretch for all planes keeps their colors.
                let ends = reduced.quantiles_of_all([low, high]).ok_or_else(none)?;
                Self::planes(frame, vec![ends.into(); reduced.planes])
            }
            Range::Full => Self::full(frame, choice, reduced),
        }
    }

    /// From what no light reads to the most that the stage can hold.
    fn full(frame: &FrameHeader, choice: &Choice, reduced: &Reduced) -> Result<Self> {
        let metadata = &frame.metadata;
        let extremes = || {
            (0..reduced.planes)
                .map(|plane| reduced.moments(plane))
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], plane| {
                    [low.min(plane.min[0]), high.max(plane.max[0])]
                })
        };
        let ends = match metadata.quantity {
            QuantityKind::Srgb => return Ok(Self::Encoded),
            QuantityKind::Xyz if reduced.planes != 3 => {
                return Err(
                    frame.refuse("a single plane of XYZ is no picture; give --range LOW,HIGH, or --false-color")
                );
            }
            QuantityKind::Xyz => {
                let white = white_of(frame).ok_or_else(|| {
                    frame.refuse(
                        "the metadata name no white; give --range LOW,HIGH, or make it anew with `to-xyz \
                         --white-luminance CD_PER_M2`",
                    )
                })?;
                return Ok(Self::Xyz(linear_srgb_from_xyz(white), (0.0, 1.0)));
            }
            QuantityKind::ExpectedElectrons | QuantityKind::Electrons => {
                let readout = metadata.sensor.as_ref().and_then(|sensor| sensor.readout.as_ref());
                let full = readout.map_or_else(|| extremes()[1], |readout| readout.full_well_e);
                (metadata.dark_signal_e.unwrap_or(0.0), full)
            }
            QuantityKind::Adu => {
                let black = frame.black_levels()?.map_or(0.0, |black| black.smallest());
                let white = metadata.white_level_adu.unwrap_or_else(|| extremes()[1].into());
                if reduced.planes == 3 {
                    return Self::planes(frame, white.classes().map(|white| (black, white)).to_vec());
                }
                (black, white.largest())
            }
            QuantityKind::LinearSrgb => (0.0, 1.0),
            QuantityKind::Unspecified => {
                let [lowest, highest] = extremes();
                (lowest.min(0.0), highest)
            }
            other => {
                return Err(frame.refuse(format!(
                    "{other} is no picture; give --range LOW,HIGH, or show one plane in false color, as with --plane {} --false-color",
                    choice.names(frame)[0]
                )));
            }
        };
        Self::planes(frame, vec![ends; reduced.planes])
    }

    /// XYZ from one luminance of white light to another.
    fn xyz(frame: &FrameHeader, ends: (f64, f64)) -> Result<Self> {
        Self::planes(frame, vec![ends])?;
        Ok(Self::Xyz(light(frame), ends))
    }

    fn planes(frame: &FrameHeader, ranges: Vec<(f64, f64)>) -> Result<Self> {
        match ranges.iter().find(|(low, high)| !(low < high && (high - low).is_finite())) {
            None => Ok(Self::Planes(ranges)),
            Some((low, high)) => Err(Error::Usage(format!(
                "{}: a range from {low} to {high} shows nothing; --range takes black first and then white, which is larger",
                frame.name
            ))),
        }
    }

    /// A warning of a range that shows nothing: all numbers are below it, or all above.
    pub fn doubt(&self, frame: &FrameHeader, reduced: &Reduced) -> Option<String> {
        match self {
            Self::Planes(ranges) => {
                let each =
                    ranges.iter().enumerate().map(|(plane, range)| (*range, reduced.quantiles(plane, [0.0, 1.0])));
                all_outside(frame, each)
            }
            Self::Xyz(_, range) if *range != (0.0, 1.0) => {
                all_outside(frame, [(*range, reduced.quantiles(LUMINANCE, [0.0, 1.0]))].into_iter())
            }
            Self::Xyz(..) | Self::Encoded => None,
        }
    }

    /// What is black and what is white, in the unit of the samples.
    pub fn words(&self, frame: &FrameHeader, choice: &Choice) -> Option<String> {
        let names = choice.names(frame);
        let unit = match choice.unit(frame) {
            unit if unit.is_empty() => unit,
            unit => format!(" {unit}"),
        };
        // Linear sRGB at its own range is the same picture as that of sRGB.
        let is_whole = frame.metadata.quantity == QuantityKind::LinearSrgb;
        match self {
            Self::Planes(ranges) if is_whole && **ranges == [(0.0, 1.0); 3] && white(frame).is_some() => white(frame),
            Self::Planes(ranges) if ranges.iter().all(|range| *range == ranges[0]) => {
                let (low, high) = ranges[0];
                let [low, high] = apart(low, high, level);
                Some(format!("black {low}, white {high}{unit}"))
            }
            Self::Planes(ranges) => {
                let range = |(name, (low, high)): (&String, &(f64, f64))| {
                    let [low, high] = apart(*low, *high, level);
                    format!("{name} {low} to {high}")
                };
                let ranges: Vec<String> = names.iter().zip(ranges).map(range).collect();
                Some(format!("black to white: {}{unit}", ranges.join(", ")))
            }
            Self::Xyz(_, (low, high)) if (*low, *high) != (0.0, 1.0) => {
                let [low, high] = apart(*low, *high, level);
                Some(format!("black {low}, white {high}{unit}"))
            }
            Self::Xyz(..) | Self::Encoded => white(frame),
        }
    }

    /// The bytes of a picture, pixel by pixel.
    pub fn bytes(&self, reduced: &Reduced) -> Vec<u8> {
        let (columns, planes) = (reduced.size[0], reduced.planes);
        let curve = Curve::new();
        let mut bytes = vec![0; reduced.samples.len()];
        let rows = bytes.par_chunks_exact_mut(columns * planes).zip(reduced.samples.par_chunks_exact(columns * planes));
        rows.for_each(|(bytes, row)| {
            let sample = |plane: usize, x: usize| f64::from(row[plane * columns + x]);
            match self {
                Self::Encoded => {
                    for (place, byte) in bytes.iter_mut().enumerate() {
                        *byte = code(sample(place % planes, place / planes));
                    }
                }
                Self::Planes(ranges) => {
                    for (place, byte) in bytes.iter_mut().enumerate() {
                        let (low, high) = ranges[place % planes];
                        *byte = curve.code((sample(place % planes, place / planes) - low) / (high - low));
                    }
                }
                Self::Xyz(matrix, (low, high)) => {
                    for (x, pixel) in bytes.chunks_exact_mut(3).enumerate() {
                        let linear = matrix * Vector3::from_fn(|plane, _| sample(plane, x));
                        let code = |value: &f64| curve.code((value - low) / (high - low));
                        pixel.iter_mut().zip(&linear).for_each(|(byte, value)| *byte = code(value));
                    }
                }
            }
        });
        bytes
    }
}

/// The white that a frame of XYZ names; of relative XYZ that name none, D65 of Y = 1.
fn white_of(frame: &FrameHeader) -> Option<[f64; 3]> {
    let named = frame.metadata.color.as_ref().and_then(|color| color.white);
    named.or_else(|| frame.metadata.is_relative().then(|| xyz_of_chromaticity(D65_XY, 1.0)))
}

/// From XYZ to linear light of the primaries of sRGB, 1 of white light of the luminance 1; white is that of the metadata, or D65.
fn light(frame: &FrameHeader) -> nalgebra::Matrix3<f64> {
    let white = frame.metadata.color.as_ref().and_then(|color| color.white);
    let white = white.filter(|[_, luminance, _]| *luminance > 0.0);
    linear_srgb_from_xyz(
        white.map_or_else(|| xyz_of_chromaticity(D65_XY, 1.0), |white| white.map(|part| part / white[1])),
    )
}

/// The range of color temperatures from so many standard deviations of their inverses above the mean of these to as many below, where
/// that is above 0; else to the highest.
fn about_inverse(reduced: &Reduced, plane: usize, count: f64) -> (f64, f64) {
    let moments = reduced.inverse_moments(plane);
    let (mean, spread) = (moments.mean[0], count * moments.std(0).unwrap_or(0.0));
    let high = if mean > spread { (mean - spread).recip() } else { reduced.moments(plane).max[0] };
    ((mean + spread).recip(), high)
}

/// The number that all finite samples are.
pub(super) fn only_value(reduced: &Reduced) -> Option<f64> {
    let mut finite = reduced.samples.iter().copied().filter(|sample| sample.is_finite());
    let first = finite.next()?;
    finite.all(|sample| sample == first).then(|| f64::from(first))
}

/// A complaint of a frame without numbers.
pub(super) fn nothing(frame: &FrameHeader) -> Error {
    frame.refuse("none of its pixels has a number that is finite; there is nothing to show")
}

/// A warning where of each plane all numbers, of which the least and the most are given, lie on one side of its range.
pub(super) fn all_outside(
    frame: &FrameHeader,
    planes: impl Iterator<Item = ((f64, f64), Option<[f64; 2]>)>,
) -> Option<String> {
    let (mut range, mut ends) = (None, [f64::INFINITY, f64::NEG_INFINITY]);
    for ((low, high), seen) in planes {
        let Some([least, most]) = seen else { continue };
        if !(most < low || least > high) {
            return None;
        }
        range = Some((low, high));
        ends = [ends[0].min(least), ends[1].max(most)];
    }
    let (low, high) = range?;
    let [least, most] = apart(ends[0], ends[1], rounded);
    let [low, high] = apart(low, high, level);
    Some(format!(
        "{}: all numbers, from {least} to {most}, lie outside the range from {low} to {high}, which shows nothing of them; give \
         another with --range",
        frame.name
    ))
}

/// The code of a value of 0 to 1; 0 of NaN.
fn code(value: f64) -> u8 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to a byte")]
    let code = (value.clamp(0.0, 1.0) * 255.0).round() as u8;
    code
}

/// The curve of sRGB in 8 bits, by the linear values at which its codes change.
struct Curve {
    begins: [f64; 255],
    /// Codes of the beginnings of equal steps, where to look.
    near: Vec<u8>,
}

impl Curve {
    /// Steps of the table: the curve rises by less than one code in each.
    const STEPS: usize = 4096;

    fn new() -> Self {
        let begins = std::array::from_fn(|code| srgb_decode((code as f64 + 0.5) / 255.0));
        let near = (0..=Self::STEPS).map(|step| code(srgb_encode(step as f64 / Self::STEPS as f64))).collect();
        Self { begins, near }
    }

    /// The code of linear light; what is NaN is shown as black.
    fn code(&self, value: f64) -> u8 {
        let value = if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0) };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most the number of steps")]
        let near = self.near[(value * Self::STEPS as f64) as usize];
        let rises = self.begins.get(usize::from(near)).is_some_and(|begin| value >= *begin);
        near + u8::from(rises)
    }
}

/// Whether a frame can be shown as it is.
pub(super) fn is_picture(frame: &FrameHeader, range: Option<Range>) -> bool {
    let is_one = frame.geometry.channels.len() == 1;
    if !(is_one || frame.has_three_planes()) {
        return false;
    }
    match frame.metadata.quantity {
        _ if range.is_some_and(|range| range != Range::Full) => true,
        QuantityKind::Xyz => !is_one && white_of(frame).is_some(),
        QuantityKind::Srgb
        | QuantityKind::ExpectedElectrons
        | QuantityKind::Electrons
        | QuantityKind::Adu
        | QuantityKind::LinearSrgb
        | QuantityKind::Unspecified => true,
        _ => false,
    }
}

/// What the ends of the false colors are where nobody says: all numbers; or, where a few would stretch that to more than twice its
/// length, the middle 99 % of the pixels.
pub(super) fn usual_range(reduced: &Reduced, is_temperature: bool) -> Range {
    const MIDDLE: [f64; 2] = [0.005, 0.995];
    const MOST: f64 = 2.0;
    // Of color temperatures the length is that of their inverses.
    let along = |value: f64| if is_temperature { -value.recip() } else { value };
    match reduced.quantiles(0, [0.0, MIDDLE[0], MIDDLE[1], 1.0]).map(|ends| ends.map(along)) {
        Some([least, low, high, most]) if low < high && most - least > MOST * (high - low) => {
            Range::Shares(MIDDLE[0], MIDDLE[1])
        }
        _ => Range::Shares(0.0, 1.0),
    }
}

/// What of the numbers of a single plane lies beyond the ends of the colors, in words.
pub(super) fn beyond(reduced: &Reduced, (low, high): (f64, f64), range: Range) -> Option<String> {
    let [least, most] = reduced.quantiles(0, [0.0, 1.0])?;
    let ends = match range {
        Range::Shares(low, high) => format!("colors end at {} % and {} %; ", 100.0 * low, 100.0 * high),
        _ => String::new(),
    };
    let is_beyond = least < low || most > high;
    let [least, most] = apart(least, most, rounded);
    is_beyond.then(|| format!("{ends}lowest {least}, highest {most}"))
}

/// The ends of the numbers of a single plane; of one that is the same everywhere, half of it to both sides, and from 0 to 1 where it is 0
/// of what is never less.
///
/// # Errors
///
/// [`Error::Usage`] for a range that shows nothing; [`Error::Format`] where no pixel has a number.
pub(super) fn one_range(frame: &FrameHeader, range: Range, choice: &Choice, reduced: &Reduced) -> Result<(f64, f64)> {
    if let (Range::Shares(..), Some([low, high])) = (range, reduced.quantiles(0, [0.0, 1.0]))
        && low == high
    {
        let room = if low == 0.0 { 1.0 } else { 0.5 * low.abs() };
        let least = if low == 0.0 && choice.is_never_negative(frame) { 0.0 } else { low - room };
        return Ok((least, low + room));
    }
    match Shade::new(frame, range, choice, reduced)? {
        Shade::Planes(ranges) => Ok(ranges[0]),
        Shade::Encoded | Shade::Xyz(..) => Ok((0.0, 1.0)),
    }
}

/// What the white of a picture of colors is, where the frame tells it.
fn white(frame: &FrameHeader) -> Option<String> {
    let color = frame.metadata.color.as_ref()?;
    let [_, luminance, _] = color.white?;
    // Relative XYZ have no luminance.
    let is_relative = color.range_adu.is_some() || frame.metadata.unit == "relative";
    let luminance = level(luminance);
    Some(if is_relative { format!("white Y = {luminance}") } else { format!("white {luminance} cd m⁻²") })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Geometry;
    use crate::metadata::{ColorRecord, Metadata};

    #[test]
    fn the_table_gives_the_codes_of_the_curve() {
        let curve = Curve::new();
        for step in 0..=100_000 {
            let value = f64::from(step) / 1e5;
            assert_eq!(curve.code(value), code(srgb_encode(value)), "{value}");
        }
        assert_eq!([f64::NAN, -1.0, f64::INFINITY, f64::NEG_INFINITY].map(|value| curve.code(value)), [0, 0, 255, 0]);
    }

    #[test]
    fn the_white_of_relative_colors_has_no_luminance() {
        let told = |quantity, shade: &Shade, range_adu| {
            let mut metadata = Metadata::new(quantity);
            let white = Some([0.95, 1.0, 1.09]);
            metadata.color = Some(ColorRecord { white, range_adu, ..ColorRecord::of_xyz() });
            let frame = FrameHeader { name: "f".into(), geometry: Geometry::new(4, 4, &["R", "G", "B"]), metadata };
            let choice = Choice::of(&frame, None, false).unwrap();
            shade.words(&frame, &choice).unwrap()
        };
        let words = |range_adu| told(QuantityKind::Srgb, &Shade::Encoded, range_adu);
        assert_eq!([None, Some([900.0; 3])].map(words), ["white 1 cd m⁻²", "white Y = 1"]);
        // Linear sRGB from 0 to 1 is the same picture; stretched it is not.
        let linear = |range| told(QuantityKind::LinearSrgb, &Shade::Planes(vec![range; 3]), None);
        assert_eq!([(0.0, 1.0), (0.0, 0.5)].map(linear), ["white 1 cd m⁻²", "black 0, white 0.5"]);
    }
}
