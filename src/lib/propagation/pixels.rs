//! The uncertainty of each pixel of a frame, from the sensor's noise model at the pixel's own level.
//!
//! Scenes need not be uniform: each pixel's demosaicked R, G and B tell the signal of the photosites around it, the noise
//! model their variances, and the weights of its phase (folded back at the edges) its covariance. What varies within the
//! reach of the weights, three photosites, is taken as level; photosites behind several amplifiers are taken to read the same level.

use super::charge;
use super::covariance::Covariance;
use super::ground::{corrected, quantity_of_sites};
use super::level_variance::{HALF_A_CODE, LevelVariance};
use super::moments::Equations;
use super::photosite::Photosite;
use super::pixel_gains::{PixelGains, phase_at};
use super::pixel_light::PixelVariances;
use super::pixel_lines::PixelLines;
use super::pixel_tap_lines::{OfTaps, PixelTapLines, TAPS};
use super::reading::ENDLESS;
use super::repeated::average_of;
use super::smooth_hue;
use super::tapped_axis::Axis;
use super::tapped_flat;
use super::taps;
use crate::camera::taps::Taps;
use crate::cfa::Class;
use crate::error::Result;
use crate::frame::Geometry;
use crate::metadata::{AdcRecord, AverageRecord, FrameHeader, Illumination, NoiseRecord};
use crate::names::Named;
use crate::random::Source;
use crate::stages::demosaic::Method;
use crate::stages::demosaic::weights::WeightTable;
use crate::stages::noise::NoiseModel;
use crate::units::QuantityKind;

/// Tells the covariance of the demosaicked R, G and B of a pixel from its place and level.
#[derive(Debug, Clone, PartialEq)]
pub struct PixelNoise {
    columns: Places,
    rows: Places,
    /// Gains of the pixels of each row class and, within, each column class.
    gains: Vec<PixelGains>,
    /// The same of what whole rows, columns and sites are off together, and its variances; none where the black level has none.
    of_black: Option<(Vec<PixelGains>, [f64; 3])>,
    /// What photosites share by rows and by columns; none where they share nothing.
    of_lines: Option<PixelLines>,
    /// What each amplifier makes of photosites, where there are several.
    of_taps: Option<PixelTaps>,
    depends_on_hue: bool,
    variances: PixelVariances,
    /// What no light reads in the frame, in the unit of its samples.
    black: f64,
}

/// Which columns, or rows, are alike: all near the edges differ, those between repeat with the array's period.
#[derive(Debug, Clone, PartialEq)]
struct Places {
    length: usize,
    reach: usize,
    /// One place of each kind.
    examples: Vec<usize>,
    /// The kind of each place, where amplifiers make more kinds.
    kinds: Vec<usize>,
}

impl Places {
    fn new(length: usize, reach: usize) -> Self {
        let examples = if length <= 2 * reach + 2 {
            (0..length).collect()
        } else {
            (0..reach + 2).chain(length - reach..length).collect()
        };
        Self { length, reach, examples, kinds: Vec::new() }
    }

    /// The same of lines from `first` on the sensor on, `taps` telling the amplifiers of each.
    fn of_taps(first: i64, length: usize, reach: usize, taps: impl Fn(i64) -> [usize; 2]) -> Self {
        let Axis { kinds, examples, .. } = Axis::of(first, length, 0..length, reach, taps);
        Self { length, reach, examples: examples.into_iter().map(|(place, _)| place).collect(), kinds }
    }

    fn kind(&self, place: usize) -> usize {
        let Self { length, reach, .. } = *self;
        if let Some(kind) = self.kinds.get(place) {
            return *kind;
        }
        if length <= 2 * reach + 2 || place < reach {
            place
        } else if place >= length - reach {
            reach + 2 + place - (length - reach)
        } else {
            reach + (place - reach) % 2
        }
    }
}

/// What each of the amplifiers of a sensor makes of the photosites of pixels.
#[derive(Debug, Clone, PartialEq)]
struct PixelTaps {
    /// Gains of the variances of the three classes behind each.
    gains: Vec<PixelGains<{ 3 * TAPS }>>,
    variances: Vec<[LevelVariance; 3]>,
    /// What no light reads behind each, less what it does without them.
    shifts: Vec<f64>,
    /// The slope of each, relative to that of the sensor.
    slopes: Vec<f64>,
    /// What photosites share by rows and by columns, where the converter is curved.
    lines: Option<PixelTapLines>,
}

