//! Whether numbers that are graded `go` may be used, and whether those that are withheld were wrong.
//!
//! Random rigs with nothing missing, with one effect and more, with effects outside the library, in noise ten times as loud, and
//! from 1000 rows to a million. The rigs integrate physics in continuous time and share no code with what is graded.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use twinlag::cross_relation::Z_975;
use twinlag::diagnosis::{Grade, Judgement};
use twinlag::record::Record;
use twinlag::signal::undeclared::{GasKind, Kind, Undeclared, undeclared};
use twinlag::{Characterisation, DiagnoseOptions, NamedEffect, Options, characterise, diagnose};
use twinlag_report::{Axis, Chart, Figure, Reference, Series};
use twinlag_study::{Failure, Merge, Outcome, Quantity, Rate, Results, Study, Tally};

use super::keep_last;
use super::loops::{own_effects, record_of, truth_s};
use super::missing::Missing;
use super::stored::{Head, Stored};

/// The experiments of all kinds of records, of effects which are not in the library, and of readings that are missing.
pub(super) const NAMES: [&str; 3] = ["grades", "stretches", "missing-readings"];

/// A plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Plan {
    name: String,
    title: String,
    seed: u64,
    /// Records of each set.
    records: u64,
    /// Whether the table says of each group what each verb gives.
    #[serde(default, skip_serializing_if = "is_not")]
    by_verb: bool,
    groups: Vec<Group>,
}

/// Records of one kind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Group {
    name: String,
    /// Effects that a record has together.
    sets: Vec<Vec<Kind>>,
    /// Size of the effects, in place of 1, which any search finds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    size_factor: Option<f64>,
    /// Readings that the records lack.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    missing: Option<Missing>,
    /// Times as loud as usual that the noise is.
    #[serde(default)]
    noise_factor: Option<f64>,
    /// Rows, in place of those that were drawn.
    #[serde(default)]
    rows: Option<usize>,
    /// Records of each set, in place of the plan's: fewer where they are long.
    #[serde(default)]
    records: Option<u64>,
    /// Whether the library is to be without the effects that a record has.
    #[serde(default, skip_serializing_if = "is_not")]
    without_own: bool,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks for a reference")]
fn is_not(flag: &bool) -> bool {
    !flag
}

/// Numbers of a record: both time constants and the difference by both verbs, and the first few parameters of effects.
const NUMBERS: [&str; 10] = [
    "diagnose T1",
    "diagnose T2",
    "diagnose difference",
    "parameter 1",
    "parameter 2",
    "parameter 3",
    "parameter 4",
    "characterise T1",
    "characterise T2",
    "characterise difference",
];
const FIRST_PARAMETER: usize = 3;
const FIRST_OF_CHARACTERISE: usize = 7;
/// What is asked of each of them.
const EVENTS: [&str; 6] =
    ["is go", "covered if go", "far if go", "is conditional", "covered if conditional", "wrong if withheld"];
/// Standard errors beyond which a number is far off: by chance once in two million.
const FAR_STANDARD_ERRORS: f64 = 5.0;
/// A record in which both time constants of the diagnosis are go.
const KEEPS_GO: usize = NUMBERS.len() * EVENTS.len();

/// A number of an answer, and what it is in truth.
struct Graded<'a> {
    value: Option<f64>,
    interval: Option<[f64; 2]>,
    judgement: &'a Judgement,
    truth: f64,
}

impl Graded<'_> {
    fn put_down(&self, number: usize, outcome: &mut Outcome) {
        let first = number * EVENTS.len();
        let grade = self.judgement.grade;
        outcome.event(first, grade == Grade::Go);
        outcome.event(first + 3, grade == Grade::Conditional);
        let (Some(value), Some([low, high])) = (self.value, self.interval) else { return };
        let is_covered = low <= self.truth && self.truth <= high;
        let error = 0.5 * (high - low) / Z_975;
        match grade {
            Grade::Go => {
                outcome.event(first + 1, is_covered);
                outcome.event(first + 2, (value - self.truth).abs() > FAR_STANDARD_ERRORS * error);
            }
            Grade::Conditional => outcome.event(first + 4, is_covered),
            _ => outcome.event(first + 5, !is_covered),
        }
    }
}

