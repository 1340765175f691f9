//! `mosaic`: one CFA plane from three.

cyanometer::program!(mosaic);
