//! Units as people write them, taken to pieces: every spelling of powers and products to one.

use std::borrow::Cow;

/// A unit of power in which radiance is given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Power {
    Kilowatt,
    Watt,
    Milliwatt,
    Microwatt,
    Nanowatt,
    /// 10⁻⁷ W, that of CGS.
    ErgPerSecond,
    /// A power of ten of W for which there is no word.
    TenTo(i8),
}

impl Power {
    /// Those that powers of ten make of each other.
    const ALL: [Self; 5] = [Self::Kilowatt, Self::Watt, Self::Milliwatt, Self::Microwatt, Self::Nanowatt];

    /// The unit that is a power of ten of this one, written as `1e-3`, `10-3` or `0.001`; none for other numbers, of which
    /// nobody knows whether they are a factor.
    pub(super) fn times(self, number: &str) -> Option<Self> {
        /// Powers of ten differ by more than what rounding makes of them.
        const ROUNDING: f64 = 1e-9;
        let is_scale = number.contains(['e', 'E']) || number.starts_with("0.");
        let factor: f64 = number.parse().ok().filter(|_| is_scale)?;
        let watts = self.in_w() * factor;
        let is_so = |unit: &Self| (unit.in_w() / watts - 1.0).abs() < ROUNDING;
        Self::ALL.into_iter().chain((-30..=30).map(Self::TenTo)).find(is_so)
    }

    pub(super) fn symbol(self) -> Cow<'static, str> {
        Cow::Borrowed(match self {
            Self::Kilowatt => "kW",
            Self::Watt => "W",
            Self::Milliwatt => "mW",
            Self::Microwatt => "uW",
            Self::Nanowatt => "nW",
            Self::ErgPerSecond => "erg s-1",
            Self::TenTo(exponent) => return Cow::Owned(format!("1e{exponent} W")),
        })
    }

    pub(super) fn in_w(self) -> f64 {
        match self {
            Self::Kilowatt => 1e3,
            Self::Watt => 1.0,
            Self::Milliwatt => 1e-3,
            Self::Microwatt => 1e-6,
            Self::Nanowatt => 1e-9,
            Self::ErgPerSecond => 1e-7,
            Self::TenTo(exponent) => 10_f64.powi(exponent.into()),
        }
    }
}

/// A unit of length.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Length {
    Nanometer,
    Micrometer,
    Angstrom,
    Millimeter,
    Centimeter,
    Meter,
}

impl Length {
    pub(super) fn symbol(self) -> &'static str {
        match self {
            Self::Nanometer => "nm",
            Self::Micrometer => "um",
            Self::Angstrom => "angstrom",
            Self::Millimeter => "mm",
            Self::Centimeter => "cm",
            Self::Meter => "m",
        }
    }
}

/// A piece of a text.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Token {
    /// Letters, perhaps with a power.
    Factor { word: String, exponent: Option<i32> },
    /// A slash, or `per`.
    Per,
    /// `square`, of the next factor.
    Square,
    /// A number.
    Number(String),
    /// What ends a unit.
    End,
}

impl Token {
    pub(super) fn lower(&self) -> Option<String> {
        match self {
            Self::Factor { word, .. } => Some(word.to_ascii_lowercase()),
            _ => None,
        }
    }

    /// The number that it is.
    pub(super) fn number(&self) -> Option<&str> {
        match self {
            Self::Number(number) => Some(number),
            _ => None,
        }
    }

    /// Whether it is a factor that is no unit here.
    pub(super) fn is_strange(&self) -> bool {
        matches!(self, Self::Factor { word, .. } if base(word).is_none())
    }

    pub(super) fn shown(&self) -> String {
        match self {
            Self::Factor { word, exponent: None } => word.clone(),
            Self::Factor { word, exponent: Some(exponent) } => format!("{word}{exponent}"),
            Self::Per => "/".into(),
            Self::Square => "square".into(),
            Self::Number(number) => number.clone(),
            Self::End => String::new(),
        }
    }
}

