//! Photosites that hold one value with light and without: they measure nothing, and a few of them are as much as a pattern.
//!
//! So do those that reach the largest code under light that is far from it for all others, hot ones above all: they do not follow it.
//!
//! Of n photosites one that is stuck at c adds (c − μ)²/n to the variance between photosites: less under light than in the dark, so
//! that what light adds, the difference of the two, is too small, or none at all.

use super::sites::Site;
use crate::numerics::robust::median;

/// A photosite that is stuck.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct StuckSite {
    /// Column of the frame.
    pub x: usize,
    /// Row.
    pub y: usize,
    /// The mean of its samples in the dark.
    pub dark_adu: f64,
    /// That under light.
    pub light_adu: f64,
}

/// A photosite of a grid, and the column of its row that stands in for it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StandIn {
    /// Row of the grid.
    pub row: usize,
    /// Column.
    pub column: usize,
    /// The column that stands in.
    pub by: usize,
}

/// Means of photosites, laid out as `[row][channel][column]`, and the noise that is left in them, a variance, of each grid.
#[derive(Debug, Clone)]
pub struct Picture<'a> {
    /// Means of frames.
    pub means: &'a [f32],
    /// What noise leaves in them, grid by grid.
    pub noise: Vec<f64>,
}

/// Photosites of all grids that are stuck.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Stuck {
    grids: Vec<Grid>,
}

/// Those of a grid, and how many it has in all.
#[derive(Debug, Clone, Default, PartialEq)]
struct Grid {
    sites: Vec<(StandIn, StuckSite)>,
    /// Those that reach the largest code early, and their places in the frame.
    early: Vec<(StandIn, [usize; 2])>,
    /// Those that corrections mended.
    mended: Vec<StandIn>,
    class: String,
    count: usize,
}

/// Photosites follow the light by less than this share of what most do.
const FOLLOWS: f64 = 0.1;
/// Standard deviations that are far beyond chance.
const BEYOND: f64 = 10.0;
/// More than this share of the photosites are no defects.
const FEW: f64 = 0.01;

impl Stuck {
    /// Those that a dark and a flat show: that do not follow the light, and lie far off black or are held at code 0. `are_codes` tells
    /// whether samples are codes, and the frames have so many columns and planes.
    pub fn of(sites: &[Site], size: [usize; 2], [dark, flat]: [&Picture; 2], are_codes: bool) -> Self {
        let grid = |(index, site): (usize, &Site)| {
            let sites = stuck_of(site, size, [dark, flat], index, are_codes);
            Grid { sites, class: site.class.clone(), count: site.count(), ..Grid::default() }
        };
        Self { grids: sites.iter().enumerate().map(grid).collect() }
    }

    /// The same with those besides that reach the largest code early, and those that corrections mended: columns and rows of each grid,
    /// row by row.
    #[must_use]
    pub fn with_others(self, sites: &[Site], early: &[Vec<[usize; 2]>], mended: &[Vec<[usize; 2]>]) -> Self {
        let grid = |(index, site): (usize, &Site)| {
            let mut grid = self.grids.get(index).cloned().unwrap_or_default();
            (grid.class, grid.count) = (site.class.clone(), site.count());
            let is_known = |[column, row]: &[usize; 2]| {
                grid.sites.iter().any(|(stuck, _)| stuck.row == *row && stuck.column == *column)
            };
            let places: Vec<[usize; 2]> = early[index].iter().filter(|place| !is_known(place)).copied().collect();
            let is_other = |place: &&[usize; 2]| !is_known(place) && !places.contains(place);
            let own_mended: Vec<[usize; 2]> = mended[index].iter().filter(is_other).copied().collect();
            let mut out: Vec<[usize; 2]> = grid.sites.iter().map(|(stuck, _)| [stuck.column, stuck.row]).collect();
            out.extend(places.iter().chain(&own_mended));
            let with_stand_in = |&[column, row]: &[usize; 2]| {
                let own: Vec<usize> = out.iter().filter(|place| place[1] == row).map(|place| place[0]).collect();
                let at = [site.first[0] + column * site.step[0], site.first[1] + row * site.step[1]];
                Some((StandIn { row, column, by: nearest_other(column, site.size[0], &own)? }, at))
            };
            grid.early = places.iter().filter_map(with_stand_in).collect();
            grid.mended = own_mended.iter().filter_map(with_stand_in).map(|(stand_in, _)| stand_in).collect();
            // One that stood in may be such a one itself.
            for (stuck, _) in &mut grid.sites {
                let own: Vec<usize> = out.iter().filter(|place| place[1] == stuck.row).map(|place| place[0]).collect();
                stuck.by = nearest_other(stuck.column, site.size[0], &own).unwrap_or(stuck.by);
            }
            grid
        };
        Self { grids: sites.iter().enumerate().map(grid).collect() }
    }

