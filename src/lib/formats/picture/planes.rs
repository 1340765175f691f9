//! Which planes of a frame a picture shows, and what they are called.

use crate::analysis::comparison::MAP_CHANNELS;
use crate::error::{Error, Result};
use crate::frame::bare_name;
use crate::metadata::FrameHeader;
use crate::names::place_of;
use crate::plot::end_labels;
use crate::stages::saturation::MASK_LAYER;
use crate::units::{QuantityKind, typeset};

/// What of a frame is shown.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Choice {
    /// Places of its channels: one, or the three of a picture in color.
    pub channels: Vec<usize>,
    /// The letter of the filter whose photosites alone are shown.
    pub filter: Option<char>,
    /// What reports call the single channel of a frame that was taken from others.
    pub called: Option<String>,
}

impl Choice {
    /// The plane of a name: a channel as reports or files call it, or a class of a CFA plane. Without a name, a single plane or the
    /// three of R, G and B (or what was made of them).
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for a name that is none of the frame's, which are listed; [`Error::Format`] for what makes no picture.
    pub fn of(frame: &FrameHeader, name: Option<&str>, is_one: bool) -> Result<Self> {
        let channels = &frame.geometry.channels;
        let all = |channels: &[usize]| Self { channels: channels.to_vec(), filter: None, called: None };
        let Some(name) = name else {
            return match channels.len() {
                1 => Ok(all(&[0])),
                n if is_one => Err(Error::Usage(format!(
                    "{}: it holds {}; false color shows one of its {n} planes, {}; say which, as with --plane {}",
                    frame.name,
                    frame.holds(),
                    known(frame),
                    Self::leading(frame).names(frame)[0]
                ))),
                3 if frame.has_three_planes() => Ok(all(&[0, 1, 2])),
                _ => Err(frame.refuse(format!(
                    "it holds {}, which makes no picture; show one, of {}, in false color, as with --plane {} --false-color",
                    frame.holds(),
                    known(frame),
                    Self::leading(frame).names(frame)[0]
                ))),
            };
        };
        let filters = filters(frame);
        let letters: Vec<String> = filters.iter().map(char::to_string).collect();
        if let Some(place) = place_of(name, letters.iter().map(String::as_str)) {
            return Ok(Self { channels: vec![0], filter: Some(filters[place]), called: None });
        }
        let names: Vec<String> = channels.iter().map(|channel| in_words(frame, channel)).collect();
        let place = place_of(name, (0..channels.len()).map(|place| frame.channel_name(place)))
            .or_else(|| place_of(name, names.iter().map(String::as_str)))
            .or_else(|| place_of(name, channels.iter().map(String::as_str)));
        place
            .map(|place| all(&[place]))
            .ok_or_else(|| Error::Usage(format!("{}: there is no plane `{name}`; it has {}", frame.name, known(frame))))
    }

    /// The plane that says most of a frame, for one that is no picture as it is: its luminance or lightness, the middle one of spectra, or the
    /// first.
    pub fn leading(frame: &FrameHeader) -> Self {
        let place = |name: &str| (0..frame.geometry.channels.len()).find(|place| frame.channel_name(*place) == name);
        let place = match frame.metadata.quantity {
            QuantityKind::Cct => place("CCT"),
            // The first wavelengths are often those where little is seen.
            QuantityKind::SpectralRadiance => frame.geometry.channels.len().checked_sub(1).map(|last| last / 2),
            _ => place("Y").or_else(|| place("L")),
        };
        Self { channels: vec![place.unwrap_or(0)], filter: None, called: None }
    }

    /// Whether a frame is a map of quantities, of which the first is looked for and no color is made.
    pub fn is_of_map(frame: &FrameHeader) -> bool {
        matches!(frame.metadata.quantity, QuantityKind::ColorDifference | QuantityKind::Cct)
    }

