//! The thresholds of the search and of the verdict in one place, each with where it comes from.
//!
//! Grids, starts, bounds and iteration counts are not here: they decide how a number is found, not
//! which one, and stand beside the code that uses them. A policy can be stored, compared and
//! changed one number at a time.

use serde::{Deserialize, Serialize};

use crate::error::ModelError;

/// Tests of a residual at most: three of its energy and whiteness, seven of what it goes with.
const RESIDUAL_TESTS: f64 = 10.0;

/// A number of a policy: a quantity, or a count.
trait PolicyNumber: Copy {
    fn to_f64(self) -> f64;
    fn of_f64(value: f64) -> Self;
}

impl PolicyNumber for f64 {
    fn to_f64(self) -> f64 {
        self
    }

    fn of_f64(value: f64) -> Self {
        value
    }
}

impl PolicyNumber for usize {
    fn to_f64(self) -> f64 {
        self as f64
    }

    fn of_f64(value: f64) -> Self {
        value.round().max(1.0) as Self
    }
}

/// One struct from one list: its fields with their documentation, their defaults, and access by
/// name.
macro_rules! policy {
    ($($(#[doc = $doc:literal])+ $name:ident: $kind:ty = $default:expr,)+) => {
        /// The numbers that decide what a user reads. Names end in the quantity or the unit;
        /// energies are those of the whitened residual per residual, 1 for noise of the assumed
        /// levels; deviances are differences of `−2 ln L`.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
        #[serde(deny_unknown_fields, default)]
        pub struct Policy {
            $($(#[doc = $doc])+ pub $name: $kind,)+
        }

        impl Default for Policy {
            fn default() -> Self {
                Self { $($name: $default,)+ }
            }
        }

        impl Policy {
            /// Names of all numbers, each with its documentation.
            pub const ABOUT: &[(&str, &str)] = &[$((stringify!($name), concat!($($doc, "\n"),+)),)+];

            /// Every number with its name.
            pub fn numbers(&self) -> Vec<(&'static str, f64)> {
                vec![$((stringify!($name), PolicyNumber::to_f64(self.$name)),)+]
            }

            /// The policy with another `value` of the number `name`, counts rounded and at least 1;
            /// `None` if there is no such number.
            #[must_use]
            pub fn with(&self, name: &str, value: f64) -> Option<Self> {
                let mut out = self.clone();
                match name {
                    $(stringify!($name) => out.$name = PolicyNumber::of_f64(value),)+
                    _ => return None,
                }
                Some(out)
            }
        }
    };
}

policy! {
    /// Probability that one round adds an effect, or sees a line, that is not there, all candidates together: the
    /// rate that is promised. Experiment `false-alarms` measures what becomes of it.
    round_false_alarm_probability: f64 = 1e-3,
    /// Probability that noise alone lets one candidate be fitted: a screen that costs time alone,
    /// ten times as wide as the promised rate, since a linearisation is not exact.
    screening_probability: f64 = 0.01,
    /// Probability that any of the tests of a right model fails. Each test has its share of it
    /// ([`Policy::rejection_p_value`]).
    record_rejection_probability: f64 = 1e-3,

    /// Deviance up to which two effects explain a record equally well: a likelihood ratio of `e⁵`,
    /// 150, which knowledge of the rig easily outweighs.
    tie_deviance: f64 = 10.0,
    /// Deviance, whatever the noise, up to which candidates are compared with white noise: two
    /// ties, since either may be off by one.
    near_deviance: f64 = 20.0,
    /// Deviance up to which two candidates are one model in two guises, the effect that occurs more
    /// often named: twice the logarithm of a likelihood ratio below 3 is no evidence (Kass and
    /// Raftery 1995).
    same_deviance: f64 = 2.0,

    /// Odds from which on a slow body is taken to have had the temperature of the gas as the record began: strong evidence (Kass
    /// and Raftery 1995). With less it may have had any, which leaves the numbers right in either case.
    first_state_odds: f64 = 20.0,

    /// Part of what noise of another colour explains that an effect must explain whatever the
    /// noise, to come before it: chosen.
    beside_noise_share: f64 = 0.03,
    /// Part of what noise of another colour explains that an effect must explain with levels as free
    /// as those beside the noise, to come before it all the same: chosen, the larger half.
    instead_of_noise_share: f64 = 0.5,
    /// Part of the best candidate's score that a static disagreement must have to come first where
    /// no effect explains the record: chosen.
    static_share: f64 = 0.25,
    /// Part of the residuals that a model must keep: one that takes most of a short stretch away
    /// explains nothing. Chosen.
    kept_share: f64 = 0.8,

    /// Energy beyond which a model is far off, and a linearisation there says little: chosen, 1.7
    /// times the noise in amplitude.
    far_off_energy: f64 = 3.0,
    /// Energy that the best of the candidates leaves beyond which no single effect explains the
    /// record: chosen.
    incomplete_energy: f64 = 1.5,
    /// Standard errors of the energy beyond which more parameters of an effect are tried: three,
    /// once in 700 right models.
    resize_standard_errors: f64 = 3.0,

    /// Where the best candidate leaves only noise, one whose gain in an excerpt is less than this part of the best one's is
    /// not fitted to the end. Chosen: half of the gain leaves the square root of the excess energy.
    rival_share: f64 = 0.5,
    /// Deviance per residual by which a look-alike may be worse at first sight and still be fitted to the end: a tenth
    /// more energy, which the last iterations of a fit do not take off.
    look_alike_deficit_share: f64 = 0.1,

    /// Effects that are added at most: twice as many as can usually be distinguished, so that a
    /// record in which they cannot is seen as one. Chosen.
    most_effects: usize = 4,
    /// Effects that can be distinguished; a verdict on more is partial. Chosen: experiment `pairs`
    /// measures how often two are.
    most_distinguished_effects: usize = 2,
    /// Candidates that are fitted to the end, of some thirty: chosen, it costs time.
    most_fitted_candidates: usize = 10,

    /// Shortest time constant that samples resolve, sample periods: a fifth leaves `e⁻⁵`, less than
    /// a hundredth, of a step to the next sample.
    shortest_resolved_periods: f64 = 0.2,
    /// Part of the longest time constant that a fit may reach beyond which it is as good as on that
    /// bound. Chosen.
    longest_resolved_share: f64 = 0.9,
    /// Standard error of a time constant's logarithm beyond which it is not printed: its 95 %
    /// interval spans a factor of seven, `exp(2 × 1.96 × 0.5)`.
    vague_log_std: f64 = 0.5,
    /// Standard error of a time constant's logarithm up to which the curvature is believed, and no
    /// other minimum is looked for. Chosen.
    certain_log_std: f64 = 0.03,
    /// Factor by which a time constant is moved to see whether another fits as well: chosen.
    ridge_factor: f64 = 2.0,

    /// Probability that parts of a record seem to disagree on a number of a right model: of the three that are asked most, in
    /// three records of a thousand.
    parts_rejection_probability: f64 = 1e-3,
    /// Probability that records of one rig seem to differ, in their noise or in a number that they share, of a right model: as of
    /// parts of a record.
    records_rejection_probability: f64 = 1e-3,
    /// How much more than chance the root mean square of a whitened residual may exceed 1 in a record that was left out, or what the record
    /// leaves over by itself as a share of that: what the parameters of the others are uncertain by adds to it. Chosen: a record whose sensor
    /// is 15 % slower exceeds it (test `campaign` of `twinlag-diagnose`); experiment `campaign` counts the records that are accused.
    left_out_rms_margin: f64 = 0.1,
    /// Probability that a record has an effect that the search has not named: chosen, one in four, of which each kind of effect
    /// that has a size has an equal share, and its places, forms and starts share that.
    prior_effect_probability: f64 = 0.25,
    /// How many times as probable as that are second lags, slow paths and delays, of which every probe has some: by
    /// `cargo xtask experiment run grades`. With 3, of the numbers that may be used 93.8 % hold the truth and 0.8 % are beyond five
    /// standard errors, and both time constants may be used in 92 % of records with nothing missing; with 1 it is 93.4, 1.1 and 96 %.
    prior_phase_factor: f64 = 3.0,
    /// Probability that an effect is there unseen which moves a number out of its interval, from which on the number
    /// is right only if there is none: the one in twenty that the interval leaves open itself.
    hidden_effect_probability: f64 = 0.05,
    /// Part of the record beyond which no time constant is given: ten of the longest one fit into it, fewer say nothing of
    /// how it differs from a drift. Chosen.
    longest_given_share: f64 = 0.1,
    /// Energy beside that of the noise, as a share of it, up to which a record counts as explained, and intervals cover that
    /// all of it goes with the number: half of what the test of the energy of 20 000 samples can see, `4 √(2/20 000)`.
    explained_excess_share: f64 = 0.02,
    /// Coherence of the residual with the gas from which on what was taken for noise is model error: what the test of it sees
    /// in 20 000 samples, which is 0.076 where the gas stands out at ten frequencies and 0.087 at sixty: chosen between them.
    /// Longer records show smaller coherence, for example of a noise that is not quite of first order.
    noise_coherence: f64 = 0.08,

    /// How many standard errors the energy must lie below that of the assumed levels before they are
    /// lowered: four, once in 30 000 records.
    lower_levels_standard_errors: f64 = 4.0,

    /// Blocks along the record of which some judge: many short ones, so that they see the gas that
    /// the others see. Chosen.
    judging_blocks: usize = 80,
    /// One block in so many judges: an eighth of the record makes its error certain to 4 % in 3000
    /// samples.
    judging_every_blocks: usize = 8,
    /// Blocks along the record that are left out in turn when a candidate is accepted: chosen.
    held_out_blocks: usize = 40,
    /// Groups of those, each left out together: chosen, the usual five, which leave four fifths for
    /// the fit.
    held_out_folds: usize = 5,
    /// Part of a block beside a left-out one that is in neither, since it shares readings with it:
    /// chosen.
    block_gap_share: f64 = 0.1,
    /// The most samples of such a gap: chosen.
    block_gap_most_samples: usize = 20,

    /// Robust standard deviations beyond which a single reading is wrong: once in 500 million
    /// readings of Gaussian noise.
    spike_standard_deviations: f64 = 6.0,
    /// Robust standard deviations beyond which a reading is wrong in a channel that already has
    /// spikes: once in 150 000 readings.
    further_spike_standard_deviations: f64 = 4.5,
    /// Factor by which a reading that the residual hardly shows must stick out farther from its
    /// neighbours: chosen.
    spike_neighbour_factor: f64 = 1.7,
    /// Part of the standard deviations of [`Policy::spike_standard_deviations`] that the residual must reach at a reading
    /// that stands out from its neighbours by [`Policy::spike_neighbour_factor`]: chosen.
    spike_residual_share: f64 = 0.5,
    /// If the other channel moves faster at the outlying readings than elsewhere by more than this many standard errors of
    /// its mean rank, they are the gas and not spikes: wrong once in 4000 channels.
    most_spike_rank_standard_errors: f64 = 3.5,
    /// Part of a channel's readings beyond which these are not isolated: chosen.
    most_spikes_share: f64 = 0.05,
    /// Readings at one extreme value from which on the converter may end there, if half of them are
    /// neighbours: chosen.
    fewest_readings_at_end: usize = 8,
    /// Standard errors, beyond the steps of both converters, by which the other channel must move on while one stays at an
    /// extreme: once in 30 000 ends.
    limit_standard_errors: f64 = 4.0,
    /// Runs at an extreme from which on noise may be cut off there: chosen.
    fewest_cut_runs: usize = 20,
    /// Steps of the converter that a reading beside such a run is away where noise is cut off. One that stays for two samples
    /// moves by less than a step from sample to sample: chosen, far beyond that.
    cut_noise_steps: f64 = 5.0,
    /// Places along the record whose departures the other channel's must exceed, as a wrong model makes them: one in forty by
    /// chance, of the few extremes that come in runs and that a flank runs into.
    limit_comparisons: usize = 39,

    /// Power of a tone over that of the noise from which on it counts: a bin of noise is beyond it
    /// once in 10¹³.
    tone_power_ratio: f64 = 30.0,
    /// Part of a reading's power above its noise that tones must have for the gas to count as one of tones: the larger half.
    tone_power_share: f64 = 0.5,
    /// Amplitude of a line in the difference of both inferred inputs, over that in their mean, below which both sensors see
    /// it and it is the gas's: what one of them alone sees has 2. Chosen.
    most_gas_line_ratio: f64 = 0.7,
    /// Samples below which tones are not counted: chosen.
    tone_fewest_samples: usize = 200,
    /// Periods of a tone in a record below which it is not seen to come back: chosen.
    tone_fewest_periods: usize = 5,
    /// Most tones of the gas for which the answer states how many numbers they determine: chosen.
    most_counted_tones: usize = 4,
}

impl Policy {
    /// The p-value below which a test of a residual rejects the model: all of them together do so
    /// in [`Policy::record_rejection_probability`] of the right models at most (Bonferroni).
    ///
    /// ```
    /// use twinlag_model::Policy;
    ///
    /// let strict = Policy::default().with("record_rejection_probability", 1e-5).expect("a number of the policy");
    /// assert!((strict.rejection_p_value() / 1e-6 - 1.0).abs() < 1e-15); // each of ten tests has a tenth
    /// strict.check()?;
    /// // A probability of 2 means nothing, and the message says which number it is.
    /// let wrong = strict.with("screening_probability", 2.0).expect("a number of the policy");
    /// assert!(wrong.check().expect_err("refused").to_string().contains("screening_probability = 2"));
    /// # Ok::<(), twinlag_model::ModelError>(())
    /// ```
    pub fn rejection_p_value(&self) -> f64 {
        self.record_rejection_probability / RESIDUAL_TESTS
    }

    /// Samples beside a block of `blocks` in a record of `samples` that are neither in it nor out
    /// of it.
    pub(crate) fn block_gap_samples(&self, samples: usize, blocks: usize) -> usize {
        let share = samples as f64 / blocks.max(1) as f64 * self.block_gap_share;
        (share as usize).min(self.block_gap_most_samples)
    }

    /// That every number is positive, and that shares and probabilities are no more than 1.
    ///
    /// # Errors
    /// [`ModelError::Policy`] names the first that is not.
    pub fn check(&self) -> Result<(), ModelError> {
        for (name, got) in self.numbers() {
            let is_share = name.ends_with("_share") || name.ends_with("_probability");
            if !got.is_finite() || got <= 0.0 || (is_share && got > 1.0) {
                return Err(ModelError::Policy { name, got });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_number_changes_by_its_name() {
        let policy = Policy::default();
        let other = policy.with("tie_deviance", 7.5).expect("a number of the policy");
        assert_eq!(other.tie_deviance, 7.5);
        assert_eq!(Policy { tie_deviance: policy.tie_deviance, ..other }, policy);
        assert_eq!(policy.with("most_effects", 0.2).expect("a number of the policy").most_effects, 1);
        assert_eq!(policy.with("no_such_number", 1.0), None);
    }

    #[test]
    fn what_means_nothing_is_refused_by_its_name() {
        let policy = Policy::default();
        policy.check().expect("the default is sound");
        for (name, value) in [("tie_deviance", 0.0), ("kept_share", 1.1), ("far_off_energy", f64::NAN)] {
            let error = policy.with(name, value).expect("a number of the policy").check().expect_err(name);
            assert!(error.to_string().contains(name), "{error}");
        }
        policy.with("kept_share", 1.0).expect("a number of the policy").check().expect("all of it");
    }

    /// A tenth of a block, rounded down, up to the cap.
    #[test]
    fn gaps_are_a_share_of_a_block_up_to_their_cap() {
        let policy = Policy::default();
        assert_eq!([799, 800, 15_999, 16_000, 100_000].map(|n| policy.block_gap_samples(n, 80)), [0, 1, 19, 20, 20]);
    }

    #[test]
    fn tests_share_the_rate_of_a_record() {
        let policy = Policy::default();
        assert_eq!(RESIDUAL_TESTS * policy.rejection_p_value(), policy.record_rejection_probability);
        assert_eq!(policy.rejection_p_value(), 1e-4);
    }
}
