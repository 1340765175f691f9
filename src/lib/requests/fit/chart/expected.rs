//! The colors that the patches of a chart have in a light.

use super::super::super::notes::Note;
use crate::analysis::chart::neutrals::neutral_white;
use crate::color::adaptation::Adaptation;
use crate::color::illuminant::Illuminant;
use crate::color::{chromaticity, lab_from_xyz, xyz_of_chromaticity};
use crate::error::{Error, Result};
use crate::formats::chart::{Colors, Light, Reference};
use crate::requests::values::LightColor;
use crate::spectrum::{Curve, Observer};
use nalgebra::Vector3;

/// So far about a light, C\*ab at the L\* of white, may the neutral patches of a reference lie that is for it: they are not quite neutral.
const MOST_OFF: f64 = 5.0;

/// Colors of patches in a light.
pub(super) struct Expected {
    pub(super) names: Vec<String>,
    pub(super) xyz: Vec<[f64; 3]>,
    pub(super) white: [f64; 3],
    /// The color of its neutral patches, Y = 1; none where it has too few.
    pub(super) neutral: Option<[f64; 3]>,
    pub(super) light: String,
    pub(super) notes: Vec<Note>,
}

impl Expected {
    /// The colors of a reference, which is for `of_reference`, in the light of the chart.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for reflectances without a light, and for lights that colors cannot be adapted to; those of [`Light::xyz`].
    pub(super) fn new(
        reference: &Reference,
        of_reference: LightColor,
        light: Option<Light>,
        observer: &Observer,
    ) -> Result<Self> {
        let from_xy = of_reference.xy(observer);
        let from_white = xyz_of_chromaticity(from_xy, 1.0);
        if let Colors::Reflectance(curves) = &reference.colors {
            return Self::of_curves(reference, curves, light, observer);
        }
        let colors = reference.colors_in(from_white).unwrap_or_default();
        let (source, of_reference) = (&reference.name, name_of(of_reference));
        let doubt = doubt_of_light(reference, &colors, from_white, &of_reference, observer);
        let Some(light) = light else {
            let text = format!("XYZ are those of the chart in the light of its reference, {of_reference}");
            let notes = doubt.into_iter().chain([Note::Remark(text)]).collect();
            return Ok(Self::of(reference, colors, from_white, of_reference, notes));
        };
        let white = match &light {
            Light::Illuminant(illuminant) => xyz_of_chromaticity(illuminant.white_xy(observer), 1.0),
            Light::Measured(..) => light.xyz(&[], observer)?.1,
        };
        let to_xy = chromaticity(white);
        let adaptation = Adaptation::Bradford.between(from_xy, to_xy).map_err(Error::Usage)?;
        let adapted = colors.into_iter().map(|xyz| (adaptation * Vector3::from(xyz)).into()).collect();
        let name = light.name();
        let told = (to_xy != from_xy).then(|| {
            Note::Warning(format!(
                "{source}: its colors are for {of_reference}; they are adapted to {name} by Bradford's transform, which is some \
                 Delta E off what reflectances would give"
            ))
        });
        Ok(Self::of(reference, adapted, white, name, doubt.into_iter().chain(told).collect()))
    }

    /// Those of reflectances.
    fn of_curves(reference: &Reference, curves: &[Curve], light: Option<Light>, observer: &Observer) -> Result<Self> {
        let Some(light) = light else {
            let problem = format!("{}: reflectances have a color in a light alone", reference.name);
            return Err(Error::Usage(problem).give(&["illuminant"]));
        };
        let (xyz, white) = light.xyz(curves, observer)?;
        Ok(Self::of(reference, xyz, white, light.name(), Vec::new()))
    }

    fn of(reference: &Reference, xyz: Vec<[f64; 3]>, white: [f64; 3], light: String, notes: Vec<Note>) -> Self {
        Self { names: reference.names.clone(), neutral: neutral_white(&xyz, white), xyz, white, light, notes }
    }
}

/// A light as messages call it.
fn name_of(light: LightColor) -> String {
    match light {
        LightColor::Illuminant(illuminant) => illuminant.to_string(),
        LightColor::Chromaticity([x, y]) => format!("x {x}, y {y}"),
    }
}

/// A warning of colors whose neutral patches have another light than the reference is said to be for, which is named where it is known.
fn doubt_of_light(
    reference: &Reference,
    colors: &[[f64; 3]],
    said: [f64; 3],
    name: &str,
    observer: &Observer,
) -> Option<Note> {
    let neutral = neutral_white(colors, said)?;
    let off = |white: [f64; 3]| {
        let [_, a, b] = lab_from_xyz(neutral, white);
        a.hypot(b)
    };
    if off(said) <= MOST_OFF {
        return None;
    }
    let lights = Illuminant::NAMED.map(|(name, light)| (name, off(xyz_of_chromaticity(light.white_xy(observer), 1.0))));
    let known = lights.into_iter().filter(|(_, off)| *off <= MOST_OFF).min_by(|(_, a), (_, b)| a.total_cmp(b));
    let [x, y] = chromaticity(neutral).map(|value| format!("{value:.4}"));
    let source = &reference.name;
    let lie = format!("{source}: its neutral patches lie at x {x}, y {y}");
    let text = match (&reference.colors, known) {
        (Colors::Lab(_), _) => format!("{lie}, which is not neutral about {name}, the white of its L*a*b*"),
        (_, Some((light, _))) => {
            format!(
                "{lie}, as in {light}, not in {name}, which its colors are taken to be for: give --reference-light {light}"
            )
        }
        (_, None) => {
            format!(
                "{lie}, not at {name}, which its colors are taken to be for: give the light that they are for, --reference-light {x},{y}"
            )
        }
    };
    Some(Note::Warning(text))
}
