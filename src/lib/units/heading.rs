//! What the heading of a column says about the unit of its numbers: as people write it, beside names, brackets and factors.

use super::other::OtherUnit;
use super::quantity::{JANSKYS, READINGS, by_spelling, is_per_interval, is_reading, names, quantity_named};
use super::spectral::{Found, Stated, as_written, units_among};
use super::spelling::{Base, Token, base, tokens};

/// What the heading of a column says about the unit of its numbers; a name such as `irradiance` counts where there is no
/// unit, and what stands in brackets where it looks like one.
pub fn unit_of_heading(heading: &str) -> Option<Stated> {
    if let Some(kind) = changed(heading) {
        return Some(Stated::Other { text: heading.trim().to_owned(), kind });
    }
    let found = of_name_and_unit(heading)?;
    let contradicts = match &found {
        Stated::Radiance(_) => {
            let is_other = names(heading, &IRRADIANCES) || names(heading, &RATIOS);
            is_other && !names(heading, &RADIANCE) || names(heading, &PHOTONS)
        }
        Stated::Other { kind: OtherUnit::Irradiance, .. } => names(heading, &RADIANCE) && !names(heading, &IRRADIANCES),
        Stated::Other { .. } => false,
    };
    let found = match found {
        Stated::Other { text, kind: OtherUnit::Unknown } => Stated::Other { kind: by_name(&text), text },
        found => found,
    };
    Some(match contradicts {
        true => Stated::Other { text: heading.trim().to_owned(), kind: OtherUnit::Contradiction },
        false => found,
    })
}

/// What was made of radiances by the words of a heading: `log10(L)`, `sqrt radiance`, `normalized radiance`.
fn changed(heading: &str) -> Option<OtherUnit> {
    const FUNCTIONS: [&str; 5] = ["log", "ln", "lg", "sqrt", "root"];
    const SIGNS: [&str; 4] = ["√", "^0.5", "^(1/2)", "**0.5"];
    let tokens = tokens(heading);
    let is_one = |token: &Token| token.lower().is_some_and(|word| FUNCTIONS.contains(&word.as_str()));
    // Of something: `log` alone, or `log 3`, is a name.
    let has_argument = |place: usize| matches!(tokens.get(place + 1), Some(Token::Factor { .. }));
    let is_function = tokens.iter().enumerate().any(|(place, token)| is_one(token) && has_argument(place));
    if is_function || SIGNS.iter().any(|sign| heading.contains(sign)) {
        return Some(OtherUnit::Function);
    }
    // A relative number of photons is none of radiances.
    (names(heading, &NORMALIZED) && !names(heading, &PHOTONS)).then_some(OtherUnit::Relative)
}

const NORMALIZED: [&str; 3] = ["normalized", "normalised", "relative"];

/// What a unit, or a name, is that is made of no powers of light.
fn by_name(text: &str) -> OtherUnit {
    if let Some(kind) = quantity_named(text).or_else(|| by_spelling(text)) {
        kind
    } else if names(text, &PHOTOMETRIC) {
        OtherUnit::Photometric
    } else if names(text, &READINGS) {
        OtherUnit::Reading
    } else if text.contains('%') || names(text, &RATIOS) {
        OtherUnit::Ratio
    } else if is_relative(text) {
        OtherUnit::Relative
    } else {
        OtherUnit::Unknown
    }
}

/// Whether what names a ratio says no more than that it is in per cent.
pub fn is_per_cent(text: &str) -> bool {
    let is_percent = text.contains('%') || names(text, &PER_CENT);
    is_percent && !names(text, &RATIOS.map(|word| if PER_CENT.contains(&word) { "" } else { word }))
}

/// Words for `%`.
const PER_CENT: [&str; 2] = ["percent", "pct"];

/// Whether a text says that numbers have no scale: `a.u.`, `arb. units`, `relative`.
fn is_relative(text: &str) -> bool {
    const WORDS: [&str; 9] =
        ["au", "arb", "arbitrary", "rel", "relative", "norm", "normalized", "normalised", "unitless"];
    let letters: String = text.to_lowercase().chars().filter(char::is_ascii_alphabetic).collect();
    let bare = ["units", "unit"].iter().find_map(|word| letters.strip_suffix(word)).unwrap_or(&letters);
    WORDS.contains(&bare) || bare == "arbu" || bare == "relu"
}

