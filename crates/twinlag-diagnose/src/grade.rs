//! Whether a number may be used: a grade, and why.
//!
//! A number is right under assumptions: that the model is complete, that the record is of one piece, that what was given beforehand holds.
//! Where nothing speaks against these the number is [`Grade::Go`]; where one of them stays open it is
//! [`Grade::Conditional`] and the reason says on which; where nothing says how far the number may be off it is
//! [`Grade::NoGo`], and is not given. Each reason has its grade, and the worst one counts.

use std::cmp::Ordering;
use std::fmt;

use serde::{Deserialize, Serialize};
use twinlag_cross_relation::{PartScatter, Z_975};
use twinlag_model::{BetweenRecords, Identifier, ModelFit, Policy};
use twinlag_optimise::Scale;

use crate::diagnosis::Verdict;
use crate::naming::{hull, interval_95};

/// Whether a number may be used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Grade {
    /// The number and its interval may be used.
    Go,
    /// They are right if the assumption holds that is stated.
    Conditional,
    /// Nothing says how far the number may be off, so it is not given.
    #[default]
    NoGo,
}

impl fmt::Display for Grade {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Go => "go",
            Self::Conditional => "conditional",
            Self::NoGo => "no-go",
        })
    }
}

/// What speaks against a number, or what it rests on. Its [`Display`](fmt::Display) is a clause for the reader.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Reason {
    /// Other values explain the record as well.
    NotDetermined,
    /// The record cannot be diagnosed at all.
    Refused,
    /// It would be longer than the record can show.
    TooLong {
        /// The longest that the record can show, s.
        most_s: f64,
    },
    /// Other delays fit as well: the gas repeats itself.
    OtherDelays {
        /// The others, the shortest first, s.
        delays_s: Vec<f64>,
    },
    /// It is a part of the total delay of channel 2, which alone is determined.
    PartOfTotal,
    /// Nothing says how uncertain it is.
    NoInterval,
    /// More than noise is left over, and nothing says how far it moves the number.
    LeftOver,
    /// More than noise is left over, and the number is right if that does not go with it.
    LeftOverAside,
    /// Little more than noise is left over, and the interval covers that all of it goes with the number.
    LeavesSome {
        /// Energy that is left over beside that of the noise, as a share of it.
        share: f64,
    },
    /// So many effects may imitate another cause together.
    ManyEffects {
        /// How many there are.
        count: usize,
    },
    /// Parts of the record give different values, and the interval covers their scatter.
    PartsDisagree {
        /// Their scatter over that which noise makes.
        ratio: f64,
    },
    /// Records of one rig give different values of a number that they share, and the interval covers what they differ.
    RecordsDisagree {
        /// Their scatter over that which noise makes.
        ratio: f64,
        /// Whether the interval says anything still.
        is_known: bool,
    },
    /// The others do not show without this record what was found, so that it rests on it alone.
    RestsOnRecord {
        /// The record, from 0.
        record: usize,
    },
    /// Of several records the models of the others leave more than noise.
    DoesNotTransfer {
        /// How many records these are.
        records: usize,
    },
    /// Other effects explain the record as well, and with them the number is another.
    Cause {
        /// The effect that it is right with.
        effect: Identifier,
        /// The channel of that, 0 or 1; `None` where it is of both.
        channel: Option<usize>,
    },
    /// Effects may be there that the record hardly shows, and that would move the number out of its interval.
    Hidden {
        /// These effects, the likeliest first. All others like them together are improbable.
        effects: Vec<Identifier>,
        /// Those of them that the model has in one sensor: it is the other one that may have them unseen.
        in_other_sensor: Vec<Identifier>,
    },
    /// The best fit lies on a bound of it.
    OnBound,
    /// The best fit of the model lies on a bound of one of its effects.
    EffectOnBound {
        /// The effect.
        effect: Identifier,
        /// Its channel, 0 or 1; `None` where it is of both.
        channel: Option<usize>,
    },
    /// The record contradicts what was given beforehand.
    Contradicted {
        /// What was given, as `T1 = 0.5 s`.
        what: String,
        /// By how many standard deviations.
        deviations: f64,
        /// The best grade that a number can have with it.
        grade: Grade,
    },
    /// Either the effects that were found are there, or what was given beforehand is wrong.
    EffectsOrGiven {
        /// What was given, as `T1 = 0.5 s`.
        what: String,
    },
    /// The fit departs from what was given: what the model lacks drags it away.
    LeftBehind {
        /// What was given, as `T1 = 0.5 ± 0.1 s`.
        what: String,
        /// By how many of its standard deviations.
        deviations: f64,
    },
    /// A noise that was found in the residual accounts for what is left over, whatever that is.
    FoundAsNoise {
        /// The noise.
        effect: Identifier,
    },
    /// A value was given beforehand.
    Given {
        /// What was given, as `T1 = 0.5 s`.
        what: String,
    },
    /// The gas is a single tone, and two time constants absorb whatever is missing.
    SingleTone,
    /// Time constants that are taken to change by one factor do not.
    RatioChanges {
        /// Probability of such a change of their ratio if it stays.
        p_value: f64,
    },
    /// One sensor has an effect that no reading would show if both had it.
    OfOneAlone {
        /// The effect.
        effect: Identifier,
        /// The name of the channel.
        channel: String,
    },
    /// The estimator has a bias that noise makes.
    Biased,
    /// A check of the number itself finds a fault.
    Fault {
        /// What it finds.
        what: String,
        /// The best grade that a number can have with it.
        grade: Grade,
    },
    /// Effects are held at the numbers of a model, which are taken as exact.
    HeldAtModel {
        /// The record that the model was found in, where that is known.
        source: Option<String>,
    },
    /// A model without effects is used on another record than its own.
    NothingInModel {
        /// The record that the model was found in, where that is known.
        source: Option<String>,
    },
    /// A model is used that did not explain its own record.
    ModelNotExplained {
        /// What was said of that record.
        verdict: Verdict,
        /// The record.
        source: String,
    },
    /// A model is used of which nothing says how well it explained its own record.
    ModelUnjudged,
    /// A model is used that holds numbers which may not be used.
    ModelNoGo {
        /// These numbers.
        what: String,
    },
    /// A model is used outside the data that it was found in.
    OutsideRange {
        /// What is outside, and what was inside.
        what: String,
    },
    /// What the number follows from has no better grade.
    Follows {
        /// What it follows from.
        from: String,
        /// The grade of that.
        grade: Grade,
        /// Why that has it.
        because: String,
    },
}

