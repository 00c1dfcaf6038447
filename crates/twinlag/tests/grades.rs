//! What is not given because the record does not determine it.

mod common;

use common::read;
use twinlag::diagnosis::Grade;
use twinlag::signal::undeclared::{GasKind, Kind, undeclared};
use twinlag::{DiagnoseOptions, diagnose};

/// Failed: of a second of plunges neither time constant is determined, and the difference of where the fit ended in their valley,
/// 0.003 ± 0.006 s in place of 0.141 s, was go.
#[test]
fn the_difference_of_a_place_in_a_valley_is_not_given() {
    let drawn = undeclared(&[Kind::None], 1.0, Some(GasKind::Plunge), 1_813_701).expect("a rig");
    let mut sampling = drawn.rig.record().clone();
    sampling.samples = 1000;
    let rig = drawn.rig.with_record(sampling).expect("a sound rig");
    let answer = diagnose(&read(&rig), &DiagnoseOptions::default()).expect("a sound question");
    assert!(answer.last.sensors.iter().all(|sensor| sensor.time_constant_s.is_none()));
    let difference = &answer.last.time_constant_difference_s;
    assert_eq!((difference.value, difference.judgement.grade), (None, Grade::NoGo), "{difference:?}");
}
