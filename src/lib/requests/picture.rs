//! Frames shown as pictures.

use super::described::DescribedInput;
use super::options::Output;
use super::values;
use crate::analysis::statistics::Region;
use crate::error::{Error, Result};
use crate::formats::input::FrameReader;
use crate::formats::picture::{PictureSettings, Range};
use crate::formats::places::{STEM, is_pattern, named};
use clap::Args;
use clap::builder::RangedU64ValueParser;
use std::path::Path;

/// Frames to show, all of which are described alike.
#[derive(Debug, Clone, Args)]
#[command(mut_arg("inputs", |option| option.help(
    "Frames to read, EXR, TIFF, DNG, PNG or FITS; `-` or none for standard input. Several make a sheet, in this order, each with its name, what it holds, mean and standard deviation; or, with -o DIR/ or a name with {stem}, a picture each"
)))]
pub struct ShownFrames {
    /// The frames.
    #[command(flatten)]
    pub input: DescribedInput,
    /// Columns of the sheet; by default about as many as rows
    #[arg(long, value_name = "N", value_parser = RangedU64ValueParser::<usize>::new().range(1..=64))]
    columns: Option<usize>,
}

impl ShownFrames {
    /// Each frame by itself.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] where the standard input is one of several.
    pub fn each(&self) -> Result<Vec<DescribedInput>> {
        let paths = &self.input.frame.inputs;
        if paths.iter().any(|path| named(Some(path)).is_none()) {
            return Err(Error::Usage("the standard input cannot be one of several inputs; name a file".into()));
        }
        Ok(paths.iter().map(|path| self.input.with(self.input.frame.only(Some(path), None))).collect())
    }

    /// The columns of the sheet that goes to `output`; none where each frame has a picture of its own.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for columns of no sheet, and for a caption of one, which has its own.
    pub fn columns(&self, output: &Path, has_caption: bool) -> Result<Option<usize>> {
        let count = self.input.frame.inputs.len();
        if count < 2 || is_pattern(output) {
            return match self.columns {
                Some(_) => {
                    Err(Error::Usage("columns are those of a sheet of several frames".into()).leave_out(&["columns"]))
                }
                None => Ok(None),
            };
        }
        // A caption that is taken for an input, behind a blank.
        let inputs = self.input.frame.inputs.iter().filter(|input| has_caption && named(Some(input)).is_some());
        if let Some((missing, error)) = inputs.filter_map(|input| Some((input, input.metadata().err()?))).next() {
            return Err(Error::disk(&missing.display().to_string(), "open", error));
        }
        if has_caption {
            let problem = "the frames of a sheet have captions, which say what each is";
            return Err(Error::Usage(problem.into()).leave_out(&["caption"]));
        }
        Ok(self.columns.or_else(|| (1..).find(|columns| columns * columns >= count)))
    }
}

/// What of a frame to show, and how.
#[derive(Debug, Clone, Args)]
pub struct PictureOptions {
    /// Rectangle X,Y,W,H in pixels to show; by default the whole frame
    #[arg(long, value_name = "X,Y,W,H", value_parser = values::region)]
    region: Option<Region>,
    /// Show one plane alone: a channel or a layer by the name that `measure` gives it, such as Y of XYZ, or sigma.Y for its standard deviation, or a class
    /// of a CFA plane, R, G or B, by the means of its photosites in each period of the array
    #[arg(long, value_name = "NAME", conflicts_with = "channel")]
    plane: Option<String>,
    /// Show one plane in colors from dark blue to yellow, equal steps of which look equal, beside a bar with its numbers
    #[arg(long)]
    false_color: bool,
    /// Show every pixel as a square of N x N
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = RangedU64ValueParser::<usize>::new().range(1..=64))]
    zoom: usize,
    /// Make the picture at most N pixels wide and high, a scale bar or caption beside it: each is the mean of a square of samples, in linear light, of whole
    /// periods of a filter array
    #[arg(long, value_name = "N", conflicts_with = "zoom", value_parser = RangedU64ValueParser::<usize>::new().range(16..=8192))]
    fit: Option<usize>,
    /// What is black and what is white, or the ends of the false colors: full, LOW,HIGH in the unit of the samples, LOW%,HIGH%
    /// of the pixels, all planes together, of XYZ of its luminances, or so many standard deviations about the mean of each plane,
    /// as in 4sigma; by default full, in false color 0%,100%, or 0.5%,99.5% where a few pixels would stretch that to more than twice its length
    #[arg(long, value_name = "full|LOW,HIGH|LOW%,HIGH%|Nsigma", value_parser = range, allow_hyphen_values = true)]
    range: Option<Range>,
    /// Say below the picture what is seen: in these words, or by the frame's name, what it holds, mean and standard deviation;
    /// and what is black and what is white
    #[arg(long, value_name = "TEXT", num_args = 0..=1, require_equals = true, default_missing_value = "")]
    caption: Option<String>,
}

