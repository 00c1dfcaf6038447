//! The bill of materials of the program: every package that it is compiled from, in the form of `CycloneDX` 1.5.
//!
//! It has no date and no serial number, so that it is the same to the byte whenever the sources are.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::process::Command;

use anyhow::{Context, Result, ensure};
use serde::Deserialize;
use serde_json::{Value, json};
use toml::Table;

use super::{FEATURES, PACKAGE};
use crate::root;

/// What `cargo metadata` says of the packages and of which takes which.
#[derive(Deserialize)]
struct Metadata {
    packages: Vec<Package>,
    resolve: Resolve,
}

#[derive(Deserialize)]
struct Package {
    id: String,
    name: String,
    version: String,
    license: Option<String>,
    repository: Option<String>,
    /// Where it comes from; `None` of a package of the repository.
    source: Option<String>,
}

#[derive(Deserialize)]
struct Resolve {
    nodes: Vec<Node>,
}

#[derive(Deserialize)]
struct Node {
    id: String,
    deps: Vec<Dependency>,
}

#[derive(Deserialize)]
struct Dependency {
    pkg: String,
    dep_kinds: Vec<Kind>,
}

#[derive(Deserialize)]
struct Kind {
    /// `None` of what is compiled into the package, `dev` or `build` of the rest.
    kind: Option<String>,
}

impl Dependency {
    fn is_compiled_in(&self) -> bool {
        self.dep_kinds.iter().any(|of| of.kind.is_none())
    }
}

impl Package {
    /// Its package URL, by which the bill refers to it.
    fn url(&self) -> String {
        format!("pkg:cargo/{}@{}", self.name, self.version)
    }

    fn component(&self, sha256: Option<&String>) -> Value {
        let mut out = json!({
            "type": "library",
            "bom-ref": self.url(),
            "name": self.name,
            "version": self.version,
            "purl": self.url(),
        });
        // Some manifests have the old separator.
        out["licenses"] = self.license.iter().map(|of| json!({"expression": of.replace('/', " OR ")})).collect();
        out["hashes"] = sha256.iter().map(|of| json!({"alg": "SHA-256", "content": of})).collect();
        let repository = |url: &String| json!({"type": "vcs", "url": url});
        out["externalReferences"] = self.repository.iter().map(repository).collect();
        out
    }
}

/// The bill of the program for the platform `target`.
pub(super) fn bill(target: &str) -> Result<Value> {
    let output = Command::new("cargo")
        .args(["metadata", "--format-version", "1", "--locked", "--filter-platform", target])
        .args(["--features", &format!("{PACKAGE}/{FEATURES}")])
        .current_dir(root()?)
        .output()
        .context("cargo could not be started")?;
    ensure!(output.status.success(), "cargo metadata: {}", String::from_utf8_lossy(&output.stderr));
    let Metadata { packages, resolve } = serde_json::from_slice(&output.stdout)?;
    let program = packages.iter().find(|package| package.name == PACKAGE && package.source.is_none());
    let program = program.context("the program is no package of the repository")?;
    let packages: BTreeMap<&str, &Package> = packages.iter().map(|package| (&*package.id, package)).collect();
    let nodes: BTreeMap<&str, &Node> = resolve.nodes.iter().map(|node| (&*node.id, node)).collect();
    let taken_by =
        |id: &str| nodes[id].deps.iter().filter(|dependency| dependency.is_compiled_in()).map(|to| &*to.pkg).collect();

    let mut takes: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    let mut seen: BTreeSet<&str> = BTreeSet::new();
    let mut left = vec![&*program.id];
    while let Some(id) = left.pop() {
        if seen.insert(id) {
            let taken: Vec<&str> = taken_by(id);
            takes.insert(packages[id].url(), taken.iter().map(|id| packages[id].url()).collect());
            left.extend(taken);
        }
    }
    let hashes = hashes()?;
    let component = |id: &&str| {
        let package = packages[id];
        package.component(hashes.get(&(package.name.clone(), package.version.clone())))
    };
    let mut components: Vec<Value> = seen.iter().filter(|id| **id != program.id).map(component).collect();
    components.sort_by(|a, b| a["purl"].as_str().cmp(&b["purl"].as_str()));
    let mut subject = program.component(None);
    subject["type"] = "application".into();
    let dependencies: Vec<Value> = takes.iter().map(|(of, on)| json!({"ref": of, "dependsOn": on})).collect();
    Ok(json!({
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "version": 1,
        "metadata": {"component": subject, "properties": [{"name": "target", "value": target}]},
        "components": components,
        "dependencies": dependencies,
    }))
}

/// SHA-256 of each package that comes from a registry, by name and version, as the lock file has it.
fn hashes() -> Result<BTreeMap<(String, String), String>> {
    let lock: Table = fs::read_to_string(root()?.join("Cargo.lock"))?.parse()?;
    let packages = lock["package"].as_array().context("the lock file lists packages")?;
    let text = |package: &toml::Value, name: &str| Some(package.get(name)?.as_str()?.to_owned());
    let of = |p: &toml::Value| Some(((text(p, "name")?, text(p, "version")?), text(p, "checksum")?));
    Ok(packages.iter().filter_map(of).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dist::host;

    #[test]
    fn the_bill_lists_what_is_compiled_in_with_licence_and_hash() {
        let bill = bill(&host().expect("a host")).expect("a bill");
        let components = bill["components"].as_array().expect("a list");
        let names: BTreeSet<&str> = components.iter().filter_map(|of| of["name"].as_str()).collect();
        assert!(["serde", "faer", "twinlag", "object_store"].iter().all(|name| names.contains(name)), "{names:?}");
        // Of tests alone, and of a build script.
        assert!(["proptest", "trycmd", "cc"].iter().all(|name| !names.contains(name)), "{names:?}");
        for component in components {
            assert_eq!(component["licenses"].as_array().map(Vec::len), Some(1), "{component}");
            let is_own = component["name"].as_str().is_some_and(|name| name.starts_with("twinlag"));
            let hash = component["hashes"][0]["content"].as_str().map(str::len);
            assert_eq!(hash, (!is_own).then_some(64), "{component}");
        }
        let all: BTreeSet<&str> = components.iter().filter_map(|of| of["bom-ref"].as_str()).collect();
        for dependency in bill["dependencies"].as_array().expect("a list") {
            let on = dependency["dependsOn"].as_array().expect("a list");
            assert!(on.iter().all(|on| all.contains(on.as_str().expect("a reference"))), "{dependency}");
        }
    }
}
