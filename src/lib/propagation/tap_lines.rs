//! What photosites of a row, or of a column, share where several amplifiers read them.
//!
//! The reading of a photosite of class k behind amplifier a is y_ak(x, u, v), x what is its own, u and v what its row has
//! (`lines`); amplifiers differ by what they make of a charge, and the row is the same to all, so that
//!
//! cov(y_ak, y_bl) = cov(m_ak(u, v), m_bl(u, v)),  m_ak(u, v) = E\[y_ak | u, v]
//!
//! and so for columns. Where codes follow straight each has its own slope, g_ak g_bl \[σ² + E_k E_l s²].
//!
//! A drift of the black level is one number of a row, which all amplifiers meet with their slopes; over a flat field that of the flat field
//! is another.

use super::bent_lines::BentLine;
use super::drift::NUMBERS;
use super::law::Law;
use super::line_sums::{bent, curved};
use super::lines::{Axis, DRIFT_CUT};
use super::moments::Prediction;
use super::photosite::Photosite;
use super::unpredictable::{Predicted, Unpredictable};
use crate::metadata::{AdcRecord, AverageRecord};
use nalgebra::{DMatrix, Matrix3};

/// Photosites of an amplifier, and the signal electrons that R, G and B of them expect.
pub(super) type Lit = (Photosite, [f64; 3]);

/// Covariances of photosites that share a row, and of those that share a column, by amplifiers and classes.
#[derive(Debug, Clone, PartialEq)]
pub struct TapLines {
    /// Of two in a row, its drift included: class k of the group g stands at 3 g + k.
    pub row: DMatrix<f64>,
    /// What of that is drift of the black level; none where it does not drift.
    pub drift: Option<TapDrift>,
    /// Of two in a column.
    pub column: DMatrix<f64>,
    /// Of three planes: what samples of one place share beyond what they do by row and by column, by group.
    pub together: Vec<Matrix3<f64>>,
    /// How photosites of a row, and of a column, go together beyond these; none where they follow what they share straight.
    pub bent: [Option<BentLine>; 2],
}

/// The drift of the black level, which rows near each other share in part.
#[derive(Debug, Clone, PartialEq)]
pub struct TapDrift {
    /// What the samples of a class of a group have of its numbers, of variance 1, where these stand in [`TapLines::row`].
    pub loads: Vec<[f64; NUMBERS]>,
    /// Rows from one knot to the next.
    pub rows_per_knot: f64,
}

impl TapDrift {
    /// Of photosites of such moments behind each of some amplifiers, of an average of exposures where there is one; none where they do not
    /// drift.
    fn of(sites: &[Lit], moments: &[[Prediction; 3]], average: Option<&AverageRecord>) -> Predicted<Option<Self>> {
        let lines =
            moments.iter().flat_map(|sites| [0, 1, 2].map(|k| (sites[k].lines.drift[k], sites[k].lines.drift_rows)));
        let (variances, rows): (Vec<f64>, Vec<f64>) = lines.unzip();
        let rows_per_knot = rows.into_iter().fold(0.0, f64::max);
        let mut loads: Vec<[f64; NUMBERS]> =
            variances.into_iter().map(|variance| [variance.max(0.0).sqrt(), 0.0]).collect();
        if sites.iter().any(|(photosite, _)| photosite.flat.is_some()) {
            let slopes = sites.iter().map(|(photosite, expected_e)| photosite.line_slopes(*expected_e));
            let slopes = slopes.collect::<Predicted<Option<Vec<_>>>>()?.unwrap_or_default();
            let of_site = |((photosite, expected_e), [slopes, _]): (&Lit, [[f64; 3]; 2])| {
                photosite.drift_loads(photosite.ratios(*expected_e), slopes, average)
            };
            loads = sites.iter().zip(slopes).flat_map(of_site).collect();
        }
        Ok(loads.iter().flatten().any(|load| *load != 0.0).then_some(Self { loads, rows_per_knot }))
    }

    /// What two photosites that stand at such places share in a row.
    pub fn between(&self, one: usize, other: usize) -> f64 {
        self.loads[one].iter().zip(self.loads[other]).map(|(one, other)| one * other).sum()
    }

    /// How many numbers of a knot any of them has.
    pub fn rank(&self) -> usize {
        if self.loads.iter().any(|load| load[1] != 0.0) { NUMBERS } else { 1 }
    }
}

