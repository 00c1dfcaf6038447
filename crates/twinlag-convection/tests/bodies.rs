//! Bodies, flows and what another time constant would take.

use twinlag_convection::{Body, ConvectionError, Expected, Flow};

fn expected(body: &str, flow: &str) -> Result<Expected, ConvectionError> {
    Expected::of(&body.parse().expect("a body"), &flow.parse().expect("a flow"), 20.0)
}

/// The inverse of the correlation, whatever the shape, the fluid and the direction: a diameter or a speed that it gives has the
/// time constant that was asked, to the solver's 1e-12 in the logarithm.
#[test]
fn what_it_would_take_gives_what_was_asked() {
    for (body, flow) in
        [("wire:0.1mm", "air@5m/s"), ("bead:0.8mm", "air@20m/s,800C,5bar"), ("wire:0.1mm", "water@0.1m/s")]
    {
        let (body, flow): (Body, Flow) = (body.parse().expect("a body"), flow.parse().expect("a flow"));
        let as_given = Expected::of(&body, &flow, 20.0).expect("within the correlation");
        for factor in [0.7, 1.4] {
            let wanted_s = factor * as_given.time_constant_s;
            let take = as_given.would_take(wanted_s);
            let other = Body::new(body.shape, body.material, take.diameter_m.expect("near")).expect("a body");
            let mut faster = flow;
            faster.speed_m_s = take.speed_m_s.expect("near");
            for got in [Expected::of(&other, &flow, 20.0), Expected::of(&body, &faster, 20.0)] {
                let got_s = got.expect("within the correlation").time_constant_s;
                assert!((got_s / wanted_s - 1.0).abs() < 1e-9, "{body} in {flow}: got {got_s}, want {wanted_s}");
            }
        }
    }
}

/// A time constant that no diameter and no speed gives has neither: water makes no millimetre wire lag for an hour.
#[test]
fn what_cannot_be_is_not_given() {
    let take = expected("wire:0.1mm", "air@5m/s").expect("within the correlation").would_take(1e9);
    assert_eq!((take.diameter_m, take.speed_m_s), (None, None));
}

#[test]
fn where_correlations_do_not_reach_is_said() {
    let fails = |body, flow| expected(body, flow).expect_err("refused");
    assert!(matches!(fails("wire:10um", "air@0.01m/s"), ConvectionError::Reynolds { .. }));
    assert!(matches!(fails("sheath:3mm", "water@2m/s"), ConvectionError::Biot { .. }));
    assert!(matches!(fails("wire:1mm", "water@1m/s,400C"), ConvectionError::Temperature { .. }));
    assert!(matches!(fails("wire:1mm", "air@1m/s,1e9C"), ConvectionError::Temperature { .. }));
}

#[test]
fn texts_that_are_none_say_what_was_expected() {
    for (text, want) in [
        ("thermocouple", "a kind, a colon and a diameter"),
        ("rod:1mm", "thermocouple, wire, platinum, bead or sheath, got 'rod'"),
        ("wire:1in", "a diameter in um, mm, cm or m, got '1in'"),
        ("wire:-1mm", "a diameter in um, mm, cm or m"),
        ("wire:0mm", "a diameter in um, mm, cm or m"),
        ("wire:NaNmm", "a diameter in um, mm, cm or m"),
    ] {
        let error = text.parse::<Body>().expect_err("refused").to_string();
        assert!(error.contains(want), "{text}: {error}");
    }
    for (text, want) in [
        ("air", "a fluid, @ and its speed"),
        ("oil@1m/s", "air or water, got 'oil'"),
        ("air@0m/s", "a speed above 0"),
        ("air@20", "a speed above 0 in m/s"),
        ("air@20m/s,hot", "a temperature in C or K, or a pressure"),
        ("air@20m/s,xC", "a temperature in C or K"),
    ] {
        let error = text.parse::<Flow>().expect_err("refused").to_string();
        assert!(error.contains(want), "{text}: {error}");
    }
}
