//! Binary files that gzip has compressed.

use std::io::Write as _;

use flate2::Compression;
use flate2::write::GzEncoder;
use twinlag_files::{Choice, FileError, Format, contents, is_binary, read, read_bytes};
use twinlag_record::{Note, RecordError};

use crate::common::{assert_same, bytes, expected};

/// Failed: it was said to be no text.
#[test]
fn what_gzip_has_compressed_is_read_as_what_is_in_it() {
    let compressed = |bytes: &[u8]| {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(bytes).expect("memory");
        encoder.finish().expect("memory")
    };
    let whole = compressed(&bytes("plain.mf4"));
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("plain.mf4.gz");
    std::fs::write(&path, &whole).expect("can be written");
    assert!(is_binary(&path));
    assert_eq!(contents(&path).expect("MDF").format, Format::Mdf4);
    let of_file = read(&path, &Choice::default()).expect("MDF");
    let of_bytes = read_bytes(whole.clone(), &Choice::default(), "plain.mf4.gz").expect("MDF");
    for table in [of_file, of_bytes] {
        assert_same(&table, &expected("plain.mf4"), "plain.mf4.gz");
        assert!(table.notes().contains(&Note::Decompressed), "{:?}", table.notes());
    }
    let error = read_bytes(whole[..whole.len() / 2].to_vec(), &Choice::default(), "cut.gz").expect_err("cut off");
    assert!(matches!(error, FileError::Table(RecordError::CutGzip { .. })), "{error}");
    std::fs::write(&path, compressed(b"time,T1,T2\n0,20,21\n")).expect("can be written");
    assert!(!is_binary(&path));
}
