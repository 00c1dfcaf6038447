//! What must hold before a change lands.

use std::fs;
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, bail};

use crate::{book, cluster, instructions, python, report, root, web};

/// The oldest compiler that is promised: `rust-version` of the workspace.
const OLDEST: &str = "1.89";

/// Runs the checks of every change; with `full`, those of a release.
///
/// - `tested`: whether the tests are known to pass, and are left out
pub(crate) fn run(tested: bool, full: bool) -> Result<()> {
    if !tested {
        step("tests", "cargo", &["test", "--workspace"])?;
    }
    step("format", "cargo", &["fmt", "--all", "--check"])?;
    step("lints", "cargo", &["clippy", "--workspace", "--all-targets", "--", "--deny", "warnings"])?;
    step("documentation", "cargo", &["doc", "--workspace", "--no-deps", "--document-private-items"])?;
    // In one build, most of which the tests have made: asked for one by one, packages take features one by one, and are compiled anew.
    step("programs and examples", "cargo", &["build", "--workspace", "--all-targets"])?;
    step("the README's main job", "target/debug/twinlag", &["demo"])?;
    step("example: all estimators", "target/debug/examples/characterise", &[])?;
    step("example: a solver of one's own", "target/debug/own-solver", &[])?;
    step("example: a cost of one's own", "target/debug/own-cost", &[])?;
    step("example: an estimator of one's own", "target/debug/own-estimator", &[])?;
    step("example: an effect of one's own", "target/debug/own-effect", &[])?;
    step("example: a live pipe", "target/debug/live-pipe", &[])?;
    let quick = root()?.join("target/quick-experiments");
    if quick.exists() {
        fs::remove_dir_all(&quick)?;
    }
    let start = Instant::now();
    crate::experiment::quick(&quick)?;
    println!("== experiments, a trial in each cell: {:.0} s", start.elapsed().as_secs_f64());
    book::run()?;
    if full {
        features()?;
        toolchains()?;
        if starts("cargo", &["deny", "--version"]) {
            step("licences and sources", "cargo", &["deny", "--locked", "check", "licenses", "bans", "sources"])?;
        } else {
            println!(
                "== SKIPPED: licences and sources of the dependencies; `cargo install cargo-deny` installs what it takes"
            );
        }
        // In release, which has the line tables that a profile is made of.
        step("profiles of a short record", "cargo", &["xtask", "profile", "--quick"])?;
        cluster::run(&cluster::Cluster::default())?;
        if starts(instructions::EMULATOR, &["--version"]) {
            step("the program in release", "cargo", &["build", "--release", "--package", "twinlag-cli"])?;
            instructions::run(&instructions::Instructions::default())?;
        } else {
            println!("== SKIPPED: answers on an older processor; they take {}", instructions::EMULATOR);
        }
        package_and_pages()?;
    }
    Ok(())
}

/// The package for Python, the reports, and the page for a browser, each where what it takes is there.
fn package_and_pages() -> Result<()> {
    if starts(python::PYTHON, &["-m", "venv", "--help"]) {
        python::run(&python::Python::default())?;
    } else {
        println!("== SKIPPED: the package for Python; it takes a Python with `venv`");
    }
    let has_version = |program: &str| starts(program, &["--version"]);
    let has_node = has_version("node") && has_version("npm");
    let has_browser = has_node && report::browser(None).is_ok();
    if has_browser {
        report::run(&report::Report::default())?;
    } else {
        println!("== SKIPPED: reports in a browser; they take Chromium, Node.js and npm");
    }
    if installed(&["target", "list", "--installed"], web::TARGET).is_none() {
        println!("== SKIPPED: the page for a browser; `rustup target add {}` installs what it takes", web::TARGET);
        return Ok(());
    }
    if !has_node {
        println!("== SKIPPED: the page for a browser; it takes Node.js and npm");
        return Ok(());
    }
    if !has_browser {
        println!("== SKIPPED: the page in a browser, which takes Chromium; it is built");
    }
    web::run(&if has_browser { web::Web::default() } else { web::Web::undriven() })
}

/// Whether a program is there.
fn starts(program: &str, arguments: &[&str]) -> bool {
    Command::new(program).args(arguments).output().is_ok_and(|said| said.status.success())
}

/// Each optional feature, and what is built apart, one by one: there are so few that they are listed here.
fn features() -> Result<()> {
    step(
        "without the standard library",
        "cargo",
        &["check", "--package", "twinlag-compensate", "--package", "twinlag-sensor", "--no-default-features"],
    )?;
    step(
        "with object stores",
        "cargo",
        &["clippy", "--package", "twinlag-objects", "--features", "s3", "--", "--deny", "warnings"],
    )?;
    let server = ["--manifest-path", "xtask/objects/Cargo.toml"];
    step("format of the S3 server", "cargo", &[&["fmt", "--check"], &server[..]].concat())?;
    step("without readers of binary files", "cargo", &["check", "--package", "twinlag-files", "--tests"])?;
    step(
        "without optional solvers",
        "cargo",
        &["test", "--package", "twinlag-optimise", "--no-default-features", "--lib", "--quiet"],
    )
}

/// The oldest compiler, and a machine without an operating system, where they are installed.
fn toolchains() -> Result<()> {
    // Apart, or the next build would begin anew.
    let check = ["check", "--target-dir", "target/oldest", "--workspace"];
    if let Some(oldest) = installed(&["toolchain", "list"], OLDEST) {
        let arguments: Vec<&str> = ["run", &oldest, "cargo"].into_iter().chain(check).collect();
        step("the oldest compiler", "rustup", &arguments)?;
    } else {
        println!("== SKIPPED: the oldest compiler; `rustup toolchain install {OLDEST} --profile minimal` installs it");
    }
    if installed(&["target", "list", "--installed"], web::TARGET).is_some() {
        let arguments = ["check", "--target", web::TARGET, "--package", "twinlag", "--no-default-features"];
        step("in a browser", "cargo", &arguments)
    } else {
        println!("== SKIPPED: in a browser; `rustup target add {}` installs what it takes", web::TARGET);
        let arguments = ["check", "--package", "twinlag", "--no-default-features"];
        step("the facade without optional solvers", "cargo", &arguments)
    }
}

/// The first word that `rustup` answers that begins with `name`.
fn installed(question: &[&str], name: &str) -> Option<String> {
    let answer = Command::new("rustup").args(question).output().ok()?;
    let answer = String::from_utf8_lossy(&answer.stdout);
    answer.split_whitespace().find(|word| word.starts_with(name)).map(str::to_owned)
}

fn step(name: &str, program: &str, arguments: &[&str]) -> Result<()> {
    println!("== {name}: {program} {}", arguments.join(" "));
    let start = Instant::now();
    let status = Command::new(program)
        .args(arguments)
        .current_dir(root()?)
        .env("RUSTDOCFLAGS", "--deny warnings")
        .status()
        .with_context(|| format!("{program} could not be started"))?;
    if !status.success() {
        bail!("{name}: {program} {} ended with {status}", arguments.join(" "));
    }
    println!("== {name}: {:.0} s", start.elapsed().as_secs_f64());
    Ok(())
}
