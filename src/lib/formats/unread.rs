//! Formats that are known, so that none is taken for what it is not, but that not every program reads: the makers' own raw
//! formats, which `import-raw` reads through [`super::makers`], and JPEG.
//!
//! Camera raws mostly begin as a TIFF does, and their first image is a small picture of what was taken: it must not pass
//! for the frame.

use super::format::{FrameFormat, Reading, Sign};
use super::tiff::{Directory, TiffFile};
use crate::error::Result;
use tiff::tags::Tag;

/// Nikon's raw format.
pub const NEF: FrameFormat = tagged("a Nikon NEF", |file, directory| is_raw_of(file, directory, &["NIKON"]));
/// Sony's raw format.
pub const ARW: FrameFormat = tagged("a Sony ARW", |file, directory| is_raw_of(file, directory, &["SONY"]));
/// Pentax's raw format.
pub const PEF: FrameFormat = tagged("a Pentax PEF", |file, directory| is_raw_of(file, directory, &["PENTAX", "RICOH"]));
/// Those of other makers, such as Epson, Hasselblad, Kodak, Leaf, Mamiya and Samsung, that begin with a small picture.
pub const OTHER_RAW: FrameFormat = tagged("a camera's raw file", |file, directory| {
    Ok(directory.has(Tag::Make) && is_reduced(file, directory)? && directory.has(Tag::SubIfd))
});
/// Canon's raw format of 2004 to 2018.
pub const CR2: FrameFormat = raw("a Canon CR2", |head| {
    head.starts_with(b"II*\0") && head.get(8..).is_some_and(|at| at.starts_with(b"CR\x02\0"))
});
/// Canon's raw format since 2018.
pub const CR3: FrameFormat = raw("a Canon CR3", |head| head.get(4..).is_some_and(|at| at.starts_with(b"ftypcrx ")));
/// Canon's raw format before 2004.
pub const CRW: FrameFormat = raw("a Canon CRW", |head| head.get(6..).is_some_and(|at| at.starts_with(b"HEAPCCDR")));
/// Olympus's raw format.
pub const ORF: FrameFormat =
    raw("an Olympus ORF", |head| [b"IIRO", b"IIRS", b"MMOR"].iter().any(|magic| head.starts_with(*magic)));
/// Panasonic's raw format, which Leica uses too.
pub const RW2: FrameFormat = raw("a Panasonic RW2", |head| head.starts_with(b"IIU\0"));
/// Fujifilm's raw format.
pub const RAF: FrameFormat = raw("a Fujifilm RAF", |head| head.starts_with(b"FUJIFILMCCD-RAW"));
/// Minolta's raw format.
pub const MRW: FrameFormat = raw("a Minolta MRW", |head| head.starts_with(b"\0MRM"));
/// Arri's raw format.
pub const ARI: FrameFormat = raw("an Arri ARI", |head| head.starts_with(b"ARRI"));
/// Sigma's raw format, of three samples at a photosite.
pub const X3F: FrameFormat = raw("a Sigma X3F", |head| head.starts_with(b"FOVb"));
/// Phase One's raw format.
pub const IIQ: FrameFormat = raw("a Phase One IIQ", |head| {
    [b"II*\0", b"MM\0*"].iter().any(|magic| head.starts_with(*magic))
        && head.get(8..12).is_some_and(|at| at == b"IIII" || at == b"MMMM")
});
/// JPEG pictures.
pub const JPEG: FrameFormat = FrameFormat {
    name: "a JPEG",
    sign: Sign::Bytes(|head| head.starts_with(&[0xFF, 0xD8, 0xFF])),
    reading: Reading::NotYet(
        "for measurements give the camera's raw file, which a JPEG was developed from; for a picture as a scene convert it, for \
         example with `oiiotool in.jpg -o out.tif`",
    ),
};

/// Portable pictures, as `dcraw` writes them.
pub const PNM: FrameFormat = FrameFormat {
    name: "a PNM (PGM, PPM)",
    sign: Sign::Bytes(|head| matches!(head, [b'P', b'1'..=b'6', b'\n' | b'\r', ..])),
    reading: Reading::NotYet("convert it, for example with `oiiotool in.pgm -o out.tif`, which keeps 16 bits"),
};
/// Pictures of Radiance.
pub const HDR: FrameFormat = FrameFormat {
    name: "a Radiance HDR",
    sign: Sign::Bytes(|head| head.starts_with(b"#?RADIANCE") || head.starts_with(b"#?RGBE")),
    reading: Reading::NotYet("convert it, for example with `oiiotool in.hdr -o out.exr`"),
};

/// Compressions of their own: Sony's, Nikon's and Pentax's.
const OWN_COMPRESSIONS: [u64; 3] = [32_767, 34_713, 65_535];

const fn raw(name: &'static str, is_one: fn(&[u8]) -> bool) -> FrameFormat {
    FrameFormat { name, sign: Sign::Bytes(is_one), reading: Reading::MakersRaw }
}

const fn tagged(name: &'static str, is_one: fn(&mut TiffFile, &Directory) -> Result<bool>) -> FrameFormat {
    FrameFormat { name, sign: Sign::Tags(is_one), reading: Reading::MakersRaw }
}

/// A plane behind a color filter array (PhotometricInterpretation).
const CFA: u64 = 32_803;

/// Whether a file is a raw of one of these makers, and not a TIFF of theirs: its first image is a reduced one that has
/// others below it, or one behind a filter array, or is compressed as only raws are.
fn is_raw_of(file: &mut TiffFile, directory: &Directory, makers: &[&str]) -> Result<bool> {
    let make = file.text(directory, Tag::Make)?.unwrap_or_default().to_ascii_uppercase();
    if !makers.iter().any(|maker| make.starts_with(maker)) {
        return Ok(false);
    }
    let is_reduced = is_reduced(file, directory)?;
    let compression = file.one(directory, Tag::Compression)?;
    let is_plane = file.one(directory, Tag::PhotometricInterpretation)? == Some(CFA);
    Ok(is_reduced && directory.has(Tag::SubIfd)
        || is_plane
        || compression.is_some_and(|number| OWN_COMPRESSIONS.contains(&number)))
}

/// Whether the first image is a smaller one of another.
fn is_reduced(file: &mut TiffFile, directory: &Directory) -> Result<bool> {
    Ok(file.one(directory, Tag::NewSubfileType)?.is_some_and(|kind| kind & 1 == 1))
}
