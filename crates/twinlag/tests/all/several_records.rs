//! One pair of time constants for several records of one rig.

use crate::common::record;
use twinlag::record::Record;
use twinlag::{Error, Options, OwnTimeConstant, Setting, Status, characterise, characterise_records};

const TRUTH_S: [f64; 2] = [0.0238, 0.1168];

/// A record of the rig, the second sensor with `second_s`.
fn run(seed: u64, second_s: f64) -> Record {
    let gas = "kind = \"turbulence\"\nstd_k = 15.0\ncorner_hz = 3.0\ncutoff_hz = 60.0";
    let sensors = [TRUTH_S[0], second_s].map(|t| format!("time_constant_s = {t}\nnoise = {{ std_k = 0.3 }}"));
    record(seed, 2000, 0.002, gas, [&sensors[0], &sensors[1]])
}

/// Four records say twice as much as one, each of them its part, and none contradicts the others. An estimate is four standard errors
/// off once in 16 000 records.
#[test]
fn several_records_give_one_pair_of_time_constants() {
    let records: Vec<Record> = (1..=4).map(|seed| run(seed, TRUTH_S[1])).collect();
    let together = characterise_records(&records, &Options::default()).expect("four records of one rig");
    assert_eq!((together.status, together.records.len()), (Status::Ok, 4));
    let transfer = together.transfer.expect("each was left out");
    assert_eq!(transfer.count, 4);
    let rms = transfer.error.held_out_normalised_rms;
    assert_eq!(rms.before, rms.after, "there are no effects");
    // Of 8000 residuals it is known to 1/√16000, and the noise levels of four records by third differences to as much: four of both.
    assert!((rms.after - 1.0).abs() < 4.0 * (2.0_f64 / 16_000.0).sqrt(), "{rms:?}");
    let alone = characterise(&records[0], &Options::default()).expect("one record");
    for (i, truth_s) in TRUTH_S.into_iter().enumerate() {
        let [all, one] = [&together, &alone].map(|answer| answer.sensors[i].standard_error_s.expect("determined"));
        let got_s = together.sensors[i].time_constant_s.expect("determined");
        assert!((got_s - truth_s).abs() < 4.0 * all, "{got_s} ± {all} s");
        let own: Vec<OwnTimeConstant> =
            together.records.iter().map(|record| record.time_constants[i].expect("each determines it")).collect();
        for own in &own {
            assert!((own.value_s - truth_s).abs() < 4.0 * own.standard_error_s, "{own:?}");
        }
        // What they know adds up, but for what their gases correlate both time constants otherwise; and each knows about as much.
        let of_all = own.iter().map(|own| own.standard_error_s.powi(-2)).sum::<f64>().powf(-0.5);
        assert!((all / of_all - 1.0).abs() < 0.1, "{all} and {of_all} s");
        assert!((0.35..0.65).contains(&(all / one)), "{all} and {one} s");
    }
    assert!(together.records.iter().all(|record| record.agrees == Some(true)), "{:?}", together.records);
}

/// Three records of a rig and one whose second sensor was replaced.
#[test]
fn a_record_of_another_sensor_is_named() {
    let mut records: Vec<Record> = (1..=3).map(|seed| run(seed, TRUTH_S[1])).collect();
    records.push(run(4, 1.3 * TRUTH_S[1]));
    let answer = characterise_records(&records, &Options::default()).expect("four records");
    assert_eq!(answer.status, Status::ModelRejected);
    let agrees: Vec<Option<bool>> = answer.records.iter().map(|record| record.agrees).collect();
    assert_eq!(agrees, [Some(true), Some(true), Some(true), Some(false)]);
    // What all of them share is not given, and so is none of their own.
    assert!(answer.sensors.iter().all(|sensor| sensor.time_constant_s.is_none()));
    assert!(answer.records.iter().all(|record| record.time_constants == [None; 2]));
}

/// What is asked of a single record is refused, by its name, and so are records of two sample periods.
#[test]
fn what_several_records_cannot_have_is_refused() {
    let records: Vec<Record> = (1..=2).map(|seed| run(seed, TRUTH_S[1])).collect();
    let options = Options::default().free("gain").expect("a parameter");
    let error = characterise_records(&records, &options).expect_err("of a single record");
    assert_eq!(error.settings(), [Setting::Free]);
    let gas = "kind = \"turbulence\"\nstd_k = 15.0\ncorner_hz = 3.0\ncutoff_hz = 60.0";
    let sensors = TRUTH_S.map(|t| format!("time_constant_s = {t}\nnoise = {{ std_k = 0.3 }}"));
    let slower = record(3, 2000, 0.004, gas, [&sensors[0], &sensors[1]]);
    let error = characterise_records(&[records[0].clone(), slower], &Options::default()).expect_err("two periods");
    assert!(matches!(error, Error::OtherPeriod { first_s: 0.002, period_s: 0.004, .. }), "{error}");
    assert!(error.to_string().contains("0.002 s, got 0.004 s"), "{error}");
}
