//! The methods by name.

/// A way to interpolate the missing classes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Bilinear interpolation (BI) of each class by itself.
    Bilinear,
    /// Smooth hue transition interpolation (SHTI), of the ratios R/G and B/G \[Cok1987].
    SmoothHue,
    /// Effective colour interpolation (ECI), of the differences G − R and G − B \[PeiTam2003].
    EffectiveColor,
    /// Malvar, He and Cutler's linear filters of 5×5 sites (MHC) \[MHC2004].
    Malvar,
}

impl Method {
    /// All methods.
    pub const ALL: [Self; 4] = [Self::Bilinear, Self::SmoothHue, Self::EffectiveColor, Self::Malvar];

    /// Short and long name.
    pub fn names(self) -> [&'static str; 2] {
        match self {
            Self::Bilinear => ["bi", "bilinear"],
            Self::SmoothHue => ["shti", "smooth-hue"],
            Self::EffectiveColor => ["eci", "effective-color"],
            Self::Malvar => ["mhc", "malvar"],
        }
    }

    /// The method of a short or long name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|method| method.names().contains(&name))
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
