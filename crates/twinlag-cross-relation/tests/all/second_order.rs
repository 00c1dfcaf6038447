//! The published cost with sensors of second order: against simulated sensors, a public derivative checker, and the cost of
//! first order.

use finitediff::vec::{central_diff, central_hessian};
use twinlag_cross_relation::{CrossRelation, Readings, Segment, Steps};
use twinlag_sensor::{Discretisation, Lag, SecondOrder};

const PERIOD_S: f64 = 0.002;
/// `[τ1, τ2, g, o, τ₂1, τ₂2]`.
const TRUTH: [f64; 6] = [0.0238, 0.1168, 1.03, 0.4, 0.004, 0.009];

/// Two lags of second order in a two-tone gas, gain and offset on the second, with a deterministic disturbance of size
/// `wobble_k` on each.
fn record(wobble_k: f64) -> Readings {
    let gas: Vec<f64> =
        (0..900).map(|k| 9.0 * (0.11 * f64::from(k)).sin() + 5.0 * (0.031 * f64::from(k)).cos()).collect();
    let reading = |tau: f64, second: f64, wobble: f64| -> Vec<f64> {
        let sensor = SecondOrder::new(tau, second, PERIOD_S).expect("valid sensor");
        let clean = sensor.difference_equation(Discretisation::ZeroOrderHold).expect("exists").respond(&gas);
        clean.iter().enumerate().map(|(k, y)| y + wobble_k * (wobble * (k * k) as f64).sin()).collect()
    };
    let y1 = reading(TRUTH[0], TRUTH[4], 2.3);
    let y2 = reading(TRUTH[1], TRUTH[5], 1.7).iter().map(|y| TRUTH[2] * y + TRUTH[3]).collect();
    let segment = Segment::new(y1, y2, Steps::Even(PERIOD_S)).expect("valid channels");
    Readings::about(vec![segment], 0.0).expect("valid record")
}

/// The filters forget their start as `exp(−600 · 2 ms/116.8 ms)` = 3e-5, squared 1e-9, of a swing of some kelvin. Leaving a
/// second lag of 9 ms out costs its share of the delay, 9 ms of a tone of 9 Hz, half a radian of a reading of 1 K.
#[test]
fn the_cost_vanishes_at_the_true_time_constants_of_second_order() {
    let readings = record(0.0);
    let cost = CrossRelation::new(&readings, 600).expect("long enough");
    let at_truth = cost.evaluate(&TRUTH).value;
    let without = cost.evaluate(&[TRUTH[0], TRUTH[1], TRUTH[2], TRUTH[3], TRUTH[4], 0.0]).value;
    assert!(at_truth < 1e-8, "at the truth {at_truth:e}");
    assert!(without > 1e-3, "without one of the lags {without:e}");
}

/// See `derivatives.rs` for the tolerance. Points with both, one and none of the second lags; nearly equal lags among them.
#[test]
fn value_gradient_and_hessian_agree() {
    let readings = record(0.4);
    let cost = CrossRelation::new(&readings, 100).expect("long enough");
    let starts = [
        TRUTH,
        [0.03, 0.09, 0.9, -1.0, 0.0301, 0.002],
        [0.2, 0.01, 1.2, 2.0, 0.0, 0.03],
        [0.02, 0.05, 1.1, 1.0, 0.03, 0.0],
        [0.02, 0.05, 1.1, 1.0, 0.0, 0.0],
    ];
    for start in starts {
        // Time constants in logarithms, except those that are none.
        let free: Vec<usize> = (0..6).filter(|&i| start[i] != 0.0).collect();
        let is_log = |i: usize| i != 2 && i != 3;
        let natural = |x: &[f64]| {
            let mut theta = [0.0; 6];
            free.iter().zip(x).for_each(|(&i, x)| theta[i] = if is_log(i) { x.exp() } else { *x });
            theta
        };
        let x: Vec<f64> = free.iter().map(|&i| if is_log(i) { f64::ln(start[i]) } else { start[i] }).collect();
        let slope = |x: &[f64]| -> Vec<f64> {
            let theta = natural(x);
            let c = cost.evaluate(&theta);
            free.iter().map(|&i| c.gradient[i] * if is_log(i) { theta[i] } else { 1.0 }).collect()
        };
        let theta = natural(&x);
        let c = cost.evaluate(&theta);
        let scale = |i: usize| if is_log(i) { theta[i] } else { 1.0 };
        let hessian: Vec<Vec<f64>> = free
            .iter()
            .map(|&i| {
                let own = |j: usize| if i == j && is_log(i) { c.gradient[i] * scale(i) } else { 0.0 };
                free.iter().map(|&j| c.hessian[i][j] * scale(i) * scale(j) + own(j)).collect()
            })
            .collect();
        let close = |name: &str, got: &[f64], want: &[f64]| {
            let tol = 1e-5 * want.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            for (i, (g, w)) in got.iter().zip(want).enumerate() {
                assert!((g - w).abs() <= tol, "{start:?}, {name} {i}: got {g:e}, want {w:e} ± {tol:e}");
            }
        };
        let value = |x: &Vec<f64>| Ok(cost.evaluate(&natural(x)).value);
        close("gradient", &slope(&x), &central_diff(&value)(&x).expect("finite"));
        let want = central_hessian(&|x: &Vec<f64>| Ok(slope(x)))(&x).expect("finite");
        close("Hessian", &hessian.concat(), &want.concat());
        // The error signal carries the same derivatives.
        let signal = cost.error_signal(&theta);
        let sum: [f64; 6] =
            std::array::from_fn(|i| 2.0 * signal.iter().map(|(e, de)| e * de[i]).sum::<f64>() / cost.counted() as f64);
        close("gradient from the error signal", &sum, &c.gradient);
        for i in (0..6).filter(|i| !free.contains(i)) {
            assert_eq!(c.gradient[i], 0.0, "a lag that is none has no derivative");
        }
    }
}

/// The two recursions, that by hand and that of second order with one lag of 1e-3 periods, whose step response is complete to
/// `exp(−1000)` within a sample: it only takes the hold back by its own length, which is 1e-3 of a sample of every derivative.
#[test]
fn no_second_lag_is_the_cost_of_first_order() {
    let readings = record(0.4);
    let cost = CrossRelation::new(&readings, 100).expect("long enough");
    let [first, none, tiny] = [
        cost.evaluate(&[0.03, 0.09, 0.9, -1.0]).value,
        cost.evaluate(&[0.03, 0.09, 0.9, -1.0, 0.0, 0.0]).value,
        cost.evaluate(&[0.03, 0.09, 0.9, -1.0, 2e-6, 0.0]).value,
    ];
    assert!((none / first - 1.0).abs() < 1e-13, "without: {none}, first order: {first}");
    assert!((tiny / first - 1.0).abs() < 2e-3, "with a tiny one: {tiny}, first order: {first}");
}
