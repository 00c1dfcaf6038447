//! Which format a file has, by its first bytes.

use std::fmt;

use crate::fault::Fault;
use crate::input::Input;
use crate::series::Opened;

/// Formats of measurements, recognised by their first bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Format {
    /// Excel from 2007 on: xlsx, xlsm.
    Xlsx,
    /// Excel 5 to 2003.
    Xls,
    /// OpenDocument spreadsheet.
    Ods,
    /// ASAM MDF 4.
    Mdf4,
    /// MDF 3 and before.
    Mdf3,
    /// TDMS of National Instruments.
    Tdms,
    /// Apache Parquet.
    Parquet,
    /// HDF5 that is nothing more special.
    Hdf5,
    /// MATLAB 7.3, which is HDF5.
    Matlab73,
    /// netCDF: classic, or 4, which is HDF5.
    NetCdf,
    /// One array of NumPy.
    Npy,
    /// Named arrays of NumPy.
    Npz,
    /// MATLAB 5 to 7.
    Matlab5,
    /// A format that nothing here reads.
    Foreign(Foreign),
}

/// Formats that are recognised and not read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Foreign {
    /// DIAdem, the header of DAT.
    DiademDat,
    /// DIAdem, TDM.
    DiademTdm,
    /// ASAM ODS, ATFX.
    Atfx,
    /// imc FAMOS.
    Famos,
    /// Dewesoft data files, dxd and d7d.
    Dewesoft,
    /// The index beside a TDMS file, without samples.
    TdmsIndex,
    /// Encrypted Parquet.
    EncryptedParquet,
    /// Feather, which is a file of Apache Arrow from version 2 on.
    Feather,
    /// A database of `SQLite`.
    Sqlite,
    /// Excel before version 5.
    OldExcel,
    /// Excel in binary parts, xlsb.
    BinaryExcel,
    /// An Office document with a password.
    EncryptedOffice,
    /// An Office document that is no spreadsheet.
    OtherOffice,
    /// bzip2.
    Bzip2,
    /// xz.
    Xz,
    /// Zstandard.
    Zstd,
    /// 7z.
    SevenZip,
    /// RAR.
    Rar,
    /// A zip archive of none of the formats here.
    Zip,
}

/// Opens a file of a format, reading its metadata.
pub(crate) type Opener = fn(Input, Format) -> Result<Box<dyn Opened>, Fault>;

impl Format {
    /// The format of a file; `None` for text and for whatever else is not among them.
    ///
    /// ```
    /// use twinlag_files::Format;
    ///
    /// assert_eq!(Format::of(b"MDF     4.10    asammdf"), Some(Format::Mdf4));
    /// assert_eq!(Format::of(b"time,T1,T2\n0,20,21\n"), None);
    /// ```
    ///
    /// - `first_bytes`: some ten determine most formats; what distinguishes archives and the kinds of
    ///   HDF5 stands in the first 64 KiB
    pub fn of(first_bytes: &[u8]) -> Option<Self> {
        let starts = |with: &[u8]| first_bytes.starts_with(with);
        let foreign = |foreign| Some(Self::Foreign(foreign));
        match first_bytes {
            _ if starts(b"MDF ") || starts(b"UnFinMF ") => {
                let is_four = first_bytes.get(8).is_some_and(|major| *major >= b'4');
                Some(if is_four { Self::Mdf4 } else { Self::Mdf3 })
            }
            _ if starts(b"TDSm") => Some(Self::Tdms),
            _ if starts(b"TDSh") => foreign(Foreign::TdmsIndex),
            _ if starts(b"PAR1") => Some(Self::Parquet),
            _ if starts(b"PARE") => foreign(Foreign::EncryptedParquet),
            _ if starts(b"CDF\x01") || starts(b"CDF\x02") || starts(b"CDF\x05") => Some(Self::NetCdf),
            _ if starts(b"\x93NUMPY") => Some(Self::Npy),
            _ if starts(HDF5) || has_user_block(first_bytes) => Some(of_hdf5(first_bytes)),
            _ if starts(b"MATLAB 5.0 MAT-file") || is_matlab_5(first_bytes) => Some(Self::Matlab5),
            _ if starts(b"PK\x03\x04") => Some(of_zip(first_bytes)),
            _ if starts(b"PK\x05\x06") => foreign(Foreign::Zip),
            _ if starts(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1") => Some(of_compound(first_bytes)),
            // Beginning of the file in BIFF 2, 3 and 4: a record number, its length, a version.
            [0x09, 0x00 | 0x02 | 0x04, 0x04 | 0x06, 0x00, ..] => foreign(Foreign::OldExcel),
            _ => foreign_of(first_bytes).map(Self::Foreign),
        }
    }

    /// The feature that builds its reader in.
    pub(crate) fn feature(self) -> &'static str {
        match self {
            Self::Xlsx | Self::Xls | Self::Ods => "spreadsheet",
            Self::Mdf4 | Self::Mdf3 => "mdf",
            Self::Tdms => "tdms",
            Self::Parquet => "parquet",
            Self::Hdf5 | Self::Matlab73 => "hdf5",
            Self::NetCdf => "netcdf",
            Self::Npy | Self::Npz => "numpy",
            Self::Matlab5 => "matlab",
            Self::Foreign(_) => "",
        }
    }

