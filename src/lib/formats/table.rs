//! The table of formats: what a file is, told before any of it is decoded.

use super::format::{FrameFormat, Readers, Reading, Sign};
use super::tiff::{self, TiffFile};
use super::{dng, exr, fits, png, unread};
use crate::error::{Error, Result};
use std::fs::File;

/// All formats that are known. Of those that share their first bytes the narrower comes first, TIFF last.
pub const FORMATS: &[FrameFormat] = &[
    exr::FORMAT,
    dng::FORMAT,
    unread::NEF,
    unread::ARW,
    unread::PEF,
    unread::OTHER_RAW,
    unread::CR2,
    unread::CR3,
    unread::CRW,
    unread::ORF,
    unread::RW2,
    unread::RAF,
    unread::MRW,
    unread::ARI,
    unread::X3F,
    unread::IIQ,
    png::FORMAT,
    unread::JPEG,
    unread::PNM,
    unread::HDR,
    fits::FORMAT,
    tiff::FORMAT,
];

/// The readers of a file that begins with the bytes `head`; none where no format does. Those of a TIFF may have to give
/// way to others, see [`by_tags`].
///
/// # Errors
///
/// [`Error::Format`] for a format that is not read, [`Error::Order`] for one that `import-raw` alone reads.
pub fn by_head(head: &[u8], name: &str) -> Result<Option<Readers>> {
    known_by(head).map(|format| readers(format, name)).transpose()
}

/// The readers of a file that begins as a TIFF does and is something narrower; none where it is just a TIFF.
///
/// # Errors
///
/// Those of [`by_head`]; [`Error::Disk`] where the file cannot be looked at.
pub fn by_tags(file: &File, name: &str) -> Result<Option<Readers>> {
    // Of a damaged file the reader of TIFF meets the damage again, and tells it if it matters.
    whole(narrower(file, name))?.flatten().map(|format| readers(format, name)).transpose()
}

fn narrower(file: &File, name: &str) -> Result<Option<&'static FrameFormat>> {
    let copy = file.try_clone().map_err(|e| Error::disk(name, "read", e))?;
    let mut file = TiffFile::open(copy, name)?;
    let directory = file.directory(0)?;
    for format in FORMATS {
        if let Sign::Tags(is_one) = format.sign
            && is_one(&mut file, &directory)?
        {
            return Ok(Some(format));
        }
    }
    Ok(None)
}

/// The format of a file of a maker's own raw format, which begins with the bytes `head`; none of another.
///
/// # Errors
///
/// [`Error::Disk`] where the file cannot be looked at.
pub fn makers_raw(file: &File, head: &[u8], name: &str) -> Result<Option<&'static FrameFormat>> {
    let by_head = known_by(head);
    let by_tags = if tiff::begins_so(head) { whole(narrower(file, name))?.flatten() } else { None };
    let is_makers = |format: &&FrameFormat| matches!(format.reading, Reading::MakersRaw);
    Ok(by_tags.filter(is_makers).or(by_head.filter(is_makers)))
}

/// What was found in a file, nothing in one that is damaged.
fn whole<T>(found: Result<T>) -> Result<Option<T>> {
    match found {
        Err(Error::Format { .. }) => Ok(None),
        other => other.map(Some),
    }
}

fn readers(format: &FrameFormat, name: &str) -> Result<Readers> {
    match format.reading {
        Reading::Rows(readers) => Ok(readers),
        Reading::MakersRaw => Err(Error::Order {
            file: name.into(),
            problem: format!("it is {}, a maker's own raw format", format.name),
            first: "import-raw",
        }),
        Reading::NotYet(instead) => {
            Err(Error::format(name, format!("it is {}, which is not read yet; {instead}", format.name)))
        }
    }
}

/// Whether bytes begin a frame that can stand behind another: one that is read without a seek and has no parts that might come
/// later.
pub fn may_follow(head: &[u8]) -> bool {
    FORMATS.iter().any(|format| match (format.sign, format.reading) {
        (Sign::Bytes(is_one), Reading::Rows(Readers { stream: Some(stream), .. })) => {
            is_one(head) && !stream.has_parts && (stream.is_streamable)(head)
        }
        _ => false,
    })
}

