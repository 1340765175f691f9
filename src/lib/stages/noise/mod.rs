//! The noise module: from expected electrons to those of one exposure.
//!
//! M = DCSN ∘ DCNU + SSN ∘ PRNU + RON        [HP2005, Eq. 10]
//!
//! DCNU and PRNU are fixed patterns: they hang on the sensor's seed alone. DCSN, SSN and RON are temporal: they hang on
//! seed and frame. Where charge transfer is simulated, it takes light and dark charge to the output before RON is added.
//! Sensors that are read by row and column have noise of these besides ([`LineNoise`]): gains beside PRNU, and offsets, fixed
//! and temporal, beside RON. Columns of a CCD may have [smear], which goes into what light is expected, and charge beyond full
//! well that spills along them ([bloom]).

pub mod bloom;
mod model;
pub mod smear;
mod taps;

pub use model::{LineNoise, NoiseModel, NoiseSettings, Tails, knots, rectified_mean, rectified_mean_square};
pub use smear::ColumnLight;

use crate::camera::readout::ReadOut;
use crate::camera::sensor::Sensor;
use crate::cfa::{CfaPattern, Class};
use crate::error::{Error, Result};
use crate::frame::{Rows, Window, to_sample};
use crate::metadata::{FrameHeader, NoiseRecord, PoissonKind};
use crate::numerics::vectors::{self, Instructions, Kernel};
use crate::random::philox::{LONGEST_RUN, VECTOR};
use crate::random::poisson::Table;
use crate::random::{LineDraws, Run, RunWords, Source, Unlike, of_column, of_knot, of_row, spans};
use crate::stages::transfer::{Transfer, uniform_share};
use crate::stream::{Counts, Stage};
use crate::units::{Electrons, ExpectedElectrons, QuantityKind};
use smear::Known;
use std::ops::Range;
use std::sync::Arc;
use taps::ReadNoise;

/// Draws one noisy exposure.
///
/// # Examples
///
/// ```
/// use cyanometer::stages::mosaic::Mosaic;
/// use cyanometer::stages::noise::{AddNoise, NoiseSettings};
/// use cyanometer::stream::MemoryFrame;
/// # use cyanometer::camera::optics::Exposure;
/// # use cyanometer::formats::data::load_sensor;
/// # use cyanometer::frame::Geometry;
/// # use cyanometer::metadata::{FrameHeader, Metadata};
/// # use cyanometer::units::QuantityKind;
/// # let mut metadata = Metadata::new(QuantityKind::ExpectedElectrons);
/// # metadata.sensor = Some(load_sensor("kaf-5101ce")?.sensor);
/// # metadata.exposure = Some(Exposure { exposure_s: 0.033, f_number: 8.0, lens_transmittance: 1.0 });
/// # let geometry = Geometry::new(40, 30, &["R", "G", "B"]);
/// # let header = FrameHeader { name: "example".into(), geometry, metadata };
///
/// let light = MemoryFrame::new(header, vec![5000.0; 40 * 30 * 3]);
/// let exposed = |frame: &MemoryFrame| {
///     let settings = NoiseSettings { seed: 7, ..NoiseSettings::default() };
///     Ok(frame.through(&AddNoise::new(&frame.header, &settings)?)?.0)
/// };
/// let mosaicked = |frame: &MemoryFrame| Ok(frame.through(&Mosaic::new(&frame.header, None)?)?.0);
///
/// // A draw hangs on its photosite and class, not on the order of work: mosaicking first gives the same noise, and draws a
/// // third of it.
/// assert_eq!(mosaicked(&exposed(&light)?)?.samples, exposed(&mosaicked(&light)?)?.samples);
/// # Ok::<(), cyanometer::error::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct AddNoise {
    header: FrameHeader,
    pattern: Option<CfaPattern>,
    model: NoiseModel,
    record: NoiseRecord,
    transfer: Option<Transfer>,
    tables: Tables,
    columns: Columns,
    taps: ReadNoise,
    instructions: Instructions,
    /// Share of what is beyond full well that spills along its column.
    blooming: f64,
    /// Whether columns have smear that their rows must tell first.
    lacks_light: bool,
}

