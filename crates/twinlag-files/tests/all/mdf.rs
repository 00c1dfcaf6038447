//! MDF files of asammdf.

use crate::common::{assert_cuts_are_refused, assert_flips_are_survived, check, notes, path};
use twinlag_files::{Choice, FileError, contents, read};

#[test]
fn conversions_and_invalidation_bits_are_applied() {
    let table = check("plain.mf4", &Choice::default());
    assert_eq!(table.columns()[2].missing(), 4);
    assert!(notes(&table).contains("read as an MDF 4 file, version 4.10"), "{}", notes(&table));
}

#[test]
fn the_group_with_two_temperatures_is_taken_from_a_compressed_file() {
    let table = check("groups.mf4", &Choice::default());
    assert!(notes(&table).contains("group 'gas', the only one of 2 groups"), "{}", notes(&table));
    let speed =
        read(path("groups.mf4"), &Choice { group: Some("engine".to_owned()), ..Choice::default() }).expect("chosen");
    assert_eq!((speed.rows(), speed.columns()[1].name()), (80, "speed"));
}

#[test]
fn temperatures_in_groups_of_their_own_are_listed_and_joined_only_when_asked() {
    let error = read(path("apart.mf4"), &Choice::default()).expect_err("which of them?");
    assert!(matches!(error, FileError::SeveralGroups { .. }), "{error}");
    let text = error.to_string();
    assert!(text.contains("'ECU1': 40 rows, period 0.0078125 s") && text.contains("T2 [°C]"), "{text}");
    assert!(text.contains("choose one by its name") && text.contains("joined on the stamps of one"), "{text}");
    let on_the_faster = Choice { join: true, group: Some("ECU1".to_owned()), ..Choice::default() };
    let table = check("apart.mf4", &on_the_faster);
    assert!(notes(&table).contains("'T2' of group 'ECU2' interpolated linearly to the stamps of group 'ECU1'"));
    assert!(notes(&table).contains("group 'ECU2' has one sample for every 2 of group 'ECU1'"), "{}", notes(&table));
    let table = read(path("apart.mf4"), &Choice { join: true, ..Choice::default() }).expect("joined");
    assert_eq!(table.rows(), 18);
    assert!(notes(&table).contains("group 'ECU2', the one with the lowest sampling rate"), "{}", notes(&table));
    assert!(!notes(&table).contains("has one sample for"), "{}", notes(&table));
    let error =
        read(path("apart.mf4"), &Choice { group: Some("ECU3".to_owned()), ..Choice::default() }).expect_err("no such");
    assert!(error.to_string().contains("no group 'ECU3'; choose one of these by its name"), "{error}");
}

#[test]
fn the_group_is_taken_that_alone_has_the_channels() {
    let with = |names: &[&str]| {
        let channels = names.iter().map(|name| (*name).to_owned()).collect();
        read(path("apart.mf4"), &Choice { channels, ..Choice::default() })
    };
    for name in ["T2", "t2", "T2 [°C]"] {
        let table = with(&[name]).expect("one group has it");
        assert!(notes(&table).contains(&format!("group 'ECU2', the only one of 2 groups with '{name}'")));
    }
    assert!(matches!(with(&["T1", "T2"]), Err(FileError::SeveralGroups { .. })));
}

#[test]
fn mdf_3_is_read_through_its_own_entry() {
    let table = check("old.mdf", &Choice::default());
    assert!(notes(&table).contains("read as an MDF 3 file, version 3.30"), "{}", notes(&table));
}

#[test]
fn contents_have_names_units_rows_period_and_start() {
    let groups = contents(path("groups.mf4")).expect("sound").groups;
    assert_eq!(groups.iter().map(|group| group.rows).collect::<Vec<_>>(), [80, 40]);
    assert_eq!(groups[1].channels[1].unit, "K");
    assert_eq!(groups[1].start_ns, Some(1_769_853_600_000_000_000));
    let period_s = groups[0].period_s.expect("two stamps or more");
    // The mean of 79 steps of 0.005 s, each rounded to a double.
    assert!((period_s - 0.005).abs() < 1e-15, "{period_s}");
}

#[test]
fn cut_off_files_are_refused() {
    for name in ["plain.mf4", "groups.mf4", "old.mdf"] {
        assert_cuts_are_refused(name, &Choice::default());
    }
}

#[test]
fn damaged_files_are_survived() {
    for name in ["plain.mf4", "groups.mf4", "old.mdf"] {
        assert_flips_are_survived(name, &Choice::default());
    }
}

/// Failed: all of its readings were 0 °C.
#[test]
fn numbers_of_two_bytes_are_left_out_by_name() {
    let table = read(path("half.mf4"), &Choice::default()).expect("the other channel can be read");
    assert!(table.columns().iter().all(|column| column.name() != "T1"), "{:?}", table.columns().len());
    let said = "channel 'T1' was left out: its samples are floating-point numbers of 16 bits";
    assert!(notes(&table).contains(said), "{}", notes(&table));
}
