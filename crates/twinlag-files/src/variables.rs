//! Named arrays of which no format says how they belong together: vectors of one length are
//! channels of one group, the columns of a matrix with as many rows as well. The longer side of a
//! matrix is its rows. A scalar that is called a sampling rate or a period gives the time where no
//! vector does.

use crate::contents::{Channel, Group};
use crate::series::{Series, is_time};

/// Scalars that are samples per second.
const RATES: [&str; 10] = [
    "fs",
    "fs_hz",
    "rate",
    "rate_hz",
    "sample_rate",
    "sampling_rate",
    "samplerate",
    "samplingrate",
    "sampling_frequency",
    "sample_rate_hz",
];
/// Scalars that are seconds per sample.
const PERIODS: [&str; 10] = [
    "dt",
    "dt_s",
    "ts",
    "period",
    "period_s",
    "sample_period",
    "sampling_period",
    "sample_interval",
    "sampling_interval",
    "wf_increment",
];
/// A matrix with more columns is no set of channels.
const MAX_COLUMNS: u64 = 1000;
/// Part of a period by which two statements of it may differ by rounding.
const SAME_PERIODS: f64 = 1e-6;

/// An array by its metadata.
#[derive(Clone, Debug, Default)]
pub(crate) struct Variable {
    pub(crate) name: String,
    pub(crate) unit: String,
    pub(crate) shape: Vec<u64>,
    pub(crate) obstacle: Option<String>,
}

/// Groups of arrays, and which arrays each has.
#[derive(Debug, Default)]
pub(crate) struct Arranged {
    pub(crate) groups: Vec<Group>,
    pub(crate) members: Vec<Vec<usize>>,
}

impl Variable {
    /// Its sides that are longer than 1.
    fn sides(&self) -> Vec<u64> {
        self.shape.iter().copied().filter(|side| *side != 1).collect()
    }

    /// Whether it is one number.
    pub(crate) fn is_scalar(&self) -> bool {
        self.sides().is_empty()
    }

    /// Rows and columns; `None` if it is a scalar, empty, has more than two sides or too many columns.
    fn size(&self) -> Option<(u64, u64)> {
        match self.sides()[..] {
            [rows] if rows > 0 => Some((rows, 1)),
            [a, b] if a > 0 && (1..=MAX_COLUMNS).contains(&a.min(b)) => Some((a.max(b), a.min(b))),
            _ => None,
        }
    }

    /// Names of its columns.
    fn titles(&self) -> Vec<String> {
        match (self.size(), self.name.as_str()) {
            (Some((_, 1)), name) => vec![name.to_owned()],
            (Some((_, columns)), "") => vec![String::new(); columns as usize],
            (Some((_, columns)), name) => (1..=columns).map(|column| format!("{name} {column}")).collect(),
            (None, _) => Vec::new(),
        }
    }

    /// Its columns.
    ///
    /// - `values`: as stored, the last side running fastest
    pub(crate) fn series(&self, values: Vec<f64>) -> Vec<Series> {
        let (titles, sides) = (self.titles(), self.sides());
        let named = |title: String, values| Series::numbers(title, self.unit.clone(), values);
        match (sides.as_slice(), titles.len()) {
            (_, 1) => titles.into_iter().zip([values]).map(|(title, values)| named(title, values)).collect(),
            (&[rows, columns], _) if rows >= columns => {
                let column = |at: usize| values.iter().skip(at).step_by(columns as usize).copied().collect();
                titles.into_iter().enumerate().map(|(at, title)| named(title, column(at))).collect()
            }
            (&[_, rows], _) => {
                let parts = values.chunks(rows as usize);
                titles.into_iter().zip(parts).map(|(title, part)| named(title, part.to_vec())).collect()
            }
            _ => Vec::new(),
        }
    }
}

/// Puts arrays of one length together.
///
/// - `within`: of what they are, in the names of groups; empty for the whole file
/// - `period_s`: as stated for all of them
pub(crate) fn arrange(variables: &[Variable], within: &str, period_s: Option<f64>) -> Arranged {
    let mut arranged = Arranged::default();
    let mut lengths: Vec<u64> = Vec::new();
    for (index, variable) in variables.iter().enumerate() {
        let Some((rows, _)) = variable.size() else { continue };
        let at = lengths.iter().position(|length| *length == rows).unwrap_or_else(|| {
            lengths.push(rows);
            arranged.groups.push(Group { rows: rows as usize, period_s, ..Group::default() });
            arranged.members.push(Vec::new());
            lengths.len() - 1
        });
        let channels = variable.titles().into_iter().map(|name| {
            let (unit, obstacle) = (variable.unit.clone(), variable.obstacle.clone());
            Channel { name, unit, obstacle }
        });
        arranged.groups[at].channels.extend(channels);
        arranged.members[at].push(index);
    }
    let is_one = arranged.groups.len() == 1;
    for group in &mut arranged.groups {
        group.name = match (within, is_one) {
            ("", true) => "variables".to_owned(),
            ("", false) => format!("{} samples", group.rows),
            (within, true) => within.to_owned(),
            (within, false) => format!("{within}, {} samples", group.rows),
        };
        if group.channels.iter().any(|channel| is_time(&channel.name, &channel.unit)) {
            group.period_s = None;
        }
    }
    arranged
}

/// The period that scalars state by their names; none if they contradict each other.
pub(crate) fn period_s<'a>(scalars: impl IntoIterator<Item = (&'a str, f64)>) -> Option<f64> {
    let stated = scalars.into_iter().filter_map(|(name, value)| {
        let name = name.to_lowercase();
        let of_rate = RATES.contains(&name.as_str()).then(|| 1.0 / value);
        of_rate.or_else(|| PERIODS.contains(&name.as_str()).then_some(value))
    });
    let mut stated = stated.filter(|period_s| period_s.is_finite() && *period_s > 0.0);
    let first = stated.next()?;
    stated.all(|other| (other - first).abs() <= SAME_PERIODS * first).then_some(first)
}
