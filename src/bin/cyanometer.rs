//! `cyanometer`: the front door to the other programs, and most of them themselves.

cyanometer::program!(front);
