//! OpenEXR among the formats: how its files are known, and how they are opened.

use super::layered;
use super::read::ExrReader;
use crate::formats::format::{FrameFormat, Readers, Reading, Sign, Streaming};
use exr::meta::magic_number;

/// OpenEXR.
pub const FORMAT: FrameFormat = FrameFormat {
    name: "an EXR",
    sign: Sign::Bytes(|head| head.starts_with(&magic_number::BYTES)),
    reading: Reading::Rows(Readers {
        open: layered::open,
        stream: Some(Streaming {
            is_streamable,
            has_parts: false,
            open: |input, name| Ok(Box::new(ExrReader::stream(input, name)?)),
        }),
    }),
};

/// Whether the bytes are the start of an EXR file that can be read without seeking: one part of scanlines.
fn is_streamable(head: &[u8]) -> bool {
    // Bytes 5 and 6 hold the flags: tiled 0x02, deep 0x08, multi-part 0x10 [OpenEXR file layout].
    head.len() >= 8 && head[..4] == magic_number::BYTES && head[5] & (0x02 | 0x08 | 0x10) == 0
}
