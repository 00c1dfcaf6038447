//! `twinlag study plan PLAN.toml`: what a study will take, from a few of its trials.

use std::num::{NonZeroU32, NonZeroUsize};
use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;
use twinlag_cluster::Work;
use twinlag_experiment::Experiment;
use twinlag_study::{PilotCost, PilotOptions, PilotTime, Study as _, pilot};

use crate::columns::columns;
use crate::console::Console;
use crate::failure::Failure;
use crate::submission;
use crate::{print, progress};

/// How many times the upper end of the longest shard the limit is; chosen, since processors may be slower than in the pilot: the same machine
/// took 44 and then 34 seconds for the same trials.
const LIMIT_FACTOR: f64 = 2.0;

/// Most tasks of an array of jobs, where the configuration of Slurm says nothing else (`MaxArraySize` is 1001).
const SLURM_TASKS: u64 = 1001;

#[derive(Debug, Args)]
pub(crate) struct Planning {
    /// The plan, a TOML file; the book's chapter Experiments describes it.
    plan: PathBuf,
    /// Processors of each shard; the pilot runs on as many threads.
    #[arg(long, value_name = "N", default_value = "1")]
    cpus: NonZeroU32,
    /// How long a shard should take, in minutes.
    #[arg(long, value_name = "MINUTES", default_value = "30")]
    shard_minutes: NonZeroU32,
    /// How long the pilot should take, in seconds; six trials of each cell are run in any case.
    #[arg(long, value_name = "SECONDS", default_value = "20")]
    pilot_seconds: NonZeroU32,
}

/// What `twinlag study plan` prints with --json.
#[derive(Serialize, JsonSchema)]
pub(crate) struct StudyPlan {
    /// `twinlag.study-plan/1`.
    schema: &'static str,
    /// Number of cells.
    cells: usize,
    /// Number of trials of all cells together.
    trials: u64,
    /// Number of those that were run for this.
    pilot_trials: u64,
    /// Processors of each shard.
    cpus: u32,
    /// Processor time of all shards, h.
    core_hours: f64,
    /// 95 % interval of the processor time, h, at the speed that processors had in the pilot.
    core_hours_interval: [f64; 2],
    /// Most memory that the pilot had, bytes; null where the system does not say.
    peak_memory_bytes: Option<u64>,
    /// Recommended number of shards.
    shards: u64,
    /// Time of the shard that takes longest, min.
    longest_shard_min: f64,
    /// 95 % interval of that time, min, at the speed that processors had in the pilot.
    longest_shard_min_interval: [f64; 2],
    /// Recommended limit of the time of a shard, min.
    time_limit_min: u64,
    /// Expected bytes of all parts, if the numbers of the trials are normal.
    bytes: u64,
    /// Expected bytes of the largest part.
    largest_part_bytes: u64,
    /// What submits the study so, with the folder to be filled in.
    command: String,
}