    /// What opens files of it, if that is built in.
    pub(crate) fn opener(self) -> Option<Opener> {
        match self {
            #[cfg(feature = "spreadsheet")]
            Self::Xlsx | Self::Xls | Self::Ods => Some(crate::spreadsheet::open),
            #[cfg(feature = "mdf")]
            Self::Mdf4 => Some(crate::mdf::open),
            #[cfg(feature = "mdf")]
            Self::Mdf3 => Some(crate::mdf3::open),
            #[cfg(feature = "tdms")]
            Self::Tdms => Some(crate::tdms::open),
            #[cfg(feature = "parquet")]
            Self::Parquet => Some(crate::parquet::open),
            #[cfg(feature = "hdf5")]
            Self::Hdf5 | Self::Matlab73 => Some(crate::hdf5::open),
            #[cfg(feature = "netcdf")]
            Self::NetCdf => Some(crate::netcdf::open),
            #[cfg(feature = "numpy")]
            Self::Npy | Self::Npz => Some(crate::numpy::open),
            #[cfg(feature = "matlab")]
            Self::Matlab5 => Some(crate::matlab::open),
            _ => None,
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Xlsx => "an Excel workbook (xlsx)",
            Self::Xls => "an Excel workbook (xls)",
            Self::Ods => "an OpenDocument spreadsheet",
            Self::Mdf4 => "an MDF 4 file",
            Self::Mdf3 => "an MDF 3 file",
            Self::Tdms => "a TDMS file",
            Self::Parquet => "a Parquet file",
            Self::Hdf5 => "an HDF5 file",
            Self::Matlab73 => "a MATLAB 7.3 file",
            Self::NetCdf => "a netCDF file",
            Self::Npy => "a NumPy array (npy)",
            Self::Npz => "a NumPy archive (npz)",
            Self::Matlab5 => "a MATLAB 5 file",
            Self::Foreign(foreign) => return foreign.fmt(f),
        })
    }
}

impl Foreign {
    /// What to do instead of reading it.
    pub fn remedy(self) -> &'static str {
        match self {
            Self::DiademDat | Self::DiademTdm => "export it from DIAdem as TDMS or CSV",
            Self::Atfx => "export it as MDF 4 or CSV",
            Self::Famos => "export it from FAMOS as MDF 4, TDMS or CSV",
            Self::Dewesoft => "export it from Dewesoft as MDF 4, TDMS or CSV",
            Self::TdmsIndex => "name the .tdms file beside it, which has the samples",
            Self::EncryptedParquet => "write it without encryption",
            Self::Feather => "save it as Parquet or CSV",
            Self::Sqlite => "export the table of readings as CSV",
            Self::OldExcel | Self::BinaryExcel => "open it in a spreadsheet program and save it as xlsx or CSV",
            Self::EncryptedOffice => "save it without a password",
            Self::OtherOffice => "save the table as xlsx or CSV",
            Self::Bzip2 | Self::Xz | Self::Zstd | Self::SevenZip | Self::Rar | Self::Zip => "decompress it first",
        }
    }
}

impl fmt::Display for Foreign {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::DiademDat => "a DIAdem header (DAT)",
            Self::DiademTdm => "a DIAdem file (TDM)",
            Self::Atfx => "an ASAM ODS file (ATFX)",
            Self::Famos => "an imc FAMOS file",
            Self::Dewesoft => "a Dewesoft data file",
            Self::TdmsIndex => "the index of a TDMS file, without samples",
            Self::EncryptedParquet => "an encrypted Parquet file",
            Self::Feather => "a Feather or Arrow file",
            Self::Sqlite => "an SQLite database",
            Self::OldExcel => "an Excel worksheet from before Excel 5",
            Self::BinaryExcel => "an Excel workbook in binary parts (xlsb)",
            Self::EncryptedOffice => "an Office document with a password",
            Self::OtherOffice => "an Office document that is no spreadsheet",
            Self::Bzip2 => "compressed with bzip2",
            Self::Xz => "compressed with xz",
            Self::Zstd => "compressed with zstd",
            Self::SevenZip => "a 7z archive",
            Self::Rar => "a RAR archive",
            Self::Zip => "a zip archive",
        })
    }
}

const HDF5: &[u8] = b"\x89HDF\r\n\x1a\n";

/// HDF5 may begin behind a block of another program, of 512 bytes or that times a power of two.
fn has_user_block(head: &[u8]) -> bool {
    (9..20).any(|power| head.get(1 << power..).is_some_and(|rest| rest.starts_with(HDF5)))
}

