//! `predict-noise`: the noise budget of a uniform scene, by formula.

cyanometer::program!(predict_noise);
