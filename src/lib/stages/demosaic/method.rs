//! The methods by name.

use crate::names::Named;

/// A way to interpolate the missing classes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// Bilinear interpolation (BI) of each class by itself.
    Bilinear,
    /// Smooth hue transition interpolation (SHTI), of the ratios R/G and B/G \[Cok1987].
    SmoothHue,
    /// Effective color interpolation (ECI), of the differences G − R and G − B \[PeiTam2003].
    #[default]
    EffectiveColor,
    /// Malvar, He and Cutler's linear filters of 5×5 sites (MHC) \[MHC2004].
    Malvar,
}

impl Method {
    /// All methods.
    pub const ALL: [Self; 4] = [Self::Bilinear, Self::SmoothHue, Self::EffectiveColor, Self::Malvar];

    /// Short and long name.
    pub fn names(self) -> &'static [&'static str; 2] {
        match self {
            Self::Bilinear => &["bi", "bilinear"],
            Self::SmoothHue => &["shti", "smooth-hue"],
            Self::EffectiveColor => &["eci", "effective-color"],
            Self::Malvar => &["mhc", "malvar"],
        }
    }

    /// Rows and columns on each side that an interpolated value depends on.
    pub fn reach(self) -> usize {
        match self {
            Self::Bilinear => 1,
            Self::SmoothHue | Self::Malvar => 2,
            Self::EffectiveColor => 3,
        }
    }
}

impl Named for Method {
    const ALL: &'static [Self] = &Self::ALL;

    fn name(self) -> &'static str {
        self.names()[0]
    }

    fn other_names(self) -> &'static [&'static str] {
        &self.names()[1..]
    }
}
