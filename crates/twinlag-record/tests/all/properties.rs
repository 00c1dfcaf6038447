//! What holds for every record and every file.

use crate::common::record_with;
use proptest::prelude::*;
use twinlag_record::{Channels, Decimals, Record, SamplingChoice, Selection, Table, write_csv};

fn cell() -> impl Strategy<Value = f64> {
    prop_oneof![8 => -273.15..5000.0, 1 => Just(f64::NAN), 1 => -1e-9..1e-9]
}

fn same(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan()))
}

proptest! {
    #[test]
    fn a_record_written_and_read_back_is_the_same_to_the_bit(
        cells in prop::collection::vec((1e-6..10.0, cell(), cell(), cell()), 12..40),
    ) {
        let mut time_s = vec![0.0];
        for (step_s, ..) in &cells[1..] {
            time_s.push(time_s[time_s.len() - 1] + step_s);
        }
        let channels = Channels {
            source: "made".to_owned(),
            names: ["T1", "T2"].map(str::to_owned),
            time_s,
            t1_c: cells.iter().map(|cell| cell.1).collect(),
            t2_c: cells.iter().map(|cell| cell.2).collect(),
            reference_c: Some(cells.iter().map(|cell| cell.3).collect()),
        };
        let want = Record::from_channels(channels, SamplingChoice::Auto);
        prop_assume!(want.is_ok());
        let want = want.unwrap();
        let mut bytes = Vec::new();
        want.write_csv(&mut bytes, Decimals::Shortest).unwrap();
        let selection = Selection { reference: "Tref".parse().ok(), ..Selection::default() };
        let got = record_with(&bytes, &selection).unwrap();
        prop_assert!(same(&got.time_s, &want.time_s) && same(&got.t1_c, &want.t1_c) && same(&got.t2_c, &want.t2_c));
        prop_assert!(same(got.reference_c.as_deref().unwrap(), want.reference_c.as_deref().unwrap()));
        prop_assert_eq!((got.sampling, got.segments, got.missing), (want.sampling, want.segments, want.missing));
    }

    #[test]
    fn arbitrary_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = record_with(&bytes, &Selection::default());
        let _ = Table::read(&[b"\xFF\xFE", &bytes[..]].concat(), "x");
    }

    /// Bytes that loggers do use come further than arbitrary ones.
    #[test]
    fn text_of_the_right_letters_never_panics(
        text in "(([0-9]{1,3}[.,:/-]?[0-9]{0,2}|NaN|OL|T1 \\[°C\\]|time|\"|#|[a-z]{1,3}|)[,; \t\n|]){0,80}",
        header in prop_oneof![Just(""), Just("time,T1,T2\n"), Just("Zeit;T1;T2\n"), Just("T1\tT2\n")],
    ) {
        let text = format!("{header}{text}");
        let _ = record_with(text.as_bytes(), &Selection::default());
        let _ = record_with(text.as_bytes(), &Selection { period_s: Some(0.1), ..Selection::default() });
    }

    /// Rows that are well formed reach the clock, the grid and the segments.
    #[test]
    fn rows_of_any_numbers_never_panic(
        rows in prop::collection::vec((any::<f64>(), any::<f64>(), any::<f64>()), 8..30), sort in any::<bool>(),
    ) {
        let mut rows = rows;
        if sort {
            rows.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        let text: Vec<_> = rows.iter().map(|(t, a, b)| format!("{t:e},{},{}", a % 1000.0, b % 1000.0)).collect();
        let _ = record_with(format!("time,T1,T2\n{}\n", text.join("\n")).as_bytes(), &Selection::default());
    }
}

#[test]
fn fixed_decimals_missing_cells_and_names_are_written_plainly() {
    let mut out = Vec::new();
    write_csv(&mut out, &[("t", &[0.0, 0.5]), ("a,\"b\"", &[1.25, f64::NAN])], Decimals::Fixed(2)).unwrap();
    assert_eq!(String::from_utf8(out).unwrap(), "t,\"a,\"\"b\"\"\"\n0.00,1.25\n0.50,\n");
    let error = write_csv(&mut Vec::new(), &[("t", &[0.0]), ("a", &[])], Decimals::Shortest).unwrap_err().to_string();
    assert!(error.contains("a has 0 samples, expected 1"), "{error}");
}
