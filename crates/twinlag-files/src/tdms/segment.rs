//! The segments of a file: which channels there are, and where their samples lie.

use std::collections::HashMap;
use std::io::{Read, Seek, SeekFrom};

use super::Properties;
use super::daqmx::{self, Layout};
use super::parse::Cursor;
use super::scale;
use super::value::{Kind, Property};
use crate::fault::Fault;
use crate::input::Stream;

const LEAD_IN_BYTES: u64 = 28;
const HAS_METADATA: u32 = 1 << 1;
const HAS_NEW_LIST: u32 = 1 << 2;
const HAS_SAMPLES: u32 = 1 << 3;
const IS_INTERLEAVED: u32 = 1 << 5;
const IS_BIG_ENDIAN: u32 = 1 << 6;
/// Of a segment that was never closed.
const TO_THE_END: u64 = u64::MAX;
const NO_SAMPLES: u32 = u32::MAX;
const AS_BEFORE: u32 = 0;

/// All channels of a file.
#[derive(Debug)]
pub(super) struct Objects {
    pub(super) version: u32,
    /// Whether the last segment was never closed.
    pub(super) is_open: bool,
    pub(super) objects: Vec<Object>,
}

/// A channel.
#[derive(Clone, Debug, Default)]
pub(super) struct Object {
    pub(super) group: String,
    pub(super) name: String,
    pub(super) properties: Properties,
    /// What its values are made of: one kind of samples, or all the counts that a scale takes; nothing if
    /// it never had samples.
    pub(super) sources: Vec<Source>,
    pub(super) rows: u64,
    /// What it has in each chunk of the segment at hand.
    pub(super) chunk: Option<Chunk>,
    /// Where its counts stand in raw data of DAQmx.
    pub(super) layout: Option<Layout>,
}

/// Samples of one type.
#[derive(Clone, Debug)]
pub(super) struct Source {
    /// The scale for which they stand.
    pub(super) scale: u32,
    pub(super) kind: Kind,
    /// Which bit of them counts; all do of what is no digital line.
    pub(super) bit: Option<u8>,
    pub(super) pieces: Vec<Piece>,
}

impl Source {
    /// Adds samples, to the last run of them if they follow it.
    pub(super) fn add(&mut self, piece: Piece) {
        match self.pieces.last_mut() {
            Some(last) if last.continues(&piece) => last.count += piece.count,
            _ => self.pieces.push(piece),
        }
    }
}

/// Samples in one run through the file.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    /// Of the first record: one sample, or one of each interleaved channel.
    pub(super) offset: u64,
    /// Of the sample within a record.
    pub(super) at: usize,
    pub(super) count: u64,
    /// From sample to sample.
    pub(super) stride: u64,
    pub(super) is_big_endian: bool,
}

impl Piece {
    fn continues(&self, next: &Self) -> bool {
        let is_alike = (self.stride, self.at) == (next.stride, next.at) && self.is_big_endian == next.is_big_endian;
        is_alike && self.offset + self.count * self.stride == next.offset
    }
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Chunk {
    pub(super) count: u64,
    pub(super) bytes: u64,
}

impl Object {
    /// The type of its samples, if it has one type.
    fn kind(&self) -> Option<Kind> {
        self.sources.first().map(|source| source.kind)
    }

