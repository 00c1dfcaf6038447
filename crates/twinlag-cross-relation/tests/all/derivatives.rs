//! Every cost's derivatives against a public derivative checker (the `finitediff` crate).
//!
//! Central differences with its step `h = √ε ≈ 1.5e-8` in `ln τ` and in gains of size one: the truncation error is `h²`,
//! rounding `ε/h ≈ 1.5e-8` of the largest term summed. 1e-5 of the largest derivative leaves room for cancellation in the
//! sums; a wrong sign or factor is far outside.

use finitediff::vec::{central_diff, central_hessian};
use twinlag_cross_relation::{CostValue, CrossRelation, Form, FreeGains, Readings, Segment, Steps, Whitened};
use twinlag_sensor::{Discretisation, FirstOrder};

const PERIOD_S: f64 = 0.002;
const RELATIVE: f64 = 1e-5;

/// Two lags of a two-tone gas with a deterministic disturbance on each channel, gain 1.03 and offset 0.4 on the second.
fn channels(n: usize) -> (Vec<f64>, Vec<f64>) {
    let gas: Vec<f64> = (0..n).map(|k| 50.0 + 9.0 * (0.11 * k as f64).sin() + 5.0 * (0.031 * k as f64).cos()).collect();
    let reading = |tau: f64, wobble: f64| -> Vec<f64> {
        let clean = FirstOrder::new(tau, PERIOD_S).expect("valid sensor").respond(&gas);
        clean.iter().enumerate().map(|(k, y)| y + 0.4 * (wobble * (k * k) as f64).sin()).collect()
    };
    let y2 = reading(0.1168, 1.7).iter().map(|y| 1.03 * y + 0.4).collect();
    (reading(0.0238, 2.3), y2)
}

fn even() -> Readings {
    let (y1, y2) = channels(700);
    Readings::even(&y1, &y2, PERIOD_S).expect("valid channels")
}

fn uneven_with_a_gap() -> Readings {
    let (y1, y2) = channels(700);
    let steps: Vec<f64> = (0..699).map(|k| PERIOD_S * (1.0 + 0.2 * f64::from(k % 5))).collect();
    let cut = |from: usize, to: usize| {
        let steps = Steps::Uneven(steps[from..to - 1].to_vec());
        Segment::new(y1[from..to].to_vec(), y2[from..to].to_vec(), steps).expect("valid segment")
    };
    Readings::new(vec![cut(0, 300), cut(310, 700)]).expect("valid record")
}

/// `[ln τ1, ln τ2, g, o]` to the costs' own parameters, and derivatives back by the chain rule.
fn natural<const P: usize>(x: &[f64]) -> [f64; P] {
    std::array::from_fn(|i| if i < 2 { x[i].exp() } else { x[i] })
}

fn in_logarithms<const P: usize>(x: &[f64], c: &CostValue<P>) -> (Vec<f64>, Vec<Vec<f64>>) {
    let theta: [f64; P] = natural(x);
    let scale: [f64; P] = std::array::from_fn(|i| if i < 2 { theta[i] } else { 1.0 });
    let gradient: Vec<f64> = (0..P).map(|i| c.gradient[i] * scale[i]).collect();
    let hessian = (0..P)
        .map(|i| {
            (0..P)
                .map(|j| c.hessian[i][j] * scale[i] * scale[j] + if i == j && i < 2 { gradient[i] } else { 0.0 })
                .collect()
        })
        .collect();
    (gradient, hessian)
}

fn close(name: &str, got: &[f64], want: &[f64]) {
    let size = want.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    for (i, (g, w)) in got.iter().zip(want).enumerate() {
        assert!(
            (g - w).abs() <= RELATIVE * size,
            "{name}, entry {i}: got {g:e}, want {w:e} within {:e}",
            RELATIVE * size
        );
    }
}

/// Checks value against gradient and, where the Hessian is exact, gradient against Hessian, at points on and off the truth.
fn check<const P: usize>(name: &str, exact_hessian: bool, cost: impl Fn(&[f64; P]) -> CostValue<P>) {
    for start in [[0.0238, 0.1168, 1.03, 0.4], [0.03, 0.09, 0.9, -1.0], [0.2, 0.01, 1.2, 2.0]] {
        let x: Vec<f64> = (0..P).map(|i| if i < 2 { f64::ln(start[i]) } else { start[i] }).collect();
        let (gradient, hessian) = in_logarithms(&x, &cost(&natural(&x)));
        let value = |x: &Vec<f64>| Ok(cost(&natural(x)).value);
        close(name, &gradient, &central_diff(&value)(&x).expect("finite"));
        if exact_hessian {
            let slope = |x: &Vec<f64>| Ok(in_logarithms(x, &cost(&natural(x))).0);
            let want = central_hessian(&slope)(&x).expect("finite");
            close(name, &hessian.concat(), &want.concat());
        }
    }
}

#[test]
fn cross_relation_value_gradient_and_hessian_agree() {
    let readings = even();
    let cost = CrossRelation::new(&readings, 100).expect("long enough");
    check("unity gain", true, |t: &[f64; 2]| cost.evaluate(t));
    check("free gain and offset", true, |t: &[f64; 4]| cost.evaluate(t));
}

