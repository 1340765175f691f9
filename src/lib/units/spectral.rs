//! Units of spectral radiance, read as people write them.
//!
//! `W m-2 sr-1 nm-1`, `W/(m2 sr nm)`, `W·m⁻²·sr⁻¹·nm⁻¹`, `mW m^-2 sr^-1 nm^-1`, `uW/cm2/sr/nm`, `w_per_m2_sr_nm`, in any
//! order, alone or within a heading such as `radiance (W m-2 sr-1 nm-1)`. What follows a slash or `per` is divided by.

use super::spelling::{Base, Length, Power, Token, base, tokens};
use super::wavelength::WavelengthUnit;
use std::fmt;

/// The unit in which a file gives spectral radiance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RadianceUnit {
    power: Power,
    /// The side of the square.
    area: Length,
    wavelength: WavelengthUnit,
}

impl Default for RadianceUnit {
    /// W cm⁻² sr⁻¹ nm⁻¹, ours.
    fn default() -> Self {
        Self::W_PER_CM2_SR_NM
    }
}

impl RadianceUnit {
    /// W cm⁻² sr⁻¹ nm⁻¹, ours.
    pub const W_PER_CM2_SR_NM: Self =
        Self { power: Power::Watt, area: Length::Centimeter, wavelength: WavelengthUnit::Nanometer };

    /// Those in use, in the order in which help lists them.
    pub const USUAL: [Self; 5] = [
        Self::W_PER_CM2_SR_NM,
        Self { area: Length::Meter, ..Self::W_PER_CM2_SR_NM },
        Self { power: Power::Milliwatt, area: Length::Meter, ..Self::W_PER_CM2_SR_NM },
        Self { area: Length::Meter, wavelength: WavelengthUnit::Micrometer, ..Self::W_PER_CM2_SR_NM },
        Self { power: Power::Microwatt, ..Self::W_PER_CM2_SR_NM },
    ];

    /// What one such unit is in W cm⁻² sr⁻¹ nm⁻¹ at a wavelength, which matters where it is per wavenumber: L(λ) = L(ν)·|dν/dλ|.
    pub fn in_w_per_cm2_sr_nm(self, wavelength_nm: f64) -> f64 {
        let in_cm2 = match self.area {
            Length::Meter => 1e4,
            Length::Millimeter => 1e-2,
            _ => 1.0,
        };
        self.power.in_w() / self.wavelength.in_nm(wavelength_nm) / in_cm2
    }

    /// Whether it is per interval of wavenumber.
    pub fn is_per_wavenumber(self) -> bool {
        self.wavelength == WavelengthUnit::PerCentimeter
    }

    /// Reads a unit that is all of a text.
    pub fn parse(text: &str) -> Option<Self> {
        let tokens = tokens(text);
        match units_among(&tokens).as_slice() {
            [found] if found.begin == 0 && found.end == tokens.len() => match found.says {
                Stated::Radiance(unit) => Some(unit),
                Stated::Other { .. } => None,
            },
            _ => None,
        }
    }
}

impl fmt::Display for RadianceUnit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let interval = self.wavelength.symbol();
        let interval = if self.is_per_wavenumber() { format!("/ {interval}") } else { format!("{interval}-1") };
        write!(f, "{} {}-2 sr-1 {interval}", self.power.symbol(), self.area.symbol())
    }
}

/// What a text says about the unit of its numbers.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Stated {
    /// A spectral radiance.
    Radiance(RadianceUnit),
    /// The unit of something else.
    Other {
        /// The unit as it is written, words between spaces.
        text: String,
        /// What it is.
        kind: OtherUnit,
    },
}

/// What a unit is that is none of spectral radiance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OtherUnit {
    /// Power per area, from all directions.
    Irradiance,
    /// Photons instead of energy.
    Photons,
    /// Per interval of frequency, or of what may be wavenumber.
    PerFrequency,
    /// Radiance over all wavelengths.
    AllWavelengths,
    /// With a number before it.
    Scaled,
    /// A radiance beside which a factor stands.
    BesideFactor,
    /// Two units of radiance.
    Several,
    /// None that is known.
    Unknown,
}

