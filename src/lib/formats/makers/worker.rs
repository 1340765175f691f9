//! The child as its parent sees it: started, listened to, waited for, and ended whatever happens.

use super::wire::{Answer, Head, MOST_ANSWER_BYTES};
use super::{INSTEAD, SERVE, complete};
use crate::error::{Error, Result};
use crate::formats::own_program::own_program;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::sys::resource::{Resource, getrlimit};
use nix::sys::signal::Signal;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::os::fd::AsFd;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// Memory of a child besides what its file takes: code, tables, stacks.
const OWN_BYTES: u64 = 256 << 20;
/// For each byte of its file a child may take so many more, for a few copies of samples that are stored in a fraction of one.
const BYTES_PER_BYTE: u64 = 64;
/// No child may take more.
const MOST_BYTES: u64 = 16 << 30;
/// Processor time of a child besides what its file takes, s.
const OWN_SECONDS: u64 = 6;
/// Bytes of a file that a child may take another second for.
const BYTES_PER_SECOND: u64 = 1 << 20;
/// A busy machine may take longer: how long a child may keep silent, s, and how much longer for each of those seconds.
const OWN_SILENCE: u64 = 9;
const SILENCE_PER_SECOND: u64 = 2;
/// Exit status of a child that the system gave no more memory.
const NO_MEMORY: i32 = 1;
/// How long a child that has closed its output may take to end.
const FAREWELL: Duration = Duration::from_secs(2);

/// What decodes the makers' raw files: this program itself, started once more. Only a program whose `main` begins with
/// [`super::serve`] may have one.
#[derive(Debug, Clone, Copy)]
pub struct Worker(());

impl Worker {
    /// The program that is running.
    pub fn this_program() -> Self {
        Self(())
    }

    /// Starts a child on a file, of which messages have the name and what it is, and waits for its answer.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] for what is not decoded, [`Error::Disk`] where no child is started.
    pub(super) fn start(self, mut file: File, name: &str, kind: &str) -> Result<(Head, Running)> {
        if !cfg!(feature = "makers-raw") {
            let build = "build `import-raw` with the feature `makers-raw`";
            return Err(Error::format(
                name,
                format!("it is {kind}, and this build reads DNG alone; {build}, or {INSTEAD}"),
            ));
        }
        let failed = |e| Error::disk(name, "read", e);
        let bytes = file.seek(SeekFrom::End(0)).map_err(failed)?;
        complete::check(&file, name)?;
        file.rewind().map_err(failed)?;
        let limits = Limits::of_file(bytes);
        let command = Self::command(limits).map_err(|e| Error::disk(name, "start a process that decodes it", e))?;
        let mut running = Running::start(command, file, name, limits)?;
        let head = running.head(kind)?;
        Ok((head, running))
    }

    /// The command that starts this program as a child. What the environment says does not reach it.
    fn command(limits: Limits) -> io::Result<Command> {
        // The file of the program may have been replaced since it was started.
        let kept = Path::new("/proc/self/exe");
        let is_kept = cfg!(target_os = "linux") && kept.exists();
        let program = if is_kept { kept.to_owned() } else { own_program()? };
        let mut command = Command::new(program);
        let threads = rayon::current_num_threads();
        let numbers = [limits.memory_bytes, limits.processor_s, threads as u64, std::process::id().into()];
        command.arg(SERVE).args(numbers.map(|number| number.to_string())).env_clear().current_dir("/");
        command.arg0(env!("CARGO_PKG_NAME"));
        Ok(command)
    }
}

/// What a child may take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Limits {
    /// Address space.
    memory_bytes: u64,
    /// Seconds of all its threads.
    processor_s: u64,
    /// How long it may keep silent.
    silence: Duration,
}

impl Limits {
    /// Those for a file of so many bytes.
    fn of_file(bytes: u64) -> Self {
        let longer = bytes / BYTES_PER_SECOND;
        let wanted = bytes.saturating_mul(BYTES_PER_BYTE).saturating_add(OWN_BYTES).min(MOST_BYTES);
        // What limits this process limits a child of it.
        let own = getrlimit(Resource::RLIMIT_AS).map_or(MOST_BYTES, |(soft, _)| soft);
        Self {
            memory_bytes: wanted.min(own),
            processor_s: OWN_SECONDS + longer,
            silence: Duration::from_secs(OWN_SILENCE + SILENCE_PER_SECOND * longer),
        }
    }
}

/// A child that is at work, or has just ended. One that is dropped is killed and waited for.
#[derive(Debug)]
pub(super) struct Running {
    child: Child,
    output: ChildStdout,
    name: String,
    limits: Limits,
}

