//! The compensated and the normalised cost: derivatives against a public checker, expectation against simulation.

use finitediff::vec::{central_diff, central_hessian};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use twinlag_bias::{Compensated, Hybrid, Noise, NoiseError, Normalised};
use twinlag_cross_relation::{CostValue, CrossRelation, Readings};
use twinlag_sensor::{Discretisation, FirstOrder, Lag, SecondOrder};

const PERIOD_S: f64 = 0.002;
const TAU_S: [f64; 2] = [0.0238, 0.1168];

fn clean(n: usize, tau_s: f64) -> Vec<f64> {
    let gas: Vec<f64> = (0..n).map(|k| 9.0 * (0.11 * k as f64).sin() + 5.0 * (0.031 * k as f64).cos()).collect();
    FirstOrder::new(tau_s, PERIOD_S).expect("valid sensor").respond(&gas)
}

fn noisy(n: usize, std_k: [f64; 2], rng: &mut ChaCha8Rng) -> Readings {
    let [y1, y2] = [0, 1].map(|i| {
        let reading = clean(n, TAU_S[i]);
        reading.iter().map(|y| y + std_k[i] * Distribution::<f64>::sample(&StandardNormal, rng)).collect::<Vec<f64>>()
    });
    Readings::even(&y1, &y2, PERIOD_S).expect("valid channels")
}

fn check<const P: usize>(at: [f64; P], cost: impl Fn(&[f64; P]) -> CostValue<P>) {
    // Variables of size one: time constants in units of their start. Tolerance: see the cross-relation crate's derivatives.
    let unit: [f64; P] = std::array::from_fn(|i| if (2..4).contains(&i) { 1.0 } else { at[i] });
    let theta = |x: &Vec<f64>| std::array::from_fn(|i| x[i] * unit[i]);
    let x: Vec<f64> = (0..P).map(|i| at[i] / unit[i]).collect();
    let got = cost(&theta(&x));
    let gradient = central_diff(&|x: &Vec<f64>| Ok(cost(&theta(x)).value))(&x).expect("finite");
    let slope = |x: &Vec<f64>| Ok(cost(&theta(x)).gradient.iter().zip(unit).map(|(g, u)| g * u).collect());
    let hessian = central_hessian(&slope)(&x).expect("finite");
    let size = |m: &[f64]| 1e-5 * m.iter().fold(0.0_f64, |a, v| a.max(v.abs()));
    for i in 0..P {
        let g = got.gradient[i] * unit[i];
        assert!((g - gradient[i]).abs() <= size(&gradient), "gradient {i}: got {g:e}, want {:e}", gradient[i]);
        for j in 0..P {
            let h = got.hessian[i][j] * unit[i] * unit[j];
            assert!(
                (h - hessian[i][j]).abs() <= size(&hessian.concat()),
                "Hessian {i}, {j}: got {h:e}, want {:e}",
                hessian[i][j]
            );
        }
    }
}

#[test]
fn derivatives_agree_with_a_public_checker() {
    let readings = noisy(700, [0.5, 0.3], &mut ChaCha8Rng::seed_from_u64(1));
    let plain = || CrossRelation::new(&readings, 100).expect("long enough");
    let noise = || [Noise::coloured(vec![0.25, 0.1]).expect("valid"), Noise::white(0.3).expect("valid")];
    let compensated = Compensated::new(plain(), noise());
    let normalised = Normalised::new(plain(), noise());
    check([0.03, 0.09], |t: &[f64; 2]| compensated.evaluate(t));
    check([0.03, 0.09, 0.9, 0.4], |t: &[f64; 4]| compensated.evaluate(t));
    check([0.03, 0.09], |t: &[f64; 2]| normalised.evaluate(t));
    check([0.03, 0.09, 0.9, 0.4], |t: &[f64; 4]| normalised.evaluate(t));
    let of_second_order = [0.03, 0.09, 0.9, 0.4, 0.007, 0.02];
    check(of_second_order, |t: &[f64; 6]| compensated.evaluate(t));
    check(of_second_order, |t: &[f64; 6]| normalised.evaluate(t));
    for weight in [0.0, 0.3, 0.5, 1.0] {
        let hybrid = Hybrid::with_weight(plain(), noise(), weight).expect("valid weight");
        check([0.03, 0.09], |t: &[f64; 2]| hybrid.evaluate(t));
        check([0.03, 0.09, 0.9, 0.4], |t: &[f64; 4]| hybrid.evaluate(t));
        check(of_second_order, |t: &[f64; 6]| hybrid.evaluate(t));
    }
}

