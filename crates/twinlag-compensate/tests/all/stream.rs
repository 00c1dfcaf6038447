//! That a stream says what the filter of a whole record does, also across missing readings, and settles.

use twinlag_compensate::{Form, Prior, Readings, Rig, Sensor, Stream, Term, reconstruct};

const PERIOD_S: f64 = 0.002;
const SAMPLES: usize = 4000;

fn readings_c() -> [Vec<f64>; 2] {
    [0, 1].map(|i| {
        (0..SAMPLES)
            .map(|k| k as f64)
            .map(|k| 300.0 + 8.0 * (0.02 * k - 0.3 * f64::from(i)).sin() + 0.4 * (1.7 * k + f64::from(i)).cos())
            .collect()
    })
}

/// Kept gains are those of a covariance that changes by 1e-15 of itself per sample: what comes later differs by a few thousand times
/// that at most.
#[test]
fn a_stream_says_what_the_filter_does() {
    let rig = Rig::new([Sensor::new(0.024, 0.3), Sensor::new(0.117, 0.2)]);
    let terms = vec![
        Term::Rough { std_k: 5.0, corner_hz: 2.0 },
        Term::Resonance { std_k: 5.0, frequency_hz: 8.0, quality: 20.0 },
    ];
    let reading_c = readings_c();
    let missing =
        [0, 1].map(|i| (0..SAMPLES).map(|k| (2500..2510).contains(&k) || k % 997 == 13 + i).collect::<Vec<_>>());
    let prior = Prior { level_c: 298.0, terms: terms.clone() };
    let time_s = (0..SAMPLES).map(|k| k as f64 * PERIOD_S).collect();
    let record = Readings::with_missing(time_s, reading_c.clone(), missing.clone()).expect("good readings");
    let want = reconstruct(&record, &rig, &prior, Form::Filter).expect("a good rig");
    let mut stream = Stream::<6>::new(&rig, 298.0, &terms, PERIOD_S).expect("six states");
    let mut settled = 0;
    for k in 0..SAMPLES {
        let now = stream.push([0, 1].map(|i: usize| (!missing[i][k]).then(|| reading_c[i][k])));
        assert!((now.gas_c - want.gas_c[k]).abs() < 1e-9, "at {k}: {} and {}", now.gas_c, want.gas_c[k]);
        assert!((now.variance_k2.sqrt() - want.std_k[k]).abs() < 1e-9, "at {k}");
        settled += usize::from(stream.is_settled());
    }
    assert!(settled > SAMPLES / 4, "it settles: {settled} of {SAMPLES} samples");
}

#[test]
fn a_stream_with_too_few_states_or_a_delay_is_none() {
    let rig = Rig::new([Sensor::new(0.024, 0.3), Sensor::new(0.117, 0.2)]);
    let terms = [Term::Resonance { std_k: 5.0, frequency_hz: 8.0, quality: 20.0 }];
    assert_eq!(Stream::<4>::states(&rig, &terms), 5);
    assert!(Stream::<4>::new(&rig, 0.0, &terms, PERIOD_S).is_none());
    assert!(Stream::<5>::new(&Rig { delay_s: 0.01, ..rig }, 0.0, &terms, PERIOD_S).is_none());
    assert!(Stream::<5>::new(&rig, 0.0, &terms, PERIOD_S).is_some());
}
