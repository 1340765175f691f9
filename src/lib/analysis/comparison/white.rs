//! Which space the colors of a frame are in, and which white they are seen under.

use crate::color::{D65_XY, Space, White, xyz_of_chromaticity};
use crate::error::{Error, Result};
use crate::frame::bare_name;
use crate::metadata::FrameHeader;
use crate::units::QuantityKind;

/// Luminance of the white of colors that are given as numbers and name none: the 100 of CIE tables, cd m⁻².
pub const NUMBERS_WHITE_LUMINANCE: f64 = 100.0;

/// Names of the planes that a frame of colors can lead with; L\*a\*b\* and xyY name themselves.
const PLANES: [([&str; 3], Option<Space>); 4] = [
    (["R", "G", "B"], None),
    (["X", "Y", "Z"], None),
    (["x", "y", "Y"], Some(Space::Xyy)),
    (["L", "a", "b"], Some(Space::Lab)),
];

/// What a user may set of a comparison.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ComparisonSettings {
    /// What frames without metadata hold, and colors given as numbers are; XYZ where none is given.
    pub space: Option<Space>,
    /// The white of XYZ and xyY.
    pub white: Option<White>,
    /// Luminance of the white in cd m⁻².
    pub white_luminance: Option<f64>,
}

/// The space of a frame's colors: as its metadata say; or as was stated; or as its channels are called; or XYZ.
pub(super) fn space_of(frame: &FrameHeader, stated: Option<Space>) -> Result<Space> {
    let holds = frame.holds();
    let channels = frame.geometry.channels.iter().map(|name| bare_name(name)).take(3);
    let named = PLANES.iter().find(|(planes, _)| channels.clone().eq(*planes));
    let space = match frame.metadata.quantity {
        QuantityKind::Xyz => Space::Xyz,
        QuantityKind::Xyy => Space::Xyy,
        QuantityKind::Lab => Space::Lab,
        QuantityKind::Unspecified => stated.or(named.and_then(|(_, space)| *space)).unwrap_or(Space::Xyz),
        QuantityKind::ExpectedElectrons | QuantityKind::Electrons | QuantityKind::Adu => {
            return Err(frame.out_of_order(format!("it holds {holds}, not colors"), "to-xyz"));
        }
        QuantityKind::Srgb => {
            return Err(frame.refuse(format!(
                "it holds {holds}, a picture whose colors may be clipped; compare the frames that it was made of, behind `to-xyz --space lab`"
            )));
        }
        QuantityKind::Luv | QuantityKind::Cct | QuantityKind::LinearSrgb => {
            return Err(frame.refuse(format!("it holds {holds}; compare XYZ, xyY or L*a*b*")));
        }
        QuantityKind::SpectralRadiance => {
            return Err(frame.out_of_order(format!("it holds {holds}, not colors"), "render-radiance"));
        }
        QuantityKind::ColorDifference => {
            return Err(frame.refuse(format!("it holds {holds}; give the images that it was made of")));
        }
    };
    match named {
        Some(_) => Ok(space),
        None => Err(frame.refuse(format!("it holds {holds}; a color is three planes, the first three channels"))),
    }
}

/// Whether two whites are equal but for what a text with seven digits may have lost.
fn agree(a: [f64; 3], b: [f64; 3]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-6 * b.abs())
}

fn in_words([x, y, z]: [f64; 3]) -> String {
    format!("XYZ {x:.6} {y:.6} {z:.6}")
}

/// Refuses relative XYZ beside absolute ones, and a luminance of their white. Two of L\*a\*b\* are beyond scales.
fn check_scales(headers: [Option<&FrameHeader>; 2], spaces: [Space; 2], settings: &ComparisonSettings) -> Result<()> {
    let is_relative = |header: &FrameHeader| header.metadata.is_relative();
    if spaces == [Space::Lab; 2] {
        return Ok(());
    }
    let known = headers.map(|header| header.filter(|header| header.metadata.quantity != QuantityKind::Unspecified));
    if let [Some(first), Some(second)] = known
        && is_relative(first) != is_relative(second)
    {
        let scale = |header| if is_relative(header) { "relative" } else { "absolute" };
        return Err(second.refuse(format!(
            "its colors are {}, those of {} {}; make both with matrices of one unit",
            scale(second),
            first.name,
            scale(first)
        )));
    }
    match headers.into_iter().flatten().find(|header| is_relative(header)) {
        Some(frame) if settings.white_luminance.is_some() => {
            let problem = "its XYZ are relative: the white has Y = 1 and no luminance in cd/m2";
            Err(frame.refuse(problem).leave_out(&["white_luminance"]))
        }
        _ => Ok(()),
    }
}