impl Reason {
    /// That these effects may be there unseen; nothing where there are none.
    ///
    /// - `named`: effects of the model
    pub(crate) fn hidden(effects: &[Identifier], named: &[Identifier]) -> Option<Self> {
        let in_other_sensor = effects.iter().copied().filter(|effect| named.contains(effect)).collect();
        (!effects.is_empty()).then(|| Self::Hidden { effects: effects.to_vec(), in_other_sensor })
    }

    /// The best grade that a number can have with it.
    pub fn grade(&self) -> Grade {
        match self {
            Self::NotDetermined
            | Self::Refused
            | Self::TooLong { .. }
            | Self::PartOfTotal
            | Self::NoInterval
            | Self::LeftOver
            | Self::LeftBehind { .. }
            | Self::OnBound
            | Self::EffectOnBound { .. }
            | Self::SingleTone
            | Self::DoesNotTransfer { .. }
            | Self::RatioChanges { .. }
            | Self::RecordsDisagree { is_known: false, .. } => Grade::NoGo,
            Self::Follows { grade, .. } | Self::Fault { grade, .. } | Self::Contradicted { grade, .. } => *grade,
            _ => Grade::Conditional,
        }
    }

    /// Whether it says that the interval covers this.
    fn says(&self, covered: Covered) -> bool {
        match covered {
            Covered::OtherModels => matches!(self, Self::Cause { .. }),
            Covered::LeftOver => matches!(self, Self::LeavesSome { .. }),
            Covered::Parts => matches!(self, Self::PartsDisagree { .. }),
            Covered::Records => matches!(self, Self::RecordsDisagree { .. }),
        }
    }

    /// What speaks against the use of a model, as a clause by itself; `None` of any other reason.
    ///
    /// ```
    /// use twinlag_diagnose::{Reason, Verdict};
    ///
    /// let reason = Reason::ModelNotExplained { verdict: Verdict::PartlyExplained, source: "run.csv".into() };
    /// let caution = "the model leaves more than noise in its own record, run.csv (partly-explained)";
    /// assert_eq!(reason.caution().as_deref(), Some(caution));
    /// assert_eq!(reason.to_string(), format!("right if this does no harm: {caution}"));
    /// assert_eq!(Reason::LeftOver.caution(), None);
    /// ```
    pub fn caution(&self) -> Option<String> {
        Some(match self {
            Self::ModelNotExplained { verdict: Verdict::Refused, source } => {
                format!("the record of the model, {source}, could not be diagnosed")
            }
            Self::ModelNotExplained { verdict, source } => {
                let name = if *verdict == Verdict::PartlyExplained { "partly-explained" } else { "unexplained" };
                format!("the model leaves more than noise in its own record, {source} ({name})")
            }
            Self::ModelUnjudged => "the model does not say how well it explains its own record".into(),
            Self::ModelNoGo { what } => format!("the model holds numbers that its own record did not give: {what}"),
            Self::OutsideRange { what } => format!("the model is used outside the data that it was found in: {what}"),
            _ => return None,
        })
    }
}

