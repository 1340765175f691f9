//! `photon-transfer`: what a camera is, measured from flats and darks.

cyanometer::program!(photon_transfer);
