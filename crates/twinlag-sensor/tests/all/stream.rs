//! That a sensor sample by sample is the sensor of its formula and of slices; with and without the feature `std`.

use twinlag_sensor::{Discretisation, FirstOrder, Lag, SecondOrder, SlowMode};

const PERIOD_S: f64 = 0.004;

fn gas_c() -> Vec<f64> {
    (0..2000).map(|k| 300.0 + 40.0 * (0.31 * f64::from(k)).sin() + f64::from(k * k % 17)).collect()
}

fn largest_difference(got: &[f64], want: &[f64]) -> f64 {
    assert_eq!(got.len(), want.len());
    got.iter().zip(want).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Terms of up to 360 K have errors of 6e-14 from rounding of themselves and of the pole, which is amplified by
/// `1/(1 − a)` = 13: 8e-13, twice for both.
#[test]
fn a_first_order_responder_follows_its_recursion() {
    let (gas, tau_s) = (gas_c(), 0.05);
    let a = (-PERIOD_S / tau_s).exp();
    let mut want = vec![gas[0]];
    for k in 1..gas.len() {
        want.push(a * want[k - 1] + (1.0 - a) * gas[k - 1]);
    }
    let mut responder = FirstOrder::new(tau_s, PERIOD_S).expect("valid").responder();
    let got: Vec<f64> = gas.iter().map(|&x| responder.push(x)).collect();
    let worst = largest_difference(&got, &want);
    assert!(worst < 2e-12, "largest difference {worst:e}");
}

/// Rounding of readings, 6e-14, divided by `1 − a = 0.08`, twice.
#[test]
fn an_inverter_gives_the_gas_of_one_sample_earlier() {
    let (gas, sensor) = (gas_c(), FirstOrder::new(0.05, PERIOD_S).expect("valid"));
    let (mut responder, mut inverter) = (sensor.responder(), sensor.inverter());
    let back: Vec<Option<f64>> = gas.iter().map(|&x| inverter.push(responder.push(x))).collect();
    assert_eq!(back[0], None);
    let back: Vec<f64> = back[1..].iter().map(|x| x.expect("from the second on")).collect();
    let worst = largest_difference(&back, &gas[..gas.len() - 1]);
    assert!(worst < 2e-12, "largest difference {worst:e}");
}

/// In partial fractions a sensor of two poles is two of first order side by side: `τ/(τ − τ₂)` of one and `−τ₂/(τ − τ₂)` of the
/// other for two lags in series, and `1 − φ τ_s/(τ_s − τ)` and `φ τ_s/(τ_s − τ)` for a slow path; both hold the gas. Terms of
/// up to 2 · 360 K have errors of 1.1e-13 from their rounded coefficients, the same in each step, which is amplified by
/// `1/((1 − a)(1 − c))` = 42 and 1300: 1.5e-10, twice for both coefficients.
#[test]
fn an_equation_responder_is_the_sum_of_its_partial_fractions() {
    let gas = gas_c();
    let (tau, second, slow, fraction) = (0.05, 0.011, 0.4, 0.25);
    let through_support = fraction * slow / (slow - tau);
    let series = SecondOrder::new(tau, second, PERIOD_S).expect("valid");
    let parallel = SlowMode::new(tau, fraction, slow, PERIOD_S).expect("valid");
    let cases = [
        (&series as &dyn Lag, [(tau / (tau - second), tau), (-second / (tau - second), second)]),
        (&parallel, [(1.0 - through_support, tau), (through_support, slow)]),
    ];
    for (lag, fractions) in cases {
        let mut whole = lag.difference_equation(Discretisation::ZeroOrderHold).expect("exists").responder();
        let mut parts = fractions.map(|(_, tau)| FirstOrder::new(tau, PERIOD_S).expect("valid").responder());
        let got: Vec<f64> = gas.iter().map(|&x| whole.push(x)).collect();
        let want: Vec<f64> = gas
            .iter()
            .map(|&x| parts.iter_mut().zip(fractions).map(|(part, (weight, _))| weight * part.push(x)).sum())
            .collect();
        let worst = largest_difference(&got, &want);
        assert!(worst < 3e-10, "largest difference {worst:e}");
    }
}

/// The last digit of the exponential, of whichever library, 2.2e-16 of numbers below one.
#[test]
fn poles_are_those_of_the_standard_library() {
    for tau_s in [0.001, 0.05, 3.0, 4e5] {
        let sensor = FirstOrder::new(tau_s, PERIOD_S).expect("valid");
        let (want_pole, want_gain) = ((-PERIOD_S / tau_s).exp(), -(-PERIOD_S / tau_s).exp_m1());
        assert!((sensor.pole() - want_pole).abs() <= f64::EPSILON * want_pole, "τ = {tau_s}");
        assert!((sensor.input_gain() - want_gain).abs() <= f64::EPSILON * want_gain, "τ = {tau_s}");
        let again = FirstOrder::from_pole(sensor.pole(), PERIOD_S).expect("valid").pole();
        assert!((again - want_pole).abs() <= 2.0 * f64::EPSILON, "τ = {tau_s}");
    }
}

/// The same operations in the same order: the same bits. The difference equation is written out once more.
#[cfg(feature = "std")]
#[test]
fn slices_say_what_samples_say() {
    let (gas, sensor) = (gas_c(), FirstOrder::new(0.05, PERIOD_S).expect("valid"));
    let (mut responder, mut inverter) = (sensor.responder(), sensor.inverter());
    let readings = sensor.respond(&gas);
    let one_by_one: Vec<f64> = gas.iter().map(|&x| responder.push(x)).collect();
    assert_eq!(readings, one_by_one);
    let back: Vec<f64> = readings.iter().filter_map(|&y| inverter.push(y)).collect();
    assert_eq!(sensor.invert(&readings), back);
    for kind in [Discretisation::ZeroOrderHold, Discretisation::FirstOrderHold, Discretisation::Bilinear] {
        let equation =
            SecondOrder::new(0.05, 0.011, PERIOD_S).expect("valid").difference_equation(kind).expect("exists");
        let (num, den) = (equation.numerator(), equation.denominator());
        let rest = |values: &[f64], k: usize, j: usize| if k >= j { values[k - j] } else { gas[0] };
        let mut want: Vec<f64> = Vec::new();
        for k in 0..gas.len() {
            let input: f64 = (0..3).map(|j| num[j] * rest(&gas, k, j)).sum();
            let output: f64 = (1..3).map(|j| den[j] * rest(&want, k, j)).sum();
            want.push(input - output);
        }
        assert_eq!(equation.respond(&gas), want, "{kind:?}");
    }
}
