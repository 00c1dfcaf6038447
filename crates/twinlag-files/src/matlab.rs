//! MATLAB 5 to 7: numeric arrays by name. Structures, cells and texts are not read; a table in
//! one of them is to be saved as vectors.

use std::io::Read;

use flate2::read::ZlibDecoder;
use matfile::{Array, MatFile, NumericData};

use crate::contents::Group;
use crate::fault::Fault;
use crate::format::Format;
use crate::input::{Input, Stream};
use crate::series::{Loaded, Opened};
use crate::variables::{Arranged, Variable, arrange, period_s};

/// Header of a file.
const HEADER_BYTES: u64 = 128;
const TAG_BYTES: u64 = 8;
/// Types of elements; compressed ones are not padded.
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
/// An element with its tag and the flags of the array, in which the class stands.
const SHORTEST_BYTES: usize = 24;
const CLASS_AT: usize = 16;
/// Classes of arrays: double, single and whole numbers of 8 to 64 bits.
const NUMERIC_CLASSES: std::ops::RangeInclusive<u8> = 6..=15;
const DOUBLE: u8 = 6;
const INT32: u8 = 12;
/// Bytes that zlib makes of one, at most: <https://zlib.net/zlib_tech.html>.
const MAX_EXPANSION: u64 = 1032;

struct Matlab {
    arrays: Vec<Array>,
    variables: Vec<Variable>,
    arranged: Arranged,
    /// Elements of which the library made no array.
    others: usize,
}

pub(crate) fn open(input: Input, _: Format) -> Result<Box<dyn Opened>, Fault> {
    let bytes = input.bytes()?;
    let (arrays, others) = read(&mut input.stream()?, bytes)?;
    let variables: Vec<Variable> = arrays.iter().map(describe).collect();
    let scalars = arrays.iter().zip(&variables).filter(|(_, variable)| variable.is_scalar());
    let scalars = scalars.filter_map(|(array, _)| Some((array.name(), *values(array.data()).first()?)));
    let arranged = arrange(&variables, "", period_s(scalars));
    Ok(Box::new(Matlab { arrays, variables, arranged, others }))
}

/// Reads element by element: of a whole file, the library leaves out what follows one that is
/// damaged or cut off, and says nothing. Gives the numeric arrays, and how many elements are something else.
fn read(stream: &mut Stream, bytes: u64) -> Result<(Vec<Array>, usize), Fault> {
    let mut header = [0; HEADER_BYTES as usize];
    stream.read_exact(&mut header)?;
    let is_big_endian = header.ends_with(b"MI");
    let (mut arrays, mut others) = (Vec::new(), 0);
    let mut at = HEADER_BYTES;
    while at < bytes {
        if bytes - at < TAG_BYTES {
            return Err(Fault::damaged_at(at, format!("the {TAG_BYTES} bytes that begin an array"), bytes - at));
        }
        let mut element = vec![0; TAG_BYTES as usize];
        stream.read_exact(&mut element)?;
        let number = |four: &[u8]| {
            let four = [four[0], four[1], four[2], four[3]];
            if is_big_endian { u32::from_be_bytes(four) } else { u32::from_le_bytes(four) }
        };
        let kind = number(&element);
        let length = u64::from(number(&element[4..]));
        let padded = if kind == COMPRESSED { length } else { length.next_multiple_of(8) };
        let start = at + TAG_BYTES;
        if padded > bytes - start {
            let expected = format!("an array of {padded} bytes from byte {start} on");
            return Err(Fault::damaged_at(bytes, expected, "the end of the file"));
        }
        stream.by_ref().take(padded).read_to_end(&mut element)?;
        if kind == COMPRESSED {
            element = inflated(&element[TAG_BYTES as usize..])
                .map_err(|error| Fault::damaged_at(start, "a compressed array", error))?;
        }
        if element.len() < SHORTEST_BYTES || number(&element) != MATRIX {
            return Err(Fault::damaged_at(at, "an array", "something else"));
        }
        let class = &mut element[if is_big_endian { CLASS_AT + 3 } else { CLASS_AT }];
        if NUMERIC_CLASSES.contains(class) {
            if *class == INT32 {
                // The library takes arrays of this class for another; as doubles they are the same numbers.
                *class = DOUBLE;
            }
            let file = MatFile::parse(header.chain(&element[..]));
            let found = file.map_or_else(|error| Err(error.to_string()), |file| Ok(file.arrays().clone()));
            let found = found.and_then(|found| if found.is_empty() { Err("none".to_owned()) } else { Ok(found) });
            arrays.extend(found.map_err(|found| Fault::damaged_at(at, "an array of numbers", found))?);
        } else {
            others += 1;
        }
        at = start + padded;
    }
    Ok((arrays, others))
}

