//! What must hold before a change lands.

use std::fs;
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use pulldown_cmark::{Event, Parser, Tag};

use crate::root;

/// The oldest compiler that is promised: `rust-version` of the workspace.
const OLDEST: &str = "1.89";
const WASM: &str = "wasm32-unknown-unknown";

/// Runs all checks, the tests among them unless they are known to be `tested`.
pub(crate) fn run(tested: bool) -> Result<()> {
    if !tested {
        step("tests", "cargo", &["test", "--workspace"])?;
    }
    step("format", "cargo", &["fmt", "--all", "--check"])?;
    features()?;
    toolchains()?;
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
    println!("== experiments, two trials a cell: {:.0} s", start.elapsed().as_secs_f64());
    let start = Instant::now();
    crate::profile::quick()?;
    println!("== profiles, a short record: {:.0} s", start.elapsed().as_secs_f64());
    links()
}

/// Each optional feature left out, one by one: there are so few that they are listed here.
fn features() -> Result<()> {
    step(
        "without the standard library",
        "cargo",
        &["check", "--package", "twinlag-compensate", "--package", "twinlag-sensor", "--no-default-features"],
    )?;
    step("without readers of binary files", "cargo", &["check", "--package", "twinlag-files", "--tests"])?;
    step(
        "without the random solvers",
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
    if installed(&["target", "list", "--installed"], WASM).is_some() {
        let arguments = ["check", "--target", WASM, "--package", "twinlag", "--no-default-features"];
        step("in a browser", "cargo", &arguments)
    } else {
        println!("== SKIPPED: in a browser; `rustup target add {WASM}` installs what it takes");
        let arguments = ["check", "--package", "twinlag", "--no-default-features"];
        step("the facade without the random solvers", "cargo", &arguments)
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

/// Every relative link of the book and of the README leads to a file.
fn links() -> Result<()> {
    let root = root()?;
    let mut pages = vec![root.join("README.md"), root.join("CONTRIBUTING.md"), root.join("CHANGELOG.md")];
    for entry in fs::read_dir(root.join("docs/src"))? {
        let path = entry?.path();
        if path.extension().is_some_and(|e| e == "md") {
            pages.push(path);
        }
    }
    let mut count = 0;
    for page in &pages {
        let text = fs::read_to_string(page).with_context(|| format!("{}", page.display()))?;
        for event in Parser::new(&text) {
            let Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) = event else { continue };
            let target = dest_url.split('#').next().unwrap_or("");
            if target.is_empty() || target.contains("://") {
                continue;
            }
            let path = page.parent().unwrap_or(root).join(target);
            if !path.exists() {
                bail!("{}: the link to {target} leads nowhere", page.display());
            }
            count += 1;
        }
    }
    println!("== links: {count} in {} pages lead to files", pages.len());
    Ok(())
}
