//! Sums over what rows and columns share, where samples follow it on a curve.
//!
//! The mean sample m(u, v) of photosites whose response differs by u, and to whose charge v is added, is smooth on the scale of
//! what is a photosite's own. Where that is next to nothing beside a code, m is a staircase of v: its steps lie where a code begins,
//! less the charge, or each count of it, and the sum over v has panels between them. Of u it is smooth even then, as far as shot
//! noise, or what is added, blurs it.

use super::averaged_means::{AveragedMeans, Averaging};
use super::bent_lines::{BentLine, Given};
use super::blur::blur_e;
use super::effort;
use super::law::Law;
use super::line_means::{FewMeans, Kinds, LineMeans};
use super::lines::{Axis, BLURRED, COARSE_LINES, MOST_NODES, TOO_COARSE, nodes};
use super::moments::LineCovariance;
use super::photosite::Photosite;
use super::unpredictable::{Predicted, Unpredictable};
use crate::metadata::AdcRecord;
use crate::numerics::gauss::panel;
use crate::numerics::normal::density;
use crate::stages::noise::NoiseModel;
use nalgebra::{DMatrix, DVector, Matrix3};

/// Values of what is shared that are gone through at most where codes follow it by steps.
const MOST_STEPPED: usize = 6000;

/// Evaluations that a sum may take, a tenth of a second.
const MOST_WORK: u64 = 16_000_000;

/// The same where photosites are unlike each other, of which there are several sums for each stage.
const MOST_WORK_OF_UNLIKE: u64 = 3_000_000;

/// Why nothing is said where a sum takes more.
const TAKES_LONG: &str = "full well, an end of the codes or their rounding bends what rows or columns share, and all counts of light and \
                          dark signal beside each of its values take too many evaluations";

/// Standard deviations beyond which what is shared does not count.
const REACH: f64 = 6.5;

/// ADU per electron up to which shot noise blurs codes as a normal law does.
const FEW: f64 = 0.2;

/// A step of the mean sample, in standard deviations of what is shared, and over what width.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Step {
    at: f64,
    width: f64,
}

/// What rows or columns share, or both, of photosites of some classes: of R, G and B, of one amplifier or of several.
struct Shared {
    /// What is added to the charge, e⁻.
    offset_e: f64,
    /// Relative response.
    response: f64,
    classes: Vec<Class>,
}

/// Photosites of one class behind one amplifier.
struct Class {
    /// What is a photosite's own, or other lines'.
    kinds: Kinds,
    /// Few others, and their shares.
    few: Vec<(f64, Law)>,
    /// What of that blurs codes, e⁻.
    blur_e: f64,
    expected_e: f64,
    adc: Option<AdcRecord>,
    /// The first class that is the same.
    same: usize,
    /// How exposures were averaged; none of one.
    averaging: Option<Averaging>,
}

/// Photosites of one class in one line.
enum Means<'a> {
    OfOne(Box<LineMeans>),
    OfAverage(AveragedMeans<'a>),
}

impl Means<'_> {
    fn at(&self, offset_e: f64) -> [f64; 2] {
        match self {
            Self::OfOne(means) => means.at(offset_e),
            Self::OfAverage(means) => means.at(offset_e),
        }
    }
}

impl Photosite {
    /// Covariances, by classes, of photosites that share such lines, by sums over what these share.
    ///
    /// # Errors
    ///
    /// [`Unpredictable::Beyond`] where they are too many.
    pub(super) fn curved(&self, axes: &[Axis], expected_e: [f64; 3]) -> Predicted<Matrix3<f64>> {
        let found = curved(&[(*self, expected_e)], axes)?;
        Ok(Matrix3::from_fn(|k, l| found[(k, l)]))
    }