/// Words for irradiance: the language's, libRadtran's, those of solar energy and of the color of water.
const IRRADIANCES: [&str; 17] = [
    "irradiance",
    "irradiances",
    "irrad",
    "exitance",
    "flux",
    "edir",
    "eglo",
    "edn",
    "eup",
    "edif",
    "eglobal",
    "ghi",
    "dni",
    "dhi",
    "etr",
    "ed",
    "es",
];
/// libRadtran's words for means over directions.
const MEANS: [&str; 6] = ["uavg", "uavgdir", "uavgdn", "uavgup", "uavgdif", "uavgglo"];
const RADIANCE: [&str; 2] = ["radiance", "radiances"];
/// Units of light as the eye weights it.
const PHOTOMETRIC: [&str; 10] = ["lm", "lumen", "lumens", "cd", "candela", "candelas", "lx", "lux", "nit", "nits"];
/// Words for shares of light, and their unit.
const RATIOS: [&str; 10] = [
    "reflectance",
    "reflectances",
    "reflectivity",
    "transmittance",
    "transmission",
    "albedo",
    "absorptance",
    "absorptivity",
    "percent",
    "pct",
];
const PHOTONS: [&str; 3] = ["photon", "photons", "quanta"];

/// The same, where the name and the unit do not contradict each other.
fn of_name_and_unit(heading: &str) -> Option<Stated> {
    let whole = |kind| Some(Stated::Other { text: heading.trim().to_owned(), kind });
    let all = units_among(&tokens(heading));
    // `(W m-2 sr-1 nm-1)/V`: what stands behind the brackets divides.
    if all.iter().any(|found| matches!(found.says, Stated::Other { kind: OtherUnit::PerReading, .. })) {
        return whole(OtherUnit::PerReading);
    }
    let radiances = all.into_iter().filter(|found| matches!(found.says, Stated::Radiance(_)));
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
            // One letter is a name.
            let reads = |token: &Token| token.lower().is_some_and(|word| word.len() > 1 && is_reading(&word));
            let scaled = if tokens.iter().any(reads) {
                whole(OtherUnit::PerReading)
            } else if is_beside_factor(found, text, &tokens) {
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
            (word, _) if IRRADIANCES.contains(&word) => named(OtherUnit::Irradiance),
            (word, _) if MEANS.contains(&word) => named(OtherUnit::Mean),
            (word, _) if RATIOS.contains(&word) => named(OtherUnit::Ratio),
            (_, Some(Base::Photons)) => named(OtherUnit::Photons),
            // One letter is a name.
            (word, _) if READINGS.contains(&word) && word.len() > 1 && tokens.len() == 1 => named(OtherUnit::Reading),
            _ => None,
        })
    };
    // `brightness temperature (K)`
    let by_quantity = || quantity_named(heading).filter(|_| !names(heading, &RADIANCE)).and_then(named);
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
        (Stated::Other { kind, .. }, Some(text))
            if [OtherUnit::Irradiance, OtherUnit::AllWavelengths, OtherUnit::Intensity, OtherUnit::Power]
                .contains(&kind)
                && self::tokens(text).iter().any(Token::is_strange) =>
        {
            Stated::Other { text: text.to_owned(), kind: OtherUnit::Unknown }
        }
        (says, _) => says,
    });
    // `radiance_w_m2_sr_um`: powers that nobody tells from places.
    let in_name = || whole(OtherUnit::Unknown).filter(|_| names_unit_in_words(heading));
    let in_full = || whole(OtherUnit::Unknown).filter(|_| is_bare_unit(heading));
    found.or_else(by_quantity).or_else(in_words).or_else(in_brackets).or_else(in_name).or_else(in_full)
}

