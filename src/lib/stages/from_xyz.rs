//! From CIE XYZ that are there already to other spaces, under another white, with their covariances.

use super::to_xyz::{check_white, needs_white, place, planes_of};
use crate::color::adaptation::Adaptation;
use crate::color::coordinates::Coordinates;
use crate::color::temperature::Locus;
use crate::color::{Space, White, chromaticity};
use crate::error::{Error, Result};
use crate::frame::{Rows, Window, to_sample};
use crate::metadata::{AdaptationRecord, ColorRecord, Coverage, FrameHeader};
use crate::stream::{Counts, Stage};
use crate::units::{QuantityKind, RELATIVE_UNIT, Tristimulus};
use nalgebra::{Matrix3, Vector3};
use std::sync::Arc;

/// Channels of the layer of covariances of XYZ.
pub const COVARIANCE_LAYER: [&str; 6] =
    ["covariance.XX", "covariance.XY", "covariance.XZ", "covariance.YY", "covariance.YZ", "covariance.ZZ"];

/// Places of the covariances in a symmetric matrix, in the order of [`COVARIANCE_LAYER`].
const PAIRS: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

/// The layers that tell the uncertainty of a space.
///
/// # Errors
///
/// [`Error::Usage`] for sRGB, a picture.
pub fn layers_of(space: Space) -> Result<Vec<&'static str>> {
    match space {
        Space::Xyz => Ok(COVARIANCE_LAYER.into_iter().chain(["sigma.R", "sigma.G", "sigma.B"]).collect()),
        Space::Xyy => Ok(vec!["sigma.x", "sigma.y", "sigma.Y"]),
        Space::Lab => Ok(vec!["sigma.L", "sigma.a", "sigma.b"]),
        Space::Luv => Ok(vec!["sigma.L", "sigma.u", "sigma.v"]),
        Space::Cct => Ok(vec!["sigma.CCT", "sigma.Duv", "sigma.Y"]),
        Space::LinearSrgb => Ok(vec!["sigma.R", "sigma.G", "sigma.B"]),
        Space::Srgb => Err(Error::Usage(
            "standard deviations are those of xyz, xyy, lab, luv, cct or linear-srgb; srgb is a picture to look at"
                .into(),
        )),
    }
}

/// An adaptation from the light of the colors to another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Adapting {
    /// The transform.
    pub transform: Adaptation,
    /// Chromaticity of the light that the colors have.
    pub from_xy: [f64; 2],
    /// Chromaticity of the light that they get.
    pub to_xy: [f64; 2],
}

impl Adapting {
    /// Its matrix.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for a light that the transform does not know.
    pub fn matrix(&self) -> Result<Matrix3<f64>> {
        self.transform.between(self.from_xy, self.to_xy).map_err(Error::Usage)
    }

    /// What colors are referred to where no white is named.
    pub fn white(self) -> White {
        White::of_chromaticity(self.to_xy)
    }

    /// The record of it.
    pub fn record(self) -> AdaptationRecord {
        let Self { transform, from_xy, to_xy } = self;
        AdaptationRecord { transform, from_xy, to_xy }
    }
}

/// What a user may set of the conversion of XYZ.
#[derive(Debug, Clone)]
pub struct XyzSettings {
    /// The space.
    pub space: Space,
    /// The white of L*a*b*, L*u*v* and sRGB; by default the light that colors are adapted to, that which the frame records, or D65.
    pub white: Option<White>,
    /// Luminance of a white that is not given as XYZ, cd m⁻²; by default that which the frame records.
    pub white_luminance: Option<f64>,
    /// The adaptation that comes first.
    pub adapting: Option<Adapting>,
    /// The black bodies of [`Space::Cct`].
    pub locus: Option<Arc<Locus>>,
}

/// Turns XYZ into the colors of another space, adapted to another light first where that is asked for.
///
/// A frame whose channels behind the first three are [`COVARIANCE_LAYER`] gets its uncertainty carried along, to first order:
/// Σ′ = J A Σ Aᵀ Jᵀ, A the adaptation, J the Jacobian of the space.
#[derive(Debug, Clone)]
pub struct FromXyz {
    header: FrameHeader,
    coordinates: Coordinates,
    adaptation: Matrix3<f64>,
    has_covariance: bool,
}

