//! What comes up on the way, for the user to hear.

use crate::analysis::statistics::{ChannelReport, RegionReport, RepeatedReport, Report};
use crate::formats::input::FrameReader;
use crate::metadata::{AdcRecord, FrameHeader, HistoryEntry, Metadata};
use crate::propagation::pixels::{CoarseCodes, coarse_codes};
use crate::propagation::{LeftOutTails, left_out_tails};
use crate::stream::RowSource;
use crate::text::{counted, in_decimals, in_digits};
use crate::units::QuantityKind;

/// Something that came up; whoever asked decides what to do with it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Note {
    /// The result may not be what was wanted.
    Warning(String),
    /// For those who want to know how the result came about.
    Remark(String),
}

impl Note {
    /// What is said.
    pub fn text(&self) -> &str {
        match self {
            Self::Warning(text) | Self::Remark(text) => text,
        }
    }

    /// A warning of pixels that are left out of statistics; none where there are none.
    pub fn not_finite(pixels: u64) -> Option<Self> {
        let text = || counted(pixels, "pixels are NaN or infinite; they are left out of the statistics");
        (pixels > 0).then(|| Self::Warning(text()))
    }
}

/// Warnings of pixels that a frame marks, by what for, if those read were any.
pub fn of_marks(reader: &FrameReader) -> Vec<Note> {
    let name = &reader.header().name;
    let [saturated, defective, corrected, beyond] = reader.marked();
    let kinds = [
        (saturated, "were made of saturated samples"),
        (defective.max(corrected), "are, or used, defective photosites"),
        (beyond, "are beyond the model of a correction"),
    ];
    let text = |(pixels, what)| format!("{name}: {pixels} of the pixels read {what}; they are taken as they are");
    kinds.into_iter().filter(|(pixels, _)| *pixels > 0).map(text).map(Note::Warning).collect()
}

/// What came up among statistics over frames.
pub fn of_over_frames(report: &RepeatedReport) -> Vec<Note> {
    let left_out = report.regions.iter().map(|region| region.left_out).sum();
    let text = "pixels are saturated, otherwise marked, NaN or infinite in one of the frames or more; they are left out of all";
    let left_out = (left_out > 0).then(|| Note::Warning(counted(left_out, text)));
    let unlike =
        report.unlike.as_ref().map(|differs| Note::Warning(format!("{differs}; nothing is predicted of them")));
    left_out.into_iter().chain(unlike).collect()
}

/// What came up among statistics.
pub fn of_statistics(report: &Report, frame: &FrameHeader) -> Vec<Note> {
    let not_finite = report.regions.iter().map(|region| region.not_finite).sum();
    let pixels: u64 = report.regions.iter().map(|region| region.saturated).sum();
    let saturated = match report.regions.iter().any(|region| region.leaves_saturated_out) {
        _ if pixels == 0 => None,
        true => Some(counted(
            pixels,
            "pixels were made of saturated samples; they are left out of the statistics, so that these are of the darker part \
             alone (--keep-saturated keeps them in)",
        )),
        false => {
            Some(counted(pixels, "samples are saturated; the statistics hold for what was recorded, not for the light"))
        }
    };
    let defective: u64 = report.regions.iter().map(|region| region.defective.max(region.corrected)).sum();
    let defective = (defective > 0)
        .then(|| counted(defective, "pixels are, or used, defective photosites; they are left out of the statistics"));
    let beyond: u64 = report.regions.iter().map(|region| region.beyond_model).sum();
    let beyond = (beyond > 0)
        .then(|| counted(beyond, "pixels are beyond the model of a correction; they are left out of the statistics"));
    let other = report.regions.iter().find_map(unlike_prediction);
    let unpredicted = report
        .unpredicted
        .as_ref()
        .filter(|_| report.regions.iter().any(|region| region.patch.is_some()))
        .map(|why| format!("nothing is predicted of the patches: {why}"));
    let marked =
        saturated.into_iter().chain(defective).chain(beyond).chain(other).chain(unpredicted).map(Note::Warning);
    let listed = report.unpredicted.is_none().then(|| of_listed_defects(frame)).flatten();
    Note::not_finite(not_finite).into_iter().chain(marked).chain(listed).collect()
}