/// What the frame's columns have by themselves; empty where they have nothing.
#[derive(Debug, Clone, Default)]
struct Columns {
    /// Electrons that are added.
    offsets: Vec<f32>,
    /// Relative gains less 1.
    gains: Vec<f32>,
    /// Smear, expected electrons.
    smear: Vec<f32>,
}

impl Columns {
    fn of(frame: &FrameHeader, model: &NoiseModel, record: &NoiseRecord) -> Self {
        let LineNoise { column_noise_e, dsnu_column_e, prnu_column, .. } = model.lines;
        let has_offsets = column_noise_e > 0.0 || dsnu_column_e > 0.0;
        if !has_offsets && prnu_column <= 0.0 {
            return Self::default();
        }
        let seeds = [record.seed, record.sensor_seed];
        let draws = (0..frame.geometry.width).map(|x| {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_possible_wrap,
                reason = "wraps as sensor columns do"
            )]
            let column = frame.geometry.origin[0].wrapping_add(x as i32);
            of_column(seeds, record.frame, column)
        });
        let offset = |draw: &LineDraws| to_sample(column_noise_e * draw.temporal + dsnu_column_e * draw.offset);
        let gain = |draw: &LineDraws| to_sample(prnu_column * draw.response);
        let (offsets, gains): (Vec<f32>, Vec<f32>) = draws.map(|draw| (offset(&draw), gain(&draw))).unzip();
        Self {
            offsets: if has_offsets { offsets } else { Vec::new() },
            gains: if prnu_column > 0.0 { gains } else { Vec::new() },
            smear: Vec::new(),
        }
    }
}

impl Columns {
    /// Adds smear, of which packets take such a share of the light; tells whether the head of the frame says enough.
    fn add_smear(&mut self, frame: &FrameHeader, share: f64) -> Result<bool> {
        if share > 0.0 {
            match smear::known(frame, frame.sensor()?.bayer()?, share)? {
                Known::Smear(smear) => self.smear = smear,
                Known::Nothing => return Ok(false),
            }
        }
        Ok(true)
    }
}

/// Counts at rates that are known beforehand: those of the dark signal, and of light where the scene is uniform.
#[derive(Debug, Clone, Default)]
struct Tables {
    dark: Option<Arc<Table>>,
    light: [Option<Arc<Table>>; 3],
}

impl Tables {
    /// The tables that a frame is large enough for.
    fn of(frame: &FrameHeader, model: &NoiseModel, instructions: Instructions) -> Self {
        /// Photosites from which on a table saves more than it costs.
        const WORTHWHILE: usize = 1 << 17;
        /// Rates from which on the widest vectors work counts out faster than they are looked up.
        const FEW: f64 = 10.0;
        let geometry = &frame.geometry;
        if model.poisson != PoissonKind::Exact || geometry.width * geometry.height < WORTHWHILE {
            return Self::default();
        }
        let table = |rate: f64| Table::new(to_sample(rate)).map(Arc::new);
        let scene = frame.metadata.scene.as_ref().filter(|scene| scene.uniform && model.signal_shot);
        let rates = scene.and_then(|scene| scene.expected_electrons);
        let is_slow = |rates: &[f64; 3]| instructions == Instructions::Avx512 && rates.iter().all(|&rate| rate >= FEW);
        let light = rates.filter(|rates| !is_slow(rates)).map(|rates| rates.map(table));
        let dark = if model.dark_shot && model.dark_e > 0.0 { table(model.dark_e) } else { None };
        Self { dark, light: light.unwrap_or_default() }
    }
}

/// The dark signal is left out where its variance is below this share of that of the read noise: the total standard
/// deviation changes by less than half of it.
const NEGLIGIBLE_DARK: f64 = 1e-9;

