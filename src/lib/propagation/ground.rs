//! What the photosites of a frame follow from, read off its head: their noise, their converter, what came off, and the light.

use super::columns::{Smeared, check_wells};
use super::masters::{Dark, Flat};
use super::moments::{Equations, Prediction};
use super::photosite::Photosite;
use super::tails;
use super::taps;
use super::unpredictable::{Predicted, Unpredictable};
use crate::camera::levels::BlackLevel;
use crate::error::Error;
use crate::metadata::{FrameHeader, NoiseRecord, PoissonKind};
use crate::numerics::averages::Combine;
use crate::numerics::normal::MeanVariance;
use crate::stages::noise::NoiseModel;
use crate::stages::transfer::{Transfer, uniform_share};
use crate::units::QuantityKind;
use std::borrow::Cow;

/// The quantity of the photosites that a frame was made of.
pub(crate) fn quantity_of_sites(frame: &FrameHeader) -> QuantityKind {
    match (frame.metadata.quantity, &frame.metadata.demosaic) {
        (QuantityKind::Electrons | QuantityKind::ExpectedElectrons, _) | (_, None) => frame.metadata.quantity,
        _ => QuantityKind::Adu,
    }
}

/// What the photosites of a frame follow from, before their moments are worked out.
pub(super) struct Ground<'a> {
    /// The frame as one amplifier reads it.
    pub frame: Cow<'a, FrameHeader>,
    /// What samples follow from.
    pub photosite: Photosite,
    /// The light, smear included.
    pub smeared: Smeared,
    /// What samples are.
    pub quantity: QuantityKind,
}

impl<'a> Ground<'a> {
    pub fn of(frame: &'a FrameHeader, equations: Equations) -> Predicted<Self> {
        let frame = taps::of_one(frame)?;
        let metadata = &frame.metadata;
        let scene = metadata.scene.as_ref().ok_or(Unpredictable::Missing("scene"))?;
        if !scene.uniform {
            return Err(Unpredictable::NotUniform);
        }
        let expected_e = scene.expected_electrons.ok_or(Unpredictable::Missing("scene.expected_electrons"))?;
        let model = noise_model(&frame)?;
        let photosite = Photosite::of_electrons(model, equations);
        let smeared = Smeared::of(&frame, expected_e)?;
        let expected_e = smeared.expected_e;
        check_wells(&frame, &photosite, expected_e)?;
        if !model.tails.is_none()
            && (metadata.is_transferred() || metadata.noise.as_ref().is_some_and(|noise| noise.cte.is_some()))
        {
            return Err(Unpredictable::Beyond(tails::TRANSFERRED));
        }
        let quantity = quantity_of_sites(&frame);
        let photosite = match quantity {
            QuantityKind::ExpectedElectrons => photosite,
            QuantityKind::Electrons => {
                photosite.check_tails(expected_e)?;
                photosite
            }
            QuantityKind::Adu => {
                let adc = metadata.adc.ok_or(Unpredictable::Missing("adc"))?;
                codes_of(&frame, photosite.digitized(adc), expected_e)?
            }
            _ => return Err(Unpredictable::Beyond("only electrons, ADU and what is made of them are predicted")),
        };
        photosite.check_lines(true)?;
        photosite.check_level(expected_e, &frame.geometry)?;
        Ok(Self { frame, photosite, smeared, quantity })
    }

    /// Moments of samples of R, G and B.
    pub fn moments(&self) -> Predicted<[Prediction; 3]> {
        let (frame, expected_e) = (&*self.frame, self.smeared.expected_e);
        match self.quantity {
            QuantityKind::ExpectedElectrons => Ok(expected_e.map(|mean| Prediction::of_cumulants(mean, 0.0, 0.0, 0.0))),
            QuantityKind::Electrons => {
                let classes = expected_e.map(|mean| self.photosite.moments(mean));
                transferred(frame, &self.photosite, classes, 0.0)
            }
            _ => moments_of_codes(frame, &self.photosite, expected_e),
        }
    }
}

/// What was subtracted, where it is the same at all photosites.
pub(super) fn subtracted(level: BlackLevel, with_deltas: bool) -> Predicted<f64> {
    level
        .uniform()
        .filter(|_| !with_deltas)
        .ok_or(Unpredictable::Beyond("the black level that was subtracted differs among photosites"))
}

/// Why nothing is said behind medians of flats that were lit in other places each.
const UNLIKE_FLATS: &str = "the median or clipped mean of flats counts whose light differed from place to place by more than their noise; use \
                            `--combine mean`";