impl PixelTaps {
    /// What is the own of photosites, of such variances, of which those of the sensor's slope share so much.
    fn own(&self, whole: OfTaps, shared: [f64; 3]) -> OfTaps {
        std::array::from_fn(|index| {
            let slope = self.slopes.get(index / 3).copied().unwrap_or_default();
            (whole[index] - slope * slope * shared[index % 3]).max(0.0)
        })
    }

    /// The variances of the classes behind each amplifier, as all photosites read such levels above black.
    fn at(&self, level: [f64; 3]) -> OfTaps {
        std::array::from_fn(|index| {
            let (tap, class) = (index / 3, index % 3);
            let of_tap = self.variances.get(tap).map(|variances| variances[class].at(level[class] - self.shifts[tap]));
            of_tap.unwrap_or_default()
        })
    }
}

impl PixelGains<{ 3 * TAPS }> {
    /// Those of the classes behind each amplifier, `tap` telling that of a place of the frame.
    fn of_taps(table: &WeightTable, at: [usize; 2], geometry: &Geometry, tap: impl Fn([isize; 2]) -> usize) -> Self {
        let phase = phase_at(at, geometry);
        let class = |offset| table.class(phase, offset) as usize;
        Self::by(table, at, geometry, |a, b| {
            let mut sums = [0.0; 3 * TAPS];
            for (offset, weight) in a.sites() {
                let place = [0, 1].map(|axis| at[axis].cast_signed() + offset[axis]);
                if let Some(sum) = sums.get_mut(3 * tap(place) + class(offset)) {
                    *sum += weight * b.at(offset);
                }
            }
            sums
        })
    }
}

impl PixelNoise {
    /// The noise of the pixels of a demosaicked frame.
    ///
    /// # Errors
    ///
    /// [`crate::error::Error::MissingKey`] where the metadata name no sensor, exposure or converter, or no read-out of the sensor;
    /// [`crate::error::Error::Order`] for a frame that is not demosaicked.
    pub fn of(frame: &FrameHeader) -> Result<Self> {
        let metadata = &frame.metadata;
        let record = metadata.demosaic.as_ref().ok_or_else(|| {
            let is_before_mosaic = frame.leads_with_three_planes();
            let problem = format!("it holds {}, and nothing says how it was demosaicked", frame.holds());
            frame.out_of_order(problem, if is_before_mosaic { "mosaic" } else { "demosaic" })
        })?;
        let method = Method::named(&record.method)
            .ok_or_else(|| frame.refuse(format!("it was demosaicked by `{}`, a method unknown here", record.method)))?;
        let (photosite, black) = photosite_of(&taps::as_one_reads(frame))?;
        let largest = photosite.largest();
        let table = WeightTable::of(method, record.cfa);
        let [columns, rows] = places(frame, method.reach());
        let places = || rows.examples.iter().flat_map(|&y| columns.examples.iter().map(move |&x| [x, y]));
        let gains = |gains: fn(&WeightTable, [usize; 2], &Geometry) -> PixelGains| -> Vec<PixelGains> {
            places().map(|at| gains(table, at, &frame.geometry)).collect()
        };
        let is_followed = photosite.check_tails([0.0; 3]).and_then(|()| photosite.check_lines(false));
        let light = flat_light(frame);
        is_followed.and_then(|()| photosite.check_flat_in(light)).map_err(|why| frame.refuse(why.to_string()))?;
        let is_level_told = photosite.check_level_of_drift();
        is_level_told.map_err(|why| frame.refuse(why.to_string()))?;
        let average = match &metadata.average {
            Some(record) => {
                let record =
                    average_of(frame, record, quantity_of_sites(frame)).map_err(|why| frame.refuse(why.to_string()))?;
                photosite.check_average(&record).map_err(|why| frame.refuse(why.to_string()))?;
                Some(record)
            }
            None => None,
        };
        tapped_flat::check_flat(frame).map_err(|why| frame.refuse(why.to_string()))?;
        let kinds: Vec<[usize; 2]> = places().collect();
        let tap = tap_of_place(frame).filter(|_| frame.taps().is_some());
        let gain = |place: [isize; 2]| tap.as_ref().map_or(1.0, |tap| relative_slope(frame, tap(place)));
        let is_bent_by_tap = frame.taps().is_some() && photosite.adc.is_some_and(|adc| adc.is_bent());
        let of_lines = (photosite.has_lines() && !is_bent_by_tap)
            .then(|| PixelLines::of(photosite, average.as_ref(), table, &kinds, &frame.geometry, gain));
        let of_black = metadata
            .black_noise
            .map(|noise| (gains(PixelGains::of_black), [noise.row_adu2, noise.column_adu2, noise.site_adu2]));
        let gains = gains(PixelGains::new);
        let light = light.map(|light| (light, &frame.geometry));
        let variances = PixelVariances::of(&photosite, average.as_ref(), largest, light);
        let of_taps = match frame.taps() {
            Some(_) => Some(pixel_taps(frame, table, kinds, average.as_ref(), &photosite)?),
            None => None,
        };
        let depends_on_hue = table.depends_on_hue();
        Ok(Self { columns, rows, gains, of_black, of_lines, of_taps, depends_on_hue, variances, black })
    }

