//! Pictures for people: 8-bit PNG of any frame, one quantity in false color with its scale, several frames on one sheet.

mod planes;
mod reduce;
mod shade;

use super::atomic::Target;
use super::foreign::png_complaint;
use super::register;
use crate::analysis::statistics::{MarkedRows, Region, Saturated};
use crate::color::ramp::ramp;
use crate::error::{Error, Result};
use crate::metadata::FrameHeader;
use crate::numerics::moments::Moments;
use crate::plot::{Pixels, Scale, ScaleBar, Tile, lacking, sheet};
use crate::stream::RowSource;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use planes::Choice;
use reduce::{Reduced, Reduction, Tally};
pub use shade::Range;
use shade::Shade;
use std::io::Write;
use std::path::Path;

/// A picture may have this many pixels: it is held in memory.
const MAX_PIXELS: usize = 64 << 20;

/// The color of what is no number, in false color: none of the ramp is like it.
const MISSING: [u8; 3] = [0xcc, 0x79, 0xa7];

/// What of a frame to show, and how.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PictureSettings {
    /// The part of the frame; all of it where there is none.
    pub region: Option<Region>,
    /// Every pixel becomes a square of so many; 0 is as 1.
    pub zoom: usize,
    /// The picture is at most so many pixels wide and high; each is then the mean of a square of samples.
    pub fit: Option<usize>,
    /// The channel, layer or class that is shown alone.
    pub plane: Option<String>,
    /// Whether a plane is shown in false color, with a scale.
    pub false_color: bool,
    /// What is black and what is white; the full range of the stage where there is none, in false color all that is shown, or all but
    /// a few pixels far off.
    pub range: Option<Range>,
    /// Whether what is seen is said below the picture: in these words, or, where they are empty, by what the frame holds.
    pub caption: Option<String>,
    /// What reports call the single channel of a frame that was taken from others.
    pub channel: Option<String>,
}

/// Reads a frame and writes it as a PNG.
///
/// Electrons and ADU are shown plane by plane, R as red and so on, with the sRGB curve; XYZ in its colors under the
/// white that its metadata name; sRGB as it is. Of a map, of color differences or color temperatures, the first is shown in false color
/// where no plane is named. In false color numbers run along [`ramp`], and a bar says which is which.
///
/// # Errors
///
/// [`Error::Usage`] for a region outside the frame, a plane that is not there, a picture too large, or an output that is a terminal
/// or a file that is read; [`Error::Format`] for quantities that are no picture; those of the reader; [`Error::Disk`].
pub fn write_png(source: &mut dyn RowSource, settings: &PictureSettings, path: &Path) -> Result<()> {
    let shown = Shown::of(source, settings)?;
    match shown.bar {
        None => encode(&shown.bytes, shown.size, shown.samples_per_pixel, path),
        Some(_) => {
            let caption = shown.scale.iter().cloned().collect();
            write_sheet(vec![shown.tile(String::new(), caption)], 1, path)
        }
    }
}

/// Writes the picture of a single frame, with its caption where one is wanted.
///
/// # Errors
///
/// As of [`write_png`] and [`write_sheet`].
pub fn write_picture(source: &mut dyn RowSource, settings: &PictureSettings, path: &Path) -> Result<()> {
    if settings.caption.is_none() {
        return write_png(source, settings, path);
    }
    write_sheet(vec![thumbnail(source, settings)?], 1, path)
}

/// Writes pictures with their bars and captions in a grid of so many columns.
///
/// # Errors
///
/// [`Error::Usage`] where the sheet is too large, or the output a terminal or a file that is read; [`Error::Disk`].
pub fn write_sheet(tiles: Vec<Tile>, columns: usize, path: &Path) -> Result<()> {
    let pixels: usize = tiles.iter().map(|tile| tile.picture.rgb.len() / 3).fold(0, usize::saturating_add);
    if pixels > MAX_PIXELS {
        return Err(Error::Usage(format!("a sheet of {pixels} pixels is too large; make its pictures smaller"))
            .change(&["fit"]));
    }
    let Pixels { size, rgb } = sheet(&tiles, columns)?;
    drop(tiles);
    encode(&rgb, size, 3, path)
}

