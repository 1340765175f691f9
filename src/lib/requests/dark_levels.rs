//! What came off a frame and cannot well be its dark signal, by its mean.

use crate::metadata::FrameHeader;
use crate::stages::bounds::Bounds;
use crate::stages::darks::{DRIFT, Misfit};

/// Black and white level of a frame, where both are known.
pub(super) fn range_of(frame: &FrameHeader) -> Option<[f64; 2]> {
    let [black, white] = [frame.metadata.black_level_adu?.largest(), frame.metadata.white_level_adu?.largest()];
    (white > black).then_some([black, white])
}

/// A warning of what came off a frame and cannot well be its dark signal: a mean above that of the frame, or, where nothing tells that
/// it is one, far up on the way from black to white.
pub(super) fn doubt_of_level(name: &str, [frame, dark]: [f64; 2], range_adu: Option<[f64; 2]>) -> Option<String> {
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

/// What the mean of frames without light is at least, bias frames where `is_bias`: the bias less what noise takes, or, of cameras whose
/// noise is not known, a share of the bias of the sensor that is named, or else of the black level. That may count the dark signal of the
/// exposure, which bias frames lack.
pub(super) fn least_level(frame: &FrameHeader, is_bias: bool) -> Option<f64> {
    /// Black levels are told to a few per cent.
    const MOST_OF_BLACK: f64 = 0.75;
    /// So many times the bias may a black level be that counts dark signal.
    const MOST_OF_BIAS: f64 = 10.0;
    let by_converter = Bounds::of(frame).and_then(|bounds| bounds.mean);
    let metadata = &frame.metadata;
    let share = || {
        let black = metadata.black_level_adu.map(|black| black.sites().into_iter().fold(f64::INFINITY, f64::min));
        match metadata.bias_adu().filter(|_| is_bias) {
            Some(bias) => Some(MOST_OF_BLACK * bias),
            None if is_bias => black.map(|black| black / MOST_OF_BIAS),
            None => black.or(metadata.bias_adu()).map(|level| MOST_OF_BLACK * level),
        }
    };
    by_converter.or_else(|| share().filter(|least| *least > 0.0 && metadata.adc.is_none()))
}

/// A warning of what came off a frame whose bias it does not reach.
pub(super) fn doubt_of_low(name: &str, dark: f64, least: f64) -> Option<String> {
    (dark < least).then(|| {
        format!(
            "{name}: what came off has a mean of {dark:.1} ADU, and by the frame's metadata dark and bias frames have {least:.1} ADU \
             at least; are these of another converter, or was their bias subtracted?"
        )
    })
}

/// A warning of what came off a frame and cannot well be dark frames of it, by the samples of both.
pub(super) fn doubt_of_misfit(name: &str, misfit: Misfit) -> String {
    let percent = |share: f64| format!("{:.0} %", 100.0 * share);
    match misfit {
        Misfit::Below(share) => format!(
            "{name}: in {} of it its mean is below that of what came off; are these dark or bias frames of it, and of the scale of its codes?",
            percent(share)
        ),
        Misfit::Step([frame, darks]) => format!(
            "{name}: its codes are multiples of {frame}, those of what came off of {darks}; their scales may differ, as those of 14 and of \
             16 bits do"
        ),
        Misfit::Scatters(share) => format!(
            "{name}: what came off scatters more than it in {} of it, and dark frames of its gain, scale and temperature scatter less",
            percent(share)
        ),
    }
}

/// A warning of what came off a frame and is a few times its black level, as frames of another number of bits are.
pub(super) fn doubt_of_scale(name: &str, dark: f64, black: Option<f64>) -> Option<String> {
    /// Numbers of bits differ by no more.
    const MOST_BITS: i32 = 4;
    /// Black levels are told, and dark signals are small, to this share.
    const NEAR: f64 = 0.05;
    let ratio = dark / black.filter(|black| *black > 0.0)?;
    let scale = (1..=MOST_BITS).map(|bits| 2_f64.powi(bits)).find(|scale| (ratio / scale - 1.0).abs() < NEAR)?;
    Some(format!(
        "{name}: what came off has a mean of {dark:.1} ADU, {scale} times its black level; are these of another number of bits, or is that \
         dark signal?"
    ))
}
