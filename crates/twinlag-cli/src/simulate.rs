//! `twinlag simulate SPEC.toml --out OUT.csv`.

use std::io::{BufWriter, Write, stdout};
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;
use twinlag::record::{Decimals, write_csv};
use twinlag::signal::{Rig, Simulated};

use crate::arguments::Simulate;
use crate::console::Console;
use crate::failure::Failure;
use crate::output::{self, UntilClosed};
use crate::print;
use crate::progress::Progress;

/// What `twinlag simulate` prints with --json.
#[derive(Serialize, JsonSchema)]
pub(crate) struct Simulation {
    /// `twinlag.simulation/1`.
    schema: &'static str,
    /// File of the record.
    out: PathBuf,
    /// Number of samples.
    samples: usize,
    /// Names of the channels.
    channels: [String; 2],
    /// Description of the rig, with the keys of its file.
    rig: Value,
    /// Program that made the record.
    made_by: Program,
}

/// A program and its version.
#[derive(Serialize, JsonSchema)]
struct Program {
    /// Name of the program.
    program: &'static str,
    /// Version of the program.
    version: &'static str,
}

pub(crate) fn run(command: &Simulate, console: Console) -> Result<u8, Failure> {
    if output::is_same(&command.spec, &command.out) {
        return Err(Failure::Usage(format!("{} is the rig itself: choose another name", command.out.display())));
    }
    let views = output::Views::default();
    let to_stdout = output::check_data(&command.spec, None, &command.out, &views, command.force, console)?;
    let mut rig = read(&command.spec)?;
    if let Some(seed) = command.seed {
        rig = rig.with_seed(seed);
    }
    let record = {
        let _progress = Progress::start(console, format!("simulating {} samples", rig.record().samples));
        rig.simulate().map_err(|error| Failure::File(format!("{}: {error}", command.spec.display())))?
    };
    if to_stdout {
        write(&mut UntilClosed::new(stdout().lock()), &record)?;
    } else {
        output::replace(&command.out, |file| write(&mut BufWriter::new(file), &record))?;
    }
    if console.json {
        print::json(&Simulation {
            schema: "twinlag.simulation/1",
            out: command.out.clone(),
            samples: record.time_s.len(),
            channels: record.channels.clone(),
            rig: serde_json::to_value(&rig).map_err(|error| Failure::Other(error.to_string()))?,
            made_by: Program { program: "twinlag", version: env!("CARGO_PKG_VERSION") },
        })?;
    } else if !to_stdout {
        let (out, period_s) = (command.out.display(), rig.record().sample_period_s);
        console.note(|| format!("{out}: {} samples, {period_s} s apart", record.time_s.len()));
    }
    Ok(0)
}

/// Reads the rig in `spec`; relative paths in it are relative to its folder.
pub(crate) fn read(spec: &Path) -> Result<Rig, Failure> {
    let name = spec.display();
    let text =
        std::fs::read_to_string(spec).map_err(|error| Failure::File(format!("{name}: cannot be read: {error}")))?;
    let rig: Rig = toml::from_str(&text).map_err(|error| Failure::File(format!("{name}: {error}")))?;
    Ok(rig.with_base_dir(spec.parent().unwrap_or(Path::new(""))))
}

fn write(out: &mut impl Write, record: &Simulated) -> Result<(), Failure> {
    let mut columns: Vec<(&str, &[f64])> =
        vec![("time_s", &record.time_s), ("T1", &record.t1_c), ("T2", &record.t2_c), ("Tref", &record.gas_c)];
    columns.extend(record.velocity_m_per_s.as_deref().map(|velocity| ("velocity_m_s", velocity)));
    write_csv(out, &columns, Decimals::Shortest).map_err(twinlag::Error::from)?;
    Ok(())
}
