//! Types of samples and properties.

use super::parse::Cursor;
use crate::fault::Fault;
use crate::records::{Meaning, Number};

/// Seconds from 1904-01-01 to 1970-01-01.
const EPOCHS_APART_S: i64 = 2_082_844_800;

/// What samples or a property are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Number(Number),
    Timestamp,
    Text,
    /// Known by size only: extended floats, complex numbers.
    Other(u64),
}

impl Kind {
    /// The type that a number stands for.
    pub(super) fn of(code: u32) -> Option<Self> {
        Some(match code {
            1..=4 => Self::Number(Number::Int(1 << (code - 1))),
            5..=8 => Self::Number(Number::Unsigned(1 << (code - 5))),
            9 | 0x19 => Self::Number(Number::Single),
            10 | 0x1a => Self::Number(Number::Double),
            11 | 0x1b | 0x10_000d => Self::Other(16),
            0x20 => Self::Text,
            0x21 => Self::Number(Number::Unsigned(1)),
            0x44 => Self::Timestamp,
            0x08_000c => Self::Other(8),
            _ => return None,
        })
    }

    /// Bytes of one sample; 0 if that varies.
    pub(super) fn bytes(self) -> u64 {
        match self {
            Self::Number(number) => number.bytes() as u64,
            Self::Other(bytes) => bytes,
            Self::Timestamp => 16,
            Self::Text => 0,
        }
    }

    /// What is made of its samples, if anything.
    pub(super) fn meaning(self) -> Option<Meaning> {
        match self {
            Self::Number(number) => Some(Meaning::Number(number)),
            Self::Timestamp => Some(Meaning::Instant(instant_ns)),
            Self::Text | Self::Other(_) => None,
        }
    }

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Text => "texts",
            Self::Timestamp => "instants",
            Self::Other(_) => "extended or complex numbers",
            Self::Number(_) => "numbers",
        }
    }
}

/// An instant in nanoseconds since 1970-01-01: 2⁻⁶⁴ s and seconds since 1904-01-01.
pub(super) fn instant_ns(sample: &[u8], is_big_endian: bool) -> Option<i64> {
    let (first, second) = (sample.get(..8)?.try_into().ok()?, sample.get(8..16)?.try_into().ok()?);
    let (fraction, seconds) = if is_big_endian {
        (u64::from_be_bytes(second), i64::from_be_bytes(first))
    } else {
        (u64::from_le_bytes(first), i64::from_le_bytes(second))
    };
    let ns = ((u128::from(fraction) * 1_000_000_000 + (1 << 63)) >> 64) as i64;
    // LabVIEW's time zero stands for none.
    let known = seconds != 0 || fraction != 0;
    seconds.checked_sub(EPOCHS_APART_S)?.checked_mul(1_000_000_000)?.checked_add(ns).filter(|_| known)
}

/// A property of an object, as far as one is needed.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Property {
    Number(f64),
    Text(String),
    Instant(Option<i64>),
    Other,
}

impl Property {
    pub(super) fn read(cursor: &mut Cursor<'_>) -> Result<Self, Fault> {
        let at = cursor.position();
        let code = cursor.u32()?;
        let Some(kind) = Kind::of(code) else {
            return Err(Fault::damaged_at(at, "the type of a property", format!("number {code}")));
        };
        if kind == Kind::Text {
            return Ok(Self::Text(cursor.text()?));
        }
        let is_big_endian = cursor.is_big_endian();
        let bytes = cursor.take(kind.bytes())?;
        Ok(match kind {
            Kind::Timestamp => Self::Instant(instant_ns(bytes, is_big_endian)),
            Kind::Number(number) => Self::Number(number.value(bytes, is_big_endian)),
            Kind::Text | Kind::Other(_) => Self::Other,
        })
    }

    pub(super) fn number(&self) -> Option<f64> {
        if let Self::Number(number) = self { Some(*number) } else { None }
    }

    pub(super) fn text(&self) -> Option<&str> {
        if let Self::Text(text) = self { Some(text) } else { None }
    }

    pub(super) fn instant_ns(&self) -> Option<i64> {
        if let Self::Instant(instant) = self { *instant } else { None }
    }
}
