//! Moments of a frame from its head alone.
//!
//! The way goes down once: from the head to the photosites that the frame was made of ([`Sites`]), from these to its
//! pixels ([`PixelMoments`]).

use super::columns::{Smeared, check_wells};
use super::curved;
use super::divided::NARROW;
use super::lines::DRIFTING;
use super::masters::{Dark, Flat};
use super::moments::LineCovariance;
use super::moments::{Equations, Prediction};
use super::photosite::Photosite;
use super::pixel_moments::PixelMoments;
use super::repeated;
use super::spaces::{Channels, Curved, OTHER_COLORS, is_curved, white};
use super::tails;
use super::tapped::TappedPixels;
use super::taps::{self, Group};
use super::unpredictable::TOO_LONG;
pub use super::unpredictable::{Predicted, Unpredictable};
use crate::camera::levels::BlackLevel;
use crate::color;
use crate::error::Error;
use crate::metadata::{FrameHeader, NoiseRecord, PoissonKind};
use crate::names::Named;
use crate::numerics::normal::MeanVariance;
use crate::stages::demosaic::Method;
use crate::stages::noise::NoiseModel;
use crate::stages::transfer::{Transfer, uniform_share};
use crate::units::QuantityKind;
use nalgebra::Matrix3;

/// Predicted moments of a frame.
#[derive(Debug, Clone, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "one is made of a frame")]
pub enum FramePrediction {
    /// Classes that are drawn apart: R, G and B before demosaicking.
    Planes([Prediction; 3]),
    /// Such classes in groups, one for each of the amplifiers that have read the frame.
    Groups(Vec<Group>),
    /// Pixels that are weighted sums of photosites.
    Pixels(Box<PixelMoments>),
    /// Such pixels where several amplifiers have read their photosites.
    Tapped(Box<TappedPixels>),
}

/// Predicts a frame from its metadata alone.
///
/// # Errors
///
/// [`Unpredictable`] where the scene is not uniform, the stage is beyond what is predicted, or the metadata do not say
/// enough.
///
/// # Examples
///
/// ```
/// use cyanometer::metadata::Scene;
/// use cyanometer::propagation::{Equations, FramePrediction, Unpredictable, of_frame};
/// use cyanometer::random::Source;
/// use cyanometer::stages::noise::{AddNoise, NoiseSettings};
/// use cyanometer::stream::Stage;
/// # use cyanometer::camera::optics::Exposure;
/// # use cyanometer::formats::data::load_sensor;
/// # use cyanometer::frame::Geometry;
/// # use cyanometer::metadata::{FrameHeader, Metadata};
/// # use cyanometer::units::QuantityKind;
/// # let mut metadata = Metadata::new(QuantityKind::ExpectedElectrons);
/// # metadata.sensor = Some(load_sensor("kaf-5101ce")?.sensor);
/// # metadata.exposure = Some(Exposure { exposure_s: 0.033, f_number: 8.0, lens_transmittance: 1.0 });
/// # metadata.scene = Some(Scene {
/// #     source: "example".into(),
/// #     uniform: true,
/// #     expected_electrons: Some([1000.0, 4000.0, 9000.0]),
/// #     vignetting_focal_length_mm: None,
/// #     patch: None,
/// #     source_width: None,
/// #     brightest_e: None,
/// #     upsampling: None,
/// # });
/// # let geometry = Geometry::new(640, 480, &["R", "G", "B"]);
/// # let header = FrameHeader { name: "example".into(), geometry, metadata };
///
/// // A uniform scene of 1000, 4000 and 9000 e⁻, of whose noise only the shot noise of light is drawn.
/// let without = vec![Source::Dcsn, Source::Dcnu, Source::Prnu, Source::Ron];
/// let noisy = AddNoise::new(&header, &NoiseSettings { without, ..NoiseSettings::default() })?.header().clone();
/// let Ok(FramePrediction::Planes(planes)) = of_frame(&noisy, Equations::Exact) else { panic!("nothing predicted") };
/// assert_eq!(planes.map(|plane| plane.moments.variance.round()), [1000.0, 4000.0, 9000.0]);
///
/// // Of a scene that is not known to be uniform nothing is predicted.
/// let mut unknown = noisy;
/// unknown.metadata.scene = None;
/// assert!(matches!(of_frame(&unknown, Equations::Exact), Err(Unpredictable::Missing(_))));
/// # Ok::<(), cyanometer::error::Error>(())
/// ```
pub fn of_frame(frame: &FrameHeader, equations: Equations) -> Predicted<FramePrediction> {
    let moments = |frame: &FrameHeader, equations| Ok(Sites::of(frame, equations)?.moments);
    if let Some(groups) = taps::groups(frame, equations, moments)? {
        return Ok(FramePrediction::Groups(groups));
    }
    if taps::are_mixed(frame) {
        return Ok(FramePrediction::Tapped(Box::new(tapped(frame, equations)?)));
    }
    let prediction = Sites::of(frame, equations)?.frame(frame)?;
    match &prediction {
        FramePrediction::Pixels(pixels) => pixels.void.map_or(Ok(()), |why| Err(Unpredictable::Beyond(why)))?,
        FramePrediction::Planes(_) | FramePrediction::Groups(_) | FramePrediction::Tapped(_) => {}
    }
    Ok(prediction)
}

