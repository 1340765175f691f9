//! From expected electrons per source pixel to a frame of photosites: patches, vignetting, the colour filter array.

use crate::cfa::{CfaPattern, Class};
use crate::error::Result;
use crate::frame::to_sample;
use crate::metadata::FrameHeader;
use crate::optics::Vignetting;
use crate::stage::RowSink;

/// Draws each pixel of a source as a patch of photosites.
#[derive(Debug, Clone)]
pub struct Rendering {
    /// The head of the frame.
    pub header: FrameHeader,
    /// Photosites that show one source pixel: width and height. The last ones may be cut by the frame's edge.
    pub patch: [usize; 2],
    /// Vignetting, if any.
    pub vignetting: Option<Vignetting>,
    /// The pattern where only the plane is wanted that a mosaic would keep.
    pub cfa: Option<CfaPattern>,
}

impl Rendering {
    /// Renders the whole frame; `next_row` gives the source's rows one after another, each the expected electrons of
    /// R, G and B of its pixels on the optical axis.
    ///
    /// Without vignetting the rows of a patch are alike, and are worked out once (twice under a filter array).
    ///
    /// # Errors
    ///
    /// Those of the source and the sink.
    pub fn run(
        &self,
        mut next_row: impl FnMut() -> Result<Vec<[f64; 3]>>,
        sink: &mut dyn RowSink,
        progress: &mut dyn FnMut(usize),
    ) -> Result<()> {
        let geometry = &self.header.geometry;
        let mut pixels = Vec::new();
        let mut made: [Option<Vec<f32>>; 2] = [None, None];
        for y in 0..geometry.height {
            if y % self.patch[1] == 0 {
                pixels = next_row()?;
                made = [None, None];
            }
            let parity = if self.cfa.is_some() { y % 2 } else { 0 };
            if self.vignetting.is_some() {
                made[parity] = None;
            }
            let row = made[parity].get_or_insert_with(|| self.row(y, &pixels));
            sink.write(row)?;
            progress(y + 1);
        }
        Ok(())
    }

    fn row(&self, y: usize, pixels: &[[f64; 3]]) -> Vec<f32> {
        let geometry = &self.header.geometry;
        let mut row = vec![0.0; geometry.row_samples()];
        for (channel, plane) in row.chunks_exact_mut(geometry.width).enumerate() {
            let classes = match self.cfa {
                Some(pattern) => pattern.row_classes(geometry.origin, y),
                None => [Class::ALL[channel]; 2],
            };
            for (x, sample) in plane.iter_mut().enumerate() {
                *sample = to_sample(pixels[x / self.patch[0]][classes[x % 2] as usize]);
            }
            if let Some(vignetting) = &self.vignetting {
                for ((x, sample), factor) in plane.iter_mut().enumerate().zip(vignetting.row(y)) {
                    *sample = to_sample(factor * pixels[x / self.patch[0]][classes[x % 2] as usize]);
                }
            }
        }
        row
    }
}
