//! ASAM MDF 4. A channel group is a group; its master is the time.
//!
//! Values are physical: the file's own conversion is applied. A sample whose invalidation bit is
//! set is missing. Times count from the start of the measurement in the header, in all groups.

use falcon_mdf::blocks::DataType;
use falcon_mdf::model::{Channel as MdfChannel, ChannelGroup, SignalValues};
use falcon_mdf::{Mf4Error, Mf4File};

use crate::contents::{Channel, Group, name_apart};
use crate::fault::Fault;
use crate::format::Format;
use crate::input::Input;
use crate::series::{Loaded, Opened, Series, Values};

/// Length of the header of a block, before its links.
const BLOCK_HEADER_BYTES: u64 = 24;
/// Flag of a channel group that holds values of varying length and no samples.
const VARIABLE_LENGTH_GROUP: u16 = 1;

struct Mdf4 {
    file: Mf4File,
    groups: Vec<Group>,
    /// Data group and channel group of each group.
    places: Vec<(usize, usize)>,
}

pub(crate) fn open(input: Input, _: Format) -> Result<Box<dyn Opened>, Fault> {
    let file = match input {
        Input::Path(path) => Mf4File::open(path),
        Input::Bytes(bytes) => Mf4File::from_bytes(bytes),
    };
    let file = file.map_err(fault)?;
    refuse_what_is_cut_off(&file)?;
    let (mut groups, mut places) = (Vec::new(), Vec::new());
    for (of_data, data) in file.data_groups().iter().enumerate() {
        for (of_channels, channels) in data.channel_groups.iter().enumerate().filter(|(_, group)| !group.is_vlsd()) {
            groups.push(describe(channels, file.start_time().timestamp_ns, groups.len() + 1));
            places.push((of_data, of_channels));
        }
    }
    name_apart(&mut groups);
    Ok(Box::new(Mdf4 { file, groups, places }))
}

impl Mdf4 {
    fn group(&self, group: usize) -> &ChannelGroup {
        let (of_data, of_channels) = self.places[group];
        &self.file.data_groups()[of_data].channel_groups[of_channels]
    }
}

impl Opened for Mdf4 {
    fn version(&self) -> String {
        let version = format!("version {}", self.file.version());
        match self.file.unfinalized() {
            Some(_) => version + ", not closed by the program that wrote it",
            None => version,
        }
    }

    fn groups(&self) -> &[Group] {
        &self.groups
    }

    /// The mean step of the master.
    fn period_s(&mut self, group: usize) -> Option<f64> {
        let master = self.group(group).channels.iter().find(|channel| channel.is_time_channel())?;
        let signal = self.file.signal(master).ok()?;
        let steps = signal.len().checked_sub(2)? + 1;
        let length_s = signal.value_at(steps).ok()? - signal.value_at(0).ok()?;
        Some(length_s / steps as f64).filter(|period_s| period_s.is_finite())
    }

    fn load(&mut self, group: usize) -> Result<Loaded, Fault> {
        let described = &self.groups[group];
        let mut loaded = Loaded::default();
        let channels = self.group(group).channels.iter().zip(&described.channels);
        for (channel, described) in channels.filter(|(_, described)| described.obstacle.is_none()) {
            let signal = self.file.signal(channel).map_err(fault)?;
            let (name, unit) = (described.name.clone(), described.unit.clone());
            let values = match signal.values().map_err(fault)? {
                SignalValues::Str(mut texts) => {
                    mask(&mut texts, signal.validity(), &String::new());
                    Values::Texts(texts)
                }
                SignalValues::F64(mut values) => {
                    mask(&mut values, signal.validity(), &f64::NAN);
                    Values::Numbers(values)
                }
                other => {
                    let mut values = other.to_f64();
                    mask(&mut values, signal.validity(), &f64::NAN);
                    Values::Numbers(values)
                }
            };
            if channel.is_time_channel() {
                loaded.time = Some(loaded.series.len());
            }
            loaded.series.push(Series { name, unit, values });
        }
        if loaded.time.is_none() {
            loaded.notes.push("the group has no master that is a time".to_owned());
        }
        if self.file.unfinalized().is_some() {
            loaded
                .notes
                .push("the file was not closed by the program that wrote it: its end may be missing".to_owned());
        }
        Ok(loaded)
    }
}

fn describe(channels: &ChannelGroup, start_ns: i64, number: usize) -> Group {
    let name = [channels.acquisition_name.trim(), text_of(&channels.comment)].into_iter().find(|name| !name.is_empty());
    let of_channel = |channel: &MdfChannel| Channel {
        name: channel.name.clone(),
        unit: channel.unit.trim().to_owned(),
        obstacle: obstacle(channel, channels.is_bus_event()),
    };
    Group {
        name: name.map_or_else(|| format!("group {number}"), str::to_owned),
        rows: usize::try_from(channels.sample_count).unwrap_or(usize::MAX),
        channels: channels.channels.iter().map(of_channel).collect(),
        period_s: None,
        start_ns: Some(start_ns),
    }
}

