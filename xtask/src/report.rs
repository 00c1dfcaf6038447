//! Reports in a browser: pages of simulated records are made and opened, at two sizes, light, dark and on paper.
//!
//! It takes Chromium, Node.js and three packages of npm, so that no test of a fresh clone rests on it: `cargo xtask report`, and
//! `cargo xtask ci --full`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};
use clap::Args;

use crate::root;

/// Where a browser may be, in the order in which it is looked for.
const BROWSERS: [&str; 3] = ["/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];
/// A column name that is a script. It must be text wherever it stands.
const NASTY: &str = "<script>window.ran=1</script>";
const NASTIER: &str = "\"'><img src=x onerror=window.ran=1>";

/// Screenshots of the book's chapter.
const IN_BOOK: [&str; 6] = [
    "single-wide-light",
    "single-wide-dark",
    "single-narrow-light",
    "single-enlarged",
    "gas-wide-light",
    "several-wide-light",
];

/// What is simulated: the name of the record, and the rig after the sensors' common part.
const RIGS: [(&str, &str); 3] = [
    ("good", "time_constant_s = 0.45\nnoise = { std_k = 0.1 }\n"),
    ("offset", "time_constant_s = 0.45\noffset_k = 2.0\nnoise = { std_k = 0.1 }\n"),
    ("second", "time_constant_s = 0.45\noffset_k = 2.0\nnoise = { std_k = 0.1 }\n"),
];

/// Opens reports in a browser.
#[derive(Args, Default)]
pub(crate) struct Report {
    /// The program whose reports are opened; by default the one that is built.
    #[arg(long)]
    program: Option<PathBuf>,
    /// The browser: Chromium, or one that is made of it.
    #[arg(long)]
    browser: Option<PathBuf>,
    /// Writes the screenshots of the book's chapter on reports as well.
    #[arg(long)]
    write: bool,
}

/// A report, and the command that makes it.
fn pages() -> Vec<(&'static str, Vec<&'static str>)> {
    vec![
        ("single", vec!["diagnose", "offset.csv", "--reference", "Tref"]),
        ("adequate", vec!["diagnose", "good.csv", "--reference", "Tref"]),
        ("static", vec!["diagnose", "offset.csv", "--reference", "Tref", "--static"]),
        ("several", vec!["diagnose", "offset.csv", "second.csv", "--t1", "T1", "--t2", "T2"]),
        ("gas", vec!["compensate", "offset.csv", "--reference", "Tref", "--out", "gas.csv"]),
        ("track", vec!["track", "good.csv", "--reference", "Tref", "--out", "tau.csv"]),
        ("batch", vec!["batch", "good.csv", "offset.csv", "second.csv", "--out", "table.csv"]),
        ("nasty", vec!["diagnose", "nasty.csv", "--t1", NASTY, "--t2", NASTIER]),
    ]
}

/// Makes the reports, opens them, and fails where one is not as it should be.
pub(crate) fn run(arguments: &Report) -> Result<()> {
    let program = match &arguments.program {
        Some(program) => program.clone(),
        None => built()?,
    };
    let program = program.canonicalize().with_context(|| format!("{}: no program", program.display()))?;
    let browser = browser(arguments.browser.as_deref())?;
    let dir = root()?.join("target/report");
    let pages_dir = dir.join("pages");
    let screenshots = dir.join("screenshots");
    fs::create_dir_all(&pages_dir)?;
    fs::create_dir_all(&screenshots)?;
    records(&program, &pages_dir)?;
    for (name, command) in pages() {
        let page = format!("{name}.html");
        let made = Command::new(&program)
            .args(&command)
            .args(["--report", &page, "--force", "--quiet"])
            .current_dir(&pages_dir)
            .output()
            .context("the program could not be started")?;
        // Exit code 4: there is a report that says why there is no answer.
        if !matches!(made.status.code(), Some(0 | 4)) || !pages_dir.join(&page).exists() {
            bail!("{}: {}", command.join(" "), String::from_utf8_lossy(&made.stderr));
        }
        println!("== made {page}");
    }
    with_packages(&dir)?;
    let script = root()?.join("xtask/report/check.mjs");
    let paths = [&script, &pages_dir, &screenshots, &browser].map(|path| path.display().to_string());
    step("node", &paths.each_ref().map(String::as_str), &dir)?;
    if arguments.write { into_book(&screenshots, "report", &IN_BOOK) } else { Ok(()) }
}

/// The browser that is given, or the first that is there.
pub(crate) fn browser(given: Option<&Path>) -> Result<PathBuf> {
    let found = || BROWSERS.iter().map(PathBuf::from).find(|path| path.exists());
    given.map(Path::to_owned).or_else(found).context("no browser: install Chromium, or name one with --browser")
}

/// Installs npm's packages below `dir` unless they are there, and returns their folder.
pub(crate) fn with_packages(dir: &Path) -> Result<PathBuf> {
    let wanted = root()?.join("xtask/report/package.json");
    let (asked, packages) = (dir.join("package.json"), dir.join("node_modules"));
    if !packages.exists() || fs::read(&asked).ok() != Some(fs::read(&wanted)?) {
        fs::copy(wanted, &asked)?;
        // What is not installed is asked for again.
        step("npm", &["install", "--no-audit", "--no-fund"], dir).inspect_err(|_| drop(fs::remove_file(&asked)))?;
    }
    Ok(packages)
}

/// The program, built.
pub(crate) fn built() -> Result<PathBuf> {
    let root = root()?;
    step("cargo", &["build", "--release", "--package", "twinlag-cli"], root)?;
    Ok(target_dir()?.join("release/twinlag"))
}

/// Where cargo builds.
pub(crate) fn target_dir() -> Result<PathBuf> {
    let root = root()?;
    Ok(std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root.join("target"), PathBuf::from))
}

