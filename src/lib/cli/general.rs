//! Options of how a program runs and talks.

use crate::names::Named;
use crate::requests::options::{Input, Output};
use crate::requests::values;
use clap::Args;

/// When to show a progress bar.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ProgressWhen {
    /// On terminals.
    #[default]
    Auto,
    /// Always.
    Always,
    /// Never.
    Never,
}

impl Named for ProgressWhen {
    const ALL: &'static [Self] = &[Self::Auto, Self::Always, Self::Never];

    fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Always => "always",
            Self::Never => "never",
        }
    }
}

/// How the program runs and talks.
#[derive(Debug, Clone, Default, Args)]
pub struct General {
    /// Threads to use; by default all, and one where frames come or go through a pipe. The result does not depend on it
    #[arg(long, value_name = "N", value_parser = threads)]
    pub threads: Option<usize>,
    /// Whether frames come or go through a pipe.
    #[arg(skip)]
    pub pipeline: bool,
    /// Say nothing but errors
    #[arg(short, long)]
    pub quiet: bool,
    /// Say what is read, and what is left out
    #[arg(short, long)]
    pub verbose: bool,
    /// Progress bar on standard error
    #[arg(long, value_name = "WHEN", default_value = ProgressWhen::default().name(), value_parser = values::choice::<ProgressWhen>())]
    pub progress: ProgressWhen,
    /// Print all keys of sensor files, matrix files and metadata, with units; `cyanometer template` prints files to begin with
    #[arg(long)]
    pub describe_keys: bool,
}

impl General {
    /// The same for a program that makes a frame of a frame.
    pub fn between(&self, input: &Input, output: &Output) -> Self {
        self.clone().in_pipeline(input.is_pipe() || output.is_pipe())
    }

    /// The same for a program whose frames come or go through a pipe, or do not.
    pub fn in_pipeline(self, pipeline: bool) -> Self {
        Self { pipeline, ..self }
    }
}

fn threads(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(threads @ 1..=1024) => Ok(threads),
        _ => Err("give a whole number from 1 to 1024".into()),
    }
}
