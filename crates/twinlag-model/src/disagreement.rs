//! The whitened disagreement of a plant along a record, and its derivative with respect to one parameter: what a fit
//! evaluates again and again, so it computes nothing else, and keeps its memory.
//!
//! The derivative is exact: the inverse is computed in numbers that carry it along. Where the parameter moves none of
//! the rows that carry noise, as an offset does, the factor of the residual whitens the derivative as well.

use std::ops::{ControlFlow, Range};
use std::sync::Arc;

use crate::directions::Direction;
use crate::inverse::Inverse;
use crate::masked::masked_std_k;
use crate::number::{Number, Real};
use crate::observations::{Observations, Stretch};
use crate::plant::{Place, Plant};
use crate::rows::Rows;
use crate::selection::Span;
use crate::whitening::{Adjoint, DERIVATIVE_ROUNDING, Factor, FactorDerivative, Source, Variance};

/// Fewest disagreements of a stretch: one of fewer is left out.
const MIN_DISAGREEMENTS: usize = 4;
/// Samples of a window: what a derivative of one works on, some twenty numbers for each sample, is a megabyte. Chosen.
const WINDOW_SAMPLES: usize = 8192;
/// Values of a block, and the bands that it has at least: what acts in a part of a record is computed block by block, or left
/// out. What a block takes beside its own values, for the operators and the lead, is some bands. Chosen.
const BLOCK_SAMPLES: usize = 512;
const BLOCK_BANDS: usize = 4;
/// Samples of a record up to which all factors are kept for derivatives: of longer ones those that have not settled are computed
/// once more, for a part of what one derivative costs.
const MAX_KEPT_SAMPLES: usize = 65_536;
/// Part of a step by which the instant of a value may differ from its sample's.
const SAME_INSTANT_STEPS: f64 = 0.25;

/// Where the residuals of a stretch belong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Piece {
    /// Which of the stretches.
    pub(crate) stretch: usize,
    /// Residuals of it.
    pub(crate) count: usize,
    /// The sample, counted through all stretches, in the middle of the first residual's reach.
    pub(crate) first_sample: usize,
}

/// Variance of each reading of both channels of a stretch, K²: of masked ones how far they may be off.
///
/// - `noise_std_k`: white noise of the channels in all stretches, K
/// - `swing_k`: standard deviation of the more lively channel, K
pub(crate) fn reading_variances(noise_std_k: [f64; 2], stretch: &Stretch, swing_k: f64) -> [Variance; 2] {
    [0, 1].map(|i| {
        let std_k = noise_std_k[i] * stretch.noise_factor[i];
        Variance::masked(std_k, &masked_std_k(stretch, i, std_k, swing_k))
    })
}

/// The disagreement of one stretch, ready to be whitened, in memory that is used again.
#[derive(Clone, Debug)]
pub(crate) struct Disagreement<T> {
    pub(crate) inverse: Inverse<T>,
    /// How noise of either reading enters.
    pub(crate) reading_rows: [Rows<T>; 2],
    /// How innovations of each extra noise enter.
    pub(crate) extra_rows: Vec<Rows<T>>,
    /// The disagreement, and then the residual.
    pub(crate) values: Vec<T>,
    /// Variance of the innovations of each extra noise, K².
    extra_variances: Vec<Variance>,
}

impl<T: Real> Default for Disagreement<T> {
    fn default() -> Self {
        Self::empty()
    }
}

impl<T: Real> Disagreement<T> {
    pub(crate) fn empty() -> Self {
        Self {
            inverse: Inverse::empty(),
            reading_rows: [Rows::identity(), Rows::identity()],
            extra_rows: Vec::new(),
            values: Vec::new(),
            extra_variances: Vec::new(),
        }
    }

