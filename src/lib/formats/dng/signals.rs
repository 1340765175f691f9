//! The colors of a camera as a DNG tells them.

use super::tags::{D65, UNKNOWN_LIGHT};
use crate::color::illuminant::Illuminant;
use crate::color::{D65_XY, linear_srgb_from_xyz, matrix, rows_of, xyz_of_chromaticity};
use crate::formats::data::load_observer;
use crate::metadata::{Metadata, Scene, TakenAs};
use nalgebra::Vector3;

/// What leads from XYZ to the signals of a camera, and from these to a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CameraColor {
    /// The light that they are for, as Exif numbers it.
    pub illuminant: u16,
    /// Signals of R, G and B from XYZ, scaled so that the largest of the signals of white with Y = 1 is 1 \[DNG2023,
    /// ColorMatrix1].
    pub camera_from_xyz: [[f64; 3]; 3],
    /// The signals of the white of the scene, the largest 1.
    pub neutral: [f64; 3],
    /// Linear sRGB from signals; the neutral is white.
    pub srgb_from_camera: [[f64; 3]; 3],
}

impl CameraColor {
    /// Those of the sensor, for D65, and for the white of the scene where that is known; or of the raw file that a frame comes
    /// from, for the white of its exposure.
    pub fn of_frame(metadata: &Metadata) -> Option<Self> {
        let of_sensor = metadata.sensor.as_ref().and_then(|sensor| sensor.xyz_from_camera);
        let of_sensor = of_sensor.and_then(|matrix| {
            let of_scene = scene_white(metadata).and_then(|white_xy| Self::of(&matrix, (D65_XY, D65), white_xy));
            of_scene.or_else(|| Self::of(&matrix, (D65_XY, D65), D65_XY))
        });
        let of_raw = metadata.relative_matrix.as_ref();
        let of_raw =
            || of_raw.and_then(|raw| Self::of(&raw.xyz_from_camera, (raw.white_xy, UNKNOWN_LIGHT), raw.white_xy));
        of_sensor.or_else(of_raw)
    }

    /// Those of a matrix of any scale for a light, its chromaticity and number, and for the white of a scene; none where it has no
    /// inverse, or one of the two no signal in a class.
    pub fn of(
        xyz_from_camera: &[[f64; 3]; 3],
        (light_xy, illuminant): ([f64; 2], u16),
        white_xy: [f64; 2],
    ) -> Option<Self> {
        let inverse = matrix(xyz_from_camera).try_inverse()?;
        let signals = |xy: [f64; 2]| -> Option<Vector3<f64>> {
            let signals = inverse * Vector3::from(xyz_of_chromaticity(xy, 1.0));
            signals.iter().all(|signal| *signal > 0.0 && signal.is_finite()).then_some(signals)
        };
        let (of_light, of_white) = (signals(light_xy)?, signals(white_xy)?);
        let white = xyz_of_chromaticity(white_xy, 1.0);
        let srgb_from_camera = linear_srgb_from_xyz(white) * matrix(xyz_from_camera) * of_white.max();
        Some(Self {
            illuminant,
            camera_from_xyz: rows_of(&(inverse / of_light.max())),
            neutral: (of_white / of_white.max()).into(),
            srgb_from_camera: rows_of(&srgb_from_camera),
        })
    }
}

/// Whether the tags of a file tell other colors (ColorMatrix1, AsShotNeutral) than metadata of ours by which they were written.
pub(in crate::formats) fn are_other_colors(told: &Metadata, tagged: &Metadata) -> bool {
    /// Programs that write tags anew round them to four decimals.
    const SAME: f64 = 1e-3;
    let Some((told, tagged)) = CameraColor::of_frame(told).zip(tagged.relative_matrix.as_ref()) else { return false };
    let Some(inverse) = matrix(&tagged.xyz_from_camera).try_inverse() else { return false };
    let neutral = inverse * Vector3::from(xyz_of_chromaticity(tagged.white_xy, 1.0));
    let matrices = [inverse, matrix(&told.camera_from_xyz)].map(|matrix| matrix / matrix.norm());
    let are_one = (neutral / neutral.max() - Vector3::from(told.neutral)).amax() <= SAME
        && (matrices[0] - matrices[1]).amax() <= SAME;
    !are_one
}

