//! The page for a browser: built as one HTML file, and driven in Chromium.
//!
//! To build it takes the target `wasm32-unknown-unknown`, Node.js and npm; to drive it, Chromium too. The binder and Binaryen's `wasm-opt` are
//! installed below `target/web`.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use base64ct::{Base64, Encoding};
use clap::Args;
use flate2::Compression;
use flate2::write::GzEncoder;
use lzma_rust2::{LzmaOptions, LzmaWriter};
use twinlag_report::{Axis, Chart, Document, Figure, Series, policy_hash};

use crate::dist::without_paths;
use crate::report::{browser, built, into_book, step, target_dir, with_packages};
use crate::root;

pub(crate) const TARGET: &str = "wasm32-unknown-unknown";
/// Several numbers at once, which browsers have been able to since 2023, and the stack of a thread of the program.
const FLAGS: [&str; 2] = ["-Ctarget-feature=+simd128", "-Clink-arg=-zstack-size=8388608"];
const PARTS: [&Part; 2] = [&SESSION, &UNPACKER];
const SESSION: Part = Part { package: "twinlag-web", global: "wasm_bindgen" };
const UNPACKER: Part = Part { package: "twinlag-unpack", global: "unpacker" };
/// The binder of WebAssembly and the library that it binds have one version.
const BINDER: &str = "wasm-bindgen";
/// What makes WebAssembly shorter when it is packed: functions that are the same once they are compiled are kept once, and those with
/// names that are alike stand beside each other. 40 kB of the page less.
const ORDER: [&str; 2] = ["--duplicate-function-elimination", "--reorder-functions-by-name"];

/// Screenshots of the book's chapter.
const IN_BOOK: [&str; 3] = ["read-wide-light", "answer-wide-light", "answer-narrow-dark"];

/// Rows of the long record: enough to measure, few enough for continuous integration.
const LONG_ROWS: usize = 20_000;

/// A crate of WebAssembly, and what its JavaScript is called in the page.
struct Part {
    package: &'static str,
    global: &'static str,
}

impl Part {
    /// The name of a file that is made of it.
    fn file(&self, end: &str) -> String {
        self.package.replace('-', "_") + end
    }
}

/// Builds the page, and drives it in a browser.
#[derive(Args)]
pub(crate) struct Web {
    /// The browser: Chromium, or one that is made of it.
    #[arg(long)]
    browser: Option<PathBuf>,
    /// Only builds the page.
    #[arg(long)]
    undriven: bool,
    /// Writes the screenshots of the book's chapter on the page as well.
    #[arg(long, conflicts_with = "undriven")]
    write: bool,
    /// Rows of the long record that is diagnosed in the page and by the program.
    #[arg(long, default_value_t = LONG_ROWS)]
    rows: usize,
}

impl Default for Web {
    fn default() -> Self {
        Self { browser: None, undriven: false, write: false, rows: LONG_ROWS }
    }
}

impl Web {
    /// Only built.
    pub(crate) fn undriven() -> Self {
        Self { undriven: true, ..Self::default() }
    }
}

pub(crate) fn run(web: &Web) -> Result<()> {
    let work = root()?.join("target/web");
    fs::create_dir_all(&work)?;
    let page = work.join("twinlag.html");
    let text = assembled(&bound(&work)?)?;
    fs::write(&page, &text)?;
    let bytes = text.as_bytes();
    println!("== {}: {} bytes, {} compressed", page.display(), bytes.len(), gzipped(bytes)?.len());
    if web.undriven { Ok(()) } else { driven(web, &page, &work) }
}

/// The WebAssembly and its JavaScript, in the folder that is returned.
fn bound(work: &Path) -> Result<PathBuf> {
    let root = root()?;
    println!("== the page's WebAssembly");
    let mut build = vec!["build", "--profile", "web", "--target", TARGET];
    build.extend(PARTS.iter().flat_map(|part| ["--package", part.package]));
    // In place of the flags of `.cargo/config.toml`, which are those of the facade alone.
    let flags =
        FLAGS.map(str::to_owned).into_iter().chain(without_paths(&target_dir()?)?).collect::<Vec<_>>().join("\u{1f}");
    let built = Command::new("cargo").args(&build).env("CARGO_ENCODED_RUSTFLAGS", flags).current_dir(root).status()?;
    ensure!(built.success(), "cargo {} ended with {built}", build.join(" "));
    let version = locked_version(&fs::read_to_string(root.join("Cargo.lock"))?)?;
    let tools = work.join("tools");
    let binder = tools.join("bin").join(BINDER);
    let has_version = |program: &Path| {
        let said = Command::new(program).arg("--version").output();
        said.is_ok_and(|said| String::from_utf8_lossy(&said.stdout).trim().ends_with(&version))
    };
    if !has_version(&binder) {
        let tools = tools.display().to_string();
        let install = ["install", "wasm-bindgen-cli", "--version", &version, "--force", "--root", &tools];
        step("cargo", &install, root)?;
    }
    let out = work.join("bound");
    for part in PARTS {
        let wasm = target_dir()?.join(TARGET).join("web").join(part.file(".wasm"));
        let [binder, out, wasm] = [&binder, &out, &wasm].map(|path| path.display().to_string());
        let how = ["--target", "no-modules", "--no-modules-global", part.global, "--no-typescript"];
        step(&binder, &[&how[..], &["--out-dir", &out, &wasm]].concat(), root)?;
    }
    let optimizer = with_packages(work)?.join(".bin/wasm-opt").display().to_string();
    for part in PARTS {
        let wasm = out.join(part.file("_bg.wasm")).display().to_string();
        // Without `-g`, `wasm-opt` writes no names of functions.
        step(&optimizer, &[&ORDER[..], &[&wasm, "--output", &wasm]].concat(), root)?;
    }
    Ok(out)
}

