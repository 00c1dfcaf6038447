//! TDMS files of npTDMS.

use crate::common::{assert_cuts_are_refused, assert_flips_are_survived, check, notes, path};
use twinlag_files::{Choice, contents, read};
use twinlag_record::{Record, Selection};

#[test]
fn units_period_and_offset_are_those_of_the_waveform() {
    let table = check("segments.tdms", &Choice::default());
    assert!(notes(&table).contains("read as a TDMS file, version"), "{}", notes(&table));
    let group = &contents(path("segments.tdms")).expect("sound").groups[0];
    assert_eq!((group.period_s, group.start_ns, group.rows), (Some(0.002), Some(1_769_853_600_000_000_000), 40));
}

/// A reader that takes the first chunk of a segment alone loses three quarters of the samples.
#[test]
fn all_chunks_of_a_segment_are_read() {
    assert_eq!(check("chunks.tdms", &Choice::default()).rows(), 40);
}

#[test]
fn interleaved_samples_are_told_apart() {
    check("interleaved.tdms", &Choice::default());
}

#[test]
fn a_channel_of_stamps_is_the_time() {
    let table = check("stamps.tdms", &Choice::default());
    let record = Record::from_table(&table, &Selection::default()).expect("a record");
    assert_eq!(record.time_s[39], 9.75);
}

#[test]
fn counts_that_are_still_to_be_scaled_are_refused() {
    let error = read(path("unscaled.tdms"), &Choice { group: Some("daq".to_owned()), ..Choice::default() });
    let text = error.expect_err("counts are no temperatures").to_string();
    assert!(
        text.contains("channel 'T1' of group 'daq' has counts that are still to be scaled (Thermocouple)"),
        "{text}"
    );
    assert!(text.contains("write scaled values"), "{text}");
}

#[test]
fn cut_off_files_are_refused() {
    for name in ["segments.tdms", "chunks.tdms", "interleaved.tdms", "stamps.tdms"] {
        assert_cuts_are_refused(name, &Choice::default());
    }
}

#[test]
fn damaged_files_are_survived() {
    for name in ["segments.tdms", "chunks.tdms", "interleaved.tdms", "stamps.tdms", "unscaled.tdms"] {
        assert_flips_are_survived(name, &Choice::default());
    }
}
