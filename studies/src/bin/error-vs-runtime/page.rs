//! The page: sections of text, plots, tables and advice.

use cyanometer::error::Result;
use cyanometer::formats::plots::write_plot;
use cyanometer::plot::{Plot, power_of_ten};
use cyanometer_studies::pages::{Table, number};
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
            write_plot(&directory.join(format!("{name}.svg")), plot)?;
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
    let (mantissa, magnitude) = {
        let text = format!("{value:.*e}", count - 1);
        let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        (mantissa.parse().unwrap_or(value), exponent.parse().unwrap_or(0_i32))
    };
    if (-4..7).contains(&magnitude) {
        let decimals = i64::try_from(count).unwrap_or(0) - 1 - i64::from(magnitude);
        return number(mantissa * 10_f64.powi(magnitude), usize::try_from(decimals).unwrap_or(0));
    }
    match (number(mantissa, count - 1).as_str(), power_of_ten(magnitude)) {
        ("1", power) => power,
        (mantissa, power) => format!("{mantissa}·{power}"),
    }
}

/// A fraction as percent.
pub fn percent(fraction: f64) -> String {
    format!("{} %", digits(100.0 * fraction, 2))
}

/// A power of ten from 10⁴ on, any other number as it is.
pub fn count(value: usize) -> String {
    let magnitude = value.max(1).ilog10();
    if magnitude >= 4 && value == 10_usize.pow(magnitude) {
        power_of_ten(magnitude.cast_signed())
    } else {
        value.to_string()
    }
}