    /// Takes what its samples are from a segment on. Where samples stand may change, their types may not.
    ///
    /// - `at`: byte of the file, in messages
    pub(super) fn become_of(&mut self, sources: Vec<Source>, at: u64) -> Result<(), Fault> {
        let alike = |(had, has): (&Source, &Source)| (had.scale, had.kind, had.bit) == (has.scale, has.kind, has.bit);
        if self.sources.len() == sources.len() && self.sources.iter().zip(&sources).all(alike) {
            return Ok(());
        }
        if self.rows > 0 {
            return Err(Fault::unsupported(
                format!(
                    "changes the type of the samples of channel '{}' of group '{}' at byte {at}",
                    self.name, self.group
                ),
                "export it as MDF 4 or CSV",
            ));
        }
        self.sources = sources;
        Ok(())
    }
}

/// The lead-in of a segment.
struct LeadIn {
    flags: u32,
    version: u32,
    metadata_end: u64,
    end: u64,
    is_open: bool,
}

impl LeadIn {
    fn read(stream: &mut Stream, start: u64, bytes: u64) -> Result<Self, Fault> {
        let mut lead_in = [0; LEAD_IN_BYTES as usize];
        if bytes - start < LEAD_IN_BYTES {
            return Err(Fault::damaged_at(
                start,
                format!("the {LEAD_IN_BYTES} bytes that begin a segment"),
                bytes - start,
            ));
        }
        stream.seek(SeekFrom::Start(start))?;
        stream.read_exact(&mut lead_in)?;
        if &lead_in[..4] != b"TDSm" {
            let found = format!("'{}'", lead_in[..4].escape_ascii());
            return Err(Fault::damaged_at(start, "a segment, which begins with 'TDSm'", found));
        }
        // The flags say in which order the bytes of everything else stand.
        let flags = u32::from_le_bytes([lead_in[4], lead_in[5], lead_in[6], lead_in[7]]);
        let mut cursor = Cursor::new(&lead_in[8..], start + 8, flags & IS_BIG_ENDIAN != 0);
        let (version, length, metadata) = (cursor.u32()?, cursor.u64()?, cursor.u64()?);
        let is_open = length == TO_THE_END;
        let behind = start + LEAD_IN_BYTES;
        let end = if is_open { bytes } else { behind.saturating_add(length) };
        if end > bytes {
            let expected = format!("a segment of {length} bytes from byte {behind} on");
            return Err(Fault::damaged_at(bytes, expected, "the end of the file"));
        }
        let metadata_end = behind.saturating_add(metadata);
        if metadata_end > end {
            let expected = format!("{metadata} bytes of metadata");
            return Err(Fault::damaged_at(end, expected, "the end of the segment"));
        }
        Ok(Self { flags, version, metadata_end, end, is_open })
    }

