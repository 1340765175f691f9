//! The help of a program: its options in groups, the same in all programs and in the same order, and its examples.

use super::examples;
use clap::{Arg, ArgAction, Command};

/// Groups of options in the order in which help shows them, and the options of each. What no group has is what a program
/// is for, and stands before them.
const GROUPS: [(&str, &[&str]); 10] = [
    (
        "The scene",
        &["electrons", "dark", "size", "radiance-unit", "column", "sample", "all-samples", "wavelengths", "quadrature"],
    ),
    ("A picture in R, G, B as the scene", &["rgb", "primaries", "illuminant", "luminance"]),
    (
        "The sensor and the exposure",
        &[
            "sensor",
            "readout",
            "setting",
            "counts",
            "peak-quantum-efficiency",
            "expose-to",
            "focal-length",
            "vignetting",
            "exposure",
            "f-number",
            "lens-transmittance",
            "cfa",
        ],
    ),
    (
        "Noise",
        &["seed", "sensor-seed", "frame", "frames", "without", "clean", "temperature", "poisson", "cte", "dark-frames"],
    ),
    ("The evaluation of the matrix", &["evaluate", "demosaic", "noise-free"]),
    (
        "A chart or a raw file instead of a library",
        &["chart", "corners", "levels", "reference", "reference-light", "no-misfit", "from-raw", "own-matrix"],
    ),
    ("The white and the light", &["white-luminance", "adapt-to", "scene-white", "adaptation"]),
    (READ, &["part", "raw", "metadata", "metadata-template", "channel", "crop"]),
    (
        "Output",
        &[
            "output",
            "resume",
            "format",
            "compression",
            "sample-type",
            "viewable",
            "separate-layers",
            "output-format",
            "plot",
            "pixels",
            "map",
            "write-matrix",
            "write-readout",
            "sensor-out",
        ],
    ),
    (GENERAL, &["threads", "quiet", "verbose", "progress", "describe-keys", "help", "version"]),
];
/// The group of what is said of a frame.
const READ: &str = "The frame that is read";
/// The last group.
const GENERAL: &str = "General";
/// What a user may say of a frame, in programs that read one.
const OF_A_FRAME: [&str; 6] = ["cfa", "white", "black", "exposure", "f-number", "lens-transmittance"];
/// Options that mean more to a program than to others; none is what the program is for.
const APART: [(&str, &str, Option<&str>); 25] = [
    ("demosaic", "black", None),
    ("correct-frame", "black", None),
    ("correct-frame", "dark", None),
    ("correct-frame", "cte", None),
    ("mosaic", "cfa", None),
    ("import-raw", "crop", None),
    ("predict-noise", "dark-frames", None),
    ("stack-frames", "frames", Some(READ)),
    ("render-radiance", "part", Some("The scene")),
    ("render-radiance", "patch", Some("The scene")),
    ("to-xyz", "white", Some("The white and the light")),
    ("predict-noise", "white", Some("The white and the light")),
    ("color-difference", "white", Some("The white and the light")),
    ("fit-matrix", "white", Some("The white and the light")),
    ("fit-matrix", "patch", Some("The evaluation of the matrix")),
    ("fit-matrix", "part", Some("A chart or a raw file instead of a library")),
    ("fit-matrix", "raw", Some("A chart or a raw file instead of a library")),
    ("fit-matrix", "channel", Some("A chart or a raw file instead of a library")),
    ("fit-matrix", "crop", Some("A chart or a raw file instead of a library")),
    ("fit-matrix", "cfa", Some("A chart or a raw file instead of a library")),
    ("fit-matrix", "metadata", Some("A chart or a raw file instead of a library")),
    ("fit-matrix", "patches", Some("A chart or a raw file instead of a library")),
    ("fit-matrix", "illuminant", Some("A chart or a raw file instead of a library")),
    ("fit-matrix", "temperature", Some("A chart or a raw file instead of a library")),
    ("fit-matrix", "luminance", Some("A chart or a raw file instead of a library")),
];

/// A program's definition with its options in groups, a row of examples, and help and version among what is general.
pub(super) fn arranged(program: &'static str, command: &Command) -> Command {
    let reads_frames = command.get_arguments().any(|argument| argument.get_long() == Some("metadata-template"));
    let own = |id: &'static str, short, action, help: &'static str| {
        Arg::new(id).long(id).short(short).action(action).help(help)
    };
    let of_clap = [
        own("help", 'h', ArgAction::Help, "Print help: -h a summary, --help all of it with examples"),
        own(
            "version",
            'V',
            ArgAction::Version,
            "Print project and version, and the commit where the build was told it",
        ),
    ];
    let place = |argument: &Arg| argument.get_long().and_then(|long| group(program, long, reads_frames));
    let mut arguments: Vec<(Option<usize>, Arg)> =
        command.get_arguments().cloned().chain(of_clap).map(|argument| (place(&argument), argument)).collect();
    arguments.sort_by_key(|(place, _)| *place);
    let arguments = arguments.into_iter().map(|(place, argument)| {
        // `-1` is a value, of which the option says what is wrong.
        let takes_values = matches!(argument.get_action(), ArgAction::Set | ArgAction::Append);
        let argument =
            if takes_values && !argument.is_positional() { argument.allow_negative_numbers(true) } else { argument };
        argument.help_heading(place.map(|place| GROUPS[place].0))
    });
    let version = env!("CARGO_PKG_VERSION");
    let mut made =
        Command::new(program).bin_name(program).version(version).disable_help_flag(true).disable_version_flag(true);
    if let Some(about) = command.get_about() {
        made = made.about(about.clone());
    }
    if let Some(about) = command.get_long_about() {
        made = made.long_about(about.clone());
    }
    made.args(arguments).groups(command.get_groups().cloned()).after_long_help(examples::text(program))
}

/// The place of the group that an option belongs to.
fn group(program: &str, long: &str, reads_frames: bool) -> Option<usize> {
    let named = |name: &str| GROUPS.iter().position(|(group, _)| *group == name);
    if let Some((.., group)) = APART.iter().find(|(of, option, _)| (*of, *option) == (program, long)) {
        return group.and_then(named);
    }
    if reads_frames && OF_A_FRAME.contains(&long) {
        return named(READ);
    }
    GROUPS.iter().position(|(_, options)| options.contains(&long))
}
