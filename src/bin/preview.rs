//! `preview`: a PNG picture of any frame.

use clap::Parser;
use cyanometer::cli;
use cyanometer::error::Result;
use cyanometer::formats::picture::{thumbnail, write_png, write_sheet};
use cyanometer::formats::register::announce;
use cyanometer::requests::picture::{PictureOptions, ShownFrames};
use cyanometer::requests::{self, values};
use std::path::PathBuf;
use std::process::ExitCode;

#[global_allocator]
static MEMORY: cli::Memory = cli::Memory;

/// Write a frame as a PNG picture to look at
///
/// Electrons and ADU are shown plane by plane, R as red and so on, from what no light reads to the most that the stage
/// holds; XYZ in its colors. With --plane and --false-color one quantity is shown with a scale. Several frames make a sheet of
/// small pictures, each with what it holds. For measurements use the frame itself: a picture has 8 bits.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(flatten)]
    frames: ShownFrames,
    /// PNG file to write; `-` for standard output
    #[arg(short, long, value_name = "FILE.png", value_parser = values::png_file())]
    output: PathBuf,
    #[command(flatten)]
    picture: PictureOptions,
    #[command(flatten)]
    general: cli::General,
}

fn main() -> ExitCode {
    let general = |arguments: &Arguments| arguments.general.clone().in_pipeline(arguments.frames.first.frame.is_pipe());
    cli::start(env!("CARGO_BIN_NAME"), general, run)
}

fn run(arguments: &Arguments, session: &cli::Session) -> Result<()> {
    announce(&[Some(&arguments.output)])?;
    let settings = arguments.picture.settings();
    let mut tiles = Vec::new();
    for input in arguments.frames.each()? {
        let mut reader = arguments.picture.open(&input)?;
        session.report_reader(&reader);
        match arguments.frames.columns() {
            None if settings.caption.is_none() => write_png(&mut reader, &settings, &arguments.output)?,
            _ => {
                reader.keep_mask();
                tiles.push(thumbnail(&mut reader, &settings)?);
            }
        }
        session.tell(&requests::of_marks(&reader));
    }
    if tiles.is_empty() {
        Ok(())
    } else {
        write_sheet(tiles, arguments.frames.columns().unwrap_or(1), &arguments.output)
    }
}
