//! A cost of one's own with every solver of the registry: the cross-relation cost, robust against glitches of the logger.
//!
//! `cargo run --release -p own-cost`

mod robust;

use twinlag::signal::{Gas, Noise, Record, Rig, Sensor, Signal, Turbulence};
use twinlag_cross_relation::{CrossRelation, Readings};
use twinlag_optimise::{Budget, End, Minimiser, Optimiser, Problem, Variable};

use crate::robust::Robust;

const PERIOD_S: f64 = 0.002;
const TRUTH_S: [f64; 2] = [0.024, 0.117];
const DISCARD: usize = 300;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let sensors = [("fine", TRUTH_S[0]), ("coarse", TRUTH_S[1])].map(|(name, tau_s)| {
        let mut sensor = Sensor::new(name, tau_s);
        sensor.noise = Some(Noise::white(0.05));
        sensor
    });
    let gas = Gas::new(450.0, Signal::Turbulence(Turbulence { std_k: 15.0, corner_hz: 3.0, cutoff_hz: 200.0 }));
    let mut simulated = Rig::new(1, Record::new(2500, PERIOD_S), gas, sensors)?.simulate()?;
    // Ten samples of the coarse channel that never were a temperature.
    for k in (350..2500).step_by(215) {
        simulated.t2_c[k] += 60.0;
    }
    let readings = Readings::even(&simulated.t1_c, &simulated.t2_c, PERIOD_S)?;

    // `δ` that is never reached makes the loss the square, and the cost the published one.
    let squares = Robust { cost: CrossRelation::new(&readings, DISCARD)?, ordinary_k: 1e6 };
    let robust = Robust { cost: CrossRelation::new(&readings, DISCARD)?, ordinary_k: 0.1 };
    let variables = || ["T1", "T2"].map(|name| Variable::logarithmic(name, 1e-3, 2.0)).to_vec();
    let start = [0.01, 0.1];
    let worst = |tau_s: &[f64]| (0..2).map(|i| (tau_s[i] / TRUTH_S[i] - 1.0).abs()).fold(0.0, f64::max);

    let problem = Problem::new(&squares, variables())?;
    let misled = Optimiser::default().minimise(&problem, &start, &Budget::default())?;
    println!("{:30} {:.4} and {:.4} s", "true", TRUTH_S[0], TRUTH_S[1]);
    println!("{:30} {:.4} and {:.4} s", "squares", misled.x[0], misled.x[1]);

    let problem = Problem::new(&robust, variables())?;
    for name in Optimiser::NAMES.into_iter().chain(Optimiser::GLOBAL_NAMES) {
        let fit = Optimiser::by_name(name)?.minimise(&problem, &start, &Budget::default())?;
        let work = fit.evaluations.values + fit.evaluations.derivatives;
        println!("{name:30} {:.4} and {:.4} s, {:?}, {work} evaluations", fit.x[0], fit.x[1], fit.end);
        assert_eq!(fit.end, End::Converged, "{name}");
        assert!(worst(&fit.x) < 0.02, "{name}: far from the truth");
        assert!(worst(&fit.x) < 0.2 * worst(&misled.x), "{name}: no better than squares");
    }

    // Brent's search takes one variable: the fine sensor's, the coarse one's known.
    let [fine, coarse] = <[Variable; 2]>::try_from(variables()).expect("two variables");
    let problem = Problem::new(&robust, vec![fine, coarse.held_at(TRUTH_S[1])])?;
    let fit = Optimiser::by_name("brent")?.minimise(&problem, &start, &Budget::default())?;
    println!("{:30} {:.4} s, the other known, {:?}", "brent", fit.x[0], fit.end);
    assert!(fit.end == End::Converged && worst(&fit.x) < 0.02, "brent: {fit:?}");
    Ok(())
}
