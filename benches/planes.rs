//! Integrals over 471 wavelengths of every pixel of a row, three classes, on one core; beside numpy's tensordot on the same
//! rows, where the Python that the variable `PYTHON` names has it.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use cyanometer::numerics::planes::{WeightedPlane, weighted_sums};
use std::hint::black_box;
use std::process::Command;

const PLANES: usize = 471;

/// What numpy takes, in the processor's time, for weights of either precision.
const NUMPY: &str = "
import os
os.environ['OMP_NUM_THREADS'] = os.environ['OPENBLAS_NUM_THREADS'] = '1'
import numpy, time
for width in (1024, 4096):
    rows = ((numpy.arange(471 * width) * 7919) % 10007 / 31).astype('f4').reshape(471, width)
    for kind in ('f8', 'f4'):
        weights = numpy.ones((3, 471), kind)
        times = []
        for _ in range(15):
            start = time.process_time()
            for _ in range(20): numpy.tensordot(weights, rows, 1)
            times.append((time.process_time() - start) / 20)
        print(f'numpy, weights {kind}, {width} pixels: {width / sorted(times)[7] / 1e6:.2f} Mpixel/s')
";

fn planes(criterion: &mut Criterion) {
    for width in [1024, 4096] {
        let samples: Vec<f32> = (0..width * PLANES).map(|i| ((i * 7919) % 10_007) as f32 / 31.0).collect();
        let planes: Vec<WeightedPlane> =
            (0..PLANES).map(|plane| WeightedPlane { plane, weights: [plane as f64, 1.0, 2.0] }).collect();
        let mut group = criterion.benchmark_group("integrals over wavelength");
        group.throughput(Throughput::Elements(width as u64));
        group.bench_function(format!("{width} pixels"), |bencher| {
            bencher.iter(|| weighted_sums(black_box(&samples), width, &planes, |sums| _ = black_box(sums)));
        });
        group.finish();
    }
    let python = std::env::var("PYTHON").unwrap_or_else(|_| "python3".into());
    match Command::new(python).args(["-c", NUMPY]).status() {
        Ok(status) if status.success() => {}
        _ => eprintln!("numpy is not at hand; name a Python that has it in PYTHON"),
    }
}

criterion_group!(benches, planes);
criterion_main!(benches);
