//! How far model and prior move the gas temperature: one of their numbers at a time.
//!
//! Each case is a gas temperature of its own, of the whole record. Most matter little, and those of long records, whose model and
//! prior are well determined, hardly at all: pieces of the record show which.

use rayon::prelude::*;
use twinlag_compensate::{Gas, Prior};

use crate::parallel::in_parallel;
use crate::watch::Stop;

/// Share of a variance that cases which are left out may move it by, all together and at the sample that they move most: 2 % of a
/// standard deviation. The mean share of the model and of the prior is added, so that less is left out; other priors are left out
/// altogether.
const MAX_LEFT_OUT_SHARE: f64 = 0.04;

/// What a case says of the gas temperature.
#[derive(Clone, Copy, Debug)]
pub(super) enum Moves {
    /// The model's parameters moved by a standard error.
    Model,
    /// The prior's numbers moved by a standard error, which counts so many times.
    Prior { times: f64 },
    /// Another prior, of this probability.
    Mixture { weight: f64 },
}

/// A model and prior in place of the likeliest ones.
pub(super) struct Case {
    pub(super) theta: Vec<f64>,
    pub(super) prior: Prior,
    pub(super) moves: Moves,
}

/// The cases that matter, and the mean share of the variance that the model and the prior have by others.
pub(super) struct Chosen {
    cases: Vec<Case>,
    of_model: f64,
    of_prior: f64,
}

/// The gas temperature, with what the model and the prior add to its variance.
pub(super) struct Moved {
    pub(super) gas: Gas,
    pub(super) of_model: Added,
    pub(super) of_prior: Added,
}

/// What is added to the variance of a gas temperature.
pub(super) struct Added {
    /// The share of the variance that is added at each sample.
    share: f64,
    /// That with what cases add, at each sample, K²; empty where there is none.
    sums: Vec<f64>,
}

impl Added {
    fn of_share(share: f64) -> Self {
        Self { share, sums: Vec::new() }
    }

    /// At sample `k`, K².
    ///
    /// - `std_k`: standard deviation of the gas temperature there, K
    pub(super) fn at(&self, k: usize, std_k: f64) -> f64 {
        self.sums.get(k).copied().unwrap_or(self.share * std_k * std_k)
    }

    /// At each sample of `gas`, K².
    fn each(&mut self, gas: &Gas) -> &mut [f64] {
        if self.sums.is_empty() {
            self.sums.extend(gas.std_k.iter().map(|s| self.share * s * s));
        }
        &mut self.sums
    }
}

/// What is done in the meantime.
const TASK: &str = "how model and prior move the gas temperature";

impl Chosen {
    pub(super) const fn all(cases: Vec<Case>) -> Self {
        Self { cases, of_model: 0.0, of_prior: 0.0 }
    }

    /// Whether any of them has other parameters of the model.
    pub(super) fn moves_the_model(&self) -> bool {
        self.cases.iter().any(|case| matches!(case.moves, Moves::Model))
    }

    /// Those of `cases` that matter in pieces of a record, of which `gas` is the likeliest and `run` gives the others.
    pub(super) fn by(cases: Vec<Case>, gas: &Gas, stop: &Stop<'_>, run: impl Fn(&Case) -> Option<Gas> + Sync) -> Self {
        let largest_and_mean = |case: &Case| {
            let other = run(case)?;
            let shares = (0..gas.gas_c.len()).map(|k| case.share(gas, &other, k));
            let (largest, sum) = shares.fold((0.0_f64, 0.0), |(largest, sum), s| (largest.max(s), sum + s));
            Some((largest, sum / gas.gas_c.len() as f64))
        };
        let shares = in_parallel(&cases, TASK, stop, largest_and_mean);
        // One that cannot be run in pieces counts in the whole.
        let known = |share: Option<(f64, f64)>| share.filter(|s| s.1.is_finite()).unwrap_or((f64::INFINITY, 0.0));
        let mut ranked: Vec<(Case, (f64, f64))> = cases.into_iter().zip(shares.into_iter().map(known)).collect();
        ranked.sort_by(|a, b| a.1.0.total_cmp(&b.1.0));
        let mut out = Self::all(Vec::new());
        let mut left_out = 0.0;
        for (case, (largest, mean)) in ranked {
            left_out += largest;
            match case.moves {
                _ if left_out > MAX_LEFT_OUT_SHARE => out.cases.push(case),
                Moves::Model => out.of_model += mean,
                Moves::Prior { .. } => out.of_prior += mean,
                Moves::Mixture { .. } => (),
            }
        }
        out
    }

