//! Each effect against a closed form, or against the same rig without it.

use std::f64::consts::{FRAC_PI_2, TAU};

use twinlag_signal::{
    Clean, ClockSlip, ColouredNoise, Flow, FlowSine, FlowStep, Gas, Hysteresis, IntermittentContact, Mains, Mismatch,
    Noise, Radiation, Record, Replaced, Rig, Sensor, Series, Signal, SignalError, Spikes, Stream,
    TemperatureDependence, Tone,
};
use twinlag_transform::Complex64;

use super::{assert_close, coarse, held, lagged, mean_square, rig, rig_with};

const MEAN_C: f64 = 450.0;
const TAU_S: f64 = 0.0238;
const STEP_S: f64 = 0.002 / 24.0;
const ZERO_CELSIUS_K: f64 = 273.15;

fn sine(amplitude_k: f64, frequency_hz: f64) -> Gas {
    Gas::new(MEAN_C, Signal::Sine(Tone { amplitude_k, frequency_hz, phase_rad: 0.3 }))
}

/// The reference record, with more than sixty time constants of run-in.
fn reference(gas: Gas, first: Sensor) -> Rig {
    let mut record = Record::new(2500, 0.002);
    record.settle_s = Some(1.5);
    rig_with(record, gas, first)
}

fn clean(rig: &Rig) -> Clean {
    rig.clean(0).expect("simulates")
}

/// The first sensor of the reference record with a change to it.
fn with(change: impl FnOnce(&mut Sensor)) -> Sensor {
    let mut sensor = Sensor::new("T1", TAU_S);
    change(&mut sensor);
    sensor
}

/// A step from one temperature to another at the second sample, held.
fn step(from_c: f64, to_c: f64, samples: usize) -> Gas {
    let mut values_c = vec![to_c; samples];
    values_c[0] = from_c;
    held(0.0, Signal::Series(Series::Inline { values_c, period_s: 0.002 }))
}

/// Both sides are computed from the same junction temperature: rounding of 450 °C.
#[test]
fn curvature_adds_a_parabola_about_its_centre_after_gain_and_offset() {
    let gained = |sensor: &mut Sensor| (sensor.gain, sensor.offset_k) = (1.02, -0.7);
    let junction = clean(&reference(sine(20.0, 5.0), with(|_| ())));
    let curved = with(|sensor| {
        gained(sensor);
        (sensor.curvature_per_k, sensor.curvature_about_c) = (-2e-4, 440.0);
    });
    for (got, t) in clean(&reference(sine(20.0, 5.0), curved)).readings_c[0].iter().zip(&junction.readings_c[0]) {
        assert_close("reading", *got, 1.02 * t - 0.7 - 2e-4 * (t - 440.0).powi(2), 1e-12 * MEAN_C);
    }
}

/// `20 |H| sin(ω(t − D) + φ + arg H)`. The rule's error is `20 [(h/τ)⁴ + (ωh)⁴]`, the cubic's `(ωh)⁴/384` of the swing;
/// rounding of 450 °C 1e-9 at most. The delays are none of whole steps or samples but the last.
#[test]
fn delayed_sine_has_the_closed_form() {
    let omega = TAU * 5.0;
    let tol = 20.0 * ((STEP_S / TAU_S).powi(4) + 2.0 * (omega * STEP_S).powi(4)) + 1e-9;
    assert!(tol < 1e-6 * 20.0, "a millionth of the swing is promised");
    let response = 20.0 * (Complex64::ONE + Complex64::I * omega * TAU_S).inv();
    for delay_s in [1e-5, 0.000_731, 0.003_013, 0.0347, 0.004] {
        let got = clean(&reference(sine(20.0, 5.0), with(|sensor| sensor.delay_s = delay_s)));
        for (t, y) in got.time_s.iter().zip(&got.readings_c[0]) {
            let want = MEAN_C + (response * Complex64::cis(omega * (t - delay_s) + 0.3)).im;
            assert_close("reading", *y, want, tol);
        }
    }
}

