//! Image file directories: the table of tags in front of, or behind, the samples.
//!
//! Nothing is allocated for a declared size before the file is known to be that long.

use crate::error::{Error, Result};
use std::collections::{BTreeMap, HashSet};
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use tiff::tags::Tag;

/// Longest text of one tag.
const TEXT_BYTES: u64 = 16 << 20;

/// Whether a file begins as a TIFF does: classic or BigTIFF, in either byte order.
pub fn begins_so(head: &[u8]) -> bool {
    [b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"].iter().any(|magic| head.starts_with(*magic))
}

/// The number that a classic TIFF has behind its byte order.
const CLASSIC: u64 = 42;

/// A TIFF file: its bytes, and how its numbers are written.
#[derive(Debug)]
pub struct TiffFile {
    pub(super) file: File,
    /// The file as the user named it.
    pub(super) name: String,
    /// Bytes in the file.
    pub(super) length: u64,
    /// `MM` files; the others are little-endian.
    pub(super) big_endian: bool,
    /// BigTIFF: offsets and counts have eight bytes.
    big_tiff: bool,
    pub(super) first_directory: u64,
}

impl TiffFile {
    /// Reads the header.
    ///
    /// # Errors
    ///
    /// When the file cannot be read or is no TIFF.
    pub fn open(file: File, name: &str) -> Result<Self> {
        Self::open_with(file, name, &[CLASSIC])
    }

    /// The same for files that are laid out so but have a number of their own instead of TIFF's: those of Olympus and Panasonic.
    ///
    /// # Errors
    ///
    /// As [`Self::open`].
    pub(in crate::formats) fn open_kin(file: File, name: &str) -> Result<Self> {
        Self::open_with(
            file,
            name,
            &[CLASSIC, u64::from(u16::from_le_bytes(*b"RO")), u64::from(u16::from_le_bytes(*b"RS")), 0x55],
        )
    }

    fn open_with(mut file: File, name: &str, classic: &[u64]) -> Result<Self> {
        let length = file.seek(SeekFrom::End(0)).map_err(|source| Error::disk(name, "read", source))?;
        let mut opened =
            Self { file, name: name.to_owned(), length, big_endian: false, big_tiff: false, first_directory: 0 };
        if length == 0 {
            return Err(opened.problem("the file is empty"));
        }
        let no_tiff = "this is no TIFF file; its first bytes are not those of one";
        if length < 8 {
            return Err(opened.problem(no_tiff));
        }
        let mut head = [0; 8];
        opened.read_at(0, &mut head)?;
        opened.big_endian = match &head[..2] {
            b"II" => false,
            b"MM" => true,
            _ => return Err(opened.problem(no_tiff)),
        };
        opened.first_directory = match opened.number(&head[2..4]) {
            number if classic.contains(&number) => opened.number(&head[4..8]),
            43 if opened.number(&head[4..6]) == 8 && opened.number(&head[6..8]) == 0 => {
                opened.big_tiff = true;
                let mut offset = [0; 8];
                opened.read_at(8, &mut offset)?;
                opened.number(&offset)
            }
            _ => return Err(opened.problem(no_tiff)),
        };
        Ok(opened)
    }

    /// An [`Error::Format`] about this file.
    pub fn problem(&self, problem: impl Into<String>) -> Error {
        Error::format(&self.name, problem)
    }

    /// The error for bytes that should be there and are not.
    pub fn cut_short(&self, what: &str) -> Error {
        self.problem(format!("{what} lies beyond the end of the file; it was cut short or damaged"))
    }

    /// Fills `bytes` from the place `offset` of the file.
    ///
    /// # Errors
    ///
    /// When the file ends before, or the disk refuses.
    pub fn read_at(&mut self, offset: u64, bytes: &mut [u8]) -> Result<()> {
        if !self.holds(offset, bytes.len() as u64) {
            return Err(self.cut_short("what is to be read"));
        }
        self.file
            .seek(SeekFrom::Start(offset))
            .and_then(|_| self.file.read_exact(bytes))
            .map_err(|source| Error::disk(&self.name, "read", source))
    }

    /// Whether the file has `length` bytes at `offset`.
    pub fn holds(&self, offset: u64, length: u64) -> bool {
        offset.checked_add(length).is_some_and(|end| end <= self.length)
    }

    /// An unsigned number of up to eight bytes in the file's byte order.
    pub fn number(&self, bytes: &[u8]) -> u64 {
        let append = |number: u64, byte: &u8| number << 8 | u64::from(*byte);
        if self.big_endian { bytes.iter().fold(0, append) } else { bytes.iter().rev().fold(0, append) }
    }

    /// A signed number of up to eight bytes.
    fn signed(&self, bytes: &[u8]) -> i64 {
        let unused = 64 - 8 * bytes.len();
        (self.number(bytes) << unused).cast_signed() >> unused
    }

    /// Reads the directory of image number `page`, counted from 0.
    ///
    /// # Errors
    ///
    /// When there is no such image, or the directories before it are damaged or run in a circle.
    pub fn directory(&mut self, page: usize) -> Result<Directory> {
        let mut seen = HashSet::new();
        let mut offset = self.first_directory;
        loop {
            if offset == 0 {
                let held = match seen.len() {
                    0 => return Err(self.problem("the file holds no image")),
                    1 => "one".to_owned(),
                    n => n.to_string(),
                };
                let problem = format!("there is no image {page} (counted from 0); the file holds {held}");
                return Err(Error::Usage(format!("{}: {problem}", self.name)));
            }
            if !seen.insert(offset) {
                return Err(self.problem(format!(
                    "there is no image {page}; the file is damaged, its directories run in a circle"
                )));
            }
            let wanted = seen.len() > page;
            let (directory, next) = self.directory_at(offset, wanted)?;
            if wanted {
                return Ok(directory);
            }
            offset = next;
        }
    }

    /// Bytes in the file.
    pub fn length(&self) -> u64 {
        self.length
    }

    /// Whether numbers have their highest byte first.
    pub fn big_endian(&self) -> bool {
        self.big_endian
    }

    /// Reads the directory at `offset`, which a tag of another names.
    ///
    /// # Errors
    ///
    /// When there is none.
    pub fn directory_below(&mut self, offset: u64) -> Result<Directory> {
        Ok(self.directory_at(offset, true)?.0)
    }

    /// Reads the directory at `offset` (only its link to the next one unless `wanted`), and gives that link.
    pub(super) fn directory_at(&mut self, offset: u64, wanted: bool) -> Result<(Directory, u64)> {
        let (count_bytes, entry_bytes, offset_bytes) = if self.big_tiff { (8, 20, 8) } else { (2, 12, 4) };
        let beyond = |file: &Self| file.cut_short("the table of tags");
        if !self.holds(offset, count_bytes as u64) {
            return Err(beyond(self));
        }
        let mut count = [0; 8];
        self.read_at(offset, &mut count[..count_bytes])?;
        let count = self.number(&count[..count_bytes]);
        if count == 0 || count > u64::from(u16::MAX) {
            return Err(self.problem("the file is damaged; its table of tags has no valid length"));
        }
        let table_bytes = count * entry_bytes;
        let table = offset + count_bytes as u64;
        if !self.holds(table, table_bytes) {
            return Err(beyond(self));
        }
        // Some writers leave out the link of the last directory at the very end of the file.
        let mut link = [0; 8];
        if self.holds(table + table_bytes, offset_bytes as u64) {
            self.read_at(table + table_bytes, &mut link[..offset_bytes])?;
        }
        let bytes = count_bytes as u64 + table_bytes + offset_bytes as u64;
        let mut directory = Directory { entries: BTreeMap::new(), bytes };
        if wanted {
            let mut bytes = vec![0; usize::try_from(table_bytes).unwrap_or_default()];
            self.read_at(table, &mut bytes)?;
            for entry in bytes.chunks_exact(if self.big_tiff { 20 } else { 12 }) {
                self.add(&mut directory, entry);
            }
        }
        Ok((directory, self.number(&link[..offset_bytes])))
    }

    /// Adds one entry to the directory; the first of several with one tag counts.
    fn add(&self, directory: &mut Directory, entry: &[u8]) {
        let (count, value) = if self.big_tiff { (&entry[4..12], &entry[12..]) } else { (&entry[4..8], &entry[8..]) };
        let mut inline = [0; 8];
        inline[..value.len()].copy_from_slice(value);
        let [tag, kind] = [&entry[..2], &entry[2..4]].map(|bytes| match *bytes {
            [a, b] if self.big_endian => u16::from_be_bytes([a, b]),
            [a, b] => u16::from_le_bytes([a, b]),
            _ => 0,
        });
        let entry = Entry { kind, count: self.number(count), inline, offset: self.number(value) };
        directory.entries.entry(tag).or_insert(entry);
    }

    /// The directory that a tag points to, such as that of Exif; none where the tag is missing.
    ///
    /// # Errors
    ///
    /// When the file is damaged there.
    pub fn below(&mut self, directory: &Directory, tag: Tag) -> Result<Option<Directory>> {
        let Some(offset) = self.one(directory, tag)? else { return Ok(None) };
        self.directory_below(offset).map(Some)
    }

    /// The most bytes of a value that stands in the table itself.
    pub(super) fn inline_bytes(&self) -> u64 {
        if self.big_tiff { 8 } else { 4 }
    }

    /// The bytes of a tag's first `at_most` values, and their type.
    fn value(&mut self, entry: &Entry, tag: Tag, at_most: u64) -> Result<(u16, usize, Vec<u8>)> {
        let size = type_bytes(entry.kind);
        if size == 0 {
            let kind = entry.kind;
            return Err(self.problem(format!("the file is damaged; tag {tag:?} has type {kind}")));
        }
        let beyond = |file: &Self| file.cut_short(&format!("the value of tag {tag:?}"));
        let total = entry.count.checked_mul(size as u64).filter(|&total| total <= self.length.max(8));
        let Some(total) = total else { return Err(beyond(self)) };
        let wanted = usize::try_from(total.min(at_most.saturating_mul(size as u64))).map_err(|_| beyond(self))?;
        if total <= self.inline_bytes() {
            return Ok((entry.kind, size, entry.inline[..wanted].to_vec()));
        }
        if !self.holds(entry.offset, total) {
            return Err(beyond(self));
        }
        let mut bytes = vec![0; wanted];
        self.read_at(entry.offset, &mut bytes)?;
        Ok((entry.kind, size, bytes))
    }

    /// The first `at_most` values of a tag that holds unsigned numbers; none where the tag is missing.
    ///
    /// # Errors
    ///
    /// When the value lies outside the file or is not of such a type.
    pub fn unsigned(&mut self, directory: &Directory, tag: Tag, at_most: u64) -> Result<Option<Vec<u64>>> {
        let Some(entry) = directory.entries.get(&tag.to_u16()) else { return Ok(None) };
        let (kind, size, bytes) = self.value(entry, tag, at_most)?;
        if !matches!(kind, 1 | 3 | 4 | 13 | 16 | 18) {
            return Err(
                self.problem(format!("the file is damaged; tag {tag:?} should be a whole number and has type {kind}"))
            );
        }
        Ok(Some(bytes.chunks_exact(size).map(|bytes| self.number(bytes)).collect()))
    }

    /// The number that a tag holds, the first if there are several.
    ///
    /// # Errors
    ///
    /// As [`TiffFile::unsigned`].
    pub fn one(&mut self, directory: &Directory, tag: Tag) -> Result<Option<u64>> {
        Ok(self.unsigned(directory, tag, 1)?.and_then(|values| values.first().copied()))
    }

    /// The first `at_most` values of a tag that holds numbers of any type, or bytes; none where the tag is missing. Ratios
    /// of zeros are NaN.
    ///
    /// # Errors
    ///
    /// When the value lies outside the file or is text.
    pub fn numbers(&mut self, directory: &Directory, tag: Tag, at_most: u64) -> Result<Option<Vec<f64>>> {
        let Some(entry) = directory.entries.get(&tag.to_u16()) else { return Ok(None) };
        let (kind, size, bytes) = self.value(entry, tag, at_most)?;
        let mut numbers = Vec::with_capacity(bytes.len() / size);
        for bytes in bytes.chunks_exact(size) {
            let (above, below) = bytes.split_at(size / 2);
            numbers.push(match kind {
                5 => self.number(above) as f64 / self.number(below) as f64,
                10 => self.signed(above) as f64 / self.signed(below) as f64,
                6 | 8 | 9 | 17 => self.signed(bytes) as f64,
                11 => f32::from_bits(low_half(self.number(bytes))).into(),
                12 => f64::from_bits(self.number(bytes)),
                2 | 129 => {
                    return Err(
                        self.problem(format!("the file is damaged; tag {tag:?} should be a number and is text"))
                    );
                }
                _ => self.number(bytes) as f64,
            });
        }
        Ok(Some(numbers))
    }

    /// The number that a tag of any such type holds, the first if there are several; none where it is missing or no
    /// finite number.
    ///
    /// # Errors
    ///
    /// As [`TiffFile::numbers`].
    pub fn ratio(&mut self, directory: &Directory, tag: Tag) -> Result<Option<f64>> {
        let numbers = self.numbers(directory, tag, 1)?;
        Ok(numbers.and_then(|numbers| numbers.first().copied()).filter(|number| number.is_finite()))
    }

    /// The text of a tag up to its first NUL; bytes that are not UTF-8 become U+FFFD.
    ///
    /// # Errors
    ///
    /// When the text lies outside the file or is longer than 16 MiB.
    pub fn text(&mut self, directory: &Directory, tag: Tag) -> Result<Option<String>> {
        let Some(entry) = directory.entries.get(&tag.to_u16()) else { return Ok(None) };
        // ASCII and its cousins: bytes, undefined, UTF-8.
        if !matches!(entry.kind, 1 | 2 | 7 | 129) {
            return Ok(None);
        }
        if entry.count > TEXT_BYTES && self.holds(entry.offset, entry.count) {
            return Err(self.problem(format!("the text of tag {tag:?} is longer than 16 MiB; remove it")));
        }
        let (_, _, bytes) = self.value(entry, tag, TEXT_BYTES)?;
        let end = bytes.iter().position(|&byte| byte == 0).unwrap_or(bytes.len());
        Ok(Some(String::from_utf8_lossy(&bytes[..end]).into_owned()))
    }
}

/// The tags of one image.
#[derive(Debug)]
pub struct Directory {
    entries: BTreeMap<u16, Entry>,
    /// Bytes of the table, with its length before and the link behind it.
    pub(super) bytes: u64,
}

impl Directory {
    /// Whether the tag is there.
    pub fn has(&self, tag: Tag) -> bool {
        self.entries.contains_key(&tag.to_u16())
    }

    /// The numbers of all tags, in ascending order.
    pub fn numbers(&self) -> impl Iterator<Item = u16> {
        self.entries.keys().copied()
    }

    /// Number and type of each tag, the bytes that its values take, and where they lie if not in the table.
    pub(super) fn values(&self) -> impl Iterator<Item = (u16, u16, u64, u64)> {
        self.entries.iter().map(|(tag, entry)| {
            let bytes = entry.count.saturating_mul(type_bytes(entry.kind) as u64);
            (*tag, entry.kind, bytes, entry.offset)
        })
    }
}

#[derive(Debug)]
struct Entry {
    kind: u16,
    count: u64,
    inline: [u8; 8],
    offset: u64,
}

/// The four lower bytes.
fn low_half(number: u64) -> u32 {
    let [a, b, c, d, ..] = number.to_le_bytes();
    u32::from_le_bytes([a, b, c, d])
}

/// Bytes of one value of a TIFF type; 0 for types that do not exist.
pub(super) fn type_bytes(kind: u16) -> usize {
    match kind {
        1 | 2 | 6 | 7 | 129 => 1,
        3 | 8 => 2,
        4 | 9 | 11 | 13 => 4,
        5 | 10 | 12 | 16..=18 => 8,
        _ => 0,
    }
}
