//! `add-noise`: one noisy exposure from expected electrons.

cyanometer::program!(add_noise);