/// Reads a frame for a sheet, or for a caption of its own: a picture, small on a sheet, with the name of the frame, what it holds, and mean and standard deviation of its
/// samples, plane by plane or class by class. Pixels that were made of saturated samples, or are marked otherwise, are shown but
/// not counted, as in [`measure`](crate::analysis::statistics::measure).
///
/// A frame that makes no picture as it is shows its luminance, its lightness, the middle plane of its spectra or its first plane in false
/// color; on a sheet one whose numbers are all the same, or that has none, a flat cell that says so.
///
/// # Errors
///
/// As of [`write_png`].
pub fn thumbnail(source: &mut dyn RowSource, settings: &PictureSettings) -> Result<Tile> {
    // Where a plane is named it may be the layer itself.
    let named = source.header().clone();
    let mut source = MarkedRows::of(source, Saturated::LeftOut);
    let frame = if settings.plane.is_some() { named } else { source.unmarked() };
    let mut settings = settings.clone();
    let is_alone = settings.caption.is_some();
    if settings.zoom <= 1 && !is_alone {
        settings.fit = settings.fit.or(Some(THUMBNAIL));
    }
    let is_map = settings.plane.is_none() && Choice::is_of_map(&frame);
    // On a sheet each shows what it can.
    let is_one = settings.false_color && (is_alone || frame.geometry.channels.len() == 1);
    let is_told = !is_map && (settings.plane.is_some() || is_one || is_alone);
    let choice = if is_told || !is_map && !settings.false_color && shade::is_picture(&frame, settings.range) {
        Choice::of(&frame, settings.plane.as_deref(), settings.false_color)?
    } else {
        settings.false_color = true;
        Choice::leading(&frame)
    };
    let choice = Choice { called: settings.channel.clone(), ..choice };
    let reduction = reduction(&frame, &settings, &choice)?;
    let region = settings.region.unwrap_or(Region::whole(&frame));
    let mut tally = Tally::new(&frame, &source, region, &choice);
    let reduced = Reduced::read(&mut source, &reduction, &choice, Some(&mut tally))?;
    let shown = match Shown::paint(&frame, &settings, &choice, &reduced) {
        Err(error) if !is_alone => Shown::flat(&settings, &reduced).ok_or(error)?,
        painted => painted?,
    };
    let scale = scale(&settings, reduction.in_words(choice.filter), &shown);
    if let Some(words) = settings.caption.filter(|words| !words.is_empty()) {
        doubt_of_caption(&words);
        return Ok(shown.tile(String::new(), words.lines().map(str::to_owned).chain(scale).collect()));
    }
    let mut caption = vec![planes::stage(&frame, &choice, [region.width, region.height])];
    caption.extend(tally.groups.iter().map(|(name, moments)| seen(name, moments)));
    if tally.full > 0 {
        let all: u64 = tally.groups.iter().map(|(_, moments)| moments.count).sum();
        caption.push(format!("saturated: {} of {all} samples", tally.full));
    }
    let reasons = tally.left_out.into_iter().zip(["saturated or marked", "not finite"]).filter(|(count, _)| *count > 0);
    let reasons: Vec<String> = reasons.map(|(count, reason)| format!("{count} {reason}")).collect();
    if !reasons.is_empty() {
        caption.push(format!("left out: {}", reasons.join(", ")));
    }
    caption.extend(scale);
    Ok(shown.tile(frame.name, caption))
}

/// Warns of a caption that is not written as it was given.
fn doubt_of_caption(words: &str) {
    let lacking = lacking(words);
    if !lacking.is_empty() {
        let shown: Vec<String> = lacking.iter().map(char::to_string).collect();
        let problem = "the font of pictures lacks them, and a question mark stands there";
        register::doubt(format!(
            "the caption has characters such as {}: {problem}",
            shown[..shown.len().min(8)].join(" ")
        ));
    }
}