impl Reason {
    /// What several records say, as a clause; empty for any other reason.
    fn of_records(&self) -> String {
        match self {
            Self::RecordsDisagree { ratio, is_known: true } => format!(
                "right if these records are typical: they give values that differ {ratio:.1} times as much as noise explains, \
                 which the interval covers"
            ),
            Self::RecordsDisagree { ratio, .. } => format!(
                "the records give values that differ {ratio:.1} times as much as noise explains; an interval that covered this would say \
                 too little"
            ),
            Self::RestsOnRecord { record } => format!(
                "right if record {} is of one rig with the others, which do not show without it what was found",
                record + 1
            ),
            Self::DoesNotTransfer { records } => format!(
                "the model of the others leaves more than noise in {}, left out in turn",
                counted_records(*records)
            ),
            _ => String::new(),
        }
    }

    /// What is said of a delay, as a clause; empty for any other reason.
    fn of_delays(&self) -> String {
        match self {
            Self::PartOfTotal => "only the total delay of the second channel is determined, and not its parts".into(),
            Self::OtherDelays { delays_s } => {
                let delays: Vec<String> = delays_s.iter().map(|delay_s| format!("{delay_s:.4}")).collect();
                format!(
                    "right if the delay is the shortest of those that fit equally well, and not {} s: the gas repeats itself",
                    delays.join(" or ")
                )
            }
            _ => String::new(),
        }
    }

    /// What a bound says, as a clause; empty for any other reason.
    fn of_bounds(&self) -> String {
        match self {
            Self::OnBound => "the best fit lies on a bound of it, so it is no estimate".into(),
            Self::EffectOnBound { effect, channel } => format!(
                "the best fit lies on a bound of the {effect}{}, so the other numbers of the model are no estimates either",
                of_sensor(*channel)
            ),
            _ => String::new(),
        }
    }

    /// A reason that lies in what was given beforehand, in words.
    fn of_given(&self) -> String {
        match self {
            Self::Contradicted { what, deviations, grade } => {
                let so = if *grade == Grade::NoGo { "" } else { "right if that is so all the same: " };
                format!("{so}the record contradicts {what}, as given, by {} standard deviations", rounded(*deviations))
            }
            Self::EffectsOrGiven { what } => {
                format!("right if {what}, as given: without it, fewer effects explain the record as well")
            }
            Self::LeftBehind { what, deviations } => format!(
                "the fit departs from {what}, as given, by {} of its standard deviations: something that the model lacks drags \
                 it away",
                rounded(*deviations)
            ),
            _ => String::new(),
        }
    }
}

/// So many records, in words.
pub(crate) fn counted_records(records: usize) -> String {
    if records == 1 { "one record".into() } else { format!("{records} records") }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotDetermined => f.write_str("the record does not determine it: other values explain it as well"),
            Self::Refused => f.write_str("the record cannot be diagnosed"),
            Self::TooLong { most_s } => {
                write!(
                    f,
                    "the fit makes it longer than {most_s:.3} s, the longest that a record of this length can show"
                )
            }
            Self::PartOfTotal | Self::OtherDelays { .. } => f.write_str(&self.of_delays()),
            Self::NoInterval => f.write_str("nothing says how uncertain it is"),
            Self::LeftOver => {
                f.write_str("the model leaves more than noise, and nothing says how far that moves this number")
            }
            Self::LeftOverAside => f.write_str("right if what is left over does not go with it"),
            Self::LeavesSome { share } => write!(
                f,
                "right if no more is missing than what is left over, {:.2} % of the noise: the interval covers that",
                100.0 * share
            ),
            Self::ManyEffects { count } => {
                write!(f, "right if these {count} effects are the cause: so many may imitate another one together")
            }
            Self::PartsDisagree { ratio } => write!(
                f,
                "right if the record is typical: its parts give values that differ {ratio:.1} times as much as noise explains, \
                 which the interval covers"
            ),
            Self::RecordsDisagree { .. } | Self::RestsOnRecord { .. } | Self::DoesNotTransfer { .. } => {
                f.write_str(&self.of_records())
            }
            Self::Cause { effect, channel } => right_with(f, *effect, *channel),
            Self::Hidden { effects, in_other_sensor } => write!(
                f,
                "right if there is no {} of a usual size: the record would hardly show one, and it would move this number out of \
                 its interval",
                listed(effects, in_other_sensor)
            ),
            Self::OnBound | Self::EffectOnBound { .. } => f.write_str(&self.of_bounds()),
            Self::Contradicted { .. } | Self::EffectsOrGiven { .. } | Self::LeftBehind { .. } => {
                f.write_str(&self.of_given())
            }
            Self::FoundAsNoise { effect } if *effect == Identifier::COLOURED_NOISE => write!(
                f,
                "right if the {effect} that was found is noise, and the noise of the other sensor is white: a response that the model lacks, \
                 or coloured noise of both sensors, looks alike"
            ),
            Self::FoundAsNoise { effect } => write!(
                f,
                "right if the {effect} that was found is noise: it would account for a response that the model lacks as well"
            ),
            Self::Given { what } => write!(f, "right if {what}, as given"),
            Self::SingleTone => f.write_str(
                "of a single tone two time constants absorb any effect: which sensor is slower, and by how much at its \
                 frequency, is all that is determined",
            ),
            Self::RatioChanges { p_value } => write!(
                f,
                "the ratio of both time constants changes along the record (p = {p_value:.0e}), so the two sensors do not \
                 follow one flow, or the model lacks an effect that looks like it"
            ),
            Self::OfOneAlone { effect, channel } => {
                write!(
                    f,
                    "right if only {channel} has the error named {effect}: no reading shows {}",
                    effect.about().unseen
                )
            }
            Self::Biased => f.write_str("right if the noise is negligible: it biases this estimator"),
            Self::Fault { what, .. } => f.write_str(what),
            Self::Follows { from, because, .. } => write!(f, "it follows from {from}: {because}"),
            Self::HeldAtModel { source } => write!(
                f,
                "right if the sensors are those of {} and the numbers of the model exact: the interval does not cover that",
                source.as_deref().unwrap_or("the model")
            ),
            Self::NothingInModel { source } => write!(
                f,
                "right if the sensors are those of {}, and two first-order lags are all there is to them",
                source.as_deref().unwrap_or("the model")
            ),
            Self::ModelNotExplained { .. }
            | Self::ModelUnjudged
            | Self::ModelNoGo { .. }
            | Self::OutsideRange { .. } => {
                write!(f, "right if this does no harm: {}", self.caution().unwrap_or_default())
            }
        }
    }
}

