//! What comes up on the way, for the user to hear.

use crate::analysis::statistics::Report;
use crate::formats::input::FrameReader;
use crate::metadata::FrameHeader;
use crate::stream::RowSource;

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
        let text = || format!("{pixels} pixels are NaN or infinite; they are left out of the statistics");
        (pixels > 0).then(|| Self::Warning(text()))
    }
}

/// A warning of pixels that a frame marks as made of saturated samples, if those read were any.
pub fn of_marks(reader: &FrameReader) -> Option<Note> {
    let (name, pixels) = (&reader.header().name, reader.marked());
    let text =
        || format!("{name}: {pixels} of the pixels read were made of saturated samples; they are taken as they are");
    (pixels > 0).then(|| Note::Warning(text()))
}

/// What came up among statistics.
pub fn of_statistics(report: &Report) -> Vec<Note> {
    let not_finite = report.regions.iter().map(|region| region.not_finite).sum();
    let pixels: u64 = report.regions.iter().map(|region| region.saturated).sum();
    let saturated = match report.regions.iter().any(|region| region.leaves_saturated_out) {
        _ if pixels == 0 => None,
        true => Some(format!(
            "{pixels} pixels were made of saturated samples; they are left out of the statistics, so that these are of the \
             darker part alone (--keep-saturated keeps them in)"
        )),
        false => Some(format!(
            "{pixels} samples are saturated; the statistics hold for what was recorded, not for the light"
        )),
    };
    Note::not_finite(not_finite).into_iter().chain(saturated.map(Note::Warning)).collect()
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
    let doubts = if header.metadata.history.is_empty() { header.metadata.doubts() } else { Vec::new() };
    let doubts = doubts.into_iter().map(|doubt| format!("{}: {doubt}", header.name));
    remarks.chain(doubts.map(Note::Warning)).chain(of_levels(header)).collect()
}

/// A warning of a black level that leaves no room for light.
pub fn of_levels(frame: &FrameHeader) -> Option<Note> {
    let metadata = &frame.metadata;
    let (black, white) = (metadata.uniform_black_adu()?, metadata.white_level_adu?.largest());
    (black >= white).then(|| {
        Note::Warning(format!(
            "{}: its black level, {black} ADU, is not below its white level, {white} ADU: no sample tells of light",
            frame.name
        ))
    })
}