/// What black, white and a pixel of the picture are.
fn scale(settings: &PictureSettings, pixel: Option<String>, shown: &Shown) -> Option<String> {
    let zoomed = (settings.zoom > 1).then(|| match &pixel {
        Some(_) => format!("shown as {0} × {0}", settings.zoom),
        None => format!("each sample {0} × {0} pixels", settings.zoom),
    });
    let parts: Vec<String> = shown.scale.iter().cloned().chain(pixel).chain(zoomed).collect();
    (!parts.is_empty()).then(|| parts.join("; "))
}

/// The side of a small picture.
const THUMBNAIL: usize = 320;

/// What is said of the samples of a plane.
fn seen(name: &str, moments: &Moments) -> String {
    match moments.std(0) {
        Some(std) => {
            format!("{name}: mean {}, std {}", planes::mean_beside(moments.mean[0], std), planes::rounded(std))
        }
        None if moments.count == 1 => format!("{name}: {}", planes::rounded(moments.mean[0])),
        None => format!("{name}: no number"),
    }
}

/// A picture in memory.
struct Shown {
    size: [usize; 2],
    /// 1 of gray, 3 of R, G and B.
    samples_per_pixel: usize,
    bytes: Vec<u8>,
    bar: Option<ScaleBar>,
    /// What is black and what is white, or what lies beyond the ends of the bar.
    scale: Option<String>,
}

impl Shown {
    fn of(source: &mut dyn RowSource, settings: &PictureSettings) -> Result<Self> {
        let frame = source.header().clone();
        let is_map = settings.plane.is_none() && Choice::is_of_map(&frame);
        let settings = PictureSettings { false_color: settings.false_color || is_map, ..settings.clone() };
        let choice = match is_map {
            true => Choice::leading(&frame),
            false => Choice::of(&frame, settings.plane.as_deref(), settings.false_color)?,
        };
        let choice = Choice { called: settings.channel.clone(), ..choice };
        let reduction = reduction(&frame, &settings, &choice)?;
        let reduced = Reduced::read(source, &reduction, &choice, None)?;
        if !reduced.has_numbers() {
            return Err(shade::nothing(&frame));
        }
        Self::paint(&frame, &settings, &choice, &reduced)
    }

    fn paint(frame: &FrameHeader, settings: &PictureSettings, choice: &Choice, reduced: &Reduced) -> Result<Self> {
        let zoom = settings.zoom.max(1);
        let size = reduced.size.map(|side| side * zoom);
        if settings.false_color {
            let is_temperature = choice.is_temperature(frame);
            let range = settings.range.unwrap_or_else(|| shade::usual_range(reduced, is_temperature));
            let (low, high) = shade::one_range(frame, range, choice, reduced)?;
            let missing = reduced.samples.iter().any(|sample| !sample.is_finite());
            let missing = missing.then(|| (MISSING, "not finite".to_owned()));
            let scale = if is_temperature && low > 0.0 { Scale::Reciprocal } else { Scale::Linear };
            let only = shade::only_value(reduced).filter(|value| (low..=high).contains(value));
            let only = only.map(|value| (value, planes::level(value)));
            let bar = ScaleBar { label: choice.label(frame), range: (low, high), scale, colors: ramp(), missing, only };
            let bytes = zoomed(&reduced.in_false_color(&bar, MISSING), reduced.size, 3, zoom);
            let scale = shade::beyond(reduced, (low, high), range);
            let seen = [((low, high), reduced.quantiles(0, [0.0, 1.0]))];
            shade::all_outside(frame, seen.into_iter()).into_iter().for_each(register::doubt);
            return Ok(Self { size, samples_per_pixel: 3, bytes, bar: Some(bar), scale });
        }
        let shade = Shade::new(frame, settings.range.unwrap_or(Range::Full), choice, reduced)?;
        shade.doubt(frame, reduced).into_iter().for_each(register::doubt);
        let planes = reduced.planes;
        Ok(Self {
            size,
            samples_per_pixel: planes,
            bytes: zoomed(&shade.bytes(reduced), reduced.size, planes, zoom),
            bar: None,
            scale: shade.words(frame, choice),
        })
    }

