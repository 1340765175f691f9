//! What is looked for in the samples of a frame while they are read.

mod shares;
mod steps;

use super::codes::CodeCheck;
use super::levels::LevelCheck;
use super::linear::LinearCheck;
use super::masked::MaskedCheck;
use super::time::TimeCheck;
use super::top::TopCheck;
use crate::camera::levels::{BlackLevel, BlackLevels};
use crate::error::Result;
use crate::formats::register;
use crate::metadata::FrameHeader;
use shares::ShareCheck;
use steps::StepCheck;

/// Checks of samples against metadata.
#[derive(Debug, Default)]
pub(super) struct Checks {
    /// The black level that a user says.
    pub said_black: Option<BlackLevel>,
    /// What comes off as a black level.
    pub taken_black: Option<BlackLevels>,
    /// From which share of the range, and which sample, on the file says that samples may be far from linear.
    pub linear_limit: Option<(f64, f64)>,
    /// A doubt of a black level of 0 that the file does not tell.
    pub doubt_of_black: Option<&'static str>,
    /// Whether samples that are heaped at the top are told, and times that cannot be.
    tells_top: bool,
    codes: Option<CodeCheck>,
    levels: Option<LevelCheck>,
    top: Option<TopCheck>,
    masked: Option<MaskedCheck>,
    time: Option<TimeCheck>,
    steps: Option<StepCheck>,
    linear: Option<LinearCheck>,
    shares: Option<ShareCheck>,
}

impl Checks {
    /// All of them, and where `tells_top` that of samples that are heaped at the top, which the first program of a pipe tells.
    pub fn telling_top(tells_top: bool) -> Self {
        Self { tells_top, ..Self::default() }
    }

    /// Makes ready for the rows of a frame, whose layer of marks comes with them where `is_marked`; those of codes only where they are
    /// given as they are stored. The exposure time is that of the file's own tags where `is_tagged`.
    pub fn begin(&mut self, frame: &FrameHeader, is_marked: bool, are_stored: bool, is_tagged: bool) {
        let is_zero = |black: &BlackLevels| black.uniform() == Some(0.0);
        let is_taken_for_zero = frame.black_levels().is_ok_and(|known| known.as_ref().is_some_and(is_zero))
            && self.taken_black.as_ref().is_none_or(is_zero);
        if let Some(doubt) = self.doubt_of_black.filter(|_| self.tells_top && is_taken_for_zero) {
            register::doubt(format!("{}: {doubt}", frame.name));
        }
        doubt_of_size(frame).filter(|_| self.tells_top).into_iter().for_each(register::doubt);
        if are_stored {
            (self.codes, self.levels) = (CodeCheck::of(frame), LevelCheck::of(frame, self.said_black));
            self.top = TopCheck::of(frame).filter(|_| self.tells_top && !is_marked);
            self.steps = StepCheck::of(frame).filter(|steps| !is_marked && (self.tells_top || steps.knows_sensor()));
            self.time = TimeCheck::of(frame, is_tagged).filter(|_| self.tells_top);
            self.shares = ShareCheck::of(frame).filter(|_| self.tells_top);
            self.linear = self.linear_limit.map(|limit| LinearCheck::of(frame, limit));
            self.masked = self.taken_black.take().and_then(|black| MaskedCheck::of(frame, black));
        }
    }

    /// Looks at rows of the frame.
    ///
    /// # Errors
    ///
    /// Those of [`CodeCheck::look`] and [`LevelCheck::look`].
    pub fn look(&mut self, rows: &[f32], frame: &FrameHeader) -> Result<()> {
        self.codes.as_mut().map_or(Ok(()), |codes| codes.look(rows, frame))?;
        self.levels.as_mut().map_or(Ok(()), |levels| levels.look(rows, frame))?;
        self.top.iter_mut().for_each(|top| top.look(rows, frame));
        self.masked.iter_mut().for_each(|masked| masked.look(rows, frame));
        self.time.iter_mut().for_each(|time| time.look(rows, frame));
        self.steps.iter_mut().for_each(|steps| steps.look(rows, frame));
        self.linear.iter_mut().for_each(|linear| linear.look(rows));
        self.shares.iter_mut().for_each(|shares| shares.look(rows));
        Ok(())
    }

    /// Judges the whole, once all rows were looked at.
    ///
    /// # Errors
    ///
    /// Those of [`LevelCheck::end`].
    pub fn end(&mut self, frame: &FrameHeader) -> Result<()> {
        self.top.take().iter().for_each(|top| top.end(frame));
        self.masked.take().into_iter().for_each(|masked| masked.end(frame));
        self.time.take().into_iter().for_each(|time| time.end(frame));
        self.steps.take().iter().for_each(|steps| steps.end(frame));
        self.linear.take().iter().for_each(|linear| linear.end(frame));
        self.shares.take().iter().for_each(|shares| shares.end(frame));
        self.levels.as_mut().map_or(Ok(()), |levels| levels.end(frame))
    }
}

/// A warning of a frame of a camera that is larger than the sensor which counts for it.
fn doubt_of_size(frame: &FrameHeader) -> Option<String> {
    let FrameHeader { name, geometry, metadata } = frame;
    let sensor = metadata.sensor.as_ref().filter(|_| metadata.noise.is_none() && metadata.scene.is_none())?;
    let readout = sensor.readout.as_ref()?;
    let size = [readout.width, readout.height].map(i64::from);
    let [x, y, width, height] = geometry.on_sensor();
    let end = [x + width, y + height];
    (end[0] > size[0] || end[1] > size[1]).then(|| {
        format!(
            "{name}: it has photosites up to column {} and row {}, and its sensor `{}` has {}x{} of them; is it a frame of another sensor?",
            end[0] - 1,
            end[1] - 1,
            sensor.name,
            size[0],
            size[1]
        )
    })
}
