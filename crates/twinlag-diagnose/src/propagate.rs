//! Errors of numbers that follow from parameters.

/// Step of derivatives, in standard errors of the parameters: small enough that a function that bends within ten of them is straight
/// over it.
const STEP_SE: f64 = 0.1;

/// Variance of a function of some parameters, to first order.
///
/// - `of`: the function, of the parameters at `places`
/// - `theta`: all parameters, with their `covariance`
pub(crate) fn variance(of: impl Fn(&[f64]) -> f64, places: &[usize], theta: &[f64], covariance: &[Vec<f64>]) -> f64 {
    let at: Vec<f64> = places.iter().map(|place| theta[*place]).collect();
    let slope = |i: usize| {
        let step = STEP_SE * covariance[places[i]][places[i]].max(0.0).sqrt();
        let moved = |by: f64| {
            let mut moved = at.clone();
            moved[i] += by;
            of(&moved)
        };
        if step > 0.0 { (moved(step) - moved(-step)) / (2.0 * step) } else { 0.0 }
    };
    let slopes: Vec<f64> = (0..places.len()).map(slope).collect();
    let pairs = (0..places.len()).flat_map(|i| (0..places.len()).map(move |j| (i, j)));
    pairs.map(|(i, j)| slopes[i] * slopes[j] * covariance[places[i]][places[j]]).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `x y` has the variance `y² σx² + 2 x y σxy + x² σy²`, and central differences of a product are exact.
    #[test]
    fn errors_of_a_product_go_with_both_factors() {
        let covariance = [vec![9.0, 0.0, 0.0], vec![0.0, 0.04, 0.01], vec![0.0, 0.01, 0.09]];
        let got = variance(|xy| xy[0] * xy[1], &[1, 2], &[100.0, 2.0, 5.0], &covariance);
        let want = 25.0 * 0.04 + 2.0 * 2.0 * 5.0 * 0.01 + 4.0 * 0.09;
        assert!((got - want).abs() < 1e-12 * want, "{got} {want}");
    }
}
