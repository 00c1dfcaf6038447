//! The whitened cost for second-order sensors, for autoregressive noise, and the bound, each against an oracle of its own.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use twinlag_cross_relation::{CostError, Readings, Whitened};
use twinlag_sensor::{Discretisation, FirstOrder, Lag, SecondOrder};

const PERIOD_S: f64 = 0.002;
const HOLDS: [Discretisation; 3] =
    [Discretisation::ZeroOrderHold, Discretisation::FirstOrderHold, Discretisation::Bilinear];

fn gas(n: usize) -> Vec<f64> {
    (0..n).map(|k| 15.0 * (0.11 * k as f64).sin() + 8.0 * (0.031 * k as f64).cos()).collect()
}

fn reading(lag: &dyn Lag, hold: Discretisation, gas: &[f64]) -> Vec<f64> {
    lag.difference_equation(hold).expect("exists").respond(gas)
}

/// Records of the partial-fraction difference equations, which the cost does not use. What is left at the truth is rounding,
/// 1e-12 of some 20 K amplified by `1/(1 − a)(1 − c)` of both lags, about 300, over a noise of 0.1 K: 1e-15 in the square, times
/// 700 terms and their scatter; 1e-9. A tenth off in any time constant costs thousands.
#[test]
fn second_order_sensors_agree_at_the_truth_and_nowhere_else() {
    let gas = gas(700);
    for hold in HOLDS {
        for truth in [
            [0.03, 0.1168, 1.0, 0.0, 0.004, 0.0],
            [0.0238, 0.1, 1.0, 0.0, 0.0, 0.02],
            [0.03, 0.1, 1.0, 0.0, 0.01, 0.05],
        ] {
            let channel = |i: usize| {
                let (tau, second) = (truth[i], truth[4 + i]);
                if second > 0.0 {
                    reading(&SecondOrder::new(tau, second, PERIOD_S).expect("valid"), hold, &gas)
                } else {
                    reading(&FirstOrder::new(tau, PERIOD_S).expect("valid"), hold, &gas)
                }
            };
            let readings = Readings::even(&channel(0), &channel(1), PERIOD_S).expect("valid");
            let cost = Whitened::new(&readings, hold, [0.1, 0.1]).expect("valid");
            let at_truth = cost.evaluate(&truth).value;
            assert!(at_truth < 1e-9, "{hold:?}, {truth:?}: {at_truth:e}");
            for i in [0, 1, 4, 5].into_iter().filter(|&i| truth[i] > 0.0) {
                let mut moved = truth;
                moved[i] *= 1.1;
                let value = cost.evaluate(&moved).value;
                assert!(value > 10.0, "{hold:?}, {truth:?}, {i}: {value:e}");
            }
        }
    }
}

/// Without second lags six parameters are four, whatever form computes them; rounding of 700 terms.
#[test]
fn no_second_lag_is_the_first_order_sensor() {
    let gas = gas(700);
    let channel = |tau| FirstOrder::new(tau, PERIOD_S).expect("valid").respond(&gas);
    let readings = Readings::even(&channel(0.02), &channel(0.1), PERIOD_S).expect("valid");
    let cost = Whitened::new(&readings, Discretisation::ZeroOrderHold, [0.1, 0.2]).expect("valid");
    let (four, six) = (cost.evaluate(&[0.03, 0.12, 1.1, 0.3]), cost.evaluate(&[0.03, 0.12, 1.1, 0.3, 0.0, 0.0]));
    assert!((four.value / six.value - 1.0).abs() < 1e-10, "{} and {}", four.value, six.value);
    for i in 0..4 {
        assert!((four.gradient[i] / six.gradient[i] - 1.0).abs() < 1e-8, "{i}");
    }
    assert_eq!(six.gradient[4..], [0.0, 0.0]);
}

