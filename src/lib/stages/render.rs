//! From expected electrons per source pixel to a frame of photosites: patches, vignetting, the colour filter array.

use crate::camera::optics::Vignetting;
use crate::cfa::{CfaPattern, Class};
use crate::error::Result;
use crate::frame::to_sample;
use crate::metadata::FrameHeader;
use crate::stream::RowSink;

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
    /// Without vignetting the rows of a patch are alike, and are worked out once (twice under a filter array) a band; a band
    /// of nothing else stays for the next.
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
        // An even number of rows, so that bands begin at the same phase of the filter array.
        let band_rows = geometry.cached_rows().next_multiple_of(2);
        let row_samples = geometry.row_samples();
        let patch_of = |y: usize| y / self.patch[1];
        let mut pixels = Vec::new();
        let mut band = Vec::new();
        // The patches that all rows of the band belong to, where they do.
        let mut shown = None;
        let mut first = 0;
        while first < geometry.height {
            let end = (first + band_rows).min(geometry.height);
            let inside = (patch_of(first) == patch_of(end - 1)).then(|| patch_of(first));
            if inside.is_none() || shown != inside || self.vignetting.is_some() {
                band.clear();
                for y in first..end {
                    if y % self.patch[1] == 0 {
                        pixels = next_row()?;
                    }
                    match self.row_alike(y).filter(|alike| *alike >= first) {
                        Some(alike) => {
                            let start = (alike - first) * row_samples;
                            band.extend_from_within(start..start + row_samples);
                        }
                        None => self.append_row(y, &pixels, &mut band),
                    }
                }
                shown = inside;
            }
            sink.write(&band[..(end - first) * row_samples])?;
            first = end;
            progress(end);
        }
        Ok(())
    }

    /// A row above row `y` of the same samples, where there is one: without vignetting the row above of the patch, or
    /// under a filter array the one above that.
    fn row_alike(&self, y: usize) -> Option<usize> {
        let period = if self.cfa.is_some() { 2 } else { 1 };
        let is_in_patch = self.vignetting.is_none() && y % self.patch[1] >= period;
        is_in_patch.then(|| y - period)
    }

    /// Appends row `y`, of the source's pixels `pixels`.
    fn append_row(&self, y: usize, pixels: &[[f64; 3]], band: &mut Vec<f32>) {
        let geometry = &self.header.geometry;
        let start = band.len();
        band.resize(start + geometry.row_samples(), 0.0);
        let row = &mut band[start..];
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
    }
}
