//! Mistakes with the programs: the complaint, the exit status, and that nothing is lost.

#![allow(clippy::unwrap_used, reason = "a test that cannot be set up shall stop there")]

use crate::support;
use std::fs;
use std::process::Command;
use support::TREE;
use support::workshop::{BAD_DATA, BAD_USAGE, Workshop};

/// The likeliest mistakes with each program: the command, the exit status, the line.
const MISTAKES: [(&str, i32, &str); 139] = [
    (
        "preview codes.exr plane.exr -o {steam}.png",
        BAD_USAGE,
        "{steam}.png: nothing stands for {steam}; did you mean {stem}? There are {stem}, {frame} and {index}, and {frame:05} for five \
         digits",
    ),
    ("to-xyz rgb.exr matrix.yaml -o x.exr", BAD_USAGE, "matrix.yaml: it is no frame but a matrix file, for --matrix"),
    (
        "preview codes.exr --range 5%,1% -o x.png",
        BAD_USAGE,
        "`5%,1%` is no value for --range <full|LOW,HIGH|LOW%,HIGH%|Nsigma>: the lower share stands first, and both lie within 0% and \
         100%, as in 1%,99%; see `preview --help`",
    ),
    (
        "photon-transfer codes.exr",
        BAD_DATA,
        "codes.exr: it is an EXR, a single frame; a list of flats and darks is wanted, a table with the columns file, kind, exposure_s, \
         photons, temperature_k, temperature_c, level, or the directory that they are in",
    ),
    (
        "render-radiance matrix.yaml",
        BAD_DATA,
        "matrix.yaml: it is a matrix file, for --matrix; a table is wanted here, as CSV",
    ),
    (
        "to-xyz rgb.exr --matrix codes.exr",
        BAD_DATA,
        "codes.exr: it is no text but a binary file, such as a frame; a YAML file is wanted here",
    ),
    (
        "measure codes.exr --metadata plane.exr",
        BAD_DATA,
        "plane.exr: it is no text but a binary file, such as a frame; a YAML file is wanted here",
    ),
    (
        "render-radiance --dark --sensor codes.exr",
        BAD_DATA,
        "codes.exr: its name ends neither in .yaml, as those of sensor files do, nor in .csv, as those of responses; is it another file?",
    ),
    (
        "measure codes.exr -o report.docx",
        BAD_USAGE,
        "no report is written as .docx; there are text, json, yaml, csv; give another --output",
    ),
    (
        "predict-noise uvspec.csv noisy.exr.yaml",
        BAD_USAGE,
        "unknown option or extra argument `noisy.exr.yaml`; the program takes one input; see `predict-noise --help`",
    ),
    (
        "predict-noise uvspec.csv ./matrix.yaml",
        BAD_USAGE,
        "unknown option or extra argument `./matrix.yaml`; it is a matrix file: give it as `--matrix ./matrix.yaml`; see \
         `predict-noise --help`",
    ),
    (
        "measure codes.exr -o codes.xlsx",
        BAD_USAGE,
        "no report is written as .xlsx; there are text, json, yaml, csv; give another --output",
    ),
    (
        "predict-noise --electrons 900,2000,4000 --patch 4x9000",
        BAD_USAGE,
        "a patch of 4x9000 pixels is larger than the sensor, which has 2654x1996 photosites; give another --patch",
    ),
    (
        "predict-noise --dark -o noise.png",
        BAD_USAGE,
        "no report is written as .png; there are text, json, yaml, csv; give another --output",
    ),
    (
        "average-frames codes.exr plane.exr -o DIR/",
        BAD_USAGE,
        "DIR/: one frame is made of all; name a single file; give another --output",
    ),
    (
        "digitize noisy.exr --resume",
        BAD_USAGE,
        "a stream keeps nothing of an earlier run; name files for what is made; leave out --resume",
    ),
    (
        "digitize noisy.exr -o x.dng",
        BAD_DATA,
        "x.dng: a DNG holds codes behind a filter array, one plane of ADU, and this frame is three planes of ADU; run `mosaic` first",
    ),
    (
        "add-noise expected.exr -o x.dng",
        BAD_DATA,
        "x.dng: a DNG holds codes behind a filter array, one plane of ADU, and this frame is three planes of electrons; run `mosaic` \
         and `digitize` first",
    ),
    (
        "demosaic plane.exr --format dng",
        BAD_USAGE,
        "standard output: a DNG holds codes behind a filter array, one plane of ADU, and this frame is three demosaicked planes of \
         ADU; write an EXR or a TIFF",
    ),
    (
        "mosaic codes.exr --compression lzw -o x.dng",
        BAD_USAGE,
        "DNG of 16-bit codes is not compressed by lzw; leave it uncompressed, or write 32-bit floats (f32) and deflate",
    ),
    (
        "correct-frame plane.exr --black auto --compression zip -o x.dng",
        BAD_USAGE,
        "DNG of floats is not compressed by zip; it is one of none or deflate",
    ),
    ("render-radiance missing.csv", BAD_DATA, "missing.csv: cannot open: no such file or directory"),
    (
        "render-radiance --dark --size 8",
        BAD_USAGE,
        "`8` is no value for --size <WIDTHxHEIGHT>: a size is WIDTHxHEIGHT in photosites, such as 1332x1000; see \
         `render-radiance --help`",
    ),
    (
        "render-radiance --electrons 1,2",
        BAD_USAGE,
        "`1,2` is no value for --electrons <R,G,B>: give the electrons of R,G,B between commas, none below 0 or above 3.4e38; see \
         `render-radiance --help`",
    ),
    (
        "render-radiance --dark --sensor kaf-5101",
        BAD_USAGE,
        "there is no sensor `kaf-5101`; `cyanometer list sensors` has those that there are, and for a file of your own give its path; did you mean `kaf-5101ce`?",
    ),
    (
        "render-radiance sky.csv --electrons 1,2,3",
        BAD_USAGE,
        "[INPUT] and --electrons <R,G,B> exclude each other; see `render-radiance --help`",
    ),
    ("add-noise", BAD_DATA, "standard input: it is empty; the program before it wrote nothing"),
    (
        "add-noise noisy.exr",
        BAD_DATA,
        "noisy.exr: it holds three planes of electrons that have their noise already; noise is added once",
    ),
    (
        "add-noise codes.exr",
        BAD_DATA,
        "codes.exr: it holds three planes of ADU, not expected electrons of photosites; run `render-radiance` first",
    ),
    (
        "add-noise expected.exr --without ssm",
        BAD_USAGE,
        "`ssm` is no value for --without <SOURCES>; it is one of dcsn, dcnu, ssn, prnu, ron, row_noise, \
         column_noise, dsnu, dsnu_row, dsnu_column, prnu_row, prnu_column, hot_pixels, rts, black_drift; did you mean `ssn`? See `add-noise --help`",
    ),
    (
        "add-noise expected.exr --sed 7",
        BAD_USAGE,
        "unknown option or extra argument `--sed`; did you mean `--seed`? See `add-noise --help`",
    ),
    (
        "add-noise expected.exr -o expected.exr",
        BAD_USAGE,
        "expected.exr: it is the same file as the input expected.exr; name another output",
    ),
    (
        "add-noise matrix.yaml",
        BAD_DATA,
        "matrix.yaml: it is neither an EXR nor a DNG nor a PNG nor a FITS nor a TIFF file; it is a matrix file, for --matrix",
    ),
    (
        "measure codes.exr.yaml",
        BAD_DATA,
        "codes.exr.yaml: it is neither an EXR nor a DNG nor a PNG nor a FITS nor a TIFF file; it holds the metadata of `codes.exr`: \
         name that",
    ),
    (
        "render-radiance zenit-sky",
        BAD_DATA,
        "zenit-sky: there is no such file; did you mean `clear_zenith.csv`? `cyanometer list spectra` tells those known by name",
    ),
    (
        "fit-matrix no_data/skies/sky912.exr",
        BAD_DATA,
        "no_data/skies/sky912.exr: there is no such file; did you mean `sky912.exr`? `cyanometer list spectra` tells those known by name",
    ),
    (
        "predict-noise measured_bleu.csv",
        BAD_DATA,
        "measured_bleu.csv: there is no such file; did you mean `measured_blue.csv`? `cyanometer list spectra` tells those known by name",
    ),
    (
        "fit-matrix sky921.exr",
        BAD_DATA,
        "sky921.exr: there is no such file; did you mean `sky912.exr`? `cyanometer list spectra` tells those known by name",
    ),
    (
        "render-radiance uvspec.csv",
        BAD_DATA,
        "uvspec.csv: column `edir`: its values are in `edir`, an irradiance, which has no sr-1; spectral radiances are wanted, in units such as \
         W m-2 sr-1 nm-1: take those of one direction from where these come from, as `uu` of uvspec; of a matt white surface they are the irradiance \
         over pi; `uu` may hold them: choose it with --column 'uu'",
    ),
    (
        "render-radiance mistyped.csv",
        BAD_DATA,
        "mistyped.csv: line 1, column 1: `40O` is no number; its line looks like one of numbers (a heading begins with a word such as \
         `wavelength_nm`)",
    ),
    (
        "render-radiance contradictory.csv",
        BAD_DATA,
        "contradictory.csv: its values are in `irradiance (W m-2 sr-1 nm-1)`, the name of one quantity beside the unit of another, one of \
         which is wrong; give --radiance-unit",
    ),
    (
        "add-noise matrix.yaml --raw 4x3:u16",
        BAD_USAGE,
        "`4x3:u16` is no value for --raw <WxH:TYPE[:OFFSET]>: a file without a header is described as WIDTHxHEIGHT:TYPE or \
         WIDTHxHEIGHT:TYPE:OFFSET, the type one of u8, u16le, u16be, f32le; see `add-noise --help`",
    ),
    (
        "measure codes.exr --crop 1,1,0,1",
        BAD_USAGE,
        "codes.exr: region 1,1,0,1 does not lie within the frame of 8x6; give another --crop",
    ),
    (
        "measure codes.exr --channel Y",
        BAD_USAGE,
        "codes.exr: there is no channel `Y`; it has R, G, B; give another --channel",
    ),
    (
        "measure noisy.exr --white 4095",
        BAD_USAGE,
        "noisy.exr: it holds three planes of electrons, which have no level of codes; leave out --white",
    ),
    ("measure --raw 4x3:u16le", BAD_DATA, "standard input: it has 0 bytes, but 4x3:u16le takes 24; give another --raw"),
    (
        "add-noise expected.exr --cte 1.1",
        BAD_USAGE,
        "`1.1` is no value for --cte <X>: give a fraction above 0 and at most 1; see `add-noise --help`",
    ),
    (
        "correct-frame codes.exr",
        BAD_USAGE,
        "there is nothing to correct; give --black, --dark, --bias, --flat, --defects, --linearize or --cte",
    ),
    (
        "correct-frame noisy.exr --cte 0.9",
        BAD_DATA,
        "noisy.exr: it holds three planes of electrons, not ADU; run `digitize` first",
    ),
    (
        "correct-frame rgb.exr --black 3",
        BAD_DATA,
        "rgb.exr: it holds three demosaicked planes of ADU; corrections come before demosaicking",
    ),
    (
        "correct-frame codes.exr --cte 0.1",
        BAD_USAGE,
        "a charge transfer efficiency of 0.1 is too poor to be undone over 6 moves; errors would grow more than 1000 times",
    ),
    (
        "correct-frame codes.exr --dark plane.exr",
        BAD_DATA,
        "plane.exr: its number of planes is 1, but that of codes.exr is 3",
    ),
    (
        "correct-frame codes.exr --dark noisy.exr",
        BAD_DATA,
        "noisy.exr: it holds three planes of electrons, not ADU; run `digitize` first",
    ),
    (
        "correct-frame codes.exr --dark codes.exr --black 3",
        BAD_USAGE,
        "--dark <FILE> and --black <auto|none|N[,N,N,N]|border|rows|columns> exclude each other; see `correct-frame --help`",
    ),
    ("correct-frame codes.exr --dark missing.exr", BAD_DATA, "missing.exr: cannot open: no such file or directory"),
    (
        "correct-frame plane.exr --dark plane.exr",
        BAD_USAGE,
        "plane.exr: it is given as the frame itself and as a dark frame; its noise would count as that of two exposures; name \
         another file",
    ),
    (
        "correct-frame codes.exr --flat plane.exr --flat ./plane.exr --black auto",
        BAD_USAGE,
        "./plane.exr: it is given twice as a flat; its noise would count as that of two exposures; name another file",
    ),
    (
        "correct-frame codes.exr --dark plane.exr --clip 4",
        BAD_USAGE,
        "only `--combine clipped` leaves samples out; leave out --clip",
    ),
    (
        "correct-frame codes.exr --black auto --combine median",
        BAD_USAGE,
        "--dark <FILE> or --bias <FILE> or --flat <FILE> is missing, without which --combine has no effect; see \
         `correct-frame --help`",
    ),
    (
        "correct-frame plane.exr --black auto --defects plane.exr",
        BAD_DATA,
        "plane.exr: 48 of its 48 samples are not 0, and would be defective photosites; a map is 0 where photosites are good",
    ),
    (
        "measure codes.exr --level 0.01",
        BAD_USAGE,
        "--check is missing, without which --level has no effect; see `measure --help`",
    ),
    (
        "demosaic plane.exr --pattern bggr",
        BAD_USAGE,
        "plane.exr: the filter array is rggb by its metadata, which --metadata FILE can replace; leave out --pattern",
    ),
    (
        "to-xyz rgb.exr --matrix matrix.yaml --exposure 1",
        BAD_USAGE,
        "rgb.exr: the exposure time in s is 0.033 by its metadata, which --metadata FILE can replace; leave out --exposure",
    ),
    (
        "to-xyz rgb.exr --matrix matrix.yaml --space lab --white 90,95,100 --white-luminance 95",
        BAD_USAGE,
        "a white of X,Y,Z has its luminance already; leave out --white-luminance",
    ),
    (
        "to-xyz rgb.exr --matrix matrix.yaml --adaptation cat16",
        BAD_USAGE,
        "--adapt-to <LIGHT> is missing, without which --adaptation has no effect; see `to-xyz --help`",
    ),
    (
        "fit-matrix SAMPLES/skies/sky912.exr --seed 3",
        BAD_USAGE,
        "--evaluate <LIBRARY> is missing, without which --seed has no effect; see `fit-matrix --help`",
    ),
    (
        "render-radiance --dark --focal-length 20",
        BAD_USAGE,
        "--vignetting is missing, without which --focal-length has no effect; see `render-radiance --help`",
    ),
    ("digitize codes.exr", BAD_DATA, "codes.exr: it holds three planes of ADU: it is digitized already"),
    ("digitize noisy.exr --bits 20", BAD_USAGE, "a converter of 20 bits is impossible here; give 1 to 16"),
    (
        "digitize noisy.exr --slope 0",
        BAD_USAGE,
        "`0` is no value for --slope <ADU_PER_E>: give a number above 0; see `digitize --help`",
    ),
    (
        "digitize noisy.exr -o codes.jpg",
        BAD_USAGE,
        "codes.jpg: `.jpg` names no format that is written here; end the name in .exr, .tiff, .dng or .png (for a stack of frames in .zarr, by `stack-frames`), or give --format",
    ),
    (
        "digitize noisy.exr -o codes.png --sample-type f32",
        BAD_USAGE,
        "PNG stores u16; for floats write a TIFF or an EXR",
    ),
    ("mosaic plane.exr", BAD_DATA, "plane.exr: it is a CFA plane already, rggb"),
    (
        "mosaic codes.exr --pattern rgbg",
        BAD_USAGE,
        "`rgbg` is no value for --pattern <PATTERN>: a pattern is rggb, bggr, grbg or gbrg; see `mosaic --help`",
    ),
    (
        "mosaic xyz.exr",
        BAD_DATA,
        "xyz.exr: it holds three demosaicked planes of XYZ; a mosaic is made of the three planes R, G and B of a sensor",
    ),
    ("demosaic codes.exr", BAD_DATA, "codes.exr: it holds three planes of ADU, not a CFA plane; run `mosaic` first"),
    (
        "demosaic plane.exr --black dark",
        BAD_USAGE,
        "`dark` is no value for --black <auto|none|N[,N,N,N]>: give auto, none, a number, or four between commas; see `demosaic --help`",
    ),
    (
        "fit-matrix SAMPLES/skies/sky912.exr -o rgb.exr",
        BAD_USAGE,
        "rgb.exr: a matrix file is written as YAML; end its name in .yaml",
    ),
    ("demosaic rgb.exr", BAD_DATA, "rgb.exr: it holds three demosaicked planes of ADU; demosaicking is done once"),
    ("demosaic plane.exr -o no/where.exr", BAD_DATA, "no/where.exr: there is no directory `no`; make it first"),
    (
        "to-xyz rgb.exr --matrix relative.yaml --white-luminance 100",
        BAD_USAGE,
        "rgb.exr: the matrix gives relative XYZ, in which the white has Y = 1 and no luminance in cd/m2; leave out --white-luminance",
    ),
    (
        "to-xyz rgb.exr --matrix unit.yaml",
        BAD_DATA,
        "unit.yaml: its unit is `nits`; understood are `cd m-2 per (ADU s-1 sr-1)` and `relative XYZ per (white level - black \
         level)`",
    ),
    (
        "color-difference relative.exr xyz.exr",
        BAD_DATA,
        "xyz.exr: its colors are absolute, those of relative.exr relative; make both with matrices of one unit",
    ),
    (
        "color-difference relative.exr 0.2,0.2,0.2 --white-luminance 100",
        BAD_DATA,
        "relative.exr: its XYZ are relative: the white has Y = 1 and no luminance in cd/m2; leave out --white-luminance",
    ),
    (
        "to-xyz plane.exr --matrix matrix.yaml",
        BAD_DATA,
        "plane.exr: it holds a CFA plane of ADU, not three classes at each pixel; run `demosaic` first",
    ),
    (
        "to-xyz rgb.exr --matrix missing.yaml",
        BAD_DATA,
        "missing.yaml: there is no such file; `fit-matrix` makes a matrix, as in `fit-matrix sky912.exr -o matrix.yaml`",
    ),
    ("measure codes.exr -o out/", BAD_DATA, "out/: there is no directory of this name, and a file is wanted; name one"),
    (
        "render-radiance a.csv q.exr",
        BAD_USAGE,
        "unknown option or extra argument `q.exr`; for an output write `-o q.exr`; see `render-radiance --help`",
    ),
    (
        "preview rgb.exr a.png",
        BAD_USAGE,
        "--output <FILE.png> is missing; for an output write `-o a.png`; see `preview --help`",
    ),
    (
        "preview rgb.exr -o a.png --caption hello",
        BAD_DATA,
        "hello: cannot open: no such file or directory; a value of --caption stands behind `=`, as in `--caption=hello`",
    ),
    (
        "photon-transfer matrix.yaml",
        BAD_DATA,
        "matrix.yaml: it is a matrix file, for --matrix; a list of flats and darks is wanted here",
    ),
    (
        "render-radiance expected.exr",
        BAD_DATA,
        "expected.exr: it holds three planes of expected electrons, neither spectral radiance nor a picture in R, G, B; it is rendered \
         already, for `add-noise`",
    ),
    (
        "add-noise expected.exr --temperature 20",
        BAD_USAGE,
        "`20` is no value for --temperature <K>: give a temperature in K, above 0; 20 looks like degrees Celsius, which is 293.15 K; see \
         `add-noise --help`",
    ),
    (
        "predict-noise --dark --temperature 69.9",
        BAD_USAGE,
        "`69.9` is no value for --temperature <K>: give a temperature in K, above 0; 69.9 looks like degrees Celsius, which is 343.05 K; \
         see `predict-noise --help`",
    ),
    (
        "add-noise expected.exr --temperature 25C",
        BAD_USAGE,
        "`25C` is no value for --temperature <K>: give a temperature in K, above 0; 25 looks like degrees Celsius, which is 298.15 K; see \
         `add-noise --help`",
    ),
    (
        "to-xyz noisy.exr --matrix matrix.yaml",
        BAD_DATA,
        "noisy.exr: it holds three planes of electrons, not ADU; run `digitize` first",
    ),
    ("measure missing.exr", BAD_DATA, "missing.exr: cannot open: no such file or directory"),
    ("measure noisy.exr --region 0,0,9,9", BAD_USAGE, "noisy.exr: region 0,0,9,9 does not lie within the frame of 8x6"),
    (
        "measure --patches noisy.exr",
        BAD_USAGE,
        "noisy.exr: its metadata tell of no patches of several photosites; give --patches=WxH",
    ),
    ("measure --patches=4x9 noisy.exr", BAD_USAGE, "noisy.exr: no patch of 4x9 lies whole within the frame of 8x6"),
    (
        "measure --patches=4x3 rgb.exr",
        BAD_USAGE,
        "rgb.exr: patches of 4x3 have no interior: eci mixes colors up to 3 pixels from their edges; they must be 7x7 at least",
    ),
    (
        "measure --patches=4 noisy.exr",
        BAD_USAGE,
        "`4` is no value for --patches[=<WxH>]: a size is WIDTHxHEIGHT in photosites, such as 1332x1000; see `measure --help`",
    ),
    (
        "measure --patches=4x3 noisy.exr --check",
        BAD_USAGE,
        "--patches[=<WxH>] and --check exclude each other; see `measure --help`",
    ),
    (
        "measure --patches=4x3 noisy.exr --region 0,0,1,1",
        BAD_USAGE,
        "--patches[=<WxH>] and --region <X,Y,W,H> exclude each other; see `measure --help`",
    ),
    (
        "color-difference xyz.exr xyz.exr xyz.exr",
        BAD_USAGE,
        "unknown option or extra argument `xyz.exr`; the program takes two inputs; see `color-difference --help`",
    ),
    (
        "color-difference a.exr b.exr c.exr",
        BAD_USAGE,
        "unknown option or extra argument `c.exr`; see `color-difference --help`",
    ),
    (
        "measure noisy.exr --output-format xml",
        BAD_USAGE,
        "`xml` is no value for --output-format <OUTPUT_FORMAT>; it is one of text, txt, json, yaml, yml, csv; did you mean `yml`? \
         See `measure --help`",
    ),
    ("color-difference xyz.exr", BAD_USAGE, "<B> is missing; see `color-difference --help`"),
    ("color-difference xyz.exr missing.exr", BAD_DATA, "missing.exr: cannot open: no such file or directory"),
    (
        "color-difference xyz.exr 1,2",
        BAD_USAGE,
        "`1,2` is no value for <B>: it is no option, no file, and no color, which is three numbers between commas; see \
         `color-difference --help`",
    ),
    (
        "color-difference rgb.exr xyz.exr",
        BAD_DATA,
        "rgb.exr: it holds three demosaicked planes of ADU, not colors; run `to-xyz` first",
    ),
    (
        "color-difference xyz.exr plane.exr",
        BAD_DATA,
        "plane.exr: it holds a CFA plane of ADU, not colors; run `to-xyz` first",
    ),
    (
        "color-difference xyz.exr noisy.exr",
        BAD_DATA,
        "noisy.exr: it holds three planes of electrons, not colors; run `to-xyz` first",
    ),
    ("color-difference - -", BAD_USAGE, "only one input can be the standard input; name a file for the others"),
    (
        "color-difference 1,2,3 4,5,6 --map map.exr",
        BAD_USAGE,
        "a map needs an image; two colors have no map of differences",
    ),
    (
        "color-difference xyz.exr 4,5,6 --map map.tiff",
        BAD_USAGE,
        "`map.tiff` is no value for --map <FILE.exr>: end the name in .exr; see `color-difference --help`",
    ),
    (
        "color-difference xyz.exr 4,5,6 --map map.exr -o ./map.exr",
        BAD_USAGE,
        "the map and the report have the same place; name a file for each",
    ),
    (
        "color-difference 1,2,3 4,5,6 --white 1,0,1",
        BAD_USAGE,
        "a white of XYZ 1.000000 0.000000 1.000000 is impossible; all three must be above 0",
    ),
    (
        "color-difference 1,2,3 4,5,6 --white 1,1,1 --white-luminance 2",
        BAD_USAGE,
        "a white of X,Y,Z has its luminance already; leave out --white-luminance",
    ),
    (
        "color-difference xyz.exr 4,5,6 --map -",
        BAD_USAGE,
        "the map and the report have the same place; name a file for each",
    ),
    ("fit-matrix", BAD_USAGE, "<LIBRARY> is missing; see `fit-matrix --help`"),
    ("fit-matrix missing.exr", BAD_DATA, "missing.exr: cannot open: no such file or directory"),
    (
        "fit-matrix SAMPLES/skies/sky912.exr --hold-out maritime23",
        BAD_USAGE,
        "--hold-out names labels; give them with --labels FILE:COLUMN",
    ),
    (
        "fit-matrix SAMPLES/skies/sky912.exr --labels SAMPLES/skies/sky912_meta.csv:aerosol --hold-out marine",
        BAD_USAGE,
        "no sample has the label `marine`; there are maritime23, none, rural25, rural5, tropospheric50, urban5",
    ),
    (
        "fit-matrix SAMPLES/skies/sky912.exr --white-sample 3",
        BAD_USAGE,
        "sky-rad-ls keeps no sample exact; leave out --white-sample, or choose another --regression",
    ),
    (
        "fit-matrix SAMPLES/skies/sky912.exr --method max-ign-sppls --train 20",
        BAD_USAGE,
        "max-ign-sppls is fitted on the responses alone; it has no training samples",
    ),
    (
        "fit-matrix SAMPLES/skies/sky912.exr --train 5,5,5,5",
        BAD_DATA,
        "4 training samples do not determine the matrix: only 1 of the 3 signals they need are independent; give more \
         varied ones",
    ),
    (
        "fit-matrix SAMPLES/skies/sky912.exr --plot x.svg",
        BAD_USAGE,
        "--plot draws the trade-off of --noise-weight; give that too",
    ),
    (
        "fit-matrix SAMPLES/skies/sky912.exr --evaluate SAMPLES/skies/sky912.exr --expose-to 1.5",
        BAD_USAGE,
        "`1.5` is no value for --expose-to <FRACTION>: give a fraction above 0 and at most 1; see `fit-matrix --help`",
    ),
    (
        "fit-matrix SAMPLES/skies/sky912.exr --white 0,0,0",
        BAD_USAGE,
        "a white of XYZ 0 0 0 is impossible; all three must be above 0",
    ),
    ("predict-noise --all-samples", BAD_USAGE, "--all-samples is for a library of spectra; name one"),
    (
        "fit-matrix SAMPLES/skies/sky912.exr --train 2000",
        BAD_USAGE,
        "the library has 912 samples to train on, fewer than 2000",
    ),
    (
        "fit-matrix SAMPLES/skies/sky912.exr --train 0,1",
        BAD_DATA,
        "2 training samples do not determine the matrix: only 2 of the 3 signals they need are independent; give more \
         varied ones",
    ),
    ("preview expected.exr", BAD_USAGE, "--output <FILE.png> is missing; see `preview --help`"),
    (
        "preview noisy.exr -o picture.jpg",
        BAD_USAGE,
        "`picture.jpg` is no value for --output <FILE.png>: end the name in .png; see `preview --help`",
    ),
    (
        "correct-frame codes.exr --dark lit.exr",
        BAD_DATA,
        "lit.exr: its scene, `--electrons`, was lit; a dark frame is taken without light, as `render-radiance --dark` renders it",
    ),
    (
        "to-xyz rgb.exr --matrix matrix.yaml --black 5",
        BAD_USAGE,
        "rgb.exr: the black level is 0 by its metadata, which --metadata FILE can replace; leave out --black",
    ),
    (
        "add-noise expected.exr --temperature -20",
        BAD_USAGE,
        "`-20` is no value for --temperature <K>: give a temperature in K, above 0; -20 looks like degrees Celsius, which is \
         253.15 K; see `add-noise --help`",
    ),
    ("preview missing.exr -o picture.png", BAD_DATA, "missing.exr: cannot open: no such file or directory"),
];

