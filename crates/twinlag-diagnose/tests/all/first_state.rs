//! The first state of a slow body: a support that had the temperature of the gas as the record began, and one that had not. The rig is
//! that of `twinlag-signal`, which integrates the support in continuous time from the gas of the moment on.

use std::ops::ControlFlow;

use twinlag_diagnose::{
    Diagnosis, FirstStateChoice, Found, Identifier, Observations, Settings, Stretch, Verdict, diagnose,
    diagnose_records,
};
use twinlag_signal::{Gas, Noise, Record, Rig, Sensor, Signal, SlowMode, Turbulence};

const TAU_S: [f64; 2] = [0.05, 0.2];
const SHARE: f64 = 0.1;
/// A fifth of the record.
const SLOW_S: f64 = 6.0;

/// - `settled_s`: how long the sensors have been in the gas when the record begins, in equilibrium with it before
fn record(seed: u64, settled_s: f64) -> Observations {
    let mut sensors = [0, 1].map(|i| Sensor::new(format!("T{}", i + 1), TAU_S[i]));
    sensors.iter_mut().for_each(|s| s.noise = Some(Noise::white(0.05)));
    sensors[1].slow_mode = Some(SlowMode { fraction: SHARE, time_constant_s: SLOW_S });
    let gas = Gas::new(300.0, Signal::Turbulence(Turbulence { std_k: 8.0, corner_hz: 0.1, cutoff_hz: 20.0 }));
    let mut form = Record::new(3000, 0.01);
    form.settle_s = Some(settled_s);
    let record = Rig::new(seed, form, gas, sensors).expect("a rig").simulate().expect("a record");
    let stretch = Stretch::new(record.time_s, [record.t1_c, record.t2_c]);
    Observations::new(vec![stretch], Some(0.01)).expect("a record")
}

fn diagnosed(observations: &Observations) -> Diagnosis {
    let watch = |_: &str, _, _| ControlFlow::Continue(());
    diagnose(observations, &Settings::default(), &watch).expect("a record that can be diagnosed")
}

/// The slow mode of an explained record, both of whose numbers are within four standard errors of the truth.
fn slow_mode(diagnosis: &Diagnosis) -> &Found {
    assert_eq!(diagnosis.verdict, Verdict::Explained, "{:#?}", diagnosis.effects);
    let [found] = &diagnosis.effects[..] else { panic!("{:#?}", diagnosis.effects) };
    assert_eq!(found.effect, Identifier::SLOW_MODE);
    for (number, truth) in found.parameters.iter().zip([SHARE, SLOW_S]) {
        let error = number.standard_error.expect("a fitted number has one");
        assert!((number.value - truth).abs() < 4.0 * error, "{number:?}, and it is {truth}");
    }
    found
}

/// A body that has been in the gas for four of its time constants has one of many temperatures, and is seen not to have had that of the
/// gas; with that, its numbers would be others.
#[test]
fn a_body_that_has_followed_the_gas_may_have_begun_anywhere() {
    for seed in 1..4 {
        let diagnosis = diagnosed(&record(seed, 4.0 * SLOW_S));
        let slow = slow_mode(&diagnosis);
        let first = slow.first_state.as_ref().expect("both were tried");
        assert_eq!(first.choice, FirstStateChoice::Free, "{first}");
        assert!(first.equilibrium_log_odds_nats < -(20.0_f64).ln(), "{first}");
        let far = |i: usize| {
            let (kept, other) = (&slow.parameters[i], &first.otherwise[i]);
            (kept.value - other.value).abs() > 2.0 * kept.standard_error.expect("a fitted number has one")
        };
        assert!(far(0) || far(1), "{first}");
    }
}

/// Most bodies that began in equilibrium are seen to. What is known more makes no number less certain: the second derivatives that errors
/// come from are those at another point, which differ by about the inverse root of 3000 residuals, two per cent.
#[test]
fn a_body_in_equilibrium_is_seen_to_be() {
    let seen: Vec<bool> = (1..5)
        .map(|seed| {
            let diagnosis = diagnosed(&record(seed, 0.0));
            let slow = slow_mode(&diagnosis);
            let first = slow.first_state.as_ref().expect("both were tried");
            let is_seen = first.choice == FirstStateChoice::Equilibrium;
            if is_seen {
                let error = |number: &twinlag_diagnose::Value| number.standard_error.expect("a fitted number has one");
                for (kept, other) in slow.parameters.iter().zip(&first.otherwise) {
                    assert!(error(kept) < 1.02 * error(other), "{first}");
                    assert!((kept.value - other.value).abs() < 3.0 * error(other), "{first}");
                }
            }
            is_seen
        })
        .collect();
    // Three in four: of the others the odds stay below those that count.
    assert!(seen.iter().filter(|is| **is).count() >= 3, "{seen:?}");
}

/// Each of several records has a first state of its own.
#[test]
fn of_several_records_each_began_somewhere() {
    let watch = |_: &str, _, _| ControlFlow::Continue(());
    let choice = |settled_s: [f64; 2]| {
        let records = [record(11, settled_s[0]), record(12, settled_s[1])];
        let joint = diagnose_records(&records, &Settings::default(), &watch).expect("two records");
        let first = slow_mode(&joint.diagnosis).first_state.as_ref().expect("both were tried");
        assert_eq!(first.otherwise.len(), 2, "{first}");
        first.choice
    };
    assert_eq!(choice([0.0, 0.0]), FirstStateChoice::Equilibrium);
    assert_eq!(choice([0.0, 4.0 * SLOW_S]), FirstStateChoice::Free);
}