    /// From the inverse of a stretch to its disagreement: the differences that whiten extra noise, and the rows.
    pub(crate) fn compare(&mut self, plant: &Plant, step_s: f64) {
        let has_gas = plant.extra.iter().any(|e| e.place == Place::Gas);
        self.extra_rows.resize_with(plant.extra.len(), Rows::identity);
        self.extra_variances.clear();
        for (index, extra) in plant.extra.iter().enumerate() {
            let rho = extra.rho(step_s);
            self.extra_variances.push(Variance::same(extra.std_k * extra.std_k * (1.0 - rho * rho)));
            let (before, rest) = self.extra_rows.split_at_mut(index);
            match extra.place {
                Place::Reading(i) if !self.inverse.has[i] => rest[0].begin(),
                Place::Reading(i) => self.inverse.disagreement_rows(plant, i, &mut rest[0]),
                Place::Gas => rest[0].copy(&self.inverse.gas.rows),
            }
            // Its innovations come with the next value; noise that is there already has one more difference.
            rest[0].start += 1;
            let count = self.inverse.count() - 1;
            before.iter_mut().for_each(|rows| rows.difference(rho, count));
            self.inverse.difference(rho, has_gas);
        }
        for (i, rows) in self.reading_rows.iter_mut().enumerate() {
            if self.inverse.has[i] {
                self.inverse.disagreement_rows(plant, i, rows);
            } else {
                rows.begin();
            }
        }
        let [one, two] = &self.inverse.chains;
        self.values.clear();
        match self.inverse.has {
            [true, true] => self.values.extend(one.value.iter().zip(&two.value).map(|(a, b)| *a - *b)),
            [true, false] => self.values.extend_from_slice(&one.value),
            [false, _] => self.values.extend(two.value.iter().map(|b| -*b)),
        }
    }

    /// What brings noise in, of readings with `variances`; of derivatives, where there are some.
    ///
    /// - `first_sample`: the sample of the stretch with which the inverse begins
    pub(crate) fn sources<'a>(&'a self, variances: &'a [Variance; 2], first_sample: usize) -> Vec<Source<'a, T>> {
        let readings = self.reading_rows.iter().zip(variances);
        let extra = self.extra_rows.iter().zip(&self.extra_variances);
        readings.chain(extra).map(|(rows, variance)| Source { rows, variance, first_sample }).collect()
    }
}

/// Whether a stretch has disagreements under `plant`.
pub(crate) fn is_long_enough(stretch: &Stretch, plant: &Plant, is_even: bool) -> bool {
    stretch.len() >= plant.consumed(is_even) + MIN_DISAGREEMENTS
}

/// The sample of a stretch whose instant the first value of a disagreement has.
pub(crate) fn first_sample(stretch: &Stretch, first_s: f64, step_s: f64) -> usize {
    stretch.time_s.first_not_before(first_s - SAME_INSTANT_STEPS * step_s)
}

/// Values of a stretch that are whitened at a time, and the factor for them. Up to so many samples a stretch is one window.
#[derive(Debug)]
pub(crate) struct Window {
    /// Which of the pieces.
    piece: usize,
    /// Its first value, counted through the piece, and through all pieces; a lead comes before it.
    first: usize,
    from: usize,
    /// Values without the lead.
    count: usize,
    /// Last values of the window before, which its own are correlated with.
    lead: usize,
    factor: Factor,
}

impl Window {
    /// Its residuals, counted through all pieces.
    pub(crate) fn residuals(&self) -> Range<usize> {
        self.from..self.from + self.count
    }

    /// Values before one that it is correlated with.
    pub(crate) fn band(&self) -> usize {
        self.factor.band()
    }

    /// Its disagreement, into `plain`; the first of its samples in the stretch.
    fn disagree(
        &self,
        plant: &Plant,
        observations: &Observations,
        piece: &Piece,
        plain: &mut Disagreement<f64>,
    ) -> usize {
        let period_s = observations.period_s;
        let samples = self.samples(plant.consumed(period_s.is_some()));
        let first = samples.start;
        plain.inverse.invert(plant, observations.stretches[piece.stretch].cut(samples), period_s);
        plain.compare(plant, observations.step_s());
        debug_assert_eq!(plain.values.len(), self.lead + self.count, "as many as the operators leave");
        first
    }

