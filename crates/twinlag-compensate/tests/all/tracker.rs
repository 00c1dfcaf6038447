//! That time constants are followed as readings come in, with a band that holds them, through smooth changes and sudden ones.

use twinlag_compensate::{Prior, Readings, Rig, Sensor, Term, TrackerState, learn, tracker};
use twinlag_signal::{Flow, FlowSine, FlowStep};
use twinlag_signal::{
    Gas, Noise, Record, Rig as Simulation, Sensor as Simulated, Signal, Simulated as Answer, Turbulence,
};

const PERIOD_S: f64 = 0.002;
/// Samples of the start, at steady flow, that the gas is learned from.
const START: usize = 2500;
const SAMPLES: usize = 20_000;
/// A tenth in ten time constants of the slower sensor.
const CHANGE: f64 = 0.092;

fn simulated(flow: Flow, seed: u64) -> Answer {
    let sensor = |name: &str, tau_s| {
        let mut sensor = Simulated::new(name, tau_s);
        sensor.noise = Some(Noise::white(0.1));
        sensor
    };
    let signal = Signal::Turbulence(Turbulence { std_k: 10.0, corner_hz: 3.0, cutoff_hz: 240.0 });
    let sensors = [sensor("fine", 0.024), sensor("coarse", 0.117)];
    let rig = Simulation::new(seed, Record::new(SAMPLES, PERIOD_S), Gas::new(300.0, signal), sensors).expect("a rig");
    rig.with_flow(flow).expect("a flow").simulate().expect("a record")
}

fn tracked(record: &Answer) -> Vec<TrackerState> {
    let rig = Rig::new([Sensor::new(0.024, 0.1), Sensor::new(0.117, 0.1)]);
    let start = |values: &[f64]| values[..START].to_vec();
    let readings =
        Readings::new(start(&record.time_s), [start(&record.t1_c), start(&record.t2_c)]).expect("good readings");
    let prior = learn(&readings, &rig).expect("long enough").prior;
    let mut tracker = tracker(&rig, &prior, PERIOD_S, CHANGE).expect("no delay");
    (0..SAMPLES).map(|k| tracker.push([Some(record.t1_c[k]), Some(record.t2_c[k])])).collect()
}

/// A change that is smoother than a random walk is followed by one with a band that is too wide rather than too narrow. Its error is a
/// tenth of the change at most.
#[test]
fn a_slow_change_is_followed() {
    let flow = Flow::Sine(FlowSine::new(0.3, 20.0, 0.0));
    let (mut inside, mut count, mut squares) = (0_u32, 0_u32, 0.0);
    for seed in 1..4 {
        for (k, now) in tracked(&simulated(flow, seed)).iter().enumerate().skip(START) {
            let error = now.log_factor - flow.factor(k as f64 * PERIOD_S).ln();
            inside += u32::from(error.abs() < 1.96 * now.log_variance.sqrt());
            squares += error * error;
            count += 1;
        }
    }
    let (share, rms) = (f64::from(inside) / f64::from(count), (squares / f64::from(count)).sqrt());
    assert!(share > 0.93, "{share} inside the band");
    assert!(rms < 0.03, "error {rms}");
}

/// A step of 40 % at 20 s: before and, once ten time constants of the faster sensor are gone, after, the factor is where it should be by
/// four standard deviations, and it is known to 5 %.
#[test]
fn a_sudden_change_is_followed() {
    let all = tracked(&simulated(Flow::Step(FlowStep::new(1.4, 20.0, 0.001)), 1));
    let at = |time_s: f64| all[(time_s / PERIOD_S) as usize];
    for (time_s, factor) in [(19.0, 1.0_f64), (19.9, 1.0), (20.5, 1.4), (25.0, 1.4), (39.0, 1.4)] {
        let now = at(time_s);
        let std = now.log_variance.sqrt();
        assert!((now.log_factor - factor.ln()).abs() < 4.0 * std && std < 0.05, "at {time_s} s: {now:?}");
    }
}

/// A factor of four is beyond what is kept in view, and that is said; nothing is NaN, also without readings.
#[test]
fn what_is_beyond_the_range_is_said() {
    let all = tracked(&simulated(Flow::Step(FlowStep::new(4.0, 10.0, 0.001)), 1));
    assert!(all[4000].chance_beyond < 0.01 && all[15_000].chance_beyond > 0.5);
    assert!(all.iter().all(|now| now.gas_c.is_finite() && now.variance_k2 > 0.0 && now.log_variance > 0.0));
    let rig = Rig::new([Sensor::new(0.024, 0.1), Sensor::new(0.117, 0.1)]);
    let prior = Prior { level_c: 300.0, terms: vec![Term::Rough { std_k: 10.0, corner_hz: 3.0 }] };
    let mut all = tracker(&rig, &prior, PERIOD_S, CHANGE).expect("no delay");
    let widths: Vec<f64> = (0..1000).map(|_| all.push([None, None]).log_variance).collect();
    assert!(widths[999] > widths[0] && widths.iter().all(|w| w.is_finite()));
    // One absurd reading does not end it.
    all.push([Some(1e9), Some(300.0)]);
    assert!(all.push([Some(300.0), Some(300.0)]).log_factor.is_finite());
    assert!(tracker(&Rig { delay_s: 0.01, ..rig }, &prior, PERIOD_S, CHANGE).is_none());
}

/// Samples without readings, skipped at once and one by one: the same but for rounding, 1e-13, which the likelihoods of readings that lie up
/// to 30 standard deviations off multiply by some thousand; a sample too many changes a percent. Once all is forgotten, factors are as likely as each other: of 41 that are evenly apart the variance is 140 squares of what lies between two.
#[test]
fn samples_are_skipped_at_once_as_one_by_one() {
    let rig = Rig::new([Sensor::new(0.024, 0.1), Sensor::new(0.117, 0.1)]);
    let prior = Prior { level_c: 300.0, terms: vec![Term::Rough { std_k: 10.0, corner_hz: 3.0 }] };
    let mut start = tracker(&rig, &prior, PERIOD_S, CHANGE).expect("no delay");
    let numbers = |now: TrackerState| [now.gas_c, now.variance_k2, now.log_factor, now.log_variance, now.chance_beyond];
    for missing in [1, 2, 7, 1000, 3001] {
        let [mut slowly, mut at_once] = [0, 1].map(|_| {
            let mut tracker = tracker(&rig, &prior, PERIOD_S, CHANGE).expect("no delay");
            (0..50).for_each(|k| _ = tracker.push([0.3, 0.7].map(|by| Some(300.0 + 5.0 * (by * f64::from(k)).sin()))));
            tracker
        });
        (0..missing).for_each(|_| _ = slowly.push([None, None]));
        at_once.skip(missing);
        for _ in 0..3 {
            let [want, got] =
                [&mut slowly, &mut at_once].map(|tracker| numbers(tracker.push([Some(303.0), Some(302.0)])));
            for (want, got) in want.iter().zip(got) {
                assert!((got - want).abs() < 1e-8 * want.abs().max(1.0), "{missing} missing: {got}, want {want}");
            }
        }
    }
    start.skip(u64::MAX);
    let spacing = 2.0 * 2.5_f64.ln() / 40.0;
    let forgotten = start.push([None, None]);
    assert!((forgotten.log_variance / (spacing * spacing) - 140.0 - 1.0 / 12.0).abs() < 1e-6, "{forgotten:?}");
    assert!((forgotten.gas_c - 300.0).abs() < 1e-6 && (forgotten.variance_k2 - 100.0).abs() < 1e-6, "{forgotten:?}");
}
