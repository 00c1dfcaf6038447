//! Rig files: what is read, what is written, what is refused.

use twinlag_signal::{Flow, FlowStep, Hold, Rig, Series, Signal, Stream};

const RIGS: [(&str, &str); 9] = [
    ("sine", include_str!("../rigs/sine.toml")),
    ("multi-tone", include_str!("../rigs/multi-tone.toml")),
    ("engine", include_str!("../rigs/engine.toml")),
    ("turbulence", include_str!("../rigs/turbulence.toml")),
    ("plunge", include_str!("../rigs/plunge.toml")),
    ("broadband", include_str!("../rigs/broadband.toml")),
    ("series", include_str!("../rigs/series.toml")),
    ("everything", include_str!("../rigs/everything.toml")),
    ("effects", include_str!("../rigs/effects.toml")),
];

fn read(text: &str) -> Result<Rig, toml::de::Error> {
    toml::from_str(text)
}

#[test]
fn every_kind_simulates() {
    for (name, text) in RIGS {
        let rig = read(text).unwrap_or_else(|error| panic!("{name}: {error}"));
        let rig = rig.with_base_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/rigs"));
        let record = rig.simulate().unwrap_or_else(|error| panic!("{name}: {error}"));
        for column in [&record.time_s, &record.t1_c, &record.t2_c, &record.gas_c] {
            assert_eq!(column.len(), 2500, "{name}");
            assert!(column.iter().all(|x| x.is_finite()), "{name}");
        }
        assert_eq!(record.channels, ["T1", "T2"]);
    }
}

#[test]
fn rigs_survive_toml_and_json() {
    for (name, text) in RIGS {
        let rig = read(text).unwrap_or_else(|error| panic!("{name}: {error}"));
        let again = toml::to_string(&rig).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(read(&again).unwrap_or_else(|error| panic!("{name}: {error}\n{again}")), rig);
        let again = serde_json::to_string(&rig).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(serde_json::from_str::<Rig>(&again).unwrap_or_else(|error| panic!("{name}: {error}")), rig);
    }
}

#[test]
fn inline_series_survives_toml() {
    let text = RIGS[6].1.replace("path = \"gas.csv\"", "period_s = 2.5\nvalues_c = [1.0, 2.5, 3]");
    let rig = read(&text).unwrap();
    let want = Series::Inline { values_c: vec![1.0, 2.5, 3.0], period_s: 2.5 };
    assert_eq!(rig.gas().signal, Signal::Series(want));
    assert_eq!(read(&toml::to_string(&rig).unwrap()).unwrap(), rig);
}

#[test]
fn what_is_left_out_has_its_documented_default() {
    let rig = read(RIGS[0].1).unwrap();
    assert_eq!((rig.record().oversampling, rig.record().settle_s), (24, None));
    assert_eq!((rig.gas().hold, rig.gas().per_trial), (Hold::Continuous, false));
    let sensor = &rig.sensors()[0];
    assert_eq!((sensor.gain, sensor.offset_k), (1.0, 0.0));
    assert_eq!((sensor.second_time_constant_s, sensor.slow_mode, sensor.adc), (None, None, None));
    assert_eq!(sensor.noise.map(|noise| noise.ar1), Some(0.0));
}

/// In the file `rig`, `from` replaced by `to` is refused with a message that holds `wanted`.
fn assert_refused(rig: &str, from: &str, to: &str, wanted: &str) {
    let (_, text) = RIGS.iter().find(|(name, _)| *name == rig).expect("a rig of that name");
    assert!(text.contains(from), "{rig} has no {from:?}");
    let message = read(&text.replacen(from, to, 1)).expect_err(to).to_string();
    assert!(message.contains(wanted), "{rig}: {from:?} -> {to:?}\ngot  {message}\nwant {wanted}");
}

