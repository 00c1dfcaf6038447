//! Sensors in a stream whose velocity is recorded: what depends on it is found in its sensor, and nothing where nothing does.

use crate::common::{read, record, recovers};
use twinlag::diagnosis::{Identifier, Verdict};
use twinlag::record::Record;
use twinlag::signal::Rig;
use twinlag::{
    DiagnoseOptions, Diagnosis, Error, Options, Setting, Status, characterise_with, diagnose, diagnose_records,
};

const TRUTH_S: [f64; 2] = [0.03, 0.11];

/// 12 s of turbulence in a stream of `mean_m_s` that changes by 40 %, with `second` in the second sensor.
fn in_stream(seed: u64, mean_m_s: f64, second: &str) -> Record {
    let [first_s, second_s] = TRUTH_S;
    let text = format!(
        "seed = {seed}\n[record]\nsamples = 6000\nsample_period_s = 0.002\n\
         [gas]\nkind = \"turbulence\"\nmean_c = 450.0\nstd_k = 20.0\ncorner_hz = 1.0\ncutoff_hz = 60.0\n\
         [stream]\nmean_m_per_s = {mean_m_s}\ndepth = 0.4\nperiod_s = 5.0\n\
         [[sensors]]\nchannel = \"T1\"\ntime_constant_s = {first_s}\nnoise = {{ std_k = 0.1 }}\n\
         [[sensors]]\nchannel = \"T2\"\ntime_constant_s = {second_s}\nnoise = {{ std_k = 0.1 }}\n{second}\n"
    );
    let rig: Rig = toml::from_str(&text).expect("a rig");
    let (record, stream) = (read(&rig), *rig.stream().expect("it has one"));
    let velocity_m_s = record.time_s.iter().map(|t| stream.velocity_m_per_s(*t)).collect();
    record.with_flow(velocity_m_s).expect("positive")
}

/// The diagnosis of a stream of 12 m/s.
fn diagnosed(second: &str) -> Diagnosis {
    diagnose(&in_stream(5, 12.0, second), &DiagnoseOptions::default()).expect("a sound question")
}

/// The only effect named, and its number `name` with its standard error.
fn only(answer: &Diagnosis, effect: Identifier, name: &str) -> [f64; 2] {
    assert_eq!(answer.verdict, Verdict::Explained, "{:?}", answer.effects);
    let [found] = &answer.effects[..] else { panic!("one effect: {:?}", answer.effects) };
    assert_eq!((found.effect, found.channel.as_deref()), (effect, Some("T2")));
    let number = found.parameters.iter().find(|p| p.name == name).expect("a parameter");
    [number.value, number.standard_error].map(|value| value.expect("given"))
}

/// The gas is carried over 60 mm, in 8.3 ms at most. Taken for a delay of the reading, it left the second time constant wrong by 0.3 %, now
/// up, now down, and coloured noise was found. Four standard errors each.
#[test]
fn a_distance_along_the_stream_delays_the_gas_and_not_the_reading() {
    let answer = diagnosed("downstream_m = 0.06");
    let [delay_s, error_s] = only(&answer, Identifier::SEPARATION, "delay_at_mean_flow");
    let of_velocity = |k: u32| (1.0 + 0.4 * (std::f64::consts::TAU * f64::from(k) * 0.002 / 5.0).sin()).ln();
    let mean_m_s = 12.0 * ((0..6000).map(of_velocity).sum::<f64>() / 6000.0).exp();
    let want_s = 0.06 / mean_m_s;
    assert!((delay_s - want_s).abs() < 4.0 * error_s, "{delay_s} ± {error_s} s, want {want_s} s");
    recovers(&answer.last, TRUTH_S, 4.0);
    // In a slower stream the same distance takes longer. Taken for the delay at its own mean, it left the time constants wrong.
    let slower = in_stream(6, 8.0, "downstream_m = 0.06");
    let other = characterise_with(&slower, &answer.model(), &Options::default()).expect("a record");
    assert_eq!(other.status, Status::Ok);
    recovers(&other, TRUTH_S, 4.0);
}

#[test]
fn a_time_constant_that_goes_with_the_velocity_is_found_in_its_sensor() {
    let answer = diagnosed("stream_exponent = -0.5");
    let [exponent, error] = only(&answer, Identifier::VARYING_TIME_CONSTANT, "exponent");
    assert!((exponent + 0.5).abs() < 4.0 * error && error < 0.01, "{exponent} ± {error}");
}

