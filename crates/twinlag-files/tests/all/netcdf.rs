//! netCDF files of netCDF4, classic ones among them.

use crate::common::{assert_cuts_are_refused, assert_flips_are_survived, check, path};
use twinlag_files::{Choice, contents};
use twinlag_record::Column;

#[test]
fn missing_and_invalid_values_and_scales_are_those_of_the_attributes() {
    for name in ["classic.nc", "offset.nc", "four.nc"] {
        let table = check(name, &Choice::default());
        assert_eq!(table.columns().iter().map(Column::missing).collect::<Vec<_>>(), [0, 3, 1], "{name}");
        let group = &contents(path(name)).expect("sound").groups[0];
        assert_eq!((group.start_ns, group.rows), (Some(1_769_853_600_000_000_000), 40), "{name}");
    }
}

#[test]
fn marks_of_missing_values_are_as_the_values_are_stored() {
    for name in ["marks.nc", "marks4.nc"] {
        let table = check(name, &Choice::default());
        assert_eq!(table.columns().iter().map(Column::missing).collect::<Vec<_>>(), [0, 2, 6], "{name}");
    }
}

#[test]
fn places_along_a_second_dimension_are_channels_and_what_was_never_written_is_missing() {
    let table = check("stations.nc", &Choice::default());
    assert_eq!(table.columns()[1].missing(), 10);
}

#[test]
fn cut_off_files_are_refused() {
    for name in ["classic.nc", "offset.nc", "four.nc", "marks4.nc", "stations.nc"] {
        assert_cuts_are_refused(name, &Choice::default());
    }
}

#[test]
fn damaged_files_are_survived() {
    for name in ["classic.nc", "four.nc", "marks4.nc", "stations.nc"] {
        assert_flips_are_survived(name, &Choice::default());
    }
}
