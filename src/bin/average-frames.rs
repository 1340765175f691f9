//! `average-frames`: one frame of several exposures of a scene.

cyanometer::program!(average_frames);