/// What was compressed. More than zlib can make of it is not taken.
fn inflated(compressed: &[u8]) -> std::io::Result<Vec<u8>> {
    let mut out = Vec::new();
    let most = MAX_EXPANSION * compressed.len() as u64;
    ZlibDecoder::new(compressed).take(most).read_to_end(&mut out)?;
    Ok(out)
}

fn describe(array: &Array) -> Variable {
    // The first side runs fastest in MATLAB.
    let shape = array.size().iter().rev().map(|side| *side as u64).collect();
    let obstacle = is_complex(array.data()).then(|| "its values are complex".to_owned());
    Variable { name: array.name().to_owned(), unit: String::new(), shape, obstacle }
}

impl Opened for Matlab {
    fn groups(&self) -> &[Group] {
        &self.arranged.groups
    }

    fn load(&mut self, group: usize) -> Result<Loaded, Fault> {
        let mut loaded = Loaded::default();
        if self.others > 0 {
            let count = self.others;
            loaded.notes.push(format!("{count} variables were left out: they are no numeric arrays"));
        }
        let members = self.arranged.members[group].iter();
        for &index in members.filter(|index| self.variables[**index].obstacle.is_none()) {
            let (variable, array) = (&self.variables[index], &self.arrays[index]);
            loaded.series.extend(variable.series(values(array.data())));
        }
        loaded.add_clock(0.0, self.arranged.groups[group].period_s);
        Ok(loaded)
    }
}

fn is_complex(data: &NumericData) -> bool {
    match data {
        NumericData::Int8 { imag, .. } => imag.is_some(),
        NumericData::UInt8 { imag, .. } => imag.is_some(),
        NumericData::Int16 { imag, .. } => imag.is_some(),
        NumericData::UInt16 { imag, .. } => imag.is_some(),
        NumericData::Int32 { imag, .. } => imag.is_some(),
        NumericData::UInt32 { imag, .. } => imag.is_some(),
        NumericData::Int64 { imag, .. } => imag.is_some(),
        NumericData::UInt64 { imag, .. } => imag.is_some(),
        NumericData::Single { imag, .. } => imag.is_some(),
        NumericData::Double { imag, .. } => imag.is_some(),
    }
}

fn values(data: &NumericData) -> Vec<f64> {
    fn cast<T: Copy + Into<f64>>(values: &[T]) -> Vec<f64> {
        values.iter().map(|&value| value.into()).collect()
    }
    match data {
        NumericData::Int8 { real, .. } => cast(real),
        NumericData::UInt8 { real, .. } => cast(real),
        NumericData::Int16 { real, .. } => cast(real),
        NumericData::UInt16 { real, .. } => cast(real),
        NumericData::Int32 { real, .. } => cast(real),
        NumericData::UInt32 { real, .. } => cast(real),
        NumericData::Int64 { real, .. } => real.iter().map(|&value| value as f64).collect(),
        NumericData::UInt64 { real, .. } => real.iter().map(|&value| value as f64).collect(),
        NumericData::Single { real, .. } => cast(real),
        NumericData::Double { real, .. } => real.clone(),
    }
}