/// Why nothing more comes.
enum Silence {
    /// The output is closed.
    Closed,
    /// Nothing came for too long.
    TooLong,
    /// Reading failed.
    Failed(io::Error),
}

impl Running {
    /// Starts a command on a file that stands at its start.
    fn start(mut command: Command, file: File, name: &str, limits: Limits) -> Result<Self> {
        command.stdin(Stdio::from(file)).stdout(Stdio::piped()).stderr(Stdio::null());
        let failed = |e| Error::disk(name, "start a process that decodes it", e);
        let mut child = command.spawn().map_err(failed)?;
        let output = child.stdout.take().ok_or_else(|| failed(io::ErrorKind::BrokenPipe.into()))?;
        Ok(Self { child, output, name: name.into(), limits })
    }

    /// Its answer about a file of a kind.
    fn head(&mut self, kind: &str) -> Result<Head> {
        let mut length = [0; 4];
        self.fill(&mut length)?;
        let length = u32::from_le_bytes(length);
        if length > MOST_ANSWER_BYTES {
            return Err(self.nonsense());
        }
        let mut text = vec![0; length as usize];
        self.fill(&mut text)?;
        let problem = match serde_json::from_slice(&text) {
            Ok(Answer::Image(head)) => return Ok(*head),
            Ok(Answer::Refused(why)) => format!("it is {kind} that cannot be decoded ({why}); {INSTEAD}"),
            Ok(Answer::GaveUp(words)) => {
                format!("its decoder gave up ({words}); it is damaged, or of an unknown kind: {INSTEAD}")
            }
            Err(_) => return Err(self.nonsense()),
        };
        Err(Error::format(&self.name, problem))
    }

    /// The next bytes.
    ///
    /// # Errors
    ///
    /// Where fewer come: what became of the child.
    pub fn fill(&mut self, mut bytes: &mut [u8]) -> Result<()> {
        while !bytes.is_empty() {
            match self.some(bytes) {
                Ok(count) => bytes = &mut bytes[count..],
                Err(silence) => return Err(self.end_of(silence)),
            }
        }
        Ok(())
    }

    /// Makes sure that nothing follows, and that the child ends well.
    pub fn finish(&mut self) -> Result<()> {
        match self.some(&mut [0]) {
            Ok(_) => Err(self.nonsense()),
            Err(Silence::Closed) => match self.ended() {
                Some(status) if status.success() => Ok(()),
                _ => Err(self.end_of(Silence::Closed)),
            },
            Err(silence) => Err(self.end_of(silence)),
        }
    }

    /// Some bytes, at least one, as soon as they come.
    fn some(&mut self, bytes: &mut [u8]) -> std::result::Result<usize, Silence> {
        let deadline = Instant::now() + self.limits.silence;
        loop {
            let left = deadline.saturating_duration_since(Instant::now());
            let left = PollTimeout::try_from(left).unwrap_or(PollTimeout::MAX);
            let ready = poll(&mut [PollFd::new(self.output.as_fd(), PollFlags::POLLIN)], left);
            match ready {
                Ok(0) => return Err(Silence::TooLong),
                Ok(_) => match self.output.read(bytes) {
                    Ok(0) => return Err(Silence::Closed),
                    Ok(count) => return Ok(count),
                    Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                    Err(error) => return Err(Silence::Failed(error)),
                },
                Err(nix::errno::Errno::EINTR) => {}
                Err(error) => return Err(Silence::Failed(error.into())),
            }
        }
    }

    /// How the child ended, which has closed its output; none of one that does not end.
    fn ended(&mut self) -> Option<ExitStatus> {
        let deadline = Instant::now() + FAREWELL;
        loop {
            match self.child.try_wait() {
                Ok(Some(status)) => return Some(status),
                Ok(None) if Instant::now() < deadline => std::thread::sleep(Duration::from_millis(1)),
                _ => return None,
            }
        }
    }

    /// What became of the child, in words.
    fn end_of(&mut self, silence: Silence) -> Error {
        let Limits { memory_bytes, processor_s, silence: patience } = self.limits;
        let too_long = |what: String| format!("its decoder took {what}");
        let what = match silence {
            Silence::Failed(error) => return Error::disk(&self.name, "read what its decoder says", error),
            Silence::TooLong => too_long(format!("more than {} s", patience.as_secs_f64())),
            Silence::Closed => {
                let status = self.ended();
                let signal = status.and_then(|status| status.signal()).and_then(|number| Signal::try_from(number).ok());
                match (signal, status.and_then(|status| status.code())) {
                    (Some(Signal::SIGXCPU | Signal::SIGKILL), _) => {
                        too_long(format!("more than {processor_s} s of processor time, or was killed"))
                    }
                    (_, Some(NO_MEMORY)) => too_long(format!("more than {} MiB of memory", memory_bytes >> 20)),
                    (Some(signal), _) => format!("its decoder gave up ({signal})"),
                    _ => "its decoder gave up".into(),
                }
            }
        };
        Error::format(&self.name, format!("{what}; it is damaged, or of an unknown kind: {INSTEAD}"))
    }

