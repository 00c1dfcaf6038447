//! Which residuals count, and which of their frequencies.

use std::ops::Range;

use crate::disagreement::Piece;
use crate::observations::Observations;
use crate::weighting::Weighting;

/// The residuals that count, by the sample in the middle of their reach.
#[derive(Clone, Debug)]
pub struct Selection {
    /// Whether a sample counts.
    pub counts: Vec<bool>,
    /// The weights of the frequencies.
    pub weighting: Weighting,
}

impl Selection {
    /// Whether a sample counts.
    pub fn holds(&self, sample: usize) -> bool {
        self.counts.get(sample).copied().unwrap_or(false)
    }

    /// The selection of successive samples, counted from the first of them.
    pub(crate) fn of_samples(&self, samples: Range<usize>) -> Self {
        Self { counts: self.counts[samples].to_vec(), weighting: self.weighting.clone() }
    }

    /// Those of these samples that are in some part of the record.
    pub(crate) fn where_in(&self, is_in: impl Fn(usize) -> bool) -> Self {
        let counts = self.counts.iter().enumerate().map(|(sample, counts)| *counts && is_in(sample)).collect();
        Self { counts, weighting: self.weighting.clone() }
    }

    /// How many samples count.
    pub(crate) fn counted(&self) -> usize {
        self.counts.iter().filter(|counts| **counts).count()
    }

    /// Degrees of freedom that masked readings take away: one each, but where both channels are masked for `m` samples in a row no more
    /// than the `m + consumed` residuals that these readings enter.
    ///
    /// - `consumed`: by how many samples a residual reaches beyond its own
    pub(crate) fn taken_by_masks(&self, observations: &Observations, consumed: usize) -> usize {
        let mut taken = 0;
        let mut counts = self.counts.iter();
        for stretch in &observations.stretches {
            let mut in_a_row = 0;
            for ((first, second), counts) in stretch.masked[0].iter().zip(&stretch.masked[1]).zip(&mut counts) {
                let both = *first && *second && *counts;
                in_a_row = if both { in_a_row + 1 } else { 0 };
                taken += match (both, (*first || *second) && *counts) {
                    (true, _) if in_a_row <= consumed => 2,
                    (_, is_one) => usize::from(is_one),
                };
            }
        }
        taken
    }

    /// Samples of the residuals of `pieces` that count.
    pub(crate) fn samples(&self, pieces: &[Piece]) -> impl Iterator<Item = usize> {
        let of_piece = |p: &Piece| p.first_sample..p.first_sample + p.count;
        pieces.iter().flat_map(of_piece).filter(|sample| self.holds(*sample))
    }

    /// Appends those of `filtered` values that count to `out`, the first of them of sample `first`.
    fn pick(&self, filtered: &[f64], first: usize, out: &mut Vec<f64>) {
        let counts = self.counts.get(first..).unwrap_or(&[]);
        out.extend(filtered.iter().zip(counts).filter(|(_, counts)| **counts).map(|(r, _)| *r));
    }
}

/// Rising numbers as ranges of neighbours.
pub(crate) fn ranges(numbers: impl Iterator<Item = usize>) -> Vec<Range<usize>> {
    let mut out: Vec<Range<usize>> = Vec::new();
    for number in numbers {
        match out.last_mut() {
            Some(last) if last.end == number => last.end += 1,
            _ => out.push(number..number + 1),
        }
    }
    out
}

/// Samples in rising order, in runs of neighbours.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Samples(Vec<Range<usize>>);

impl Samples {
    /// How many there are.
    pub fn len(&self) -> usize {
        self.0.iter().map(Range::len).sum()
    }

    /// Whether there is not one.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The runs.
    pub fn runs(&self) -> &[Range<usize>] {
        &self.0
    }

    /// Appends `samples`, which come after all of these.
    pub(crate) fn append(&mut self, samples: impl Iterator<Item = usize>) {
        for run in ranges(samples) {
            match self.0.last_mut() {
                Some(last) if last.end == run.start => last.end = run.end,
                _ => self.0.push(run),
            }
        }
    }