impl AddNoise {
    /// The noise of `input`, whose metadata gives sensor and exposure.
    ///
    /// # Errors
    ///
    /// [`Error::Order`] unless the frame holds expected electrons of photosites; [`Error::MissingKey`] without sensor
    /// or exposure; [`Error::Usage`] for an impossible temperature or charge transfer efficiency; [`Error::Format`]
    /// where charge of a crop would be transferred, and for planes behind another array than Bayer's.
    pub fn new(input: &FrameHeader, settings: &NoiseSettings) -> Result<Self> {
        check_expected(input)?;
        let pattern = input.bayer("given noise")?;
        check_planes(input)?;
        let readout = input.readout()?;
        let temperature_k = settings.temperature_k.unwrap_or(readout.temperature_k);
        if !(1.0..=1000.0).contains(&temperature_k) {
            return Err(Error::Usage(format!(
                "a temperature of {temperature_k} K is impossible for a sensor; give 1 to 1000"
            )));
        }
        let transfer = match settings.cte {
            Some(cte) => {
                input.check_corner()?;
                input.check_one_output()?;
                Some(Transfer::new(cte, &input.geometry)?)
            }
            None => None,
        };
        // Eq. 7: Q_DC = I_DC Δt.
        let exposure_s = input.exposure()?.exposure_s;
        let mut dark_e = readout.dark_current_e_per_s(temperature_k) * exposure_s;
        let mut hot_pixel_e = readout.hot_pixel_e_per_s(temperature_k) * exposure_s;
        let hot_share = readout.hot_pixel_share;
        let mut metadata = input.metadata.becoming(QuantityKind::Electrons);
        let mut sources: Vec<Source> =
            Source::ALL.into_iter().filter(|source| !settings.without.contains(source)).collect();
        // What the noisy frames leave out, the clean one does.
        let least_read_noise_e = readout.read_noises_e().fold(f64::INFINITY, f64::min);
        let read_variance = if sources.contains(&Source::Ron) { least_read_noise_e.powi(2) } else { 0.0 };
        let of_hot = hot_share * hot_pixel_e * (1.0 + 2.0 * hot_pixel_e);
        let dark_variance = dark_e * (1.0 + readout.dcnu.powi(2)) + of_hot;
        if dark_variance > 0.0 && dark_variance < NEGLIGIBLE_DARK * read_variance {
            metadata.leave_out(
                "add-noise",
                format!("dark signal of {:.1e} e-", dark_e + hot_share * hot_pixel_e),
                format!("its variance is below {NEGLIGIBLE_DARK:e} of that of the read noise"),
            );
            (dark_e, hot_pixel_e) = (0.0, 0.0);
        }
        if !sources.contains(&Source::HotPixels) {
            dark_e += hot_share * hot_pixel_e;
            hot_pixel_e = 0.0;
        }
        if hot_pixel_e == 0.0 {
            sources.retain(|source| *source != Source::HotPixels);
        }
        if dark_e == 0.0 {
            sources.retain(|source| *source != Source::Dcnu && (*source != Source::Dcsn || hot_pixel_e > 0.0));
        }
        sources.retain(|source| has_noise(readout, *source));
        if settings.clean {
            // No source is drawn that would lift the mean where it is cut at zero.
            dark_e = dark_e * rectified_mean(readout.dcnu) + hot_share * hot_pixel_e;
            hot_pixel_e = 0.0;
            sources.clear();
        }
        let record = NoiseRecord {
            sources,
            seed: settings.seed,
            sensor_seed: settings.sensor_seed,
            frame: settings.frame,
            temperature_k,
            dark_e,
            hot_pixel_e,
            poisson: settings.poisson,
            cte: settings.cte,
            smear_per_row: if exposure_s > 0.0 { readout.smear_line_s / exposure_s } else { 0.0 },
        };
        let mut model = NoiseModel::of(input, &record)?;
        let taps = ReadNoise::of(input, readout, &record);
        if record.sources.contains(&Source::Ron) {
            model.read_noise_e = readout.read_noises_e().fold(0.0, f64::max);
        }
        let mean_dark_e = dark_e * rectified_mean(model.dcnu) + model.tails.mean_hot_e();
        metadata.dark_signal_e = Some(mean_dark_e * settings.cte.map_or(1.0, uniform_share));
        metadata.noise = Some(record.clone());
        let instructions = Instructions::widest();
        let tables = Tables::of(input, &model, instructions);
        let mut columns = Columns::of(input, &model, &record);
        let lacks_light = !columns.add_smear(input, record.smear_per_row)?;
        let blooming = readout.blooming;
        let header = FrameHeader { metadata, ..input.clone() };
        Ok(Self {
            header,
            pattern,
            model,
            record,
            transfer,
            tables,
            columns,
            taps,
            instructions,
            blooming,
            lacks_light,
        })
    }