    fn nonsense(&self) -> Error {
        Error::format(&self.name, format!("its decoder answers what is no image; {INSTEAD}"))
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // One that has ended cannot be killed, and is waited for all the same.
        drop(self.child.kill());
        drop(self.child.wait());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    const LIMITS: Limits = Limits { memory_bytes: 64 << 20, processor_s: 1, silence: Duration::from_millis(300) };

    /// What becomes of a child that is this script of a shell, and the number that it had as a process.
    fn said(script: &str) -> (String, u32, Duration) {
        let mut command = Command::new("sh");
        command.args(["-c", script]);
        let start = Instant::now();
        let mut running = Running::start(command, tempfile::tempfile().unwrap(), "a.nef", LIMITS).unwrap();
        let process = running.child.id();
        let done = running.head("a Nikon NEF").and_then(|head| {
            running.fill(&mut vec![0; head.width * head.height * 2])?;
            running.finish()
        });
        drop(running);
        (done.map_or_else(|error| error.to_string(), |()| "done".into()), process, start.elapsed())
    }

    /// A script that prints an answer, and then does something.
    fn answer(answer: &Answer, then: &str) -> String {
        let text = serde_json::to_string(answer).unwrap();
        let length: String =
            u32::try_from(text.len()).unwrap().to_le_bytes().map(|byte| format!("\\{byte:03o}")).concat();
        format!("printf '{length}'; printf '%s' '{text}'; {then}")
    }

    fn image() -> Answer {
        Answer::Image(Box::new(super::super::describe::tests::head()))
    }

    #[test]
    fn whatever_becomes_of_a_child_is_one_line() {
        let rows = "head -c 48 /dev/zero";
        for (script, wanted) in [
            ("sleep 60".into(), "its decoder took more than 0.3 s; "),
            ("yes".into(), "its decoder answers what is no image; "),
            ("printf '\\002\\000\\000\\000no'".into(), "its decoder answers what is no image; "),
            ("exit 0".into(), "its decoder gave up; it is damaged"),
            ("exit 1".into(), "its decoder took more than 64 MiB of memory; "),
            ("exit 101".into(), "its decoder gave up; "),
            ("kill -ABRT $$".into(), "its decoder gave up (SIGABRT); "),
            ("kill -SEGV $$".into(), "its decoder gave up (SIGSEGV); "),
            ("ulimit -t 1; while :; do :; done >&2".into(), "its decoder took more than 0.3 s; "),
            ("kill -XCPU $$".into(), "its decoder took more than 1 s of processor time, or was killed; "),
            (answer(&Answer::GaveUp("index".into()), ""), "its decoder gave up (index); "),
            (answer(&Answer::Refused("no".into()), ""), "it is a Nikon NEF that cannot be decoded (no); "),
            (answer(&image(), rows), "done"),
            (answer(&image(), "head -c 47 /dev/zero"), "its decoder gave up; "),
            (answer(&image(), "head -c 49 /dev/zero"), "its decoder answers what is no image; "),
            (answer(&image(), &format!("{rows}; kill -BUS $$")), "its decoder gave up (SIGBUS); "),
            (answer(&image(), &format!("{rows}; sleep 60")), "its decoder took more than 0.3 s; "),
            (answer(&image(), &format!("{rows}; exec >&-; sleep 60")), "its decoder gave up; "),
        ] {
            let (complaint, process, took) = said(&script);
            let wanted = if wanted == "done" { wanted.to_owned() } else { format!("a.nef: {wanted}") };
            assert!(complaint.starts_with(&wanted), "{script}: {complaint}");
            assert!(complaint == "done" || complaint.ends_with("with `unprocessed_raw -T` of LibRaw"), "{complaint}");
            assert!(took < Duration::from_secs(10), "{script}: {took:?}");
            // Neither it nor what the system keeps of it is left.
            assert!(!Path::new(&format!("/proc/{process}")).exists(), "{script}");
        }
    }

    #[test]
    fn limits_go_with_the_file() {
        let [none, some] = [0, 10 << 20].map(Limits::of_file);
        assert_eq!((none.processor_s, none.silence), (6, Duration::from_secs(9)));
        assert_eq!((some.processor_s, some.silence), (16, Duration::from_secs(29)));
        assert!(some.memory_bytes >= none.memory_bytes && some.memory_bytes <= (256 + 640) << 20);
        assert!(Limits::of_file(u64::MAX).memory_bytes <= MOST_BYTES);
    }
}
