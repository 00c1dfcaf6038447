//! Parquet: one table. Columns by name, those within structures with the names of these before
//! them; null is missing; stamps are instants.

use parquet::basic::{ConvertedType, LogicalType, TimeUnit, Type};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{ByteArray, DataType, Int96};
use parquet::errors::ParquetError;
use parquet::file::reader::{ChunkReader, FileReader as _, SerializedFileReader};
use parquet::schema::types::ColumnDescriptor;

use crate::contents::{Channel, Group};
use crate::fault::Fault;
use crate::format::Format;
use crate::input::Input;
use crate::series::{Loaded, Opened, Series, Values};

/// Values that are read at a time.
const BATCH_VALUES: usize = 1 << 16;

struct Parquet<R: ChunkReader + 'static> {
    reader: SerializedFileReader<R>,
    groups: [Group; 1],
    meanings: Vec<Option<Meaning>>,
}

pub(crate) fn open(input: Input, _: Format) -> Result<Box<dyn Opened>, Fault> {
    match input {
        Input::Path(path) => of(std::fs::File::open(path)?),
        Input::Bytes(bytes) => of(bytes::Bytes::from(bytes)),
    }
}

fn of<R: ChunkReader + 'static>(source: R) -> Result<Box<dyn Opened>, Fault> {
    let reader = SerializedFileReader::new(source).map_err(fault)?;
    let metadata = reader.metadata();
    let rows = metadata.file_metadata().num_rows();
    let columns = metadata.file_metadata().schema_descr().columns();
    let meanings: Vec<Option<Meaning>> = columns.iter().map(|column| Meaning::of(column)).collect();
    let channels = columns.iter().zip(&meanings).map(|(column, meaning)| Channel {
        name: column.path().parts().join("."),
        unit: meaning.map_or("", Meaning::unit).to_owned(),
        obstacle: meaning.is_none().then(|| format!("its values are of the type {}", column.physical_type())),
    });
    let Ok(rows) = usize::try_from(rows) else {
        return Err(Fault::damaged("a number of rows", rows));
    };
    let groups = [Group { name: "table".to_owned(), rows, channels: channels.collect(), ..Group::default() }];
    Ok(Box::new(Parquet { reader, groups, meanings }))
}

/// What the values of a column are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Meaning {
    Number,
    /// Spans or times of day, in this unit.
    Time(&'static str),
    /// Instants, in ticks of that many nanoseconds.
    Instant(i64),
    Text,
}

impl Meaning {
    fn of(column: &ColumnDescriptor) -> Option<Self> {
        const DAY_NS: i64 = 86_400_000_000_000;
        if column.max_rep_level() > 0 {
            return None;
        }
        let physical = column.physical_type();
        match (column.logical_type_ref(), column.converted_type()) {
            (Some(LogicalType::Timestamp(stamp)), _) => Some(Self::Instant(tick_ns(stamp.unit))),
            (None, ConvertedType::TIMESTAMP_MILLIS) => Some(Self::Instant(1_000_000)),
            (None, ConvertedType::TIMESTAMP_MICROS) => Some(Self::Instant(1000)),
            (Some(LogicalType::Time(time)), _) => Some(Self::Time(unit(time.unit))),
            (None, ConvertedType::TIME_MILLIS) => Some(Self::Time("ms")),
            (None, ConvertedType::TIME_MICROS) => Some(Self::Time("us")),
            (Some(LogicalType::Date), _) | (None, ConvertedType::DATE) => Some(Self::Instant(DAY_NS)),
            (Some(LogicalType::Decimal(_)), _) | (_, ConvertedType::DECIMAL) => None,
            (Some(LogicalType::String), _) | (_, ConvertedType::UTF8) => Some(Self::Text),
            _ => match physical {
                Type::INT96 => Some(Self::Instant(1)),
                Type::BOOLEAN | Type::INT32 | Type::INT64 | Type::FLOAT | Type::DOUBLE => Some(Self::Number),
                Type::BYTE_ARRAY | Type::FIXED_LEN_BYTE_ARRAY => None,
            },
        }
    }

    fn unit(self) -> &'static str {
        if let Self::Time(unit) = self { unit } else { "" }
    }
}

fn tick_ns(unit: TimeUnit) -> i64 {
    match unit {
        TimeUnit::MILLIS => 1_000_000,
        TimeUnit::MICROS => 1000,
        TimeUnit::NANOS => 1,
    }
}

fn unit(unit: TimeUnit) -> &'static str {
    match unit {
        TimeUnit::MILLIS => "ms",
        TimeUnit::MICROS => "us",
        TimeUnit::NANOS => "ns",
    }
}

impl<R: ChunkReader + 'static> Opened for Parquet<R> {
    fn version(&self) -> String {
        let metadata = self.reader.metadata().file_metadata();
        metadata.created_by().map_or_else(String::new, |by| format!("written by {by}"))
    }

    fn groups(&self) -> &[Group] {
        &self.groups
    }

    fn load(&mut self, _: usize) -> Result<Loaded, Fault> {
        let mut loaded = Loaded::default();
        for (index, meaning) in self.meanings.iter().enumerate() {
            let Some(meaning) = *meaning else { continue };
            let values = self.column(index, meaning)?;
            let Channel { name, unit, .. } = self.groups[0].channels[index].clone();
            let series = Series { name, unit, values };
            if series.len() != self.groups[0].rows {
                let expected = format!("{} values of column '{}'", self.groups[0].rows, series.name);
                return Err(Fault::damaged(expected, series.len()));
            }
            loaded.series.push(series);
        }
        Ok(loaded)
    }
}

