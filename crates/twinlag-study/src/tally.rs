//! What is kept of many trials.

use serde::{Deserialize, Serialize};

use crate::forest::Merge;
use crate::moments::Moments;
use crate::rate::Rate;
use crate::sketch::Sketch;
use crate::study::{Found, Kind, Outcome, Quantity};

/// Moments and quantiles of one set of numbers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "UncheckedValues")]
pub struct Values {
    moments: Moments,
    sketch: Sketch,
    refused: u64,
}

impl Values {
    /// Adds a number. One that is not finite, or beyond [`Moments::LIMIT`], is counted as refused
    /// instead.
    pub fn push(&mut self, x: f64) {
        if self.moments.push(x) {
            self.sketch.push(x);
        } else {
            self.refused += 1;
        }
    }

    /// Mean, spread, extremes and their standard errors.
    pub fn moments(&self) -> &Moments {
        &self.moments
    }

    /// The histogram behind [`Values::quantile`].
    pub fn sketch(&self) -> &Sketch {
        &self.sketch
    }

    /// How many numbers were refused. Unless it is zero, all else describes a selection.
    pub fn refused(&self) -> u64 {
        self.refused
    }

    /// The number of rank `⌈q n⌉`, to within [`Sketch::RELATIVE_ERROR`] of itself, and never
    /// outside the extremes. `None` without numbers, or if `q` is not in [0, 1].
    pub fn quantile(&self, q: f64) -> Option<f64> {
        Some(self.sketch.quantile(q)?.clamp(self.moments.min()?, self.moments.max()?))
    }
}

impl Merge for Values {
    fn merge(&mut self, later: Self) {
        self.moments.merge(later.moments);
        self.sketch.merge(later.sketch);
        self.refused += later.refused;
    }
}

#[derive(Deserialize)]
struct UncheckedValues {
    moments: Moments,
    sketch: Sketch,
    refused: u64,
}

impl TryFrom<UncheckedValues> for Values {
    type Error = String;

    fn try_from(u: UncheckedValues) -> Result<Self, String> {
        let UncheckedValues { moments, sketch, refused } = u;
        if moments.count() != sketch.count() {
            return Err(format!("moments of {} numbers beside quantiles of {}", moments.count(), sketch.count()));
        }
        Ok(Self { moments, sketch, refused })
    }
}

/// What is kept of one quantity.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Statistic {
    /// Statistics of a number.
    Value(Values),
    /// Rate of an event that happens or does not.
    Event(Rate),
}

impl Statistic {
    fn seen(&self) -> u64 {
        match self {
            Self::Value(values) => values.moments.count() + values.refused,
            Self::Event(rate) => rate.count(),
        }
    }

    fn kind(&self) -> Kind {
        match self {
            Self::Value(_) => Kind::Value,
            Self::Event(_) => Kind::Event,
        }
    }
}

/// One quantity of a tally.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Column {
    name: String,
    absent: u64,
    statistic: Statistic,
}

impl Column {
    /// What the study calls it.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Trials that did not yield it.
    pub fn absent(&self) -> u64 {
        self.absent
    }

    /// What those yielded that did.
    pub fn statistic(&self) -> &Statistic {
        &self.statistic
    }
}

/// What is kept of a set of trials of one cell. For each quantity, trials that yielded it, gave
/// something refused, or left it out add up to [`Tally::trials`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "UncheckedTally")]
pub struct Tally {
    trials: u64,
    columns: Vec<Column>,
}

impl Tally {
    /// A tally of no trials.
    pub fn new(quantities: &[Quantity]) -> Self {
        let columns = quantities
            .iter()
            .map(|q| Column {
                name: q.name.clone(),
                absent: 0,
                statistic: match q.kind {
                    Kind::Value => Statistic::Value(Values::default()),
                    Kind::Event => Statistic::Event(Rate::default()),
                },
            })
            .collect();
        Self { trials: 0, columns }
    }

    /// Adds one trial. The outcome must be over the same quantities: what it lacks counts as
    /// absent.
    pub fn push(&mut self, outcome: &Outcome) {
        self.trials += 1;
        for (position, column) in self.columns.iter_mut().enumerate() {
            match (&mut column.statistic, outcome.found(position)) {
                (Statistic::Value(values), Some(Found::Value(x))) => values.push(x),
                (Statistic::Event(rate), Some(Found::Event(happened))) => rate.push(happened),
                _ => column.absent += 1,
            }
        }
    }

    /// How many trials were added.
    pub fn trials(&self) -> u64 {
        self.trials
    }

    /// The quantities, in the study's order.
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    /// The quantity called `name`.
    pub fn column(&self, name: &str) -> Option<&Column> {
        self.columns.iter().find(|column| column.name == name)
    }

