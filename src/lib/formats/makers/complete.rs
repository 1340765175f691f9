//! Whether a file holds all that it says it does: a decoder fills what is cut off with what it likes.

use crate::error::{Error, Result};
use crate::formats::tiff::{Directory, TiffFile};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use tiff::tags::Tag;

/// Images of a file that are looked at: those one after another, and those below each.
const MOST_IMAGES: usize = 16;
/// Strips or tiles of one.
const MOST_CHUNKS: u64 = 1 << 20;
/// What Panasonic's files have for an offset that stands elsewhere.
const NOWHERE: u64 = 0xFFFF_FFFF;
/// Where a RAF says where three parts of it begin and how long they are: a picture, tags, the raw image.
const RAF_PARTS: std::ops::Range<usize> = 84..108;
/// Boxes of a CR3 one after another.
const MOST_BOXES: usize = 1 << 10;

/// Makes sure that no part that a file tells of lies beyond its end: strips and tiles of files laid out as a TIFF, the parts of a
/// RAF, the boxes of a CR3. Of others, and of what is damaged otherwise, nothing is said.
///
/// # Errors
///
/// [`Error::Format`] where one does; [`Error::Disk`].
pub(super) fn check(file: &File, name: &str) -> Result<()> {
    let failed = |e| Error::disk(name, "read", e);
    let mut file = file.try_clone().map_err(failed)?;
    let length = file.seek(SeekFrom::End(0)).map_err(failed)?;
    file.rewind().map_err(failed)?;
    let mut head = Vec::new();
    file.by_ref().take(RAF_PARTS.end as u64).read_to_end(&mut head).map_err(failed)?;
    let end = if head.starts_with(b"FUJIFILMCCD-RAW") {
        raf_end(&head)
    } else if head.get(4..8) == Some(b"ftyp") {
        boxes_end(&mut file, length).map_err(failed)?
    } else {
        match tiff_end(file, name) {
            Err(Error::Format { .. }) => 0,
            other => other?,
        }
    };
    if end <= length {
        return Ok(());
    }
    Err(Error::format(name, format!("it was cut short: it tells of {end} bytes and has {length}; copy it again")))
}

fn raf_end(head: &[u8]) -> u64 {
    let (numbers, _) = head.get(RAF_PARTS).unwrap_or_default().as_chunks();
    let numbers: Vec<u64> = numbers.iter().map(|bytes| u64::from(u32::from_be_bytes(*bytes))).collect();
    numbers.chunks_exact(2).map(|part| part[0] + part[1]).max().unwrap_or(0)
}

/// The end of the last box, each of which begins with its length in four bytes, or, where that is 1, in eight behind its name.
fn boxes_end(file: &mut File, length: u64) -> std::io::Result<u64> {
    let mut at = 0_u64;
    for _ in 0..MOST_BOXES {
        if at + 16 > length {
            break;
        }
        let mut head = [0; 16];
        file.seek(SeekFrom::Start(at))?;
        file.read_exact(&mut head)?;
        let [short, _, high, low] = [0, 4, 8, 12].map(|at| u32::from_be_bytes([0, 1, 2, 3].map(|k| head[at + k])));
        at = match short {
            0 => break,
            1 => at.saturating_add(u64::from(high) << 32 | u64::from(low)),
            _ => at + u64::from(short),
        };
    }
    Ok(at)
}

/// The end of the last strip or tile.
fn tiff_end(file: File, name: &str) -> Result<u64> {
    let mut file = TiffFile::open_kin(file, name)?;
    let mut end = 0;
    for page in 0..MOST_IMAGES {
        let directory = match file.directory(page) {
            Err(Error::Format { .. } | Error::Usage(_)) => break,
            other => other?,
        };
        end = end.max(chunks_end(&mut file, &directory)?);
        let below = values(&mut file, &directory, Tag::SubIfd, MOST_IMAGES as u64)?;
        for offset in below {
            let directory = file.directory_below(offset)?;
            end = end.max(chunks_end(&mut file, &directory)?);
        }
    }
    Ok(end)
}

fn chunks_end(file: &mut TiffFile, directory: &Directory) -> Result<u64> {
    let mut end = 0;
    for (offsets, counts) in [(Tag::StripOffsets, Tag::StripByteCounts), (Tag::TileOffsets, Tag::TileByteCounts)] {
        let offsets = values(file, directory, offsets, MOST_CHUNKS)?;
        let counts = values(file, directory, counts, MOST_CHUNKS)?;
        let ends = offsets.iter().zip(&counts).filter(|(offset, _)| **offset < NOWHERE);
        end = ends.map(|(offset, count)| offset.saturating_add(*count)).fold(end, u64::max);
    }
    Ok(end)
}

fn values(file: &mut TiffFile, directory: &Directory, tag: Tag, at_most: u64) -> Result<Vec<u64>> {
    Ok(file.unsigned(directory, tag, at_most)?.unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    fn checked(bytes: &[u8]) -> std::result::Result<(), String> {
        let mut file = tempfile::tempfile().unwrap();
        file.write_all(bytes).unwrap();
        check(&file, "a.raw").map_err(|error| error.to_string())
    }

    /// A file laid out as a TIFF, with one strip of 100 bytes.
    fn strip(magic: &[u8; 4], offset: u32) -> Vec<u8> {
        let mut bytes = [magic, &8_u32.to_le_bytes()[..], &2_u16.to_le_bytes()].concat();
        for (tag, value) in [(273_u16, offset), (279, 100)] {
            bytes.extend(
                [&tag.to_le_bytes()[..], &4_u16.to_le_bytes(), &1_u32.to_le_bytes(), &value.to_le_bytes()].concat(),
            );
        }
        bytes.resize(38 + 100, 0);
        bytes
    }

    #[test]
    fn what_was_cut_short_is_told() {
        for magic in [b"II*\0", b"IIRO", b"IIU\0"] {
            let whole = strip(magic, 38);
            checked(&whole).unwrap();
            let complaint = "a.raw: it was cut short: it tells of 138 bytes and has 137; copy it again";
            assert_eq!(checked(&whole[..137]).unwrap_err(), complaint);
            checked(&strip(magic, 0xFFFF_FFFF)).unwrap();
        }
        let mut raf = b"FUJIFILMCCD-RAW ".to_vec();
        raf.resize(84, 0);
        raf.extend([108_u32, 5, 113, 2, 115, 10].iter().flat_map(|number| number.to_be_bytes()));
        raf.resize(125, 0);
        checked(&raf).unwrap();
        assert!(checked(&raf[..124]).unwrap_err().contains("it tells of 125 bytes and has 124"));
        let boxes = [
            &24_u32.to_be_bytes()[..],
            b"ftypcrx ",
            &[0; 12],
            &1_u32.to_be_bytes(),
            b"mdat",
            &20_u64.to_be_bytes(),
            &[0; 4],
        ];
        let cr3 = boxes.concat();
        checked(&cr3).unwrap();
        assert!(checked(&cr3[..cr3.len() - 1]).unwrap_err().contains("it tells of 44 bytes and has 43"));
        // What is damaged otherwise is left to the decoder.
        checked(b"II*\0\xFF\xFF\xFF\0").unwrap();
        checked(b"\0MRM").unwrap();
    }
}
