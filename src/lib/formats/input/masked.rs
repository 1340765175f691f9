//! Photosites that no light reaches, beside the black level that comes off: the two tell the same.

use crate::camera::levels::{BlackLevels, near_black};
use crate::formats::register;
use crate::frame::to_sample;
use crate::metadata::FrameHeader;
use crate::text::in_decimals;
use crate::units::QuantityKind;

/// So many photosites of a row are looked at: an odd stride takes both sites of it.
const OF_ROW: usize = 64;
/// Fewer of a frame tell nothing.
const LEAST: usize = 64;
/// Standard deviations by which a median may be off, all of which may be those of whole rows.
const Z: f64 = 8.0;

/// What masked photosites read above the black level.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct MaskedCheck {
    black: BlackLevels,
    row: usize,
    rows: usize,
    above: Vec<f32>,
    level: f64,
}

impl MaskedCheck {
    /// Of codes of a frame that has masked photosites, off which `black` comes.
    pub fn of(frame: &FrameHeader, black: BlackLevels) -> Option<Self> {
        let metadata = &frame.metadata;
        let are_codes = matches!(metadata.quantity, QuantityKind::Adu | QuantityKind::Unspecified);
        let is_plane = frame.geometry.channels.len() == 1 && metadata.demosaic.is_none();
        let is_open = are_codes && is_plane && metadata.correction.is_none() && !metadata.masked_areas.is_empty();
        is_open.then_some(Self { black, row: 0, rows: 0, above: Vec::new(), level: 0.0 })
    }

    /// Looks at rows of the frame, in its first plane.
    pub fn look(&mut self, rows: &[f32], frame: &FrameHeader) {
        let geometry = &frame.geometry;
        let [left, top] = geometry.origin.map(i64::from);
        for row in rows.chunks_exact(geometry.row_samples().max(1)) {
            let at = top + self.row as i64;
            let inside = |y0: i64, height: i64| (y0..y0.saturating_add(height)).contains(&at);
            let areas = frame.metadata.masked_areas.iter().filter(|[_, y0, _, height]| inside(*y0, *height));
            let column = |x: i64| usize::try_from(x - left).unwrap_or(0).min(geometry.width);
            let spans: Vec<_> = areas.map(|[x0, _, width, _]| column(*x0)..column(x0.saturating_add(*width))).collect();
            let count: usize = spans.iter().map(ExactSizeIterator::len).sum();
            let black = self.black.row(self.row);
            let before = self.above.len();
            for x in spans.into_iter().flatten().step_by((count / OF_ROW) | 1) {
                if row[x].is_finite() {
                    self.above.push(to_sample(f64::from(row[x]) - black.at(x)));
                    self.level += black.at(x);
                }
            }
            self.rows += usize::from(self.above.len() > before);
            self.row += 1;
        }
    }

    /// What masked photosites read, and the black level, ADU, where the two differ by more than noise and habit.
    fn other_level(&mut self) -> Option<[f64; 2]> {
        let count = self.above.len();
        if count < LEAST {
            return None;
        }
        let [low, off, high] = [1, 2, 3].map(|quarter| {
            let (_, value, _) = self.above.select_nth_unstable_by(quarter * (count - 1) / 4, f32::total_cmp);
            f64::from(*value)
        });
        let level = self.level / count as f64;
        // Between the quartiles of a normal law lie 1.35 standard deviations; of few codes they may be one.
        let scatter = (high - low).max(1.0) / 1.349;
        let allowed = near_black(level) + Z * scatter / (self.rows as f64).sqrt();
        (off.abs() > allowed).then_some([level + off, level])
    }

    /// Has the program warn of masked photosites at another level, once all rows were looked at.
    pub fn end(mut self, frame: &FrameHeader) {
        if let Some(levels) = self.other_level() {
            let [read, level] = levels.map(|adu| in_decimals(adu, 1));
            register::doubt(format!(
                "{}: its masked photosites (`masked_areas`) read {read} ADU, and {level} ADU come off as its black level; one of the two is wrong",
                frame.name
            ));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Geometry;
    use crate::metadata::Metadata;

    /// A frame of 40 columns, the first 12 of which are masked; light of 9000 ADU beside them.
    fn header(areas: Vec<[i64; 4]>) -> FrameHeader {
        let mut metadata = Metadata::new(QuantityKind::Adu);
        metadata.masked_areas = areas;
        FrameHeader { name: "a".into(), geometry: Geometry::new(40, 32, &["Y"]), metadata }
    }

    /// What masked photosites of a level read, where that is not the black level.
    fn read(level: f32, black: f64) -> Option<[f64; 2]> {
        let frame = header(vec![[0, 0, 12, 32]]);
        let mut check = MaskedCheck::of(&frame, BlackLevels::uniform_at(black)).unwrap();
        let noise = |i: u16| f32::from(i * 7 % 11) - 5.0;
        let rows: Vec<f32> = (0..32 * 40).map(|i| if i % 40 < 12 { level + noise(i) } else { 9000.0 }).collect();
        check.look(&rows, &frame);
        assert_eq!((check.rows, check.above.len()), (32, 32 * 12));
        check.other_level()
    }

    #[test]
    fn masked_photosites_tell_the_black_level() {
        assert_eq!(MaskedCheck::of(&header(Vec::new()), BlackLevels::uniform_at(0.0)), None);
        // The median of whole numbers from -5 to 5 above a level is within one of it.
        let is_near = |[read, level]: [f64; 2], wanted: [f64; 2]| (read - wanted[0]).abs() <= 1.0 && level == wanted[1];
        assert!(read(2048.0, 0.0).is_some_and(|found| is_near(found, [2048.0, 0.0])));
        assert!(read(512.0, 600.0).is_some_and(|found| is_near(found, [512.0, 600.0])));
        // As cameras tell theirs.
        for (level, black) in [(2047.0, 2056.0), (512.0, 510.0), (4.0, 0.0), (128.0, 128.0)] {
            assert_eq!(read(level, black), None, "{level} {black}");
        }
    }
}