fn of_hdf5(head: &[u8]) -> Format {
    if head.starts_with(b"MATLAB 7.3") {
        Format::Matlab73
    } else if has(head, b"_NCProperties") || has(head, b"_Netcdf4Dimid") || has(head, b"_nc3_strict") {
        Format::NetCdf
    } else {
        Format::Hdf5
    }
}

/// Behind 124 bytes of text: version 1 and the order of bytes, both in that order.
fn is_matlab_5(head: &[u8]) -> bool {
    matches!(head.get(124..128), Some([0, 1, b'I', b'M'] | [1, 0, b'M', b'I']))
}

/// Where the parts of an Office document are in its archive.
const OFFICE_FOLDERS: [&[u8]; 3] = [b"_rels/", b"docProps/", b"xl/"];

/// What an archive is shows in the names of its entries.
fn of_zip(head: &[u8]) -> Format {
    let mut office = false;
    let mut rest = head;
    while let Some(at) = find(rest, b"PK\x03\x04") {
        rest = &rest[at..];
        let Some(name) = entry_name(rest) else { break };
        match name {
            _ if name.ends_with(b".npy") => return Format::Npz,
            b"mimetype" if has(&rest[..rest.len().min(128)], b"opendocument.spreadsheet") => return Format::Ods,
            b"mimetype" => return Format::Foreign(Foreign::OtherOffice),
            b"xl/workbook.bin" => return Format::Foreign(Foreign::BinaryExcel),
            b"xl/workbook.xml" => return Format::Xlsx,
            _ if name.starts_with(b"word/") || name.starts_with(b"ppt/") => {
                return Format::Foreign(Foreign::OtherOffice);
            }
            b"[Content_Types].xml" => office = true,
            _ => office = office || OFFICE_FOLDERS.iter().any(|folder| name.starts_with(folder)),
        }
        rest = &rest[4..];
    }
    if office { Format::Xlsx } else { Format::Foreign(Foreign::Zip) }
}

/// The name of the entry of an archive whose header stands first.
fn entry_name(header: &[u8]) -> Option<&[u8]> {
    const NAME_LENGTH_AT: usize = 26;
    const NAME_AT: usize = 30;
    let length = header.get(NAME_LENGTH_AT..NAME_LENGTH_AT + 2)?;
    let length = usize::from(u16::from_le_bytes([length[0], length[1]]));
    header.get(NAME_AT..NAME_AT + length)
}

/// A compound document of Microsoft: a workbook, unless it says otherwise.
fn of_compound(head: &[u8]) -> Format {
    let has_stream = |name: &str| {
        let wide: Vec<u8> = name.encode_utf16().flat_map(u16::to_le_bytes).collect();
        has(head, &wide)
    };
    if has_stream("EncryptedPackage") {
        Format::Foreign(Foreign::EncryptedOffice)
    } else if has_stream("WordDocument") || has_stream("PowerPoint Document") {
        Format::Foreign(Foreign::OtherOffice)
    } else {
        Format::Xls
    }
}

fn foreign_of(head: &[u8]) -> Option<Foreign> {
    const XML_HEAD_BYTES: usize = 1024;
    let starts = |with: &[u8]| head.starts_with(with);
    let xml_head = &head[..head.len().min(XML_HEAD_BYTES)];
    match () {
        () if starts(b"DIAEXTENDED") => Some(Foreign::DiademDat),
        () if starts(b"|CF,") => Some(Foreign::Famos),
        () if starts(b"MULTI_STREAM_FILE") || (has(&head[..head.len().min(64)], b"Dewesoft_Data")) => {
            Some(Foreign::Dewesoft)
        }
        () if starts(b"ARROW1\0\0") || starts(b"FEA1") => Some(Foreign::Feather),
        () if starts(b"SQLite format 3\0") => Some(Foreign::Sqlite),
        () if starts(b"BZh") && head.get(4..7) == Some(b"1AY") => Some(Foreign::Bzip2),
        () if starts(b"\xfd7zXZ\0") => Some(Foreign::Xz),
        () if starts(b"\x28\xb5\x2f\xfd") => Some(Foreign::Zstd),
        () if starts(b"7z\xbc\xaf\x27\x1c") => Some(Foreign::SevenZip),
        () if starts(b"Rar!\x1a\x07") => Some(Foreign::Rar),
        () if !xml_head.trim_ascii_start().starts_with(b"<") && !starts(b"\xef\xbb\xbf<") => None,
        () if has(xml_head, b"<usi:tdm") => Some(Foreign::DiademTdm),
        () if has(xml_head, b"<atfx_file") => Some(Foreign::Atfx),
        () => None,
    }
}

fn has(bytes: &[u8], part: &[u8]) -> bool {
    find(bytes, part).is_some()
}

fn find(bytes: &[u8], part: &[u8]) -> Option<usize> {
    memchr::memmem::find(bytes, part)
}