    /// Takes out the first `count`.
    pub(crate) fn take_first(&mut self, mut count: usize) -> Self {
        let mut out = Vec::new();
        let mut whole = 0;
        for run in &mut self.0 {
            let taken = count.min(run.len());
            if taken > 0 {
                out.push(run.start..run.start + taken);
            }
            run.start += taken;
            count -= taken;
            whole += usize::from(run.start == run.end);
            if count == 0 {
                break;
            }
        }
        self.0.drain(..whole);
        Self(out)
    }

    /// All of them, in order.
    pub fn iter(&self) -> impl Iterator<Item = usize> + Clone + '_ {
        self.0.iter().cloned().flatten()
    }

    /// Those from place `first` on.
    pub(crate) fn iter_from(&self, mut first: usize) -> impl Iterator<Item = usize> + '_ {
        self.0.iter().flat_map(move |run| {
            let skipped = first.min(run.len());
            first -= skipped;
            run.start + skipped..run.end
        })
    }
}

impl FromIterator<usize> for Samples {
    /// - `samples`: in rising order
    fn from_iter<I: IntoIterator<Item = usize>>(samples: I) -> Self {
        Self(ranges(samples.into_iter()))
    }
}

/// Which values of a piece a window has.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Span<'a> {
    pub(crate) piece: &'a Piece,
    /// Whether it is the first of the piece.
    pub(crate) is_first: bool,
    /// Whether it is the last of the piece.
    pub(crate) is_last: bool,
}

/// A filter of values that come window after window: it reaches over the ends of windows.
#[derive(Clone, Debug, Default)]
pub(crate) struct Stream {
    /// Values that the filter reaches from the next one on.
    values: Vec<f64>,
    filtered: Vec<f64>,
    /// Place of the first of these values, and of the next one that is filtered.
    first: usize,
    next: usize,
}

impl Stream {
    /// Begins again.
    fn begin(&mut self) {
        self.values.clear();
        (self.first, self.next) = (0, 0);
    }

    /// The next filtered values, those of the window and of windows before it as far as the filter reaches only now, and the place
    /// of the first of them.
    pub(crate) fn filter(&mut self, window: &[f64], weighting: &Weighting, is_last: bool) -> (usize, &[f64]) {
        let needless = (self.next - self.first).saturating_sub(weighting.memory());
        self.values.drain(..needless);
        self.first += needless;
        self.values.extend_from_slice(window);
        weighting.apply_into(&self.values, &mut self.filtered);
        let unreached = if is_last { 0 } else { weighting.half() };
        let end = (self.first + self.values.len()).saturating_sub(unreached).max(self.next);
        let next = std::mem::replace(&mut self.next, end);
        (next, &self.filtered[next - self.first..end - self.first])
    }
}

/// Values of a piece that count, filtered, window after window.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sieve {
    stream: Stream,
}

