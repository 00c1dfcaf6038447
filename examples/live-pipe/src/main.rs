//! A logger writes rows into a pipe; each is answered before the next one comes: gas temperature and both time constants, while the flow
//! past the sensors falls. `logger | twinlag track - --live 1500 --out -` does the same from a shell.

use std::error::Error;
use std::io::{BufRead, BufReader, Write, pipe};
use std::thread;

use twinlag::record::{Decimals, Record, RowReader, Selection, Table, write_csv};
use twinlag::signal::{Flow, FlowStep, Gas, Noise, Record as Sampling, Rig, Sensor, Signal, Turbulence};
use twinlag::{Live, LiveOptions};

/// Rows that are waited for: they tell what sensors, noise and gas are like.
const START: usize = 1500;
/// One of so many answers is printed.
const EVERY: usize = 250;

fn main() -> Result<(), Box<dyn Error>> {
    let (from_logger, mut to_program) = pipe()?;
    let logged = logged()?;
    // What a logger does, at its own pace.
    let logger = thread::spawn(move || to_program.write_all(&logged));

    let mut lines = BufReader::new(from_logger).lines();
    let mut start = String::new();
    for line in lines.by_ref().take(1 + START) {
        start.push_str(&line?);
        start.push('\n');
    }
    let (table, selection) = (Table::read(start.as_bytes(), "the logger")?, Selection::default());
    let record = Record::from_table(&table, &selection)?;
    let mut reader = RowReader::after(&table, &selection)?;
    let mut live = Live::start(&record, &LiveOptions::default())?;
    for k in 0..record.len() {
        live.push(Some(record.time_s[k]), [Some(record.t1_c[k]), Some(record.t2_c[k])]);
    }

    println!("time (s)    gas (°C)         T1 (s)                     T2 (s)");
    for (k, line) in lines.enumerate() {
        // A row that cannot be read is one that is missing; blank lines and comments are none.
        let Some(row) = reader.read(&line?, 2 + START + k).unwrap_or(None) else { continue };
        let Some(now) = live.push(row.time_s, row.reading_c) else { continue };
        if k % EVERY == 0 {
            let tau = |i: usize| match (now.tau_s[i], now.tau_95_s[i]) {
                (Some(tau_s), Some([low_s, high_s])) => format!("{tau_s:.3} ({low_s:.3} to {high_s:.3})"),
                _ => "not determined".into(),
            };
            println!("{:8.2}    {:6.1} ± {:.1}    {}    {}", now.time_s, now.gas_c, now.gas_std_k, tau(0), tau(1));
        }
    }
    Ok(logger.join().map_err(|_| "the logger failed")??)
}

/// Two thermocouples in turbulence; at 25 s the flow falls, and both are 1.4 times as slow from then on.
fn logged() -> Result<Vec<u8>, Box<dyn Error>> {
    let sensor = |channel: &str, tau_s| {
        let mut sensor = Sensor::new(channel, tau_s);
        sensor.noise = Some(Noise::white(0.1));
        sensor
    };
    let signal = Signal::Turbulence(Turbulence { std_k: 15.0, corner_hz: 0.5, cutoff_hz: 45.0 });
    let rig =
        Rig::new(3, Sampling::new(4000, 0.01), Gas::new(300.0, signal), [sensor("T1", 0.12), sensor("T2", 0.45)])?;
    let record = rig.with_flow(Flow::Step(FlowStep::new(1.4, 25.0, 0.1)))?.simulate()?;
    let mut text = Vec::new();
    write_csv(
        &mut text,
        &[("time_s", &record.time_s), ("T1", &record.t1_c), ("T2", &record.t2_c)],
        Decimals::Shortest,
    )?;
    Ok(text)
}