    /// The covariance of the pixel in column `x` and row `y` of the frame, whose samples are `rgb`; and whether
    /// propagation holds there.
    ///
    /// Where smooth hue transition divides by a green that is lost in noise, the covariance is that of the hue which
    /// green would make at its noise, and says only that it is large. Where a median or clipped mean of codes scatters over less than
    /// a code, it is that of an average over all places in a code.
    pub fn covariance(&self, [x, y]: [usize; 2], rgb: [f64; 3]) -> (Covariance, bool) {
        let kind = self.rows.kind(y) * self.columns.examples.len() + self.columns.kind(x);
        // What was divided by a flat field had this share of its light, and was so much less.
        let share = self.variances.share([x, y]);
        let level = rgb.map(|sample| (sample - self.black) * share);
        let of_taps = self.of_taps.as_ref().map(|taps| (taps, taps.at(level)));
        let all = |mut variances: [f64; 3], hues: Option<[f64; 3]>| {
            let lines = self.of_lines.as_ref().map(|lines| (lines, lines.at(level, share)));
            let shared = lines.as_ref().map(|(lines, level)| lines.of_sites(level));
            if let Some(shared) = shared {
                let off = |(variance, shared): (&mut f64, f64)| *variance = (*variance - shared).max(0.0);
                variances.iter_mut().zip(shared).for_each(off);
            }
            let mut covariance = match of_taps {
                Some((taps, whole)) => {
                    let lines = taps.lines.as_ref().map(|lines| (lines, lines.at(level)));
                    let own = match &lines {
                        Some((lines, level)) => lines.own(whole, level),
                        None => taps.own(whole, shared.unwrap_or_default()),
                    };
                    let mut covariance = taps.gains[kind].covariance(own, hues);
                    if let Some((lines, level)) = &lines {
                        let more = lines.covariance(kind, y, level, hues);
                        covariance.iter_mut().zip(more).for_each(|(covariance, more)| *covariance += more);
                    }
                    covariance
                }
                None => self.gains[kind].covariance(variances, hues),
            };
            if let Some((lines, level)) = &lines {
                let more = lines.covariance(kind, y, level, hues);
                covariance.iter_mut().zip(more).for_each(|(covariance, more)| *covariance += more);
            }
            if let Some((gains, of_black)) = &self.of_black {
                let more = gains[kind].covariance(*of_black, hues);
                covariance.iter_mut().zip(more).for_each(|(covariance, more)| *covariance += more);
            }
            covariance.map(|covariance| covariance / (share * share))
        };
        let of_any_tap = || of_taps.iter().flat_map(|(_, whole)| whole);
        let (mut variances, are_told) = self.variances.at(level, share);
        let is_told = are_told && of_any_tap().all(|variance| !variance.is_nan());
        for (index, of_tap) in of_any_tap().enumerate() {
            variances[index % 3] = variances[index % 3].max(*of_tap);
        }
        if !self.depends_on_hue {
            return (all(variances, None), is_told);
        }
        let green = level[Class::Green as usize];
        let first_order = smooth_hue::FirstOrder::of(level, variances);
        let floor = variances[Class::Green as usize].sqrt() / 2.0;
        let divisor = if green > floor { green } else { floor.max(f64::MIN_POSITIVE) };
        let hues = level.map(|level| {
            let hue = level.max(0.0) / divisor;
            if hue.is_finite() { hue } else { 1.0 }
        });
        (all(variances, Some(hues)), is_told && first_order.holds)
    }
}