/// The reading of a sine that arrives `L/v̄` later. The cubic's error is `3 (ωh)⁴/128` of the swing with half a step `h`, less than the
/// rule's.
#[test]
fn gas_carried_by_a_steady_stream_comes_late_by_distance_over_velocity() {
    let omega = TAU * 5.0;
    let tol = 20.0 * ((STEP_S / TAU_S).powi(4) + 2.0 * (omega * STEP_S).powi(4)) + 1e-9;
    let response = 20.0 * (Complex64::ONE + Complex64::I * omega * TAU_S).inv();
    for downstream_m in [0.0005, 0.0101, 0.07] {
        let rig = reference(sine(20.0, 5.0), with(|_| ())).with_stream(Stream::new(2.0, 0.0, 1.0, 0.0));
        let mut sensors = rig.as_ref().expect("a stream").sensors().clone();
        sensors[0].downstream_m = downstream_m;
        let got = clean(&rig.and_then(|rig| rig.with_sensors(sensors)).expect("valid"));
        assert_eq!(got.velocity_m_per_s, Some(vec![2.0; 2500]));
        for (t, y) in got.time_s.iter().zip(&got.readings_c[0]) {
            let want = MEAN_C + (response * Complex64::cis(omega * (t - downstream_m / 2.0) + 0.3)).im;
            assert_close("reading", *y, want, tol);
        }
    }
}

/// With the power 1 the stream is a flow of the same depth, for one sensor alone: the same arithmetic.
#[test]
fn a_time_constant_goes_with_a_power_of_the_velocity() {
    let flow = Flow::Sine(FlowSine::new(0.3, 1.7, 0.4));
    let alike = clean(&reference(sine(20.0, 5.0), with(|_| ())).with_flow(flow).expect("valid"));
    let steady = reference(sine(20.0, 5.0), with(|_| ()));
    let rig = steady.clone().with_stream(Stream::new(12.0, 0.3, 1.7, 0.4)).expect("valid");
    let mut sensors = rig.sensors().clone();
    sensors[0].stream_exponent = 1.0;
    let got = clean(&rig.with_sensors(sensors).expect("valid"));
    assert_eq!(got.readings_c[0], alike.readings_c[0]);
    assert_eq!(got.readings_c[1], clean(&steady).readings_c[1]);
}

/// `y = 100 (1 − exp(−(t − D − Ts)/τ))` from the step on, in held gas too: the cubic's error is `(h/τ)⁴/384` of 100 K,
/// 4e-11, the rule's 1e-10. Before the run-in's start the sensor rests.
#[test]
fn delayed_step_response_is_exponential_and_rests_before() {
    let delay_s = 0.005_37;
    let sensor = with(|sensor| sensor.delay_s = delay_s);
    let mut record = Record::new(200, 0.002);
    record.settle_s = Some(0.0);
    let got = clean(&rig_with(record, step(0.0, 100.0, 200), sensor));
    for (t, y) in got.time_s.iter().zip(&got.readings_c[0]) {
        assert_close("reading", *y, -100.0 * (-(t - delay_s - 0.002).max(0.0) / TAU_S).exp_m1(), 1e-9);
    }
}

/// In steady gas the balance `x − T = k (T⁴ − W⁴)` holds: what is left of the start after forty time constants is 4e-18
/// of it, so rounding of fourth powers is all: `k T⁴` is 20 to 400 K.
#[test]
fn radiation_at_rest_balances_convection() {
    for (coefficient_per_k3, wall_c) in [(5e-11, 350.0), (5.4e-10, 538.4), (5e-10, 800.0)] {
        let sensor = with(|sensor| sensor.radiation = Some(Radiation::new(coefficient_per_k3, wall_c)));
        let mut record = Record::new(2, 0.002);
        record.settle_s = Some(40.0 * TAU_S);
        let got = clean(&rig_with(record, held(643.0, Signal::Sine(still())), sensor)).readings_c[0][1];
        let power = |c: f64| (c + ZERO_CELSIUS_K).powi(4);
        let loss_k = coefficient_per_k3 * (power(got) - power(wall_c));
        assert!(loss_k.abs() > 1.0, "an effect to speak of");
        assert_close("loss", 643.0 - got, loss_k, 1e-9);
    }
}

