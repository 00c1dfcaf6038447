use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use twinlag_diagnose::*;
use twinlag_signal::undeclared::*;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let n: u64 = args[1].parse().unwrap();
    let only: Vec<&str> = args[2..].iter().map(String::as_str).collect();
    let kinds: Vec<Kind> = Kind::ALL.into_iter().filter(|k| only.is_empty() || only.contains(&k.name())).collect();
    let jobs: Vec<(Kind, u64)> = kinds.iter().flat_map(|k| (0..n).map(move |s| (*k, 1000 + s))).collect();
    let next = AtomicU64::new(0);
    let out = Mutex::new(BTreeMap::new());
    std::thread::scope(|s| {
        for _ in 0..2 {
            s.spawn(|| loop {
                let i = next.fetch_add(1, Ordering::Relaxed) as usize;
                let Some(&(kind, seed)) = jobs.get(i) else { break };
                let u = undeclared(&[kind], 1.0, Some(GasKind::ALL[seed as usize % 4]), seed).unwrap();
                let r = match u.simulate() { Ok(r) => r, Err(e) => { println!("{kind:?} {seed} {e}"); continue } };
                let period = (r.time_s[r.time_s.len() - 1] - r.time_s[0]) / (r.time_s.len() - 1) as f64;
                let obs = Observations::new(vec![Stretch::new(r.time_s.clone(), [r.t1_c.clone(), r.t2_c.clone()])], Some(period)).unwrap();
                let now = std::time::Instant::now();
                let d = diagnose(&obs, &Settings::default(), &|_, _, _| ()).unwrap();
                let tau: Vec<f64> = u.rig.sensors().iter().map(|s| s.time_constant_s).collect();
                let z: Vec<String> = (0..2).map(|i| { let t = &d.last.time_constants[i]; match (t.value_s, t.standard_error_s) { (Some(v), Some(s)) => format!("{:+.2}%({:+.1})", 100.0 * (v / tau[i] - 1.0), (v - tau[i]) / s), _ => "-".into() } }).collect();
                let names: Vec<String> = d.effects.iter().map(|e| format!("{}{}{}", e.effect, e.channel.map_or(String::new(), |c| format!("{}", c + 1)), if e.alternatives.is_empty() { String::new() } else { format!("|{}", e.alternatives.iter().map(|a| a.name()).collect::<Vec<_>>().join("|")) })).collect();
                let line = format!("{:34} {seed} {:10} ch {:?} size {:.4} tau {:?} noise {:.3?} -> {:?} [{}] chi2 {:.3}->{:.3} ho {:.3}->{:.3} {} {:.1}s", kind.name(), u.gas.name(), u.channel, u.size, tau.iter().map(|t| (t / period).round()).collect::<Vec<_>>(), d.last.noise_std_k, d.verdict, names.join(", "), d.base.chi2_per_dof, d.last.chi2_per_dof, d.error.held_out_normalised_rms.before, d.error.held_out_normalised_rms.after, z.join(" "), now.elapsed().as_secs_f64());
                let fails: Vec<String> = d.last.tests.iter().filter(|t| t.p_value < 1e-4).map(|t| format!("{} {:.2} p {:.0e}", t.test, t.statistic, t.p_value)).collect();
                println!("{line} FAILS {fails:?}");
                let right = match (kind.effect(), d.effects.first()) { (Some(e), Some(f)) => f.effect.name() == e, (None, None) => true, _ => false };
                let tie = right || matches!((kind.effect(), d.effects.first()), (Some(e), Some(f)) if f.alternatives.iter().any(|a| a.name() == e));
                let mut o = out.lock().unwrap();
                let e: &mut (u64, u64, u64, u64) = o.entry(format!("{kind:?}")).or_default();
                e.0 += 1; e.1 += right as u64; e.2 += tie as u64; e.3 += (d.verdict == Verdict::Explained || d.verdict == Verdict::Adequate) as u64;
            });
        }
    });
    for (k, v) in out.into_inner().unwrap() { println!("SUM {k:36} n {} right {} with ties {} explained {}", v.0, v.1, v.2, v.3); }
}
