//! How likely a step of both time constants is at each instant, all of them at once.
//!
//! For a step at an instant the residual is, before it, that of the time constants before, and from then on that of those after,
//! but for the few samples that the filters reach over. With both linear in the parameters, the least sum of squares follows
//! from sums of products over the samples on either side, and these from one pass. It is exact for a small step; for a large one
//! where it is linearised.

use std::ops::Range;

use crate::cost::Linearised;
use crate::dense;
use crate::selection::Samples;

/// A pivot that is less than this share of what it was is rounding.
const PIVOT_SHARE: f64 = 1e-12;

/// Energies from which on those are left out that turned out to be too far from the least, again where there are twice as many. Chosen.
const SIFTED_ENERGIES: usize = 4096;

/// The least energy of a step at each sample.
pub(super) struct Scan {
    /// A sample from which on the time constants are others, and the least energy with it: those within a limit of the least.
    pub(super) energies: Vec<(usize, f64)>,
    /// The likeliest sample, the energy there, and by how much the parameters change, the step's last.
    pub(super) best: (usize, f64, Vec<f64>),
}

impl Scan {
    /// The scan of the instants `within`, samples. `None` where there is none.
    ///
    /// - `before`: linearised with the time constants before the step, without the step's parameter
    /// - `after`: has its argument visit what is linearised with those after it and has the step's parameter last, some samples after
    ///   the others. It is asked twice, so that it need not be in memory
    /// - `limit`: energies that exceed the least by so much are not kept
    pub(super) fn of(
        before: &Linearised,
        after: impl Fn(&mut dyn FnMut(&Linearised)),
        within: Range<usize>,
        limit: f64,
    ) -> Option<Self> {
        let p = before.columns.len() + 1;
        let row_before =
            |i: usize| before.columns.iter().map(|c| c[i]).chain([0.0, before.residual[i]]).collect::<Vec<f64>>();
        let mut sums = vec![vec![0.0; p + 1]; p + 1];
        each_common(&before.samples, &after, |_, _, row_after| add(&mut sums, row_after, 1.0));
        // What is known beforehand comes after the samples.
        (before.samples.len()..before.residual.len()).for_each(|i| add(&mut sums, &row_before(i), 1.0));
        let mut energies: Vec<(usize, f64)> = Vec::new();
        let mut most_energies = SIFTED_ENERGIES;
        let mut best: Option<(usize, f64, Vec<Vec<f64>>)> = None;
        each_common(&before.samples, &after, |sample, i, row_after| {
            if within.contains(&sample) {
                let energy = least_energy(&sums);
                if best.as_ref().is_none_or(|(_, least, _)| energy - least < limit) {
                    if energies.len() >= most_energies
                        && let Some((_, least, _)) = &best
                    {
                        energies.retain(|(_, of_sample)| of_sample - least < limit);
                        most_energies = most_energies.max(2 * energies.len());
                    }
                    energies.push((sample, energy));
                }
                if best.as_ref().is_none_or(|(_, least, _)| energy < *least) {
                    best = Some((sample, energy, sums.clone()));
                }
            }
            add(&mut sums, &row_before(i), 1.0);
            add(&mut sums, row_after, -1.0);
        });
        let (sample, energy, sums) = best?;
        energies.retain(|(_, of_sample)| of_sample - energy < limit);
        let products: Vec<Vec<f64>> = sums[..p].iter().map(|row| row[..p].to_vec()).collect();
        let change = dense::times(&dense::inverse(&products)?, &sums[p][..p]).into_iter().map(|x| -x).collect();
        Some(Self { energies, best: (sample, energy, change) })
    }
}