/// As good as a constant: its largest value over any record is 1e-12 K.
fn still() -> Tone {
    Tone { amplitude_k: 1e-12, frequency_hz: 1e-3, phase_rad: 0.0 }
}

/// About its rest `T` the sensor is linear, `H = 1/(1 + 4kT³ + iωτ)`, but for `6kT²` times the square of its swing;
/// that is smaller than the gas's.
#[test]
fn radiation_makes_a_small_swing_smaller_and_faster() {
    let (k, amplitude_k, omega) = (5.4e-10, 0.05, TAU * 5.0);
    let sensor = with(|sensor| sensor.radiation = Some(Radiation::new(k, 400.0)));
    let at_rest_c = clean(&reference(held(MEAN_C, Signal::Sine(still())), sensor.clone())).readings_c[0][0];
    let rest_k = at_rest_c + ZERO_CELSIUS_K;
    let response = amplitude_k * (1.0 + 4.0 * k * rest_k.powi(3) + Complex64::I * omega * TAU_S).inv();
    let got = clean(&reference(sine(amplitude_k, 5.0), sensor));
    let tol = 6.0 * k * rest_k.powi(2) * amplitude_k.powi(2) + 1e-9;
    assert!(tol < 1e-3 * response.norm());
    for (t, y) in got.time_s.iter().zip(&got.readings_c[0]) {
        assert_close("reading", *y, at_rest_c + (response * Complex64::cis(omega * t + 0.3)).im, tol);
    }
}

/// With exponent −1 a step from `T₀` to `x` (absolute) is logistic:
/// `T/(x − T) = T₀/(x − T₀) exp(x t/(τ R))`. The rule's error is of order `(h/τ)⁴` of 200 K: 3e-8.
#[test]
fn time_constant_in_inverse_proportion_to_temperature_makes_a_logistic_step() {
    let dependence = TemperatureDependence::new(-1.0, 426.85);
    let sensor = with(|sensor| sensor.temperature_dependence = Some(dependence));
    let got = clean(&rig_with(Record::new(200, 0.002), step(326.85, 526.85, 200), sensor));
    for (t, y) in got.time_s.iter().zip(&got.readings_c[0]).skip(1) {
        let odds = 600.0 / 200.0 * (800.0 * (t - 0.002) / (TAU_S * 700.0)).exp();
        assert_close("reading", *y, 800.0 * odds / (1.0 + odds) - ZERO_CELSIUS_K, 3e-8);
    }
}

/// With exponent −1 at a share `m` of the gas temperature, what a step from `T₀` to `x` (absolute) still lacks, `u = x − T`, is
/// logistic: `u/(x − (1 − m) u) = u₀/(x − (1 − m) u₀) exp(−x t/(τ R))`. The rule's error is of order `(h/τ)⁴` of 200 K: 3e-8.
#[test]
fn time_constant_in_inverse_proportion_to_film_temperature_makes_a_logistic_step() {
    let dependence = TemperatureDependence::of_film(-1.0, 426.85);
    let sensor = with(|sensor| sensor.temperature_dependence = Some(dependence));
    let got = clean(&rig_with(Record::new(200, 0.002), step(326.85, 526.85, 200), sensor));
    for (t, y) in got.time_s.iter().zip(&got.readings_c[0]).skip(1) {
        let odds = 200.0 / 700.0 * (-800.0 * (t - 0.002) / (TAU_S * 700.0)).exp();
        let lacking_k = 800.0 * odds / (1.0 + 0.5 * odds);
        assert_close("reading", *y, 526.85 - lacking_k, 3e-8);
    }
}

