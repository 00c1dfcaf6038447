//! Tasks of the repository: `cargo xtask ci`, `cargo xtask book`, `cargo xtask experiment`, `cargo xtask measured DIR`,
//! `cargo xtask data DIR`, `cargo xtask bench`, `cargo xtask fleet DIR`, `cargo xtask faults`, `cargo xtask instructions`, `cargo xtask cluster`,
//! `cargo xtask profile`, `cargo xtask report`, `cargo xtask web`, `cargo xtask python`, `cargo xtask dist`.

mod bench;
mod book;
mod ci;
mod cluster;
mod dist;
mod experiment;
mod faults;
mod fleet;
mod instructions;
mod measured;
mod profile;
mod python;
mod report;
mod web;

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use anyhow::{Context, Result, ensure};
use clap::{Parser, Subcommand};

/// Tasks of the repository.
#[derive(Parser)]
struct Arguments {
    #[command(subcommand)]
    task: Task,
}

#[derive(Subcommand)]
enum Task {
    /// What must hold before a change lands: tests, format, lints, documentation, quick runs.
    Ci {
        /// Leaves the tests out: they have just been run.
        #[arg(long)]
        tested: bool,
        /// What must hold before a release as well: features one by one, the oldest compiler and WebAssembly where they are installed,
        /// a profile, and reports in a browser, which takes Chromium and Node.js.
        #[arg(long)]
        full: bool,
    },
    /// Builds the book into `target/book` and follows its links.
    Book,
    /// Runs every record of a folder of measured data and holds what is found against what is known of them.
    Measured {
        /// The folder. It is no part of the repository.
        dir: PathBuf,
        /// A folder with several records of each instrument, which are diagnosed together.
        #[arg(long, value_name = "DIR")]
        campaigns: Option<PathBuf>,
        /// Writes the table and the pictures of the book's chapter on them as well.
        #[arg(long)]
        write: bool,
    },
    /// Fetches the measured records that source distributions of Python packages carry, for `measured`; needs Python with NumPy
    /// and SciPy.
    Data {
        /// Where they go.
        dir: PathBuf,
        /// Overwrites what is there.
        #[arg(long)]
        force: bool,
    },
    /// The Monte-Carlo experiments: list, run, check, merge.
    #[command(subcommand)]
    Experiment(experiment::Task),
    /// Times the fits, beside what a user would otherwise write where Python with SciPy is at hand.
    Bench(bench::Bench),
    /// Simulates a fleet of records of many rigs, one file in ten damaged, to measure `twinlag batch` on.
    Fleet(fleet::Fleet),
    /// Runs a study and a batch on Slurm, `HyperQueue`, GNU parallel and an object store on this machine, and kills nodes: the bytes have to
    /// be the same.
    Cluster(cluster::Cluster),
    /// Kills the program at moments all over its runs, fills the disk and damages what it keeps: nothing may be lost or half written.
    Faults(faults::Faults),
    /// Compares answers with those of an older processor, by qemu-x86_64: they may differ by a thousandth of a standard error.
    Instructions(instructions::Instructions),
    /// Samples where the time of each verb goes, and writes the book's page on it.
    Profile(profile::Profile),
    /// Makes a release archive for a platform, the same to the byte whenever it is made.
    Dist(dist::Dist),
    /// Builds the Python package as a wheel, installs it in an empty environment and tests it there; needs Python with `venv`.
    Python(python::Python),
    /// Opens reports in a browser: console, accessibility, keyboard, print; needs Chromium and Node.js.
    Report(report::Report),
    /// Builds the page for a browser, and drives it; needs the target wasm32-unknown-unknown, Chromium and Node.js.
    Web(web::Web),
}

fn main() -> ExitCode {
    // As the program does: benches measure what its users have.
    twinlag_memory::give_back_large();
    let result = match Arguments::parse().task {
        Task::Ci { tested, full } => ci::run(tested, full),
        Task::Book => book::run(),
        Task::Measured { dir, campaigns, write } => measured::run(&dir, campaigns.as_deref(), write),
        Task::Data { dir, force } => data(&dir, force),
        Task::Bench(arguments) => bench::run(&arguments),
        Task::Fleet(arguments) => fleet::run(&arguments),
        Task::Cluster(arguments) => cluster::run(&arguments),
        Task::Faults(arguments) => faults::run(&arguments),
        Task::Instructions(arguments) => instructions::run(&arguments),
        Task::Profile(arguments) => profile::run(&arguments),
        Task::Python(arguments) => python::run(&arguments),
        Task::Report(arguments) => report::run(&arguments),
        Task::Web(arguments) => web::run(&arguments),
        Task::Dist(arguments) => dist::run(&arguments),
        Task::Experiment(task) => experiment::run(task),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("xtask: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn data(dir: &Path, force: bool) -> Result<()> {
    let status = Command::new("python3")
        .arg(root()?.join("xtask/data/fetch.py"))
        .arg(dir)
        .args(force.then_some("--force"))
        .status()
        .context("python3 could not be started: the script needs Python with NumPy and SciPy")?;
    ensure!(status.success(), "the records were not fetched");
    Ok(())
}

/// The top of the repository.
fn root() -> Result<&'static Path> {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().ok_or_else(|| anyhow::anyhow!("xtask lies in the repository"))
}
