//! Several records of one rig, one after the other, as one.
//!
//! What belongs to the rig is then fitted to all of them, and what belongs to a record, to that record alone. Each record is
//! moved along the axis of time, so that no two overlap, and a function of time is one of a record.

use std::ops::Range;
use std::sync::Arc;

use crate::effect::{Context, KnownEffect, Shared};
use crate::error::ModelError;
use crate::fit::{Effort, Fitted};
use crate::model::Model;
use crate::observations::{Observations, Stretch};
use crate::prepare::Prepared;
use crate::selection::Selection;

/// Time between two records, as a share of the longest one: enough to see the gap in a picture. The spectrum of the gas takes
/// records apart by it.
const GAP_SHARE: f64 = 0.02;
/// Relative difference of two sample periods that are one: clocks differ by less, and time constants move by no more than this share.
const SAME_PERIOD: f64 = 1e-4;

/// One record of several of a rig.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Member {
    /// Its number, from 0.
    pub number: usize,
    /// Its samples, counted through all stretches.
    pub samples: Range<usize>,
    /// Its first and last instant, s, as the joined records have them.
    pub ends_s: [f64; 2],
}

impl Observations {
    /// Several records of one rig as one: each keeps its stretches, which are moved in time so that the records come one after
    /// the other.
    ///
    /// ```
    /// use twinlag_model::{ModelError, Observations, Stretch};
    ///
    /// let record = |from_s: f64| {
    ///     let time_s: Vec<f64> = (0..100).map(|k| from_s + 0.5 * f64::from(k)).collect();
    ///     let reading_c = [1.0, 3.0].map(|k| time_s.iter().map(|t| 20.0 + k * t.sin()).collect());
    ///     Observations::new(vec![Stretch::new(time_s, reading_c)], Some(0.5))
    /// };
    /// let joined = Observations::joined(&[record(0.0)?, record(7.0)?])?;
    /// let members = joined.members();
    /// assert_eq!((members.len(), joined.samples()), (2, 200));
    /// assert_eq!(members[1].samples, 100..200);
    /// assert!(members[1].ends_s[0] > members[0].ends_s[1]);
    /// assert_eq!(joined.of_member(1).samples(), 100);
    /// # Ok::<(), ModelError>(())
    /// ```
    ///
    /// # Errors
    /// As [`Self::new`]: [`ModelError::TooShort`] for no record. [`ModelError::OtherPeriod`] for records of different sample periods; one
    /// without a period makes all of them uneven.
    pub fn joined(records: &[Self]) -> Result<Self, ModelError> {
        let gap_s = GAP_SHARE * records.iter().map(Self::span_s).fold(0.0, f64::max);
        let mut stretches = Vec::new();
        let mut free_from_s = None;
        for (number, record) in records.iter().enumerate() {
            let [first_s, last_s] = record.ends_s();
            let later_s = free_from_s.map_or(0.0, |free_s: f64| free_s - first_s);
            stretches.extend(record.stretches.iter().map(|stretch| stretch.as_member(number, later_s)));
            free_from_s = Some(last_s + later_s + gap_s);
        }
        let periods_s: Option<Vec<f64>> = records.iter().map(|record| record.period_s).collect();
        let Some(&[first_s, ref others_s @ ..]) = periods_s.as_deref() else { return Self::new(stretches, None) };
        match (1..).zip(others_s).find(|(_, period_s)| (*period_s - first_s).abs() > SAME_PERIOD * first_s) {
            Some((record, period_s)) => Err(ModelError::OtherPeriod { record, period_s: *period_s, first_s }),
            None => Self::new(stretches, Some(first_s)),
        }
    }

    /// The records that these are, in order: one, unless they were joined.
    pub fn members(&self) -> Vec<Member> {
        let mut out: Vec<Member> = Vec::new();
        let mut first = 0;
        for stretch in &self.stretches {
            let end = first + stretch.len();
            let [first_s, last_s] = stretch.ends_s();
            match out.last_mut() {
                Some(member) if member.number == stretch.member => {
                    (member.samples.end, member.ends_s[1]) = (end, last_s);
                }
                _ => out.push(Member { number: stretch.member, samples: first..end, ends_s: [first_s, last_s] }),
            }
            first = end;
        }
        out
    }

    /// Whether these are several records.
    pub fn is_joined(&self) -> bool {
        self.stretches.iter().any(|stretch| stretch.member != self.stretches[0].member)
    }

    /// One of the records, where it lies among the others.
    #[must_use]
    pub fn of_member(&self, number: usize) -> Self {
        self.keeping(|stretch| stretch.member == number)
    }

    /// The records without one of them, where they lie.
    #[must_use]
    pub fn without_member(&self, number: usize) -> Self {
        self.keeping(|stretch| stretch.member != number)
    }

