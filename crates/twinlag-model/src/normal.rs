//! The normal equations of a model: sums over residuals and their derivatives, of which one window is in memory.

use crate::cost::{Block, Linearised, ResidualCost};
use crate::dense;
use crate::directions::Directions;
use crate::model::Model;
use crate::observations::Observations;
use crate::selection::{Selection, Stream};
use crate::weighting::Weighting;

/// Normal equations of a whitened residual `r`, filtered, with derivatives `J` at a point: sums over the residuals that count, and
/// over what is known beforehand.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct NormalEquations {
    /// Energy of the residual, `rᵀr`.
    pub energy: f64,
    /// Residuals, prior knowledge among them.
    pub count: usize,
    /// Half the first derivatives of the energy, `Jᵀr`.
    pub slope: Vec<f64>,
    /// Products of the derivatives, `JᵀJ`.
    pub products: Vec<Vec<f64>>,
    /// Covariance of the slope for white noise: products of the columns, each filtered once more, since the noise is that of the
    /// residual before its filter; prior knowledge has unit variance. Zero where it was not asked for.
    pub slope_covariance: Vec<Vec<f64>>,
    /// Whether the columns that another model has as well are those of that model.
    pub is_beside: bool,
}

impl NormalEquations {
    /// Of no residuals.
    pub(crate) fn none(parameters: usize) -> Self {
        let none = vec![vec![0.0; parameters]; parameters];
        Self {
            energy: 0.0,
            count: 0,
            slope: vec![0.0; parameters],
            products: none.clone(),
            slope_covariance: none,
            is_beside: false,
        }
    }

    /// Of the first `rows` residuals.
    pub(crate) fn of(lin: &Linearised, rows: usize) -> Self {
        let mut out = Self::none(lin.columns.len());
        (0..rows).for_each(|k| out.add(lin, k));
        out
    }

    /// Adds one residual, that in place `k`.
    pub(crate) fn add(&mut self, lin: &Linearised, k: usize) {
        let r = lin.residual[k];
        self.energy += r * r;
        self.count += 1;
        for (a, (slope, products)) in self.slope.iter_mut().zip(&mut self.products).enumerate() {
            let of_a = lin.columns[a][k];
            *slope += of_a * r;
            products.iter_mut().zip(&lin.columns).for_each(|(sum, of_b)| *sum += of_a * of_b[k]);
        }
    }

    /// Holds parameter `at`: it has no derivative.
    pub fn hold(&mut self, at: usize) {
        self.slope[at] = 0.0;
        for matrix in [&mut self.products, &mut self.slope_covariance] {
            matrix[at].fill(0.0);
            matrix.iter_mut().for_each(|row| row[at] = 0.0);
        }
    }
}

/// A model that was linearised without the last effect of another, which has no size there.
#[derive(Clone, Copy, Debug)]
pub struct Beside<'a> {
    /// The model without the effect.
    pub without: &'a Linearised,
    /// Most that a residual may differ: beyond this the columns of both are others.
    pub max_difference: f64,
}

impl Beside<'_> {
    /// Whether residuals differ by no more than they may.
    ///
    /// - `first`: place of the first of them among all
    pub(crate) fn agrees_with(&self, residual: &[f64], first: usize) -> bool {
        let mut pairs = residual.iter().zip(self.without.residual.get(first..).unwrap_or(&[]));
        self.max_difference.is_infinite() || pairs.all(|(a, b)| (a - b).abs() < self.max_difference)
    }

    /// Whether samples are those of the model without the effect.
    ///
    /// - `are_all`: whether there are no more of them
    pub(crate) fn has_samples(&self, mut samples: impl Iterator<Item = usize>, are_all: bool) -> bool {
        let mut known = self.without.samples.iter();
        samples.all(|sample| known.next() == Some(sample)) && !(are_all && known.next().is_some())
    }
}

/// Normal equations that are summed up block by block.
pub(crate) struct Sums<'a> {
    /// Between directions, and with the last block between parameters.
    out: NormalEquations,
    directions: &'a Directions,
    known: &'a [Vec<f64>],
    filter: Option<&'a Weighting>,
    streams: Vec<Stream>,
}

