//! `preview`: a PNG picture of any frame.

use clap::Parser;
use cyanometer::cli::{self, Turn};
use cyanometer::error::Result;
use cyanometer::formats::picture::{thumbnail, write_picture, write_sheet};
use cyanometer::formats::register::announce;
use cyanometer::requests::picture::{PictureOptions, ShownFrames, each_to};
use cyanometer::requests::{self, values};
use cyanometer::stream::RowSource;
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
    /// PNG file to write; `-` for standard output. Of each of several frames DIR/, or a name with {stem}, {frame} or {index}
    #[arg(short, long, value_name = "FILE.png", value_parser = values::png_file())]
    output: PathBuf,
    #[command(flatten)]
    picture: PictureOptions,
    #[command(flatten)]
    general: cli::General,
}

fn main() -> ExitCode {
    let general = |arguments: &Arguments| arguments.general.clone().in_pipeline(arguments.frames.input.frame.is_pipe());
    cli::start(env!("CARGO_BIN_NAME"), general, run)
}

fn run(arguments: &Arguments, session: &cli::Session) -> Result<()> {
    let Arguments { frames, output, picture, .. } = arguments;
    let settings = picture.settings();
    let Some(columns) = frames.columns(output, settings.caption.is_some())? else {
        let output = each_to(output);
        return session.each_frame::<Arguments>(
            &frames.input.frame,
            &output,
            |Turn { session, input, output, .. }| {
                let mut reader = picture.open(&frames.input.with((*input).clone()))?;
                session.report_reader(&reader);
                settings.caption.is_some().then(|| reader.keep_mask());
                let place = session.place(reader.header(), output)?.path.unwrap_or_default();
                write_picture(&mut reader, &settings, &place)?;
                session.tell(&requests::of_marks(&reader));
                Ok(())
            },
        );
    };
    announce(&[Some(output)])?;
    let mut tiles = Vec::new();
    for input in frames.each()? {
        let mut reader = picture.open(&input)?;
        session.report_reader(&reader);
        reader.keep_mask();
        tiles.push(thumbnail(&mut reader, &settings)?);
        session.tell(&requests::of_marks(&reader));
    }
    write_sheet(tiles, columns, output)
}
