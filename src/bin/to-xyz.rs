//! `to-xyz`: colors from sensor RGB.

cyanometer::program!(to_xyz);
