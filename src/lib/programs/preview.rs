//! `preview`: a PNG picture of any frame.

use crate::cli::{self, Turn};
use crate::error::Result;
use crate::formats::picture::{thumbnail, write_picture, write_sheet};
use crate::formats::register::announce;
use crate::requests::batch::check_known;
use crate::requests::picture::{PictureOptions, ShownFrames, each_to};
use crate::requests::{self, values};
use crate::stream::RowSource;
use clap::Parser;
use std::path::PathBuf;
use std::process::ExitCode;

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

/// Runs it with the arguments of the process.
pub fn main() -> ExitCode {
    let general = |arguments: &Arguments| arguments.general.clone().in_pipeline(arguments.frames.input.frame.is_pipe());
    cli::start("preview", general, run)
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
                let settings = picture.settings_of(&reader);
                write_picture(&mut reader, &settings, &place)?;
                session.tell(&requests::of_marks(&reader));
                Ok(())
            },
        );
    };
    check_known(Some(output))?;
    announce(&[Some(output)])?;
    let mut tiles = Vec::new();
    for input in frames.each()? {
        let mut reader = picture.open(&input)?;
        session.report_reader(&reader);
        reader.keep_mask();
        let settings = picture.settings_of(&reader);
        tiles.push(thumbnail(&mut reader, &settings)?);
        session.tell(&requests::of_marks(&reader));
    }
    write_sheet(tiles, columns, output)
}
