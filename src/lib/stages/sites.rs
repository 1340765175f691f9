//! Which photosites of a frame are alike: those behind one kind of filter.

use crate::metadata::FrameHeader;

/// The classes of the photosites of a frame: of its planes where there are several, of the filters of its array, or one.
#[derive(Debug, Clone, PartialEq)]
pub struct SiteClasses {
    /// Classes of a period, row by row, from the frame's first photosite; none where each plane is a class.
    period: Option<(usize, Vec<usize>)>,
    count: usize,
}

impl SiteClasses {
    /// Those of a frame whose layer of marks, if there is one, does not count.
    pub fn of(frame: &FrameHeader, planes: usize) -> Self {
        let array = frame.metadata.cfa.filter(|_| planes == 1);
        let Some(array) = array else { return Self { period: None, count: planes } };
        let [columns, rows] = array.period();
        let filters = array.filters();
        let [x0, y0] = frame.geometry.origin.map(i64::from);
        let class = |x: usize, y: usize| {
            let filter = array.filter(x0 + x as i64, y0 + y as i64);
            filters.iter().position(|known| Some(*known) == filter).unwrap_or(0)
        };
        let sites = (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y))).map(|(x, y)| class(x, y)).collect();
        Self { period: Some((columns, sites)), count: filters.len().max(1) }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Columns and rows after which classes come again; one of each where each plane is a class.
    pub fn period(&self) -> [usize; 2] {
        self.period.as_ref().map_or([1; 2], |(columns, sites)| [*columns, sites.len() / columns])
    }

    /// The classes of the photosites in row `y` of a plane, from the first on, again and again.
    pub fn row(&self, y: usize, plane: usize) -> Vec<usize> {
        match &self.period {
            None => vec![plane],
            Some((columns, sites)) => sites[y % (sites.len() / columns) * columns..][..*columns].to_vec(),
        }
    }

    /// The class of a photosite.
    pub fn class(&self, x: usize, y: usize, plane: usize) -> usize {
        match &self.period {
            None => plane,
            Some((columns, sites)) => sites[y % (sites.len() / columns) * columns + x % columns],
        }
    }
}
