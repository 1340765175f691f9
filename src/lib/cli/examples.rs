//! Examples of each program: what its help and its manual page show, and a test runs.

/// A command line, and what it is good for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Example {
    /// The reason, in a few words.
    pub reason: &'static str,
    /// What a shell is given; spectra are those of `sample_data`, by name, and what other examples and the usual pipeline make.
    pub command: &'static str,
}

const fn example(reason: &'static str, command: &'static str) -> Example {
    Example { reason, command }
}

/// The examples of each program, in an order in which they can be run.
pub const EXAMPLES: [(&str, &[Example]); 17] = [
    (
        "fit-matrix",
        &[
            example("A matrix from 912 computed skies", "fit-matrix sky912.exr -o matrix.yaml"),
            example(
                "Trained on 20 of them, judged on skies measured elsewhere, with noise and without",
                "fit-matrix sky912.exr --train 20 --evaluate kider2014.exr",
            ),
            example(
                "With one sky kept exact, by another regression",
                "fit-matrix sky912.exr --regression sky-rad-sppls -o exact.yaml",
            ),
        ],
    ),
    (
        "render-radiance",
        &[
            example(
                "A uniform sky, exposed to three quarters of full well",
                "render-radiance clear_zenith.csv --size 640x480 --expose-to 0.75 -o expected.exr",
            ),
            example(
                "A library of skies as a chart, each a patch of 24x24 photosites",
                "render-radiance sky912.exr --patch 24x24 --expose-to 0.75 -o chart.exr",
            ),
            example(
                "Electrons given outright",
                "render-radiance --electrons 8000,12000,20000 --size 320x240 | measure",
            ),
        ],
    ),
    (
        "add-noise",
        &[
            example("One exposure, which the seed tells from others", "add-noise --seed 7 expected.exr -o noisy.exr"),
            example(
                "Ten exposures, a file each; --resume leaves alone what is complete",
                "add-noise --frames 0..10 --resume expected.exr -o 'noisy-{frame:03}.exr'",
            ),
            example(
                "A hundred exposures in one stream, and the statistics of each",
                "add-noise --frames 0..100 expected.exr | digitize | measure",
            ),
            example(
                "Another exposure by the same sensor, without read noise",
                "add-noise --frame 1 --without ron expected.exr | measure",
            ),
        ],
    ),
    (
        "digitize",
        &[
            example("Codes of the sensor's own converter, as TIFF", "digitize noisy.exr -o codes.tiff"),
            example("Codes of a converter of 14 bits", "digitize --bits 14 --bias 512 --slope 0.4 noisy.exr | measure"),
        ],
    ),
    (
        "mosaic",
        &[
            example("What the camera records: one class at each photosite", "mosaic codes.tiff -o plane.tiff"),
            example("A DNG that raw converters open", "mosaic codes.tiff -o plane.dng"),
        ],
    ),
    (
        "import-raw",
        &[
            example("The codes of a raw file, with pattern, levels and exposure", "import-raw plane.dng -o codes.tiff"),
            example(
                "Several, each beside its own matrix for relative XYZ",
                "import-raw plane.dng plane2.dng -o '{stem}.exr' --write-matrix '{stem}-matrix.yaml'",
            ),
        ],
    ),
    (
        "correct-frame",
        &[
            example("The black level off", "correct-frame --black auto plane.tiff -o corrected.exr"),
            example(
                "Dark frames off, their outliers left out, and hot photosites interpolated",
                "correct-frame --dark d1.exr --dark d2.exr --combine clipped --find-defects plane.tiff -o corrected.exr",
            ),
        ],
    ),
    (
        "demosaic",
        &[
            example("Sensor RGB, with a standard deviation for each pixel", "demosaic --sigma plane.tiff -o rgb.exr"),
            example(
                "Another program's plane, which says neither pattern nor black level",
                "demosaic --method mhc --cfa rggb --black 64 foreign.png -o rgb2.exr",
            ),
        ],
    ),
    (
        "to-xyz",
        &[
            example("Absolute XYZ, with error bars", "to-xyz --matrix matrix.yaml --sigma demosaicked.exr -o xyz.exr"),
            example(
                "L*a*b* of what is there already as XYZ, under D50",
                "to-xyz --space lab --white d50 --white-luminance 5000 xyz.exr -o lab.exr",
            ),
        ],
    ),
    (
        "stack-frames",
        &[
            example("Many frames in one Zarr store, which xarray reads", "stack-frames noisy-*.exr -o night.zarr"),
            example("Some of them out of it, into a pipe", "stack-frames night.zarr --frames 2..5 | measure"),
        ],
    ),
    (
        "average-frames",
        &[
            example("The mean of ten exposures", "average-frames noisy-*.exr -o mean.exr"),
            example(
                "Their median, codes made first; names in quotes are expanded too",
                "digitize 'noisy-*.exr' | average-frames --combine median -o median.tiff",
            ),
            example(
                "XYZ of a mean, whose standard deviations know what has averaged out",
                "digitize noisy-*.exr | average-frames | mosaic | demosaic | to-xyz --sigma -o still.exr",
            ),
        ],
    ),
    (
        "measure",
        &[
            example("Mean, spread and covariance, beside what the formulas predict", "measure plane.tiff"),
            example(
                "The same of a rectangle, for another program",
                "measure --region 100,100,64,64 --output-format json xyz.exr -o xyz.json",
            ),
            example(
                "What scatters from frame to frame, and what is the same in all",
                "add-noise --frames 0..20 expected.exr | digitize | measure --over frames",
            ),
            example(
                "Exit with status 1 where noise is not as predicted",
                "render-radiance --electrons 900,2000,4000 --size 320x240 | add-noise | digitize | mosaic | measure --check",
            ),
        ],
    ),
    (
        "predict-noise",
        &[
            example(
                "The noise budget of a level, up to L*a*b*, and of the mean of a patch",
                "predict-noise --electrons 8000,12000,20000 --matrix matrix.yaml --patch 16x16",
            ),
            example(
                "The photon transfer curve, as table and figure",
                "predict-noise --sweep 10:40000:50log --plot transfer.svg -o sweep.csv",
            ),
        ],
    ),
    (
        "photon-transfer",
        &[
            example("A camera from a folder of flats and darks that tell what they are", "photon-transfer frames"),
            example(
                "From a list of them, with its curves, for another program",
                "photon-transfer list.csv --plot camera.svg --output-format json -o camera.json",
            ),
        ],
    ),
    (
        "color-difference",
        &[
            example("Two colors, X,Y,Z", "color-difference 40,42,50 41,42,52"),
            example(
                "Two frames, and a map of their differences",
                "color-difference reference.exr xyz.exr --map difference.exr",
            ),
        ],
    ),
    (
        "preview",
        &[
            example("A picture of a frame", "preview plane.tiff -o plane.png"),
            example(
                "One quantity in false color, with its scale",
                "preview xyz.exr --plane Y --false-color -o luminance.png",
            ),
            example("A sheet of several frames", "preview expected.exr noisy.exr plane.tiff -o sheet.png"),
        ],
    ),
    (
        "cyanometer",
        &[
            example("The programs, a line each", "cyanometer"),
            example("Sensors, spectra, lights and charts that are known by name", "cyanometer list"),
            example("Sensors of which a word is told, with what they have and lack", "cyanometer list sensors nikon"),
            example("All keys of a sensor file, and a file to begin with", "cyanometer keys sensor"),
            example("A sensor of one's own", "cyanometer template sensor > my-camera.yaml"),
        ],
    ),
];