impl OtherUnit {
    /// What it is, in words.
    pub fn in_words(self) -> &'static str {
        match self {
            Self::Irradiance => "an irradiance, which has no sr-1",
            Self::Photons => "a unit of photons, not of energy",
            Self::PerFrequency => "per interval of frequency or wavenumber, not of wavelength",
            Self::AllWavelengths => "a radiance over all wavelengths, which has no nm-1",
            Self::Scaled => "a unit with a number before it",
            Self::BesideFactor => {
                "a radiance beside a factor that may be in the values already or not; say what they are in as they stand"
            }
            Self::Several => "two units of radiance; say in which they are",
            Self::Unknown => "no unit of spectral radiance that is known",
        }
    }

    /// Whether the numbers cannot be spectral radiances, whatever a user says.
    pub fn is_another_quantity(self) -> bool {
        matches!(self, Self::Irradiance | Self::Photons | Self::PerFrequency)
    }
}

/// The units of radiance, or of what may be taken for it, that a text names, first to last.
pub fn units_in(text: &str) -> Vec<Stated> {
    let tokens = tokens(text);
    units_among(&tokens).into_iter().map(|found| found.written_in(text, &tokens)).collect()
}

/// What the heading of a column says about the unit of its numbers; a name such as `irradiance` counts where there is no
/// unit, and what stands in brackets where it looks like one.
pub fn unit_of_heading(heading: &str) -> Option<Stated> {
    let whole = |kind| Some(Stated::Other { text: heading.trim().to_owned(), kind });
    let radiances = units_among(&tokens(heading)).into_iter().filter(|found| matches!(found.says, Stated::Radiance(_)));
    let radiances: Vec<Stated> = radiances.map(|found| found.says).collect();
    if radiances.windows(2).any(|pair| pair[0] != pair[1]) {
        return whole(OtherUnit::Several);
    }
    // What stands before brackets that hold a unit is none of it.
    if let Some(text) = in_last_brackets(heading) {
        let outside = heading.replace(text, "");
        let tokens = tokens(text);
        if let [found] = units_among(&tokens).as_slice()
            && matches!(found.says, Stated::Radiance(_))
        {
            let scaled = if found.is_beside_factor(text, &tokens) {
                whole(OtherUnit::BesideFactor)
            } else {
                beside_factor(heading, &outside)
            };
            return Some(scaled.unwrap_or_else(|| found.says.clone()));
        }
    }
    let tokens = tokens(heading);
    let named = |kind| Some(Stated::Other { text: heading.to_owned(), kind });
    let in_words = || {
        tokens.iter().filter_map(Token::lower).find_map(|word| match (word.as_str(), base(&word)) {
            ("irradiance", _) => named(OtherUnit::Irradiance),
            (_, Some(Base::Photons)) => named(OtherUnit::Photons),
            _ => None,
        })
    };
    let bracketed = in_brackets(heading);
    let in_brackets = || {
        let text = bracketed.filter(|text| looks_like_a_unit(text))?;
        Some(Stated::Other { text: text.to_owned(), kind: OtherUnit::Unknown })
    };
    let found = units_among(&tokens).pop().map(|found| {
        let written = as_written(heading, &tokens[found.begin..found.end]);
        let outside = written.map_or_else(|| heading.to_owned(), |unit| heading.replacen(unit, "", 1));
        match &found.says {
            Stated::Radiance(_) => beside_factor(heading, &outside).unwrap_or_else(|| found.says.clone()),
            Stated::Other { .. } => found.written_in(heading, &tokens),
        }
    });
    let found = found.map(|says| match (says, bracketed) {
        // Part of a unit is none: `(W/m2/xy/nm)`.
        (Stated::Other { kind: OtherUnit::Irradiance | OtherUnit::AllWavelengths, .. }, Some(text))
            if self::tokens(text).iter().any(Token::is_strange) =>
        {
            Stated::Other { text: text.to_owned(), kind: OtherUnit::Unknown }
        }
        (says, _) => says,
    });
    // `radiance_w_m2_sr_um`: powers that nobody tells from places.
    let in_name = || whole(OtherUnit::Unknown).filter(|_| names_unit_in_words(heading));
    found.or_else(in_words).or_else(in_brackets).or_else(in_name)
}

