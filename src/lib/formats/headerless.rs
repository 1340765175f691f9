//! Files without a header: rows of samples of one channel, whose size and type someone has to tell.

use super::format::{Opened, SampleReader, SampleType};
use crate::error::{Error, Result};
use crate::frame::Geometry;
use crate::metadata::Metadata;
use crate::units::QuantityKind;
use std::fmt;
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::str::FromStr;

/// How the samples of a file without a header lie.
///
/// Written as `WIDTHxHEIGHT:TYPE` or `WIDTHxHEIGHT:TYPE:OFFSET`.
///
/// # Examples
///
/// ```
/// use cyanometer::formats::headerless::{HeaderlessType, Layout};
///
/// let layout: Layout = "1920x1080:u16le:512".parse()?;
/// assert_eq!((layout.width, layout.height), (1920, 1080));
/// assert_eq!((layout.samples, layout.offset), (HeaderlessType::U16Le, 512));
/// # Ok::<(), String>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// How samples are stored.
    pub samples: HeaderlessType,
    /// Bytes before the first sample.
    pub offset: u64,
}

/// How samples are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HeaderlessType {
    /// 8-bit unsigned integers.
    U8,
    /// 16-bit unsigned integers, the low byte first.
    U16Le,
    /// 16-bit unsigned integers, the high byte first.
    U16Be,
    /// Single-precision floats, the low byte first.
    F32Le,
}

impl HeaderlessType {
    const ALL: [Self; 4] = [Self::U8, Self::U16Le, Self::U16Be, Self::F32Le];

    /// Its name: `u16le` …
    pub fn name(self) -> &'static str {
        match self {
            Self::U8 => "u8",
            Self::U16Le => "u16le",
            Self::U16Be => "u16be",
            Self::F32Le => "f32le",
        }
    }

    fn stored(self) -> SampleType {
        match self {
            Self::U8 => SampleType::U8,
            Self::U16Le | Self::U16Be => SampleType::U16,
            Self::F32Le => SampleType::F32,
        }
    }
}

impl FromStr for Layout {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let wrong = || {
            let types = HeaderlessType::ALL.map(HeaderlessType::name).join(", ");
            format!(
                "a file without a header is described as WIDTHxHEIGHT:TYPE or WIDTHxHEIGHT:TYPE:OFFSET, the type one of {types}"
            )
        };
        let mut parts = text.split(':');
        let (Some(size), Some(samples)) = (parts.next(), parts.next()) else { return Err(wrong()) };
        let offset = parts.next().map_or(Ok(0), str::parse).map_err(|_| wrong())?;
        let side = |text: &str| text.parse().ok().filter(|side| (1..=i32::MAX as usize).contains(side));
        let (width, height) = size.split_once(['x', 'X']).ok_or_else(wrong)?;
        let (Some(width), Some(height), None) = (side(width), side(height), parts.next()) else { return Err(wrong()) };
        let samples = HeaderlessType::ALL.into_iter().find(|kind| kind.name().eq_ignore_ascii_case(samples));
        Ok(Self { width, height, samples: samples.ok_or_else(wrong)?, offset })
    }
}

impl fmt::Display for Layout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { width, height, samples, offset } = self;
        write!(f, "{width}x{height}:{}", samples.name())?;
        if *offset > 0 { write!(f, ":{offset}") } else { Ok(()) }
    }
}

impl Layout {
    /// Bytes of a row.
    fn row_bytes(&self) -> u64 {
        self.width as u64 * self.samples.stored().bytes() as u64
    }

    /// Bytes of a file.
    fn bytes(&self) -> u128 {
        u128::from(self.row_bytes()) * self.height as u128 + u128::from(self.offset)
    }
}

/// Reads rows as they come.
struct HeaderlessReader {
    name: String,
    layout: Layout,
    input: Box<dyn Read + Send>,
    waits: bool,
    geometry: Geometry,
    own_tags: Metadata,
    rows_read: usize,
    /// One row, as stored.
    stored: Vec<u8>,
}

/// Opens a file, regular or not, that stands at its first byte. Its length must be that of the layout.
///
/// # Errors
///
/// [`Error::Usage`] for a part besides the only one; [`Error::Format`] for a file of another length, which what is no
/// regular file shows behind its last row; [`Error::Disk`].
pub fn open(mut file: File, name: &str, part: usize, layout: Layout) -> Opened {
    if part != 0 {
        return Err(Error::Usage(format!("{name}: it has no part {part}; a file without a header has a single one")));
    }
    let failed = |e| Error::disk(name, "read", e);
    let is_file = file.metadata().map_err(failed)?.is_file();
    if is_file {
        let start = file.stream_position().map_err(failed)?;
        let length = file.seek(SeekFrom::End(0)).map_err(failed)?.saturating_sub(start);
        if u128::from(length) != layout.bytes() {
            return Err(other_length(name, &format!("{length} bytes"), &layout));
        }
        file.seek(SeekFrom::Start(start)).map_err(failed)?;
    }
    let mut input = BufReader::with_capacity(READ_BYTES, file);
    let skipped = io::copy(&mut input.by_ref().take(layout.offset), &mut io::sink()).map_err(failed)?;
    if skipped < layout.offset {
        return Err(other_length(name, &format!("{skipped} bytes"), &layout));
    }
    Ok(Box::new(HeaderlessReader {
        name: name.into(),
        layout,
        input: Box::new(input),
        waits: !is_file,
        geometry: Geometry::new(layout.width, layout.height, &["Y"]),
        own_tags: Metadata::new(QuantityKind::Unspecified),
        rows_read: 0,
        stored: Vec::new(),
    }))
}

/// Bytes that are read together.
const READ_BYTES: usize = 1 << 18;

