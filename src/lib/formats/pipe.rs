//! Pipes: which inputs and outputs are some, and how much they hold.

use super::files::named;
use std::fs::File;
use std::io;
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::fs::FileTypeExt;
use std::path::Path;

/// What a pipe is made to hold where the system allows, in bytes: some bands, so that the programs at its ends seldom wait
/// for each other. Linux makes pipes of 64 KiB, and lets anyone enlarge them to this.
#[cfg(target_os = "linux")]
const PIPE_BYTES: usize = 1 << 20;

/// Enlarges a pipe; where the file is none or the system refuses, all stays as it is.
pub fn enlarge(file: &File) {
    #[cfg(target_os = "linux")]
    if !is_marked(file) {
        let _ = rustix::pipe::fcntl_setpipe_size(file, PIPE_BYTES);
    }
    #[cfg(not(target_os = "linux"))]
    let _ = file;
}

/// What the pipe of a program that has failed holds, in pages, so that those behind it fail too and the user hears of it once: a
/// number that nobody else gives a pipe. Linux makes pipes of 16 pages, or of 2 or 1 where a user has many. Not a byte passes
/// through, whoever reads.
#[cfg(target_os = "linux")]
const PAGES_OF_FAILURE: usize = 8;

/// Tells the next program of a pipe that this one has failed, where the system knows how and what was written is read soon.
pub fn pass_failure_on() {
    /// How often it is tried while the pipe holds more than it then would, and how long it is waited between.
    #[cfg(target_os = "linux")]
    const TRIES: (usize, std::time::Duration) = (20, std::time::Duration::from_millis(2));
    #[cfg(target_os = "linux")]
    if is_output(None) {
        let mark = || rustix::pipe::fcntl_setpipe_size(io::stdout(), PAGES_OF_FAILURE * rustix::param::page_size());
        for _ in 0..TRIES.0 {
            if mark() != Err(rustix::io::Errno::BUSY) {
                return;
            }
            std::thread::sleep(TRIES.1);
        }
    }
}

/// Whether the standard input is a pipe of a program that has failed.
pub fn has_failed() -> bool {
    #[cfg(target_os = "linux")]
    return is_input(None) && is_marked(io::stdin());
    #[cfg(not(target_os = "linux"))]
    false
}

#[cfg(target_os = "linux")]
fn is_marked(pipe: impl AsFd) -> bool {
    rustix::pipe::fcntl_getpipe_size(pipe).is_ok_and(|size| size == PAGES_OF_FAILURE * rustix::param::page_size())
}

/// Whether the input at `path`, or the standard input for none or `-`, is a pipe.
pub fn is_input(path: Option<&Path>) -> bool {
    is_pipe(path, io::stdin().as_fd())
}

/// Whether the output at `path`, or the standard output for none or `-`, is a pipe.
pub fn is_output(path: Option<&Path>) -> bool {
    is_pipe(path, io::stdout().as_fd())
}

fn is_pipe(path: Option<&Path>, standard: BorrowedFd<'_>) -> bool {
    let metadata = match named(path) {
        Some(path) => std::fs::metadata(path),
        None => standard.try_clone_to_owned().and_then(|stream| File::from(stream).metadata()),
    };
    metadata.is_ok_and(|metadata| metadata.file_type().is_fifo())
}