/// The step response with `∫ dt/τ(t)` in place of `t/τ`:
/// `∫ dθ/(1 + d sin θ) = 2/√(1 − d²) arctan((tan(θ/2) + d)/√(1 − d²))`, on one branch here. The rule's error is of order
/// `(h/τ)⁴` of 100 K with the shortest time constant, 1e-7 at most.
#[test]
fn sinusoidal_flow_modulates_both_time_constants() {
    let (depth, period_s, phase_rad) = (0.4, 1.2, -0.6);
    let rig = rig_with(Record::new(200, 0.002), step(0.0, 100.0, 200), Sensor::new("T1", TAU_S))
        .with_flow(Flow::Sine(FlowSine::new(depth, period_s, phase_rad)))
        .expect("valid flow");
    let got = clean(&rig);
    let root = f64::sqrt(1.0 - depth * depth);
    let integral = |t: f64| {
        let half_angle = 0.5 * (TAU * t / period_s + phase_rad);
        assert!(half_angle.abs() < FRAC_PI_2, "one branch");
        period_s / TAU * 2.0 / root * ((half_angle.tan() + depth) / root).atan()
    };
    for (y, tau_s) in got.readings_c.iter().zip([TAU_S, 0.1168]) {
        for (t, y) in got.time_s.iter().zip(y).skip(1) {
            let elapsed = (integral(*t) - integral(0.002)) / tau_s;
            assert_close("reading", *y, -100.0 * (-elapsed).exp_m1(), 1e-7);
        }
    }
}

/// The same for a step of the flow. Over the whole change `∫ dt/m = over/√factor`, since
/// `∫₀^π dθ/(a − b cos θ) = π/√(a² − b²)` with `a = (f + 1)/2`, `b = (f − 1)/2`.
#[test]
fn stepping_flow_changes_both_time_constants_once() {
    for factor in [0.5, 2.5] {
        let (at_s, over_s): (f64, f64) = (0.05, 0.1);
        let rig = rig_with(Record::new(200, 0.002), step(0.0, 100.0, 200), Sensor::new("T1", 0.1))
            .with_flow(Flow::Step(FlowStep::new(factor, at_s, over_s)))
            .expect("valid flow");
        let got = clean(&rig);
        for (y, tau_s) in got.readings_c.iter().zip([0.1, 0.1168]) {
            for (t, y) in got.time_s.iter().zip(y).skip(1) {
                let elapsed_s = if *t <= at_s {
                    t - 0.002
                } else if *t >= at_s + over_s {
                    at_s - 0.002 + over_s / factor.sqrt() + (t - at_s - over_s) / factor
                } else {
                    continue;
                };
                assert_close("reading", *y, -100.0 * (-elapsed_s / tau_s).exp_m1(), 1e-8);
            }
        }
    }
}

/// Rounding of 450 °C is all that differs, here and in the next two.
#[test]
fn drift_is_linear_in_time_and_nothing_in_the_middle() {
    let [plain, drifting] =
        [0.0, -0.25].map(|rate| clean(&reference(sine(20.0, 5.0), with(|sensor| sensor.drift_k_per_s = rate))));
    for (k, t) in plain.time_s.iter().enumerate() {
        let got_k = drifting.readings_c[0][k] - plain.readings_c[0][k];
        assert_close("drift", got_k, -0.25 * (t - 0.5 * 2499.0 * 0.002), 1e-12 * MEAN_C);
    }
    assert_eq!(drifting.readings_c[1], plain.readings_c[1]);
}

