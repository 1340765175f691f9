//! The programs: of each its arguments, and what it does with them.
//!
//! `src/bin` has a line for each, so that each can be built alone. One executable can be all of them as well, by the name under
//! which it is called ([`front`]); `scripts/install` makes links to it. Those that are linked with much that no other needs stand
//! in `src/bin` whole: `import-raw` and `stack-frames`.

pub mod add_noise;
pub mod average_frames;
pub mod color_difference;
pub mod correct_frame;
pub mod demosaic;
pub mod digitize;
pub mod fit_matrix;
pub mod front;
pub mod measure;
pub mod mosaic;
pub mod photon_transfer;
pub mod predict_noise;
pub mod preview;
pub mod render_radiance;
pub mod to_xyz;

use std::process::ExitCode;

/// What a program does with the arguments of the process.
type Main = fn() -> ExitCode;

/// The programs that one executable can be, by name.
const BY_NAME: [(&str, Main); 14] = [
    ("render-radiance", render_radiance::main),
    ("add-noise", add_noise::main),
    ("digitize", digitize::main),
    ("mosaic", mosaic::main),
    ("correct-frame", correct_frame::main),
    ("demosaic", demosaic::main),
    ("fit-matrix", fit_matrix::main),
    ("to-xyz", to_xyz::main),
    ("average-frames", average_frames::main),
    ("measure", measure::main),
    ("predict-noise", predict_noise::main),
    ("photon-transfer", photon_transfer::main),
    ("color-difference", color_difference::main),
    ("preview", preview::main),
];

/// The program of a name, where this executable can be it; of the name of a file with the project's before it, as a system has it
/// that keeps plain names for any package's.
fn by_name(name: &str) -> Option<Main> {
    let plain = name.strip_prefix(concat!(env!("CARGO_PKG_NAME"), "-")).unwrap_or(name);
    BY_NAME.iter().find(|(known, _)| *known == plain).map(|(_, main)| *main)
}

/// Makes an executable of a program of this library: `cyanometer::program!(digitize);`.
#[macro_export]
macro_rules! program {
    ($name:ident) => {
        #[global_allocator]
        static MEMORY: $crate::cli::Memory = $crate::cli::Memory;

        fn main() -> ::std::process::ExitCode {
            $crate::programs::$name::main()
        }
    };
}
