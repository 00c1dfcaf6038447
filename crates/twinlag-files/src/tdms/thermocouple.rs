//! Temperature from the voltage of a thermocouple, by the reference functions of ITS-90.

use thermocouple::prelude::{Celsius, Millivolts, ThermocoupleCore};
use thermocouple::{BType, EType, JType, KType, NType, RType, SType, TType};

/// A type of thermocouple, its cold junction at 0 °C.
#[derive(Clone, Copy, Debug)]
pub(super) struct Thermocouple {
    letter: char,
    /// Voltages, mV, that determine the temperature.
    range_mv: (f64, f64),
    emf_mv: fn(f64) -> f64,
    /// To 0.1 K.
    temperature_c: fn(f64) -> f64,
}

/// The functions of one type.
macro_rules! thermocouple {
    ($letter:literal, $kind:ident, $low_c:literal..$high_c:literal) => {{
        let emf_mv: fn(f64) -> f64 =
            |celsius| $kind::new().with_reference_temperature(Celsius(0.0)).sense_voltage(Celsius(celsius)).0;
        Thermocouple {
            letter: $letter,
            range_mv: (emf_mv($low_c), emf_mv($high_c)),
            emf_mv,
            temperature_c: |millivolts| {
                let celsius: Celsius =
                    $kind::new().with_reference_temperature(Celsius(0.0)).sense_temperature(Millivolts(millivolts));
                celsius.0
            },
        }
    }};
}

impl Thermocouple {
    /// The type that a number of National Instruments stands for.
    pub(super) fn of(number: f64) -> Option<Self> {
        Some(match number as u32 {
            10047 => thermocouple!('B', BType, 250.0..1820.0),
            10055 => thermocouple!('E', EType, -200.0..1000.0),
            10072 => thermocouple!('J', JType, -210.0..1200.0),
            10073 => thermocouple!('K', KType, -200.0..1372.0),
            10077 => thermocouple!('N', NType, -200.0..1300.0),
            10082 => thermocouple!('R', RType, -50.0..1768.1),
            10085 => thermocouple!('S', SType, -50.0..1768.1),
            10086 => thermocouple!('T', TType, -200.0..400.0),
            _ => return None,
        })
    }

    pub(super) fn letter(self) -> char {
        self.letter
    }

    /// The voltage `E(T)`, mV.
    pub(super) fn emf_mv(self, celsius: f64) -> f64 {
        (self.emf_mv)(celsius)
    }

    /// The temperature at which the reference function has this voltage, °C; NaN outside its range,
    /// as of a broken thermocouple.
    ///
    /// The published inverse polynomials are up to 0.06 K off and jump from one to the next. Steps with
    /// the slope over 1 K begin there: it is known to 1 % or better, so each leaves less than a
    /// hundredth of the error.
    pub(super) fn temperature_c(self, millivolts: f64) -> f64 {
        const STEPS: usize = 5;
        let (low, high) = self.range_mv;
        if !(low..=high).contains(&millivolts) {
            return f64::NAN;
        }
        let start = (self.temperature_c)(millivolts);
        let slope = self.emf_mv(start + 0.5) - self.emf_mv(start - 0.5);
        (0..STEPS).fold(start, |celsius, _| celsius - (self.emf_mv(celsius) - millivolts) / slope)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_temperature_is_that_of_the_voltage() {
        for (number, low, high) in [
            (10047.0, 250.0, 1820.0),
            (10055.0, -200.0, 1000.0),
            (10072.0, -210.0, 1200.0),
            (10073.0, -200.0, 1372.0),
            (10077.0, -200.0, 1300.0),
            (10082.0, -50.0, 1768.1),
            (10085.0, -50.0, 1768.1),
            (10086.0, -200.0, 400.0),
        ] {
            let thermocouple = Thermocouple::of(number).expect("a type");
            for step in 0..=2000 {
                let celsius = low + (high - low) * f64::from(step) / 2000.0;
                let back = thermocouple.temperature_c(thermocouple.emf_mv(celsius));
                // Rounding of the power series, in which terms of some hundred mV cancel, over a slope of 0.002 mV/K or more.
                assert!((back - celsius).abs() < 1e-9, "type {}: {celsius} °C and {back}", thermocouple.letter());
            }
        }
    }

    /// Values of the tables of NIST (Monograph 175), which are rounded to 0.001 mV.
    #[test]
    fn voltages_are_those_of_the_tables() {
        for (number, celsius, millivolts) in [
            (10047.0, 1000.0, 4.834),
            (10055.0, 500.0, 37.005),
            (10072.0, 760.0, 42.919),
            (10073.0, -200.0, -5.891),
            (10073.0, 1000.0, 41.276),
            (10077.0, 600.0, 20.613),
            (10082.0, 1000.0, 10.506),
            (10085.0, 1000.0, 9.587),
            (10086.0, 400.0, 20.872),
        ] {
            let emf_mv = Thermocouple::of(number).expect("a type").emf_mv(celsius);
            assert!((emf_mv - millivolts).abs() <= 0.0005 + 1e-9, "{number}: {emf_mv} mV at {celsius} °C");
        }
    }

    #[test]
    fn a_broken_thermocouple_has_no_temperature() {
        let type_k = Thermocouple::of(10073.0).expect("type K");
        assert!(type_k.temperature_c(100.0).is_nan() && type_k.temperature_c(-6.5).is_nan());
        assert!(type_k.temperature_c(f64::NAN).is_nan());
    }
}
