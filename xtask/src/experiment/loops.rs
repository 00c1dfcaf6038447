//! Experiments of the closed loop: random rigs with effects that are not declared, diagnosed blind.
//!
//! The rigs integrate physics in continuous time and share no code with the effects that explain them.

mod tables;

use std::path::Path;

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use twinlag::diagnosis::{Identifier, Verdict};
use twinlag::record::{Channels, Record, SamplingChoice};
use twinlag::signal::Simulated;
use twinlag::signal::undeclared::{GasKind, Kind, Undeclared, undeclared};
use twinlag::{DiagnoseOptions, Diagnosis, NamedEffect, Options, diagnose};
use twinlag_study::{Failure, Outcome, Quantity, Results, Study};

use super::keep_last;
use super::stored::{Head, Stored};
pub(super) use tables::{hits_of_count, set_name};

/// A plan: which effects, how large, in which gas, how many records.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Plan {
    pub(super) name: String,
    pub(super) title: String,
    pub(super) seed: u64,
    /// Records in each cell.
    pub(super) records: u64,
    /// Effects that a record has together; an empty list is a record with nothing missing.
    sets: Vec<Vec<Kind>>,
    /// What sizes are multiplied with.
    size_factors: Vec<f64>,
    gases: Vec<GasKind>,
    /// Whether the library is to be without the effects that a record has.
    #[serde(default)]
    without_own: bool,
}

impl Plan {
    /// The plan, if the text is one of this kind.
    pub(super) fn read(text: &str) -> Option<Result<Self>> {
        let is_one = text.lines().any(|l| l.starts_with("sets"));
        is_one.then(|| toml::from_str(text).context("the plan of the closed loop"))
    }

    fn cells(&self) -> Vec<(&[Kind], f64)> {
        self.sets.iter().flat_map(|set| self.size_factors.iter().map(move |size| (set.as_slice(), *size))).collect()
    }
}

/// Quantities of a record, in order; those of sensors are two.
const RIGHT: usize = 0;
const STATED: usize = 1;
const ALL_FOUND: usize = 2;
const WRONG: usize = 3;
const COVERED: usize = 4;
const VERDICT: usize = 6;
const ERROR: usize = VERDICT + VERDICTS.len();
const RATIO: usize = ERROR + 2;
const BOUND: usize = RATIO + 2;
const HELD_OUT: usize = BOUND + 2;
const FIRST: usize = HELD_OUT + 1;

const VERDICTS: [(Verdict, &str); 4] = [
    (Verdict::Adequate, "adequate"),
    (Verdict::Explained, "explained"),
    (Verdict::PartlyExplained, "partly-explained"),
    (Verdict::Unexplained, "unexplained"),
];

impl Study for Plan {
    type Scratch = ();

    fn plan(&self) -> String {
        format!("{} {}", env!("CARGO_PKG_VERSION"), serde_json::to_string(self).unwrap_or_default())
    }

    fn cells(&self) -> usize {
        Plan::cells(self).len()
    }

    fn trials(&self) -> u64 {
        self.records
    }

    fn block(&self) -> u64 {
        1
    }

    fn quantities(&self, _cell: usize) -> Vec<Quantity> {
        let events = ["right first", "right or stated", "all found", "wrong name", "covered 1", "covered 2"];
        let mut out: Vec<Quantity> = events.into_iter().map(Quantity::event).collect();
        out.extend(VERDICTS.iter().map(|(_, name)| Quantity::event(*name)));
        for name in ["relative error", "error over its standard error", "error over that of the right effect"] {
            out.extend((1..3).map(|sensor| Quantity::value(format!("{name} {sensor}"))));
        }
        out.push(Quantity::value("held-out rms after"));
        out.extend(Identifier::ALL.iter().map(|e| Quantity::event(format!("first: {e}"))));
        out.push(Quantity::event("first: none"));
        out
    }

    fn scratch(&self, _cell: usize) -> std::result::Result<(), Failure> {
        Ok(())
    }

