//! The child: limits itself, reads, decodes, answers.

use super::decode::decode;
use super::wire::{Answer, MOST_ANSWER_BYTES};
use nix::sys::resource::{Resource, getrlimit, setrlimit};
use std::ffi::OsString;
use std::io::{self, Read, Write};
use std::process::ExitCode;

/// Bytes of rows that are written together.
const WRITTEN_BYTES: usize = 1 << 16;
/// What `rawler` says before most reasons.
const DECODE_FAILED: &str = "Failed to decode image, possibly corrupt image: ";
/// Characters of a reason.
const MOST_REASON: usize = 300;

/// What a child is told on its command line: bytes of memory, seconds of processor time, threads, its parent.
struct Task {
    memory_bytes: u64,
    processor_s: u64,
    threads: usize,
    parent: i32,
}

impl Task {
    fn of(words: impl Iterator<Item = OsString>) -> Option<Self> {
        let words: Vec<String> = words.map(|word| word.into_string().unwrap_or_default()).collect();
        let [memory, time, threads, parent] = words.as_slice() else { return None };
        Some(Self {
            memory_bytes: memory.parse().ok()?,
            processor_s: time.parse().ok()?,
            threads: threads.parse().ok()?,
            parent: parent.parse().ok()?,
        })
    }

    /// Takes on the limits, before anything of the file is read: memory, time, no core dump, no byte in any file, and the end of
    /// the parent.
    fn limit(&self) -> nix::Result<()> {
        lower(Resource::RLIMIT_AS, self.memory_bytes)?;
        lower(Resource::RLIMIT_CPU, self.processor_s)?;
        lower(Resource::RLIMIT_CORE, 0)?;
        lower(Resource::RLIMIT_FSIZE, 0)?;
        #[cfg(target_os = "linux")]
        nix::sys::prctl::set_pdeathsig(nix::sys::signal::Signal::SIGKILL)?;
        // It may have ended before that.
        if nix::unistd::getppid().as_raw() == self.parent { Ok(()) } else { Err(nix::errno::Errno::ESRCH) }
    }
}

/// Sets a limit, unless a lower one holds. The system's second limit is one more, so that the signal of the first tells which it
/// was.
fn lower(resource: Resource, limit: u64) -> nix::Result<()> {
    let (soft, hard) = getrlimit(resource)?;
    setrlimit(resource, soft.min(limit), hard.min(limit.saturating_add(1)))
}

/// Does what a child is there for. What goes wrong is answered, or seen in how it ends.
pub(super) fn work(words: impl Iterator<Item = OsString>) -> ExitCode {
    std::panic::set_hook(Box::new(|panic| {
        let payload = panic.payload();
        let words = payload.downcast_ref::<&str>().copied().or(payload.downcast_ref::<String>().map(String::as_str));
        // Whoever waits for an answer has it, or sees that there is none.
        drop(answer(&Answer::GaveUp(reason(words.unwrap_or_default()))));
        std::process::exit(PANICKED);
    }));
    let Some(task) = Task::of(words) else { return ExitCode::from(MISUSED) };
    if task.limit().is_err() {
        return ExitCode::from(MISUSED);
    }
    // Where no thread is started, this one works.
    let _ = rayon::ThreadPoolBuilder::new().num_threads(task.threads).use_current_thread().build_global();
    match answered() {
        Ok(()) => ExitCode::SUCCESS,
        Err(_) => ExitCode::from(MISUSED),
    }
}

/// Exit status after a panic, as Rust's programs have it.
const PANICKED: i32 = 101;
/// Exit status of a child that could not read or answer.
const MISUSED: u8 = 2;

/// Reads the file, and writes what becomes of it.
fn answered() -> io::Result<()> {
    let mut bytes = Vec::new();
    io::stdin().lock().read_to_end(&mut bytes)?;
    let (head, samples) = match decode(bytes) {
        Ok(decoded) => decoded,
        Err(why) => return answer(&Answer::Refused(reason(&why))),
    };
    answer(&Answer::Image(Box::new(head)))?;
    let mut out = io::stdout().lock();
    let mut words = Vec::with_capacity(WRITTEN_BYTES);
    for part in samples.chunks(WRITTEN_BYTES / size_of::<u16>()) {
        words.clear();
        words.extend(part.iter().flat_map(|sample| sample.to_le_bytes()));
        out.write_all(&words)?;
    }
    out.flush()
}

fn answer(answer: &Answer) -> io::Result<()> {
    let text = serde_json::to_vec(answer)?;
    let length = u32::try_from(text.len()).unwrap_or(u32::MAX);
    if length > MOST_ANSWER_BYTES {
        return Err(io::ErrorKind::InvalidData.into());
    }
    let mut out = io::stdout().lock();
    out.write_all(&length.to_le_bytes())?;
    out.write_all(&text)?;
    out.flush()
}

/// The first line of what a decoder says, without a full stop, in bounds.
fn reason(words: &str) -> String {
    let line = words.lines().next().unwrap_or_default();
    let line = line.trim().trim_start_matches("Error: ").trim_start_matches(DECODE_FAILED).trim_end_matches('.');
    line.chars().take(MOST_REASON).collect()
}
