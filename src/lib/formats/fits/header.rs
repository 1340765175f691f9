//! The cards of a header, and what they say of the array behind them.

use crate::error::{Error, Result};
use std::collections::{BTreeMap, BTreeSet};
use std::io::Read;

/// Bytes of a block: headers and arrays fill whole ones.
pub(super) const BLOCK_BYTES: usize = 2880;
/// Bytes of a card.
const CARD_BYTES: usize = 80;
/// A header may have this many bytes.
const MOST_BYTES: usize = 64 << 20;
/// Keywords that are kept besides those that begin with `NAXIS`; a header may have very many.
const KEPT: [&str; 36] = [
    "SIMPLE", "XTENSION", "BITPIX", "PCOUNT", "GCOUNT", "GROUPS", "ZIMAGE", "BSCALE", "BZERO", "BLANK", "BUNIT",
    "EXTNAME", "BAYERPAT", "COLORTYP", "XBAYROFF", "YBAYROFF", "ROWORDER", "EXPTIME", "EXPOSURE", "EXPOINUS",
    "FOCALLEN", "APTDIA", "FOCRATIO", "CCD-TEMP", "GAIN", "EGAIN", "PEDESTAL", "OFFSET", "BLKLEVEL", "INSTRUME",
    "READOUTM", "XBINNING", "YBINNING", "IMAGETYP", "FRAME", "OBSTYPE",
];

/// The value of a card.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value {
    /// `T` or `F`.
    Logical(bool),
    /// An integer or a real number.
    Number(f64),
    /// Between quotes; spaces behind it do not count.
    Text(String),
    /// None, or of a kind that nothing here has, such as complex numbers.
    Other,
}

/// The cards of a part whose keywords are of use; of several with one keyword the first counts.
#[derive(Debug, Default)]
pub(super) struct Header {
    cards: BTreeMap<String, Value>,
    /// Keywords that stand there again with another value.
    pub repeated: BTreeSet<String>,
    /// Keywords whose comment tells milliseconds.
    pub in_ms: BTreeSet<String>,
    /// Its bytes, in whole blocks.
    pub bytes: u64,
}

impl Header {
    /// Reads the blocks of a header, up to the one that holds its end. None where nothing follows any more.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] for what is no header or ends too soon, [`Error::Disk`].
    pub fn read(input: &mut impl Read, name: &str) -> Result<Option<Self>> {
        let mut header = Self::default();
        let mut block = Vec::with_capacity(BLOCK_BYTES);
        for number in 0..MOST_BYTES / BLOCK_BYTES {
            block.clear();
            let read = input.by_ref().take(BLOCK_BYTES as u64).read_to_end(&mut block);
            read.map_err(|e| Error::disk(name, "read", e))?;
            if number == 0 && block.is_empty() {
                return Ok(None);
            }
            // A last block need not be filled up, as long as the end stands in it.
            for (place, card) in block.chunks_exact(CARD_BYTES).enumerate() {
                let card = text(card).ok_or_else(|| Error::format(name, "it is damaged: its header is no text"))?;
                let (keyword, rest) = card.split_at(8);
                let keyword = keyword.trim_end();
                if number == 0 && place == 0 && !(["SIMPLE", "XTENSION"].contains(&keyword) && rest.starts_with("= ")) {
                    return Err(Error::format(
                        name,
                        "it is damaged: a header begins with another keyword than it should",
                    ));
                }
                if keyword == "END" && rest.trim().is_empty() {
                    header.bytes = (number as u64 + 1) * BLOCK_BYTES as u64;
                    return Ok(Some(header));
                }
                if let Some(value) = rest.strip_prefix("= ")
                    && (KEPT.contains(&keyword) || keyword.starts_with("NAXIS"))
                {
                    if tells_ms(value) {
                        header.in_ms.insert(keyword.to_owned());
                    }
                    let value = value_of(value);
                    let counts = header.cards.entry(keyword.to_owned()).or_insert_with(|| value.clone());
                    if *counts != value {
                        header.repeated.insert(keyword.to_owned());
                    }
                }
            }
            if block.len() < BLOCK_BYTES {
                return Err(Error::format(name, "the file ends within a header; it was cut short"));
            }
        }
        Err(Error::format(name, "its header is longer than 64 MiB; no header is"))
    }

    /// A header of these cards.
    #[cfg(test)]
    pub fn of(cards: &[(&str, Value)]) -> Self {
        let cards = cards.iter().map(|(key, value)| ((*key).to_owned(), value.clone())).collect();
        Self { cards, ..Self::default() }
    }

    /// The number of a keyword, which some programs write as a text; none where there is none.
    pub fn number(&self, key: &str) -> Option<f64> {
        match self.cards.get(key)? {
            Value::Number(number) => Some(*number),
            Value::Text(text) => text.trim().parse().ok().filter(|number: &f64| number.is_finite()),
            Value::Logical(_) | Value::Other => None,
        }
    }

    /// The text of a keyword, without spaces around it; none where there is none, or nothing else.
    pub fn text(&self, key: &str) -> Option<&str> {
        match self.cards.get(key)? {
            Value::Text(text) => Some(text.trim()).filter(|text| !text.is_empty()),
            _ => None,
        }
    }

    /// Whether a keyword is `T`.
    pub fn is_true(&self, key: &str) -> bool {
        self.cards.get(key) == Some(&Value::Logical(true))
    }
}

