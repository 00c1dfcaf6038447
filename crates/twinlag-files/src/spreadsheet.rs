//! Workbooks: xlsx, xls, ods. A sheet is a group.
//!
//! The table of a sheet begins with the first two rows, one under the other, that have numbers or
//! dates in the same two columns or more. The header is the nearest row of texts above them; where
//! the row between is one of units, these are the columns' own. What stands above is a preamble.

mod bounds;
mod cells;
mod sheet;

use calamine::{Cell, Data, Ods, Reader, SheetType, Xls, Xlsx};

use crate::contents::Group;
use crate::fault::Fault;
use crate::format::Format;
use crate::input::{Input, Stream};
use crate::series::{Loaded, Opened};
use cells::Sheet;

const WORKBOOK: &str = "a workbook";

/// A workbook, all of whose sheets are read: which one is meant shows in their headers alone.
struct Workbook {
    groups: Vec<Group>,
    sheets: Vec<Loaded>,
}

pub(crate) fn open(input: Input, format: Format) -> Result<Box<dyn Opened>, Fault> {
    let mut stream = input.stream()?;
    let sheets = match format {
        Format::Xls => {
            bounds::check(&mut stream)?;
            dense(Xls::new(stream).map_err(damaged)?)?
        }
        Format::Ods => dense(Ods::new(stream).map_err(damaged)?)?,
        _ => of_xlsx(stream)?,
    };
    let (groups, sheets) = sheets.into_iter().filter_map(|(name, sheet)| sheet::read(name, &sheet)).unzip();
    Ok(Box::new(Workbook { groups, sheets }))
}

impl Opened for Workbook {
    fn groups(&self) -> &[Group] {
        &self.groups
    }

    fn load(&mut self, group: usize) -> Result<Loaded, Fault> {
        Ok(std::mem::take(&mut self.sheets[group]))
    }
}

/// Sheets of a format that is read as whole rectangles: what it can hold is small, or its reader
/// leaves out empty rows and columns at the end.
fn dense<R>(mut workbook: R) -> Result<Vec<(String, Sheet)>, Fault>
where
    R: Reader<Stream>,
    R::Error: std::fmt::Display,
{
    let names = names(&workbook);
    let read = names.into_iter().map(|name| {
        let range = workbook.worksheet_range(&name).map_err(damaged)?;
        let (first_row, first_column) = range.start().unwrap_or_default();
        let cells = range.used_cells().map(|(row, column, value)| {
            Cell::new((first_row + row as u32, first_column + column as u32), value.clone())
        });
        Ok((name, Sheet::of(cells.collect())))
    });
    read.collect()
}

/// Sheets of an Office archive, cell by cell: a damaged place of one cell must not become a
/// rectangle of the largest size.
fn of_xlsx(stream: Stream) -> Result<Vec<(String, Sheet)>, Fault> {
    let mut workbook = Xlsx::new(stream).map_err(damaged)?;
    let read = names(&workbook).into_iter().map(|name| {
        let mut reader = workbook.worksheet_cells_reader(&name).map_err(damaged)?;
        let mut cells = Vec::new();
        while let Some(cell) = reader.next_cell().map_err(damaged)? {
            cells.push(Cell::new(cell.get_position(), Data::from(cell.get_value().clone())));
        }
        Ok((name, Sheet::of(cells)))
    });
    read.collect()
}

fn names(workbook: &impl Reader<Stream>) -> Vec<String> {
    let sheets = workbook.sheets_metadata().iter();
    sheets.filter(|sheet| sheet.typ == SheetType::WorkSheet).map(|sheet| sheet.name.clone()).collect()
}

fn damaged(error: impl std::fmt::Display) -> Fault {
    let text = error.to_string();
    if text.to_lowercase().contains("password") {
        return Fault::unsupported("has a password", "save it without one");
    }
    Fault::damaged(WORKBOOK, text)
}
