use twinlag_compensate::*;
use twinlag_signal::{
    Engine, Gas as SignalGas, Noise, Plunge, Record, Rig as SRig, Sensor as SSensor, Signal, Turbulence,
};

#[test]
fn scratch() {
    let n = 2000;
    let ts = 0.002;
    let tau = [0.0238, 0.1168];
    for (name, signal) in [
        ("turbulence", Signal::Turbulence(Turbulence { std_k: 10.0, corner_hz: 3.0, cutoff_hz: 200.0 })),
        ("plunge", Signal::Plunge(Plunge { amplitude_k: 17.0, dwell_s: 0.3, rise_s: 0.02 })),
        (
            "engine",
            Signal::Engine(Engine { amplitude_relative_std: 0.1, period_relative_std: 0.02, ..Engine::new(30.0, 8.0) }),
        ),
        ("engine0", Signal::Engine(Engine::new(30.0, 8.0))),
    ] {
        for noise in [0.1, 0.2, 0.5, 1.0] {
            let mut sensors = [SSensor::new("T1", tau[0]), SSensor::new("T2", tau[1])];
            for s in &mut sensors {
                s.noise = Some(Noise::white(noise));
            }
            let rig = SRig::new(3, Record::new(n, ts), SignalGas::new(300.0, signal.clone()), sensors).unwrap();
            let s = rig.simulate().unwrap();
            let time: Vec<f64> = (0..n).map(|k| k as f64 * ts).collect();
            let readings = Readings::new(time, [s.t1_c.clone(), s.t2_c.clone()]).unwrap();
            let r = Rig::new([Sensor::new(tau[0], noise), Sensor::new(tau[1], noise)]);
            let t0 = std::time::Instant::now();
            let prior = learn(&readings, &r).unwrap();
            let t1 = t0.elapsed();
            let g = reconstruct(&readings, &r, &prior, Form::Smoother).unwrap();
            let t2 = t0.elapsed();
            let rms = |v: &[f64]| (v.iter().zip(&s.gas_c).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / n as f64).sqrt();
            let inside =
                g.gas_c.iter().zip(&g.std_k).zip(&s.gas_c).filter(|((a, sd), b)| (*a - *b).abs() < 1.96 * *sd).count();
            println!(
                "{name} {noise}: rms {:.4} raw {:.4} coverage {:.3} energy {:.3} ll {:.1} learn {:?} smooth {:?}\n   {:?}",
                rms(&g.gas_c),
                rms(&s.t1_c),
                inside as f64 / n as f64,
                g.innovation_energy,
                g.log_likelihood,
                t1,
                t2 - t1,
                prior.terms
            );
        }
    }
}
