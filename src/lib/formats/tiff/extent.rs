//! How far the bytes reach that a file's directories name, and what comes behind them.

use super::directory::{Directory, TiffFile, begins_so};
use crate::error::{Error, Result};
use crate::formats::format::{HEAD_BYTES, Rest};
use std::collections::HashSet;
use std::io::{BufReader, Seek, SeekFrom};
use tiff::tags::Tag;

/// Directories that are looked at.
const MOST_DIRECTORIES: usize = 1 << 16;
/// Tags that name other directories, besides those of type IFD.
const DIRECTORIES: [u16; 4] = [330, 34_665, 34_853, 40_965];
/// Types of values that are places of directories: IFD and IFD8.
const TYPES_OF_DIRECTORIES: [u16; 2] = [13, 18];
/// Tags with the places and the lengths of bytes: strips, tiles, pictures in JPEG.
const PLACES: [[u16; 2]; 3] = [[273, 279], [324, 325], [513, 514]];
/// Tags in which makers keep what only they read, places in the file perhaps: MakerNote and DNGPrivateData.
const PRIVATE: [u16; 2] = [37_500, 50_740];

/// What the directories have told so far.
struct Extent {
    /// The end of the last byte that one names.
    end: u64,
    /// Whether a maker's own data may name more.
    has_private: bool,
    /// Where directories were looked for.
    seen: HashSet<u64>,
    /// Bytes that may still be read: those of a whole file do not lie one over another.
    left: u64,
}

impl TiffFile {
    /// What comes behind the bytes that its directories name and `chunks`, places and lengths; zeros fill up and are nothing.
    ///
    /// # Errors
    ///
    /// [`Error::Disk`]; [`Error::Format`] where directories lie one over another.
    pub(in crate::formats) fn rest(&mut self, chunks: &[(u64, u64)]) -> Result<Rest> {
        let end = chunks.iter().map(|(offset, stored)| offset.saturating_add(*stored)).max().unwrap_or_default();
        if end == self.length {
            return Ok(Rest::Nothing);
        }
        let mut extent = Extent { end, has_private: false, seen: HashSet::new(), left: self.length };
        let images = self.extend(&mut extent)?;
        // Some writers leave scraps of directories behind the last of several images.
        let may_belong = extent.has_private || images > 1;
        if may_belong && let Some(another) = self.another_behind(extent.end)? {
            return Ok(Rest::of_head(another, may_belong));
        }
        let found = self.file.seek(SeekFrom::Start(extent.end));
        let found = found.and_then(|_| Rest::unread(&mut BufReader::new(&self.file), may_belong));
        found.map_err(|source| Error::disk(&self.name, "read", source))
    }

    /// Goes through the directories, each once, until the last byte of the file is named; gives the number of images that follow one
    /// another.
    fn extend(&mut self, extent: &mut Extent) -> Result<usize> {
        let (mut images, mut next) = (0, self.first_directory);
        let mut below = Vec::new();
        while extent.end < self.length
            && let Some(link) = self.visit(next, extent, &mut below)?
        {
            (images, next) = (images + 1, link);
            while extent.end < self.length
                && let Some(offset) = below.pop()
            {
                let link = self.visit(offset, extent, &mut below)?;
                below.extend(link);
            }
        }
        Ok(images)
    }

    /// Adds what the directory at a place names, and the directories below it; gives its link to the next one. None where none is:
    /// what is damaged where nobody has looked names nothing.
    fn visit(&mut self, offset: u64, extent: &mut Extent, below: &mut Vec<u64>) -> Result<Option<u64>> {
        if offset == 0 || !extent.seen.insert(offset) {
            return Ok(None);
        }
        let Ok((directory, next)) = self.directory_at(offset, true) else { return Ok(None) };
        let table = directory.bytes;
        let is_one_more = extent.seen.len() <= MOST_DIRECTORIES;
        extent.left = extent.left.checked_sub(table).filter(|_| is_one_more).ok_or_else(|| self.overlap())?;
        extent.end = extent.end.max((offset + table).min(self.length));
        self.extend_by(&directory, extent, below)?;
        Ok(Some(next))
    }

    /// Adds what a directory names, and the directories below it.
    fn extend_by(&mut self, directory: &Directory, extent: &mut Extent, below: &mut Vec<u64>) -> Result<()> {
        for (tag, kind, bytes, offset) in directory.values() {
            if bytes > self.inline_bytes() && self.holds(offset, bytes) {
                extent.end = extent.end.max(offset + bytes);
            }
            extent.has_private |= PRIVATE.contains(&tag);
            if DIRECTORIES.contains(&tag) || TYPES_OF_DIRECTORIES.contains(&kind) {
                below.extend(self.places(directory, tag, extent)?);
            }
        }
        for [places, lengths] in PLACES {
            let [places, lengths] = [self.places(directory, places, extent)?, self.places(directory, lengths, extent)?];
            for (place, length) in places.into_iter().zip(lengths) {
                if self.holds(place, length) {
                    extent.end = extent.end.max(place + length);
                }
            }
        }
        Ok(())
    }

