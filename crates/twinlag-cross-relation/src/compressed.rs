//! The whitened cost in a hundred terms instead of thousands: bins gathered into bands once, before
//! any evaluation.
//!
//! All that depends on data in the spectral cost is quadratic in a few series per bin,
//! `D_i,j D_k,j`, and all that depends on the parameters is smooth in `x = cos w`. So in each band
//! the function `1/λ(x)`, `λ = α + β x`, is interpolated at [`NODES_PER_BAND`] Chebyshev points `x_q`: with
//! `L_q` Lagrange's polynomials, `Σ_j (D_i D_k)_j/λ_j ≈ Σ_q G_ik,q/λ(x_q)`,
//! `G_ik,q = Σ_j L_q(x_j) (D_i D_k)_j`. The same sum over points, of which there are about a
//! hundred whatever the length of the record. Bands with no more bins than points keep their bins, except where segments of several
//! lengths share bands: there each is interpolated, and all segments are one sum.
//!
//! The error is known exactly: interpolating `1/λ` leaves the relative error
//! `Π_q β (x − x_q)/λ(x_q)`, at most `ε = 2 (|β| h/2)^Q / Π_q λ(x_q)` in a band of half width `h`.
//! Bands are a factor of two wide in `1 − x`, so `ε ≤ 5.1e-5` (`1/T₆(3)`) whatever the parameters,
//! and far less where noise is white in the band. [`crate::Whitened::shift_bound`] turns it into a
//! bound on what the minimum can move.

use std::borrow::Borrow;
use std::cmp::Reverse;
use std::sync::Arc;

use num_dual::DualSVec64;

use crate::bands::{Bands, NODES_PER_BAND, SharedBands};
use crate::noise_model::HoldAndNoise;
use crate::parameters::Pair;
use crate::readings::{Segment, Steps};
use crate::spectral::{Sloped, Sums, Weights};
use crate::transform::Transformed;

/// Samples of the pieces that a long segment is gathered from. A cut takes one whitened residual away and what the noise on its
/// two sides has in common; the transform of a piece stays in fast memory. Chosen.
const PIECE_SAMPLES: usize = 1 << 17;

/// Products of the first `T` series, upper triangle.
const fn pairs(series: usize) -> usize {
    series * (series + 1) / 2
}

/// One segment compressed, or several in the same bands: for each product of two series, its sums at the points.
#[derive(Clone, Debug)]
pub(crate) struct Compressed {
    period_s: f64,
    /// Of the first segment that was added: points and widths are those of all, bins are not.
    bands: Arc<Bands>,
    /// `[pair][node]`, pairs in the order `(0,0), (0,1), (1,1), (0,2), …`.
    gram: Vec<Vec<f64>>,
}

impl Compressed {
    /// The products of the first three series of all `segments`, or of all five.
    pub(crate) fn of_all(segments: &[Transformed], series: usize) -> Vec<Self> {
        let mut longest_first: Vec<&Transformed> = segments.iter().collect();
        longest_first.sort_by_key(|segment| Reverse(segment.len()));
        let have_one_period = segments.windows(2).all(|pair| pair[0].period_s == pair[1].period_s);
        let is_shared = have_one_period && differ(segments.iter().map(Transformed::len));
        Self::joined(longest_first.into_iter(), is_shared, series)
    }

    /// The products of long `segments` of one sample period, gathered piece by piece without keeping any bin. `None` if one is
    /// unevenly sampled.
    ///
    /// The sums are those of the pieces: [`PIECE_SAMPLES`] is so long that next to nothing is lost between them.
    pub(crate) fn of_pieces(segments: &[Segment], series: usize) -> Option<Vec<Self>> {
        let mut longest_first = Vec::new();
        for segment in segments {
            let Steps::Even(period_s) = *segment.steps() else { return None };
            let channels = segment.y1().chunks(PIECE_SAMPLES).zip(segment.y2().chunks(PIECE_SAMPLES));
            longest_first.extend(channels.filter(|(y1, _)| y1.len() > 1).map(|(y1, y2)| (y1, y2, period_s)));
        }
        longest_first.sort_by_key(|(y1, ..)| Reverse(y1.len()));
        // Pieces of one segment have two lengths at most: nothing is won by sharing, and their slowest bins stay as they are.
        let is_shared = segments.len() > 1 && differ(longest_first.iter().map(|(y1, ..)| y1.len()));
        let transformed = longest_first.into_iter().map(|(y1, y2, period_s)| Transformed::of(y1, y2, period_s));
        Some(Self::joined(transformed, is_shared, series))
    }

