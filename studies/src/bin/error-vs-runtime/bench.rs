//! Measures times: CPU time of this thread, alternatives by turns, medians.

use cpu_time::ThreadTime;
use cyanometer::error::Result;
use cyanometer_studies::frames::median;

/// Something whose run is timed.
pub type Work<'a> = Box<dyn FnMut() -> Result<()> + 'a>;

/// How long is measured.
#[derive(Clone, Copy)]
pub struct Bench {
    /// Turns of all alternatives; the median over them counts.
    rounds: usize,
    /// What is shorter is repeated until it takes so many seconds.
    least_s: f64,
}

impl Bench {
    /// A measurement, or one that only shows that all works.
    pub fn new(quick: bool) -> Self {
        if quick { Self { rounds: 3, least_s: 2e-4 } } else { Self { rounds: 9, least_s: 4e-3 } }
    }

    /// The number of turns.
    pub fn rounds(&self) -> usize {
        self.rounds
    }

    /// Seconds of CPU time that one run of each alternative takes.
    ///
    /// All alternatives run once in each round, so that whatever else the machine does hits all alike. Single runs of work
    /// that is long enough are timed; short work is repeated. The first run of each is not timed.
    pub fn medians(&self, alternatives: &mut [Work<'_>]) -> Result<Vec<f64>> {
        let mut repeats = Vec::new();
        for work in alternatives.iter_mut() {
            work()?;
            repeats.push(self.repeats(work)?);
        }
        let mut times = vec![Vec::new(); alternatives.len()];
        for _ in 0..self.rounds {
            for ((work, &repeats), times) in alternatives.iter_mut().zip(&repeats).zip(&mut times) {
                times.push(seconds(work, repeats)? / repeats as f64);
            }
        }
        Ok(times.into_iter().map(median).collect())
    }

    /// How often work is to be repeated.
    fn repeats(&self, work: &mut Work<'_>) -> Result<usize> {
        let mut repeats = 1;
        loop {
            let taken = seconds(work, repeats)?;
            if taken >= self.least_s {
                return Ok(repeats);
            }
            // Two steps mostly: a rough time first, then what it asks for.
            let factor = (1.2 * self.least_s / taken.max(1e-8)).clamp(2.0, 1000.0);
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most a thousandfold")]
            {
                repeats = (repeats as f64 * factor).ceil() as usize;
            }
        }
    }
}

/// CPU time of this thread that repeated work takes.
fn seconds(work: &mut Work<'_>, repeats: usize) -> Result<f64> {
    let start = ThreadTime::now();
    for _ in 0..repeats {
        work()?;
    }
    Ok(start.elapsed().as_secs_f64())
}

/// What `work` gives, and the CPU time that it took.
pub fn timed<T>(work: impl FnOnce() -> Result<T>) -> Result<(T, f64)> {
    let start = ThreadTime::now();
    let made = work()?;
    Ok((made, start.elapsed().as_secs_f64()))
}

/// The value that a share of all values do not exceed; NaN of none.
pub fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an index")]
    let index = ((values.len() as f64 * share).ceil() as usize).clamp(1, values.len().max(1)) - 1;
    values.get(index).copied().unwrap_or(f64::NAN)
}
