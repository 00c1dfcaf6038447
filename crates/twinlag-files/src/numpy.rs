//! NumPy: one array (npy) or several by name (npz).
//!
//! Fields of a structured array are channels by name; a matrix has a channel for each column. Times
//! are what `datetime64` has.

use std::borrow::Cow;
use std::io::{Read, Seek, SeekFrom};

use npyz::{DType, Endianness, NpyHeader, Order, TimeUnits, TypeChar, TypeStr};
use zip::ZipArchive;

use crate::contents::Group;
use crate::fault::Fault;
use crate::format::Format;
use crate::input::{Input, Stream};
use crate::records::{self, Field, Meaning, Number};
use crate::series::{Loaded, Opened, Series, Values};
use crate::variables::{Arranged, Variable, arrange, period_s};

/// What a file begins with: its mark, and the version of its header, whose length comes next.
const MAGIC_BYTES: usize = 8;
const MAJOR_VERSION_AT: usize = 6;
/// Limits of a header. NumPy reads no more than 10 000 bytes unless asked to: six times that. Each record within a record takes two
/// brackets.
const MAX_HEADER_BYTES: usize = 1 << 16;
const MAX_BRACKET_DEPTH: usize = 12;

struct Numpy {
    archive: Archive,
    arrays: Vec<Array>,
    variables: Vec<Variable>,
    arranged: Arranged,
}

enum Archive {
    Npy(Stream),
    Npz(Box<ZipArchive<Stream>>),
}

/// An array, or a field of each of its records.
struct Array {
    /// The entry of the archive.
    entry: usize,
    field: Option<Field>,
}

pub(crate) fn open(input: Input, format: Format) -> Result<Box<dyn Opened>, Fault> {
    let bytes = input.bytes()?;
    let stream = input.stream()?;
    let mut archive = if format == Format::Npz {
        Archive::Npz(Box::new(ZipArchive::new(stream).map_err(|error| Fault::damaged("an archive", error))?))
    } else {
        Archive::Npy(stream)
    };
    let (mut arrays, mut variables) = (Vec::new(), Vec::new());
    for (entry, name) in archive.names().into_iter().enumerate() {
        let Some(name) = name.strip_suffix(".npy") else { continue };
        let header = archive.with(entry, |reader, length| {
            let header = header(reader)?;
            check_length(&header, reader, length.unwrap_or(bytes))?;
            Ok(header)
        })?;
        for (field_name, unit, field, obstacle) in fields(&header.dtype()) {
            let name = [name, &field_name].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>();
            variables.push(Variable { name: name.join("."), unit, shape: shape(&header), obstacle });
            arrays.push(Array { entry, field });
        }
    }
    let mut scalars = Vec::new();
    for (array, variable) in arrays.iter().zip(&variables).filter(|(_, variable)| variable.is_scalar()) {
        if let Values::Numbers(values) = values(&mut archive, array)? {
            scalars.extend(values.first().map(|value| (variable.name.as_str(), *value)));
        }
    }
    let arranged = arrange(&variables, "", period_s(scalars));
    Ok(Box::new(Numpy { archive, arrays, variables, arranged }))
}

impl Archive {
    fn names(&self) -> Vec<String> {
        match self {
            Self::Npy(_) => vec![".npy".to_owned()],
            Self::Npz(zip) => {
                let name = |at| zip.name_for_index(at)?.ok();
                (0..zip.len()).map(|at| name(at).map_or_else(String::new, Cow::into_owned)).collect()
            }
        }
    }

    /// Reads an entry from its beginning.
    fn with<T>(
        &mut self,
        entry: usize,
        work: impl FnOnce(&mut Counted<&mut dyn Read>, Option<u64>) -> Result<T, Fault>,
    ) -> Result<T, Fault> {
        match self {
            Self::Npy(stream) => {
                stream.seek(SeekFrom::Start(0))?;
                work(&mut Counted { inner: stream, read: 0 }, None)
            }
            Self::Npz(zip) => {
                let mut file = zip.by_index(entry).map_err(|error| Fault::damaged("an entry of the archive", error))?;
                let length = file.size();
                work(&mut Counted { inner: &mut file, read: 0 }, Some(length))
            }
        }
    }
}

