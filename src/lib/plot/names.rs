//! Words beside points, where they cover neither marks nor each other.

use super::drawing::{Drawing, Outline, Point, Rect, Stroke, Text};
use super::figure::{Anchor, Color, Name};
use super::font;
use super::legend::Covered;
use super::style::{MIDDLE, TEXT, TEXT_RGB, ink};
use std::f64::consts::TAU;

/// From a point to the nearest edge of a word beside it.
const BESIDE: f64 = 9.0;
/// How far beyond that a word may stand off, with a line to it.
const REACHES: [f64; 9] = [0.0, 8.0, 18.0, 30.0, 45.0, 62.0, 82.0, 110.0, 150.0];
const TURNS: u32 = 24;
/// Points of one name share it within so many pixels.
const NEAR: f64 = 12.0;
/// Marks hide each other within so many.
const HIDDEN: f64 = 3.0;
/// Half the side of what a mark needs.
const MARK: f64 = 6.0;
/// Words stay so far apart.
const APART: f64 = 4.0;

/// A word in its place.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Placed {
    pub rect: Rect,
    text: String,
    rgb: [u8; 3],
    /// From the point to the word, where that stands off.
    pub leader: Option<[Point; 2]>,
}

/// What names must keep away from.
pub(super) struct Obstacles<'a> {
    /// The frame.
    pub area: Rect,
    /// Middles of marks.
    pub marks: &'a [Point],
    /// Lines.
    pub lines: &'a Covered,
}

/// Finds a place for each name at a point of the canvas, the first first; where one finds none, it is the first of a new trial.
/// A name is left out where there is none in any of them.
pub(super) fn place(names: &[(Point, &Name)], around: &Obstacles) -> Vec<Placed> {
    const TRIALS: usize = 12;
    let joined = joined(names);
    let mut order: Vec<(Point, &Name)> = joined.iter().map(|(at, name)| (*at, name)).collect();
    let mut best: Vec<Placed> = Vec::new();
    for _ in 0..TRIALS {
        let (placed, missing) = trial(&order, around);
        if placed.len() > best.len() {
            best = placed;
        }
        let Some(missing) = missing else { break };
        let first = order.remove(missing);
        order.insert(0, first);
    }
    best
}

/// Names of one color at all but one place, where one mark hides the other, as one: `piz, zips`.
fn joined(names: &[(Point, &Name)]) -> Vec<(Point, Name)> {
    let mut joined: Vec<(Point, Name)> = Vec::new();
    for (at, name) in names {
        let hidden = |(other, their): &&mut (Point, Name)| their.color == name.color && distance(*other, *at) < HIDDEN;
        match joined.iter_mut().find(hidden) {
            Some((_, their)) if their.text.split(", ").any(|text| text == name.text) => {}
            Some((_, their)) => their.text = format!("{}, {}", their.text, name.text),
            None => joined.push((*at, (*name).clone())),
        }
    }
    joined
}

/// Places names in their order, and says which is the first that found none.
fn trial(names: &[(Point, &Name)], around: &Obstacles) -> (Vec<Placed>, Option<usize>) {
    let mut placed: Vec<Placed> = Vec::new();
    let mut missing = None;
    let mut named: Vec<(Point, &str)> = Vec::new();
    for (index, (at, name)) in names.iter().enumerate() {
        if named.iter().any(|(other, text)| *text == name.text && distance(*other, *at) < NEAR) {
            continue;
        }
        let shares = |(other, their): &(Point, &Name)| their.text == name.text && distance(*other, *at) < NEAR;
        let is_shared = names.iter().filter(|other| shares(other)).any(|(_, their)| their.color != name.color);
        let Some((rect, leader)) = best(*at, font::width(&name.text, TEXT), around, &placed) else {
            missing = missing.or(Some(index));
            continue;
        };
        named.push((*at, &name.text));
        // Somewhat darker than the mark: letters are thin.
        let dark = name.color.rgb().map(|part| part / 4 * 3);
        let rgb = if is_shared || name.color == Color::Yellow { TEXT_RGB } else { dark };
        placed.push(Placed { rect, text: name.text.clone(), rgb, leader });
    }
    (placed, missing)
}

/// The place that costs least, and the line to it.
fn best(at: Point, width: f64, around: &Obstacles, placed: &[Placed]) -> Option<(Rect, Option<[Point; 2]>)> {
    let mut best: Option<(f64, Rect, Option<[Point; 2]>)> = None;
    for (ring, reach) in REACHES.into_iter().enumerate() {
        for turn in 0..TURNS {
            let (up, along) = (TAU * f64::from(turn) / f64::from(TURNS)).sin_cos();
            let rect = beside(at, width, [along, up], reach);
            let leader = (ring > 0).then(|| leader(at, rect));
            if !is_free(rect, leader, at, around, placed) {
                continue;
            }
            // Beside is better than above, near than far, and a line covered is worst.
            let crossed = around.lines.cost(rect) + leader.map_or(0, |ends| along_line(ends, around.lines));
            let cost = reach + 6.0 * up.abs() + 25.0 * crossed as f64;
            if best.as_ref().is_none_or(|(least, ..)| cost < *least) {
                best = Some((cost, rect, leader));
            }
        }
    }
    best.map(|(_, rect, leader)| (rect, leader))
}

