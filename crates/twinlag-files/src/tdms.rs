//! TDMS of National Instruments: own reader, since of those that there are none reads what LabVIEW
//! writes (several chunks in a segment, interleaved samples, lists of objects that go on) without
//! losing samples in silence.
//!
//! Channels of a group with one number of samples and one time base are a group here. The time is
//! `wf_start_offset + k wf_increment`, from `wf_start_time`; without an increment it is a channel of
//! its own, if there is one. Counts are scaled as the file says. Layout: NI, "TDMS File Format Internal
//! Structure".

mod daqmx;
mod parse;
mod scale;
mod segment;
mod thermocouple;
mod value;

use std::collections::BTreeMap;
use std::io::{Seek, SeekFrom};

use crate::contents::{Channel, Group, name_apart};
use crate::fault::Fault;
use crate::format::Format;
use crate::input::{Input, Stream};
use crate::records::{self, Field};
use crate::series::{Loaded, Opened, Series, Values};
use scale::Scales;
use segment::{Object, Objects, Piece, Source};
use value::Property;

struct Tdms {
    stream: Stream,
    version: u32,
    is_open: bool,
    groups: Vec<Group>,
    /// The channels of each group, with their time base.
    members: Vec<(Clock, Vec<Object>)>,
}

/// Evenly spaced samples: period and offset as bits, to be compared; and the instant of time zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Clock {
    rows: u64,
    period: Option<u64>,
    offset: u64,
    start_ns: Option<i64>,
}

impl Clock {
    fn of(object: &Object) -> Self {
        let number = |name: &str| object.properties.get(name).and_then(Property::number);
        let period_s = number("wf_increment").filter(|period_s| *period_s > 0.0 && period_s.is_finite());
        let offset_s = number("wf_start_offset").filter(|offset_s| offset_s.is_finite()).unwrap_or(0.0);
        let start_ns = object.properties.get("wf_start_time").and_then(Property::instant_ns);
        Self { rows: object.rows, period: period_s.map(f64::to_bits), offset: offset_s.to_bits(), start_ns }
    }

    fn period_s(self) -> Option<f64> {
        self.period.map(f64::from_bits)
    }
}

pub(crate) fn open(input: Input, _: Format) -> Result<Box<dyn Opened>, Fault> {
    let bytes = input.bytes()?;
    let mut stream = input.stream()?;
    let Objects { version, is_open, objects } = segment::read(&mut stream, bytes)?;
    let (mut groups, mut members): (Vec<Group>, Vec<(Clock, Vec<Object>)>) = Default::default();
    for object in objects {
        let clock = Clock::of(&object);
        let same = (0..groups.len()).find(|&at| groups[at].name == object.group && members[at].0 == clock);
        let at = same.unwrap_or_else(|| {
            let (period_s, rows) = (clock.period_s(), usize::try_from(clock.rows).unwrap_or(usize::MAX));
            let name = object.group.clone();
            groups.push(Group { name, rows, period_s, start_ns: clock.start_ns, channels: Vec::new() });
            members.push((clock, Vec::new()));
            groups.len() - 1
        });
        groups[at].channels.push(describe(&object));
        members[at].1.push(object);
    }
    name_apart(&mut groups);
    Ok(Box::new(Tdms { stream, version, is_open, groups, members }))
}

fn describe(object: &Object) -> Channel {
    let text = |name: &str| object.properties.get(name).and_then(Property::text).unwrap_or_default().trim();
    let unit = Some(text("unit_string")).filter(|unit| !unit.is_empty()).unwrap_or_else(|| text("NI_UnitDescription"));
    let obstacle = match &object.sources[..] {
        [] => Some("it has no samples".to_owned()),
        sources => match (sources.iter().find(|source| source.kind.meaning().is_none()), scales_of(object)) {
            (Some(source), _) => Some(format!("its samples are {}", source.kind.name())),
            (None, Err(reason)) => Some(format!("its samples are counts that cannot be scaled: {reason}")),
            (None, Ok(_)) => None,
        },
    };
    Channel { name: object.name.clone(), unit: unit.to_owned(), obstacle }
}

/// The scales for a channel's counts, if it has any, or why they cannot be applied.
fn scales_of(object: &Object) -> Result<Option<Scales>, String> {
    let counts: Vec<u32> = object.sources.iter().map(|source| source.scale).collect();
    Scales::of(&object.properties, &counts)
}

impl Opened for Tdms {
    fn version(&self) -> String {
        let version = match self.version {
            4712 => "version 1.0".to_owned(),
            4713 => "version 2.0".to_owned(),
            other => format!("version {other}"),
        };
        if self.is_open { version + ", not closed by the program that wrote it" } else { version }
    }

    fn groups(&self) -> &[Group] {
        &self.groups
    }

    fn load(&mut self, group: usize) -> Result<Loaded, Fault> {
        let (clock, members) = &self.members[group];
        let mut loaded = Loaded::default();
        let mut scaled: BTreeMap<String, Vec<String>> = BTreeMap::new();
        for (object, channel) in members.iter().zip(&self.groups[group].channels) {
            if channel.obstacle.is_some() {
                continue;
            }
            let mut values = object.sources.iter().map(|source| samples(&mut self.stream, source));
            let values = match scales_of(object) {
                Ok(Some(scales)) => {
                    let counts = values.map(|values| Ok(values?.into_numbers())).collect::<Result<Vec<_>, Fault>>()?;
                    scaled.entry(scales.names()).or_default().push(format!("'{}'", channel.name));
                    Values::Numbers(scales.apply(&counts))
                }
                _ => values.next().unwrap_or(Ok(Values::Numbers(Vec::new())))?,
            };
            loaded.series.push(Series { name: channel.name.clone(), unit: channel.unit.clone(), values });
        }
        loaded.notes.extend(
            scaled
                .iter()
                .map(|(laws, names)| format!("counts of {} scaled as the file says: {laws}", names.join(", "))),
        );
        loaded.add_clock(f64::from_bits(clock.offset), clock.period_s());
        if self.is_open {
            loaded
                .notes
                .push("the file was not closed by the program that wrote it: its end may be missing".to_owned());
        }
        Ok(loaded)
    }
}

/// All samples of a source. The pieces were checked to lie within the file.
fn samples(stream: &mut Stream, source: &Source) -> Result<Values, Fault> {
    let Some(meaning) = source.kind.meaning() else { return Ok(Values::Numbers(Vec::new())) };
    let field = |piece: &Piece| Field {
        offset: piece.at,
        bytes: source.kind.bytes() as usize,
        meaning,
        is_big_endian: piece.is_big_endian,
    };
    let mut columns = [Values::Numbers(Vec::new())];
    for (index, piece) in source.pieces.iter().enumerate() {
        let field = field(piece);
        if index == 0 {
            columns = [field.empty()];
        }
        stream.seek(SeekFrom::Start(piece.offset))?;
        records::read(stream, piece.count, piece.stride as usize, &[field], &mut columns)?;
    }
    let [mut values] = columns;
    if let (Some(bit), Values::Numbers(values)) = (source.bit, &mut values) {
        values.iter_mut().for_each(|value| *value = f64::from((*value as u64 >> bit & 1) as u8));
    }
    Ok(values)
}

/// Properties by name.
type Properties = BTreeMap<String, Property>;