/// A warning of a mean that is not that of the scene and the camera of the metadata, by far more than chance.
fn unlike_prediction(region: &RegionReport) -> Option<String> {
    /// Standard errors, and share of what is predicted.
    const FAR: f64 = 30.0;
    const SHARE: f64 = 0.02;
    let is_whole =
        region.saturated + region.defective + region.corrected + region.beyond_model + region.not_finite == 0;
    let far = |channel: &ChannelReport| {
        let (mean, predicted) = channel.mean.zip(channel.predicted_mean)?;
        let is_far = channel.z_mean?.abs() > FAR && (mean - predicted).abs() > SHARE * predicted.abs();
        is_far.then(|| {
            let [mean, predicted] = [mean, predicted].map(|value| in_digits(value, 6));
            format!(
                "the mean of {} is {mean}, and {predicted} by its metadata: its samples were changed since, or these are of another \
                 frame",
                channel.name
            )
        })
    };
    let mut all = region.channels.iter().chain(&region.classes);
    if is_whole && region.tests.is_empty() { all.find_map(far) } else { None }
}

/// What a reader found.
pub fn of_reader(reader: &FrameReader) -> Vec<Note> {
    let header = reader.header();
    let found = format!(
        "{}: {}x{}, {}, stored as {}",
        header.name,
        header.geometry.width,
        header.geometry.height,
        header.holds(),
        reader.stored_as()
    );
    let remarks = std::iter::once(found).chain(reader.notes().iter().cloned()).map(Note::Remark);
    // Where a program of ours wrote the metadata, it has warned already.
    let mut doubts = Vec::new();
    if header.metadata.history.is_empty() {
        // Seconds of tags are seconds.
        let exposure = header.metadata.exposure.filter(|exposure| reader.tagged_exposure() != Some(*exposure));
        doubts = Metadata { exposure, ..header.metadata.clone() }.doubts();
    }
    // What is said of a sensor is said where it is read too, and once.
    let named = |doubt: String| if doubt.starts_with("sensor ") { doubt } else { format!("{}: {doubt}", header.name) };
    let doubts = doubts.into_iter().map(named);
    remarks.chain(doubts.map(Note::Warning)).chain(of_levels(header)).collect()
}

/// A warning of levels that leave no room for light.
pub fn of_levels(frame: &FrameHeader) -> Option<Note> {
    let metadata = &frame.metadata;
    let (black, white) = (metadata.uniform_black_adu()?, metadata.white_level_adu?.largest());
    let problem = if white < 0.0 {
        format!("what is subtracted exceeds its white level by {} ADU: no sample is above 0", in_decimals(-white, 1))
    } else if black >= white {
        let [black, white] = [black, white].map(|level| in_decimals(level, 1));
        format!("its black level, {black} ADU, is not below its white level, {white} ADU: no sample tells of light")
    } else {
        return None;
    };
    Some(Note::Warning(format!("{}: {problem}", frame.name)))
}

/// A warning of expected electrons that are made codes; of several files it is said once.
pub fn of_expected(input: &FrameHeader) -> Option<Note> {
    let text = "no noise was drawn: these are codes of what is expected; `add-noise` comes before";
    let is_expected = input.metadata.quantity == QuantityKind::ExpectedElectrons;
    is_expected.then(|| Note::Warning(text.into()))
}

/// Whether a program before made standard deviations of its pixels.
fn has_sigma(frame: &FrameHeader) -> bool {
    let is_given = |entry: &HistoryEntry| entry.arguments.iter().any(|argument| argument == "--sigma");
    frame.metadata.history.iter().any(is_given)
}

/// Warnings of standard deviations beside pixels; not where a program before gave them.
pub fn of_sigma(input: &FrameHeader) -> Vec<Note> {
    [of_undrawn(input), of_coarse_codes(input), of_sigma_beside_defects(input)].into_iter().flatten().collect()
}

/// A warning of standard deviations beside pixels that have no noise; not where a program before gave it.
fn of_undrawn(input: &FrameHeader) -> Option<Note> {
    let text = "no noise was drawn; the standard deviations are those of noisy frames of the same scene";
    (input.is_undrawn() && !has_sigma(input)).then(|| Note::Warning(text.into()))
}