    /// Compresses one segment after the other and adds up those at the same points.
    ///
    /// A record with many gaps has thousands of short segments, each of which has as many points as bins. Shared bands, those of
    /// the longest, make all of them one sum.
    ///
    /// - `is_shared`: whether all are gathered in the bands of the first, which has two bins at least
    fn joined(
        longest_first: impl Iterator<Item = impl Borrow<Transformed>>,
        is_shared: bool,
        series: usize,
    ) -> Vec<Self> {
        let mut shared: Option<SharedBands> = None;
        let mut before: Option<(usize, Arc<Bands>)> = None;
        let mut out: Vec<Self> = Vec::new();
        for segment in longest_first {
            let segment = segment.borrow();
            let cosines = &segment.plan.cosines;
            let bands = match before.take().filter(|(length, _)| *length == segment.len()) {
                Some((_, bands)) => bands,
                None if is_shared => {
                    let shared = shared.get_or_insert_with(|| SharedBands::of_longest(cosines));
                    Arc::new(Bands::sharing(shared, cosines))
                }
                None => segment.plan.bands().clone(),
            };
            let one = Self::new(segment, &bands, series);
            before = Some((segment.len(), bands));
            match out.last_mut().filter(|last| last.has_points_of(&one)) {
                Some(last) => last.add(&one),
                None => out.push(one),
            }
        }
        out
    }

    fn new(segment: &Transformed, bands: &Arc<Bands>, series: usize) -> Self {
        let gram = match series {
            3 => gather::<3, { pairs(3) }>(segment, bands),
            _ => gather::<5, { pairs(5) }>(segment, bands),
        };
        Self { period_s: segment.period_s, bands: bands.clone(), gram }
    }

    fn has_points_of(&self, other: &Self) -> bool {
        self.period_s == other.period_s && self.bands.nodes == other.bands.nodes
    }

    /// Adds the sums of another segment at the same points.
    fn add(&mut self, other: &Self) {
        let sums = self.gram.iter_mut().flatten();
        sums.zip(other.gram.iter().flatten()).for_each(|(sum, value)| *sum += value);
    }

    /// Whether gain and offset are served as well.
    pub(crate) fn has_calibration(&self) -> bool {
        self.gram.len() > pairs(3)
    }

    /// Adds this segment to `sums`.
    pub(crate) fn accumulate<const P: usize>(
        &self,
        model: &HoldAndNoise,
        pair: &Pair<DualSVec64<P>>,
        sums: &mut Sums<P>,
    ) {
        let weights = Weights::new(model, pair, self.period_s);
        match P {
            2 => self.accumulate_pairs::<P, { pairs(3) }>(&weights, sums),
            _ => self.accumulate_pairs::<P, { pairs(5) }>(&weights, sums),
        }
    }

    fn accumulate_pairs<const P: usize, const G: usize>(&self, weights: &Weights<P>, sums: &mut Sums<P>) {
        let nodes = &self.bands.nodes[..];
        let gram: [&[f64]; G] = std::array::from_fn(|g| &self.gram[g][..nodes.len()]);
        let forms = Forms::<P, G>::new(&weights.parts);
        for (j, &x) in nodes.iter().enumerate() {
            let at: [f64; G] = std::array::from_fn(|g| gram[g][j]);
            let terms = forms.at(&at, weights, x);
            sums.squares += terms.squares;
            for p in 0..P {
                sums.gradient[p] += terms.gradient[p];
                for q in p..P {
                    sums.normal[p][q] += terms.normal[p][q];
                }
            }
        }
    }

    /// Bounds on what compression changes of half the gradient, added up over this segment.
    pub(crate) fn gradient_error<const P: usize>(
        &self,
        model: &HoldAndNoise,
        pair: &Pair<DualSVec64<P>>,
        out: &mut [f64; P],
    ) {
        let weights = Weights::new(model, pair, self.period_s);
        match P {
            2 => self.gradient_error_of_pairs::<P, { pairs(3) }>(&weights, out),
            _ => self.gradient_error_of_pairs::<P, { pairs(5) }>(&weights, out),
        }
    }

    /// With `J_j (1 + ε_j)` in place of `J_j = r_j²`: `½ ∂(J ε) = r ∂r ε + ½ J ε ∂ ln ε`, Cauchy's
    /// inequality for the first over a band, and `∂ ln ε = Σ_q ∂ ln(β/λ_q)`, the same for all its
    /// bins.
    fn gradient_error_of_pairs<const P: usize, const G: usize>(&self, weights: &Weights<P>, out: &mut [f64; P]) {
        let bands = &self.bands;
        let forms = Forms::<P, G>::new(&weights.parts);
        let beta = &weights.beta;
        for band in bands.bands.iter().filter(|b| b.half_width > 0.0) {
            let mut sums = Sums::<P>::ZERO;
            let mut epsilon = 2.0;
            let mut slope = [0.0; P];
            for j in band.first_node..band.first_node + NODES_PER_BAND {
                let x = bands.nodes[j];
                let at: [f64; G] = std::array::from_fn(|g| self.gram[g][j]);
                let terms = forms.at(&at, weights, x);
                let lambda = weights.alpha.0 + beta.0 * x;
                sums.squares += terms.squares;
                epsilon *= 0.5 * (beta.0 * band.half_width / lambda).abs();
                for p in 0..P {
                    sums.normal[p][p] += terms.normal[p][p];
                    slope[p] += beta.1[p] / beta.0 - (weights.alpha.1[p] + beta.1[p] * x) / lambda;
                }
            }
            for p in 0..P {
                let along = (sums.squares.abs() * sums.normal[p][p].abs()).sqrt();
                out[p] += epsilon * (along + 0.5 * sums.squares.abs() * slope[p].abs());
            }
        }
    }
}