    fn trial(&self, cell: usize, index: u64, (): &mut (), outcome: &mut Outcome) -> std::result::Result<(), Failure> {
        let cells = Plan::cells(self);
        let (kinds, size) = cells[cell];
        let gas = self.gases[index as usize % self.gases.len()];
        let rig = undeclared(kinds, size, Some(gas), self.seed + 100_000 * cell as u64 + index)?;
        let simulated = rig.simulate()?;
        let truth_s = truth_s(&rig, &simulated.time_s, &simulated.gas_c);
        // The error against the gas is no quantity of these experiments, and takes longer than the loop.
        let mut record = record_of(simulated)?;
        record.reference_c = None;
        let wanted = rig.effects();
        let own = own_effects(&wanted);
        // What is found counts here, and not what of it is given: the experiment of the grades asks that.
        let characterise = Options { best_effort: true, ..Options::default() };
        let options = |without: Vec<Identifier>| DiagnoseOptions {
            without,
            characterise: characterise.clone(),
            ..DiagnoseOptions::default()
        };
        let without = if self.without_own { own.clone() } else { Vec::new() };
        let answer = diagnose(&record, &options(without))?;

        let is_alien = kinds.iter().any(|k| Kind::UNMODELLED.contains(k));
        let named = Naming::of(&answer, &wanted);
        if !is_alien {
            outcome.event(RIGHT, named.is_right_first);
            outcome.event(STATED, named.is_right_or_stated);
            outcome.event(ALL_FOUND, named.is_all_found);
        }
        for (i, (verdict, _)) in VERDICTS.iter().enumerate() {
            outcome.event(VERDICT + i, answer.verdict == *verdict);
        }
        outcome.event(WRONG, named.is_wrong);
        // The scatter that is due: that of the same estimator where it is told which effects there are.
        let others = || Identifier::ALL.into_iter().filter(|e| !wanted.contains(&e.name())).collect();
        let told = if is_alien { None } else { Some(diagnose(&record, &options(others()))?) };
        let told = told.filter(|t| own.iter().all(|o| t.effects.iter().any(|e| e.effect == *o)));
        for i in 0..2 {
            let sensor = &answer.last.sensors[i];
            if let (Some(tau_s), Some([low, high])) = (sensor.time_constant_s, sensor.interval_95_s) {
                outcome.event(COVERED + i, low <= truth_s[i] && truth_s[i] <= high);
                outcome.value(ERROR + i, (tau_s / truth_s[i] - 1.0).abs());
                if let Some(se) = sensor.standard_error_s {
                    outcome.value(RATIO + i, (tau_s - truth_s[i]).abs() / se);
                }
                if let Some(se) = told.as_ref().and_then(|t| t.last.sensors[i].standard_error_s) {
                    outcome.value(BOUND + i, (tau_s - truth_s[i]).abs() / se);
                }
            }
        }
        outcome.value(HELD_OUT, answer.error.budget.held_out_normalised_rms.after);
        let first = answer.effects.first().map(|e| e.effect);
        for (i, effect) in Identifier::ALL.iter().enumerate() {
            outcome.event(FIRST + i, first == Some(*effect));
        }
        outcome.event(FIRST + Identifier::ALL.len(), first.is_none());
        Ok(())
    }
}

/// The library's effects of these names.
pub(super) fn own_effects(names: &[&str]) -> Vec<Identifier> {
    Identifier::ALL.into_iter().filter(|effect| names.contains(&effect.name())).collect()
}

/// Whether a diagnosis names the effects that a rig has.
#[expect(clippy::struct_excessive_bools, reason = "four questions, each answered with yes or no")]
pub(super) struct Naming {
    /// The first effect named is one of them, or there is neither.
    pub(super) is_right_first: bool,
    /// One of them is named first or as an alternative to what is, or there is neither.
    pub(super) is_right_or_stated: bool,
    /// Each is named or an alternative to what is.
    pub(super) is_all_found: bool,
    /// Another is named first with full confidence: no alternative, and none of those that look like one of them.
    pub(super) is_wrong: bool,
}