impl TapLines {
    /// Of photosites of such moments behind each of some amplifiers, of an average of exposures where there is one; none where they share
    /// nothing.
    ///
    /// # Errors
    ///
    /// [`Unpredictable::Beyond`] where no formula tells.
    pub(super) fn of(
        sites: &[Lit],
        moments: &[[Prediction; 3]],
        average: Option<&AverageRecord>,
    ) -> Predicted<Option<Self>> {
        if !sites.iter().any(|(photosite, _)| photosite.has_lines()) {
            return Ok(None);
        }
        let mut whole = shared(sites)?;
        if let Some(record) = average {
            let one = sites.iter().map(|(photosite, expected_e)| (photosite.one_exposure(), *expected_e));
            let one: Vec<Lit> = one.collect();
            let scale = |place: usize| sites[place / 3].0.flat.map_or(1.0, |flat| flat.ratios[place % 3]);
            let of_samples = |anew: DMatrix<f64>| {
                DMatrix::from_fn(anew.nrows(), anew.ncols(), |a, b| scale(a) * scale(b) * anew[(a, b)])
            };
            let temporal = shared(&one)?.into_iter().zip(fixed(&one)?).map(|(whole, fixed)| of_samples(whole - fixed));
            let off = 1.0 - 1.0 / f64::from(record.frames.max(1));
            whole.iter_mut().zip(temporal).for_each(|(whole, temporal)| *whole -= off * temporal);
        }
        let [row, column] = whole;
        let together = |sites: &[Prediction; 3]| Matrix3::from_fn(|k, l| sites[k].lines.together[l]);
        let drift = TapDrift::of(sites, moments, average)?;
        let bent = bent_lines(sites, average.map(|record| record.frames))?;
        Ok(Some(Self { row, drift, column, together: moments.iter().map(together).collect(), bent }))
    }

    /// What of that is the same in every exposure.
    ///
    /// # Errors
    ///
    /// As [`Self::of`].
    pub(super) fn fixed(sites: &[Lit]) -> Predicted<Self> {
        let [row, column] = fixed(sites)?;
        let together = vec![Matrix3::zeros(); sites.len()];
        Ok(Self { row, drift: None, column, together, bent: [None, None] })
    }

    /// What of that is drawn anew in each exposure, which has such moments at photosites; none where they share nothing.
    ///
    /// # Errors
    ///
    /// As [`Self::of`].
    pub(super) fn drawn_anew(sites: &[Lit], moments: &[[Prediction; 3]]) -> Predicted<Option<Self>> {
        if !sites.iter().any(|(photosite, _)| photosite.has_lines()) {
            return Ok(None);
        }
        let one = sites.iter().map(|(photosite, expected_e)| (photosite.one_exposure(), *expected_e));
        let one: Vec<Lit> = one.collect();
        let ([whole_row, whole_column], [row, column]) = (shared(&one)?, fixed(&one)?);
        Ok(Some(Self {
            row: whole_row - row,
            drift: TapDrift::of(sites, moments, None)?,
            column: whole_column - column,
            together: vec![Matrix3::zeros(); sites.len()],
            bent: [None, None],
        }))
    }

    /// The matrices of rows and of columns.
    pub fn axes(&self) -> [&DMatrix<f64>; 2] {
        [&self.row, &self.column]
    }

    /// What two photosites that stand at such places share in a row of the drift of its black level.
    pub fn drift(&self, one: usize, other: usize) -> f64 {
        self.drift.as_ref().map_or(0.0, |drift| drift.between(one, other))
    }

    /// The same of what is their row's alone.
    pub fn row_alone(&self, one: usize, other: usize) -> f64 {
        self.row[(one, other)] - self.drift(one, other)
    }

    /// What of the variance of photosites that stand at such a place is their own.
    pub fn own(&self, at: usize, variance: f64) -> f64 {
        (variance - self.row[(at, at)] - self.column[(at, at)]).max(0.0)
    }

    /// What of the third and fourth cumulants of photosites of such moments that stand at such a place is their own: no fourth is less than
    /// −2κ₂².
    pub fn own_cumulants(&self, at: usize, site: &Prediction) -> [f64; 2] {
        let own = self.own(at, site.moments.variance);
        let of_lines = self.bent.iter().flatten().map(|line| line.cumulants(at));
        let [third, fourth] = of_lines.fold([0.0; 2], |sum, of| [sum[0] + of[0], sum[1] + of[1]]);
        [site.third - third, (site.fourth() - fourth).max(-2.0 * own * own)]
    }

