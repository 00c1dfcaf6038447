//! Merging pieces that arrive in any order as if they had arrived in one.
//!
//! Over `blocks` pieces stands one binary tree: node `i` of level `l` covers the blocks from
//! `i 2^l` up to `(i + 1) 2^l`, as far as there are any. A piece is a leaf. When both children of a
//! node are there they merge, left before right, and the node takes their place; a child whose
//! sibling would lie beyond the last block moves up unmerged. So the root is the same expression in
//! the leaves whatever the order of arrival, and with it the same bits. Exact.

use std::collections::BTreeMap;
use std::ops::Range;

use serde::ser::SerializeStruct;
use serde::{Deserialize, Serialize, Serializer};
use thiserror::Error;

/// What can be combined with what came later.
pub trait Merge {
    /// Adds `later` to `self`. Need not be associative or commutative: the forest always does it in
    /// the same order.
    fn merge(&mut self, later: Self);
}

/// Why a piece did not fit, or the whole could not be had.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[expect(missing_docs, reason = "each message names its fields")]
#[non_exhaustive]
pub enum ForestError {
    #[error("blocks {} to {} of {blocks} are there twice", .range.start, .range.end - 1)]
    Twice { range: Range<u64>, blocks: u64 },
    #[error("there is no node at block {first}, level {level}, in a tree over {blocks} blocks")]
    NoSuchNode { first: u64, level: u32, blocks: u64 },
    #[error("a tree over {got} blocks cannot be joined with one over {expected}")]
    OtherTree { expected: u64, got: u64 },
}

/// The merged nodes of a binary tree over block indices. For the first `b` blocks it holds at most
/// `log2 b + 1` nodes, for `b` neighbours anywhere at most `2 log2 b + 1`, and so for `g + 1` runs
/// with `g` gaps between them at most `g + 1` times that.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(try_from = "Unchecked<T>", bound(deserialize = "T: Deserialize<'de>"))]
pub struct Forest<T> {
    blocks: u64,
    /// By the first block that they cover.
    nodes: BTreeMap<u64, Node<T>>,
}

#[derive(Clone, Debug, PartialEq)]
struct Node<T> {
    level: u32,
    value: T,
}

impl<T> Forest<T> {
    /// Blocks that a tree can have: node sizes must fit their type.
    pub const LARGEST: u64 = 1 << 62;

    /// An empty forest for `blocks` blocks.
    ///
    /// # Panics
    /// If there are none, or more than [`Forest::LARGEST`].
    #[must_use]
    pub fn new(blocks: u64) -> Self {
        assert!((1..=Self::LARGEST).contains(&blocks), "a forest is over 1 to 2⁶² blocks, not {blocks}");
        Self { blocks, nodes: BTreeMap::new() }
    }

    /// How many blocks the whole has.
    pub fn blocks(&self) -> u64 {
        self.blocks
    }

    /// The nodes held, in order, with the blocks that each covers.
    pub fn nodes(&self) -> impl ExactSizeIterator<Item = (Range<u64>, &T)> {
        self.nodes.iter().map(|(&first, node)| (self.cover(first, node.level), &node.value))
    }

    /// Whether `block` has arrived.
    pub fn contains(&self, block: u64) -> bool {
        self.first_common(&(block..block + 1)).is_some()
    }

    /// The blocks that have not arrived, as ranges in ascending order.
    pub fn missing(&self) -> Vec<Range<u64>> {
        let mut gaps = Vec::new();
        let mut next = 0;
        for (cover, _) in self.nodes() {
            if next < cover.start {
                gaps.push(next..cover.start);
            }
            next = cover.end;
        }
        if next < self.blocks {
            gaps.push(next..self.blocks);
        }
        gaps
    }

    /// The whole, once all blocks have arrived; before that, `None`.
    pub fn root(&self) -> Option<&T> {
        // The node that starts at 0 is the root if it reaches the end: nodes merge as soon as they
        // can.
        self.nodes.get(&0).filter(|node| self.cover(0, node.level).end == self.blocks).map(|node| &node.value)
    }

