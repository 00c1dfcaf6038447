//! Stacks as they are sampled, folded to what is ours in them.
//!
//! A frame of ours is named by its module, which is the file that its source lies in, and its function. What lies between two
//! frames of ours is left out; what lies below the last one is one frame: the crate that it ends in.

use std::collections::BTreeMap;
use std::path::Path;

use pprof::Symbol;

/// Between the module and the function of a frame.
pub(super) const IN: &str = " ";
/// What stands for the name of a function that has none.
const CLOSURE: &str = "closure";
/// What stands for the standard library and what the compiler put in: their time is the caller's.
const OF_THE_CALLER: [&str; 8] =
    ["core", "alloc", "std", "compiler_builtins", "hashbrown", "rayon", "rayon_core", "xtask"];

/// A module or a function of ours, with its shares of the samples.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Part {
    pub(super) name: String,
    /// Share in itself, and in libraries that it calls.
    pub(super) own: f64,
    /// Share in itself and in all that it calls.
    pub(super) with_calls: f64,
}

/// The frames of a stack, the outermost first, with `;` between.
///
/// - `frames`: the innermost first, each with what was inlined into it, the innermost first
pub(super) fn stack(frames: &[Vec<Symbol>]) -> String {
    let mut out: Vec<String> = Vec::new();
    let mut below = None;
    for symbol in frames.iter().flatten() {
        let name = symbol.name();
        match module(Path::new(&*symbol.filename())) {
            Some(module) => {
                out.push(format!("{module}{IN}{}", function(&name)));
            }
            None if out.is_empty() => below = below.or_else(|| library(&name)),
            None => {}
        }
    }
    out.reverse();
    name_closures(&mut out);
    out.dedup();
    out.extend(below);
    if out.is_empty() { "xtask".into() } else { out.join(";") }
}

/// Gives closures the name of the function of their module that the stack went through last.
fn name_closures(frames: &mut [String]) {
    for i in 0..frames.len() {
        let (outer, rest) = frames.split_at_mut(i);
        if let Some(module) = rest[0].strip_suffix(CLOSURE)
            && let Some(function) = outer.iter().rev().find(|frame| module_of(frame) == module_of(module))
        {
            rest[0].clone_from(function);
        }
    }
}

/// The module that a source file of ours is: `twinlag-model::fit`.
fn module(file: &Path) -> Option<String> {
    let parts: Vec<&str> = file.iter().filter_map(|part| part.to_str()).collect();
    let top = parts.iter().rposition(|part| *part == "src")?;
    let krate = parts.get(top.checked_sub(1)?)?;
    let is_ours =
        *krate == "xtask" || (krate.starts_with("twinlag") && parts.get(top.checked_sub(2)?) == Some(&"crates"));
    let path = parts[top + 1..]
        .iter()
        .map(|part| part.trim_end_matches(".rs"))
        .filter(|part| *part != "lib" && *part != "main");
    is_ours.then(|| [*krate].into_iter().chain(path).collect::<Vec<_>>().join("::"))
}

/// The function's own name, of the whole one.
fn function(name: &str) -> String {
    let plain = without_generics(name);
    let is_said = |part: &&str| !part.is_empty() && !part.starts_with('{');
    plain.split("::").filter(is_said).last().unwrap_or(CLOSURE).to_owned()
}

/// The crate of a function that is not ours, unless its time is that of the caller.
fn library(name: &str) -> Option<String> {
    let path = name.trim_start_matches(['<', '&', '*']).trim_start_matches("mut ").trim_start_matches("dyn ");
    let krate = path.split("::").next().filter(|_| path.contains("::"))?;
    let is_crate = krate.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
    (is_crate && !OF_THE_CALLER.contains(&krate)).then(|| format!("[{krate}]"))
}

fn without_generics(name: &str) -> String {
    let mut depth = 0_usize;
    let mut out = String::new();
    for c in name.replace("->", "").chars() {
        match c {
            '<' => depth += 1,
            '>' => depth = depth.saturating_sub(1),
            c if depth == 0 => out.push(c),
            _ => {}
        }
    }
    out
}

