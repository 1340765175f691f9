//! How much work predictions may take: evaluations are counted, so that the same is refused on any machine.

use std::cell::Cell;

thread_local! { static LEFT: Cell<u64> = const { Cell::new(u64::MAX) }; }

/// Counts so many evaluations.
pub(super) fn spend(evaluations: u64) {
    LEFT.with(|left| left.set(left.get().saturating_sub(evaluations)));
}

/// Whether more is not allowed: what is found from then on is of no use, and shall be found soon.
pub(super) fn is_spent() -> bool {
    left() == 0
}

/// What is left of the evaluations.
pub(super) fn left() -> u64 {
    LEFT.with(Cell::get)
}

/// What `work` finds, and the evaluations that it took.
pub(super) fn counted<T>(work: impl FnOnce() -> T) -> (T, u64) {
    let before = left();
    let found = work();
    (found, before - left())
}

/// What `work` finds within so many evaluations; none where it takes more.
pub(super) fn within<T>(evaluations: u64, work: impl FnOnce() -> T) -> Option<T> {
    let before = left();
    let allowed = evaluations.min(before);
    LEFT.with(|left| left.set(allowed));
    let (found, used) = counted(work);
    LEFT.with(|left| left.set(before - used));
    (used < allowed).then_some(found)
}

/// The numbers below `count`, any first of them spread over all: bits in reverse order.
pub(super) fn scattered(count: usize) -> impl Iterator<Item = usize> {
    let all = count.next_power_of_two();
    let spare = usize::BITS - all.trailing_zeros();
    (0..all).map(move |index| index.reverse_bits().checked_shr(spare).unwrap_or(0)).filter(move |index| *index < count)
}

/// How much work equal parts will take, as the first of them tell.
pub(super) struct Foreseen {
    parts: u64,
    begun: u64,
    /// What was left before the first.
    allowed: u64,
}

impl Foreseen {
    /// Parts from which on all can be foreseen.
    const TELLING: u64 = 16;

    /// Of so many parts.
    pub fn of(parts: usize) -> Self {
        Self { parts: parts as u64, begun: 0, allowed: left() }
    }

    /// Before each part: where those before tell that all take twice what is allowed, nothing is left for any.
    pub fn begin_next(&mut self) {
        if self.begun == 0 {
            self.allowed = left();
        }
        let used = self.allowed - left();
        if self.begun >= Self::TELLING && used.saturating_mul(self.parts) / self.begun > self.allowed.saturating_mul(2)
        {
            spend(left());
        }
        self.begun += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_ends_where_it_takes_more_than_is_allowed() {
        assert_eq!(within(10, || spend(9)), Some(()));
        assert_eq!(within(10, || spend(10)), None);
        // What is within counts for what it is part of.
        assert_eq!(within(10, || (within(8, || spend(6)), within(8, || spend(6)), is_spent())), None);
        assert!(!is_spent());
    }
    #[test]
    fn what_takes_too_much_is_foreseen() {
        let parts_done = |of_part: u64| {
            let mut done = 0;
            within(1000, || {
                let mut foreseen = Foreseen::of(100);
                while done < 100 {
                    foreseen.begin_next();
                    if is_spent() {
                        break;
                    }
                    spend(of_part);
                    done += 1;
                }
            });
            done
        };
        assert_eq!([5, 9, 15, 21, 300].map(parts_done), [100, 100, 67, 16, 4]);
    }

    #[test]
    fn scattered_numbers_are_all_and_spread_out() {
        assert_eq!(scattered(8).collect::<Vec<_>>(), [0, 4, 2, 6, 1, 5, 3, 7]);
        for count in [0, 1, 2, 5, 8, 100] {
            let mut found: Vec<usize> = scattered(count).collect();
            found.sort_unstable();
            assert_eq!(found, (0..count).collect::<Vec<_>>());
        }
    }
}
