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
    let _ = rustix::pipe::fcntl_setpipe_size(file, PIPE_BYTES);
    #[cfg(not(target_os = "linux"))]
    let _ = file;
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
