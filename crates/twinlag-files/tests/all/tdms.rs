//! TDMS files of npTDMS.

use crate::common::{assert_cuts_are_refused, assert_flips_are_survived, assert_near, check, expected, notes, path};
use twinlag_files::{Choice, contents, read};
use twinlag_record::{Record, Selection};

/// Files that are read.
const SOUND: [&str; 7] =
    ["segments.tdms", "chunks.tdms", "interleaved.tdms", "stamps.tdms", "big_endian.tdms", "scales.tdms", "daqmx.tdms"];

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
fn the_high_byte_may_stand_first() {
    check("big_endian.tdms", &Choice::default());
}

/// Newton's steps and the library's root finder end within rounding of some tens of °C.
const ROUNDING_K: f64 = 1e-10;

/// Of six laws, npTDMS applies each.
#[test]
fn counts_are_scaled_by_the_laws_in_the_file() {
    let table = read(path("scales.tdms"), &Choice::default()).expect("scales that are known");
    assert_near(&table, &expected("scales.tdms"), ROUNDING_K);
    for scaled in
        ["'resistance' scaled as the file says: linear, resistance", "'divider', 'current' scaled as the file says"]
    {
        assert!(notes(&table).contains(scaled), "{}", notes(&table));
    }
}

/// Rows of the counts of two thermocouples and their cold junction, in chunks of which the last is short.
#[test]
fn a_log_of_daqmx_gives_temperatures_of_thermocouples() {
    let table = read(path("daqmx.tdms"), &Choice::default()).expect("counts with their scales");
    assert_near(&table, &expected("daqmx.tdms"), ROUNDING_K);
    let laws = "counts of 'T1', 'T2' scaled as the file says: linear, resistance thermometer, \
                voltage of the cold junction, thermocouple type K";
    assert!(notes(&table).contains(laws), "{}", notes(&table));
}

#[test]
fn counts_that_make_no_temperature_are_refused() {
    let reason = "T1 (its samples are counts that cannot be scaled: its scale is of kind 'Strain'";
    for (group, said) in [(None, "has no group with rows of numbers"), (Some("daq"), "no channel of this group")] {
        let choice = Choice { group: group.map(str::to_owned), ..Choice::default() };
        let text = read(path("strain.tdms"), &choice).expect_err("a bridge is no thermometer").to_string();
        assert!(text.contains(said) && text.contains(reason), "{text}");
    }
}

#[test]
fn cut_off_files_are_refused() {
    for name in SOUND {
        assert_cuts_are_refused(name, &Choice::default());
    }
}

#[test]
fn damaged_files_are_survived() {
    for name in SOUND.into_iter().chain(["strain.tdms"]) {
        assert_flips_are_survived(name, &Choice::default());
    }
}
