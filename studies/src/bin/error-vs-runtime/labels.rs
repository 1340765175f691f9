//! Names beside points, where they cover neither points nor each other.

use cyanometer::plot::{Anchor, Color, Note, Panel};

/// How large a panel is drawn; the layout does not say, so these are near enough.
#[derive(Clone, Copy)]
pub enum Shape {
    /// The only panel of a plot.
    Alone,
    /// One above another.
    Stacked,
    /// One beside another.
    Beside,
}

impl Shape {
    /// Width and height of the frame in pixels.
    fn pixels(self) -> [f64; 2] {
        match self {
            Self::Alone => [785.0, 470.0],
            Self::Stacked => [785.0, 310.0],
            Self::Beside => [530.0, 410.0],
        }
    }
}

/// Both axes of a panel, logarithmic, on a grid of pixels.
#[derive(Clone, Copy)]
pub struct Canvas {
    /// Ends of the axes.
    pub ends: [(f64, f64); 2],
    /// The panel.
    pub shape: Shape,
}

impl Canvas {
    fn pixel(&self, point: [f64; 2]) -> [f64; 2] {
        let size = self.shape.pixels();
        [0, 1].map(|i| {
            let (low, high) = self.ends[i];
            size[i] * (point[i] / low).ln() / (high / low).ln()
        })
    }

    fn value(&self, pixel: [f64; 2]) -> [f64; 2] {
        let size = self.shape.pixels();
        [0, 1].map(|i| {
            let (low, high) = self.ends[i];
            low * (high / low).powf(pixel[i] / size[i])
        })
    }
}

/// An upright rectangle: its center and half its sides.
#[derive(Clone, Copy)]
struct Rect {
    center: [f64; 2],
    half: [f64; 2],
}

impl Rect {
    /// Whether another lies within so many pixels.
    fn touches(&self, other: &Self, room: f64) -> bool {
        (0..2).all(|i| (self.center[i] - other.center[i]).abs() < self.half[i] + other.half[i] + room)
    }
}

/// A line's end stays so far from its label.
const SHORT: f64 = 7.0;
const HALF_LINE: f64 = 6.5;
/// Points with the same name share it within so many pixels.
const NEAR: f64 = 26.0;

/// Writes names beside points; names that find no room there stand off, at the end of a thin line. `line` is better not
/// covered, `points` must not be.
pub fn write(panel: &mut Panel, canvas: Canvas, named: &[([f64; 2], &str)], points: &[[f64; 2]], line: &[[f64; 2]]) {
    let size = canvas.shape.pixels();
    let marks: Vec<Rect> = points.iter().map(|&at| Rect { center: canvas.pixel(at), half: [4.0; 2] }).collect();
    let line: Vec<[f64; 2]> = line.iter().map(|&at| canvas.pixel(at)).collect();
    let mut written: Vec<(Rect, &str)> = Vec::new();
    let mut leaders: Vec<[f64; 4]> = Vec::new();
    let mut reached: Vec<(&str, [f64; 2])> = Vec::new();
    for &(value, name) in named {
        let at = canvas.pixel(value);
        if reached.iter().any(|(other, place)| *other == name && distance(*place, at) < NEAR) {
            continue;
        }
        let half = [0.5 * width(name), HALF_LINE];
        let mut best: Option<(f64, Rect, bool)> = None;
        for (ring, reach) in [0.0, 14.0, 28.0, 44.0, 62.0, 82.0].into_iter().enumerate() {
            for turn in 0..16 {
                let angle = std::f64::consts::TAU * f64::from(turn) / 16.0;
                let out = [angle.cos(), angle.sin()];
                let center = [0, 1].map(|i| at[i] + out[i] * (half[i] + 8.0 + reach));
                let rect = Rect { center, half };
                let inside = (0..2).all(|i| center[i] - half[i] > 6.0 && center[i] + half[i] < size[i] - 6.0);
                let free = inside
                    && !written.iter().any(|(other, _)| rect.touches(other, 5.0))
                    && !marks.iter().any(|mark| rect.touches(mark, 2.0));
                if !free {
                    continue;
                }
                let crossed = line.windows(2).filter(|pair| crosses(&rect, pair)).count();
                let threaded =
                    leaders.iter().filter(|leader| crosses(&rect, &[[leader[0], leader[1]], [leader[2], leader[3]]]));
                // Beside is better than above, near than far.
                let cost = reach + 6.0 * out[1].abs() + 30.0 * (crossed + threaded.count()) as f64;
                if best.as_ref().is_none_or(|(least, ..)| cost < *least) {
                    best = Some((cost, rect, ring > 0));
                }
            }
        }
        let Some((_, rect, is_off)) = best else { continue };
        if is_off {
            // To the nearest point of the label's edge.
            let end = [0, 1].map(|i| at[i].clamp(rect.center[i] - rect.half[i], rect.center[i] + rect.half[i]));
            let part = 1.0 - (SHORT / distance(at, end).max(SHORT));
            leaders.push([at[0], at[1], at[0] + part * (end[0] - at[0]), at[1] + part * (end[1] - at[1])]);
        }
        written.push((rect, name));
        reached.push((name, at));
    }
    panel.notes.extend(leaders.iter().map(|leader| {
        let ends = [[leader[0], leader[1]], [leader[2], leader[3]]];
        Note::Line { points: ends.map(|end| canvas.value(end)).to_vec(), color: Color::Gray }
    }));
    for (rect, name) in written {
        let at = canvas.value(rect.center);
        panel.notes.push(Note::Text { at, anchor: Anchor::Middle, text: name.to_owned() });
    }
}

/// How wide a text of 13 pixels is in DejaVu Sans; the widest of each kind of letter.
fn width(text: &str) -> f64 {
    let of = |c: char| match c {
        ' ' | '.' | ',' | 'i' | 'l' => 4.3,
        'm' | 'M' | 'W' | 'w' | '=' => 12.0,
        'A'..='Z' => 9.8,
        '⁰' | '¹' | '²'..='³' | '⁴'..='⁹' => 5.3,
        _ => 8.3,
    };
    text.chars().map(of).sum()
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    f64::hypot(a[0] - b[0], a[1] - b[1])
}

/// Whether a line from one point to another passes a rectangle, at a resolution of 4 pixels.
fn crosses(rect: &Rect, ends: &[[f64; 2]]) -> bool {
    let [from, to] = [ends[0], ends[1]];
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few hundred pixels")]
    let steps = (distance(from, to) / 4.0).ceil().clamp(1.0, 1000.0) as usize;
    (0..=steps).any(|step| {
        let along = step as f64 / steps as f64;
        let at = Rect { center: [0, 1].map(|i| from[i] + along * (to[i] - from[i])), half: [0.0; 2] };
        rect.touches(&at, 2.0)
    })
}
