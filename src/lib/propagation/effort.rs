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
}
