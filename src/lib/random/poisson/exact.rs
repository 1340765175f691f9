//! The distribution function of the Poisson law and its exact inverse, in double precision.

use super::super::gaussian;

/// Probabilities of at most `count` and of more than `count` at `rate` > 0, each to a relative error of about 10⁻¹⁴
/// where it is the smaller one.
///
/// Below a rate of 200, the series of probabilities outward from `count`, the first by Loader's saddle-point form
/// \[Loader2000]; above, Temme's uniform expansion of the incomplete gamma ratio [Temme1979; DLMF 8.12],
///
/// P(X ≤ k) = Q(a, λ) = ½ erfc(η √(a/2)) + R,   a = k + 1,   ½η² = μ − ln(1 + μ),   μ = (λ − a)/a,
/// R = exp(−½ a η²)/√(2πa) Σ c_j(η) a^−j.
pub fn tails(count: f64, rate: f64) -> (f64, f64) {
    if rate < SERIES_BELOW {
        return by_series(count, rate);
    }
    let a = count + 1.0;
    let half_square = divergence(rate, a);
    let eta = (2.0 * half_square).sqrt().copysign(rate - a);
    let series = |coefficients: &[f64]| coefficients.iter().rev().fold(0.0, |sum, c| sum * eta + c);
    let remainder = libm::exp(-a * half_square) / (std::f64::consts::TAU * a).sqrt()
        * TEMME.iter().rev().fold(0.0, |sum, coefficients| sum / a + series(coefficients));
    let z = eta * (0.5 * a).sqrt();
    (0.5 * libm::erfc(z) + remainder, 0.5 * libm::erfc(-z) - remainder)
}

/// Rates from which on Temme's expansion to a⁻⁶ and η²³ is exact to double precision within ±9.3 σ.
const SERIES_BELOW: f64 = 200.0;

fn by_series(count: f64, rate: f64) -> (f64, f64) {
    let mut sum = 0.0;
    if count + 1.0 <= rate {
        let (mut term, mut k) = (probability(count, rate), count);
        while term > sum * 1e-17 {
            sum += term;
            term *= k / rate;
            k -= 1.0;
        }
        (sum, 1.0 - sum)
    } else {
        let (mut term, mut k) = (probability(count + 1.0, rate), count + 1.0);
        while term > sum * 1e-17 {
            sum += term;
            k += 1.0;
            term *= rate / k;
        }
        (1.0 - sum, sum)
    }
}

/// Probability of `count` at `rate` > 0: exp(−δ(k) − k·(μ − ln(1+μ)))/√(2πk), μ = (λ − k)/k \[Loader2000].
pub fn probability(count: f64, rate: f64) -> f64 {
    if count == 0.0 {
        return libm::exp(-rate);
    }
    libm::exp(-stirling_error(count) - count * divergence(rate, count)) / (std::f64::consts::TAU * count).sqrt()
}

/// μ − ln(1 + μ) for μ = (`rate` − `count`)/`count`, to full relative precision.
fn divergence(rate: f64, count: f64) -> f64 {
    let mu = (rate - count) / count;
    if mu.abs() > 0.5 {
        return mu - libm::log(rate / count);
    }
    // ln(1 + μ) = 2 artanh r, r = μ/(2 + μ), and μ − 2r = r μ, so that no digits are lost.
    let r = mu / (2.0 + mu);
    let square = r * r;
    let odd = ODD_RECIPROCALS.iter().rev().fold(0.0, |sum, reciprocal| sum * square + reciprocal);
    r * (mu - 2.0 * square * odd)
}

/// 1/3, 1/5 …: as many as r = ⅓ needs.
const ODD_RECIPROCALS: [f64; 17] = {
    let mut table = [0.0; 17];
    let mut n = 0;
    while n < table.len() {
        table[n] = 1.0 / (2 * n + 3) as f64;
        n += 1;
    }
    table
};

