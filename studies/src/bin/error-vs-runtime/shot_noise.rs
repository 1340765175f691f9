//! Exact Poisson numbers, normal ones in their place, none.

use crate::Study;
use crate::bench::Work;
use crate::page::{Section, digits, percent, time};
use cyanometer::error::Result;
use cyanometer::frame::to_sample;
use cyanometer::metadata::{FrameHeader, PoissonKind, Scene};
use cyanometer::numerics::normal::cumulative;
use cyanometer::numerics::significance::of_chi_square;
use cyanometer::plot::{Axis, Color, Marks, Panel, Plot};
use cyanometer::random::{Source, poisson::tails};
use cyanometer::stages::noise::{AddNoise, NoiseSettings};
use cyanometer::stream::MemoryFrame;
use cyanometer_studies::frames::mosaicked;
use cyanometer_studies::pages::{Table, number};
use std::hint::black_box;

const RATES: [f64; 6] = [0.5, 5.0, 50.0, 500.0, 5000.0, 30_000.0];
const KINDS: [&str; 4] = ["exact", "exact, uniform scene", "Gaussian", "none"];
/// What exact draws may be off by in all, at the highest rate: each step of the distribution function is known to 5·10⁻¹⁴ of
/// the nearer tail (docs/model.md).
const FOOT: f64 = 1e-11;

/// A law of whole numbers: probabilities from `first` on.
struct Law {
    first: i64,
    shares: Vec<f64>,
}

impl Law {
    /// The law of Poisson, to 12 standard deviations.
    fn poisson(rate: f64) -> Self {
        let reach = 12.0 * rate.sqrt() + 30.0;
        let (first, last) = (whole((rate - reach).max(0.0)), whole(rate + reach));
        // From the nearer end, so that nothing cancels.
        let share = |k: i64| {
            let (below, above) = tails(k as f64, rate);
            let before = if k > 0 { tails(k as f64 - 1.0, rate) } else { (0.0, 1.0) };
            if below < 0.5 { below - before.0 } else { before.1 - above }
        };
        Self { first, shares: (first..=last).map(share).collect() }
    }

    /// That of a normal number of mean and variance `rate`, rounded to whole electrons.
    fn gaussian(rate: f64) -> Self {
        let reach = 12.0 * rate.sqrt() + 30.0;
        let (first, last) = (whole(rate - reach), whole(rate + reach));
        let z = |edge: f64| (edge - rate) / rate.sqrt();
        let share = |k: i64| {
            let (low, high) = (z(k as f64 - 0.5), z(k as f64 + 0.5));
            if low > 0.0 { cumulative(-low) - cumulative(-high) } else { cumulative(high) - cumulative(low) }
        };
        Self { first, shares: (first..=last).map(share).collect() }
    }

    /// That of the rate itself.
    fn none(rate: f64) -> Self {
        Self { first: whole(rate.round()), shares: vec![1.0] }
    }

    fn at(&self, k: i64) -> f64 {
        usize::try_from(k - self.first).ok().and_then(|i| self.shares.get(i)).copied().unwrap_or(0.0)
    }

    fn counts(&self) -> impl Iterator<Item = (i64, f64)> {
        self.shares.iter().enumerate().map(|(i, p)| (self.first + i as i64, *p))
    }

    /// ½ Σ |p − q|.
    fn distance(&self, other: &Self) -> f64 {
        let first = self.first.min(other.first);
        let end = (self.first + self.shares.len() as i64).max(other.first + other.shares.len() as i64);
        0.5 * (first..end).map(|k| (self.at(k) - other.at(k)).abs()).sum::<f64>()
    }
}

#[expect(clippy::cast_possible_truncation, reason = "counts of electrons")]
fn whole(value: f64) -> i64 {
    value.floor() as i64
}

/// A kind of number at a rate.
struct Case {
    rate: f64,
    kind: usize,
    /// Total variation distance to the law of Poisson.
    distance: f64,
    time: f64,
    /// Simulated: mean, standard deviation, skewness, P(X = 0).
    mean: f64,
    std: f64,
    skewness: f64,
    zero: f64,
    /// Significance of χ² of the counts against the law of Poisson.
    significance: f64,
}