    /// Whether there are any.
    pub fn is_any(&self) -> bool {
        self.grids.iter().any(|grid| !(grid.sites.is_empty() && grid.early.is_empty() && grid.mended.is_empty()))
    }

    /// The share of the photosites of a class that hold one value.
    pub fn share(&self, class: &str) -> f64 {
        self.share_of(class, |grid| grid.sites.len())
    }

    fn share_of(&self, class: &str, of: fn(&Grid) -> usize) -> f64 {
        let own = || self.grids.iter().filter(|grid| grid.class == class);
        let count: usize = own().map(|grid| grid.count).sum();
        own().map(of).sum::<usize>() as f64 / count.max(1) as f64
    }

    /// Those of classes that have few, which can be left out.
    #[must_use]
    pub fn few(&self) -> Self {
        let of_few = |grid: &Grid| {
            let mut own = grid.clone();
            if self.share(&grid.class) > FEW {
                own.sites.clear();
            }
            if self.share_of(&grid.class, |grid| grid.early.len()) > FEW {
                own.early.clear();
            }
            if self.share_of(&grid.class, |grid| grid.mended.len()) > FEW {
                own.mended.clear();
            }
            own
        };
        Self { grids: self.grids.iter().map(of_few).collect() }
    }

    /// What stands in for those of a grid, in the order of rows.
    pub fn stand_ins(&self, grid: usize) -> Vec<StandIn> {
        let Some(grid) = self.grids.get(grid) else { return Vec::new() };
        let both =
            grid.sites.iter().map(|(stand_in, _)| *stand_in).chain(grid.early.iter().map(|(stand_in, _)| *stand_in));
        let mut all: Vec<StandIn> = both.chain(grid.mended.iter().copied()).collect();
        all.sort_by_key(|stand_in| (stand_in.row, stand_in.column));
        all
    }

    /// Columns and rows of the frame's photosites of a class that reach the largest code early, row by row.
    pub fn early_of_class(&self, class: &str) -> Vec<[usize; 2]> {
        let own = self.grids.iter().filter(|grid| grid.class == class);
        let mut found: Vec<[usize; 2]> = own.flat_map(|grid| grid.early.iter().map(|(_, at)| *at)).collect();
        found.sort_by_key(|[x, y]| (*y, *x));
        found
    }

    /// How many of a class corrections mended.
    pub fn mended_of_class(&self, class: &str) -> usize {
        self.grids.iter().filter(|grid| grid.class == class).map(|grid| grid.mended.len()).sum()
    }

    /// Those of a class, row by row.
    pub fn of_class(&self, class: &str) -> Vec<StuckSite> {
        let own = self.grids.iter().filter(|grid| grid.class == class);
        let mut found: Vec<StuckSite> = own.flat_map(|grid| grid.sites.iter().map(|(_, site)| *site)).collect();
        found.sort_by_key(|site| (site.y, site.x));
        found
    }
}