/// A card as text: printable ASCII.
fn text(card: &[u8]) -> Option<&str> {
    std::str::from_utf8(card).ok().filter(|text| text.bytes().all(|byte| (b' '..=b'~').contains(&byte)))
}

/// The value behind `= `, without the comment \[FITS4, Sec. 4.2].
fn value_of(text: &str) -> Value {
    let text = text.trim_start();
    if let Some(quoted) = text.strip_prefix('\'') {
        // A quote within the text is written twice.
        let mut value = String::new();
        let mut rest = quoted;
        while let Some((before, after)) = rest.split_once('\'') {
            value += before;
            match after.strip_prefix('\'') {
                Some(after) => {
                    value.push('\'');
                    rest = after;
                }
                None => return Value::Text(value.trim_end().to_owned()),
            }
        }
        return Value::Other;
    }
    let (value, _) = text.split_once('/').unwrap_or((text, ""));
    match value.trim() {
        "T" => Value::Logical(true),
        "F" => Value::Logical(false),
        // Exponents of double precision begin with D.
        number => match number.replace(['D', 'd'], "E").parse() {
            Ok(number) if f64::is_finite(number) => Value::Number(number),
            _ => Value::Other,
        },
    }
}

/// Whether the comment behind a number names milliseconds: `/ [ms] exposure time`.
fn tells_ms(text: &str) -> bool {
    let comment = text.split_once('/').map(|(_, comment)| comment.to_ascii_lowercase()).unwrap_or_default();
    let mut words = comment.split(|letter: char| !letter.is_ascii_alphabetic());
    words.any(|word| ["ms", "msec", "msecs"].contains(&word) || word.starts_with("millisec"))
}

/// What stands behind a header.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Kind {
    /// An array, perhaps of no samples.
    Array,
    /// A table that holds an image in compressed tiles.
    Tiles,
    /// Another extension, by its name.
    Other(String),
}

/// The array behind a header.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Array {
    pub kind: Kind,
    /// Bits of a sample; below zero those of floats.
    pub bitpix: i64,
    /// Columns, rows, planes …
    pub axes: Vec<u64>,
    /// Bytes of its samples, those that fill the last block not counted.
    pub bytes: u64,
}

impl Array {
    /// Reads the keywords that every header has.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] where one is missing or impossible.
    pub fn of(header: &Header, name: &str) -> Result<Self> {
        let damaged = |key: &str| Error::format(name, format!("it is damaged: its header has no valid {key}"));
        let whole = |key: &str| header.number(key).and_then(whole).ok_or_else(|| damaged(key));
        let size = |key: &str| u64::try_from(whole(key)?).map_err(|_| damaged(key));
        if header.text("XTENSION").is_none() && !header.is_true("SIMPLE") {
            return Err(Error::format(name, "it says itself that it departs from the standard (SIMPLE is not T)"));
        }
        let bitpix = whole("BITPIX")?;
        if ![8, 16, 32, 64, -32, -64].contains(&bitpix) {
            return Err(damaged("BITPIX"));
        }
        let count = size("NAXIS")?;
        if count > 999 {
            return Err(damaged("NAXIS"));
        }
        let axes = (1..=count).map(|axis| size(&format!("NAXIS{axis}"))).collect::<Result<Vec<_>>>()?;
        let optional = |key: &str, missing: u64| header.number(key).map_or(Ok(missing), |_| size(key));
        let (before, groups) = (optional("PCOUNT", 0)?, optional("GCOUNT", 1)?);
        if header.is_true("GROUPS") {
            return Err(Error::format(name, "it holds random groups, not an image"));
        }
        let samples = if axes.is_empty() {
            Some(0)
        } else {
            axes.iter().try_fold(1_u64, |product, axis| product.checked_mul(*axis))
        };
        let bytes = samples
            .and_then(|samples| {
                samples.checked_add(before)?.checked_mul(groups)?.checked_mul(bitpix.unsigned_abs() / 8)
            })
            .filter(|bytes| *bytes < 1 << 62);
        let bytes = bytes.ok_or_else(|| Error::format(name, "it is damaged: its header declares a size beyond any"))?;
        let kind = match header.text("XTENSION") {
            None | Some("IMAGE" | "IUEIMAGE") => Kind::Array,
            Some("BINTABLE") if header.is_true("ZIMAGE") => Kind::Tiles,
            Some(other) => Kind::Other(other.to_owned()),
        };
        Ok(Self { kind, bitpix, axes, bytes })
    }

    /// Bytes up to the next header.
    pub fn padded_bytes(&self) -> u64 {
        self.bytes.next_multiple_of(BLOCK_BYTES as u64)
    }

    /// Whether it is an image of some samples.
    pub fn is_image(&self) -> bool {
        self.kind == Kind::Array && self.axes.len() > 1 && self.bytes > 0
    }
}

/// A number that is whole, among those that doubles hold all of.
pub(super) fn whole(number: f64) -> Option<i64> {
    /// 2⁵³.
    const MOST: f64 = 9_007_199_254_740_992.0;
    #[expect(clippy::cast_possible_truncation, reason = "whole, and no larger than 2⁵³")]
    (number.fract() == 0.0 && number.abs() <= MOST).then_some(number as i64)
}
