//! Units of spectral radiance, read as people write them.
//!
//! `W m-2 sr-1 nm-1`, `W/(m2 sr nm)`, `W·m⁻²·sr⁻¹·nm⁻¹`, `mW m^-2 sr^-1 nm^-1`, `uW/cm2/sr/nm`, `w_per_m2_sr_nm`, in any
//! order, alone or among other words; and with energies over time, `erg s-1 cm-2 sr-1 A-1`. What follows a slash or `per` is divided by.

use super::other::OtherUnit;
use super::quantity::is_reading;
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

    /// Whether it is per interval of wavenumber, or of the energy of photons.
    pub fn is_per_wavenumber(self) -> bool {
        self.wavelength.is_of_energy()
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
        let interval = if self.wavelength == WavelengthUnit::PerCentimeter {
            format!("/ {interval}")
        } else {
            format!("{interval}-1")
        };
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

/// Tokens as a text.
fn shown(tokens: &[Token]) -> String {
    tokens.iter().map(Token::shown).collect::<Vec<_>>().join(" ")
}

/// A unit among the pieces of a text.
pub(super) struct Found {
    pub(super) begin: usize,
    pub(super) end: usize,
    pub(super) says: Stated,
}

impl Found {
    /// Where it ends with what it is divided by, of which a piece may be none that is known: `W/m2xy nm`.
    fn whole(&self, tokens: &[Token]) -> usize {
        let is_part = |token: &Token| match token {
            Token::Factor { word, .. } => base(word).is_some(),
            token => *token == Token::Per,
        };
        match tokens.get(self.end) {
            Some(Token::End) if tokens[self.end - 1] == Token::Per => {
                let behind = &tokens[self.end + 1..];
                self.end + 1 + behind.iter().take_while(|token| is_part(token)).count()
            }
            _ => self.end,
        }
    }

    /// What it says, another unit than of radiance as it is written in a text of these pieces.
    pub(super) fn written_in(&self, text: &str, tokens: &[Token]) -> Stated {
        match &self.says {
            Stated::Other { kind, text: plain } => {
                let written = as_written(text, &tokens[self.begin..self.whole(tokens)]).unwrap_or(plain);
                Stated::Other { text: written.to_owned(), kind: *kind }
            }
            radiance => radiance.clone(),
        }
    }
}

/// The shortest part of a text, between blanks and brackets, that has these pieces.
pub(super) fn as_written<'a>(text: &'a str, pieces: &[Token]) -> Option<&'a str> {
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
pub(super) fn units_among(tokens: &[Token]) -> Vec<Found> {
    let known = |place: usize| match &tokens[place] {
        Token::Factor { word, exponent } => base(word).map(|base| (base, *exponent)),
        _ => None,
    };
    let heads =
        |place: usize| matches!(known(place), Some((Base::Power(_) | Base::Photons | Base::Energy(_), None | Some(1))));
    let is_divisor = |place: usize| known(place).is_some_and(|(_, exponent)| exponent.is_some_and(|power| power < 0));
    let is_multiplied = |place: usize| {
        let factor = (place < tokens.len()).then(|| known(place)).flatten();
        matches!(factor, Some((Base::SolidAngle | Base::Length(_), None)))
    };
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
            let scale = begin.checked_sub(1).and_then(|place| tokens[place].number());
            // Two numbers are no scale.
            let is_one = begin < 2 || tokens[begin - 2].number().is_none();
            let from = if scale.is_some() { begin - 1 } else { begin };
            let says = product(&tokens[begin..end]);
            // What divides and is not known is part of it: `W/km2/sr/nm`, `W/m2/sr/5nm`.
            if matches!(says, Err(OtherUnit::Unknown | OtherUnit::AllWavelengths)) && tokens[end - 1] == Token::Per {
                let is_part = |place: &usize| match &tokens[*place] {
                    Token::Per | Token::Square => true,
                    Token::Factor { .. } | Token::Number(_) if tokens[*place - 1] == Token::Per => !heads(*place),
                    Token::Factor { .. } => known(*place).is_some() && !heads(*place),
                    Token::Number(_) | Token::End => false,
                };
                end += (end..tokens.len()).take_while(is_part).count();
            }
            let text = shown(&tokens[from..end]);
            let scaled = |unit: RadianceUnit, scale: &str| {
                unit.power.times(scale).filter(|_| is_one).map(|power| RadianceUnit { power, ..unit })
            };
            let says = match (scale, says) {
                (_, Ok(_)) if is_per_reading(tokens, end) => {
                    end += 1;
                    Stated::Other { text: shown(&tokens[from..end]), kind: OtherUnit::PerReading }
                }
                (_, Ok(_)) if is_of_reading_per(tokens, from) => Stated::Other { text, kind: OtherUnit::Responsivity },
                (None, Ok(unit)) => Stated::Radiance(unit),
                (Some(scale), Ok(unit)) => {
                    scaled(unit, scale).map_or(Stated::Other { text, kind: OtherUnit::Scaled }, Stated::Radiance)
                }
                (_, Err(OtherUnit::Irradiance | OtherUnit::AllWavelengths)) if is_multiplied(end) => {
                    end = (end..tokens.len()).find(|&place| !is_multiplied(place)).unwrap_or(tokens.len());
                    Stated::Other { text: shown(&tokens[from..end]), kind: OtherUnit::Undivided }
                }
                (_, Err(kind)) => Stated::Other { text, kind },
            };
            found.push(Found { begin: from, end, says });
        }
    }
    found
}