/// δ(k) = ln k! − ½ ln 2πk − k ln k + k for whole k > 0.
fn stirling_error(count: f64) -> f64 {
    if count < 16.0 {
        let factorial = (1..=15).map(f64::from).take_while(|k| *k <= count).product::<f64>();
        // k! / (√(2πk) (k/e)^k) is near 1; its logarithm is the error.
        let stirling = (std::f64::consts::TAU * count).sqrt() * libm::pow(count / std::f64::consts::E, count);
        return libm::log(factorial / stirling);
    }
    let square = 1.0 / (count * count);
    // 1/12k − 1/360k³ + 1/1260k⁵ − 1/1680k⁷ + 1/1188k⁹
    let series = [1.0 / 12.0, -1.0 / 360.0, 1.0 / 1260.0, -1.0 / 1680.0, 1.0 / 1188.0];
    series.iter().rev().fold(0.0, |sum, c| sum * square + c) / count
}

/// The count of a word at `rate`: the smallest k with P(X ≤ k) > u = (word + ½)/2⁶⁴.
///
/// A rate of 0 gives 0, an infinite one infinity. Above [`LARGEST_RATE`] counts are no longer told apart, and the expansion about the rate stands.
pub fn quantile(rate: f64, word: u64) -> f64 {
    if rate <= 0.0 {
        return 0.0;
    }
    if rate.is_infinite() {
        return rate;
    }
    let (share, is_lower) = gaussian::share(word);
    let guess = super::expansion(rate, gaussian::quantile(word)).floor().max(0.0);
    if rate > LARGEST_RATE {
        return guess;
    }
    let exceeds = |count: f64| {
        let (below, above) = tails(count, rate);
        if is_lower { below > share } else { above <= share }
    };
    let mut count = guess;
    if exceeds(count) {
        while count > 0.0 && exceeds(count - 1.0) {
            count -= 1.0;
        }
    } else {
        count += 1.0;
        while !exceeds(count) {
            count += 1.0;
        }
    }
    count
}

/// Rates up to which each count has its own probability: 2⁴⁰.
pub const LARGEST_RATE: f64 = 1_099_511_627_776.0;