    /// What three samples of one place, each of its class, share by row and column together beyond what they share by either: where
    /// codes are no straight lines there is more than the sum.
    ///
    /// # Errors
    ///
    /// As [`Self::curved`].
    pub(super) fn beyond_lines(&self, expected_e: [f64; 3], lines: &[LineCovariance; 3]) -> Predicted<[[f64; 3]; 3]> {
        let shares = |axis: &Axis| axis.parts(&self.model.lines).iter().any(|part| *part > 0.0);
        if !Axis::ALL.iter().all(shares) || !self.is_curved_in_lines(expected_e)? {
            return Ok([[0.0; 3]; 3]);
        }
        let both = self.curved(&Axis::ALL, expected_e)?;
        let beyond =
            |k: usize, l: usize| if k == l { 0.0 } else { both[(k, l)] - lines[k].row[l] - lines[k].column[l] };
        Ok([0, 1, 2].map(|k| [0, 1, 2].map(|l| beyond(k, l))))
    }
}

/// Covariances of photosites that share such lines, of R, G and B of each of several amplifiers one after the other, by sums over what
/// these share; the amplifiers are those of one sensor.
///
/// # Errors
///
/// [`Unpredictable::Beyond`] where they are too many.
pub(super) fn curved(sites: &[Lit], axes: &[Axis]) -> Predicted<DMatrix<f64>> {
    let shared = Shared::of(sites, axes, None);
    let count = shared.classes.len();
    let (mut first, mut second) = (DVector::zeros(count), DMatrix::zeros(count, count));
    shared.each_value(sites, |weight, [means, _]| {
        second += weight * &means * means.transpose();
        first += weight * means;
    })?;
    Ok(second - &first * first.transpose())
}

/// How photosites of a line go together beyond their covariance, in an average of so many exposures where it is one; none where they share
/// nothing.
///
/// # Errors
///
/// As [`curved`].
pub(super) fn bent(sites: &[Lit], axis: Axis, frames: Option<u32>) -> Predicted<Option<BentLine>> {
    let mut given = Vec::new();
    Shared::of(sites, &[axis], frames).each_value(sites, |weight, [means, squares]| {
        given.push(Given { weight, variances: squares - means.component_mul(&means), means });
    })?;
    Ok(BentLine::of(given))
}

/// Photosites behind an amplifier, and the signal electrons that R, G and B of them expect.
type Lit = (Photosite, [f64; 3]);

impl Shared {
    /// Goes through what is shared: how likely it is, and what it makes of the means of all classes and of their squares.
    fn each_value(&self, sites: &[Lit], of: impl FnMut(f64, [DVector<f64>; 2])) -> Predicted<()> {
        let are_alike = |class: &Class| class.kinds.laws.len() == 1 && class.kinds.jumps.is_empty();
        let are_unlike = match self.classes.iter().any(|class| class.averaging.is_some()) {
            true => sites.iter().any(|(site, _)| site.has_tails()),
            false => !self.classes.iter().all(are_alike),
        };
        let most_work = if are_unlike { MOST_WORK_OF_UNLIKE } else { MOST_WORK };
        let found = effort::within(most_work, || self.each_within(are_unlike, of));
        found.unwrap_or(Err(Unpredictable::Beyond(TAKES_LONG)))
    }