pub(super) fn run(planning: &Planning, console: Console) -> Result<u8, Failure> {
    let (plan, _) = super::read(&planning.plan)?;
    let experiment =
        Experiment::new(&plan).map_err(|error| Failure::File(format!("{}: {error}", planning.plan.display())))?;
    let threads = NonZeroUsize::try_from(planning.cpus).unwrap_or(NonZeroUsize::MIN);
    let time = Duration::from_secs(planning.pilot_seconds.get().into());
    let cells = experiment.cells();
    let bar = progress::bar(console).with_message("cells");
    bar.set_length(cells as u64);
    let pilot = pilot(&experiment, PilotOptions { threads, time }, |done| {
        bar.set_position(done as u64);
    });
    bar.finish_and_clear();
    let pilot = pilot?;

    let core_s_of_shard = 60.0 * f64::from(planning.shard_minutes.get()) * f64::from(planning.cpus.get());
    let whole = pilot.cost(1);
    let wanted = (whole.total.s / core_s_of_shard).ceil() as u64;
    if wanted > Work::MAX_SHARDS {
        let hours = whole.total.s / 3600.0;
        return Err(Failure::Usage(format!(
            "{} h of processor time would be {wanted} shards, more than {}: choose a longer --shard-minutes, more --cpus, or fewer trials",
            number(hours),
            Work::MAX_SHARDS
        )));
    }
    let shards = wanted.clamp(1, pilot.blocks());
    let PilotCost { total, longest, bytes, largest_bytes } = pilot.cost(shards);
    let in_units = |PilotTime { s, interval_s }: PilotTime, unit_s: f64| (s / unit_s, interval_s.map(|s| s / unit_s));
    let (core_hours, core_hours_interval) = in_units(total, 3600.0);
    let (longest_shard_min, longest_shard_min_interval) = in_units(longest, 60.0);
    let time_limit_min = (LIMIT_FACTOR * longest_shard_min_interval[1]).ceil().max(1.0) as u64;
    let file = submission::text(&planning.plan)?;
    let file = shlex::try_quote(&file).map_err(|error| Failure::Usage(format!("{file}: {error}")))?;
    let command = format!(
        "twinlag study submit {file} --out DIR --engine slurm --shards {shards} --time-limit {time_limit_min} --cpus {}",
        planning.cpus
    );
    let answer = StudyPlan {
        schema: "twinlag.study-plan/1",
        cells,
        trials: experiment.trials() * cells as u64,
        pilot_trials: pilot.trials(),
        cpus: planning.cpus.get(),
        core_hours,
        core_hours_interval,
        peak_memory_bytes: peak_memory_bytes(),
        shards,
        longest_shard_min,
        longest_shard_min_interval,
        time_limit_min,
        bytes,
        largest_part_bytes: largest_bytes,
        command,
    };
    if console.json {
        print::json(&answer)?;
    } else {
        print::on_stdout(&answer.in_words())?;
    }
    if shards > SLURM_TASKS {
        console.note(|| {
            format!("Slurm takes {SLURM_TASKS} tasks of an array, or what its MaxArraySize says: a longer --shard-minutes gives fewer shards")
        });
    }
    Ok(0)
}

/// Most memory that this process has had, where the system says it as Linux does.
fn peak_memory_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(1024 * line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?)
}

impl StudyPlan {
    fn in_words(&self) -> String {
        let (low, high) = (self.core_hours_interval[0], self.core_hours_interval[1]);
        let [shortest, longest] = self.longest_shard_min_interval;
        let memory = self.peak_memory_bytes.map_or("unknown".to_owned(), megabytes);
        let rows = [
            ["trials", &format!("{} in {} cells; {} were run for this", self.trials, self.cells, self.pilot_trials)],
            [
                "processor time",
                &format!(
                    "{} h, 95 % {} to {} at the speed of this pilot",
                    number(self.core_hours),
                    number(low),
                    number(high)
                ),
            ],
            ["shards", &format!("{} of {} processors", self.shards, self.cpus)],
            [
                "longest shard",
                &format!("{} min, 95 % {} to {}", number(self.longest_shard_min), number(shortest), number(longest)),
            ],
            ["memory of this pilot", &memory],
            [
                "parts",
                &format!("about {} in all, the largest {}", megabytes(self.bytes), megabytes(self.largest_part_bytes)),
            ],
        ];
        let rows: Vec<_> = rows.iter().map(|row| row.map(str::to_owned).to_vec()).collect();
        columns(&rows, |_| true).into_iter().chain([self.command.clone(), String::new()]).collect::<Vec<_>>().join("\n")
    }
}

/// Three digits.
fn number(x: f64) -> String {
    let digits = if x > 0.0 { (2 - x.log10().floor() as i32).max(0) as usize } else { 0 };
    format!("{x:.digits$}")
}

fn megabytes(bytes: u64) -> String {
    format!("{} MB", number(bytes as f64 / 1e6))
}
