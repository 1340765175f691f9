//! `digitize`: codes from electrons.

cyanometer::program!(digitize);