/// Error and time of each kind of number against the rate.
fn figure(cases: &[Case]) -> Plot {
    let rate = || Axis::log10("rate, e⁻");
    let mut error = Panel::new(rate(), Axis::log10("distance of the law to Poisson"));
    let mut time = Panel::new(rate(), Axis::linear("CPU time per photosite, ns"));
    for (kind, name) in KINDS.into_iter().enumerate() {
        let line = |of: &dyn Fn(&Case) -> f64| -> Vec<[f64; 2]> {
            cases.iter().filter(|case| case.kind == kind).map(|case| [case.rate, of(case)]).collect()
        };
        let color = Color::of_index(kind);
        // Of exact numbers, which share their foot, the second are drawn as points alone.
        let errors = line(&|case| case.distance.max(FOOT));
        error.add(name, color, if kind == 1 { Marks::Points(errors) } else { Marks::LineAndPoints(errors) });
        time.add(name, color, Marks::LineAndPoints(line(&|case| case.time * 1e9)));
    }
    error.name([RATES[0], FOOT], "exact: less than 10⁻¹¹", Color::Blue);
    let highest = cases.iter().map(|case| 1.1e9 * case.time).fold(1.0, f64::max);
    time.y = time.y.range(0.0, highest);
    let mut plot = Plot::new("Shot noise: exact, Gaussian, none", error);
    plot.panels.push(time);
    plot
}

pub fn study(study: &Study) -> Result<Section> {
    let size = if study.quick { [512, 256] } else { [1024, 1024] };
    let mut cases = Vec::new();
    for rate in RATES {
        let seed = study.seed(2) + cases.len() as u64;
        cases.extend(at_rate(study, rate, size, seed)?);
    }
    let plot = figure(&cases);

    let mut table = Table::new(&[
        "rate, e⁻",
        "numbers",
        "distance of the law",
        "error of the mean, in σ",
        "of σ",
        "skewness (exact)",
        "P(X = 0) (exact)",
        "χ² against Poisson: significance",
        "time per photosite",
    ]);
    for case in &cases {
        let exact_zero = (-case.rate).exp();
        table.row(&[
            digits(case.rate, 1),
            KINDS[case.kind].into(),
            if case.kind < 2 { "< 10⁻¹¹".into() } else { digits(case.distance, 2) },
            signed_percent((case.mean - case.rate) / case.rate.sqrt()),
            signed_percent(case.std / case.rate.sqrt() - 1.0),
            format!("{} ({})", number(case.skewness, 3), number(case.rate.sqrt().recip(), 3)),
            format!(
                "{} ({})",
                digits(case.zero, 3),
                if exact_zero < 1e-6 { "0".into() } else { digits(exact_zero, 3) }
            ),
            if case.significance < 1e-4 { "< 10⁻⁴".into() } else { digits(case.significance, 2) },
            time(case.time),
        ]);
    }
    let photosites = size[0] * size[1];
    Ok(Section {
        title: "Exact Poisson numbers, Gaussian ones, none".into(),
        method: format!(
            "`add-noise --poisson exact|gaussian` and `--without ssn`, signal shot noise alone, {photosites} photosites. The \
             distance of a law to that of Poisson, ½ Σ |p − q|, is computed from exact probabilities \
             (`cyanometer::random::poisson::tails`), normal numbers rounded to whole electrons; the exact draws invert the law \
             with a word of 64 bits and a distribution function known to 5·10⁻¹⁴ of itself, which leaves less than 10⁻¹¹ (they \
             stand at the foot of the plot). Mean, σ, skewness and \
             P(X = 0) are those of the simulated frame, whose sampling errors of mean and σ are {} of σ and {}; χ² tests the \
             simulated counts against the law of Poisson. In a uniform scene of this size counts are looked up in a table.",
            percent((photosites as f64).sqrt().recip()),
            percent((2.0 * photosites as f64).sqrt().recip()),
        ),
        figures: vec![("shot-noise".into(), "Distance to the law of Poisson, and time, against the rate".into(), plot)],
        tables: vec![(String::new(), table)],
        advice: advice(&cases),
    })
}

fn signed_percent(fraction: f64) -> String {
    format!("{} %", number(100.0 * fraction, 3))
}

fn head(study: &Study, size: [usize; 2], rate: f64, uniform: bool) -> FrameHeader {
    let mut head = study.head(size, Some([rate; 3]));
    if let Some(scene) = &mut head.metadata.scene {
        *scene = Scene { uniform, ..scene.clone() };
    }
    head
}

