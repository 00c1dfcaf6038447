//! The segments of a file: which channels there are, and where their samples lie.

use std::collections::HashMap;
use std::io::{Read, Seek, SeekFrom};

use super::Properties;
use super::parse::Cursor;
use super::value::{Kind, Property};
use crate::fault::Fault;
use crate::input::Stream;

const LEAD_IN_BYTES: u64 = 28;
const HAS_METADATA: u32 = 1 << 1;
const HAS_NEW_LIST: u32 = 1 << 2;
const HAS_SAMPLES: u32 = 1 << 3;
const IS_INTERLEAVED: u32 = 1 << 5;
const IS_BIG_ENDIAN: u32 = 1 << 6;
const HAS_DAQMX: u32 = 1 << 7;
/// Of a segment that was never closed.
const TO_THE_END: u64 = u64::MAX;
const NO_SAMPLES: u32 = u32::MAX;
const AS_BEFORE: u32 = 0;
/// The property that counts scales.
const SCALES: &str = "NI_Number_Of_Scales";
/// Kinds of raw data of DAQmx, in which samples are counts that are to be scaled.
const DAQMX_SCALER: u32 = 0x1269;
const DAQMX_LINE_SCALERS: [u32; 2] = [0x126a, 0x1369];

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
    /// `None` if it never had samples.
    pub(super) kind: Option<Kind>,
    pub(super) rows: u64,
    pub(super) pieces: Vec<Piece>,
    is_daqmx: bool,
    /// What it has in each chunk of the segment at hand.
    chunk: Option<Chunk>,
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
struct Chunk {
    count: u64,
    bytes: u64,
}

impl Object {
    /// Adds samples, to the last run of them if they follow it.
    fn add(&mut self, piece: Piece) {
        match self.pieces.last_mut() {
            Some(last) if last.continues(&piece) => last.count += piece.count,
            _ => self.pieces.push(piece),
        }
    }

    /// Whether its samples are counts that a chain of scales in the properties is to be applied to.
    pub(super) fn is_unscaled(&self) -> bool {
        let status = self.properties.get("NI_Scaling_Status").and_then(Property::text);
        let scales = self.properties.get(SCALES).and_then(Property::number).unwrap_or(0.0);
        self.is_daqmx || status == Some("unscaled") || (status != Some("scaled") && scales > 0.0)
    }

    /// The types of its scales, in messages.
    pub(super) fn scales(&self) -> String {
        let of_type = self.properties.iter().filter(|(name, _)| name.ends_with("_Scale_Type"));
        let types: Vec<&str> = of_type.filter_map(|(_, property)| property.text()).collect();
        if types.is_empty() { String::new() } else { format!(" ({})", types.join(", ")) }
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
        for (name, property) in shared.flatten().filter(|(name, _)| name.starts_with("NI_Scal") || *name == SCALES) {
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
        let at = cursor.position();
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
        let (before, had_daqmx) = (object.kind, object.is_daqmx);
        let has_samples = read_index(cursor, object)?;
        if before.is_some_and(|kind| object.kind != Some(kind)) && object.rows > 0 && !had_daqmx {
            return Err(Fault::unsupported(
                format!("changes the type of the samples of channel '{path}' at byte {at}"),
                "export it as MDF 4 or CSV",
            ));
        }
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
        _ if length == DAQMX_SCALER || DAQMX_LINE_SCALERS.contains(&length) => {
            read_daqmx(cursor, object, length)?;
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
            object.kind = Some(kind);
            object.chunk = Some(Chunk { count, bytes });
            Ok(true)
        }
    }
}

/// Raw data of DAQmx: read over, since they are not used.
fn read_daqmx(cursor: &mut Cursor<'_>, object: &mut Object, kind: u32) -> Result<(), Fault> {
    let scaler_bytes = if kind == DAQMX_SCALER { 20 } else { 17 };
    cursor.take(8)?;
    let count = cursor.u64()?;
    let scalers = cursor.u32()?;
    cursor.take(u64::from(scalers) * scaler_bytes)?;
    let widths = cursor.u32()?;
    cursor.take(u64::from(widths) * 4)?;
    object.is_daqmx = true;
    object.chunk = Some(Chunk { count, bytes: 0 });
    Ok(())
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
    let chunks: Vec<(usize, Chunk)> = active.iter().filter_map(|&index| Some((index, objects[index].chunk?))).collect();
    if lead_in.has(HAS_DAQMX) || chunks.iter().any(|(index, _)| objects[*index].is_daqmx) {
        for (index, chunk) in chunks {
            objects[index].is_daqmx = true;
            objects[index].rows = objects[index].rows.saturating_add(chunk.count);
        }
        return Ok(());
    }
    let chunk_bytes = chunks.iter().fold(0_u64, |sum, (_, chunk)| sum.saturating_add(chunk.bytes));
    if chunk_bytes == 0 {
        return Ok(());
    }
    if !lead_in.is_open && !available.is_multiple_of(chunk_bytes) {
        let expected = format!("whole chunks of {chunk_bytes} bytes");
        return Err(Fault::damaged_at(lead_in.metadata_end, expected, format!("{available} bytes")));
    }
    let stride = chunks.iter().filter_map(|(index, _)| objects[*index].kind).map(Kind::bytes).sum::<u64>();
    let is_interleaved = lead_in.has(IS_INTERLEAVED);
    if is_interleaved && chunks.iter().any(|(_, chunk)| chunk.count != chunks[0].1.count) {
        return Err(Fault::damaged_at(lead_in.metadata_end, "as many interleaved samples of each channel", "others"));
    }
    for chunk in 0..available / chunk_bytes {
        let mut offset = lead_in.metadata_end + chunk * chunk_bytes;
        let mut at = 0;
        for &(index, Chunk { count, bytes }) in &chunks {
            let object = &mut objects[index];
            let size = object.kind.map_or(0, Kind::bytes);
            let is_big_endian = lead_in.has(IS_BIG_ENDIAN);
            let piece = if is_interleaved {
                Piece { offset, at, count, stride, is_big_endian }
            } else {
                Piece { offset, at: 0, count, stride: size, is_big_endian }
            };
            object.rows += count;
            if size > 0 && count > 0 {
                object.add(piece);
            }
            at += size as usize;
            offset += if is_interleaved { 0 } else { bytes };
        }
    }
    Ok(())
}