/// Names of effects for the reader: `delay, slow-mode in the other sensor or radiation`.
fn listed(effects: &[Identifier], in_other_sensor: &[Identifier]) -> String {
    let name = |effect: &Identifier| {
        let place = if in_other_sensor.contains(effect) { " in the other sensor" } else { "" };
        format!("{effect}{place}")
    };
    let names: Vec<String> = effects.iter().map(name).collect();
    match names.split_last() {
        Some((last, others)) if !others.is_empty() => format!("{} or {last}", others.join(", ")),
        _ => names.concat(),
    }
}

/// A number of standard deviations for the reader.
pub(crate) fn rounded(deviations: f64) -> String {
    if deviations < 100.0 { format!("{deviations:.0}") } else { "more than 100".into() }
}

/// What an interval covers beside the noise of the readings. Its [`Display`](fmt::Display) is a clause for the reader.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Covered {
    /// Other models that explain the record as well: other effects, or the whole form of one of which the record supports a part.
    OtherModels,
    /// What the model leaves over.
    LeftOver,
    /// What the parts of the record differ.
    Parts,
    /// What the records of the rig differ.
    Records,
}

impl fmt::Display for Covered {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::OtherModels => "the interval covers other models that explain the record as well",
            Self::LeftOver => "the interval covers what is left over",
            Self::Parts => "the interval covers what the parts of the record differ",
            Self::Records => "the interval covers what the records differ",
        })
    }
}

/// The grade of a number, and why.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct Judgement {
    /// Whether the number may be used.
    #[serde(default)]
    pub grade: Grade,
    /// Why, for the reader; of a number that may be used, what speaks for it.
    #[serde(default)]
    pub because: String,
    /// What its interval covers beside the noise: without these it would be shorter.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub interval_covers: Vec<Covered>,
}

impl Judgement {
    /// The judgement that `reasons` make, the gravest of them first.
    ///
    /// ```
    /// use twinlag_diagnose::{Grade, Judgement, Reason};
    ///
    /// let given = Reason::Given { what: "T1 = 0.5 s".into() };
    /// assert_eq!(Judgement::of(&[]).grade, Grade::Go);
    /// assert_eq!(Judgement::of(&[given.clone()]).because, "right if T1 = 0.5 s, as given");
    /// let worst = Judgement::of(&[given, Reason::LeftOver]);
    /// assert_eq!(worst.grade, Grade::NoGo);
    /// assert!(worst.because.starts_with("the model leaves more than noise"));
    /// ```
    pub fn of(reasons: &[Reason]) -> Self {
        let grade = reasons.iter().map(Reason::grade).max().unwrap_or(Grade::Go);
        // Of a number that is not given, conditions are of no use.
        let of_grade: Vec<String> = reasons.iter().filter(|r| r.grade() == grade).map(ToString::to_string).collect();
        let because = if of_grade.is_empty() { WHY_GO.to_owned() } else { said_once(&of_grade) };
        Self { grade, because, interval_covers: Vec::new() }
    }

    /// Puts down that the interval covers this, once.
    ///
    /// - `is_said`: whether a reason says so
    pub(crate) fn cover(&mut self, covered: Covered, is_said: bool) {
        if self.interval_covers.contains(&covered) {
            return;
        }
        self.interval_covers.push(covered);
        if !is_said && self.grade != Grade::NoGo {
            self.because = said_once(&[std::mem::take(&mut self.because), covered.to_string()]);
        }
    }

    /// Makes the interval of the number cover that of another model as well, and says so where it is longer for it.
    pub(crate) fn cover_with(&mut self, interval: &mut [f64; 2], other: [f64; 2]) {
        let before = *interval;
        *interval = hull(before, other);
        if is_longer(*interval, before) {
            self.cover(Covered::OtherModels, false);
        }
    }

