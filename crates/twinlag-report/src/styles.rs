//! Which colour and which marker each name has in a figure.

use crate::palette::{CYCLE, Colour};

/// Colour and marker of each name, by a number: the least that no series has with which the name
/// shares a panel. So names that never meet may share a colour, and a figure of many panels does
/// not run out of them.
pub(crate) struct Styles(Vec<(String, usize)>);

impl Styles {
    /// - `charts`: the names of the series of each panel
    pub(crate) fn new(charts: &[Vec<&str>]) -> Self {
        let mut given: Vec<(String, usize)> = Vec::new();
        for &name in charts.iter().flatten() {
            if given.iter().any(|(n, _)| n == name) {
                continue;
            }
            let meets = |other: &str| charts.iter().any(|c| c.contains(&name) && c.contains(&other));
            let taken: Vec<usize> = given.iter().filter(|(n, _)| meets(n)).map(|(_, k)| *k).collect();
            let free = (0..=taken.len()).find(|k| !taken.contains(k)).unwrap_or(taken.len());
            given.push((name.to_owned(), free));
        }
        Self(given)
    }

    pub(crate) fn of(&self, name: &str, own: Option<Colour>) -> (Colour, usize) {
        let index = self.0.iter().find(|(n, _)| n == name).map_or(0, |(_, k)| *k);
        (own.unwrap_or(CYCLE[index % CYCLE.len()]), index)
    }
}
