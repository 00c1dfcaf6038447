//! Release archives: the program with its manual, the book, completions, licences and a bill of materials, as one file for each platform.
//!
//! An archive is the same to the byte wherever the repository lies, as long as compiler, dependencies and platform are the same: paths
//! of the machine are taken out of the program, and entries are in order, with one date and one owner. An archive for another platform takes its
//! target of Rust and a linker for it; runners of a CI service have each its own.

mod bill;

use std::fs::{self, File};
use std::io::{Read, Write as _};
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use clap::Args;
use flate2::{Compression, GzBuilder};
use sha2::{Digest, Sha256};
use zip::write::SimpleFileOptions;

use crate::{book, root};

/// Files of the repository that go with the program.
const BESIDE: [&str; 5] = ["README.md", "CHANGELOG.md", "LICENSE-APACHE", "LICENSE-MIT", "CITATION.cff"];
/// The package that is the program, and the features that it is built with.
const PACKAGE: &str = "twinlag-cli";
const FEATURES: &str = "s3";
const SHELLS: [&str; 4] = ["bash", "zsh", "fish", "powershell"];

/// Makes a release archive.
#[derive(Args)]
pub(crate) struct Dist {
    /// The platform, as Rust names it; by default the one that this runs on.
    #[arg(long, value_name = "TRIPLE")]
    target: Option<String>,
    /// The folder for the archive.
    #[arg(long, value_name = "DIR", default_value = "target/dist")]
    out: PathBuf,
    /// Builds it again from nothing and compares both, byte by byte.
    #[arg(long)]
    check: bool,
}

pub(crate) fn run(arguments: &Dist) -> Result<()> {
    let host = host()?;
    let target = arguments.target.as_deref().unwrap_or(&host);
    fs::create_dir_all(&arguments.out)?;
    let archive = make(target, &host, &root()?.join("target/dist-build"), &arguments.out)?;
    let hash = hash(&archive)?;
    let name = archive.file_name().context("an archive has a name")?.to_string_lossy().into_owned();
    fs::write(arguments.out.join(format!("{name}.sha256")), format!("{hash}  {name}\n"))?;
    println!("{}: {} bytes, SHA-256 {hash}", archive.display(), archive.metadata()?.len());
    if arguments.check {
        let again = root()?.join("target/dist-again");
        if again.exists() {
            fs::remove_dir_all(&again)?;
        }
        fs::create_dir_all(&again)?;
        let other = make(target, &host, &again.join("build"), &again)?;
        ensure!(fs::read(&archive)? == fs::read(&other)?, "built twice, the archive differs: {}", other.display());
        println!("built twice, the archive is the same to the byte");
    }
    Ok(())
}

/// The platform that this runs on.
fn host() -> Result<String> {
    let output = Command::new("rustc").arg("-vV").output().context("rustc could not be started")?;
    let text = String::from_utf8(output.stdout)?;
    let host = text.lines().find_map(|line| line.strip_prefix("host: ")).context("rustc names no host")?;
    Ok(host.to_owned())
}

/// Builds the program and packs it. Manual and completions are printed by a program for this machine.
fn make(target: &str, host: &str, build: &Path, out: &Path) -> Result<PathBuf> {
    let program = compiled(target, build)?;
    let here = if target == host { program.clone() } else { compiled(host, build)? };
    let version = env!("CARGO_PKG_VERSION");
    let folder = format!("twinlag-{version}-{target}");
    let mut entries =
        vec![(program.file_name().context("a program has a name")?.to_owned().into(), fs::read(&program)?, true)];
    entries.extend(documents(&build.join("book"))?);
    for shell in SHELLS {
        let script = Command::new(&here).args(["completions", shell]).output()?;
        ensure!(script.status.success(), "no completions for {shell}");
        entries.push((Path::new("completions").join(format!("twinlag.{shell}")), script.stdout, false));
    }
    let pages = build.join("man");
    if pages.exists() {
        fs::remove_dir_all(&pages)?;
    }
    let status = Command::new(&here).args(["man", "--quiet", "--out"]).arg(&pages).status()?;
    ensure!(status.success(), "no manual");
    for page in fs::read_dir(&pages)? {
        let page = page?;
        entries.push((Path::new("man").join(page.file_name()), fs::read(page.path())?, false));
    }
    entries.push((
        PathBuf::from("bill-of-materials.cdx.json"),
        serde_json::to_vec_pretty(&bill::bill(target)?)?,
        false,
    ));
    entries.sort();
    if target.contains("windows") {
        let archive = out.join(format!("{folder}.zip"));
        zipped(&archive, &folder, &entries)?;
        Ok(archive)
    } else {
        let archive = out.join(format!("{folder}.tar.gz"));
        tarred(&archive, &folder, &entries)?;
        Ok(archive)
    }
}