    /// This judgement with one reason more.
    #[must_use]
    pub fn and(self, reason: &Reason) -> Self {
        let more = Self::of(std::slice::from_ref(reason));
        match self.grade.cmp(&more.grade) {
            Ordering::Less => more,
            Ordering::Equal => Self { because: said_once(&[self.because, more.because]), ..self },
            Ordering::Greater => self,
        }
    }

    /// The judgement of what was given beforehand, which what speaks against it in `basis` takes away.
    pub fn of_given(basis: &Basis) -> Self {
        let known = Self { because: "known beforehand".into(), ..Self::of(&[]) };
        basis.against_given().fold(known, Self::and)
    }

    /// The judgement of a point to which parameters refer: it is of the record as it stands, and no estimate.
    pub(crate) fn reference_point() -> Self {
        Self { because: "a point of reference, and no estimate".into(), ..Self::of(&[]) }
    }

    /// The judgement of what follows from numbers with these judgements, each with its name.
    pub fn following<'a>(from: impl IntoIterator<Item = (&'a str, &'a Self)>) -> Self {
        let reasons: Vec<Reason> = from
            .into_iter()
            .filter(|(_, j)| j.grade != Grade::Go)
            .map(|(name, j)| Reason::Follows { from: name.into(), grade: j.grade, because: j.because.clone() })
            .collect();
        let worst = reasons.iter().map(Reason::grade).max();
        // One of them says enough.
        Self::of(&reasons.into_iter().find(|r| Some(r.grade()) == worst).into_iter().collect::<Vec<_>>())
    }

    /// The judgement of what follows from numbers with the judgement `numbers`, and rests on what has this one itself.
    #[must_use]
    pub fn and_following(self, numbers: Self) -> Self {
        if self.grade == Grade::NoGo || self.grade > numbers.grade { self } else { numbers }
    }
}

/// Between the clauses of a text.
const NEXT_CLAUSE: &str = "; ";

/// The clauses of all these texts, each once.
fn said_once(texts: &[String]) -> String {
    let mut said: Vec<&str> = Vec::new();
    for clause in texts.iter().flat_map(|text| text.split(NEXT_CLAUSE)) {
        if !said.contains(&clause) {
            said.push(clause);
        }
    }
    said.join(NEXT_CLAUSE)
}

/// What speaks for a number that may be used.
const WHY_GO: &str = "what is left over is noise, and the parts of the record agree";

/// What all numbers of a fit rest on.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Basis {
    /// What holds for each of them.
    pub reasons: Vec<Reason>,
    /// Energy that is left over beside that of the noise, and may all go with a number.
    pub excess_energy: f64,
}

impl Basis {
    /// What speaks against what was given beforehand.
    pub(crate) fn against_given(&self) -> impl Iterator<Item = &Reason> {
        let is_against =
            |reason: &&Reason| matches!(reason, Reason::Contradicted { .. } | Reason::EffectsOrGiven { .. });
        self.reasons.iter().filter(is_against)
    }

    /// The numbers of a fit of which nothing but the residual is known.
    ///
    /// - `excess`: what it leaves over beside noise; `None` where nothing says what the noise is
    /// - `is_bounded_otherwise`: whether a number holds without the rest of the model, or knowledge holds it
    pub fn of(excess: Option<Excess>, is_bounded_otherwise: bool, policy: &Policy) -> Self {
        match excess.filter(|excess| excess.is_bounded(policy)) {
            Some(Excess { share, energy }) if share > 0.0 => {
                Self { reasons: vec![Reason::LeavesSome { share }], excess_energy: energy }
            }
            Some(_) => Self::default(),
            None if is_bounded_otherwise => Self { reasons: vec![Reason::LeftOverAside], excess_energy: 0.0 },
            None => Self { reasons: vec![Reason::LeftOver], excess_energy: 0.0 },
        }
    }
}

fn of_sensor(channel: Option<usize>) -> &'static str {
    channel.map_or("", |channel| [" of T1", " of T2"][channel])
}

fn right_with(f: &mut fmt::Formatter<'_>, effect: Identifier, channel: Option<usize>) -> fmt::Result {
    let place = of_sensor(channel);
    write!(f, "right if the cause is {effect}{place}: others explain the record as well and give another number")
}

/// A number with its interval, on its own scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Number {
    /// The number.
    pub value: f64,
    /// Its standard error by noise alone; `None` where its interval is not that of a standard error.
    pub standard_error: Option<f64>,
    /// Its 95 % interval, with other models that explain the record as well.
    pub interval_95: Option<[f64; 2]>,
    /// How far it moves between parts of the record.
    pub scatter: Option<PartScatter>,
    /// How far it moves between records that share it, where it does by more than noise explains.
    pub between: Option<RecordScatter>,
    /// Whether it is positive by nature, so that its interval is a factor either way.
    pub is_positive: bool,
}

