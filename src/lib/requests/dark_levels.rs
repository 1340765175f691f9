//! What came off a frame and cannot well be its dark signal, by its mean.

use crate::metadata::FrameHeader;
use crate::stages::bounds::Bounds;

/// Black and white level of a frame, where both are known.
pub(super) fn range_of(frame: &FrameHeader) -> Option<[f64; 2]> {
    let [black, white] = [frame.metadata.black_level_adu?.largest(), frame.metadata.white_level_adu?.largest()];
    (white > black).then_some([black, white])
}

/// A warning of what came off a frame and cannot well be its dark signal: a mean above that of the frame, or, where nothing tells that
/// it is one, far up on the way from black to white.
pub(super) fn doubt_of_level(name: &str, [frame, dark]: [f64; 2], range_adu: Option<[f64; 2]>) -> Option<String> {
    /// Dark signals that drift from frame to frame differ by less, in ADU and as a share.
    const DRIFT: [f64; 2] = [1.0, 0.01];
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

/// What the mean of a frame without light is at least: the bias less what noise takes, or, of cameras whose noise is not known, most
/// of the black level.
pub(super) fn least_level(frame: &FrameHeader) -> Option<f64> {
    /// Black levels are told to a few per cent.
    const MOST_OF_BLACK: f64 = 0.75;
    let by_converter = Bounds::of(frame).and_then(|bounds| bounds.mean);
    let black = || {
        frame
            .metadata
            .black_level_adu
            .map(|black| MOST_OF_BLACK * black.sites().into_iter().fold(f64::INFINITY, f64::min))
    };
    by_converter.or_else(|| black().filter(|black| *black > 0.0 && frame.metadata.adc.is_none()))
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
