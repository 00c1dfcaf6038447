//! Exact whitening of a disagreement whose noise is a sum of moving averages: `V = L Lᵀ`, banded, `r = L⁻¹ u`, and the
//! derivatives of `r` with respect to what moves `V` and `u`.
//!
//! Where the weights of all rows are the same, the rows of `L` settle after a few times the band, from the start and
//! from each masked reading on, and the last one stands for all up to the next masked reading; so do their derivatives.
//!
//! A long stretch is whitened in windows. Each begins with the last values of the one before it, as many as the band: the *lead*,
//! whose rows and whitened values are known, so that the result is that of the whole stretch.

use std::ops::Range;

use crate::number::{Number, Real};
use crate::rows::Rows;

/// Rows of the factor in a row that must agree before it counts as settled: one more than a rounding that happens to
/// repeat, for the bands of all models here.
const SETTLED_ROWS: usize = 6;
/// Relative difference that rounding makes.
const ROUNDING: f64 = 4.0 * f64::EPSILON;
/// Relative difference of derivatives that does not count: they enter a step of a solver, not an estimate.
pub(crate) const DERIVATIVE_ROUNDING: f64 = 1e-13;
/// Values from which all lags are subtracted before the next ones: so many stay in the fastest memory. Chosen.
const RUN_PART: usize = 512;

/// Noise that enters the disagreement through rows of weights.
pub(crate) struct Source<'a, T> {
    pub(crate) rows: &'a Rows<T>,
    pub(crate) variance: &'a Variance,
    /// Sample of the stretch that rows count from.
    pub(crate) first_sample: usize,
}

impl<T: Real> Source<'_, T> {
    /// First reading that enters value `k`.
    fn reading(&self, k: usize) -> usize {
        self.first_sample + self.rows.start + k
    }
}

/// Variance of the white noise of readings, K².
#[derive(Clone, Debug)]
pub(crate) struct Variance {
    plain: f64,
    /// Masked readings, in rising order, each with its own.
    masked: Vec<(usize, f64)>,
}

impl Variance {
    /// One variance for all readings.
    pub(crate) fn same(plain: f64) -> Self {
        Self { plain, masked: Vec::new() }
    }

    /// - `std_k`: standard deviation of all readings but those that are masked, K
    /// - `masked`: those, in rising order, with the standard deviation of each, K
    pub(crate) fn masked(std_k: f64, masked: &[(usize, f64)]) -> Self {
        Self { plain: std_k * std_k, masked: masked.iter().map(|(k, std_k)| (*k, std_k * std_k)).collect() }
    }

    pub(crate) fn at(&self, sample: usize) -> f64 {
        self.masked.binary_search_by_key(&sample, |(k, _)| *k).map_or(self.plain, |place| self.masked[place].1)
    }

    /// The first masked reading from `sample` on.
    fn next_masked(&self, sample: usize) -> Option<usize> {
        self.masked.get(self.masked.partition_point(|(k, _)| *k < sample)).map(|(k, _)| *k)
    }

    fn has_masked_in(&self, samples: Range<usize>) -> bool {
        self.next_masked(samples.start).is_some_and(|m| m < samples.end)
    }
}

