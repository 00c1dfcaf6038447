//! What each residual of a fit does to its numbers.

use std::ops::Range;

use twinlag_cross_relation::PartScatter;

use crate::cost::Linearised;
use crate::dense;
use crate::fit::Fitted;
use crate::observations::Observations;
use crate::selection::{Samples, Selection};

/// A fit, linearised where it ended.
pub(crate) struct Influence<'a> {
    linearised: Linearised,
    /// Inverse of the products of its columns.
    inverse: Vec<Vec<f64>>,
    covariance: &'a [Vec<f64>],
}

impl<'a> Influence<'a> {
    /// - `covariance`: of the parameters, as it is stated
    ///
    /// `None` where the columns are those of fewer parameters.
    pub(crate) fn of(
        fitted: &Fitted,
        observations: &Observations,
        selection: &Selection,
        covariance: &'a [Vec<f64>],
    ) -> Option<Self> {
        let linearised = fitted.model.linearised(&fitted.theta, observations, selection);
        let inverse = dense::inverse(&dense::gram(&linearised.columns))?;
        Some(Self { linearised, inverse, covariance })
    }

    /// How far a sum of parameters, each by its index and its factor, moves between parts of the record.
    pub(crate) fn scatter(&self, sum: &[(usize, f64)]) -> Option<PartScatter> {
        let variance: f64 =
            sum.iter().map(|(i, s)| sum.iter().map(|(j, t)| s * t * self.covariance[*i][*j]).sum::<f64>()).sum();
        let weights: Vec<f64> = self.inverse.iter().map(|row| sum.iter().map(|(j, t)| row[*j] * t).sum()).collect();
        let Linearised { columns, residual, samples, .. } = &self.linearised;
        let weighted: Vec<(&[f64], f64)> =
            columns.iter().map(Vec::as_slice).zip(weights).filter(|(_, weight)| *weight != 0.0).collect();
        let starts: Vec<usize> = samples
            .runs()
            .iter()
            .scan(0, |end, run| {
                *end += run.len();
                Some(*end - run.len())
            })
            .collect();
        let influence = |run: usize, k: usize| {
            weighted.iter().fold(0.0, |sum, (column, weight)| sum + weight * column[starts[run] + k])
        };
        PartScatter::with_influence(&runs(residual, samples), influence, variance.max(0.0).sqrt())
    }
}

/// The values of each run of `samples`, which come first.
fn runs<'a>(mut values: &'a [f64], samples: &Samples) -> Vec<&'a [f64]> {
    let next = |run: &Range<usize>| values.split_off(..run.len()).expect("a value for each sample");
    samples.runs().iter().map(next).collect()
}
