//! Drawings as PNG.

use super::drawing::{Drawing, Ink, Item, Outline, Point, Stroke, Text};
use super::figure::Anchor;
use super::font;
use crate::error::{Error, Result};
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use tiny_skia::{FillRule, LineCap, LineJoin, Mask, Paint, PathBuilder, Pixmap, StrokeDash, Transform};

/// The drawing as a PNG of 8 bits.
///
/// # Errors
///
/// [`Error::Data`] when the canvas is too large.
pub(super) fn picture(drawing: &Drawing) -> Result<Vec<u8>> {
    let canvas = painted(drawing).ok_or_else(|| failed("it is too large"))?;
    // The background is opaque, so that there is no alpha to keep.
    let rgb: Vec<u8> = canvas.data().chunks_exact(4).flat_map(|pixel| pixel[..3].iter().copied()).collect();
    let mut bytes = Vec::new();
    PngEncoder::new_with_quality(&mut bytes, CompressionType::Best, FilterType::Adaptive)
        .write_image(&rgb, canvas.width(), canvas.height(), ExtendedColorType::Rgb8)
        .map_err(|error| failed(&error.to_string()))?;
    Ok(bytes)
}

fn failed(problem: &str) -> Error {
    Error::Data(format!("the plot cannot be painted as a PNG: {problem}"))
}

/// `None` when the canvas is too large.
pub(super) fn painted(drawing: &Drawing) -> Option<Pixmap> {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the layout makes small sizes")]
    let (width, height) = (drawing.width.ceil() as u32, drawing.height.ceil() as u32);
    let mut canvas = Pixmap::new(width, height)?;
    canvas.fill(tiny_skia::Color::WHITE);
    let still = Transform::identity();
    let mut mask = None;
    for item in &drawing.items {
        match item {
            Item::Shape { outline, fill, stroke } => {
                let Some(path) = path_of(outline) else { continue };
                if let Some(ink) = fill {
                    canvas.fill_path(&path, &paint(*ink), FillRule::Winding, still, mask.as_ref());
                }
                if let Some(stroke) = stroke {
                    canvas.stroke_path(&path, &paint(stroke.ink), &skia_stroke(*stroke), still, mask.as_ref());
                }
            }
            Item::Text(text) => paint_text(&mut canvas, text),
            Item::Clip(None) => mask = None,
            Item::Clip(Some(clip)) => {
                let mut inside = Mask::new(width, height)?;
                if let Some(path) = path_of(&clip.outline()) {
                    inside.fill_path(&path, FillRule::Winding, true, still);
                }
                mask = Some(inside);
            }
        }
    }
    Some(canvas)
}

#[expect(clippy::cast_possible_truncation, reason = "places on the canvas")]
fn path_of(outline: &Outline) -> Option<tiny_skia::Path> {
    let mut path = PathBuilder::new();
    let draw = |path: &mut PathBuilder, points: &[Point]| {
        for (index, [x, y]) in points.iter().enumerate() {
            let (x, y) = (*x as f32, *y as f32);
            if index == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
        }
    };
    match outline {
        Outline::Line(points) => draw(&mut path, points),
        Outline::Polygon(points) => {
            draw(&mut path, points);
            path.close();
        }
        Outline::Circle([x, y], radius) => path.push_circle(*x as f32, *y as f32, *radius as f32),
    }
    path.finish()
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a fraction of 255")]
fn paint(ink: Ink) -> Paint<'static> {
    let [r, g, b] = ink.rgb;
    let mut paint = Paint::default();
    paint.set_color_rgba8(r, g, b, (ink.opacity.clamp(0.0, 1.0) * 255.0).round() as u8);
    paint
}

#[expect(clippy::cast_possible_truncation, reason = "a few pixels")]
fn skia_stroke(stroke: Stroke) -> tiny_skia::Stroke {
    let dashes = stroke.dashes.iter().map(|length| *length as f32).collect();
    tiny_skia::Stroke {
        width: stroke.width as f32,
        line_cap: LineCap::Butt,
        line_join: LineJoin::Round,
        dash: StrokeDash::new(dashes, 0.0),
        ..tiny_skia::Stroke::default()
    }
}

#[expect(clippy::cast_possible_truncation, reason = "places on the canvas")]
fn paint_text(canvas: &mut Pixmap, text: &Text) {
    let (Some(path), scale) = font::outline(&text.text, text.size) else { return };
    let shift = match text.anchor {
        Anchor::Start => 0.0,
        Anchor::Middle => -0.5 * font::width(&text.text, text.size),
        Anchor::End => -font::width(&text.text, text.size),
    };
    let ([x, y], scale, shift) = (text.at.map(|place| place as f32), scale as f32, shift as f32);
    // The font's y goes up, the canvas's down; an upward text goes along −y.
    let transform = if text.upward {
        Transform::from_row(0.0, -scale, -scale, 0.0, x, y - shift)
    } else {
        Transform::from_row(scale, 0.0, 0.0, -scale, x + shift, y)
    };
    canvas.fill_path(&path, &paint(Ink { rgb: text.rgb, opacity: 1.0 }), FillRule::Winding, transform, None);
}
