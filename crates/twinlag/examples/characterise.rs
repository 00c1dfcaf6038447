//! Both time constants from vectors that are already in memory, with every estimator there is.
//!
//! `cargo run --release -p twinlag --example characterise`

use twinlag::record::{Channels, Record, SamplingChoice};
use twinlag::signal::{Engine, Gas, Noise, Record as Sampling, Rig, Sensor, Signal};
use twinlag::{Estimator, Options, characterise};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // A made-up pair of thermocouples in an engine's exhaust; put your own vectors in the place of `simulated`.
    let mut sensors = [Sensor::new("fine", 0.024), Sensor::new("coarse", 0.117)];
    for sensor in &mut sensors {
        sensor.noise = Some(Noise::white(1.5));
    }
    let mut engine = Engine::new(60.0, 8.0);
    engine.amplitude_relative_std = 0.2;
    engine.period_relative_std = 0.03;
    let simulated =
        Rig::new(7, Sampling::new(2500, 0.002), Gas::new(450.0, Signal::Engine(engine)), sensors)?.simulate()?;

    let record = Record::from_channels(
        Channels {
            source: "vectors".into(),
            names: simulated.channels,
            time_s: simulated.time_s,
            t1_c: simulated.t1_c,
            t2_c: simulated.t2_c,
            reference_c: None,
        },
        SamplingChoice::Auto,
    )?;
    println!("true: 0.024 and 0.117 s");
    for estimator in Estimator::ALL {
        let answer = characterise(&record, &Options { estimator, ..Options::default() })?;
        let text: Vec<String> = answer
            .sensors
            .iter()
            .map(|s| match (s.time_constant_s, s.interval_95_s) {
                (Some(tau), Some([low, high])) => format!("{tau:.4} s [{low:.4}, {high:.4}]"),
                _ => "not determined".into(),
            })
            .collect();
        println!("{:16} {}", estimator.name(), text.join("   "));
    }
    Ok(())
}