#[test]
fn a_stream_that_changes_nothing_is_no_effect() {
    let answer = diagnosed("");
    assert_eq!((answer.verdict, answer.effects.len()), (Verdict::Adequate, 0), "{:?}", answer.effects);
}

/// A record of time constants that go with the root of the inverse of a steady flow, and are those of [`TRUTH_S`] at 12 m/s.
fn at(seed: u64, velocity_m_s: f64) -> Record {
    with_gain(1.0, seed, velocity_m_s)
}

/// A record as of [`at`], with a gain of the second channel about the mean of the gas, 300 °C.
fn with_gain(gain: f64, seed: u64, velocity_m_s: f64) -> Record {
    of_samples(SAMPLES, gain, seed, velocity_m_s)
}

fn of_samples(samples: usize, gain: f64, seed: u64, velocity_m_s: f64) -> Record {
    let gas = "kind = \"turbulence\"\nstd_k = 15.0\ncorner_hz = 3.0\ncutoff_hz = 60.0";
    let factor = (velocity_m_s / 12.0).powf(-0.5);
    let sensor = |tau_s: f64, gain: f64| {
        let offset_k = 300.0 * (1.0 - gain);
        format!("time_constant_s = {}\nnoise = {{ std_k = 0.1 }}\ngain = {gain}\noffset_k = {offset_k}", factor * tau_s)
    };
    let sensors = [sensor(TRUTH_S[0], 1.0), sensor(TRUTH_S[1], gain)];
    record(seed, samples, 0.002, gas, [&sensors[0], &sensors[1]])
}

/// As [`at`], with the flow beside the readings.
fn in_steady_flow(seed: u64, velocity_m_s: f64) -> Record {
    at(seed, velocity_m_s).with_flow(vec![velocity_m_s; SAMPLES]).expect("positive")
}

/// As [`in_steady_flow`], as an anemometer reads it, up and down by a thousandth; and shorter, since each row has other time constants.
fn in_flow_that_is_measured(seed: u64, velocity_m_s: f64) -> Record {
    const FEWER_SAMPLES: usize = 1000;
    let of_row = |k: usize| velocity_m_s * (1.0 + 1e-3 * (0.7 * (k * k % 97) as f64).sin());
    let flow_m_s = (0..FEWER_SAMPLES).map(of_row).collect();
    of_samples(FEWER_SAMPLES, 1.0, seed, velocity_m_s).with_flow(flow_m_s).expect("positive")
}

const SAMPLES: usize = 3000;

/// Failed: a steady flow was refused beside others, and a model did not say at which flow its numbers hold. Four standard errors each.
#[test]
fn records_in_steady_flows_share_an_exponent_and_the_flow_of_their_time_constants() {
    const VELOCITIES_M_S: [f64; 3] = [6.0, 12.0, 20.0];
    let records = [0, 1, 2].map(|i| in_steady_flow(1 + i as u64, VELOCITIES_M_S[i]));
    let answer = diagnose_records(&records, &DiagnoseOptions::default()).expect("three records of one rig");
    assert_eq!(answer.verdict, Verdict::Explained, "{:?}", answer.effects);
    let [found] = &answer.effects[..] else { panic!("one effect: {:?}", answer.effects) };
    assert_eq!((found.effect, found.channel.as_deref()), (Identifier::VARYING_TIME_CONSTANT, None));
    let [exponent, mean] =
        ["exponent", "mean_flow"].map(|name| found.parameters.iter().find(|p| p.name == name).expect(name));
    let [value, error] = [exponent.value, exponent.standard_error].map(|value| value.expect("given"));
    assert!((value + 0.5).abs() < 4.0 * error && error < 0.05, "{value} ± {error}");
    // To rounding of some thousand logarithms.
    let mean_m_s = VELOCITIES_M_S.iter().product::<f64>().cbrt();
    assert!((mean.value.expect("measured") / mean_m_s - 1.0).abs() < 1e-12, "{mean:?}");
    let at_mean_s = TRUTH_S.map(|tau_s| tau_s * (mean_m_s / 12.0).powf(-0.5));
    recovers(&answer.last, at_mean_s, 4.0);
    each_recovers(&answer, at_mean_s);
    // Another record in another steady flow, with that model: at the flow of the model.
    let other = characterise_with(&in_steady_flow(4, 9.0), &answer.model(), &Options::default()).expect("a record");
    recovers(&other, at_mean_s, 4.0);
    assert!(
        other.warnings.iter().any(|w| w.contains("mean flow of the model, 11.29, not at that of this record, 9:")),
        "{:?}",
        other.warnings
    );
    // A speed of the sensors is no flow.
    let moving = at(5, 9.0);
    let position_m: Vec<f64> = moving.time_s.iter().map(|t| 9.0 * t).collect();
    let moving = moving.with_position(&position_m).expect("it changes");
    let error = characterise_with(&moving, &answer.model(), &Options::default()).expect_err("a model of a flow");
    assert_eq!(error.settings(), [Setting::Flow], "{error}");
}

