//! `twinlag demo`: simulates a built-in rig with an effect unknown to the estimator, and diagnoses
//! the record.

use twinlag::DiagnoseOptions;
use twinlag::record::{Channels, Record, SamplingChoice};
use twinlag::signal::Rig;

use crate::arguments::Demo;
use crate::console::Console;
use crate::diagnose::{diagnose, exit_code};
use crate::failure::Failure;
use crate::print;

const RIG: &str = include_str!("demo.toml");

pub(crate) fn run(command: &Demo, console: Console) -> Result<u8, Failure> {
    let mut rig: Rig = toml::from_str(RIG).expect("the embedded rig is valid");
    if let Some(seed) = command.seed {
        rig = rig.with_seed(seed);
    }
    let simulated = rig.simulate().map_err(twinlag::Error::from)?;
    let channels = Channels {
        source: "built-in rig".into(),
        names: simulated.channels,
        time_s: simulated.time_s,
        t1_c: simulated.t1_c,
        t2_c: simulated.t2_c,
        reference_c: Some(simulated.gas_c),
    };
    let record = Record::from_channels(channels, SamplingChoice::Auto)?;
    if !console.json && !console.quiet {
        eprintln!("# the rig: two thermocouples in an engine's exhaust; the estimator knows none of this");
        RIG.lines().filter(|l| !l.starts_with('#') && !l.is_empty()).for_each(|l| eprintln!("#   {l}"));
    }
    let answer = diagnose(&record, &DiagnoseOptions::default(), console)?;
    print::diagnosis(&answer, console)?;
    if !console.json {
        println!();
        for (sensor, truth) in answer.last.sensors.iter().zip(rig.sensors()) {
            let inside = match sensor.interval_95_s {
                Some([low, high]) if (low..=high).contains(&truth.time_constant_s) => "inside the interval",
                Some(_) => "outside the interval, as happens once in twenty",
                None => "not determined",
            };
            println!("truth: {} {} s, {inside}", sensor.channel, truth.time_constant_s);
            if let Some(second_s) = truth.second_time_constant_s {
                println!("truth: {} has a second lag of {second_s} s", sensor.channel);
            }
        }
    }
    Ok(exit_code(&answer, false))
}
