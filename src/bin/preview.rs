//! `preview`: a PNG picture of any frame.

cyanometer::program!(preview);
