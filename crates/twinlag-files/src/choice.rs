//! Which group of a file is meant: the one that the caller names, else the only one that can be.

use crate::contents::Group;
use crate::error::{FileError, Listing};
use crate::format::Format;
use crate::series::{Opened, is_temperature, is_time};

/// Temperatures that a group must have to be chosen among others.
const SENSORS: usize = 2;

/// What to take of a file with several groups of channels.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Choice {
    /// The sheet, channel group or group of datasets, by name. With `join`, the one whose stamps
    /// are kept.
    pub group: Option<String>,
    /// Puts the channels of all groups with a temperature, or of all if none has one, on the stamps
    /// of one: the others are interpolated linearly between neighbouring samples, never beyond
    /// their ends, never across an invalid sample or a step of more than five times the median one.
    pub join: bool,
}

/// The group to take, with the reason if it was not the only one.
pub(crate) fn choose(
    opened: &mut dyn Opened,
    choice: &Choice,
    file: &str,
    format: Format,
) -> Result<(usize, Option<String>), FileError> {
    let groups = opened.groups();
    let file = file.to_owned();
    if let Some(wanted) = &choice.group {
        let by = |same: &dyn Fn(&Group) -> bool| (0..groups.len()).filter(|&at| same(&groups[at])).collect::<Vec<_>>();
        let exact = by(&|group| group.name == *wanted);
        let found = if exact.is_empty() { by(&|g| g.name.to_lowercase() == wanted.to_lowercase()) } else { exact };
        return match found[..] {
            [group] => Ok((group, None)),
            _ => Err(FileError::UnknownGroup { file, wanted: wanted.clone(), groups: listing(opened, |_| true) }),
        };
    }
    let usable: Vec<usize> = (0..groups.len()).filter(|&group| is_usable(&groups[group])).collect();
    let with_sensors: Vec<usize> =
        usable.iter().copied().filter(|&group| temperatures(&groups[group]) >= SENSORS).collect();
    match (&usable[..], &with_sensors[..]) {
        ([], _) => Err(FileError::NoGroup { file, format, groups: listing(opened, |_| true) }),
        ([group], _) => Ok((*group, None)),
        (all, [group]) if !choice.join => {
            let why = format!("the only one of {} groups with two temperatures or more", all.len());
            Ok((*group, Some(why)))
        }
        ([first, ..], with_sensors) if choice.join => Ok((*with_sensors.first().unwrap_or(first), None)),
        _ => Err(FileError::SeveralGroups { file, groups: listing(opened, is_usable) }),
    }
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

fn listing(opened: &mut dyn Opened, which: impl Fn(&Group) -> bool) -> Listing {
    let chosen: Vec<usize> = (0..opened.groups().len()).filter(|&group| which(&opened.groups()[group])).collect();
    let described = chosen.into_iter().map(|group| {
        let period_s = opened.period_s(group);
        Group { period_s, ..opened.groups()[group].clone() }
    });
    Listing(described.collect())
}
