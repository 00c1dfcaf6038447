//! What is said of how plausible a time constant is: `--sensor` and `--fluid`.

use crate::common::{Bench, FAST_RIG, number};

/// The time constant of a wire of 50 µm in air at 20 m/s, s. By hand, with air of 300 °C (0.0446 W/(m K), 47.5·10⁻⁶ m²/s): a Reynolds
/// number of 21, a Nusselt number of 2.5 and with 1.5 % of radiation 0.0207 s, which goes with the diameter to the power of 1.56 there.
const EXPECTED_S: f64 = 0.0207;
/// Diameters of 24 ms over and times the factor of 95 %, `exp(1.96 · 0.3)` = 1.8.
const DIAMETERS_M: [f64; 2] = [37.7e-6, 80.0e-6];
/// Two digits of each number by hand, and a power that is not quite one.
const BY_HAND: f64 = 0.05;

const AIR: [&str; 2] = ["--fluid", "air@20m/s"];

#[test]
fn a_wire_of_the_right_size_is_plausible() {
    let bench = Bench::simulated("plausible", FAST_RIG);
    let verbs: [&[&str]; 3] = [&["characterise"], &["diagnose"], &["compensate", "--out", "gas.csv"]];
    for verb in verbs {
        let asked = [verb, &["run.csv", "--json", "--sensor", "T1=wire:50um"], &AIR].concat();
        let answer = bench.run(&asked).json();
        let last = if verb[0] == "characterise" { &answer } else { &answer["final"] };
        let one = &last["plausibility"][0];
        assert_eq!((&one["channel"], &one["is_outside"]), (&"T1".into(), &false.into()), "{one:#}");
        assert!((number(&one["expected_s"]) / EXPECTED_S - 1.0).abs() < BY_HAND, "{one:#}");
        assert!(one["would_take"].is_null() && one["is_taken_as_known"] == false, "{one:#}");
    }
}

/// What the record determines by itself stays as it is, whatever was expected.
#[test]
fn a_wire_of_another_size_is_not_and_moves_nothing() {
    let bench = Bench::simulated("implausible", FAST_RIG);
    let alone = bench.characterise("run.csv", &[]).json();
    for size in ["T1=wire:0.5mm", "T1=wire:7um"] {
        let asked = [&["--sensor", size], &AIR[..]].concat();
        let answer = bench.characterise("run.csv", &asked).json();
        assert_eq!(answer["sensors"], alone["sensors"]);
        let one = &answer["plausibility"][0];
        assert_eq!(one["is_outside"], true, "{one:#}");
        for (got, want) in one["would_take"]["diameter_m"].as_array().expect("two ends").iter().zip(DIAMETERS_M) {
            assert!((number(got) / want - 1.0).abs() < BY_HAND, "{one:#}");
        }
        let text = bench.run(&[&["characterise", "run.csv", "--quiet"], &asked[..]].concat()).stdout;
        assert!(text.contains("implausible: T1 has 0.02") && text.contains("it would take a diameter of"), "{text}");
    }
}

/// Of two sensors that are alike a record determines nothing; what is expected of one is then taken as known.
#[test]
fn what_the_record_does_not_determine_is_taken_to_be_as_expected() {
    let bench = Bench::simulated("plausible-alike", &FAST_RIG.replace("0.117", "0.024"));
    let alone = bench.characterise("run.csv", &[]);
    assert_eq!(alone.code, 4, "{alone:#?}");
    let answer = bench.characterise("run.csv", &[&["--sensor", "T1=wire:50um"], &AIR[..]].concat());
    assert_eq!(answer.code, 0, "{answer:#?}");
    let answer = answer.json();
    let one = &answer["plausibility"][0];
    assert!(one["is_taken_as_known"] == true && one["is_outside"].is_null(), "{one:#}");
    let sensor = &answer["sensors"][1];
    assert_eq!(sensor["grade"], "conditional", "{sensor:#}");
    // What little the record says moves it within the standard deviation of what is expected.
    assert!((number(&sensor["time_constant_s"]) / EXPECTED_S - 1.0).abs() < 0.3, "{sensor:#}");
}

/// A known value for the same sensor would count twice; a size says nothing without a flow.
#[test]
fn what_does_not_go_together_is_refused() {
    let bench = Bench::simulated("plausible-refused", FAST_RIG);
    let refuses = |further: &[&str], words: &[&str]| {
        bench.refuses(2, &[&["characterise", "run.csv"], further].concat(), words);
    };
    refuses(&["--sensor", "T1=wire:50um"], &["--fluid", "air@20m/s"]);
    refuses(&["--fluid", "air@20m/s"], &["--sensor", "thermocouple:0.5mm"]);
    refuses(&["--sensor", "T1=0.1..0.2s", "--sensor", "T1=0.1..0.3s"], &["--sensor", "each sensor once"]);
    refuses(&["--sensor", "T1=0.1..0.2s", "--known", "T1=0.1s"], &["--known", "not known besides"]);
    refuses(&["--sensor", "T3=0.1..0.2s"], &["--sensor", "T1 or T2"]);
    refuses(&["--sensor", "T1=0.2..0.1s"], &["LOW..HIGH"]);
    refuses(&["--sensor", "T1=wire:50in", "--fluid", "air@20m/s"], &["--sensor", "um, mm, cm or m"]);
    refuses(&["--sensor", "T1=wire:50um", "--fluid", "honey@20m/s"], &["--fluid", "air or water"]);
    refuses(&["--sensor", "T1=wire:50um", "--fluid", "air@1mm/s"], &["reynolds", "range of the time constant"]);
}