/// Whether a masked reading enters value `k`, or one within `band` before it.
fn is_masked_around<T: Real>(sources: &[Source<'_, T>], k: usize, band: usize) -> bool {
    sources.iter().any(|source| {
        let first = source.reading(k);
        source.variance.has_masked_in(first.saturating_sub(band)..first + source.rows.width)
    })
}

/// The first value after `k` around which a masked reading is, where none is around `k` itself.
fn plain_end<T: Real>(sources: &[Source<'_, T>], k: usize, band: usize) -> usize {
    let ends = sources.iter().filter_map(|source| {
        let masked = source.variance.next_masked(source.reading(k).saturating_sub(band))?;
        Some((masked + 1).saturating_sub(source.rows.width + source.reading(0)))
    });
    ends.fold(usize::MAX, usize::min).max(k + 1)
}

/// The row that is kept for row `k` of a factor: the last one stands for all after it.
fn kept_for(kept: &[u32], k: usize) -> usize {
    kept[k.min(kept.len() - 1)] as usize
}

/// The factor `L` of a covariance: lags `0..=band` of each row; rows that are the same are kept once.
#[derive(Clone, Debug)]
pub(crate) struct Factor {
    band: usize,
    rows: Vec<f64>,
    /// Which of the rows that are kept stands for each row of `L`, up to the last that is not the one before it.
    kept: Vec<u32>,
    /// Rows of `L`.
    len: usize,
    /// Entries of a row of the covariance without masked readings, where all are the same.
    same: Vec<f64>,
    /// Rows in a row that agreed at the end.
    agreeing: usize,
    /// Whether all of its rows follow from `same` alone: it begins a stretch, its rows of weights are the same, and no masked
    /// reading enters it.
    is_stationary: bool,
}

impl Factor {
    pub(crate) fn empty() -> Self {
        Self {
            band: 0,
            rows: Vec::new(),
            kept: Vec::new(),
            len: 0,
            same: Vec::new(),
            agreeing: 0,
            is_stationary: false,
        }
    }

    /// Values before one that it is correlated with.
    pub(crate) fn band(&self) -> usize {
        self.band
    }

    /// Becomes the factor of the covariance of `count` values, in its own memory.
    ///
    /// - `before`: that of the window before, where the first of the values are a lead
    /// - `like`: that of another stretch, whose rows may be the same
    pub(crate) fn compute(
        &mut self,
        sources: &[Source<'_, f64>],
        count: usize,
        before: Option<&Self>,
        like: Option<&Self>,
    ) {
        self.band = sources.iter().map(|s| s.rows.width).max().unwrap_or(1) - 1;
        let (band, stride) = (self.band, self.band + 1);
        let settles = sources.iter().all(|s| s.rows.is_same()) && count > band;
        self.same.clear();
        if settles {
            self.same.extend((0..stride).map(|lag| covariance_of_same(sources, lag)));
        }
        self.rows.clear();
        self.kept.clear();
        self.len = 0;
        self.is_stationary =
            before.is_none() && settles && !is_masked_around(sources, 0, band) && plain_end(sources, 0, band) >= count;
        let is_alike = |like: &&Self| like.is_stationary && like.len() >= count && like.same == self.same;
        if let Some(like) = like.filter(is_alike).filter(|_| self.is_stationary) {
            return self.begin_as(like, count);
        }
        let mut agreeing = 0;
        if !settles {
            self.rows.reserve_exact(count * stride);
        }
        let has_lead = before.is_some();
        if let Some(before) = before {
            agreeing = before.agreeing;
            self.lead(before);
        }
        while self.len < count {
            let k = self.len;
            let is_plain = settles && !is_masked_around(sources, k, band);
            if is_plain && agreeing >= SETTLED_ROWS {
                self.len = plain_end(sources, k, band).min(count);
                continue;
            }
            let from = self.rows.len();
            self.rows.resize(from + stride, 0.0);
            let (before, row) = self.rows.split_at_mut(from);
            let older_row = |k: usize| &before[kept_for(&self.kept, k) * stride..][..stride];
            let reach = band.min(k);
            if is_plain {
                row[..=reach].copy_from_slice(&self.same[..=reach]);
            } else {
                covariances(sources, k, &mut row[..=reach]);
            }
            // Each entry needs the one before it, which is therefore subtracted last, and the inverse is ready by then.
            for lag in (1..=reach).rev() {
                let other = &older_row(k - lag)[..=reach - lag];
                let of_both = row[lag + 1..=reach].iter().zip(&other[1..]).rev();
                row[lag] = of_both.fold(row[lag], |entry, (a, b)| entry - a * b) * (1.0 / other[0]);
            }
            let variance = row[1..=reach].iter().rev().fold(row[0], |entry, l| entry - l * l);
            row[0] = variance.max(f64::MIN_POSITIVE).sqrt();
            let scale = row[0];
            let agrees = |(a, b): (&f64, &f64)| (a - b).abs() <= ROUNDING * scale;
            let has_settled = is_plain && (k > band || has_lead) && row.iter().zip(older_row(k - 1)).all(agrees);
            agreeing = if has_settled { agreeing + 1 } else { 0 };
            self.push(from / stride);
        }
        self.agreeing = agreeing;
    }

    /// Adds a row, for which the kept one in this place stands: another than the one before it.
    fn push(&mut self, kept: usize) {
        if let Some(&last) = self.kept.last() {
            self.kept.resize(self.len, last);
        }
        self.kept.push(kept as u32);
        self.len += 1;
    }

    /// Whether all of its rows follow from one of the covariance.
    pub(crate) fn is_stationary(&self) -> bool {
        self.is_stationary
    }

    /// Becomes the first `count` rows of another.
    fn begin_as(&mut self, like: &Self, count: usize) {
        self.kept.extend_from_slice(&like.kept[..count.min(like.kept.len())]);
        self.len = count;
        let rows = kept_for(&like.kept, count - 1) + 1;
        self.rows.extend_from_slice(&like.rows[..rows * (self.band + 1)]);
        self.agreeing = if count == like.len() { like.agreeing } else { 0 };
    }

    /// Keeps no more than the next window begins with, if the rows have not settled: there are as many of them as of values.
    pub(crate) fn shorten(&mut self) {
        // A window no longer than the band is its own end.
        if self.len > self.band && 2 * self.rows.len() > self.len * (self.band + 1) {
            let mut end = Self { band: self.band, agreeing: self.agreeing, ..Self::empty() };
            end.lead(self);
            *self = end;
        }
    }

    /// Rows that there are, those of the lead as well.
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// Begins with the last rows of the window before, as many as the band.
    fn lead(&mut self, before: &Self) {
        debug_assert_eq!(before.band, self.band, "windows of one stretch");
        let last = before.len - self.band..before.len;
        for k in last.clone() {
            if k == last.start || !before.is_settled(k) {
                self.push(self.rows.len() / (self.band + 1));
                self.rows.extend_from_slice(before.row(k));
            } else {
                self.len += 1;
            }
        }
    }

    /// Row `k` of `L`: the standard deviation of value `k` given those before it, then the lags.
    pub(crate) fn row(&self, k: usize) -> &[f64] {
        let stride = self.band + 1;
        &self.rows[kept_for(&self.kept, k) * stride..][..stride]
    }

    /// Whether row `k` is the one before it.
    fn is_settled(&self, k: usize) -> bool {
        k > 0 && kept_for(&self.kept, k) == kept_for(&self.kept, k - 1)
    }

    /// `L⁻¹ u` in place.
    ///
    /// - `first_row`: the row that belongs to the first value
    /// - `lead`: so many values are whitened already
    pub(crate) fn whiten(&self, u: &mut [f64], first_row: usize, lead: usize) {
        let mut k = lead;
        while k < u.len() {
            let row = self.row(first_row + k);
            let run = self.run(first_row, k, u.len());
            if run.is_empty() {
                let reach = self.band.min(k);
                let (before, rest) = u.split_at_mut(k);
                rest[0] = (rest[0] - backwards(&row[1..=reach], &before[k - reach..])) / row[0];
                k += 1;
            } else {
                k = run.end;
                whiten_run(row, u, run);
            }
        }
    }

    /// The values from `k` on, before `count`, that are whitened by the row before `k`: none where row `k` is another, or where fewer
    /// values than the band come before it.
    fn run(&self, first_row: usize, k: usize, count: usize) -> Range<usize> {
        let row = first_row + k;
        if k < self.band || !self.is_settled(row) {
            return k..k;
        }
        let own = kept_for(&self.kept, row);
        let mut listed = self.kept.get(row..).unwrap_or(&[]).iter().take(count - k);
        // After those that are listed the last one stands for all.
        k..listed.position(|kept| *kept as usize != own).map_or(count, |same| k + same)
    }

    /// `L⁻ᵀ r` in place: of a whitened residual `V⁻¹ u`.
    pub(crate) fn unwhiten_transposed(&self, r: &mut [f64]) {
        self.unwhiten_transposed_from(r, 0);
    }

    /// As [`Self::unwhiten_transposed`] of the values after a lead, from which it takes off what they have in common.
    pub(crate) fn unwhiten_transposed_from(&self, r: &mut [f64], lead: usize) {
        for k in (lead..r.len()).rev() {
            let row = self.row(k);
            let (before, rest) = r.split_at_mut(k);
            let w = rest[0] / row[0];
            rest[0] = w;
            for (b, l) in before.iter_mut().rev().zip(&row[1..]) {
                *b -= l * w;
            }
        }
    }
}

/// How an energy depends on the disagreement `u` and on its covariance `V`: derivatives by each, with `r = L⁻¹ u` and `q` that
/// by `r`. That by `u` is `w = L⁻ᵀ q`, that by `L` is `−w rᵀ`, and what follows for `V = L Lᵀ` is the factorisation gone
/// through backwards (reverse mode; Smith 1995, "Differentiation of the Cholesky algorithm"). No reading is masked.
#[derive(Clone, Debug, Default)]
pub(crate) struct Adjoint {
    /// By each value of the disagreement.
    pub(crate) by_value: Vec<f64>,
    /// By each entry of its covariance, lags `0..=band` of each row; and by those of `L`, where no row after it has been gone
    /// through.
    by_covariance: Vec<f64>,
    /// Entries from row to row: as many as the widest of the factors has.
    stride: usize,
}

impl Adjoint {
    /// - `gradient`: `q` of all values
    /// - `band`: the widest of the factors
    pub(crate) fn begin(gradient: Vec<f64>, band: usize) -> Self {
        let stride = band + 1;
        let by_covariance = vec![0.0; gradient.len() * stride];
        Self { by_value: gradient, by_covariance, stride }
    }

    /// Goes through the rows of a window, the last one first, after the windows that follow it.
    ///
    /// - `residual`: `r` of all values
    /// - `all`: values of the window, its lead among them
    pub(crate) fn go_back(&mut self, factor: &Factor, residual: &[f64], all: Range<usize>, lead: usize) {
        let (stride, first) = (self.stride, all.start);
        factor.unwhiten_transposed_from(&mut self.by_value[all.clone()], lead);
        let by = &mut self.by_covariance[first * stride..all.end * stride];
        let residual = &residual[all];
        for k in (lead..residual.len()).rev() {
            let reach = factor.band.min(k);
            let w = self.by_value[first + k];
            let (before, rest) = by.split_at_mut(k * stride);
            let own = &mut rest[..=reach];
            own.iter_mut().zip(residual[..=k].iter().rev()).for_each(|(by, r)| *by -= w * r);
            let l = &factor.row(k)[..=reach];
            own[0] *= 0.5 / l[0];
            let of_diagonal = 2.0 * own[0];
            own[1..].iter_mut().zip(&l[1..]).for_each(|(by, l)| *by -= of_diagonal * l);
            for lag in 1..=reach {
                let other = factor.row(k - lag);
                let by_other = &mut before[(k - lag) * stride..][..stride];
                own[lag] /= other[0];
                let by_entry = own[lag];
                by_other[0] -= by_entry * l[lag];
                for older in lag + 1..=reach {
                    own[older] -= by_entry * other[older - lag];
                    by_other[older - lag] -= by_entry * l[older];
                }
            }
        }
    }

    /// How fast the energy changes with the covariance of some values.
    ///
    /// - `band`: that of the factor
    /// - `sources`: what makes the covariance, with derivatives; a source whose rows have none may be left out
    pub(crate) fn slope(&self, band: usize, sources: &[Source<'_, Number>], all: Range<usize>, lead: usize) -> f64 {
        let by = &self.by_covariance[all.start * self.stride..all.end * self.stride];
        let rows = by.chunks_exact(self.stride).map(|row| &row[..=band]).enumerate().skip(lead);
        if sources.iter().all(|source| source.rows.is_same()) {
            let mut sums = vec![0.0; band + 1];
            rows.for_each(|(_, row)| sums.iter_mut().zip(row).for_each(|(sum, by)| *sum += by));
            return sums.iter().enumerate().map(|(lag, by)| by * derivative_of_same(sources, lag)).sum();
        }
        let mut entries = vec![0.0; band + 1];
        let of_row = |(k, row): (usize, &[f64])| -> f64 {
            let entries = &mut entries[..=band.min(k)];
            derivatives_of_covariances(sources, k, entries);
            row.iter().zip(entries).map(|(by, entry)| by * *entry).sum()
        };
        rows.map(of_row).sum()
    }
}

/// The derivative of a factor, row after row.
#[derive(Clone, Debug, Default)]
pub(crate) struct FactorDerivative {
    now: Last,
    same: Vec<f64>,
    /// Values of the stretch up to the end of the last window.
    end: usize,
    /// The first window of an earlier stretch.
    first: Remembered,
}

/// The last rows of the derivative of a factor.
#[derive(Clone, Debug, Default)]
struct Last {
    /// A ring: after the row in place `at` comes the next one.
    recent: Vec<f64>,
    at: usize,
    row: Vec<f64>,
    /// Rows in a row that agreed at the end.
    agreeing: usize,
    /// Whether the last row stands for those that follow.
    is_kept: bool,
    /// The largest entry of all rows of the stretch.
    largest: f64,
}

/// The first window of a stretch that no masked reading enters: covariances decide its rows.
#[derive(Clone, Debug, Default)]
struct Remembered {
    /// Entries of a row of the covariance, and of its derivative.
    same: [Vec<f64>; 2],
    /// Rows up to the one that stands for those that follow, or to the end of the window.
    rows: Vec<f64>,
    /// Values of the window.
    count: usize,
    /// The last rows at its end.
    after: Last,
}

impl Remembered {
    fn begin(&mut self, same: [&Vec<f64>; 2]) {
        self.same.iter_mut().zip(same).for_each(|(own, same)| own.clone_from(same));
        self.rows.clear();
        self.count = 0;
    }

    /// Whether these are the rows of a window of `count` values.
    fn is_of(&self, same: [&Vec<f64>; 2], count: usize) -> bool {
        self.count == count && self.same[0] == *same[0] && self.same[1] == *same[1]
    }
}

impl FactorDerivative {
    /// Begins a stretch whose factor has bands of `band`.
    pub(crate) fn begin(&mut self, band: usize) {
        let stride = band + 1;
        let Last { recent, at, row, agreeing, is_kept, largest } = &mut self.now;
        *at = 0;
        recent.clear();
        recent.resize(stride * stride, 0.0);
        row.clear();
        row.resize(stride, 0.0);
        (self.end, *agreeing, *is_kept, *largest) = (0, 0, false, 0.0);
    }

    /// Goes past `count` values where no source has derivatives, if there is nothing left of those before; whether there is not.
    pub(crate) fn passes(&mut self, count: usize) -> bool {
        let Last { recent, row, is_kept, largest, .. } = &self.now;
        let stride = row.len();
        let rows = if *is_kept { row } else { recent };
        let is_still = rows.iter().all(|d| d.abs() <= DERIVATIVE_ROUNDING * largest);
        if is_still {
            let end = self.end + count;
            self.begin(stride - 1);
            self.end = end;
        }
        is_still
    }

    /// The derivative of `r = L⁻¹ u`, in place of that of `u`: `L dr = du − dL r`, where `dL` follows from the
    /// derivative of `V = L Lᵀ` row by row.
    ///
    /// - `factor`: `L`
    /// - `sources`: what makes `V`, with the derivatives of the rows; a source whose rows have none may be left out
    /// - `residual`: `r`
    /// - `values`: the derivative of `u`, and then of `r`
    /// - `lead`: so many values are whitened already
    /// - `first_row`: the row of `factor` that belongs to the first value
    pub(crate) fn whiten(
        &mut self,
        factor: &Factor,
        first_row: usize,
        sources: &[Source<'_, Number>],
        residual: &[f64],
        values: &mut [f64],
        lead: usize,
    ) {
        let stride = factor.band + 1;
        let settles = !factor.same.is_empty();
        self.same.clear();
        if settles {
            self.same.extend((0..stride).map(|lag| derivative_of_same(sources, lag)));
        }
        let first = self.end - lead;
        let begins = factor.is_stationary && self.end == 0;
        if begins && self.first.is_of([&factor.same, &self.same], values.len()) {
            self.end = values.len();
            let Remembered { rows, after, .. } = &self.first;
            let last = rows.len() / stride - 1;
            let mut k = 0;
            while k < values.len() {
                let row = &rows[k.min(last) * stride..][..stride];
                k = whiten_on((factor, first_row), (row, k > last), residual, values, k);
            }
            self.now.clone_from(after);
            return;
        }
        if begins {
            self.first.begin([&factor.same, &self.same]);
        }
        let mut k = lead;
        while k < values.len() {
            let is_new = self.advance(factor, first_row, sources, k);
            if begins && is_new {
                self.first.rows.extend_from_slice(&self.now.row);
            }
            k = whiten_on((factor, first_row), (&self.now.row, !is_new), residual, values, k);
        }
        self.end = first + values.len();
        if begins {
            self.first.count = values.len();
            self.first.after.clone_from(&self.now);
        }
    }

    /// Goes to row `k` of `dL`; whether it had to be computed.
    fn advance(&mut self, factor: &Factor, first_row: usize, sources: &[Source<'_, Number>], k: usize) -> bool {
        let (band, stride) = (factor.band, factor.band + 1);
        // Where the factor has settled, its derivative does soon after.
        let is_settled = factor.is_settled(first_row + k);
        let is_new = !(is_settled && self.now.agreeing >= SETTLED_ROWS);
        if is_new {
            if self.now.is_kept {
                // All rows in reach were the one that was kept.
                let Last { recent, row, .. } = &mut self.now;
                recent.chunks_exact_mut(stride).for_each(|recent| recent.copy_from_slice(row));
            }
            let is_plain = !factor.same.is_empty() && (is_settled || !is_masked_around(sources, k, band));
            self.next_row(factor, first_row, sources, k, is_plain);
            let Last { recent, at, row, agreeing, largest, .. } = &mut self.now;
            let larger = |most: f64, d: &f64| if d.abs() > most { d.abs() } else { most };
            let largest_here = row.iter().fold(0.0, larger);
            *largest = larger(*largest, &largest_here);
            let before = &recent[*at * stride..][..stride];
            let agrees = |(a, b): (&f64, &f64)| (a - b).abs() <= DERIVATIVE_ROUNDING * largest_here;
            let has_settled = is_settled && row.iter().zip(before).all(agrees);
            *agreeing = if has_settled { *agreeing + 1 } else { 0 };
            *at = if *at == band { 0 } else { *at + 1 };
            recent[*at * stride..][..stride].copy_from_slice(row);
        }
        self.now.is_kept = is_settled && self.now.agreeing >= SETTLED_ROWS;
        is_new
    }

    /// Row `k` of `dL`, after the one in place `at`.
    fn next_row(
        &mut self,
        factor: &Factor,
        first_row: usize,
        sources: &[Source<'_, Number>],
        k: usize,
        is_plain: bool,
    ) {
        let stride = factor.band + 1;
        let reach = factor.band.min(k);
        let l = &factor.row(first_row + k)[..=reach];
        let Last { recent, at, row, .. } = &mut self.now;
        if is_plain {
            row[..=reach].copy_from_slice(&self.same[..=reach]);
        } else {
            derivatives_of_covariances(sources, k, &mut row[..=reach]);
        }
        for lag in (1..=reach).rev() {
            let other = &factor.row(first_row + k - lag)[..=reach - lag];
            // The row before is in place `at`.
            let place = if *at + 1 >= lag { *at + 1 - lag } else { *at + 1 + stride - lag };
            let d_other = &recent[place * stride..][..=reach - lag];
            let of_row = row[lag + 1..=reach].iter().zip(&l[lag + 1..]);
            // As in a row of the factor, what the entry before this one adds is subtracted last.
            let products = of_row.zip(other[1..].iter().zip(&d_other[1..])).rev();
            let known = row[lag] - l[lag] * d_other[0];
            let entry = products.fold(known, |entry, ((dl, l), (other, d_other))| entry - l * d_other - dl * other);
            row[lag] = entry * (1.0 / other[0]);
        }
        let products = l[1..].iter().zip(&row[1..]).rev();
        row[0] = (0.5 * row[0] - products.fold(0.0, |sum, (l, dl)| sum + l * dl)) / l[0];
    }
}

/// Value `k` of `L dr = du − dL r`, in place of that of `du`, and those after it that are whitened by the same rows; the next value.
///
/// - `first_row`: the row of the factor that belongs to the first value
/// - `is_kept`: whether the row of `dL` is that of the value before, and of those after it as long as the row of `L` is
fn whiten_on(
    (factor, first_row): (&Factor, usize),
    (of_derivative, is_kept): (&[f64], bool),
    residual: &[f64],
    values: &mut [f64],
    k: usize,
) -> usize {
    let row = factor.row(first_row + k);
    let run = if is_kept { factor.run(first_row, k, values.len()) } else { k..k };
    if run.is_empty() {
        whiten_next(row, of_derivative, residual, values, k);
        return k + 1;
    }
    let end = run.end;
    derive_run(row, of_derivative, residual, values, run);
    end
}

/// Value `k` of `L dr = du − dL r`, in place of that of `du`.
fn whiten_next(of_factor: &[f64], of_derivative: &[f64], residual: &[f64], values: &mut [f64], k: usize) {
    let reach = k.min(of_factor.len() - 1);
    let (before, rest) = values.split_at_mut(k);
    let from_factor = backwards(&of_derivative[..=reach], &residual[k - reach..=k]);
    let from_before = backwards(&of_factor[1..=reach], &before[k - reach..]);
    rest[0] = (rest[0] - from_factor - from_before) / of_factor[0];
}

/// Values of `L⁻¹ u` in place, where all rows of `L` are the same and as many values come before as its band. The inverse of the
/// diagonal is taken once, so that no value waits for a division.
fn whiten_run(row: &[f64], u: &mut [f64], run: Range<usize>) {
    let inverse = 1.0 / row[0];
    let lags: Vec<f64> = row[1..].iter().rev().map(|lag| lag * inverse).collect();
    for k in run {
        let (before, rest) = u.split_at_mut(k);
        let before = lags.iter().zip(&before[k - lags.len()..]);
        rest[0] = before.fold(rest[0] * inverse, |sum, (lag, value)| sum - lag * value);
    }
}

/// Values of `L dr = du − dL r` in place of those of `du`, where all rows of `L` are the same, and all of `dL`: first what the residual
/// adds, lag by lag, and then the recursion.
fn derive_run(of_factor: &[f64], of_derivative: &[f64], residual: &[f64], values: &mut [f64], run: Range<usize>) {
    for from in run.clone().step_by(RUN_PART) {
        let part = from..run.end.min(from + RUN_PART);
        for (lag, weight) in of_derivative.iter().enumerate() {
            let before = &residual[part.start - lag..part.end - lag];
            values[part.clone()].iter_mut().zip(before).for_each(|(value, r)| *value -= weight * r);
        }
    }
    whiten_run(of_factor, values, run);
}

/// `Σ weights[i] values[n − 1 − i]`, the last value last: where it has only just been computed, all others are added up before.
fn backwards(weights: &[f64], values: &[f64]) -> f64 {
    weights.iter().rev().zip(values).fold(0.0, |sum, (weight, value)| sum + weight * value)
}

/// Covariances of value `k` with itself and with those before it, one for each lag.
fn covariances(sources: &[Source<'_, f64>], k: usize, of_lags: &mut [f64]) {
    sum_over_readings(sources, k, of_lags, |a, b| a * b);
}

/// Derivatives of the covariances of value `k` with itself and with those before it, one for each lag.
fn derivatives_of_covariances(sources: &[Source<'_, Number>], k: usize, of_lags: &mut [f64]) {
    sum_over_readings(sources, k, of_lags, |a, b| a.eps * b.re + a.re * b.eps);
}

/// Covariance with the value `lag` before, of rows that are all the same and no masked reading.
fn covariance_of_same(sources: &[Source<'_, f64>], lag: usize) -> f64 {
    sum_over_same(sources, lag, |a, b| a * b)
}

/// Derivative of the covariance with the value `lag` before, of rows that are all the same and no masked reading.
fn derivative_of_same(sources: &[Source<'_, Number>], lag: usize) -> f64 {
    sum_over_same(sources, lag, |a, b| a.eps * b.re + a.re * b.eps)
}

fn sum_over_same<T: Real>(sources: &[Source<'_, T>], lag: usize, product: impl Fn(T, T) -> f64) -> f64 {
    let of_source = |Source { rows, variance, .. }: &Source<'_, T>| -> f64 {
        let row = rows.at(0);
        let products = row.iter().zip(row.get(lag..).unwrap_or(&[])).map(|(a, b)| product(*a, *b));
        variance.plain * products.sum::<f64>()
    };
    sources.iter().map(of_source).sum()
}

/// `Σ σ² product(weight in value k, weight in value k − lag)` over the readings that both have in common, for each lag.
fn sum_over_readings<T: Real>(sources: &[Source<'_, T>], k: usize, of_lags: &mut [f64], product: impl Fn(T, T) -> f64) {
    of_lags.fill(0.0);
    for source in sources {
        let Source { rows, variance, .. } = source;
        let (now, first) = (rows.at(k), source.reading(k));
        let has_masked = variance.has_masked_in(first..first + now.len());
        for (lag, sum) in of_lags.iter_mut().enumerate().take(now.len()) {
            let products = now.iter().zip(&rows.at(k - lag)[lag..]).map(|(a, b)| product(*a, *b));
            *sum += if has_masked {
                products.enumerate().map(|(j, p)| p * variance.at(first + j)).sum()
            } else {
                variance.plain * products.sum::<f64>()
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chain::{Along, Chain, Curves};
    use crate::dense;
    use crate::number::Number;
    use crate::observations::Stretch;

    const SAMPLES: usize = 120;

    fn through_lag<T: Real>(tau_s: T) -> Chain<T> {
        let time_s: Vec<f64> = (0..SAMPLES).map(|k| k as f64).collect();
        let reading: Vec<f64> = (0..SAMPLES).map(|k| (0.7 * k as f64).sin() + 0.01 * (k * k % 7) as f64).collect();
        let stretch = Stretch::new(time_s, [reading.clone(), reading]);
        let mut chain = Chain::of(stretch.whole(), 0, Some(1.0));
        chain.factor(Along::Same(tau_s), Curves::default());
        chain
    }

    /// Variances of both channels, of which the second has two masked readings or none.
    fn variances(is_masked: bool) -> [Variance; 2] {
        let masked = if is_masked { &[(17, 30.0), (70, 30.0)][..] } else { &[] };
        [Variance::same(0.01), Variance::masked(0.2, masked)]
    }

    /// A run of two parts and more is value for value what single values are. Both add up six terms of size one, with a rounding of
    /// 1e-15, which the recursion carries on less than twice: the bound is 1e-14.
    #[test]
    fn a_run_is_whitened_as_its_values_one_by_one() {
        let (factor, derivative) = ([2.0, -0.9, 0.2], [0.3, 0.1, -0.2]);
        let residual: Vec<f64> = (0..2 * RUN_PART + 77).map(|k| (0.7 * k as f64).sin()).collect();
        let mut want: Vec<f64> = residual.iter().map(|r| r * r - 0.3).collect();
        let mut got = want.clone();
        (0..want.len()).for_each(|k| whiten_next(&factor, &derivative, &residual, &mut want, k));
        got[..2].copy_from_slice(&want[..2]);
        derive_run(&factor, &derivative, &residual, &mut got, 2..want.len());
        for (k, (got, want)) in got.iter().zip(&want).enumerate() {
            assert!((got - want).abs() < 1e-14, "value {k}: got {got}, want {want}");
        }
    }

    /// What brings noise into two chains.
    fn sources<'a, T: Real>(chains: &'a [Chain<T>; 2], variances: &'a [Variance; 2]) -> [Source<'a, T>; 2] {
        [0, 1].map(|i| Source { rows: &chains[i].rows, variance: &variances[i], first_sample: 0 })
    }

    /// Factor and disagreement of two lags, one reading masked or none.
    fn two_lags(tau_s: [f64; 2], is_masked: bool) -> (Vec<f64>, Factor) {
        let chains = tau_s.map(through_lag);
        let mut factor = Factor::empty();
        factor.compute(&sources(&chains, &variances(is_masked)), chains[0].len(), None, None);
        let u = chains[0].value.iter().zip(&chains[1].value).map(|(a, b)| *a - *b).collect();
        (u, factor)
    }

    /// Rows of two lags on 120 samples, one reading masked: `rᵀr` is `uᵀ V⁻¹ u` with the dense matrix. Both are sums of
    /// 118 terms, each from some 40 products: rounding leaves 118 · 40 · 1.1e-16, 5e-13.
    #[test]
    fn the_banded_factor_is_that_of_the_dense_matrix() {
        let (u, factor) = two_lags([3.0, 9.0], true);
        let mut whitened = u.clone();
        factor.whiten(&mut whitened, 0, 0);
        let (m, [_, variance]) = (u.len(), variances(true));
        let dense_rows = |rows: &Rows<f64>| -> Vec<Vec<f64>> {
            (0..m)
                .map(|k| {
                    let mut row = vec![0.0; SAMPLES];
                    rows.at(k).iter().enumerate().for_each(|(j, c)| row[rows.start + k + j] = *c);
                    row
                })
                .collect()
        };
        let (a, b) = (dense_rows(&through_lag(3.0).rows), dense_rows(&through_lag(9.0).rows));
        let entry = |i: usize, j: usize| -> f64 {
            (0..SAMPLES).map(|k| 0.01 * a[i][k] * a[j][k] + variance.at(k) * b[i][k] * b[j][k]).sum()
        };
        let matrix: Vec<Vec<f64>> = (0..m).map(|i| (0..m).map(|j| entry(i, j)).collect()).collect();
        let inverse = dense::inverse(&matrix).expect("positive definite");
        let weighted = dense::times(&inverse, &u);
        let (energy, want) = (dense::dot(&whitened, &whitened), dense::dot(&u, &weighted));
        assert!((energy - want).abs() < 5e-13 * want, "got {energy}, want {want}");
        factor.unwhiten_transposed(&mut whitened);
        for (got, want) in whitened.iter().zip(weighted) {
            assert!((got - want).abs() < 1e-8 * (1.0 + want.abs()), "got {got}, want {want}");
        }
    }

    /// The derivative of each residual with respect to a time constant, against central differences of 1e-4 of it:
    /// their error is a third derivative times a sixth of the step's square, 1.5e-8 s². Residuals of size ten that go as
    /// `1/τ` at 3 s have one of 10 · 6/27, 2.2 s⁻³: 3.3e-8; the bound is three times that. Rounding over the step is 1e-10. With
    /// a masked reading the factor does not settle, without one it does.
    #[test]
    fn derivatives_of_the_residual_are_exact() {
        for is_masked in [false, true] {
            let residual = |tau_s: f64| {
                let (mut u, factor) = two_lags([tau_s, 9.0], is_masked);
                factor.whiten(&mut u, 0, 0);
                u
            };
            let (mut whitened, factor) = two_lags([3.0, 9.0], is_masked);
            factor.whiten(&mut whitened, 0, 0);
            let chains = [Number::from(3.0).derivative(), Number::from(9.0)].map(through_lag);
            let variances = variances(is_masked);
            let sources = sources(&chains, &variances);
            let mut got: Vec<f64> = chains[0].value.iter().zip(&chains[1].value).map(|(a, b)| (a - b).eps).collect();
            let mut of_factor = FactorDerivative::default();
            of_factor.begin(factor.band());
            of_factor.whiten(&factor, 0, &sources, &whitened, &mut got, 0);
            let step_s = 3e-4;
            let (above, below) = (residual(3.0 + step_s), residual(3.0 - step_s));
            for (k, got) in got.iter().enumerate() {
                let want = (above[k] - below[k]) / (2.0 * step_s);
                assert!((got - want).abs() < 1e-7, "{is_masked}, residual {k}: got {got}, want {want}");
            }
        }
    }
}
