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
mod columns;
mod line;
mod model;
mod record;
pub mod smear;
mod tables;
mod taps;

pub use model::{LineNoise, NoiseModel, NoiseSettings, Tails, knots, rectified_mean, rectified_mean_square};
pub use smear::ColumnLight;

use crate::camera::sensor::Sensor;
use crate::cfa::{CfaPattern, Class};
use crate::error::Result;
use crate::frame::{Rows, Window, to_sample};
use crate::metadata::{FrameHeader, NoiseRecord};
use crate::numerics::vectors::{self, Instructions, Kernel};
use crate::random::{Source, of_knot, of_row, spans};
use crate::stages::transfer::{Transfer, uniform_share};
use crate::stream::{Counts, Stage};
use crate::units::{Electrons, ExpectedElectrons, QuantityKind};
use columns::Columns;
use line::{Charges, Line, Scratch, add, not_finite};
use tables::Tables;
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

impl AddNoise {
    /// The noise of `input`, whose metadata gives sensor and exposure.
    ///
    /// # Errors
    ///
    /// [`Error::Order`](crate::error::Error::Order) unless the frame holds expected electrons of photosites; [`Error::MissingKey`](crate::error::Error::MissingKey) without sensor
    /// or exposure; [`Error::Usage`](crate::error::Error::Usage) for an impossible temperature or charge transfer efficiency; [`Error::Format`](crate::error::Error::Format)
    /// where charge of a crop would be transferred, and for planes behind another array than Bayer's.
    pub fn new(input: &FrameHeader, settings: &NoiseSettings) -> Result<Self> {
        check_expected(input)?;
        let pattern = input.bayer("given noise")?;
        check_planes(input)?;
        let readout = input.readout()?;
        let transfer = match settings.cte {
            Some(cte) => {
                input.check_corner()?;
                input.check_one_output()?;
                Some(Transfer::new(cte, &input.geometry)?)
            }
            None => None,
        };
        let mut metadata = input.metadata.becoming(QuantityKind::Electrons);
        let record = record::of(input, settings, &mut metadata)?;
        let mut model = NoiseModel::of(input, &record)?;
        let taps = ReadNoise::of(input, readout, &record);
        if record.sources.contains(&Source::Ron) {
            model.read_noise_e = readout.read_noises_e().fold(0.0, f64::max);
        }
        let mean_dark_e = record.dark_e * rectified_mean(model.dcnu) + model.tails.mean_hot_e();
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
/// [`Error::Format`](crate::error::Error::Format) where noise was added already, else [`Error::Order`](crate::error::Error::Order).
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

/// Refuses a frame whose photosites are of no known class.
///
/// # Errors
///
/// [`Error::Format`](crate::error::Error::Format) when the frame has neither three planes nor a CFA pattern.
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
