//! What was worked out last is not worked out again: stages, causes and shares of saturation ask for the same laws.

use std::cell::RefCell;
use std::collections::VecDeque;

/// The last answers of a thread, by what was asked.
pub(super) struct Memory<Key, Answer>(RefCell<VecDeque<(Key, Answer)>>);

/// As many answers as one scene asks for.
const KEPT: usize = 48;

impl<Key: PartialEq, Answer: Copy> Memory<Key, Answer> {
    pub const fn new() -> Self {
        Self(RefCell::new(VecDeque::new()))
    }

    /// The answer, worked out unless it is known.
    pub fn recall(&self, key: Key, work_out: impl FnOnce(&Key) -> Answer) -> Answer {
        let known = self.0.borrow().iter().find(|(of, _)| *of == key).map(|(_, answer)| *answer);
        known.unwrap_or_else(|| {
            let answer = work_out(&key);
            let mut kept = self.0.borrow_mut();
            kept.truncate(KEPT - 1);
            kept.push_front((key, answer));
            answer
        })
    }
}
