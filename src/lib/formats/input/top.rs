//! Samples that are heaped at their largest value, as saturated ones are, where neither metadata nor marks tell of saturation.
//!
//! Of light and noise the largest values of a frame are its rarest. A converter that ends there, or a level to which samples were cut,
//! puts all that is brighter on one value.

use crate::cfa::CfaPattern;
use crate::formats::register;
use crate::metadata::FrameHeader;
use crate::stages::saturation::{FullLevels, samples_tell, untold};
use crate::units::QuantityKind;

/// So many of the largest values of a plane are counted.
const VALUES: usize = 24;
/// Fewer values are those of a frame without noise.
const LEAST_VALUES: usize = 16;
/// So many samples at the largest value are a heap,
const LEAST_HEAP: u64 = 20;
/// and so many times those at any other of the largest.
const ABOVE_OTHERS: u64 = 8;

/// The largest values of one plane, falling, and how many samples have each.
#[derive(Debug, Clone, Default, PartialEq)]
struct Largest(Vec<(f32, u64)>);

impl Largest {
    fn take<'a>(&mut self, samples: impl Iterator<Item = &'a f32>) {
        let mut floor = self.floor();
        for sample in samples {
            if *sample >= floor {
                self.put(*sample);
                floor = self.floor();
            }
        }
    }

    /// What smaller samples do not count; of infinite ones none does.
    fn floor(&self) -> f32 {
        if self.0.len() < VALUES { f32::MIN } else { self.0.last().map_or(f32::MIN, |(value, _)| *value) }
    }

    fn put(&mut self, sample: f32) {
        if sample == f32::INFINITY {
            return;
        }
        match self.0.iter().position(|(value, _)| *value <= sample) {
            Some(at) if self.0[at].0 == sample => self.0[at].1 += 1,
            Some(at) => self.0.insert(at, (sample, 1)),
            None => self.0.push((sample, 1)),
        }
        self.0.truncate(VALUES);
    }

    /// The largest value and how many samples have it, where that is a heap.
    fn heap(&self) -> Option<(f32, u64)> {
        let (&(value, count), others) = self.0.split_first()?;
        let most = others.iter().map(|(_, count)| *count).max()?;
        let is_heap = self.0.len() >= LEAST_VALUES && count >= LEAST_HEAP && count >= ABOVE_OTHERS * most;
        is_heap.then_some((value, count))
    }
}

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
        let heaps: Vec<(f32, u64)> =
            self.planes.iter().filter_map(Largest::heap).filter(|(value, _)| *value < lowest).collect();
        let Some((value, _)) = heaps.iter().max_by_key(|(_, count)| *count) else { return };
        let count: u64 = heaps.iter().map(|(_, count)| count).sum();
        let advice = match (levels, frame.metadata.demosaic.is_some()) {
            (Some([level, ..]), _) => format!("their white level, {level}, is above it"),
            (None, true) => "nothing marks which pixels used them; EXR would".to_owned(),
            (None, false) => "no white level tells that they are".to_owned(),
        };
        register::doubt(format!(
            "{}: {count} of its samples are at the largest value, {value}, as saturated ones are, and {advice}",
            frame.name
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn heap(samples: impl IntoIterator<Item = f32>) -> Option<(f32, u64)> {
        let mut plane = Largest::default();
        plane.take(samples.into_iter().collect::<Vec<_>>().iter());
        plane.heap()
    }

    #[test]
    fn a_heap_is_many_samples_at_the_largest_value() {
        let ramp = || (0..4000_u16).map(|i| f32::from(i % 1000));
        assert_eq!(heap(ramp()), None);
        let cut = |at: f32| ramp().map(move |sample| sample.min(at));
        assert_eq!(heap(cut(900.0)), Some((900.0, 400)));
        assert_eq!(heap(cut(995.0)), None);
        // What is no number does not count, whatever is beyond.
        assert_eq!(heap(cut(900.0).chain([f32::NAN, f32::INFINITY])), Some((900.0, 400)));
        // Few values are those of patches without noise, and few samples hot pixels.
        assert_eq!(heap((0..4000_u16).map(|i| f32::from((i / 5).min(10)))), None);
        assert_eq!(heap((0..100_u16).map(|i| f32::from(i.min(85)))), None);
        // The tail of coarse noise: each code is rarer than that before.
        assert_eq!(
            heap((0..20_u16).flat_map(|code| std::iter::repeat_n(f32::from(code), 20 - usize::from(code)))),
            None
        );
    }
}
