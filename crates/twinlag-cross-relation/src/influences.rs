//! What each residual of a fit does to its parameters, in a form from which the scatter of any sum of them follows.
//!
//! With `d_i = ∂r/∂θ_i` and weights `w`, a residual moves the sum by `Σ_i w_i d_i r` and has the information `(Σ_i w_i d_i)²`: both
//! are forms in `w` whose coefficients add up, over neighbours in time as well as over neighbouring bins. So sums are kept in place
//! of residuals, of as few neighbours as leave [`MOST_SUMS`]: parts of a record then end where they should to within a share
//! `4/MOST_SUMS` of their length, less than a ten-thousandth.

use num_dual::DualSVec64;
use twinlag_transform::sine_transform;

use crate::banded;
use crate::parameters::Pair;
use crate::parts::{PartScatter, Scatter, between};
use crate::whitened::Whitened;

/// Sums along a record, or by frequency, at most.
const MOST_SUMS: usize = 1 << 16;
/// Residuals of an unbroken run that are transformed at once, at most: the transform of a piece has a power of two.
const MOST_AT_ONCE: usize = 1 << 19;
const PIECE_RESIDUALS: usize = (1 << 17) - 1;

/// Sums of products of residuals and their derivatives.
#[derive(Clone, Copy, Debug)]
struct Sums<const P: usize> {
    /// `Σ d_i r`.
    slope: [f64; P],
    /// `Σ d_i d_j`.
    products: [[f64; P]; P],
}

impl<const P: usize> Sums<P> {
    const ZERO: Self = Self { slope: [0.0; P], products: [[0.0; P]; P] };

    fn add(&mut self, r: f64, d: &[f64; P], scale: f64) {
        for i in 0..P {
            self.slope[i] += scale * d[i] * r;
            for j in 0..P {
                self.products[i][j] += scale * d[i] * d[j];
            }
        }
    }

    fn join(&mut self, other: &Self) {
        for i in 0..P {
            self.slope[i] += other.slope[i];
            for j in 0..P {
                self.products[i][j] += other.products[i][j];
            }
        }
    }

    /// What the residuals move the sum of parameters with these weights by, and their information on it.
    fn term(&self, weights: &[f64; P]) -> [f64; 2] {
        let moved = (0..P).map(|i| weights[i] * self.slope[i]).sum();
        let pairs = (0..P).flat_map(|i| (0..P).map(move |j| (i, j)));
        [moved, pairs.map(|(i, j)| weights[i] * weights[j] * self.products[i][j]).sum()]
    }
}

/// What the residuals of a fit do to its parameters, along the record and by frequency.
///
/// ```
#[doc = include_str!("example.txt")]
/// let cost = Whitened::new(&readings, Discretisation::ZeroOrderHold, [0.1, 0.2])?;
/// let theta = [0.03, 0.1];
/// let influences = cost.influences(&theta);
/// // Products of derivatives, summed, are the information: the inverse of the bound of Cramér and Rao.
/// let products = influences.products();
/// let bound = cost.cramer_rao(&theta, &[0]).expect("determined");
/// assert!((products[0][0] * bound[0][0] - 1.0).abs() < 1e-2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Influences<const P: usize> {
    along: Vec<Sums<P>>,
    by_frequency: Vec<Sums<P>>,
}

impl<const P: usize> Influences<P> {
    /// Sums of products of two derivatives over all residuals `[P][P]`.
    pub fn products(&self) -> [[f64; P]; P] {
        let mut all = Sums::ZERO;
        self.along.iter().for_each(|sums| all.join(sums));
        all.products
    }

    /// Scatter between parts of the record of the sum of parameters that each residual moves by `weights · d`.
    ///
    /// `None` of fewer than sixteen sums, or where nothing has an influence.
    pub fn scatter(&self, weights: &[f64; P], standard_error: f64) -> Option<PartScatter> {
        let of = |all: &[Sums<P>]| -> Option<Scatter> { between(all.iter().map(|s| s.term(weights)), standard_error) };
        Some(PartScatter { along: of(&self.along)?, by_frequency: of(&self.by_frequency)? })
    }
}

/// Gathers residuals in order of time.
struct Gathering<const P: usize> {
    /// Residuals to a sum.
    neighbours: usize,
    seen: usize,
    along: Vec<Sums<P>>,
    /// Residuals and derivatives that are not transformed yet.
    waiting: [Vec<f64>; 7],
    /// Cycles per sample of each bin, by pieces of one length after the other.
    bins: Vec<(f64, Sums<P>)>,
    /// Residuals of the piece that was transformed last.
    last_length: usize,
}

impl<const P: usize> Gathering<P> {
    fn push(&mut self, r: f64, d: &[f64; P]) {
        if self.seen.is_multiple_of(self.neighbours) {
            self.along.push(Sums::ZERO);
        }
        self.seen += 1;
        self.along.last_mut().expect("pushed above").add(r, d, 1.0);
        self.waiting[0].push(r);
        (0..P).for_each(|i| self.waiting[1 + i].push(d[i]));
    }

    /// Transforms what waits, as one piece.
    fn transform(&mut self) {
        let n = self.waiting[0].len();
        if n == 0 {
            return;
        }
        let spectra: Vec<Vec<f64>> = self.waiting[..=P].iter().map(|series| sine_transform(series)).collect();
        self.waiting.iter_mut().for_each(Vec::clear);
        // Pieces of one long run share their bins.
        if n != PIECE_RESIDUALS || n != self.last_length {
            let place = |j: usize| (j + 1) as f64 / (n + 1) as f64;
            self.bins.extend((0..n).map(|j| (place(j), Sums::ZERO)));
            self.last_length = n;
        }
        let first = self.bins.len() - n;
        for (j, (_, sums)) in self.bins[first..].iter_mut().enumerate() {
            let d = std::array::from_fn(|i| spectra[1 + i][j]);
            sums.add(spectra[0][j], &d, 2.0 / (n + 1) as f64);
        }
    }

    fn done(mut self) -> Influences<P> {
        self.bins.sort_by(|a, b| a.0.total_cmp(&b.0));
        let neighbours = self.bins.len().div_ceil(MOST_SUMS).max(1);
        let by_frequency = self.bins.chunks(neighbours).map(|bins| {
            let mut sums = Sums::ZERO;
            bins.iter().for_each(|(_, bin)| sums.join(bin));
            sums
        });
        Influences { along: self.along, by_frequency: by_frequency.collect() }
    }
}

impl Whitened<'_> {
    /// What each whitened residual at `theta` does to the parameters.
    pub fn influences<const P: usize>(&self, theta: &[f64; P]) -> Influences<P> {
        const { assert!(P <= 6, "a pair of sensors has six parameters") };
        let pair: Pair<DualSVec64<P>> = Pair::variables(theta);
        let samples = self.readings().len();
        let mut all = Gathering {
            neighbours: samples.div_ceil(MOST_SUMS),
            seen: 0,
            along: Vec::new(),
            waiting: Default::default(),
            bins: Vec::new(),
            last_length: 0,
        };
        let segments = if self.has_no_inverse(&pair) { &[] } else { self.readings().segments() };
        for segment in segments {
            let at_once = if segment.len() > MOST_AT_ONCE { PIECE_RESIDUALS } else { usize::MAX };
            banded::sweep(segment, self.model(), &pair, |r, d: &[f64; P]| {
                all.push(r, d);
                if all.waiting[0].len() == at_once {
                    all.transform();
                }
            });
            all.transform();
        }
        all.done()
    }
}