/// How far a number moves between records of one rig that share it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct RecordScatter {
    /// The 95 % interval of the mean over such records; `None` where chance may make them differ as much.
    pub interval_95: Option<[f64; 2]>,
    /// Root mean square of what the records' values differ, over their standard errors.
    pub ratio: f64,
    /// Probability of at least as large a scatter if the model is right.
    pub p_value: f64,
}

impl RecordScatter {
    /// That of what records say of a number; `None` where noise explains what they differ.
    pub fn of(between: Option<&BetweenRecords>) -> Option<Self> {
        let between = between.filter(|between| between.scatters())?;
        let BetweenRecords { interval_95, ratio, p_value, .. } = *between;
        Some(Self { interval_95: between.differs().then_some(interval_95), ratio, p_value })
    }
}

impl Number {
    /// The judgement of this number, and its interval with all that it has to cover.
    ///
    /// - `own`: what speaks against this number alone
    pub fn judged(&self, own: Vec<Reason>, basis: &Basis, policy: &Policy) -> (Judgement, Option<[f64; 2]>) {
        let mut reasons = own;
        reasons.extend(basis.reasons.iter().cloned());
        let Some(interval) = self.interval_95 else {
            reasons.push(Reason::NoInterval);
            return (Judgement::of(&reasons), None);
        };
        let mut covers = Vec::new();
        if self.interval_of_noise().is_some_and(|of_noise| is_longer(interval, of_noise)) {
            covers.push(Covered::OtherModels);
        }
        let mut factor = (1.0 + basis.excess_energy).sqrt();
        if factor > 1.0 {
            covers.push(Covered::LeftOver);
        }
        if let Some(scatter) = self.scatter.filter(|s| s.p_value() < policy.parts_rejection_probability) {
            reasons.push(Reason::PartsDisagree { ratio: scatter.ratio() });
            covers.push(Covered::Parts);
            factor = factor.max(T_975_OF_7 / Z_975 * scatter.ratio());
        }
        let mut interval = self.widened(interval, factor);
        if factor > 1.0 && self.is_vague(interval, policy) {
            reasons.push(Reason::LeftOver);
        }
        if let Some(RecordScatter { interval_95: between, ratio, p_value }) = self.between {
            // What records differ by chance widens the interval of all; that of their own values may be far longer, since it knows
            // nothing of what lies between records.
            let with_between = between.map_or_else(|| self.widened(interval, ratio), |between| hull(interval, between));
            if is_longer(with_between, interval) {
                covers.push(Covered::Records);
            }
            interval = with_between;
            let is_known = !self.is_vague(interval, policy);
            if p_value < policy.records_rejection_probability || !is_known {
                reasons.push(Reason::RecordsDisagree { ratio, is_known });
            }
        }
        // As long as that it says nothing, and JSON has no infinity.
        let interval = Some(interval).filter(|interval| interval.iter().all(|end| end.is_finite()));
        reasons.extend(interval.is_none().then_some(Reason::NoInterval));
        let mut judgement = Judgement::of(&reasons);
        for covered in covers {
            judgement.cover(covered, reasons.iter().any(|reason| reason.says(covered)));
        }
        (judgement, interval)
    }

    /// The 95 % interval that noise alone makes; `None` where nothing says what that is.
    fn interval_of_noise(&self) -> Option<[f64; 2]> {
        let scale = if self.is_positive { Scale::Logarithmic } else { Scale::Linear { typical: 1.0 } };
        self.standard_error.map(|error| interval_95(self.value, error, &scale))
    }

    fn widened(&self, [low, high]: [f64; 2], factor: f64) -> [f64; 2] {
        let is_positive = self.is_positive && low > 0.0 && self.value > 0.0;
        [low, high].map(|end| further(self.value, end, factor, is_positive))
    }

    /// Whether an interval that had to be widened says anything still: of a positive number a factor, of another one its sign.
    fn is_vague(&self, [low, high]: [f64; 2], policy: &Policy) -> bool {
        if self.is_positive {
            low <= 0.0 || (high / low).ln() > 2.0 * Z_975 * policy.vague_log_std
        } else {
            low * high <= 0.0
        }
    }
}

/// An end of the interval of a value, `factor` times as far from it: of a positive number by its logarithm.
pub(crate) fn further(value: f64, end: f64, factor: f64, is_positive: bool) -> f64 {
    if is_positive { value * (end / value).powf(factor) } else { value + factor * (end - value) }
}

/// Whether an interval reaches beyond another one by more than rounding.
fn is_longer([low, high]: [f64; 2], [from, to]: [f64; 2]) -> bool {
    let rounding = ROUNDING * (to - from);
    low < from - rounding || high > to + rounding
}

/// Share of an interval that is rounding: intervals from a standard error and back differ by some 1e-15 of the number, which may be
/// 10⁶ times as large as they are.
const ROUNDING: f64 = 1e-6;

/// Quantile 0.975 of Student's distribution with as many degrees of freedom as the parts of a record have.
const T_975_OF_7: f64 = 2.364_624;

