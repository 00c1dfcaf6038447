//! A measured flow: time constants that go with a power of it.

use crate::common::{NOISE_K, PERIOD_S, SAMPLES, SEED, TAU_S, found, recovers, told, turbulence};
use twinlag_diagnose::{Identifier, KnownEffect, ModelError, Observations, Settings, Stretch, Verdict, fit_with};
use twinlag_signal::{Flow, FlowSine, Gas, Noise, Record, Rig, Sensor};

/// A rig whose time constants fall with the root of the velocity, from 0.7 to 1.3 times those at rest, in 1.7 periods.
fn record(column: impl Fn(f64) -> f64) -> Result<Observations, ModelError> {
    let sensors = [Sensor::new("T1", TAU_S[0]), Sensor::new("T2", TAU_S[1])].map(|mut s| {
        s.noise = Some(Noise::white(NOISE_K));
        s
    });
    let flow = flow();
    let rig = Rig::new(SEED, Record::new(SAMPLES, PERIOD_S), Gas::new(300.0, turbulence()), sensors).expect("valid");
    let simulated = rig.with_flow(flow).expect("valid").simulate().expect("finite");
    let velocity = simulated.time_s.iter().map(|t| column(flow.factor(*t))).collect();
    let stretch = Stretch::new(simulated.time_s, [simulated.t1_c, simulated.t2_c]).with_flow(velocity);
    Observations::new(vec![stretch], Some(PERIOD_S))
}

fn flow() -> Flow {
    Flow::Sine(FlowSine::new(0.3, 1.8, 0.4))
}

/// Time constants at the geometric mean of the velocity, s.
fn truth_s() -> [f64; 2] {
    let logs: f64 = (0..SAMPLES).map(|k| flow().factor(k as f64 * PERIOD_S).ln()).sum();
    TAU_S.map(|tau_s| tau_s * (logs / SAMPLES as f64).exp())
}

#[test]
fn the_power_of_a_measured_velocity_is_found() {
    let observations = record(|factor| 8.0 / (factor * factor)).expect("positive");
    let d = found(&observations);
    let told = told(&d);
    assert_eq!(d.verdict, Verdict::Explained, "{told}");
    let [effect] = &d.effects[..] else { panic!("{told}") };
    assert_eq!(effect.effect, Identifier::VARYING_TIME_CONSTANT, "{told}");
    let [exponent, mean] = &effect.parameters[..] else { panic!("{told}") };
    let error = exponent.standard_error.expect("a fitted number has one");
    assert_eq!((exponent.name.as_str(), mean.name.as_str()), ("exponent", "mean_flow"));
    // Factors of the time constants are the inverse root of the velocity. To rounding of some thousand logarithms.
    let factor = truth_s()[0] / TAU_S[0];
    assert!((mean.value * factor * factor / 8.0 - 1.0).abs() < 1e-12, "{}", mean.value);
    assert!((exponent.value + 0.5).abs() < 4.0 * error && error < 0.05, "{told}");
    recovers(&d.last, truth_s(), &told);

    // The same with the exponent known.
    let known = KnownEffect {
        effect: Identifier::VARYING_TIME_CONSTANT,
        channel: None,
        parameters: vec![("exponent".into(), -0.5)],
    };
    recovers(
        &fit_with(&observations, &Settings::default(), &[known]).expect("known").fit,
        truth_s(),
        "with the exponent known",
    );
}

/// A column that has nothing to do with the sensors is not used: what is found is a function of time.
#[test]
fn a_column_that_does_not_matter_is_not_used() {
    let observations = record(|factor| 1.0 + (50.0 * factor).sin().abs()).expect("positive");
    let d = found(&observations);
    let told = told(&d);
    assert_eq!(d.effects[0].effect, Identifier::VARYING_TIME_CONSTANT, "{told}");
    assert!(d.effects[0].parameters.iter().all(|p| p.name != "exponent"), "{told}");
}

#[test]
fn a_flow_that_stands_still_backwards_or_is_missing_is_refused() {
    for bad in [0.0, -1.0, f64::NAN] {
        assert_eq!(record(|factor| if factor > 1.2 { bad } else { 1.0 }), Err(ModelError::Flow), "{bad}");
    }
}