fn other_length(name: &str, has: &str, layout: &Layout) -> Error {
    Error::format(name, format!("it has {has}, but {layout} takes {}", layout.bytes())).change(&["raw"])
}

impl SampleReader for HeaderlessReader {
    fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    fn stored_as(&self) -> Option<SampleType> {
        Some(self.layout.samples.stored())
    }

    fn natural_rows(&self) -> usize {
        1
    }

    fn may_wait(&self) -> bool {
        self.waits
    }

    fn embedded(&self) -> Option<&str> {
        None
    }

    fn own_tags(&self) -> &Metadata {
        &self.own_tags
    }

    fn notes(&self) -> &[String] {
        &[]
    }

    fn read(&mut self, rows: usize, samples: &mut Vec<f32>) -> Result<()> {
        let Self { layout, stored, input, .. } = self;
        for _ in 0..rows {
            stored.clear();
            let read = input.by_ref().take(layout.row_bytes()).read_to_end(stored);
            read.map_err(|e| Error::disk(&self.name, "read", e))?;
            if (stored.len() as u64) < layout.row_bytes() {
                let before = u128::from(layout.row_bytes()) * self.rows_read as u128 + u128::from(layout.offset);
                let has = before + stored.len() as u128;
                return Err(other_length(&self.name, &format!("{has} bytes"), layout));
            }
            match layout.samples {
                HeaderlessType::U8 => samples.extend(stored.iter().map(|byte| f32::from(*byte))),
                HeaderlessType::U16Le => {
                    samples.extend(stored.as_chunks().0.iter().map(|bytes| f32::from(u16::from_le_bytes(*bytes))));
                }
                HeaderlessType::U16Be => {
                    samples.extend(stored.as_chunks().0.iter().map(|bytes| f32::from(u16::from_be_bytes(*bytes))));
                }
                HeaderlessType::F32Le => {
                    samples.extend(stored.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)));
                }
            }
            self.rows_read += 1;
        }
        if self.rows_read == layout.height {
            let more = input.by_ref().take(1).read_to_end(stored).map_err(|e| Error::disk(&self.name, "read", e))?;
            if more > 0 {
                return Err(other_length(&self.name, "more bytes", layout));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::files::tests::of_bytes;

    fn layout(text: &str) -> Layout {
        text.parse().unwrap()
    }

    /// What a file and a pipe of these bytes give.
    fn read(bytes: &[u8], text: &str) -> [Result<Vec<f32>>; 2] {
        [false, true].map(|piped| {
            let input = of_bytes(bytes, piped);
            let mut reader = open(input, "in.raw", 0, layout(text))?;
            let mut samples = Vec::new();
            for _ in 0..reader.geometry().height {
                reader.read(1, &mut samples)?;
            }
            Ok(samples)
        })
    }

    #[test]
    fn layouts_are_read_as_they_are_written() {
        for text in ["1920x1080:u16le", "1x1:u8", "3x2:f32le:12", "3x2:u16be:1"] {
            assert_eq!(layout(text).to_string(), text);
        }
        assert_eq!(layout("3X2:U16LE:0").to_string(), "3x2:u16le");
        for wrong in ["", "3x2", "3x2:u32", "0x2:u8", "3:u8", "3x2:u8:", "3x2:u8:-1", "3x2:u8:1:1", "3x9999999999:u8"] {
            let complaint = wrong.parse::<Layout>().unwrap_err();
            assert!(complaint.contains("u8, u16le, u16be, f32le"), "{complaint}");
        }
    }

    #[test]
    fn samples_are_those_stored() {
        for (bytes, text, wanted) in [
            (&[0, 7, 255, 1][..], "2x2:u8", [0.0, 7.0, 255.0, 1.0]),
            (&[9, 9, 9, 1, 0, 0, 1, 255, 255, 2, 0], "2x2:u16le:3", [1.0, 256.0, 65535.0, 2.0]),
            (&[1, 0, 0, 1, 255, 255, 2, 0], "4x1:u16be", [256.0, 1.0, 65535.0, 512.0]),
            (&[1.5_f32, -2.0, 1e30, 0.0].map(f32::to_le_bytes).concat(), "1x4:f32le", [1.5, -2.0, 1e30, 0.0]),
        ] {
            for samples in read(bytes, text) {
                assert_eq!(samples.unwrap(), wanted, "{text}");
            }
        }
    }

    #[test]
    fn the_length_is_that_of_the_layout() {
        let complaints = |bytes: &[u8], text: &str| read(bytes, text).map(|read| read.unwrap_err().to_string());
        let give = "give another `raw`";
        for (bytes, has) in [(5, "5 bytes"), (0, "0 bytes"), (2, "2 bytes")] {
            let said = format!("in.raw: it has {has}, but 2x2:u8:2 takes 6; {give}");
            assert_eq!(complaints(&vec![0; bytes], "2x2:u8:2"), [said.clone(), said]);
        }
        let [file, pipe] = complaints(&[0; 7], "2x2:u8:2");
        assert_eq!(file, format!("in.raw: it has 7 bytes, but 2x2:u8:2 takes 6; {give}"));
        assert_eq!(pipe, format!("in.raw: it has more bytes, but 2x2:u8:2 takes 6; {give}"));
        // What is declared and not there takes no memory.
        let wide = complaints(&[0; 7], "2147483647x2147483647:f32le");
        assert!(wide.iter().all(|said| said.contains("takes 18446744056529682436;")), "{wide:?}");
        let refused = open(tempfile::tempfile().unwrap(), "in.raw", 1, layout("1x1:u8")).err().unwrap().to_string();
        assert_eq!(refused, "in.raw: it has no part 1; a file without a header has a single one");
    }
}