/// The module of a frame; `None` of a library's.
fn module_of(frame: &str) -> Option<&str> {
    (!frame.starts_with('[')).then(|| frame.split(IN).next().unwrap_or(frame))
}

/// The modules that were met.
pub(super) fn modules(stacks: &BTreeMap<String, usize>) -> Vec<Part> {
    parts(stacks, module_of)
}

/// The functions that were met, each with its module.
pub(super) fn functions(stacks: &BTreeMap<String, usize>) -> Vec<Part> {
    parts(stacks, |frame| module_of(frame).map(|_| frame))
}

fn parts<'s>(stacks: &'s BTreeMap<String, usize>, of: fn(&'s str) -> Option<&'s str>) -> Vec<Part> {
    let all: usize = stacks.values().sum();
    let mut counts: BTreeMap<&str, [usize; 2]> = BTreeMap::new();
    for (stack, count) in stacks {
        let mut names: Vec<&str> = stack.split(';').filter_map(of).collect();
        let last = names.last().copied();
        names.sort_unstable();
        names.dedup();
        for name in names {
            let counts = counts.entry(name).or_default();
            counts[1] += count;
            if last == Some(name) {
                counts[0] += count;
            }
        }
    }
    let share = |count: usize| count as f64 / all as f64;
    let part = |(name, [own, with_calls]): (&str, [usize; 2])| Part {
        name: name.to_owned(),
        own: share(own),
        with_calls: share(with_calls),
    };
    counts.into_iter().map(part).collect()
}

/// The shares of libraries.
pub(super) fn libraries(stacks: &BTreeMap<String, usize>) -> BTreeMap<String, f64> {
    let all: usize = stacks.values().sum();
    let mut out = BTreeMap::new();
    for (stack, count) in stacks {
        if let Some(library) = stack.split(';').next_back().filter(|frame| frame.starts_with('[')) {
            *out.entry(library.trim_matches(['[', ']']).to_owned()).or_insert(0.0) += *count as f64 / all as f64;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_named_by_module_and_function() {
        let of = |file| module(Path::new(file));
        assert_eq!(of("/some/crates/twinlag-model/src/fit/steps.rs").as_deref(), Some("twinlag-model::fit::steps"));
        assert_eq!(of("crates/twinlag/src/lib.rs").as_deref(), Some("twinlag"));
        assert_eq!(of("/registry/src/index/realfft-3.5.0/src/lib.rs"), None);
        assert_eq!(function("<twinlag_model::fit::Fit<T> as core::iter::Iterator>::next::{{closure}}"), "next");
        assert_eq!(function("twinlag_model::fit::<impl twinlag_model::Model>::fit"), "fit");
        assert_eq!(library("<rustfft::avx::Butterfly<T> as rustfft::Fft<T>>::process").as_deref(), Some("[rustfft]"));
        assert_eq!(library("core::ops::function::FnOnce::call_once"), None);
    }

    #[test]
    fn closures_belong_to_the_function_of_their_module() {
        let mut frames = ["a closure", "a f", "b g", "a closure"].map(str::to_owned);
        name_closures(&mut frames);
        assert_eq!(frames, ["a closure", "a f", "b g", "a f"]);
    }

    /// Of ten samples four are in `a`, three in `b` that it called, and three in a library that `b` called.
    #[test]
    fn a_part_has_its_own_share_and_that_of_what_it_calls() {
        let stacks = [("a f", 4), ("a f;b g", 3), ("a f;b g;a h;b g;[fft]", 3)];
        let stacks = stacks.into_iter().map(|(stack, count)| (stack.to_owned(), count)).collect();
        let part = |name: &str, own, with_calls| Part { name: name.into(), own, with_calls };
        assert_eq!(modules(&stacks), [part("a", 0.4, 1.0), part("b", 0.6, 0.6)]);
        assert_eq!(functions(&stacks), [part("a f", 0.4, 1.0), part("a h", 0.0, 0.3), part("b g", 0.6, 0.6)]);
        assert_eq!(libraries(&stacks), [("fft".to_owned(), 0.3)].into());
    }
}