    /// Whether no number of what is shown can be below 0: a difference of colors, a standard deviation, light as it is expected.
    pub fn is_never_negative(&self, frame: &FrameHeader) -> bool {
        let is_spread = |name: &str| name.starts_with(SIGMA) || name.starts_with(VARIANCE);
        let is_light = matches!(
            frame.metadata.quantity,
            QuantityKind::ColorDifference | QuantityKind::SpectralRadiance | QuantityKind::ExpectedElectrons
        );
        is_light || self.channels.iter().all(|place| is_spread(&frame.geometry.channels[*place]))
    }

    /// What reports call the channels that are shown.
    pub fn names(&self, frame: &FrameHeader) -> Vec<String> {
        match &self.called {
            Some(called) => vec![called.clone()],
            None => self.channels.iter().map(|place| frame.channel_name(*place).to_owned()).collect(),
        }
    }

    /// The letters of the filters whose photosites are shown, of a CFA plane.
    pub fn filters(&self, frame: &FrameHeader) -> Vec<char> {
        self.filter.map_or_else(|| filters(frame), |filter| vec![filter])
    }

    /// Whether a single plane of color temperatures is shown.
    pub fn is_temperature(&self, frame: &FrameHeader) -> bool {
        self.channels.len() == 1 && self.temperatures(frame) == Some(0)
    }

    /// Which of the planes that are shown has color temperatures.
    pub fn temperatures(&self, frame: &FrameHeader) -> Option<usize> {
        let are_there = frame.metadata.quantity == QuantityKind::Cct;
        self.names(frame).iter().position(|name| are_there && name == "CCT")
    }

    /// The unit of what is shown; empty where it is 1 or not known.
    pub fn unit(&self, frame: &FrameHeader) -> String {
        match self.channels[..] {
            [place] => unit(frame, place),
            _ => Some(typeset(&frame.metadata.unit)).filter(|unit| !is_none(unit)).unwrap_or_default(),
        }
    }

    /// What stands beside the scale of a single plane: the quantity and its unit.
    pub fn label(&self, frame: &FrameHeader) -> String {
        let [place] = self.channels[..] else { return typeset(&frame.metadata.unit) };
        let channel = self.called.as_ref().unwrap_or(&frame.geometry.channels[place]);
        let quantity = match (quantity(frame, channel), self.filter) {
            (words, None) => words,
            (words, Some(filter)) => format!("{words}, class {filter}"),
        };
        match unit(frame, place) {
            unit if unit.is_empty() => quantity,
            unit => format!("{quantity} / {unit}"),
        }
    }
}

/// The letters of the filters before a single plane; none of other frames.
fn filters(frame: &FrameHeader) -> Vec<char> {
    match frame.metadata.cfa {
        Some(array) if frame.geometry.channels.len() == 1 => array.filters(),
        _ => Vec::new(),
    }
}

/// The names of planes, as many as one reads.
fn known(frame: &FrameHeader) -> String {
    const SHOWN: usize = 16;
    let channels = 0..frame.geometry.channels.len();
    let classes = filters(frame).into_iter().map(String::from);
    let names: Vec<String> =
        channels.map(|place| frame.channel_name(place).to_owned()).chain(classes).take(SHOWN + 1).collect();
    let more = if names.len() > SHOWN { ", …" } else { "" };
    names[..names.len().min(SHOWN)].join(", ") + more
}

/// What a channel is called, a layer by what it belongs to: `sigma.Y` where files and reports have `sigma.G`.
fn in_words(frame: &FrameHeader, channel: &str) -> String {
    let layer = [SIGMA, VARIANCE].into_iter().find_map(|kind| Some((kind, channel.strip_prefix(kind)?)));
    match layer {
        Some((kind, base)) => format!("{kind}{}", frame.name_of(base)),
        None => frame.name_of(channel).to_owned(),
    }
}

/// What begins the name of a layer of standard deviations.
const SIGMA: &str = "sigma.";
/// What begins the name of a layer of variances over frames.
const VARIANCE: &str = "variance.";
/// What begins the name of a layer of covariances.
const COVARIANCE: &str = "covariance.";

