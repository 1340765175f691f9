//! Sums over rows of samples in lanes, which compilers make vectors of.

/// Sums run in so many lanes, whatever the instructions.
const LANES: usize = 8;

/// Σ a.
#[inline(always)]
pub fn sum(values: &[f64]) -> f64 {
    let (whole, rest) = values.as_chunks::<LANES>();
    let mut lanes = [0.0; LANES];
    for values in whole {
        for (lane, value) in lanes.iter_mut().zip(values) {
            *lane += value;
        }
    }
    lanes.iter().sum::<f64>() + rest.iter().sum::<f64>()
}

/// Σ a b.
#[inline(always)]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((whole_a, rest_a), (whole_b, rest_b)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
    let mut lanes = [0.0; LANES];
    for (a, b) in whole_a.iter().zip(whole_b) {
        for ((lane, a), b) in lanes.iter_mut().zip(a).zip(b) {
            *lane += a * b;
        }
    }
    lanes.iter().sum::<f64>() + rest_a.iter().zip(rest_b).map(|(a, b)| a * b).sum::<f64>()
}

/// Takes from samples of a frame their means, adds what is left, and its square, to those of their columns; gives Σ a, Σ a (ȳ − c)
/// and Σ a².
#[inline(always)]
pub fn depart(samples: &mut [f64], means: &[f64], above: &[f64], [of_columns, squares]: [&mut [f64]; 2]) -> [f64; 3] {
    let (samples, rest) = samples.as_chunks_mut::<LANES>();
    let (means, rest_means) = means.as_chunks::<LANES>();
    let (above, rest_above) = above.as_chunks::<LANES>();
    let (of_columns, rest_of_columns) = of_columns.as_chunks_mut::<LANES>();
    let (squares, rest_squares) = squares.as_chunks_mut::<LANES>();
    let mut sums = [[0.0; LANES]; 3];
    let columns = of_columns.iter_mut().zip(squares);
    for (((samples, means), above), (of_columns, squares)) in samples.iter_mut().zip(means).zip(above).zip(columns) {
        // Loaded whole, and stored whole, so that the lanes become a vector.
        let (mut a, mut of_column, mut square) = (*samples, *of_columns, *squares);
        for lane in 0..LANES {
            a[lane] -= means[lane];
            of_column[lane] += a[lane];
            square[lane] += a[lane] * a[lane];
            sums[0][lane] += a[lane];
            sums[1][lane] += a[lane] * above[lane];
            sums[2][lane] += a[lane] * a[lane];
        }
        (*samples, *of_columns, *squares) = (a, of_column, square);
    }
    let mut totals = sums.map(|lanes| lanes.iter().sum::<f64>());
    for (index, sample) in rest.iter_mut().enumerate() {
        *sample -= rest_means[index];
        let a = *sample;
        rest_of_columns[index] += a;
        rest_squares[index] += a * a;
        totals[0] += a;
        totals[1] += a * rest_above[index];
        totals[2] += a * a;
    }
    totals
}