/// A comment of one line, by itself or as the text `TX` of XML; empty where it is more than that.
fn text_of(comment: &str) -> &str {
    let inner = comment.split_once("<TX>").and_then(|(_, rest)| rest.split_once("</TX>"));
    let text = inner.map_or(comment, |(text, _)| text).trim();
    if text.contains(['\n', '<', '&']) { "" } else { text }
}

fn obstacle(channel: &MdfChannel, is_bus_event: bool) -> Option<String> {
    if is_bus_event && !channel.is_master() {
        return Some(
            "it is recorded bus traffic, expected signals; decode it with its database and export again".to_owned(),
        );
    }
    if let Some(reason) = channel.unreadable() {
        return Some(reason.to_string());
    }
    if matches!(channel.data_type, DataType::FloatLe | DataType::FloatBe) && !matches!(channel.bit_count, 32 | 64) {
        return Some(format!("its samples are floating-point numbers of {} bits", channel.bit_count));
    }
    if channel.array_shape.is_some() {
        return Some("each of its samples is an array".to_owned());
    }
    (!channel.is_numeric()).then(|| "its samples are no numbers".to_owned())
}

fn mask<T: Clone>(values: &mut [T], validity: Option<Vec<bool>>, missing: &T) {
    let Some(validity) = validity else { return };
    values.iter_mut().zip(validity).filter(|(_, valid)| !valid).for_each(|(value, _)| value.clone_from(missing));
}

/// The library reads as many samples as there are. A file that was closed and has fewer than it
/// declares, or a block that goes beyond its end, is cut off.
fn refuse_what_is_cut_off(file: &Mf4File) -> Result<(), Fault> {
    let map = file.block_map();
    if let Some(block) = map.blocks.iter().find(|block| block.address.saturating_add(block.length) > map.file_size) {
        let expected = format!("{} bytes of block {} from byte {} on", block.length, block.block_type, block.address);
        return Err(Fault::damaged_at(map.file_size, expected, "the end of the file"));
    }
    if file.unfinalized().is_some() {
        return Ok(());
    }
    let mut declared = 0_u64;
    for block in map.blocks.iter().filter(|block| block.block_type.ends_with("CG")) {
        let at = block.address + BLOCK_HEADER_BYTES + 8 * block.link_count;
        let fields = file.read_raw(at, 18).map_err(fault)?;
        let number = |at: usize| fields.get(at..at + 8).and_then(|bytes| bytes.try_into().ok()).map(u64::from_le_bytes);
        let flags = fields.get(16..18).and_then(|bytes| bytes.try_into().ok()).map_or(0, u16::from_le_bytes);
        if flags & VARIABLE_LENGTH_GROUP == 0 {
            declared = declared.saturating_add(number(8).unwrap_or(0));
        }
    }
    let groups = file.data_groups().iter().flat_map(|data| &data.channel_groups).filter(|group| !group.is_vlsd());
    let found: u64 = groups.map(|group| group.sample_count).sum();
    if found < declared {
        return Err(Fault::damaged(format!("{declared} samples in all groups, as declared"), found));
    }
    Ok(())
}

pub(crate) fn fault(error: Mf4Error) -> Fault {
    let text = error.to_string();
    match error {
        Mf4Error::Io(error) => Fault::Io(error),
        Mf4Error::TruncatedFile { offset, expected, actual } => {
            Fault::damaged_at(offset, format!("{expected} bytes"), actual)
        }
        Mf4Error::InvalidBlockId { offset, expected, actual } => {
            Fault::damaged_at(offset, format!("a block {expected}"), format!("'{}'", actual.escape_default()))
        }
        Mf4Error::MissingBlock { block_type, offset } => {
            Fault::damaged_at(offset, format!("a block {block_type}"), "none")
        }
        Mf4Error::InvalidLink { offset, target } => {
            Fault::damaged_at(offset, "a link to a block", format!("one to byte {target}"))
        }
        Mf4Error::CyclicLink { chain, offset } => {
            Fault::damaged_at(offset, format!("a chain of {chain} that ends"), "one that comes back here")
        }
        Mf4Error::UnsupportedVersion { .. } | Mf4Error::Unsupported { .. } => Fault::unsupported(
            format!("has what is not read ({text})"),
            "export it as MDF 4.10 without this, or as CSV",
        ),
        _ => Fault::damaged("what the format prescribes", text),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_comment_of_one_line_is_a_name() {
        assert_eq!(text_of("gas side"), "gas side");
        assert_eq!(text_of("<CGcomment>\n<TX>gas side</TX>\n</CGcomment>"), "gas side");
        for more in ["", "one\ntwo", "<CGcomment><e>7</e></CGcomment>", "<TX>a &amp; b</TX>"] {
            assert_eq!(text_of(more), "");
        }
    }
}
