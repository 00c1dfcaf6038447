//! All tests of `twinlag-files` in one program: linked once, and run side by side.

#[allow(dead_code, reason = "each format uses a part")]
mod common;
mod format;
#[cfg(feature = "mdf")]
mod gzip;
#[cfg(feature = "hdf5")]
mod hdf5;
#[cfg(feature = "matlab")]
mod matlab;
#[cfg(feature = "mdf")]
mod mdf;
#[cfg(feature = "netcdf")]
mod netcdf;
#[cfg(feature = "numpy")]
mod numpy;
#[cfg(feature = "parquet")]
mod parquet;
#[cfg(feature = "spreadsheet")]
mod spreadsheet;
#[cfg(feature = "tdms")]
mod tdms;