/// The examples of a program.
pub fn of(program: &str) -> &'static [Example] {
    EXAMPLES.iter().find(|(name, _)| *name == program).map_or(&[], |(_, examples)| examples)
}

/// The examples of a program as its help shows them.
pub(super) fn text(program: &str) -> String {
    let shown = of(program)
        .iter()
        .map(|Example { reason, command }| format!("  # {reason}\n  {}\n", lines(command).join(" \\\n      ")));
    format!("Examples:\n{}", shown.collect::<Vec<_>>().join("\n"))
}

/// A command in lines that no terminal breaks.
fn lines(command: &str) -> Vec<String> {
    /// Columns of a line, before its indent and a backslash.
    const COLUMNS: usize = 72;
    let mut lines = vec![String::new()];
    for word in command.split(' ') {
        match lines.last_mut() {
            Some(line) if line.is_empty() => line.push_str(word),
            Some(line) if line.len() + word.len() < COLUMNS => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// The same in roff, as a section of a manual page.
pub(super) fn roff(program: &str) -> String {
    let plain = |text: &str| text.replace('\\', "\\e").replace('-', "\\-").replace('\'', "\\(aq");
    let shown = of(program)
        .iter()
        .map(|Example { reason, command }| format!(".PP\n{}:\n.PP\n.EX\n  {}\n.EE\n", plain(reason), plain(command)));
    format!(".SH EXAMPLES\n{}", shown.collect::<String>())
}