/// Coefficients of c_j(η) by powers of η, j from 0 [DLMF 8.12.9 to 8.12.12], as many as |η| < 0.8 needs.
const TEMME: [&[f64]; 7] = [
    &[
        -0.3333333333333333,
        0.08333333333333333,
        -0.014814814814814815,
        0.0011574074074074073,
        0.0003527336860670194,
        -0.0001787551440329218,
        3.919263178522438e-05,
        -2.185448510679992e-06,
        -1.85406221071516e-06,
        8.296711340953087e-07,
        -1.7665952736826078e-07,
        6.707853543401498e-09,
        1.0261809784240309e-08,
        -4.382036018453353e-09,
        9.14769958223679e-10,
        -2.5514193994946248e-11,
        -5.830772132550426e-11,
        2.4361948020667415e-11,
        -5.0276692801141755e-12,
        1.1004392031956135e-13,
        3.371763262400985e-13,
        -1.392388722418162e-13,
        2.8534893807047445e-14,
        -5.139111834242572e-16,
    ],
    &[
        -0.001851851851851852,
        -0.003472222222222222,
        0.0026455026455026454,
        -0.0009902263374485596,
        0.00020576131687242798,
        -4.018775720164609e-07,
        -1.8098550334489977e-05,
        7.64916091608111e-06,
        -1.6120900894563446e-06,
        4.647127802807434e-09,
        1.378633446915721e-07,
        -5.752545603517705e-08,
        1.1951628599778148e-08,
        -1.7543241719747647e-11,
        -1.0091543710600413e-09,
        4.162792991842583e-10,
        -8.56390702649298e-11,
        6.067215101604758e-14,
        7.1624989648114856e-12,
        -2.933186643771437e-12,
    ],
    &[
        0.004133597883597883,
        -0.0026813271604938273,
        0.0007716049382716049,
        2.0093878600823047e-06,
        -0.0001073665322636516,
        5.2923448829120125e-05,
        -1.2760635188618728e-05,
        3.423578734096138e-08,
        1.3721957309062934e-06,
        -6.298992138380055e-07,
        1.4280614206064242e-07,
        -2.0477098421990866e-10,
        -1.409252991086752e-08,
        6.228974084922022e-09,
        -1.3670488396617114e-09,
        9.428356159014678e-13,
        1.2872252400089318e-10,
    ],
    &[
        0.0006494341563786008,
        0.00022947209362139917,
        -0.0004691894943952557,
        0.00026772063206283885,
        -7.561801671883977e-05,
        -2.396505113867297e-07,
        1.1082654115347302e-05,
        -5.6749528269915965e-06,
        1.4230900732435883e-06,
        -2.7861080291528143e-11,
        -1.6958404091930278e-07,
        8.099464905388083e-08,
        -1.9111168485973655e-08,
        2.3928620439808118e-12,
    ],
    &[
        -0.0008618882909167117,
        0.0007840392217200666,
        -0.0002990724803031902,
        -1.4638452578843418e-06,
        6.641498215465122e-05,
        -3.968365047179435e-05,
        1.1375726970678419e-05,
        2.507497226237533e-10,
        -1.6954149536558305e-06,
        8.907507532205309e-07,
        -2.292934834000805e-07,
    ],
    &[
        -0.00033679855336635813,
        -6.972813758365857e-05,
        0.0002772753244959392,
        -0.00019932570516188847,
        6.797780477937208e-05,
        1.419062920643967e-07,
        -1.3594048189768693e-05,
        8.018470256334202e-06,
    ],
    &[
        0.0005313079364639922,
        -0.0005921664373536939,
        0.0002708782096718045,
        7.902353232660328e-07,
        -8.153969367561969e-05,
    ],
];

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of a rate, a count k, P(X ≤ k) and P(X > k), made with mpmath.
    fn table() -> Vec<[f64; 4]> {
        let table = include_str!("../../../../tests/reference/poisson_tails.csv");
        let rows = table.lines().filter(|line| !line.starts_with('#')).skip(1);
        let row = |row: &str| row.split(',').map(|field| field.parse().unwrap()).collect::<Vec<f64>>();
        rows.map(|line| row(line).try_into().unwrap()).collect()
    }

    /// Against mpmath, at rates from 10⁻⁹ to 10⁸ on both sides of every switch, to 9 standard deviations.
    #[test]
    fn tails_agree_with_an_independent_computation() {
        for row in table() {
            let (below, above) = tails(row[1], row[0]);
            let error = if row[2] < row[3] { below / row[2] - 1.0 } else { above / row[3] - 1.0 };
            // Beyond the reach of 64-bit words relative precision is of no use.
            if row[2].min(row[3]) > 1e-20 {
                // The exponent k D of the leading probability is at most 45; where D is a difference it is above 0.09,
                // known to 10⁻¹⁶, and k is below 500.
                assert!(error.abs() < 5e-14, "{row:?}: {below} {above}");
            }
        }
    }

    /// Words next to those that stand for the table's probabilities: on one side of a boundary between two counts lies the
    /// one, on the other side the other.
    #[test]
    #[expect(clippy::cast_possible_truncation, reason = "shares lie below one half")]
    fn quantiles_step_where_an_independent_computation_has_the_steps() {
        let mut judged = 0;
        for [rate, count, at_most, more_than] in table() {
            let is_lower = at_most < more_than;
            // The boundary in words, from the nearer end of their range; half a word as words stand for their middles.
            let boundary = at_most.min(more_than) * 2.0_f64.powi(64) - 0.5;
            // Tails are good to 5·10⁻¹⁴ (see above), words to one.
            let margin = 1e-13 * boundary + 1.0;
            if boundary < margin {
                continue;
            }
            let words = [boundary - margin, boundary + margin].map(|tail| tail as u64);
            let [below, above] = if is_lower { words } else { [!words[1], !words[0]] };
            let [first, second] = [below, above].map(|word| quantile(rate, word));
            assert!(first <= count && second > count, "{rate} {count}: {first} {second}");
            // Counts have words of their own but at the very ends.
            assert!(boundary < 1e4 || (first, second) == (count, count + 1.0), "{rate} {count}: {first} {second}");
            judged += 1;
        }
        assert!(judged > 200, "{judged}");
    }

    #[test]
    fn counts_rise_with_words_and_with_rates() {
        let words: Vec<u64> = (0..64).flat_map(|bit| [1 << bit, (1 << bit) + 1, !(1_u64 << bit)]).collect();
        for rate in [0.01, 4.0, 9.999, 10.0, 55.0, 199.99, 200.0, 3e4] {
            let mut sorted = words.clone();
            sorted.sort_unstable();
            let counts: Vec<f64> = sorted.iter().map(|&word| quantile(rate, word)).collect();
            assert!(counts.is_sorted());
            for (&word, count) in sorted.iter().zip(counts) {
                assert!(quantile(rate * 1.001, word) >= count);
            }
        }
    }
}
