//! How likely a step is at the samples around one, exactly.
//!
//! As far as the filters reach around a step, the residual is neither that before it nor that after it. What lies farther away is
//! the same for all these samples, so that of a long record a piece is enough, with all parameters but the instant held.

use std::collections::BTreeMap;
use std::ops::Range;

use super::scan::Scan;
use super::{Tracker, varying};
use crate::fit::{Effort, Fitted};
use crate::observations::Observations;
use crate::selection::Selection;

/// Reach of the filters, in the larger time constant: after four of them 2 % of what was is left.
const REACH_LAGS: f64 = 4.0;
/// Shortest reach, in samples: that of the filters alone.
const MIN_REACH_SAMPLES: usize = 8;
/// A record that is so many times as long as the reach is looked at in a piece. A shorter one is fitted again at each sample.
const LONG_REACHES: usize = 40;
/// Samples that are looked at on either side at a time; the next time they are so many times as close.
const SIDE_SAMPLES: usize = 8;

/// The samples around a step.
pub(super) struct Near<'a> {
    tracker: &'a Tracker<'a>,
    fitted: &'a Fitted,
    centre: usize,
    reach: usize,
    /// A piece around it, of a long record.
    piece: Option<(Observations, Selection)>,
}

impl<'a> Near<'a> {
    /// - `fitted`: with a step at sample `centre`
    pub(super) fn of(tracker: &'a Tracker<'a>, fitted: &'a Fitted, centre: usize) -> Self {
        let observations = &tracker.prepared.observations;
        let tau_s = fitted.theta[0].max(fitted.theta[1]);
        let lags = (REACH_LAGS * tau_s / tracker.prepared.context.step_s).min(tracker.time_s.len() as f64);
        let reach = (lags.ceil() as usize).max(MIN_REACH_SAMPLES);
        let piece = (tracker.time_s.len() > LONG_REACHES * reach)
            .then(|| piece(observations, tracker.selection, centre, 3 * reach));
        Self { tracker, fitted, centre, reach, piece: piece.flatten() }
    }

    /// The energy of a step at `sample`, but for what is the same at all of them.
    fn energy(&self, sample: usize) -> f64 {
        let constant = self.fitted.model.without(self.fitted.model.effects.len() - 1);
        let changed = constant.with(varying::step(self.tracker.instant_s(sample)));
        if let Some((observations, selection)) = &self.piece {
            return changed.energy(&self.fitted.theta, observations, selection);
        }
        let observations = &self.tracker.prepared.observations;
        changed.fit(&self.fitted.theta, observations, self.tracker.selection, Effort::Look).chi2
    }

    /// The likeliest sample `within`, around `from`.
    pub(super) fn likeliest(&self, from: usize, within: &Range<usize>) -> usize {
        let mut energies: BTreeMap<usize, f64> = BTreeMap::new();
        let (mut best, mut apart) = (from, self.reach.div_ceil(SIDE_SAMPLES));
        loop {
            let around = (0..=2 * SIDE_SAMPLES).map(|k| (best + k * apart).saturating_sub(SIDE_SAMPLES * apart));
            for sample in around.filter(|sample| within.contains(sample) && self.is_near(*sample)) {
                energies.entry(sample).or_insert_with(|| self.energy(sample));
            }
            best = energies.iter().min_by(|a, b| a.1.total_cmp(b.1)).map_or(best, |(sample, _)| *sample);
            if apart == 1 {
                return best;
            }
            apart = apart.div_ceil(SIDE_SAMPLES);
        }
    }

    /// The first and last sample at which a step is as likely as at `best`, but for `limit` of the energy; also those that others
    /// lie before.
    pub(super) fn interval(&self, best: usize, scan: &Scan, limit: f64) -> [usize; 2] {
        let least = self.energy(best);
        let far = scan.energies.iter().filter(|(sample, _)| !self.is_near(*sample));
        let likely = far.filter(|(_, energy)| energy - scan.best.1 < limit).map(|(sample, _)| *sample);
        let [low, high] = likely.fold([best, best], |[low, high], sample| [low.min(sample), high.max(sample)]);
        let is_likely = |sample: usize| self.is_near(sample) && self.energy(sample) - least < limit;
        let end = |at: &dyn Fn(usize) -> Option<usize>| {
            let is_inside = |by: usize| at(by).is_some_and(is_likely);
            let (mut inside, mut outside) = (0, 1);
            while is_inside(outside) {
                (inside, outside) = (outside, 2 * outside);
            }
            while outside - inside > 1 {
                let middle = inside.midpoint(outside);
                if is_inside(middle) { inside = middle } else { outside = middle }
            }
            at(inside).unwrap_or(best)
        };
        let before = end(&|by| best.checked_sub(by));
        let after = end(&|by| Some(best + by).filter(|sample| *sample < self.tracker.time_s.len()));
        [low.min(before), high.max(after)]
    }

    fn is_near(&self, sample: usize) -> bool {
        self.piece.is_none() || sample.abs_diff(self.centre) <= 2 * self.reach
    }
}

