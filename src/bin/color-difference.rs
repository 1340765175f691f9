//! `color-difference`: how far images or colors differ to the eye.

cyanometer::program!(color_difference);
