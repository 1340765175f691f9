//! Samples whose level cannot be: their mean lies below what no light reads, or, once something came off them or they were
//! demosaicked, one of them beyond what codes can become. Another program has scaled or shifted them, or their metadata are wrong.

use crate::camera::levels::{BlackLevel, BlackLevels, OF_ONE_SCALE, RowBlack};
use crate::cfa::CfaPattern;
use crate::error::{Error, Result};
use crate::formats::register;
use crate::metadata::FrameHeader;
use crate::numerics::vectors::{self, Kernel};
use crate::stages::bounds::{Bounds, taken_off};
use crate::text::in_decimals;
use crate::units::QuantityKind;

/// So much of a black level, and of what came off, frames of cameras may be darker: black levels are told to a few per cent.
const UNTOLD: f64 = 0.25;

/// Standard deviations of one sample, over the root of the rows or columns there are, that a mean may be off by where noise is not
/// known: all of it might be that of whole rows.
const Z: f64 = 8.0;

/// What the level of a frame may be.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LevelCheck {
    /// The pattern whose photosites were measured; none where all were.
    measured: Option<CfaPattern>,
    planes: usize,
    least: Least,
    /// The least and the largest sample.
    samples: [f64; 2],
    /// Whether metadata of ours tell it, so that what is beyond is refused; else it is a doubt.
    refuses: bool,
    has_doubted: bool,
    row: usize,
    tally: Tally,
}

/// The least mean.
#[derive(Debug, Clone, PartialEq)]
enum Least {
    /// By the converter and the noise of its sensor, ADU.
    Known(f64),
    /// By a black level alone, and the most that came off before.
    Black(BlackLevels, f64),
    /// Nothing tells it.
    Unknown,
}

/// Samples above black, added up.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Tally {
    count: f64,
    sum: f64,
    black: f64,
    squares: f64,
}

impl LevelCheck {
    /// What the metadata of a frame say of it, and of its black level a user; none where they say nothing.
    pub fn of(frame: &FrameHeader, said: Option<BlackLevel>) -> Option<Self> {
        let metadata = &frame.metadata;
        let planes = if frame.leads_with_three_planes() { 3 } else { 1 };
        let measured = metadata.demosaic.as_ref().map(|record| record.cfa);
        let are_codes = matches!(metadata.quantity, QuantityKind::Adu | QuantityKind::Unspecified);
        // Of one plane of three nothing tells which it is.
        if !are_codes || measured.is_some() && planes == 1 {
            return None;
        }
        let bounds = Bounds::of(frame);
        let off = taken_off(metadata);
        let said = said.map(|level| BlackLevels::of_sites(level, frame.geometry.origin));
        let knows_noise =
            metadata.adc.is_some() && metadata.sensor.as_ref().is_some_and(|sensor| sensor.readout.is_some());
        let black = || said.or_else(|| frame.black_levels().ok().flatten()).zip(off);
        let least = match bounds.and_then(|bounds| bounds.mean) {
            Some(mean) => Least::Known(mean),
            None if knows_noise => Least::Unknown,
            None => black().map_or(Least::Unknown, |(black, [_, most])| Least::Black(black, most)),
        };
        let is_made = metadata.correction.is_some() || measured.is_some() || metadata.average.is_some();
        let white = metadata.white_level_adu.filter(|_| is_made).map(|white| white.largest()).zip(off);
        let by_white = white.map(|(white, [least, most])| [f64::NEG_INFINITY, OF_ONE_SCALE * (white + most) - least]);
        let samples = bounds.map(|bounds| bounds.samples).filter(|_| is_made).or(by_white);
        let samples = samples.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
        let tells = least != Least::Unknown || samples[1] < f64::INFINITY;
        tells.then(|| Self {
            measured,
            planes,
            refuses: !metadata.history.is_empty() && bounds.is_some(),
            least,
            samples,
            has_doubted: false,
            row: 0,
            tally: Tally::default(),
        })
    }

    /// Looks at rows of the frame, in the channels that are planes.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] for a sample that cannot be, where metadata of ours tell it.
    pub fn look(&mut self, rows: &[f32], frame: &FrameHeader) -> Result<()> {
        let width = frame.geometry.width;
        for row in rows.chunks_exact(frame.geometry.row_samples().max(1)) {
            for (plane, line) in row.chunks_exact(width).take(self.planes).enumerate() {
                let is_measured = self.measured.map_or([true; 2], |pattern| {
                    pattern.row_classes(frame.geometry.origin, self.row).map(|class| class as usize == plane)
                });
                if is_measured != [false; 2] {
                    self.add(line, is_measured, &frame.name)?;
                }
            }
            self.row += 1;
        }
        Ok(())
    }

