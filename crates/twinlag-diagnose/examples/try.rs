use std::time::Instant;
use twinlag_diagnose::*;
fn main() {
    for path in std::env::args().skip(1) {
        let text = std::fs::read_to_string(&path).unwrap();
        let rows: Vec<Vec<f64>> = text.lines().skip(1).map(|l| l.split(',').map(|x| x.parse().unwrap()).collect()).collect();
        let col = |j: usize| rows.iter().map(|r| r[j]).collect::<Vec<_>>();
        let t = col(0);
        let period = (t[t.len() - 1] - t[0]) / (t.len() - 1) as f64;
        let obs = Observations::new(vec![Stretch::new(t, [col(1), col(2)])], Some(period)).unwrap();
        let now = Instant::now();
        let d = diagnose(&obs, &Settings::default(), &|_, _, _| ()).unwrap();
        println!("== {path} {:.2} s: {:?}", now.elapsed().as_secs_f64(), d.verdict);
        println!("  base {:?} {:?} chi2 {:.3}", d.base.time_constants[0], d.base.time_constants[1].value_s, d.base.chi2_per_dof);
        for e in &d.effects {
            println!("  {} {:?} alt {:?} {:?}", e.effect, e.channel, e.alternatives, e.evidence);
            for p in e.parameters.iter().take(4) { println!("     {} {} ± {:?} {}", p.name, p.value, p.standard_error, p.unit); }
            if let Some(s) = &e.seen { println!("     {s}"); }
        }
        println!("  last {:?}\n       {:?} chi2 {:.3} rms {:?}", d.last.time_constants[0], d.last.time_constants[1], d.last.chi2_per_dof, d.error.held_out_normalised_rms);
        for t in &d.last.tests { println!("   {} {:.3} p {:.2e}", t.test, t.statistic, t.p_value); }
        if let Some(u) = &d.unexplained { println!("  {}", u.description); }
    }
}
