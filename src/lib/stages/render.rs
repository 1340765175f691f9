//! From expected electrons per source pixel to a frame of photosites: patches, vignetting, the color filter array.

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
    /// Rows of the source that the frame shows.
    pub fn source_rows(&self) -> usize {
        self.header.geometry.height.div_ceil(self.patch[1])
    }

    /// Draws the rows of the frame that show the rows of the source from row `first` on; `pixels` are these, each the
    /// expected electrons of R, G and B of its pixels on the optical axis.
    ///
    /// Without vignetting the rows of a patch are alike, and are worked out once (twice under a filter array) a band; a band
    /// of nothing else stays for the next. `progress` hears of the frame's rows done so far.
    ///
    /// # Errors
    ///
    /// Those of the sink.
    pub fn draw(
        &self,
        first: usize,
        pixels: &[impl AsRef<[[f64; 3]]>],
        sink: &mut dyn RowSink,
        progress: &mut dyn FnMut(usize),
    ) -> Result<()> {
        let geometry = &self.header.geometry;
        // An even number of rows, so that the bands of a patch begin at the same phase of the filter array.
        let band_rows = geometry.cached_rows().next_multiple_of(2);
        let row_samples = geometry.row_samples();
        let patch_of = |y: usize| y / self.patch[1];
        let rows = first * self.patch[1]..((first + pixels.len()) * self.patch[1]).min(geometry.height);
        let mut band = Vec::new();
        // The patches that all rows of the band belong to, where they do.
        let mut shown = None;
        for start in rows.clone().step_by(band_rows) {
            let end = (start + band_rows).min(rows.end);
            let inside = (patch_of(start) == patch_of(end - 1)).then(|| patch_of(start));
            if inside.is_none() || shown != inside || self.vignetting.is_some() {
                band.clear();
                for y in start..end {
                    match self.row_alike(y).filter(|alike| *alike >= start) {
                        Some(alike) => {
                            let at = (alike - start) * row_samples;
                            band.extend_from_within(at..at + row_samples);
                        }
                        None => self.append_row(y, pixels[patch_of(y) - first].as_ref(), &mut band),
                    }
                }
                shown = inside;
            }
            sink.write(&band[..(end - start) * row_samples])?;
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