/// Takes a text to pieces, every spelling of powers and products to one.
pub(super) fn tokens(text: &str) -> Vec<Token> {
    let mut plain = String::with_capacity(text.len());
    // Powers of ten are numbers, `10^-3` as `1e-3`.
    let text = text.replace(" ^", "^").replace("10^", "1e").replace("10**", "1e").replace("**", "");
    let mut characters = text.chars().peekable();
    while let Some(character) = characters.next() {
        match character {
            '⁻' | '⁰'..='⁹' | '²' | '³' | '¹' if ends_in_ten(&plain) => {
                plain.truncate(plain.len() - 1);
                plain.push('e');
                plain.push(plain_of(character));
            }
            '.' if plain.ends_with(|c: char| c.is_ascii_digit())
                && characters.peek().is_some_and(char::is_ascii_digit) =>
            {
                plain.push('.');
            }
            'µ' | 'μ' => plain.push('u'),
            'Å' | '\u{212B}' => plain.push_str("angstrom"),
            '⁻' | '−' | '–' | '⁰'..='⁹' | '¹' | '²' | '³' => plain.push(plain_of(character)),
            '^' | '{' | '}' | '$' => {}
            '*' | '·' | '⋅' | '×' | '•' | '.' | '_' | '[' | ']' | '"' => plain.push(' '),
            '/' => plain.push_str(" / "),
            ':' | ';' | ',' | '=' | '<' | '>' => plain.push_str(" | "),
            other => plain.push(other),
        }
    }
    let plain = plain.replace("(cm-1)-1", " / cm-1 ").replace(['(', ')'], " ");
    inverse(plain.split_whitespace().flat_map(pieces).collect())
}

/// The same with `1/nm` as the power that it is, `nm-1`.
fn inverse(tokens: Vec<Token>) -> Vec<Token> {
    let mut found: Vec<Token> = Vec::with_capacity(tokens.len());
    for token in tokens {
        match (found.as_slice(), token) {
            ([.., Token::Number(one), Token::Per], Token::Factor { word, exponent })
                if one == "1"
                    && exponent.is_none_or(|power| power > 0)
                    && matches!(base(&word), Some(Base::Length(_) | Base::SolidAngle)) =>
            {
                found.truncate(found.len() - 2);
                found.push(Token::Factor { word, exponent: Some(-exponent.unwrap_or(1)) });
            }
            (_, token) => found.push(token),
        }
    }
    found
}

/// Whether a text ends in the number 10.
fn ends_in_ten(text: &str) -> bool {
    let is_digit = |c: char| c.is_ascii_digit() || c == '.';
    text.strip_suffix("10").is_some_and(|before| !before.ends_with(is_digit) && !before.ends_with(char::is_alphabetic))
}

/// A minus or a raised digit as it is typed.
fn plain_of(character: char) -> char {
    let digit = "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().position(|digit| digit == character);
    digit.and_then(|digit| "0123456789".chars().nth(digit)).unwrap_or('-')
}

/// The pieces of a word: a hyphen before a letter parts factors, before a digit it is the sign of a power, behind which another
/// factor may begin: `Wm-2sr-1nm-1`.
fn pieces(word: &str) -> Vec<Token> {
    let mut parts = vec![String::new()];
    let mut characters = word.chars().peekable();
    while let Some(character) = characters.next() {
        if character == '-' && characters.peek().is_none_or(|next| !next.is_ascii_digit()) {
            parts.push(String::new());
        } else if let Some(part) = parts.last_mut() {
            let is_behind_power = part.contains('-') && part.ends_with(|c: char| c.is_ascii_digit());
            if is_behind_power && part.starts_with(char::is_alphabetic) && character.is_alphabetic() {
                parts.push(character.into());
            } else {
                part.push(character);
            }
        }
    }
    let parts = parts.iter().filter(|part| !part.is_empty());
    parts.flat_map(|part| by_powers(part).unwrap_or_else(|| glued(piece(part)))).collect()
}

/// The factors of a word in which a power stands between two, `m2sr`, where all are known.
fn by_powers(word: &str) -> Option<Vec<Token>> {
    let behind_power =
        |(at, pair): (usize, &[u8])| (pair[0].is_ascii_digit() && pair[1].is_ascii_alphabetic()).then_some(at + 1);
    let mut cuts = word.as_bytes().windows(2).enumerate().filter_map(behind_power);
    let (cut, is_last) = (cuts.next()?, cuts.next().is_none());
    let (first, second) = word.split_at(cut);
    let factors = [first, second].map(piece);
    let is_known = |token: &Token| matches!(token, Token::Factor { word, .. } if base(word).is_some());
    (is_last && factors.iter().all(is_known)).then(|| factors.to_vec())
}