#[test]
fn mains_adds_its_sines_undelayed() {
    let late = |sensor: &mut Sensor| sensor.delay_s = 0.003;
    let plain = clean(&reference(sine(20.0, 5.0), with(late)));
    let humming = with(|sensor| {
        late(sensor);
        sensor.mains = vec![Mains::new(50.0, 0.5, 0.2), Mains::new(150.0, 0.1, -1.0)];
    });
    let humming = clean(&reference(sine(20.0, 5.0), humming));
    for (k, t) in plain.time_s.iter().enumerate() {
        let want_k = 0.5 * (TAU * 50.0 * t + 0.2).sin() + 0.1 * (TAU * 150.0 * t - 1.0).sin();
        assert_close("mains", humming.readings_c[0][k] - plain.readings_c[0][k], want_k, 1e-12 * MEAN_C);
    }
    assert_eq!(humming.readings_c[1], plain.readings_c[1]);
}

#[test]
fn crosstalk_adds_a_part_of_the_other_channel_about_its_mean() {
    let rig = |parts: [f64; 2]| {
        let mut sensors = [with(|_| ()), Sensor::new("T2", 0.1168)];
        for (sensor, part) in sensors.iter_mut().zip(parts) {
            sensor.crosstalk = part;
        }
        clean(&Rig::new(1, Record::new(2500, 0.002), sine(20.0, 5.0), sensors).expect("valid rig"))
    };
    let plain = rig([0.0; 2]).readings_c;
    let mixed = rig([0.05, -0.02]).readings_c;
    let mean_c = plain.each_ref().map(|y| y.iter().sum::<f64>() / 2500.0);
    for k in 0..2500 {
        let about_mean_k: [f64; 2] = std::array::from_fn(|i| plain[i][k] - mean_c[i]);
        assert_close("first", mixed[0][k] - plain[0][k], 0.05 * about_mean_k[1], 1e-12 * MEAN_C);
        assert_close("second", mixed[1][k] - plain[1][k], -0.02 * about_mean_k[0], 1e-12 * MEAN_C);
    }
}

/// The other gas goes through a linear sensor as the gas does, so the readings' difference is the noise `m` through the
/// pole: variance `s² θ/(θ + τ)`, with a deviation over the time T of at most `2 √((τ + θ)/T)` of itself; the
/// integration is off by h/θ/10, a thousandth. Independent of the gas: the correlation of the difference with a signal
/// has standard error `√(2 (τ + θ)/T)` or less. Four of each.
#[test]
fn mismatch_is_low_pass_noise_before_one_sensor() {
    let (n, corner_hz) = (50_000, 10.0);
    let mut record = Record::new(n, 0.005);
    (record.oversampling, record.settle_s) = (10, Some(3.0));
    let theta_s = 1.0 / (TAU * corner_hz);
    let plain = rig_with(record, sine(20.0, 1.0), with(|_| ()));
    let want = clean(&plain);
    for (channel, index, tau_s) in [(None, 1, 0.1168), (Some("T1"), 0, TAU_S), (Some("T2"), 1, 0.1168)] {
        let mut mismatch = Mismatch::new(0.8, corner_hz);
        mismatch.channel = channel.map(str::to_owned);
        let got = clean(&plain.clone().with_mismatch(mismatch).expect("valid mismatch"));
        assert_eq!(got.gas_c, want.gas_c, "the truth is the gas");
        assert_eq!(got.readings_c[1 - index], want.readings_c[1 - index]);
        let added_k: Vec<f64> = got.readings_c[index].iter().zip(&want.readings_c[index]).map(|(a, b)| a - b).collect();
        let memory = ((tau_s + theta_s) / (n as f64 * 0.005)).sqrt();
        let variance = 0.64 * theta_s / (theta_s + tau_s);
        assert_close("variance", mean_square(&added_k), variance, variance * (8.0 * memory + 0.002));
        let product: f64 = added_k.iter().zip(&want.gas_c).map(|(m, x)| m * (x - MEAN_C)).sum();
        let correlation = product / n as f64 / (variance.sqrt() * 20.0 / 2.0_f64.sqrt());
        assert_close("correlation with the gas", correlation, 0.0, 4.0 * 2.0_f64.sqrt() * memory);
    }
    let unknown = Mismatch::new(0.8, corner_hz);
    let unknown = plain.with_mismatch({
        let mut named = unknown;
        named.channel = Some("T3".into());
        named
    });
    assert!(matches!(unknown, Err(SignalError::UnknownChannel { got, .. }) if got == "T3"));
}

