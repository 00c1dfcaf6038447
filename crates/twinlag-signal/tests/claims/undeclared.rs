//! Random rigs: what is drawn, and that it is what is said.

use twinlag_signal::undeclared::{GasKind, Kind, undeclared};
use twinlag_signal::{Clean, Rig, SignalError};

use super::assert_close;

fn clean(rig: &Rig) -> Clean {
    rig.clean(0).expect("simulates")
}

#[test]
fn every_kind_builds_for_twenty_seeds_within_its_ranges() {
    for kind in Kind::ALL {
        for seed in 0..20 {
            let drawn = undeclared(&[kind], 1.0, None, seed).unwrap_or_else(|error| panic!("{kind:?} {seed}: {error}"));
            let what = format!("{} {seed}", kind.name());
            let (rig, [first, second]) = (&drawn.rig, drawn.rig.sensors());
            let fast_s = first.time_constant_s.min(second.time_constant_s);
            let slow_s = first.time_constant_s.max(second.time_constant_s);
            assert!((9000..=18_000).contains(&rig.record().samples), "{what}");
            assert!((10.0..=32.0).contains(&(fast_s / rig.record().sample_period_s)), "{what}");
            assert!((3.5..=6.5).contains(&(slow_s / fast_s)), "{what}");
            assert!((0.07..=0.2).contains(&(drawn.frequency_hz * fast_s)), "{what}");
            assert!((15.0..=30.0).contains(&drawn.scale_k), "{what}");
            for sensor in rig.sensors() {
                let noise_k = sensor.noise.expect("every channel has noise").std_k;
                assert!((0.002..=0.03).contains(&(noise_k / drawn.scale_k)), "{what}");
            }
            let both = [Kind::None, Kind::IdleStream, Kind::VaryingTimeConstant, Kind::FilmTemperature].contains(&kind);
            assert_eq!(drawn.channel.is_none(), both, "{what}");
            assert_eq!(drawn.size == 0.0, [Kind::None, Kind::IdleStream].contains(&kind), "{what}");
            assert_eq!(drawn.effects(), Vec::from_iter(kind.effect()), "{what}");
            let text = toml::to_string(rig).unwrap_or_else(|error| panic!("{what}: {error}"));
            assert_eq!(toml::from_str::<Rig>(&text).unwrap_or_else(|error| panic!("{what}: {error}")), *rig);
        }
    }
}

/// The record changes where the effect is said to be, and nowhere else: not in the gas, and not in the other channel.
#[test]
fn every_kind_changes_its_channel_alone() {
    let without = undeclared(&[Kind::None], 1.0, None, 3).expect("builds").simulate().expect("simulates");
    for kind in Kind::ALL {
        let drawn = undeclared(&[kind], 1.0, None, 3).expect("builds");
        let record = drawn.simulate().unwrap_or_else(|error| panic!("{kind:?}: {error}"));
        assert_eq!(record.gas_c, without.gas_c, "{kind:?}");
        let changed = [record.t1_c != without.t1_c, record.t2_c != without.t2_c];
        let want = match (kind, drawn.channel) {
            (Kind::None | Kind::IdleStream, _) => [false; 2],
            (_, None) => [true; 2],
            (_, Some(channel)) => [channel == 0, channel == 1],
        };
        assert_eq!(changed, want, "{kind:?}");
        assert!(record.t1_c.iter().chain(&record.t2_c).all(|y| y.is_finite()), "{kind:?}");
    }
}

/// Scaled to it over the record itself, at the sample instants: rounding of some 1e4 additions of 650 °C is left.
#[test]
fn gas_has_the_drawn_deviation_over_the_record() {
    for gas in GasKind::ALL {
        let drawn = undeclared(&[], 1.0, Some(gas), 5).expect("builds");
        assert_eq!((drawn.gas, drawn.channel, drawn.size), (gas, None, 0.0));
        let gas_c = clean(&drawn.rig).gas_c;
        let n = gas_c.len() as f64;
        let mean_c = gas_c.iter().sum::<f64>() / n;
        let std_k = (gas_c.iter().map(|x| (x - mean_c).powi(2)).sum::<f64>() / n).sqrt();
        assert!((150.0..650.0).contains(&mean_c), "{gas:?}: {mean_c}");
        assert_close(gas.name(), std_k, drawn.scale_k, 1e-6);
    }
}

