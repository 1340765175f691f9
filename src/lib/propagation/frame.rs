//! Moments of a frame from its head alone.
//!
//! The way goes down once: from the head to the photosites that the frame was made of ([`Sites`]), from these to its
//! pixels ([`PixelMoments`]).

use super::curved;
use super::gains;
use super::ground::{Ground, quantity_of_sites, subtracted};
use super::moments::LineCovariance;
use super::moments::{Equations, Prediction, SiteCovariance};
use super::photosite::Photosite;
use super::pixel_moments::PixelMoments;
use super::repeated;
use super::spaces::{Channels, Curved, OTHER_COLORS, is_curved, white};
use super::tails;
use super::tap_lines::{Lit, TapLines};
use super::tapped::{TapMoments, TappedPixels};
use super::tapped_flat;
use super::taps::{self, Group, TappedSites};
use super::unpredictable::{OFFSETS_TOO_LONG, TOO_LONG};
pub use super::unpredictable::{Predicted, Unpredictable};
use crate::color;
use crate::metadata::{AverageRecord, FrameHeader};
use crate::names::Named;
use crate::stages::demosaic::Method;
use crate::units::QuantityKind;
use nalgebra::Matrix3;

/// Predicted moments of a frame.
#[derive(Debug, Clone, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "one is made of a frame")]
pub enum FramePrediction {
    /// Classes that are drawn apart: R, G and B before demosaicking.
    Planes([Prediction; 3]),
    /// Such classes in groups, one for each of the amplifiers that have read the frame.
    Groups(TappedSites),
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
/// #     true_xyz: None,
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
    let of_one = |frame: &FrameHeader, equations| {
        let sites = Sites::of(frame, equations)?;
        Ok((sites.lit(), sites.moments, sites.average(frame)?))
    };
    if let Some(sites) = taps::sites(frame, equations, of_one)? {
        return Ok(FramePrediction::Groups(sites));
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

/// The same for how samples scatter: where photosites follow what their rows and columns share on a curve, or where these drift over a flat
/// field, whose level hangs on its rows, by their places, as those of several amplifiers are told, which [`of_frame`] does not tell apart. So
/// are pixels.
///
/// # Errors
///
/// As [`of_frame`].
pub fn of_samples(frame: &FrameHeader, equations: Equations) -> Predicted<FramePrediction> {
    let found = of_frame(frame, equations)?;
    if !found.has_lines() {
        return Ok(found);
    }
    let sites = Sites::of(frame, equations)?;
    let drifts = sites.photosite.drifts() && sites.photosite.flat.is_some();
    if drifts {
        return by_place(frame, equations, &sites, found);
    }
    if !sites.photosite.bends_lines(sites.expected_e)? {
        return Ok(found);
    }
    let by_places = match &found {
        FramePrediction::Planes(moments) => {
            taps::one_group(frame, &sites.lit(), *moments, sites.average(frame)?.as_ref(), false)?
                .map(FramePrediction::Groups)
        }
        FramePrediction::Pixels(moments) => {
            let method = frame.metadata.demosaic.as_ref().and_then(|record| Method::named(&record.method));
            let is_by_hue = method == Some(Method::SmoothHue);
            let pixels = pixels_by_place(frame, equations).ok();
            let pixels = pixels.map(|pixels| if is_by_hue { pixels.with_moments(moments) } else { pixels });
            pixels.map(|pixels| FramePrediction::Tapped(Box::new(pixels)))
        }
        FramePrediction::Groups(_) | FramePrediction::Tapped(_) => None,
    };
    Ok(by_places.unwrap_or(found))
}

/// What is `found` of a frame, by its places.
fn by_place(
    frame: &FrameHeader,
    equations: Equations,
    sites: &Sites,
    found: FramePrediction,
) -> Predicted<FramePrediction> {
    Ok(match found {
        FramePrediction::Planes(moments) => {
            let average = sites.average(frame)?;
            let group = taps::one_group(frame, &sites.lit(), moments, average.as_ref(), true)?;
            group.map_or(FramePrediction::Planes(moments), FramePrediction::Groups)
        }
        FramePrediction::Pixels(moments) => {
            let method = frame.metadata.demosaic.as_ref().and_then(|record| Method::named(&record.method));
            let pixels = pixels_by_place(frame, equations)?;
            let pixels = if method == Some(Method::SmoothHue) { pixels.with_moments(&moments) } else { pixels };
            FramePrediction::Tapped(Box::new(pixels))
        }
        by_taps => by_taps,
    })
}

impl FramePrediction {
    /// Whether photosites of rows or columns share something, of a frame that one amplifier has read.
    pub fn has_lines(&self) -> bool {
        let sites = match self {
            Self::Planes(sites) => sites,
            Self::Pixels(pixels) => &pixels.sites,
            Self::Groups(_) | Self::Tapped(_) => return false,
        };
        sites.iter().any(|site| site.lines != LineCovariance::default())
    }
}

/// What of the covariance of the channels of a pixel is the same in every exposure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FixedPart {
    /// To first order.
    pub first_order: Matrix3<f64>,
    /// With what is curved in a color, where that is told.
    pub covariance: Matrix3<f64>,
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
        let ground = Ground::of(frame, equations)?;
        let (frame, photosite, expected_e) = (&*ground.frame, ground.photosite, ground.smeared.expected_e);
        let mut moments = ground.moments()?;
        if moments.iter().any(|site| site.moments.variance.is_nan()) {
            return Err(Unpredictable::Beyond(if photosite.has_tails() { TOO_LONG } else { OFFSETS_TOO_LONG }));
        }
        if ground.quantity != QuantityKind::ExpectedElectrons {
            let lines = photosite.lines(expected_e)?;
            if frame.metadata.is_transferred() && lines != [LineCovariance::default(); 3] {
                return Err(Unpredictable::Beyond("charge transfer before rows and columns that share noise"));
            }
            moments.iter_mut().zip(lines).for_each(|(moments, lines)| moments.lines = lines);
            // What several amplifiers make of a level is told of all together.
            let is_of_one = frame.metadata.correction.as_ref().and_then(|correction| correction.flat.as_ref());
            let is_of_one = is_of_one.is_none_or(|flat| flat.converters.is_empty());
            let levels = [photosite.level_covariance(expected_e), photosite.level_of_drift(expected_e, frame)];
            for (k, moments) in moments.iter_mut().enumerate() {
                moments.lines.level =
                    [0, 1, 2].map(|l| if is_of_one { levels[0][k][l] + levels[1][k][l] } else { 0.0 });
            }
            if frame.geometry.channels.len() == 3 && frame.metadata.demosaic.is_none() {
                let beyond = photosite.beyond_lines(expected_e, &lines)?;
                moments.iter_mut().zip(beyond).for_each(|(moments, together)| moments.lines.together = together);
            }
        }
        let sites = Self { photosite, expected_e, moments };
        let sites = match &frame.metadata.average {
            None => sites,
            Some(record) => {
                let average = repeated::average_of(frame, record, ground.quantity)?;
                Self { moments: photosite.averaged(moments, expected_e, &average)?, ..sites }
            }
        };
        ground.smeared.check_even(&photosite, &sites.moments)?;
        Ok(sites)
    }

