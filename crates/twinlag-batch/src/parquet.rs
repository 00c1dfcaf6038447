//! The table of a batch as Parquet: the columns of the delimited text, with their types; an empty cell is null.

use std::fs::File;
use std::io::Write;
use std::path::Path;
use std::sync::Arc;

use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader as _, SerializedFileReader};
use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use parquet::schema::types::{Type, TypePtr};
use serde_json::Value;

use crate::error::BatchError;
use crate::group::Unit;
use crate::journal::Answers;
use crate::row::{Cells, Row, Verb};
use crate::table::columns;

/// Rows that are held until they are written together; chosen, so that few megabytes are held, however long the table is.
const GROUP_ROWS: usize = 512;
/// The name of the schema, by which a table is known.
const SCHEMA: &str = "twinlag_batch";

impl From<ParquetError> for BatchError {
    fn from(error: ParquetError) -> Self {
        Self::Table { reason: error.to_string() }
    }
}

/// Writes the table of a batch as Parquet.
///
/// # Errors
/// [`BatchError::Table`], [`BatchError::Read`].
pub fn write_parquet(
    units: &[Unit],
    answers: &mut impl Answers,
    verb: Verb,
    out: impl Write + Send,
) -> Result<(), BatchError> {
    let columns = columns(units, answers, verb)?;
    let properties = WriterProperties::builder().set_compression(Compression::ZSTD(<_>::default())).build();
    let mut writer = SerializedFileWriter::new(out, schema(&columns)?, Arc::new(properties))?;
    let mut held = Vec::with_capacity(GROUP_ROWS);
    for unit in units {
        held.extend(answers.rows(unit)?);
        if held.len() >= GROUP_ROWS {
            write_group(&mut writer, &columns, &held)?;
            held.clear();
        }
    }
    if !held.is_empty() {
        write_group(&mut writer, &columns, &held)?;
    }
    writer.close()?;
    Ok(())
}

/// Whether a file is a table that [`write_parquet`] has written.
pub(crate) fn is_parquet_table(path: &Path) -> bool {
    let table = File::open(path).ok().and_then(|file| SerializedFileReader::new(file).ok());
    table.is_some_and(|table| table.metadata().file_metadata().schema().name() == SCHEMA)
}

fn schema(columns: &[(String, Cells)]) -> Result<TypePtr, ParquetError> {
    let field = |(name, cells): &(String, Cells)| {
        let (physical, logical) = match cells {
            Cells::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
            Cells::Count => (Physical::INT64, None),
            Cells::Number => (Physical::DOUBLE, None),
            Cells::Truth => (Physical::BOOLEAN, None),
        };
        let builder = Type::primitive_type_builder(name, physical).with_repetition(Repetition::OPTIONAL);
        Ok(Arc::new(builder.with_logical_type(logical).build()?))
    };
    let fields = columns.iter().map(field).collect::<Result<Vec<_>, ParquetError>>()?;
    Ok(Arc::new(Type::group_type_builder(SCHEMA).with_fields(fields).build()?))
}

fn write_group(
    writer: &mut SerializedFileWriter<impl Write + Send>,
    columns: &[(String, Cells)],
    rows: &[Row],
) -> Result<(), ParquetError> {
    let mut group = writer.next_row_group()?;
    for (name, cells) in columns {
        let column = group.next_column()?.expect("the schema has the same columns");
        let values = rows.iter().map(|row| row.get(name));
        let texts = rows.iter().map(|row| row.in_words(name));
        match cells {
            Cells::Text => write_column::<ByteArrayType>(column, texts.map(|text| Some(ByteArray::from(&*text?)))),
            Cells::Count => write_column::<Int64Type>(column, values.map(|value| value?.as_i64())),
            Cells::Number => write_column::<DoubleType>(column, values.map(|value| value?.as_f64())),
            Cells::Truth => write_column::<BoolType>(column, values.map(|value| value.and_then(Value::as_bool))),
        }?;
    }
    group.close()?;
    Ok(())
}

fn write_column<Of: DataType>(
    mut column: SerializedColumnWriter<'_>,
    cells: impl Iterator<Item = Option<Of::T>>,
) -> Result<(), ParquetError> {
    let (mut values, mut is_there) = (Vec::new(), Vec::new());
    for cell in cells {
        is_there.push(i16::from(cell.is_some()));
        values.extend(cell);
    }
    column.typed::<Of>().write_batch(&values, Some(&is_there), None)?;
    column.close()
}