fn at_rate(study: &Study, rate: f64, size: [usize; 2], seed: u64) -> Result<Vec<Case>> {
    let plane = |uniform: bool| -> Result<MemoryFrame> {
        let samples = vec![to_sample(rate); 3 * size[0] * size[1]];
        mosaicked(&MemoryFrame::new(head(study, size, rate, uniform), samples))
    };
    let (any, uniform) = (plane(false)?, plane(true)?);
    // At 1 K there is no dark signal.
    let all_but =
        |kept: Option<Source>| Source::ALL.into_iter().filter(|source| Some(*source) != kept).collect::<Vec<_>>();
    let settings = |kept, poisson| NoiseSettings {
        seed,
        without: all_but(kept),
        temperature_k: Some(1.0),
        poisson,
        ..NoiseSettings::default()
    };
    let shot = Some(Source::Ssn);
    let stages = [
        (&any, AddNoise::new(&any.header, &settings(shot, PoissonKind::Exact))?),
        (&uniform, AddNoise::new(&uniform.header, &settings(shot, PoissonKind::Exact))?),
        (&any, AddNoise::new(&any.header, &settings(shot, PoissonKind::Gaussian))?),
        (&any, AddNoise::new(&any.header, &settings(None, PoissonKind::Exact))?),
    ];
    let mut works: Vec<Work<'_>> = Vec::new();
    for (frame, stage) in &stages {
        works.push(Box::new(|| {
            black_box(frame.through(stage)?);
            Ok(())
        }));
    }
    let times = study.bench.medians(&mut works)?;
    drop(works);
    let exact = Law::poisson(rate);
    let mut cases = Vec::new();
    for (kind, ((frame, stage), time)) in stages.iter().zip(times).enumerate() {
        let law = match kind {
            0 | 1 => Law::poisson(rate),
            2 => Law::gaussian(rate),
            _ => Law::none(rate),
        };
        let drawn = frame.through(stage)?.0.samples;
        let count = drawn.len() as f64;
        let mean = drawn.iter().map(|&x| f64::from(x)).sum::<f64>() / count;
        let central = |power: i32| drawn.iter().map(|&x| (f64::from(x) - mean).powi(power)).sum::<f64>() / count;
        let std = central(2).sqrt();
        cases.push(Case {
            rate,
            kind,
            distance: law.distance(&exact),
            time: time / count,
            mean,
            std,
            skewness: if std > 0.0 { central(3) / std.powi(3) } else { 0.0 },
            zero: drawn.iter().filter(|&&x| x.round() == 0.0).count() as f64 / count,
            significance: chi_square(&drawn, &exact),
        });
    }
    Ok(cases)
}

/// Significance of the counts of rounded numbers against a law, counts pooled until ten are expected.
fn chi_square(drawn: &[f32], law: &Law) -> f64 {
    let total = drawn.len() as f64;
    let mut found = std::collections::HashMap::new();
    for &x in drawn {
        *found.entry(whole(f64::from(x.round()))).or_insert(0_u32) += 1;
    }
    let (mut sum, mut classes, mut left) = (0.0, 0.0, (0.0, 0.0));
    let mut seen = 0.0;
    for (k, share) in law.counts() {
        let observed = f64::from(found.get(&k).copied().unwrap_or(0));
        left = (left.0 + observed, left.1 + total * share);
        seen += observed;
        if left.1 >= 10.0 {
            sum += (left.0 - left.1).powi(2) / left.1;
            classes += 1.0;
            left = (0.0, 0.0);
        }
    }
    // What is left at the upper end, and what lies where the law has nothing.
    let outside = total - seen;
    sum += (left.0 + outside - left.1).powi(2) / left.1.max(1.0);
    // Too large counts against a law; too small would be as suspicious.
    of_chi_square(sum, classes)
}

fn advice(cases: &[Case]) -> String {
    let of = |kind: usize| cases.iter().filter(move |case| case.kind == kind);
    let below = of(2)
        .find(|case| case.distance < 0.01)
        .map_or("no rate here".to_owned(), |c| format!("{} e⁻", digits(c.rate, 1)));
    let lowest = of(2).next();
    let (slowest, saved) = of(0)
        .zip(of(2))
        .map(|(e, g)| (e.time, e.time / g.time))
        .fold((0.0, 0.0), |a, b| (f64::max(a.0, b.0), f64::max(a.1, b.1)));
    format!(
        "Take exact numbers, the default, at every rate: they cost at most {} per photosite, {} times what Gaussian ones cost. \
         The Gaussian law is within 1 % of that of Poisson from {below} on, and {} away from it at {} e⁻; its skewness is \
         missing at every rate.",
        time(slowest),
        number(saved, 1),
        percent(lowest.map_or(f64::NAN, |case| case.distance)),
        lowest.map_or(String::new(), |case| digits(case.rate, 1)),
    )
}
