//! `demosaic`: sensor RGB from a CFA plane.

cyanometer::program!(demosaic);
