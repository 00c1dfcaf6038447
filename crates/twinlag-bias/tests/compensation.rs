//! The compensated and the normalised cost: derivatives against a public checker, expectation against simulation.

use finitediff::vec::{central_diff, central_hessian};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use twinlag_bias::{Compensated, Noise, Normalised};
use twinlag_cross_relation::{CostValue, CrossRelation, Readings};
use twinlag_sensor::FirstOrder;

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
    let unit: [f64; P] = std::array::from_fn(|i| if i < 2 { at[i] } else { 1.0 });
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
