//! Places and sizes on a frame, in pixels.

use super::numbers::{finite_list, list};
use crate::analysis::statistics::Region;

/// Reads `WIDTHxHEIGHT`, both at least 1.
///
/// # Errors
///
/// What is expected, in words.
pub fn size(text: &str) -> Result<[usize; 2], String> {
    let parse = |part: &str| part.parse::<usize>().ok().filter(|n| (1..=i32::MAX as usize).contains(n));
    text.split_once(['x', 'X'])
        .and_then(|(width, height)| Some([parse(width)?, parse(height)?]))
        .ok_or_else(|| "a size is WIDTHxHEIGHT in photosites, such as 1332x1000".into())
}

/// Reads the centers of four corner patches, `X,Y,X,Y,X,Y,X,Y`.
///
/// # Errors
///
/// What is expected, in words.
pub fn corners(text: &str) -> Result<[[f64; 2]; 4], String> {
    match finite_list(text).as_deref() {
        Some([a, b, c, d, e, f, g, h]) => Ok([[*a, *b], [*c, *d], [*e, *f], [*g, *h]]),
        _ => {
            Err("give column and row of the centers of dark skin, bluish green, black and white: eight numbers".into())
        }
    }
}

/// Reads the size of a patch, `WIDTHxHEIGHT`, at least 2 pixels and at most 1024 on a side.
///
/// # Errors
///
/// What is expected, in words.
pub fn patch(text: &str) -> Result<[usize; 2], String> {
    let wrong = || "a patch is WIDTHxHEIGHT in pixels, from 2x2 to 1024x1024".to_owned();
    size(text).ok().filter(|size| size.iter().all(|side| (2..=1024).contains(side))).ok_or_else(wrong)
}

/// Reads a region `X,Y,W,H`.
///
/// # Errors
///
/// What is expected, in words.
pub fn region(text: &str) -> Result<Region, String> {
    match list(text, ',').as_deref() {
        Some([x, y, width, height]) => Ok(Region { x: *x, y: *y, width: *width, height: *height }),
        _ => Err("a region is X,Y,W,H in pixels, counted from the frame's corner".into()),
    }
}

/// Reads a column and row of the sensor, `X,Y`.
///
/// # Errors
///
/// What is expected, in words.
pub fn place(text: &str) -> Result<[i64; 2], String> {
    match list(text, ',').as_deref() {
        Some([x, y]) => Ok([*x, *y]),
        _ => Err("give the column and row X,Y of the sensor".into()),
    }
}
