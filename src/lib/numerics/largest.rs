//! The largest of many samples, and whether they are heaped at one value.
//!
//! Of light and noise the largest values of a frame are its rarest. A converter that ends there, or a level to which samples were cut,
//! puts all that is brighter on one value.

/// So many of the largest values of a plane are counted.
const VALUES: usize = 24;
/// Fewer values are those of a frame without noise.
const LEAST_VALUES: usize = 16;
/// So many samples at the largest value are a heap,
const LEAST_HEAP: u64 = 20;
/// and so many times those at any other of the largest.
const ABOVE_OTHERS: u64 = 8;

/// Whether a number is the largest code of 8 to 16 bits.
fn is_largest_code(value: f32) -> bool {
    (8..=16).any(|bits| value == f32::from(u16::MAX >> (16 - bits)))
}

/// The largest values of one plane, falling, and how many samples have each.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Largest(Vec<(f32, u64)>);

impl Largest {
    /// Takes samples in.
    pub fn take<'a>(&mut self, samples: impl Iterator<Item = &'a f32>) {
        let mut floor = self.floor();
        for sample in samples {
            if *sample >= floor {
                self.put(*sample);
                floor = self.floor();
            }
        }
    }

    /// What smaller samples do not count; of infinite ones none does.
    fn floor(&self) -> f32 {
        if self.0.len() < VALUES { f32::MIN } else { self.0.last().map_or(f32::MIN, |(value, _)| *value) }
    }

    fn put(&mut self, sample: f32) {
        if sample == f32::INFINITY {
            return;
        }
        match self.0.iter().position(|(value, _)| *value <= sample) {
            Some(at) if self.0[at].0 == sample => self.0[at].1 += 1,
            Some(at) => self.0.insert(at, (sample, 1)),
            None => self.0.push((sample, 1)),
        }
        self.0.truncate(VALUES);
    }

    /// The largest value and how many samples have it, where that is a heap; of few values only if no level is known beside which they
    /// would be plain.
    pub fn heap(&self, is_level_known: bool) -> Option<(f32, u64)> {
        let (&(value, count), others) = self.0.split_first()?;
        let most = others.iter().map(|(_, count)| *count).max().unwrap_or_default();
        // Of a frame that is nearly all saturated the largest code of a converter tells, where no other is known.
        let is_told = self.0.len() >= LEAST_VALUES || !is_level_known && is_largest_code(value);
        (is_told && count >= LEAST_HEAP && count >= ABOVE_OTHERS * most).then_some((value, count))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn heap(samples: impl IntoIterator<Item = f32>) -> Option<(f32, u64)> {
        let mut plane = Largest::default();
        plane.take(samples.into_iter().collect::<Vec<_>>().iter());
        plane.heap(false)
    }

    #[test]
    fn a_heap_is_many_samples_at_the_largest_value() {
        let ramp = || (0..4000_u16).map(|i| f32::from(i % 1000));
        assert_eq!(heap(ramp()), None);
        let cut = |at: f32| ramp().map(move |sample| sample.min(at));
        assert_eq!(heap(cut(900.0)), Some((900.0, 400)));
        assert_eq!(heap(cut(995.0)), None);
        // What is no number does not count, whatever is beyond.
        assert_eq!(heap(cut(900.0).chain([f32::NAN, f32::INFINITY])), Some((900.0, 400)));
        // Few values are those of patches without noise, and few samples hot pixels.
        assert_eq!(heap((0..4000_u16).map(|i| f32::from((i / 5).min(10)))), None);
        assert_eq!(heap((0..100_u16).map(|i| f32::from(i.min(85)))), None);
        // Nearly all at the largest code of 12 bits.
        assert_eq!(heap([4095.0; 40].into_iter().chain([4000.0])), Some((4095.0, 40)));
        assert_eq!(heap([4000.0; 40]), None);
        let mut known = Largest::default();
        known.take([4095.0; 40].iter());
        assert_eq!(known.heap(true), None);
        // The tail of coarse noise: each code is rarer than that before.
        assert_eq!(
            heap((0..20_u16).flat_map(|code| std::iter::repeat_n(f32::from(code), 20 - usize::from(code)))),
            None
        );
    }
}