    /// The whole by value.
    ///
    /// # Errors
    /// The forest itself, if blocks are missing.
    pub fn into_root(mut self) -> Result<T, Self> {
        if self.root().is_some()
            && let Some(node) = self.nodes.remove(&0)
        {
            return Ok(node.value);
        }
        Err(self)
    }

    /// Whether the tree has such a node, and nothing below it is there yet.
    fn check_room(&self, first: u64, level: u32) -> Result<(), ForestError> {
        let blocks = self.blocks;
        if first >= blocks || level > 62 || first & ((1 << level) - 1) != 0 {
            return Err(ForestError::NoSuchNode { first, level, blocks });
        }
        match self.first_common(&self.cover(first, level)) {
            Some(range) => Err(ForestError::Twice { range, blocks }),
            None => Ok(()),
        }
    }

    fn cover(&self, first: u64, level: u32) -> Range<u64> {
        first..(first + (1 << level)).min(self.blocks)
    }

    /// What a node held has in common with `range`, the first such node.
    fn first_common(&self, range: &Range<u64>) -> Option<Range<u64>> {
        let before = self.nodes.range(..=range.start).next_back();
        let after = self.nodes.range(range.start..range.end).next();
        before.into_iter().chain(after).find_map(|(&first, node)| {
            let cover = self.cover(first, node.level);
            let common = cover.start.max(range.start)..cover.end.min(range.end);
            (common.start < common.end).then_some(common)
        })
    }
}

/// The blocks of each node that a forest over `blocks` blocks has of neighbours, in order.
pub(crate) fn nodes_of(range: Range<u64>, blocks: u64) -> impl Iterator<Item = Range<u64>> {
    let mut start = range.start;
    std::iter::from_fn(move || {
        if start >= range.end {
            return None;
        }
        // The largest node that begins there and is all of it in the range; what lies beyond the last block is missing nowhere.
        let end_of = |level: u32| start.saturating_add(1 << level).min(blocks);
        let highest = start.trailing_zeros().min(62);
        let level = (0..=highest).rev().find(|level| end_of(*level) <= range.end).unwrap_or(0);
        let node = start..end_of(level);
        start = node.end;
        Some(node)
    })
}

impl<T: Merge> Forest<T> {
    /// Adds the piece of one block.
    ///
    /// # Errors
    /// [`ForestError::Twice`]; [`ForestError::NoSuchNode`] for a block beyond the last.
    pub fn insert(&mut self, block: u64, value: T) -> Result<(), ForestError> {
        self.graft(block, 0, value)
    }

    /// Adds all that another forest over the same blocks holds. On an error nothing has changed.
    ///
    /// # Errors
    /// [`ForestError::Twice`] if they have a block in common; [`ForestError::OtherTree`].
    pub fn join(&mut self, other: Self) -> Result<(), ForestError> {
        if self.blocks != other.blocks {
            return Err(ForestError::OtherTree { expected: self.blocks, got: other.blocks });
        }
        if let Some(range) = other.nodes().find_map(|(cover, _)| self.first_common(&cover)) {
            return Err(ForestError::Twice { range, blocks: self.blocks });
        }
        other.nodes.into_iter().try_for_each(|(first, node)| self.graft(first, node.level, node.value))
    }

    fn graft(&mut self, mut first: u64, mut level: u32, mut value: T) -> Result<(), ForestError> {
        self.check_room(first, level)?;
        let blocks = self.blocks;
        while first != 0 || 1 << level < blocks {
            let size = 1_u64 << level;
            let is_left = first & size == 0;
            let sibling = first ^ size;
            if sibling < blocks {
                if self.nodes.get(&sibling).is_none_or(|node| node.level != level) {
                    break;
                }
                let Some(Node { value: other, .. }) = self.nodes.remove(&sibling) else { break };
                if is_left {
                    value.merge(other);
                } else {
                    let right = std::mem::replace(&mut value, other);
                    value.merge(right);
                    first = sibling;
                }
            }
            level += 1;
        }
        self.nodes.insert(first, Node { level, value });
        Ok(())
    }
}

#[derive(Serialize)]
struct NodeView<'a, T> {
    first: u64,
    level: u32,
    value: &'a T,
}