impl Plan {
    pub(super) fn read(text: &str) -> Result<Self> {
        toml::from_str(text).context("the plan of the grades")
    }

    /// Each set, with its group.
    fn sets(&self) -> Vec<(&Group, &[Kind])> {
        self.groups.iter().flat_map(|group| group.sets.iter().map(move |set| (group, set.as_slice()))).collect()
    }
}

impl Group {
    /// The rig that was drawn, as this group has it.
    fn changed(&self, mut drawn: Undeclared) -> Result<Undeclared, Failure> {
        let mut record = drawn.rig.record().clone();
        record.samples = self.rows.unwrap_or(record.samples);
        let mut sensors = drawn.rig.sensors().clone();
        for noise in sensors.iter_mut().filter_map(|s| s.noise.as_mut()) {
            noise.std_k *= self.noise_factor.unwrap_or(1.0);
        }
        drawn.rig = drawn.rig.with_record(record)?.with_sensors(sensors)?;
        Ok(drawn)
    }
}

impl Study for Plan {
    type Scratch = ();

    fn plan(&self) -> String {
        format!("{} {}", env!("CARGO_PKG_VERSION"), serde_json::to_string(self).unwrap_or_default())
    }

    fn cells(&self) -> usize {
        self.sets().len()
    }

    fn trials(&self) -> u64 {
        self.records
    }

    fn block(&self) -> u64 {
        1
    }

    fn quantities(&self, _cell: usize) -> Vec<Quantity> {
        let of = |number: &&str| EVENTS.map(|event| Quantity::event(format!("{number} {event}")));
        NUMBERS.iter().flat_map(of).chain([Quantity::event("keeps go")]).collect()
    }

    fn scratch(&self, _cell: usize) -> std::result::Result<(), Failure> {
        Ok(())
    }

    fn trial(&self, cell: usize, index: u64, (): &mut (), outcome: &mut Outcome) -> std::result::Result<(), Failure> {
        let (group, set) = self.sets()[cell];
        if index >= group.records.unwrap_or(u64::MAX) {
            return Ok(());
        }
        let gas = GasKind::ALL[index as usize % GasKind::ALL.len()];
        let seed = self.seed + 100_000 * cell as u64 + index;
        let drawn = group.changed(undeclared(set, group.size_factor.unwrap_or(1.0), Some(gas), seed)?)?;
        let mut simulated = drawn.rig.simulate()?;
        let truth_s = truth_s(&drawn, &simulated.time_s, &simulated.gas_c);
        if let Some(missing) = &group.missing {
            missing.taken_from(&mut simulated, seed);
        }
        let mut record = record_of(simulated)?;
        record.reference_c = None;
        let options = Options { best_effort: true, ..Options::default() };
        let without = if group.without_own { own_effects(&drawn.effects()) } else { Vec::new() };
        let options = DiagnoseOptions { characterise: options, without, ..DiagnoseOptions::default() };
        of_diagnosis(&drawn, &record, &options, truth_s, outcome)?;
        of_every_answer(&characterise(&record, &options.characterise)?, FIRST_OF_CHARACTERISE, truth_s, outcome);
        Ok(())
    }
}

fn of_diagnosis(
    drawn: &Undeclared,
    record: &Record,
    options: &DiagnoseOptions,
    truth_s: [f64; 2],
    outcome: &mut Outcome,
) -> Result<(), Failure> {
    let answer = diagnose(record, options)?;
    of_every_answer(&answer.last, 0, truth_s, outcome);
    let parameters = answer.effects.iter().flat_map(|effect| {
        let known = effect.parameters.iter().filter_map(move |p| Some((p, truth_of(drawn, effect, &p.name)?)));
        known.map(|(p, truth)| Graded { value: p.value, interval: p.interval_95, judgement: &p.judgement, truth })
    });
    for (number, graded) in (FIRST_PARAMETER..FIRST_OF_CHARACTERISE).zip(parameters) {
        graded.put_down(number, outcome);
    }
    let keeps = answer.last.sensors.iter().all(|s| s.judgement.grade == Grade::Go);
    outcome.event(KEEPS_GO, keeps);
    Ok(())
}