/// On average over 400 records the compensated cost is the cost of the clean record, which the plain one exceeds by the
/// noise: the mean must lie within four of its own standard errors, and the noise's share is many of these.
#[test]
fn compensation_makes_the_cost_unbiased() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let std_k = [0.5, 0.3];
    let at = TAU_S;
    let (n, trials) = (700, 400);
    let without = {
        let readings = Readings::even(&clean(n, TAU_S[0]), &clean(n, TAU_S[1]), PERIOD_S).expect("valid");
        CrossRelation::new(&readings, 300).expect("long enough").evaluate(&at).value
    };
    let (mut plain, mut compensated) = (Vec::new(), Vec::new());
    for _ in 0..trials {
        let readings = noisy(n, std_k, &mut rng);
        let cost = Compensated::new(
            CrossRelation::new(&readings, 300).expect("long enough"),
            std_k.map(|s| Noise::white(s).expect("valid")),
        );
        plain.push(cost.cost().evaluate(&at).value - without);
        compensated.push(cost.evaluate(&at).value - without);
    }
    let mean_and_error = |x: &[f64]| {
        let mean = x.iter().sum::<f64>() / x.len() as f64;
        let variance = x.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>() / (x.len() - 1) as f64;
        (mean, (variance / x.len() as f64).sqrt())
    };
    let (bias, error) = mean_and_error(&compensated);
    assert!(bias.abs() < 4.0 * error, "compensated: {bias:e} ± {error:e}");
    let (bias, error) = mean_and_error(&plain);
    assert!(bias > 20.0 * error, "plain: {bias:e} ± {error:e}");
}

#[test]
fn only_the_ratio_of_the_levels_moves_the_normalised_minimum() {
    let readings = noisy(700, [0.5, 0.3], &mut ChaCha8Rng::seed_from_u64(3));
    let plain = || CrossRelation::new(&readings, 100).expect("long enough");
    let by_ratio = Normalised::with_ratio(plain(), 0.6).expect("valid ratio");
    let by_levels = Normalised::new(plain(), [Noise::white(0.5), Noise::white(0.3)].map(|n| n.expect("valid")));
    for at in [[0.0238, 0.1168], [0.05, 0.07]] {
        let (a, b) = (by_ratio.evaluate(&at), by_levels.evaluate(&at));
        assert!((a.value / b.value / 0.25 - 1.0).abs() < 1e-12);
        assert!((a.gradient[0] / b.gradient[0] / 0.25 - 1.0).abs() < 1e-9);
    }
    assert!(Normalised::with_ratio(plain(), 0.0).is_err());
}

/// `w = 1` and `w = 0` are the two costs that the family joins, to rounding.
#[test]
fn the_hybrids_ends_are_the_compensated_and_the_normalised_cost() {
    let readings = noisy(700, [0.5, 0.3], &mut ChaCha8Rng::seed_from_u64(4));
    let plain = || CrossRelation::new(&readings, 100).expect("long enough");
    let noise = || [Noise::white(0.5), Noise::white(0.3)].map(|n| n.expect("valid"));
    let end = |weight| Hybrid::with_weight(plain(), noise(), weight).expect("valid weight").evaluate(&[0.03, 0.09]);
    let compensated = Compensated::new(plain(), noise()).evaluate(&[0.03, 0.09]);
    let normalised = Normalised::new(plain(), noise()).evaluate(&[0.03, 0.09]);
    for (got, want, shift) in [(end(1.0), compensated, 0.0), (end(0.0), normalised, 1.0)] {
        assert!((got.value / (want.value - shift) - 1.0).abs() < 1e-12);
        for i in 0..2 {
            assert!((got.gradient[i] / want.gradient[i] - 1.0).abs() < 1e-10);
            for j in 0..2 {
                assert!((got.hessian[i][j] / want.hessian[i][j] - 1.0).abs() < 1e-10);
            }
        }
    }
    let half = Hybrid::new(plain(), noise()).expect("valid");
    assert_eq!(half.weight(), 0.5);
    assert!(matches!(Hybrid::with_weight(plain(), noise(), 1.5), Err(NoiseError::Weight { .. })));
    let silence = || Noise::white(0.0).expect("valid");
    assert!(matches!(Hybrid::new(plain(), [silence(), silence()]), Err(NoiseError::NoNoise)));
}