impl FromXyz {
    /// The conversion of `input`.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] unless the frame holds three planes of XYZ, or where nothing tells the luminance of the white;
    /// [`Error::Usage`] for an impossible white or light, and a luminance of relative XYZ.
    pub fn new(input: &FrameHeader, settings: &XyzSettings) -> Result<Self> {
        let holds = input.holds();
        // Other programs name the planes by what they hold.
        let is_named = input.geometry.channels.iter().take(3).eq(["X", "Y", "Z"]);
        if input.metadata.quantity != QuantityKind::Xyz || !(is_named || input.leads_with_three_planes()) {
            return Err(input.refuse(format!("it holds {holds}, not three planes of XYZ")));
        }
        let space = settings.space;
        let white = reference_white(input, settings)?;
        // What is recorded must be a white, whatever the space.
        check_white(if settings.names_white() { Space::Lab } else { space }, white)?;
        let has_covariance = input.geometry.channels[3..].iter().eq(COVARIANCE_LAYER.iter()) && space != Space::Srgb;
        let adaptation = settings.adapting.map_or(Ok(Matrix3::identity()), |adapting| adapting.matrix())?;

        let (quantity, channels) = planes_of(space);
        let is_relative = input.metadata.unit == RELATIVE_UNIT;
        let mut metadata = input.metadata.becoming(quantity);
        if is_relative {
            metadata.unit = quantity.relative_unit().into();
        }
        let mut geometry = input.geometry.with_channels(&channels);
        if has_covariance {
            geometry.channels.extend(layers_of(space)?.into_iter().map(str::to_owned));
            metadata.uncertainty = input.metadata.uncertainty.clone().or_else(|| Some(Coverage::noise_only(None)));
        }
        let has_white = input.metadata.color.as_ref().is_some_and(|color| color.white.is_some());
        let is_recorded = needs_white(space) || settings.names_white() || settings.adapting.is_some() && has_white;
        if is_recorded || settings.adapting.is_some() {
            let record = metadata.color.get_or_insert_with(ColorRecord::of_xyz);
            if is_recorded {
                record.white = Some(white);
            }
            if let Some(adapting) = settings.adapting {
                record.adapt(adapting.record(), &adaptation);
            }
        }
        let header = FrameHeader { name: input.name.clone(), geometry, metadata };
        let coordinates = Coordinates::new(space, white, settings.locus.clone());
        Ok(Self { header, coordinates, adaptation, has_covariance })
    }

    /// The head of the converted frame, to add to.
    pub fn header_mut(&mut self) -> &mut FrameHeader {
        &mut self.header
    }

    /// Whether the uncertainty of the colors comes along.
    pub fn has_covariance(&self) -> bool {
        self.has_covariance
    }

    /// The layers of a pixel: of XYZ the covariances, then the standard deviations.
    fn layers(&self, xyz: [f64; 3], covariance: [f64; 6]) -> impl Iterator<Item = f64> {
        let [xx, xy, xz, yy, yz, zz] = covariance;
        let whole = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        let jacobian = self.coordinates.jacobian(xyz);
        let through = |jacobian: Matrix3<f64>| jacobian * whole * jacobian.transpose();
        let made = jacobian.map_or_else(
            || {
                let of_luminance = through(self.adaptation)[(1, 1)];
                Matrix3::from_diagonal(&self.coordinates.variances_without_chromaticity(xyz, of_luminance).into())
            },
            |jacobian| through(jacobian * self.adaptation),
        );
        let shown = if self.coordinates.space() == Space::Xyz { PAIRS.len() } else { 0 };
        let covariances = PAIRS.map(|pair| made[pair]);
        // The larger of a NaN and 0 would be 0.
        let stds = [0, 1, 2].map(|k| if made[(k, k)].is_nan() { f64::NAN } else { made[(k, k)].max(0.0).sqrt() });
        covariances.into_iter().take(shown).chain(stds)
    }
}

impl XyzSettings {
    /// Whether a white is asked for, be it for spaces whose numbers do not hang on it: it is recorded, and `--viewable` scales by it.
    fn names_white(&self) -> bool {
        self.white.is_some() || self.white_luminance.is_some()
    }
}