/// The columns and rows of a frame that are alike.
fn places(frame: &FrameHeader, reach: usize) -> [Places; 2] {
    let geometry = &frame.geometry;
    let readout = frame.metadata.sensor.as_ref().and_then(|sensor| sensor.readout.as_ref());
    let extents = [geometry.width, geometry.height];
    let Some(readout) = readout.filter(|readout| readout.taps.is_some()) else {
        return extents.map(|extent| Places::new(extent, reach));
    };
    [0, 1].map(|axis| {
        let first = i64::from(geometry.origin[axis]);
        Places::of_taps(first, extents[axis], reach, |line| readout.taps_of_line(axis, line))
    })
}

/// The slope of what an amplifier makes of the samples of a frame, relative to that of the sensor.
fn relative_slope(frame: &FrameHeader, tap: usize) -> f64 {
    // Over a flat field gains come off.
    let are_codes = quantity_of_sites(frame) == QuantityKind::Adu && tapped_flat::flat_of(frame).is_none();
    frame.taps().filter(|_| are_codes).map_or(1.0, |taps| taps.gain(tap))
}

/// What reads the photosite of a place of a frame, counted from the frame's first.
fn tap_of_place(frame: &FrameHeader) -> Option<impl Fn([isize; 2]) -> usize + '_> {
    let (readout, origin) = (frame.readout().ok()?, frame.geometry.origin.map(i64::from));
    Some(move |place: [isize; 2]| readout.tap([0, 1].map(|axis| origin[axis] + place[axis] as i64)))
}

/// What each amplifier makes of the photosites of pixels at such examples of all places.
fn pixel_taps(
    frame: &FrameHeader,
    table: &WeightTable,
    examples: Vec<[usize; 2]>,
    average: Option<&AverageRecord>,
    one: &Photosite,
) -> Result<PixelTaps> {
    let light = flat_light(frame);
    if light.is_some() {
        return Err(frame.refuse(tapped_flat::UNEVENLY_FLATTENED));
    }
    let tap = tap_of_place(frame).ok_or_else(|| frame.missing("sensor.readout"))?;
    let gains = examples.iter().map(|at| PixelGains::of_taps(table, *at, &frame.geometry, &tap)).collect();
    let (mut photosites, mut variances, mut shifts, mut slopes) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for tap in 0..frame.taps().map_or(0, Taps::count) {
        let (photosite, _) = photosite_of(&taps::of_tap(frame, tap))?;
        let is_followed = photosite.check_tails([0.0; 3]).and_then(|()| photosite.check_flat());
        is_followed.map_err(|why| frame.refuse(why.to_string()))?;
        let largest = photosite.largest();
        slopes.push(relative_slope(frame, tap));
        let unlit = |photosite: &Photosite| {
            photosite.moments(0.0).moments.mean * photosite.flat.map_or(1.0, |flat| flat.ratios[1])
        };
        let shift = unlit(&photosite) - unlit(one);
        shifts.push(shift);
        photosites.push((photosite, shift));
        variances.push(LevelVariance::of_classes(&photosite, average, largest));
    }
    let is_bent = one.has_lines() && one.adc.is_some_and(|adc| adc.is_bent());
    let of_lines = || PixelTapLines::of(photosites, average, table, &examples, &frame.geometry, &tap);
    let lines = if is_bent { of_lines() } else { None };
    Ok(PixelTaps { gains, variances, shifts, slopes, lines })
}