    /// A flat cell for what no range is of: no finite numbers, or all of one value. None of others, and where the range is given in values.
    fn flat(settings: &PictureSettings, reduced: &Reduced) -> Option<Self> {
        /// Neither black nor white.
        const GRAY: [u8; 3] = [0x80; 3];
        let (rgb, words) = match shade::only_value(reduced) {
            _ if matches!(settings.range, Some(Range::Values(..))) && reduced.has_numbers() => return None,
            Some(value) => (GRAY, format!("all samples are {}", planes::level(value))),
            None if reduced.has_numbers() => return None,
            None => (MISSING, "no sample is finite".to_owned()),
        };
        let size = reduced.size.map(|side| side * settings.zoom.max(1));
        let bytes = vec![rgb; size[0] * size[1]].into_flattened();
        Some(Self { size, samples_per_pixel: 3, bytes, bar: None, scale: Some(words) })
    }

    fn tile(self, name: String, caption: Vec<String>) -> Tile {
        let rgb = match self.samples_per_pixel {
            1 => self.bytes.iter().flat_map(|gray| [*gray; 3]).collect(),
            _ => self.bytes,
        };
        Tile { picture: Pixels { size: self.size, rgb }, bar: self.bar, name, caption }
    }
}

/// Which samples make a pixel, and how large the picture becomes.
fn reduction(frame: &FrameHeader, settings: &PictureSettings, choice: &Choice) -> Result<Reduction> {
    let region = settings.region.unwrap_or(Region::whole(frame));
    region.check(frame)?;
    let reduction = Reduction::new(frame, region, settings.fit, choice);
    let size = reduction.size().map(|side| side.saturating_mul(settings.zoom.max(1)));
    if size[0].checked_mul(size[1]).is_none_or(|pixels| pixels > MAX_PIXELS) {
        return Err(Error::Usage(format!(
            "{}: a picture of {}x{} is too large; show a part of it with --region, or all of it smaller with --fit",
            frame.name, size[0], size[1]
        )));
    }
    Ok(reduction)
}

/// The bytes of a picture each of whose pixels becomes a square of `zoom` by `zoom`.
fn zoomed(bytes: &[u8], [columns, _]: [usize; 2], planes: usize, zoom: usize) -> Vec<u8> {
    if zoom == 1 {
        return bytes.to_vec();
    }
    let mut made = Vec::with_capacity(bytes.len() * zoom * zoom);
    for row in bytes.chunks_exact(columns * planes) {
        let start = made.len();
        for pixel in row.chunks_exact(planes) {
            for _ in 0..zoom {
                made.extend_from_slice(pixel);
            }
        }
        for _ in 1..zoom {
            made.extend_from_within(start..start + columns * zoom * planes);
        }
    }
    made
}

/// Writes the bytes of a picture as a PNG.
fn encode(bytes: &[u8], size: [usize; 2], planes: usize, path: &Path) -> Result<()> {
    let mut file = Target::open(Some(path), false)?;
    let name = file.name().to_owned();
    let color = if planes == 1 { ExtendedColorType::L8 } else { ExtendedColorType::Rgb8 };
    let [width, height] = size.map(|length| u32::try_from(length).unwrap_or(u32::MAX));
    PngEncoder::new_with_quality(&mut file, CompressionType::Default, FilterType::Adaptive)
        .write_image(bytes, width, height, color)
        .map_err(|error| png_complaint(&name, error))?;
    file.flush().map_err(|e| Error::disk(&name, "write", e))?;
    file.commit()
}
