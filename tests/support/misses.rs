//! How often intervals miss the numbers that they are to hold, and how many trials are made.

/// How many trials a law gets: a fourth of all, or all where CYANOMETER_CAMERAS asks for more of everything that is drawn at random.
pub fn trials(all: u64) -> u64 {
    if std::env::var_os("CYANOMETER_CAMERAS").is_some() { all } else { all / 4 }
}

/// The probability that an interval holds its number.
pub const CONFIDENCE: f64 = 0.95;

/// So many of n intervals may miss by chance: 4 standard deviations beyond 5 %.
pub fn allowed_misses(n: usize) -> f64 {
    let n = n as f64;
    n * (1.0 - CONFIDENCE) + 4.0 * (n * CONFIDENCE * (1.0 - CONFIDENCE)).sqrt()
}

/// Makes sure that intervals miss no more often than that, of whose numbers one each is held, missed, or not known; gives how many are
/// known.
pub fn check_misses(name: &str, held: impl IntoIterator<Item = Option<bool>>) -> usize {
    let known: Vec<bool> = held.into_iter().flatten().collect();
    let missed = known.iter().filter(|held| !**held).count();
    eprintln!("{name}: {missed} of {} missed", known.len());
    assert!(missed as f64 <= allowed_misses(known.len()), "{name}: {missed} of {} intervals missed", known.len());
    known.len()
}