    fn each_within(&self, are_unlike: bool, mut of: impl FnMut(f64, [DVector<f64>; 2])) -> Predicted<()> {
        if self.offset_e == 0.0 && self.response == 0.0 {
            return Ok(());
        }
        let few: Vec<Option<FewMeans>> = (0..self.classes.len()).map(|k| self.few_of(k)).collect();
        if effort::is_spent() {
            return Err(Unpredictable::Beyond(TAKES_LONG));
        }
        let mut gains = self.gains(false)?;
        let smooth = nodes(self.offset_e, self.least_blur_e());
        let are_many = smooth.len() * gains.len() > MOST_NODES;
        let is_sharp = are_many && self.classes.iter().all(|class| class.adc.is_some());
        if is_sharp && are_unlike {
            return Err(Unpredictable::Beyond(COARSE_LINES));
        }
        if is_sharp {
            gains = self.gains(true)?;
        } else if are_many {
            return Err(Unpredictable::Beyond(TOO_COARSE));
        }
        let mut all = 0;
        let mut foreseen: Option<effort::Foreseen> = None;
        let lines = gains.len();
        for (u, of_u) in gains {
            let share = 1.0 + self.response * u;
            let gained: Vec<Kinds> = self.classes.iter().map(|class| class.kinds.gained(share)).collect();
            let line = self.line(&gained, &few, share);
            let offsets = if is_sharp { &self.offsets(&gained)? } else { &smooth };
            all += offsets.len();
            if all > MOST_STEPPED {
                return Err(Unpredictable::Beyond(TOO_COARSE));
            }
            let foreseen = foreseen.get_or_insert_with(|| effort::Foreseen::of(lines * offsets.len()));
            for (v, of_v) in offsets {
                foreseen.begin_next();
                if effort::is_spent() {
                    return Err(Unpredictable::Beyond(TAKES_LONG));
                }
                of(of_u * of_v, self.means(&line, self.offset_e * v));
            }
        }
        Ok(())
    }

    /// Of such lines, in an average of so many exposures where it is one.
    fn of(sites: &[Lit], axes: &[Axis], frames: Option<u32>) -> Self {
        let of_mean = f64::from(frames.unwrap_or(1).max(1)).sqrt().recip();
        let mut anew_e: f64 = 0.0;
        let mut shared = Self { offset_e: 0.0, response: 0.0, classes: Vec::new() };
        if let Some((site, _)) = sites.first() {
            for axis in axes {
                let [temporal, fixed, of_response] = axis.parts(&site.model.lines);
                shared.offset_e = shared.offset_e.hypot((of_mean * temporal).hypot(fixed));
                anew_e = anew_e.hypot(temporal);
                shared.response = shared.response.hypot(of_response);
            }
        }
        let part = |model: &NoiseModel| axes.iter().fold(*model, |rest, axis| axis.without(&rest));
        for (site, expected_e) in sites {
            let rest = part(&site.model);
            for expected_e in *expected_e {
                let (mut kinds, adc) = (site.kinds_of_line(expected_e, part), site.adc);
                // Of photosites that are full nothing blurs codes but what is added, and few of them do not follow what is shared on a curve.
                let is_coarse = adc.is_some_and(|adc| adc.adu_per_e * rest.added() < BLURRED);
                let are_steps = is_coarse && kinds.laws.iter().any(|(_, law)| law.are_few && law.reaches_full_well());
                let few = if frames.is_none() && !are_steps { kinds.split_off_few() } else { Vec::new() };
                let are_full = site.nears_full_well(expected_e) || rest.tails.has_hot() && few.is_empty();
                let of_full_e = if are_full { rest.added() } else { f64::INFINITY };
                let blur_e = adc.map_or(f64::INFINITY, |adc| blur_e(&rest, &adc, expected_e).min(of_full_e));
                let is_same =
                    |class: &Class| class.kinds == kinds && class.adc == adc && class.expected_e == expected_e;
                let same = shared.classes.iter().position(is_same).unwrap_or(shared.classes.len());
                let averaging = frames.map(|frames| Averaging::of(site, expected_e, part, anew_e, frames));
                shared.classes.push(Class { kinds, few, blur_e, expected_e, adc, same, averaging });
            }
        }
        shared
    }

    /// What few photosites of a class add to its means; none where another class is the same.
    fn few_of(&self, index: usize) -> Option<FewMeans> {
        let class = &self.classes[index];
        let is_told = class.same == index && !effort::is_spent();
        is_told
            .then(|| FewMeans::of(&class.few, class.kinds.most(), class.adc, [self.offset_e, self.response]))
            .flatten()
    }

