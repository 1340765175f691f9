//! A small raw file as Nikon's D700 lays them out: a picture, below it the plane of 12 bits without compression, and notes of the
//! maker. Made after the tags that readers ask for, not by a camera.

#![allow(dead_code, reason = "each file of tests takes what it needs")]

/// A value of a tag: its type and its bytes.
type Value = (u16, Vec<u8>);

const ASCII: u16 = 2;
const BYTE: u16 = 1;
const SHORT: u16 = 3;
const LONG: u16 = 4;
const RATIO: u16 = 5;
const UNDEFINED: u16 = 7;

fn shorts(values: &[u16]) -> Value {
    (SHORT, values.iter().flat_map(|value| value.to_be_bytes()).collect())
}

fn longs(values: &[u32]) -> Value {
    (LONG, values.iter().flat_map(|value| value.to_be_bytes()).collect())
}

fn ratios(values: &[u32]) -> Value {
    (RATIO, longs(values).1)
}

fn text(text: &str) -> Value {
    (ASCII, [text.as_bytes(), b"\0"].concat())
}

/// A file that grows.
struct File(Vec<u8>);

impl File {
    fn new() -> Self {
        Self(b"MM\0*\0\0\0\0".to_vec())
    }

    /// Appends bytes, and gives their place.
    fn put(&mut self, bytes: &[u8]) -> u32 {
        self.0.resize(self.0.len().next_multiple_of(2), 0);
        let place = self.0.len();
        self.0.extend(bytes);
        u32::try_from(place).unwrap()
    }

    /// Appends a directory, its values behind it, and gives its place.
    fn directory(&mut self, mut tags: Vec<(u16, Value)>) -> u32 {
        tags.sort();
        let place = self.0.len().next_multiple_of(2);
        let behind = place + 2 + 12 * tags.len() + 4;
        let mut values: Vec<u8> = Vec::new();
        let mut table = u16::try_from(tags.len()).unwrap().to_be_bytes().to_vec();
        for (tag, (kind, mut bytes)) in tags {
            let size = match kind {
                SHORT => 2,
                LONG => 4,
                RATIO => 8,
                _ => 1,
            };
            let count = u32::try_from(bytes.len() / size).unwrap();
            if bytes.len() > 4 {
                bytes.resize(bytes.len().next_multiple_of(2), 0);
                let at = u32::try_from(behind + values.len()).unwrap();
                values.append(&mut bytes);
                bytes = at.to_be_bytes().to_vec();
            }
            bytes.resize(4, 0);
            table.extend([&tag.to_be_bytes()[..], &kind.to_be_bytes(), &count.to_be_bytes(), &bytes].concat());
        }
        self.put(&[table, vec![0; 4], values].concat())
    }

    fn done(mut self, first: u32) -> Vec<u8> {
        self.0[4..8].copy_from_slice(&first.to_be_bytes());
        self.0
    }
}

/// The file of a plane of codes of 12 bits.
#[allow(clippy::too_many_lines, reason = "a file, directory after directory")]
pub fn nef([width, height]: [u32; 2], codes: &[u16]) -> Vec<u8> {
    // Two codes in three bytes.
    let strip: Vec<u8> = codes
        .chunks_exact(2)
        .flat_map(|pair| {
            let both = u32::from(pair[0]) << 12 | u32::from(pair[1]);
            both.to_be_bytes()[1..].to_vec()
        })
        .collect();
    let mut notes = File::new();
    // The multipliers of R and B, which follow one another, then those of the two greens.
    // Readers take it for granted that this directory begins right behind the header.
    let first = notes.directory(vec![(0x0C, ratios(&[2, 1, 3, 2, 1, 1, 1, 1])), (0x93, shorts(&[1]))]);
    let notes = [b"Nikon\0\x02\x10\0\0".to_vec(), notes.done(first)].concat();

    let mut file = File::new();
    let exif = file.directory(vec![
        (33434, ratios(&[1, 250])),
        (33437, ratios(&[56, 10])),
        (34855, shorts(&[200])),
        (37500, (UNDEFINED, notes)),
    ]);
    let picture = file.put(&[0; 144]);
    // Its length is known before it is there.
    let raw = |place: u32| {
        vec![
            (254, longs(&[0])),
            (256, longs(&[width])),
            (257, longs(&[height])),
            (258, shorts(&[12])),
            (259, shorts(&[1])),
            (262, shorts(&[32803])),
            (273, longs(&[place])),
            (277, shorts(&[1])),
            (278, longs(&[height])),
            (279, longs(&[u32::try_from(strip.len()).unwrap()])),
            (33421, shorts(&[2, 2])),
            (33422, (BYTE, vec![0, 1, 1, 2])),
        ]
    };
    let first = |below: u32| {
        vec![
            (254, longs(&[1])),
            (256, longs(&[8])),
            (257, longs(&[6])),
            (258, shorts(&[8, 8, 8])),
            (259, shorts(&[1])),
            (262, shorts(&[2])),
            (271, text("NIKON CORPORATION")),
            (272, text("NIKON D700")),
            (273, longs(&[picture])),
            (274, shorts(&[8])),
            (277, shorts(&[3])),
            (278, longs(&[6])),
            (279, longs(&[144])),
            (330, longs(&[below])),
            (34665, longs(&[exif])),
        ]
    };
    // The plane comes last, as in the files of cameras: behind the directories, whose lengths do not depend on its place.
    let length = {
        let mut trial = File(file.0.clone());
        let below = trial.directory(raw(0));
        trial.directory(first(below));
        trial.0.len().next_multiple_of(2)
    };
    let below = file.directory(raw(u32::try_from(length).unwrap()));
    let first = file.directory(first(below));
    file.put(&strip);
    file.done(first)
}
