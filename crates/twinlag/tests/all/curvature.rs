//! A curved calibration is found in the channel that has it.

use crate::common::{record, recovers};
use twinlag::diagnosis::{Identifier, Verdict};
use twinlag::{DiagnoseOptions, diagnose};

/// A reading is bent after its lag: which of the two is bent shows while the gas changes. Four standard errors.
#[test]
fn a_curvature_is_found_in_its_channel() {
    let gas = "kind = \"turbulence\"\nstd_k = 25.0\ncorner_hz = 1.0\ncutoff_hz = 60.0";
    let plain = |tau_s: f64| format!("time_constant_s = {tau_s}\nnoise = {{ std_k = 0.1 }}\n");
    let curved = |tau_s: f64| plain(tau_s) + "curvature_per_k = 0.0006\ncurvature_about_c = 300.0";
    let of = [
        ([curved(0.03), plain(0.11)], ["gain", "offset", "curvature_of_first"]),
        ([plain(0.03), curved(0.11)], ["gain", "offset", "curvature"]),
    ];
    for ([first, second], names) in of {
        let record = record(6, 8000, 0.002, gas, [&first, &second]);
        let answer = diagnose(&record, &DiagnoseOptions::default()).expect("a sound question");
        assert_eq!(answer.verdict, Verdict::Explained, "{:?}", answer.effects);
        let [found] = &answer.effects[..] else { panic!("one effect: {:?}", answer.effects) };
        assert_eq!(found.effect, Identifier::CALIBRATION);
        let fitted: Vec<&str> = found.parameters.iter().map(|p| p.name.as_str()).take(3).collect();
        assert_eq!(fitted, names);
        recovers(&answer.last, [0.03, 0.11], 4.0);
    }
}
