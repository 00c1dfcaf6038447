//! HDF5 files of h5py, MATLAB 7.3 among them.

use crate::common::{assert_cuts_are_refused, assert_flips_are_survived, check, notes, path};
use twinlag_files::{Choice, contents};

#[test]
fn attributes_say_units_missing_ones_scale_and_start() {
    let table = check("groups.h5", &Choice::default());
    assert!(notes(&table).contains("group 'rig/gas'"), "{}", notes(&table));
    assert_eq!(table.columns()[1].missing(), 2);
    let groups = contents(path("groups.h5")).expect("sound").groups;
    let gas = groups.iter().find(|group| group.name == "rig/gas").expect("there");
    assert_eq!(gas.start_ns, Some(1_769_853_600_000_000_000));
}

#[test]
fn marks_of_missing_values_are_as_the_values_are_stored() {
    let table = check("marks.h5", &Choice::default());
    assert_eq!(table.columns()[1].missing(), 1);
}

#[test]
fn fields_of_records_are_channels() {
    check("records.h5", &Choice::default());
}

#[test]
fn columns_of_a_matrix_are_channels_and_an_attribute_gives_the_time() {
    check("matrix.h5", &Choice::default());
}

#[test]
fn matlab_7_3_is_told_from_its_header() {
    let table = check("seven.mat", &Choice::default());
    assert!(notes(&table).contains("read as a MATLAB 7.3 file"), "{}", notes(&table));
}

#[test]
fn cut_off_files_are_refused() {
    for name in ["groups.h5", "records.h5", "matrix.h5", "seven.mat"] {
        assert_cuts_are_refused(name, &Choice::default());
    }
}

#[test]
fn damaged_files_are_survived() {
    for name in ["groups.h5", "records.h5", "matrix.h5", "seven.mat"] {
        assert_flips_are_survived(name, &Choice::default());
    }
}