#[test]
fn invalid_numbers_are_refused_with_the_name_of_their_field() {
    let all = "everything";
    for (rig, from, to, wanted) in [
        (all, "samples = 2500", "samples = 1", "record.samples must be at least 2"),
        (all, "sample_period_s = 0.002", "sample_period_s = 0.0", "record.sample_period_s must be finite and positive"),
        (all, "oversampling = 32", "oversampling = 0", "record.oversampling must be at least 1"),
        (all, "settle_s = 1.5", "settle_s = -1.5", "record.settle_s must be finite and not negative"),
        (all, "settle_s = 1.5", "settle_s = inf", "record.settle_s"),
        (all, "samples = 2500", "samples = 2000000000", "integration steps are more than"),
        (all, "settle_s = 1.5", "settle_s = 1e300", "record.settle_s"),
        (all, "mean_c = 450", "mean_c = nan", "gas.mean_c must be finite"),
        (
            all,
            "time_constant_s = 0.0238",
            "time_constant_s = -1.0",
            "sensors[0].time_constant_s must be finite and positive",
        ),
        (all, "time_constant_s = 0.1168", "time_constant_s = inf", "sensors[1].time_constant_s"),
        (all, "gain = 1.02", "gain = 0.0", "sensors[0].gain must be finite and positive"),
        (all, "offset_k = -0.7", "offset_k = nan", "sensors[0].offset_k must be finite"),
        (all, "second_time_constant_s = 0.005", "second_time_constant_s = 0.0", "sensors[0].second_time_constant_s"),
        (all, "fraction = 0.1", "fraction = 1.1", "sensors[0].slow_mode.fraction must lie between 0 and 1, got 1.1"),
        (all, "fraction = 0.1", "fraction = nan", "sensors[0].slow_mode.fraction"),
        (all, "time_constant_s = 0.5 }", "time_constant_s = 0.0 }", "sensors[0].slow_mode.time_constant_s"),
        (all, "std_k = 0.5", "std_k = -0.5", "sensors[0].noise.std_k must be finite and not negative"),
        (all, "ar1 = 0.4", "ar1 = 1.0", "sensors[0].noise.ar1"),
        (all, "step_k = 0.0625", "step_k = 0.0", "sensors[0].adc.step_k"),
        (all, "low_c = -50.0", "low_c = 1200.0", "sensors[0].adc.low_c must be below sensors[0].adc.high_c (1200)"),
        (all, "high_c = 460.0", "high_c = inf", "sensors[1].adc.high_c"),
        ("sine", "amplitude_k = 20.0", "amplitude_k = -20.0", "gas.amplitude_k must be finite and positive, got -20"),
        ("sine", "frequency_hz = 5.0", "frequency_hz = nan", "gas.frequency_hz"),
        ("sine", "phase_rad = 0.5", "phase_rad = inf", "gas.phase_rad"),
        ("multi-tone", "frequency_hz = 5.0", "frequency_hz = 0.0", "gas.tones[1].frequency_hz"),
        ("engine", "period_relative_std = 0.02", "period_relative_std = -0.02", "gas.period_relative_std"),
        ("engine", "amplitude_relative_std = 0.1", "amplitude_relative_std = 1.1", "gas.amplitude_relative_std"),
        ("engine", "rise_fraction = 0.08", "rise_fraction = 1.0", "gas.rise_fraction"),
        ("engine", "decay_fraction = 0.25", "decay_fraction = 0.0", "gas.decay_fraction"),
        ("turbulence", "corner_hz = 5.0", "corner_hz = 900.0", "gas.corner_hz must be below gas.cutoff_hz (800)"),
        ("turbulence", "corner_hz = 5.0", "corner_hz = 1e-9", "1/gas.corner_hz"),
        ("plunge", "rise_s = 0.02", "rise_s = 0.5", "gas.rise_s must be below gas.dwell_s (0.5), got 0.5"),
        ("broadband", "std_k = 20.0", "std_k = 0.0", "gas.std_k"),
    ] {
        assert_refused(rig, from, to, wanted);
    }
}