/// Visits the samples that both have: each with its place among those before, and the row of derivatives and residual after.
fn each_common(
    before: &Samples,
    after: impl Fn(&mut dyn FnMut(&Linearised)),
    mut visit: impl FnMut(usize, usize, &[f64]),
) {
    let mut places = before.iter().enumerate().peekable();
    let mut row = Vec::new();
    after(&mut |rows| {
        for (j, sample) in rows.samples.iter().enumerate() {
            while places.next_if(|(_, other)| *other < sample).is_some() {}
            let Some((i, _)) = places.next_if(|(_, other)| *other == sample) else { continue };
            row.clear();
            row.extend(rows.columns.iter().map(|c| c[j]).chain([rows.residual[j]]));
            visit(sample, i, &row);
        }
    });
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::varying;
    use crate::track::fixture::Fixture;

    /// Numbers without order.
    fn wave(n: usize, rate: f64) -> Vec<f64> {
        (0..n).map(|k| (rate * (k * k + 3 * k) as f64).sin()).collect()
    }

    /// Rows of samples, of the residual, and of what is known of the two parameters beforehand.
    fn linearised(samples: Vec<usize>, columns: Vec<Vec<f64>>, residual: Vec<f64>) -> Linearised {
        Linearised { samples: samples.into_iter().collect(), residual, columns }
    }

    /// The least sum of squares of rows that are stacked as the step has them, `r'r − r'J (J'J)⁻¹ J'r`, with where it is.
    fn stacked(before: &Linearised, after: &Linearised, step: usize) -> (f64, Vec<f64>) {
        let mut rows: Vec<(Vec<f64>, f64)> = Vec::new();
        for (i, sample) in
            before.samples.iter().enumerate().filter(|(_, sample)| after.samples.iter().any(|s| s == *sample))
        {
            if sample < step {
                rows.push((vec![before.columns[0][i], before.columns[1][i], 0.0], before.residual[i]));
            } else {
                let j = after.samples.iter().position(|s| s == sample).expect("it has this one");
                rows.push((after.columns.iter().map(|c| c[j]).collect(), after.residual[j]));
            }
        }
        for i in before.samples.len()..before.residual.len() {
            rows.push((vec![before.columns[0][i], before.columns[1][i], 0.0], before.residual[i]));
        }
        let columns: Vec<Vec<f64>> = (0..3).map(|a| rows.iter().map(|(row, _)| row[a]).collect()).collect();
        let residual: Vec<f64> = rows.iter().map(|(_, r)| *r).collect();
        let slope: Vec<f64> = columns.iter().map(|c| dense::dot(c, &residual)).collect();
        let change = dense::times(&dense::inverse(&dense::gram(&columns)).expect("three columns"), &slope);
        let energy = dense::dot(&residual, &residual) - dense::dot(&slope, &change);
        (energy, change.iter().map(|x| -x).collect())
    }

    /// Of 60 samples, of which each side lacks another, and one row that is known beforehand. The sums are of some 60 products of
    /// size one, taken off again one by one: rounding is below 1e-13, and the bound ten times that.
    #[test]
    fn every_step_has_the_energy_of_its_stacked_rows() {
        let samples = |lacks: usize| (10..71).filter(|s| *s != lacks).collect::<Vec<usize>>();
        let with_known = |mut column: Vec<f64>, known: f64| {
            column.push(known);
            column
        };
        let columns = vec![with_known(wave(60, 0.37), 0.9), with_known(wave(60, 0.91), -0.4)];
        let before = linearised(samples(20), columns, with_known(wave(60, 1.7), 0.3));
        let after = linearised(samples(50), vec![wave(60, 0.53), wave(60, 1.1), wave(60, 0.7)], wave(60, 1.3));
        // In blocks of seven, with an empty one before the last.
        let blocks = |visit: &mut dyn FnMut(&Linearised)| {
            let samples: Vec<usize> = after.samples.iter().collect();
            let mut starts: Vec<usize> = (0..samples.len()).step_by(7).chain([samples.len()]).collect();
            starts.insert(starts.len() - 2, starts[starts.len() - 2]);
            for ends in starts.windows(2) {
                let of = |all: &[f64]| all[ends[0]..ends[1]].to_vec();
                let columns = after.columns.iter().map(|column| of(column)).collect();
                visit(&linearised(samples[ends[0]..ends[1]].to_vec(), columns, of(&after.residual)));
            }
        };
        let scan = Scan::of(&before, |visit| visit(&after), 30..60, f64::INFINITY).expect("samples within");
        let in_blocks = Scan::of(&before, blocks, 30..60, f64::INFINITY).expect("samples within");
        assert!(in_blocks.energies == scan.energies && in_blocks.best == scan.best);
        assert_eq!(scan.energies.len(), 29, "one of 30 is lacking");
        let limit =
            0.5 * (scan.energies.iter().map(|(_, energy)| energy).fold(0.0, |a: f64, b| a.max(*b)) - scan.best.1);
        let near = Scan::of(&before, |visit| visit(&after), 30..60, limit).expect("samples within");
        let is_near = |(_, energy): &&(usize, f64)| energy - scan.best.1 < limit;
        assert_eq!(near.energies, scan.energies.iter().filter(is_near).copied().collect::<Vec<(usize, f64)>>());
        assert!(near.energies.len() < 29 && near.best == scan.best);
        let want = |step: usize| stacked(&before, &after, step);
        for (sample, energy) in &scan.energies {
            assert!((energy - want(*sample).0).abs() < 1e-12, "{sample}: {energy}, want {}", want(*sample).0);
        }
        let (best, least, change) = &scan.best;
        assert!(scan.energies.iter().all(|(_, energy)| least <= energy));
        for (got, want) in change.iter().zip(want(*best).1) {
            assert!((got - want).abs() < 1e-11, "{change:?}");
        }
    }

    /// A fit with a step at a sample leaves what the scan says, where the step is one of 8 % and the scan is linearised without one.
    /// Both know of the step what they take off, some hundreds; what is bent in it is a share of its size of that, 8 %, and the
    /// residual is another over the reach of the filters, some ten samples of 900 on either side.
    #[test]
    fn a_small_step_has_the_energy_of_its_fit() {
        let fixture = Fixture::of(1800, |t| if t < 900.0 { 1.0 } else { 1.08 });
        let (tracker, constant) = (fixture.tracker(), &fixture.constant);
        let scan = tracker.scan(constant, &constant.theta, 0.0, 600..1200, f64::INFINITY).expect("samples within");
        let taken_off = |energy: f64| constant.chi2 - energy;
        assert!(taken_off(scan.best.1) > 100.0, "the step is seen: {}", taken_off(scan.best.1));
        for (sample, energy) in scan.energies.iter().step_by(97) {
            let step = varying::step(*sample as f64 - 0.5);
            let fitted = tracker.fit(constant, step, &[0.0], crate::fit::Effort::Finish);
            let (got, want) = (taken_off(*energy), taken_off(fitted.chi2));
            assert!((got - want).abs() < 0.1 * want + 1.0, "{sample}: takes {got} off, want {want}");
        }
    }
}
