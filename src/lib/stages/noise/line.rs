//! The noise of one row of one plane, run by run.

use super::columns::Columns;
use super::model::NoiseModel;
use super::tables::Tables;
use crate::cfa::Class;
use crate::frame::to_sample;
use crate::metadata::{NoiseRecord, PoissonKind};
use crate::numerics::vectors::Kernel;
use crate::random::philox::{LONGEST_RUN, VECTOR};
use crate::random::poisson::Table;
use crate::random::{Run, RunWords, Source, Unlike, spans};
use crate::stream::Counts;
use std::ops::Range;

/// One row of one plane.
pub(super) struct Line<'a> {
    pub model: &'a NoiseModel,
    pub record: &'a NoiseRecord,
    pub tables: &'a Tables,
    pub columns: &'a Columns,
    /// Electrons that are added to the row, and its relative gain less 1.
    pub offset: f32,
    pub gain: f32,
    /// Read noise of each column, e⁻; empty where all have that of the model.
    pub read_noise: &'a [f32],
    /// Row of the sensor, and column of the frame's first.
    pub row: i32,
    pub first_column: i32,
    /// Classes of the frame's even and odd columns.
    pub classes: [Class; 2],
}

/// Makes the charge of one row, before it is transferred, and the read noise that it will meet where that is asked for.
pub(super) struct Charges<'a> {
    pub line: &'a Line<'a>,
    pub expected: &'a [f32],
    pub charge: &'a mut [f32],
    pub read_noise: Option<&'a mut [f32]>,
}

impl Kernel for Charges<'_> {
    type Output = Counts;

    #[inline(always)]
    fn run(self) -> Counts {
        let Self { line, expected, charge, mut read_noise } = self;
        let mut counts = Counts::default();
        let mut scratch = Scratch::default();
        for span in spans(line.first_column, expected.len()) {
            let run = line.run(&span);
            run.make_temporal(&mut scratch.words);
            line.charges(&run, &mut scratch, &span, &expected[span.clone()], &mut charge[span.clone()], &mut counts);
            if let Some(read_noise) = &mut read_noise {
                let of_span = &mut read_noise[span.clone()];
                if line.model.read_noise_e > 0.0 {
                    let made = line.read_noise(&run, &mut scratch, &span);
                    of_span.copy_from_slice(&made[..of_span.len()]);
                } else {
                    of_span.fill(0.0);
                }
                line.add_jumps(&run, &mut scratch, of_span);
                line.add_offsets(&run, &mut scratch, span, of_span);
            }
        }
        counts
    }
}

/// Memory for the numbers of a run.
pub(super) struct Scratch {
    pub words: RunWords,
    pub rates: [f32; LONGEST_RUN],
    pub light: [f32; LONGEST_RUN],
    pub dark: [f32; LONGEST_RUN],
    pub normals: [f32; LONGEST_RUN],
    pub unlike: Vec<Unlike>,
    pub hot: Vec<(usize, f32)>,
}

impl Default for Scratch {
    fn default() -> Self {
        let empty = [0.0; LONGEST_RUN];
        let (unlike, hot) = (Vec::new(), Vec::new());
        Self { words: RunWords::default(), rates: empty, light: empty, dark: empty, normals: empty, unlike, hot }
    }
}

