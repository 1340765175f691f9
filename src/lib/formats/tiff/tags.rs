//! Tags that the caller of the writer adds to its own.

use super::directory::type_bytes;
use crate::error::{Error, Result};
use tiff::tags::{Tag, Type};

/// A tag that the caller adds.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtraTag {
    /// Its number.
    pub number: u16,
    /// Its value.
    pub value: TagValue,
}

/// The value of a tag: one number or several of a type, or a text.
#[derive(Debug, Clone, PartialEq)]
pub enum TagValue {
    /// BYTE.
    Bytes(Vec<u8>),
    /// UNDEFINED: bytes that are no numbers.
    Undefined(Vec<u8>),
    /// ASCII; its final NUL is added.
    Text(String),
    /// SHORT.
    Shorts(Vec<u16>),
    /// LONG.
    Longs(Vec<u32>),
    /// SSHORT.
    SignedShorts(Vec<i16>),
    /// SLONG.
    SignedLongs(Vec<i32>),
    /// RATIONAL: dividend and divisor.
    Ratios(Vec<[u32; 2]>),
    /// SRATIONAL.
    SignedRatios(Vec<[i32; 2]>),
    /// FLOAT.
    Floats(Vec<f32>),
    /// DOUBLE.
    Doubles(Vec<f64>),
}

/// Tags that say how and where samples are stored, or what the frame is called: the writer sets those that are needed.
pub(super) const OF_THE_WRITER: [u16; 26] = [
    256, 257, 258, 259, 262, 266, 270, 273, 277, 278, 279, 282, 283, 284, 286, 287, 296, 305, 317, 322, 323, 324, 325,
    338, 339, 347,
];

/// One entry of a directory.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Field {
    pub tag: Tag,
    pub kind: Type,
    pub count: u64,
    /// The value, little-endian.
    pub bytes: Vec<u8>,
}

impl Field {
    /// An entry whose value has these bytes.
    pub fn new(tag: Tag, kind: Type, bytes: Vec<u8>) -> Self {
        Self { tag, kind, count: (bytes.len() / type_bytes(kind.to_u16())) as u64, bytes }
    }

    /// An entry with a text.
    pub fn text(tag: Tag, text: &str) -> Self {
        Self::new(tag, Type::ASCII, text.bytes().filter(|&byte| byte != 0).chain([0]).collect())
    }
}

/// The entries of the tags that the caller adds, in the order of their numbers.
///
/// # Errors
///
/// [`Error::Data`] for a tag that the writer sets itself, that is given twice, or has no value.
pub(super) fn fields(extra: &[ExtraTag], name: &str) -> Result<Vec<Field>> {
    let refuse = |number: u16, why: &str| Err(Error::Data(format!("{name}: the tag {number} {why}")));
    let mut fields: Vec<Field> = Vec::with_capacity(extra.len());
    for ExtraTag { number, value } in extra {
        let field = encoded(Tag::from_u16_exhaustive(*number), value);
        if OF_THE_WRITER.contains(number) {
            return refuse(*number, "is set by the writer of the file; it cannot be added");
        }
        if fields.iter().any(|other| other.tag == field.tag) {
            return refuse(*number, "is given twice");
        }
        if field.count == 0 {
            return refuse(*number, "has no value");
        }
        fields.push(field);
    }
    fields.sort_by_key(|field| field.tag.to_u16());
    Ok(fields)
}

fn encoded(tag: Tag, value: &TagValue) -> Field {
    let (kind, bytes) = match value {
        TagValue::Bytes(bytes) => (Type::BYTE, bytes.clone()),
        TagValue::Undefined(bytes) => (Type::UNDEFINED, bytes.clone()),
        TagValue::Text(text) => return Field::text(tag, text),
        TagValue::Shorts(numbers) => (Type::SHORT, little_endian(numbers, |number| number.to_le_bytes())),
        TagValue::Longs(numbers) => (Type::LONG, little_endian(numbers, |number| number.to_le_bytes())),
        TagValue::SignedShorts(numbers) => (Type::SSHORT, little_endian(numbers, |number| number.to_le_bytes())),
        TagValue::SignedLongs(numbers) => (Type::SLONG, little_endian(numbers, |number| number.to_le_bytes())),
        TagValue::Ratios(ratios) => (Type::RATIONAL, little_endian(ratios.as_flattened(), |part| part.to_le_bytes())),
        TagValue::SignedRatios(ratios) => {
            (Type::SRATIONAL, little_endian(ratios.as_flattened(), |part| part.to_le_bytes()))
        }
        TagValue::Floats(numbers) => (Type::FLOAT, little_endian(numbers, |number| number.to_le_bytes())),
        TagValue::Doubles(numbers) => (Type::DOUBLE, little_endian(numbers, |number| number.to_le_bytes())),
    };
    Field::new(tag, kind, bytes)
}

fn little_endian<T: Copy, const BYTES: usize>(numbers: &[T], bytes: impl Fn(T) -> [u8; BYTES]) -> Vec<u8> {
    numbers.iter().flat_map(|number| bytes(*number)).collect()
}
