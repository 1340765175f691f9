//! Charge transfer: what packets leave behind on their way to the output, and its undoing.
//!
//! A packet in row i of its column is moved i + 1 times, and one in column j of the serial register j + 1 times. Each
//! move leaves the share ε = 1 − cte of a packet behind, where the packet that follows takes it up
//! [HP2005, Sec. 3.3]. With n the charges along one line, from the output on,
//!
//! n′ᵢ = Σ_d C(i, d) (1 − ε)^(i−d+1) ε^d n_(i−d)
//!
//! nᵢ = (1 − ε)^−(i+1) Σ_d C(i, d) (−ε)^d n′_(i−d)
//!
//! where d counts the moves that a share of the charge has missed. The two are exact inverses of each other. The first
//! line's coefficients sum to 1 − ε at every i, those of the second to 1/(1 − ε): uniform light stays uniform.

use crate::error::{Error, Result};
use crate::frame::Geometry;
use std::borrow::Borrow;

/// Coefficients are left out where all that are left out come to less than this at any photosite: the error of a sum is
/// below this share of the largest sample around.
const NEGLIGIBLE: f64 = 1e-10;

/// The largest number of missed moves that is worked out.
const MOST_MISSED: usize = 64;

/// The factor by which undoing a direction may magnify errors.
const LARGEST_GAIN: f64 = 1000.0;

/// The transfer of every photosite's charge along its column and then along the serial register, or its undoing.
#[derive(Debug, Clone, PartialEq)]
pub struct Transfer {
    down: Line,
    height: usize,
    /// Coefficients by missed moves, then by column.
    across: Vec<Vec<f64>>,
}

/// One direction: charges that follow each other to the output.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Line {
    /// Share of a packet that a move takes along.
    cte: f64,
    undone: bool,
    /// Missed moves beyond which coefficients are left out.
    most_missed: usize,
}

impl Line {
    /// A line of `length` photosites.
    fn new(cte: f64, undone: bool, length: usize) -> Result<Self> {
        if !(cte > 0.0 && cte <= 1.0) {
            return Err(Error::Usage(format!(
                "a charge transfer efficiency of {cte} is impossible; give a fraction above 0 and at most 1"
            )));
        }
        let last = length.saturating_sub(1);
        let too_poor = |why: String| {
            let verb = if undone { "undone" } else { "followed" };
            Err(Error::Usage(format!(
                "a charge transfer efficiency of {cte} is too poor to be {verb} over {length} moves; {why}"
            )))
        };
        let too_wide = || too_poor(format!("charge would spread over more than {MOST_MISSED} photosites"));
        let line = Self { cte, undone, most_missed: last };
        let mut sizes = Vec::new();
        for coefficient in line.coefficients(last) {
            sizes.push(coefficient.abs());
            // Beyond the largest they fall off faster than in half, and the rest is less than the last one.
            let falls = sizes.len() > 1 && 2.0 * sizes[sizes.len() - 1] <= sizes[sizes.len() - 2];
            if !coefficient.is_finite() || (falls && coefficient.abs() < NEGLIGIBLE * f64::EPSILON) {
                break;
            }
        }
        // Where even the first coefficient is too small for a double, the sum does not tell.
        if sizes[0] < f64::MIN_POSITIVE {
            return too_wide();
        }
        let gain: f64 = sizes.iter().sum();
        if undone && (gain.is_nan() || gain > LARGEST_GAIN) {
            return too_poor(format!("errors would grow more than {LARGEST_GAIN} times"));
        }
        let mut most_missed = sizes.len();
        let mut left_out = 0.0;
        while most_missed > 0 && left_out + sizes[most_missed - 1] < NEGLIGIBLE {
            most_missed -= 1;
            left_out += sizes[most_missed];
        }
        let most_missed = most_missed.saturating_sub(1);
        if most_missed > MOST_MISSED { too_wide() } else { Ok(Self { most_missed, ..line }) }
    }

    /// The coefficients of photosite `index`, by the number of missed moves.
    fn coefficients(self, index: usize) -> impl Iterator<Item = f64> {
        // 1 − cte is exact from ½ up.
        let missed = 1.0 - self.cte;
        let moves = index as f64 + 1.0;
        let (first, ratio) =
            if self.undone { (self.cte.powf(-moves), -missed) } else { (self.cte.powf(moves), missed / self.cte) };
        // C(i, d + 1) = C(i, d) (i − d)/(d + 1)
        (0..=self.most_missed.min(index)).scan(first, move |next, d| {
            let coefficient = *next;
            *next *= ratio * (index - d) as f64 / (d as f64 + 1.0);
            Some(coefficient)
        })
    }
}