/// How the flat field was lit that divided a frame, where that was not even.
fn flat_light(frame: &FrameHeader) -> Option<&Illumination> {
    tapped_flat::flat_of(frame).and_then(|flat| flat.illumination.as_ref())
}

/// The photosites that a demosaicked frame was made of, and what no light reads in it, in the unit of its samples.
pub(super) fn photosite_of(frame: &FrameHeader) -> Result<(Photosite, f64)> {
    let metadata = &frame.metadata;
    if metadata.is_transferred() || metadata.correction.as_ref().is_some_and(|correction| correction.cte.is_some()) {
        return Err(frame.refuse(
            "its charge was transferred, and what that does to noise differs from place to place; no standard \
             deviations can be told",
        ));
    }
    if let Some(count) = metadata.bloomed_photosites.filter(|count| *count > 0) {
        return Err(frame.refuse(format!(
            "charge has spilled over into {count} of its photosites from others of their columns; nothing tells which, so that no \
             standard deviations can be told"
        )));
    }
    let readout = frame.readout()?;
    let noise = match &metadata.noise {
        Some(noise) => noise.clone(),
        None => whole_noise(frame)?,
    };
    let model = NoiseModel::of(frame, &noise)?;
    let photosite = Photosite::of_electrons(model, Equations::Exact);
    let found = match metadata.quantity {
        QuantityKind::Electrons | QuantityKind::ExpectedElectrons => (photosite, metadata.dark_signal_e.unwrap_or(0.0)),
        _ => {
            let adc = metadata.adc.unwrap_or_else(|| AdcRecord::of_readout(readout));
            let codes = corrected(frame, photosite.digitized(adc)).map_err(|why| frame.refuse(why.to_string()))?;
            // Frames that came off, or divide it, keep what their rows and columns have.
            let codes = Photosite { model: less_border(frame, codes.model), ..codes };
            let black_adu = frame.uniform_black_adu()?;
            (codes, black_adu + dark_above(frame, &codes, &adc, black_adu))
        }
    };
    Ok(found)
}

/// The model of what is left where the level of each row, or column, came off as its masked photosites have it: what does not hang on light
/// is theirs too. The noise of that level is in the metadata.
fn less_border(frame: &FrameHeader, model: NoiseModel) -> NoiseModel {
    let is_by_lines = frame.metadata.correction.as_ref().is_some_and(|correction| correction.black_deltas);
    let Some(noise) = frame.metadata.black_noise.filter(|_| is_by_lines) else { return model };
    let mut lines = model.lines;
    if noise.row_adu2 > 0.0 {
        (lines.row_noise_e, lines.dsnu_row_e, lines.black_drift_e) = (0.0, 0.0, 0.0);
    }
    if noise.column_adu2 > 0.0 {
        (lines.column_noise_e, lines.dsnu_column_e) = (0.0, 0.0);
    }
    NoiseModel { lines, ..model }
}

/// What codes without light are above the black level of the metadata, in ADU. That of a camera is often the converter's, and counts no
/// dark signal, as it is where bias frames alone came off; by the sensor of the frame's exposure, what no light reads is then known all
/// the same. Simulated frames have it in their black level.
fn dark_above(frame: &FrameHeader, codes: &Photosite, adc: &AdcRecord, black_adu: f64) -> f64 {
    let metadata = &frame.metadata;
    if metadata.noise.is_some() {
        return 0.0;
    }
    let off_adu = metadata.demosaic.as_ref().map_or(0.0, |record| record.black.mean())
        + metadata.correction.as_ref().map_or(0.0, |record| record.black_adu.mean());
    let unlit_adu = codes.moments(0.0).moments.mean - off_adu;
    if codes.darks[0].is_some() {
        return unlit_adu - black_adu;
    }
    // A level from that of the converter on, or 1 % below it, up to that with the dark signal counts not all of this.
    let dark_adu = unlit_adu - (adc.sample_at(0.0) - off_adu);
    let short_adu = unlit_adu - black_adu;
    let most_adu = dark_adu + (0.5 * dark_adu).max(0.01 * adc.sample_at(0.0));
    if (0.0..=most_adu).contains(&short_adu) { short_adu } else { 0.0 }
}