#[test]
fn steps_that_are_too_long_are_refused_with_the_oversampling_that_suffices() {
    let wanted = "sensors[0].time_constant_s = 0.00008 s: raise record.oversampling to at least 26";
    assert_refused("sine", "time_constant_s = 0.0238", "time_constant_s = 0.00008", wanted);
    let enough = RIGS[0].1.replacen("0.0238", "0.00008", 1).replacen("0.002\n", "0.002\noversampling = 26\n", 1);
    read(&enough).unwrap();

    let wanted = "gas.cutoff_hz = 1500 is too fast for the integration step";
    assert_refused("turbulence", "cutoff_hz = 800.0", "cutoff_hz = 1500.0", wanted);
    assert_refused("turbulence", "cutoff_hz = 800.0", "cutoff_hz = 1500.0", "record.oversampling to at least 30");
    let enough = RIGS[3].1.replacen("800.0", "1500.0", 1).replacen("0.002\n", "0.002\noversampling = 30\n", 1);
    read(&enough).unwrap();
    // A held gas has nothing between the samples that a step could miss.
    read(&RIGS[3].1.replacen("800.0", "1500.0\nhold = \"zero-order\"", 1)).unwrap();
    assert_refused("plunge", "rise_s = 0.02", "rise_s = 0.0001", "gas.rise_s = 0.0001 is too fast");
    assert_refused("engine", "frequency_hz = 20.0", "frequency_hz = 500.0", "gas.frequency_hz = 500 is too fast");
}

#[test]
fn what_is_not_a_rig_is_refused() {
    for (rig, from, to, wanted) in [
        ("everything", "seed = 1", "seed = 1\nsede = 2", "sede"),
        ("everything", "settle_s = 1.5", "settle = 1.5", "settle"),
        ("sine", "phase_rad = 0.5", "phase = 0.5", "phase"),
        ("sine", "kind = \"sine\"", "kind = \"cosine\"", "cosine"),
        ("sine", "kind = \"sine\"", "", "kind"),
        ("broadband", "hold = \"zero-order\"", "hold = \"first-order\"", "first-order"),
        ("everything", "gain = 1.02", "gian = 1.02", "gian"),
        ("everything", "ar1 = 0.4", "ar = 0.4", "ar"),
        ("sine", "channel = \"T1\"", "channel = \"\"", "sensors[0].channel must not be empty"),
        ("sine", "channel = \"T1\"", "channel = \"T2\"", "both are \"T2\""),
        ("sine", "[[sensors]]", "[[sensors]]\nchannel = \"T0\"\ntime_constant_s = 0.1\n[[sensors]]", "exactly two"),
        ("series", "path = \"gas.csv\"", "path = \"gas.csv\"\nperiod_s = 1.0", "either path, or values_c and period_s"),
        ("series", "path = \"gas.csv\"", "period_s = 1.0\nvalues_c = [1.0]", "gas.values_c must be at least 2"),
        ("series", "path = \"gas.csv\"", "period_s = 1.0\nvalues_c = [1.0, nan]", "gas.values_c[1] must be finite"),
    ] {
        assert_refused(rig, from, to, wanted);
    }
}

