//! Single and double precision through the chain from electrons to XYZ.

use crate::Study;
use crate::bench::Work;
use crate::page::{Section, digits, percent, time};
use crate::pareto::{self, Choice, Group};
use cyanometer::color::difference::delta_e_76;
use cyanometer::color::{self, D65_XY, lab_from_xyz, xyz_of_chromaticity};
use cyanometer::error::{Error, Result};
use cyanometer::frame::{mirror, to_sample};
use cyanometer::plot::Plot;
use cyanometer::stages::adc::{AdcSettings, Digitize};
use cyanometer::stages::demosaic::Method;
use cyanometer::stream::MemoryFrame;
use cyanometer_studies::camera::EXPOSURE;
use cyanometer_studies::frames::{codes, colors, demosaicked, exposed, mosaicked};
use cyanometer_studies::pages::Table;
use std::hint::black_box;
use std::ops::{Add, Mul, Sub};

/// What the plain chain computes with.
trait Real: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + PartialOrd {
    fn of(value: f64) -> Self;
    fn of_sample(value: f32) -> Self;
    fn round(self) -> Self;
    fn double(self) -> f64;
}

impl Real for f64 {
    fn of(value: f64) -> Self {
        value
    }
    fn of_sample(value: f32) -> Self {
        value.into()
    }
    fn round(self) -> Self {
        self.round()
    }
    fn double(self) -> f64 {
        self
    }
}

impl Real for f32 {
    fn of(value: f64) -> Self {
        to_sample(value)
    }
    fn of_sample(value: f32) -> Self {
        value
    }
    fn round(self) -> Self {
        self.round()
    }
    fn double(self) -> f64 {
        self.into()
    }
}

/// What the plain chain needs to know.
struct Constants {
    bias_adu: f64,
    adu_per_e: f64,
    top: f64,
    black_adu: f64,
    xyz_from_adu: [[f64; 3]; 3],
}

/// Converter, mosaic (RGGB), bilinear interpolation and matrix, pixel by pixel: the plain version, at any precision.
fn plain<T: Real>(electrons: &[f32], [width, height]: [usize; 2], constants: &Constants) -> Vec<[T; 3]> {
    let (bias, slope, top) = (T::of(constants.bias_adu), T::of(constants.adu_per_e), T::of(constants.top));
    let black = T::of(constants.black_adu);
    let matrix = constants.xyz_from_adu.map(|row| row.map(T::of));
    let zero = T::of(0.0);
    let mut plane = Vec::with_capacity(width * height);
    for y in 0..height {
        for x in 0..width {
            let class = (y % 2) + (x % 2);
            let code = (bias + slope * T::of_sample(electrons[(3 * y + class) * width + x])).round();
            let code = if code < zero {
                zero
            } else if code > top {
                top
            } else {
                code
            };
            plane.push(code - black);
        }
    }
    let mut xyz = Vec::with_capacity(width * height);
    let (quarter, half) = (T::of(0.25), T::of(0.5));
    for y in 0..height {
        let rows = [-1, 0, 1].map(|d| width * mirror(y.cast_signed() + d, height));
        for x in 0..width {
            let columns = [-1, 0, 1].map(|d| mirror(x.cast_signed() + d, width));
            let at = |row: usize, column: usize| plane[rows[row] + columns[column]];
            let own = at(1, 1);
            let cross = quarter * ((at(0, 1) + at(2, 1)) + (at(1, 0) + at(1, 2)));
            let corners = quarter * ((at(0, 0) + at(0, 2)) + (at(2, 0) + at(2, 2)));
            let (beside, above) = (half * (at(1, 0) + at(1, 2)), half * (at(0, 1) + at(2, 1)));
            let rgb = match (y % 2, x % 2) {
                (0, 0) => [own, cross, corners],
                (1, 1) => [corners, cross, own],
                (0, _) => [beside, own, above],
                _ => [above, own, beside],
            };
            xyz.push(matrix.map(|row| row[0] * rgb[0] + row[1] * rgb[1] + row[2] * rgb[2]));
        }
    }
    xyz
}

