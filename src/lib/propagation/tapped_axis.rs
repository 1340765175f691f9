//! The columns, or the rows, of a plane that several amplifiers have read, as far as they are alike.

use std::collections::BTreeMap;
use std::ops::Range;

/// The lines of a plane along one axis.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Axis {
    /// The place on the sensor of the plane's first.
    pub first: i64,
    /// What reads each line of the plane, and its parity.
    pub codes: Vec<u8>,
    /// Those of the rectangle.
    pub lines: Range<usize>,
    /// The kinds of these.
    pub kinds: Vec<usize>,
    /// One of each kind, and how many there are.
    pub examples: Vec<(usize, f64)>,
}

/// A code of no line.
const OUTSIDE: u8 = u8::MAX;

/// What a line of the rectangle has more than one beside it.
const WITHIN: u8 = 64;

impl Axis {
    /// Of a plane of so many lines from `first` on, of which `lines` are the rectangle's; `taps` reads a line.
    pub fn of(first: i64, length: usize, lines: Range<usize>, reach: usize, taps: impl Fn(i64) -> [usize; 2]) -> Self {
        let code = |line: i64| {
            let [a, b] = taps(line).map(|tap| u8::try_from(tap).unwrap_or_default());
            2 * (4 * a + b) + u8::from(line.rem_euclid(2) == 1)
        };
        let codes = (0..length).map(|place| code(first + place as i64)).collect();
        let mut axis = Self { first, codes, lines, kinds: Vec::new(), examples: Vec::new() };
        (axis.kinds, axis.examples) = axis.alike(axis.lines.clone(), reach, false);
        axis
    }

    /// The kinds of lines by what is around them, so far to either side, and one of each kind with their number; with `tells_rim` lines
    /// of the rectangle are told from those beside it.
    pub fn alike(&self, lines: Range<usize>, far: usize, tells_rim: bool) -> (Vec<usize>, Vec<(usize, f64)>) {
        let code = |place: Option<usize>| {
            let found = place.and_then(|place| Some((place, *self.codes.get(place)?)));
            found.map_or(OUTSIDE, |(place, code)| {
                code + if tells_rim && self.lines.contains(&place) { WITHIN } else { 0 }
            })
        };
        let far = far.cast_signed();
        let mut known: BTreeMap<Vec<u8>, usize> = BTreeMap::new();
        let mut examples: Vec<(usize, f64)> = Vec::new();
        let kinds = lines.map(|line| {
            let key = (-far..=far).map(|offset| code(line.checked_add_signed(offset))).collect();
            let kind = *known.entry(key).or_insert_with(|| {
                examples.push((line, 0.0));
                examples.len() - 1
            });
            examples[kind].1 += 1.0;
            kind
        });
        (kinds.collect(), examples)
    }

    /// Lines of the rectangle, one of each kind that differs in anything up to so far away, and how many there are.
    pub fn examples(&self, far: usize) -> Vec<(usize, f64)> {
        self.alike(self.lines.clone(), far, true).1
    }

    /// The same of the lines that have a part in the rectangle, with the first of these and the kinds of all.
    pub fn kinds_around(&self, reach: usize, far: usize) -> (usize, Vec<usize>, Vec<(usize, f64)>) {
        let around = self.lines.start.saturating_sub(reach)..(self.lines.end + reach).min(self.codes.len());
        let first = around.start;
        let (kinds, examples) = self.alike(around, far, true);
        (first, kinds, examples)
    }

    /// The kind of a line of the rectangle.
    pub fn kind(&self, line: usize) -> usize {
        self.kinds[line - self.lines.start]
    }
}
