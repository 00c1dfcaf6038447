//! What a file holds: groups of channels, each on one time base.

use std::fmt;

use jiff::Timestamp;

use crate::format::Format;

/// Most channels of a group that are listed one by one.
const LISTED_CHANNELS: usize = 12;

/// What a file holds, as far as its metadata say.
#[derive(Clone, Debug, PartialEq)]
pub struct Contents {
    /// The format.
    pub format: Format,
    /// Its version, and with what it was written where the file says so.
    pub version: String,
    /// The groups, in the order of the file.
    pub groups: Vec<Group>,
}

/// Channels on one time base: a sheet, a channel group, the variables of one dimension.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Group {
    /// Its name, by which it is chosen.
    pub name: String,
    /// Number of rows.
    pub rows: usize,
    /// The channels, in the order of the file.
    pub channels: Vec<Channel>,
    /// Sample period, s: as the file states it, else the mean of its stamps where they are cheap to read.
    pub period_s: Option<f64>,
    /// The instant from which its time counts, in nanoseconds since 1970-01-01, UTC, where the file
    /// states it.
    pub start_ns: Option<i64>,
}

/// One channel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Channel {
    /// Its name.
    pub name: String,
    /// Its unit; empty if the file states none.
    pub unit: String,
    /// Why it cannot be read as numbers or instants, if so.
    pub obstacle: Option<String>,
}

impl Channel {
    /// A channel of numbers or instants.
    pub(crate) fn new(name: impl Into<String>, unit: impl Into<String>) -> Self {
        Self { name: name.into(), unit: unit.into(), obstacle: None }
    }
}

/// Adds a number to names of groups that come again, so that each can be chosen.
pub(crate) fn name_apart(groups: &mut [Group]) {
    for group in 1..groups.len() {
        let (before, rest) = groups.split_at_mut(group);
        let name = rest[0].name.clone();
        let mut number = 1;
        while before.iter().any(|other| other.name == rest[0].name) {
            number += 1;
            rest[0].name = format!("{name} #{number}");
        }
    }
}

impl fmt::Display for Channel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.name.as_str(), self.unit.as_str()) {
            ("", _) => write!(f, "(no name)"),
            (name, "") => write!(f, "{name}"),
            (name, unit) if name.ends_with(']') || name.ends_with(')') => write!(f, "{name} in {unit}"),
            (name, unit) => write!(f, "{name} [{unit}]"),
        }
    }
}

impl fmt::Display for Group {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "'{}': {} rows", self.name, self.rows)?;
        if let Some(period_s) = self.period_s {
            write!(f, ", period {} s", significant(period_s))?;
        }
        if let Some(start) = self.start_ns.and_then(|ns| Timestamp::from_nanosecond(ns.into()).ok()) {
            write!(f, ", from {start}")?;
        }
        write!(f, ": ")?;
        let named = self.channels.iter().take(LISTED_CHANNELS).map(|channel| match &channel.obstacle {
            Some(obstacle) => format!("{channel} ({obstacle})"),
            None => channel.to_string(),
        });
        let named = named.collect::<Vec<_>>();
        write!(f, "{}", named.join(", "))?;
        match self.channels.len().saturating_sub(LISTED_CHANNELS) {
            0 => Ok(()),
            more => write!(f, " and {more} more"),
        }
    }
}

/// A number to nine digits: stamps that are multiples of a decimal period are not of its double.
fn significant(value: f64) -> f64 {
    format!("{value:.8e}").parse().unwrap_or(value)
}
