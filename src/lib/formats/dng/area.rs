//! Parts of the stored image: the photosites that see light, and what converters show.

use super::image::RawImage;
use super::tags;
use crate::error::Result;
use crate::formats::tiff::TiffFile;
use crate::names::Named;

/// Which part of a raw image is read.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum RawArea {
    /// The photosites that see light (`ActiveArea`).
    #[default]
    Active,
    /// All that is stored, with what is masked.
    Full,
    /// What converters show by default (`DefaultCropOrigin`, `DefaultCropSize`).
    Default,
}

impl Named for RawArea {
    const ALL: &'static [Self] = &[Self::Active, Self::Full, Self::Default];

    fn name(self) -> &'static str {
        match self {
            Self::Active => "active",
            Self::Full => "full",
            Self::Default => "default",
        }
    }
}

/// A rectangle of the stored image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::formats) struct Rectangle {
    pub left: usize,
    pub top: usize,
    pub width: usize,
    pub height: usize,
}

impl Rectangle {
    /// The whole of a size.
    pub fn whole([width, height]: [usize; 2]) -> Self {
        Self { left: 0, top: 0, width, height }
    }

    /// The same so many columns and rows further on.
    pub fn moved(self, [columns, rows]: [usize; 2]) -> Self {
        Self { left: self.left + columns, top: self.top + rows, ..self }
    }

    /// In words: `1734x1156 from column 152, row 26`.
    pub fn in_words(self) -> String {
        format!("{}x{} from column {}, row {}", self.width, self.height, self.left, self.top)
    }
}

/// The active area \[DNG2023, ActiveArea]; all that is stored where there is none.
///
/// # Errors
///
/// When it is not in the stored image.
pub(super) fn active(file: &mut TiffFile, image: &RawImage) -> Result<Rectangle> {
    let Some([top, left, bottom, right]) = tags::ACTIVE_AREA.whole::<4>(file, image.directory())? else {
        return Ok(Rectangle::whole(image.size));
    };
    let [width, height] = image.size;
    if top < bottom && bottom <= height && left < right && right <= width {
        return Ok(Rectangle { left, top, width: right - left, height: bottom - top });
    }
    Err(file.problem(format!(
        "it is damaged; its ActiveArea, rows {top} to {bottom} and columns {left} to {right}, does not lie in the {width}x{height} samples that are stored"
    )))
}

/// The photosites that no light reaches \[DNG2023, MaskedAreas], as X, Y, width and height on the sensor, whose corner the
/// image's is `place` from. Where the tag is missing, all that lies beside the active area but for [`LEAK`] photosites.
///
/// # Errors
///
/// When the tag is damaged, or an area is not in the stored image.
pub(super) fn masked(
    file: &mut TiffFile,
    image: &RawImage,
    active: Rectangle,
    place: [usize; 2],
) -> Result<Vec<[i64; 4]>> {
    let [width, height] = image.size.map(|side| side as u64);
    let given = tags::MASKED_AREAS.unsigned(file, image.directory(), 4 * MOST_AREAS + 1)?;
    if let Some(given) = given.as_ref().filter(|given| given.len() % 4 != 0) {
        let problem = "of four each, at most 64 of which are read";
        return Err(
            file.problem(format!("it is damaged; its MaskedAreas has {} numbers, no areas {problem}", given.len()))
        );
    }
    // Top, left, bottom and right, again and again.
    let beside = || {
        let (left, top) = (active.left as u64, active.top as u64);
        let (right, bottom) = (left + active.width as u64, top + active.height as u64);
        vec![
            [0, 0, top.saturating_sub(LEAK), width],
            [bottom + LEAK, 0, height, width],
            [0, 0, height, left.saturating_sub(LEAK)],
            [0, right + LEAK, height, width],
        ]
    };
    let areas = given.map_or_else(beside, |given| given.as_chunks::<4>().0.to_vec());
    let is_within = |[_, _, bottom, right]: &[u64; 4]| *bottom <= height && *right <= width;
    if let Some([top, left, bottom, right]) = areas.iter().find(|area| !is_within(area)) {
        return Err(file.problem(format!(
            "it is damaged; its MaskedAreas, rows {top} to {bottom} and columns {left} to {right}, do not lie in the {width}x{height} \
             samples that are stored"
        )));
    }
    let on_sensor = |[top, left, bottom, right]: [u64; 4]| {
        let [x, y] = [left + place[0] as u64, top + place[1] as u64];
        (top < bottom && left < right).then(|| [x, y, right - left, bottom - top].map(u64::cast_signed))
    };
    Ok(areas.into_iter().filter_map(on_sensor).collect())
}

/// Areas that are read.
const MOST_AREAS: u64 = 64;

/// Photosites beside the active area that light may leak into.
const LEAK: u64 = 2;

/// The photosites that lie wholly within the default crop, where that lies in the active area; that area where there is none. Else why
/// it is none, in words.
///
/// # Errors
///
/// When its tags are damaged.
pub(super) fn default_crop(
    file: &mut TiffFile,
    image: &RawImage,
    active: Rectangle,
) -> Result<std::result::Result<Rectangle, String>> {
    let origin = tags::DEFAULT_CROP_ORIGIN.exactly::<2>(file, image.directory())?.unwrap_or([0.0; 2]);
    let size = tags::DEFAULT_CROP_SIZE.exactly::<2>(file, image.directory())?;
    let size = size.unwrap_or([active.width as f64, active.height as f64]);
    let [left, top, width, height] = [origin[0], origin[1], size[0], size[1]];
    let shown = format!("its default crop, {width}x{height} from {left},{top} of the active area,");
    let fits = |from: f64, side: f64, most: usize| from >= 0.0 && side >= 1.0 && from + side <= most as f64;
    if !(fits(left, width, active.width) && fits(top, height, active.height)) {
        return Ok(Err(format!("{shown} does not lie in that area, which has {}x{}", active.width, active.height)));
    }
    // What a ratio of integers is off by as a double.
    const ROUNDING: f64 = 1e-9;
    let first = |from: f64| (from - ROUNDING).ceil().max(0.0);
    let whole = |from: f64, side: f64| [first(from), (from + side + ROUNDING).floor() - first(from)];
    let [[left, width], [top, height]] = [whole(left, width), whole(top, height)];
    if width < 1.0 || height < 1.0 {
        return Ok(Err(format!("{shown} has no whole photosite")));
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "whole and within the image")]
    let [left, top, width, height] = [left, top, width, height].map(|side| side as usize);
    Ok(Ok(Rectangle { left: active.left + left, top: active.top + top, width, height }))
}