/// Tokens as a text.
fn shown(tokens: &[Token]) -> String {
    tokens.iter().map(Token::shown).collect::<Vec<_>>().join(" ")
}

/// Whether a piece beside a unit, in the same brackets, may be a factor: a number, a word with one, or a letter or prefix alone.
fn scales(token: &Token) -> bool {
    match token {
        Token::Number(_) => true,
        Token::Factor { word, exponent } => {
            let lower = word.to_lowercase();
            let has_number = exponent.is_some() || lower.contains(|c: char| c.is_numeric());
            has_number || lower.chars().count() == 1 || FACTORS_IN_WORDS.contains(&lower.as_str())
        }
        Token::Per | Token::Square | Token::End => false,
    }
}

/// Whether a piece before a power of ten changes nothing.
fn is_times_one(token: &Token) -> bool {
    match token {
        Token::Number(number) => number == "1",
        Token::Factor { word, exponent: None } => word.eq_ignore_ascii_case("x"),
        _ => false,
    }
}

/// Whether the words of a name are those of a unit of radiance.
fn names_unit_in_words(heading: &str) -> bool {
    const POWERS: [&str; 6] = ["w", "mw", "uw", "µw", "kw", "nw"];
    let lower = heading.to_lowercase();
    let words: Vec<&str> = lower.split(|c: char| !c.is_alphanumeric()).collect();
    words.contains(&"sr") && words.iter().any(|word| POWERS.contains(word))
}

/// Words that multiply.
const FACTORS_IN_WORDS: [&str; 18] = [
    "log",
    "log10",
    "ln",
    "times",
    "scaled",
    "multiplied",
    "divided",
    "db",
    "kilo",
    "milli",
    "micro",
    "nano",
    "mega",
    "giga",
    "thousand",
    "million",
    "percent",
    "x",
];

/// What is said where a factor stands beside the unit of a heading; nothing where none does. `outside` is the heading without
/// the unit.
fn beside_factor(heading: &str, outside: &str) -> Option<Stated> {
    let lower = outside.to_lowercase().replace(['×', '*', '·', '/'], " * ");
    let words: Vec<&str> =
        lower.split(|c: char| !(c.is_alphanumeric() || "^*.+-".contains(c))).filter(|word| !word.is_empty()).collect();
    let is_power = |text: &str| {
        let digits = text.strip_prefix("10").unwrap_or_default();
        digits.starts_with('^') || digits.starts_with('-') || digits.starts_with('⁻')
    };
    let is_exponential = |text: &str| {
        text.starts_with(|c: char| c.is_ascii_digit()) && text.contains('e') && text.parse::<f64>().is_ok()
    };
    let is_large = |text: &str| {
        is_power(text) || text.parse::<f64>().is_ok_and(|factor| factor >= 10.0 || factor > 0.0 && factor < 1.0)
    };
    let is_sign = |place: usize| words.get(place).is_some_and(|word| ["x", "*"].contains(word));
    let is_factor = words.iter().enumerate().any(|(place, word)| {
        let number = word.trim_start_matches(['x', '*']);
        let is_signed = number.len() < word.len() || place > 0 && is_sign(place - 1) || is_sign(place + 1);
        FACTORS_IN_WORDS.contains(word) && *word != "x"
            || is_power(number)
            || is_exponential(number)
            || is_signed && is_large(number)
    });
    is_factor.then(|| Stated::Other { text: heading.trim().to_owned(), kind: OtherUnit::BesideFactor })
}

/// What stands in the last brackets of a heading, brackets in them included.
fn in_last_brackets(heading: &str) -> Option<&str> {
    let close = heading.rfind([')', ']'])?;
    let mut depth = 0;
    for (at, c) in heading[..close].char_indices().rev() {
        match c {
            ')' | ']' => depth += 1,
            '(' | '[' if depth > 0 => depth -= 1,
            '(' | '[' => return Some(heading[at + 1..close].trim()),
            _ => {}
        }
    }
    None
}