    /// Its samples of the stretch.
    fn samples(&self, consumed: usize) -> Range<usize> {
        self.first - self.lead..self.first + self.count + consumed
    }
}

/// Memory for the factor of a window that was not kept.
pub(crate) struct Again {
    plain: Disagreement<f64>,
    factor: Factor,
}

impl Default for Again {
    fn default() -> Self {
        Self { plain: Disagreement::empty(), factor: Factor::empty() }
    }
}

/// Values of a window that are derived at a time.
struct Block<'a> {
    window: &'a Window,
    /// The first of them in the window.
    first: usize,
    /// Values without the lead.
    count: usize,
    /// Last values before them, which they are correlated with.
    lead: usize,
}

impl Block<'_> {
    /// Its samples of the stretch.
    fn samples(&self, consumed: usize) -> Range<usize> {
        let first = self.window.first + self.first;
        first - self.lead..first + self.count + consumed
    }

    /// Its values, counted through all pieces, those of its lead among them.
    fn values(&self) -> Range<usize> {
        let first = self.window.from + self.first;
        first - self.lead..first + self.count
    }

    /// The row of the window's factor that belongs to its first value.
    fn first_row(&self) -> usize {
        self.window.lead + self.first - self.lead
    }
}

/// The derivative along a record, window after window.
#[derive(Default)]
pub(crate) struct Moved {
    factor: FactorDerivative,
    /// Derivatives of the last window that was computed, its lead first.
    values: Vec<f64>,
    /// The largest of the stretch.
    largest: f64,
}

impl Moved {
    /// Begins a stretch whose factor has bands of `band`.
    fn begin(&mut self, band: usize) {
        self.factor.begin(band);
        self.values.clear();
        self.largest = 0.0;
    }

    /// Goes past a block where nothing moves, if there is nothing left of what moved before; whether there is not.
    fn passes(&mut self, block: &Block<'_>) -> bool {
        let before = &self.values[self.values.len() - block.lead..];
        let is_still = before.iter().all(|v| v.abs() <= DERIVATIVE_ROUNDING * self.largest);
        let passes = is_still && self.factor.passes(block.count);
        if passes {
            self.values.resize(self.values.len() + block.count, 0.0);
        }
        passes
    }
}

/// Evaluates plants of one record, one after the other.
pub(crate) struct Evaluator<'a> {
    observations: &'a Observations,
    variances: Vec<[Variance; 2]>,
    plain: Disagreement<f64>,
    /// Windows of the last evaluation, in their order, and after them those of earlier ones, for their memory.
    windows: Vec<Window>,
    used: usize,
    /// Most values of a window of evenly spaced samples.
    pub(crate) window_samples: usize,
    /// Samples up to which all factors are kept.
    pub(crate) max_kept_samples: usize,
    /// Values of a block of a window, or as many as some bands.
    pub(crate) block_samples: usize,
    /// Pieces of the last evaluation.
    pub(crate) pieces: Vec<Piece>,
    /// Its whitened residual.
    pub(crate) residual: Vec<f64>,
}

impl<'a> Evaluator<'a> {
    /// - `noise_std_k`: white noise of the channels, which all plants have
    pub(crate) fn new(observations: &'a Observations, noise_std_k: [f64; 2]) -> Self {
        let of_stretch = |s: &Arc<Stretch>| reading_variances(noise_std_k, s, observations.swing_k());
        Self {
            observations,
            variances: observations.stretches.iter().map(of_stretch).collect(),
            plain: Disagreement::empty(),
            windows: Vec::new(),
            used: 0,
            window_samples: WINDOW_SAMPLES,
            max_kept_samples: MAX_KEPT_SAMPLES,
            block_samples: BLOCK_SAMPLES,
            pieces: Vec::new(),
            residual: Vec::new(),
        }
    }

    /// Whether the factors of all windows are kept: those of a long record are computed again.
    pub(crate) fn keeps_factors(&self) -> bool {
        self.observations.samples() <= self.max_kept_samples
    }