/// Whether a heading without brackets is nothing but a unit: a word for levels or for light as the eye weights it, `dB`, or a word
/// and what it is divided by, `cd/m2/nm`, `E m-2 s-1 nm-1`. One divisor may be a name's, `L/nm`.
fn is_bare_unit(heading: &str) -> bool {
    const LEVELS: [&str; 6] = ["db", "dbm", "flick", "flicks", "microflick", "microflicks"];
    let tokens = tokens(heading);
    let Some((Token::Factor { word, exponent: None }, rest)) = tokens.split_first() else { return false };
    let word = word.to_lowercase();
    let is_photometric = PHOTOMETRIC.contains(&word.as_str());
    let (mut divisors, mut is_divided) = (0, false);
    for token in rest {
        match token {
            Token::Per => is_divided = true,
            Token::Square => {}
            Token::Factor { word, exponent }
                if base(word).is_some() && (is_divided || exponent.is_some_and(|power| power < 0)) =>
            {
                divisors += 1;
            }
            _ => return false,
        }
    }
    match divisors {
        // Two letters are a name.
        0 => rest.is_empty() && (LEVELS.contains(&word.as_str()) || is_photometric && word.len() > 2),
        1 => is_photometric || JANSKYS.contains(&word.as_str()),
        _ => true,
    }
}