/// What stands between the first and the last bracket of a heading.
fn in_brackets(heading: &str) -> Option<&str> {
    let [open, close] = [heading.find(['(', '[']), heading.rfind([')', ']'])].map(Option::unwrap_or_default);
    heading.get(open + 1..close).map(str::trim).filter(|text| !text.is_empty())
}

/// Whether a text is the unit of something, known or not: it has powers or is divided, or is a unit or a scale that people
/// name.
fn looks_like_a_unit(text: &str) -> bool {
    const NAMED: [&str; 32] = [
        "cd",
        "lm",
        "lx",
        "lux",
        "nit",
        "nits",
        "flick",
        "mw",
        "gw",
        "pw",
        "w",
        "j",
        "erg",
        "v",
        "mv",
        "uv",
        "db",
        "dn",
        "adu",
        "counts",
        "count",
        "cts",
        "percent",
        "rel",
        "relative",
        "normalized",
        "normalised",
        "arb",
        "au",
        "log",
        "log10",
        "ev",
    ];
    let tokens = tokens(text);
    let has_numbers = tokens.iter().any(|token| matches!(token, Token::Number(_) | Token::End));
    let is_power =
        |token: &Token| !has_numbers && matches!(token, Token::Per | Token::Factor { exponent: Some(_), .. });
    let is_named = |token: &Token| token.lower().is_some_and(|word| NAMED.contains(&word.as_str()));
    text.contains('%') || text == "a.u." || tokens.iter().any(is_power) || tokens.first().is_some_and(is_named)
}

/// A unit among the pieces of a text.
struct Found {
    begin: usize,
    end: usize,
    says: Stated,
}

impl Found {
    /// Whether what stands beside it in a text of these pieces may be a factor.
    fn is_beside_factor(&self, text: &str, tokens: &[Token]) -> bool {
        let (mut before, after) = (&tokens[..self.begin], &tokens[self.end..]);
        let has_power = matches!(tokens[self.begin], Token::Number(_));
        // `1 x 10^-3 W` is a power of ten.
        while let Some((_, rest)) = before.split_last().filter(|(last, _)| has_power && is_times_one(last)) {
            before = rest;
        }
        let beside = as_written(text, &tokens[self.begin..self.end]).and_then(|unit| text.split_once(unit));
        let has_digits = |text: &str| text.contains(|c: char| c.is_numeric());
        let is_told = beside.is_some_and(|(left, right)| {
            let left = if has_power { left.trim_end_matches(|c: char| "x×*·1 ".contains(c)) } else { left };
            has_digits(left) || has_digits(right)
        });
        is_told || text.contains('%') || before.iter().chain(after).any(scales)
    }

    /// What it says, another unit than of radiance as it is written in a text of these pieces.
    fn written_in(&self, text: &str, tokens: &[Token]) -> Stated {
        match &self.says {
            Stated::Other { kind, text: plain } => {
                let written = as_written(text, &tokens[self.begin..self.end]).unwrap_or(plain);
                Stated::Other { text: written.to_owned(), kind: *kind }
            }
            radiance => radiance.clone(),
        }
    }
}

/// The shortest part of a text, between blanks and brackets, that has these pieces.
fn as_written<'a>(text: &'a str, pieces: &[Token]) -> Option<&'a str> {
    /// Longer texts are not looked through.
    const MOST_BYTES: usize = 200;
    if text.len() > MOST_BYTES {
        return None;
    }
    let is_edge = |c: char| c.is_whitespace() || "([,:;=)]".contains(c);
    let edges = text.char_indices().filter(|(_, c)| is_edge(*c));
    let cuts: Vec<usize> =
        [0].into_iter().chain(edges.flat_map(|(at, c)| [at, at + c.len_utf8()])).chain([text.len()]).collect();
    let parts = cuts.iter().flat_map(|from| cuts.iter().filter_map(|to| text.get(*from..*to)));
    let is_closed = |part: &&str| part.matches('(').count() == part.matches(')').count();
    parts.map(str::trim).filter(is_closed).filter(|part| tokens(part) == pieces).min_by_key(|part| part.len())
}

