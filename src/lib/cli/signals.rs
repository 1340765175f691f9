//! Signals that end a program: it tidies up, and then dies of them as programs do, so that shells and loops around it end too.
//!
//! The signals are blocked in all threads but one, which waits for them; so nothing is interrupted at an odd moment.

use crate::formats::atomic::remove_pending;
use nix::sys::signal::{SigSet, Signal, raise};
use std::thread;

/// Signals that end a program, which may tidy up first.
const ENDING: [Signal; 5] = [Signal::SIGHUP, Signal::SIGINT, Signal::SIGQUIT, Signal::SIGTERM, Signal::SIGXCPU];

/// What shells add to the number of a signal that has ended a program.
const BY_SIGNAL: i32 = 128;

/// Makes the signals that end a program remove what is half-written first. Signals that the program was started to ignore,
/// as by `nohup`, stay ignored. A file that grows too long is an error of writing, and no longer a signal.
///
/// Called before any thread is started. Where it does not succeed, signals end the program all the same.
pub(super) fn tidy_up_first() {
    let ignored = ignored();
    let awaited: SigSet = ENDING.into_iter().filter(|signal| !ignored.contains(*signal)).collect();
    let mut blocked = awaited;
    blocked.add(Signal::SIGXFSZ);
    if blocked.thread_block().is_err() {
        return;
    }
    if thread::Builder::new().name("signals".into()).spawn(move || end_by(&awaited)).is_err() {
        let _ = awaited.thread_unblock();
    }
}

/// Waits for one of some signals, and ends the program by it.
fn end_by(awaited: &SigSet) {
    let Ok(signal) = awaited.wait() else { return };
    remove_pending();
    // Where either fails, the last line ends the program all the same.
    let _ = SigSet::from(signal).thread_unblock().and_then(|()| raise(signal));
    // The first process of a container does not die of signals.
    std::process::exit(BY_SIGNAL + signal as i32);
}

/// The signals that are ignored, where the system tells.
fn ignored() -> SigSet {
    const RADIX: u32 = 16;
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|digits| u64::from_str_radix(digits.trim(), RADIX).ok()).unwrap_or_default();
    ENDING.into_iter().filter(|signal| mask >> (*signal as i32 - 1) & 1 == 1).collect()
}