/// Simulates the records, and one whose columns have the names of scripts.
fn records(program: &Path, dir: &Path) -> Result<()> {
    for (seed, (name, sensor)) in RIGS.iter().enumerate() {
        let rig = format!(
            "seed = {}\n[record]\nsamples = 3000\nsample_period_s = 0.01\n[gas]\nkind = \"turbulence\"\nmean_c = 300.0\nstd_k = 15.0\n\
             corner_hz = 0.5\ncutoff_hz = 45.0\n[[sensors]]\nchannel = \"T1\"\ntime_constant_s = 0.12\nnoise = {{ std_k = 0.1 }}\n\
             [[sensors]]\nchannel = \"T2\"\n{sensor}",
            seed + 5
        );
        fs::write(dir.join(format!("{name}.toml")), rig)?;
        let (rig, record) = (format!("{name}.toml"), format!("{name}.csv"));
        step(&program.display().to_string(), &["simulate", &rig, "--out", &record, "--force", "--quiet"], dir)?;
    }
    let text = fs::read_to_string(dir.join("offset.csv"))?;
    let (header, rows) = text.split_once('\n').context("a record has a header")?;
    let quoted = |name: &str| format!("\"{}\"", name.replace('"', "\"\""));
    let header: Vec<String> = header
        .split(',')
        .map(|name| match name.split([' ', '_', '[']).next() {
            Some("T1") => quoted(NASTY),
            Some("T2") => quoted(NASTIER),
            _ => name.to_owned(),
        })
        .collect();
    Ok(fs::write(dir.join("nasty.csv"), format!("{}\n{rows}", header.join(",")))?)
}

/// The screenshots that the book shows.
pub(crate) fn into_book(screenshots: &Path, chapter: &str, names: &[&str]) -> Result<()> {
    let to = root()?.join("docs/src").join(chapter);
    fs::create_dir_all(&to)?;
    for name in names {
        fs::copy(screenshots.join(format!("{name}.png")), to.join(format!("{name}.png")))?;
    }
    Ok(())
}

pub(crate) fn step(program: &str, arguments: &[&str], dir: &Path) -> Result<()> {
    println!("== {program} {}", arguments.join(" "));
    let status = Command::new(program)
        .args(arguments)
        .current_dir(dir)
        .status()
        .with_context(|| format!("{program} could not be started"))?;
    ensure!(status.success(), "{program} {} ended with {status}", arguments.join(" "));
    Ok(())
}
