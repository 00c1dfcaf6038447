//! A solver of one's own, compass search, on the whitened cost of a simulated record.
//!
//! `cargo run --release -p own-solver`

mod compass;

use twinlag::sensor::Discretisation;
use twinlag::signal::{Gas, Noise, Record, Rig, Sensor, Signal, Turbulence};
use twinlag_cross_relation::{Readings, Whitened};
use twinlag_optimise::{Budget, Cost, Derivatives, End, Minimiser, MultiStart, Optimiser, Problem, Variable};

use crate::compass::Compass;

const PERIOD_S: f64 = 0.002;
const TRUTH_S: [f64; 2] = [0.024, 0.117];
const NOISE_STD_K: f64 = 0.3;

/// The whitened cost, as the optimisers take it.
struct OfTwo<'a>(Whitened<'a>);

impl Cost for OfTwo<'_> {
    fn value(&self, tau_s: &[f64]) -> f64 {
        self.0.evaluate(&[tau_s[0], tau_s[1]]).value
    }

    // Compass search does not ask for them, but whoever judges where it ended does.
    fn derivatives(&self, tau_s: &[f64]) -> Option<Derivatives> {
        let at = self.0.evaluate(&[tau_s[0], tau_s[1]]);
        let curvature = at.hessian.iter().map(|row| row.to_vec()).collect();
        Some(Derivatives { value: at.value, gradient: at.gradient.to_vec(), curvature })
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let sensors = [("fine", TRUTH_S[0]), ("coarse", TRUTH_S[1])].map(|(name, tau_s)| {
        let mut sensor = Sensor::new(name, tau_s);
        sensor.noise = Some(Noise::white(NOISE_STD_K));
        sensor
    });
    let gas = Gas::new(450.0, Signal::Turbulence(Turbulence { std_k: 15.0, corner_hz: 3.0, cutoff_hz: 200.0 }));
    let simulated = Rig::new(1, Record::new(2500, PERIOD_S), gas, sensors)?.simulate()?;
    let readings = Readings::even(&simulated.t1_c, &simulated.t2_c, PERIOD_S)?;
    let cost = OfTwo(Whitened::new(&readings, Discretisation::ZeroOrderHold, [NOISE_STD_K; 2])?);

    let variables = ["T1", "T2"].map(|name| Variable::logarithmic(name, 1e-3, 10.0)).to_vec();
    let problem = Problem::new(&cost, variables)?;
    let compass = Compass { smallest_step: 1e-6 };
    // Wherever the library takes a solver it takes this one, several starts included.
    let all = MultiStart::run(&problem, &compass, &[vec![0.01, 0.1], vec![0.1, 0.3]], &Budget::default())?;
    let own = all.best();
    let default = Optimiser::default().minimise(&problem, &[0.01, 0.1], &Budget::default())?;
    println!("true                 {:.4} and {:.4} s", TRUTH_S[0], TRUTH_S[1]);
    for fit in [own, &default] {
        let work = fit.evaluations.values + fit.evaluations.derivatives;
        println!("{:20} {:.4} and {:.4} s, {:?}, {work} evaluations", fit.optimiser, fit.x[0], fit.x[1], fit.end);
    }

    assert_eq!(own.end, End::Converged);
    for i in 0..2 {
        // A last step of 1e-6 in ln τ brings it that near, and a valley between two axes some times less near.
        assert!((own.x[i] / default.x[i] - 1.0).abs() < 1e-4, "the solvers disagree");
        assert!((own.x[i] / TRUTH_S[i] - 1.0).abs() < 0.1, "far from the truth");
    }
    Ok(())
}