/// Whether a unit that ends before `place` is divided by what an instrument reads: `/ count`, `DN-1`.
fn is_per_reading(tokens: &[Token], place: usize) -> bool {
    match tokens.get(place) {
        Some(Token::Factor { word, exponent: None }) => is_reading(word) && tokens[place - 1] == Token::Per,
        Some(Token::Factor { word, exponent: Some(-1) }) => is_reading(word),
        _ => false,
    }
}

/// Whether a unit that begins at `place` divides what an instrument reads: `counts / (W ...)`.
fn is_of_reading_per(tokens: &[Token], place: usize) -> bool {
    let before = tokens[..place].split_last_chunk();
    matches!(before, Some((_, [Token::Factor { word, exponent: None }, Token::Per])) if is_reading(word))
}

/// What a product of factors is: a unit of spectral radiance, or what else.
fn product(tokens: &[Token]) -> Result<RadianceUnit, OtherUnit> {
    let Dimensions {
        power,
        energy,
        has_photons,
        has_others,
        per_sr,
        time,
        per_frequency,
        per_wavenumber,
        per_ev,
        mut lengths,
    } = Dimensions::of(tokens);
    if has_photons {
        return Err(OtherUnit::Photons);
    }
    if per_frequency {
        return Err(OtherUnit::PerFrequency);
    }
    if has_others {
        return Err(OtherUnit::Unknown);
    }
    lengths.sort_by_key(|(_, exponent)| *exponent);
    let is_area = |length| matches!(length, Length::Millimeter | Length::Centimeter | Length::Meter);
    let power = match (power, energy, time) {
        (Some(power), None, 0) | (None, Some(power), -1) => power,
        (None, Some(_), 0) | (Some(_), None, 1) => return Err(OtherUnit::Energy),
        _ => return Err(OtherUnit::Unknown),
    };
    match (per_sr, lengths.as_slice()) {
        (-1, [(area, -2)]) if per_wavenumber && is_area(*area) => {
            Ok(RadianceUnit { power, area: *area, wavelength: WavelengthUnit::PerCentimeter })
        }
        _ if per_wavenumber => Err(OtherUnit::PerFrequency),
        (-1, [(area, -2)]) if per_ev == -1 && is_area(*area) => {
            Ok(RadianceUnit { power, area: *area, wavelength: WavelengthUnit::ElectronVolt })
        }
        (0, [(area, -2)]) if per_ev == -1 && is_area(*area) => Err(OtherUnit::Irradiance),
        _ if per_ev != 0 => Err(OtherUnit::Unknown),
        (-1, [(area, -2), (length, -1)]) if is_area(*area) => {
            Ok(RadianceUnit { power, area: *area, wavelength: interval(*length)? })
        }
        (-1, [(Length::Centimeter, -3)]) => Err(OtherUnit::PerCentimeter),
        (-1, [(Length::Meter, -3)]) => {
            Ok(RadianceUnit { power, area: Length::Meter, wavelength: WavelengthUnit::Meter })
        }
        (-1, [(area, -2)]) if is_area(*area) => Err(OtherUnit::AllWavelengths),
        (0, [(area, -2), ..] | [(area, -3)]) if is_area(*area) => Err(OtherUnit::Irradiance),
        (-1, []) => Err(OtherUnit::Intensity),
        (-1, [(length, -1)]) if !is_area(*length) => Err(OtherUnit::Intensity),
        (0, [(length, -1)]) if !is_area(*length) => Err(OtherUnit::Power),
        _ => Err(OtherUnit::Unknown),
    }
}

/// The interval of wavelength that a length is, by which a radiance is divided.
fn interval(length: Length) -> Result<WavelengthUnit, OtherUnit> {
    match length {
        Length::Nanometer => Ok(WavelengthUnit::Nanometer),
        Length::Micrometer => Ok(WavelengthUnit::Micrometer),
        Length::Angstrom => Ok(WavelengthUnit::Angstrom),
        Length::Meter => Ok(WavelengthUnit::Meter),
        // Whoever writes so may mean wavenumbers.
        Length::Centimeter => Err(OtherUnit::PerCentimeter),
        Length::Millimeter => Err(OtherUnit::Unknown),
    }
}

/// What the factors of a product are, and to which powers.
#[derive(Default)]
struct Dimensions {
    power: Option<Power>,
    /// An energy, by the power that it is per second.
    energy: Option<Power>,
    has_photons: bool,
    /// Whether there is what no unit of radiance has.
    has_others: bool,
    /// The exponent of the solid angle.
    per_sr: i32,
    /// The exponent of the time.
    time: i32,
    per_frequency: bool,
    per_wavenumber: bool,
    /// The exponent of the energy of photons in eV.
    per_ev: i32,
    /// Each length with its exponent.
    lengths: Vec<(Length, i32)>,
}

