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
const KEPT: [&str; 47] = [
    "SIMPLE", "XTENSION", "BITPIX", "PCOUNT", "GCOUNT", "GROUPS", "ZIMAGE", "BSCALE", "BZERO", "BLANK", "BUNIT",
    "EXTNAME", "BAYERPAT", "COLORTYP", "XBAYROFF", "YBAYROFF", "ROWORDER", "EXPTIME", "EXPOSURE", "EXPOINUS",
    "FOCALLEN", "APTDIA", "FOCRATIO", "CCD-TEMP", "GAIN", "EGAIN", "PEDESTAL", "OFFSET", "BLKLEVEL", "INSTRUME",
    "READOUTM", "XBINNING", "YBINNING", "IMAGETYP", "FRAME", "OBSTYPE", "INHERIT", "XORGSUBF", "YORGSUBF", "CALSTAT",
    "STACKCNT", "NCOMBINE", "FILTER", "SATURATE", "BIASSEC", "DATASEC", "TRIMSEC",
];
/// Keywords of one part alone, which another never inherits, besides those that begin with `NAXIS`.
const OF_ONE_PART: [&str; 12] = [
    "SIMPLE", "XTENSION", "BITPIX", "PCOUNT", "GCOUNT", "GROUPS", "ZIMAGE", "BSCALE", "BZERO", "BLANK", "EXTNAME",
    "INHERIT",
];
/// Keywords for one thing: a header that has one of them tells it.
const FOR_ONE_THING: [&[&str]; 5] = [
    &["EXPTIME", "EXPOSURE", "EXPOINUS"],
    &["BAYERPAT", "COLORTYP"],
    &["IMAGETYP", "FRAME", "OBSTYPE"],
    &["OFFSET", "BLKLEVEL"],
    &["STACKCNT", "NCOMBINE"],
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

/// A value and the comment behind it.
#[derive(Debug, Clone)]
struct Card {
    value: Value,
    comment: String,
}

/// The cards of a part whose keywords are of use; of several with one keyword the first counts.
#[derive(Debug, Default)]
pub(super) struct Header {
    cards: BTreeMap<String, Card>,
    /// Keywords that stand there again with another value.
    pub repeated: BTreeSet<String>,
    /// Keywords that the primary header has and this one lacks, which does not inherit them.
    pub not_inherited: Vec<String>,
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
                    header.take(keyword, card_of(value));
                }
            }
            if block.len() < BLOCK_BYTES {
                return Err(Error::format(name, "the file ends within a header; it was cut short"));
            }
        }
        Err(Error::format(name, "its header is longer than 64 MiB; no header is"))
    }

    /// Takes a card, of which the first with its keyword counts.
    fn take(&mut self, keyword: &str, card: Card) {
        let value = card.value.clone();
        if self.cards.entry(keyword.to_owned()).or_insert(card).value != value {
            self.repeated.insert(keyword.to_owned());
        }
    }

    /// A header of these cards, each without a comment.
    #[cfg(test)]
    pub fn of(cards: &[(&str, Value)]) -> Self {
        let card = |value: &Value| Card { value: value.clone(), comment: String::new() };
        let cards = cards.iter().map(|(key, value)| ((*key).to_owned(), card(value))).collect();
        Self { cards, ..Self::default() }
    }

    /// Takes from the primary header what this one, of an extension, does not tell itself, where its INHERIT is T \[FITS4,
    /// App. K]; else notes which keywords these are. A unit of samples is one of the primary array where there is such an array.
    pub fn inherit(&mut self, primary: &Self) {
        let is_of_array = |key: &str| key == "BUNIT" && primary.number("NAXIS") != Some(0.0);
        let is_shared = |key: &str| !key.starts_with("NAXIS") && !OF_ONE_PART.contains(&key) && !is_of_array(key);
        let told: Vec<_> = primary.cards.iter().filter(|(key, _)| is_shared(key) && !self.tells(key)).collect();
        if self.is_true("INHERIT") {
            let told: Vec<_> = told.into_iter().map(|(key, card)| (key.clone(), card.clone())).collect();
            self.repeated.extend(told.iter().map(|(key, _)| key.clone()).filter(|key| primary.repeated.contains(key)));
            self.cards.extend(told);
        } else {
            self.not_inherited = told.into_iter().map(|(key, _)| key.clone()).collect();
        }
    }

    /// Whether it has a keyword, or another for the same thing.
    fn tells(&self, key: &str) -> bool {
        let alike = FOR_ONE_THING.into_iter().find(|keys| keys.contains(&key));
        alike.unwrap_or(&[key]).iter().any(|key| self.cards.contains_key(*key))
    }

    /// The comment behind the value of a keyword.
    pub fn comment(&self, key: &str) -> &str {
        self.cards.get(key).map_or("", |card| &card.comment)
    }

    fn value(&self, key: &str) -> Option<&Value> {
        self.cards.get(key).map(|card| &card.value)
    }

    /// The number of a keyword, which some programs write as a text; none where there is none.
    pub fn number(&self, key: &str) -> Option<f64> {
        match self.value(key)? {
            Value::Number(number) => Some(*number),
            Value::Text(text) => text.trim().parse().ok().filter(|number: &f64| number.is_finite()),
            Value::Logical(_) | Value::Other => None,
        }
    }

    /// The text of a keyword, without spaces around it; none where there is none, or nothing else.
    pub fn text(&self, key: &str) -> Option<&str> {
        match self.value(key)? {
            Value::Text(text) => Some(text.trim()).filter(|text| !text.is_empty()),
            _ => None,
        }
    }

    /// Whether a keyword is `T`.
    pub fn is_true(&self, key: &str) -> bool {
        self.value(key) == Some(&Value::Logical(true))
    }
}

/// A card as text: printable ASCII.
fn text(card: &[u8]) -> Option<&str> {
    std::str::from_utf8(card).ok().filter(|text| text.bytes().all(|byte| (b' '..=b'~').contains(&byte)))
}

/// The value behind `= `, and the comment behind it \[FITS4, Sec. 4.2].
fn card_of(text: &str) -> Card {
    let text = text.trim_start();
    let (value, rest) = match text.strip_prefix('\'') {
        Some(quoted) => quoted_text(quoted).unwrap_or((Value::Other, "")),
        None => {
            let (value, _) = text.split_once('/').unwrap_or((text, ""));
            (plain_value(value.trim()), &text[value.len()..])
        }
    };
    let comment = rest.trim_start().strip_prefix('/').unwrap_or("").trim();
    Card { value, comment: comment.to_owned() }
}

/// A text behind its first quote, and what follows the last one; none without one. A quote within the text is written twice.
fn quoted_text(quoted: &str) -> Option<(Value, &str)> {
    let (mut text, mut rest) = (String::new(), quoted);
    loop {
        let (before, after) = rest.split_once('\'')?;
        text += before;
        match after.strip_prefix('\'') {
            Some(after) => {
                text.push('\'');
                rest = after;
            }
            None => return Some((Value::Text(text.trim_end().to_owned()), after)),
        }
    }
}

/// A value that is no text.
fn plain_value(value: &str) -> Value {
    match value {
        "T" => Value::Logical(true),
        "F" => Value::Logical(false),
        // Exponents of double precision begin with D.
        number => match number.replace(['D', 'd'], "E").parse() {
            Ok(number) if f64::is_finite(number) => Value::Number(number),
            _ => Value::Other,
        },
    }
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