impl<'a> Sums<'a> {
    /// - `known`: a model whose columns are the first ones
    pub(crate) fn of(directions: &'a Directions, known: Option<&'a Linearised>, filter: Option<&'a Weighting>) -> Self {
        let count = directions.all.len();
        let out = NormalEquations { is_beside: known.is_some(), ..NormalEquations::none(count) };
        let known = known.map_or(&[][..], |known| &known.columns);
        Self { out, directions, known, filter, streams: vec![Stream::default(); count] }
    }

    pub(crate) fn add(&mut self, block: &Block<'_>) {
        if block.is_prior {
            self.finish_directions();
        }
        let Self { out, known, filter, .. } = self;
        let of_known = known.iter().map(|column| {
            let end = block.range.end.min(column.len());
            &column[block.range.start.min(end)..end]
        });
        let columns: Vec<&[f64]> = of_known.chain(block.columns.iter().copied().skip(known.len())).collect();
        out.energy += dense::dot(block.residual, block.residual);
        out.count += block.residual.len();
        out.slope.iter_mut().zip(&columns).for_each(|(slope, column)| *slope += dense::dot(column, block.residual));
        add_products(&mut out.products, &columns);
        if filter.is_some() && block.is_prior {
            add_products(&mut out.slope_covariance, &columns);
        } else if filter.is_some() {
            let zeros = vec![0.0; block.residual.len()];
            self.add_filtered(
                &columns.iter().map(|column| if column.is_empty() { &zeros } else { *column }).collect::<Vec<_>>(),
                false,
            );
        }
    }

    /// Adds products of columns that are filtered once more.
    fn add_filtered(&mut self, columns: &[&[f64]], is_last: bool) {
        let Self { out, filter: Some(filter), streams, .. } = self else { return };
        let filtered: Vec<&[f64]> =
            streams.iter_mut().zip(columns).map(|(stream, column)| stream.filter(column, filter, is_last).1).collect();
        add_products(&mut out.slope_covariance, &filtered);
    }

    /// From directions to parameters.
    fn finish_directions(&mut self) {
        self.add_filtered(&vec![&[][..]; self.directions.all.len()], true);
        let Self { out, directions, .. } = self;
        out.slope = directions.along_parameters(std::mem::take(&mut out.slope));
        for matrix in [&mut out.products, &mut out.slope_covariance] {
            mirror(matrix);
            *matrix = directions.between_parameters(std::mem::take(matrix));
        }
    }

    pub(crate) fn normal_equations(mut self) -> NormalEquations {
        mirror(&mut self.out.products);
        mirror(&mut self.out.slope_covariance);
        self.out
    }
}

/// Adds `CᵀC` to the lower triangle.
fn add_products(sums: &mut [Vec<f64>], columns: &[&[f64]]) {
    for (i, a) in columns.iter().enumerate().filter(|(_, column)| !column.is_empty()) {
        for (sum, b) in sums[i].iter_mut().zip(&columns[..=i]) {
            *sum += dense::dot(a, b);
        }
    }
}

fn mirror(matrix: &mut [Vec<f64>]) {
    for i in 0..matrix.len() {
        for j in 0..i {
            matrix[j][i] = matrix[i][j];
        }
    }
}

impl Model {
    /// The normal equations at a point, without [`NormalEquations::slope_covariance`].
    ///
    /// - `beside`: a model without the last effect. Where residuals are of the same samples, and differ by no more than they may,
    ///   the columns of the parameters that both have are those of that model: what an effect of no size does not change
    pub fn normal_equations(
        &self,
        theta: &[f64],
        observations: &Observations,
        selection: &Selection,
        beside: Option<Beside<'_>>,
    ) -> NormalEquations {
        ResidualCost::new(self, theta, observations, selection).into_normal_equations(theta, beside, None)
    }

    /// The normal equations at a point, with [`NormalEquations::slope_covariance`]; else as [`Model::normal_equations`].
    pub fn scored_normal_equations(
        &self,
        theta: &[f64],
        observations: &Observations,
        selection: &Selection,
        beside: Option<Beside<'_>>,
    ) -> NormalEquations {
        let cost = ResidualCost::new(self, theta, observations, selection);
        cost.into_normal_equations(theta, beside, Some(&selection.weighting))
    }
}