/// The quantity of the photosites that a frame was made of.
pub(crate) fn quantity_of_sites(frame: &FrameHeader) -> QuantityKind {
    match (frame.metadata.quantity, &frame.metadata.demosaic) {
        (QuantityKind::Electrons | QuantityKind::ExpectedElectrons, _) | (_, None) => frame.metadata.quantity,
        _ => QuantityKind::Adu,
    }
}

/// The photosites of R, G and B that a frame was made of, in the unit that it was made in.
#[derive(Debug, Clone, PartialEq)]
pub struct Sites {
    /// What their samples follow from.
    pub photosite: Photosite,
    /// Signal electrons that they expect, those of smear among them.
    pub expected_e: [f64; 3],
    /// Moments of their samples.
    pub moments: [Prediction; 3],
}

impl Sites {
    /// The photosites of a frame, or of the plane that it was made of.
    ///
    /// # Errors
    ///
    /// As [`of_frame`].
    pub fn of(frame: &FrameHeader, equations: Equations) -> Predicted<Self> {
        let frame = &*taps::of_one(frame)?;
        let metadata = &frame.metadata;
        let scene = metadata.scene.as_ref().ok_or(Unpredictable::Missing("scene"))?;
        if !scene.uniform {
            return Err(Unpredictable::NotUniform);
        }
        let expected_e = scene.expected_electrons.ok_or(Unpredictable::Missing("scene.expected_electrons"))?;
        let model = noise_model(frame)?;
        let photosite = Photosite::of_electrons(model, equations);
        let smeared = Smeared::of(frame, expected_e)?;
        let expected_e = smeared.expected_e;
        check_wells(frame, &photosite, expected_e)?;
        if !model.tails.is_none()
            && (metadata.is_transferred() || metadata.noise.as_ref().is_some_and(|noise| noise.cte.is_some()))
        {
            return Err(Unpredictable::Beyond(tails::TRANSFERRED));
        }
        let (photosite, mut moments) = match quantity_of_sites(frame) {
            QuantityKind::ExpectedElectrons => {
                (photosite, expected_e.map(|mean| Prediction::of_cumulants(mean, 0.0, 0.0, 0.0)))
            }
            QuantityKind::Electrons => {
                photosite.check_tails(expected_e)?;
                let classes = expected_e.map(|mean| photosite.moments(mean));
                (photosite, transferred(frame, &photosite, classes, 0.0)?)
            }
            QuantityKind::Adu => {
                let codes = photosite.digitized(metadata.adc.ok_or(Unpredictable::Missing("adc"))?);
                codes_of(frame, codes, expected_e)?
            }
            _ => return Err(Unpredictable::Beyond("only electrons, ADU and what is made of them are predicted")),
        };
        photosite.check_lines()?;
        photosite.check_level()?;
        if photosite.has_tails() && moments.iter().any(|site| site.moments.variance.is_nan()) {
            return Err(Unpredictable::Beyond(TOO_LONG));
        }
        if quantity_of_sites(frame) != QuantityKind::ExpectedElectrons {
            let lines = photosite.lines(expected_e)?;
            if frame.metadata.is_transferred() && lines != [LineCovariance::default(); 3] {
                return Err(Unpredictable::Beyond("charge transfer before rows and columns that share noise"));
            }
            moments.iter_mut().zip(lines).for_each(|(moments, lines)| moments.lines = lines);
        }
        let sites = Self { photosite, expected_e, moments };
        let sites = match &metadata.average {
            None => sites,
            Some(record) => {
                let average = repeated::average_of(frame, record, quantity_of_sites(frame))?;
                Self { moments: photosite.averaged(moments, expected_e, &average)?, ..sites }
            }
        };
        smeared.check_even(photosite.slope(), &sites.moments)?;
        Ok(sites)
    }

