//! Samples as bytes: fixed-size records in a row, each with fields of numbers or instants.

use std::io::Read;

use crate::fault::Fault;
use crate::series::Values;

/// Bytes that are read at a time.
const BUFFER_BYTES: usize = 1 << 20;

/// A number as it is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Number {
    /// Of that many bytes, 8 at most.
    Int(usize),
    /// Of that many bytes, 8 at most.
    Unsigned(usize),
    Single,
    Double,
}

impl Number {
    pub(crate) fn bytes(self) -> usize {
        match self {
            Self::Int(bytes) | Self::Unsigned(bytes) => bytes,
            Self::Single => 4,
            Self::Double => 8,
        }
    }

    /// The number as a double, or the nearest one.
    ///
    /// - `stored`: as many bytes as [`Number::bytes`]
    pub(crate) fn value(self, stored: &[u8], is_big_endian: bool) -> f64 {
        let raw = self.raw(stored, is_big_endian);
        match self {
            Self::Int(_) => self.signed(raw) as f64,
            Self::Unsigned(_) => raw as f64,
            Self::Single => f64::from(f32::from_bits(raw as u32)),
            Self::Double => f64::from_bits(raw),
        }
    }

    /// What becomes of a number that is stored and read: single precision rounds it.
    pub(crate) fn stored(self, number: f64) -> f64 {
        if self == Self::Single { f64::from(number as f32) } else { number }
    }

    /// Numbers that follow each other, as doubles.
    pub(crate) fn values(self, stored: &[u8], is_big_endian: bool) -> impl Iterator<Item = f64> {
        stored.chunks_exact(self.bytes()).map(move |stored| self.value(stored, is_big_endian))
    }

    /// A whole number.
    pub(crate) fn whole(self, stored: &[u8], is_big_endian: bool) -> i64 {
        self.signed(self.raw(stored, is_big_endian))
    }

    fn raw(self, stored: &[u8], is_big_endian: bool) -> u64 {
        let mut bytes = [0; 8];
        let length = self.bytes().min(stored.len());
        bytes[..length].copy_from_slice(&stored[..length]);
        if is_big_endian {
            bytes[..length].reverse();
        }
        u64::from_le_bytes(bytes)
    }

    fn signed(self, raw: u64) -> i64 {
        let unused = 64 - 8 * self.bytes() as u32;
        (raw << unused).cast_signed() >> unused
    }
}

/// What a field of a record is.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Meaning {
    Number(Number),
    /// An instant, and what makes nanoseconds since 1970-01-01 of its bytes.
    Instant(fn(&[u8], bool) -> Option<i64>),
    /// A whole number of that many nanoseconds since 1970-01-01; the lowest of all stands for a missing one.
    Ticks(i64),
}

/// A field of a record.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Field {
    /// Of its first byte within the record.
    pub(crate) offset: usize,
    pub(crate) bytes: usize,
    pub(crate) meaning: Meaning,
    pub(crate) is_big_endian: bool,
}

impl Field {
    /// Where its values go.
    pub(crate) fn empty(&self) -> Values {
        match self.meaning {
            Meaning::Number(_) => Values::Numbers(Vec::new()),
            Meaning::Instant(_) | Meaning::Ticks(_) => Values::Instants(Vec::new()),
        }
    }

    fn push(&self, record: &[u8], into: &mut Values) {
        let Some(stored) = record.get(self.offset..self.offset + self.bytes) else { return };
        match (self.meaning, into) {
            (Meaning::Number(number), Values::Numbers(values)) => values.push(number.value(stored, self.is_big_endian)),
            (Meaning::Instant(instant_ns), Values::Instants(values)) => {
                values.push(instant_ns(stored, self.is_big_endian));
            }
            (Meaning::Ticks(tick_ns), Values::Instants(values)) => {
                let ticks = Number::Int(8).whole(stored, self.is_big_endian);
                values
                    .push(Some(ticks).filter(|ticks| *ticks != i64::MIN).and_then(|ticks| ticks.checked_mul(tick_ns)));
            }
            _ => {}
        }
    }
}

/// Reads records and adds their fields to the columns of these. No more is allocated than is read:
/// how many records there are may be a damaged number.
///
/// - `record_bytes`: with what no field covers
pub(crate) fn read(
    reader: &mut impl Read,
    records: u64,
    record_bytes: usize,
    fields: &[Field],
    columns: &mut [Values],
) -> Result<(), Fault> {
    if record_bytes == 0 {
        return Ok(());
    }
    let per_part = (BUFFER_BYTES / record_bytes).max(1) as u64;
    let mut buffer = Vec::new();
    let mut left = records;
    while left > 0 {
        let now = left.min(per_part);
        buffer.resize(now as usize * record_bytes, 0);
        reader.read_exact(&mut buffer)?;
        for record in buffer.chunks_exact(record_bytes) {
            fields.iter().zip(&mut *columns).for_each(|(field, column)| field.push(record, column));
        }
        left -= now;
    }
    Ok(())
}