impl<T: Serialize> Serialize for Forest<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        // By reference: deriving with `into` would copy all that a study has.
        let nodes: Vec<_> =
            self.nodes.iter().map(|(&first, Node { level, value })| NodeView { first, level: *level, value }).collect();
        let mut state = serializer.serialize_struct("Forest", 2)?;
        state.serialize_field("blocks", &self.blocks)?;
        state.serialize_field("nodes", &nodes)?;
        state.end()
    }
}

#[derive(Deserialize)]
struct Unchecked<T> {
    blocks: u64,
    nodes: Vec<UncheckedNode<T>>,
}

#[derive(Deserialize)]
struct UncheckedNode<T> {
    first: u64,
    level: u32,
    value: T,
}

impl<T> TryFrom<Unchecked<T>> for Forest<T> {
    type Error = String;

    fn try_from(u: Unchecked<T>) -> Result<Self, String> {
        if !(1..=Self::LARGEST).contains(&u.blocks) {
            return Err(format!("a forest is over 1 to 2⁶² blocks, not {}", u.blocks));
        }
        let mut forest = Self::new(u.blocks);
        for UncheckedNode { first, level, value } in u.nodes {
            forest.check_room(first, level).map_err(|e| e.to_string())?;
            // A forest never holds a node that could have merged or moved up. Nor is it done here,
            // for a value: whoever reads it has not checked it yet.
            let sibling = first ^ (1 << level);
            let is_root = first == 0 && 1 << level >= u.blocks;
            let is_late = sibling >= u.blocks || forest.nodes.get(&sibling).is_some_and(|node| node.level == level);
            if is_late && !is_root {
                return Err(format!("the node at block {first}, level {level}, should have merged"));
            }
            forest.nodes.insert(first, Node { level, value });
        }
        Ok(forest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Neither associative nor commutative: it writes down the tree.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    struct Term(String);

    impl Merge for Term {
        fn merge(&mut self, later: Self) {
            self.0 = format!("({}{})", self.0, later.0);
        }
    }

    fn leaf(block: u64) -> Term {
        Term(char::from(b'a' + block as u8).to_string())
    }

    fn root_of(order: impl IntoIterator<Item = u64>, blocks: u64) -> Option<Term> {
        let mut forest = Forest::new(blocks);
        for block in order {
            forest.insert(block, leaf(block)).unwrap();
        }
        forest.into_root().ok()
    }

    /// Drawn by hand.
    #[test]
    fn the_tree_is_the_canonical_one() {
        for (blocks, want) in [(1, "a"), (2, "(ab)"), (3, "((ab)c)"), (5, "(((ab)(cd))e)"), (6, "(((ab)(cd))(ef))")] {
            assert_eq!(root_of(0..blocks, blocks), Some(Term(want.into())), "{blocks} blocks");
            assert_eq!(root_of((0..blocks).rev(), blocks), Some(Term(want.into())), "{blocks} blocks, reversed");
        }
        assert_eq!(root_of([0, 2], 3), None);
    }

    /// After b blocks in order the nodes are the ones in the binary digits of b, of which there are
    /// ⌊log2 b⌋ + 1.
    #[test]
    fn blocks_in_order_leave_no_more_nodes_than_binary_digits() {
        #[derive(Clone)]
        struct Nothing;
        impl Merge for Nothing {
            fn merge(&mut self, _: Self) {}
        }
        let mut forest = Forest::new(100_000);
        for b in 1..=100_000_u64 {
            forest.insert(b - 1, Nothing).unwrap();
            let (got, most) = (forest.nodes().len() as u32, b.ilog2() + 1);
            assert!(got <= most, "{b} blocks: got {got} nodes, at most {most}");
        }
        assert_eq!(forest.nodes().len(), 1);
    }

    /// At each level, at most two nodes can lack their sibling, at the two ends; at the highest at
    /// most one.
    #[test]
    fn a_run_of_blocks_leaves_few_nodes_wherever_it_begins() {
        for first in 0..64 {
            for length in 1..=64 - first {
                let mut forest = Forest::new(64);
                (first..first + length).for_each(|block| forest.insert(block, leaf(block)).unwrap());
                let (got, most) = (forest.nodes().len() as u32, 2 * length.ilog2() + 1);
                assert!(got <= most, "{length} blocks from {first}: got {got} nodes, at most {most}");
            }
        }
    }

    /// The oracle is the forest itself, of a number of blocks that is a power of two and of others.
    #[test]
    fn the_nodes_of_a_run_are_foreseen() {
        for blocks in [1, 2, 13, 32, 37] {
            for first in 0..blocks {
                for end in first + 1..=blocks {
                    let mut forest = Forest::new(blocks);
                    (first..end).for_each(|block| forest.insert(block, leaf(block)).unwrap());
                    let are: Vec<_> = forest.nodes().map(|(covers, _)| covers).collect();
                    assert_eq!(nodes_of(first..end, blocks).collect::<Vec<_>>(), are, "{first} to {end} of {blocks}");
                }
            }
        }
    }

    #[test]
    fn a_block_twice_is_refused_and_named() {
        let mut forest = Forest::new(6);
        for block in [0, 1, 2, 3, 5] {
            forest.insert(block, leaf(block)).unwrap();
        }
        assert_eq!(forest.missing(), vec![4..5]);
        let before = forest.clone();
        assert_eq!(forest.insert(2, leaf(2)), Err(ForestError::Twice { range: 2..3, blocks: 6 }));
        assert_eq!(forest.insert(6, leaf(6)), Err(ForestError::NoSuchNode { first: 6, level: 0, blocks: 6 }));
        let mut other = Forest::new(6);
        other.insert(4, leaf(4)).unwrap();
        other.insert(5, leaf(5)).unwrap();
        assert_eq!(forest.join(other), Err(ForestError::Twice { range: 5..6, blocks: 6 }));
        assert_eq!(forest.join(Forest::new(7)), Err(ForestError::OtherTree { expected: 6, got: 7 }));
        assert_eq!(forest, before);
    }

    #[test]
    fn a_false_forest_is_refused() {
        for bad in [
            r#"{"blocks":0,"nodes":[]}"#,
            r#"{"blocks":4,"nodes":[{"first":1,"level":1,"value":"a"}]}"#,
            r#"{"blocks":4,"nodes":[{"first":4,"level":0,"value":"a"}]}"#,
            r#"{"blocks":4,"nodes":[{"first":0,"level":63,"value":"a"}]}"#,
            r#"{"blocks":4,"nodes":[{"first":0,"level":1,"value":"a"},{"first":1,"level":0,"value":"b"}]}"#,
            r#"{"blocks":4,"nodes":[{"first":0,"level":0,"value":"a"},{"first":1,"level":0,"value":"b"}]}"#,
            r#"{"blocks":3,"nodes":[{"first":2,"level":0,"value":"a"}]}"#,
        ] {
            assert!(serde_json::from_str::<Forest<Term>>(bad).is_err(), "{bad} was accepted");
        }
    }

    proptest! {
        #[test]
        fn any_order_and_any_split_with_a_stop_on_disk_gives_the_same_tree(
            (blocks, order, shards) in (1_u64..24).prop_flat_map(|blocks| (
                Just(blocks),
                Just((0..blocks).collect::<Vec<_>>()).prop_shuffle(),
                prop::collection::vec(0_usize..4, blocks as usize),
            ))
        ) {
            let want = root_of(0..blocks, blocks);
            prop_assert_eq!(root_of(order.iter().copied(), blocks), want.clone());
            let mut parts = vec![Forest::new(blocks); 4];
            for (&block, &shard) in order.iter().zip(&shards) {
                parts[shard].insert(block, leaf(block)).unwrap();
            }
            let mut whole = Forest::new(blocks);
            for part in parts {
                let text = serde_json::to_string(&part).unwrap();
                let read: Forest<Term> = serde_json::from_str(&text).unwrap();
                prop_assert_eq!(&read, &part);
                whole.join(read).unwrap();
            }
            prop_assert_eq!(whole.into_root().ok(), want);
        }
    }
}
