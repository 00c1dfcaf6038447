//! Counters of microcontrollers, which begin anew at a power of two.

/// Bits of such a counter: `millis()` and `micros()` have 32, short ones 16.
const BITS: [u32; 2] = [32, 16];
/// How many of its usual steps a counter may go on by where it begins anew: a row or two may be lost.
const MAX_STEPS: f64 = 5.0;

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
    let rises: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).filter(|rise| *rise > 0.0).collect();
    if rises.is_empty() {
        return None;
    }
    let longest = MAX_STEPS * crate::sampling::median(&rises);
    BITS.into_iter().find_map(|bits| {
        let turn = 2_f64.powi(bits as i32);
        let is_turn = |pair: &[f64]| pair[0] < turn && (0.0..=longest).contains(&(pair[1] + turn - pair[0]));
        if values.windows(2).any(|pair| pair[1] < pair[0] && !is_turn(pair)) {
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

#[cfg(test)]
mod tests {
    use super::{Wrapped, unwrapped};

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
        let reset: Vec<f64> = (0..200).map(|k| 100.0 * f64::from(k % 120)).collect();
        assert_eq!(unwrapped(&reset), None);
        assert_eq!(unwrapped(&[0.0, 100.0, 200.0]), None);
        assert_eq!(unwrapped(&[]), None);
    }
}
