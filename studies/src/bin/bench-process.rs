//! Runs a program and tells what it took, for `scripts/bench`.
//!
//!     bench-process REPORT PROGRAM [ARGUMENT]...
//!
//! Writes one line to the file REPORT: clock seconds, user and system CPU seconds, and peak resident memory in KiB; exits
//! as the program does. Linux counts the memory of the process that starts a program into the peak of the program, so
//! the one that starts it has to be as small as this one, and not an interpreter.

use std::ffi::OsString;
use std::process::{Command, ExitCode};

#[cfg(unix)]
fn run(report: &OsString, program: &OsString, arguments: &[OsString]) -> Result<ExitCode, Box<dyn std::error::Error>> {
    use nix::sys::resource::{UsageWho, getrusage};
    let start = std::time::Instant::now();
    let status = Command::new(program).args(arguments).status()?;
    let clock_s = start.elapsed().as_secs_f64();
    let usage = getrusage(UsageWho::RUSAGE_CHILDREN)?;
    let seconds = |time: nix::sys::time::TimeVal| time.tv_sec() as f64 + 1e-6 * time.tv_usec() as f64;
    let (user_s, system_s) = (seconds(usage.user_time()), seconds(usage.system_time()));
    std::fs::write(report, format!("{clock_s:.6} {user_s:.6} {system_s:.6} {}\n", usage.max_rss()))?;
    Ok(ExitCode::from(status.code().and_then(|code| u8::try_from(code).ok()).unwrap_or(1)))
}

#[cfg(not(unix))]
fn run(_: &OsString, _: &OsString, _: &[OsString]) -> Result<ExitCode, Box<dyn std::error::Error>> {
    Err("what a process took is asked of Unix only".into())
}

fn main() -> ExitCode {
    let arguments: Vec<OsString> = std::env::args_os().skip(1).collect();
    let [report, program, arguments @ ..] = &arguments[..] else {
        eprintln!("usage: bench-process REPORT PROGRAM [ARGUMENT]...");
        return ExitCode::from(2);
    };
    run(report, program, arguments).unwrap_or_else(|error| {
        eprintln!("bench-process: {}: {error}", program.display());
        ExitCode::FAILURE
    })
}