#[test]
fn mistakes_are_answered_in_one_line() {
    let shop = Workshop::with_frames();
    let matrix = |unit: &str| {
        format!("schema: cyanometer-matrix/1\nunit: {unit}\nxyz_from_camera: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\n")
    };
    fs::write(shop.path("relative.yaml"), matrix("relative XYZ per (white level - black level)")).unwrap();
    fs::write(shop.path("unit.yaml"), matrix("nits")).unwrap();
    shop.run("to-xyz rgb.exr --matrix relative.yaml -o relative.exr", &[]);
    fs::copy(shop.path("codes.exr"), shop.path("lit.exr")).unwrap();
    fs::write(shop.path("uvspec.csv"), "lambda edir edn uu\n400 1 1 1\n410 1 1 1\n").unwrap();
    fs::write(shop.path("mistyped.csv"), "40O,1e-5\n410,2e-5\n").unwrap();
    fs::write(shop.path("contradictory.csv"), "nm,irradiance (W m-2 sr-1 nm-1)\n400,0.1\n410,0.2\n").unwrap();
    let files = shop.files();
    for (line, status, complaint) in MISTAKES {
        let output = shop.attempt(line, &[]);
        let program = line.split(' ').next().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(said, format!("{program}: {complaint}\n"), "{line}");
        assert_eq!(output.status.code(), Some(status), "{line}");
        assert!(output.stdout.is_empty(), "{line}");
        assert_eq!(shop.files(), files, "{line} leaves something behind");
    }
}