impl Line<'_> {
    /// The draws of the photosites in a span of the frame's columns.
    pub fn run(&self, span: &Range<usize>) -> Run {
        let record = self.record;
        #[expect(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "wraps as sensor columns do")]
        let column = self.first_column.wrapping_add(span.start as i32);
        Run {
            seed: record.seed,
            sensor_seed: record.sensor_seed,
            frame: record.frame,
            place: [column, self.row],
            classes: [span.start, span.start + 1].map(|x| self.classes[x % 2] as u8),
            length: span.len().next_multiple_of(VECTOR),
        }
    }

    /// Draws the charge of each photosite, light and dark, clipped at full well. The run's temporal words are made.
    #[inline(always)]
    pub fn charges(
        &self,
        run: &Run,
        scratch: &mut Scratch,
        span: &Range<usize>,
        expected: &[f32],
        charge: &mut [f32],
        counts: &mut Counts,
    ) {
        let model = self.model;
        let Scratch { words, rates, light, dark, normals, unlike, hot } = scratch;
        let [rates, light, dark, normals] = [rates, light, dark, normals].map(|numbers| &mut numbers[..run.length]);
        let mut negative = 0_u32;
        for (rate, &expected) in rates.iter_mut().zip(expected) {
            negative += u32::from(expected < 0.0);
            *rate = if expected < 0.0 { 0.0 } else { expected };
        }
        if let Some(smear) = self.columns.smear.get(span.clone()) {
            add(rates, smear);
        }
        // What fills the run up looks like the rest, so that it takes no path of its own.
        for index in expected.len()..run.length {
            rates[index] = rates[index.saturating_sub(2)];
        }
        counts.negative += u64::from(negative);

        self.shot(model.signal_shot, Source::Ssn, run, words, rates, light);
        // No count stands for a rate that is no number.
        for (light, &rate) in light.iter_mut().zip(&*rates) {
            *light = if rate.is_nan() { rate } else { *light };
        }
        if model.prnu > 0.0 || model.dcnu > 0.0 {
            run.make_pattern(words);
        }
        if model.prnu > 0.0 {
            run.normals(words, Source::Prnu, normals);
        }
        if model.lines.has_gains() {
            self.scale_by_lines(light, span, normals);
        } else if model.prnu > 0.0 {
            scale(light, to_sample(model.prnu), normals);
        }
        if model.dark_e > 0.0 || model.tails.has_hot() {
            rates.fill(to_sample(model.dark_e));
            self.shot(model.dark_shot && model.dark_e > 0.0, Source::Dcsn, run, words, rates, dark);
            if model.dcnu > 0.0 {
                run.normals(words, Source::Dcnu, normals);
            }
            if model.tails.has_hot() {
                run.find_unlike(words, Source::HotPixels, model.tails.hot_share, unlike);
                self.heat(run, words, (unlike, hot), dark, normals);
            }
            if model.dcnu > 0.0 {
                scale(dark, to_sample(model.dcnu), normals);
            }
            for (light, &dark) in light.iter_mut().zip(&*dark) {
                *light += dark;
            }
        }
        let full_well = to_sample(model.full_well_e);
        let mut full = 0_u32;
        for (charge, &light) in charge.iter_mut().zip(&*light) {
            full += u32::from(light > full_well);
            *charge = if light > full_well { full_well } else { light };
        }
        counts.full_well += u64::from(full);
    }

    /// Draws the dark signal of hot photosites at their own rates, of which the non-uniformity of the others is a lesser share.
    fn heat(
        &self,
        run: &Run,
        words: &RunWords,
        (unlike, hot): (&[Unlike], &mut Vec<(usize, f32)>),
        dark: &mut [f32],
        normals: &mut [f32],
    ) {
        let NoiseModel { dark_e, tails, poisson, .. } = self.model;
        hot.clear();
        for &(index, excess) in unlike {
            let rate_e = dark_e + tails.hot_e * excess;
            normals[index] *= to_sample(dark_e / rate_e);
            hot.push((index, to_sample(rate_e)));
        }
        if self.model.dark_shot {
            run.recount(words, *poisson == PoissonKind::Exact, hot, dark);
        } else {
            hot.iter().for_each(|(index, rate)| dark[*index] = *rate);
        }
    }

    /// Adds what the readings of photosites with a trap are off by.
    #[inline(always)]
    pub fn add_jumps(&self, run: &Run, scratch: &mut Scratch, samples: &mut [f32]) {
        let tails = &self.model.tails;
        if !tails.has_rts() {
            return;
        }
        let Scratch { words, unlike, .. } = scratch;
        run.find_unlike(words, Source::Rts, tails.rts_share, unlike);
        for &(index, excess) in &*unlike {
            if let Some(sample) = samples.get_mut(index) {
                *sample += to_sample(tails.rts_e * excess) * run.jump(index);
            }
        }
    }

    /// Fills `numbers` with counts at `rates`, or with the rates themselves where there is no shot noise.
    #[inline(always)]
    fn shot(&self, is_drawn: bool, source: Source, run: &Run, words: &RunWords, rates: &[f32], numbers: &mut [f32]) {
        if !is_drawn {
            numbers.copy_from_slice(rates);
        } else if self.model.poisson == PoissonKind::Gaussian {
            run.normals(words, source, numbers);
            for (number, &rate) in numbers.iter_mut().zip(rates) {
                *number = rate + rate.sqrt() * *number;
            }
        } else if let Some(tables) = self.tables_at(source, run, rates) {
            run.counts_of(words, source, tables, numbers);
        } else {
            run.counts(words, source, rates, numbers);
        }
    }

    /// The tables of the run's rates, where all its photosites have those.
    #[inline(always)]
    fn tables_at(&self, source: Source, run: &Run, rates: &[f32]) -> Option<[&Table; 2]> {
        let tables = match source {
            Source::Dcsn => [self.tables.dark.as_deref(); 2],
            _ => run.classes.map(|class| self.tables.light[usize::from(class)].as_deref()),
        };
        let [Some(even), Some(odd)] = tables else { return None };
        let known = [even.rate(), odd.rate()];
        let differs = |pair: &[f32; 2]| (pair[0] != known[0]) | (pair[1] != known[1]);
        let any = rates.as_chunks::<2>().0.iter().fold(false, |any, pair| any | differs(pair));
        (!any).then_some([even, odd])
    }

    /// Multiplies each number by max(0, 1 + σ n + g), g the gains of row and column less 1; where σ is 0, whatever n is.
    #[inline(always)]
    fn scale_by_lines(&self, numbers: &mut [f32], span: &Range<usize>, normals: &mut [f32]) {
        let sigma = to_sample(self.model.prnu);
        for normal in &mut *normals {
            *normal = if sigma > 0.0 { sigma * *normal } else { 0.0 };
        }
        if let Some(gains) = self.columns.gains.get(span.clone()) {
            for (normal, &gain) in normals.iter_mut().zip(gains) {
                *normal += self.gain + gain;
            }
        } else {
            normals.iter_mut().for_each(|normal| *normal += self.gain);
        }
        scale(numbers, 1.0, normals);
    }

    /// Adds the fixed offsets of photosites, and what row and columns add.
    #[inline(always)]
    pub fn add_offsets(&self, run: &Run, scratch: &mut Scratch, span: Range<usize>, samples: &mut [f32]) {
        let lines = &self.model.lines;
        if lines.dsnu_e > 0.0 {
            let offsets = &mut scratch.normals[..run.length];
            run.make_offsets(&mut scratch.words);
            run.normals(&scratch.words, Source::Dsnu, offsets);
            let rms = to_sample(lines.dsnu_e);
            for (sample, &offset) in samples.iter_mut().zip(&*offsets) {
                *sample += rms * offset;
            }
        }
        if let Some(offsets) = self.columns.offsets.get(span) {
            for (sample, &offset) in samples.iter_mut().zip(offsets) {
                *sample += self.offset + offset;
            }
        } else if lines.has_line_offsets() {
            samples.iter_mut().for_each(|sample| *sample += self.offset);
        }
    }

    /// Draws the read noise of each photosite. The run's temporal words are made.
    #[inline(always)]
    pub fn read_noise<'a>(&self, run: &Run, scratch: &'a mut Scratch, span: &Range<usize>) -> &'a [f32] {
        let noise = &mut scratch.normals[..run.length];
        run.normals(&scratch.words, Source::Ron, noise);
        if let Some(of_columns) = self.read_noise.get(span.clone()) {
            noise.iter_mut().zip(of_columns).for_each(|(noise, rms)| *noise *= rms);
            return noise;
        }
        let rms = to_sample(self.model.read_noise_e);
        noise.iter_mut().for_each(|noise| *noise *= rms);
        noise
    }
}

/// Adds numbers to samples.
#[inline(always)]
pub(super) fn add(samples: &mut [f32], numbers: &[f32]) {
    for (sample, number) in samples.iter_mut().zip(numbers) {
        *sample += number;
    }
}

/// How many samples are not finite.
#[inline(always)]
pub(super) fn not_finite(samples: &[f32]) -> u64 {
    let count = samples.iter().fold(0_u32, |count, sample| count + u32::from(!sample.is_finite()));
    u64::from(count)
}

/// Multiplies each number by max(0, 1 + σ n).
#[inline(always)]
pub(super) fn scale(numbers: &mut [f32], sigma: f32, normals: &[f32]) {
    for (number, &normal) in numbers.iter_mut().zip(normals) {
        let sensitivity = 1.0 + sigma * normal;
        *number *= if sensitivity > 0.0 { sensitivity } else { 0.0 };
    }
}