/// XYZ of the white that colors refer to.
fn reference_white(input: &FrameHeader, settings: &XyzSettings) -> Result<[f64; 3]> {
    let metadata = &input.metadata;
    let is_relative = metadata.unit == RELATIVE_UNIT;
    if is_relative && settings.white_luminance.is_some() {
        let mut problem = "its XYZ are relative: the white has Y = 1 and no luminance in cd/m2".to_owned();
        if metadata.history.is_empty() {
            problem += ", unless metadata with `unit: cd m-2` say otherwise";
        }
        return Err(input.refuse(problem).leave_out(&["white_luminance"]));
    }
    let recorded = metadata.color.as_ref().and_then(|color| color.white);
    let of_frame = || if is_relative { Some(1.0) } else { recorded.map(|white| white[1]) };
    // What is white in the scene has become the light that colors are adapted to.
    let adapted = settings.adapting.map(Adapting::white);
    let (white, recorded) =
        if adapted.is_some() { (settings.white.or(adapted), None) } else { (settings.white, recorded) };
    let named = white.unwrap_or_default();
    match (white, recorded, settings.white_luminance.or_else(of_frame)) {
        (Some(White::Absolute(white)), ..) => Ok(white),
        (None, Some(white), _) if settings.white_luminance.is_none() => Ok(white),
        (None, Some(white), Some(luminance)) => Ok(white.map(|value| value * luminance / white[1])),
        (.., Some(luminance)) => Ok(named.xyz(luminance)),
        _ if !needs_white(settings.space) && !settings.names_white() => Ok(named.xyz(1.0)),
        _ => {
            let problem = "nothing tells how bright white is in it";
            Err(input.refuse(problem).give(&["white_luminance"]))
        }
    }
}

/// The light of a frame's colors, where its metadata know it.
pub fn scene_white(frame: &FrameHeader) -> Option<[f64; 2]> {
    let metadata = &frame.metadata;
    let recorded = metadata.color.as_ref().and_then(|color| color.scene_white_xy);
    let of_raw = || metadata.relative_matrix.as_ref().filter(|_| metadata.is_relative()).map(|matrix| matrix.white_xy);
    recorded.or_else(of_raw)
}

/// The chromaticity of a white given as XYZ.
///
/// # Errors
///
/// [`Error::Usage`] where it has none.
pub fn checked_xy(white: [f64; 3]) -> Result<[f64; 2]> {
    if white.iter().all(|value| *value > 0.0 && value.is_finite()) {
        return Ok(chromaticity(white));
    }
    let [x, y, z] = white;
    Err(Error::Usage(format!("a white of XYZ {x} {y} {z} is impossible; all three must be above 0")))
}

impl Stage for FromXyz {
    type Input = Tristimulus;
    type Output = Tristimulus;

    fn header(&self) -> &FrameHeader {
        &self.header
    }

