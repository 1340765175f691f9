//! The noise module: from expected electrons to those of one exposure.
//!
//! M = DCSN ∘ DCNU + SSN ∘ PRNU + RON        [HP2005, Eq. 10]
//!
//! DCNU and PRNU are fixed patterns: they hang on the sensor's seed alone. DCSN, SSN and RON are temporal: they hang on
//! seed and frame. Where charge transfer is simulated, it takes light and dark charge to the output before RON is added.

use crate::cfa::Class;
use crate::error::{Error, Result};
use crate::frame::{Rows, Window, to_sample};
use crate::metadata::{FrameHeader, NoiseRecord, PoissonKind};
use crate::random::{Draws, Source};
use crate::stage::{Counts, Stage};
use crate::transfer::{Transfer, uniform_share};
use crate::units::{Electrons, ExpectedElectrons, QuantityKind};
use rand_distr::{Distribution, Poisson, StandardNormal};

/// The numbers that the noise of a photosite follows from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseModel {
    /// Mean dark signal Q_DC before non-uniformity, e⁻ [HP2005, Eq. 7].
    pub dark_e: f64,
    /// Relative rms of the dark current over photosites; 0 when left out.
    pub dcnu: f64,
    /// Relative rms of the response over photosites; 0 when left out.
    pub prnu: f64,
    /// Read noise, rms e⁻; 0 when left out.
    pub read_noise_e: f64,
    /// Full well, e⁻.
    pub full_well_e: f64,
    /// Whether the dark signal has shot noise.
    pub dark_shot: bool,
    /// Whether the light signal has shot noise.
    pub signal_shot: bool,
    /// How Poisson numbers are drawn.
    pub poisson: PoissonKind,
}

impl NoiseModel {
    /// The model of a noise record.
    ///
    /// # Errors
    ///
    /// [`Error::MissingKey`] when the frame has no sensor.
    pub fn of(frame: &FrameHeader, record: &NoiseRecord) -> Result<Self> {
        let sensor = frame.sensor()?;
        let drawn = |source| record.sources.contains(&source);
        let if_drawn = |source, value| if drawn(source) { value } else { 0.0 };
        Ok(Self {
            dark_e: record.dark_e,
            dcnu: if_drawn(Source::Dcnu, sensor.dcnu),
            prnu: if_drawn(Source::Prnu, sensor.prnu),
            read_noise_e: if_drawn(Source::Ron, sensor.read_noise_e),
            full_well_e: sensor.full_well_e,
            dark_shot: drawn(Source::Dcsn),
            signal_shot: drawn(Source::Ssn),
            poisson: record.poisson,
        })
    }
}

/// What a user may set of the noise.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct NoiseSettings {
    /// Seed of the temporal noise.
    pub seed: u64,
    /// Seed of the fixed patterns.
    pub sensor_seed: u64,
    /// Number of the exposure.
    pub frame: u32,
    /// Sources to leave out; their means stay.
    pub without: Vec<Source>,
    /// Temperature in K, the sensor's own where none is given.
    pub temperature_k: Option<f64>,
    /// How to draw Poisson numbers.
    pub poisson: PoissonKind,
    /// Share of a packet that each move to the output takes along; none leaves transfer out.
    pub cte: Option<f64>,
}

