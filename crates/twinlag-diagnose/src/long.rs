//! Long records, which are searched in pieces.
//!
//! Residuals are local functions of the readings, so that pieces of a record lose nothing but their ends: what is left of a search
//! of them is what a record of so many samples shows. What it finds is then fitted to the whole record, where the search goes on
//! from there: every effect that is still missing is screened against all residuals, and what stands out is fitted to all. Effects
//! with quite other time constants, each of which costs a fit, are fitted to the whole where the pieces do not exclude them.

use std::ops::Range;

use twinlag_model::{Effort, Fitted, ModelError, Observations, Prepared, Settings, Shared, Watch, evenly_spread};

use crate::candidates::{Candidate, Search};
use crate::moves::{Move, State, Taken};

/// Samples of a record that is searched whole. A search takes some hundred fits, one of the whole a second for a million samples.
const MAX_SEARCHED_SAMPLES: usize = 49_152;
/// Pieces of a longer one, spread evenly, and the samples of each: more than twenty thousand samples, of which a delay of 64 samples
/// takes a tenth.
const PIECES: usize = 12;
const PIECE_SAMPLES: usize = 2048;
/// Samples of all of them.
pub(crate) const SEARCHED_SAMPLES: usize = PIECES * PIECE_SAMPLES;
/// Deviance by which the pieces exclude an effect: odds of one to a hundred and fifty.
pub(crate) const EXCLUDED_DEVIANCE: f64 = 10.0;
/// Factor within which time constants are the same: a screening of the effect has looked there.
const SAME_TAU_FACTOR: f64 = 1.1;

/// Whether a record is searched in pieces first.
pub(crate) fn is_long(observations: &Observations) -> bool {
    observations.samples() > MAX_SEARCHED_SAMPLES
}

/// Pieces of a long record; `None` of one that is searched whole, or consists of stretches too short for pieces.
pub(crate) fn pieces(observations: &Observations) -> Option<Observations> {
    if !is_long(observations) {
        return None;
    }
    let members = observations.members();
    let of_each = (PIECES / members.len()).max(1);
    // Of more records than pieces every second one, or third.
    let each = members.len().div_ceil(PIECES);
    let starts = members.iter().step_by(each).flat_map(|member| starts_in(member.samples.clone(), of_each));
    let pieces = observations.excerpt(starts, PIECE_SAMPLES);
    (!is_long(&pieces)).then_some(pieces)
}

/// First samples of so many pieces of a record, or as many as lie in it side by side; of one in its middle.
fn starts_in(samples: Range<usize>, pieces: usize) -> Vec<usize> {
    let Range { start, end } = samples;
    match pieces.min((end - start) / PIECE_SAMPLES) {
        0 => Vec::new(),
        1 => vec![start + (end - start - PIECE_SAMPLES) / 2],
        pieces => evenly_spread(end - start, pieces, PIECE_SAMPLES).map(|first| start + first).collect(),
    }
}

impl<'a> State<'a> {
    /// What a search of pieces found, fitted to the whole record.
    pub(crate) fn carried(part: State<'_>, mut prepared: Prepared, settings: &'a Settings, watch: Watch<'a>) -> Self {
        let base = prepared.base_from(&part.base.theta, settings);
        let current = match part.current.model.noise() {
            Some(_) => part.current.clone(),
            None => {
                Fitted { model: part.current.model.clone().with_noise(prepared.levels.std_k), ..part.current.clone() }
            }
        };
        let mut out = Self::of(base, prepared, settings, watch);
        out.current = out.carried_fit(&current);
        if part.taken.iter().any(|taken| taken.candidate.effect.about().is_narrow) {
            out.prepared.find_levels(&out.current);
            out.refit();
        }
        if part.prepared.levels.is_of_residual && out.prepared.has_high_levels(&out.current) {
            out.prepared.lower_levels(&out.current, settings);
            out.refit();
        }
        if part.moves.iter().any(|entry| matches!(entry, Move::Reweigh { .. })) {
            out.prepared.weigh_by(&out.current);
            out.refit();
        }
        out.taken = part.taken.into_iter().map(|taken| out.taken_in_whole(taken)).collect();
        out.moves = part.moves;
        let is_open = |far: &Candidate| far.white_gain > -EXCLUDED_DEVIANCE && is_elsewhere(&far.fitted, &part.current);
        out.far_in_pieces = Some(part.far.into_iter().filter(is_open).collect());
        out
    }

    /// A model of pieces fitted to the whole record.
    fn carried_fit(&self, of_pieces: &Fitted) -> Fitted {
        let Prepared { observations, searched, .. } = &self.prepared;
        let fit = |from: &Fitted| from.model.fit(&from.theta, observations, searched, Effort::Compare);
        of_pieces.clone().carried_to(observations, fit)
    }

    /// An effect that pieces showed, with fits to the whole record.
    fn taken_in_whole(&self, taken: Taken) -> Taken {
        let candidate = Candidate { fitted: self.current.clone(), ..taken.candidate };
        let in_whole = |tie: Candidate| {
            let fitted = self.carried_fit(&with_levels_of(&self.current, &tie.fitted));
            Candidate { fitted, ..tie }
        };
        Taken { candidate, ties: taken.ties.into_iter().map(in_whole).collect() }
    }
}