impl<R: ChunkReader + 'static> Parquet<R> {
    /// The values of a column from all row groups.
    fn column(&self, index: usize, meaning: Meaning) -> Result<Values, Fault> {
        let descriptor = self.reader.metadata().file_metadata().schema_descr().column(index);
        let is_unsigned = matches!(descriptor.logical_type_ref(), Some(LogicalType::Integer(whole)) if !whole.is_signed)
            || descriptor.converted_type() == ConvertedType::UINT_64
            || descriptor.converted_type() == ConvertedType::UINT_32;
        let level = descriptor.max_def_level();
        let mut out = match meaning {
            Meaning::Instant(_) => Values::Instants(Vec::new()),
            Meaning::Text => Values::Texts(Vec::new()),
            Meaning::Number | Meaning::Time(_) => Values::Numbers(Vec::new()),
        };
        let tick_ns = if let Meaning::Instant(tick_ns) = meaning { tick_ns } else { 1 };
        for group in 0..self.reader.num_row_groups() {
            let of_group = self.reader.get_row_group(group).map_err(fault)?;
            let reader = of_group.get_column_reader(index).map_err(fault)?;
            match (&mut out, reader) {
                (Values::Numbers(out), ColumnReader::BoolColumnReader(reader)) => {
                    take(reader, level, |value| out.push(value.map_or(f64::NAN, |value| f64::from(u8::from(*value)))))
                }
                (Values::Numbers(out), ColumnReader::Int32ColumnReader(reader)) => take(reader, level, |value| {
                    let number =
                        |value: i32| if is_unsigned { f64::from(value.cast_unsigned()) } else { f64::from(value) };
                    out.push(value.map_or(f64::NAN, |value| number(*value)));
                }),
                (Values::Numbers(out), ColumnReader::Int64ColumnReader(reader)) => take(reader, level, |value| {
                    let number = |value: i64| if is_unsigned { value.cast_unsigned() as f64 } else { value as f64 };
                    out.push(value.map_or(f64::NAN, |value| number(*value)));
                }),
                (Values::Numbers(out), ColumnReader::FloatColumnReader(reader)) => {
                    take(reader, level, |value| out.push(value.map_or(f64::NAN, |value| f64::from(*value))))
                }
                (Values::Numbers(out), ColumnReader::DoubleColumnReader(reader)) => {
                    take(reader, level, |value| out.push(value.map_or(f64::NAN, |value| *value)))
                }
                (Values::Instants(out), ColumnReader::Int64ColumnReader(reader)) => {
                    take(reader, level, |value| out.push(value.and_then(|value| value.checked_mul(tick_ns))))
                }
                (Values::Instants(out), ColumnReader::Int32ColumnReader(reader)) => take(reader, level, |value| {
                    out.push(value.and_then(|value| i64::from(*value).checked_mul(tick_ns)));
                }),
                (Values::Instants(out), ColumnReader::Int96ColumnReader(reader)) => {
                    take(reader, level, |value| out.push(value.map(Int96::to_nanos)))
                }
                (Values::Texts(out), ColumnReader::ByteArrayColumnReader(reader)) => {
                    let text = |value: &ByteArray| String::from_utf8_lossy(value.data()).into_owned();
                    take(reader, level, |value| out.push(value.map_or_else(String::new, text)))
                }
                _ => Err(Fault::damaged("values of the type that the schema states", "another")),
            }?;
        }
        Ok(out)
    }
}

/// Gives the values of a column in a row group one by one, `None` where one is null.
fn take<T: DataType>(
    mut reader: ColumnReaderImpl<T>,
    level: i16,
    mut push: impl FnMut(Option<&T::T>),
) -> Result<(), Fault> {
    let (mut values, mut levels) = (Vec::new(), Vec::new());
    loop {
        values.clear();
        levels.clear();
        let (records, _, _) = reader.read_records(BATCH_VALUES, Some(&mut levels), None, &mut values).map_err(fault)?;
        if records == 0 {
            return Ok(());
        }
        if level == 0 {
            values.iter().for_each(|value| push(Some(value)));
            continue;
        }
        let mut present = values.iter();
        levels.iter().for_each(|&at| push(if at == level { present.next() } else { None }));
    }
}

fn fault(error: ParquetError) -> Fault {
    match error {
        ParquetError::NYI(what) => {
            Fault::unsupported(format!("has what is not read ({what})"), "write it with snappy, zstd or no compression")
        }
        ParquetError::General(text) if text.contains("Disabled feature") => {
            Fault::unsupported(format!("has what is not read ({text})"), "write it with snappy, zstd or no compression")
        }
        other => Fault::damaged("what the format prescribes", other),
    }
}
