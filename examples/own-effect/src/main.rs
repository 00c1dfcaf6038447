//! An effect of one's own in the closed loop, without a change to any of the crates: an amplifier that warms up. It is
//! found in a record that has it, and not in one that has not.
//!
//! `cargo run --release -p own-effect`

mod warm_up;

use std::ops::ControlFlow;

use twinlag_diagnose::{Diagnosis, Observations, Settings, Stretch, Verdict, diagnose};
use twinlag_signal::{Gas, Noise, Record, Rig, Sensor, Signal, Simulated, Turbulence};

use crate::warm_up::WARM_UP;

const PERIOD_S: f64 = 0.002;
const START_K: f64 = 4.0;
const SETTLING_S: f64 = 0.8;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let sensors = [("fine", 0.024), ("coarse", 0.117)].map(|(name, tau_s)| {
        let mut sensor = Sensor::new(name, tau_s);
        sensor.noise = Some(Noise::white(0.1));
        sensor
    });
    let gas = Gas::new(450.0, Signal::Turbulence(Turbulence { std_k: 15.0, corner_hz: 3.0, cutoff_hz: 200.0 }));
    let cold = Rig::new(1, Record::new(2500, PERIOD_S), gas, sensors)?.simulate()?;

    println!("an amplifier that is warm:");
    let without = diagnosed(&cold)?;
    report(&without);
    assert_eq!(without.verdict, Verdict::Adequate);

    println!("one that has been switched on, {START_K} K off and settling in {SETTLING_S} s:");
    let mut warming = cold;
    for (y, t) in warming.t2_c.iter_mut().zip(&warming.time_s) {
        *y += START_K * (-(t - warming.time_s[0]) / SETTLING_S).exp();
    }
    let with = diagnosed(&warming)?;
    report(&with);
    assert_eq!(with.effects.iter().map(|e| e.effect).collect::<Vec<_>>(), [WARM_UP]);
    for (parameter, truth) in with.effects[0].parameters.iter().zip([START_K, SETTLING_S]) {
        let error = parameter.standard_error.ok_or("both are determined")?;
        // Wrong by chance once in 15 000 records.
        assert!((parameter.value - truth).abs() < 4.0 * error, "{} is {}", parameter.name, parameter.value);
    }
    Ok(())
}

/// The diagnosis with the effects of the library and this one.
fn diagnosed(simulated: &Simulated) -> Result<Diagnosis, Box<dyn std::error::Error>> {
    let mut settings = Settings::default();
    settings.effects.push(WARM_UP);
    let stretch = Stretch::new(simulated.time_s.clone(), [simulated.t1_c.clone(), simulated.t2_c.clone()]);
    let observations = Observations::new(vec![stretch], Some(PERIOD_S))?;
    Ok(diagnose(&observations, &settings, &|_, _, _| ControlFlow::Continue(()))?)
}

fn report(diagnosis: &Diagnosis) {
    let [first, second] = diagnosis.last.time_constants.map(|t| t.value_s.unwrap_or(f64::NAN));
    println!("  {:?}, time constants {first:.4} and {second:.4} s", diagnosis.verdict);
    for effect in &diagnosis.effects {
        println!("  {}", effect.effect);
        for p in &effect.parameters {
            println!("    {} = {:.3} ± {:.3} {}", p.name, p.value, p.standard_error.unwrap_or(f64::NAN), p.unit);
        }
    }
}
