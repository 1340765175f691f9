//! Photosites that are alike: those at one place of the filter array's period, or those of a plane.

use crate::frame::to_sample;
use crate::metadata::FrameHeader;

/// A grid of photosites behind one filter.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Site {
    /// The class: `R`, `G`, `B` or another filter's letter, the name of a plane, or `Y`.
    pub class: String,
    /// The plane.
    pub plane: usize,
    /// Column and row of the frame's first.
    pub first: [usize; 2],
    /// From one to the next, columns and rows.
    pub step: [usize; 2],
    /// How many there are, columns and rows.
    pub size: [usize; 2],
}

impl Site {
    /// The grids of a frame: one for each place in the period of its filter array, or for each plane.
    pub fn of(frame: &FrameHeader) -> Vec<Self> {
        let geometry = &frame.geometry;
        let size = [geometry.width, geometry.height];
        let array = frame.metadata.cfa.filter(|_| geometry.channels.len() == 1);
        let Some(array) = array.filter(|array| array.period() != [1, 1]) else {
            let plane = |(plane, name): (usize, &String)| Self {
                class: name.clone(),
                plane,
                first: [0, 0],
                step: [1, 1],
                size,
            };
            return geometry.channels.iter().enumerate().map(plane).collect();
        };
        let step = array.period();
        let [x0, y0] = geometry.origin.map(i64::from);
        let site = |first: [usize; 2]| {
            let class = array.filter(x0 + first[0] as i64, y0 + first[1] as i64)?;
            let count = |axis: usize| size[axis].saturating_sub(first[axis]).div_ceil(step[axis]);
            Some(Self { class: class.to_string(), plane: 0, first, step, size: [count(0), count(1)] })
        };
        (0..step[1]).flat_map(|y| (0..step[0]).map(move |x| [x, y])).filter_map(site).collect()
    }

    /// Copies those of the plane's row `samples`, which has some.
    #[inline(always)]
    pub fn gather(&self, samples: &[f32], into: &mut [f64]) {
        if self.step[0] == 1 {
            into.iter_mut().zip(samples).for_each(|(to, from)| *to = f64::from(*from));
        } else {
            let own = samples[self.first[0]..].iter().step_by(self.step[0]);
            into.iter_mut().zip(own).for_each(|(to, from)| *to = f64::from(*from));
        }
    }

    /// Writes values of those of a row into the plane's row.
    pub fn spread(&self, values: &[f64], into: &mut [f32]) {
        let own = into[self.first[0]..].iter_mut().step_by(self.step[0]);
        own.zip(values).for_each(|(to, value)| *to = to_sample(*value));
    }

    /// Whether it has photosites in row `y`.
    pub fn is_in_row(&self, y: usize) -> bool {
        y >= self.first[1] && (y - self.first[1]).is_multiple_of(self.step[1])
    }

    /// How many photosites there are.
    pub fn count(&self) -> usize {
        self.size[0] * self.size[1]
    }
}