    /// The photosites of a line, by class, each about the center that the law of most has; none where another is the same.
    fn line(&self, gained: &[Kinds], few: &[Option<FewMeans>], share: f64) -> Vec<Option<Means<'_>>> {
        let means = |k: usize, class: &'_ Class| {
            let about = self.classes[k].kinds.most();
            match &self.classes[k].averaging {
                None => {
                    let few = few[k].map(|few| few.gained(share));
                    Means::OfOne(Box::new(LineMeans::of(&gained[k], about, class.adc, class.blur_e).beside(few)))
                }
                Some(averaging) => Means::OfAverage(averaging.line(share, class.adc)),
            }
        };
        self.classes.iter().enumerate().map(|(k, class)| (class.same == k).then(|| means(k, class))).collect()
    }

    /// Their mean samples, and those of the squares, where so much is added.
    fn means(&self, line: &[Option<Means<'_>>], offset_e: f64) -> [DVector<f64>; 2] {
        let mut found = [0, 1].map(|_| DVector::zeros(self.classes.len()));
        for (k, means) in line.iter().enumerate() {
            let same = self.classes[k].same;
            let pair = means.as_ref().map_or([found[0][same], found[1][same]], |means| means.at(offset_e));
            (0..2).for_each(|power| found[power][k] = pair[power]);
        }
        found
    }

    fn least_blur_e(&self) -> f64 {
        self.classes.iter().map(|class| class.blur_e).fold(f64::INFINITY, f64::min)
    }

    /// Responses to go through, with their weights; codes follow them by steps where they are `sharp`.
    fn gains(&self, is_sharp: bool) -> Predicted<Vec<(f64, f64)>> {
        let Some(Class { kinds, expected_e, .. }) = self.brightest() else { return Ok(vec![(0.0, 1.0)]) };
        let law = kinds.most();
        let spread_e = expected_e * self.response;
        // Brighter lines have more counts, whose law is smooth in the light whatever is read of each.
        if self.response == 0.0 || law.light.shot_std() > 0.0 {
            return Ok(nodes(spread_e, law.light.shot_std().hypot(self.least_blur_e())));
        }
        if !is_sharp || self.offset_e > 0.0 {
            let at_full = law.least_pattern_std().max(1.0);
            return Ok(nodes(spread_e, self.least_blur_e().hypot(self.offset_e).min(at_full)));
        }
        let mut steps = Vec::new();
        for Class { kinds, blur_e, expected_e, adc, .. } in &self.classes {
            let law = kinds.most();
            let spread_e = expected_e * self.response;
            let charge_e = law.light.rate + law.dark.rate;
            let at = |level_e: f64| Step { at: (level_e - charge_e) / spread_e, width: blur_e / spread_e };
            let reach_e = REACH * spread_e + 9.0 * blur_e;
            let edges = adc.as_ref().map_or(Ok(Vec::new()), |adc| edges(adc, charge_e, reach_e))?;
            steps.extend(edges.into_iter().chain([law.full_well_e]).map(at));
        }
        stepped(steps)
    }

    fn brightest(&self) -> Option<&Class> {
        self.classes.iter().max_by(|a, b| a.expected_e.total_cmp(&b.expected_e))
    }

    /// What is added, in standard deviations of it, with weights, where codes follow it by steps, of photosites of one kind.
    fn offsets(&self, gained: &[Kinds]) -> Predicted<Vec<(f64, f64)>> {
        if self.offset_e == 0.0 {
            return Ok(vec![(0.0, 1.0)]);
        }
        let mut steps = Vec::new();
        for (k, kinds) in gained.iter().enumerate() {
            let Class { blur_e, adc: Some(adc), .. } = &self.classes[k] else { continue };
            if (0..k).any(|other| gained[other] == *kinds && self.classes[other].adc == Some(*adc)) {
                continue;
            }
            for charge_e in charges(kinds.most(), adc)? {
                let at = |edge_e: f64| Step { at: (edge_e - charge_e) / self.offset_e, width: blur_e / self.offset_e };
                steps.extend(edges(adc, charge_e, REACH * self.offset_e + 9.0 * blur_e)?.into_iter().map(at));
                too_many(steps.len())?;
            }
        }
        stepped(steps)
    }
}