    fn apply(&self, input: Window<'_, Tristimulus>, mut output: Rows<'_, Tristimulus>) -> Counts {
        let mut counts = Counts::default();
        let width = input.width();
        for y in output.range() {
            let row = |channel| input.row(y.cast_signed(), channel);
            let planes = [0, 1, 2].map(row);
            let covariances = if self.has_covariance { [3, 4, 5, 6, 7, 8].map(row) } else { [&[][..]; 6] };
            let (mut made, layers) = output.three_and_rest(y);
            for x in 0..width {
                let xyz = planes.map(|plane| f64::from(plane[x]));
                let xyz: [f64; 3] = (self.adaptation * Vector3::from(xyz)).into();
                let color = place(&self.coordinates, xyz, &mut counts);
                for (plane, value) in made.iter_mut().zip(color) {
                    plane[x] = to_sample(value);
                }
                if self.has_covariance {
                    let covariance = covariances.map(|plane| f64::from(plane[x]));
                    for (layer, value) in self.layers(xyz, covariance).enumerate() {
                        layers[layer * width + x] = to_sample(value);
                    }
                }
            }
        }
        counts
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::{D50_XY, D65_XY};
    use crate::formats::data::load_observer;
    use crate::frame::Geometry;
    use crate::metadata::Metadata;
    use crate::stream::MemoryFrame;

    fn settings(space: Space) -> XyzSettings {
        let locus = Some(Arc::new(Locus::new(&load_observer().unwrap())));
        XyzSettings { space, white: Some(White::D65), white_luminance: Some(100.0), adapting: None, locus }
    }

    /// One pixel of XYZ with covariances.
    fn pixel(xyz: [f32; 3], covariance: Option<[f32; 6]>) -> MemoryFrame {
        let names: Vec<&str> = ["R", "G", "B"].into_iter().chain(COVARIANCE_LAYER).collect();
        let channels = if covariance.is_some() { &names[..] } else { &names[..3] };
        let geometry = Geometry::new(1, 1, channels);
        let header = FrameHeader { name: "xyz".into(), geometry, metadata: Metadata::new(QuantityKind::Xyz) };
        MemoryFrame::new(header, xyz.into_iter().chain(covariance.into_iter().flatten()).collect())
    }

    fn through(frame: &MemoryFrame, settings: &XyzSettings) -> (MemoryFrame, Counts) {
        frame.through(&FromXyz::new(&frame.header, settings).unwrap()).unwrap()
    }

    /// A white is white everywhere, to the last digit of a sample but for the four decimals of sRGB; and it has a temperature.
    #[test]
    fn white_is_white_in_every_space() {
        let white = pixel([95.0456, 100.0, 108.9058], None);
        for (space, expected, tolerance) in [
            (Space::Xyz, [95.0456, 100.0, 108.9058], 1e-5),
            (Space::Xyy, [0.3127, 0.3290, 100.0], 1e-5),
            (Space::Lab, [100.0, 0.0, 0.0], 1e-3),
            (Space::Luv, [100.0, 0.0, 0.0], 1e-3),
            (Space::Cct, [6503.0, 0.0032, 100.0], 2.0),
            (Space::LinearSrgb, [1.0; 3], 3e-4),
            (Space::Srgb, [1.0; 3], 3e-4),
        ] {
            let (made, counts) = through(&white, &settings(space));
            for (value, expected) in made.samples.iter().zip(expected) {
                assert!((f64::from(*value) - expected).abs() < tolerance, "{space}: {:?}", made.samples);
            }
            assert_eq!((counts.not_finite, counts.off_locus), (0, 0));
        }
        let (_, counts) = through(&pixel([0.0, 100.0, 0.0], None), &settings(Space::Cct));
        assert_eq!((counts.not_finite, counts.off_locus), (0, 1));
    }

    /// What is white in the scene's light is white in that which colors are adapted to, whatever white the frame recorded; a white that is
    /// named counts.
    #[test]
    fn colors_refer_to_the_light_that_they_are_adapted_to() {
        const A_XY: [f64; 2] = [0.44758, 0.40745];
        let scene = White::Chromaticity(A_XY).xyz(80.0);
        let mut frame = pixel(scene.map(to_sample), None);
        frame.header.metadata.color = Some(ColorRecord { white: Some(White::D50.xyz(80.0)), ..ColorRecord::of_xyz() });
        let adapting = Some(Adapting { transform: Adaptation::Bradford, from_xy: A_XY, to_xy: D65_XY });
        let asked = |space, white| XyzSettings { white, white_luminance: None, adapting, ..settings(space) };
        let white_of = |made: &MemoryFrame| made.header.metadata.color.as_ref().unwrap().white.unwrap();
        let (lab, _) = through(&frame, &asked(Space::Lab, None));
        assert!(
            lab.samples.iter().zip([100.0, 0.0, 0.0]).all(|(made, wanted)| (made - wanted).abs() < 1e-3),
            "{:?}",
            lab.samples
        );
        let (xyz, _) = through(&frame, &asked(Space::Xyz, None));
        assert_eq!([white_of(&lab), white_of(&xyz)], [White::D65.xyz(80.0); 2]);
        let (named, _) = through(&frame, &asked(Space::Lab, Some(White::D50)));
        assert_eq!(white_of(&named), White::D50.xyz(80.0));
        assert!(named.samples[2] < -10.0, "{:?}", named.samples);
    }

    /// A chromaticity that is white's for want of one is not known at all; luminance and lightness are.
    #[test]
    fn colors_without_chromaticity_have_no_end_of_uncertainty() {
        let (of_luminance, infinite) = (0.04_f32, f32::INFINITY);
        let frame = pixel([-9.0, -1.0, 2.0], Some([1.0, 0.0, 0.0, of_luminance, 0.0, 1.0]));
        // L* is straight below (6/29)³ of white: 903.3 Y/Yₙ.
        let of_lightness = 0.2 * 9.033;
        for (space, expected) in
            [(Space::Xyy, [infinite, infinite, 0.2]), (Space::Luv, [of_lightness, infinite, infinite])]
        {
            let (made, counts) = through(&frame, &settings(space));
            assert_eq!((counts.no_chromaticity, counts.not_finite), (1, 0));
            for (found, expected) in made.samples[3..].iter().zip(expected) {
                assert!(*found == expected || (found / expected - 1.0).abs() < 1e-4, "{space}: {:?}", made.samples);
            }
        }
        assert_eq!(through(&frame, &settings(Space::Lab)).1.no_chromaticity, 0);
    }

    /// Covariances against small shifts along a column of a factor of Σ = f fᵀ: a space that is smooth moves by J f.
    #[test]
    fn covariances_come_along() {
        let (xyz, f) = ([40.0, 30.0, 20.0], [2e-2, -1e-2, 3e-2]);
        let product = |(i, j): (usize, usize)| to_sample(f[i] * f[j]);
        let adapting = Adapting { transform: Adaptation::Cat16, from_xy: D65_XY, to_xy: D50_XY };
        for space in [Space::Xyz, Space::Xyy, Space::Lab, Space::Luv, Space::Cct, Space::LinearSrgb] {
            for adapting in [None, Some(adapting)] {
                let settings = XyzSettings { adapting, ..settings(space) };
                let made = through(&pixel(xyz.map(to_sample), Some(PAIRS.map(product))), &settings).0;
                let shift = adapting.map_or(Matrix3::identity(), |by| by.matrix().unwrap());
                let at = |by: f64| {
                    let moved = Vector3::from(xyz) + Vector3::from(f) * by;
                    Coordinates::new(space, White::D65.xyz(100.0), settings.locus.clone())
                        .of((shift * moved).into())
                        .value
                };
                let (low, high) = (at(-1.0), at(1.0));
                let stds = &made.samples[made.samples.len() - 3..];
                let largest = (0..3).map(|k| (high[k] - low[k]).abs() / 2.0).fold(0.0, f64::max);
                for k in 0..3 {
                    let expected = (high[k] - low[k]).abs() / 2.0;
                    // Curvature, over 10⁻³ of the color, and the digits of the samples, whose squares cancel.
                    assert!(
                        (f64::from(stds[k]) - expected).abs() < 2e-3 * expected + 3e-4 * largest,
                        "{space}: {stds:?} {k}"
                    );
                }
            }
        }
    }

    #[test]
    fn the_light_that_colors_were_adapted_to_is_recorded() {
        let adapting = Adapting { transform: Adaptation::Bradford, from_xy: D65_XY, to_xy: D50_XY };
        let frame = pixel([95.0456, 100.0, 108.9058], None);
        let settings = XyzSettings { adapting: Some(adapting), ..settings(Space::Xyz) };
        let made = through(&frame, &settings).0;
        let white = White::D50.xyz(100.0);
        assert!(made.samples.iter().zip(white).all(|(made, white)| (f64::from(*made) - white).abs() < 1e-3));
        let record = made.header.metadata.color.clone().unwrap();
        assert_eq!((record.scene_white_xy, record.adapted), (Some(D50_XY), Some(adapting.record())));
        assert_eq!(scene_white(&made.header), Some(D50_XY));
    }

    #[test]
    fn what_tells_no_white_is_refused() {
        let frame = pixel([1.0; 3], None);
        let said = |settings: XyzSettings| FromXyz::new(&frame.header, &settings).unwrap_err().to_string();
        assert!(said(XyzSettings { white_luminance: None, ..settings(Space::Lab) }).contains("how bright white is"));
        assert!(
            FromXyz::new(&frame.header, &XyzSettings { white: None, white_luminance: None, ..settings(Space::Xyy) })
                .is_ok()
        );
        let white = Some(White::Absolute([1.0, 0.0, 1.0]));
        assert!(said(XyzSettings { white, ..settings(Space::Luv) }).contains("is impossible"));
        let mut relative = frame.header.clone();
        relative.metadata.unit = RELATIVE_UNIT.into();
        assert!(FromXyz::new(&relative, &settings(Space::Lab)).unwrap_err().to_string().contains("are relative"));
        let mut camera = frame.header.clone();
        camera.metadata.quantity = QuantityKind::Adu;
        assert!(FromXyz::new(&camera, &settings(Space::Lab)).is_err());
    }
}
