//! Corrections that a DNG asks converters for, none of which is made here \[DNG2023, ch. 7, Opcode List Processing].

use super::image::RawImage;
use super::tags;
use crate::error::{Error, Result};
use crate::formats::tiff::TiffFile;

/// What an opcode does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Effect {
    /// Multiplies samples by place: what a flat field takes off too.
    Shading,
    /// Makes other numbers of samples.
    Levels,
    /// Tells photosites that are defective.
    Defects,
    /// Moves what is seen, or cuts it off.
    Places,
}

/// The opcodes by their numbers.
const OPCODES: [(u32, &str, Effect); 14] = [
    (1, "WarpRectilinear", Effect::Places),
    (2, "WarpFisheye", Effect::Places),
    (3, "FixVignetteRadial", Effect::Shading),
    (4, "FixBadPixelsConstant", Effect::Defects),
    (5, "FixBadPixelsList", Effect::Defects),
    (6, "TrimBounds", Effect::Places),
    (7, "MapTable", Effect::Levels),
    (8, "MapPolynomial", Effect::Levels),
    (9, "GainMap", Effect::Shading),
    (10, "DeltaPerRow", Effect::Levels),
    (11, "DeltaPerColumn", Effect::Levels),
    (12, "ScalePerRow", Effect::Levels),
    (13, "ScalePerColumn", Effect::Levels),
    (14, "WarpRectilinear2", Effect::Places),
];

/// What is said of the opcodes of a raw image: doubts of those by which converters make other samples of it, and notes on others.
#[derive(Debug, Default)]
pub(super) struct Said {
    pub doubts: Vec<String>,
    pub notes: Vec<String>,
}

impl Said {
    /// What is said of all lists of an image.
    ///
    /// # Errors
    ///
    /// Those of the disk alone: no sample that is read depends on them.
    pub fn of(file: &mut TiffFile, image: &RawImage) -> Result<Self> {
        /// Bytes of a list that are looked at; a map of gains takes some 10⁴.
        const MOST: u64 = 1 << 20;
        let mut said = Self::default();
        for tag in tags::OPCODES {
            let bytes = match tag.numbers(file, image.directory(), MOST) {
                Ok(None) => continue,
                Err(Error::Format { .. }) => None,
                other => other?,
            };
            match bytes.as_deref().and_then(numbers) {
                Some(list) => said.take(tag.1, &list),
                None => said.notes.push(format!("its {} is passed over: it is damaged", tag.1)),
            }
        }
        Ok(said)
    }

    /// Takes in a list.
    fn take(&mut self, list: &str, numbers: &[u32]) {
        let effect = |number: &u32| OPCODES.iter().find(|(known, ..)| known == number).map(|(.., effect)| *effect);
        // Of one that is not known anything may follow.
        let with = |wanted: Effect| {
            let of_it = numbers.iter().filter(|number| effect(number).unwrap_or(Effect::Levels) == wanted);
            in_words(of_it.copied())
        };
        if let Some(names) = with(Effect::Shading) {
            self.doubts.push(format!(
                "its {list} has {names}, by which DNG evens out what falls off towards the corners: it is not applied; a flat field \
                 does the same, `correct-frame --flat`"
            ));
        }
        if let Some(names) = with(Effect::Levels) {
            self.doubts.push(format!(
                "its {list} has {names}, by which DNG makes other levels of its samples: it is not applied, and samples need not be \
                 linear in light without it; have the program that wrote the file write it without, or applied"
            ));
        }
        if let Some(names) = with(Effect::Defects) {
            self.doubts.push(format!(
                "its {list} has {names}, which tells defective photosites: they are neither marked nor interpolated; \
                 `correct-frame --defects` takes a list of them, and `correct-frame --find-defects` finds them in dark frames"
            ));
        }
        if let Some(names) = with(Effect::Places) {
            self.notes.push(format!("its {list} has {names}, which moves or cuts pictures, and is not applied"));
        }
    }
}

/// Opcodes by their names, each once; none of none.
fn in_words(numbers: impl Iterator<Item = u32>) -> Option<String> {
    let mut names: Vec<String> = Vec::new();
    for number in numbers {
        let known = OPCODES.iter().find(|(known, ..)| *known == number).map(|(_, name, _)| (*name).to_owned());
        let name = known.unwrap_or_else(|| format!("an opcode {number} that is not known here"));
        if !names.contains(&name) {
            names.push(name);
        }
    }
    (!names.is_empty()).then(|| names.join(", "))
}

/// The numbers of the opcodes of a list, as far as its bytes are there: big-endian whatever the order of the file, the count; then of
/// each its number, version, flags, and the bytes of what it holds, and these. None of a list that is damaged.
fn numbers(bytes: &[f64]) -> Option<Vec<u32>> {
    /// Number, version, flags and length.
    const HEAD: usize = 16;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the tag holds bytes")]
    let whole = |at: usize| {
        let four = bytes.get(at..at.checked_add(4)?)?;
        Some(four.iter().fold(0_u32, |all, byte| all << 8 | u32::from(*byte as u8)))
    };
    let count = whole(0)?;
    let (mut found, mut at) = (Vec::new(), 4_usize);
    for _ in 0..count {
        // The rest of a long list is not looked at.
        let Some((number, length)) = whole(at).zip(whole(at.checked_add(HEAD - 4)?)) else {
            return (!found.is_empty()).then_some(found);
        };
        found.push(number);
        at = at.checked_add(HEAD)?.checked_add(usize::try_from(length).ok()?)?;
    }
    Some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A list of opcodes with so many bytes each.
    fn list(opcodes: &[(u32, usize)]) -> Vec<f64> {
        let mut bytes = u32::try_from(opcodes.len()).unwrap().to_be_bytes().to_vec();
        for (number, length) in opcodes {
            let head = [*number, 0x0103_0000, 1, u32::try_from(*length).unwrap()];
            bytes.extend(head.into_iter().flat_map(u32::to_be_bytes));
            bytes.extend(vec![9; *length]);
        }
        bytes.into_iter().map(f64::from).collect()
    }

    #[test]
    fn opcodes_are_found_behind_what_others_hold() {
        assert_eq!(numbers(&list(&[(9, 76), (9, 0), (5, 12), (1, 3)])), Some(vec![9, 9, 5, 1]));
        assert_eq!(numbers(&list(&[])), Some(Vec::new()));
        // Cut short, what is there counts; nothing, or a count without opcodes, is damage.
        let long = list(&[(9, 76), (3, 5)]);
        assert_eq!(numbers(&long[..50]), Some(vec![9]));
        assert_eq!([numbers(&long[..3]), numbers(&long[..9])], [None, None]);
        assert_eq!(numbers(&[255.0; 16]), None);
    }

    #[test]
    fn what_changes_samples_is_doubted_and_what_moves_them_noted() {
        let mut said = Said::default();
        said.take("OpcodeList2", &[9, 9, 5, 1, 8, 77]);
        let wanted = [
            "has GainMap, by",
            "has MapPolynomial, an opcode 77 that is not known here, by",
            "has FixBadPixelsList, which",
        ];
        for wanted in wanted {
            assert!(said.doubts.iter().any(|doubt| doubt.contains(wanted)), "{wanted}: {said:?}");
        }
        assert_eq!(said.doubts.len(), 3);
        assert!(said.notes.len() == 1 && said.notes[0].contains("OpcodeList2 has WarpRectilinear"), "{said:?}");
    }
}
