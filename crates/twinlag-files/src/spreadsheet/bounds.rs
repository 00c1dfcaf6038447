//! Whether the cells of an xls file lie within a sheet. The library makes a rectangle of them before
//! anything can be asked, so that one damaged place would take all memory.

use std::io::{Read, Seek, SeekFrom};

use cfb::CompoundFile;

use crate::fault::Fault;
use crate::input::Stream;

/// Size of a sheet before Excel 2007.
const MAX_ROWS: u32 = 65_536;
const MAX_COLUMNS: u32 = 256;
/// The size of what is filled.
const DIMENSIONS: u32 = 0x0200;
/// MULRK.
const SEVERAL_NUMBERS: u32 = 0x00bd;
/// Records that begin with the row and the column of a cell: FORMULA, RSTRING, LABELSST, NUMBER,
/// LABEL, BOOLERR, RK ([MS-XLS], 2.4).
const CELL_RECORDS: [u32; 7] = [0x0006, 0x00d6, 0x00fd, 0x0203, 0x0204, 0x0205, 0x027e];

/// Refuses a file in which a cell lies elsewhere; leaves the stream at its beginning.
pub(super) fn check(stream: &mut Stream) -> Result<(), Fault> {
    let unreadable = |error: std::io::Error| Fault::damaged("a compound file with a workbook in it", error);
    let mut file = CompoundFile::open(&mut *stream).map_err(unreadable)?;
    let name = ["/Workbook", "/Book"].into_iter().find(|name| file.is_stream(name));
    let Some(name) = name else {
        return Err(Fault::damaged("a stream called Workbook or Book", "none"));
    };
    let mut book = Vec::new();
    file.open_stream(name).and_then(|mut stream| stream.read_to_end(&mut book)).map_err(unreadable)?;
    let number = |at: usize| book.get(at..at + 2).map(|two| u32::from(u16::from_le_bytes([two[0], two[1]])));
    let mut at = 0;
    while let (Some(kind), Some(length)) = (number(at), number(at + 2)) {
        let body = at + 4;
        let length = length as usize;
        let (rows, columns) = match (kind, length) {
            // The size in 16 bits before Excel 97, rows in 32 bits since.
            (DIMENSIONS, 10) => (number(body + 2), number(body + 6)),
            (DIMENSIONS, _) => {
                (number(body + 4).zip(number(body + 6)).map(|(low, high)| low + (high << 16)), number(body + 10))
            }
            // The last column of several cells stands last.
            (SEVERAL_NUMBERS, _) => (None, number(body + length.saturating_sub(2)).map(|column| column + 1)),
            _ if CELL_RECORDS.contains(&kind) => (None, number(body + 2).map(|column| column + 1)),
            _ => (None, None),
        };
        let (rows, columns) = (rows.unwrap_or(0), columns.unwrap_or(0));
        if rows > MAX_ROWS || columns > MAX_COLUMNS {
            let expected = format!("{MAX_ROWS} rows and {MAX_COLUMNS} columns at most");
            return Err(Fault::damaged(expected, format!("a cell or a size of {rows} rows and {columns} columns")));
        }
        at = body + length;
    }
    stream.seek(SeekFrom::Start(0))?;
    Ok(())
}