/// Why nothing is predicted of a clipped mean of codes of little noise.
const CLIPPED_BY_CODE: &str = "the noise of the dark or bias frames, over few codes, makes what their clipped mean leaves out hang \
                               on where in a code their mean lies; use `--combine mean` or `median`";

/// Why nothing is predicted of a clipped mean of codes that end.
const CUT_OFF: &str = "an end of the codes cuts off the dark or bias frames, and no formula tells what their clipped mean keeps; use \
                       `--combine mean` or `median`";

/// Why nothing is predicted where those that stand out were taken away.
const FOUND: &str = "hot pixels or random telegraph signals that stand out were found and left out (`--find-defects`), and of the others nothing is \
                     told; list defects from elsewhere (`--defects`)";

/// Photosites whose codes are as the converter gave them, or as they were corrected.
fn codes_of(frame: &FrameHeader, codes: Photosite, expected_e: [f64; 3]) -> Predicted<Photosite> {
    let metadata = &frame.metadata;
    check_levels(frame, &codes)?;
    if codes.equations == Equations::Paper && codes.adc.is_some_and(|adc| adc.is_bent()) {
        return Err(Unpredictable::Beyond("the paper's converter is straight"));
    }
    let Some(correction) = &metadata.correction else {
        codes.check_tails(expected_e)?;
        return Ok(codes);
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
    if corrected.has_tails() && correction.defects.as_ref().is_some_and(|defects| defects.found_beyond.is_some()) {
        return Err(Unpredictable::Beyond(FOUND));
    }
    subtracted(correction.black_adu, correction.black_deltas)?;
    Ok(corrected)
}

/// Moments of codes as charge transfer left them, or as they were corrected.
fn moments_of_codes(frame: &FrameHeader, codes: &Photosite, expected_e: [f64; 3]) -> Predicted<[Prediction; 3]> {
    let shifted = |prediction: Prediction, by: f64| Prediction {
        moments: MeanVariance { mean: prediction.moments.mean + by, ..prediction.moments },
        ..prediction
    };
    let Some(correction) = &frame.metadata.correction else {
        let bias_adu = codes.adc.map_or(0.0, |adc| adc.bias_adu);
        let above_bias = of_classes(codes, expected_e).map(|code| shifted(code, -bias_adu));
        let left = transferred(frame, codes, above_bias, 1.0 / 12.0)?;
        return Ok(left.map(|code| shifted(code, bias_adu)));
    };
    if codes.flat.is_none() {
        let black_adu = subtracted(correction.black_adu, correction.black_deltas)?;
        return Ok(of_classes(codes, expected_e).map(|code| shifted(code, -black_adu)));
    }
    let mut classes = [Prediction::of_cumulants(0.0, 0.0, 0.0, 0.0); 3];
    for (class, prediction) in classes.iter_mut().enumerate() {
        let found = codes.divided(class, expected_e[class]);
        *prediction = found.ok_or_else(|| codes.why_not_divided(class, expected_e[class]))?;
    }
    Ok(classes)
}

/// Moments of the codes of all classes; none from the first on that takes too long, since nothing is said of a frame then.
fn of_classes(codes: &Photosite, expected_e: [f64; 3]) -> [Prediction; 3] {
    let mut is_void = false;
    expected_e.map(|expected_e| {
        if is_void {
            return Prediction::of_cumulants(f64::NAN, f64::NAN, f64::NAN, f64::NAN);
        }
        let found = codes.moments(expected_e);
        is_void = found.moments.variance.is_nan();
        found
    })
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
    let mut averages = corrected.darks.iter().flatten();
    if averages.any(|dark| corrected.adc.is_some_and(|adc| dark.is_clipped_by_code(&adc, 0.0))) {
        return Err(Unpredictable::Beyond(CLIPPED_BY_CODE));
    }
    let is_cut = |dark: &Dark| corrected.adc.is_some_and(|adc| corrected.of_dark(dark).is_cut(&adc));
    if corrected.darks.iter().flatten().any(|dark| dark.combine == Combine::Clipped && dark.frames > 2 && is_cut(dark))
    {
        return Err(Unpredictable::Beyond(CUT_OFF));
    }
    if let Some(flat) = &correction.flat {
        if flat.unlike_levels > 0.0 {
            return Err(Unpredictable::Beyond(UNLIKE_FLATS));
        }
        let adc = codes.adc.ok_or(Unpredictable::Missing("adc"))?;
        let mut flat = Flat::of(frame, flat, &adc, of_sensor).ok_or(unknown)?;
        let black_adu = correction.black_adu.mean();
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
pub(crate) fn has_tails(frame: &FrameHeader) -> bool {
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
