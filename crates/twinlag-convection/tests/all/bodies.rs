//! Bodies, flows and what another time constant would take.

use twinlag_convection::{Body, ConvectionError, Expected, Flow};

fn expected(body: &str, flow: &str) -> Result<Expected, ConvectionError> {
    Expected::of(&body.parse().expect("a body"), &flow.parse().expect("a flow"), 20.0)
}

/// The inverse of the correlation, whatever the shape, the fluid and the direction: the ends of a range of diameters or speeds have the
/// ends of the range of the time constant that was asked for. The solver stops at 1e-12 in the logarithm of the argument, of which
/// the time constant goes with a power of two at most.
#[test]
fn what_it_would_take_gives_what_was_asked() {
    for (body, flow) in
        [("wire:0.1mm", "air@5m/s"), ("bead:0.8mm", "air@20m/s,400C,5bar"), ("wire:0.1mm", "water@0.1m/s")]
    {
        let (body, flow): (Body, Flow) = (body.parse().expect("a body"), flow.parse().expect("a flow"));
        let as_given = Expected::of(&body, &flow, 20.0).expect("within the correlation");
        let factor = as_given.range_95_s()[1] / as_given.time_constant_s;
        for times in [0.9, 1.1] {
            let wanted_s = times * as_given.time_constant_s;
            let take = as_given.would_take(wanted_s);
            let [diameters_m, speeds_m_s] = [take.diameter_m, take.speed_m_s].map(|ends| ends.expect("near"));
            for end in 0..2 {
                let other = Body::new(body.shape, body.material, diameters_m[end]).expect("a body");
                let mut faster = flow;
                faster.speed_m_s = speeds_m_s[1 - end];
                let want_s = if end == 0 { wanted_s / factor } else { wanted_s * factor };
                for got in [Expected::of(&other, &flow, 20.0), Expected::of(&body, &faster, 20.0)] {
                    let got_s = got.expect("within the correlation").time_constant_s;
                    assert!((got_s / want_s - 1.0).abs() < 2e-12, "{body} in {flow}: got {got_s}, want {want_s}");
                }
            }
        }
    }
}

/// No diameter up to a metre and no speed gives a wire of 0.1 mm in air of 5 m/s a time constant of thirty years.
#[test]
fn what_cannot_be_is_not_given() {
    let take = expected("wire:0.1mm", "air@5m/s").expect("within the correlation").would_take(1e9);
    assert_eq!((take.diameter_m, take.speed_m_s), (None, None));
}

/// `4 ε σ T³` at 800 °C and 0.8 is 224 W/(m² K), by hand. At 20 m/s it shortens the time constant of a bare wire of base metal by what it
/// adds, and water lets none of it through.
#[test]
fn radiation_takes_part_in_hot_gas() {
    let with = expected("wire:0.5mm", "air@20m/s,800C").expect("within the correlation");
    let convection_w_m2_k = {
        let bright = expected("platinum:0.5mm", "air@20m/s,800C").expect("within the correlation");
        // The same wire of platinum has a quarter of the emissivity: both give the share of convection.
        let [metal, platinum] = [3.78e6, 2.85e6].map(|c| c * 0.25 * 0.5e-3);
        let [h_metal, h_platinum] = [metal / with.time_constant_s, platinum / bright.time_constant_s];
        h_platinum - (h_metal - h_platinum) / 3.0
    };
    let added = 3.78e6 * 0.25 * 0.5e-3 / with.time_constant_s - convection_w_m2_k;
    assert!((added - 224.0).abs() < 1.0, "{added}");
    assert!(with.log_std > 0.3);
}

/// A sphere of 0.706 mm with a heat capacity of 3.78 MJ/(m³ K) and `h` has a time constant of `ρc d/(6 h)`, a cylinder of `ρc d/(4 h)`: with
/// the same Nusselt number their ratio is 2/3.
#[test]
fn a_bead_has_two_thirds_of_the_volume_over_surface_of_a_wire() {
    let [wire, bead] =
        ["wire:0.7mm", "bead:0.7mm"].map(|b| expected(b, "water@0.01m/s").expect("within the correlation"));
    let ratio = bead.time_constant_s * bead.numbers.nusselt / (wire.time_constant_s * wire.numbers.nusselt);
    assert!((ratio - 2.0 / 3.0).abs() < 1e-12, "{ratio}");
}

#[test]
fn where_correlations_do_not_reach_is_said() {
    let fails = |body, flow| expected(body, flow).expect_err("refused");
    assert!(matches!(fails("wire:10um", "air@0.01m/s"), ConvectionError::Reynolds { .. }));
    assert!(matches!(fails("sheath:3mm", "water@2m/s"), ConvectionError::Biot { .. }));
    assert!(matches!(fails("wire:1mm", "water@1m/s,400C"), ConvectionError::Temperature { .. }));
    assert!(matches!(fails("wire:1mm", "air@1m/s,1e9C"), ConvectionError::Temperature { .. }));
    assert!(matches!(fails("bead:1mm", "air@1mm/s"), ConvectionError::Reynolds { .. }));
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
        ("air@20m/s,20C,300K", "one temperature and one pressure"),
    ] {
        let error = text.parse::<Flow>().expect_err("refused").to_string();
        assert!(error.contains(want), "{text}: {error}");
    }
}
