//! What is not given because the record does not determine it.

use twinlag::diagnosis::Grade;
use twinlag::record::{Channels, Record, SamplingChoice};
use twinlag::signal::undeclared::{GasKind, Kind, undeclared};
use twinlag::{DiagnoseOptions, diagnose};

/// Failed: of a second of plunges neither time constant is determined, and the difference of where the fit ended in their valley,
/// 0.003 ± 0.006 s in place of 0.141 s, was go.
#[test]
fn the_difference_of_a_place_in_a_valley_is_not_given() {
    let drawn = undeclared(&[Kind::None], 1.0, Some(GasKind::Plunge), 1_813_701).expect("a rig");
    let mut sampling = drawn.rig.record().clone();
    sampling.samples = 1000;
    let simulated = drawn.rig.with_record(sampling).and_then(|rig| rig.simulate()).expect("a sound rig");
    let channels = Channels {
        source: "a rig".into(),
        names: simulated.channels,
        time_s: simulated.time_s,
        t1_c: simulated.t1_c,
        t2_c: simulated.t2_c,
        reference_c: None,
    };
    let record = Record::from_channels(channels, SamplingChoice::Auto).expect("a sound record");
    let answer = diagnose(&record, &DiagnoseOptions::default()).expect("a sound question");
    assert!(answer.last.sensors.iter().all(|sensor| sensor.time_constant_s.is_none()));
    let difference = &answer.last.time_constant_difference_s;
    assert_eq!((difference.value, difference.judgement.grade), (None, Grade::NoGo), "{difference:?}");
}