fn of_every_answer(answer: &Characterisation, first: usize, truth_s: [f64; 2], outcome: &mut Outcome) {
    for (i, sensor) in answer.sensors.iter().enumerate() {
        let (value, interval) = (sensor.time_constant_s, sensor.interval_95_s);
        Graded { value, interval, judgement: &sensor.judgement, truth: truth_s[i] }.put_down(first + i, outcome);
    }
    let apart = &answer.time_constant_difference_s;
    // A total delay is another number.
    if !apart.includes_delay {
        let (value, interval, truth) = (apart.value, apart.interval_95_s, truth_s[1] - truth_s[0]);
        Graded { value, interval, judgement: &apart.judgement, truth }.put_down(first + 2, outcome);
    }
}

/// What a parameter is in truth, where the rig has it as a number of its own; that of an effect that is not there is none.
fn truth_of(drawn: &Undeclared, effect: &NamedEffect, parameter: &str) -> Option<f64> {
    let sensors = drawn.rig.sensors();
    let [one, two] = sensors;
    let of = effect.fitted_in.as_ref().and_then(|name| sensors.iter().find(|s| s.channel == *name)).unwrap_or(two);
    let is_curved = drawn.kinds.contains(&Kind::Curvature);
    match (effect.effect.name(), parameter) {
        // Of a curved calibration it depends on where the line is drawn.
        ("calibration", "gain") if !is_curved => Some(two.gain / one.gain),
        ("delay", "delay") => Some(two.delay_s - one.delay_s),
        ("second-order", "second_time_constant") => Some(of.second_time_constant_s.unwrap_or(0.0)),
        ("slow-mode", "share") => Some(of.slow_mode.as_ref().map_or(0.0, |slow| slow.fraction)),
        ("slow-mode", "slow_time_constant") => of.slow_mode.as_ref().map(|slow| slow.time_constant_s),
        _ => None,
    }
}

impl Stored for Plan {
    fn head(&self) -> Head<'_> {
        let Self { name, title, seed, .. } = self;
        Head { name, title, seed: *seed }
    }

    fn trials_and_seed(&mut self) -> [&mut u64; 2] {
        [&mut self.records, &mut self.seed]
    }

    /// One record of usual length, of the last set of a single effect: two effects, and the first of some plans, take a search of half a
    /// minute.
    fn shorten(&mut self) {
        self.records = 1;
        self.groups.iter_mut().for_each(|group| group.sets.retain(|set| set.len() == 1));
        self.groups.retain(|group| group.rows.is_none() && !group.sets.is_empty());
        keep_last(&mut self.groups, 1);
        self.groups.iter_mut().for_each(|group| keep_last(&mut group.sets, 1));
    }

    fn cell_name(&self, cell: usize) -> String {
        let (group, set) = self.sets()[cell];
        let kinds: Vec<&str> = set.iter().map(|kind| kind.name()).collect();
        format!("{}: {}", group.name, kinds.join(" + "))
    }

    fn tables(&self, results: &Results, out: &Path) -> Result<()> {
        let mut groups: Vec<(&str, Tally)> = Vec::new();
        let mut nothing_missing: Option<Tally> = None;
        for ((group, set), tally) in self.sets().into_iter().zip(results.cells()) {
            if set.iter().all(|kind| *kind == Kind::None) {
                add(&mut nothing_missing, tally);
            }
            match groups.last_mut().filter(|(name, _)| *name == group.name) {
                Some((_, sum)) => sum.merge(tally.clone()),
                None => groups.push((&group.name, tally.clone())),
            }
        }
        let mut all = None;
        groups.iter().for_each(|(_, tally)| add(&mut all, tally));
        let mut text = String::from(
            "| records | numbers | go (%) | of these inside the interval (%) | beyond five standard errors (%) | conditional (%) | \
             of these inside (%) | withheld (%) | of these outside (%) | inside or withheld (%) | both time constants go (%) |\n\
             |---|---|---|---|---|---|---|---|---|---|---|\n",
        );
        let sums = groups.iter().map(|(name, tally)| ((*name).to_owned(), tally));
        let sums = sums.chain(nothing_missing.iter().map(|tally| ("**all with nothing missing**".to_owned(), tally)));
        let sums: Vec<(String, &Tally)> = sums.chain(all.iter().map(|tally| ("**all**".to_owned(), tally))).collect();
        for (name, tally) in &sums {
            let _ = writeln!(text, "| {name} | {} |", row(tally, 0..NUMBERS.len()).join(" | "));
            if self.by_verb {
                for (verb, numbers) in
                    [("diagnose", 0..FIRST_OF_CHARACTERISE), ("characterise", FIRST_OF_CHARACTERISE..NUMBERS.len())]
                {
                    let _ = writeln!(text, "| – by {verb} | {} |", row(tally, numbers).join(" | "));
                }
            }
        }
        if let Some(all) = &all {
            let parts = [
                ("time constants, diagnose", 0..2),
                ("difference, diagnose", 2..3),
                ("parameters of effects", FIRST_PARAMETER..FIRST_OF_CHARACTERISE),
                ("time constants, characterise", FIRST_OF_CHARACTERISE..FIRST_OF_CHARACTERISE + 2),
                ("difference, characterise", FIRST_OF_CHARACTERISE + 2..NUMBERS.len()),
            ];
            for (name, numbers) in parts {
                let _ = writeln!(text, "| all: {name} | {} |", row(all, numbers).join(" | "));
            }
        }
        fs::write(out.join(format!("{}.md", self.name)), text)?;
        fs::write(out.join(format!("{}.svg", self.name)), picture(&self.title, &groups)?)?;
        Ok(())
    }
}

