//! Channels with their values, as every format's module gives them.

use twinlag_record::NamedColumn;

use crate::contents::Group;
use crate::fault::Fault;

/// A file whose metadata are read and whose samples are read as they are asked for.
pub(crate) trait Opened {
    /// The version of the format, and what wrote the file, where these are known.
    fn version(&self) -> String {
        String::new()
    }

    /// The groups, each on one time base.
    fn groups(&self) -> &[Group];

    /// Sample period of a group, s: as the file states it, else the mean of its stamps where they are
    /// cheap to read.
    fn period_s(&mut self, group: usize) -> Option<f64> {
        self.groups()[group].period_s
    }

    /// The channels of a group.
    fn load(&mut self, group: usize) -> Result<Loaded, Fault>;
}

/// The channels of a group, all of one length.
#[derive(Debug, Default)]
pub(crate) struct Loaded {
    pub(crate) series: Vec<Series>,
    /// Which of them is the time, where the format says so.
    pub(crate) time: Option<usize>,
    /// What the user should know of how they were read.
    pub(crate) notes: Vec<String>,
}

impl Loaded {
    /// Puts the time of evenly spaced samples before the channels, as long as these are.
    pub(crate) fn add_clock(&mut self, start_s: f64, period_s: Option<f64>) {
        let (Some(period_s), Some(first)) = (period_s, self.series.first()) else { return };
        self.series.insert(0, Series::clock(start_s, period_s, first.len()));
        self.time = Some(0);
    }
}

/// A channel with its values.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Series {
    pub(crate) name: String,
    pub(crate) unit: String,
    pub(crate) values: Values,
}

/// Values, one for each row.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Values {
    /// Missing is NaN.
    Numbers(Vec<f64>),
    /// Nanoseconds since 1970-01-01, UTC.
    Instants(Vec<Option<i64>>),
    Texts(Vec<String>),
}

impl Values {
    /// The numbers; as many missing ones for instants and texts.
    pub(crate) fn into_numbers(self) -> Vec<f64> {
        match self {
            Self::Numbers(values) => values,
            Self::Instants(values) => vec![f64::NAN; values.len()],
            Self::Texts(values) => vec![f64::NAN; values.len()],
        }
    }
}

impl Series {
    pub(crate) fn numbers(name: impl Into<String>, unit: impl Into<String>, values: Vec<f64>) -> Self {
        Self { name: name.into(), unit: unit.into(), values: Values::Numbers(values) }
    }

    /// `start + k period`, the time of evenly spaced samples, in seconds.
    fn clock(start_s: f64, period_s: f64, rows: usize) -> Self {
        Self::numbers("time", "s", (0..rows).map(|row| start_s + row as f64 * period_s).collect())
    }

    pub(crate) fn len(&self) -> usize {
        match &self.values {
            Values::Numbers(values) => values.len(),
            Values::Instants(values) => values.len(),
            Values::Texts(values) => values.len(),
        }
    }

    pub(crate) fn into_column(self) -> NamedColumn {
        let Self { name, unit, values } = self;
        match values {
            Values::Numbers(values) => NamedColumn::numbers(name, values).with_unit(unit),
            Values::Instants(values) => NamedColumn::instants_ns(name, values),
            Values::Texts(values) => NamedColumn::texts(name, values).with_unit(unit),
        }
    }
}

/// Whether a name and a unit are those of a temperature.
pub(crate) fn is_temperature(name: &str, unit: &str) -> bool {
    NamedColumn::numbers(name, []).with_unit(unit).is_called_temperature()
}

/// Whether a name and a unit are those of a time.
pub(crate) fn is_time(name: &str, unit: &str) -> bool {
    NamedColumn::numbers(name, []).with_unit(unit).is_called_time()
}