impl Transfer {
    /// The transfer of a frame at the sensor's corner; `cte` is the share of a packet that a move takes along.
    ///
    /// # Errors
    ///
    /// [`Error::Usage`] for an efficiency that is none, or so poor that charge spreads over more than 64 photosites.
    pub fn new(cte: f64, geometry: &Geometry) -> Result<Self> {
        Self::either_way(cte, geometry, false)
    }

    /// The undoing of [`Self::new`].
    ///
    /// # Errors
    ///
    /// As of [`Self::new`]; also where errors would grow more than 1000 times in one direction.
    pub fn undoing(cte: f64, geometry: &Geometry) -> Result<Self> {
        Self::either_way(cte, geometry, true)
    }

    fn either_way(cte: f64, geometry: &Geometry, undone: bool) -> Result<Self> {
        let down = Line::new(cte, undone, geometry.height)?;
        let along = Line::new(cte, undone, geometry.width)?;
        let mut across = vec![vec![0.0; geometry.width]; along.most_missed + 1];
        for x in 0..geometry.width {
            for (coefficients, coefficient) in across.iter_mut().zip(along.coefficients(x)) {
                coefficients[x] = coefficient;
            }
        }
        Ok(Self { down, height: geometry.height, across })
    }

    /// Rows above that a row depends on.
    pub fn reach(&self) -> usize {
        self.down.most_missed
    }

    /// The passage of some rows of one plane.
    pub fn passage(&self) -> Passage<&Self> {
        Passage::of(self)
    }
}

impl Transfer {
    /// What is left of the variance of independent charges, on average over the frame: the mean over rows, and over
    /// columns, of the sum of squared coefficients.
    pub fn mean_square_share(&self) -> f64 {
        let (height, width) = (self.height, self.across[0].len());
        let square = |coefficients: f64| coefficients * coefficients;
        let down: f64 = (0..height).flat_map(|y| self.down.coefficients(y)).map(square).sum();
        let along: f64 = self.across.iter().flatten().copied().map(square).sum();
        down / height as f64 * along / width as f64
    }
}

/// What transfer leaves of uniform light: the coefficients sum to 1 − ε in each direction.
pub fn uniform_share(cte: f64) -> f64 {
    cte * cte
}

/// Rows on their way: each is put in from the top on, [`Transfer::reach`] rows before the first that is taken out.
#[derive(Debug)]
pub struct Passage<T> {
    transfer: T,
    /// The last rows that were put in, by their number modulo the reach plus one.
    rows: Vec<Vec<f64>>,
    column_sums: Vec<f64>,
    moved: Vec<f64>,
}

impl<T: Borrow<Transfer>> Passage<T> {
    /// The passage of some rows of one plane by `transfer`.
    pub fn of(transfer: T) -> Self {
        let (width, reach) = (transfer.borrow().across[0].len(), transfer.borrow().reach());
        let row = || vec![0.0; width];
        Self { transfer, rows: vec![row(); reach + 1], column_sums: row(), moved: row() }
    }

    /// Room for the charges of the frame's row `y`.
    pub fn entering(&mut self, y: usize) -> &mut [f64] {
        let index = y % self.rows.len();
        &mut self.rows[index]
    }

