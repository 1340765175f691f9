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

/// Σ a⁴.
#[inline(always)]
pub fn fourth_powers(values: &[f64]) -> f64 {
    let (whole, rest) = values.as_chunks::<LANES>();
    let mut lanes = [0.0; LANES];
    for values in whole {
        let square = each(values, values, |a, b| a * b);
        lanes = each(&lanes, &each(&square, &square, |a, b| a * b), |sum, fourth| sum + fourth);
    }
    total(&lanes) + rest.iter().map(|value| (value * value).powi(2)).sum::<f64>()
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
    let [mut of_samples, mut of_products, mut of_squares] = [[0.0; LANES]; 3];
    let columns = of_columns.iter_mut().zip(squares);
    for (((samples, means), above), (of_columns, squares)) in samples.iter_mut().zip(means).zip(above).zip(columns) {
        // One step of all lanes after another, or compilers make short vectors of several steps.
        let a = each(samples, means, |sample, mean| sample - mean);
        let square = each(&a, &a, |a, b| a * b);
        *of_columns = each(of_columns, &a, |sum, a| sum + a);
        *squares = each(squares, &square, |sum, square| sum + square);
        of_samples = each(&of_samples, &a, |sum, a| sum + a);
        of_products = each(&of_products, &each(&a, above, |a, above| a * above), |sum, product| sum + product);
        of_squares = each(&of_squares, &square, |sum, square| sum + square);
        *samples = a;
    }
    let mut totals = [of_samples, of_products, of_squares].map(|lanes| total(&lanes));
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

/// Makes means of sums, which are multiplied by a share, and takes a center off, which is added to what columns have; gives Σ b and Σ b² of what
/// is left.
#[inline(always)]
pub fn center(means: &mut [f64], above: &mut [f64], of_columns: &mut [f64], [share, center]: [f64; 2]) -> [f64; 2] {
    let (means, rest) = means.as_chunks_mut::<LANES>();
    let (above, rest_above) = above.as_chunks_mut::<LANES>();
    let (of_columns, rest_of_columns) = of_columns.as_chunks_mut::<LANES>();
    let [mut sums, mut squares] = [[0.0; LANES]; 2];
    for ((means, above), of_columns) in means.iter_mut().zip(above).zip(of_columns) {
        *means = each(means, &[share; LANES], |mean, share| mean * share);
        let b = each(means, &[center; LANES], |mean, center| mean - center);
        *of_columns = each(of_columns, &b, |sum, b| sum + b);
        sums = each(&sums, &b, |sum, b| sum + b);
        squares = each(&squares, &each(&b, &b, |a, b| a * b), |sum, square| sum + square);
        *above = b;
    }
    for ((mean, above), of_column) in rest.iter_mut().zip(&mut *rest_above).zip(rest_of_columns) {
        *mean *= share;
        *above = *mean - center;
        *of_column += *above;
    }
    let of_rest = [rest_above.iter().sum::<f64>(), rest_above.iter().map(|b| b * b).sum()];
    let [sum, square] = [sums, squares].map(|lanes| total(&lanes));
    [sum + of_rest[0], square + of_rest[1]]
}

/// Σ d², Σ d⁴ and Σ d⁸ of the differences of neighbors.
#[inline(always)]
pub fn steps(values: &[f64]) -> [f64; 3] {
    let next = &values[1..];
    let (whole, rest) = values[..next.len()].as_chunks::<LANES>();
    let (whole_next, rest_next) = next.as_chunks::<LANES>();
    let [mut squares, mut fourths, mut eighths] = [[0.0; LANES]; 3];
    for (values, next) in whole.iter().zip(whole_next) {
        let d = each(next, values, |next, value| next - value);
        let square = each(&d, &d, |a, b| a * b);
        squares = each(&squares, &square, |sum, square| sum + square);
        let fourth = each(&square, &square, |a, b| a * b);
        fourths = each(&fourths, &fourth, |sum, fourth| sum + fourth);
        eighths = each(&eighths, &each(&fourth, &fourth, |a, b| a * b), |sum, eighth| sum + eighth);
    }
    let mut totals = [squares, fourths, eighths].map(|lanes| total(&lanes));
    for (value, next) in rest.iter().zip(rest_next) {
        let square = (next - value) * (next - value);
        let powers = [square, square.powi(2), square.powi(4)];
        totals.iter_mut().zip(powers).for_each(|(sum, power)| *sum += power);
    }
    totals
}

/// The sum of lanes. Apart from the loop before it, or compilers make vectors across the sums and none of their lanes.
#[inline(never)]
fn total(lanes: &[f64; LANES]) -> f64 {
    lanes.iter().sum()
}

/// What is made of each two lanes.
#[inline(always)]
fn each(a: &[f64; LANES], b: &[f64; LANES], of: impl Fn(f64, f64) -> f64) -> [f64; LANES] {
    let mut made = [0.0; LANES];
    for ((made, a), b) in made.iter_mut().zip(a).zip(b) {
        *made = of(*a, *b);
    }
    made
}
