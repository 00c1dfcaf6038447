//! Reading and writing records: delimited text, units, irregular sampling, gaps.
//!
//! For whoever has a file of two temperatures from a logger and wants vectors that can be trusted:
//! it finds out by itself what kind of text it is, says in [`Record::notes`] what it made of it,
//! and refuses, with line, column and remedy, what can be read in two ways. It knows nothing of
//! estimators. If you want time constants, take the facade `twinlag`, which reads files through
//! this crate; if you already have vectors, [`Record::from_channels`] checks them in the same way.
//!
//! ```
//! use twinlag_record::{Record, SamplingKind, Selection, Table};
//!
//! let text = "\
//! Logger: demo
//! Zeit [ms];T1 [°C];T2 [K]
//! 0;20,0;293,15
//! 2;20,5;293,25
//! 4;21,0;293,45
//! 6;21,5;293,75
//! 8;22,0;294,05
//! 10;---;294,35
//! 12;23,0;294,75
//! 14;23,5;295,15
//! 16;24,0;295,65
//! ";
//! let table = Table::read(text.as_bytes(), "demo.csv")?;
//! let record = Record::from_table(&table, &Selection::default())?;
//! assert_eq!(record.channels, ["T1", "T2"]);
//! assert_eq!(record.segments, [0..5, 6..9]); // cut at the missing value, which is masked, not filled
//! assert_eq!(record.sampling.kind, SamplingKind::Uniform);
//! assert!((record.sampling.period_s - 0.002).abs() < 1e-12);
//! for note in &record.notes {
//!     println!("{note}"); // semicolons, decimal comma, guessed columns, converted units, masked rows, sampling
//! }
//! # Ok::<(), twinlag_record::RecordError>(())
//! ```

mod beside;
mod cells;
mod choose;
mod clock;
mod column;
mod description;
mod dialect;
mod encoding;
mod error;
mod fill;
mod flow;
mod form;
mod from_columns;
mod grid;
pub mod gzip;
mod joined;
mod lab_view;
mod layout;
mod motion;
mod names;
mod note;
mod number;
mod parts;
mod record;
mod row_lines;
mod rows;
mod sampling;
mod scale;
mod sea_bird;
mod selection;
mod serial;
mod sign;
mod stamps;
mod table;
mod time_axis;
mod unit;
mod wording;
mod words;
mod wrap;
mod write;

pub use choose::SAMPLE_PERIODS_S;
pub use column::{Column, Kind};
pub use error::{Candidates, Place, RecordError};
pub use form::Program;
pub use from_columns::NamedColumn;
pub use grid::{Grid, Stretch};
pub use note::Note;
pub use record::{Channels, Record, TEMPERATURE_RANGE_C};
pub use rows::{Row, RowReader};
pub use sampling::{Sampling, SamplingKind};
pub use selection::{ColumnRef, SamplingChoice, Selection, Setting};
pub use sign::{Decimal, Delimiter};
pub use table::{MAX_LINE_BYTES, Table};
pub use unit::Unit;
pub use write::{Decimals, TextColumn, write_csv, write_csv_with_text};
