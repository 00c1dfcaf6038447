//! Raw data as the driver DAQmx writes them while it measures: buffers, one for each card, of rows in
//! which the counts of all channels stand beside each other.

use super::parse::Cursor;
use super::segment::{Chunk, Object, Piece, Source};
use super::value::Kind;
use crate::fault::Fault;
use crate::records::Number;

const SCALER: u32 = 0x1269;
/// Of digital lines: the documents and the files differ in the number.
const LINE_SCALERS: [u32; 2] = [0x126a, 0x1369];
/// The type of a channel whose counts are to be scaled.
const RAW: u32 = u32::MAX;

/// Where the counts of a channel stand.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Layout {
    scalers: Vec<Scaler>,
    /// Bytes of a row in each buffer.
    widths: Vec<u64>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Scaler {
    buffer: usize,
    /// Within a row of the buffer.
    byte: u64,
    bytes: u64,
}

/// Whether the length of a channel's index is the mark of this layout.
pub(super) fn is_mark(length: u32) -> bool {
    length == SCALER || LINE_SCALERS.contains(&length)
}

/// Reads where the counts of a channel stand.
pub(super) fn read_index(cursor: &mut Cursor<'_>, object: &mut Object, mark: u32) -> Result<(), Fault> {
    let is_direct = cursor.u32()? != RAW;
    let _dimension = cursor.u32()?;
    let count = cursor.u64()?;
    let (mut scalers, mut sources) = (Vec::new(), Vec::new());
    for _ in 0..cursor.u32()? {
        let at = cursor.position();
        let code = cursor.u32()?;
        let Some(kind) = kind_of(code) else {
            return Err(Fault::damaged_at(at, "the type of DAQmx's counts", format!("number {code}")));
        };
        let (buffer, place) = (cursor.u32()? as usize, u64::from(cursor.u32()?));
        let is_line = mark != SCALER;
        let _format = cursor.take(if is_line { 1 } else { 4 })?;
        let scale = cursor.u32()?;
        let (byte, bit) = if is_line { (place / 8, Some((place % 8) as u8)) } else { (place, None) };
        scalers.push(Scaler { buffer, byte, bytes: kind.bytes() });
        sources.push(Source {
            scale: if is_direct { super::scale::COUNTS } else { scale },
            kind,
            bit,
            pieces: Vec::new(),
        });
    }
    let mut widths = Vec::new();
    for _ in 0..cursor.u32()? {
        widths.push(u64::from(cursor.u32()?));
    }
    let fits = |scaler: &Scaler| widths.get(scaler.buffer).is_some_and(|width| scaler.byte + scaler.bytes <= *width);
    if !scalers.iter().all(fits) {
        return Err(Fault::damaged_at(cursor.position(), "counts within the rows of DAQmx's buffers", "others"));
    }
    object.become_of(sources, cursor.position())?;
    object.chunk = Some(Chunk { count, bytes: 0 });
    object.layout = Some(Layout { scalers, widths });
    Ok(())
}

fn kind_of(code: u32) -> Option<Kind> {
    Some(match code {
        0..=7 if code.is_multiple_of(2) => Kind::Number(Number::Unsigned(1 << (code / 2))),
        0..=7 => Kind::Number(Number::Int(1 << (code / 2))),
        8 => Kind::Number(Number::Single),
        9 => Kind::Number(Number::Double),
        u32::MAX => Kind::Timestamp,
        _ => return None,
    })
}

/// Where the counts of a segment lie: chunk after chunk, in each buffer after buffer.
///
/// - `start`: of the raw data
/// - `available`: their bytes
/// - `is_open`: whether the segment was never closed, and may end anywhere
pub(super) fn place(
    objects: &mut [Object],
    active: &[usize],
    (start, available): (u64, u64),
    is_big_endian: bool,
    is_open: bool,
) -> Result<(), Fault> {
    let layouts: Vec<(usize, Layout, u64)> = active
        .iter()
        .filter_map(|&index| {
            let object = &objects[index];
            let count = object.chunk?.count;
            Some((index, object.layout.clone()?, count))
        })
        .collect();
    let Some((_, Layout { widths, .. }, _)) = layouts.first().cloned() else { return Ok(()) };
    let others = active.iter().filter(|&&index| objects[index].chunk.is_some()).count() > layouts.len();
    if others || layouts.iter().any(|(_, layout, _)| layout.widths != widths) {
        return Err(Fault::unsupported(
            format!("has raw data of DAQmx beside others in the segment that begins its data at byte {start}"),
            "export it as CSV",
        ));
    }
    let mut rows = vec![0; widths.len()];
    for (_, layout, count) in &layouts {
        layout.scalers.iter().for_each(|scaler| rows[scaler.buffer] = rows[scaler.buffer].max(*count));
    }
    let sizes: Vec<u64> = rows.iter().zip(&widths).map(|(rows, width)| rows.saturating_mul(*width)).collect();
    let chunk_bytes = sizes.iter().fold(0_u64, |sum, bytes| sum.saturating_add(*bytes));
    if chunk_bytes == 0 {
        return Ok(());
    }
    // The last chunk is as short as the measurement made it.
    let (chunks, rest) = (available / chunk_bytes, available % chunk_bytes);
    let last = if let [width] = widths[..] { rest / width } else { 0 };
    if !is_open && last * widths[0] != rest {
        let expected = format!("whole rows of {} bytes, or chunks of {chunk_bytes}", widths[0]);
        return Err(Fault::damaged_at(start + available - rest, expected, format!("{rest} bytes")));
    }
    let parts = (0..chunks).map(|chunk| (chunk, u64::MAX)).chain((last > 0).then_some((chunks, last)));
    for (chunk, most) in parts {
        for (index, layout, count) in &layouts {
            let (object, count) = (&mut objects[*index], (*count).min(most));
            for (scaler, source) in layout.scalers.iter().zip(&mut object.sources) {
                let before: u64 = sizes[..scaler.buffer].iter().sum();
                let offset = start + chunk * chunk_bytes + before;
                let (at, stride) = (scaler.byte as usize, widths[scaler.buffer]);
                source.add(Piece { offset, at, count, stride, is_big_endian });
            }
            object.rows += count;
        }
    }
    Ok(())
}
