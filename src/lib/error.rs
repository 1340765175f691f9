//! One error type; its variants are named for whoever must act.

use std::fmt;
use std::io;

/// What went wrong, and whose move it is.
///
/// The text names the file first, then what is wrong, then what to do; a program puts its own name before it.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The command line asks for something that cannot be (exit status 2).
    #[error("{0}")]
    Usage(String),

    /// The disk, a directory or a pipe refuses.
    #[error("{file}: cannot {action}: {}", reason(source))]
    Disk {
        /// The file as the user named it.
        file: String,
        /// What was tried: `open`, `read`, `write` …
        action: &'static str,
        /// What the system answered.
        source: io::Error,
    },

    /// The program that wrote the file made something that cannot be read here.
    #[error("{file}: {problem}")]
    Format {
        /// The file as the user named it.
        file: String,
        /// What is wrong with it and what to do.
        problem: String,
    },

    /// The programs were run in an order that makes no sense.
    #[error("{file}: {problem}; run `{first}` first")]
    Order {
        /// The file as the user named it.
        file: String,
        /// What the file holds and what was wanted.
        problem: String,
        /// The program that should come first.
        first: &'static str,
    },

    /// The metadata lacks a key that is needed. The command line adds the option that supplies it.
    #[error("{file}: {} has no `{}`", holder_of(.key), .key.strip_prefix("sensor.").unwrap_or(.key))]
    MissingKey {
        /// The file as the user named it.
        file: String,
        /// The key that is missing.
        key: &'static str,
    },

    /// The data are too few, undetermined or out of range.
    #[error("{0}")]
    Data(String),

    /// An error that other settings would mend. The command line calls them by its options.
    #[error("{error}; {advice}")]
    Advised {
        /// What is wrong.
        error: Box<Self>,
        /// What to do about it.
        advice: Advice,
    },

    /// The program before this one in a pipe has failed, and has said why.
    #[error("the program before it in the pipe has failed")]
    Upstream,

    /// Whoever read our output has closed the pipe: no error, the program ends quietly.
    #[error("the output pipe was closed")]
    ClosedPipe,
}

/// What a user should do with settings, each called by its name in the library, such as `white_luminance`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Advice {
    /// Give one of these.
    Give(&'static [&'static str]),
    /// Leave out all of these.
    LeaveOut(&'static [&'static str]),
    /// Choose another value of one of these.
    Change(&'static [&'static str]),
}

impl Advice {
    /// The advice in words, each setting as `shown` has it.
    pub fn in_words(self, shown: impl Fn(&str) -> String) -> String {
        let (act, settings, joined) = match self {
            Self::Give(settings) => ("give", settings, "or"),
            Self::LeaveOut(settings) => ("leave out", settings, "and"),
            Self::Change(settings) => ("give another", settings, "or"),
        };
        let (last, others) = settings.split_last().unwrap_or((&"", &[]));
        let others: Vec<String> = others.iter().map(|setting| shown(setting)).collect();
        let joined = if others.is_empty() { String::new() } else { format!("{} {joined} ", others.join(", ")) };
        format!("{act} {joined}{}", shown(last))
    }
}

impl fmt::Display for Advice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.in_words(|setting| format!("`{setting}`")))
    }
}

/// A result with the project's [`Error`].
pub type Result<T> = std::result::Result<T, Error>;

/// What a key should stand in.
fn holder_of(key: &str) -> &'static str {
    if key.starts_with("sensor.") { "its sensor" } else { "the metadata" }
}

impl Error {
    /// An [`Error::Format`] about `file`.
    pub fn format(file: &str, problem: impl Into<String>) -> Self {
        Self::Format { file: file.into(), problem: problem.into() }
    }

    /// An [`Error::Disk`] about `file`, or [`Error::ClosedPipe`] where that is what happened.
    pub fn disk(file: &str, action: &'static str, source: io::Error) -> Self {
        if source.kind() == io::ErrorKind::BrokenPipe {
            return Self::ClosedPipe;
        }
        if action == "read" && source.kind() == io::ErrorKind::UnexpectedEof {
            return Self::cut_short(file);
        }
        Self::Disk { file: file.into(), action, source }
    }

    /// The same error with advice to give one of some settings.
    #[must_use]
    pub fn give(self, settings: &'static [&'static str]) -> Self {
        Self::Advised { error: Box::new(self), advice: Advice::Give(settings) }
    }

    /// The same error with advice to leave some settings out.
    #[must_use]
    pub fn leave_out(self, settings: &'static [&'static str]) -> Self {
        Self::Advised { error: Box::new(self), advice: Advice::LeaveOut(settings) }
    }

    /// The same error with advice to choose another value of one of some settings.
    #[must_use]
    pub fn change(self, settings: &'static [&'static str]) -> Self {
        Self::Advised { error: Box::new(self), advice: Advice::Change(settings) }
    }

    /// An [`Error::Format`] about `file`, which ends too soon.
    pub fn cut_short(file: &str) -> Self {
        Self::format(file, "the file ends before its last row; it was cut short")
    }

    /// What is wrong, without advice.
    pub fn bare(self) -> Self {
        match self {
            Self::Advised { error, .. } => error.bare(),
            other => other,
        }
    }

    /// The exit status that a program ends with.
    pub fn exit_status(&self) -> u8 {
        match self {
            Self::Usage(_) => 2,
            Self::Advised { error, .. } => error.exit_status(),
            Self::ClosedPipe => 0,
            _ => 1,
        }
    }
}

/// The system's reason without Rust's `(os error N)`.
fn reason(source: &io::Error) -> String {
    let text = source.to_string();
    match text.find(" (os error") {
        Some(end) => text[..end].to_lowercase(),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_reason_is_the_systems_alone() {
        let source = std::fs::File::open("there is no such file").unwrap_err();
        assert!(source.to_string().contains("(os error"), "the words that are cut off have changed: {source}");
        assert_eq!(reason(&source), "no such file or directory");
        assert_eq!(reason(&io::Error::other("Lights went out")), "Lights went out");
    }
}