/// The gradient at the truth has no expectation, whatever the weight and the order of the sensors: over 600 records its mean
/// lies within four of its own standard errors of zero, which the gradient of the plain cost by `τ1` does not. What the filters' start
/// leaves, `exp(−400 · 2 ms/116.8 ms)` = 1e-3 of a swing of some kelvin, is 1e-6 of the clean cost.
#[test]
fn the_hybrids_gradient_at_the_truth_is_zero_on_average() {
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let (n, trials, std_k) = (900, 600, [1.5, 0.9]);
    let theta = [TAU_S[0], TAU_S[1], 1.0, 0.0, 0.004, 0.009];
    let gas: Vec<f64> =
        (0..n).map(|k| 9.0 * (0.11 * f64::from(k)).sin() + 5.0 * (0.031 * f64::from(k)).cos()).collect();
    let clean = [0, 1].map(|i| {
        let sensor = SecondOrder::new(theta[i], theta[4 + i], PERIOD_S).expect("valid sensor");
        sensor.difference_equation(Discretisation::ZeroOrderHold).expect("exists").respond(&gas)
    });
    let noise = || std_k.map(|s| Noise::white(s).expect("valid"));
    let gradients = |y1: &[f64], y2: &[f64]| {
        let readings = Readings::even(y1, y2, PERIOD_S).expect("valid");
        let plain = || CrossRelation::new(&readings, 400).expect("long enough");
        let of = |w| Hybrid::with_weight(plain(), noise(), w).expect("valid").evaluate(&theta).gradient;
        [of(0.0), of(0.5), of(1.0), plain().evaluate(&theta).gradient]
    };
    let (mut sum, mut squares) = ([[0.0; 6]; 4], [[0.0; 6]; 4]);
    for _ in 0..trials {
        let [y1, y2] = [0, 1].map(|i| {
            clean[i]
                .iter()
                .map(|y| y + std_k[i] * Distribution::<f64>::sample(&StandardNormal, &mut rng))
                .collect::<Vec<f64>>()
        });
        for (kind, gradient) in gradients(&y1, &y2).iter().enumerate() {
            for i in 0..6 {
                sum[kind][i] += gradient[i] / f64::from(trials);
                squares[kind][i] += gradient[i] * gradient[i] / f64::from(trials);
            }
        }
    }
    for kind in 0..4 {
        for i in [0, 1, 2, 4, 5] {
            let error = ((squares[kind][i] - sum[kind][i] * sum[kind][i]) / f64::from(trials)).sqrt();
            let off = sum[kind][i].abs();
            if kind < 3 {
                assert!(off < 4.0 * error, "weight {}, {i}: {off:e} ± {error:e}", 0.5 * f64::from(kind as u8));
            } else if i == 0 {
                assert!(off > 6.0 * error, "plain, {i}: {off:e} ± {error:e}");
            }
        }
    }
}

/// Newton's method from `start`.
fn minimum(start: [f64; 2], cost: impl Fn(&[f64; 2]) -> CostValue<2>) -> [f64; 2] {
    let mut theta = start;
    for _ in 0..30 {
        let c = cost(&theta);
        let [[a, b], [_, d]] = c.hessian;
        let det = a * d - b * b;
        let step = [(d * c.gradient[0] - b * c.gradient[1]) / det, (a * c.gradient[1] - b * c.gradient[0]) / det];
        theta = [theta[0] - step[0], theta[1] - step[1]];
    }
    theta
}

/// Levels given four times too large in variance, in the right ratio: compensating, minimising and reading the level off the
/// minimum again and again ends where the normalised cost is minimal, at the true level. The level converges faster than
/// linearly, so eight rounds leave rounding alone, 1e-9 of the time constants with room. The level of 600 noisy values, the
/// filters' output being correlated over some `τ/Ts`, has a relative standard error of about a fifth.
#[test]
fn profiling_the_level_ends_at_the_normalised_minimum() {
    let readings = noisy(2500, [0.5, 0.3], &mut ChaCha8Rng::seed_from_u64(8));
    let plain = || CrossRelation::new(&readings, 600).expect("long enough");
    let noise = || [Noise::white(1.0), Noise::white(0.6)].map(|n| n.expect("valid"));
    let want = minimum(TAU_S, |t| Normalised::new(plain(), noise()).evaluate(t));
    let mut cost = Compensated::new(plain(), noise());
    let mut theta = TAU_S;
    for _ in 0..8 {
        cost = cost.with_level(cost.profiled_level(&theta)).expect("a level");
        theta = minimum(theta, |t| cost.evaluate(t));
    }
    for i in 0..2 {
        assert!((theta[i] / want[i] - 1.0).abs() < 1e-9, "sensor {}: got {}, want {}", i + 1, theta[i], want[i]);
    }
    assert!((cost.level() / 0.25 - 1.0).abs() < 0.4, "level {}", cost.level());
    assert!(cost.with_level(-1.0).is_err() && cost.with_level(f64::NAN).is_err());
}