    /// The photosites of each of the amplifiers that read a frame, with its number and those of R, G and B.
    ///
    /// # Errors
    ///
    /// As [`of_frame`].
    pub fn of_taps(frame: &FrameHeader, equations: Equations) -> Predicted<Vec<(usize, [f64; 3], Self)>> {
        let parts = taps::parts(frame).into_iter();
        parts.map(|part| Ok((part.tap, part.counts, Self::of(&part.frame, equations)?))).collect()
    }

    /// Predicts a frame that was made of these photosites; pixels say where their moments are void.
    ///
    /// # Errors
    ///
    /// As [`of_frame`].
    pub fn frame(&self, frame: &FrameHeader) -> Predicted<FramePrediction> {
        let metadata = &frame.metadata;
        let Some(record) = &metadata.demosaic else { return Ok(FramePrediction::Planes(self.moments)) };
        if self.photosite.drifts() {
            return Err(Unpredictable::Beyond(DRIFTING));
        }
        let equations = self.photosite.equations;
        let method = Method::named(&record.method)
            .ok_or(Unpredictable::Beyond("it was demosaicked by a method that is unknown here"))?;
        let black = subtracted(record.black, record.black_deltas)?;
        let size = [frame.geometry.width, frame.geometry.height];
        let mut camera = PixelMoments::demosaicked(record.cfa, black, method, self.moments, size, equations)
            .ok_or(Unpredictable::Beyond("the paper has no equations for its method of demosaicking"))?;
        let has_tails = self.photosite.has_tails();
        if has_tails && method == Method::SmoothHue {
            camera.void = Some(tails::CURVED);
        }
        let is_curved = is_curved(metadata.quantity) && has_tails;
        let Some(record) = &metadata.color else {
            if metadata.quantity != quantity_of_sites(frame) {
                return Err(Unpredictable::Missing("color"));
            }
            return Ok(FramePrediction::Pixels(Box::new(camera)));
        };
        let xyz_from_adu = record.xyz_from_adu(metadata.exposure).ok_or(Unpredictable::Missing("exposure"))?;
        let xyz = match equations {
            Equations::Paper if method != Method::EffectiveColor => {
                // Eq. 19 of [HP2005] takes the channels as independent; Eq. 20 keeps the correlations, for ECI.
                let squares = xyz_from_adu.map(|element| element * element);
                let independent = Matrix3::from_diagonal(&(squares * camera.covariance.diagonal()));
                PixelMoments { covariance: independent, ..camera.through(&xyz_from_adu, record.black_adu) }
            }
            _ => camera.through(&xyz_from_adu, record.black_adu),
        };
        let xyz = if is_curved { PixelMoments { void: xyz.void.or(Some(tails::CURVED)), ..xyz } } else { xyz };
        let pixels = match (Curved::of(metadata)?, metadata.quantity) {
            (Some(space), _) => xyz.to_color(space, equations)?,
            (None, QuantityKind::Xyz) => xyz,
            (None, QuantityKind::LinearSrgb) => xyz.through(&color::linear_srgb_from_xyz(white(metadata)?), 0.0),
            _ => return Err(Unpredictable::Beyond(OTHER_COLORS)),
        };
        Ok(FramePrediction::Pixels(Box::new(pixels)))
    }
}

impl PixelMoments {
    /// XYZ in a space that is curved in them; void where noise is too large a share of them.
    fn to_color(&self, space: Curved, equations: Equations) -> Predicted<Self> {
        let local = space.about(self.mean)?;
        if equations == Equations::Paper {
            return Ok(self.linearized(&local));
        }
        if space.is_quiet(self.mean, &self.covariance) {
            return Ok(self.curved(&local, |xyz| space.value(xyz)));
        }
        let linearized = self.linearized(&local);
        Ok(Self { void: self.void.or(Some(curved::VOID)), ..linearized })
    }
}

/// Why the paper says nothing of pixels of several amplifiers.
const OF_ONE: &str = "the paper's sensor is read through one amplifier, and several (`taps`) have a part in its pixels";

/// Why nothing is said of smooth hue transition.
const BY_HUE: &str = "smooth hue transition divides by green, and several amplifiers (`taps` of the sensor) have a part in its pixels; of \
                      them bi, eci and mhc are predicted, and regions and crops behind one";