/// A warning of standard deviations of codes that noise does not blur; not where a program before gave it.
fn of_coarse_codes(frame: &FrameHeader) -> Option<Note> {
    if has_sigma(frame) {
        return None;
    }
    let CoarseCodes { up_to_adu, scatter_adu: [least, most], told_adu } = coarse_codes(frame)?;
    Some(Note::Warning(format!(
        "{}: up to {} ADU above black its noise is below half a code, so that a sample scatters by {} to {} ADU in the dark, by where in a code its level \
         lies; the standard deviations count {}, with 1/12 ADU\u{b2} for rounding, which neighbors of one level have in common; more gain before the \
         converter blurs it",
        frame.name,
        in_decimals(up_to_adu, 1),
        in_decimals(least, 2),
        in_decimals(most, 2),
        in_decimals(told_adu, 2)
    )))
}

/// A warning of standard deviations beside pixels that count hot pixels, or photosites that jump, although defects were left out; not where a
/// program before gave it.
pub fn of_sigma_beside_defects(frame: &FrameHeader) -> Option<Note> {
    if has_sigma(frame) {
        return None;
    }
    beside_defects(frame, true)
}

/// A warning of predictions that count hot pixels, or photosites that jump, which a list of defects may have named. Behind those that were found
/// nothing is predicted.
pub fn of_listed_defects(frame: &FrameHeader) -> Option<Note> {
    beside_defects(frame, false)
}

fn beside_defects(frame: &FrameHeader, with_found: bool) -> Option<Note> {
    /// What nobody would see of a standard deviation.
    const LITTLE: f64 = 1e-3;
    let LeftOutTails { are_found, at_most } = left_out_tails(frame)?;
    let too_large = at_most - 1.0;
    if too_large < LITTLE || are_found && !with_found {
        return None;
    }
    let percent = in_digits(100.0 * too_large, 2);
    let name = &frame.name;
    Some(Note::Warning(match are_found {
        true => format!(
            "{name}: hot pixels or random telegraph signals that stand out were found and left out, but the standard deviations count them: they are up to \
             {percent} % too large"
        ),
        false => format!(
            "{name}: the noise that is told of it counts all hot pixels and random telegraph signals of its sensor; if its list of defects names such, \
             standard deviations are up to {percent} % too large"
        ),
    }))
}

/// A warning of codes that are not proportional to charge, of which colors are made all the same.
pub fn of_bent_codes(frame: &FrameHeader) -> Option<Note> {
    let metadata = &frame.metadata;
    let of_sensor = || metadata.sensor.as_ref()?.readout.as_ref().map(AdcRecord::of_readout);
    let adc = metadata.adc.or_else(of_sensor).filter(AdcRecord::is_bent)?;
    let codes =
        (0..=adc.top_code()).map(f64::from).filter(|code| *code > adc.bias_adu + 0.01 * f64::from(adc.top_code()));
    let straight = AdcRecord { is_linearized: true, ..adc };
    let change = |code: f64| (straight.sample(code) - adc.bias_adu) / (code - adc.bias_adu) - 1.0;
    let most = codes.map(change).fold(0.0, |most: f64, change| if change.abs() > most.abs() { change } else { most });
    Some(Note::Warning(format!(
        "{}: its codes are not proportional to charge, by up to {:.2} %; `correct-frame --linearize` makes them so",
        frame.name,
        100.0 * most
    )))
}

/// A warning of a converter whose slope looks like its inverse, electrons per ADU: full well is far from the range of codes,
/// and would be near it.
pub fn of_slope(frame: &FrameHeader) -> Option<Note> {
    let (adc, readout) = (frame.metadata.adc?, frame.metadata.sensor.as_ref()?.readout.as_ref()?);
    doubt_of_slope(&adc, readout.full_well_e)
}

/// The same of a converter behind such a full well.
pub(super) fn doubt_of_slope(adc: &AdcRecord, full_well_e: f64) -> Option<Note> {
    let range_e = f64::from(adc.top_code()) / full_well_e;
    let is_near = |slope: f64| (0.25..4.0).contains(&(slope / range_e));
    let (slope, inverse) = (adc.adu_per_e, adc.adu_per_e.recip());
    (!(0.05..20.0).contains(&(slope / range_e)) && is_near(inverse)).then(|| {
        Note::Warning(format!(
            "a slope of {slope} ADU per electron puts full well at {:.4} of the largest code; it looks like electrons per \
             ADU, whose inverse is {inverse:.4}",
            slope / range_e
        ))
    })
}