fn too_many(steps: usize) -> Predicted<()> {
    if steps > MOST_STEPPED { Err(Unpredictable::Beyond(TOO_COARSE)) } else { Ok(()) }
}

/// Charges from which what is added leads to steps: each count where codes tell counts apart, else their mean, which shot noise blurs;
/// and full well where that is within reach.
fn charges(law: &Law, adc: &AdcRecord) -> Predicted<Vec<f64>> {
    const LEAST_WEIGHT: f64 = 1e-10;
    let full = law.full_well_e;
    let counted = [&law.light, &law.dark].into_iter().filter(|charge| charge.shot_std() > 0.0);
    let rate: f64 = counted.map(|charge| charge.rate).sum();
    let mean = law.light.rate + law.dark.rate;
    let mut found = if rate == 0.0 || adc.adu_per_e <= FEW {
        vec![mean]
    } else {
        if 18.0 * rate.sqrt() > MOST_STEPPED as f64 {
            return Err(Unpredictable::Beyond(TOO_COARSE));
        }
        let counts =
            super::counts::Charge { rate, pattern: 0.0, ..if law.light.rate > 0.0 { law.light } else { law.dark } };
        let counts = counts.counts(0.0).into_iter().filter(|count| count.weight > LEAST_WEIGHT);
        counts.map(|count| mean - rate + count.electrons).collect()
    };
    found.iter_mut().for_each(|charge| *charge = charge.min(full));
    if law.reaches_full_well() {
        found.push(full);
    }
    found.dedup();
    Ok(found)
}

/// Charges at which codes begin, within reach of one.
fn edges(adc: &AdcRecord, charge_e: f64, reach_e: f64) -> Predicted<Vec<f64>> {
    let top = f64::from(adc.top_code());
    let [first, last] =
        [charge_e - reach_e, charge_e + reach_e].map(|charge| (adc.level_at(charge) - 0.5).clamp(-1.0, top));
    let (first, last) = (first.floor().max(0.0), last.ceil().min(top - 1.0));
    if last < first {
        return Ok(Vec::new());
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "numbers of codes")]
    let (first, last) = (first as u32, last as u32);
    too_many((last - first) as usize)?;
    let all = (first..=last).map(|code| adc.electrons_at(f64::from(code) + 0.5));
    Ok(all.filter(|edge| (edge - charge_e).abs() <= reach_e).collect())
}

