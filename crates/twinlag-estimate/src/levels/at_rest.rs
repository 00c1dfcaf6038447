//! Noise levels from runs of samples in which the gas is at rest: scatter about a straight line in
//! each.

/// Degrees of freedom, samples less two, that a stretch at rest must have. A level from eight is
/// good to `1/√(2·8)`, a quarter.
pub const MIN_DEGREES_OF_FREEDOM_AT_REST: usize = 8;

/// Sums of squares about a straight line, and of products of neighbours.
#[derive(Default)]
pub(super) struct LineScatter {
    squares: f64,
    products: f64,
    pub(super) degrees_of_freedom: f64,
}

impl LineScatter {
    pub(super) fn add(&mut self, times: &[f64], y: &[f64]) {
        let n = times.len() as f64;
        let mean = |v: &[f64]| v.iter().sum::<f64>() / n;
        let (t0, y0) = (mean(times), mean(y));
        let moment: f64 = times.iter().map(|t| (t - t0) * (t - t0)).sum();
        let slope = if moment > 0.0 {
            times.iter().zip(y).map(|(t, y)| (t - t0) * (y - y0)).sum::<f64>() / moment
        } else {
            0.0
        };
        let left: Vec<f64> = times.iter().zip(y).map(|(t, y)| y - y0 - slope * (t - t0)).collect();
        self.squares += left.iter().map(|r| r * r).sum::<f64>();
        self.products += left.windows(2).map(|w| w[0] * w[1]).sum::<f64>();
        self.degrees_of_freedom += (n - 2.0).max(0.0);
    }

    pub(super) fn std(&self) -> f64 {
        (self.squares / self.degrees_of_freedom).sqrt()
    }

    pub(super) fn lag_one(&self) -> f64 {
        if self.squares > 0.0 { self.products / self.squares } else { 0.0 }
    }
}
