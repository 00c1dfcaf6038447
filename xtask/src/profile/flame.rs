//! A profile as a flame graph.

use std::collections::BTreeMap;

use anyhow::{Result, anyhow};
use pprof::flamegraph::{self, Options};

use super::sample::Sampled;

/// Share below which a frame is left out: the picture shows what matters, and stays small.
const LEAST_SHARE: f64 = 0.01;
const WIDTH_PX: usize = 1200;

/// The flame graph of a profile, as SVG.
pub(super) fn picture(title: &str, sampled: &Sampled) -> Result<String> {
    let stacks = pruned(&sampled.stacks);
    let lines: Vec<String> = stacks.iter().map(|(stack, count)| format!("{stack} {count}")).collect();
    let mut options = Options::default();
    title.clone_into(&mut options.title);
    options.count_name = "samples".into();
    options.image_width = Some(WIDTH_PX);
    options.deterministic = true;
    let mut svg = Vec::new();
    flamegraph::from_lines(&mut options, lines.iter().map(String::as_str), &mut svg)
        .map_err(|error| anyhow!("{error}"))?;
    Ok(String::from_utf8(svg)?)
}

/// Stacks cut where too few samples went deeper.
fn pruned(stacks: &BTreeMap<String, usize>) -> BTreeMap<String, usize> {
    let all: usize = stacks.values().sum();
    let ends = |stack: &str| stack.match_indices(';').map(|(at, _)| at).chain([stack.len()]).collect::<Vec<usize>>();
    let mut through: BTreeMap<&str, usize> = BTreeMap::new();
    for (stack, count) in stacks {
        for end in ends(stack) {
            *through.entry(&stack[..end]).or_default() += count;
        }
    }
    let mut out = BTreeMap::new();
    for (stack, count) in stacks {
        let is_met = |end: &usize| through[&stack[..*end]] as f64 >= LEAST_SHARE * all as f64;
        let end = ends(stack).into_iter().take_while(is_met).last();
        if let Some(end) = end {
            *out.entry(stack[..end].to_owned()).or_default() += count;
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a thousand samples nine went on from `b` to `c`, and one somewhere else.
    #[test]
    fn rare_frames_are_cut_off_and_their_samples_stay() {
        let of = |stacks: &[(&str, usize)]| stacks.iter().map(|(stack, count)| ((*stack).to_owned(), *count)).collect();
        let stacks: BTreeMap<String, usize> = of(&[("a;b", 990), ("a;b;c", 9), ("d", 1)]);
        assert_eq!(pruned(&stacks), of(&[("a;b", 999)]));
    }
}