impl Naming {
    /// - `wanted`: the effects that the rig has
    pub(super) fn of(answer: &Diagnosis, wanted: &[&str]) -> Self {
        let is = |e: &NamedEffect, name: &str| e.effect.name() == name;
        let states = |e: &NamedEffect, name: &str| is(e, name) || e.alternatives.iter().any(|a| a.name() == name);
        let looks_like = |e: &NamedEffect| {
            own_effects(wanted).into_iter().any(|o| o == e.effect || o.about().imitates.contains(&e.effect.name()))
        };
        let first = answer.effects.first();
        let first_or_none = |of: &dyn Fn(&NamedEffect) -> bool| first.map_or(wanted.is_empty(), of);
        let is_confident = answer.verdict == Verdict::Explained;
        Self {
            is_right_first: first_or_none(&|e| wanted.iter().any(|name| is(e, name))),
            is_right_or_stated: first_or_none(&|e| wanted.iter().any(|name| states(e, name))),
            is_all_found: wanted.iter().all(|name| answer.effects.iter().any(|e| states(e, name)))
                && answer.effects.len() >= wanted.len(),
            is_wrong: is_confident && first.is_some_and(|e| e.alternatives.is_empty() && !looks_like(e)),
        }
    }
}

/// What a logger would have of it.
pub(crate) fn record_of(simulated: Simulated) -> Result<Record, twinlag::record::RecordError> {
    let Simulated { channels, time_s, t1_c, t2_c, gas_c, velocity_m_per_s, .. } = simulated;
    let source = "a rig".into();
    let channels = Channels { source, names: channels, time_s, t1_c, t2_c, reference_c: Some(gas_c) };
    let record = Record::from_channels(channels, SamplingChoice::Auto)?;
    match velocity_m_per_s {
        Some(velocity_m_per_s) => record.with_flow(velocity_m_per_s),
        None => Ok(record),
    }
}

/// Both time constants as an answer means them: means over the record where the flow changes, those at the geometric mean of a recorded
/// velocity, those at the record's mean temperature where they change with it, the larger one of two.
pub(super) fn truth_s(rig: &Undeclared, time_s: &[f64], gas_c: &[f64]) -> [f64; 2] {
    let mean = |values: &mut dyn Iterator<Item = f64>| -> f64 {
        let (sum, n) = values.fold((0.0, 0.0_f64), |(sum, n), v| (sum + v, n + 1.0));
        sum / n.max(1.0)
    };
    let flow = rig.rig.flow().map_or(1.0, |flow| mean(&mut time_s.iter().map(|t| flow.factor(*t))));
    let mean_k = mean(&mut gas_c.iter().copied()) + 273.15;
    [0, 1].map(|i| {
        let sensor = &rig.rig.sensors()[i];
        let warm = sensor
            .temperature_dependence
            .as_ref()
            .map_or(1.0, |d| (mean_k / (d.reference_c + 273.15)).powf(d.exponent));
        let in_stream = rig.rig.stream().map_or(1.0, |stream| {
            let log_ratio = |t: &f64| (stream.velocity_m_per_s(*t) / stream.mean_m_per_s).ln();
            (sensor.stream_exponent * mean(&mut time_s.iter().map(log_ratio))).exp()
        });
        sensor.time_constant_s * flow * in_stream * warm
    })
}

impl Stored for Plan {
    fn head(&self) -> Head<'_> {
        let Plan { name, title, seed, .. } = self;
        Head { name, title, seed: *seed }
    }

    fn trials_and_seed(&mut self) -> [&mut u64; 2] {
        [&mut self.records, &mut self.seed]
    }

    /// One record of the last set, of the two largest sizes: the first of some plans has effects that take a search of half a minute.
    fn shorten(&mut self) {
        self.records = 1;
        keep_last(&mut self.sets, 1);
        keep_last(&mut self.size_factors, 2);
    }

    fn cell_name(&self, cell: usize) -> String {
        let (kinds, size) = Plan::cells(self)[cell];
        tables::cell_name(kinds, size, self.size_factors.len())
    }

    fn tables(&self, results: &Results, out: &Path) -> Result<()> {
        tables::write(self, results, out)
    }
}