#[test]
fn invalid_effects_are_refused_with_the_name_of_their_field() {
    for (from, to, wanted) in [
        ("curvature_per_k = 1e-4", "curvature_per_k = nan", "sensors[0].curvature_per_k must be finite"),
        ("curvature_about_c = 400.0", "curvature_about_c = inf", "sensors[0].curvature_about_c must be finite"),
        ("delay_s = 0.0031", "delay_s = -0.1", "sensors[0].delay_s must be finite and not negative"),
        ("drift_k_per_s = 0.25", "drift_k_per_s = nan", "sensors[0].drift_k_per_s must be finite"),
        ("crosstalk = 0.03", "crosstalk = 1.5", "sensors[0].crosstalk must lie between -1 and 1"),
        ("coefficient_per_k3 = 5e-11", "coefficient_per_k3 = -1.0", "sensors[0].radiation.coefficient_per_k3"),
        ("wall_c = 350.0", "wall_c = -300.0", "sensors[0].radiation.wall_c must be finite and above absolute zero"),
        ("exponent = -0.5", "exponent = nan", "sensors[0].temperature_dependence.exponent must be finite"),
        ("reference_c = 440.0", "reference_c = -273.15", "sensors[0].temperature_dependence.reference_c must be"),
        ("width_k = 0.75", "width_k = -1.0", "sensors[0].hysteresis.width_k must be finite and not negative"),
        ("at_s = 2.5", "at_s = nan", "sensors[0].clock_slip.at_s must be finite"),
        ("by_s = 0.005", "by_s = -0.005", "sensors[0].clock_slip.by_s must be finite and not negative"),
        ("at_s = 3.5", "at_s = inf", "sensors[0].replaced.at_s must be finite"),
        ("time_constant_s = 0.05 }", "time_constant_s = 0.0 }", "sensors[0].replaced.time_constant_s"),
        ("rate_hz = 0.5", "rate_hz = 501.0", "sensors[0].intermittent_contact.rate_hz must lie between 0 and 500"),
        ("mean_duration_s = 0.1", "mean_duration_s = 0.0", "sensors[0].intermittent_contact.mean_duration_s"),
        ("drop_fraction = 0.06", "drop_fraction = 1.06", "sensors[0].intermittent_contact.drop_fraction"),
        ("towards_c = 25.0", "towards_c = nan", "sensors[0].intermittent_contact.towards_c must be finite"),
        ("frequency_hz = 150.0", "frequency_hz = 0.0", "sensors[0].mains[1].frequency_hz"),
        ("amplitude_k = 0.5", "amplitude_k = -0.5", "sensors[0].mains[0].amplitude_k"),
        ("phase_rad = 1.0", "phase_rad = inf", "sensors[0].mains[1].phase_rad"),
        ("std_k = 0.5, corr", "std_k = -0.5, corr", "sensors[0].coloured_noise.std_k must be finite and not negative"),
        ("correlation_time_s = 0.02", "correlation_time_s = 0.0", "sensors[0].coloured_noise.correlation_time_s"),
        (
            "rate_per_sample = 0.01",
            "rate_per_sample = 1.01",
            "sensors[0].spikes.rate_per_sample must lie between 0 and 1",
        ),
        ("size_k = 8.0", "size_k = -8.0", "sensors[0].spikes.size_k must be finite and not negative"),
        ("depth = 0.2", "depth = 1.0", "flow.depth must lie between -1 and 1"),
        ("depth = 0.2", "depth = nan", "flow.depth"),
        ("period_s = 4.0", "period_s = 0.0", "flow.period_s must be finite and positive"),
        ("phase_rad = 0.5", "phase_rad = nan", "flow.phase_rad must be finite"),
        ("kind = \"sine\"\ndepth", "kind = \"saw\"\ndepth", "saw"),
        ("phase_rad = 0.5", "phase = 0.5", "phase"),
        ("channel = \"T1\"\nstd_k", "channel = \"T3\"\nstd_k", "mismatch.channel must be one of the channels"),
        ("std_k = 0.5\ncorner", "std_k = 0.0\ncorner", "mismatch.std_k must be finite and positive"),
        ("corner_hz = 10.0", "corner_hz = 2000.0", "mismatch.corner_hz = 2000 is too fast"),
        ("wall_c = 350.0", "wall = 350.0", "wall"),
        ("width_k = 0.75", "width = 0.75", "width"),
    ] {
        assert_refused("effects", from, to, wanted);
    }
}