/// The format of a file that begins with the bytes `head`; none of what is no frame.
pub fn known_by(head: &[u8]) -> Option<&'static FrameFormat> {
    FORMATS.iter().find(|format| matches!(format.sign, Sign::Bytes(is_one) if is_one(head)))
}

/// The names of the formats that are read: `an EXR nor a DNG nor a PNG nor a FITS nor a TIFF`.
pub fn names_of_read() -> String {
    let is_read = |format: &&FrameFormat| matches!(format.reading, Reading::Rows(_));
    FORMATS.iter().filter(is_read).map(|format| format.name).collect::<Vec<_>>().join(" nor ")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cfa::FilterArray;
    use crate::formats::files::tests::of_bytes;
    use crate::formats::input::{FrameReader, InputOptions};
    use crate::formats::tiff::{ExtraTag, TagValue, TiffCompression, TiffSamples, TiffSettings, TiffTags, TiffWriter};
    use crate::frame::Geometry;
    use crate::stream::RowSource;
    use std::io::Cursor;

    const RAW: &str = "a maker's own raw format; run `import-raw` first";

    /// Opens bytes as a file or as what comes down a pipe, which holds them.
    fn open(bytes: &[u8], piped: bool) -> Result<FrameReader> {
        let input = of_bytes(bytes, piped);
        FrameReader::open_file(input, "in", None, &InputOptions::default())
    }

    fn complaint(bytes: &[u8]) -> String {
        let [file, pipe] = [false, true].map(|piped| open(bytes, piped).err().unwrap().to_string());
        assert_eq!(file, pipe);
        file
    }

    /// A TIFF of 4x2 pixels with tags of its own.
    fn tiff(extra: &[(u16, TagValue)]) -> Vec<u8> {
        let extra = extra.iter().map(|(number, value)| ExtraTag { number: *number, value: value.clone() }).collect();
        let settings = TiffSettings {
            samples: TiffSamples::U16,
            scale: 1.0,
            compression: TiffCompression::None,
            tags: TiffTags::default(),
            extra,
            exif: Vec::new(),
        };
        let geometry = Geometry::new(4, 2, &["Y"]);
        let mut writer = TiffWriter::create(Cursor::new(Vec::new()), "out.tif", &geometry, settings).unwrap();
        writer.write_rows(&[7.0; 8]).unwrap();
        writer.finish().unwrap().0.into_inner()
    }

    #[test]
    fn formats_that_are_not_read_are_refused_by_name() {
        for (begin, name) in [
            (&b"II*\0\x10\0\0\0CR\x02\0"[..], "a Canon CR2"),
            (b"\0\0\0\x18ftypcrx \0\0\0\x01", "a Canon CR3"),
            (b"II\x1A\0\0\0HEAPCCDR", "a Canon CRW"),
            (b"IIRO\x08\0\0\0", "an Olympus ORF"),
            (b"IIU\0\x18\0\0\0", "a Panasonic RW2"),
            (b"FUJIFILMCCD-RAW 0201", "a Fujifilm RAF"),
            (b"\0MRM\0\0\0\0", "a Minolta MRW"),
            (b"ARRI\x12\x34\x56\x78", "an Arri ARI"),
            (b"FOVb\0\0\x02\0", "a Sigma X3F"),
            (b"II*\0\x08\0\0\0IIII", "a Phase One IIQ"),
        ] {
            let bytes = [begin, &[0; 64]].concat();
            assert_eq!(complaint(&bytes), format!("in: it is {name}, {RAW}"));
        }
        // What is read is told from the others too, and says itself what is wrong.
        assert!(complaint(b"\x89PNG\r\n\x1A\n\0\0\0\rIHDR").contains("it was cut short"));
        assert!(complaint(&[0xFF, 0xD8, 0xFF, 0xE0]).starts_with("in: it is a JPEG, which is not read yet; "));
        assert!(
            complaint(b"P5\n2 2\n65535\nabcdefgh").starts_with("in: it is a PNM (PGM, PPM), which is not read yet; ")
        );
        assert!(complaint(b"#?RADIANCE\n").starts_with("in: it is a Radiance HDR, which is not read yet; "));
        assert!(complaint(b"SIMPLE  =                    T").contains("ends within a header"));
    }

    #[test]
    fn raws_that_begin_as_a_tiff_are_told_from_one() {
        let (make, reduced) = (|make: &str| (271, TagValue::Text(make.into())), (254, TagValue::Longs(vec![1])));
        let below = (330, TagValue::Longs(vec![8]));
        let dng = (50_706, TagValue::Bytes(vec![1, 4, 0, 0]));
        for (tags, name) in [
            (vec![make("NIKON CORPORATION"), reduced.clone(), below.clone()], "a Nikon NEF"),
            (vec![make("SONY"), reduced.clone(), below.clone()], "a Sony ARW"),
            (vec![make("SEIKO EPSON CORP."), reduced.clone(), below.clone()], "a camera's raw file"),
        ] {
            assert_eq!(complaint(&tiff(&tags)), format!("in: it is {name}, {RAW}"));
        }
        // Those that are read are not taken for what their makers' own are.
        let said = complaint(&tiff(&[make("NIKON CORPORATION"), dng.clone(), reduced.clone()]));
        assert!(said.starts_with("in: it is a DNG without a raw image"), "{said}");
        let plane = open(&tiff(&[make("NIKON CORPORATION"), dng]), true).unwrap();
        assert_eq!(plane.header().metadata.cfa, Some(FilterArray::Monochrome));
        let mut pef = tiff(&[make("PENTAX Corporation")]);
        let compression = pef.windows(8).position(|entry| entry == [3, 1, 3, 0, 1, 0, 0, 0]).unwrap() + 8;
        pef[compression..compression + 2].copy_from_slice(&[0xFF, 0xFF]);
        assert_eq!(complaint(&pef), format!("in: it is a Pentax PEF, {RAW}"));

        // Such a maker's programs write plain TIFF too, and so do those that make small pictures beside large ones.
        for tags in [vec![make("NIKON CORPORATION")], vec![make("SONY"), reduced.clone()], vec![reduced, below]] {
            for piped in [false, true] {
                let mut reader = open(&tiff(&tags), piped).unwrap();
                let mut samples = Vec::new();
                reader.read(2, &mut samples).unwrap();
                assert_eq!((reader.stored_as(), samples), ("u16", vec![7.0; 8]));
            }
        }
    }

    #[test]
    fn what_is_no_frame_is_told_so() {
        let refused = "in: it is neither an EXR nor a DNG nor a PNG nor a FITS nor a TIFF file";
        let text = "; it looks like text (a spectrum goes into `render-radiance`)";
        assert_eq!(complaint(&[0; 64]), refused);
        assert_eq!(complaint("# Größen\n".as_bytes()), format!("{refused}{text}"));
        // The sixteenth byte is the first of two.
        assert_eq!(complaint("# 1 characters ö".as_bytes()), format!("{refused}{text}"));
        assert_eq!(complaint(b"# 1 ch\x01racters"), refused);
        assert_eq!(complaint(b""), "in: it is empty");
        // A TIFF that is damaged where others are told from it is still one.
        let mut damaged = tiff(&[]);
        let end = damaged.len() - 30;
        damaged.truncate(end);
        assert!(complaint(&damaged).contains("cut short"));
    }

    #[test]
    fn no_line_hides_another() {
        for (index, format) in FORMATS.iter().enumerate() {
            assert!(FORMATS[..index].iter().all(|other| other.name != format.name), "{}", format.name);
        }
        assert_eq!(FORMATS.last().map(|format| format.name), Some("a TIFF"));
    }
}