    /// What comes out of the row `y` that was put in last.
    pub fn leaving(&mut self, y: usize) -> &[f64] {
        let Self { transfer, rows, column_sums, moved } = self;
        let transfer: &Transfer = (*transfer).borrow();
        column_sums.fill(0.0);
        for (missed, coefficient) in transfer.down.coefficients(y).enumerate() {
            let above = &rows[(y - missed) % rows.len()];
            for (sum, charge) in column_sums.iter_mut().zip(above) {
                *sum += coefficient * charge;
            }
        }
        moved.fill(0.0);
        for (missed, coefficients) in transfer.across.iter().enumerate() {
            let here = moved.iter_mut().zip(coefficients).skip(missed);
            for ((sum, coefficient), before) in here.zip(&*column_sums) {
                *sum += coefficient * before;
            }
        }
        moved
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Packets of one line, moved one by one: of each a share stays behind, and joins the packet that comes next.
    fn cascade(cte: f64, packets: &[f64]) -> Vec<f64> {
        let mut sites = packets.to_vec();
        let mut read = Vec::new();
        for _ in packets {
            read.push(cte * sites[0]);
            for i in 0..sites.len() {
                let coming = sites.get(i + 1).map_or(0.0, |next| cte * next);
                sites[i] = (1.0 - cte) * sites[i] + coming;
            }
        }
        read
    }

    fn frame(width: usize, height: usize) -> Vec<Vec<f64>> {
        (0..height).map(|y| (0..width).map(|x| ((x * 37 + y * 101 + x * y * 7) % 1009) as f64).collect()).collect()
    }

    fn through(transfer: &Transfer, rows: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let mut passage = transfer.passage();
        let pass = |(y, row): (usize, &Vec<f64>)| {
            passage.entering(y).copy_from_slice(row);
            passage.leaving(y).to_vec()
        };
        rows.iter().enumerate().map(pass).collect()
    }

    /// Largest difference of two frames.
    fn distance(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
        a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn the_sums_are_what_packets_do() {
        for (cte, width, height) in [(0.99999, 90, 70), (0.999, 80, 91), (0.97, 40, 37), (0.5, 9, 7), (1.0, 5, 4)] {
            let rows = frame(width, height);
            // Down the columns, then along the register.
            let mut moved = vec![vec![0.0; width]; height];
            for x in 0..width {
                let column: Vec<f64> = rows.iter().map(|row| row[x]).collect();
                for (y, charge) in cascade(cte, &column).into_iter().enumerate() {
                    moved[y][x] = charge;
                }
            }
            let moved: Vec<Vec<f64>> = moved.iter().map(|row| cascade(cte, row)).collect();
            let found = through(&Transfer::new(cte, &Geometry::new(width, height, &["Y"])).unwrap(), &rows);
            // Twice what is left out of samples up to 1008, and the rounding of a hundred moves in each direction.
            let bound = 1008.0 * (2.0 * NEGLIGIBLE + 200.0 * f64::EPSILON);
            assert!(distance(&moved, &found) < bound, "{cte}: {}", distance(&moved, &found));
        }
    }

    #[test]
    fn undoing_restores_what_was() {
        for (cte, width, height) in [(0.99999, 2654, 40), (0.9999, 300, 1996), (0.98, 60, 50), (1.0, 8, 9)] {
            let geometry = Geometry::new(width, height, &["Y"]);
            let rows = frame(width, height);
            let moved = through(&Transfer::new(cte, &geometry).unwrap(), &rows);
            let back = through(&Transfer::undoing(cte, &geometry).unwrap(), &moved);
            // Undoing magnifies errors by the sum of its coefficients' sizes, (1 + ε)^i / (1 − ε)^(i + 1).
            let gain = |length: usize| (2.0 - cte).powf(length as f64 - 1.0) * cte.powf(-(length as f64));
            let gain = gain(width) * gain(height);
            // Of samples up to 1008 four sums leave something out; powers of many moves are good to an ulp of each
            // exponent.
            let rounding = 8.0 * (width + height) as f64 * f64::EPSILON;
            let bound = 1008.0 * gain * (4.0 * NEGLIGIBLE + rounding);
            assert!(distance(&rows, &back) < bound, "{cte}: {} {bound}", distance(&rows, &back));
        }
    }

    #[test]
    fn uniform_light_stays_uniform() {
        let geometry = Geometry::new(2654, 1996, &["Y"]);
        for cte in [0.992, 0.9999, 0.99999, 1.0] {
            for undone in [false, true] {
                let Ok(line) = Line::new(cte, undone, geometry.width) else {
                    assert!(undone && cte == 0.992, "{cte}");
                    continue;
                };
                let share = if undone { 1.0 / cte } else { cte };
                for index in [0, 1, 7, 1000, 2653] {
                    let sum: f64 = line.coefficients(index).sum();
                    // What is left out, and the power of so many moves, an ulp of its exponent.
                    assert!((sum - share).abs() < NEGLIGIBLE + 1e4 * f64::EPSILON, "{cte} {index}: {sum}");
                }
            }
        }
        assert_eq!(Transfer::new(1.0, &geometry).unwrap().reach(), 0);
        let usual = Transfer::new(0.99999, &geometry).unwrap();
        assert_eq!((usual.reach(), usual.across.len()), (4, 6));
    }

    #[test]
    fn impossible_efficiencies_are_refused() {
        let refused = |cte, width, height, undone| {
            let found = Transfer::either_way(cte, &Geometry::new(width, height, &["Y"]), undone);
            matches!(found, Err(Error::Usage(_)))
        };
        for undone in [false, true] {
            for cte in [0.0, -0.1, 1.0 + 1e-9, f64::NAN, f64::INFINITY] {
                assert!(refused(cte, 8, 6, undone), "{cte}");
            }
            // All of a packet would have to be summed, or none comes through.
            assert!(refused(0.9, 2654, 4, undone) && refused(0.9, 4, 1996, undone));
            assert!(refused(0.5, 30_000, 1, undone) && refused(1e-300, 2000, 1, undone));
            assert!(!refused(0.9999, 2654, 1996, undone));
        }
        // Charge of 24 lost moves spreads over fewer than 64; undoing it would magnify errors e^48 times.
        assert!(!refused(0.991, 2654, 1996, false) && refused(0.991, 2654, 1996, true));
        assert!(!refused(0.01, 8, 6, false) && refused(0.01, 8, 6, true));
    }
}