/// Each record by itself, with the exponent of all: in its steady flow it does not show one. Four standard errors, of 1 % at most.
fn each_recovers(answer: &Diagnosis, truth_s: [f64; 2]) {
    for record in &answer.records {
        for (own, truth_s) in record.time_constants.iter().zip(truth_s) {
            let own = own.expect("the record determines it");
            assert!((own.value_s - truth_s).abs() < 4.0 * own.standard_error_s, "{own:?}, {truth_s} s");
            assert!(own.standard_error_s < 0.01 * truth_s, "{own:?}");
        }
    }
}

/// Failed: a record that knows next to nothing of the exponent had to find it, and its time constants were not determined.
#[test]
fn a_record_takes_the_exponent_of_all_where_its_flow_hardly_changes() {
    const VELOCITIES_M_S: [f64; 3] = [6.0, 12.0, 20.0];
    let records = [0, 1, 2].map(|i| in_flow_that_is_measured(1 + i as u64, VELOCITIES_M_S[i]));
    let answer = diagnose_records(&records, &DiagnoseOptions::default()).expect("three records of one rig");
    assert_eq!(answer.verdict, Verdict::Explained, "{:?}", answer.effects);
    let mean_m_s = VELOCITIES_M_S.iter().product::<f64>().cbrt();
    each_recovers(&answer, TRUTH_S.map(|tau_s| tau_s * (mean_m_s / 12.0).powf(-0.5)));
}

/// Failed: a mismatch of the gas that was found first stood for both, and no number was given. Four standard errors.
#[test]
fn a_gain_beside_the_flow_is_found_where_a_noise_that_is_found_first_does_not_hold() {
    let records = [6.0, 12.0, 20.0].map(|velocity_m_s: f64| {
        let record = with_gain(1.02, velocity_m_s as u64, velocity_m_s);
        record.with_flow(vec![velocity_m_s; SAMPLES]).expect("positive")
    });
    let answer = diagnose_records(&records, &DiagnoseOptions::default()).expect("three records of one rig");
    assert_eq!(answer.verdict, Verdict::Explained, "{:?}", answer.effects);
    let mut effects = answer.effects.iter();
    assert!(effects.any(|f| f.effect == Identifier::CALIBRATION || f.alternatives.contains(&Identifier::CALIBRATION)));
    let mut numbers = answer.effects.iter().flat_map(|found| &found.parameters);
    let exponent = numbers.find(|number| number.name == "exponent").expect("of the flow");
    let [value, error] = [exponent.value, exponent.standard_error].map(|value| value.expect("given"));
    assert!((value + 0.5).abs() < 4.0 * error && error < 0.05, "{value} ± {error}");
}

/// Where one is left out, the other says nothing of the flow.
#[test]
fn two_records_in_steady_flows_are_one_too_few() {
    let records = [in_steady_flow(1, 6.0), in_steady_flow(2, 20.0)];
    let answer = diagnose_records(&records, &DiagnoseOptions::default()).expect("two records of one rig");
    assert_eq!(
        (answer.verdict, answer.unexplained.is_none()),
        (Verdict::PartlyExplained, true),
        "{:?}",
        answer.effects
    );
    assert!(answer.last.sensors.iter().all(|sensor| sensor.time_constant_s.is_none()));
    assert!(answer.remarks.iter().any(|remark| remark.contains("three or more")), "{:?}", answer.remarks);
}

#[test]
fn a_single_record_in_steady_flow_says_nothing_of_the_flow() {
    let error = diagnose(&in_steady_flow(1, 6.0), &DiagnoseOptions::default()).expect_err("the flow never changes");
    assert!(matches!(error, Error::SteadyFlow { value: 6.0, .. }), "{error}");
    assert_eq!(error.settings(), [Setting::Flow]);
    assert!(error.to_string().contains("three records in different flows"), "{error}");
}
