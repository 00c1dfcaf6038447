//! The Python package: built as a wheel, installed in an empty environment, and tried there.

mod stubs;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, ensure};
use clap::Args;

use crate::bench::scale::{Step, Verb, child, simulated};
use crate::report::target_dir;
use crate::root;

/// The Python that is taken where none is named.
pub(crate) const PYTHON: &str = "python3";

/// Rows of the record that is measured.
const LONG_ROWS: usize = 10_000_000;

/// Builds the wheel and tests it.
#[derive(Args, Debug)]
pub(crate) struct Python {
    /// The Python that the environments are made with.
    #[arg(long, default_value = PYTHON)]
    python: PathBuf,
    /// Tests a wheel that was built to find faults: with debug assertions and checks for overflow.
    #[arg(long)]
    debug: bool,
    /// Measures in place of the tests: how long it takes to import, eight threads, and a record of ten million samples beside what the
    /// library takes.
    #[arg(long, conflicts_with = "debug")]
    measure: bool,
    /// Writes the type stubs of the compiled part anew, in place of the tests.
    #[arg(long, conflicts_with_all = ["debug", "measure"])]
    stubs: bool,
}

impl Default for Python {
    fn default() -> Self {
        Self { python: PYTHON.into(), debug: false, measure: false, stubs: false }
    }
}

/// Builds the wheel from the sources, installs it in an empty environment, and runs its tests, its types and its stubs there.
pub(crate) fn run(Python { python, debug, measure, stubs }: &Python) -> Result<()> {
    let package = root()?.join("crates/twinlag-python");
    if *stubs {
        return stubs::write(&package);
    }
    let work = root()?.join("target/python");
    if work.exists() {
        fs::remove_dir_all(&work).with_context(|| format!("{} cannot be removed", work.display()))?;
    }
    let builder = Environment::new(python, &work.join("builder"))?;
    builder.install(&["maturin>=1.9.4,<2"])?;
    let wheels = work.join("wheels");
    let release: &[&str] = if *debug { &[] } else { &["--release"] };
    step(
        "the wheel",
        builder.program("maturin").arg("build").args(release).arg("--out").arg(&wheels).current_dir(&package),
    )?;
    let wheel = the_wheel(&wheels)?;
    println!("== {}: {} bytes", wheel.display(), fs::metadata(&wheel)?.len());

    let user = Environment::new(python, &work.join("user"))?;
    user.install(&[&wheel.display().to_string()])?;
    // Beside no other package but NumPy.
    let first = "import twinlag as tl; assert tl.characterise(tl.simulate(tl.EXAMPLE_RIG)).ok; print(tl.__version__)";
    step("the package alone", user.program("python").args(["-c", first]).current_dir(&work))?;
    if *measure {
        return measured(&user, &package, &work);
    }
    user.install(&[&format!("{}[test]", wheel.display())])?;
    let program = target_dir()?.join(if *debug { "debug/twinlag" } else { "release/twinlag" });
    step("the program of the same sources", Command::new("cargo").arg("build").args(release).current_dir(root()?))?;
    // The tests in a folder in which the sources of the package are not: what is tried is what was installed.
    let tests = package.join("tests");
    step(
        "tests",
        user.program("python")
            .args(["-m", "pytest", "-p", "no:cacheprovider"])
            .arg(&tests)
            .env("TWINLAG_PROGRAM", program)
            .current_dir(&work),
    )?;
    step(
        "examples of the documentation",
        user.program("python")
            .args(["-m", "pytest", "-p", "no:cacheprovider", "--doctest-modules", "--pyargs", "twinlag"])
            .current_dir(&work),
    )?;
    user.install(&[&format!("{}[notebooks]", wheel.display())])?;
    step(
        "notebooks",
        user.program("python")
            .args(["-m", "pytest", "-p", "no:cacheprovider", "--nbmake"])
            .arg(package.join("notebooks"))
            .current_dir(&work),
    )?;
    let settings = package.join("pyproject.toml");
    let checked = |arguments: &[&str]| {
        let mut command = user.program("python");
        command.arg("-m").args(arguments).arg(&settings).current_dir(&work);
        command
    };
    step("types", &mut checked(&["mypy", "--package", "twinlag", "--config-file"]))?;
    step("stubs", &mut checked(&["mypy.stubtest", "twinlag", "--mypy-config-file"]))?;
    stubs::check(&package)
}

/// Says what the package takes, and for a long record what the library takes.
fn measured(user: &Environment, package: &Path, work: &Path) -> Result<()> {
    let record = simulated(work, LONG_ROWS)?;
    step("the package", user.program("python").arg(package.join("benches/measure.py")).arg(&record).current_dir(work))?;
    let took = child(Step::Verb(Verb::Characterise), &record)?;
    println!("== the library: {}", serde_json::to_string(&took)?);
    Ok(())
}

/// An environment of its own, with `pip`.
struct Environment {
    folder: PathBuf,
}

impl Environment {
    fn new(python: &Path, folder: &Path) -> Result<Self> {
        step("an empty environment", Command::new(python).args(["-m", "venv"]).arg(folder))?;
        Ok(Self { folder: folder.to_owned() })
    }

    fn program(&self, name: &str) -> Command {
        let mut command = Command::new(self.folder.join(if cfg!(windows) { "Scripts" } else { "bin" }).join(name));
        command.env("VIRTUAL_ENV", &self.folder).env_remove("PYTHONPATH");
        command
    }

    fn install(&self, packages: &[&str]) -> Result<()> {
        step("pip install", self.program("python").args(["-m", "pip", "install", "--quiet"]).args(packages))
    }
}

fn the_wheel(folder: &Path) -> Result<PathBuf> {
    let is_wheel = |path: &PathBuf| path.extension().is_some_and(|ending| ending == "whl");
    let entries = fs::read_dir(folder).with_context(|| format!("{} cannot be read", folder.display()))?;
    let mut wheels = entries.filter_map(|entry| entry.ok().map(|entry| entry.path())).filter(is_wheel);
    wheels.next().with_context(|| format!("no wheel in {}", folder.display()))
}

fn step(name: &str, command: &mut Command) -> Result<()> {
    println!("== {name}: {command:?}");
    let start = Instant::now();
    let status = command.status().with_context(|| format!("{name}: could not be started"))?;
    ensure!(status.success(), "{name}: ended with {status}");
    println!("== {name}: {:.0} s", start.elapsed().as_secs_f64());
    Ok(())
}
