//! What came off a frame and cannot well be its dark signal, by its mean.

use crate::camera::levels::{BlackLevel, LEAST_OF_BIAS, OF_COOLED, near_black};
use crate::camera::readout::ReadOut;
use crate::formats::input::TOO_DARK;
use crate::formats::register;
use crate::metadata::{FrameHeader, MasterKind, Scene, TakenAs};
use crate::stages::bounds::{Bounds, most_off_bias};
use crate::stages::darks::{DRIFT, DarkFrames, DarkStack, Misfit};
use crate::stages::flats::FlatFrames;
use crate::stream::RowSource;
use crate::text::percent_in_decimals;

/// What a frame and its sensor tell of the mean of its dark frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct DarkLevels {
    /// Black and white level of the frame, as far as darks are taken for such on trust.
    range_adu: Option<[f64; 2]>,
    /// What it is at least.
    least_adu: Option<f64>,
    /// What it can well be at most, and what tells it.
    most_adu: Option<(f64, &'static str)>,
    /// The bias of the sensor that is named, and the dark signal above it that it predicts.
    predicted_adu: Option<[f64; 2]>,
    /// The black level of a camera's frame.
    black_adu: Option<f64>,
    /// What it is at least by the bias of the sensor, and by the dark signal that it predicts too.
    least_predicted_adu: Option<[f64; 2]>,
    /// What the mean of bias frames beside dark frames can well be at most, and what tells it.
    most_bias_adu: Option<(f64, &'static str)>,
    /// Whether the exposure is so long that a dark signal may be as much as the black level.
    is_long: bool,
    /// Whether a black level or a bias is known, which darks without it lie below.
    knows_black: bool,
}

impl DarkLevels {
    /// Those of a frame and of what comes off it; `on_trust` where nothing tells that these are dark frames.
    pub(super) fn of(frame: &FrameHeader, darks: Option<&DarkStack>, on_trust: bool) -> Self {
        let metadata = &frame.metadata;
        let predicted_adu = darks.and_then(|darks| predicted_level(frame, darks));
        Self {
            range_adu: range_of(frame).filter(|_| on_trust),
            least_adu: least_level(frame, darks.is_some_and(DarkStack::is_bias)),
            most_adu: darks.and_then(|darks| most_level(frame, darks, darks.is_bias())),
            predicted_adu,
            least_predicted_adu: least_predicted(frame, predicted_adu.map_or(0.0, |[_, signal]| signal)),
            most_bias_adu: darks.and_then(|darks| most_level(frame, darks, true)),
            black_adu: metadata.black_level_adu.filter(|_| metadata.adc.is_none()).map(BlackLevel::mean),
            is_long: metadata.time_s().is_some_and(|time_s| time_s >= LONG_S) && predicted_adu.is_none(),
            knows_black: metadata.black_level_adu.is_some() || metadata.bias_adu().is_some(),
        }
    }

    /// Those of flats for a frame and of what comes off them.
    pub(super) fn of_flats<S: RowSource>(frame: &FrameHeader, flats: &FlatFrames<S>) -> Self {
        Self::of(&flats.head_beside(frame), flats.darks().map(DarkFrames::stack), false)
    }

    /// Whether a mean is the dark signal that the sensor predicts, for half of what it has above the bias or more.
    fn explains(&self, dark: f64) -> bool {
        self.predicted_adu.is_some_and(|[bias, signal]| 2.0 * signal >= dark - bias)
    }

    /// What cannot well be of the dark signal of the frame `name`, by what came off it.
    pub(super) fn doubt<S: RowSource>(&self, name: &str, darks: &DarkFrames<S>) -> Option<String> {
        let misfit = || darks.misfit().map(|misfit| doubt_of_misfit(name, misfit));
        let border = || darks.left_at_border().and_then(|left| doubt_of_border(name, left));
        let zeros = || darks.at_zero().filter(|_| !self.knows_black).map(doubt_of_zeros);
        let below = || darks.below_zero().map(doubt_of_negatives).or_else(zeros);
        let Some([frame, dark]) = darks.means() else { return misfit().or_else(border).or_else(below) };
        let is_told = self.explains(dark);
        let range_adu = self.range_adu.filter(|_| !is_told);
        let black_adu = self.black_adu.filter(|_| !is_told);
        let low = self.doubt_of_least(name, dark);
        low.or_else(|| doubt_of_level(name, [frame, dark], range_adu))
            .or_else(misfit)
            .or_else(|| doubt_of_scale(name, dark, black_adu, |scale| !self.is_long || darks.are_multiples_of(scale)))
            .or_else(|| self.most_adu.and_then(|most| doubt_of_high(name, dark, above(most, darks.step_of_frame()))))
            .or_else(|| self.doubt_of_bias(darks))
            .or_else(border)
            .or_else(below)
    }

    /// What cannot well be of what came off flats, whose levels these are.
    pub(super) fn doubts_of_flats<S: RowSource>(&self, flats: &FlatFrames<S>) -> Vec<String> {
        let name = flats.name();
        let of_share = |share: f64| {
            format!(
                "{name}: in {} % of it its mean is below that of what came off; are these dark or bias frames of it?",
                percent_in_decimals(share, 0)
            )
        };
        let below = flats.below_darks().map(of_share);
        let Some(darks) = flats.darks() else { return Vec::new() };
        let level = || {
            let dark = darks.mean()?;
            self.doubt_of_least(name, dark).or_else(|| doubt_of_high(name, dark, self.most_adu?))
        };
        let doubt = below.or_else(level).or_else(|| self.doubt_of_bias(darks));
        let doubt = doubt.or_else(|| flats.darks_below_zero().map(doubt_of_negatives));
        let doubt = doubt.or_else(|| flats.darks_at_zero().filter(|_| !self.knows_black).map(doubt_of_zeros));
        doubt.into_iter().chain(darks.unlike().map(doubt_of_one)).collect()
    }

    /// A warning of a mean below what dark frames have.
    fn doubt_of_least(&self, name: &str, dark: f64) -> Option<String> {
        let low = self.least_adu.and_then(|least| doubt_of_low(name, dark, least));
        // A frame that lacks the dark signal itself is told of already.
        let of_frame = || register::has_doubt(|doubt| doubt.starts_with(name) && doubt.contains(TOO_DARK));
        let short = self.least_predicted_adu.and_then(|least| doubt_of_short(name, dark, least));
        low.or_else(|| short.filter(|_| !of_frame()))
    }

    /// A warning of bias frames beside dark frames that are none.
    fn doubt_of_bias<S: RowSource>(&self, darks: &DarkFrames<S>) -> Option<String> {
        let (name, bias) = darks.mean_of(MasterKind::Bias)?;
        let (_, dark) = darks.mean_of(MasterKind::Dark)?;
        let [near, share] = NEAR;
        if bias - dark > near.max(share * dark.abs()) {
            return Some(format!(
                "{name}: its mean is {bias:.1} ADU, above that of the dark frames, {dark:.1} ADU, which a bias frame is below; was it lit, or \
                 exposed for long?"
            ));
        }
        let most = self.most_bias_adu.map(|most| above(most, darks.step_of_frame()));
        let (most, by) = most.filter(|(most, _)| bias > *most)?;
        Some(format!(
            "{name}: its mean is {bias:.1} ADU, and by the frame's {by} bias frames have {most:.1} ADU at most; was it lit, or exposed for long?"
        ))
    }
}

/// Levels are told to so many ADU, and to such a share.
const NEAR: [f64; 2] = [4.0, 0.02];
/// So many times may a dark signal be off what the sensor predicts: sensors of one model, and temperatures that nobody told, differ.
const TIMES: f64 = 10.0;

/// Exposures from here on may collect a dark signal of a whole black level, s.
const LONG_S: f64 = 1.0;
/// Frames of cameras that tell no time are exposed no longer, s; a dark signal [`TIMES`] as large as the sensor's is that of ten minutes.
const UNTOLD_S: f64 = 60.0;
/// Levels of a sensor that drifts differ by less than this share of its read noise.
const OF_NOISE: f64 = 0.5;

/// How far off a level frames may be, ADU, as far as the sensor tells its noise.
fn near(level: f64, readout: &ReadOut, slope: f64) -> f64 {
    let [near, share] = NEAR;
    near.max(share * level.abs()).max(OF_NOISE * slope * readout.read_noise_e)
}

/// What a mean can well be at most, where codes lie a step apart: two of these more than where they are whole.
fn above((most, by): (f64, &'static str), step: f64) -> (f64, &'static str) {
    (if step > 1.0 { most + 2.0 * step } else { most }, by)
}

/// Black and white level of a frame, where both are known.
fn range_of(frame: &FrameHeader) -> Option<[f64; 2]> {
    let [black, white] = [frame.metadata.black_level_adu?.largest(), frame.metadata.white_level_adu?.largest()];
    (white > black).then_some([black, white])
}

/// A warning of what came off a frame and cannot well be its dark signal: a mean above that of the frame, or, where nothing tells that
/// it is one, far up on the way from black to white.
fn doubt_of_level(name: &str, [frame, dark]: [f64; 2], range_adu: Option<[f64; 2]>) -> Option<String> {
    /// Dark frames are below this share of the range.
    const MOST_OF_RANGE: f64 = 0.25;
    if dark - frame > DRIFT[0].max(DRIFT[1] * dark.abs()) {
        return Some(format!(
            "{name}: its mean is {frame:.1} ADU, below that of what came off, {dark:.1} ADU; are these dark or bias frames of it?"
        ));
    }
    let [black, white] = range_adu?;
    let share = (dark - black) / (white - black);
    (share > MOST_OF_RANGE).then(|| {
        format!(
            "{name}: what came off has a mean of {dark:.1} ADU, {:.0} % of the way from black to white; dark frames are darker, and nothing \
             tells that these are such",
            100.0 * share
        )
    })
}

/// A warning of a frame that dark frames come off and that is one itself: a shell gives `--dark` the first of several names.
pub(super) fn doubt_of_dark(frame: &FrameHeader) -> Option<String> {
    let is_unlit = frame.metadata.scene.as_ref().is_some_and(Scene::is_dark)
        || matches!(frame.metadata.taken_as, Some(TakenAs::Dark | TakenAs::Bias));
    is_unlit.then(|| {
        format!(
            "{}: no light fell on it: it is a dark frame itself; to take several names for --dark put them in quotes, \
             --dark 'dark-*.exr'",
            frame.name
        )
    })
}

/// What the mean of frames without light is at least, bias frames where `is_bias`: the bias less what noise takes, or, of cameras whose
/// noise is not known, a share of the bias of the sensor that is named, or else of the black level. That may count the dark signal of the
/// exposure, which bias frames lack.
fn least_level(frame: &FrameHeader, is_bias: bool) -> Option<f64> {
    /// So many times the bias may a black level be that counts dark signal.
    const MOST_OF_BIAS: f64 = 10.0;
    let by_converter = Bounds::of(frame).and_then(|bounds| bounds.mean);
    let metadata = &frame.metadata;
    let share = || {
        let black = metadata.black_level_adu.map(|black| black.sites().into_iter().fold(f64::INFINITY, f64::min));
        match metadata.bias_adu().filter(|_| is_bias) {
            Some(bias) => Some(LEAST_OF_BIAS * bias),
            None if is_bias => black.map(|black| black / MOST_OF_BIAS),
            None => black.or(metadata.bias_adu()).map(|level| LEAST_OF_BIAS * level),
        }
    };
    by_converter.or_else(|| share().filter(|least| *least > 0.0 && metadata.adc.is_none()))
}

/// What the mean of dark frames of a frame can well be at most, ADU, and what tells it: the bias of its sensor and ten times the dark
/// signal, as sensors of one model and temperatures that nobody told differ; or its black level, where no time is left for dark signal.
fn most_level(frame: &FrameHeader, darks: &DarkStack, is_bias: bool) -> Option<(f64, &'static str)> {
    /// Black levels of cameras are told to so many ADU, and to such a share.
    const NEAR_BLACK: [f64; 2] = [8.0, 0.05];
    /// Exposures in which no camera collects a dark signal that shows, s.
    const SHORT_S: f64 = 0.1;
    let metadata = &frame.metadata;
    let off = |level: f64, near: [f64; 2]| level + near[0].max(near[1] * level.abs());
    if let Some(readout) = metadata.sensor.as_ref().and_then(|sensor| sensor.readout.as_ref()) {
        let own = (metadata.time_s(), metadata.temperature_k());
        let masters = darks.masters();
        let of_masters = masters.iter().map(|master| (master.exposure_s.or(own.0), master.temperature_k.or(own.1)));
        let doses = std::iter::once(own).chain(of_masters).map(|conditions| dark_charge_e(readout, conditions));
        let known = doses.into_iter().try_fold(0.0, |most: f64, e| Some(most.max(e?)));
        let (most_e, by) = match known {
            _ if is_bias => (0.0, "sensor"),
            Some(most_e) => (most_e, "sensor"),
            None => (dark_charge_e(readout, (Some(UNTOLD_S), own.1))?, "sensor, in a minute, as no time is told,"),
        };
        let slope = metadata.adu_per_e().unwrap_or(readout.adu_per_e);
        let bias = metadata.bias_adu().unwrap_or(readout.bias_adu);
        return Some((bias + near(bias, readout, slope) + TIMES * slope * most_e, by));
    }
    let is_short = is_bias || metadata.time_s().is_some_and(|time_s| time_s <= SHORT_S);
    let black = metadata.black_level_adu.filter(|_| is_short)?;
    Some((off(black.largest(), NEAR_BLACK), "black level"))
}

/// The mean dark charge of a sensor, of a time in s and a temperature in K, or that of its read-out; none where the time is to be known.
fn dark_charge_e(readout: &ReadOut, (time_s, temperature_k): (Option<f64>, Option<f64>)) -> Option<f64> {
    let [ordinary, hot] = readout.dark_charges_e(temperature_k.unwrap_or(readout.temperature_k), time_s)?;
    Some(ordinary + readout.hot_pixel_share * hot)
}

/// The most dark signal that a frame of a black level can well have, ADU: ten times what its sensor predicts; of other cameras as much as the
/// black level in [`LONG_S`], which is the time of a frame that tells none.
pub(super) fn most_dark_signal(frame: &FrameHeader, black: f64) -> f64 {
    let metadata = &frame.metadata;
    let Some(readout) = metadata.sensor.as_ref().and_then(|sensor| sensor.readout.as_ref()) else {
        return near_black(black).max(black) * metadata.time_s().map_or(1.0, |time_s| time_s / LONG_S);
    };
    let conditions = (metadata.time_s().or(Some(UNTOLD_S)), metadata.temperature_k());
    let slope = metadata.adu_per_e().unwrap_or(readout.adu_per_e);
    TIMES * slope * dark_charge_e(readout, conditions).unwrap_or_default()
}

/// The bias of the sensor that is named, and the dark signal that it predicts of what comes off, ADU; of dark frames that do not tell
/// their time or temperature, at those of the frame.
fn predicted_level(frame: &FrameHeader, darks: &DarkStack) -> Option<[f64; 2]> {
    let metadata = &frame.metadata;
    let readout = metadata.sensor.as_ref()?.readout.as_ref()?;
    let own = (metadata.time_s(), metadata.temperature_k());
    let masters = darks.masters();
    let of_kind = masters.iter().filter(|master| master.kind == MasterKind::Dark);
    let charge_e = of_kind.map(|master| {
        let conditions = (master.exposure_s.or(own.0), master.temperature_k.or(own.1));
        dark_charge_e(readout, conditions).map(|e| master.weight * e)
    });
    let slope = metadata.adu_per_e().unwrap_or(readout.adu_per_e);
    Some([metadata.bias_adu().unwrap_or(readout.bias_adu), slope * charge_e.sum::<Option<f64>>()?])
}

/// What the mean of bias frames is at least, and that of dark frames, where the sensor predicts a dark signal above its bias, ADU. Where
/// nothing tells the temperature, the sensor may be cooled.
fn least_predicted(frame: &FrameHeader, signal: f64) -> Option<[f64; 2]> {
    let metadata = &frame.metadata;
    let is_told = metadata.sensor_temperature_k.is_some() || metadata.noise.is_some();
    let readout = metadata.sensor.as_ref()?.readout.as_ref()?;
    let bias = metadata.bias_adu().unwrap_or(readout.bias_adu);
    // A full photosite has no more.
    let slope = metadata.adu_per_e().unwrap_or(readout.adu_per_e);
    let full = 0.5 * slope * readout.full_well_e;
    let least = (signal / if is_told { TIMES } else { TIMES * OF_COOLED }).min(full);
    let off = near(bias, readout, slope).max(most_off_bias(frame, readout)?);
    Some([bias - off, bias - off + least])
}

/// A warning of what came off a frame and lies far below the bias or the dark signal that its sensor has.
fn doubt_of_short(name: &str, dark: f64, [of_bias, least]: [f64; 2]) -> Option<String> {
    let question = if dark < of_bias {
        "are these of another camera or converter, or was their level shifted?"
    } else {
        "are these bias frames, or of a shorter exposure, or does the camera take dark signal off itself?"
    };
    (dark < least).then(|| {
        format!(
            "{name}: what came off has a mean of {dark:.1} ADU, and by the frame's sensor, exposure and temperature dark frames have {least:.1} \
             ADU at least; {question}"
        )
    })
}

/// A warning of what came off a frame and lies above what dark frames of it read.
fn doubt_of_high(name: &str, dark: f64, (most, by): (f64, &str)) -> Option<String> {
    (dark > most).then(|| {
        format!(
            "{name}: what came off has a mean of {dark:.1} ADU, and by the frame's {by} dark frames have {most:.1} ADU at most; did light fall \
             on them, or was their level shifted?"
        )
    })
}

/// A warning of frames that count as one, one of which is at another level than the others.
pub(super) fn doubt_of_one((name, [mean, median]): (&str, [f64; 2])) -> String {
    format!(
        "{name}: its mean is {mean:.1} ADU, and that of the frames which it counts as one with {median:.1} ADU; was it lit, or its level shifted?"
    )
}

/// A warning of what is left of photosites that no light reaches.
fn doubt_of_border(name: &str, [left, deviation]: [f64; 2]) -> Option<String> {
    /// Black levels drift by less from frame to frame, ADU.
    const DRIFT_ADU: f64 = 4.0;
    const Z: f64 = 8.0;
    (left.abs() > DRIFT_ADU + Z * deviation).then(|| {
        format!(
            "{name}: {left:.1} ADU are left of its masked photosites by what came off; is that of another exposure or level, or was it lit?"
        )
    })
}

/// A warning of what came off a frame whose bias it does not reach.
fn doubt_of_low(name: &str, dark: f64, least: f64) -> Option<String> {
    (dark < least).then(|| {
        format!(
            "{name}: what came off has a mean of {dark:.1} ADU, and by the frame's metadata dark and bias frames have {least:.1} ADU \
             at least; are these of another converter, or was their bias subtracted?"
        )
    })
}

/// A warning of dark frames with samples below zero.
fn doubt_of_negatives((name, share): (&str, f64)) -> String {
    format!(
        "{name}: {} % of its samples are below zero, as no camera writes them; was a bias taken off? What it lacks stays in the frame",
        percent_in_decimals(share, 0)
    )
}

/// A warning of dark frames that are cut off at zero, beside a frame that is far above it.
fn doubt_of_zeros((name, share): (&str, f64)) -> String {
    format!(
        "{name}: {} % of its samples are exactly 0, and nothing of what it comes off is near it; was a bias taken off, and what fell below \
         zero cut off? What it lacks stays in the frame",
        percent_in_decimals(share, 0)
    )
}

/// A warning of what came off a frame and cannot well be dark frames of it, by the samples of both.
fn doubt_of_misfit(name: &str, misfit: Misfit) -> String {
    let percent = |share: f64| format!("{} %", percent_in_decimals(share, 0));
    match misfit {
        Misfit::Below(share) => format!(
            "{name}: in {} of it its mean is below that of what came off; are these dark or bias frames of it, and of the scale of its codes?",
            percent(share)
        ),
        Misfit::Step([frame, darks]) => format!(
            "{name}: its codes are multiples of {frame}, those of what came off of {darks}; their scales may differ, as those of 14 and of \
             16 bits do"
        ),
        Misfit::Shifted([frame, darks]) => format!(
            "{name}: its codes are multiples of {frame}, those of what came off of {darks}, and it is brighter throughout by as many times; \
             unless these are averages their scales differ, as those of 12 bits and of 16 do"
        ),
        Misfit::Shares([frame, darks]) => format!(
            "{name}: what came off reads {darks:.4} at most, by means of 64 photosites, and the frame up to {frame:.1}; is that shares of 1 beside codes?"
        ),
        Misfit::Scatters(share) => format!(
            "{name}: what came off scatters more than it in {} of it, and dark frames of its gain, scale and temperature scatter less",
            percent(share)
        ),
    }
}

/// A warning of what came off a frame and is a few times its black level, as frames of another number of bits are, as far as they can be of
/// such a scale.
fn doubt_of_scale(name: &str, dark: f64, black: Option<f64>, can_be: impl Fn(u64) -> bool) -> Option<String> {
    /// Numbers of bits differ by no more.
    const MOST_BITS: u32 = 4;
    /// Black levels are told, and dark signals are small, to this share.
    const NEAR: f64 = 0.05;
    let ratio = dark / black.filter(|black| *black > 0.0)?;
    let is_near = |bits: &u32| (ratio / f64::from(*bits).exp2() - 1.0).abs() < NEAR;
    let scale = 1_u64 << (1..=MOST_BITS).find(is_near)?;
    if !can_be(scale) {
        return None;
    }
    Some(format!(
        "{name}: what came off has a mean of {dark:.1} ADU, {scale} times its black level; are these of another number of bits, or is that \
         dark signal?"
    ))
}