/// Counts what is read.
struct Counted<R> {
    inner: R,
    read: u64,
}

impl<R: Read> Read for Counted<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let count = self.inner.read(buffer)?;
        self.read += count as u64;
        Ok(count)
    }
}

/// Reads the header. The library takes twice as long for each bracket within brackets.
fn header(reader: &mut impl Read) -> Result<NpyHeader, Fault> {
    let damaged = |error| Fault::damaged_at(0, "the header of an array", error);
    let mut head = Vec::new();
    let mut read = |bytes: usize| -> Result<Vec<u8>, Fault> {
        let start = head.len();
        reader.take(bytes as u64).read_to_end(&mut head)?;
        Ok(head[start..].to_vec())
    };
    let length_bytes = if read(MAGIC_BYTES)?.get(MAJOR_VERSION_AT) == Some(&1) { 2 } else { 4 };
    let length = read(length_bytes)?.iter().rev().fold(0, |sum, byte| (sum << 8) | usize::from(*byte));
    if length > MAX_HEADER_BYTES {
        return Err(damaged(format!("one of {length} bytes, {MAX_HEADER_BYTES} at most")));
    }
    let depth = bracket_depth(&read(length)?);
    if depth > MAX_BRACKET_DEPTH {
        return Err(damaged(format!("brackets {depth} deep, {MAX_BRACKET_DEPTH} at most")));
    }
    NpyHeader::from_reader(&head[..]).map_err(|error| damaged(error.to_string()))
}

/// How many brackets are open at once, at most; those in names do not count.
fn bracket_depth(text: &[u8]) -> usize {
    let (mut quote, mut open, mut deepest) = (None, 0_usize, 0);
    let mut bytes = text.iter();
    while let Some(&byte) = bytes.next() {
        match (quote, byte) {
            (Some(_), b'\\') => {
                bytes.next();
            }
            (Some(begun), _) => quote = Some(begun).filter(|begun| *begun != byte),
            (None, b'\'' | b'"') => quote = Some(byte),
            (None, b'(' | b'[' | b'{') => open += 1,
            (None, b')' | b']' | b'}') => open = open.saturating_sub(1),
            _ => {}
        }
        deepest = deepest.max(open);
    }
    deepest
}

/// An array is as long as its header says, to the byte.
fn check_length(header: &NpyHeader, reader: &Counted<&mut dyn Read>, length: u64) -> Result<(), Fault> {
    let Some(item) = header.dtype().num_bytes() else { return Ok(()) };
    let sides = header.shape().iter().try_fold(1_u64, |product, side| product.checked_mul(*side));
    let wanted = sides.and_then(|items| items.checked_mul(item as u64)).and_then(|data| data.checked_add(reader.read));
    if wanted == Some(length) {
        return Ok(());
    }
    let expected =
        format!("{} values of {item} bytes behind the header", sides.map_or("no".to_owned(), |n| n.to_string()));
    Err(Fault::damaged_at(length.min(wanted.unwrap_or(length)), expected, format!("{} bytes", length - reader.read)))
}

/// Sides, the one that runs fastest last.
fn shape(header: &NpyHeader) -> Vec<u64> {
    match header.order() {
        Order::C => header.shape().to_vec(),
        Order::Fortran => header.shape().iter().rev().copied().collect(),
    }
}

/// Name, unit and place in the record of each field, or why it is not read.
fn fields(dtype: &DType) -> Vec<(String, String, Option<Field>, Option<String>)> {
    let of = |name: &str, dtype: &DType, offset: usize| {
        let plain = if let DType::Plain(plain) = dtype { meaning(plain) } else { None };
        let field = plain.map(|(meaning, bytes, is_big_endian, _)| Field { offset, bytes, meaning, is_big_endian });
        let unit = plain.map_or("", |(.., unit)| unit);
        let obstacle = field.is_none().then(|| format!("its values are of the type {}", dtype.descr()));
        (name.to_owned(), unit.to_owned(), field, obstacle)
    };
    let DType::Record(fields) = dtype else { return vec![of("", dtype, 0)] };
    let mut offset = 0;
    let described = fields.iter().map(|field| {
        let described = of(&field.name, &field.dtype, offset);
        offset += field.dtype.num_bytes().unwrap_or(0);
        described
    });
    // Gaps for alignment are fields without a name.
    described.filter(|(name, _, field, _)| !name.is_empty() || field.is_some()).collect()
}