    /// What adds up the light of the frame's columns, where smear hangs on rows that are not read yet: the whole frame goes
    /// through it, and then into [`Self::with_light`]. Without it a band needs all rows of the frame.
    pub fn light_wanted(&self) -> Option<ColumnLight> {
        self.lacks_light.then(|| self.column_light())
    }

    fn column_light(&self) -> ColumnLight {
        let of_sensor = self.header.sensor().and_then(Sensor::bayer).ok();
        ColumnLight::of(&self.header, of_sensor.or(self.pattern).unwrap_or(CfaPattern::Rggb))
    }

    /// The same with smear of the light of its columns, all of whose rows were added up.
    pub fn with_light(mut self, light: &ColumnLight) -> Self {
        self.columns.smear = light.smear(self.record.smear_per_row);
        self.lacks_light = false;
        self
    }

    /// Draws on a narrower set of instructions than the widest there is; the noise is the same.
    pub fn on(mut self, instructions: Instructions) -> Self {
        self.instructions = instructions;
        self.tables = Tables::of(&self.header, &self.model, instructions);
        self
    }

    /// The head of the noisy frame, to add to.
    pub fn header_mut(&mut self) -> &mut FrameHeader {
        &mut self.header
    }

    /// What a user should hear before the frame is made.
    pub fn warning(&self) -> Option<String> {
        let apart = self.transfer.is_some() && self.header.metadata.cfa.is_none();
        apart.then(|| {
            "each of the three planes is transferred by itself, as if its class were at every photosite; for what a \
             sensor does run `mosaic` first"
                .into()
        })
    }
}

/// Makes sure that a frame holds expected electrons of photosites.
///
/// # Errors
///
/// [`Error::Format`] where noise was added already, else [`Error::Order`].
fn check_expected(frame: &FrameHeader) -> Result<()> {
    let holds = frame.holds();
    match frame.metadata.quantity {
        QuantityKind::ExpectedElectrons if frame.metadata.demosaic.is_none() => Ok(()),
        QuantityKind::Electrons => {
            Err(frame.refuse(format!("it holds {holds} that have their noise already; noise is added once")))
        }
        _ => {
            let problem = format!("it holds {holds}, not expected electrons of photosites");
            Err(frame.out_of_order(problem, "render-radiance"))
        }
    }
}

/// Whether a sensor has a source of noise at all.
fn has_noise(readout: &ReadOut, source: Source) -> bool {
    match source {
        Source::Dcnu => readout.dcnu > 0.0,
        Source::Prnu => readout.prnu > 0.0,
        Source::Ron => readout.read_noises_e().any(|noise| noise > 0.0),
        Source::RowNoise => readout.row_noise_e > 0.0,
        Source::ColumnNoise => readout.column_noise_e > 0.0,
        Source::Dsnu => readout.dsnu_e > 0.0,
        Source::DsnuRow => readout.dsnu_row_e > 0.0,
        Source::DsnuColumn => readout.dsnu_column_e > 0.0,
        Source::PrnuRow => readout.prnu_row > 0.0,
        Source::PrnuColumn => readout.prnu_column > 0.0,
        Source::HotPixels => readout.hot_pixel_share > 0.0,
        Source::Rts => readout.rts_share > 0.0,
        Source::BlackDrift => readout.black_drift_e > 0.0,
        Source::Dcsn | Source::Ssn => true,
    }
}

