//! Samples that are heaped at their largest value, as saturated ones are, where neither metadata nor marks tell of saturation.
//!
//! Of light and noise the largest values of a frame are its rarest. A converter that ends there, or a level to which samples were cut,
//! puts all that is brighter on one value.

use crate::cfa::CfaPattern;
use crate::formats::register;
use crate::metadata::FrameHeader;
use crate::numerics::largest::Largest;
use crate::stages::saturation::{FullLevels, samples_tell, untold};
use crate::units::QuantityKind;

/// The largest samples of a frame.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct TopCheck {
    planes: Vec<Largest>,
    /// The pattern whose photosites were measured, and stay as they are behind demosaicking, beside which what is interpolated may be
    /// larger; none where all were.
    measured: Option<CfaPattern>,
    row: usize,
}

impl TopCheck {
    /// Of frames of photosites, and of pixels that were made of them, whose saturated samples nothing else tells.
    pub fn of(frame: &FrameHeader) -> Option<Self> {
        let is_of_sensor =
            matches!(frame.metadata.quantity, QuantityKind::Electrons | QuantityKind::Adu | QuantityKind::Unspecified);
        let is_told = frame.metadata.samples.as_ref().is_some_and(|samples| samples.saturated > Some(0));
        let planes = if frame.leads_with_three_planes() { 3 } else { 1 };
        let is_open = is_of_sensor && !is_told && untold(frame, false).is_none();
        let measured = frame.metadata.demosaic.as_ref().map(|record| record.cfa).filter(|_| planes == 3);
        is_open.then(|| Self { planes: vec![Largest::default(); planes], measured, row: 0 })
    }

    /// Looks at rows of the frame, in the channels that are planes.
    pub fn look(&mut self, rows: &[f32], frame: &FrameHeader) {
        let width = frame.geometry.width.max(1);
        for row in rows.chunks_exact(frame.geometry.row_samples().max(1)) {
            let classes = self.measured.map(|pattern| pattern.row_classes(frame.geometry.origin, self.row));
            for (plane, (largest, line)) in self.planes.iter_mut().zip(row.chunks_exact(width)).enumerate() {
                match classes {
                    None => largest.take(line.iter()),
                    Some(classes) => {
                        let parities = (0..2).filter(|parity| classes[*parity] as usize == plane);
                        parities.for_each(|parity| largest.take(line.iter().skip(parity).step_by(2)));
                    }
                }
            }
            self.row += 1;
        }
    }

    /// Has the program warn of heaps that are below the level from which samples are marked, or that no level tells.
    pub fn end(&self, frame: &FrameHeader) {
        let levels = FullLevels::of(frame).filter(|_| samples_tell(frame)).map(|levels| levels.classes());
        let lowest = levels.map_or(f32::INFINITY, |levels| levels.into_iter().fold(f32::INFINITY, f32::min));
        let is_level_known = frame.metadata.white_level_adu.is_some() || frame.metadata.adc.is_some();
        let heaps = self.planes.iter().filter_map(|plane| plane.heap(is_level_known));
        let heaps: Vec<(f32, u64)> = heaps.filter(|(value, _)| *value < lowest).collect();
        let Some((value, _)) = heaps.iter().max_by_key(|(_, count)| *count) else { return };
        let count: u64 = heaps.iter().map(|(_, count)| count).sum();
        let advice = match (levels, frame.metadata.demosaic.is_some()) {
            (Some([level, ..]), _) => format!("their white level, {level}, is above it"),
            (None, true) if is_level_known => "the white level that was known marks none of them".to_owned(),
            (None, true) => {
                "no white level was known that marks pixels which used them; demosaic with `--white`".to_owned()
            }
            (None, false) => "no white level tells that they are".to_owned(),
        };
        let text = format!(
            "{}: {count} of its samples are at the largest value, {value}, as saturated ones are, and {advice}",
            frame.name
        );
        register::doubt_of_frame(format!("{value} {advice}"), text);
    }
}