impl Search<'_> {
    /// Effects with quite other time constants that pieces do not exclude, fitted to the whole record beside `current`.
    pub(crate) fn far_in_whole(&self, current: &Fitted, far: &[Candidate]) -> Result<Vec<Candidate>, ModelError> {
        let robust_before = self.robust(current);
        let is_beside = |far: &&Candidate| {
            let (effects, own) = (&far.fitted.model.effects, &current.model.effects);
            let is_same = |(a, b): (&Shared, &Shared)| {
                let [a, b] = [a, b].map(|effect| (effect.identifier(), effect.channel(), effect.parameters().len()));
                a == b
            };
            effects.len() == own.len() + 1 && effects.iter().zip(own).all(is_same)
        };
        let of_whole = |far: &Candidate| {
            let in_gas = self.gas().and_then(|gas| far.effect.in_gas(gas));
            let effect = in_gas.unwrap_or_else(|| far.effect.clone());
            let fitted = Fitted { model: current.model.with(effect.clone()), ..far.fitted.clone() };
            Candidate { effect, fitted, ..far.clone() }
        };
        let far: Vec<Candidate> = far.iter().filter(is_beside).map(of_whole).collect();
        self.each(&far, |far| self.finished(current, far, robust_before))
    }
}

/// A fit of pieces with the noise levels of `current`: energies compare under the same levels alone.
fn with_levels_of(current: &Fitted, fitted: &Fitted) -> Fitted {
    Fitted { model: fitted.model.clone().with_noise(current.model.noise_std_k()), ..fitted.clone() }
}

/// Whether time constants of two fits differ.
fn is_elsewhere(one: &Fitted, other: &Fitted) -> bool {
    let is_far = |i: usize| (one.theta[i] / other.theta[i]).ln().abs() > SAME_TAU_FACTOR.ln();
    is_far(0) || is_far(1)
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use twinlag_model::{Identifier, Stretch};
    use twinlag_signal::{Gas, Noise, Record, Rig, Sensor, Signal, Turbulence};

    use super::*;
    use crate::diagnose::diagnose;
    use crate::remark::Remark;

    const SAMPLES: usize = 60_000;

    /// Turbulence that sensors of 12 and 60 ms read, the second one through another lag of 6 ms.
    fn long_record() -> Observations {
        let gas = Gas::new(300.0, Signal::Turbulence(Turbulence { std_k: 20.0, corner_hz: 2.4, cutoff_hz: 200.0 }));
        let mut sensors = [Sensor::new("T1", 0.012), Sensor::new("T2", 0.060)];
        sensors.iter_mut().for_each(|sensor| sensor.noise = Some(Noise::white(0.2)));
        sensors[1].second_time_constant_s = Some(0.006);
        let rig = Rig::new(3, Record::new(SAMPLES, 0.001), gas, sensors).expect("a valid rig");
        let record = rig.simulate().expect("finite numbers");
        Observations::new(vec![Stretch::new(record.time_s, [record.t1_c, record.t2_c])], Some(0.001)).expect("a record")
    }

    /// Of a record that is searched in pieces the numbers are those of all of it: standard errors go with the root of the
    /// samples, of which pieces have two fifths, and values lie within five of them.
    #[test]
    fn what_pieces_show_is_fitted_to_all_of_a_long_record() {
        let (observations, settings) = (long_record(), Settings::default());
        let watch = |_: &str, _, _| ControlFlow::Continue(());
        let answer = diagnose(&observations, &settings, &watch).expect("a diagnosis");
        let named: Vec<Identifier> = answer.effects.iter().map(|e| e.effect).collect();
        assert_eq!(named, [Identifier::SECOND_ORDER]);
        assert_eq!(
            answer.remarks,
            [Remark::SearchedInPieces { samples: SEARCHED_SAMPLES, all: SAMPLES, is_screened: true }]
        );
        let of_pieces = diagnose(&pieces(&observations).expect("long"), &settings, &watch).expect("a diagnosis");
        for ((whole, part), tau_s) in
            answer.last.time_constants.iter().zip(&of_pieces.last.time_constants).zip([0.012, 0.060])
        {
            let (value_s, error_s) = (whole.value_s.expect("determined"), whole.standard_error_s.expect("determined"));
            assert!((value_s - tau_s).abs() < 5.0 * error_s, "{value_s} ± {error_s} s, and {tau_s} s is true");
            let ratio = part.standard_error_s.expect("determined") / error_s;
            assert!(ratio > 1.3, "errors of pieces are {ratio} times as large, and the root of 5/2 is 1.58");
        }
    }

    /// A short record is searched whole, and so is a long one that consists of stretches shorter than a piece.
    #[test]
    fn a_record_without_pieces_is_searched_whole() {
        let stretch = |samples: usize, from: usize| {
            let time_s: Vec<f64> = (from..from + samples).map(|k| k as f64).collect();
            let reading_c = [2.0, 3.0].map(|k| time_s.iter().map(|t| (k * t).sin()).collect());
            Stretch::new(time_s, reading_c)
        };
        let observations = |stretches| Observations::new(stretches, Some(1.0)).expect("a record");
        assert!(pieces(&observations(vec![stretch(MAX_SEARCHED_SAMPLES, 0)])).is_none());
        let shreds = (0..60).map(|i| stretch(1000, 2000 * i)).collect();
        assert!(pieces(&observations(shreds)).is_none());
        let long = observations(vec![stretch(MAX_SEARCHED_SAMPLES + 1, 0)]);
        assert_eq!(pieces(&long).expect("long").samples(), SEARCHED_SAMPLES);
    }
}