/// Refuses a frame whose photosites are of no known class.
///
/// # Errors
///
/// [`Error::Format`] when the frame has neither three planes nor a CFA pattern.
fn check_planes(frame: &FrameHeader) -> Result<()> {
    match (frame.geometry.channels.len(), frame.metadata.cfa) {
        (3, None) if frame.has_three_planes() => Ok(()),
        (1, Some(_)) => Ok(()),
        _ => Err(frame.refuse(format!(
            "it holds {}; noise needs the three planes R, G, B, or one CFA plane whose pattern the metadata names",
            frame.holds()
        ))),
    }
}

impl Stage for AddNoise {
    type Input = ExpectedElectrons;
    type Output = Electrons;

    fn header(&self) -> &FrameHeader {
        &self.header
    }

    fn reach(&self) -> usize {
        if self.lacks_light || self.blooms() {
            return self.header.geometry.height;
        }
        self.transfer.as_ref().map_or(0, Transfer::reach)
    }

    fn apply(&self, input: Window<'_, ExpectedElectrons>, mut output: Rows<'_, Electrons>) -> Counts {
        if let Some(mut light) = self.light_wanted() {
            (0..input.frame_height()).for_each(|y| light.add(input.all_channels(y)));
            return self.clone().with_light(&light).apply(input, output);
        }
        if self.blooms() {
            return self.apply_to_all(input, output);
        }
        let rows = output.range();
        let Some(transfer) = &self.transfer else {
            let draw = Expose { noise: self, input, output };
            return vectors::run_on(self.instructions, draw);
        };
        let mut counts = Counts::default();
        let [mut charge, mut noise] = [(); 2].map(|()| vec![0.0; input.width()]);
        let has_read_noise = self.model.read_noise_e > 0.0 || !self.model.lines.is_none() || self.model.tails.has_rts();
        for channel in 0..input.channels() {
            let mut passage = transfer.passage();
            // The rows above are drawn again, and counted in the band that they belong to.
            for y in rows.start.saturating_sub(transfer.reach())..rows.end {
                let line = self.line(y, channel);
                let expected = input.row(y.cast_signed(), channel);
                let is_read = y >= rows.start && has_read_noise;
                let read_noise = is_read.then_some(&mut *noise);
                let draw = Charges { line: &line, expected, charge: &mut charge, read_noise };
                let of_row = vectors::run_on(self.instructions, draw);
                for (entering, &charge) in passage.entering(y).iter_mut().zip(&charge) {
                    *entering = f64::from(charge);
                }
                if y >= rows.start {
                    counts = counts.plus(of_row);
                    let noisy = output.row(y, channel);
                    for (noisy, &charge) in noisy.iter_mut().zip(passage.leaving(y)) {
                        *noisy = to_sample(charge);
                    }
                    if is_read {
                        add(noisy, &noise);
                    }
                    counts.not_finite += not_finite(noisy);
                }
            }
        }
        counts
    }
}

/// One row of one plane.
struct Line<'a> {
    model: &'a NoiseModel,
    record: &'a NoiseRecord,
    tables: &'a Tables,
    columns: &'a Columns,
    /// Electrons that are added to the row, and its relative gain less 1.
    offset: f32,
    gain: f32,
    /// Read noise of each column, e⁻; empty where all have that of the model.
    read_noise: &'a [f32],
    /// Row of the sensor, and column of the frame's first.
    row: i32,
    first_column: i32,
    /// Classes of the frame's even and odd columns.
    classes: [Class; 2],
}

