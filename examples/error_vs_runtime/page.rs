//! The page: sections of text, plots, tables and advice.

use crate::markdown::{Table, number};
use cyanometer::error::Result;
use cyanometer::report::plot::Plot;
use std::fmt::Write;
use std::path::Path;

/// A part of the page.
pub struct Section {
    /// The choice that a user has.
    pub title: String,
    /// What was done: before the plot.
    pub method: String,
    /// File name without ending, what it shows, and the plot.
    pub figures: Vec<(String, String, Plot)>,
    /// Tables, each with what stands above it.
    pub tables: Vec<(String, Table)>,
    /// One sentence: which setting for which accuracy.
    pub advice: String,
}

impl Section {
    /// Writes the plots and gives the Markdown.
    pub fn write(&self, place: usize, directory: &Path) -> Result<String> {
        let mut text = format!("## {place}. {}\n\n{}\n\n", self.title, self.method);
        let _ = writeln!(text, "**Advice.** {}\n", self.advice);
        for (name, alt, plot) in &self.figures {
            plot.write(&directory.join(format!("{name}.svg")), None)?;
            let _ = writeln!(text, "![{alt}](error-vs-runtime/{name}.svg)\n");
        }
        for (head, table) in &self.tables {
            if !head.is_empty() {
                let _ = writeln!(text, "{head}\n");
            }
            let _ = writeln!(text, "{}", table.text);
        }
        Ok(text)
    }
}

/// A time with its unit, three digits.
pub fn time(seconds: f64) -> String {
    let (scale, unit) = match seconds {
        s if s >= 1.0 => (1.0, "s"),
        s if s >= 1e-3 => (1e3, "ms"),
        s if s >= 1e-6 => (1e6, "µs"),
        _ => (1e9, "ns"),
    };
    format!("{} {unit}", digits(seconds * scale, 3))
}

/// A number of so many significant digits, with a power of ten where it is very large or small.
pub fn digits(value: f64, count: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 { "0".into() } else { "–".into() };
    }
    #[expect(clippy::cast_possible_truncation, reason = "logarithms of doubles are within ±324")]
    let magnitude = {
        // Of the rounded number: 0.9996 has the magnitude of 1.
        let rough = value.abs().log10().floor();
        let step = 10_f64.powf(rough - count as f64 + 1.0);
        ((value.abs() / step).round() * step).log10().mul_add(1.0, 1e-12).floor() as i32
    };
    if (-4..7).contains(&magnitude) {
        let decimals = usize::try_from(count as i64 - 1 - i64::from(magnitude)).unwrap_or(0);
        return number(value, decimals);
    }
    let mantissa = number(value / 10_f64.powi(magnitude), count - 1);
    let exponent: String = magnitude.to_string().chars().map(raised).collect();
    if mantissa == "1" { format!("10{exponent}") } else { format!("{mantissa}·10{exponent}") }
}

fn raised(c: char) -> char {
    match c {
        '-' => '⁻',
        '0' => '⁰',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '4' => '⁴',
        '5' => '⁵',
        '6' => '⁶',
        '7' => '⁷',
        '8' => '⁸',
        _ => '⁹',
    }
}

/// A fraction as per cent.
pub fn percent(fraction: f64) -> String {
    format!("{} %", digits(100.0 * fraction, 2))
}

/// A power of ten, or a small whole number as it is.
pub fn count(value: usize) -> String {
    let power = (value as f64).log10();
    if value >= 10_000 && power.fract() < 1e-9 {
        digits(value as f64 * 1.0, 1).replace("1·", "")
    } else {
        value.to_string()
    }
}