impl Dimensions {
    fn of(tokens: &[Token]) -> Self {
        let mut found = Self::default();
        let [mut is_divided, mut is_square] = [false; 2];
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
                    found.per_wavenumber = true;
                    continue;
                }
                Some(negative) if negative < 0 && is_divided => {
                    found.per_frequency |= matches!(base(word), Some(Base::Length(_)));
                    found.has_others = true;
                    negative
                }
                exponent => exponent.unwrap_or(squared) * if is_divided { -1 } else { 1 },
            };
            found.take(base(word), exponent);
        }
        found
    }

    /// Takes a factor to this power; none is one that is not known.
    fn take(&mut self, factor: Option<Base>, exponent: i32) {
        match factor {
            Some(Base::Power(unit)) => self.power = Some(unit),
            Some(Base::Photons) => self.has_photons = true,
            Some(Base::Length(length)) => match self.lengths.iter_mut().find(|(known, _)| *known == length) {
                Some((_, sum)) => *sum += exponent,
                None => self.lengths.push((length, exponent)),
            },
            Some(Base::SolidAngle) => self.per_sr += exponent,
            Some(Base::Frequency) => self.per_frequency = true,
            Some(Base::Energy(unit)) => self.energy = Some(unit),
            Some(Base::Time) => self.time += exponent,
            Some(Base::ElectronVolt) => self.per_ev += exponent,
            None => self.has_others = true,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::heading::unit_of_heading;

    /// Spellings, and what one such unit is in W cm⁻² sr⁻¹ nm⁻¹.
    const RADIANCES: [(&str, f64); 86] = [
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
        ("W/m2sr nm", 1e-4),
        ("W/(m²sr nm)", 1e-4),
        ("mW/m²sr·nm", 1e-7),
        ("W/cm2sr um", 1e-3),
        ("W/m2nm sr", 1e-4),
        ("W m^-2 sr^-1 nm ^-1", 1e-4),
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
        ("pW cm-2 sr-1 nm-1", 1e-12),
        ("GW m-2 sr-1 um-1", 1e2),
        ("W/sqm/sr/nm", 1e-4),
        ("mW sqcm-1 srad-1 nm-1", 1e-3),
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
        ("1e-10 W cm-2 sr-1 nm-1", 1e-10),
        ("10^-4 W m-2 sr-1 nm-1", 1e-8),
        ("0.01 W m-2 sr-1 nm-1", 1e-6),
        ("1e2 mW m-2 sr-1 nm-1", 1e-5),
        ("0.001 W m-2 sr-1 nm-1", 1e-7),
        ("1/nm W/(m2 sr)", 1e-4),
        ("W 1/m2 1/sr 1/um", 1e-7),
        ("1E3 uW cm-2 sr-1 nm-1", 1e-3),
        // At 500 nm 1 cm⁻¹ is 0.025 nm, the wavenumber being 20 000 cm⁻¹.
        ("W cm-2 sr-1 / cm-1", 40.0),
        ("W/(cm2 sr cm-1)", 40.0),
        ("W cm^-2 sr^-1 (cm^-1)^-1", 40.0),
        ("mW/(m^2 sr cm^-1)", 4e-6),
        ("mW m⁻² sr⁻¹ / cm⁻¹", 4e-6),
        // 1 erg is 10⁻⁷ J.
        ("erg s-1 cm-2 sr-1 nm-1", 1e-7),
        ("ergs/s/cm2/sr/nm", 1e-7),
        ("ergs s^-1 cm^-2 ster^-1 A^-1", 1e-6),
        ("erg s-1 cm-2 sr-1 A-1", 1e-6),
        ("erg/(s cm2 sr A)", 1e-6),
        ("erg/s/cm^2/sr/Å", 1e-6),
        ("erg/cm²/s/sr/Å", 1e-6),
        ("erg s⁻¹ cm⁻² Å⁻¹ sr⁻¹", 1e-6),
        ("erg/cm2/sec/micron/ster", 1e-10),
        ("erg s-1 cm-2 sr-1 um-1", 1e-10),
        ("erg/(s cm2 sr cm-1)", 4e-6),
        ("erg s^-1cm^-2sr^-1nm^-1", 1e-7),
        ("J s-1 m-2 sr-1 nm-1", 1e-4),
        ("joules per second per square meter per steradian per nanometer", 1e-4),
        ("J/(s m2 sr um)", 1e-7),
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
    fn units_of_unknown_pieces_are_shown_whole() {
        for (heading, written) in [("radiance (W/km2/sr/nm)", "W/km2/sr/nm"), ("radiance (W/m2/sr/5nm)", "W/m2/sr/5nm")]
        {
            let found = unit_of_heading(heading);
            assert!(matches!(&found, Some(Stated::Other { text, .. }) if text == written), "{heading}: {found:?}");
        }
    }
}