/// The book, and the pages beside it, of which every link leads to something in the archive.
fn documents(built: &Path) -> Result<Vec<Entry>> {
    book::build(built)?;
    let mut entries = Vec::new();
    let mut folders = vec![built.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder)? {
            let path = entry?.path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let content = fs::read(&path)?;
                entries.push((Path::new(book::IN_ARCHIVE).join(path.strip_prefix(built)?), content, false));
            }
        }
    }
    let mut pages = Vec::new();
    for name in BESIDE {
        let page = book::in_archive(&fs::read_to_string(root()?.join(name))?);
        entries.push((PathBuf::from(name), page.clone().into_bytes(), false));
        pages.push((name, page));
    }
    for (name, page) in pages {
        for link in book::links(&page) {
            let file = link.split('#').next().unwrap_or_default();
            let is_there = file.is_empty() || entries.iter().any(|(path, _, _)| path.starts_with(file));
            ensure!(is_there, "{name} links to {link}, which is not in the archive");
        }
    }
    Ok(entries)
}

/// Flags of the compiler that leave no path of this machine in what it compiles.
///
/// - `build`: the folder that is compiled into
pub(crate) fn without_paths(build: &Path) -> Result<[String; 3]> {
    let home = std::env::var_os("CARGO_HOME").map(PathBuf::from).or_else(|| Some(std::env::home_dir()?.join(".cargo")));
    let home = home.context("cargo has no home")?;
    Ok([(root()?, "twinlag"), (&home, "cargo"), (build, "build")]
        .map(|(path, name)| format!("--remap-path-prefix={}={name}", path.display())))
}

/// The program for a platform, without paths of this machine in it.
fn compiled(target: &str, build: &Path) -> Result<PathBuf> {
    let status = Command::new("cargo")
        .args([
            "build",
            "--profile",
            "dist",
            "--locked",
            "--package",
            PACKAGE,
            "--features",
            FEATURES,
            "--target",
            target,
            "--target-dir",
        ])
        .arg(build)
        .env("CARGO_ENCODED_RUSTFLAGS", without_paths(build)?.join("\u{1f}"))
        .env("CARGO_INCREMENTAL", "0")
        .current_dir(root()?)
        .status()
        .context("cargo could not be started")?;
    ensure!(status.success(), "the program was not built for {target}");
    let name = if target.contains("windows") { "twinlag.exe" } else { "twinlag" };
    Ok(build.join(target).join("dist").join(name))
}

/// Path within the archive, content, whether it is a program.
type Entry = (PathBuf, Vec<u8>, bool);

fn mode(is_program: bool) -> u32 {
    if is_program { 0o755 } else { 0o644 }
}

fn tarred(path: &Path, folder: &str, entries: &[Entry]) -> Result<()> {
    let mut archive = tar::Builder::new(GzBuilder::new().mtime(0).write(File::create(path)?, Compression::best()));
    for (name, content, is_program) in entries {
        let mut header = tar::Header::new_ustar();
        header.set_size(content.len() as u64);
        header.set_mode(mode(*is_program));
        header.set_mtime(0);
        header.set_cksum();
        archive.append_data(&mut header, Path::new(folder).join(name), &content[..])?;
    }
    archive.into_inner()?.finish()?;
    Ok(())
}

fn zipped(path: &Path, folder: &str, entries: &[Entry]) -> Result<()> {
    let mut archive = zip::ZipWriter::new(File::create(path)?);
    for (name, content, is_program) in entries {
        let options = SimpleFileOptions::default().unix_permissions(mode(*is_program));
        archive.start_file(format!("{folder}/{}", name.display()).replace('\\', "/"), options)?;
        archive.write_all(content)?;
    }
    archive.finish()?;
    Ok(())
}

/// SHA-256 of a file, in hexadecimal digits.
fn hash(path: &Path) -> Result<String> {
    let mut content = Vec::new();
    File::open(path)?.read_to_end(&mut content)?;
    Ok(base16ct::lower::encode_string(&Sha256::digest(&content)))
}
