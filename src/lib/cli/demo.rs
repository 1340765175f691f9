//! A demonstration: the chain on skies that the program carries, each command shown before it runs.

use super::programs;
use super::show;
use crate::error::{Error, Result};
use crate::formats::atomic::AtomicFile;
use std::fs;
use std::io::{self, Write};
use std::path::Path;
use std::process::{Child, Stdio};

/// Files of `sample_data/skies` that the commands read.
const FILES: [(&str, &[u8]); 2] = [
    ("sky912.exr", include_bytes!("../../../sample_data/skies/sky912.exr")),
    ("clear_zenith.csv", include_bytes!("../../../sample_data/skies/clear_zenith.csv")),
];

/// What is done, in words, and the commands that do it.
const STEPS: [(&str, &[&str]); 4] = [
    ("A matrix from sensor RGB to XYZ, fitted to 912 computed skies", &["fit-matrix sky912.exr -o matrix.yaml"]),
    (
        "The skies as a chart, each a patch of 24x24 photosites: a file after each program",
        &[
            "render-radiance sky912.exr --patch 24x24 --expose-to 0.75 -o 1-expected.exr",
            "add-noise --seed 7 1-expected.exr -o 2-electrons.exr",
            "digitize 2-electrons.exr -o 3-codes.tiff",
            "mosaic 3-codes.tiff -o 4-mosaic.tiff",
            "demosaic --method eci 4-mosaic.tiff -o 5-rgb.exr",
            "to-xyz --matrix matrix.yaml 5-rgb.exr -o 6-xyz.exr",
        ],
    ),
    (
        "Pictures of it",
        &[
            "preview --caption 4-mosaic.tiff -o 4-mosaic.png",
            "to-xyz --matrix matrix.yaml --space srgb --white-luminance 30000 --quiet 5-rgb.exr -o 7-view.tiff",
            "preview --caption 7-view.tiff -o 7-view.png",
        ],
    ),
    (
        "One uniform sky through pipes: what is measured beside what the formulas predict",
        &[
            "render-radiance clear_zenith.csv --size 320x240 --expose-to 0.75 | add-noise --seed 7 | digitize | mosaic | measure",
        ],
    ),
];

/// What to do with what is there now.
const LOOK: &str = "
7-view.png    the skies as the camera saw them; upper half: no aerosol, lower half: hazes
4-mosaic.png  what the sensor records: one class at each photosite
6-xyz.exr     absolute XYZ, Y in cd/m2
*.yaml        the sidecar of each frame: sensor, exposure, noise, history, digest
";

/// Runs the demonstration in a directory, which is made, or is empty.
///
/// # Errors
///
/// [`Error::Usage`] for a directory with files in it; [`Error::Disk`]; [`Error::Data`] where a command fails.
pub fn run(directory: &Path) -> Result<()> {
    let shown = directory.display().to_string();
    fs::create_dir_all(directory).map_err(|e| Error::disk(&shown, "make", e))?;
    let mut entries = fs::read_dir(directory).map_err(|e| Error::disk(&shown, "read", e))?;
    if entries.next().is_some() {
        return Err(Error::Usage(format!("{shown}: there are files in it; name a directory that is empty or new")));
    }
    for (name, bytes) in FILES {
        let mut file = AtomicFile::create(&directory.join(name))?;
        file.write_all(bytes).map_err(|e| Error::disk(name, "write", e))?;
        file.commit()?;
    }
    say(&format!("In {shown}:\n"))?;
    for (title, lines) in STEPS {
        say(&format!("\n# {title}\n"))?;
        for line in lines {
            say(&format!("$ {line}\n"))?;
            pipeline(line, directory)?;
        }
    }
    say(LOOK)
}

fn say(text: &str) -> Result<()> {
    show(|| io::stdout().write_all(text.as_bytes()))
}

/// A program that does not start: one that is there lacks what its input comes from.
fn not_run(program: &Path, error: io::Error) -> Error {
    match error.kind() {
        io::ErrorKind::NotFound if program.is_file() => Error::disk("/dev/null", "open", error),
        _ => Error::disk(&program.to_string_lossy(), "run", error),
    }
}

/// Runs the programs of a line at the same time, each reading what the one before it writes.
fn pipeline(line: &str, directory: &Path) -> Result<()> {
    let commands: Vec<&str> = line.split(" | ").collect();
    let mut running: Vec<Child> = Vec::new();
    for (index, command) in commands.iter().enumerate() {
        let before = running.last_mut().and_then(|child| child.stdout.take());
        let is_last = index + 1 == commands.len();
        let mut words = command.split(' ');
        let mut command = programs::command(words.next().unwrap_or_default())?;
        command.args(words).current_dir(directory).stdin(before.map_or_else(Stdio::null, Stdio::from));
        command.stdout(if is_last { Stdio::inherit() } else { Stdio::piped() });
        let program = Path::new(command.get_program()).to_owned();
        running.push(command.spawn().map_err(|e| not_run(&program, e))?);
    }
    let mut failed = None;
    for (command, mut child) in commands.into_iter().zip(running) {
        let status = child.wait().map_err(|e| Error::disk(command, "run", e))?;
        failed = failed.or((!status.success()).then_some(command));
    }
    failed.map_or(Ok(()), |command| Err(Error::Data(format!("`{command}` has failed"))))
}
