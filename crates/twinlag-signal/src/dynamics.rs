//! How a sensor moves: its state, the derivative of it, and the classical fourth-order Runge-Kutta
//! rule.
//!
//! The rule's error is of order `(h/τ)⁴` for a gas that is smooth on the scale of a step `h`: at
//! `h = τ/100` about 1e-10 of the swing. A gas held over each sample period is constant within
//! every step, and never seen across its jump.
//!
//! A new physical effect is a term in [`Sensor::derivative`], or in [`Sensor::calibrated_c`] if it
//! acts on the reading.
//!
//! Readings between two steps, which a delay asks for, are interpolated by the cubic with the
//! states and slopes of both (Hermite): its error is `h⁴ |T⁗|/384`.

use crate::effects::Play;
use crate::gas::GasPath;
use crate::surroundings::Surroundings;
use crate::{Hold, Sensor};

/// Temperatures of the sensor's bodies, °C: first pole, second pole, slow body. Bodies that a
/// sensor lacks stay put.
pub(crate) type State = [f64; 3];

impl Sensor {
    /// Rate of change of the state, K/s, at `time_s` in gas of `gas_c`.
    fn derivative(&self, surroundings: Surroundings, time_s: f64, gas_c: f64, state: &State) -> State {
        let [first_c, second_c, slow_c] = *state;
        let mut tau_s = self.time_constant_s * surroundings.factor(self, time_s);
        if let Some(dependence) = &self.temperature_dependence {
            tau_s *= dependence.factor(first_c, gas_c);
        }
        let loss_k = self.radiation.map_or(0.0, |radiation| radiation.loss_k(first_c));
        [
            (gas_c - first_c - loss_k) / tau_s,
            self.second_time_constant_s.map_or(0.0, |tau_s| (first_c - second_c) / tau_s),
            self.slow_mode.map_or(0.0, |mode| (self.direct_c(state) - slow_c) / mode.time_constant_s),
        ]
    }

    /// What the sensor would read by its direct path alone, °C.
    fn direct_c(&self, state: &State) -> f64 {
        if self.second_time_constant_s.is_some() { state[1] } else { state[0] }
    }

    /// Temperature of the junction, °C.
    fn junction_c(&self, state: &State) -> f64 {
        let direct_c = self.direct_c(state);
        self.slow_mode.map_or(direct_c, |mode| direct_c + mode.fraction * (state[2] - direct_c))
    }

    /// What the calibration makes of a junction at `junction_c`, °C.
    fn calibrated_c(&self, junction_c: f64) -> f64 {
        let linear_c = self.gain * junction_c + self.offset_k;
        if self.curvature_per_k == 0.0 {
            linear_c
        } else {
            linear_c + self.curvature_per_k * (junction_c - self.curvature_about_c).powi(2)
        }
    }

    /// When the samples from time zero on are read, in integration steps after the start of the
    /// run-in, not before it.
    fn read_at_steps(&self, gas: &GasPath, oversampling: usize) -> Vec<f64> {
        let grid = gas.grid;
        let (samples, settle) = (grid.samples(), grid.before / grid.per_sample);
        let period_s = grid.sample_period_s();
        (settle..samples)
            .map(|sample| {
                let late_s =
                    self.delay_s + self.clock_slip.map_or(0.0, |slip| slip.late_s((sample - settle) as f64 * period_s));
                // Without a delay this is a whole number, and no interpolation.
                ((sample * oversampling) as f64 - late_s / period_s * oversampling as f64).max(0.0)
            })
            .collect()
    }

    /// Readings at the sample instants from time zero on, °C. Starts in equilibrium with the gas at
    /// the grid's start, radiation aside.
    ///
    /// - `surroundings`: what changes the first time constant
    /// - `oversampling`: integration steps per sample period, the number with which `gas` was made
    pub(crate) fn follow(&self, gas: &GasPath, surroundings: Surroundings, oversampling: usize) -> Vec<f64> {
        let grid = gas.grid;
        let step_s = grid.sample_period_s() / oversampling as f64;
        let samples = grid.samples();
        let read_at = self.read_at_steps(gas, oversampling);
        // A slipping clock reads some times twice: in the order of time, and each put where it
        // belongs.
        let mut order: Vec<usize> = (0..read_at.len()).collect();
        order.sort_by(|&a, &b| read_at[a].total_cmp(&read_at[b]));
        let mut pending = order.into_iter().peekable();

        let mut readings_c = vec![0.0; read_at.len()];
        let mut state = [gas.values_c[0]; 3];
        let mut play = Play::new(self.hysteresis, self.junction_c(&state));
        for sample in 0..samples - 1 {
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
                let derivative = |t: f64, x: f64, s: &State| self.derivative(surroundings, t, x, s);
                let next = runge_kutta_4(&state, time_s, step_s, during_c, derivative);
                let now = (sample * oversampling + step) as f64;
                while let Some(reading) = pending.next_if(|&reading| read_at[reading] < now + 1.0) {
                    let u = read_at[reading] - now;
                    let then = if u == 0.0 {
                        state
                    } else {
                        let slopes =
                            [derivative(time_s, during_c[0], &state), derivative(time_s + step_s, during_c[2], &next)];
                        hermite(u, step_s, [&state, &next], slopes)
                    };
                    readings_c[reading] = self.calibrated_c(play.output_c(self.junction_c(&then)));
                }
                state = next;
                play.advance(self.junction_c(&state));
            }
        }
        for reading in pending {
            readings_c[reading] = self.calibrated_c(play.output_c(self.junction_c(&state)));
        }
        readings_c
    }
}

/// The cubic through two states with their slopes, at the part `u` of the step between them.
fn hermite(u: f64, step_s: f64, states: [&State; 2], slopes: [State; 2]) -> State {
    let v = 1.0 - u;
    std::array::from_fn(|i| {
        let level = v * v * (1.0 + 2.0 * u) * states[0][i] + u * u * (1.0 + 2.0 * v) * states[1][i];
        level + step_s * u * v * (v * slopes[0][i] - u * slopes[1][i])
    })
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