#[test]
fn same_seed_gives_the_same_record_and_another_seed_another() {
    let record = |seed| undeclared(&[Kind::Spikes], 1.0, None, seed).expect("builds").simulate().expect("simulates");
    let first = record(11);
    assert_eq!(first, record(11));
    assert_ne!(first.gas_c, record(12).gas_c);
}

/// The limit is a value of the record itself, beyond which lie as many as were asked for, rounded.
#[test]
fn saturation_cuts_the_drawn_part_of_the_record() {
    for seed in 0..4 {
        let drawn = undeclared(&[Kind::Saturation, Kind::Gain], 1.0, None, seed).expect("builds");
        let channel = drawn.channel.expect("one channel");
        let adc = drawn.rig.sensors()[channel].adc.expect("a limit");
        let readings_c = &clean(&drawn.rig).readings_c[channel];
        let beyond = |y: f64| adc.low_c.is_some_and(|low_c| y < low_c) || adc.high_c.is_some_and(|high_c| y > high_c);
        let part = readings_c.iter().filter(|y| beyond(**y)).count() as f64 / readings_c.len() as f64;
        // A plunge stands still: many readings may be equal to the limit, and are then not beyond it.
        let equal = readings_c.iter().filter(|y| [adc.low_c, adc.high_c].contains(&Some(**y))).count() as f64;
        let tol = (equal + 0.5) / readings_c.len() as f64;
        assert_close("part beyond", part, drawn.size, tol);
    }
}

#[test]
fn size_factor_multiplies_the_size() {
    for kind in Kind::ALL {
        for seed in 0..3 {
            let [one, half] = [1.0, 0.5].map(|factor| undeclared(&[kind], factor, None, seed).expect("builds"));
            let (one_size, want) = match kind {
                // A factor of the time constant: its excess over 1 counts, or that of its inverse.
                Kind::Replaced if one.size < 1.0 => (one.size.recip() - 1.0, half.size.recip() - 1.0),
                Kind::Replaced => (one.size - 1.0, half.size - 1.0),
                _ => (one.size, half.size),
            };
            assert_close(kind.name(), 0.5 * one_size, want, 1e-12 * one_size.abs());
            assert_eq!(one.channel, half.channel);
        }
    }
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let refused = undeclared(&[Kind::Gain], bad, None, 1);
        assert!(matches!(refused, Err(SignalError::NotPositive { field, .. }) if field == "undeclared.size_factor"));
    }
}

/// All pairs of kinds can be built, each effect the same as if it were alone (but for what a quantile depends on).
#[test]
fn kinds_combine() {
    for (i, a) in Kind::EFFECTS.into_iter().enumerate() {
        for b in Kind::EFFECTS.into_iter().skip(i + 1).filter(|b| *b != Kind::Saturation && a != Kind::Saturation) {
            let pair = undeclared(&[a, b], 1.0, None, 2).unwrap_or_else(|error| panic!("{a:?}, {b:?}: {error}"));
            let alone = [a, b].map(|kind| undeclared(&[kind], 1.0, None, 2).expect("builds").placed[0]);
            assert_eq!(pair.placed, alone);
        }
    }
    let twice = undeclared(&[Kind::Gain, Kind::Delay, Kind::Gain, Kind::Offset], 1.0, None, 2).expect("builds");
    assert_eq!(twice.kinds, [Kind::Gain, Kind::Delay, Kind::Offset]);
    assert_eq!(twice.effects(), ["calibration", "delay"]);
    let saturated_first = undeclared(&[Kind::Saturation, Kind::Offset], 1.0, None, 2).expect("builds");
    assert_eq!(saturated_first.placed.iter().map(|effect| effect.kind).collect::<Vec<_>>(), saturated_first.kinds);
}

#[test]
fn kinds_are_listed_once_and_named_as_in_files() {
    let split = [&[Kind::None, Kind::IdleStream][..], &Kind::EFFECTS, &Kind::UNMODELLED].concat();
    assert_eq!(split, Kind::ALL);
    for kind in Kind::ALL {
        assert_eq!(serde_json::to_string(&kind).unwrap(), format!("{:?}", kind.name()));
        assert_eq!(kind.effect().is_some(), Kind::EFFECTS.contains(&kind));
    }
    for gas in GasKind::ALL {
        assert_eq!(serde_json::to_string(&gas).unwrap(), format!("{:?}", gas.name()));
    }
}