    /// Some of the stretches, shared with these. A delay reaches as far as in all of them, if that leaves half of the longest one.
    fn keeping(&self, is_kept: impl Fn(&Stretch) -> bool) -> Self {
        let stretches: Vec<_> = self.stretches.iter().filter(|stretch| is_kept(stretch)).cloned().collect();
        let longest = stretches.iter().map(|stretch| stretch.len()).max().unwrap_or(0);
        self.with_stretches(stretches).reaching_at_most(longest / 4)
    }

    /// Noise of each channel over that of all records together, in one of them; one where these are several.
    pub(crate) fn noise_factor(&self) -> [f64; 2] {
        if self.is_joined() { [1.0; 2] } else { self.stretches[0].noise_factor }
    }

    /// Whether records differ in their noise.
    pub(crate) fn has_own_noise(&self) -> bool {
        self.is_joined() && self.stretches.iter().any(|stretch| stretch.noise_factor != [1.0; 2])
    }

    /// These with the noise of each record's channels over that of all, in the order of [`Self::members`].
    #[must_use]
    pub(crate) fn with_noise_factors(mut self, factors: &[[f64; 2]]) -> Self {
        let members = self.members();
        for stretch in &mut self.stretches {
            let place = members.iter().position(|member| member.number == stretch.member);
            let factor = place.and_then(|place| factors.get(place)).copied().unwrap_or([1.0; 2]);
            if stretch.noise_factor != factor {
                Arc::make_mut(stretch).noise_factor = factor;
            }
        }
        self
    }
}

/// Blocks that a record is divided into, each of which is left out in turn: long enough that a drift has gone on, and three quarters
/// of the record left to fit. Chosen.
const BLOCKS: usize = 4;

/// One of several records that were prepared together, or a block of a single one: what a model of the others is tried on.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct OneRecord {
    /// Which of them it is, from 0.
    pub number: usize,
    /// The record, where it lies among the others; of a block all of the record.
    pub observations: Observations,
    /// Its residuals on which a model of the others is tried.
    pub tried: Selection,
    /// Its residuals that count where what is its own is fitted; of a block those of all of the record, since what belongs to a record
    /// is of all of it.
    pub everything: Selection,
    /// The others, and what fits of them count.
    pub others: (Observations, Selection),
    context: Context,
}

impl Prepared {
    /// Each of several records.
    pub fn each_record(&self) -> Vec<OneRecord> {
        let of = |(member, context): (Member, Context)| {
            let mut others = self.everything.clone();
            others.counts.drain(member.samples.clone());
            let everything = self.everything.of_samples(member.samples);
            OneRecord {
                number: member.number,
                observations: self.observations.of_member(member.number),
                tried: everything.clone(),
                everything,
                others: (self.observations.without_member(member.number), others),
                context,
            }
        };
        self.context.each_member().map(of).collect()
    }

    /// Each of a few long blocks of a single record; of a long one pieces, as [`Self::excerpt`] takes them.
    pub fn each_block(&self) -> Vec<OneRecord> {
        let (observations, everything) =
            if self.is_excerpted() { self.excerpt() } else { (self.observations.clone(), self.everything.clone()) };
        let samples = observations.samples();
        let of = |number: usize| {
            let block = number * samples / BLOCKS..(number + 1) * samples / BLOCKS;
            OneRecord {
                number,
                observations: observations.clone(),
                tried: everything.where_in(|sample| block.contains(&sample)),
                everything: everything.clone(),
                others: (observations.clone(), everything.where_in(|sample| !block.contains(&sample))),
                context: self.context.clone(),
            }
        };
        (0..BLOCKS).map(of).collect()
    }
}

impl OneRecord {
    /// Noise of its channels, K, where that of all records together is `std_k`.
    pub fn noise_std_k(&self, std_k: [f64; 2]) -> [f64; 2] {
        let factor = self.observations.noise_factor();
        [0, 1].map(|i| std_k[i] * factor[i])
    }

    /// A model of other records on this one: what belongs to the rig stays as it is, and what belongs to a record is fitted.
    ///
    /// # Errors
    /// [`ModelError`] where an effect that belongs to a record cannot be made for this one.
    pub fn carried(&self, fitted: &Fitted) -> Result<Fitted, ModelError> {
        let Fitted { model, theta, .. } = fitted;
        let mut own = Model::new(&[], model.noise_std_k());
        own.is_frozen = true;
        let mut values = theta[..2].to_vec();
        for (index, effect) in model.effects.iter().enumerate() {
            let given = &theta[model.range(index)];
            if effect.is_of_the_record() {
                let effect = self.made_for_it(effect, given)?;
                values.extend(effect.starts().into_iter().next().unwrap_or_default());
                own = own.with(effect);
            } else {
                values.extend_from_slice(given);
                own = own.with(effect.clone());
            }
        }
        let own = own.holding(0, theta[0]).holding(1, theta[1]);
        let has_own = own.effects.iter().any(|effect| effect.is_of_the_record());
        let carried = Fitted { model: own, theta: values, ..fitted.clone() };
        Ok(carried.carried_to(&self.observations, |from| {
            if has_own {
                from.model.fit(&from.theta, &self.observations, &self.everything, Effort::Compare)
            } else {
                from.clone()
            }
        }))
    }