/// A sine swings past the play, of which it takes up half a width at each turn: rising it is the larger of the lower
/// plateau and `y − w/2`, falling the smaller of the upper one and `y + w/2`. An extreme is missed by `A (ωh)²/8`.
#[test]
fn hysteresis_cuts_the_turns_and_lags_by_half_its_width() {
    let (width_k, omega) = (3.0, TAU * 5.0);
    let got = clean(&reference(sine(20.0, 5.0), with(|sensor| sensor.hysteresis = Some(Hysteresis::new(width_k)))));
    let response = 20.0 * (Complex64::ONE + Complex64::I * omega * TAU_S).inv();
    let top_k = response.norm() - 0.5 * width_k;
    let tol = 20.0 * ((STEP_S / TAU_S).powi(4) + (omega * STEP_S).powi(2) / 8.0) + 1e-9;
    for (t, y) in got.time_s.iter().zip(&got.readings_c[0]) {
        let turning = response * Complex64::cis(omega * t + 0.3);
        let rising = turning.re > 0.0;
        let want_k =
            if rising { (turning.im - 0.5 * width_k).max(-top_k) } else { (turning.im + 0.5 * width_k).min(top_k) };
        assert_close("reading", *y, MEAN_C + want_k, tol);
    }
}

/// Two states with rates `r` and `1/d`: open for the part `p = r d/(1 + r d)` of the time, with a deviation of
/// `√(2 p (1 − p) θ/T)`, `1/θ = r + 1/d`; one episode in each `1/r + d` on average, `T σ²/μ³` its variance. Of the
/// episodes `Ts/(2d)` fall between two samples, of the gaps `r Ts/2`: they are not seen. Four standard errors.
#[test]
fn contact_opens_as_often_and_as_long_as_said() {
    let (n, rate_hz, mean_duration_s) = (200_000, 5.0, 0.05);
    for towards_c in [None, Some(25.0)] {
        let mut contact = IntermittentContact::new(rate_hz, mean_duration_s, 0.06);
        contact.towards_c = towards_c;
        let open = with(|sensor| sensor.intermittent_contact = Some(contact));
        let [plain, got] =
            [with(|_| ()), open].map(|sensor| clean(&rig_with(coarse(n, 0.002), sine(20.0, 1.0), sensor)));
        assert_eq!(plain.readings_c[1], got.readings_c[1]);
        let reference_c = towards_c.unwrap_or(plain.readings_c[0].iter().sum::<f64>() / n as f64);
        let open: Vec<bool> = plain.readings_c[0].iter().zip(&got.readings_c[0]).map(|(a, b)| a != b).collect();
        for k in (0..n).filter(|&k| open[k]) {
            let y = plain.readings_c[0][k];
            assert_close("reading", got.readings_c[0][k], y - 0.06 * (y - reference_c), 1e-12 * MEAN_C);
        }
        let time_s = n as f64 * 0.002;
        let part = open.iter().filter(|&&open| open).count() as f64 / n as f64;
        let (want, memory_s) = (0.2, 0.04); // r d/(1 + r d) and 1/(r + 1/d)
        assert_close("part of time", part, want, 4.0 * (2.0 * want * (1.0 - want) * memory_s / time_s).sqrt());
        let episodes = open.windows(2).filter(|w| !w[0] && w[1]).count() as f64;
        let (mean_s, variance) = (0.25_f64, 0.2_f64.powi(2) + 0.05_f64.powi(2));
        let unseen = 0.002 / (2.0 * mean_duration_s) + 0.002 * rate_hz / 2.0;
        let spread = 4.0 * (time_s * variance / mean_s.powi(3)).sqrt();
        assert_close("episodes", episodes, time_s / mean_s, spread + unseen * time_s / mean_s);
    }
}

