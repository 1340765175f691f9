//! What was worked out last is not worked out again: stages, causes and shares of saturation ask for the same laws.

use super::effort;
use std::cell::RefCell;
use std::collections::VecDeque;

/// The last answers of a thread, by what was asked, and the evaluations that each took.
pub(super) struct Memory<Key, Answer>(RefCell<VecDeque<(Key, Answer, u64)>>);

/// As many answers as one scene asks for, with those of all kinds of its hot photosites.
const KEPT: usize = 1024;

impl<Key: PartialEq, Answer: Copy> Memory<Key, Answer> {
    pub const fn new() -> Self {
        Self(RefCell::new(VecDeque::new()))
    }

    /// The answer, worked out unless it is known. Either takes as many evaluations, lest what is refused hang on what was asked
    /// before.
    pub fn recall(&self, key: Key, work_out: impl FnOnce(&Key) -> Answer) -> Answer {
        let known = self.0.borrow().iter().find(|(of, ..)| *of == key).map(|(_, answer, took)| (*answer, *took));
        if let Some((answer, took)) = known {
            effort::spend(took);
            return answer;
        }
        let (answer, took) = effort::counted(|| work_out(&key));
        if effort::is_spent() {
            return answer;
        }
        let mut kept = self.0.borrow_mut();
        kept.truncate(KEPT - 1);
        kept.push_front((key, answer, took));
        answer
    }
}