/// What the numbers of a channel are, in words.
fn quantity(frame: &FrameHeader, channel: &str) -> String {
    let name = in_words(frame, channel);
    if let Some(base) = name.strip_prefix(SIGMA) {
        return format!("standard deviation of {base}");
    }
    if let Some(base) = name.strip_prefix(VARIANCE) {
        return format!("variance of {base}");
    }
    if let Some(pair) = name.strip_prefix(COVARIANCE) {
        let [first, second] = [&pair[..pair.len() / 2], &pair[pair.len() / 2..]];
        return if first == second {
            format!("variance of {first}")
        } else {
            format!("covariance of {first} and {second}")
        };
    }
    if channel == MASK_LAYER {
        return "mask, sum of bits".into();
    }
    let formulas = ["ΔE2000", "ΔE*ab", "ΔE94", "ΔE*ab in JND"];
    if let Some(formula) = MAP_CHANNELS.iter().position(|formula| *formula == channel) {
        return formulas[formula].into();
    }
    match frame.metadata.quantity {
        QuantityKind::ExpectedElectrons
        | QuantityKind::Electrons
        | QuantityKind::Adu
        | QuantityKind::SpectralRadiance => {
            let words = match frame.metadata.quantity {
                QuantityKind::Adu => "codes".to_owned(),
                other => other.to_string(),
            };
            let is_only = frame.geometry.channels.first().is_some_and(|only| only == channel);
            if frame.geometry.channels.len() == 1 && is_only { words } else { format!("{words}, {name}") }
        }
        QuantityKind::Unspecified => format!("samples {name}"),
        QuantityKind::Lab | QuantityKind::Luv if name != "mask" => format!("{name}*"),
        _ => name,
    }
}

/// Whether a unit says nothing.
fn is_none(unit: &str) -> bool {
    ["1", "unspecified"].contains(&unit)
}

/// The unit of a channel; empty where it is 1 or not known.
fn unit(frame: &FrameHeader, place: usize) -> String {
    let channel = &frame.geometry.channels[place];
    let unit = &frame.metadata.unit;
    if channel == MASK_LAYER || frame.metadata.quantity == QuantityKind::ColorDifference {
        return String::new();
    }
    let base = channel.strip_prefix(SIGMA).or_else(|| channel.strip_prefix(VARIANCE)).unwrap_or(channel);
    let is_squared = channel.starts_with(COVARIANCE) || channel.starts_with(VARIANCE);
    let units: Vec<&str> = unit.split(", ").collect();
    let own = match frame.geometry.channels.iter().position(|known| bare_name(known) == base) {
        Some(place) if units.len() > 1 => units.get(place).copied().unwrap_or_default(),
        _ => unit,
    };
    match typeset(own) {
        plain if is_none(&plain) => String::new(),
        unit if is_squared && unit == "relative" => "relative²".into(),
        unit if is_squared && unit.chars().all(char::is_alphabetic) => format!("{unit}²"),
        unit if is_squared => format!("({unit})²"),
        unit => unit,
    }
}

/// What of a frame is shown, with its unit, and how many pixels of it.
pub(super) fn stage(frame: &FrameHeader, choice: &Choice, [width, height]: [usize; 2]) -> String {
    if choice.channels.len() < frame.geometry.channels.len() {
        return format!("{}, {width} × {height}", choice.label(frame));
    }
    let unit = typeset(&frame.metadata.unit);
    let says_nothing = ["1", "ADU", "unspecified"].contains(&unit.as_str());
    let unit = if says_nothing { String::new() } else { format!(" / {unit}") };
    format!("{}{unit}, {width} × {height}", frame.holds())
}

/// Two numbers of which the second is larger, each `written` in five digits, or in as many as tell them apart.
pub(super) fn apart(low: f64, high: f64, written: fn(f64) -> String) -> [String; 2] {
    /// So much of the larger five digits tell to a hundredth.
    const TOLD: f64 = 0.01;
    let is_narrow = high > low && high - low < TOLD * low.abs().max(high.abs());
    if is_narrow { end_labels(low, high, false) } else { [low, high].map(written) }
}

/// A level in five digits at most: 4095 where that is all of it.
pub(super) fn level(value: f64) -> String {
    let shown = rounded(value);
    match shown.contains('.') && !shown.contains('e') {
        true => shown.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => shown,
    }
}

