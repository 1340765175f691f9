//! A small picture before the frame, for programs that show what a file holds.

use super::tags::{ExtraTag, Field, fields};
use crate::error::Result;
use tiff::tags::{Tag, Type};

/// An RGB picture of 8 bits that the first directory holds, and what that directory says of the file.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::formats) struct FirstImage {
    /// Columns and rows.
    pub size: [u16; 2],
    /// `[row][column][channel]`.
    pub rgb: Vec<u8>,
    /// ImageDescription.
    pub description: String,
    /// Software.
    pub software: String,
    /// Tags besides.
    pub extra: Vec<ExtraTag>,
    /// Those of Exif, in a directory of their own; there is none where these are none.
    pub exif: Vec<ExtraTag>,
}

impl FirstImage {
    /// The fields of its directory, but for what tells where things lie.
    ///
    /// # Errors
    ///
    /// [`crate::error::Error::Data`] for a tag that cannot be added.
    pub(super) fn fields(&self, name: &str) -> Result<Vec<Field>> {
        let [width, height] = self.size.map(|side| vec![side]);
        let bytes = u32::try_from(self.rgb.len()).unwrap_or(u32::MAX);
        let shorts = |tag: Tag, values: Vec<u16>| {
            Field::new(tag, Type::SHORT, values.iter().flat_map(|value| value.to_le_bytes()).collect())
        };
        let long = |tag: Tag, value: u32| Field::new(tag, Type::LONG, value.to_le_bytes().to_vec());
        let mut found = fields(&self.extra, name)?;
        found.extend([
            // A picture of reduced size.
            long(Tag::NewSubfileType, 1),
            shorts(Tag::ImageWidth, width),
            shorts(Tag::ImageLength, height.clone()),
            shorts(Tag::BitsPerSample, vec![8; 3]),
            shorts(Tag::Compression, vec![1]),
            shorts(Tag::PhotometricInterpretation, vec![2]),
            shorts(Tag::SamplesPerPixel, vec![3]),
            shorts(Tag::RowsPerStrip, height),
            long(Tag::StripByteCounts, bytes),
            shorts(Tag::PlanarConfiguration, vec![1]),
            Field::text(Tag::ImageDescription, &self.description),
            Field::text(Tag::Software, &self.software),
        ]);
        Ok(found)
    }
}
