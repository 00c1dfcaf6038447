//! Measurements from binary files as tables of columns: spreadsheets, MDF, TDMS, Parquet, HDF5,
//! netCDF, NumPy, MATLAB.
//!
//! For whoever has temperatures in the file of a measurement program and wants them as
//! [`twinlag_record::Table`], from which a record is made as from text. The format is found from
//! the first bytes, never from the name; names, units, time base and invalid samples are those of
//! the file's own metadata; what was taken is in the notes of the table. What cannot be read
//! without guessing is refused, with what to do. Text files belong to `twinlag-record` itself,
//! estimates to `twinlag`.
//!
//! Each format is a feature: `spreadsheet`, `mdf`, `tdms`, `parquet`, `hdf5` (with MATLAB 7.3),
//! `netcdf`, `numpy`, `matlab` (5 to 7), all of them `formats`; none is on by default. A format
//! that is not built in is still recognised, and named.
//!
//! ```no_run
//! use twinlag_files::{Choice, contents, read};
//! use twinlag_record::{Record, Selection};
//!
//! for group in contents("engine.mf4")?.groups {
//!     println!("{group}"); // name, rows, period, channels with units
//! }
//! let table = read("engine.mf4", &Choice { group: Some("gas".to_owned()), ..Choice::default() })?;
//! let record = Record::from_table(&table, &Selection::default())?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![cfg_attr(not(feature = "formats"), allow(dead_code, reason = "what formats share, none needs alone"))]

mod choice;
mod contents;
mod error;
mod fault;
mod format;
mod input;
mod join;
mod read;
mod series;

#[cfg(feature = "hdf5")]
mod cf;
#[cfg(feature = "hdf5")]
mod hdf5;
#[cfg(feature = "matlab")]
mod matlab;
#[cfg(feature = "mdf")]
mod mdf;
#[cfg(feature = "mdf")]
mod mdf3;
#[cfg(feature = "netcdf")]
mod netcdf;
#[cfg(feature = "numpy")]
mod numpy;
#[cfg(feature = "parquet")]
mod parquet;
#[cfg(any(feature = "hdf5", feature = "numpy", feature = "tdms"))]
mod records;
#[cfg(any(feature = "hdf5", feature = "netcdf"))]
mod since;
#[cfg(feature = "spreadsheet")]
mod spreadsheet;
#[cfg(feature = "tdms")]
mod tdms;
#[cfg(any(feature = "hdf5", feature = "matlab", feature = "numpy"))]
mod variables;

pub use choice::Choice;
pub use contents::{Channel, Contents, Group};
pub use error::{FileError, Listing, Position};
pub use format::{Foreign, Format};
pub use read::{are_binary, contents, contents_of_bytes, is_binary, read, read_bytes};