#[test]
fn stepping_flow_is_read_and_refused() {
    let sine = "kind = \"sine\"\ndepth = 0.2\nperiod_s = 4.0\nphase_rad = 0.5";
    let step = "kind = \"step\"\nfactor = 1.5\nat_s = 2.0\nover_s = 0.5";
    let rig = read(&RIGS[8].1.replacen(sine, step, 1)).unwrap();
    assert_eq!(rig.flow(), Some(&Flow::Step(FlowStep::new(1.5, 2.0, 0.5))));
    assert_eq!(read(&toml::to_string(&rig).unwrap()).unwrap(), rig);
    for (from, to, wanted) in [
        ("factor = 1.5", "factor = 0.0", "flow.factor must be finite and positive"),
        ("at_s = 2.0", "at_s = nan", "flow.at_s must be finite"),
        ("over_s = 0.5", "over_s = 0.0", "flow.over_s must be finite and positive"),
        ("over_s = 0.5", "over = 0.5", "over"),
    ] {
        assert_refused("effects", sine, &step.replacen(from, to, 1), wanted);
    }
}

#[test]
fn a_stream_is_read_and_refused() {
    let stream = "[stream]\nmean_m_per_s = 12.0\ndepth = 0.4\nperiod_s = 3.0\n";
    let in_it = "time_constant_s = 0.0238\ndownstream_m = 0.02\nstream_exponent = -0.5";
    let text = RIGS[0].1.replacen("time_constant_s = 0.0238", in_it, 1);
    let missing = read(&text).unwrap_err().to_string();
    assert!(missing.contains("sensors[0].downstream_m needs a [stream]"), "{missing}");
    let text = text.replacen("[record]", &format!("{stream}[record]"), 1);
    let rig = read(&text).unwrap();
    assert_eq!(rig.stream(), Some(&Stream::new(12.0, 0.4, 3.0, 0.0)));
    assert_eq!(read(&toml::to_string(&rig).unwrap()).unwrap(), rig);
    for (from, to, wanted) in [
        ("mean_m_per_s = 12.0", "mean_m_per_s = 0.0", "stream.mean_m_per_s must be finite and positive"),
        ("depth = 0.4", "depth = 1.0", "stream.depth must lie between -1 and 1"),
        ("period_s = 3.0", "period_s = nan", "stream.period_s must be finite and positive"),
        ("period_s = 3.0", "period_s = 3.0\nphase_rad = inf", "stream.phase_rad must be finite"),
        ("period_s = 3.0", "period_s = 3.0\nphase = 1.0", "phase"),
        ("downstream_m = 0.02", "downstream_m = -0.02", "sensors[0].downstream_m must be finite and not negative"),
        ("stream_exponent = -0.5", "stream_exponent = nan", "sensors[0].stream_exponent must be finite"),
    ] {
        let refused = read(&text.replacen(from, to, 1)).unwrap_err().to_string();
        assert!(refused.contains(wanted), "{to}: {refused}");
    }
}

/// What shortens a time constant counts: 0.0001 s is 1.2 steps, and less than one when flow or radiation shorten it.
#[test]
fn steps_too_long_for_a_shortened_time_constant_are_refused() {
    let short = |extra: &str| format!("time_constant_s = 0.0001\n{extra}");
    read(&RIGS[0].1.replacen("time_constant_s = 0.0238", &short(""), 1)).unwrap();
    let flow = "[flow]\nkind = \"step\"\nfactor = 0.5\nat_s = 1.0\nover_s = 1.0\n[record]";
    let message =
        read(&RIGS[0].1.replacen("0.0238", "0.0001", 1).replacen("[record]", flow, 1)).unwrap_err().to_string();
    let wanted = "sensors[0].time_constant_s (shortened by the flow or the stream) = 0.00005 s: raise record.oversampling to at least 41";
    assert!(message.contains(wanted), "{message}");
    let hot = short("radiation = { coefficient_per_k3 = 5e-10, wall_c = 300.0 }");
    assert_refused("sine", "time_constant_s = 0.0238", &hot, "sensors[0].time_constant_s (shortened by radiation)");
    let faster = short("temperature_dependence = { exponent = -1.0, reference_c = 20.0 }");
    assert_refused("sine", "time_constant_s = 0.0238", &faster, "(at the mean temperature of the gas)");
}