/// Whether segments have several lengths: those of one length have bands in common as they are, and of several the longest has two
/// bins at least.
fn differ(mut lengths: impl Iterator<Item = usize>) -> bool {
    let first = lengths.next();
    lengths.any(|length| Some(length) != first)
}

/// `G` sums over the bins at each point, for the products of `T` series.
fn gather<const T: usize, const G: usize>(segment: &Transformed, bands: &Bands) -> Vec<Vec<f64>> {
    let all = segment.parts();
    let n = segment.len();
    let series: [&[f64]; T] = std::array::from_fn(|i| &all[i][..n]);
    let products = |j: usize| -> [f64; G] {
        let d: [f64; T] = std::array::from_fn(|i| series[i][j]);
        let mut out = [0.0; G];
        let mut g = 0;
        for i in 0..T {
            for k in 0..=i {
                out[g] = d[i] * d[k];
                g += 1;
            }
        }
        out
    };
    let mut gram = vec![vec![0.0; bands.nodes.len()]; G];
    let mut lagrange = bands.lagrange.iter();
    for band in &bands.bands {
        if band.half_width == 0.0 {
            for (row, product) in gram.iter_mut().zip(products(band.first_bin)) {
                row[band.first_node] = product;
            }
            continue;
        }
        let mut sums = [[0.0; NODES_PER_BAND]; G];
        for (j, weights) in (band.first_bin..band.first_bin + band.bins).zip(&mut lagrange) {
            let products = products(j);
            for g in 0..G {
                for q in 0..NODES_PER_BAND {
                    sums[g][q] += products[g] * weights[q];
                }
            }
        }
        for (row, sums) in gram.iter_mut().zip(&sums) {
            row[band.first_node..band.first_node + NODES_PER_BAND].copy_from_slice(sums);
        }
    }
    gram
}

/// `U²`, `U ∂_p U` and `∂_p U ∂_q U` as linear forms in the products of the series.
struct Forms<const P: usize, const G: usize> {
    value: [f64; G],
    first: [[f64; G]; P],
    second: [[[f64; G]; P]; P],
}

impl<const P: usize, const G: usize> Forms<P, G> {
    fn new(weights: &[Sloped<P>; 5]) -> Self {
        let mut out = Self { value: [0.0; G], first: [[0.0; G]; P], second: [[[0.0; G]; P]; P] };
        let mut g = 0;
        for i in 0..5 {
            for k in 0..=i {
                if g == G {
                    return out;
                }
                // A product of two different series stands for both of its orders.
                let product = |a: &dyn Fn(usize) -> f64, b: &dyn Fn(usize) -> f64| {
                    if i == k { a(i) * b(i) } else { a(i) * b(k) + a(k) * b(i) }
                };
                let value = |i: usize| weights[i].0;
                out.value[g] = product(&value, &value);
                for p in 0..P {
                    let slope = |i: usize| weights[i].1[p];
                    out.first[p][g] = product(&value, &slope);
                    for q in p..P {
                        out.second[p][q][g] = product(&slope, &|i| weights[i].1[q]);
                    }
                }
                g += 1;
            }
        }
        out
    }

    /// The terms of `Σ r²/2`'s value, gradient and Gauss-Newton matrix at a point `x` with products
    /// `gram`.
    #[inline]
    fn at(&self, gram: &[f64; G], weights: &Weights<P>, x: f64) -> Sums<P> {
        let dot = |form: &[f64; G]| -> f64 { (0..G).map(|g| form[g] * gram[g]).sum() };
        let inverse = 1.0 / (weights.alpha.0 + weights.beta.0 * x);
        let value = dot(&self.value) * inverse;
        // ∂ ln √λ
        let pull: [f64; P] = std::array::from_fn(|p| 0.5 * (weights.alpha.1[p] + weights.beta.1[p] * x) * inverse);
        let first: [f64; P] = std::array::from_fn(|p| dot(&self.first[p]) * inverse);
        let mut out = Sums { squares: value, gradient: [0.0; P], normal: [[0.0; P]; P] };
        for p in 0..P {
            out.gradient[p] = first[p] - value * pull[p];
            for q in p..P {
                let second = dot(&self.second[p][q]) * inverse;
                out.normal[p][q] = second - first[p] * pull[q] - first[q] * pull[p] + value * pull[p] * pull[q];
            }
        }
        out
    }
}