#[test]
fn free_gains_value_gradient_and_hessian_agree() {
    let readings = even();
    let cost = FreeGains::new(&readings, 100).expect("long enough");
    // Poles and gains are of size 0.01 to 1: differences in their own units, smaller steps for nothing.
    for x in [vec![0.92, 0.08, 0.98, 0.02], vec![0.8, 0.3, 0.9, 0.08]] {
        let at = |x: &Vec<f64>| cost.evaluate([x[0], x[1], x[2], x[3]]);
        let got = at(&x);
        close("free gains", &got.gradient, &central_diff(&|x: &Vec<f64>| Ok(at(x).value))(&x).expect("finite"));
        let slope = |x: &Vec<f64>| Ok(at(x).gradient.to_vec());
        close("free gains", &got.hessian.concat(), &central_hessian(&slope)(&x).expect("finite").concat());
    }
}

#[test]
fn whitened_value_and_gradient_agree_in_both_forms() {
    let readings = even();
    for hold in [Discretisation::ZeroOrderHold, Discretisation::Bilinear] {
        for form in [Form::Spectral, Form::Banded] {
            let cost = Whitened::with_form(&readings, hold, [0.3, 0.2], form).expect("valid");
            check("whitened", false, |t: &[f64; 2]| cost.evaluate(t));
            check("whitened, free gain and offset", false, |t: &[f64; 4]| cost.evaluate(t));
        }
    }
    let cost = Whitened::new(&readings, Discretisation::FirstOrderHold, [0.3, 0.2]).expect("valid");
    check("whitened, first-order hold", false, |t: &[f64; 4]| cost.evaluate(t));
}

/// The compressed sum's gradient is that of the compressed sum.
#[test]
fn compressed_value_and_gradient_agree() {
    let readings = even();
    let cost = Whitened::new(&readings, Discretisation::ZeroOrderHold, [0.3, 0.2]).expect("valid").compressed(true);
    check("compressed", false, |t: &[f64; 2]| cost.evaluate(t));
    check("compressed, free gain and offset", false, |t: &[f64; 4]| cost.evaluate(t));
}

#[test]
fn whitened_value_and_gradient_agree_with_autoregressive_noise_and_second_lags() {
    let readings = even();
    for hold in [Discretisation::ZeroOrderHold, Discretisation::FirstOrderHold, Discretisation::Bilinear] {
        let cost = Whitened::new(&readings, hold, [0.3, 0.2]).expect("valid");
        let cost = cost.with_autoregression([vec![0.5], vec![0.2, -0.3]]).expect("stationary");
        check("autoregressive noise", false, |t: &[f64; 4]| cost.evaluate(t));
        // Two lags in each sensor multiply the condition of V, to some (2τ/Ts)² (2τ₂/Ts)² = 3e6, and with it the rounding of the
        // value: a wider step, `h = 1e-4` in the logarithms, whose truncation is `h²`.
        for at in [[0.0238_f64, 0.1168, 1.03, 0.4, 0.004, 0.03], [0.03, 0.09, 0.9, -1.0, 0.01, 0.01]] {
            let got = cost.evaluate(&at);
            let scale: [f64; 6] = std::array::from_fn(|i| if i == 2 || i == 3 { 1.0 } else { at[i] });
            let want: Vec<f64> = (0..6)
                .map(|i| {
                    let value = |sign: f64| {
                        let mut moved = at;
                        moved[i] += sign * 1e-4 * scale[i];
                        cost.evaluate(&moved).value
                    };
                    (value(1.0) - value(-1.0)) / 2e-4
                })
                .collect();
            let got: Vec<f64> = (0..6).map(|i| got.gradient[i] * scale[i]).collect();
            close(&format!("second lags, {hold:?}, {at:?}"), &got, &want);
        }
    }
}

#[test]
fn whitened_value_and_gradient_agree_on_uneven_samples_with_a_gap() {
    let readings = uneven_with_a_gap();
    let cost = Whitened::new(&readings, Discretisation::ZeroOrderHold, [0.3, 0.2]).expect("valid");
    check("whitened, uneven", false, |t: &[f64; 4]| cost.evaluate(t));
}

#[test]
fn both_forms_are_equal_to_rounding() {
    let (y1, y2) = channels(700);
    let cut = |from: usize, to: usize| {
        Segment::new(y1[from..to].to_vec(), y2[from..to].to_vec(), Steps::Even(PERIOD_S)).expect("valid segment")
    };
    let readings = Readings::new(vec![cut(0, 263), cut(270, 700)]).expect("valid record");
    for hold in [Discretisation::ZeroOrderHold, Discretisation::Bilinear] {
        let [a, b] = [Form::Spectral, Form::Banded]
            .map(|form| Whitened::with_form(&readings, hold, [0.3, 0.2], form).expect("valid"));
        for theta in [[0.0238, 0.1168, 1.03, 0.4], [0.03, 0.09, 0.9, -1.0], [0.2, 0.01, 1.2, 2.0]] {
            let (a, b) = (a.evaluate(&theta), b.evaluate(&theta));
            // Some 700 terms, each with a few roundings amplified by the condition of V, about (2τ/Ts)² = 1e4 at most.
            let tol = 700.0 * f64::EPSILON * 1e4;
            assert!((a.value / b.value - 1.0).abs() < tol, "{hold:?}: {} and {}", a.value, b.value);
            for i in 0..4 {
                let size = (b.hessian[i][i] * b.value).sqrt();
                assert!((a.gradient[i] - b.gradient[i]).abs() < tol * size, "{hold:?}, gradient {i}");
            }
        }
    }
}