/// Whether what stands beside a unit in a text of these pieces may be a factor.
fn is_beside_factor(found: &Found, text: &str, tokens: &[Token]) -> bool {
    let (mut before, after) = (&tokens[..found.begin], &tokens[found.end..]);
    let has_power = matches!(tokens[found.begin], Token::Number(_));
    // `1 x 10^-3 W` is a power of ten.
    while let Some((_, rest)) = before.split_last().filter(|(last, _)| has_power && is_times_one(last)) {
        before = rest;
    }
    let beside = as_written(text, &tokens[found.begin..found.end]).and_then(|unit| text.split_once(unit));
    let has_digits = |text: &str| text.contains(|c: char| c.is_numeric());
    let is_told = beside.is_some_and(|(left, right)| {
        let left = if has_power { left.trim_end_matches(|c: char| "x×*·1 ".contains(c)) } else { left };
        has_digits(left) || has_digits(right)
    });
    is_told || text.contains('%') || is_per_interval(text) || before.iter().chain(after).any(scales)
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
const FACTORS_IN_WORDS: [&str; 19] = [
    "scale",
    "scaling",
    "factor",
    "pi",
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
    if is_multiple_of_name(outside) || is_per_interval(heading) {
        return Some(Stated::Other { text: heading.trim().to_owned(), kind: OtherUnit::BesideFactor });
    }
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

/// Whether what stands outside a unit is a multiple of the name: `2L`, `L/2`, `1000 L`, `-L`, `πL`, `L^2`, or ends with a power of ten,
/// `E-3`, `(1000)`, `10⁻³`.
fn is_multiple_of_name(outside: &str) -> bool {
    const NAMES: [&str; 3] = ["l", "radiance", "rad"];
    let text = outside.to_lowercase().replace("()", " ").replace("[]", " ");
    let text = text.trim();
    if text.contains('π') || text.contains("10⁻") || text.contains("10⁺") {
        return true;
    }
    let number = |part: &str| part.trim().parse::<f64>().is_ok_and(|factor| factor != 1.0);
    let is_name = |part: &str| NAMES.contains(&part.trim());
    let is_product =
        |sign: char| text.split_once(sign).is_some_and(|(a, b)| is_name(a) && number(b) || is_name(b) && number(a));
    // `radiance 2` is a name.
    let is_before_name = text.split_once(' ').is_some_and(|(a, b)| number(a) && is_name(b));
    let is_negative = text.strip_prefix('-').is_some_and(is_name);
    if ['*', '·', '×', '/', '^'].into_iter().any(is_product) || is_before_name || is_negative {
        return true;
    }
    let digits = text.trim_start_matches(|c: char| c.is_ascii_digit() || c == '.');
    if digits.len() < text.len() && is_name(digits) {
        return true;
    }
    let last = text.split_whitespace().last().unwrap_or_default();
    let exponent = last.strip_prefix('e').map(|rest| rest.trim_start_matches(['+', '-']));
    let is_exponent = exponent.is_some_and(|rest| !rest.is_empty() && rest.bytes().all(|byte| byte.is_ascii_digit()));
    let bracketed = last.strip_prefix(['(', '[']).and_then(|rest| rest.strip_suffix([')', ']']));
    let is_power = |factor: f64| factor > 0.0 && (factor >= 1000.0 || factor <= 0.1) && factor.log10().fract() == 0.0;
    last.len() < text.len() && is_exponent || bracketed.is_some_and(|text| text.parse::<f64>().is_ok_and(is_power))
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

/// What stands between the first and the last bracket of a heading; of brackets that a word is divided by or multiplied with, `lm/(m2
/// sr nm)`, the word and they.
fn in_brackets(heading: &str) -> Option<&str> {
    let [open, close] = [heading.find(['(', '[']), heading.rfind([')', ']'])].map(Option::unwrap_or_default);
    let before = heading.get(..open)?;
    let text = match before.ends_with(['/', '*', '·']) {
        true => heading.get(before.rfind(char::is_whitespace).map_or(0, |blank| blank + 1)..=close),
        false => heading.get(open + 1..close),
    };
    text.map(str::trim).filter(|text| !text.is_empty())
}

/// Whether a text is the unit of something, known or not: it has powers or is divided, or is a unit or a scale that people
/// name.
fn looks_like_a_unit(text: &str) -> bool {
    const NAMED: [&str; 35] = [
        "cd",
        "lm",
        "lx",
        "lux",
        "nit",
        "nits",
        "flick",
        "flicks",
        "microflick",
        "microflicks",
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
    text.contains('%')
        || ["K", "OD"].contains(&text)
        || text.eq_ignore_ascii_case("a.u.")
        || tokens.iter().any(is_power)
        || tokens.first().is_some_and(is_named)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::RadianceUnit;

    #[test]
    fn multiples_of_a_radiance_are_told() {
        let unit = "(W m-2 sr-1 nm-1)";
        for heading in [
            format!("radiance {unit} E-3"),
            format!("L {unit} e3"),
            format!("L {unit} 10⁻³"),
            format!("L {unit} (1000)"),
            format!("L {unit}, scale 0.001"),
            format!("scale factor 0.001 radiance {unit}"),
            format!("1000 L {unit}"),
            format!("2L {unit}"),
            format!("L/2 {unit}"),
            format!("πL {unit}"),
            format!("pi*L {unit}"),
            format!("L {unit}/pi"),
            format!("L^2 {unit}"),
            format!("-L {unit}"),
            "L W m-2 sr-1 nm-1 E-3".into(),
        ] {
            let found = unit_of_heading(&heading);
            let is_told = matches!(found, Some(Stated::Other { kind: OtherUnit::BesideFactor, .. }));
            assert!(is_told, "{heading}: {found:?}");
        }
        for heading in
            ["L", "L1", "L 1", "L-2", "sky 12", "30 deg", "0°", "sza30", "E3 sky", "radiance 2", "L_350", "scan 1000"]
        {
            let found = unit_of_heading(&format!("{heading} {unit}"));
            assert!(matches!(found, Some(Stated::Radiance(_))), "{heading}: {found:?}");
        }
        let reflected = unit_of_heading(&format!("reflectance {unit}"));
        assert!(matches!(reflected, Some(Stated::Other { kind: OtherUnit::Contradiction, .. })), "{reflected:?}");
        for (heading, wanted) in
            [("counts", OtherUnit::Reading), ("DN", OtherUnit::Reading), ("relative radiance", OtherUnit::Relative)]
        {
            let found = unit_of_heading(heading);
            assert!(matches!(&found, Some(Stated::Other { kind, .. }) if *kind == wanted), "{heading}: {found:?}");
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
    fn what_was_made_of_radiances_is_told() {
        const UNIT: &str = "W m-2 sr-1 nm-1";
        for name in [
            "sqrt radiance",
            "log radiance",
            "ln(L)",
            "log10(radiance)",
            "log_radiance",
            "√L",
            "radiance^0.5",
            "Log10 L",
        ] {
            for heading in [name.to_owned(), format!("{name} ({UNIT})")] {
                let wanted = Stated::Other { text: heading.clone(), kind: OtherUnit::Function };
                assert_eq!(unit_of_heading(&heading), Some(wanted));
            }
        }
        for heading in
            ["normalized radiance", "L, normalised", "radiance_normalized", "normalized radiance (W m-2 sr-1 nm-1)"]
        {
            let wanted = Stated::Other { text: heading.into(), kind: OtherUnit::Relative };
            assert_eq!(unit_of_heading(heading), Some(wanted));
        }
        for name in ["log", "log 3", "log1", "blog radiance", "ln"] {
            assert_eq!(unit_of_heading(name), None, "{name}");
        }
    }

    #[test]
    fn other_units_are_quoted_as_they_are_written() {
        for (heading, written) in [
            ("E [W/m2/nm]", "W/m2/nm"),
            ("E, W·m⁻²·nm⁻¹", "W·m⁻²·nm⁻¹"),
            ("L (µmol m⁻² s⁻¹ sr⁻¹ nm⁻¹)", "µmol m⁻² s⁻¹ sr⁻¹ nm⁻¹"),
            ("L (100 W/(m² sr nm))", "100 W/(m² sr nm)"),
            ("radiance lm/(m2 sr nm)", "lm/(m2 sr nm)"),
            ("L (cd/(m2 nm))", "cd/(m2 nm)"),
            ("L (W/m2xy nm)", "W/m2xy nm"),
            ("radiance W/m2sr1nm/s", "W/m2sr1nm/s"),
            ("L [W/(m2xy nm)]", "W/(m2xy nm)"),
        ] {
            assert!(
                matches!(unit_of_heading(heading), Some(Stated::Other { text, .. }) if text == written),
                "{:?}",
                unit_of_heading(heading)
            );
        }
    }

    #[test]
    fn units_without_blanks_are_read() {
        for glued in ["L (Wm-2sr-1nm-1)", "Wm⁻²sr⁻¹nm⁻¹", "radiance [W·m⁻²sr⁻¹nm⁻¹]"] {
            let wanted = RadianceUnit::parse("W m-2 sr-1 nm-1").map(Stated::Radiance);
            assert_eq!((unit_of_heading(glued), wanted.is_some()), (wanted, true), "{glued}");
        }
        assert_eq!(RadianceUnit::parse("mWm-2sr-1nm-1"), RadianceUnit::parse("mW m-2 sr-1 nm-1"));
    }

    #[test]
    fn names_that_contradict_their_units_are_told() {
        use OtherUnit::{Contradiction, Irradiance, Mean, Undivided};
        for (text, kind) in [
            ("radiance (W m-2 sr nm)", Undivided),
            ("L [W m-2 sr-1 nm]", Undivided),
            ("irradiance (W m-2 nm)", Undivided),
            ("irradiance (W m-2 sr-1 nm-1)", Contradiction),
            ("Irradiance, W m-2 sr-1 nm-1", Contradiction),
            ("edir [mW m-2 sr-1 nm-1]", Contradiction),
            ("photons (W m-2 sr-1 nm-1)", Contradiction),
            ("radiance (W m-2 nm-1)", Contradiction),
            ("spectral_radiance_w_per_m2_nm", Contradiction),
            ("uavgdir", Mean),
            ("radiance over irradiance (W m-2 nm-1)", Irradiance),
        ] {
            let found = unit_of_heading(text);
            assert!(matches!(&found, Some(Stated::Other { kind: found, .. }) if *found == kind), "{text}: {found:?}");
        }
        for text in ["radiance (W m-2 sr-1 nm-1)", "radiance under an irradiance of 1 (W m-2 sr-1 nm-1)"] {
            assert!(matches!(unit_of_heading(text), Some(Stated::Radiance(_))), "{text}");
        }
    }

    #[test]
    fn light_as_the_eye_weights_it_is_told() {
        for text in [
            "L (cd m-2)",
            "L [cd/m2]",
            "L (lm/(m2 sr nm))",
            "radiance lm/(m2 sr nm)",
            "L [nit/nm]",
            "cd/m2/nm",
            "cd m-2",
            "cd per square m",
            "lux",
        ] {
            let found = unit_of_heading(text);
            assert!(matches!(found, Some(Stated::Other { kind: OtherUnit::Photometric, .. })), "{text}: {found:?}");
            assert_eq!(RadianceUnit::parse(text), None, "{text}");
        }
    }

    #[test]
    fn ratios_readings_and_energies_are_told() {
        use OtherUnit::{
            AllWavelengths, Energy, Irradiance, PerCentimeter, PerFrequency, PerIrradiance, Ratio, Reading, Unknown,
        };
        for (text, kind) in [
            ("transmittance", Ratio),
            ("reflectance (%)", Ratio),
            ("Reflectance", Ratio),
            ("Rrs, remote sensing reflectance (sr-1)", PerIrradiance),
            ("L [percent]", Ratio),
            ("transmission, %", Ratio),
            ("radiance (W m-2 sr-1)", AllWavelengths),
            ("erg s-1 cm-2 sr-1", AllWavelengths),
            ("flux (erg s-1 cm-2 A-1)", Irradiance),
            ("erg s-1 cm-2 sr-1 Hz-1", PerFrequency),
            ("erg s-1 cm-3 sr-1", PerCentimeter),
            ("J m-2 sr-1 nm-1", Energy),
            ("erg cm-2 sr-1 nm-1", Energy),
            ("erg s-2 cm-2 sr-1 nm-1", Unknown),
            ("sky [mV]", Reading),
            ("sky (DN)", Reading),
            ("sky (%)", Ratio),
            ("sky (counts)", Reading),
        ] {
            let found = unit_of_heading(text);
            assert!(matches!(&found, Some(Stated::Other { kind: found, .. }) if *found == kind), "{text}: {found:?}");
            assert_eq!(RadianceUnit::parse(text), None, "{text}");
        }
    }

    #[test]
    fn other_units_are_told_from_radiances() {
        use OtherUnit::{
            AllWavelengths, Intensity, Irradiance, Megawatt, PerCentimeter, PerFrequency, Photons, Relative, Scaled,
            Several, Unknown,
        };
        for (text, kind) in [
            ("irradiance (W m-2 nm-1)", Irradiance),
            ("E [W/m2/nm]", Irradiance),
            ("W/m²/µm", Irradiance),
            ("W m-3", Irradiance),
            ("irradiance", Irradiance),
            ("spectral_irradiance_w_per_m2_nm", Irradiance),
            ("edir", Irradiance),
            ("eglo", Irradiance),
            ("GHI", Irradiance),
            ("Ed(0+)", Irradiance),
            ("irrad", Irradiance),
            ("Wm-2nm-1", Irradiance),
            ("photons s-1 m-2 sr-1 nm-1", Photons),
            ("L (umol m-2 s-1 sr-1 nm-1)", Photons),
            ("µmol/m2/s", Photons),
            ("quanta/s/cm2/sr/nm", Photons),
            ("photon_radiance", Photons),
            ("uE m-2 s-1 nm-1", Photons),
            ("µE/m²/s/nm", Photons),
            ("E m-2 s-1 nm-1", Unknown),
            ("dB", Unknown),
            ("mmHg/m2/nm", Unknown),
            ("mW/(m^2 cm^-1)", PerFrequency),
            ("W m-2 sr-1 cm-1", PerCentimeter),
            ("W cm-2 sr-1 cm-1", PerCentimeter),
            ("W m-2 sr-1 Hz-1", PerFrequency),
            ("W m-2 sr-1", AllWavelengths),
            ("W.m^-2.sr^-1", AllWavelengths),
            ("10 000 W m-2 sr-1 nm-1", Scaled),
            ("radiance (100 W cm-2 sr-1 nm-1)", Scaled),
            ("radiance (1000 W m-2 sr-1 nm-1)", Scaled),
            ("3 × 10⁻³ W m⁻² sr⁻¹ nm⁻¹", Scaled),
            ("W sr-1 nm-1", Intensity),
            ("radiance (MW m-2 sr-1 nm-1)", Megawatt),
            ("radiance (MW/m2)", Megawatt),
            ("sky [a.u.]", Relative),
            ("L (arb. units)", Relative),
            ("lamp (relative)", Relative),
            ("L (flick)", Unknown),
            ("radiance (W/m2/xy/nm)", Unknown),
            ("MW m-2 sr-1 nm-1", Megawatt),
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
    }

    #[test]
    fn names_are_no_units() {
        for text in [
            "radiance",
            "L",
            "W",
            "A",
            "sky (measured)",
            "Y 1391.68 cd m-2",
            "a work of W",
            "sky (az=90/el=45)",
            "site-3 2026-11-24",
            "Lw-2b",
            "sky (90/45)",
            "L/nm",
            "L nm-1",
            "UE",
            "cd",
            "sky m s",
            "north/south",
            "a/b/c",
        ] {
            assert_eq!(unit_of_heading(text), None, "{text}");
        }
    }
}