    /// Windows of the last evaluation.
    pub(crate) fn windows(&self) -> &[Window] {
        &self.windows[..self.used]
    }

    /// Where the values of window `index` belong.
    pub(crate) fn span(&self, index: usize) -> Span<'_> {
        let Window { piece, first, count, .. } = &self.windows[index];
        let piece = &self.pieces[*piece];
        Span { piece, is_first: *first == 0, is_last: first + count == piece.count }
    }

    /// The whitened residual of `plant`, into [`Self::residual`].
    pub(crate) fn evaluate(&mut self, plant: &Plant) {
        self.evaluate_with(plant, |_| ());
    }

    /// As [`Self::evaluate`], and visits the standard deviation of each disagreement, given those before it.
    pub(crate) fn evaluate_with(&mut self, plant: &Plant, mut visit: impl FnMut(f64)) {
        self.residual.clear();
        self.residual.reserve_exact(self.observations.samples());
        let all = self.each_window(plant, |evaluator| {
            let window = &evaluator.windows[evaluator.used - 1];
            (window.lead..window.factor.len()).for_each(|k| visit(window.factor.row(k)[0]));
            ControlFlow::Continue(())
        });
        debug_assert!(all.is_continue(), "no window is the last one before the end");
    }

    /// The whitened residual of `plant`, window after window, of which only the last one is kept: visits the place of each among
    /// [`Self::windows`]. As long as the visitor says.
    pub(crate) fn pass(
        &mut self,
        plant: &Plant,
        mut visit: impl FnMut(&Self, usize) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        self.each_window(plant, |evaluator| {
            visit(evaluator, evaluator.used - 1)?;
            evaluator.forget();
            ControlFlow::Continue(())
        })
    }

    /// Keeps no more than the next window begins with: the last window, the first one that is like others, and the last residuals.
    fn forget(&mut self) {
        let Self { windows, used, residual, .. } = self;
        let last = *used - 1;
        let like = windows[..last].iter().position(|window| window.factor.is_stationary());
        if let Some(like) = like {
            windows.swap(0, like);
        }
        let place = usize::from(like.is_some());
        windows.swap(place, last);
        *used = place + 1;
        let needless = residual.len().saturating_sub(windows[place].band());
        residual.drain(..needless);
    }

    /// Evaluates one window after the other, and visits what there is after each, as long as the visitor says.
    fn each_window(&mut self, plant: &Plant, mut visit: impl FnMut(&mut Self) -> ControlFlow<()>) -> ControlFlow<()> {
        let is_even = self.observations.period_s.is_some();
        self.pieces.clear();
        self.residual.clear();
        self.used = 0;
        let mut before = 0;
        for (index, stretch) in self.observations.stretches.iter().enumerate() {
            if is_long_enough(stretch, plant, is_even) {
                let count = stretch.len() - plant.consumed(is_even);
                self.pieces.push(Piece { stretch: index, count, first_sample: before });
                // Rows of uneven samples are as wide as the delays of all of them need.
                let most = if is_even { self.window_samples } else { count };
                for first in (0..count).step_by(most) {
                    self.evaluate_window(plant, first, most.min(count - first));
                    visit(self)?;
                }
            }
            before += stretch.len();
        }
        ControlFlow::Continue(())
    }

    /// The residual of the next window of the last piece.
    fn evaluate_window(&mut self, plant: &Plant, first: usize, count: usize) {
        let is_kept = self.keeps_factors();
        let Self { observations, variances, plain, windows, used, pieces, residual, .. } = self;
        if windows.len() == *used {
            windows.push(Window { piece: 0, first: 0, from: 0, count: 0, lead: 0, factor: Factor::empty() });
        }
        let (earlier, rest) = windows.split_at_mut(*used);
        let before = earlier.last().filter(|_| first > 0).map(|before| &before.factor);
        let window = &mut rest[0];
        let lead = before.map_or(0, Factor::band);
        (window.piece, window.first, window.from) = (pieces.len() - 1, first, residual.len());
        (window.count, window.lead) = (count, lead);
        *used += 1;
        let piece = pieces.last_mut().expect("the piece of the window");
        let first_reading = window.disagree(plant, observations, piece, plain);
        if first == 0 {
            let (stretch, first_s) = (&observations.stretches[piece.stretch], plain.inverse.chains[0].times_s()[0]);
            piece.first_sample += first_sample(stretch, first_s, observations.step_s());
        }
        let sources = plain.sources(&variances[piece.stretch], first_reading);
        let like = earlier.iter().map(|window| &window.factor).find(|factor| factor.is_stationary());
        window.factor.compute(&sources, lead + count, before, like);
        if !is_kept && let Some(last) = earlier.last_mut() {
            last.factor.shorten();
        }
        plain.values[..lead].copy_from_slice(&residual[residual.len() - lead..]);
        window.factor.whiten(&mut plain.values, 0, lead);
        residual.extend_from_slice(&plain.values[lead..]);
    }

    /// The factor of window `index`, of the plant that was evaluated last.
    pub(crate) fn factor<'m>(&'m self, plant: &Plant, index: usize, again: &'m mut Again) -> &'m Factor {
        let window = &self.windows[index];
        if window.factor.len() == window.lead + window.count {
            return &window.factor;
        }
        let Again { plain, factor } = again;
        let piece = &self.pieces[window.piece];
        let first_reading = window.disagree(plant, self.observations, piece, plain);
        let before = index.checked_sub(1).filter(|_| window.first > 0).map(|before| &self.windows[before].factor);
        let sources = plain.sources(&self.variances[piece.stretch], first_reading);
        factor.compute(&sources, window.lead + window.count, before, None);
        factor
    }

    /// The derivative of the residual in window `index`, at the values of the plant that was evaluated last, block after block:
    /// blocks that the direction does not reach are zero, and cost nothing.
    ///
    /// - `direction`: the plant with the derivatives of what it moves
    /// - `factor`: that of the window
    /// - `moved`: after the window before
    pub(crate) fn derivative<'m>(
        &self,
        direction: &Direction,
        index: usize,
        factor: &Factor,
        disagreement: &mut Disagreement<Number>,
        moved: &'m mut Moved,
    ) -> &'m [f64] {
        let Direction { plant: Some(plant), functions, .. } = direction else { return &[] };
        let window = &self.windows[index];
        if plant.moved(*functions) == [false; 2] {
            moved.values.clear();
            moved.values.resize(window.count, 0.0);
            return &moved.values;
        }
        if window.first == 0 {
            moved.begin(factor.band());
        }
        moved.values.drain(..moved.values.len() - window.lead);
        for block in self.blocks(direction, plant, window, factor.band()) {
            if self.reaches(direction, plant, &block) || !moved.passes(&block) {
                self.derive(direction, plant, &block, factor, disagreement, moved);
            }
        }
        &moved.values[window.lead..]
    }

    /// Half the derivative of the energy that window `index` adds; else as [`Self::derivative`].
    ///
    /// - `adjoint`: of [`Self::adjoint`]
    pub(crate) fn slope(
        &self,
        direction: &Direction,
        index: usize,
        factor: &Factor,
        disagreement: &mut Disagreement<Number>,
        adjoint: &Adjoint,
    ) -> f64 {
        let Direction { plant: Some(plant), functions, .. } = direction else { return 0.0 };
        if plant.moved(*functions) == [false; 2] {
            return 0.0;
        }
        let blocks = self.blocks(direction, plant, &self.windows[index], factor.band());
        let of_block = |block: Block<'_>| {
            let Block { lead, .. } = block;
            self.move_block(direction, plant, &block, disagreement);
            let sources = self.moved_sources(plant, &block, disagreement);
            let all = block.values();
            let by = &adjoint.by_value[all.start + lead..];
            let of_values: f64 = disagreement.values[lead..].iter().zip(by).map(|(v, by)| v.eps * by).sum();
            of_values + adjoint.slope(factor.band(), &sources, all, lead)
        };
        blocks.filter(|block| self.reaches(direction, plant, block)).map(of_block).sum()
    }

    /// From half the gradient of an energy by the whitened residual, to that by the disagreement and its covariance.
    pub(crate) fn adjoint(&self, plant: &Plant, gradient: Vec<f64>, again: &mut Again) -> Adjoint {
        let widest = self.windows().iter().map(Window::band).max();
        let mut out = Adjoint::begin(gradient, widest.unwrap_or(0));
        for index in (0..self.used).rev() {
            let Window { from, count, lead, .. } = self.windows[index];
            out.go_back(self.factor(plant, index, again), &self.residual, from - lead..from + count, lead);
        }
        out
    }

    /// The blocks of a window: of a direction that acts everywhere there is one.
    fn blocks<'w>(
        &self,
        direction: &Direction,
        plant: &Plant,
        window: &'w Window,
        band: usize,
    ) -> impl Iterator<Item = Block<'w>> {
        // Rows of delays along uneven samples are as wide as those of the whole window need.
        let is_one = direction.support_s.is_none() || self.observations.period_s.is_none() && plant.has_delay();
        let most = if is_one { window.count } else { self.block_samples.max(BLOCK_BANDS * band) };
        (0..window.count).step_by(most.max(1)).map(move |first| {
            let (count, lead) = (most.min(window.count - first), band.min(window.first + first));
            Block { window, first, count, lead }
        })
    }

    /// Whether a direction acts where the samples of a block are.
    fn reaches(&self, direction: &Direction, plant: &Plant, block: &Block<'_>) -> bool {
        let samples = block.samples(plant.consumed(self.observations.period_s.is_some()));
        let time_s = &self.observations.stretches[self.pieces[block.window.piece].stretch].time_s;
        let [from_s, to_s] = [time_s.at(samples.start), time_s.at(samples.end - 1)];
        direction.support_s.is_none_or(|[first_s, last_s]| from_s <= last_s && to_s >= first_s)
    }

    /// The disagreement of a block with its derivative.
    fn move_block(
        &self,
        direction: &Direction,
        plant: &Plant,
        block: &Block<'_>,
        disagreement: &mut Disagreement<Number>,
    ) {
        let period_s = self.observations.period_s;
        let samples = block.samples(plant.consumed(period_s.is_some()));
        let cut = self.observations.stretches[self.pieces[block.window.piece].stretch].cut(samples);
        disagreement.inverse.invert_moved(plant, cut, period_s, plant.moved(direction.functions));
        disagreement.compare(plant, self.observations.step_s());
    }

    /// What brings noise into the disagreement of a block by a derivative.
    fn moved_sources<'d>(
        &'d self,
        plant: &Plant,
        block: &Block<'_>,
        disagreement: &'d Disagreement<Number>,
    ) -> Vec<Source<'d, Number>> {
        let samples = block.samples(plant.consumed(self.observations.period_s.is_some()));
        let variances = &self.variances[self.pieces[block.window.piece].stretch];
        let mut sources = disagreement.sources(variances, samples.start);
        sources.retain(|source| !source.rows.is_constant());
        sources
    }

    /// The derivatives of a block, after those before it.
    fn derive(
        &self,
        direction: &Direction,
        plant: &Plant,
        block: &Block<'_>,
        factor: &Factor,
        disagreement: &mut Disagreement<Number>,
        moved: &mut Moved,
    ) {
        let Moved { factor: of_factor, values, largest } = moved;
        let Block { count, lead, .. } = *block;
        self.move_block(direction, plant, block, disagreement);
        let sources = self.moved_sources(plant, block, disagreement);
        values.extend(disagreement.values[lead..].iter().map(|v| v.eps));
        let from = values.len() - count - lead;
        let values = &mut values[from..];
        if sources.is_empty() && of_factor.passes(count) {
            factor.whiten(values, block.first_row(), lead);
        } else {
            of_factor.whiten(factor, block.first_row(), &sources, &self.residual[block.values()], values, lead);
        }
        *largest = values[lead..].iter().fold(*largest, |most, v| most.max(v.abs()));
    }
}
