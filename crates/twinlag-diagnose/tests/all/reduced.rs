//! That a calibration loses a curvature which stood in for an effect that was found later. The rig is that of `twinlag-signal`, which
//! shares no code with the models that are fitted.

use std::ops::ControlFlow;

use twinlag_diagnose::{Identifier, Move, Observations, Settings, Stretch, Verdict, diagnose};
use twinlag_signal::{Engine, Gas, Noise, Record, Rig, Sensor, Signal};

/// A gain beside a delay, in an engine whose flanks are steep on one side: with two lags alone the delay looks like a curvature.
#[test]
fn a_curvature_goes_once_the_delay_is_there() {
    let mut sensors = [0.025, 0.11].map(|tau_s| Sensor::new(format!("{tau_s}"), tau_s));
    sensors.iter_mut().for_each(|s| s.noise = Some(Noise::white(0.4)));
    (sensors[1].gain, sensors[1].delay_s) = (0.98, 0.007);
    let engine = Engine {
        amplitude_k: 60.0,
        frequency_hz: 3.0,
        amplitude_relative_std: 0.2,
        period_relative_std: 0.03,
        rise_fraction: 0.08,
        decay_fraction: 0.25,
    };
    let gas = Gas::new(600.0, Signal::Engine(engine));
    let rig = Rig::new(5, Record::new(4000, 0.005), gas, sensors).expect("a rig");
    let record = rig.simulate().expect("a record");
    let stretch = Stretch::new(record.time_s, [record.t1_c, record.t2_c]);
    let observations = Observations::new(vec![stretch], Some(0.005)).expect("a record");
    let watch = |_: &str, _, _| ControlFlow::Continue(());
    let diagnosis = diagnose(&observations, &Settings::default(), &watch).expect("a record that can be diagnosed");
    assert_eq!(diagnosis.verdict, Verdict::Explained, "{:#?}", diagnosis.moves);
    let reduced = diagnosis.moves.iter().filter(|m| matches!(m, Move::Reduce { .. })).count();
    assert!(reduced > 0, "{:#?}", diagnosis.moves);
    let calibration = diagnosis.effects.iter().find(|e| e.effect == Identifier::CALIBRATION).expect("named");
    let evidence = calibration.evidence.expect("inferred");
    assert_eq!(calibration.parameters.len(), evidence.dof, "{:#?}", calibration.parameters);
    assert!(calibration.parameters.iter().all(|p| !p.name.starts_with("curvature")), "{:#?}", calibration.parameters);
}
