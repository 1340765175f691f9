//! `fit-matrix`: a characterization matrix from spectra, from a chart or from a raw file's own tags, and how well it does.

cyanometer::program!(fit_matrix);