/// What a fit leaves over beside noise.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Excess {
    /// Its energy, in units of that of the noise of one residual.
    pub energy: f64,
    /// Its energy, over that of the noise of all residuals.
    pub share: f64,
}

impl Excess {
    /// Whether it is so small a share of the noise that intervals cover what it may do to the numbers.
    pub fn is_bounded(&self, policy: &Policy) -> bool {
        self.share <= policy.explained_excess_share
    }
}

/// What `fit` leaves over beside noise; `None` where nothing but the residual says what the noise is.
///
/// The noise is that of the assumed levels, but no more than a quarter of the residual has: levels that took the gas for
/// noise would hide what is left over. Bands count with what is more than two standard errors above it; what a test sees
/// elsewhere has at least the energy at which a test of one degree of freedom rejects.
///
/// - `has_noise`: whether a noise that was found in the residual is part of the model
pub fn excess(fit: &ModelFit, has_noise: bool) -> Option<Excess> {
    if !fit.is_contradicted() {
        return Some(Excess { energy: 0.0, share: 0.0 });
    }
    if fit.is_noise_of_residual || has_noise {
        return None;
    }
    let bands = &fit.trace.bands;
    let count: f64 = bands.iter().map(|[_, _, dof]| dof).sum();
    let noise = quietest_quarter(bands).min(1.0);
    let above = |[_, power, dof]: &[f64; 3]| ((power / noise - 1.0 - 2.0 * (2.0 / dof).sqrt()) * dof).max(0.0);
    let of_bands: f64 = bands.iter().map(above).sum();
    let energy = of_bands.max((fit.chi2_per_dof - 1.0) * count).max(REJECTING_CHI2);
    (count > 0.0 && noise > 0.0).then_some(Excess { energy, share: energy / count })
}

/// The power that a quarter of the degrees of freedom of `bands` does not exceed.
fn quietest_quarter(bands: &[[f64; 3]]) -> f64 {
    let mut sorted: Vec<&[f64; 3]> = bands.iter().collect();
    sorted.sort_by(|a, b| a[1].total_cmp(&b[1]));
    let quarter = 0.25 * bands.iter().map(|[_, _, dof]| dof).sum::<f64>();
    let mut below = 0.0;
    let reaches = sorted.into_iter().find(|[_, _, dof]| {
        below += dof;
        below >= quarter
    });
    reaches.map_or(0.0, |[_, power, _]| *power)
}

/// Quantile of the chi-square distribution with one degree of freedom at which a test rejects, `p = 10⁻⁴`.
pub(crate) const REJECTING_CHI2: f64 = 15.14;

#[cfg(test)]
mod tests {
    use super::*;

    fn number(value: f64, interval: [f64; 2], is_positive: bool) -> Number {
        Number { value, standard_error: None, interval_95: Some(interval), scatter: None, between: None, is_positive }
    }

    /// Whether reasons come together, one after the other, or with what something else rests on.
    #[test]
    fn a_clause_is_said_once() {
        let given = Reason::Given { what: "T1 = 2 s".into() };
        let both = Judgement::of(&[given.clone(), Reason::Biased, given.clone(), Reason::Biased]);
        assert_eq!(both, Judgement::of(&[given.clone(), Reason::Biased]));
        assert_eq!(both.clone().and(&Reason::Biased).and(&given), both);
        // Failed: of a reason with two clauses the first and the second alone were compared with both.
        let follows = Reason::Follows { from: "T1".into(), grade: Grade::Conditional, because: both.because.clone() };
        let once = Judgement::of(std::slice::from_ref(&follows));
        assert_eq!(once.because, format!("it follows from T1: {}", both.because));
        assert_eq!(once.clone().and(&follows).and(&Reason::Biased), once);
        assert_eq!(Judgement::of(&[follows, Reason::Biased]), once);
    }

    #[test]
    fn a_condition_names_every_effect_that_it_takes() {
        assert_eq!(Reason::hidden(&[], &[Identifier::DELAY]), None);
        let said = |effects: &[Identifier]| {
            Reason::hidden(effects, &[Identifier::SECOND_ORDER]).expect("there are some").to_string()
        };
        assert!(said(&[Identifier::DELAY]).starts_with("right if there is no delay of a usual size: "));
        let all = [Identifier::DELAY, Identifier::SLOW_MODE, Identifier::RADIATION];
        assert!(said(&all).starts_with("right if there is no delay, slow-mode or radiation of a usual size: "));
        let one = [Identifier::DELAY, Identifier::SECOND_ORDER];
        assert!(
            said(&one).starts_with("right if there is no delay or second-order in the other sensor of a usual size: ")
        );
    }