/// The piece that reaches `reach` samples around one, within its stretch.
pub(super) fn piece(
    observations: &Observations,
    selection: &Selection,
    centre: usize,
    reach: usize,
) -> Option<(Observations, Selection)> {
    let mut first = 0;
    let stretch = observations.stretches.iter().find_map(|s| {
        let range = first..first + s.len();
        first = range.end;
        range.contains(&centre).then_some(range)
    })?;
    let cut = centre.saturating_sub(reach).max(stretch.start)..(centre + reach).min(stretch.end);
    let part = observations.excerpt(std::iter::once(cut.start), cut.len());
    let counts = selection.counts.get(cut)?.to_vec();
    Some((part, Selection { counts, weighting: selection.weighting.clone() }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::track::fixture::Fixture;

    const STEP_S: f64 = 800.5;

    /// Half the time constants' sum later: the record is a hundred reaches long, and looked at in a piece.
    fn fixture() -> Fixture {
        Fixture::of(1800, |t| if t < STEP_S { 1.0 } else { 1.3 })
    }

    fn instants_s() -> Vec<f64> {
        (0..1800).map(|k| f64::from(k) - 0.5).collect()
    }

    /// The fit with a step some samples beside it.
    fn looked(tracker: &Tracker<'_>, constant: &Fitted, sample: usize) -> Fitted {
        tracker.fit(constant, varying::step(instants_s()[sample]), &[0.2], Effort::Finish)
    }

    /// The energy of the whole record with a step at `sample`.
    fn whole(tracker: &Tracker<'_>, fitted: &Fitted, sample: usize) -> f64 {
        let constant = fitted.model.without(fitted.model.effects.len() - 1);
        let model = constant.with(varying::step(instants_s()[sample]));
        model.energy(&fitted.theta, &tracker.prepared.observations, tracker.selection)
    }

    /// What the start of the piece leaves of the whitening at the first of the samples, a reach away, is `e⁻⁴`, 2 % of a residual: of
    /// differences of energies twice that.
    #[test]
    fn a_piece_has_the_differences_of_the_whole_record() {
        let fixture = fixture();
        let tracker = fixture.tracker();
        let fitted = looked(&tracker, &fixture.constant, 803);
        let near = Near::of(&tracker, &fitted, 803);
        assert!(near.piece.is_some() && near.is_near(803 + near.reach) && !near.is_near(803 + 3 * near.reach));
        let least = (near.energy(801), whole(&tracker, &fitted, 801));
        for sample in (803 - near.reach..803 + near.reach).step_by(3) {
            let (got, want) = (near.energy(sample) - least.0, whole(&tracker, &fitted, sample) - least.1);
            assert!((got - want).abs() < 0.04 * want.abs() + 0.1, "{sample}: {got}, want {want}");
        }
    }

    /// Of all samples around, one after the other.
    #[test]
    fn the_likeliest_sample_has_the_least_energy_of_the_whole_record() {
        let fixture = fixture();
        let tracker = fixture.tracker();
        let fitted = looked(&tracker, &fixture.constant, 807);
        let near = Near::of(&tracker, &fitted, 807);
        let got = near.likeliest(807, &(100..1700));
        let around = 807 - near.reach..807 + near.reach;
        let want = around.min_by(|a, b| whole(&tracker, &fitted, *a).total_cmp(&whole(&tracker, &fitted, *b)));
        assert_eq!(Some(got), want);
        let none_far = Scan { energies: Vec::new(), best: (got, 0.0, Vec::new()) };
        let [low, high] = near.interval(got, &none_far, 7.352);
        assert!(low <= 801 && 801 <= high, "{low} to {high}: the time constants change at 800.5 s");
        // A bound ends the search.
        assert!(near.likeliest(807, &(805..1700)) >= 805);
    }

    /// The ends are the last samples in a row, of those around, whose energy is within the limit, and an instant far away that the scan has as likely
    /// is within as well.
    #[test]
    fn the_interval_ends_where_the_energy_passes_the_limit() {
        let fixture = fixture();
        let tracker = fixture.tracker();
        let fitted = looked(&tracker, &fixture.constant, 801);
        let near = Near::of(&tracker, &fitted, 801);
        let best = near.likeliest(801, &(100..1700));
        let none_far = Scan { energies: Vec::new(), best: (best, 0.0, Vec::new()) };
        for limit in [7.35, 40.0, 400.0] {
            let is_likely = |sample: &usize| near.is_near(*sample) && near.energy(*sample) - near.energy(best) < limit;
            let low = (0..=best).rev().take_while(is_likely).last().unwrap_or(best);
            let high = (best..1800).take_while(is_likely).last().unwrap_or(best);
            assert_eq!(near.interval(best, &none_far, limit), [low, high], "{limit}");
        }
        let far = Scan { energies: vec![(300, 5.0), (1500, 8.0)], best: (best, 0.0, Vec::new()) };
        let [low, high] = near.interval(best, &far, 7.35);
        assert!(low == 300 && high < 900, "{low} to {high}");
    }
}