/// What bytes of a type mean, how many there are, whether the first one weighs most, and the unit
/// of a span of time.
fn meaning(plain: &TypeStr) -> Option<(Meaning, usize, bool, &'static str)> {
    let bytes = plain.num_bytes()?;
    let (meaning, unit) = match plain.type_char() {
        TypeChar::Bool => (Meaning::Number(Number::Unsigned(1)), ""),
        TypeChar::Int if bytes <= 8 => (Meaning::Number(Number::Int(bytes)), ""),
        TypeChar::Uint if bytes <= 8 => (Meaning::Number(Number::Unsigned(bytes)), ""),
        TypeChar::Float if bytes == 4 => (Meaning::Number(Number::Single), ""),
        TypeChar::Float if bytes == 8 => (Meaning::Number(Number::Double), ""),
        TypeChar::TimeDelta => (Meaning::Number(Number::Int(8)), tick(plain.time_units()?)?.1),
        TypeChar::DateTime => (Meaning::Ticks(tick(plain.time_units()?)?.0), ""),
        _ => return None,
    };
    Some((meaning, bytes, plain.endianness() == Endianness::Big, unit))
}

/// A unit of time in nanoseconds, and its name.
fn tick(units: TimeUnits) -> Option<(i64, &'static str)> {
    const SECOND: i64 = 1_000_000_000;
    match units {
        TimeUnits::Day => Some((86_400 * SECOND, "d")),
        TimeUnits::Hour => Some((3600 * SECOND, "h")),
        TimeUnits::Minute => Some((60 * SECOND, "min")),
        TimeUnits::Second => Some((SECOND, "s")),
        TimeUnits::Millisecond => Some((1_000_000, "ms")),
        TimeUnits::Microsecond => Some((1000, "us")),
        TimeUnits::Nanosecond => Some((1, "ns")),
        _ => None,
    }
}

fn values(archive: &mut Archive, array: &Array) -> Result<Values, Fault> {
    let Some(field) = array.field else { return Ok(Values::Numbers(Vec::new())) };
    let mut columns = [field.empty()];
    archive.with(array.entry, |reader, _| {
        let header = header(reader)?;
        records::read(reader, header.len(), header.dtype().num_bytes().unwrap_or(0), &[field], &mut columns)
    })?;
    let [values] = columns;
    Ok(values)
}

impl Opened for Numpy {
    fn groups(&self) -> &[Group] {
        &self.arranged.groups
    }

    fn load(&mut self, group: usize) -> Result<Loaded, Fault> {
        let mut loaded = Loaded::default();
        let members = self.arranged.members[group].iter();
        for &index in members.filter(|index| self.variables[**index].obstacle.is_none()) {
            let variable = &self.variables[index];
            match values(&mut self.archive, &self.arrays[index])? {
                Values::Numbers(values) => loaded.series.extend(variable.series(values)),
                other => loaded.series.push(Series { name: variable.name.clone(), unit: String::new(), values: other }),
            }
        }
        loaded.add_clock(0.0, self.arranged.groups[group].period_s);
        Ok(loaded)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Brackets in names do not count, and a quote after a backslash does not end a name.
    #[test]
    fn brackets_count_outside_of_names() {
        assert_eq!(bracket_depth(b"{'descr': [('a', '<f8', (2,))], 'shape': (3,)}"), 4);
        assert_eq!(bracket_depth(b"['[[[', \"((\"]"), 1);
        assert_eq!(bracket_depth(b"['\\'[[', []]"), 2);
        assert_eq!(bracket_depth(b"['\\'', [[]]]"), 3);
    }
}