/// The units among pieces: each a power (or photons, or energy) and what it is divided by; before it stand factors with
/// negative powers alone.
fn units_among(tokens: &[Token]) -> Vec<Found> {
    let known = |place: usize| match &tokens[place] {
        Token::Factor { word, exponent } => base(word).map(|base| (base, *exponent)),
        _ => None,
    };
    let heads =
        |place: usize| matches!(known(place), Some((Base::Power(_) | Base::Photons | Base::Energy, None | Some(1))));
    let is_divisor = |place: usize| known(place).is_some_and(|(_, exponent)| exponent.is_some_and(|power| power < 0));
    let mut found: Vec<Found> = Vec::new();
    for place in (0..tokens.len()).filter(|&place| heads(place)) {
        let mut begin = place;
        while begin > found.last().map_or(0, |before| before.end) && is_divisor(begin - 1) {
            begin -= 1;
        }
        let mut end = place + 1;
        let mut is_divided = false;
        while end < tokens.len() {
            match &tokens[end] {
                Token::Per | Token::Square => is_divided |= tokens[end] == Token::Per,
                Token::Factor { .. } if is_divisor(end) || is_divided && known(end).is_some() && !heads(end) => {}
                _ => break,
            }
            end += 1;
        }
        if end - begin > 1 {
            let number = |place: usize| match &tokens[place] {
                Token::Number(number) => Some(number.as_str()),
                _ => None,
            };
            let scale = (begin > 0).then(|| number(begin - 1)).flatten();
            // Two numbers are no scale.
            let is_one = begin < 2 || number(begin - 2).is_none();
            let from = if scale.is_some() { begin - 1 } else { begin };
            let text = shown(&tokens[from..end]);
            let scaled = |unit: RadianceUnit, scale: &str| {
                unit.power.times(scale).filter(|_| is_one).map(|power| RadianceUnit { power, ..unit })
            };
            let says = match (scale, product(&tokens[begin..end])) {
                (None, Ok(unit)) => Stated::Radiance(unit),
                (Some(scale), Ok(unit)) => {
                    scaled(unit, scale).map_or(Stated::Other { text, kind: OtherUnit::Scaled }, Stated::Radiance)
                }
                (_, Err(kind)) => Stated::Other { text, kind },
            };
            found.push(Found { begin: from, end, says });
        }
    }
    found
}