/// Codes that noise does not blur, so that the scatter of a sample hangs on where in a code its level lies, which no sample tells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoarseCodes {
    /// The level above black up to which noise is below half a code, in ADU.
    pub up_to_adu: f64,
    /// The least and the largest standard deviation of samples without light, by where in a code their level lies, in ADU.
    pub scatter_adu: [f64; 2],
    /// That which is told of them in ADU, about the level: of what is drawn and of an error of rounding of 1/12 ADU².
    pub told_adu: f64,
}

/// How coarse the codes are beside the noise of photosites that [`PixelNoise`] is of; none where noise blurs them, where averages or flat fields
/// make other samples of them, or where it is not known.
pub fn coarse_codes(frame: &FrameHeader) -> Option<CoarseCodes> {
    let (photosite, _) = photosite_of(&taps::as_if_one(frame)).ok()?;
    let adc = photosite.adc.filter(|adc| !adc.is_bent())?;
    if frame.metadata.average.is_some() || photosite.flat.is_some() {
        return None;
    }
    let (model, slope) = (&photosite.model, adc.adu_per_e);
    let std = |level: f64| slope * charge::charge(model, level / slope).variance.max(0.0).sqrt().hypot(model.added());
    let unlit = std(0.0);
    if unlit.is_nan() || unlit >= HALF_A_CODE {
        return None;
    }
    let (mut low, mut high) = (0.0, slope * model.full_well_e);
    // A frame without noise is meant to have none.
    if std(high) <= 0.0 {
        return None;
    }
    if std(high) < HALF_A_CODE {
        low = high;
    }
    for _ in 0..60 {
        let middle = f64::midpoint(low, high);
        (low, high) = if std(middle) < HALF_A_CODE { (middle, high) } else { (low, middle) };
    }
    let scatter = |place: f64| {
        let [first, second, ..] = ENDLESS.moments(place, unlit, 0.0);
        (second - first * first).max(0.0).sqrt()
    };
    let told_adu = (unlit * unlit + 1.0 / 12.0).sqrt();
    Some(CoarseCodes { up_to_adu: low, scatter_adu: [0.0, 0.5].map(scatter), told_adu })
}

/// The level above black below which the green of a frame demosaicked by smooth hue transition is less than
/// [`smooth_hue::VOID_BELOW`] times its noise; none for other methods, and where the noise is not known.
pub fn dim_green_below(frame: &FrameHeader) -> Option<f64> {
    let record = frame.metadata.demosaic.as_ref()?;
    if Method::named(&record.method) != Some(Method::SmoothHue) {
        return None;
    }
    let (photosite, black) = photosite_of(&taps::as_if_one(frame)).ok()?;
    let slope = photosite.slope();
    let mut level = 0.0;
    // Rises to where a level is so many times its noise; the noise rises as its root.
    for _ in 0..40 {
        let charge = charge::charge(&photosite.model, level / slope).variance + photosite.model.added().powi(2);
        let rounding = if photosite.adc.is_some() { 1.0 / 12.0 } else { 0.0 };
        level = smooth_hue::VOID_BELOW * (charge * slope * slope + rounding).sqrt() / 2.0;
    }
    Some(black + level).filter(|level| level.is_finite())
}

/// Everything that the sensor's noise is made of, for a frame whose metadata do not say what was drawn.
fn whole_noise(frame: &FrameHeader) -> Result<NoiseRecord> {
    let readout = frame.readout()?;
    let temperature_k = frame.metadata.sensor_temperature_k.unwrap_or(readout.temperature_k);
    let charges_e = readout.dark_charges_e(temperature_k, frame.metadata.time_s());
    let [dark_e, hot_pixel_e] = charges_e.ok_or_else(|| frame.missing("exposure_time_s"))?;
    Ok(NoiseRecord {
        sources: Source::ALL.to_vec(),
        seed: 0,
        sensor_seed: 0,
        frame: 0,
        temperature_k,
        dark_e,
        hot_pixel_e,
        poisson: crate::metadata::PoissonKind::Exact,
        cte: None,
        smear_per_row: 0.0,
    })
}
