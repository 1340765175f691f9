//! Pages of Markdown with figures, and programs that write them into a directory.

use cyanometer::error::{Error, Result};
use cyanometer::formats::plots::write_plot;
use cyanometer::plot::Plot;
use std::path::Path;
use std::process::ExitCode;

/// Runs a program that takes a directory to write to, and says what went wrong.
pub fn write_into_directory(program: &str, run: impl FnOnce(&Path) -> Result<()>) -> ExitCode {
    let Some(directory) = std::env::args_os().nth(1) else {
        eprintln!("{program}: name the directory to write to");
        return ExitCode::from(2);
    };
    finish(program, make_directory(Path::new(&directory)).and_then(|()| run(Path::new(&directory))))
}

/// What a program ends with; what went wrong is said.
pub fn finish(program: &str, done: Result<()>) -> ExitCode {
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{program}: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Makes a directory and those above it.
///
/// # Errors
///
/// [`Error::Disk`].
pub fn make_directory(directory: &Path) -> Result<()> {
    std::fs::create_dir_all(directory).map_err(|e| Error::disk(&directory.display().to_string(), "make", e))
}

/// Writes a plot as SVG and as PNG.
///
/// # Errors
///
/// Those of [`write_plot`].
pub fn write_figure(directory: &Path, name: &str, plot: &Plot) -> Result<()> {
    ["svg", "png"].iter().try_for_each(|end| write_plot(&directory.join(format!("{name}.{end}")), plot))
}

/// A table of Markdown.
pub struct Table {
    /// The Markdown.
    pub text: String,
}

impl Table {
    /// A table under these heads.
    pub fn new(heads: &[&str]) -> Self {
        let rule: String = heads.iter().map(|_| "---|").collect();
        Self { text: format!("| {} |\n|{rule}\n", heads.join(" | ")) }
    }

    /// Adds a row.
    pub fn row(&mut self, cells: &[String]) {
        self.text.push_str(&format!("| {} |\n", cells.join(" | ")));
    }
}

/// A number with a true minus sign.
pub fn number(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let is_zero = text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.');
    if is_zero { text.trim_start_matches('-').to_owned() } else { text.replace('-', "−") }
}