/// What a product of factors is: a unit of spectral radiance, or what else.
fn product(tokens: &[Token]) -> Result<RadianceUnit, OtherUnit> {
    let [mut is_divided, mut is_square] = [false; 2];
    let (mut power, mut photons, mut others) = (None, false, false);
    let (mut per_sr, mut per_frequency, mut per_wavenumber) = (0, false, false);
    let mut lengths: Vec<(Length, i32)> = Vec::new();
    for token in tokens {
        let Token::Factor { word, exponent } = token else {
            is_divided |= *token == Token::Per;
            is_square |= *token == Token::Square;
            continue;
        };
        let squared = if std::mem::take(&mut is_square) { 2 } else { 1 };
        let exponent = match *exponent {
            // `mW/(m2 sr cm-1)`: an interval of wavenumber.
            Some(-1) if is_divided && base(word) == Some(Base::Length(Length::Centimeter)) => {
                per_wavenumber = true;
                continue;
            }
            Some(negative) if negative < 0 && is_divided => {
                per_frequency |= matches!(base(word), Some(Base::Length(_)));
                others = true;
                negative
            }
            exponent => exponent.unwrap_or(squared) * if is_divided { -1 } else { 1 },
        };
        match base(word) {
            Some(Base::Power(unit)) => power = Some(unit),
            Some(Base::Photons) => photons = true,
            Some(Base::Length(length)) => match lengths.iter_mut().find(|(known, _)| *known == length) {
                Some((_, sum)) => *sum += exponent,
                None => lengths.push((length, exponent)),
            },
            Some(Base::SolidAngle) => per_sr += exponent,
            Some(Base::Frequency) => per_frequency = true,
            Some(Base::Energy | Base::Time) | None => others = true,
        }
    }
    if photons {
        return Err(OtherUnit::Photons);
    }
    if per_frequency {
        return Err(OtherUnit::PerFrequency);
    }
    if others {
        return Err(OtherUnit::Unknown);
    }
    lengths.sort_by_key(|(_, exponent)| *exponent);
    let wavelength = |length| match length {
        Length::Nanometer => Ok(WavelengthUnit::Nanometer),
        Length::Micrometer => Ok(WavelengthUnit::Micrometer),
        Length::Angstrom => Ok(WavelengthUnit::Angstrom),
        Length::Meter => Ok(WavelengthUnit::Meter),
        // Whoever writes so may mean wavenumbers.
        Length::Centimeter => Err(OtherUnit::PerFrequency),
        Length::Millimeter => Err(OtherUnit::Unknown),
    };
    let is_area = |length| matches!(length, Length::Millimeter | Length::Centimeter | Length::Meter);
    let power = power.ok_or(OtherUnit::Unknown)?;
    match (per_sr, lengths.as_slice()) {
        (-1, [(area, -2)]) if per_wavenumber && is_area(*area) => {
            Ok(RadianceUnit { power, area: *area, wavelength: WavelengthUnit::PerCentimeter })
        }
        _ if per_wavenumber => Err(OtherUnit::PerFrequency),
        (-1, [(area, -2), (length, -1)]) if is_area(*area) => {
            Ok(RadianceUnit { power, area: *area, wavelength: wavelength(*length)? })
        }
        (-1, [(Length::Meter, -3)]) => {
            Ok(RadianceUnit { power, area: Length::Meter, wavelength: WavelengthUnit::Meter })
        }
        (-1, [(area, -2)]) if is_area(*area) => Err(OtherUnit::AllWavelengths),
        (0, [(area, -2), ..] | [(area, -3)]) if is_area(*area) => Err(OtherUnit::Irradiance),
        _ => Err(OtherUnit::Unknown),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Spellings, and what one such unit is in W cm⁻² sr⁻¹ nm⁻¹.
    const RADIANCES: [(&str, f64); 55] = [
        ("W cm-2 sr-1 nm-1", 1.0),
        ("W m-2 sr-1 nm-1", 1e-4),
        ("W.m^-2.sr^-1.nm^-1", 1e-4),
        ("W/(m2 sr nm)", 1e-4),
        ("W/m2/str/nm", 1e-4),
        ("W/(m^2*sr*nm)", 1e-4),
        ("W/(m**2 sr nm)", 1e-4),
        ("W·m⁻²·sr⁻¹·nm⁻¹", 1e-4),
        ("W⋅m−2⋅sr−1⋅nm−1", 1e-4),
        ("W m^{-2} sr^{-1} nm^{-1}", 1e-4),
        ("W/m²/sr/nm", 1e-4),
        ("W/m2-sr-nm", 1e-4),
        ("W/m2 sr nm", 1e-4),
        ("W m-2 sr-1/nm", 1e-4),
        ("(W/m2)/(sr nm)", 1e-4),
        ("sr-1 nm-1 m-2 W", 1e-4),
        ("nm^-1 W sr^-1 m^-2", 1e-4),
        ("W nm-1 sr-1 m-2", 1e-4),
        ("w_per_m2_sr_nm", 1e-4),
        ("W per square meter per steradian per nanometer", 1e-4),
        ("watts per square metre per steradian per nanometre", 1e-4),
        ("mW m^-2 sr^-1 nm^-1", 1e-7),
        ("mW/m2/sr/nm", 1e-7),
        ("milliwatts/m2/sr/nm", 1e-7),
        ("uW/cm2/sr/nm", 1e-6),
        ("µW/cm2/sr/nm", 1e-6),
        ("μW cm⁻² sr⁻¹ nm⁻¹", 1e-6),
        ("uW cm-2 sr-1 nm-1", 1e-6),
        ("nW cm-2 sr-1 nm-1", 1e-9),
        ("kW m-2 sr-1 um-1", 1e-4),
        ("W/m²/sr/µm", 1e-7),
        ("W m-2 sr-1 um-1", 1e-7),
        ("W/(m2 sr micron)", 1e-7),
        ("W m-2 um-1 sr-1", 1e-7),
        ("W cm-2 sr-1 um-1", 1e-3),
        ("W/cm2/sr/Å", 10.0),
        ("W/cm2/sr/A", 10.0),
        ("W mm-2 sr-1 nm-1", 100.0),
        ("W m-3 sr-1", 1e-13),
        ("W m-2 sr-1 m-1", 1e-13),
        ("W/(m2 sr m)", 1e-13),
        ("W cm-2 sr-1 m-1", 1e-9),
        ("W/cm2/sr/m", 1e-9),
        ("m-1 W cm-2 sr-1", 1e-9),
        ("10^-3 W m-2 sr-1 nm-1", 1e-7),
        ("10⁻³ W m⁻² sr⁻¹ nm⁻¹", 1e-7),
        ("10**-3 W/(m**2 sr nm)", 1e-7),
        ("1e-6 W cm-2 sr-1 nm-1", 1e-6),
        ("0.001 W m-2 sr-1 nm-1", 1e-7),
        ("1E3 uW cm-2 sr-1 nm-1", 1e-3),
        // At 500 nm 1 cm⁻¹ is 0.025 nm, the wavenumber being 20 000 cm⁻¹.
        ("W cm-2 sr-1 / cm-1", 40.0),
        ("W/(cm2 sr cm-1)", 40.0),
        ("W cm^-2 sr^-1 (cm^-1)^-1", 40.0),
        ("mW/(m^2 sr cm^-1)", 4e-6),
        ("mW m⁻² sr⁻¹ / cm⁻¹", 4e-6),
    ];

    #[test]
    fn radiances_are_read_as_people_write_them() {
        for (text, factor) in RADIANCES {
            for shown in [text.to_owned(), format!("radiance ({text})"), format!("sky1 [{text}]"), format!("L, {text}")]
            {
                let read = match unit_of_heading(&shown) {
                    Some(Stated::Radiance(unit)) => unit.in_w_per_cm2_sr_nm(500.0),
                    other => panic!("{shown}: {other:?}"),
                };
                assert!((read / factor - 1.0).abs() < 1e-15, "{shown}: {read}");
            }
            let unit = RadianceUnit::parse(text).unwrap_or_else(|| panic!("{text}"));
            assert_eq!(RadianceUnit::parse(&unit.to_string()), Some(unit));
        }
        for unit in RadianceUnit::USUAL {
            assert_eq!(RadianceUnit::parse(&unit.to_string()), Some(unit));
        }
    }

    #[test]
    fn a_factor_beside_the_unit_is_told() {
        const UNIT: &str = "W m-2 sr-1 nm-1";
        for heading in [
            format!("radiance x1000 [{UNIT}]"),
            format!("radiance [{UNIT}] x1000"),
            format!("radiance × 1000 ({UNIT})"),
            format!("radiance*1e3 ({UNIT})"),
            format!("1e3 * radiance ({UNIT})"),
            format!("L 10^-3 ({UNIT})"),
            format!("L x 10⁻³ ({UNIT})"),
            format!("log10 radiance ({UNIT})"),
            format!("radiance, scaled by 100 ({UNIT})"),
            format!("radiance x1000, {UNIT}"),
            format!("radiance (x10^-3 {UNIT})"),
            format!("radiance ({UNIT} x 1000)"),
            format!("radiance ({UNIT} / 1000)"),
            format!("radiance ({UNIT} 10^-3)"),
            format!("radiance ({UNIT} (x 10^3))"),
            format!("radiance ({UNIT}; scaled by 1000)"),
            format!("radiance ({UNIT} per 10 nm)"),
            format!("radiance (m {UNIT})"),
            format!("radiance (% {UNIT})"),
            format!("1000*radiance ({UNIT})"),
            format!("radiance/10 ({UNIT})"),
            format!("0.001 * radiance ({UNIT})"),
            format!("dB radiance ({UNIT})"),
            format!("kilo radiance ({UNIT})"),
        ] {
            let wanted = Stated::Other { text: heading.clone(), kind: OtherUnit::BesideFactor };
            assert_eq!(unit_of_heading(&heading), Some(wanted));
        }
        for name in ["sky 30", "sky1", "x1", "sza 45 az 90", "site 3.5", "2024-05-01", "(a) 12:30", "L_e", "12e"] {
            let heading = format!("{name} [{UNIT}]");
            assert_eq!(unit_of_heading(&heading), RadianceUnit::parse(UNIT).map(Stated::Radiance), "{heading}");
        }
    }

    #[test]
    fn other_units_are_quoted_as_they_are_written() {
        for (heading, written) in [
            ("E [W/m2/nm]", "W/m2/nm"),
            ("E, W·m⁻²·nm⁻¹", "W·m⁻²·nm⁻¹"),
            ("L (µmol m⁻² s⁻¹ sr⁻¹ nm⁻¹)", "µmol m⁻² s⁻¹ sr⁻¹ nm⁻¹"),
            ("L (100 W/(m² sr nm))", "100 W/(m² sr nm)"),
        ] {
            assert!(
                matches!(unit_of_heading(heading), Some(Stated::Other { text, .. }) if text == written),
                "{:?}",
                unit_of_heading(heading)
            );
        }
    }

    #[test]
    fn other_units_are_told_from_radiances() {
        use OtherUnit::{AllWavelengths, Irradiance, PerFrequency, Photons, Scaled, Several, Unknown};
        for (text, kind) in [
            ("irradiance (W m-2 nm-1)", Irradiance),
            ("E [W/m2/nm]", Irradiance),
            ("W/m²/µm", Irradiance),
            ("W m-3", Irradiance),
            ("irradiance", Irradiance),
            ("spectral_irradiance_w_per_m2_nm", Irradiance),
            ("photons s-1 m-2 sr-1 nm-1", Photons),
            ("L (umol m-2 s-1 sr-1 nm-1)", Photons),
            ("µmol/m2/s", Photons),
            ("quanta/s/cm2/sr/nm", Photons),
            ("photon_radiance", Photons),
            ("mW/(m^2 cm^-1)", PerFrequency),
            ("W m-2 sr-1 cm-1", PerFrequency),
            ("W m-2 sr-1 Hz-1", PerFrequency),
            ("W m-2 sr-1", AllWavelengths),
            ("W.m^-2.sr^-1", AllWavelengths),
            ("10^-4 W m-2 sr-1 nm-1", Scaled),
            ("radiance (100 W cm-2 sr-1 nm-1)", Scaled),
            ("radiance (1000 W m-2 sr-1 nm-1)", Scaled),
            ("3 × 10⁻³ W m⁻² sr⁻¹ nm⁻¹", Scaled),
            ("erg s-1 cm-2 sr-1 A-1", Unknown),
            ("W sr-1 nm-1", Unknown),
            ("radiance (MW m-2 sr-1 nm-1)", Unknown),
            ("radiance (MW/m2)", Unknown),
            ("L (cd m-2)", Unknown),
            ("L [cd/m2]", Unknown),
            ("sky (%)", Unknown),
            ("sky (counts)", Unknown),
            ("sky [a.u.]", Unknown),
            ("L (flick)", Unknown),
            ("radiance (W/m2/xy/nm)", Unknown),
            ("MW m-2 sr-1 nm-1", Unknown),
            ("radiance_w_m2_sr_um", Unknown),
            ("Lw_W_m2_sr_um", Unknown),
            ("radiance_uW_cm2_sr_nm", Unknown),
            ("radiance (mW m-2 sr-1 nm-1) (W m-2 sr-1 nm-1)", Several),
            ("radiance (mW m-2 sr-1 nm-1, was W m-2 sr-1 nm-1)", Several),
        ] {
            assert!(
                matches!(unit_of_heading(text), Some(Stated::Other { kind: found, .. }) if found == kind),
                "{text}: {:?}",
                unit_of_heading(text)
            );
            assert_eq!(RadianceUnit::parse(text), None, "{text}");
        }
        for text in [
            "radiance",
            "L",
            "W",
            "A",
            "sky (measured)",
            "Y 1391.68 cd m-2",
            "a work of W",
            "sky (az=90/el=45)",
            "sky (90/45)",
        ] {
            assert_eq!(unit_of_heading(text), None, "{text}");
        }
    }
}
