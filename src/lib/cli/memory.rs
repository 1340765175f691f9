//! What a program does where the system gives no more memory: it says so in a line and ends, as at any other error.
//!
//! Rust's own answer is to abort, with a core dump where these are kept, and nothing tidied up.

use crate::formats::atomic::remove_pending_now;
use std::alloc::{GlobalAlloc, Layout, System};
use std::io::{Cursor, Write};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Exit status for data that cannot be worked on.
const REFUSED: i32 = 1;

/// What the program is called.
static PROGRAM: OnceLock<&'static str> = OnceLock::new();

/// Whether a thread is saying so already.
static TOLD: AtomicBool = AtomicBool::new(false);

/// The system's allocator; where it gives nothing, the program ends. Each program names it as its global allocator; the
/// library leaves whoever uses it theirs.
#[derive(Debug)]
pub struct Memory;

// SAFETY: every call is handed to the system's allocator as it came, which keeps the trait's promises, and so is what it
// gives; where that is nothing, the call does not return.
#[expect(unsafe_code, reason = "an allocator can be written in no other way")]
unsafe impl GlobalAlloc for Memory {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as above.
        given(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(memory, layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as above.
        given(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: as above.
        given(unsafe { System.realloc(memory, layout, size) }, size)
    }
}

/// Tells the allocator the name that complaints begin with.
pub(super) fn complain_as(program: &'static str) {
    // A second name cannot come.
    let _ = PROGRAM.set(program);
}

#[inline]
fn given(memory: *mut u8, bytes: usize) -> *mut u8 {
    if memory.is_null() {
        refused(bytes);
    }
    memory
}

/// Ends the program, without asking for memory itself.
#[cold]
fn refused(bytes: usize) -> ! {
    if TOLD.swap(true, Ordering::SeqCst) {
        // Another thread is about to end the program.
        loop {
            std::thread::sleep(Duration::from_secs(1));
        }
    }
    let mut line = [0; 160];
    let mut writer = Cursor::new(&mut line[..]);
    let program = PROGRAM.get().copied().unwrap_or("cyanometer");
    let size = if bytes >> 20 > 0 { (bytes >> 20, "MiB") } else { (bytes, "bytes") };
    // A name that is too long for the line is cut off.
    drop(writeln!(writer, "{program}: the system gives no more memory; {} {} more are needed", size.0, size.1));
    let length = usize::try_from(writer.position()).unwrap_or_default();
    // Where the standard error is closed there is nobody to tell.
    drop(std::io::stderr().write_all(&line[..length]));
    remove_pending_now();
    end()
}

/// Ends the program at once: what is done at an ordinary end may ask for memory.
#[expect(unsafe_code, reason = "the standard library ends a program in no other way that asks for nothing")]
fn end() -> ! {
    // SAFETY: it takes a number and does not come back.
    unsafe { nix::libc::_exit(REFUSED) }
}
