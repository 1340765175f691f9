//! Why a number does not follow from the levels of a class, and which frames would tell it.

use super::curve::{Curve, LEAST_VARIANCE, cut_off, first_cut, hot_share};
use super::level::Level;

/// Of darks whose noise code 0 cuts off.
pub const CLIPPED: &str =
    "darks are clipped at code 0: it takes frames with the black level of the camera raised above their noise";
/// Of darks whose hot photosites are full, and are not in others.
pub const CUT_OFF: &str = "hot photosites are full, or reach the largest code, in the longer darks: it takes darks at three shorter \
                           exposure times or more";
/// Of flats no one of which is beyond saturation.
const UNSATURATED: &str = "the variance still rises at the brightest flat: brighter ones, until it falls, would tell";

/// Of what frames without any noise do not tell.
pub const NO_NOISE: &str = "the frames show none at all, not even noise: it takes frames as a camera gives them";

/// Of rows whose neighbors have hardly more of a drift in common than noise of their own.
pub const DRIFT_OF_FEW_ROWS: &str = "the black level drifts within so few rows that noise of rows is not told from it";

/// Of frames that were corrected by darks, or by black beside the image.
pub const LOST_DARK: &str =
    "what dark charge adds on average came off the frames: it takes darks as the camera gives them";

/// What is said of dark noise that is not that of no exposure time but of such a one.
pub fn time_of_noise(time_s: Option<f64>) -> String {
    let of = time_s.map_or("the exposure time of the darks, which is not known".to_owned(), |time| format!("{time} s"));
    format!(
        "temporal dark noise, and the threshold with it, is that of {of}, shot noise of the dark charge included: darks at three exposure \
         times or more would tell that of no time"
    )
}

/// What is said of dark noise of so few darks.
pub fn frames_of_noise(frames: f64) -> String {
    format!(
        "temporal dark noise is that of {frames} darks: photosites that jump, and did not between them, are not in it, which four darks or more of \
         the shortest exposure time would show"
    )
}

/// The levels that reasons are told of.
#[derive(Clone, Copy)]
pub struct Reasons<'a> {
    /// The curve through them.
    pub curve: &'a Curve,
    /// Flats.
    pub flats: &'a [Level],
    /// Darks of the flats' temperature.
    pub darks: &'a [Level],
    /// Darks of all temperatures.
    pub all_darks: &'a [Level],
    /// Whether darks of the flats' temperature are left out, as code 0 cuts them off.
    pub is_left_out: bool,
}

impl Reasons<'_> {
    /// Why darks do not tell what no light is.
    pub fn of_darks(self) -> String {
        if self.darks.is_empty() {
            no_darks(self.all_darks).into()
        } else if self.curve.are_darks_clipped {
            CLIPPED.into()
        } else {
            "no dark is known to have the exposure time of the flats: it takes two of it, or darks at two exposure times or more, \
             which `exposure_s` of a list tells"
                .into()
        }
    }

    /// Why saturation is not told.
    pub fn of_saturation(self) -> String {
        let Some(cut) = self.curve.cut_from else { return UNSATURATED.into() };
        format!(
            "part of the photosites is cut off from a mean of {:.1} ADU on, but the variance falls in no flat: some of a tenth more light than \
             that would tell",
            self.flats[cut].mean
        )
    }

    /// Why temporal noise of darks, or the pattern beneath it, is not told.
    pub fn of_noise(self) -> String {
        let Self { curve, darks, .. } = self;
        if darks.is_empty() || curve.are_darks_clipped {
            self.of_darks()
        } else if curve.is_silent {
            silent()
        } else {
            "the temporal variance of darks is not told from that of rounding: it takes more darks, or frames at a higher gain of the \
             camera"
                .into()
        }
    }

    /// Why darks do not tell what goes by time.
    pub fn of_times(self) -> String {
        match self.darks {
            [_, ..] if self.curve.are_darks_clipped || self.is_left_out => CLIPPED.into(),
            _ if self.curve.are_darks_cut_off() => CUT_OFF.into(),
            darks if darks.len() < self.all_darks.len() => {
                "it takes darks at three exposure times or more, of the flats' temperature".into()
            }
            _ => "it takes darks at three exposure times or more".into(),
        }
    }

    /// Why the response to photons is not told.
    pub fn of_photons(self) -> String {
        let is_counted = |flat: &Level| flat.condition.photons.is_some_and(|photons| photons > 0.0);
        if !self.flats.iter().any(is_counted) {
            "the photons per photosite of the flats are not known".into()
        } else if self.curve.fitted().iter().any(|&flat| is_counted(&self.flats[flat])) {
            self.of_darks()
        } else {
            "the photons per photosite of the flats well below saturation are not known".into()
        }
    }
}

/// Why there are no darks of the flats' temperature.
pub fn no_darks(all_darks: &[Level]) -> &'static str {
    if all_darks.is_empty() {
        "it takes two darks or more"
    } else {
        "the darks are of other temperatures than the flats: it takes two darks or more of the flats' temperature"
    }
}

/// Of darks whose noise rounding hides.
pub fn silent() -> String {
    format!(
        "darks have a temporal variance below {LEAST_VARIANCE} codes², which rounding hides: it takes frames at a higher gain of the \
         camera"
    )
}

/// Why no gain follows from flats.
pub fn of_gain(flats: &[Level], darks: &[Level], rounding: f64) -> String {
    let (hot, cut_from) = (hot_share(darks), first_cut(flats, darks, rounding).unwrap_or(flats.len()));
    let reason = |(place, flat): (usize, &Level)| {
        cut_off(flat, hot, rounding).or((place >= cut_from).then_some("have photosites that are cut off"))
    };
    let reasons: Vec<&str> = flats.iter().enumerate().filter_map(reason).collect();
    let mut kinds = reasons.clone();
    kinds.sort_unstable();
    kinds.dedup();
    let count = |what: &str| reasons.iter().filter(|reason| **reason == what).count();
    let told: Vec<String> = kinds.iter().map(|what| format!("{} {what}", count(what))).collect();
    let left_out = match &told[..] {
        [] => String::new(),
        told => format!(" (of {} levels of flats {})", flats.len(), told.join(", and ")),
    };
    format!(
        "no gain follows: it takes two flats of one light below saturation, with darks of their exposure time, or flats at several \
         levels{left_out}"
    )
}
