//! Statistics over frames, told when all have come.

use super::session::Session;
use crate::error::Result;
use crate::formats::output;
use crate::report::{self, ReportFormat};
use crate::requests::measurement::SharedFrames;
use crate::requests::of_over_frames;
use crate::requests::options::Output;
use std::path::Path;

impl Session {
    /// Writes what statistics over frames say, and the frame of means and variances where a file is named for it.
    ///
    /// # Errors
    ///
    /// Those of [`SharedFrames::finish`] and of writing; [`crate::error::Error::Data`] where frames are not as predicted.
    pub fn tell_over_frames(
        &self,
        statistics: SharedFrames,
        pixels: Option<&Output>,
        format: ReportFormat,
        output: Option<&Path>,
    ) -> Result<()> {
        let (report, mut frame) = statistics.finish()?;
        let name = frame.header.name.clone();
        if let Some(place) = pixels {
            self.write_whole(&mut frame, place)?;
        }
        self.tell(&of_over_frames(&report));
        output::write_text(output, &report::over_frames(&report, format)?)?;
        report.check.map_or(Ok(()), |verdict| verdict.judge(&name))
    }
}