/// Draws one noisy exposure.
#[derive(Debug, Clone)]
pub struct AddNoise {
    header: FrameHeader,
    model: NoiseModel,
    record: NoiseRecord,
    transfer: Option<Transfer>,
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
    /// where charge of a crop would be transferred.
    pub fn new(input: &FrameHeader, settings: &NoiseSettings) -> Result<Self> {
        let holds = input.holds();
        match input.metadata.quantity {
            QuantityKind::ExpectedElectrons if input.metadata.demosaic.is_none() => {}
            QuantityKind::Electrons => {
                return Err(
                    input.refuse(format!("it holds {holds} that have their noise already; noise is added once"))
                );
            }
            _ => {
                let problem = format!("it holds {holds}, not expected electrons of photosites");
                return Err(input.out_of_order(problem, "render-radiance"));
            }
        }
        plane_classes(input)?;
        let sensor = input.sensor()?;
        let temperature_k = settings.temperature_k.unwrap_or(sensor.temperature_k);
        if !(1.0..=1000.0).contains(&temperature_k) {
            return Err(Error::Usage(format!(
                "a temperature of {temperature_k} K is impossible for a sensor; give 1 to 1000"
            )));
        }
        let transfer = match settings.cte {
            Some(cte) => {
                input.check_corner()?;
                Some(Transfer::new(cte, &input.geometry)?)
            }
            None => None,
        };
        // Eq. 7: Q_DC = I_DC Δt.
        let mut dark_e = sensor.dark_current_e_per_s(temperature_k) * input.exposure()?.exposure_s;
        let mut metadata = input.metadata.becoming(QuantityKind::Electrons);
        let mut sources: Vec<Source> =
            Source::ALL.into_iter().filter(|source| !settings.without.contains(source)).collect();
        let read_variance = if sources.contains(&Source::Ron) { sensor.read_noise_e.powi(2) } else { 0.0 };
        if dark_e > 0.0 && dark_e * (1.0 + sensor.dcnu.powi(2)) < NEGLIGIBLE_DARK * read_variance {
            metadata.leave_out(
                "add-noise",
                format!("dark signal of {dark_e:.1e} e-"),
                format!("its variance is below {NEGLIGIBLE_DARK:e} of that of the read noise"),
            );
            dark_e = 0.0;
        }
        if dark_e == 0.0 {
            sources.retain(|source| !matches!(source, Source::Dcsn | Source::Dcnu));
        }
        sources.retain(|source| match source {
            Source::Dcnu => sensor.dcnu > 0.0,
            Source::Prnu => sensor.prnu > 0.0,
            Source::Ron => sensor.read_noise_e > 0.0,
            Source::Dcsn | Source::Ssn => true,
        });
        let record = NoiseRecord {
            sources,
            seed: settings.seed,
            sensor_seed: settings.sensor_seed,
            frame: settings.frame,
            temperature_k,
            dark_e,
            poisson: settings.poisson,
            cte: settings.cte,
        };
        let model = NoiseModel::of(input, &record)?;
        metadata.dark_signal_e = Some(dark_e * rectified_mean(model.dcnu) * settings.cte.map_or(1.0, uniform_share));
        metadata.noise = Some(record.clone());
        let header = FrameHeader { metadata, ..input.clone() };
        Ok(Self { header, model, record, transfer })
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

/// The sensor classes of the frame's planes: three planes, or none for a CFA plane whose classes alternate.
///
/// # Errors
///
/// [`Error::Format`] when the frame has neither three planes nor a CFA pattern.
fn plane_classes(frame: &FrameHeader) -> Result<()> {
    match (frame.geometry.channels.len(), frame.metadata.cfa) {
        (3, None) if frame.has_three_planes() => Ok(()),
        (1, Some(_)) => Ok(()),
        _ => Err(frame.refuse(format!(
            "it holds {}; noise needs the three planes R, G, B, or one CFA plane whose pattern the metadata names",
            frame.holds()
        ))),
    }
}

/// Mean of max(0, N) for N normal with mean 1: a photosite has no negative sensitivity, so draws below zero count as
/// zero, which lifts the mean by σ φ(1/σ) − Φ(−1/σ) (10⁻⁸ at σ = 0.2).
pub fn rectified_mean(sigma: f64) -> f64 {
    use crate::numerics::normal::{cumulative, density};
    if sigma <= 0.0 { 1.0 } else { cumulative(1.0 / sigma) + sigma * density(1.0 / sigma) }
}

/// Mean square of max(0, N) for N normal with mean 1.
pub fn rectified_mean_square(sigma: f64) -> f64 {
    use crate::numerics::normal::{cumulative, density};
    if sigma <= 0.0 { 1.0 } else { (1.0 + sigma * sigma) * cumulative(1.0 / sigma) + sigma * density(1.0 / sigma) }
}

/// Draws counts at one rate after another, keeping what a rate needs while it stays the same.
struct Counter {
    kind: PoissonKind,
    rate: f64,
    exact: Option<Poisson<f64>>,
}

impl Counter {
    fn new(kind: PoissonKind) -> Self {
        Self { kind, rate: 0.0, exact: None }
    }

    /// A count at `rate`, which is not negative; a rate of 0 gives 0, NaN stays NaN.
    #[expect(clippy::float_cmp, reason = "the very same rate, to use again what was set up for it")]
    fn draw(&mut self, rate: f64, draws: &mut Draws) -> f64 {
        if rate == 0.0 || rate.is_nan() {
            return rate;
        }
        if self.kind == PoissonKind::Gaussian {
            let normal: f64 = StandardNormal.sample(draws);
            return rate + rate.sqrt() * normal;
        }
        if rate != self.rate || self.exact.is_none() {
            self.rate = rate;
            self.exact = Poisson::new(rate).ok();
        }
        // Only rates beyond 10¹⁹ are refused, where a count is its rate to the last bit of a double.
        self.exact.as_ref().map_or(rate, |poisson| poisson.sample(draws))
    }
}

impl Stage for AddNoise {
    type Input = ExpectedElectrons;
    type Output = Electrons;

    fn header(&self) -> &FrameHeader {
        &self.header
    }

    fn reach(&self) -> usize {
        self.transfer.as_ref().map_or(0, Transfer::reach)
    }

    fn apply(&self, input: Window<'_, ExpectedElectrons>, mut output: Rows<'_, Electrons>) -> Counts {
        let mut counts = Counts::default();
        let rows = output.range();
        for channel in 0..input.channels() {
            let Some(transfer) = &self.transfer else {
                for y in rows.clone() {
                    let noisy = output.row(y, channel);
                    let line = self.line(y, channel);
                    line.charges(input.row(y.cast_signed(), channel), &mut counts, |x, charge, counts| {
                        noisy[x] = line.read(x, charge, counts);
                    });
                }
                continue;
            };
            let mut passage = transfer.passage();
            // The rows above are drawn again, and counted in the band that they belong to.
            for y in rows.start.saturating_sub(transfer.reach())..rows.end {
                let line = self.line(y, channel);
                let mut of_row = Counts::default();
                let entering = passage.entering(y);
                line.charges(input.row(y.cast_signed(), channel), &mut of_row, |x, charge, _| entering[x] = charge);
                if y >= rows.start {
                    counts = counts.plus(of_row);
                    for (x, (&charge, noisy)) in passage.leaving(y).iter().zip(output.row(y, channel)).enumerate() {
                        *noisy = line.read(x, charge, &mut counts);
                    }
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
    /// Row of the sensor, and column of the frame's first.
    row: i32,
    first_column: i32,
    /// Classes of the frame's even and odd columns.
    classes: [Class; 2],
}

impl AddNoise {
    fn line(&self, y: usize, channel: usize) -> Line<'_> {
        let geometry = &self.header.geometry;
        let classes = match self.header.metadata.cfa {
            Some(pattern) => pattern.row_classes(geometry.origin, y),
            None => [Class::ALL[channel]; 2],
        };
        let [first_column, y0] = geometry.origin;
        #[expect(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "wraps as sensor columns do")]
        let row = y0.wrapping_add(y as i32);
        Line { model: &self.model, record: &self.record, row, first_column, classes }
    }
}

impl Line<'_> {
    #[inline(always)]
    fn draws(&self, x: usize, source: Source) -> Draws {
        let record = self.record;
        let (seed, frame) =
            if source.is_fixed_pattern() { (record.sensor_seed, 0) } else { (record.seed, record.frame) };
        #[expect(clippy::cast_possible_truncation, clippy::cast_possible_wrap, reason = "wraps as sensor columns do")]
        let column = self.first_column.wrapping_add(x as i32);
        Draws::new(seed, frame, source, self.classes[x % 2] as u8, column, self.row)
    }

    #[inline(always)]
    fn normal(&self, x: usize, source: Source) -> f64 {
        StandardNormal.sample(&mut self.draws(x, source))
    }

    /// Draws the charge of each photosite, light and dark, clipped at full well.
    #[inline(always)]
    fn charges(&self, expected: &[f32], counts: &mut Counts, mut put: impl FnMut(usize, f64, &mut Counts)) {
        let model = self.model;
        let mut light_counters = [Counter::new(model.poisson), Counter::new(model.poisson)];
        let mut dark_counter = Counter::new(model.poisson);
        for (x, &expected) in expected.iter().enumerate() {
            let sensitivity = |source: Source, sigma: f64| (1.0 + sigma * self.normal(x, source)).max(0.0);
            let mut rate = f64::from(expected);
            if rate < 0.0 {
                counts.negative += 1;
                rate = 0.0;
            }
            let mut light = if model.signal_shot {
                light_counters[x % 2].draw(rate, &mut self.draws(x, Source::Ssn))
            } else {
                rate
            };
            if model.prnu > 0.0 {
                light *= sensitivity(Source::Prnu, model.prnu);
            }
            let mut charge = light;
            if model.dark_e > 0.0 {
                let mut dark = if model.dark_shot {
                    dark_counter.draw(model.dark_e, &mut self.draws(x, Source::Dcsn))
                } else {
                    model.dark_e
                };
                if model.dcnu > 0.0 {
                    dark *= sensitivity(Source::Dcnu, model.dcnu);
                }
                charge += dark;
            }
            if charge > model.full_well_e {
                charge = model.full_well_e;
                counts.full_well += 1;
            }
            put(x, charge, counts);
        }
    }

    /// Reads a packet of charge out.
    #[inline(always)]
    fn read(&self, x: usize, mut charge: f64, counts: &mut Counts) -> f32 {
        if self.model.read_noise_e > 0.0 {
            charge += self.model.read_noise_e * self.normal(x, Source::Ron);
        }
        counts.not_finite += u64::from(!charge.is_finite());
        to_sample(charge)
    }
}
