//! Instants of samples: of an even record no number is kept for each.

use std::ops::Range;

/// Sample instants of a stretch, s, rising.
///
/// ```
/// use twinlag_model::Instants;
///
/// let even = Instants::even(10.0, 0.5, 5);
/// assert_eq!(even.iter().collect::<Vec<f64>>(), [10.0, 10.5, 11.0, 11.5, 12.0]);
/// let as_stamped = Instants::from(vec![0.0, 0.4, 1.1]);
/// assert_eq!((as_stamped.at(1), as_stamped.len()), (0.4, 3));
/// assert_eq!(even.first_not_before(10.6), 2);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Instants(Kind);

#[derive(Clone, Debug, PartialEq)]
enum Kind {
    /// `origin_s + k step_s` of each `k` in `places`.
    Even { origin_s: f64, step_s: f64, places: Range<usize> },
    /// Each as it is.
    Stamped(Vec<f64>),
}

impl Default for Instants {
    fn default() -> Self {
        Self::from(Vec::new())
    }
}

impl From<Vec<f64>> for Instants {
    fn from(time_s: Vec<f64>) -> Self {
        Self(Kind::Stamped(time_s))
    }
}

impl Instants {
    /// Instants `first_s + k step_s`, `k` from 0 to `samples - 1`.
    pub fn even(first_s: f64, step_s: f64, samples: usize) -> Self {
        Self(Kind::Even { origin_s: first_s, step_s, places: 0..samples })
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        match &self.0 {
            Kind::Even { places, .. } => places.len(),
            Kind::Stamped(time_s) => time_s.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The instant of sample `k`, s.
    ///
    /// # Panics
    /// If there is no such sample.
    pub fn at(&self, k: usize) -> f64 {
        match &self.0 {
            Kind::Even { origin_s, step_s, places } => {
                assert!(k < places.len(), "sample {k} of {}", places.len());
                origin_s + (places.start + k) as f64 * step_s
            }
            Kind::Stamped(time_s) => time_s[k],
        }
    }

    /// All of them, s.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = f64> + Clone + '_ {
        self.of(0..self.len())
    }

    /// Those of some samples, s.
    pub(crate) fn of(&self, samples: Range<usize>) -> impl ExactSizeIterator<Item = f64> + Clone + '_ {
        samples.map(|k| self.at(k))
    }

    /// Writes those of some samples behind what is in `out`, s.
    pub(crate) fn write(&self, samples: Range<usize>, out: &mut Vec<f64>) {
        match &self.0 {
            Kind::Even { origin_s, step_s, places } => {
                let places = places.start + samples.start..places.start + samples.end;
                out.extend(places.map(|k| origin_s + k as f64 * step_s));
            }
            Kind::Stamped(time_s) => out.extend_from_slice(&time_s[samples]),
        }
    }

    /// The first sample at `time_s` or later; how many there are if none is.
    pub fn first_not_before(&self, time_s: f64) -> usize {
        let (mut from, mut to) = (0, self.len());
        while from < to {
            let middle = from.midpoint(to);
            if self.at(middle) < time_s { from = middle + 1 } else { to = middle }
        }
        from
    }

    /// The first sample later than `time_s`; how many there are if none is.
    pub(crate) fn first_after(&self, time_s: f64) -> usize {
        match &self.0 {
            Kind::Even { origin_s, step_s, places } => {
                let place = ((time_s - origin_s) / step_s).floor() + 1.0 - places.start as f64;
                let mut first = place.clamp(0.0, places.len() as f64) as usize;
                // A quotient that rounds across a whole number is off by one.
                while first > 0 && self.at(first - 1) > time_s {
                    first -= 1;
                }
                while first < places.len() && self.at(first) <= time_s {
                    first += 1;
                }
                first
            }
            Kind::Stamped(stamps_s) => stamps_s.partition_point(|t| *t <= time_s),
        }
    }

    /// Some of them.
    pub(crate) fn cut(&self, samples: Range<usize>) -> Self {
        match &self.0 {
            Kind::Even { origin_s, step_s, places } => {
                let places = places.start + samples.start..places.start + samples.end;
                Self(Kind::Even { origin_s: *origin_s, step_s: *step_s, places })
            }
            Kind::Stamped(time_s) => Self(Kind::Stamped(time_s[samples].to_vec())),
        }
    }

    /// These, so many seconds later.
    pub(crate) fn later(&self, by_s: f64) -> Self {
        match &self.0 {
            Kind::Even { origin_s, step_s, places } => {
                Self(Kind::Even { origin_s: origin_s + by_s, step_s: *step_s, places: places.clone() })
            }
            Kind::Stamped(time_s) => Self(Kind::Stamped(time_s.iter().map(|t| t + by_s).collect())),
        }
    }

    /// Puts others behind these.
    pub(crate) fn append(&mut self, others: Self) {
        if self.is_empty() {
            *self = others;
        } else {
            *self = Self::from(self.iter().chain(others.iter()).collect::<Vec<f64>>());
        }
    }

    /// Whether each is a finite number.
    pub(crate) fn are_finite(&self) -> bool {
        match &self.0 {
            Kind::Even { origin_s, step_s, .. } => origin_s.is_finite() && step_s.is_finite(),
            Kind::Stamped(time_s) => time_s.iter().all(|t| t.is_finite()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pieces of even instants are the instants of the whole, to the last bit.
    #[test]
    fn pieces_of_even_instants_are_those_of_the_whole() {
        let all = Instants::even(0.3, 0.1, 1000);
        let stamped = Instants::from(all.iter().collect::<Vec<f64>>());
        for samples in [0..1000, 17..400, 400..401, 999..1000] {
            let want: Vec<u64> = all.iter().skip(samples.start).take(samples.len()).map(f64::to_bits).collect();
            for instants in [&all, &stamped] {
                let piece = instants.cut(samples.clone());
                assert_eq!(piece.iter().map(f64::to_bits).collect::<Vec<u64>>(), want);
                assert_eq!(piece.cut(0..1).at(0).to_bits(), want[0]);
            }
        }
        for (k, time_s) in all.iter().enumerate() {
            assert_eq!([&all, &stamped].map(|i| i.first_not_before(time_s)), [k; 2]);
            assert_eq!([&all, &stamped].map(|i| i.first_after(time_s)), [k + 1; 2]);
            assert_eq!([&all, &stamped].map(|i| i.first_after(time_s.next_down())), [k; 2]);
        }
        assert_eq!(all.first_not_before(1e9), 1000);
        assert_eq!([-1e300, 1e300].map(|time_s| all.first_after(time_s)), [0, 1000]);
        assert_eq!(all.later(2.0).at(5), 2.3 + 5.0 * 0.1);
    }
}
