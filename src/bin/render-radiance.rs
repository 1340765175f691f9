//! `render-radiance`: expected electrons from spectral radiance.

cyanometer::program!(render_radiance);
