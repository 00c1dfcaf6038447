//! Formats are told by their first bytes, those that nothing reads as well.

use twinlag_files::{Choice, FileError, Foreign, Format, read, read_bytes};

#[test]
fn what_nothing_reads_is_named_with_what_to_do() {
    let wide = |text: &str| text.encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<_>>();
    let compound = |stream: &str| [b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1".to_vec(), wide(stream)].concat();
    let zip = |name: &str| {
        let length = u16::try_from(name.len()).expect("short").to_le_bytes();
        [b"PK\x03\x04".to_vec(), vec![0; 22], length.to_vec(), vec![0; 2], name.as_bytes().to_vec()].concat()
    };
    let cases: [(Vec<u8>, Foreign, &str); 20] = [
        (b"DIAEXTENDED  {@:ENGLISH\r\n".to_vec(), Foreign::DiademDat, "export it from DIAdem"),
        (b"<?xml version=\"1.0\"?><usi:tdm xmlns".to_vec(), Foreign::DiademTdm, "TDMS or CSV"),
        (b"<?xml version=\"1.0\"?>\n<atfx_file version".to_vec(), Foreign::Atfx, "MDF 4 or CSV"),
        (b"|CF,2,1,1;|CK,1,3,1,1;".to_vec(), Foreign::Famos, "export it from FAMOS as MDF 4"),
        (b"MULTI_STREAM_FILE_VER02106\0\0\0Dewesoft_Data_7.x".to_vec(), Foreign::Dewesoft, "export it from Dewesoft"),
        (b"TDSh\x0e\0\0\0".to_vec(), Foreign::TdmsIndex, ".tdms file beside it"),
        (b"PARE".to_vec(), Foreign::EncryptedParquet, "without encryption"),
        (b"ARROW1\0\0\xff\xff\xff\xff".to_vec(), Foreign::Feather, "Parquet or CSV"),
        (b"FEA1\0\0\0\0".to_vec(), Foreign::Feather, "Parquet or CSV"),
        (b"SQLite format 3\0\x10\0".to_vec(), Foreign::Sqlite, "table of readings as CSV"),
        (b"\x09\x04\x06\x00\x00\x00\x10\x00".to_vec(), Foreign::OldExcel, "save it as xlsx"),
        (compound("EncryptedPackage"), Foreign::EncryptedOffice, "without a password"),
        (compound("WordDocument"), Foreign::OtherOffice, "save the table"),
        (zip("xl/workbook.bin"), Foreign::BinaryExcel, "save it as xlsx"),
        (zip("log.csv"), Foreign::Zip, "decompress it first"),
        (b"BZh91AY&SY".to_vec(), Foreign::Bzip2, "decompress it first"),
        (b"\xfd7zXZ\0\0\x04".to_vec(), Foreign::Xz, "decompress it first"),
        (b"\x28\xb5\x2f\xfd\x04".to_vec(), Foreign::Zstd, "decompress it first"),
        (b"7z\xbc\xaf\x27\x1c\0\x04".to_vec(), Foreign::SevenZip, "decompress it first"),
        (b"Rar!\x1a\x07\x01\0".to_vec(), Foreign::Rar, "decompress it first"),
    ];
    for (bytes, foreign, remedy) in cases {
        assert_eq!(Format::of(&bytes), Some(Format::Foreign(foreign)));
        let error = read_bytes(bytes, &Choice::default(), "x").expect_err("nothing reads it");
        assert_eq!(error, FileError::NoReader { file: "x".to_owned(), foreign });
        assert!(error.to_string().contains(remedy), "{error}");
    }
}

/// Text, also compressed with gzip, is for the reader of text.
#[test]
fn text_and_unknown_bytes_are_no_format() {
    for bytes in
        [&b"time,T1,T2\n0,20,21\n"[..], b"\x1f\x8b\x08\0", b"", b"MDAT", b"\xef\xbb\xbf<html>", b"BZhang,T1,T2\n"]
    {
        assert_eq!(Format::of(bytes), None, "{}", bytes.escape_ascii());
    }
    let error = read_bytes(vec![1, 2, 255], &Choice::default(), "x.bin").expect_err("unknown");
    assert!(error.to_string().starts_with("x.bin: begins with the bytes 01 02 ff, which is no format"), "{error}");
    let error = read_bytes(Vec::new(), &Choice::default(), "x.bin").expect_err("empty");
    assert!(error.to_string().contains("it is empty"), "{error}");
}

#[test]
fn what_is_no_file_is_refused() {
    let directory = tempfile::tempdir().expect("a directory");
    let error = read(directory.path(), &Choice::default()).expect_err("no file");
    assert!(matches!(error, FileError::IsDirectory { .. }), "{error}");
    let error = read(directory.path().join("nothing.mf4"), &Choice::default()).expect_err("no file");
    assert!(matches!(error, FileError::CannotRead { .. }), "{error}");
}

/// HDF5 is told apart by what stands in it, archives by the names of their entries.
#[test]
fn kin_are_told_apart() {
    let hdf5 = b"\x89HDF\r\n\x1a\n".to_vec();
    assert_eq!(Format::of(&hdf5), Some(Format::Hdf5));
    assert_eq!(Format::of(&[hdf5.clone(), b"....._NCProperties".to_vec()].concat()), Some(Format::NetCdf));
    let block = [b"MATLAB 7.3 MAT-file".to_vec(), vec![b' '; 493], hdf5].concat();
    assert_eq!(Format::of(&block), Some(Format::Matlab73));
    assert_eq!(Format::of(b"MDF     3.30    "), Some(Format::Mdf3));
    assert_eq!(Format::of(b"UnFinMF 4.10    "), Some(Format::Mdf4));
    assert_eq!(Format::of(b"\x93NUMPY\x01\0"), Some(Format::Npy));
    assert_eq!(Format::of(b"CDF\x01"), Some(Format::NetCdf));
}

/// Without its feature, a format is named and so is the feature.
#[cfg(not(feature = "mdf"))]
#[test]
fn a_format_that_is_not_built_in_is_named() {
    let error = read_bytes(b"MDF     4.10    ".to_vec(), &Choice::default(), "x.mf4").expect_err("not built in");
    assert!(error.to_string().contains("is an MDF 4 file") && error.to_string().contains("'mdf'"), "{error}");
}