/// Autoregressive noise on both channels, of orders 1 and 2, no gas. Over `n = 20 000` whitened residuals the mean square has
/// standard error `√(2/n)` = 1 %, each autocorrelation `1/√n` = 0.7 %; four of these. Whitened as if white they are far from it.
#[test]
fn autoregressive_noise_is_whitened_exactly() {
    let n = 20_000;
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let mut noise = |phi: [f64; 2], std: f64| -> Vec<f64> {
        // Innovations that give the stationary process standard deviation `std` (Yule and Walker).
        let rest = 1.0 - phi[1];
        let fresh = std * ((1.0 + phi[1]) * (rest * rest - phi[0] * phi[0]) / rest).sqrt();
        let mut past = [0.0; 2];
        let mut out = Vec::with_capacity(n);
        for k in 0..n + 500 {
            let draw: f64 = StandardNormal.sample(&mut rng);
            let now = phi[0] * past[0] + phi[1] * past[1] + fresh * draw;
            past = [now, past[0]];
            if k >= 500 {
                out.push(now);
            }
        }
        out
    };
    let (y1, y2) = (noise([0.6, 0.0], 0.5), noise([0.3, 0.4], 0.8));
    let readings = Readings::even(&y1, &y2, PERIOD_S).expect("valid");
    let theta = [0.0238, 0.1168];
    for hold in [Discretisation::ZeroOrderHold, Discretisation::FirstOrderHold] {
        let white = Whitened::new(&readings, hold, [0.5, 0.8]).expect("valid");
        let coloured = white.clone().with_autoregression([vec![0.6], vec![0.3, 0.4]]).expect("stationary");
        let statistics = |cost: &Whitened<'_>| -> (f64, f64) {
            let residual = cost.residual(&theta).concat();
            assert_eq!(residual.len(), cost.terms(&theta));
            let energy = residual.iter().map(|r| r * r).sum::<f64>();
            let correlation =
                |lag: usize| residual.iter().zip(&residual[lag..]).map(|(a, b)| a * b).sum::<f64>() / energy;
            let largest = (1..6).map(|lag| correlation(lag).abs()).fold(0.0, f64::max);
            (energy / residual.len() as f64, largest)
        };
        let (energy, correlation) = statistics(&coloured);
        assert!((energy - 1.0).abs() < 0.04, "{hold:?}: mean square {energy}");
        assert!(correlation < 0.0283, "{hold:?}: autocorrelation {correlation}");
        assert!(statistics(&white).1 > 0.2, "{hold:?}: whiteness for nothing");
    }
}

#[test]
fn noise_that_is_not_stationary_is_refused() {
    let readings = Readings::even(&[1.0, 2.0, 3.0, 1.0], &[2.0, 1.0, 0.0, 3.0], 1.0).expect("valid");
    for bad in [vec![1.0], vec![0.5, 0.6], vec![0.1, 0.1, 0.1]] {
        let cost = Whitened::new(&readings, Discretisation::ZeroOrderHold, [1.0; 2]).expect("valid");
        let refused = cost.with_autoregression([bad.clone(), Vec::new()]).err();
        assert_eq!(refused, Some(CostError::Autoregression { coefficients: bad }));
    }
}

/// The bound per frequency, `Σ Re(d_i d_j*)` with `d_i = (∂_i H2 H1 − ∂_i H1 H2) X/√(s1² |H2|² + s2² |H1|²)`, over the discrete
/// Fourier transform of a gas that is periodic in the record, derivatives by differences. The record's own bound knows that the
/// first and last samples say less: of the order of one in `n/(τ2/Ts) = 43` time constants; 5 %.
#[test]
fn the_bound_is_that_of_the_frequency_domain() {
    let n = 2500;
    let truth = [0.0238, 0.1168];
    let noise = [0.5, 0.9];
    // 50 periods and 130 of them in the record, and as long a run-in.
    let gas = |k: i32| {
        let w = std::f64::consts::TAU * f64::from(k) / f64::from(n);
        16.5 * (50.0 * w).sin() + 7.0 * (130.0 * w).cos()
    };
    let channel = |tau: f64| -> Vec<f64> {
        let all: Vec<f64> = (-n..n).map(gas).collect();
        FirstOrder::new(tau, PERIOD_S).expect("valid").respond(&all)[n as usize..].to_vec()
    };
    let readings = Readings::even(&channel(truth[0]), &channel(truth[1]), PERIOD_S).expect("valid");
    let cost = Whitened::new(&readings, Discretisation::ZeroOrderHold, noise).expect("valid");
    let got = cost.cramer_rao(&truth, &[0, 1]).expect("determined");

    let response = |tau: f64, bin: f64| {
        let sensor = FirstOrder::new(tau, PERIOD_S).expect("valid");
        let equation = sensor.difference_equation(Discretisation::ZeroOrderHold).expect("exists");
        equation.frequency_response(bin / (f64::from(n) * PERIOD_S), PERIOD_S)
    };
    let mut information = [[0.0; 2]; 2];
    for (bin, amplitude) in [(50.0, 16.5), (130.0, 7.0)] {
        let power = f64::from(n) * amplitude * amplitude / 4.0; // |X|²/n at each sign of the frequency
        let (h1, h2) = (response(truth[0], bin), response(truth[1], bin));
        let slope = |i: usize| {
            let h = 1e-5 * truth[i];
            (response(truth[i] + h, bin) - response(truth[i] - h, bin)) / (2.0 * h)
        };
        let weight = power / (noise[0].powi(2) * h2.norm_sqr() + noise[1].powi(2) * h1.norm_sqr());
        let d = [-slope(0) * h2, slope(1) * h1];
        for i in 0..2 {
            for j in 0..2 {
                information[i][j] += 2.0 * weight * (d[i] * d[j].conj()).re;
            }
        }
    }
    let det = information[0][0] * information[1][1] - information[0][1].powi(2);
    let want = [information[1][1] / det, information[0][0] / det];
    for i in 0..2 {
        assert!((got[i][i] / want[i] - 1.0).abs() < 0.05, "{i}: got {:e}, want {:e}", got[i][i], want[i]);
    }
}