/// The version of the library that binds, as `Cargo.lock` has it.
fn locked_version(lock: &str) -> Result<String> {
    let lock: toml::Table = toml::from_str(lock)?;
    let packages = lock["package"].as_array().context("Cargo.lock has packages")?;
    let library = packages.iter().find(|package| package["name"].as_str() == Some(BINDER));
    let version = library.and_then(|library| library["version"].as_str()).context("Cargo.lock has no wasm-bindgen")?;
    Ok(version.to_owned())
}

/// The page of its parts, its content security policy with the hash of each script and style: its own, and those of the reports
/// that it shows.
fn assembled(bound: &Path) -> Result<String> {
    let page = root()?.join("crates/twinlag-web/page");
    let read = |path: PathBuf| fs::read_to_string(&path).with_context(|| format!("{} cannot be read", path.display()));
    let reports = reports()?;
    let style = format!("\n{}{}", reports.style, read(page.join("page.css"))?);
    let script = without_comments(&(read(bound.join(UNPACKER.file(".js")))? + &read(page.join("page.js"))?))?;
    let worker = without_comments(&(read(bound.join(SESSION.file(".js")))? + &read(page.join("worker.js"))?))?;
    ensure!(!(worker.clone() + &script).contains("</script"), "a script would end before its end");
    let wasm = Base64::encode_string(&packed(&fs::read(bound.join(SESSION.file("_bg.wasm")))?)?);
    let unpacker = Base64::encode_string(&gzipped(&fs::read(bound.join(UNPACKER.file("_bg.wasm")))?)?);
    let policy = format!(
        "default-src 'none'; base-uri 'none'; form-action 'none'; script-src 'wasm-unsafe-eval' '{}' {}; style-src '{}' {}; \
         worker-src blob:",
        policy_hash(&script),
        reports.script_hashes,
        policy_hash(&style),
        reports.style_hashes,
    );
    let parts = [
        ("policy", policy),
        ("style", style),
        ("script", script),
        ("worker", worker),
        ("unpacker", unpacker),
        ("wasm", wasm),
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
    ];
    // No part is looked through for the names of others.
    let template = read(page.join("index.html"))?;
    let mut places: Vec<(usize, usize, String)> = parts
        .into_iter()
        .map(|(name, text)| {
            let mark = format!("{{{name}}}");
            let place = template.find(&mark).with_context(|| format!("index.html has no {mark}"))?;
            Ok((place, mark.len(), text))
        })
        .collect::<Result<_>>()?;
    places.sort_unstable();
    let (mut out, mut done) = (String::new(), 0);
    for (place, length, text) in places {
        out += &template[done..place];
        out += &text;
        done = place + length;
    }
    Ok(out + &template[done..])
}

/// A script without indentation, empty lines, and lines that are comments alone.
fn without_comments(script: &str) -> Result<String> {
    let (mut out, mut is_comment) = (String::new(), false);
    for line in script.lines().map(str::trim) {
        if is_comment || line.starts_with("/*") {
            is_comment = !line.contains("*/");
            ensure!(is_comment || line.ends_with("*/"), "code behind a comment: {line}");
        } else if !line.is_empty() && !line.starts_with("//") {
            ensure!(line.matches('`').count().is_multiple_of(2), "a text over several lines: {line}");
            out += line;
            out.push('\n');
        }
    }
    ensure!(!is_comment, "a comment that does not end");
    Ok(out)
}

/// What reports need of the policy of a page that shows them.
struct Reports {
    /// The style of reports without traces.
    style: String,
    /// Hashes of the styles of reports with and without traces, quoted.
    style_hashes: String,
    /// That of their script.
    script_hashes: String,
}

