//! `measure`: statistics of a frame beside what propagation predicts.

cyanometer::program!(measure);
