//! The unit of a file's radiances: what the file says, what the user says, and what is assumed where nobody says anything.

use crate::error::{Error, Result};
use crate::text::about;
use crate::units::{OtherUnit, RadianceUnit, Stated};

/// Spectral radiance of what scatters all the light of the sun evenly, as the whitest cloud does, at its brightest, in
/// W cm⁻² sr⁻¹ nm⁻¹: the extraterrestrial irradiance of \[ASTM E490], 2.1 W m⁻² nm⁻¹, over π.
const WHITE: f64 = 6.7e-5;
/// So many times as bright a sky may be in places, near the sun.
const MOST: f64 = 100.0;

/// How many times as bright as a white cloud in the sun a spectral radiance in W cm⁻² sr⁻¹ nm⁻¹ is.
pub fn times_white(radiance: f64) -> f64 {
    radiance / WHITE
}

/// How many of some spectra are brighter than any sky, which is what a wrong unit makes of them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Brightness {
    spectra: usize,
    bright: usize,
    /// The brightest of all, in white clouds.
    most: f64,
}

impl Brightness {
    /// That of spectra whose largest values are so many times as bright as a white cloud in the sun.
    pub fn of(times_white: impl IntoIterator<Item = f64>) -> Self {
        times_white.into_iter().fold(Self::default(), |all, times| {
            all.plus(Self { spectra: 1, bright: usize::from(times > MOST), most: times })
        })
    }

    /// That of all spectra of two sets.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self {
            spectra: self.spectra + other.spectra,
            bright: self.bright + other.bright,
            most: self.most.max(other.most),
        }
    }

    /// Refuses bright spectra of file `name` in a unit that `is_assumed`; a warning where it is stated and more than half of them are
    /// so bright, which lamps and the sun in an image are not.
    ///
    /// # Errors
    ///
    /// [`Error::Format`] that wants the unit.
    pub fn judge(self, name: &str, unit: RadianceUnit, is_assumed: bool) -> Result<Option<String>> {
        let times = about(self.most, 2);
        let bright = format!("in {unit} it would be {times} times as bright as a white cloud in the sun");
        if is_assumed && self.bright > 0 {
            let problem = format!("it does not say the unit of its radiance; {bright}");
            return Err(Error::format(name, problem).give(&["radiance_unit"]));
        }
        let is_warned = self.bright > 0 && 2 * self.bright > self.spectra;
        Ok(is_warned.then(|| format!("{name}: {bright}: is that its unit?")))
    }
}

/// What a file says about the unit of its radiances.
#[derive(Debug, Clone, Copy)]
pub struct FileSays<'a> {
    /// The file as messages call it.
    pub name: &'a str,
    /// What it says where units belong: in the heading of the column, in an attribute.
    pub heading: Option<&'a Stated>,
    /// What it mentions in passing: in comments.
    pub remarks: &'a [Stated],
    /// Where a file of its kind names the unit, for advice: `in the heading`.
    pub place: &'a str,
}

