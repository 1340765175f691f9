//! Deviates that a report shows beside what the tests of them find.

use super::check::{Subject, Test};

/// Channels by their names, and the deviates that are shown of them.
pub(super) type Shown<'a> = Vec<(String, &'a mut Option<f64>)>;

/// Leaves out deviates of channels that were tested, but by no law of that deviate: where hardly a sample should leave its code, or a bound alone is
/// known, a deviate of 50 may well be chance.
pub(super) fn forget_deviates(tests: &[Test], subject: Subject, [channels, classes]: [Shown<'_>; 2]) {
    let is_lawless = |name: &String| {
        let own = || tests.iter().filter(|test| test.channels == [name.as_str()]);
        own().next().is_some() && !own().any(|test| test.subject == subject && test.z.is_some())
    };
    // A plane of several classes, which is not tested itself, is as they are.
    let is_any = classes.iter().any(|(name, _)| is_lawless(name));
    for (name, z) in channels {
        if is_any || is_lawless(&name) {
            *z = None;
        }
    }
    for (name, z) in classes {
        if is_lawless(&name) {
            *z = None;
        }
    }
}