    /// The whole numbers of a tag, none where it is missing or damaged.
    fn places(&mut self, directory: &Directory, tag: u16, extent: &mut Extent) -> Result<Vec<u64>> {
        let bytes = directory.values().find(|value| value.0 == tag).map_or(0, |value| value.2);
        if bytes > self.length {
            return Ok(Vec::new());
        }
        let apart = if bytes > self.inline_bytes() { bytes } else { 0 };
        extent.left = extent.left.checked_sub(apart).ok_or_else(|| self.overlap())?;
        let found = self.unsigned(directory, Tag::from_u16_exhaustive(tag), u64::MAX);
        Ok(found.ok().flatten().unwrap_or_default())
    }

    fn overlap(&self) -> Error {
        self.problem("it is damaged; its directories lie one over another")
    }

    /// The head of another TIFF behind a few bytes.
    fn another_behind(&mut self, from: u64) -> Result<Option<Vec<u8>>> {
        const SCRAPS: usize = 4096;
        let count = usize::try_from(self.length - from).unwrap_or(usize::MAX).min(SCRAPS);
        let mut bytes = vec![0; count];
        self.read_at(from, &mut bytes)?;
        let place = (0..count).find(|place| begins_so(&bytes[*place..]));
        Ok(place.map(|place| bytes[place..].iter().copied().take(HEAD_BYTES).collect()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::files::tests::of_bytes;
    use crate::formats::tiff::{ExtraTag, TagValue, TiffCompression, TiffSamples, TiffSettings, TiffTags, TiffWriter};
    use crate::frame::Geometry;
    use std::io::Cursor;

    fn tiff(tag: u16) -> Vec<u8> {
        let settings = TiffSettings {
            samples: TiffSamples::U16,
            scale: 1.0,
            compression: TiffCompression::None,
            tags: TiffTags::default(),
            extra: vec![ExtraTag { number: tag, value: TagValue::Bytes(vec![1; 9]) }],
            exif: Vec::new(),
        };
        let mut writer =
            TiffWriter::create(Cursor::new(Vec::new()), "out.tif", &Geometry::new(4, 2, &["Y"]), settings).unwrap();
        writer.write_rows(&[7.0; 8]).unwrap();
        writer.finish().unwrap().0.into_inner()
    }

    fn rest(bytes: &[u8]) -> Rest {
        TiffFile::open(of_bytes(bytes, false), "in").unwrap().rest(&[]).unwrap()
    }

    #[test]
    fn what_makers_keep_may_name_bytes_that_nobody_else_knows() {
        for (tag, is_private) in [(37_500, true), (50_740, true), (50_741, false)] {
            let whole = tiff(tag);
            assert!(matches!(rest(&whole), Rest::Nothing), "{tag}");
            assert!(matches!(rest(&[&whole, &[0; 70_000][..]].concat()), Rest::Nothing), "{tag}");
            let longer = [&whole, &[0; 70_000][..], b"more"].concat();
            assert!(
                matches!(rest(&longer), Rest::Unread { head, may_belong } if head == b"more" && may_belong == is_private),
                "{tag}"
            );
        }
    }

    /// A link that leads back, and a directory that names itself below, are gone through once; tables one over another are refused.
    #[test]
    fn damage_ends() {
        let mut circle = tiff(50_741);
        let [a, b, c, d] = [4, 5, 6, 7].map(|at| circle[at]);
        let first = u32::from_le_bytes([a, b, c, d]) as usize;
        let entries = usize::from(u16::from_le_bytes([circle[first], circle[first + 1]]));
        let link = first + 2 + 12 * entries;
        circle[link..link + 4].copy_from_slice(&[a, b, c, d]);
        assert!(matches!(rest(&[&circle, &b"more"[..]].concat()), Rest::Unread { .. }));
        // A second image may have left scraps behind.
        let second = u32::try_from(circle.len()).unwrap();
        let table = circle[first..link].to_vec();
        circle[link..link + 4].copy_from_slice(&second.to_le_bytes());
        let two = [&circle[..], &table, &[0; 4], b"more"].concat();
        assert!(matches!(rest(&two), Rest::Unread { may_belong: true, .. }));
        // Each of these begins two bytes behind the one before, and has 5000 entries.
        let mut over = b"II*\0\x08\0\0\0".to_vec();
        over.resize(70_000, 0);
        for at in (8..9000).step_by(2) {
            over[at..at + 2].copy_from_slice(&5000_u16.to_le_bytes());
        }
        for at in (8..9000).step_by(2) {
            let link = at + 2 + 12 * 5000;
            if link + 4 <= over.len() && link % 4 == 2 {
                over[link..link + 4].copy_from_slice(&u32::try_from(at + 2).unwrap().to_le_bytes());
            }
        }
        over.push(1);
        let refused = TiffFile::open(of_bytes(&over, false), "in").unwrap().rest(&[]).err().unwrap().to_string();
        assert_eq!(refused, "in: it is damaged; its directories lie one over another");
    }
}