    /// An effect that belongs to a record in the form that others have it.
    fn made_for_it(&self, effect: &Shared, given: &[f64]) -> Result<Shared, ModelError> {
        let of_another = effect.record_of(0).and_then(|number| effect.in_record(number));
        let (form, places) = of_another.unwrap_or_else(|| (effect.clone(), 0..given.len()));
        let parameters =
            form.parameters().iter().zip(&given[places]).map(|(p, value)| (p.name.into(), *value)).collect();
        let known = KnownEffect { effect: form.identifier(), channel: form.channel(), parameters };
        let made = (known.effect.about().restore)(&known, &self.context)?;
        made.ok_or_else(|| ModelError::Model { effect: known.effect.name() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Settings;

    fn record(samples: u32, period_s: f64, from_s: f64) -> Observations {
        let time_s: Vec<f64> = (0..samples).map(|k| from_s + period_s * f64::from(k)).collect();
        let reading_c = [1.0, 3.0].map(|k| time_s.iter().map(|t| 20.0 + k * t.sin()).collect());
        Observations::new(vec![Stretch::new(time_s, reading_c)], Some(period_s)).expect("a record")
    }

    /// Records that overlap in time come one after the other, whatever their own clocks said.
    #[test]
    fn records_follow_each_other() {
        let joined = Observations::joined(&[record(90, 0.5, 1e6), record(80, 0.5, 0.0), record(70, 0.5, 1e6)]);
        let joined = joined.expect("three records");
        let members = joined.members();
        assert_eq!(members.iter().map(|m| m.samples.clone()).collect::<Vec<_>>(), [0..90, 90..170, 170..240]);
        assert!(members.windows(2).all(|two| two[0].ends_s[1] < two[1].ends_s[0]), "{members:?}");
        assert_eq!(joined.period_s, Some(0.5));
        assert!(joined.is_joined() && !joined.of_member(2).is_joined());
        let others = joined.without_member(1);
        assert_eq!(others.members().iter().map(|m| m.number).collect::<Vec<_>>(), [0, 2]);
        assert_eq!(others.members()[1].ends_s, members[2].ends_s);
        // As long as the longest of them, not as all of them together.
        assert_eq!(joined.span_s(), 44.5);
    }

    /// Two records whose noise differs five times have levels of their own beside those of both; one that is left has its own levels
    /// alone. Failed: it kept its part of the levels of both, and its residuals were weighted twice.
    #[test]
    fn a_record_that_is_left_of_two_has_no_levels_beside_its_own() {
        // The golden ratio spreads it evenly and without order, and the waves are slow beside it.
        let noisy = |noise_k: f64| {
            let time_s: Vec<f64> = (0..400).map(f64::from).collect();
            let noise = |k: usize, salt: f64| noise_k * (((k * k) as f64 * 0.618_034 + salt * k as f64).fract() - 0.5);
            let of = |salt: f64| {
                let waves = time_s.iter().enumerate().map(|(k, t)| 20.0 + (t / 40.0).sin() + noise(k, salt));
                waves.collect::<Vec<f64>>()
            };
            let reading_c = [0.31, 0.47].map(of);
            Observations::new(vec![Stretch::new(time_s, reading_c)], Some(1.0)).expect("a record")
        };
        let both = Observations::joined(&[noisy(0.01), noisy(0.05)]).expect("two records");
        let settings = Settings::default();
        let prepared = Prepared::new(&both, &settings).expect("two records");
        let factor = |observations: &Observations| observations.stretches[0].noise_factor;
        assert!(factor(&prepared.raw.0) != [1.0; 2], "the levels differ");
        let left = Prepared::new(&prepared.raw.0.without_member(1), &settings).expect("one record");
        assert_eq!(factor(&left.raw.0), [1.0; 2]);
    }

    /// Failed: records of 0.5 and 0.25 s were as one with uneven samples, which fits neither.
    #[test]
    fn records_of_different_periods_are_refused() {
        let error = Observations::joined(&[record(90, 0.5, 0.0), record(80, 0.25, 0.0)]).expect_err("two periods");
        assert_eq!(error, ModelError::OtherPeriod { record: 1, period_s: 0.25, first_s: 0.5 });
        // Clocks that differ by 20 parts in a million.
        let joined = Observations::joined(&[record(90, 0.5, 0.0), record(80, 0.500_01, 0.0)]).expect("one period");
        assert_eq!(joined.period_s, Some(0.5));
    }
}