fn range(text: &str) -> std::result::Result<Range, String> {
    let wrong = || {
        "give full, LOW,HIGH, shares of the pixels such as 1%,99%, or a number of standard deviations such as 4sigma"
            .to_owned()
    };
    let text = &text.to_ascii_lowercase();
    if text == "full" {
        return Ok(Range::Full);
    }
    if let Some(count) = text.strip_suffix("sigma") {
        return values::positive(count).map(Range::Deviations).map_err(|_| wrong());
    }
    let (low, high) = text.split_once(',').ok_or_else(wrong)?;
    let number = |text: &str| values::number(text).map_err(|_| wrong());
    match (low.strip_suffix('%'), high.strip_suffix('%')) {
        (Some(low), Some(high)) => {
            let shares = [number(low)?, number(high)?].map(|per_cent| per_cent / 100.0);
            let is_right = 0.0 <= shares[0] && shares[0] < shares[1] && shares[1] <= 1.0;
            let order = || "the lower share stands first, and both lie within 0% and 100%, as in 1%,99%".to_owned();
            is_right.then_some(Range::Shares(shares[0], shares[1])).ok_or_else(order)
        }
        (None, None) => Ok(Range::Values(number(low)?, number(high)?)),
        _ => Err("one end is a share of the pixels, the other a value; give both alike, as in 1%,99%".to_owned()),
    }
}

/// Where the pictures of single frames go, by a name or a pattern.
pub fn each_to(output: &Path) -> Output {
    let in_directory = output.as_os_str().as_encoded_bytes().ends_with(b"/");
    let pattern = if in_directory { output.join(format!("{STEM}.png")) } else { output.to_owned() };
    Output { output: Some(pattern), ..Output::default() }
}

impl PictureOptions {
    /// Opens a frame with the channels that are to be shown.
    ///
    /// # Errors
    ///
    /// Those of [`DescribedInput::open`].
    pub fn open(&self, input: &DescribedInput) -> Result<FrameReader> {
        if self.plane.is_some() { input.open_all() } else { input.open() }
    }

    /// What is to be shown, of any frame.
    pub fn settings(&self) -> PictureSettings {
        let Self { region, plane, false_color, zoom, fit, range, caption } = self.clone();
        PictureSettings { region, zoom, fit, plane, false_color, range, caption, channel: None }
    }

    /// What is to be shown of a frame that is open.
    pub fn settings_of(&self, reader: &FrameReader) -> PictureSettings {
        PictureSettings { channel: reader.taken_channel().map(str::to_owned), ..self.settings() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_read_and_nothing_else() {
        for (text, wanted) in [
            ("full", Range::Full),
            ("-3,4e2", Range::Values(-3.0, 400.0)),
            ("1%,99.5%", Range::Shares(0.01, 0.995)),
            ("0%,100%", Range::Shares(0.0, 1.0)),
            ("2.5sigma", Range::Deviations(2.5)),
        ] {
            assert_eq!(range(text), Ok(wanted), "{text}");
        }
        for text in ["", "1", "1%,9", "9%,1%", "-1%,5%", "5%,101%", "nan,1", "0sigma", "5%,5%"] {
            assert!(range(text).is_err(), "{text}");
        }
    }
}
