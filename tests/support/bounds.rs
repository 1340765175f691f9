//! Programs under bounds of time and memory.

use super::workshop::{BAD_DATA, BAD_USAGE, Workshop, path_of};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::thread;
use std::time::{Duration, Instant};

/// No program may take longer, whatever it is given.
pub const LONGEST: Duration = Duration::from_secs(10);
/// Address space that a program takes whatever it reads: its code, stacks of a few threads, and blocks of up to 64 MiB, which
/// small files may declare.
pub const OWN_MEMORY: u64 = 160 << 20;
/// For each byte of its input a program may take so many more.
pub const MEMORY_PER_BYTE: u64 = 64;
/// No program may take more before an image is known to be real.
pub const MOST_MEMORY: u64 = 1 << 30;

/// What a program may take that reads so many bytes.
pub fn memory_for(bytes: u64) -> u64 {
    (OWN_MEMORY + MEMORY_PER_BYTE * bytes).min(MOST_MEMORY)
}

/// A command line and what it is given.
pub struct Bounded<'a> {
    pub shop: &'a Workshop,
    pub line: &'a str,
    /// What comes down a pipe; nothing where none.
    pub piped: Option<&'a Path>,
    /// Bytes of address space.
    pub memory: u64,
}

impl Bounded<'_> {
    /// Runs to the end, or says why not: a panic, a signal, too long, too much memory, no single line, an output in spite of
    /// an error.
    pub fn run(&self) -> Result<Output, String> {
        let output = self.output()?;
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        let program = self.line.split(' ').next().unwrap();
        let failed = |what: &str| Err(format!("{}: {what}: {} {said}", self.line, output.status));
        let status = output.status.code();
        if ![Some(0), Some(BAD_DATA), Some(BAD_USAGE)].contains(&status) {
            return failed("ended badly");
        }
        if !said.lines().all(|line| line.starts_with(&format!("{program}: "))) {
            return failed("speaks with another voice");
        }
        if said.contains("memory") && said.contains("the system gives") {
            return failed("wants too much memory");
        }
        let complaints = said.lines().filter(|line| !line.starts_with(&format!("{program}: warning: "))).count();
        match status {
            Some(0) if complaints > 0 => failed("complains and succeeds"),
            Some(0) => Ok(output),
            _ if complaints != 1 => failed("does not complain in one line"),
            _ if self.made().is_some_and(|made| made.exists()) => failed("leaves an output"),
            _ => Ok(output),
        }
    }

    /// The file that is named as the output.
    fn made(&self) -> Option<PathBuf> {
        let mut words = self.line.split(' ').skip_while(|word| *word != "-o").skip(1);
        words.next().filter(|name| *name != "-").map(|name| self.shop.path(name))
    }

    fn output(&self) -> Result<Output, String> {
        let mut command = self.command();
        let input = self.piped.map(|path| File::open(path).unwrap());
        command.stdin(if input.is_some() { Stdio::piped() } else { Stdio::null() });
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let mut taken = [None, None];
        let (stdin, stdout, stderr) = (child.stdin.take(), child.stdout.take(), child.stderr.take());
        let start = Instant::now();
        let status = thread::scope(|scope| {
            if let (Some(mut stdin), Some(mut input)) = (stdin, input) {
                // A program that refuses its input does not read it all.
                scope.spawn(move || drop(std::io::copy(&mut input, &mut stdin)));
            }
            let read = |mut stream: Box<dyn Read + Send>| {
                scope.spawn(move || {
                    let mut bytes = Vec::new();
                    stream.read_to_end(&mut bytes).unwrap();
                    bytes
                })
            };
            let readers = [read(Box::new(stdout.unwrap())), read(Box::new(stderr.unwrap()))];
            let status = loop {
                match child.try_wait().unwrap() {
                    Some(status) => break Some(status),
                    None if start.elapsed() > LONGEST => {
                        child.kill().unwrap();
                        child.wait().unwrap();
                        break None;
                    }
                    None => thread::sleep(Duration::from_millis(2)),
                }
            };
            taken = readers.map(|reader| reader.join().ok());
            status
        });
        let status = status.ok_or_else(|| format!("{}: takes more than {LONGEST:?}", self.line))?;
        let [stdout, stderr] = taken.map(Option::unwrap_or_default);
        Ok(Output { status, stdout, stderr })
    }

    /// The command behind a shell that limits its memory. Threads share one pool of memory, or each reserves its own.
    fn command(&self) -> Command {
        let mut words = self.line.split(' ');
        let mut command = self.shop.command("sh -c");
        command.arg(format!("ulimit -v {}; exec \"$0\" \"$@\"", self.memory >> 10));
        command.arg(path_of(words.next().unwrap())).args(words).env("MALLOC_ARENA_MAX", "1");
        command
    }
}
