//! Which group of a file is meant: the one that the caller names, else the only one that can be.

use twinlag_record::{ColumnRef, Selection};

use crate::contents::Group;
use crate::error::{FileError, Listing};
use crate::format::Format;
use crate::series::{is_temperature, is_time};

/// Temperatures that a group must have to be chosen among others.
const SENSORS: usize = 2;

/// What to take of a file with several groups of channels.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Choice {
    /// The sheet, channel group or group of datasets, by name. With `join`, the one whose stamps
    /// are kept.
    pub group: Option<String>,
    /// Names of channels, with or without their units, in any case. If no group is named and `join`
    /// is off, the only group that has all of them is read, with all its channels.
    pub channels: Vec<String>,
    /// Puts the channels of all groups with a temperature, or of all if none has one, on the stamps
    /// of one: the others are interpolated linearly between neighbouring samples, never beyond
    /// their ends, never across an invalid sample or a step of more than five times the median one.
    /// By default that is the group with the lowest sampling rate; the first one if the file does
    /// not state the rate of every one.
    pub join: bool,
}

impl Choice {
    /// What the caller's choice of sensors says of the group.
    pub fn of(selection: &Selection) -> Self {
        let name = |column: &ColumnRef| match column {
            ColumnRef::Name(name) => Some(name.clone()),
            ColumnRef::Number(_) => None,
        };
        let channels = [&selection.t1, &selection.t2].into_iter().flatten().filter_map(name).collect();
        Self { channels, ..Self::default() }
    }
}

/// The group to take, with the reason if it was not the only one.
///
/// - `groups`: with their periods, as far as these are known
pub(crate) fn choose(
    groups: &[Group],
    choice: &Choice,
    file: &str,
    format: Format,
) -> Result<(usize, Option<String>), FileError> {
    let file = file.to_owned();
    if let Some(wanted) = &choice.group {
        let by = |same: &dyn Fn(&Group) -> bool| (0..groups.len()).filter(|&at| same(&groups[at])).collect::<Vec<_>>();
        let exact = by(&|group| group.name == *wanted);
        let found = if exact.is_empty() { by(&|g| g.name.to_lowercase() == wanted.to_lowercase()) } else { exact };
        return match found[..] {
            [group] => Ok((group, None)),
            _ => Err(FileError::UnknownGroup { file, wanted: wanted.clone(), groups: Listing(groups.to_vec()) }),
        };
    }
    let usable: Vec<usize> = (0..groups.len()).filter(|&group| is_usable(&groups[group])).collect();
    let only = |which: &dyn Fn(&Group) -> bool| {
        let mut fitting = usable.iter().copied().filter(|&group| which(&groups[group]));
        fitting.next().filter(|_| fitting.next().is_none())
    };
    let of_several = |has: &str| Some(format!("the only one of {} groups with {has}", usable.len()));
    match usable[..] {
        [] => Err(FileError::NoGroup { file, format, groups: Listing(groups.to_vec()) }),
        [group] => Ok((group, None)),
        _ if choice.join => Ok(slowest(groups)),
        _ => {
            let has_all = |group: &Group| choice.channels.iter().all(|name| has(group, name));
            if let Some(group) = only(&has_all).filter(|_| !choice.channels.is_empty()) {
                let names: Vec<String> = choice.channels.iter().map(|name| format!("'{name}'")).collect();
                return Ok((group, of_several(&names.join(" and "))));
            }
            if let Some(group) = only(&|group| temperatures(group) >= SENSORS) {
                return Ok((group, of_several("two temperatures or more")));
            }
            let groups = usable.iter().map(|&group| groups[group].clone()).collect();
            Err(FileError::SeveralGroups { file, groups: Listing(groups) })
        }
    }
}

/// Of the groups that are joined, the one with the lowest sampling rate: between its samples, those of another are interpolated from
/// readings that lie closer together, and not the other way round. The first one where the rates are not known of all.
fn slowest(groups: &[Group]) -> (usize, Option<String>) {
    let joined = joined(groups);
    let periods_s: Option<Vec<f64>> = joined.iter().map(|&group| groups[group].period_s).collect();
    let Some(periods_s) = periods_s else { return (joined[0], None) };
    let longest_s = periods_s.iter().copied().fold(0.0, f64::max);
    let slow: Vec<usize> = (0..joined.len()).filter(|&at| periods_s[at] >= longest_s).collect();
    let why = match slow.len() {
        all if all == joined.len() => None,
        1 => Some("the one with the lowest sampling rate".to_owned()),
        _ => Some("the first of those with the lowest sampling rate".to_owned()),
    };
    (slow.first().map_or(joined[0], |&at| joined[at]), why)
}

/// Whether a channel has this name, with or without its unit.
fn has(group: &Group, name: &str) -> bool {
    let is_name = |own: &str| own.to_lowercase() == name.to_lowercase();
    group.channels.iter().any(|channel| is_name(&channel.name) || is_name(&channel.to_string()))
}

/// The groups whose channels are joined: those with a temperature, or all if none has one.
pub(crate) fn joined(groups: &[Group]) -> Vec<usize> {
    let usable = || (0..groups.len()).filter(|&group| is_usable(&groups[group]));
    let warm: Vec<usize> = usable().filter(|&group| temperatures(&groups[group]) > 0).collect();
    if warm.is_empty() { usable().collect() } else { warm }
}

/// Whether it has rows and a channel that is read and is no time.
fn is_usable(group: &Group) -> bool {
    group.rows > 0 && group.channels.iter().any(|c| c.obstacle.is_none() && !is_time(&c.name, &c.unit))
}

fn temperatures(group: &Group) -> usize {
    group.channels.iter().filter(|channel| is_temperature(&channel.name, &channel.unit)).count()
}