/// Pixels of a frame that several amplifiers have a part in.
fn tapped(frame: &FrameHeader, equations: Equations) -> Predicted<TappedPixels> {
    let metadata = &frame.metadata;
    let record = metadata.demosaic.as_ref().ok_or(Unpredictable::Missing("demosaic"))?;
    let beyond = |why: &'static str| Err(Unpredictable::Beyond(why));
    if equations == Equations::Paper {
        return beyond(OF_ONE);
    }
    if metadata.correction.as_ref().is_some_and(|correction| correction.flat.is_some()) {
        return beyond(taps::FLATTENED);
    }
    if Method::named(&record.method) == Some(Method::SmoothHue) {
        return beyond(BY_HUE);
    }
    let mut groups = Vec::new();
    for part in taps::parts(&taps::with_footprint(frame)) {
        let of_tap = FrameHeader { geometry: frame.geometry.clone(), ..part.frame };
        let sites = Sites::of(&of_tap, equations)?;
        if sites.photosite.drifts() {
            return beyond(DRIFTING);
        }
        if sites.moments.iter().any(|site| site.lines != LineCovariance::default()) {
            return beyond(taps::WITH_LINES);
        }
        if sites.photosite.has_tails() && is_curved(metadata.quantity) {
            return beyond(tails::CURVED);
        }
        groups.push((part.tap, Group { counts: part.counts, sites: sites.moments }));
    }
    let black = subtracted(record.black, record.black_deltas)?;
    TappedPixels::of(frame, &Channels::of(metadata, quantity_of_sites(frame))?, black, &groups)
}

/// What was subtracted, where it is the same at all photosites.
fn subtracted(level: BlackLevel, with_deltas: bool) -> Predicted<f64> {
    level
        .uniform()
        .filter(|_| !with_deltas)
        .ok_or(Unpredictable::Beyond("the black level that was subtracted differs among photosites"))
}

/// Why nothing is predicted of a clipped mean of codes of little noise.
const CLIPPED_BY_CODE: &str = "the noise of the dark or bias frames, over few codes, makes what their clipped mean leaves out hang \
                               on where in a code their mean lies; use `--combine mean` or `median`";

/// Codes as the converter gave them and charge transfer left them, or as they were corrected.
fn codes_of(frame: &FrameHeader, codes: Photosite, expected_e: [f64; 3]) -> Predicted<(Photosite, [Prediction; 3])> {
    let metadata = &frame.metadata;
    check_levels(frame, &codes)?;
    if codes.equations == Equations::Paper && codes.adc.is_some_and(|adc| adc.is_bent()) {
        return Err(Unpredictable::Beyond("the paper's converter is straight"));
    }
    let shifted = |prediction: Prediction, by: f64| Prediction {
        moments: MeanVariance { mean: prediction.moments.mean + by, ..prediction.moments },
        ..prediction
    };
    let Some(correction) = &metadata.correction else {
        codes.check_tails(expected_e)?;
        let bias_adu = codes.adc.map_or(0.0, |adc| adc.bias_adu);
        let above_bias = expected_e.map(|mean| shifted(codes.moments(mean), -bias_adu));
        let left = transferred(frame, &codes, above_bias, 1.0 / 12.0)?;
        return Ok((codes, left.map(|code| shifted(code, bias_adu))));
    };
    if correction.cte.is_some() || metadata.is_transferred() {
        return Err(Unpredictable::Beyond(
            "what charge transfer and its undoing do to noise differs from place to place",
        ));
    }
    if let Some(false) = correction.flat.as_ref().map(|flat| flat.even) {
        return Err(Unpredictable::Beyond("nothing says that the flat field by which it was divided was lit evenly"));
    }
    let corrected = corrected(frame, codes)?;
    corrected.check_tails(expected_e)?;
    let black_adu = subtracted(correction.black_adu, correction.black_deltas)?;
    let mut averages = corrected.darks.iter().flatten();
    if averages.any(|dark| corrected.adc.is_some_and(|adc| dark.is_clipped_by_code(&adc, 0.0))) {
        return Err(Unpredictable::Beyond(CLIPPED_BY_CODE));
    }
    if corrected.flat.is_none() {
        return Ok((corrected, expected_e.map(|mean| shifted(corrected.moments(mean), -black_adu))));
    }
    let mut classes = [Prediction::of_cumulants(0.0, 0.0, 0.0, 0.0); 3];
    for (class, prediction) in classes.iter_mut().enumerate() {
        let found = corrected.divided(class, expected_e[class]);
        *prediction = found.ok_or(Unpredictable::Beyond(NARROW))?;
    }
    Ok((corrected, classes))
}