impl Sieve {
    /// Appends those that count to `out`, of the window and of those before it as far as the filter reaches only now.
    pub(crate) fn pick(&mut self, window: &[f64], span: Span<'_>, selection: &Selection, out: &mut Vec<f64>) {
        if span.is_first {
            self.stream.begin();
        }
        let (first, filtered) = self.stream.filter(window, &selection.weighting, span.is_last);
        selection.pick(filtered, span.piece.first_sample + first, out);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observations::Stretch;

    /// `m` samples in a row without either reading take `m + consumed` residuals, and at most one for each reading.
    #[test]
    fn masked_readings_take_no_more_than_the_residuals_they_enter() {
        const SAMPLES: usize = 100;
        let taken = |masked: [&[usize]; 2], counts: &dyn Fn(usize) -> bool| {
            let time_s: Vec<f64> = (0..SAMPLES).map(|k| k as f64).collect();
            let is_masked = masked.map(|masked| (0..SAMPLES).map(|k| masked.contains(&k)).collect());
            let stretch = Stretch::new(time_s.clone(), [time_s.clone(), time_s]).with_missing(is_masked);
            let observations = Observations::new(vec![stretch], Some(1.0)).expect("long enough");
            let counts = (0..SAMPLES).map(counts).collect();
            Selection { counts, weighting: Weighting::default() }.taken_by_masks(&observations, 2)
        };
        let all = |_| true;
        assert_eq!(taken([&[], &[]], &all), 0);
        assert_eq!(taken([&[5, 6, 7, 8], &[]], &all), 4);
        assert_eq!(taken([&[5, 20], &[6, 30]], &all), 4);
        for m in 1..6 {
            let row: Vec<usize> = (10..10 + m).collect();
            assert_eq!(taken([&row, &row], &all), (2 * m).min(m + 2), "{m} samples");
        }
        assert_eq!(taken([&[5, 25], &[5, 25]], &|k| k < 20), 2);
    }

    /// The first samples and those that are left are all of them, in order, wherever they are cut.
    #[test]
    fn what_is_taken_out_is_the_beginning() {
        let all = [2, 3, 4, 8, 11, 12];
        for count in 0..=all.len() {
            let mut left: Samples = all.into_iter().collect();
            let taken = left.take_first(count);
            assert_eq!(taken.iter().collect::<Vec<_>>(), all[..count]);
            assert_eq!(left.iter().collect::<Vec<_>>(), all[count..]);
            let mut again = taken;
            again.append(left.iter());
            assert_eq!(again, all.into_iter().collect());
        }
    }

    #[test]
    fn neighbours_make_a_range() {
        assert_eq!(ranges([3, 4, 5, 9, 11, 12].into_iter()), [3..6, 9..10, 11..13]);
        assert_eq!(ranges(std::iter::empty()), []);
        let all = [3, 4, 5, 9, 11, 12];
        let samples: Samples = all.into_iter().collect();
        assert_eq!((samples.len(), samples.iter().collect::<Vec<usize>>()), (6, all.to_vec()));
        for first in 0..=6 {
            assert_eq!(samples.iter_from(first).collect::<Vec<usize>>(), all[first..], "from place {first}");
        }
    }

    /// Values that are filtered in windows are those that are filtered at once: the sums are the same ones.
    #[test]
    fn windows_are_filtered_as_the_whole() {
        let value = |k: usize| ((k * k * 7 + k) as f64 * 2.399).sin();
        let values: Vec<f64> = (0..3000).map(value).collect();
        let time_s = (0..3000).map(f64::from).collect();
        // Slow readings with noise, so that the weights are not flat.
        let reading = |i: usize| (0..3000).map(|k| (0.02 * (k + i) as f64).sin() + 0.1 * value(k + 1000 * i)).collect();
        let stretch = Stretch::new(time_s, [reading(0), reading(1)]);
        let observations = Observations::new(vec![stretch], Some(1.0)).expect("a record");
        let weighting = Weighting::of(&observations, [0.07; 2]);
        assert!(weighting.half() > 0);
        let counts: Vec<bool> = (0..3000).map(|k| k % 700 > 40).collect();
        for weighting in [Weighting::default(), weighting.by_residual(std::slice::from_ref(&values)), weighting] {
            let selection = Selection { counts: counts.clone(), weighting };
            let piece = Piece { stretch: 0, count: 2990, first_sample: 4 };
            let picked = |most: usize| {
                let (mut sieve, mut out) = (Sieve::default(), Vec::new());
                for from in (0..piece.count).step_by(most) {
                    let to = (from + most).min(piece.count);
                    let span = Span { piece: &piece, is_first: from == 0, is_last: to == piece.count };
                    sieve.pick(&values[from..to], span, &selection, &mut out);
                }
                out
            };
            let whole = picked(piece.count);
            assert_eq!(whole.len(), selection.samples(&[piece]).count());
            for most in [31, 512, 1495] {
                assert_eq!(picked(most), whole, "windows of {most}");
            }
        }
    }
}