/// A power and a length in one word, `Wm-2`, as two factors; another piece as it is.
fn glued(piece: Token) -> Vec<Token> {
    if let Token::Factor { word, exponent: exponent @ Some(_) } = &piece
        && base(word).is_none()
    {
        for at in [1, 2].into_iter().filter(|at| word.is_char_boundary(*at) && *at < word.len()) {
            let (power, length) = word.split_at(at);
            if let (Some(Base::Power(_)), Some(Base::Length(_))) = (base(power), base(length)) {
                let factor = |word: &str, exponent| Token::Factor { word: word.to_owned(), exponent };
                return vec![factor(power, None), factor(length, *exponent)];
            }
        }
    }
    vec![piece]
}

fn piece(text: &str) -> Token {
    let letters = text.find(|c: char| !c.is_alphabetic()).unwrap_or(text.len());
    let (word, power) = text.split_at(letters);
    match (word.to_ascii_lowercase().as_str(), power) {
        ("", "/") => Token::Per,
        ("per", "") => Token::Per,
        ("square" | "sq", "") => Token::Square,
        ("", number) if number.starts_with(|c: char| c.is_ascii_digit() || "+-".contains(c)) => {
            Token::Number(number.to_owned())
        }
        ("", _) => Token::End,
        ("sqm" | "sqcm" | "sqmm", _) => square(&word[2..], power),
        (_, "") => Token::Factor { word: word.to_owned(), exponent: None },
        (_, power) => match power.parse() {
            Ok(exponent) => Token::Factor { word: word.to_owned(), exponent: Some(exponent) },
            Err(_) => Token::End,
        },
    }
}

/// The square of a length, `sqm`, or what divides by it, `sqm-1`.
fn square(length: &str, power: &str) -> Token {
    let exponent = match power {
        "" => 2,
        "-1" => -2,
        _ => return Token::End,
    };
    Token::Factor { word: length.to_ascii_lowercase(), exponent: Some(exponent) }
}

/// What a factor of a unit measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Base {
    Power(Power),
    Photons,
    /// J, erg: by the power that it is per second.
    Energy(Power),
    Length(Length),
    SolidAngle,
    Time,
    Frequency,
    /// The energy of photons, of which an interval divides.
    ElectronVolt,
}

pub(super) fn base(word: &str) -> Option<Base> {
    let lower = word.to_ascii_lowercase();
    let singular = if lower.len() > 3 { lower.strip_suffix('s').unwrap_or(&lower) } else { &lower };
    Some(match singular {
        // A megawatt is none of radiance, and may be a milliwatt.
        "mw" if word.starts_with('M') => return None,
        "kw" | "kilowatt" => Base::Power(Power::Kilowatt),
        "w" | "watt" => Base::Power(Power::Watt),
        "mw" | "milliwatt" => Base::Power(Power::Milliwatt),
        "uw" | "microwatt" => Base::Power(Power::Microwatt),
        "nw" | "nanowatt" => Base::Power(Power::Nanowatt),
        "pw" if word == "pW" => Base::Power(Power::TenTo(-12)),
        "gw" if word == "GW" => Base::Power(Power::TenTo(9)),
        "ph" | "photon" | "quanta" | "quantum" | "mol" | "mmol" | "umol" | "nmol" | "mole" | "micromole"
        | "einstein" => Base::Photons,
        // As `Ue`, it is a name.
        "ue" if word == "uE" => Base::Photons,
        "j" | "joule" => Base::Energy(Power::Watt),
        "erg" => Base::Energy(Power::ErgPerSecond),
        "nm" | "nanometer" | "nanometre" => Base::Length(Length::Nanometer),
        "um" | "micron" | "micrometer" | "micrometre" => Base::Length(Length::Micrometer),
        "angstrom" | "ang" => Base::Length(Length::Angstrom),
        "a" if word == "A" => Base::Length(Length::Angstrom),
        "mm" | "millimeter" | "millimetre" => Base::Length(Length::Millimeter),
        "cm" | "centimeter" | "centimetre" => Base::Length(Length::Centimeter),
        "m" | "meter" | "metre" => Base::Length(Length::Meter),
        "sr" | "str" | "srad" | "ster" | "steradian" => Base::SolidAngle,
        "s" | "sec" | "second" => Base::Time,
        "hz" | "thz" => Base::Frequency,
        "ev" | "electronvolt" => Base::ElectronVolt,
        _ => return None,
    })
}