/// Codes of photosites as the record of a frame's corrections has them.
pub(super) fn corrected(frame: &FrameHeader, codes: Photosite) -> Predicted<Photosite> {
    let Some(correction) = &frame.metadata.correction else { return Ok(codes) };
    let unknown = Unpredictable::Beyond("the noise of the frames that it was corrected by is not known");
    // Of a frame that no noise is recorded of, that of its sensor is taken for all.
    let of_sensor = frame.metadata.noise.is_none().then_some(codes.model);
    let mut corrected = codes.less_dark_frames(correction.dark_frames);
    if !correction.masters.is_empty() {
        corrected.darks = Dark::all(frame, &correction.masters, of_sensor).ok_or(unknown)?;
    }
    if let Some(flat) = &correction.flat {
        let adc = codes.adc.ok_or(Unpredictable::Missing("adc"))?;
        let mut flat = Flat::of(frame, flat, &adc, of_sensor).ok_or(unknown)?;
        let black_adu = correction.black_adu.sites().iter().sum::<f64>() / 4.0;
        flat.levels_adu[0] = black_adu - adc.bias_adu * (1.0 - corrected.weight());
        corrected.flat = Some(flat);
    }
    Ok(corrected)
}

/// Makes sure that levels of the metadata are those of the converter, from which codes are predicted.
fn check_levels(frame: &FrameHeader, codes: &Photosite) -> Predicted<()> {
    let metadata = &frame.metadata;
    if metadata.correction.is_some() {
        return Ok(());
    }
    let is_known = metadata.black_level_adu.is_some() || !metadata.black_by_row.is_empty();
    if is_known && metadata.uniform_black_adu().is_none() {
        return Err(Unpredictable::Beyond("the black level differs among photosites"));
    }
    let top = codes.adc.map(|adc| adc.sample(adc.top_code().into()));
    if metadata.demosaic.is_none() && metadata.white_level_adu.is_some_and(|white| white.uniform() != top) {
        return Err(Unpredictable::Beyond("the white level is not the largest code of the converter"));
    }
    Ok(())
}

/// What charge transfer leaves of photosites whose mean is in proportion to charge: the same share of the mean everywhere,
/// and of the variance, apart from read noise and from that of `rounding`, what it leaves on average over the frame.
fn transferred(
    frame: &FrameHeader,
    photosite: &Photosite,
    classes: [Prediction; 3],
    rounding: f64,
) -> Predicted<[Prediction; 3]> {
    let Some(cte) = frame.metadata.noise.as_ref().and_then(|noise| noise.cte) else { return Ok(classes) };
    // Behind a filter array charge moves between classes: where they differ, so do means from place to place.
    let is_level = classes.iter().all(|class| class.moments.mean == classes[0].moments.mean);
    if frame.metadata.demosaic.is_some() || (frame.metadata.cfa.is_some() && !is_level) {
        return Err(Unpredictable::Beyond("charge transfer mixes classes of unequal signals"));
    }
    if photosite.adc.is_some_and(|adc| adc.linearization.is_some()) {
        return Err(Unpredictable::Beyond("charge transfer before a converter that is not straight"));
    }
    let transfer = Transfer::new(cte, &frame.geometry)
        .map_err(|_| Unpredictable::Beyond("its charge transfer efficiency is impossible"))?;
    let of_variance = transfer.mean_square_share();
    let slope = photosite.slope();
    let after = photosite.model.added().powi(2) * slope * slope + rounding;
    Ok(classes.map(|class| {
        let mean = class.moments.mean * uniform_share(cte);
        let variance = (class.moments.variance - after).max(0.0) * of_variance + after.min(class.moments.variance);
        Prediction { moments: MeanVariance { mean, variance }, ..class }
    }))
}

/// Whether photosites of a frame are unlike each other.
pub(super) fn has_tails(frame: &FrameHeader) -> bool {
    noise_model(frame).is_ok_and(|model| !model.tails.is_none())
}

/// The noise model of a frame; one without noise record has no noise, and no dark signal.
fn noise_model(frame: &FrameHeader) -> Predicted<NoiseModel> {
    let silent = NoiseRecord {
        sources: vec![],
        seed: 0,
        sensor_seed: 0,
        frame: 0,
        temperature_k: 0.0,
        dark_e: 0.0,
        hot_pixel_e: 0.0,
        poisson: PoissonKind::Exact,
        cte: None,
        smear_per_row: 0.0,
    };
    let record = frame.metadata.noise.as_ref().unwrap_or(&silent);
    let mut model = NoiseModel::of(frame, record).map_err(|error| match error {
        Error::MissingKey { key, .. } => Unpredictable::Missing(key),
        _ => Unpredictable::Missing("sensor"),
    })?;
    if frame.metadata.noise.is_none() {
        model.full_well_e = f64::INFINITY;
    }
    Ok(model)
}