/// Standard normal numbers and their weights for a function that is flat but for such steps.
fn stepped(mut steps: Vec<Step>) -> Predicted<Vec<(f64, f64)>> {
    /// Panels no wider than this follow the normal law.
    const WIDEST: f64 = 1.625;
    /// Widths of a step on either side of it, and of a panel across it, over which the rule follows its law to 10⁻⁹.
    const BESIDE: [f64; 6] = [-9.0, -6.0, -2.0, 2.0, 6.0, 9.0];
    const LEAST: f64 = 1e-9;
    // Wide ones the panels follow as they are.
    const WIDE: f64 = 0.5;
    steps.retain(|step| step.width < WIDE && step.at.abs() < REACH + 9.0 * step.width);
    let mut ends: Vec<f64> = (-4..=4).map(|step| WIDEST * f64::from(step)).collect();
    for step in steps {
        match step.width > LEAST {
            true => ends.extend(BESIDE.map(|widths| step.at + widths * step.width)),
            false => ends.push(step.at),
        }
    }
    ends.retain(|end| end.abs() <= REACH);
    ends.sort_by(f64::total_cmp);
    ends.dedup_by(|next, kept| *next - *kept < LEAST);
    too_many(ends.len() * crate::numerics::gauss::NODES)?;
    let of_panel =
        |pair: &[f64]| panel(pair[0], pair[1]).map(|(z, weight)| (z, weight * density(z))).collect::<Vec<_>>();
    let mut found: Vec<(f64, f64)> = ends.windows(2).flat_map(of_panel).collect();
    let sum: f64 = found.iter().map(|(_, weight)| weight).sum();
    found.iter_mut().for_each(|(_, weight)| *weight /= sum);
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::metadata::PoissonKind;
    use crate::numerics::normal::cumulative;
    use crate::propagation::Equations;
    use crate::stages::noise::{LineNoise, Tails};
    use std::f64::consts::TAU;

    /// Photosites of one bit, whose codes change at 50 000 e⁻, of no noise but of rows, of columns, and 20 e⁻ of their own.
    fn of_one_bit(row_noise_e: f64, column_noise_e: f64) -> Photosite {
        let lines = LineNoise { row_noise_e, column_noise_e, ..LineNoise::default() };
        let model = NoiseModel {
            dark_e: 0.0,
            dcnu: 0.0,
            prnu: 0.0,
            read_noise_e: OWN_E,
            full_well_e: 1e6,
            dark_shot: false,
            signal_shot: false,
            poisson: PoissonKind::Exact,
            lines,
            tails: Tails::default(),
        };
        let adc = AdcRecord::new(1, 0.0, 1e-5);
        Photosite::of_electrons(model, Equations::Exact).digitized(adc)
    }

    const OWN_E: f64 = 20.0;

    /// Two normal numbers of correlation ρ are both above their means with the probability 1/4 + asin ρ/2π \[Sheppard1899], so that codes
    /// of one bit about their step have the covariance asin ρ/2π. Three nodes are off by 3·10⁻⁶ of it, others by 6·10⁻⁸ and less.
    #[test]
    fn codes_of_one_bit_have_the_covariance_of_two_signs() {
        for row in [5.0, 50.0, 400.0, 5e3, 2e4] {
            for column in [0.0, 300.0, 1e4] {
                let site = of_one_bit(row, column);
                let all = row * row + column * column + OWN_E * OWN_E;
                let of_signs = |shared: f64| (shared / all).asin() / TAU;
                let middle = [5e4; 3];
                let of_rows = site.curved(&[Axis::Row], middle).unwrap()[(0, 1)];
                assert!(
                    (of_rows - of_signs(row * row)).abs() < 1e-8 + 3e-6 * of_rows.min(1e-3),
                    "{row} {column}: {of_rows} {}",
                    of_signs(row * row)
                );
                let lines = site.lines(middle).unwrap();
                let beyond = site.beyond_lines(middle, &lines).unwrap()[0][2];
                let shared = if column > 0.0 { row * row + column * column } else { row * row };
                let wanted = of_signs(shared) - of_signs(row * row) - of_signs(column * column);
                assert!((beyond - wanted).abs() < 4e-8, "{row} {column}: {beyond} {wanted}");
            }
        }
    }

    /// Photosites that are all full are blurred by what is added alone, whatever shot noise their light has: about the edge of a code at full
    /// well two of a row are of one bit.
    #[test]
    fn rows_of_full_photosites_follow_the_edges_of_codes() {
        let [read_noise_e, row_noise_e] = [0.5_f64, 0.7];
        let lines = LineNoise { row_noise_e, ..LineNoise::default() };
        let plain = of_one_bit(0.0, 0.0);
        let model = NoiseModel { read_noise_e, full_well_e: 2005.0, signal_shot: true, lines, ..plain.model };
        // 2005 e⁻ are 328.5 codes.
        let site = Photosite::of_electrons(model, Equations::Exact).digitized(AdcRecord::new(11, 128.0, 0.1));
        let wanted = (row_noise_e.powi(2) / (row_noise_e.powi(2) + read_noise_e.powi(2))).asin() / TAU;
        let found = site.lines([8000.0; 3]).unwrap()[0].row[1];
        assert!((found - wanted).abs() < 1e-6, "{found} {wanted}");
        // More of the edges, and light whose counts would hide them: m(z) = Σ Φ((s z − 10 j)/r).
        for (read_noise_e, row_noise_e) in [(1.2, 1.0), (1.5, 1.0), (2.0, 1.0), (3.0, 2.0)] {
            let of_row = |z: f64| -> f64 {
                (-4..=4).map(|j| cumulative((row_noise_e * z - 10.0 * f64::from(j)) / read_noise_e)).sum()
            };
            let steps = (-400..=400).map(|step| 0.02 * f64::from(step));
            let wanted: f64 = steps.map(|z| 0.02 * density(z) * (of_row(z) - 4.5).powi(2)).sum();
            let lines = LineNoise { row_noise_e, ..LineNoise::default() };
            let site = Photosite { model: NoiseModel { read_noise_e, lines, ..model }, ..site };
            let found = site.lines([2600.0; 3]).unwrap()[0].row[1];
            assert!((found / wanted - 1.0).abs() < 1e-5, "{read_noise_e} {row_noise_e}: {found} {wanted}");
        }
    }

    /// Readings that jump by −a, 0 or a, a exponential of mean A, are off by nothing or, half of them, by a number of density
    /// e^(−|x|/A)/2A: the chance that such a one and a normal one together are beyond a code has a closed form. Means are sums of it over
    /// the codes from the lowest on, the covariance that of the trapezoidal rule. Panels of 5 nodes in a are good to 10⁻⁶ of what jumps do.
    #[test]
    fn jumps_beside_an_end_of_the_codes_bend_what_rows_share() {
        const OWN_E: f64 = 5.0;
        let beyond = |x: f64, jump_e: f64| {
            let [ratio, z] = [OWN_E / jump_e, x / OWN_E];
            let tail = |sign: f64| (0.5 * ratio * ratio - sign * x / jump_e).exp() * cumulative(sign * z - ratio);
            cumulative(-z) + 0.5 * (tail(1.0) - tail(-1.0))
        };
        for (row, jump_e, share, charge_e) in
            [(4.0, 12.0, 0.05, 2.0), (4.0, 12.0, 0.3, 11.0), (2.0, 5.0, 1.0, 0.0), (8.0, 6.0, 0.5, 7.0)]
        {
            let mut site = of_one_bit(row, 0.0);
            site.model.read_noise_e = OWN_E;
            site.model.tails = Tails { rts_share: share, rts_e: jump_e, ..Tails::default() };
            let site = Photosite { adc: Some(AdcRecord::new(12, 0.0, 1.0)), ..site };
            let of_line = |z: f64| {
                let chance = |code: i32| {
                    let x = f64::from(code) + 0.5 - charge_e - row * z;
                    (1.0 - 0.5 * share) * cumulative(-x / OWN_E) + 0.5 * share * beyond(x, jump_e)
                };
                (0..500).map(chance).sum::<f64>()
            };
            let steps = (-400..=400).map(|step| 0.02 * f64::from(step));
            let means: Vec<(f64, f64)> = steps.map(|z| (0.02 * density(z), of_line(z))).collect();
            let mean: f64 = means.iter().map(|(weight, mean)| weight * mean).sum();
            let wanted: f64 = means.iter().map(|(weight, of_line)| weight * (of_line - mean).powi(2)).sum();
            let found = site.lines([charge_e; 3]).unwrap()[0].row[1];
            assert!((found - wanted).abs() < 2e-6 * wanted, "{row} {jump_e} {charge_e}: {found} {wanted}");
        }
    }

    /// Whatever the charge, a code of one bit has the variance p (1 − p), of which what is shared is less.
    #[test]
    fn what_is_shared_is_no_more_than_there_is() {
        for off in [-9e3, -2e3, -30.0, 0.0, 30.0, 7e3] {
            let site = of_one_bit(5e3, 0.0);
            let expected = [5e4 + off; 3];
            let shared = site.curved(&[Axis::Row], expected).unwrap()[(0, 0)];
            let whole = site.moments(expected[0]).moments;
            assert!((whole.variance - whole.mean * (1.0 - whole.mean)).abs() < 1e-9);
            assert!(
                shared <= whole.variance && shared > 0.97 * whole.variance,
                "{off}: {shared} of {}",
                whole.variance
            );
        }
    }
}
