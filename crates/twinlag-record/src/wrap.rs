//! Counters of microcontrollers, which begin anew at a power of two.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use crate::sampling;

/// Bits of such a counter: `millis()` and `micros()` have 32, short ones 16.
const BITS: [u32; 2] = [32, 16];
/// How many of its usual steps a counter may go on by where it begins anew: a row or two may be lost.
const MAX_STEPS: f64 = 5.0;
/// How much of its range a counter may go on by where it begins anew: one that is read so seldom shows nothing.
const MAX_SHARE: f64 = 0.125;

/// Where a counter began anew.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Wrapped {
    pub(crate) bits: u32,
    /// How often.
    pub(crate) times: usize,
}

/// Numbers that were counted on where they begin anew; `None` where they rise, or fall for another reason.
pub(crate) fn unwrapped(values: &[f64]) -> Option<(Vec<f64>, Wrapped)> {
    let falls = values.windows(2).filter(|pair| pair[1] < pair[0]).count();
    if falls == 0 || values.iter().any(|value| value.fract() != 0.0 || *value < 0.0) {
        return None;
    }
    let longest = longest_step(values);
    BITS.into_iter().find_map(|bits| {
        let turn = 2_f64.powi(bits as i32);
        if values.windows(2).any(|pair| pair[1] < pair[0] && !is_turn(pair[0], pair[1], turn, longest)) {
            return None;
        }
        let (mut turns, mut before) = (0.0, f64::NEG_INFINITY);
        let counted_on = values.iter().map(|&value| {
            if value < before {
                turns += turn;
            }
            before = value;
            value + turns
        });
        Some((counted_on.collect(), Wrapped { bits, times: falls }))
    })
}

/// Numbers as they are, or counted on where they begin anew.
pub(crate) fn counted_on(values: &[f64]) -> Cow<'_, [f64]> {
    unwrapped(values).map_or(Cow::Borrowed(values), |(values, _)| Cow::Owned(values))
}

/// Counts on what comes row by row.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct CountingOn {
    /// The longest step on.
    longest: f64,
    before: f64,
    turns: f64,
}

impl CountingOn {
    /// - `head`: the first numbers
    pub(crate) fn behind(head: &[f64]) -> Self {
        let counted = counted_on(head);
        let (last, before) = (counted.last().copied().unwrap_or(0.0), head.last().copied().unwrap_or(0.0));
        Self { longest: longest_step(head), before, turns: last - before }
    }

    /// The next number, counted on.
    pub(crate) fn next(&mut self, value: f64) -> f64 {
        if value < self.before && value.fract() == 0.0 {
            let turn_of = |bits: u32| {
                Some(2_f64.powi(bits as i32)).filter(|turn| is_turn(self.before, value, *turn, self.longest))
            };
            self.turns += BITS.into_iter().find_map(turn_of).unwrap_or(0.0);
        }
        self.before = value;
        value + self.turns
    }
}

/// The longest step on of a counter that is read as often as these.
fn longest_step(values: &[f64]) -> f64 {
    let rises: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).filter(|rise| *rise > 0.0).collect();
    if rises.is_empty() { 0.0 } else { MAX_STEPS * sampling::median(&rises) }
}

/// Whether a counter that begins anew at `turn` goes on from one number to the next.
fn is_turn(before: f64, now: f64, turn: f64, longest: f64) -> bool {
    before < turn && (0.0..=longest.min(MAX_SHARE * turn)).contains(&(now + turn - before))
}

#[cfg(test)]
mod tests {
    use super::{CountingOn, Wrapped, counted_on, unwrapped};

    #[test]
    fn a_counter_is_counted_on_and_one_that_was_reset_is_not() {
        let counter = |bits: u32, step: f64| -> Vec<f64> {
            let turn = 2_f64.powi(bits as i32);
            (0..200).map(|k| (turn - 50.0 * step + step * f64::from(k)).rem_euclid(turn)).collect()
        };
        for bits in [32, 16] {
            let (values, wrapped) = unwrapped(&counter(bits, 100.0)).expect("it begins anew");
            assert_eq!(wrapped, Wrapped { bits, times: 1 });
            assert!(values.windows(2).all(|pair| pair[1] - pair[0] == 100.0));
        }
        // Of 16 bits, every 655 rows.
        let often: Vec<f64> = (0..2000).map(|k| (100.0 * f64::from(k)) % 65_536.0).collect();
        assert_eq!(unwrapped(&often).map(|(_, wrapped)| wrapped.times), Some(3));
        let (head, rest) = often.split_at(700);
        let mut counting = CountingOn::behind(head);
        let row_by_row: Vec<f64> = rest.iter().map(|value| counting.next(*value)).collect();
        assert_eq!(row_by_row, counted_on(&often)[700..]);
        let reset: Vec<f64> = (0..200).map(|k| 100.0 * f64::from(k % 120)).collect();
        assert_eq!(unwrapped(&reset), None);
        // A log that was begun anew every four rows.
        let restarted: Vec<f64> = (0..40).map(|k| 10_000.0 * f64::from(k % 4)).collect();
        assert_eq!(unwrapped(&restarted), None);
        assert_eq!(unwrapped(&[0.0, 100.0, 200.0]), None);
        assert_eq!(unwrapped(&[]), None);
    }
}
