//! `correct-frame`: codes without black, dark signal, the traces of charge transfer, and what photosites differ by.

cyanometer::program!(correct_frame);