    /// `gas` as the mean over other priors that may be, with how far it is moved. `run` gives a case.
    ///
    /// - `has_intensity`: whether the intensity changes, which priors were not weighed with
    pub(super) fn moved(
        self,
        gas: Gas,
        has_intensity: bool,
        stop: &Stop<'_>,
        run: impl Fn(&Case) -> Option<Gas> + Sync,
    ) -> Moved {
        let (mut of_model, mut of_prior) = (Added::of_share(self.of_model), Added::of_share(self.of_prior));
        let mut others = Vec::new();
        // As many at once as there are processors, so that memory does not grow with the number of cases; sums in their order.
        let at_once = rayon::current_num_threads();
        for (turn, cases) in self.cases.chunks(at_once).enumerate() {
            stop.say(TASK, turn * at_once, self.cases.len());
            if stop.is_wanted() {
                break;
            }
            let found: Vec<Option<Gas>> = cases.par_iter().map(&run).collect();
            for (case, other) in cases.iter().zip(found) {
                let Some(other) = other else { continue };
                let (sums, times) = match case.moves {
                    Moves::Model => (&mut of_model, 1.0),
                    Moves::Prior { times } => (&mut of_prior, times),
                    Moves::Mixture { weight } => {
                        others.push((weight, other));
                        continue;
                    }
                };
                for ((sum, a), b) in sums.each(&gas).iter_mut().zip(&other.gas_c).zip(&gas.gas_c) {
                    *sum += times * (a - b) * (a - b);
                }
            }
        }
        if has_intensity {
            judge(&gas, &mut others);
        }
        if others.is_empty() {
            return Moved { gas, of_model, of_prior };
        }
        // The shares are those of the likeliest model and prior.
        [&mut of_model, &mut of_prior].into_iter().for_each(|added| {
            added.each(&gas);
        });
        Moved { gas: averaged(&gas, &others), of_model, of_prior }
    }
}

impl Case {
    /// The share of the variance of `gas` at sample `k` that this case adds, `other` its own gas. Twice what a mean is moved
    /// by, in standard deviations, counts as well.
    fn share(&self, gas: &Gas, other: &Gas, k: usize) -> f64 {
        let away = (other.gas_c[k] - gas.gas_c[k]) / gas.std_k[k];
        match self.moves {
            Moves::Model => away * away,
            Moves::Prior { times } => times * away * away,
            Moves::Mixture { weight } => {
                let wider = (other.std_k[k] / gas.std_k[k]).powi(2) - 1.0;
                weight * (wider.abs() + 2.0 * away.abs() + away * away)
            }
        }
    }
}

/// Gives other priors, whose weights are those of a constant intensity, the likelihood that they have with a changing one.
fn judge(gas: &Gas, others: &mut [(f64, Gas)]) {
    let own = 1.0 - others.iter().map(|(weight, _)| weight).sum::<f64>();
    let gain = |other: &Gas| other.log_likelihood - gas.log_likelihood;
    let most = others.iter().map(|(_, other)| gain(other)).fold(0.0, f64::max);
    others.iter_mut().for_each(|(weight, other)| *weight *= (gain(other) - most).exp());
    let all = own * (-most).exp() + others.iter().map(|(weight, _)| weight).sum::<f64>();
    others.iter_mut().for_each(|(weight, _)| *weight /= all);
}

/// The mean of `gas` and of those by other priors, with the variance of the mixture.
fn averaged(gas: &Gas, others: &[(f64, Gas)]) -> Gas {
    let own = 1.0 - others.iter().map(|(weight, _)| weight).sum::<f64>();
    let of = |k: usize| {
        let all = || others.iter().map(|(weight, other)| (*weight, other)).chain([(own, gas)]);
        let mean_c: f64 = all().map(|(w, g)| w * g.gas_c[k]).sum();
        let variance: f64 = all().map(|(w, g)| w * (g.std_k[k].powi(2) + (g.gas_c[k] - mean_c).powi(2))).sum();
        (mean_c, variance.sqrt())
    };
    let (gas_c, std_k) = (0..gas.gas_c.len()).map(of).unzip();
    Gas { gas_c, std_k, ..gas.clone() }
}
