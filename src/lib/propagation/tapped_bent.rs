//! What lines add to how sample covariances of pixels scatter, whose photosites follow what a line has on a curve ([`super::bent_lines`]).
//!
//! Of pixels o_a = m + Σ_s W_a(s) y_s with the distances d of their means from that of all, the form Σ o_i o_j − n ō_i ō_j has, of a line,
//! U = Σ_s Q_ij(s), V = Σ_a ℓ_a,i ℓ_a,jᵀ − T_i T_jᵀ/n and w = Σ_a d_i ℓ_a,j + d_j ℓ_a,i, where ℓ_a is what pixel a has of the photosites of the
//! line by their places, T = Σ_a ℓ_a, and Q as in [`super::tapped_sampling`].

use super::bent_lines::{BentLine, BeyondNormal, LineForm};
use super::covariance::PAIRS;
use super::tapped::TappedPixels;
use crate::stages::demosaic::stencil::REACH;

/// What the channels have of photosites of a line, by place.
type Loads = Vec<[f64; 3]>;

impl TappedPixels {
    /// What all lines add.
    pub(super) fn beyond_normal(&self) -> BeyondNormal {
        let mut found = BeyondNormal::default();
        let reach = self.array.weights.reach().unsigned_abs();
        for (axis, bent) in self.array.bent.iter().enumerate() {
            let Some(bent) = bent else { continue };
            // Pixels that reach a line, and what these are made of.
            let (_, _, lines) = self.array.axes[1 - axis].kinds_around(reach, 4 * reach);
            for (line, times) in lines {
                bent.add(&self.forms(bent, axis, line), times, &mut found);
            }
        }
        found
    }

    /// The forms of a line, by pairs of channels.
    fn forms(&self, bent: &BentLine, axis: usize, line: usize) -> [LineForm; 6] {
        let mut forms = [(); 6].map(|()| LineForm::zero(bent.places()));
        let mut totals: Loads = vec![[0.0; 3]; bent.places()];
        let count = self.count();
        for (loads, off, times) in self.loads_of_line(axis, line, bent.places()) {
            add_products(&mut forms, &loads, times);
            for (place, load) in loads.iter().enumerate().filter(|(_, load)| **load != [0.0; 3]) {
                (0..3).for_each(|i| totals[place][i] += times * load[i]);
                for (form, [i, j]) in forms.iter_mut().zip(PAIRS) {
                    form.add_linear(place, times * (off[i] * load[j] + off[j] * load[i]));
                }
            }
        }
        add_products(&mut forms, &totals, -1.0 / count);
        let along = &self.array.axes[axis];
        let reach = self.array.weights.reach().unsigned_abs();
        for (at, times) in along.kinds_around(reach, 3 * reach).2 {
            let at = if axis == 0 { [at, line] } else { [line, at] };
            let place = self.array.place(at);
            for (form, square) in forms.iter_mut().zip(self.squares_of_site(at).0) {
                form.add_square(place, times * square);
            }
        }
        forms
    }

    /// What the pixels of the rectangle within reach of a line have of its photosites, how far their means are off, and how many there are.
    fn loads_of_line(
        &self,
        axis: usize,
        line: usize,
        places: usize,
    ) -> impl Iterator<Item = (Loads, [f64; 3], f64)> + '_ {
        let [along, across] = [&self.array.axes[axis], &self.array.axes[1 - axis]];
        let reach = self.array.weights.reach().unsigned_abs();
        let near = line.saturating_sub(reach).max(across.lines.start)..(line + reach + 1).min(across.lines.end);
        near.flat_map(move |t| {
            along.examples.iter().map(move |(p, count)| {
                let kind = self.kind(if axis == 0 { [*p, t] } else { [t, *p] });
                let offset = line.cast_signed() - t.cast_signed();
                let mut loads = vec![[0.0; 3]; places];
                for site in kind.sites.iter().filter(|site| site.offset[1 - axis] == offset) {
                    let load = &mut loads[self.array.moments.place(site.tap, site.class)];
                    load.iter_mut().zip(site.weights).for_each(|(load, weight)| *load += weight);
                }
                (loads, self.off(kind), *count)
            })
        })
    }

    /// Q of a photosite, by pairs of channels, and what the distances of pixels make of it.
    pub(super) fn squares_of_site(&self, at: [usize; 2]) -> ([f64; 6], [f64; 6]) {
        let (mut squares, mut sums, mut moved) = ([0.0; 6], [0.0; 3], [0.0; 6]);
        for (pixel, [x, y]) in self.near(at, REACH) {
            let w = pixel.weights([-x, -y]);
            if w == [0.0; 3] {
                continue;
            }
            let off = self.off(pixel);
            for (pair, [i, j]) in PAIRS.into_iter().enumerate() {
                squares[pair] += w[i] * w[j];
                moved[pair] += off[i] * w[j] + off[j] * w[i];
            }
            sums.iter_mut().zip(w).for_each(|(sum, w)| *sum += w);
        }
        for (square, [i, j]) in squares.iter_mut().zip(PAIRS) {
            *square -= sums[i] * sums[j] / self.count();
        }
        (squares, moved)
    }
}

/// Adds so much of the products of what the channels have of photosites of a line.
fn add_products(forms: &mut [LineForm; 6], loads: &Loads, times: f64) {
    for (one, mine) in loads.iter().enumerate().filter(|(_, load)| **load != [0.0; 3]) {
        for (other, theirs) in loads.iter().enumerate().filter(|(_, load)| **load != [0.0; 3]) {
            for (form, [i, j]) in forms.iter_mut().zip(PAIRS) {
                form.add_product([one, other], times * mine[i] * theirs[j]);
            }
        }
    }
}