/// The white of a scene that was a picture in R, G, B: that of the illuminant which lit it, where it has a name.
fn scene_white(metadata: &Metadata) -> Option<[f64; 2]> {
    let name = &metadata.scene.as_ref()?.upsampling.as_ref()?.illuminant;
    // Its table has more digits than its name: D65 stays what it is.
    let other = Some(name).filter(|name| !name.eq_ignore_ascii_case("d65"))?;
    Some(other.parse::<Illuminant>().ok()?.white_xy(&load_observer().ok()?))
}

/// What to say of a frame of three classes that tells no colors; nothing where no light made any, and of flats, which nobody develops.
pub(super) fn doubt_of_colors(metadata: &Metadata) -> Option<String> {
    let is_dark = metadata.scene.as_ref().is_some_and(Scene::is_dark);
    if is_dark || metadata.taken_as.is_some_and(|taken_as| taken_as != TakenAs::Light) {
        return None;
    }
    let why = match &metadata.sensor {
        Some(sensor) if sensor.xyz_from_camera.is_some() => {
            format!(
                "by the `xyz_from_camera` of the sensor {} a class has no signal of D65, or the classes are no three; correct it",
                sensor.name
            )
        }
        Some(sensor) => {
            let by = match &sensor.response {
                Some(_) => "which `fit-matrix` finds from its spectral response",
                None => "which `fit-matrix` finds from a spectral response, or from a chart of known luminance",
            };
            format!("the sensor {} tells no matrix; its file takes one, `xyz_from_camera`, {by}", sensor.name)
        }
        None => {
            "neither a sensor nor a raw file tells a matrix; a sensor file with `xyz_from_camera` does, or metadata with `relative_matrix`"
                .into()
        }
    };
    Some(format!(
        "the DNG has no colors (ColorMatrix1, AsShotNeutral), of which raw converters make gray, NaN or nothing: {why}"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::data::load_sensor;
    use crate::metadata::{RelativeMatrix, UpsamplingRecord};
    use crate::units::QuantityKind;

    #[test]
    fn daylight_is_neutral_and_white() {
        let xyz_from_camera = [[8.7e-4, 4.5e-5, 4.4e-5], [3.7e-4, 3.1e-4, -2.6e-5], [1.0e-4, -1.6e-4, 5.3e-4]];
        let color = CameraColor::of(&xyz_from_camera, (D65_XY, D65), D65_XY).unwrap();
        let white = Vector3::from(xyz_of_chromaticity(D65_XY, 1.0));
        let neutral = Vector3::from(color.neutral);
        assert!(
            (matrix(&color.camera_from_xyz) * white - neutral).amax() < 1e-12 && (neutral.max() - 1.0).abs() < 1e-15
        );
        // The matrix of sRGB has four decimals.
        assert!((matrix(&color.srgb_from_camera) * neutral).add_scalar(-1.0).amax() < 2e-4);
        let sevenfold = xyz_from_camera.map(|row| row.map(|x| 7.0 * x));
        let scaled = CameraColor::of(&sevenfold, (D65_XY, D65), D65_XY).unwrap();
        assert!((Vector3::from(scaled.neutral) - neutral).amax() < 1e-12);
    }

    /// The white of the exposure is the neutral, and white in the picture; a sensor's own matrix comes first.
    #[test]
    fn the_matrix_of_a_raw_file_is_told_for_its_white() {
        let xyz_from_camera = [[1.66, 0.143, 0.175], [0.553, 0.971, -0.329], [-0.027, -0.238, 1.77]];
        let white_xy = [0.338, 0.3686];
        let mut metadata = Metadata::new(QuantityKind::Adu);
        metadata.relative_matrix = Some(RelativeMatrix { xyz_from_camera, white_xy, method: String::new() });
        let color = CameraColor::of_frame(&metadata).unwrap();
        let white = Vector3::from(xyz_of_chromaticity(white_xy, 1.0));
        let neutral = Vector3::from(color.neutral);
        assert!((matrix(&color.camera_from_xyz) * white - neutral).amax() < 1e-12 && color.illuminant == UNKNOWN_LIGHT);
        // The matrix of sRGB has four decimals.
        assert!((matrix(&color.srgb_from_camera) * neutral).add_scalar(-1.0).amax() < 3e-4);
        metadata.sensor = Some(load_sensor("kaf-5101ce").unwrap().sensor);
        let of_sensor = metadata.sensor.as_ref().and_then(|sensor| sensor.xyz_from_camera);
        let illuminant = CameraColor::of_frame(&metadata).unwrap().illuminant;
        assert_eq!(illuminant, if of_sensor.is_some() { D65 } else { UNKNOWN_LIGHT });
    }

    /// A picture under tungsten light is neutral in it, by the matrix for D65; a table of a light has no name that tells its color.
    #[test]
    fn the_illuminant_of_a_picture_is_its_neutral() {
        let xyz_from_camera = [[8.7e-4, 4.5e-5, 4.4e-5], [3.7e-4, 3.1e-4, -2.6e-5], [1.0e-4, -1.6e-4, 5.3e-4]];
        let lit = |illuminant: &str| {
            let mut metadata = Metadata::new(QuantityKind::Adu);
            let mut sensor = load_sensor("kaf-5101ce").unwrap().sensor;
            sensor.xyz_from_camera = Some(xyz_from_camera);
            metadata.sensor = Some(sensor);
            metadata.scene = Some(Scene {
                upsampling: Some(UpsamplingRecord {
                    method: "jakob-hanika-2019".into(),
                    encoding: "srgb".into(),
                    primaries: [D65_XY; 4],
                    illuminant: illuminant.into(),
                    white_luminance: 100.0,
                }),
                ..Scene::of("picture.png")
            });
            CameraColor::of_frame(&metadata).unwrap()
        };
        let daylight = CameraColor::of(&xyz_from_camera, (D65_XY, D65), D65_XY).unwrap();
        assert_eq!([lit("d65"), lit("lamp.csv")], [daylight; 2]);
        let tungsten = lit("a");
        assert_eq!((tungsten.camera_from_xyz, tungsten.illuminant), (daylight.camera_from_xyz, D65));
        // Illuminant A by its published chromaticity, which has five digits.
        let white = matrix(&tungsten.camera_from_xyz) * Vector3::from(xyz_of_chromaticity([0.44757, 0.40745], 1.0));
        assert!((Vector3::from(tungsten.neutral) - white / white.max()).amax() < 1e-4, "{:?}", tungsten.neutral);
        // The matrix of sRGB has four decimals.
        let shown = matrix(&tungsten.srgb_from_camera) * Vector3::from(tungsten.neutral);
        assert!(shown.add_scalar(-1.0).amax() < 3e-4, "{shown}");
    }

    /// What tells no matrix is told with what would; darks and flats are no pictures.
    #[test]
    fn a_frame_without_colors_is_told() {
        let mut metadata = Metadata::new(QuantityKind::Adu);
        assert!(doubt_of_colors(&metadata).unwrap().contains("neither a sensor nor a raw file"));
        let mut sensor = load_sensor("kaf-5101ce").unwrap().sensor;
        sensor.xyz_from_camera = None;
        metadata.sensor = Some(sensor.clone());
        let said = doubt_of_colors(&metadata).unwrap();
        assert!(said.contains(&sensor.name) && said.ends_with("from its spectral response"), "{said}");
        sensor.response = None;
        metadata.sensor = Some(sensor);
        assert!(doubt_of_colors(&metadata).unwrap().contains("from a chart of known luminance"));
        metadata.scene = Some(Scene::uniform("dark", [0.0; 3]));
        assert_eq!(doubt_of_colors(&metadata), None);
        metadata.scene = None;
        metadata.taken_as = Some(TakenAs::Flat);
        assert_eq!(doubt_of_colors(&metadata), None);
    }

    #[test]
    fn what_tells_no_colors_is_left_out() {
        let of = |matrix| CameraColor::of(matrix, (D65_XY, D65), D65_XY);
        assert_eq!(of(&[[1.0; 3]; 3]), None);
        assert_eq!(of(&[[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), None);
        assert_eq!(of(&[[f64::NAN; 3]; 3]), None);
    }
}