    /// Adds the even and odd columns of a line of which one, the other, or both were measured.
    fn add(&mut self, line: &[f32], is_measured: [bool; 2], name: &str) -> Result<()> {
        let sums = Sums::of(line);
        let black = match &self.least {
            Least::Black(black, _) => black.row(self.row),
            _ => RowBlack::Uniform(0.0),
        };
        for parity in [0, 1].into_iter().filter(|parity| is_measured[*parity]) {
            let Sums { count, sum, squares, range } = sums;
            let [low, high] = range.map(|ends| f64::from(ends[parity]));
            if low < self.samples[0] || high > self.samples[1] {
                let wrong = if high > self.samples[1] { high } else { low };
                tell(&mut self.has_doubted, self.refuses, name, &sample_beyond(wrong, self.samples))?;
            }
            let (count, sum) = (count[parity], sum[parity]);
            let level = match black {
                RowBlack::Uniform(level) => level,
                RowBlack::Varying(..) => {
                    let columns = (parity..line.len()).step_by(2);
                    columns.clone().map(|x| black.at(x)).sum::<f64>() / columns.count().max(1) as f64
                }
            };
            self.tally.count += count;
            self.tally.sum += sum;
            self.tally.black += count * level;
            self.tally.squares += squares[parity] - 2.0 * level * sum + count * level * level;
        }
        Ok(())
    }

    /// Judges the mean, once all rows were looked at.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] for one that cannot be, where metadata of ours tell it.
    pub fn end(&mut self, frame: &FrameHeader) -> Result<()> {
        let Tally { count, sum, black, squares } = self.tally;
        if count == 0.0 {
            return Ok(());
        }
        let mean = sum / count;
        let problem = match &self.least {
            Least::Known(least) if mean < *least => format!(
                "its samples average {} ADU, and by the bias and the noise of its metadata no frame averages below {}",
                in_decimals(mean, 1),
                in_decimals(*least, 1)
            ),
            Least::Black(_, off) => {
                let (level, above) = (black / count, mean - black / count);
                let lines = frame.geometry.width.min(frame.geometry.height).max(1) as f64;
                let scatter = (squares / count - above * above).max(0.0).sqrt();
                let allowed = UNTOLD * (level.abs() + off.abs()) + Z * scatter / lines.sqrt() + 1.0;
                if above >= -allowed {
                    return Ok(());
                }
                let [mean, level] = [mean, level].map(|adu| in_decimals(adu, 1));
                format!("its samples average {mean} ADU, far below what no light reads, {level} ADU")
            }
            _ => return Ok(()),
        };
        tell(&mut self.has_doubted, self.refuses, &frame.name, &problem)
    }
}

/// What is wrong with a sample.
fn sample_beyond(wrong: f64, [low, high]: [f64; 2]) -> String {
    let [from, to] = [low, high].map(|adu| in_decimals(adu, 1));
    let range = match low.is_finite() {
        true => format!("codes less what came off are {from} to {to} ADU"),
        // No converter tells where codes end then.
        false => format!("{OF_ONE_SCALE} times its white level, less what came off, are {to} ADU"),
    };
    format!("it has a sample of {wrong}, and {range}")
}

/// Refuses a frame, or doubts it once.
fn tell(has_doubted: &mut bool, refuses: bool, name: &str, problem: &str) -> Result<()> {
    if refuses {
        return Err(Error::format(
            name,
            format!(
                "{problem}: another program has scaled or shifted its samples, or the metadata are those of another frame; give \
                 metadata that are right, --metadata FILE"
            ),
        ));
    }
    if !std::mem::replace(has_doubted, true) {
        register::doubt(format!("{name}: {problem}; one of the two is on another scale, or black came off already"));
    }
    Ok(())
}

/// Finite samples of the even and the odd columns of a line.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Sums {
    count: [f64; 2],
    sum: [f64; 2],
    squares: [f64; 2],
    /// The least and the largest, each of even and odd columns.
    range: [[f32; 2]; 2],
}

impl Sums {
    fn of(line: &[f32]) -> Self {
        let found = vectors::run(Adding(line));
        if found.sum.iter().all(|sum| sum.is_finite()) { found } else { Self::of_finite(line) }
    }