    /// An excess of 8 makes intervals three times as long, by a factor or by a distance.
    #[test]
    fn intervals_cover_what_is_left_over() {
        let policy = Policy::default();
        let share = 0.01;
        let basis = Basis { reasons: vec![Reason::LeavesSome { share }], excess_energy: 8.0 };
        let (judgement, interval) = number(2.0, [1.8, 2.0 / 0.9], true).judged(Vec::new(), &basis, &policy);
        let [low, high] = interval.expect("it had one");
        assert_eq!(judgement.grade, Grade::Conditional);
        assert!((low - 2.0 * 0.729).abs() < 1e-12 && (high - 2.0 / 0.729).abs() < 1e-12, "{low} {high}");
        let (_, interval) = number(2.0, [1.9, 2.1], false).judged(Vec::new(), &basis, &policy);
        let [low, high] = interval.expect("it had one");
        assert!((low - 1.7).abs() < 1e-12 && (high - 2.3).abs() < 1e-12, "{low} {high}");
    }

    /// Failed: an interval to infinity was null in JSON, which no model could be read from again.
    #[test]
    fn an_interval_without_an_end_is_none() {
        let basis = Basis { reasons: Vec::new(), excess_energy: 0.0 };
        let (judgement, interval) =
            number(2.0, [0.0, f64::INFINITY], true).judged(Vec::new(), &basis, &Policy::default());
        assert_eq!((judgement.grade, interval), (Grade::NoGo, None));
    }

    /// Of bands with 10, 30 and 60 degrees of freedom the two quietest hold the first quarter.
    #[test]
    fn the_quietest_quarter_counts_degrees_of_freedom() {
        assert_eq!(quietest_quarter(&[[1.0, 3.0, 60.0], [2.0, 0.5, 10.0], [3.0, 0.8, 30.0]]), 0.8);
        assert_eq!(quietest_quarter(&[]), 0.0);
    }

    /// An interval holds what records differ, whichever way; the condition comes where chance does not explain it, and what they
    /// leave without a sign is not given.
    #[test]
    fn intervals_cover_what_records_differ() {
        let (policy, basis) = (Policy::default(), Basis::default());
        let judged = |interval_95, p_value| {
            let between = Some(RecordScatter { interval_95: Some(interval_95), ratio: 2.5, p_value });
            let (judgement, interval) =
                Number { between, ..number(2.0, [1.8, 2.2], false) }.judged(Vec::new(), &basis, &policy);
            let said = judgement.because.matches("covers").count();
            (judgement.grade, interval.expect("it had one"), judgement.interval_covers, said)
        };
        let records = || vec![Covered::Records];
        assert_eq!(judged([1.9, 2.1], 0.2), (Grade::Go, [1.8, 2.2], vec![], 0));
        assert_eq!(judged([1.0, 2.1], 0.2), (Grade::Go, [1.0, 2.2], records(), 1));
        assert_eq!(judged([1.0, 2.1], 1e-6), (Grade::Conditional, [1.0, 2.2], records(), 1));
        assert_eq!(judged([-1.0, 3.0], 0.2), (Grade::NoGo, [-1.0, 3.0], records(), 0));
        let between = Some(RecordScatter { interval_95: None, ratio: 1.5, p_value: 0.1 });
        let by_chance = Number { between, ..number(2.0, [1.8, 2.2], false) };
        let interval = by_chance.judged(Vec::new(), &basis, &policy).1.expect("it had one");
        assert!(interval.iter().zip([1.7, 2.3]).all(|(end, expected)| (end - expected).abs() < 1e-12), "{interval:?}");
    }

    /// An interval that is longer than noise makes it says so, on its own scale.
    #[test]
    fn an_interval_says_what_it_covers() {
        let judged = |interval, standard_error, is_positive| {
            let number = Number { standard_error: Some(standard_error), ..number(2.0, interval, is_positive) };
            number.judged(Vec::new(), &Basis::default(), &Policy::default()).0.interval_covers
        };
        let half = Z_975 * 0.1;
        assert_eq!(judged([2.0 - half, 2.0 + half], 0.1, false), []);
        assert_eq!(judged([2.0 - half, 2.1 + half], 0.1, false), [Covered::OtherModels]);
        let factor = (0.5 * half).exp();
        assert_eq!(judged([2.0 / factor, 2.0 * factor], 0.1, true), []);
        assert_eq!(judged([1.9 / factor, 2.0 * factor], 0.1, true), [Covered::OtherModels]);
    }

    /// A number whose sign or size is lost in a wider interval is not given.
    #[test]
    fn what_becomes_vague_is_not_given() {
        let policy = Policy::default();
        let basis = Basis { excess_energy: 99.0, ..Basis::default() };
        let grade = |n: Number| n.judged(Vec::new(), &basis, &policy).0.grade;
        assert_eq!(grade(number(0.5, [0.4, 0.6], false)), Grade::NoGo);
        assert_eq!(grade(number(0.5, [0.4, 0.6], true)), Grade::NoGo);
        assert_eq!(grade(number(0.5, [0.499, 0.501], true)), Grade::Go);
        assert_eq!(
            Number { interval_95: None, ..number(1.0, [0.0; 2], false) }
                .judged(Vec::new(), &Basis::default(), &policy)
                .0
                .grade,
            Grade::NoGo
        );
    }
}
