//! What was worked out last is not worked out again: stages, causes and shares of saturation ask for the same laws.

use super::effort;
use std::cell::RefCell;
use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

/// The last answers of a thread.
pub(super) struct Memory<Key, Answer>(RefCell<Known<Key, Answer>>);

/// Answers in the order in which they came, a new one in the place of the oldest, with what was asked, its print, and the evaluations that
/// each took; and where they stand by the print.
struct Known<Key, Answer> {
    answers: Vec<(u64, Key, Answer, u64)>,
    next: usize,
    places: HashMap<u64, usize, BuildHasherDefault<AsPrinted>>,
}

/// Prints are spread already.
#[derive(Default)]
struct AsPrinted(u64);

impl Hasher for AsPrinted {
    fn write(&mut self, _: &[u8]) {
        unreachable!("prints are single numbers");
    }

    fn write_u64(&mut self, print: u64) {
        self.0 = print;
    }

    fn finish(&self) -> u64 {
        self.0
    }
}

/// Evaluations that it takes as long as to look for an answer, and to keep one.
const OF_LOOK: u64 = 25;

/// As many answers as one scene asks for, with those of all kinds of its hot photosites.
const KEPT: usize = 4096;

/// What is asked, in a few bits: numbers that next to never are the same of things that differ.
pub(super) trait Print {
    /// The print beside what came before.
    fn print(&self, before: u64) -> u64;
}

impl Print for f64 {
    fn print(&self, before: u64) -> u64 {
        // Multiplication by an odd number spreads upward, the shift downward.
        let mixed = (before ^ self.to_bits()).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        mixed ^ (mixed >> 29)
    }
}

impl<const N: usize, T: Print> Print for [T; N] {
    fn print(&self, before: u64) -> u64 {
        self.iter().fold(before, |before, one| one.print(before))
    }
}

impl<A: Print, B: Print> Print for (A, B) {
    fn print(&self, before: u64) -> u64 {
        self.1.print(self.0.print(before))
    }
}

impl<A: Print, B: Print, C: Print> Print for (A, B, C) {
    fn print(&self, before: u64) -> u64 {
        self.2.print(self.1.print(self.0.print(before)))
    }
}

impl<Key: PartialEq, Answer: Clone> Known<Key, Answer> {
    /// The answer to what was asked, where it is known.
    fn recall(&self, print: u64, key: &Key) -> Option<(Answer, u64)> {
        let (_, of, answer, took) = self.answers.get(*self.places.get(&print)?)?;
        (of == key).then(|| (answer.clone(), *took))
    }

    fn keep(&mut self, answer: (u64, Key, Answer, u64)) {
        self.places.insert(answer.0, self.next);
        match self.answers.get_mut(self.next) {
            Some(oldest) => {
                // Another of the same print may stand elsewhere.
                if oldest.0 != answer.0 && self.places.get(&oldest.0) == Some(&self.next) {
                    self.places.remove(&oldest.0);
                }
                *oldest = answer;
            }
            None => {
                // Answers are large: they shall not move.
                self.answers.reserve_exact(KEPT - self.next);
                self.answers.push(answer);
            }
        }
        self.next = (self.next + 1) % KEPT;
    }
}

impl<Key: PartialEq + Print, Answer: Clone> Memory<Key, Answer> {
    pub const fn new() -> Self {
        let places = HashMap::with_hasher(BuildHasherDefault::new());
        Self(RefCell::new(Known { answers: Vec::new(), next: 0, places }))
    }

    /// The answer, worked out unless it is known. Either takes as many evaluations, lest what is refused hang on what was asked
    /// before.
    pub fn recall(&self, key: Key, work_out: impl FnOnce(&Key) -> Answer) -> Answer {
        effort::spend(OF_LOOK);
        let print = key.print(0);
        let known = self.0.borrow().recall(print, &key);
        if let Some((answer, took)) = known {
            effort::spend(took);
            return answer;
        }
        let (answer, took) = effort::counted(|| work_out(&key));
        if effort::is_spent() {
            return answer;
        }
        self.0.borrow_mut().keep((print, key, answer.clone(), took));
        answer
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A number whose print is its last digit.
    #[derive(Debug, Clone, Copy, PartialEq)]
    struct Number(u64);

    impl Print for Number {
        fn print(&self, _: u64) -> u64 {
            self.0 % 10
        }
    }

    #[test]
    fn what_has_the_same_print_is_told_apart() {
        let memory = Memory::new();
        let ask = |number: u64| memory.recall(Number(number), |Number(number)| 7 * number);
        assert_eq!([3, 13, 3, 13, 23, 3, 4].map(ask), [21, 91, 21, 91, 161, 21, 28]);
    }

    #[test]
    fn the_last_answers_are_known_and_take_as_much() {
        let (memory, worked) = (Memory::new(), std::cell::Cell::new(0));
        let ask = |number: f64| {
            let work_out = |number: &f64| {
                worked.set(worked.get() + 1);
                effort::spend(3);
                *number
            };
            effort::counted(|| memory.recall(number, work_out))
        };
        let kept = u32::try_from(KEPT).unwrap();
        let took = OF_LOOK + 3;
        effort::within(u64::MAX - 1, || {
            (0..2 * kept).map(f64::from).for_each(|number| assert_eq!(ask(number), (number, took)));
            assert_eq!(worked.replace(0), 2 * kept);
            (kept..2 * kept).rev().map(f64::from).for_each(|number| assert_eq!(ask(number), (number, took)));
            assert_eq!((worked.get(), ask(0.0).0, worked.get()), (0, 0.0, 1));
        });
    }
}
