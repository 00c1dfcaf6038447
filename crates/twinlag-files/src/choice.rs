//! Which group of a file is meant: the one that the caller names, else the only one that can be.

use crate::contents::{Channel, Group};
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
    /// Channels that are wanted, by name. Where no group is named, the only one that has all of
    /// them is taken; which channels are read does not depend on it.
    pub channels: Vec<String>,
    /// Puts the channels of all groups with a temperature, or of all if none has one, on the stamps
    /// of one, by default of the one with the fewest samples in a second: the others are
    /// interpolated linearly between neighbouring samples, never beyond their ends, never across an
    /// invalid sample or a step of more than five times the median one.
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
    let only = |which: &dyn Fn(&Group) -> bool| {
        let mut fitting = usable.iter().copied().filter(|&group| which(&groups[group]));
        fitting.next().filter(|_| fitting.next().is_none())
    };
    let of_several = |has: &str| Some(format!("the only one of {} groups with {has}", usable.len()));
    match usable[..] {
        [] => Err(FileError::NoGroup { file, format, groups: listing(opened, |_| true) }),
        [group] => Ok((group, None)),
        _ if choice.join => Ok(slowest(opened)),
        _ => {
            let wanted =
                if choice.channels.is_empty() { None } else { only(&|group| has_all(group, &choice.channels)) };
            if let Some(group) = wanted {
                let names: Vec<String> = choice.channels.iter().map(|name| format!("'{name}'")).collect();
                return Ok((group, of_several(&names.join(" and "))));
            }
            match only(&|group| temperatures(group) >= SENSORS) {
                Some(group) => Ok((group, of_several("two temperatures or more"))),
                None => Err(FileError::SeveralGroups { file, groups: listing(opened, is_usable) }),
            }
        }
    }
}

/// Of the groups that are joined, the one with the longest period: between the samples of another, its channels would be straight
/// lines and no readings. The first where that is not known of all.
fn slowest(opened: &mut dyn Opened) -> (usize, Option<String>) {
    let joined = joined(opened.groups());
    let periods_s: Option<Vec<f64>> = joined.iter().map(|&group| opened.period_s(group)).collect();
    let Some(periods_s) = periods_s else { return (joined[0], None) };
    let longest_s = periods_s.iter().copied().fold(0.0, f64::max);
    let group = periods_s.iter().position(|period_s| *period_s == longest_s).map_or(joined[0], |at| joined[at]);
    let is_alone = periods_s.iter().any(|period_s| *period_s < longest_s);
    (group, is_alone.then(|| "the one with the fewest samples in a second".to_owned()))
}

/// Whether each of these is the name of a channel.
fn has_all(group: &Group, names: &[String]) -> bool {
    let is_called = |channel: &Channel, name: &str| {
        [channel.name.clone(), channel.to_string()].iter().any(|own| own.to_lowercase() == name.to_lowercase())
    };
    names.iter().all(|name| group.channels.iter().any(|channel| is_called(channel, name)))
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