#[test]
fn slipped_clock_is_a_delay_from_its_moment_on() {
    let [plain, late, slipped] = [
        with(|_| ()),
        with(|sensor| sensor.delay_s = 0.0067),
        with(|sensor| sensor.clock_slip = Some(ClockSlip::new(2.0, 0.0067))),
    ]
    .map(|sensor| clean(&reference(sine(20.0, 5.0), sensor)).readings_c[0].clone());
    assert_eq!(slipped[..1000], plain[..1000]);
    assert_eq!(slipped[1000..], late[1000..]);
    assert_ne!(slipped[1000], plain[1000]);
}

#[test]
fn replaced_sensor_hands_over_to_one_that_has_been_there_all_along() {
    let [plain, other, replaced] = [
        with(|_| ()),
        with(|sensor| sensor.time_constant_s = 0.04),
        with(|sensor| sensor.replaced = Some(Replaced::new(2.0, 0.04))),
    ]
    .map(|sensor| clean(&reference(sine(20.0, 5.0), sensor)).readings_c[0].clone());
    assert_eq!(replaced[..1000], plain[..1000]);
    assert_eq!(replaced[1000..], other[1000..]);
    assert_ne!(replaced[1000], plain[1000]);
}

fn noisy(n: usize, change: impl FnOnce(&mut Sensor)) -> Vec<f64> {
    rig_with(coarse(n, 0.002), sine(20.0, 1.0), with(change)).simulate().expect("simulates").t1_c
}

/// As for the noise itself (Bartlett): over n points the mean square of AR(1) has standard error
/// `s² √(2 (1 + ρ²)/((1 − ρ²) n))`, the lag-one autocorrelation `√((1 − ρ²)/n)`. Four of each. The white noise beside it
/// is the same to rounding of 450 °C.
#[test]
fn coloured_noise_comes_on_top_of_the_same_white_noise() {
    let (n, correlation_time_s) = (200_000, 0.01);
    let rho = f64::exp(-0.002 / correlation_time_s);
    let white = noisy(n, |sensor| sensor.noise = Some(Noise::white(0.5)));
    let both = noisy(n, |sensor| {
        sensor.noise = Some(Noise::white(0.5));
        sensor.coloured_noise = Some(ColouredNoise::new(0.8, correlation_time_s));
    });
    let coloured_k: Vec<f64> = both.iter().zip(&white).map(|(a, b)| a - b).collect();
    let variance = mean_square(&coloured_k);
    let rel = (2.0 * (1.0 + rho * rho) / ((1.0 - rho * rho) * n as f64)).sqrt();
    assert_close("variance", variance, 0.64, 4.0 * 0.64 * rel);
    let tol = 4.0 * ((1.0 - rho * rho) / n as f64).sqrt();
    assert_close("lag-one correlation", lagged(&coloured_k, 1) / variance, rho, tol);
}

