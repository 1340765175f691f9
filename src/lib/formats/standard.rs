//! The standard streams, and which of them were closed when the program started.
//!
//! Before `main`, Rust's runtime puts `/dev/null` in the place of a standard stream that is closed, so that no file gets its
//! number. What is written there is lost without a word; so it is looked up before the runtime does that.

use super::places::{STDIN_NAME, STDOUT_NAME};
use super::register;
use crate::error::{Error, Result};
use std::fs::File;
use std::io::{self, IsTerminal};
use std::os::fd::AsFd;
use std::sync::atomic::{AtomicBool, Ordering};

static STDIN_WAS_CLOSED: AtomicBool = AtomicBool::new(false);
static STDOUT_WAS_CLOSED: AtomicBool = AtomicBool::new(false);

#[cfg(target_os = "linux")]
extern "C" fn look() {
    let is_closed = |stream| rustix::io::fcntl_getfd(stream).is_err();
    STDIN_WAS_CLOSED.store(is_closed(rustix::stdio::stdin()), Ordering::Relaxed);
    STDOUT_WAS_CLOSED.store(is_closed(rustix::stdio::stdout()), Ordering::Relaxed);
}

/// What the system calls before Rust's runtime begins. It asks the system about two numbers and stores the answers, which
/// needs nothing that the runtime sets up.
#[cfg(target_os = "linux")]
#[used]
#[expect(unsafe_code, reason = "nothing else runs before the runtime, which hides what was closed")]
#[unsafe(link_section = ".init_array")]
static BEFORE_MAIN: extern "C" fn() = look;

/// The standard input as a file.
///
/// # Errors
///
/// [`Error::Usage`] when it is a terminal or read already, [`Error::Disk`] also where it is closed.
pub fn open_stdin() -> Result<File> {
    let failed = |e| Error::disk(STDIN_NAME, "open", e);
    if STDIN_WAS_CLOSED.load(Ordering::Relaxed) {
        return Err(failed(closed()));
    }
    let stdin = io::stdin();
    if stdin.is_terminal() {
        return Err(Error::Usage("no input: name a file, or pipe one in".into()));
    }
    register::note_stdin()?;
    let file = File::from(stdin.as_fd().try_clone_to_owned().map_err(failed)?);
    register::note_input(&file.metadata().map_err(failed)?, STDIN_NAME)?;
    Ok(file)
}

/// The standard output as a file.
///
/// # Errors
///
/// [`Error::Usage`] where it is a file that is read; [`Error::Disk`] also where it is closed.
pub fn open_stdout() -> Result<File> {
    let failed = |e| Error::disk(STDOUT_NAME, "write", e);
    if STDOUT_WAS_CLOSED.load(Ordering::Relaxed) {
        return Err(failed(closed()));
    }
    let file = File::from(io::stdout().as_fd().try_clone_to_owned().map_err(failed)?);
    register::check_output(&file.metadata().map_err(failed)?, STDOUT_NAME)?;
    Ok(file)
}

/// What the system would have said, had the runtime not put another file there.
fn closed() -> io::Error {
    io::Error::other("it is closed")
}