/// The unit of a file's radiances, with a warning where it is assumed.
///
/// # Errors
///
/// [`Error::Usage`] where `given` is not what the file says; [`Error::Format`] for a file that says that it holds something
/// else, or units that are not understood.
pub fn settle(says: FileSays<'_>, given: Option<RadianceUnit>) -> Result<(RadianceUnit, Option<String>)> {
    let FileSays { name, heading, remarks, place } = says;
    let is_in = |text: &str, kind: &str| format!("its values are in `{text}`, {kind}");
    match heading {
        Some(Stated::Radiance(unit)) => {
            let unit = agreed(name, *unit, given)?;
            let other = remarks.iter().find_map(|remark| match remark {
                Stated::Radiance(other) if *other != unit => Some(other),
                _ => None,
            });
            let warned = other.filter(|_| given.is_none()).map(|other| {
                format!("{name}: its heading says {unit}, which counts, and a comment {other}; say which with --radiance-unit")
            });
            Ok((unit, warned))
        }
        Some(Stated::Other { text, kind }) => match (kind.conversion(), given) {
            // No name of a unit makes radiances of them.
            (Some(conversion), _) => {
                let problem = is_in(text, kind.in_words());
                let wanted = RadianceUnit::USUAL[1];
                let problem =
                    format!("{problem}; spectral radiances are wanted, in units such as {wanted}: {conversion}");
                Err(Error::format(name, problem))
            }
            (None, Some(unit)) => {
                let warned = (*kind == OtherUnit::Relative).then(|| {
                    format!(
                        "{name}: {}; they count as {unit}, as --radiance-unit says: signals and XYZ are then of no scale either",
                        is_in(text, kind.in_words())
                    )
                });
                Ok((unit, warned))
            }
            (None, None) => Err(Error::format(name, is_in(text, kind.in_words())).give(&["radiance_unit"])),
        },
        None if remarks.is_empty() && given.is_none() => {
            let unit = RadianceUnit::default();
            let problem = format!("{name}: it does not say the unit of its radiance, which is taken as {unit}");
            Ok((unit, Some(format!("{problem}; name the unit {place}, or give --radiance-unit"))))
        }
        None => of_remarks(name, remarks, given),
    }
}

/// The unit that a file and a user agree on.
fn agreed(name: &str, stated: RadianceUnit, given: Option<RadianceUnit>) -> Result<RadianceUnit> {
    match given {
        Some(given) if given != stated => {
            let problem = format!("{name}: it says that its unit of radiance is {stated}, not {given}");
            Err(Error::Usage(problem).leave_out(&["radiance_unit"]))
        }
        _ => Ok(stated),
    }
}

/// The unit where comments alone may tell it, with a warning where they speak of another quantity.
fn of_remarks(name: &str, remarks: &[Stated], given: Option<RadianceUnit>) -> Result<(RadianceUnit, Option<String>)> {
    let mut units: Vec<RadianceUnit> = Vec::new();
    for remark in remarks {
        if let Stated::Radiance(unit) = remark
            && !units.contains(unit)
        {
            units.push(*unit);
        }
    }
    let others = || {
        remarks.iter().filter_map(|remark| match remark {
            Stated::Radiance(_) => None,
            Stated::Other { text, kind } => Some((text, kind)),
        })
    };
    // `1361 W m-2` is a value of its own.
    let is_of_values = |(text, kind): &(&String, &OtherUnit)| {
        kind.conversion().is_some() && !text.starts_with(|c: char| c.is_ascii_digit())
    };
    match (units.as_slice(), given) {
        ([unit], given) => agreed(name, *unit, given).map(|unit| (unit, None)),
        // Another unit in a comment may be that of something else.
        ([], Some(given)) => {
            let warned = others().find(is_of_values).map(|(text, kind)| {
                format!(
                    "{name}: a comment speaks of `{text}`, {}; its values count as {given}, as --radiance-unit says: are they?",
                    kind.in_words()
                )
            });
            Ok((given, warned))
        }
        ([], None) => {
            let other = others().next().map(|(text, kind)| format!("`{text}`, {}", kind.in_words()));
            let spoken_of = other.unwrap_or_default();
            let problem = format!("it does not say the unit of its values, and its comments speak of {spoken_of}");
            let conversion = others().find_map(|(_, kind)| kind.conversion());
            Err(match conversion {
                None => Error::format(name, problem).give(&["radiance_unit"]),
                Some(conversion) => {
                    let wanted = RadianceUnit::USUAL[1];
                    let problem = format!(
                        "{problem}; spectral radiances are wanted, in units such as {wanted}: {conversion}; --radiance-unit is for \
                         values that are radiances after all"
                    );
                    Error::format(name, problem)
                }
            })
        }
        (several, Some(given)) if several.contains(&given) => Ok((given, None)),
        (several, given) => {
            let named: Vec<String> = several.iter().map(ToString::to_string).collect();
            let error = Error::format(name, format!("its comments name the units of radiance {}", named.join(" and ")));
            Err(if given.is_none() { error.give(&["radiance_unit"]) } else { error.change(&["radiance_unit"]) })
        }
    }
}