/// Of n samples `p n ± √(p (1 − p) n)` are spikes, half of them up. Heights are uniform from half the size to one and a
/// half: mean 1, variance 1/12 of it. Four standard errors of each.
#[test]
fn spikes_are_as_many_and_as_high_as_said_and_leave_the_rest_alone() {
    let (n, rate, size_k) = (200_000, 0.005, 8.0);
    let white = noisy(n, |sensor| sensor.noise = Some(Noise::white(0.5)));
    let spiky = noisy(n, |sensor| {
        sensor.noise = Some(Noise::white(0.5));
        sensor.spikes = Some(Spikes::new(rate, size_k));
    });
    let heights_k: Vec<f64> = spiky.iter().zip(&white).filter(|(a, b)| a != b).map(|(a, b)| a - b).collect();
    let count = heights_k.len() as f64;
    assert_close("spikes", count, rate * n as f64, 4.0 * (rate * n as f64).sqrt());
    assert!(heights_k.iter().all(|height_k| (0.4999 * size_k..=1.5001 * size_k).contains(&height_k.abs())));
    let up = heights_k.iter().filter(|height_k| **height_k > 0.0).count() as f64;
    assert_close("upward", up / count, 0.5, 4.0 * 0.5 / count.sqrt());
    let mean_k = heights_k.iter().map(|height_k| height_k.abs()).sum::<f64>() / count;
    assert_close("mean height", mean_k, size_k, 4.0 * size_k / (12.0 * count).sqrt());
}

/// Effects of no size take their own way through the code and change no byte.
#[test]
fn effects_of_no_size_change_nothing() {
    let plain = reference(sine(20.0, 5.0), with(|sensor| sensor.noise = Some(Noise::white(0.5))));
    let nothing = with(|sensor| {
        sensor.noise = Some(Noise::white(0.5));
        sensor.radiation = Some(Radiation::new(0.0, 20.0));
        sensor.temperature_dependence = Some(TemperatureDependence::new(0.0, 20.0));
        sensor.hysteresis = Some(Hysteresis::new(0.0));
        sensor.clock_slip = Some(ClockSlip::new(2.0, 0.0));
        sensor.replaced = Some(Replaced::new(2.0, TAU_S));
        sensor.intermittent_contact = Some(IntermittentContact::new(0.0, 0.1, 0.5));
        sensor.mains = vec![Mains::new(50.0, 0.0, 0.0)];
        sensor.coloured_noise = Some(ColouredNoise::new(0.0, 0.1));
        sensor.spikes = Some(Spikes::new(0.0, 8.0));
    });
    let nothing = reference(sine(20.0, 5.0), nothing).with_flow(Flow::Sine(FlowSine::new(0.0, 1.0, 0.0)));
    assert_eq!(nothing.expect("valid rig").simulate(), plain.simulate());
}

/// Trials differ by their noise, coloured noise and spikes; contact and mismatch belong to the gas's trial.
#[test]
fn trials_of_one_gas_share_contact_and_mismatch() {
    let sensor = with(|sensor| sensor.intermittent_contact = Some(IntermittentContact::new(5.0, 0.05, 0.06)));
    let plain = rig(2500, 0.002, sine(20.0, 5.0));
    let rig = rig_with(Record::new(2500, 0.002), sine(20.0, 5.0), sensor)
        .with_mismatch(Mismatch::new(0.5, 10.0))
        .expect("valid rig");
    assert_eq!(rig.clean(0), rig.clean(3));
    assert_ne!(clean(&rig).readings_c[0], clean(&plain).readings_c[0]);
    let mut gas = sine(20.0, 5.0);
    gas.per_trial = true;
    let own = Rig::new(1, rig.record().clone(), gas, rig.sensors().clone()).expect("valid rig");
    let own = own.with_mismatch(Mismatch::new(0.5, 10.0)).expect("valid rig");
    let [zero, three] = [0, 3].map(|trial| own.clean(trial).expect("simulates").readings_c);
    assert!(zero[0] != three[0] && zero[1] != three[1]);
}

/// What the step must follow is checked at the mean of the gas. A swing to 20 000 °C makes the sensor thousands of times
/// faster than there.
#[test]
fn equations_that_diverge_are_an_error_and_not_a_record() {
    let sensor = with(|sensor| sensor.radiation = Some(Radiation::new(1e-10, 400.0)));
    let rig = rig_with(Record::new(500, 0.002), sine(20_000.0, 5.0), sensor);
    assert!(matches!(rig.simulate(), Err(SignalError::Diverged { channel, .. }) if channel == "T1"));
}