    fn lit(&self) -> Lit {
        (self.photosite, self.expected_e)
    }

    /// How the exposures were averaged that the frame of these photosites is made of; none where it is one exposure.
    fn average(&self, frame: &FrameHeader) -> Predicted<Option<AverageRecord>> {
        let of_sites = quantity_of_sites(frame);
        frame.metadata.average.as_ref().map(|record| repeated::average_of(frame, record, of_sites)).transpose()
    }

    /// Refuses frames whose photosites no formula tells, as far as that is known before anything is worked out.
    ///
    /// # Errors
    ///
    /// As [`of_frame`].
    pub fn check(frame: &FrameHeader, equations: Equations) -> Predicted<()> {
        let ground = Ground::of(frame, equations)?;
        if ground.quantity == QuantityKind::ExpectedElectrons {
            return Ok(());
        }
        ground.photosite.check_shared(ground.smeared.expected_e)
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

    /// The means that photosites of amplifiers have over exposures, which have such moments.
    ///
    /// # Errors
    ///
    /// As [`of_frame`].
    pub fn over_exposures(
        taps: &[(usize, [f64; 3], Self)],
        means: &[(usize, [Prediction; 3])],
    ) -> Predicted<TapMoments> {
        let lit: Vec<Lit> = taps.iter().map(|(_, _, sites)| sites.lit()).collect();
        let has_lines = lit.iter().any(|(photosite, _)| photosite.has_lines());
        let lines = if has_lines { Some(TapLines::fixed(&lit)?) } else { None };
        Ok(TapMoments::of(means, lines.as_ref()))
    }

    /// Predicts a frame that was made of these photosites; pixels say where their moments are void.
    ///
    /// # Errors
    ///
    /// As [`of_frame`].
    pub fn frame(&self, frame: &FrameHeader) -> Predicted<FramePrediction> {
        let metadata = &frame.metadata;
        if metadata.demosaic.is_none() {
            return Ok(FramePrediction::Planes(self.moments));
        }
        let straight = self.straight(frame)?;
        let pixels = match Curved::of(metadata)? {
            Some(space) => straight.to_color(space, self.photosite.equations)?,
            None => straight,
        };
        Ok(FramePrediction::Pixels(Box::new(pixels)))
    }

    /// Pixels of a demosaicked frame; of a space that is curved in XYZ these.
    fn straight(&self, frame: &FrameHeader) -> Predicted<PixelMoments> {
        let metadata = &frame.metadata;
        let record = metadata.demosaic.as_ref().ok_or(Unpredictable::Missing("demosaic"))?;
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
        let is_void = is_curved(metadata.quantity) && has_tails;
        let Some(record) = &metadata.color else {
            if metadata.quantity != quantity_of_sites(frame) {
                return Err(Unpredictable::Missing("color"));
            }
            return Ok(camera);
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
        let xyz = if is_void { PixelMoments { void: xyz.void.or(Some(tails::CURVED)), ..xyz } } else { xyz };
        match metadata.quantity {
            QuantityKind::LinearSrgb => Ok(xyz.through(&color::linear_srgb_from_xyz(white(metadata)?), 0.0)),
            QuantityKind::Xyz => Ok(xyz),
            curved if is_curved(curved) => Ok(xyz),
            _ => Err(Unpredictable::Beyond(OTHER_COLORS)),
        }
    }

    /// What of the covariance of pixels that were made of these photosites is the same in every exposure, by the variances of the means
    /// that photosites of each class have over exposures.
    ///
    /// # Errors
    ///
    /// As [`of_frame`].
    pub fn fixed(&self, frame: &FrameHeader, pixels: &PixelMoments, variances: [f64; 3]) -> Predicted<FixedPart> {
        let space = Curved::of(&frame.metadata)?.filter(|_| pixels.void.is_none());
        let means = self.means_over_exposures(variances, space.is_some())?;
        let first_order = gains::mean_pixel_covariance(&pixels.weights, &SiteCovariance::of(&means.moments));
        let covariance = match space {
            Some(space) => self.straight(frame)?.fixed_in(&means.straight(frame)?, |xyz| space.value(xyz)),
            None => first_order,
        };
        Ok(FixedPart { first_order, covariance })
    }

    /// Photosites whose samples are the means that these have over exposures; where it is asked, with cumulants beyond the second, and in
    /// the third cov(v, m), by which the variance v over exposures follows the mean m.
    ///
    /// # Errors
    ///
    /// As [`of_frame`].
    pub fn means_over_exposures(&self, variances: [f64; 3], is_told: bool) -> Predicted<Self> {
        let lines = self.photosite.fixed_lines(self.expected_e)?;
        let of_class = |k: usize| {
            let unlike = is_told.then(|| self.photosite.temporal(k, self.expected_e[k], true).unlike).flatten();
            let unlike = unlike.unwrap_or_default();
            let [third, fourth] = unlike.of_means.unwrap_or_default();
            let third = third + unlike.with_mean[0];
            let mean = self.moments[k].moments.mean;
            Prediction { lines: lines[k], ..Prediction::of_cumulants(mean, variances[k], third, fourth) }
        };
        Ok(Self { moments: [0, 1, 2].map(of_class), ..self.clone() })
    }
}

impl PixelMoments {
    /// XYZ in a space that is curved in them; void where noise is too large a share of them.
    fn to_color(&self, space: Curved, equations: Equations) -> Predicted<Self> {
        let local = space.about(self.mean)?;
        if equations == Equations::Paper {
            return Ok(self.linearized(&local));
        }
        let why = if space.is_quiet(self.mean, &self.covariance) {
            match self.curved(&local, |xyz| space.value(xyz)) {
                Some(curved) => return Ok(curved),
                None => curved::FAR_FROM_NORMAL,
            }
        } else {
            curved::VOID
        };
        Ok(Self { void: self.void.or(Some(why)), ..self.linearized(&local) })
    }
}

/// Why the paper says nothing of pixels of several amplifiers.
pub(super) const OF_ONE: &str =
    "the paper's sensor is read through one amplifier, and several (`taps`) have a part in its pixels";

/// Pixels of a frame that several amplifiers have a part in.
fn tapped(frame: &FrameHeader, equations: Equations) -> Predicted<TappedPixels> {
    let beyond = |why: &'static str| Err(Unpredictable::Beyond(why));
    if equations == Equations::Paper {
        return beyond(OF_ONE);
    }
    pixels_by_place(frame, equations)
}

/// Pixels of a frame by their places, of one amplifier or several.
fn pixels_by_place(frame: &FrameHeader, equations: Equations) -> Predicted<TappedPixels> {
    let metadata = &frame.metadata;
    let record = metadata.demosaic.as_ref().ok_or(Unpredictable::Missing("demosaic"))?;
    let beyond = |why: &'static str| Err(Unpredictable::Beyond(why));
    let (mut groups, mut lit, mut average) = (Vec::new(), Vec::new(), None);
    for part in taps::parts(&taps::with_footprint(frame)) {
        let of_tap = FrameHeader { geometry: frame.geometry.clone(), ..part.frame };
        let sites = Sites::of(&of_tap, equations)?;
        let is_by_hue = Method::named(&record.method) == Some(Method::SmoothHue);
        if sites.photosite.has_tails() && (is_by_hue || is_curved(metadata.quantity)) {
            return beyond(tails::CURVED);
        }
        lit.push(sites.lit());
        average = sites.average(&of_tap)?;
        groups.push((part.tap, Group { counts: part.counts, sites: sites.moments }));
    }
    let moments: Vec<[Prediction; 3]> = groups.iter().map(|(_, group)| group.sites).collect();
    let is_shared = moments.iter().flatten().any(|site| site.lines != LineCovariance::default());
    let lines = if is_shared { TapLines::of(&lit, &moments, average.as_ref())? } else { None };
    let black = subtracted(record.black, record.black_deltas)?;
    let channels = Channels::of(metadata, quantity_of_sites(frame))?;
    let level = match tapped_flat::flat_of(frame).filter(|_| frame.taps().is_some()) {
        Some(flat) => taps::level_of_flat(frame, flat, |frame| {
            let sites = Sites::of(frame, equations)?;
            Ok((sites.lit(), sites.moments))
        })?,
        None => taps::level(&groups.iter().map(|(_, group)| *group).collect::<Vec<_>>()),
    };
    Ok(TappedPixels::of(frame, &channels, black, &groups, lines.as_ref())?.with_level(&level))
}