fn reports() -> Result<Reports> {
    let chart = Chart::new("", Axis::linear("x"), Axis::linear("y")).series(Series::trace("", [0.0, 1.0], [0.0, 1.0]));
    let live = Document::new("").drawing(Figure::new("").panel(chart).live(), "")?.to_live_html();
    let still = Document::new("").to_html();
    let of_policy = |page: &str, kind: &str| -> Result<String> {
        let policy = page.split_once("Content-Security-Policy\" content=\"").context("a report has a policy")?.1;
        let sources = policy.split_once(&format!("{kind} ")).with_context(|| format!("a policy has {kind}"))?.1;
        Ok(sources.split([';', '"']).next().unwrap_or_default().to_owned())
    };
    let style = still.split_once("<style>").and_then(|(_, rest)| rest.split_once("</style>")).context("a style")?.0;
    Ok(Reports {
        style: style.trim_start().to_owned(),
        style_hashes: of_policy(&still, "style-src")? + " " + &of_policy(&live, "style-src")?,
        script_hashes: of_policy(&live, "script-src")?,
    })
}

/// Opens the page in a browser, drops records on it, and compares its answers with the program's.
fn driven(web: &Web, page: &Path, work: &Path) -> Result<()> {
    let program = built()?;
    let browser = browser(web.browser.as_deref())?;
    let records = work.join("records");
    fs::create_dir_all(&records)?;
    let screenshots = work.join("screenshots");
    fs::create_dir_all(&screenshots)?;
    let rig = |seed: u32, rows: usize| {
        format!(
            "seed = {seed}\n[record]\nsamples = {rows}\nsample_period_s = 0.01\n[gas]\nkind = \"turbulence\"\nmean_c = 300.0\n\
             std_k = 15.0\ncorner_hz = 0.5\ncutoff_hz = 45.0\n[[sensors]]\nchannel = \"T1\"\ntime_constant_s = 0.12\n\
             noise = {{ std_k = 0.1 }}\n[[sensors]]\nchannel = \"T2\"\ntime_constant_s = 0.45\noffset_k = 2.0\nnoise = {{ std_k = 0.1 }}\n"
        )
    };
    for (name, seed, rows) in [("first", 7, 3000), ("second", 8, 3000), ("long", 9, web.rows)] {
        fs::write(records.join(format!("{name}.toml")), rig(seed, rows))?;
        let (rig, record) = (format!("{name}.toml"), format!("{name}.csv"));
        step(&program.display().to_string(), &["simulate", &rig, "--out", &record, "--force", "--quiet"], &records)?;
    }
    let nasty = fs::read_to_string(records.join("first.csv"))?.replacen("T1", "<script>window.ran=1</script>", 1);
    fs::write(records.join("nasty.csv"), nasty)?;
    fs::copy(root()?.join("crates/twinlag-files/tests/fixtures/apart.mf4"), records.join("apart.mf4"))?;
    with_packages(work)?;
    let script = root()?.join("xtask/web/check.mjs");
    let paths = [&script, page, &records, &screenshots, &browser, &program].map(|path| path.display().to_string());
    step("node", &paths.each_ref().map(String::as_str), work)?;
    if web.write { into_book(&screenshots, "browser", &IN_BOOK) } else { Ok(()) }
}

/// Packed by LZMA, whose dictionary is as long as the bytes.
fn packed(bytes: &[u8]) -> Result<Vec<u8>> {
    let mut options = LzmaOptions::with_preset(9);
    options.dict_size = u32::try_from(bytes.len())?;
    options.nice_len = 273; // the longest match that there is
    // Instructions of WebAssembly begin at any byte (`pb`), and the byte before predicts the next (`lc`).
    options.pb = 0;
    options.lc = 4;
    let mut writer = LzmaWriter::new_use_header(Vec::new(), &options, Some(bytes.len() as u64))?;
    writer.write_all(bytes)?;
    Ok(writer.finish()?)
}

fn gzipped(bytes: &[u8]) -> Result<Vec<u8>> {
    // Level 9 of zlib-rs makes longer what is packed already.
    let mut encoder = GzEncoder::new(Vec::new(), Compression::new(8));
    encoder.write_all(bytes)?;
    Ok(encoder.finish()?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_are_left_out_of_a_script() {
        let script =
            "/**\n * What it does.\n */\nfunction f() {\n    // Why.\n    return 2 * 3; // how\n}\n/* one line */\n";
        assert_eq!(without_comments(script).ok().as_deref(), Some("function f() {\nreturn 2 * 3; // how\n}\n"));
        for unclear in ["/* why */ f();\n", "let text = `over\nlines`;\n", "/* no end\n"] {
            assert!(without_comments(unclear).is_err(), "{unclear}");
        }
    }
}