#[test]
fn an_unknown_set_of_instructions_is_a_mistake() {
    let shop = Workshop::with_frames();
    for (name, is_known) in [("avx2", true), ("baseline", true), ("", true), ("sse9", false)] {
        let output = shop.command("mosaic expected.exr").env("CYANOMETER_VECTORS", name).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        let complaint =
            format!("mosaic: CYANOMETER_VECTORS={name} names no instructions; give one of baseline, avx2, avx512\n");
        assert_eq!(said, if is_known { "" } else { &complaint });
        assert_eq!(output.status.code(), Some(if is_known { 0 } else { 2 }));
    }
}

/// What is read is not written over, whatever it is called; devices are written to, not replaced.
#[test]
fn inputs_and_devices_are_not_written_over() {
    let shop = Workshop::with_frames();
    fs::copy(format!("{TREE}/sample_data/skies/sky912.exr"), shop.path("library.exr")).unwrap();
    // Whatever the name, an EXR is read as one.
    fs::copy(shop.path("noisy.exr"), shop.path("noisy.png")).unwrap();
    std::os::unix::fs::symlink(shop.path("expected.exr"), shop.path("link.exr")).unwrap();
    for (line, input) in [
        ("add-noise", "expected.exr"),
        ("mosaic", "noisy.exr"),
        ("measure", "noisy.exr"),
        ("preview", "noisy.png"),
        ("fit-matrix", "library.exr"),
    ] {
        let before = shop.bytes(input);
        for output in [input.to_owned(), format!("./{input}")] {
            let done = shop.attempt(&format!("{line} {input} -o {output}"), &[]);
            assert_eq!(
                String::from_utf8_lossy(&done.stderr),
                format!("{line}: {output}: it is the same file as the input {input}; name another output\n")
            );
            assert_eq!(done.status.code(), Some(BAD_USAGE), "{line}");
            assert!(shop.bytes(input) == before, "{line} has written over its input");
        }
    }
    assert_eq!(shop.attempt("measure expected.exr -o link.exr", &[]).status.code(), Some(BAD_USAGE));
    // A named pipe stands for all devices: replacing it harms nobody.
    let fifo = shop.path("fifo");
    assert!(Command::new("mkfifo").arg(&fifo).status().unwrap().success());
    for line in ["measure noisy.exr -o fifo", "preview noisy.exr -o fifo", "add-noise expected.exr -o fifo"] {
        let listener = std::thread::spawn({
            let fifo = fifo.clone();
            move || fs::read(fifo).unwrap().len()
        });
        let done = shop.attempt(line, &[]);
        let is_kept = std::os::unix::fs::FileTypeExt::is_fifo(&fifo.metadata().unwrap().file_type());
        assert!(done.status.success() && is_kept, "{line} has replaced a named pipe");
        assert!(listener.join().unwrap() > 0, "{line}");
    }
}

/// A run that fails in the middle leaves the output of the run before as it was.
#[test]
fn a_failed_run_keeps_the_old_output() {
    let shop = Workshop::with_frames();
    let (old, old_sidecar) = (shop.bytes("noisy.exr"), shop.bytes("noisy.exr.yaml"));
    let files = shop.files();
    let whole = shop.bytes("expected.exr");
    let output = shop.attempt("add-noise -o noisy.exr", &whole[..whole.len() - 20]);
    assert_eq!(output.status.code(), Some(BAD_DATA));
    assert_eq!(
        String::from_utf8_lossy(&output.stderr),
        "add-noise: standard input: the file ends before its last row; it was cut short\n"
    );
    assert_eq!((shop.bytes("noisy.exr"), shop.bytes("noisy.exr.yaml")), (old, old_sidecar));
    assert_eq!(shop.files(), files);
}
