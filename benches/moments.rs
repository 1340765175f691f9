//! Statistics of a frame of 2654x1996 photosites on one core, beside a copy of the same bytes: the rate of either in bytes
//! per second, so that their ratio can be read off one run.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use cyanometer::numerics::moments::{Moments, add_alternating};
use cyanometer::numerics::sums::Limits;
use std::hint::black_box;

const WIDTH: usize = 2654;
const HEIGHT: usize = 1996;
const LIMITS: Limits = Limits { low: 0.0, high: 4095.0 };

/// Codes that scatter about 1900.
fn codes(channels: usize) -> Vec<f32> {
    (0..WIDTH * HEIGHT * channels).map(|i| 1800.0 + (i.wrapping_mul(2_654_435_761) >> 7 & 255) as f32).collect()
}

fn of_rows(samples: &[f32], channels: usize) -> Moments {
    let (mut row_moments, mut all) = (Moments::new(channels), Moments::new(channels));
    for row in samples.chunks_exact(WIDTH * channels) {
        row_moments.clear();
        row_moments.add_within(WIDTH, |channel| &row[channel * WIDTH..][..WIDTH], LIMITS);
        all.merge(&row_moments);
    }
    all
}

fn of_classes(samples: &[f32]) -> [Moments; 3] {
    let mut all = [1; 3].map(Moments::new);
    let mut of_row = [1; 3].map(Moments::new);
    for (y, row) in samples.chunks_exact(WIDTH).enumerate() {
        of_row.iter_mut().for_each(Moments::clear);
        if let Ok(moments) = of_row.get_disjoint_mut([y % 2, y % 2 + 1]) {
            add_alternating(moments, row, LIMITS);
        }
        for (all, of_row) in all.iter_mut().zip(&of_row) {
            all.merge(of_row);
        }
    }
    all
}

fn moments(criterion: &mut Criterion) {
    for (name, channels) in [("moments of one plane", 1), ("moments of three planes", 3), ("moments of five planes", 5)]
    {
        let samples = codes(channels);
        let mut copied = vec![0.0; samples.len()];
        let mut group = criterion.benchmark_group(name);
        group.throughput(Throughput::Bytes(size_of_val(samples.as_slice()) as u64)).sample_size(15);
        group.bench_function("copy", |bencher| {
            bencher.iter(|| black_box(&mut copied).copy_from_slice(black_box(&samples)));
        });
        group.bench_function("channels", |bencher| bencher.iter(|| of_rows(black_box(&samples), channels)));
        if channels == 1 {
            group.bench_function("classes of a CFA", |bencher| bencher.iter(|| of_classes(black_box(&samples))));
        }
        group.finish();
    }
}

criterion_group!(benches, moments);
criterion_main!(benches);