/// A number in five digits.
pub(super) fn rounded(value: f64) -> String {
    in_digits(value, DIGITS)
}

const DIGITS: i32 = 5;

/// The mean of samples in five digits, or in as many as two digits of their standard deviation have; of samples that are all the same, as
/// many as tell it from others.
pub(super) fn mean_beside(mean: f64, std: f64) -> String {
    /// Beyond these a double has none.
    const MOST: i32 = 15;
    if std == 0.0 {
        let five = rounded(mean);
        #[expect(clippy::cast_possible_truncation, reason = "samples are singles")]
        let shortest = (mean as f32).to_string().replace('-', "−");
        let is_longer = shortest.len() > five.len() && !five.contains('e');
        return if is_longer { shortest } else { five };
    }
    let below = magnitude(mean).saturating_sub(magnitude(std));
    in_digits(mean, below.saturating_add(2).clamp(DIGITS, MOST))
}

/// The power of ten that a number begins with; of 0 the least.
fn magnitude(value: f64) -> i32 {
    #[expect(clippy::cast_possible_truncation, reason = "logarithms of doubles are within ±324")]
    let magnitude = value.abs().log10().floor().max(-400.0) as i32;
    magnitude
}

fn in_digits(value: f64, digits: i32) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let magnitude = magnitude(value);
    let behind_point = |first: i32| usize::try_from(digits - 1 - first).unwrap_or(0);
    if (-4..7).contains(&magnitude) {
        format!("{value:.*}", behind_point(magnitude)).replace('-', "−")
    } else {
        format!("{value:.*e}", behind_point(0)).replace('-', "−")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Geometry;
    use crate::metadata::Metadata;

    fn frame(quantity: QuantityKind, channels: &[&str]) -> FrameHeader {
        let geometry = Geometry::new(4, 4, channels);
        FrameHeader { name: "f".into(), geometry, metadata: Metadata::new(quantity) }
    }

    #[test]
    fn planes_are_found_by_the_names_of_reports_files_and_classes() {
        let xyz = frame(QuantityKind::Xyz, &["R", "G", "B", "covariance.XX", "sigma.R", "sigma.G", "mask"]);
        let find = |frame: &FrameHeader, name| {
            Choice::of(frame, Some(name), true).map(|choice| (choice.channels[0], choice.filter))
        };
        for (name, place) in [
            ("Y", 1),
            ("y", 1),
            ("Sigma.y", 5),
            ("G", 1),
            ("sigma.Y", 5),
            ("sigma.G", 5),
            ("mask", 6),
            ("covariance.XX", 3),
        ] {
            assert_eq!(find(&xyz, name).unwrap(), (place, None), "{name}");
        }
        let complaint = find(&xyz, "sigma").unwrap_err().to_string();
        assert_eq!(complaint, "f: there is no plane `sigma`; it has X, Y, Z, covariance.XX, sigma.R, sigma.G, mask");
        let mut plane = frame(QuantityKind::Adu, &["Y"]);
        plane.metadata.cfa = Some("rggb".parse().unwrap());
        assert_eq!(find(&plane, "G").unwrap(), (0, Some('G')));
        assert_eq!(find(&plane, "Y").unwrap(), (0, None));
        let complaint = find(&plane, "C").unwrap_err().to_string();
        assert_eq!(complaint, "f: there is no plane `C`; it has Y, R, G, B");
    }

    #[test]
    fn what_cannot_be_below_zero_is_known() {
        let is_so = |quantity, channels: &[&str], name| {
            let frame = frame(quantity, channels);
            Choice::of(&frame, Some(name), true).unwrap().is_never_negative(&frame)
        };
        assert!(is_so(QuantityKind::ColorDifference, &MAP_CHANNELS, "jnd"));
        let xyz = ["R", "G", "B", "covariance.XY", "sigma.R"];
        assert!(is_so(QuantityKind::Xyz, &xyz, "sigma.R"));
        assert!(!is_so(QuantityKind::Xyz, &xyz, "covariance.XY") && !is_so(QuantityKind::Xyz, &xyz, "X"));
    }

    #[test]
    fn scales_say_quantity_and_unit() {
        let label = |quantity, channels: &[&str], name| {
            let frame = frame(quantity, channels);
            Choice::of(&frame, Some(name), true).unwrap().label(&frame)
        };
        let three = ["R", "G", "B", "covariance.XX", "sigma.G", "sigma.B", "variance.G", "mask"];
        for (quantity, name, wanted) in [
            (QuantityKind::Xyz, "Y", "Y / cd m⁻²"),
            (QuantityKind::Xyz, "sigma.Y", "standard deviation of Y / cd m⁻²"),
            (QuantityKind::Xyz, "covariance.XX", "variance of X / (cd m⁻²)²"),
            (QuantityKind::Xyz, "variance.Y", "variance of Y / (cd m⁻²)²"),
            (QuantityKind::Electrons, "variance.G", "variance of G / (e⁻)²"),
            (QuantityKind::Adu, "variance.G", "variance of G / ADU²"),
            (QuantityKind::Xyz, "mask", "mask, sum of bits"),
            (QuantityKind::Electrons, "G", "electrons, G / e⁻"),
            (QuantityKind::Adu, "sigma.G", "standard deviation of G / ADU"),
            (QuantityKind::Xyy, "x", "x"),
            (QuantityKind::Xyy, "sigma.Y", "standard deviation of Y / cd m⁻²"),
            (QuantityKind::Cct, "CCT", "CCT / K"),
            (QuantityKind::Lab, "a", "a*"),
        ] {
            assert_eq!(label(quantity, &three, name), wanted);
        }
        assert_eq!(label(QuantityKind::ColorDifference, &MAP_CHANNELS, "delta_e_76"), "ΔE*ab");
        for (number, wanted) in [(0.0, "0"), (2730.123, "2730.1"), (-0.001_234_56, "−0.0012346"), (1e9, "1.0000e9")] {
            assert_eq!(rounded(number), wanted);
        }
        for (number, wanted) in
            [(4095.0, "4095"), (1757.31, "1757.3"), (-0.5, "−0.5"), (40_000.0, "40000"), (1e9, "1.0000e9")]
        {
            assert_eq!(level(number), wanted);
        }
        for (mean, std, wanted) in [
            (1234.55, 0.028_856, "1234.550"),
            (1234.55, 0.5, "1234.55"),
            (1234.55, 20.0, "1234.5"),
            (0.001_2, 3.0, "0.0012000"),
            (0.0, 3.0, "0"),
            (-40_000.012_5, 0.001, "−40000.0125"),
            (3.0e8, 12.0, "3.00000000e8"),
            (f64::from(1234.56_f32), 0.0, "1234.56"),
            (100.0, 0.0, "100.00"),
            (1e9, 0.0, "1.0000e9"),
        ] {
            assert_eq!(mean_beside(mean, std), wanted);
        }
        assert_eq!(apart(5000.12, 5000.14, level), ["5000.12", "5000.14"]);
        assert_eq!(apart(1757.31, 4095.0, level), ["1757.3", "4095"]);
        let frame = frame(QuantityKind::Xyy, &["R", "G", "B"]);
        let (all, one) = (Choice::of(&frame, None, false).unwrap(), Choice::leading(&frame));
        assert_eq!(stage(&frame, &all, [4, 3]), "three planes of xyY / 1, 1, cd m⁻², 4 × 3");
        assert_eq!(
            (stage(&frame, &one, [4, 3]).as_str(), one.names(&frame)),
            ("Y / cd m⁻², 4 × 3", vec!["Y".to_owned()])
        );
        assert_eq!(typeset("W cm-2 sr-1 nm-1"), "W cm⁻² sr⁻¹ nm⁻¹");
        // As other programs write powers.
        assert_eq!(typeset("W.cm^-2.sr^-1.nm^-1"), "W.cm⁻².sr⁻¹.nm⁻¹");
        assert_eq!(typeset("J/m^2"), "J/m²");
    }
}
