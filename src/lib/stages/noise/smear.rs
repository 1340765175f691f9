//! Smear: the light that a packet of charge collects on its way along its column.
//!
//! In a frame-transfer or interline sensor that no shutter covers, a packet passes all photosites of its column, some when the
//! column is cleared before the exposure and the others when it is read after it, and takes of the light of each what falls
//! in a time τ. In an exposure of t to light that does not change, photosites of a column that expect E electrons expect
//!
//! E′ᵧ = Eᵧ + (τ/t) Σⱼ Eⱼ,
//!
//! the sum over the whole column, whichever way it is read \[Ruyten1999]. Behind a filter array the column is that of the plane:
//! what a photosite would record of another class, as in three planes, has the smear of the photosites that are there.

use crate::cfa::{CfaPattern, Class};
use crate::error::Result;
use crate::frame::to_sample;
use crate::metadata::FrameHeader;

/// Adds up the light of each column of a frame, row by row; how its rows come does not matter.
///
/// # Examples
///
/// ```
/// use cyanometer::stages::noise::ColumnLight;
/// # use cyanometer::cfa::CfaPattern;
/// # use cyanometer::frame::Geometry;
/// # use cyanometer::metadata::{FrameHeader, Metadata};
/// # use cyanometer::units::QuantityKind;
/// # let mut metadata = Metadata::new(QuantityKind::ExpectedElectrons);
/// # metadata.cfa = Some(CfaPattern::Rggb.into());
/// # let header = FrameHeader { name: "example".into(), geometry: Geometry::new(2, 2, &["Y"]), metadata };
/// let mut light = ColumnLight::of(&header, CfaPattern::Rggb);
/// light.add(&[1.0, 20.0]);
/// light.add(&[300.0, 4000.0]);
/// assert_eq!(light.sums(), [301.0, 4020.0]);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct ColumnLight {
    pattern: CfaPattern,
    origin: [i32; 2],
    is_plane: bool,
    rows: usize,
    sums: Vec<f64>,
}

impl ColumnLight {
    /// Of no row yet of a frame of expected electrons, a plane or three, of a sensor behind an array of this pattern.
    pub fn of(frame: &FrameHeader, pattern: CfaPattern) -> Self {
        let geometry = &frame.geometry;
        Self {
            pattern,
            origin: geometry.origin,
            is_plane: frame.metadata.cfa.is_some(),
            rows: 0,
            sums: vec![0.0; geometry.width],
        }
    }

    /// Adds the next row, its channels one behind another; what is no light, negative or not finite, counts as none.
    pub fn add(&mut self, channels: &[f32]) {
        let width = self.sums.len();
        let classes = self.pattern.row_classes(self.origin, self.rows);
        for (x, sum) in self.sums.iter_mut().enumerate() {
            let channel = if self.is_plane { 0 } else { classes[x % 2] as usize };
            let light = channels[channel * width + x];
            if light > 0.0 && light.is_finite() {
                *sum += f64::from(light);
            }
        }
        self.rows += 1;
    }

    /// The sums.
    pub fn sums(&self) -> &[f64] {
        &self.sums
    }

    /// Smear of each column, of which packets take such a share.
    pub(super) fn smear(&self, share: f64) -> Vec<f32> {
        self.sums.iter().map(|sum| to_sample(share * sum)).collect()
    }
}

/// The light of the sensor's even and odd columns of so many rows, where the scene is uniform: of each class so many electrons.
pub fn uniform_columns(pattern: CfaPattern, height: u32, electrons: [f64; 3]) -> [f64; 2] {
    let of_class =
        |class: Class| Some(electrons[class as usize]).filter(|e| *e > 0.0 && e.is_finite()).unwrap_or_default();
    let [first, second] = [0, 1].map(|row| pattern.row_classes([0, 0], row));
    let rows = [f64::from(height.div_ceil(2)), f64::from(height / 2)];
    [0, 1].map(|column| rows[0] * of_class(first[column]) + rows[1] * of_class(second[column]))
}

/// What a frame of a sensor that has smear knows of its columns' light.
pub(super) enum Known {
    /// The smear of each.
    Smear(Vec<f32>),
    /// Nothing: its rows must be added up.
    Nothing,
}

/// What the head of a frame tells of the smear of its columns, of whose light packets take such a share.
///
/// # Errors
///
/// [`Error::Format`](crate::error::Error::Format) where the frame does not have all rows that light comes from, or is behind
/// another filter array than its sensor has.
pub(super) fn known(frame: &FrameHeader, pattern: CfaPattern, share: f64) -> Result<Known> {
    let FrameHeader { geometry, metadata, .. } = frame;
    if metadata.cfa.is_some_and(|cfa| cfa != pattern.into()) {
        return Err(frame.refuse(format!(
            "it is behind a filter array {}, and its sensor has {pattern}, by which its columns have smear; leave --pattern out",
            metadata.cfa.map(|cfa| cfa.to_string()).unwrap_or_default()
        )));
    }
    let uniform = metadata.scene.as_ref().filter(|scene| scene.uniform).and_then(|scene| scene.expected_electrons);
    if let Some(electrons) = uniform {
        let smear = uniform_columns(pattern, frame.readout()?.height, electrons).map(|sum| to_sample(share * sum));
        let first = usize::from(geometry.origin[0] & 1 != 0);
        return Ok(Known::Smear((0..geometry.width).map(|x| smear[(first + x) % 2]).collect()));
    }
    check_whole(frame, "smear comes from whole columns", "smear_line_s")?;
    Ok(Known::Nothing)
}

/// Makes sure that a frame has all rows of its sensor.
///
/// # Errors
///
/// [`Error::Format`](crate::error::Error::Format) with `why`, and the key of the sensor that asks for it.
pub(super) fn check_whole(frame: &FrameHeader, why: &str, key: &str) -> Result<()> {
    let (first, rows, height) = (frame.geometry.origin[1], frame.geometry.height, frame.readout()?.height);
    if first == 0 && rows == height as usize {
        return Ok(());
    }
    Err(frame.refuse(format!(
        "it has {rows} of the {height} rows of its sensor, from row {first} on; {why}: make frames of all rows, or take `{key}` \
         out of the sensor"
    )))
}
