//! Where to start: the costs have spurious minima, and either sensor may be the slow one.

use twinlag_cross_relation::{Readings, difference_equation_least_squares};
use twinlag_optimise::Variable;

use crate::objective::Objective;

/// Time constants on each axis of the grid, logarithmic. With six a record of 2500 samples has a
/// point in each half decade; how far off a start may lie is in the experiment `starts`.
const GRID_POINTS: usize = 6;
/// Shortest time constant of the grid's range, sample periods.
const GRID_MIN_PERIODS: f64 = 0.5;
/// Longest time constant of the grid's range, spans of the record.
const GRID_MAX_SPANS: f64 = 0.25;
/// Starts kept for each order of the two time constants: a second one, should the lowest be in a
/// spurious valley.
const STARTS_KEPT_PER_ORDER: usize = 2;
/// Noise makes the difference equation's time constants too short (experiment `bias-vs-noise`):
/// these times as long is worth a start as well.
const SLOWER_GUESS: [f64; 2] = [2.0, 1.5];
/// Second lags that fits start from, as shares of the first: a small, a middle and a large one,
/// since from a single one they may be missed.
const SECOND_LAG_SHARES: [f64; 3] = [0.05, 0.3, 0.8];

/// Starts for `objective`, data-driven: the difference equation's least squares, and the lowest
/// points of a logarithmic grid for either order of the time constants. Gain and offset take one
/// Newton step of their own at each point.
///
/// - `second_order`: which sensors have a second lag, in several sizes at each point
pub(crate) fn starts<const P: usize>(
    objective: &Objective<'_, '_, P>,
    readings: &Readings,
    variables: &[Variable],
    second_order: [bool; 2],
) -> Vec<Vec<f64>> {
    let shares = second_lag_shares(second_order);
    let step_s = readings.mean_step_s();
    let (shortest, longest) = (GRID_MIN_PERIODS * step_s, GRID_MAX_SPANS * readings.span_s());
    let axis: Vec<f64> =
        (0..GRID_POINTS).map(|i| shortest * (longest / shortest).powf((i as f64 + 0.5) / GRID_POINTS as f64)).collect();
    let offset_k = if P > 2 { mean_difference(readings) } else { 0.0 };
    let mut grid: Vec<(f64, Vec<f64>)> = Vec::new();
    let mut add = |tau1: f64, tau2: f64| {
        for [s1, s2] in &shares {
            let mut x: Vec<f64> = [tau1, tau2, 1.0, offset_k, s1 * tau1, s2 * tau2][..P].to_vec();
            hold_known(&mut x, variables);
            settle_calibration(objective, &mut x, variables);
            let value = objective.at(&x).value;
            if value.is_finite() {
                grid.push((value, x));
            }
        }
    };
    if let Ok([tau1, tau2]) = difference_equation_least_squares(readings) {
        add(tau1, tau2);
        add(SLOWER_GUESS[0] * tau1, SLOWER_GUESS[1] * tau2);
    }
    for (i, &tau1) in axis.iter().enumerate() {
        for (j, &tau2) in axis.iter().enumerate() {
            if i != j {
                add(tau1, tau2);
            }
        }
    }
    grid.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut kept: Vec<Vec<f64>> = Vec::new();
    for first_is_fast in [true, false] {
        kept.extend(
            grid.iter()
                .filter(|(_, x)| (x[0] < x[1]) == first_is_fast)
                .take(STARTS_KEPT_PER_ORDER)
                .map(|(_, x)| x.clone()),
        );
    }
    kept
}

/// Starts for `P = 6` beside a fit at first order: second lags of several sizes, since from a
/// single one they may be missed.
///
/// - `first`: time constants, gain and offset of that fit
/// - `second_order`: which sensors have a second lag
pub(crate) fn second_lags<const P: usize>(first: &[f64; 4], second_order: [bool; 2]) -> Vec<Vec<f64>> {
    let start = |[s1, s2]: &[f64; 2]| {
        // Both lags together delay as much as the one that was found.
        let (t1, t2) = (first[0] / (1.0 + s1), first[1] / (1.0 + s2));
        [t1, t2, first[2], first[3], s1 * t1, s2 * t2][..P].to_vec()
    };
    second_lag_shares(second_order).iter().map(start).collect()
}

/// Second lags that fits start from, of each sensor as a share of its first.
fn second_lag_shares(second_order: [bool; 2]) -> Vec<[f64; 2]> {
    let [small, middle, large] = SECOND_LAG_SHARES;
    let each = SECOND_LAG_SHARES.into_iter();
    match second_order {
        [false, false] => vec![[0.0; 2]],
        [true, true] => vec![[small; 2], [middle; 2], [large; 2], [small, large], [large, small]],
        [true, false] => each.map(|share| [share, 0.0]).collect(),
        [false, true] => each.map(|share| [0.0, share]).collect(),
    }
}

/// Moves `x` inside the bounds of `variables`, what is held to its value.
pub(crate) fn hold_known(x: &mut [f64], variables: &[Variable]) {
    for (x, v) in x.iter_mut().zip(variables) {
        *x = x.clamp(v.lower, v.upper);
    }
}

fn mean_difference(readings: &Readings) -> f64 {
    let sum = |y: fn(&twinlag_cross_relation::Segment) -> &[f64]| -> f64 {
        readings.segments().iter().flat_map(|s| y(s).iter()).sum()
    };
    (sum(twinlag_cross_relation::Segment::y2) - sum(twinlag_cross_relation::Segment::y1)) / readings.len() as f64
}

/// Gain and offset that fit given time constants. The residual is all but linear in both: one
/// Newton step finds them.
fn settle_calibration<const P: usize>(objective: &Objective<'_, '_, P>, x: &mut [f64], variables: &[Variable]) {
    let free: Vec<usize> = (2..P).filter(|&i| variables[i].lower < variables[i].upper).collect();
    if free.is_empty() {
        return;
    }
    let c = objective.at(x);
    let h = nalgebra::DMatrix::from_fn(free.len(), free.len(), |p, q| c.hessian[free[p]][free[q]]);
    let g = nalgebra::DVector::from_fn(free.len(), |p, _| c.gradient[free[p]]);
    if let Some(step) = h.cholesky().map(|c| c.solve(&g)) {
        for (p, &i) in free.iter().enumerate() {
            x[i] = (x[i] - step[p]).clamp(variables[i].lower, variables[i].upper);
        }
    }
}
