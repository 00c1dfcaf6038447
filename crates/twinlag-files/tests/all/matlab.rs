//! MATLAB 5 files of SciPy.

use crate::common::{assert_cuts_are_refused, assert_flips_are_survived, check, notes};
use twinlag_files::Choice;

#[test]
fn vectors_are_channels_and_what_is_left_out_is_said() {
    let table = check("vectors.mat", &Choice::default());
    assert!(notes(&table).contains("2 variables were left out"), "{}", notes(&table));
}

#[test]
fn a_rate_or_a_period_gives_the_time() {
    check("rate.mat", &Choice::default());
    check("columns.mat", &Choice::default());
}

/// A file that is cut off between two arrays is a smaller one, since nothing says how many there
/// are: the lengths that are tried lie elsewhere.
#[test]
fn cut_off_files_are_refused() {
    for name in ["vectors.mat", "columns.mat"] {
        assert_cuts_are_refused(name, &Choice::default());
    }
}

#[test]
fn damaged_files_are_survived() {
    for name in ["vectors.mat", "rate.mat", "columns.mat"] {
        assert_flips_are_survived(name, &Choice::default());
    }
}
