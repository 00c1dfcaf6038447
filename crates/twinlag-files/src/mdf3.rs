//! MDF 3 and before. A channel group is a group; its time channel is the time, in seconds from the
//! start of the measurement. Values are physical: the file's own conversion is applied.

use std::sync::Arc;

use falcon_mdf::io::memory::MemorySource;
use falcon_mdf::mdf3::{Mdf3ChannelGroup, Mdf3File};
use falcon_mdf::model::SignalValues;

use crate::contents::{Channel, Group, name_apart};
use crate::fault::Fault;
use crate::format::Format;
use crate::input::Input;
use crate::mdf::fault;
use crate::series::{Loaded, Opened, Series, Values};

struct Mdf3 {
    file: Mdf3File,
    groups: Vec<Group>,
    /// Data group and channel group of each group.
    places: Vec<(usize, usize)>,
}

pub(crate) fn open(input: Input, _: Format) -> Result<Box<dyn Opened>, Fault> {
    let bytes = input.bytes()?;
    let file = match input {
        Input::Path(path) => Mdf3File::open(path),
        Input::Bytes(bytes) => Mdf3File::from_source(Arc::new(MemorySource::new(bytes))),
    };
    let file = file.map_err(fault)?;
    let start_ns = file.start_time_ns().and_then(|ns| i64::try_from(ns).ok());
    let (mut groups, mut places) = (Vec::new(), Vec::new());
    for (of_data, data) in file.data_groups().iter().enumerate() {
        for (of_channels, channels) in data.channel_groups.iter().enumerate() {
            check_length(channels, data.data_block_addr.into(), bytes)?;
            groups.push(describe(channels, start_ns, groups.len() + 1));
            places.push((of_data, of_channels));
        }
    }
    name_apart(&mut groups);
    Ok(Box::new(Mdf3 { file, groups, places }))
}

/// The library makes room for as many samples as a group declares before it looks for them.
fn check_length(channels: &Mdf3ChannelGroup, at: u64, bytes: u64) -> Result<(), Fault> {
    let (records, record_bytes) = (u64::from(channels.cycle_count), u64::from(channels.record_size));
    // A record without bytes has no samples either.
    if records * record_bytes.max(1) <= bytes.saturating_sub(at) {
        return Ok(());
    }
    let expected = format!("{records} records of {record_bytes} bytes from byte {at} on");
    Err(Fault::damaged_at(bytes, expected, "the end of the file"))
}

impl Opened for Mdf3 {
    fn version(&self) -> String {
        let program = self.file.program().trim_matches(['\0', ' ']);
        let by = if program.is_empty() { String::new() } else { format!(", written by {program}") };
        format!("version {}{by}", self.file.version())
    }

    fn groups(&self) -> &[Group] {
        &self.groups
    }

    fn load(&mut self, group: usize) -> Result<Loaded, Fault> {
        let (of_data, of_channels) = self.places[group];
        let channels = &self.file.data_groups()[of_data].channel_groups[of_channels].channels;
        let mut loaded = Loaded::default();
        for (index, channel) in channels.iter().enumerate() {
            let values = match self.file.channel_physical(of_data, of_channels, index).map_err(fault)? {
                SignalValues::F64(values) => Values::Numbers(values),
                SignalValues::Str(texts) => Values::Texts(texts),
                SignalValues::Bytes { .. } | SignalValues::VarBytes { .. } => {
                    loaded.notes.push(format!("channel '{}' was left out: its samples are no numbers", channel.name));
                    continue;
                }
                other => Values::Numbers(other.to_f64()),
            };
            if channel.is_time() {
                loaded.time = Some(loaded.series.len());
            }
            let Channel { name, unit, .. } = self.groups[group].channels[index].clone();
            loaded.series.push(Series { name, unit, values });
        }
        if loaded.time.is_none() {
            loaded.notes.push("the group has no time channel".to_owned());
        }
        Ok(loaded)
    }
}

fn describe(channels: &Mdf3ChannelGroup, start_ns: Option<i64>, number: usize) -> Group {
    let name = Some(channels.comment.trim()).filter(|comment| !comment.is_empty() && !comment.contains('\n'));
    let time = channels.channels.iter().find(|channel| channel.is_time());
    let unit = |channel: &falcon_mdf::mdf3::Mdf3Channel| match channel.unit.trim() {
        // Times of MDF 3 are in seconds.
        "" if channel.is_time() => "s".to_owned(),
        unit => unit.to_owned(),
    };
    Group {
        name: name.map_or_else(|| format!("group {number}"), str::to_owned),
        rows: channels.cycle_count as usize,
        channels: channels.channels.iter().map(|channel| Channel::new(channel.name.as_str(), unit(channel))).collect(),
        period_s: time.map(|time| time.sampling_rate).filter(|period_s| *period_s > 0.0),
        start_ns,
    }
}
