//! Photon transfer: what a camera is, from pairs or stacks of flats and darks, after EMVA 1288 release 4.0, linear model.
//!
//! [`survey()`] reads the frames of one condition; [`of_class`] makes of the levels of a class its gain, noise, saturation, patterns
//! and dark current, each with an interval, or says which frames would tell it.

mod curve;
mod dark;
mod dark_noise;
mod doubts;
mod falling;
mod few;
mod findings;
mod fit;
mod hot;
mod lanes;
mod level;
mod limit;
mod linearity;
mod marks;
mod neighbors;
mod pattern;
mod prints;
mod reasons;
mod rounding;
mod row_drift;
mod scatter;
mod settings;
mod sheet;
mod site_survey;
mod sites;
mod strangers;
mod stuck;
mod survey;
mod suspects;
mod tally;
mod unknown;
mod view;

pub use curve::{LEAST_VARIANCE, Values, full_mean};
pub use dark::doubling_temperature;
pub use findings::of_class;
pub use fit::Line;
pub use hot::{HotTail, dark_of_offset, dark_of_tail, hot_tail, parted};
pub use level::{Condition, Level};
pub use linearity::Linearity;
pub use pattern::left_in_mean;
pub use prints::Print;
pub use row_drift::RowDrift;
pub use settings::{Corrected, Ends, Settings};
pub use sheet::{ClassFindings, CurvePoint, DarkPoint, Finding, KEYS};
pub use site_survey::SiteSurvey;
pub use sites::Site;
pub use stuck::{Picture, Stuck, StuckSite};
pub use survey::{Asked, Survey, survey, survey_as};
pub use suspects::Suspect;
pub use view::{Blur, NAMED, OUTSTANDING, Outlier, PatternFigure, PatternView, pattern_view};