/// The rectangle of a word so far from a point, in a direction.
fn beside([x, y]: Point, width: f64, [along, up]: [f64; 2], reach: f64) -> Rect {
    let center = [x + along * (0.5 * width + BESIDE + reach), y - up * (0.5 * TEXT + BESIDE + reach)];
    Rect { left: center[0] - 0.5 * width, top: center[1] - 0.5 * TEXT, width, height: TEXT }
}

/// From a point toward the nearest place of a word's edge, short of both.
fn leader(at: Point, rect: Rect) -> [Point; 2] {
    let end = [at[0].clamp(rect.left, rect.right()), at[1].clamp(rect.top, rect.bottom())];
    let whole = distance(at, end).max(1.0);
    let part = |pixels: f64| [0, 1].map(|axis| at[axis] + pixels / whole * (end[axis] - at[axis]));
    [part(f64::min(MARK, 0.4 * whole)), part((whole - 2.0).max(0.6 * whole))]
}

fn is_free(rect: Rect, leader: Option<[Point; 2]>, at: Point, around: &Obstacles, placed: &[Placed]) -> bool {
    let Rect { left, top, width, height } = rect;
    let inside =
        around.area.contains([left - 5.0, top - 3.0]) && around.area.contains([left + width + 5.0, top + height + 3.0]);
    let wide = Rect { left: left - MARK, top: top - MARK, width: width + 2.0 * MARK, height: height + 2.0 * MARK };
    // Without a line to it, a word belongs to the point that is nearest to it.
    let own = gap(at, rect);
    let is_clear = |mark: &Point| {
        !wide.contains(*mark)
            && (leader.is_some() || distance(*mark, at) < MARK || gap(*mark, rect) > own + MARK)
            && leader.is_none_or(|ends| distance(*mark, at) < MARK || !passes(ends, around_mark(*mark)))
    };
    inside
        && around.marks.iter().all(is_clear)
        && placed.iter().all(|other| {
            let taken = grown(other.rect, APART);
            !overlaps(rect, taken)
                && leader.is_none_or(|ends| !passes(ends, taken))
                && other.leader.is_none_or(|ends| !passes(ends, grown(rect, APART)))
                && !leader.zip(other.leader).is_some_and(|(ours, theirs)| meet(ours, theirs))
        })
}

fn around_mark([x, y]: Point) -> Rect {
    Rect { left: x - MARK, top: y - MARK, width: 2.0 * MARK, height: 2.0 * MARK }
}

fn grown(rect: Rect, by: f64) -> Rect {
    Rect { left: rect.left - by, top: rect.top - by, width: rect.width + 2.0 * by, height: rect.height + 2.0 * by }
}

fn overlaps(a: Rect, b: Rect) -> bool {
    a.left < b.right() && b.left < a.right() && a.top < b.bottom() && b.top < a.bottom()
}

fn distance(a: Point, b: Point) -> f64 {
    f64::hypot(a[0] - b[0], a[1] - b[1])
}

/// From a point to the nearest edge of a rectangle.
fn gap(at: Point, rect: Rect) -> f64 {
    distance(at, [at[0].clamp(rect.left, rect.right()), at[1].clamp(rect.top, rect.bottom())])
}

/// Places along a line, a pixel apart.
fn along([from, to]: [Point; 2]) -> impl Iterator<Item = Point> {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most a few hundred pixels")]
    let steps = distance(from, to).ceil().clamp(1.0, 1000.0) as u32;
    (0..=steps).map(move |step| [0, 1].map(|i| from[i] + f64::from(step) / f64::from(steps) * (to[i] - from[i])))
}

fn passes(ends: [Point; 2], rect: Rect) -> bool {
    along(ends).any(|at| rect.contains(at))
}

/// Whether two lines cross, or all but do.
fn meet(a: [Point; 2], b: [Point; 2]) -> bool {
    along(a).any(|at| along(b).any(|other| distance(at, other) < 2.0))
}

/// How much of other lines a line passes.
fn along_line(ends: [Point; 2], lines: &Covered) -> usize {
    let spot = |[x, y]: Point| Rect { left: x, top: y, width: 0.0, height: 0.0 };
    along(ends).step_by(6).filter(|at| lines.cost(spot(*at)) > 0).count()
}

impl Placed {
    /// Draws the word and the line to it.
    pub fn draw(&self, drawing: &mut Drawing) {
        if let Some([from, to]) = self.leader {
            let thin = Stroke { ink: ink(Color::Gray, 1.0), width: 1.0, dashes: &[] };
            drawing.stroke(Outline::Line(vec![from, to]), thin);
        }
        let Rect { left, top, width, height } = self.rect;
        let at = [left + 0.5 * width, top + 0.5 * height + MIDDLE * TEXT];
        let (text, anchor) = (self.text.clone(), Anchor::Middle);
        drawing.text(Text { text, at, size: TEXT, anchor, upward: false, rgb: self.rgb });
    }
}