impl AddNoise {
    fn line(&self, y: usize, channel: usize) -> Line<'_> {
        let geometry = &self.header.geometry;
        let classes = match self.pattern {
            Some(pattern) => pattern.row_classes(geometry.origin, y),
            None => [Class::ALL[channel]; 2],
        };
        let [first_column, y0] = geometry.origin;
        #[expect(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "wraps as sensor columns do")]
        let row = y0.wrapping_add(y as i32);
        let Self { model, record, tables, columns, .. } = self;
        let LineNoise { row_noise_e, dsnu_row_e, prnu_row, black_drift_e, .. } = model.lines;
        let (mut offset, mut gain) = (0.0, 0.0);
        if row_noise_e > 0.0 || dsnu_row_e > 0.0 || prnu_row > 0.0 {
            let draws = of_row([record.seed, record.sensor_seed], record.frame, row);
            offset = to_sample(row_noise_e * draws.temporal + dsnu_row_e * draws.offset);
            gain = to_sample(prnu_row * draws.response);
        }
        if black_drift_e > 0.0 {
            let (knot, [of_this, of_next]) = knots(row.into(), model.lines.black_drift_rows);
            #[expect(clippy::cast_possible_truncation, reason = "knots are fewer than rows, and one more")]
            let level = |knot: i64| of_knot(record.seed, record.frame, knot as i32);
            offset += to_sample(black_drift_e * (of_this * level(knot) + of_next * level(knot + 1)));
        }
        let read_noise = self.taps.row(row);
        Line { model, record, tables, columns, offset, gain, read_noise, row, first_column, classes }
    }
}

/// Makes rows of a noisy exposure without charge transfer.
struct Expose<'a> {
    noise: &'a AddNoise,
    input: Window<'a, ExpectedElectrons>,
    output: Rows<'a, Electrons>,
}

impl Kernel for Expose<'_> {
    type Output = Counts;

    #[inline(always)]
    fn run(self) -> Counts {
        let Self { noise, input, mut output } = self;
        let mut counts = Counts::default();
        let mut scratch = Scratch::default();
        for y in output.range() {
            for channel in 0..input.channels() {
                let line = noise.line(y, channel);
                let expected = input.row(y.cast_signed(), channel);
                let noisy = output.row(y, channel);
                for span in spans(line.first_column, expected.len()) {
                    let run = line.run(&span);
                    let (expected, noisy) = (&expected[span.clone()], &mut noisy[span.clone()]);
                    run.make_temporal(&mut scratch.words);
                    line.charges(&run, &mut scratch, &span, expected, noisy, &mut counts);
                    if noise.model.read_noise_e > 0.0 {
                        add(noisy, line.read_noise(&run, &mut scratch, &span));
                    }
                    line.add_jumps(&run, &mut scratch, noisy);
                    line.add_offsets(&run, &mut scratch, span, noisy);
                    counts.not_finite += not_finite(noisy);
                }
            }
        }
        counts
    }
}

/// Makes the charge of one row, before it is transferred, and the read noise that it will meet where that is asked for.
struct Charges<'a> {
    line: &'a Line<'a>,
    expected: &'a [f32],
    charge: &'a mut [f32],
    read_noise: Option<&'a mut [f32]>,
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
struct Scratch {
    words: RunWords,
    rates: [f32; LONGEST_RUN],
    light: [f32; LONGEST_RUN],
    dark: [f32; LONGEST_RUN],
    normals: [f32; LONGEST_RUN],
    unlike: Vec<Unlike>,
    hot: Vec<(usize, f32)>,
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
    fn run(&self, span: &Range<usize>) -> Run {
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
    fn charges(
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
    fn add_jumps(&self, run: &Run, scratch: &mut Scratch, samples: &mut [f32]) {
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
    fn add_offsets(&self, run: &Run, scratch: &mut Scratch, span: Range<usize>, samples: &mut [f32]) {
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
    fn read_noise<'a>(&self, run: &Run, scratch: &'a mut Scratch, span: &Range<usize>) -> &'a [f32] {
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
fn add(samples: &mut [f32], numbers: &[f32]) {
    for (sample, number) in samples.iter_mut().zip(numbers) {
        *sample += number;
    }
}

/// How many samples are not finite.
#[inline(always)]
fn not_finite(samples: &[f32]) -> u64 {
    let count = samples.iter().fold(0_u32, |count, sample| count + u32::from(!sample.is_finite()));
    u64::from(count)
}

/// Multiplies each number by max(0, 1 + σ n).
#[inline(always)]
fn scale(numbers: &mut [f32], sigma: f32, normals: &[f32]) {
    for (number, &normal) in numbers.iter_mut().zip(normals) {
        let sensitivity = 1.0 + sigma * normal;
        *number *= if sensitivity > 0.0 { sensitivity } else { 0.0 };
    }
}