    /// The same one by one, of those that are numbers.
    fn of_finite(line: &[f32]) -> Self {
        let (none, all) = ([0.0; 2], [[f32::INFINITY; 2], [f32::NEG_INFINITY; 2]]);
        let mut found = Self { count: none, sum: none, squares: none, range: all };
        for (x, sample) in line.iter().enumerate().filter(|(_, sample)| sample.is_finite()) {
            let (parity, exact) = (x % 2, f64::from(*sample));
            found.count[parity] += 1.0;
            found.sum[parity] += exact;
            found.squares[parity] += exact * exact;
            found.range[0][parity] = found.range[0][parity].min(*sample);
            found.range[1][parity] = found.range[1][parity].max(*sample);
        }
        found
    }
}

/// Adds up a line, so many samples at a time.
struct Adding<'a>(&'a [f32]);

/// An even number of samples.
const LANES: usize = 16;

impl Kernel for Adding<'_> {
    type Output = Sums;

    #[inline(always)]
    fn run(self) -> Sums {
        let (runs, rest) = self.0.as_chunks::<LANES>();
        let [mut sum, mut squares] = [[0.0_f64; LANES]; 2];
        let (mut low, mut high) = ([f32::INFINITY; LANES], [f32::NEG_INFINITY; LANES]);
        for run in runs {
            for lane in 0..LANES {
                let (sample, exact) = (run[lane], f64::from(run[lane]));
                sum[lane] += exact;
                squares[lane] += exact * exact;
                low[lane] = if sample < low[lane] { sample } else { low[lane] };
                high[lane] = if sample > high[lane] { sample } else { high[lane] };
            }
        }
        for (lane, sample) in rest.iter().enumerate() {
            sum[lane] += f64::from(*sample);
            squares[lane] += f64::from(*sample) * f64::from(*sample);
            low[lane] = if *sample < low[lane] { *sample } else { low[lane] };
            high[lane] = if *sample > high[lane] { *sample } else { high[lane] };
        }
        let total = |lanes: &[f64; LANES]| {
            let of = |parity: usize| lanes.iter().skip(parity).step_by(2).sum::<f64>();
            [of(0), of(1)]
        };
        let least = [0, 1].map(|parity| low.iter().skip(parity).step_by(2).fold(f32::INFINITY, |a, b| a.min(*b)));
        let most = [0, 1].map(|parity| high.iter().skip(parity).step_by(2).fold(f32::NEG_INFINITY, |a, b| a.max(*b)));
        let length = self.0.len();
        let count = [length.div_ceil(2) as f64, (length / 2) as f64];
        Sums { count, sum: total(&sum), squares: total(&squares), range: [least, most] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Geometry;
    use crate::metadata::Metadata;

    #[test]
    fn even_and_odd_columns_are_added_up_apart() {
        let mut line: Vec<f32> = (0..37_u16).map(f32::from).collect();
        let sums = Sums::of(&line);
        assert_eq!((sums.count, sums.sum), ([19.0, 18.0], [342.0, 324.0]));
        assert_eq!(sums.range, [[0.0, 1.0], [36.0, 35.0]]);
        assert_eq!(sums, Sums::of_finite(&line));
        line[4] = f32::NAN;
        line[5] = f32::INFINITY;
        let sums = Sums::of(&line);
        assert_eq!((sums.count, sums.sum), ([18.0, 17.0], [338.0, 319.0]));
        assert_eq!(sums.range[1], [36.0, 35.0]);
    }

    /// Frames of cameras, of whose noise nothing is known: what is told of black is off by a few per cent, and noise is as it may be.
    #[test]
    fn frames_of_unknown_noise_are_doubted_far_below_black_alone() {
        let above = |samples: &[f32], black: f64| {
            let mut metadata = Metadata::new(QuantityKind::Adu);
            metadata.black_level_adu = Some(black.into());
            let frame = FrameHeader { name: "a".into(), geometry: Geometry::new(4, 4, &["Y"]), metadata };
            let mut check = LevelCheck::of(&frame, None).unwrap();
            check.look(samples, &frame).unwrap();
            check.end(&frame).unwrap();
            !check.has_doubted
        };
        assert!(above(&[500.0; 16], 512.0) && above(&[512.0; 16], 512.0) && above(&[9000.0; 16], 512.0));
        assert!(!above(&[256.0; 16], 512.0) && !above(&[0.0; 16], 512.0));
        let loud: Vec<f32> = (0..16_u16).map(|i| if i % 2 == 0 { 0.0 } else { 900.0 }).collect();
        assert!(above(&loud, 512.0));
    }
}