    /// Whether photosites follow what a line has on a curve.
    pub fn are_bent(&self) -> bool {
        self.bent.iter().any(Option::is_some)
    }
}

impl Photosite {
    /// Whether one photosite in 10¹³ or more of these signals follows what its line has on a curve, so that some lines scatter by less than
    /// others; samples over a flat field are not told.
    pub(super) fn bends_lines(&self, expected_e: [f64; 3]) -> Predicted<bool> {
        if !self.has_lines() || self.flat.is_some() {
            return Ok(false);
        }
        let ends = |adc: AdcRecord| expected_e.iter().any(|light_e| !Law::of(&self.model, *light_e).is_within(&adc));
        let is_corrected = self.darks[0].is_some();
        Ok(self.is_curved_in_lines(expected_e)? || is_corrected && self.adc.is_some_and(ends))
    }
}

/// How photosites of lines go together beyond their covariances, where some of them follow what these have on a curve, in an average of so many
/// exposures where it is one.
fn bent_lines(sites: &[Lit], frames: Option<u32>) -> Predicted<[Option<BentLine>; 2]> {
    let bends = sites.iter().map(|(photosite, expected_e)| photosite.bends_lines(*expected_e));
    if !bends.collect::<Predicted<Vec<bool>>>()?.contains(&true) {
        return Ok([None, None]);
    }
    // Rows that drift are not drawn apart.
    if sites.iter().any(|(photosite, _)| photosite.drifts()) {
        return Err(Unpredictable::Beyond(DRIFT_CUT));
    }
    // What comes off adds to what is shared alone.
    let codes: Vec<Lit> =
        sites.iter().map(|(photosite, expected_e)| (photosite.less_dark_frames(0), *expected_e)).collect();
    let found = Axis::ALL.map(|axis| bent(&codes, axis, frames));
    if frames.is_some() || sites.iter().any(|(photosite, _)| photosite.darks[0].is_some()) {
        // Of these less is known, and lines are taken to be straight.
        return Ok(found.map(|line| line.ok().flatten()));
    }
    let [row, column] = found;
    Ok([row?, column?])
}

/// Covariances in a row, or column, of photosites that were divided by one flat field, of such slopes.
fn shared_by_quotients(sites: &[Lit], slopes: &[[[f64; 3]; 2]], axis: Axis) -> DMatrix<f64> {
    let added: Vec<_> =
        sites.iter().map(|(photosite, expected_e)| photosite.added_by(axis, *expected_e).unwrap_or_default()).collect();
    DMatrix::from_fn(3 * sites.len(), 3 * sites.len(), |a, b| {
        let [(one, k), (other, l)] = [a, b].map(|place| (place / 3, place % 3));
        slopes[one][0][k] * slopes[other][0][l] * added[one].between([k, l], &added[other])
    })
}

fn fixed(sites: &[Lit]) -> Predicted<[DMatrix<f64>; 2]> {
    let means = sites.iter().map(|(photosite, expected_e)| (photosite.over_exposures(), *expected_e));
    shared(&means.collect::<Vec<_>>())
}

/// Covariances in a row, and in a column.
fn shared(sites: &[Lit]) -> Predicted<[DMatrix<f64>; 2]> {
    let slopes = sites.iter().map(|(photosite, expected_e)| photosite.line_slopes(*expected_e));
    let slopes = slopes.collect::<Predicted<Option<Vec<_>>>>()?;
    let (Some(slopes), Some((first, _))) = (slopes, sites.first()) else {
        return Ok([curved(sites, &[Axis::Row])?, curved(sites, &[Axis::Column])?]);
    };
    if first.flat.is_some() {
        return Ok(Axis::ALL.map(|axis| shared_by_quotients(sites, &slopes, axis)));
    }
    let signals: Vec<[f64; 3]> =
        sites.iter().map(|(photosite, expected_e)| photosite.line_signals(*expected_e)).collect();
    Ok(Axis::ALL.map(|axis| {
        let terms = first.terms(axis);
        let at = |index: usize| {
            let (group, class) = (index / 3, index % 3);
            (signals[group][class], slopes[group].map(|slopes| slopes[class]))
        };
        DMatrix::from_fn(3 * sites.len(), 3 * sites.len(), |a, b| terms.between(at(a), at(b)))
    }))
}
