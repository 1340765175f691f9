//! The white level that is left of a frame of which nothing tells the black level, once dark frames came off.

use super::notes::Note;
use super::options::Input;
use crate::error::Result;
use crate::formats::input::FrameReader;
use crate::metadata::FrameHeader;
use crate::stream::RowSource;
use std::path::Path;

/// Notes in the head of the corrected frame how far the white level of `frame` is above the mean of the first of the frames that come off,
/// where its black level does not tell that.
///
/// # Errors
///
/// Those of the reader.
pub(super) fn keep_white(
    corrected: &mut FrameHeader,
    frame: &FrameHeader,
    first: Option<&Path>,
    input: &Input,
) -> Result<Option<Note>> {
    let metadata = &frame.metadata;
    let is_asked = metadata.black_level_adu.is_none() && metadata.adc.is_none();
    let Some((white, path)) = metadata.white_level_adu.filter(|_| is_asked).zip(first) else { return Ok(None) };
    let mut dark = FrameReader::open(&input.beside(path))?;
    let (mut sum, mut count, mut samples) = (0.0, 0_u64, Vec::new());
    let mut left = dark.header().geometry.height;
    while left > 0 {
        let rows = dark.natural_rows().clamp(1, left);
        samples.clear();
        dark.read(rows, &mut samples)?;
        sum += samples.iter().map(|sample| f64::from(*sample)).sum::<f64>();
        count += samples.len() as u64;
        left -= rows;
    }
    let mean = sum / count as f64;
    let is_below = mean.is_finite() && mean < white.largest();
    Ok(is_below.then(|| {
        corrected.metadata.white_level_adu = Some(white.map(|level| level - mean));
        Note::Remark(format!(
            "{}: nothing tells its black level; its white level is told above the mean of {}, {mean:.2} ADU",
            frame.name,
            dark.header().name
        ))
    }))
}