fn stuck_of(
    site: &Site,
    [width, planes]: [usize; 2],
    [dark, flat]: [&Picture; 2],
    index: usize,
    are_codes: bool,
) -> Vec<(StandIn, StuckSite)> {
    let place = |row: usize, column: usize| {
        let [x, y] = [site.first[0] + column * site.step[0], site.first[1] + row * site.step[1]];
        ([x, y], (y * planes + site.plane) * width + x)
    };
    let means = |at: usize| [dark, flat].map(|picture| f64::from(picture.means[at]));
    let [columns, rows] = site.size;
    let black = middle(site, |row, column| means(place(row, column).1)[0]);
    let signal = middle(site, |row, column| {
        let [dark, light] = means(place(row, column).1);
        light - dark
    });
    let [of_dark, of_flat] = [dark, flat].map(|picture| picture.noise[index]);
    // Codes are off by half of one at most.
    let rounding = if are_codes { 0.5 } else { 0.0 };
    if signal <= BEYOND * ((of_dark + of_flat).sqrt() + rounding) / (1.0 - FOLLOWS) {
        return Vec::new();
    }
    let is_stuck = |[dark, light]: [f64; 2]| {
        let is_off = (dark - black).abs() > BEYOND * (of_dark.sqrt() + rounding);
        (light - dark).abs() < FOLLOWS * signal && (is_off || are_codes && light <= 0.0)
    };
    let mut found = Vec::new();
    for row in 0..rows {
        let of_row = || (0..columns).filter(|&column| is_stuck(means(place(row, column).1)));
        let own: Vec<usize> = of_row().collect();
        for column in &own {
            let Some(by) = nearest_other(*column, columns, &own) else { continue };
            let ([x, y], at) = place(row, *column);
            let [dark_adu, light_adu] = means(at);
            found.push((StandIn { row, column: *column, by }, StuckSite { x, y, dark_adu, light_adu }));
        }
    }
    found
}

/// The column nearest to one, of so many, that is none of those that are `out`.
fn nearest_other(column: usize, columns: usize, out: &[usize]) -> Option<usize> {
    let around = (1..columns).flat_map(|off| [column.checked_sub(off), Some(column + off).filter(|at| *at < columns)]);
    around.flatten().find(|at| !out.contains(at))
}

/// The median of some thousands of the photosites of a grid.
fn middle(site: &Site, of: impl Fn(usize, usize) -> f64) -> f64 {
    const ENOUGH: usize = 4096;
    let [columns, _] = site.size;
    // An odd step takes all columns.
    let step = (site.count() / ENOUGH) | 1;
    let mut values: Vec<f64> = (0..site.count()).step_by(step).map(|at| of(at / columns, at % columns)).collect();
    median(&mut values)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of 8x6 photosites that see 1000 above a black of 100 one is held at the largest code, one at 700 and one at code 0; one that
    /// sees nothing but has the black of all, and a hot one that follows the light, are none.
    #[test]
    fn photosites_that_hold_one_value_are_told() {
        let site = Site { class: "Y".into(), plane: 0, first: [0, 0], step: [1, 1], size: [8, 6] };
        let (mut dark, mut flat) = (vec![100.0; 48], vec![1100.0; 48]);
        for (at, values) in
            [(3, [4095.0, 4095.0]), (8, [700.0, 701.0]), (9, [0.0, 0.0]), (20, [100.0, 101.0]), (30, [900.0, 1900.0])]
        {
            (dark[at], flat[at]) = (values[0], values[1]);
        }
        let [dark, flat] = [&dark, &flat].map(|means| Picture { means, noise: vec![1.0] });
        let found = Stuck::of(std::slice::from_ref(&site), [8, 1], [&dark, &flat], true);
        let places: Vec<[usize; 2]> = found.of_class("Y").iter().map(|site| [site.x, site.y]).collect();
        assert_eq!(places, [[3, 0], [0, 1], [1, 1]]);
        let by: Vec<usize> = found.stand_ins(0).iter().map(|stuck| stuck.by).collect();
        assert_eq!(by, [2, 2, 2]);
        assert!(found.is_any() && !found.few().is_any(), "3 of 48 are more than few");
        // Those that reach the largest code early, or were mended, some of which stood in for others, are left out with them.
        let with =
            found.clone().with_others(std::slice::from_ref(&site), &[vec![[2, 0], [3, 0], [5, 4]]], &[vec![[4, 0]]]);
        assert_eq!(with.early_of_class("Y"), [[2, 0], [5, 4]]);
        let by: Vec<[usize; 3]> = with.stand_ins(0).iter().map(|stuck| [stuck.row, stuck.column, stuck.by]).collect();
        assert_eq!(by, [[0, 2, 1], [0, 3, 1], [0, 4, 5], [1, 0, 2], [1, 1, 2], [4, 5, 4]]);
        // Of light that is not told from noise none is known.
        let dim = Picture { means: dark.means, noise: vec![1.0] };
        assert!(!Stuck::of(&[site], [8, 1], [&dark, &dim], true).is_any());
    }
}