    fn has(&self, flag: u32) -> bool {
        self.flags & flag != 0
    }
}

/// Reads the metadata of all segments.
pub(super) fn read(stream: &mut Stream, bytes: u64) -> Result<Objects, Fault> {
    let mut all = Objects { version: 0, is_open: false, objects: Vec::new() };
    let mut listed = Listed::default();
    let mut start = 0;
    while start < bytes {
        let lead_in = LeadIn::read(stream, start, bytes)?;
        (all.version, all.is_open) = (lead_in.version, lead_in.is_open);
        if lead_in.has(HAS_METADATA) {
            let behind = start + LEAD_IN_BYTES;
            let mut metadata = vec![0; usize::try_from(lead_in.metadata_end - behind).unwrap_or(usize::MAX)];
            stream.read_exact(&mut metadata)?;
            let mut cursor = Cursor::new(&metadata, behind, lead_in.has(IS_BIG_ENDIAN));
            if lead_in.has(HAS_NEW_LIST) {
                listed.active.clear();
            }
            read_objects(&mut cursor, &mut all.objects, &mut listed)?;
        }
        if lead_in.has(HAS_SAMPLES) {
            place_samples(&lead_in, &mut all.objects, &listed.active)?;
        }
        start = lead_in.end;
    }
    for object in &mut all.objects {
        let group = format!("/'{}'", object.group.replace('\'', "''"));
        let shared = [group.as_str(), "/"].into_iter().filter_map(|path| listed.shared.get(path));
        for (name, property) in shared.flatten().filter(|(name, _)| scale::is_of_scale(name)) {
            object.properties.entry(name.clone()).or_insert_with(|| property.clone());
        }
    }
    Ok(all)
}

/// What is known of the objects while segments are read.
#[derive(Debug, Default)]
struct Listed {
    /// Channels by path.
    indices: HashMap<String, usize>,
    /// Indices of the channels that have samples in the segment at hand, in their order.
    active: Vec<usize>,
    /// Properties of groups and of the file, by path: scales may be there.
    shared: HashMap<String, Properties>,
}

fn read_objects(cursor: &mut Cursor<'_>, objects: &mut Vec<Object>, listed: &mut Listed) -> Result<(), Fault> {
    let count = cursor.u32()?;
    for _ in 0..count {
        let path = cursor.text()?;
        let Some((group, name)) = channel_of(&path) else {
            // The file or a group.
            read_index(cursor, &mut Object::default())?;
            read_properties(cursor, listed.shared.entry(path).or_default())?;
            continue;
        };
        let index = *listed.indices.entry(path.clone()).or_insert_with(|| {
            objects.push(Object { group, name, ..Object::default() });
            objects.len() - 1
        });
        let object = &mut objects[index];
        let has_samples = read_index(cursor, object)?;
        listed.active.retain(|other| *other != index || has_samples);
        if has_samples && !listed.active.contains(&index) {
            listed.active.push(index);
        }
        read_properties(cursor, &mut object.properties)?;
    }
    Ok(())
}

/// Group and name of a channel: `/'group'/'channel'`, quotation marks doubled.
fn channel_of(path: &str) -> Option<(String, String)> {
    let inner = path.strip_prefix("/'")?.strip_suffix('\'')?;
    let (group, channel) = inner.split_once("'/'")?;
    Some((group.replace("''", "'"), channel.replace("''", "'")))
}

/// What an object has in each chunk; whether it has anything.
fn read_index(cursor: &mut Cursor<'_>, object: &mut Object) -> Result<bool, Fault> {
    let at = cursor.position();
    let length = cursor.u32()?;
    match length {
        NO_SAMPLES => Ok(false),
        AS_BEFORE => match object.chunk {
            Some(_) => Ok(true),
            None => Err(Fault::damaged_at(at, "how many samples a channel has", "a reference to none before")),
        },
        _ if daqmx::is_mark(length) => {
            daqmx::read_index(cursor, object, length)?;
            Ok(true)
        }
        _ => {
            let code = cursor.u32()?;
            let Some(kind) = Kind::of(code) else {
                return Err(Fault::damaged_at(at + 4, "the type of samples", format!("number {code}")));
            };
            let _dimension = cursor.u32()?;
            let count = cursor.u64()?;
            let bytes = if kind == Kind::Text { cursor.u64()? } else { count.saturating_mul(kind.bytes()) };
            object.become_of(vec![Source { scale: scale::COUNTS, kind, bit: None, pieces: Vec::new() }], at)?;
            (object.chunk, object.layout) = (Some(Chunk { count, bytes }), None);
            Ok(true)
        }
    }
}

fn read_properties(cursor: &mut Cursor<'_>, properties: &mut Properties) -> Result<(), Fault> {
    for _ in 0..cursor.u32()? {
        let name = cursor.text()?;
        properties.insert(name, Property::read(cursor)?);
    }
    Ok(())
}

/// Where the samples of a segment lie: chunk after chunk, in each channel after channel or sample
/// by sample.
fn place_samples(lead_in: &LeadIn, objects: &mut [Object], active: &[usize]) -> Result<(), Fault> {
    let available = lead_in.end - lead_in.metadata_end;
    let is_big_endian = lead_in.has(IS_BIG_ENDIAN);
    // Some files lack the flag for DAQmx: what the channels say counts.
    if active.iter().any(|&index| objects[index].layout.is_some()) {
        return daqmx::place(objects, active, (lead_in.metadata_end, available), is_big_endian, lead_in.is_open);
    }
    let chunks: Vec<(usize, Chunk)> = active.iter().filter_map(|&index| Some((index, objects[index].chunk?))).collect();
    let chunk_bytes = chunks.iter().fold(0_u64, |sum, (_, chunk)| sum.saturating_add(chunk.bytes));
    if chunk_bytes == 0 {
        return Ok(());
    }
    if !lead_in.is_open && !available.is_multiple_of(chunk_bytes) {
        let expected = format!("whole chunks of {chunk_bytes} bytes");
        return Err(Fault::damaged_at(lead_in.metadata_end, expected, format!("{available} bytes")));
    }
    let stride = chunks.iter().filter_map(|(index, _)| objects[*index].kind()).map(Kind::bytes).sum::<u64>();
    let is_interleaved = lead_in.has(IS_INTERLEAVED);
    if is_interleaved && chunks.iter().any(|(_, chunk)| chunk.count != chunks[0].1.count) {
        return Err(Fault::damaged_at(lead_in.metadata_end, "as many interleaved samples of each channel", "others"));
    }
    for chunk in 0..available / chunk_bytes {
        let mut offset = lead_in.metadata_end + chunk * chunk_bytes;
        let mut at = 0;
        for &(index, Chunk { count, bytes }) in &chunks {
            let object = &mut objects[index];
            let size = object.kind().map_or(0, Kind::bytes);
            let piece = if is_interleaved {
                Piece { offset, at, count, stride, is_big_endian }
            } else {
                Piece { offset, at: 0, count, stride: size, is_big_endian }
            };
            object.rows += count;
            if size > 0 && count > 0 {
                object.sources.iter_mut().for_each(|source| source.add(piece));
            }
            at += size as usize;
            offset += if is_interleaved { 0 } else { bytes };
        }
    }
    Ok(())
}