/// The white that XYZ and xyY are seen under; none where both are L\*a\*b\*.
///
/// It is the one asked for, else that of a frame of L\*a\*b\*, else that which the reference or the other records, else D65. Where
/// only its luminance is asked for, it is scaled.
pub(super) fn white(
    headers: [Option<&FrameHeader>; 2],
    spaces: [Space; 2],
    settings: &ComparisonSettings,
) -> Result<Option<[f64; 3]>> {
    check_scales(headers, spaces, settings)?;
    let recorded = [0, 1].map(|i| {
        let header: &FrameHeader = headers[i]?;
        Some((header, header.metadata.color.as_ref()?.white?))
    });
    let is_lab = spaces.map(|space| space == Space::Lab);
    let of_lab = [0, 1].map(|i| recorded[i].filter(|_| is_lab[i]));
    if let [Some((first, a)), Some((second, b))] = of_lab
        && !agree(a, b)
    {
        return Err(second.refuse(format!(
            "its L*a*b* refer to the white {}, those of {} to {}; make both with the same `to-xyz --white`",
            in_words(b),
            first.name,
            in_words(a)
        )));
    }
    if is_lab == [true, true] {
        return Ok(None);
    }
    let of_lab = of_lab[0].or(of_lab[1]);
    let known = of_lab.or(recorded[0]).or(recorded[1]).map(|(_, white)| white);
    let luminance = || {
        let unknown = (0..2).find_map(|i| headers[i].filter(|_| !is_lab[i]));
        match (settings.white_luminance.or(known.map(|white| white[1])), unknown) {
            (Some(luminance), _) => Ok(luminance),
            (None, Some(frame)) if frame.metadata.is_relative() => Ok(1.0),
            (None, Some(frame)) => Err(frame.missing("color.white")),
            (None, None) => Ok(NUMBERS_WHITE_LUMINANCE),
        }
    };
    let white = match (settings.white, known) {
        (Some(White::Absolute(_)), _) if settings.white_luminance.is_some() => {
            return Err(
                Error::Usage("a white of X,Y,Z has its luminance already".into()).leave_out(&["white_luminance"])
            );
        }
        (Some(White::Absolute(white)), _) => white,
        (Some(white @ (White::EqualEnergy | White::D50 | White::Chromaticity(_))), _) => white.xyz(luminance()?),
        (None, Some(known)) => match settings.white_luminance {
            Some(luminance) => known.map(|value| value * luminance / known[1]),
            None => known,
        },
        (Some(White::D65) | None, _) => xyz_of_chromaticity(D65_XY, luminance()?),
    };
    if !white.iter().all(|&value| value > 0.0 && value.is_finite()) {
        return Err(Error::Usage(format!("a white of {} is impossible; all three must be above 0", in_words(white))));
    }
    match of_lab {
        Some((frame, other)) if !agree(other, white) => {
            let problem = format!("its L*a*b* refer to the white {}, not to {}", in_words(other), in_words(white));
            Err(frame.refuse(problem).leave_out(&["white", "white_luminance"]))
        }
        _ => Ok(Some(white)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Geometry;
    use crate::metadata::Metadata;

    #[test]
    fn frames_say_what_they_hold_or_are_refused() {
        let space = |quantity, channels: &[&str], stated| {
            let geometry = Geometry::new(2, 1, channels);
            let header = FrameHeader { name: "frame".into(), geometry, metadata: Metadata::new(quantity) };
            space_of(&header, stated).map_err(|error| error.to_string())
        };
        use QuantityKind::{Adu, ColorDifference, Lab, Srgb, Unspecified, Xyy, Xyz};
        assert_eq!(space(Xyz, &["R", "G", "B", "sigma.R"], Some(Space::Lab)), Ok(Space::Xyz));
        assert_eq!(space(Lab, &["R", "G", "B"], None), Ok(Space::Lab));
        assert_eq!(space(Xyy, &["x", "y", "Y"], None), Ok(Space::Xyy));
        assert_eq!(space(Unspecified, &["left.R", "left.G", "left.B"], None), Ok(Space::Xyz));
        assert_eq!(space(Unspecified, &["R", "G", "B", "A"], Some(Space::Lab)), Ok(Space::Lab));
        assert_eq!(space(Unspecified, &["L", "a", "b"], None), Ok(Space::Lab));
        for (quantity, channels) in [(Unspecified, &["Y"][..]), (Xyz, &["Y"]), (Unspecified, &["C0", "C1", "C2"])] {
            assert!(space(quantity, channels, None).is_err_and(|error| error.contains("three planes")));
        }
        let first = space(Adu, &["R", "G", "B"], None).unwrap_err();
        assert_eq!(first, "frame: it holds three planes of ADU, not colors; run `to-xyz` first");
        assert!(space(Srgb, &["R", "G", "B"], None).is_err_and(|error| error.contains("to-xyz --space lab")));
        assert!(space(ColorDifference, &["delta_e_2000", "delta_e_76", "delta_e_94", "jnd"], None).is_err());
    }
}
