//! The table within a sheet: where it begins, its header, its columns.

use std::collections::{BTreeMap, BTreeSet};

use calamine::{Cell, Data, DataType as _};
use jiff::Timestamp;
use twinlag_record::Unit;

use super::cells::{Sheet, Value, is_data};
use crate::contents::{Channel, Group};
use crate::series::{Loaded, Series, Values};

/// Columns in which the first two rows of a table both have data.
const MIN_COLUMNS: usize = 2;
/// Longest preamble.
const MAX_PREAMBLE_ROWS: usize = 1000;
const DAY_NS: i64 = 86_400_000_000_000;

/// Header cells by column.
type Header = BTreeMap<u32, String>;

/// The table of a sheet; `None` if it has none.
pub(super) fn read(name: String, sheet: &Sheet) -> Option<(Group, Loaded)> {
    let first = (0..sheet.rows().saturating_sub(1).min(MAX_PREAMBLE_ROWS)).find(|&row| {
        let below = data_columns(sheet.row(row + 1));
        data_columns(sheet.row(row)).intersection(&below).count() >= MIN_COLUMNS
    })?;
    let (names, units) = header(sheet, first);
    let rows = sheet.rows() - first;
    let mut columns: BTreeMap<u32, Vec<Value>> = BTreeMap::new();
    for row in 0..rows {
        for cell in sheet.row(first + row) {
            let column = columns.entry(cell.get_position().1).or_default();
            column.resize(row, Value::Missing);
            column.push(Value::of(cell.get_value()));
        }
    }
    let series = columns.into_iter().map(|(column, mut values)| {
        values.resize(rows, Value::Missing);
        let text = |header: &Header| header.get(&column).cloned().unwrap_or_default();
        Series { name: text(&names), unit: text(&units), values: of_values(values) }
    });
    let series: Vec<Series> = series.collect();
    let channels = series.iter().map(|series| Channel::new(series.name.as_str(), series.unit.as_str())).collect();
    let notes = vec![format!("sample 1 is row {} of sheet '{name}'", sheet.number(first))];
    Some((Group { name, rows, channels, ..Group::default() }, Loaded { series, time: None, notes }))
}

fn data_columns(row: &[Cell<Data>]) -> BTreeSet<u32> {
    row.iter().filter(|cell| is_data(cell.get_value())).map(|cell| cell.get_position().1).collect()
}

/// Names and units above the first row of data.
fn header(sheet: &Sheet, first: usize) -> (Header, Header) {
    let data = data_columns(sheet.row(first));
    let texts = |row: usize| -> Header {
        let cells = sheet.row(row).iter().filter(|cell| !is_data(cell.get_value()));
        cells
            .filter_map(|cell| Some((cell.get_position().1, cell.get_value().as_string()?.trim().to_owned())))
            .collect()
    };
    // A title or a setting has fewer cells than the table has columns.
    let is_header = |row: &usize| {
        let named = texts(*row);
        2 * data.iter().filter(|column| named.contains_key(column)).count() >= data.len()
    };
    let Some(nearest) = (0..first).rev().find(is_header) else { return Default::default() };
    let cells = texts(nearest);
    let above = nearest.checked_sub(1).filter(is_header).filter(|_| is_unit_row(&cells));
    match above {
        Some(above) => (texts(above), cells),
        None => (cells, Header::new()),
    }
}

/// Whether a row has units throughout, one of them of a time or a temperature.
fn is_unit_row(cells: &Header) -> bool {
    const MAX_UNIT_CHARACTERS: usize = 12;
    let is_known = |text: &String| !matches!(Unit::parse(text), Unit::Other(_) | Unit::Unstated);
    cells.values().any(is_known) && cells.values().all(|text| text.chars().count() <= MAX_UNIT_CHARACTERS)
}

/// The values of a column as what they are throughout: numbers, instants, else texts, of which the
/// reader of records makes what it makes of those in a text file.
fn of_values(values: Vec<Value>) -> Values {
    let all = |is: fn(&Value) -> bool| values.iter().all(|value| *value == Value::Missing || is(value));
    let has_days_only = || all(|value| matches!(value, Value::Instant(ns) if ns % DAY_NS == 0));
    if all(|value| matches!(value, Value::Number(_))) {
        let number = |value| if let Value::Number(number) = value { number } else { f64::NAN };
        Values::Numbers(values.into_iter().map(number).collect())
    } else if all(|value| matches!(value, Value::Instant(_))) && !has_days_only() {
        let instant = |value| if let Value::Instant(ns) = value { Some(ns) } else { None };
        Values::Instants(values.into_iter().map(instant).collect())
    } else {
        Values::Texts(values.into_iter().map(text).collect())
    }
}

/// A cell as it would stand in a text file.
fn text(value: Value) -> String {
    match value {
        Value::Missing => String::new(),
        Value::Number(number) => number.to_string(),
        Value::Text(text) => text,
        // A day alone goes with a time of day in the column beside it.
        Value::Instant(ns) => match Timestamp::from_nanosecond(ns.into()) {
            Ok(at) if ns % DAY_NS == 0 => at.to_string().chars().take_while(|c| *c != 'T').collect(),
            Ok(at) => at.to_string().trim_end_matches('Z').to_owned(),
            Err(_) => String::new(),
        },
        Value::Time(ns) => {
            let (seconds, rest) = (ns.div_euclid(1_000_000_000), ns.rem_euclid(1_000_000_000));
            format!("{}:{:02}:{:02}.{rest:09}", seconds / 3600, seconds / 60 % 60, seconds % 60)
        }
    }
}
