//! How a sensor moves: its state, the derivative of it, and the classical fourth-order Runge-Kutta rule.
//!
//! The rule's error is of order `(h/τ)⁴` for a gas that is smooth on the scale of a step `h`: at `h = τ/100` about
//! 1e-10 of the swing. A gas held over each sample period is constant within every step, and never seen across its
//! jump.
//!
//! A new physical effect is a term in [`Sensor::derivative`], or in [`Sensor::reading_c`] if it acts on the reading.

use crate::gas::GasPath;
use crate::{Hold, Sensor};

/// Temperatures of the sensor's bodies, °C: first pole, second pole, slow body. Bodies that a sensor lacks stay put.
pub(crate) type State = [f64; 3];

impl Sensor {
    /// Rate of change of the state, K/s, at `time_s` in gas of `gas_c`.
    pub(crate) fn derivative(&self, _time_s: f64, gas_c: f64, state: &State) -> State {
        let [first_c, second_c, slow_c] = *state;
        [
            (gas_c - first_c) / self.time_constant_s,
            self.second_time_constant_s.map_or(0.0, |tau_s| (first_c - second_c) / tau_s),
            self.slow_mode.map_or(0.0, |mode| (self.direct_c(state) - slow_c) / mode.time_constant_s),
        ]
    }

    /// What the sensor would read by its direct path alone, °C.
    fn direct_c(&self, state: &State) -> f64 {
        if self.second_time_constant_s.is_some() { state[1] } else { state[0] }
    }

    /// The reading without noise and ADC, °C.
    pub(crate) fn reading_c(&self, state: &State) -> f64 {
        let direct_c = self.direct_c(state);
        let junction_c = self.slow_mode.map_or(direct_c, |mode| direct_c + mode.fraction * (state[2] - direct_c));
        self.gain * junction_c + self.offset_k
    }

    /// Readings at the sample instants from time zero on, °C. Starts in equilibrium with the gas at the grid's start.
    ///
    /// - `oversampling`: integration steps per sample period, the number with which `gas` was made
    pub(crate) fn follow(&self, gas: &GasPath, oversampling: usize) -> Vec<f64> {
        let grid = gas.grid;
        let step_s = grid.sample_period_s() / oversampling as f64;
        let (samples, settle) = (grid.samples(), grid.before / grid.per_sample);
        let mut readings_c = Vec::with_capacity(samples - settle);
        let mut state = [gas.values_c[0]; 3];
        for sample in 0..samples {
            if sample >= settle {
                readings_c.push(self.reading_c(&state));
            }
            if sample + 1 == samples {
                break;
            }
            let start = sample * grid.per_sample;
            for step in 0..oversampling {
                let during_c = match gas.hold {
                    Hold::ZeroOrder => [gas.values_c[start]; 3],
                    Hold::Continuous => {
                        let half = start + 2 * step;
                        [gas.values_c[half], gas.values_c[half + 1], gas.values_c[half + 2]]
                    }
                };
                let time_s = grid.time_s(start) + step as f64 * step_s;
                state = runge_kutta_4(&state, time_s, step_s, during_c, |t, x, s| self.derivative(t, x, s));
            }
        }
        readings_c
    }
}

/// One step of the classical rule; `gas_c` at the step's start, middle and end.
fn runge_kutta_4(
    state: &State,
    time_s: f64,
    step_s: f64,
    gas_c: [f64; 3],
    derivative: impl Fn(f64, f64, &State) -> State,
) -> State {
    let moved = |slope: &State, by_s: f64| -> State { std::array::from_fn(|i| state[i] + by_s * slope[i]) };
    let half_s = 0.5 * step_s;
    let k1 = derivative(time_s, gas_c[0], state);
    let k2 = derivative(time_s + half_s, gas_c[1], &moved(&k1, half_s));
    let k3 = derivative(time_s + half_s, gas_c[1], &moved(&k2, half_s));
    let k4 = derivative(time_s + step_s, gas_c[2], &moved(&k3, step_s));
    std::array::from_fn(|i| state[i] + step_s / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]))
}