fn add(sum: &mut Option<Tally>, tally: &Tally) {
    match sum {
        Some(sum) => sum.merge(tally.clone()),
        None => *sum = Some(tally.clone()),
    }
}

/// Hits and count of an event, over several numbers.
fn over(tally: &Tally, numbers: std::ops::Range<usize>, event: usize) -> [u64; 2] {
    let rates = numbers.filter_map(|number| tally.rate(&format!("{} {}", NUMBERS[number], EVENTS[event])));
    rates.fold([0, 0], |[hits, count], rate| [hits + rate.hits(), count + rate.count()])
}

fn percent([hits, count]: [u64; 2]) -> String {
    if count == 0 { "–".into() } else { format!("{:.1}", 100.0 * hits as f64 / count as f64) }
}

fn row(tally: &Tally, numbers: std::ops::Range<usize>) -> Vec<String> {
    let of = |event| over(tally, numbers.clone(), event);
    let ([go, count], [conditional, _]) = (of(0), of(3));
    let withheld = count - go - conditional;
    let keeps = tally.rate("keeps go").and_then(Rate::rate);
    vec![
        count.to_string(),
        percent([go, count]),
        percent(of(1)),
        percent(of(2)),
        percent([conditional, count]),
        percent(of(4)),
        percent([withheld, count]),
        percent(of(5)),
        percent([of(1)[0] + of(4)[0] + withheld, count]),
        keeps.map_or("–".into(), |share| format!("{:.0}", 100.0 * share)),
    ]
}

/// How often intervals hold the truth, by grade.
fn picture(title: &str, groups: &[(&str, Tally)]) -> Result<String> {
    let share = |event: usize, is_miss: bool| -> Vec<f64> {
        let of = |tally: &Tally| {
            let [hits, count] = over(tally, 0..NUMBERS.len(), event);
            let hits = if is_miss { count - hits } else { hits };
            if count == 0 { f64::NAN } else { 100.0 * hits as f64 / count as f64 }
        };
        groups.iter().map(|(_, tally)| of(tally)).collect()
    };
    let names = groups.iter().map(|(name, _)| (*name).to_owned());
    let axis = Axis::linear("intervals that hold the truth (%)").range(0.0, 105.0);
    let places: Vec<f64> = (0..groups.len()).map(|i| i as f64).collect();
    let chart = Chart::new("", Axis::categories("", names), axis)
        .series(Series::points("go", places.clone(), share(1, false)))
        .series(Series::points("conditional", places.clone(), share(4, false)))
        .series(Series::points("withheld", places, share(5, true)))
        .reference(Reference::horizontal(95.0));
    Ok(Figure::new(title.to_owned()).panel_size(1100.0, 420.0).panel(chart).to_svg()?)
}