    /// The numbers called `name`; `None` if there is no such quantity, or it is an event.
    pub fn values(&self, name: &str) -> Option<&Values> {
        match &self.column(name)?.statistic {
            Statistic::Value(values) => Some(values),
            Statistic::Event(_) => None,
        }
    }

    /// The rate of the event called `name`; `None` if there is no such quantity, or it is a number.
    pub fn rate(&self, name: &str) -> Option<&Rate> {
        match &self.column(name)?.statistic {
            Statistic::Event(rate) => Some(rate),
            Statistic::Value(_) => None,
        }
    }

    /// Whether the tally is over these quantities.
    pub(crate) fn is_over(&self, quantities: &[Quantity]) -> bool {
        self.columns.len() == quantities.len()
            && self.columns.iter().zip(quantities).all(|(c, q)| c.name == q.name && c.statistic.kind() == q.kind)
    }
}

impl Merge for Tally {
    /// Adds the trials of another tally.
    ///
    /// # Panics
    /// If it is over other quantities.
    fn merge(&mut self, later: Self) {
        assert_eq!(self.columns.len(), later.columns.len(), "tallies over different quantities");
        self.trials += later.trials;
        for (mine, other) in self.columns.iter_mut().zip(later.columns) {
            mine.absent += other.absent;
            match (&mut mine.statistic, other.statistic) {
                (Statistic::Value(a), Statistic::Value(b)) if mine.name == other.name => a.merge(b),
                (Statistic::Event(a), Statistic::Event(b)) if mine.name == other.name => a.merge(b),
                _ => panic!("{} and {} are different quantities", mine.name, other.name),
            }
        }
    }
}

#[derive(Deserialize)]
struct UncheckedTally {
    trials: u64,
    columns: Vec<Column>,
}

impl TryFrom<UncheckedTally> for Tally {
    type Error = String;

    fn try_from(UncheckedTally { trials, columns }: UncheckedTally) -> Result<Self, String> {
        if let Some(column) = columns.iter().find(|c| c.absent.checked_add(c.statistic.seen()) != Some(trials)) {
            return Err(format!(
                "of {trials} trials, {} yielded {} and {} did not: that does not add up",
                column.statistic.seen(),
                column.name,
                column.absent
            ));
        }
        Ok(Self { trials, columns })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quantities() -> Vec<Quantity> {
        vec![Quantity::value("error"), Quantity::event("covered")]
    }

    #[test]
    fn every_trial_is_counted_whether_it_yielded_a_number_or_not() {
        let mut tally = Tally::new(&quantities());
        let mut outcome = Outcome::new(&quantities());
        for i in 0..12 {
            outcome.clear();
            match i % 4 {
                0 => outcome.value(0, f64::from(i)),
                1 => outcome.value(0, f64::NAN),
                2 => outcome.event(1, true),
                _ => {}
            }
            tally.push(&outcome);
        }
        let error = tally.values("error").unwrap();
        assert_eq!((tally.trials(), error.moments().count(), error.refused()), (12, 3, 3));
        assert_eq!((tally.columns()[0].absent(), tally.columns()[1].absent()), (6, 9));
        assert_eq!(tally.rate("covered").unwrap().rate(), Some(1.0));
        assert!(tally.rate("error").is_none() && tally.values("covered").is_none() && tally.column("x").is_none());
        let text = serde_json::to_string(&tally).unwrap();
        assert_eq!(serde_json::from_str::<Tally>(&text).unwrap(), tally);
        assert!(serde_json::from_str::<Tally>(&text.replace("\"absent\":6", "\"absent\":7")).is_err());
        assert!(serde_json::from_str::<Tally>(&text.replace("\"n\":3,\"mean\"", "\"n\":4,\"mean\"")).is_err());
    }

    /// Both values share a bin, whose middle is larger than either.
    #[test]
    fn a_quantile_is_never_outside_the_extremes() {
        let mut values = Values::default();
        [1.0, 1.001].into_iter().for_each(|x| values.push(x));
        assert_eq!(values.sketch().quantile(1.0), Some(1.0 + 1.0 / 256.0));
        assert_eq!((values.quantile(0.0), values.quantile(1.0)), (Some(1.001), Some(1.001)));
    }

    #[test]
    #[should_panic(expected = "twice")]
    fn a_trial_yields_a_quantity_once() {
        let mut outcome = Outcome::new(&quantities());
        outcome.value(0, 1.0);
        outcome.value(0, 2.0);
    }

    #[test]
    #[should_panic(expected = "quantity 1 is of kind Event")]
    fn a_trial_yields_a_quantity_of_its_kind() {
        Outcome::new(&quantities()).value(1, 1.0);
    }
}
