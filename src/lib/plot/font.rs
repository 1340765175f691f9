//! The embedded font: widths of texts and outlines of letters.

use std::sync::LazyLock;
use tiny_skia::PathBuilder;
use ttf_parser::{Face, GlyphId, OutlineBuilder};

static FACE: LazyLock<Face<'static>> = LazyLock::new(|| {
    let bytes = include_bytes!("../../../assets/fonts/DejaVuSans-subset.ttf");
    Face::parse(bytes, 0).expect("the embedded font is a font")
});

/// The glyph of a character, or a question mark in a diamond for one that the font lacks.
fn glyph(c: char) -> GlyphId {
    FACE.glyph_index(c).or_else(|| FACE.glyph_index('\u{FFFD}')).unwrap_or_default()
}

/// The characters of a text that the font lacks, each once.
pub fn lacking(text: &str) -> Vec<char> {
    let mut found: Vec<char> = Vec::new();
    for c in text.chars().filter(|c| !c.is_whitespace() && FACE.glyph_index(*c).is_none()) {
        if !found.contains(&c) {
            found.push(c);
        }
    }
    found
}

fn advance(glyph: GlyphId) -> f64 {
    f64::from(FACE.glyph_hor_advance(glyph).unwrap_or(0))
}

/// How wide a text is, in the unit of `size`.
pub(super) fn width(text: &str, size: f64) -> f64 {
    text.chars().map(|c| advance(glyph(c))).sum::<f64>() * size / f64::from(FACE.units_per_em())
}

/// A text without as much of its middle as makes it too wide, which dots stand for: names differ at their ends.
pub(super) fn shortened(text: &str, size: f64, most: f64) -> String {
    let letters: Vec<char> = text.chars().collect();
    let without = |left_out: usize| -> String {
        let begin = (letters.len() - left_out).div_ceil(2);
        let [head, tail] = [&letters[..begin], &letters[begin + left_out..]];
        head.iter().chain(&['…']).chain(tail).collect()
    };
    let shorter = || (1..letters.len()).map(without).find(|text| width(text, size) <= most);
    if width(text, size) <= most { text.to_owned() } else { shorter().unwrap_or_else(|| "…".to_owned()) }
}

/// The words of a text in lines that are no wider; words that alone are wider are parted.
pub(super) fn lines(text: &str, size: f64, most: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace().flat_map(|word| parts(word, size, most)) {
        match lines.last_mut() {
            Some(line) if width(&format!("{line} {word}"), size) <= most => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// A word in parts that are no wider, of a letter at least.
fn parts(word: &str, size: f64, most: f64) -> Vec<&str> {
    let (mut parts, mut rest) = (Vec::new(), word);
    while width(rest, size) > most {
        let ends = rest.char_indices().map(|(at, _)| at).skip(1);
        let fits = ends.take_while(|end| width(&rest[..*end], size) <= most).last();
        let Some(end) = fits.or_else(|| rest.char_indices().nth(1).map(|(at, _)| at)) else { break };
        parts.push(&rest[..end]);
        rest = &rest[end..];
    }
    parts.push(rest);
    parts
}

/// The outlines of a text in units of the font, y upward, and the scale that gives it a size.
pub(super) fn outline(text: &str, size: f64) -> (Option<tiny_skia::Path>, f64) {
    let mut pen = Pen { path: PathBuilder::new(), x: 0.0 };
    let mut x = 0.0;
    for c in text.chars() {
        let glyph = glyph(c);
        #[expect(clippy::cast_possible_truncation, reason = "a place on the canvas")]
        {
            pen.x = x as f32;
        }
        // A space has no outline.
        let _ = FACE.outline_glyph(glyph, &mut pen);
        x += advance(glyph);
    }
    (pen.path.finish(), size / f64::from(FACE.units_per_em()))
}

struct Pen {
    path: PathBuilder,
    /// Where the letter begins.
    x: f32,
}

impl OutlineBuilder for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        self.path.move_to(self.x + x, y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.path.line_to(self.x + x, y);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.path.quad_to(self.x + x1, y1, self.x + x, y);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.path.cubic_to(self.x + x1, y1, self.x + x2, y2, self.x + x, y);
    }

    fn close(&mut self) {
        self.path.close();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn characters_without_a_glyph_are_told_once() {
        assert_eq!(lacking("a 漢b漢"), ['漢']);
        assert!(lacking("ΔE*ab / cd m⁻²").is_empty());
    }

    #[test]
    fn the_font_has_the_characters_of_labels() {
        let needed = "0123456789−+±×·°%/()[]*=<>≤≥≈→∞√…–—’⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁺₀₁₂₃₄₅₆₇₈₉αβγδΔεηκλΛμνρσΣτφΦχΩµäöüßéèñçø";
        for c in needed.chars().chain(' '..='~') {
            assert!(FACE.glyph_index(c).is_some(), "{c:?}");
        }
        assert_eq!(glyph('\u{1F600}'), FACE.glyph_index('\u{FFFD}').unwrap());
    }

    #[test]
    fn lines_are_no_wider_than_asked_for() {
        let text = "a title of some words, and one/that/is/a/path/as/long/as/paths/of/people/are.exr";
        for most in [1.0, 60.0, 200.0, 5000.0] {
            let lines = lines(text, 12.0, most);
            assert_eq!(lines.concat().replace(' ', ""), text.replace(' ', ""));
            assert!(lines.iter().all(|line| width(line, 12.0) <= most || line.chars().count() == 1), "{lines:?}");
        }
        assert_eq!(lines(text, 12.0, 5000.0), [text]);
        assert!(lines("", 12.0, 10.0).is_empty());
    }

    #[test]
    fn names_that_are_too_long_lose_their_middle() {
        let name = "a_very_long_layer_name.channel_1";
        let short = shortened(name, 12.0, 100.0);
        assert!(width(&short, 12.0) <= 100.0 && short.starts_with("a_ve") && short.ends_with("el_1"), "{short}");
        assert_eq!([shortened(name, 12.0, 1000.0), shortened(name, 12.0, 1.0)], [name.to_owned(), "…".to_owned()]);
    }

    #[test]
    fn widths_add_up() {
        // A digit of DejaVu Sans is 1303/2048 em wide.
        assert!((width("10", 2048.0) - 2606.0).abs() < 1e-9);
        assert_eq!(width("", 12.0), 0.0);
    }
}
