//! Exif as a block of its own, such as that of a PNG: a TIFF of tags alone.

use super::capture::told_exposure;
use super::directory::TiffFile;
use super::layout::passed_over;
use super::tags::{self, ExtraTag, Field};
use crate::error::Result;
use crate::formats::exposure::ToldExposure;
use crate::formats::files::spool;
use tiff::tags::{Tag, Type};

/// A block with these tags in the directory of Exif, little-endian; none where there are no tags.
///
/// # Errors
///
/// As tags of a file.
pub fn exif_block(exif: &[ExtraTag], name: &str) -> Result<Option<Vec<u8>>> {
    /// Where the first directory lies, behind byte order, number and its place.
    const FIRST: u32 = 8;
    let fields = tags::fields(exif, name)?;
    if fields.is_empty() {
        return Ok(None);
    }
    let below = FIRST + directory_bytes(1);
    let pointer = [Field::new(Tag::ExifDirectory, Type::LONG, below.to_le_bytes().to_vec())];
    let mut block = [&b"II*\0"[..], &FIRST.to_le_bytes()].concat();
    put_directory(&mut block, &pointer);
    put_directory(&mut block, &fields);
    Ok(Some(block))
}

/// Bytes of a directory of so many entries: their number, each entry, and the place of the next.
fn directory_bytes(entries: u32) -> u32 {
    2 + 12 * entries + 4
}

/// Appends a directory, and behind it the values that are too long for its entries.
fn put_directory(block: &mut Vec<u8>, fields: &[Field]) {
    // Blocks are of some hundred bytes.
    let short = |length: usize| u16::try_from(length).unwrap_or(u16::MAX);
    let count = short(fields.len());
    let behind = u32::from(short(block.len())) + directory_bytes(count.into());
    let mut values: Vec<u8> = Vec::new();
    block.extend_from_slice(&count.to_le_bytes());
    for field in fields {
        block.extend_from_slice(&field.tag.to_u16().to_le_bytes());
        block.extend_from_slice(&field.kind.to_u16().to_le_bytes());
        block.extend_from_slice(&u32::try_from(field.count).unwrap_or(u32::MAX).to_le_bytes());
        if field.bytes.len() <= 4 {
            let mut inline = field.bytes.clone();
            inline.resize(4, 0);
            block.extend_from_slice(&inline);
        } else {
            block.extend_from_slice(&(behind + u32::from(short(values.len()))).to_le_bytes());
            values.extend_from_slice(&field.bytes);
            // Values begin at even places.
            values.resize(values.len().next_multiple_of(2), 0);
        }
    }
    block.extend_from_slice(&[0; 4]);
    block.extend_from_slice(&values);
}

/// The exposure that a block of Exif tells; what is damaged is passed over with a note.
///
/// # Errors
///
/// [`crate::error::Error::Disk`].
pub fn exposure_of_block(block: &[u8], name: &str, notes: &mut Vec<String>) -> Result<Option<ToldExposure>> {
    let told = TiffFile::open(spool(&mut &*block, name)?, name).and_then(|mut file| {
        let directory = file.directory(0)?;
        told_exposure(&mut file, &directory, notes)
    });
    passed_over(told, "its Exif", notes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::tiff::TagValue;

    #[test]
    fn an_exposure_comes_back_from_a_block() {
        let ratio = |number, above, below| ExtraTag { number, value: TagValue::Ratios(vec![[above, below]]) };
        let version = ExtraTag { number: 36864, value: TagValue::Undefined(b"0300".to_vec()) };
        let block = exif_block(&[ratio(33437, 28, 10), ratio(33434, 1, 250), version], "a.png").unwrap().unwrap();
        let mut notes = Vec::new();
        let Some(ToldExposure::Whole(told)) = exposure_of_block(&block, "a.png", &mut notes).unwrap() else { panic!() };
        assert_eq!((told.exposure_s, told.f_number, notes.len()), (0.004, 2.8, 0));
        assert_eq!(exif_block(&[], "a.png").unwrap(), None);
        // Cut anywhere it is no exposure, or a note.
        for length in 0..block.len() - 4 {
            let told = exposure_of_block(&block[..length], "a.png", &mut notes).unwrap();
            assert!(told.is_none() && !notes.is_empty(), "{length}");
            notes.clear();
        }
    }
}