#[allow(clippy::too_many_lines, reason = "a study, told from top to bottom")]
pub fn study(study: &Study) -> Result<Section> {
    let size = if study.quick { [128, 96] } else { [640, 480] };
    let electrons = exposed(&study.sky_with_gradient(size), study.seed(6), study.seed(6))?;
    let digitized = Digitize::new(&electrons.header, &AdcSettings::default())?;
    let head = cyanometer::stream::Stage::header(&digitized);
    let adc = head.metadata.adc.ok_or_else(|| Error::Data("the converter left no record".into()))?;
    let matrix = color::matrix(&study.color.xyz_from_camera) / EXPOSURE.exposure_s_sr();
    let constants = Constants {
        bias_adu: adc.bias_adu,
        adu_per_e: adc.adu_per_e,
        top: f64::from(adc.top_code()),
        black_adu: head.uniform_black_adu()?,
        xyz_from_adu: [0, 1, 2].map(|i| [0, 1, 2].map(|j| matrix[(i, j)])),
    };
    let programs = || -> Result<MemoryFrame> {
        colors(&demosaicked(&codes(&mosaicked(&electrons)?)?, Method::Bilinear)?, &study.color)
    };
    let mut works: Vec<Work<'_>> = vec![
        Box::new(|| {
            black_box(plain::<f64>(black_box(&electrons.samples), size, &constants));
            Ok(())
        }),
        Box::new(|| {
            black_box(plain::<f32>(black_box(&electrons.samples), size, &constants));
            Ok(())
        }),
        Box::new(|| {
            black_box(programs()?);
            Ok(())
        }),
    ];
    let times = study.bench.medians(&mut works)?;
    drop(works);

    let truth = plain::<f64>(&electrons.samples, size, &constants);
    let single: Vec<[f64; 3]> =
        plain::<f32>(&electrons.samples, size, &constants).into_iter().map(|xyz| xyz.map(Real::double)).collect();
    let made = programs()?;
    let width = size[0];
    let staged: Vec<[f64; 3]> = (0..truth.len())
        .map(|i| [0, 1, 2].map(|c| f64::from(made.samples[(3 * (i / width) + c) * width + i % width])))
        .collect();
    let errors = [Errors::of(&truth, &truth), Errors::of(&truth, &single), Errors::of(&truth, &staged)];
    let names = ["plain, double", "plain, single", "the programs' stages"];
    let pixels = truth.len() as f64;
    let groups: Vec<Group> = (0..3)
        .map(|i| Group::new("", vec![Choice::new(names[i], times[i] * 1e9 / pixels, errors[i].largest)]))
        .collect();
    let panel = pareto::panel("", ["CPU time per pixel, ns", "largest ΔE*ab against double precision"], &groups, 1e-7);
    let plot = Plot::new("Precision from electrons to XYZ, BI", panel);
    let mut table = Table::new(&[
        "arithmetic",
        "XYZ: rms of relative errors",
        "largest",
        "pixels off by a code",
        "ΔE\\*ab, mean",
        "ΔE\\*ab, largest",
        "time per pixel",
    ]);
    for (index, name) in names.into_iter().enumerate() {
        let e = &errors[index];
        let shown = |value: f64| if index == 0 { "reference".into() } else { digits(value, 2) };
        table.row(&[
            name.into(),
            shown(e.rms),
            shown(e.relative),
            if index == 0 { "reference".into() } else { format!("{} of {}", e.codes, truth.len()) },
            shown(e.mean),
            shown(e.largest),
            time(times[index] / pixels),
        ]);
    }
    // A code of noise is what the camera itself does not know.
    let code = constants.xyz_from_adu[1][1].abs() / (truth.iter().map(|xyz| xyz[1]).sum::<f64>() / pixels);
    Ok(Section {
        title: "Single and double precision".into(),
        method: format!(
            "One noisy exposure of {}×{} of a sky with a gradient, from electrons to XYZ: converter, mosaic, bilinear \
             interpolation, matrix. The reference is a plain version in double precision, written in the study; beside it \
             the same source in single precision, and the stages of the programs (samples in 32 bits, `mosaic | digitize | demosaic \
             --method bi | to-xyz`). Relative errors are those of X, Y and Z, over the largest of each. Pixels whose ΔE\\*ab is \
             above 0.001 count as off by a code: a level too near a tie was rounded the other way. Double precision \
             stands at the foot of the plot.",
            size[0], size[1]
        ),
        figures: vec![("precision".into(), "Error of colors against time, by arithmetic".into(), plot)],
        tables: vec![(String::new(), table)],
        advice: format!(
            "32-bit samples are enough everywhere: the programs are within ΔE {} of double precision ({} relative), while one \
             code of green is {} of Y; they take {} per pixel, the plain version {} in double and {} in single precision.",
            digits(errors[2].largest, 2),
            digits(errors[2].relative, 2),
            percent(code),
            time(times[2] / pixels),
            time(times[0] / pixels),
            time(times[1] / pixels),
        ),
    })
}

/// How far colors are from the reference.
struct Errors {
    rms: f64,
    relative: f64,
    mean: f64,
    largest: f64,
    codes: usize,
}

impl Errors {
    fn of(truth: &[[f64; 3]], found: &[[f64; 3]]) -> Self {
        let count = truth.len() as f64;
        let top = [0, 1, 2].map(|i| truth.iter().map(|xyz| xyz[i]).fold(0.0, f64::max));
        let white = xyz_of_chromaticity(D65_XY, top[1]);
        let (mut squares, mut relative, mut sum, mut largest, mut codes) = (0.0, 0.0_f64, 0.0, 0.0_f64, 0);
        for (truth, found) in truth.iter().zip(found) {
            for i in 0..3 {
                let error = (found[i] - truth[i]) / top[i];
                squares += error * error / 3.0;
                relative = relative.max(error.abs());
            }
            let delta = delta_e_76(lab_from_xyz(*truth, white), lab_from_xyz(*found, white));
            sum += delta;
            largest = largest.max(delta);
            codes += usize::from(delta > 1e-3);
        }
        Self { rms: (squares / count).sqrt(), relative, mean: sum / count, largest, codes }
    }
}
