//! A given series, interpolated linearly between its points. Its first point is at the record's
//! first sample, whatever its own time; during the run-in the gas has that first value. It must
//! reach the record's end.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::SignalError;
use crate::check::{at_least, finite, positive};
use crate::grid::Grid;

/// A gas temperature given as numbers, linear between them, starting at the record's first sample.
/// Linear interpolation removes high frequencies: a series as coarse as the record's sampling
/// has less of them than the gas it was measured in.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Unchecked", into = "Unchecked")]
pub enum Series {
    /// In a rig file: `path`. A text file with a line `time_s,value_c` for each point, times
    /// increasing. Its first line may be a header; empty lines and those starting with `#` are
    /// skipped.
    File {
        /// Relative paths are looked up in [`Rig::with_base_dir`](crate::Rig::with_base_dir).
        path: PathBuf,
    },
    /// In a rig file: `values_c` and `period_s`.
    Inline {
        /// Temperatures, °C, at least two.
        values_c: Vec<f64>,
        /// Time from one to the next, s.
        period_s: f64,
    },
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename = "series")]
struct Unchecked {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    path: Option<PathBuf>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    period_s: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    values_c: Option<Vec<f64>>,
}

impl TryFrom<Unchecked> for Series {
    type Error = SignalError;

    fn try_from(fields: Unchecked) -> Result<Self, SignalError> {
        match (fields.path, fields.values_c, fields.period_s) {
            (Some(path), None, None) => Ok(Self::File { path }),
            (None, Some(values_c), Some(period_s)) => Ok(Self::Inline { values_c, period_s }),
            _ => Err(SignalError::SeriesSource),
        }
    }
}

impl From<Series> for Unchecked {
    fn from(series: Series) -> Self {
        match series {
            Series::File { path } => Self { path: Some(path), period_s: None, values_c: None },
            Series::Inline { values_c, period_s } => {
                Self { path: None, period_s: Some(period_s), values_c: Some(values_c) }
            }
        }
    }
}

impl Series {
    /// The points, `(time_s, value_c)`, first time 0.
    fn points(&self, base_dir: &Path) -> Result<Vec<(f64, f64)>, SignalError> {
        match self {
            Self::Inline { values_c, period_s } => {
                Ok(values_c.iter().enumerate().map(|(i, &value_c)| (i as f64 * period_s, value_c)).collect())
            }
            Self::File { path } => read(&base_dir.join(path)),
        }
    }

    pub(super) fn values_c(&self, grid: Grid, base_dir: &Path) -> Result<Vec<f64>, SignalError> {
        let points = self.points(base_dir)?;
        let needed_s = grid.time_s(grid.points - 1);
        let end_s = points.last().map_or(0.0, |&(time_s, _)| time_s);
        // Times that are the same in decimals may differ in the last bit: the last value is held
        // that far.
        if end_s < needed_s * (1.0 - 1e-9) {
            return Err(SignalError::SeriesTooShort { end_s, needed_s });
        }
        let mut right = 1;
        let mut next = |time_s: f64| {
            while right + 1 < points.len() && points[right].0 < time_s {
                right += 1;
            }
            let ((t0, x0), (t1, x1)) = (points[right - 1], points[right]);
            // Measured from the nearer end, so that a grid point on a series point has exactly its
            // value.
            let u = ((time_s - t0) / (t1 - t0)).clamp(0.0, 1.0);
            if u < 0.5 { x0 + u * (x1 - x0) } else { x1 - (1.0 - u) * (x1 - x0) }
        };
        Ok(grid.times_s().map(&mut next).collect())
    }

    pub(super) fn check(&self, within: &str) -> Result<(), SignalError> {
        let Self::Inline { values_c, period_s } = self else { return Ok(()) };
        at_least(within, "values_c", values_c.len(), 2)?;
        for (i, &value_c) in values_c.iter().enumerate() {
            finite(within, &format!("values_c[{i}]"), value_c)?;
        }
        positive(within, "period_s", *period_s)
    }
}

/// Reads `time_s,value_c` lines and shifts the first time to 0.
fn read(path: &Path) -> Result<Vec<(f64, f64)>, SignalError> {
    let text = fs::read_to_string(path)
        .map_err(|error| SignalError::SeriesFile { path: path.to_owned(), kind: error.kind() })?;
    let mut points: Vec<(f64, f64)> = Vec::new();
    let mut header_allowed = true;
    for (line, row) in (1..).zip(text.trim_start_matches('\u{feff}').lines().map(str::trim)) {
        if row.is_empty() || row.starts_with('#') {
            continue;
        }
        let is_first = std::mem::replace(&mut header_allowed, false);
        let Some((time_s, value_c)) = two_numbers(row) else {
            if is_first && !row.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)) {
                continue;
            }
            return Err(SignalError::SeriesLine { path: path.to_owned(), line, text: row.to_owned() });
        };
        if let Some(&(previous_s, _)) = points.last()
            && time_s <= previous_s
        {
            return Err(SignalError::SeriesOrder { path: path.to_owned(), line, previous_s, time_s });
        }
        points.push((time_s, value_c));
    }
    at_least(&path.display().to_string(), "points", points.len(), 2)?;
    let start_s = points[0].0;
    for point in &mut points {
        point.0 -= start_s;
    }
    Ok(points)
}

fn two_numbers(row: &str) -> Option<(f64, f64)> {
    let (time, value) = row.split_once(',')?;
    let number = |text: &str| text.trim().parse().ok().filter(|number: &f64| number.is_finite());
    Some((number(time)?, number(value)?))
}
