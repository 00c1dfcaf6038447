//! What a study has to say for itself, and what one trial hands back.

use serde::{Deserialize, Serialize};

/// Why a trial could not run. What went badly in a trial that ran belongs into its [`Outcome`].
pub type Failure = Box<dyn std::error::Error + Send + Sync>;

/// Trials to be repeated at each of a number of cells.
///
/// A trial must depend on its cell and index alone: not on the scratch that earlier trials left, on
/// time, or on the machine. The rest is then reproducible to the bit.
pub trait Study: Sync {
    /// What a thread keeps from one trial of a cell to the next: buffers, plans of transforms, a
    /// generator.
    type Scratch;

    /// A digest of all that decides the numbers: the plan, its seed, the version of the program.
    /// Parts of studies that differ in it are not mixed.
    fn plan(&self) -> String;

    /// How many cells there are.
    fn cells(&self) -> usize;

    /// How many trials each cell has.
    fn trials(&self) -> u64;

    /// How many trials make a block. It determines the order of additions and so the last digits.
    /// It is part of the plan, and must not depend on the machine. A block should take some tens of
    /// milliseconds.
    fn block(&self) -> u64;

    /// What a trial of this cell measures; [`Outcome`] refers to it by position.
    fn quantities(&self, cell: usize) -> Vec<Quantity>;

    /// Prepares a thread for a cell. Called once for each thread and cell, or more often.
    ///
    /// # Errors
    /// Whatever makes the cell impossible. The study ends.
    fn scratch(&self, cell: usize) -> Result<Self::Scratch, Failure>;

    /// Runs trial `index` of a cell, `0 ≤ index < trials`.
    ///
    /// # Errors
    /// Whatever makes the trial impossible. The study ends, and the error names the trial; so it
    /// does on a panic.
    fn trial(&self, cell: usize, index: u64, scratch: &mut Self::Scratch, outcome: &mut Outcome)
    -> Result<(), Failure>;
}

/// What a quantity is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// A number, of which moments and quantiles are kept.
    Value,
    /// Something that happens or does not, of which the rate is kept.
    Event,
}

/// Something that each trial of a cell may yield once.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Quantity {
    /// What tables call it; unique within a cell.
    pub name: String,
    /// What is kept of it.
    pub kind: Kind,
}

impl Quantity {
    /// A number.
    pub fn value(name: impl Into<String>) -> Self {
        Self { name: name.into(), kind: Kind::Value }
    }

    /// Something that happens or does not.
    pub fn event(name: impl Into<String>) -> Self {
        Self { name: name.into(), kind: Kind::Event }
    }
}

/// What one trial found. A quantity that the trial leaves out is counted as absent.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    slots: Vec<(Kind, Option<Found>)>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Found {
    Value(f64),
    Event(bool),
}

impl Outcome {
    /// An outcome with nothing in it yet.
    pub fn new(quantities: &[Quantity]) -> Self {
        Self { slots: quantities.iter().map(|q| (q.kind, None)).collect() }
    }

    /// Records the number of the quantity at `position`. A number that is not finite is counted as
    /// refused.
    ///
    /// # Panics
    /// If there is no value at this position, or the trial has given it already.
    pub fn value(&mut self, position: usize, x: f64) {
        self.fill(position, Found::Value(x));
    }

    /// Records whether the event at `position` happened.
    ///
    /// # Panics
    /// If there is no event at this position, or the trial has given it already.
    pub fn event(&mut self, position: usize, happened: bool) {
        self.fill(position, Found::Event(happened));
    }

    /// The number recorded at `position`.
    pub fn recorded_value(&self, position: usize) -> Option<f64> {
        match self.found(position) {
            Some(Found::Value(x)) => Some(x),
            _ => None,
        }
    }

    /// Whether the event at `position` happened.
    pub fn recorded_event(&self, position: usize) -> Option<bool> {
        match self.found(position) {
            Some(Found::Event(happened)) => Some(happened),
            _ => None,
        }
    }

    /// Empties it for the next trial.
    pub fn clear(&mut self) {
        self.slots.iter_mut().for_each(|slot| slot.1 = None);
    }

    pub(crate) fn found(&self, position: usize) -> Option<Found> {
        self.slots.get(position).and_then(|slot| slot.1)
    }

    fn fill(&mut self, position: usize, found: Found) {
        let slots = self.slots.len();
        let Some((kind, slot)) = self.slots.get_mut(position) else {
            panic!("there is no quantity {position}: the cell has {slots}");
        };
        let given = if matches!(found, Found::Value(_)) { Kind::Value } else { Kind::Event };
        assert!(*kind == given, "quantity {position} is of kind {kind:?}, the trial gave one of kind {given:?}");
        // Two numbers of one trial are not independent: standard errors from them would be too
        // small.
        assert!(slot.is_none(), "the trial gave quantity {position} twice");
        *slot = Some(found);
    }
}
