//! How likely a step of both time constants is at each instant, all of them at once.
//!
//! For a step at an instant the residual is, before it, that of the time constants before, and from then on that of those after,
//! but for the few samples that the filters reach over. With both linear in the parameters, the least sum of squares follows
//! from sums of products over the samples on either side, and these from one pass. It is exact for a small step; for a large one
//! where it is linearised.

use std::ops::Range;

use crate::cost::Linearised;
use crate::dense;

/// A pivot that is less than this share of what it was is rounding.
const PIVOT_SHARE: f64 = 1e-12;

/// The least energy of a step at each sample.
pub(super) struct Scan {
    /// A sample from which on the time constants are others, and the least energy with it.
    pub(super) energies: Vec<(usize, f64)>,
    /// The likeliest sample, the energy there, and by how much the parameters change, the step's last.
    pub(super) best: (usize, f64, Vec<f64>),
}

impl Scan {
    /// The scan of the instants `within`, samples. `None` where there is none.
    ///
    /// - `before`: linearised with the time constants before the step, without the step's parameter
    /// - `after`: with those after it, and the step's parameter last
    pub(super) fn of(before: &Linearised, after: &Linearised, within: Range<usize>) -> Option<Self> {
        let p = after.columns.len();
        let row_after = |j: usize| after.columns.iter().map(|c| c[j]).chain([after.residual[j]]).collect::<Vec<f64>>();
        let row_before =
            |i: usize| before.columns.iter().map(|c| c[i]).chain([0.0, before.residual[i]]).collect::<Vec<f64>>();
        let common = common(&before.samples, &after.samples);
        let mut sums = vec![vec![0.0; p + 1]; p + 1];
        common.iter().for_each(|(_, j)| add(&mut sums, &row_after(*j), 1.0));
        // What is known beforehand comes after the samples.
        (before.samples.len()..before.residual.len()).for_each(|i| add(&mut sums, &row_before(i), 1.0));
        let (mut energies, mut best) = (Vec::new(), None);
        for (i, j) in common {
            let sample = before.samples[i];
            if within.contains(&sample) {
                let energy = least_energy(&sums);
                energies.push((sample, energy));
                if best.as_ref().is_none_or(|(_, least, _)| energy < *least) {
                    best = Some((sample, energy, sums.clone()));
                }
            }
            add(&mut sums, &row_before(i), 1.0);
            add(&mut sums, &row_after(j), -1.0);
        }
        let (sample, energy, sums) = best?;
        let products: Vec<Vec<f64>> = sums[..p].iter().map(|row| row[..p].to_vec()).collect();
        let change = dense::times(&dense::inverse(&products)?, &sums[p][..p]).into_iter().map(|x| -x).collect();
        Some(Self { energies, best: (sample, energy, change) })
    }
}

/// Places of the samples that both have.
fn common(a: &[usize], b: &[usize]) -> Vec<(usize, usize)> {
    let mut j = 0;
    let place = |(i, sample): (usize, &usize)| {
        j += b[j..].iter().take_while(|other| *other < sample).count();
        (b.get(j) == Some(sample)).then_some((i, j))
    };
    a.iter().enumerate().filter_map(place).collect()
}

/// Adds `times` the products of a row with itself to the lower half.
fn add(sums: &mut [Vec<f64>], row: &[f64], times: f64) {
    for (i, sums) in sums.iter_mut().enumerate() {
        sums[..=i].iter_mut().zip(row).for_each(|(sum, x)| *sum += times * row[i] * x);
    }
}

/// The least of `(x, 1)ᵀ S (x, 1)`: what is left of the last diagonal entry once the others are eliminated. A column of zeros,
/// of a parameter that is held, eliminates nothing.
fn least_energy(sums: &[Vec<f64>]) -> f64 {
    let n = sums.len();
    let mut left: Vec<Vec<f64>> = sums.to_vec();
    for k in 0..n - 1 {
        let pivot = left[k][k];
        if pivot <= PIVOT_SHARE * sums[k][k] {
            continue;
        }
        for i in k + 1..n {
            let share = left[i][k] / pivot;
            for j in k + 1..=i {
                left[i][j] -= share * left[j][k];
            }
        }
    }
    left[n - 1][n - 1]
}
