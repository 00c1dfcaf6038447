//! The time constant that a sensor should have.

use argmin::core::{CostFunction, Error as ArgminError, Executor};
use argmin::solver::brent::BrentRoot;
use serde::{Deserialize, Serialize};

use crate::body::Body;
use crate::correlation::{Correlation, Nusselt};
use crate::error::ConvectionError;
use crate::flow::Flow;
use crate::fluid::ZERO_CELSIUS_K;

/// Standard deviation of the logarithm of a time constant beside what convection alone makes one expect.
///
/// Response times of sheathed thermocouples of 0.5 to 3 mm in air of 2 m/s that makers list differ from what is expected by 0.3 in
/// the mean square (`tests/makers.rs`, seven values). For wires, beads, water and other speeds the same is taken: both correlations are
/// within 30 % of what was measured, and alloys have heat capacities within 20 %. How well a user knows speed and diameter is not
/// in it.
const LOG_STD: f64 = 0.3;
/// Standard deviation of the share that radiation has in the heat transfer, relative: emissivities are hardly known better.
const RADIATION_RELATIVE_STD: f64 = 0.5;
/// Standard deviations to either end of a 95 % range.
const DEVIATIONS_95: f64 = 1.96;
/// Biot number above which the temperature inside differs from that at the surface, so that the sensor is no first-order lag
/// (the usual limit of lumped heat capacity).
const MAX_BIOT: f64 = 0.1;
/// Stefan-Boltzmann constant, W/(m² K⁴).
const STEFAN_BOLTZMANN: f64 = 5.670_374e-8;
/// Diameters (m) and speeds (m/s) in which those that a time constant would take are looked for.
const DIAMETERS_M: [f64; 2] = [1e-7, 1.0];
const SPEEDS_M_S: [f64; 2] = [1e-5, 1e3];
/// Steps in which the reach of the correlation is found, each 6 to 7 per cent of the argument.
const REACH_STEPS: i32 = 256;

/// The time constant that a body has in a flow, with what it was computed from.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Expected {
    /// Time constant, s: the middle of its range.
    pub time_constant_s: f64,
    /// Standard deviation of its logarithm.
    pub log_std: f64,
    /// The body.
    pub body: Body,
    /// The flow.
    pub flow: Flow,
    /// Temperature that properties are taken at, °C.
    pub temperature_c: f64,
    /// The correlation for its shape.
    pub correlation: Correlation,
    /// Nusselt and Reynolds numbers.
    pub numbers: Nusselt,
}

/// What another time constant would take, each with all else as it is: the range in which 95 % of such sensors would have it. `None`
/// where the correlation does not reach so far.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct WouldTake {
    /// Diameters, m.
    pub diameter_m: Option<[f64; 2]>,
    /// Speeds of the fluid, m/s.
    pub speed_m_s: Option<[f64; 2]>,
}

impl Expected {
    /// The time constant of `body` in `flow`: with the heat transfer of convection and, in a gas, that of small changes of radiation,
    /// `4 ε σ T³`.
    ///
    /// - `temperature_c`: the mean of the readings, where the flow has no temperature of its own
    ///
    /// # Errors
    /// [`ConvectionError`] where properties or correlation do not reach, or the body has no single temperature.
    pub fn of(body: &Body, flow: &Flow, temperature_c: f64) -> Result<Self, ConvectionError> {
        let is_positive = |value: f64| value.is_finite() && value > 0.0;
        for (what, value) in [("the diameter in m", body.diameter_m), ("the speed in m/s", flow.speed_m_s)] {
            if !is_positive(value) {
                return Err(ConvectionError::NotPositive { what, value });
            }
        }
        let temperature_c = flow.temperature_c.unwrap_or(temperature_c);
        let fluid = flow.fluid.properties(temperature_c, flow.pressure_pa)?;
        let correlation = Correlation::of(body.shape);
        let reynolds = flow.speed_m_s * body.diameter_m / fluid.viscosity_m2_s;
        let numbers = correlation.checked(reynolds, fluid.prandtl, flow.speed_m_s)?;
        let of_convection = numbers.nusselt * fluid.conductivity_w_m_k / body.diameter_m;
        let of_radiation = if flow.fluid.is_transparent() {
            4.0 * body.material.emissivity() * STEFAN_BOLTZMANN * (temperature_c + ZERO_CELSIUS_K).powi(3)
        } else {
            0.0
        };
        let h_w_m2_k = of_convection + of_radiation;
        let biot = body.biot(h_w_m2_k);
        if biot > MAX_BIOT {
            return Err(ConvectionError::Biot { biot, limit: MAX_BIOT });
        }
        Ok(Self {
            time_constant_s: body.time_constant_s(h_w_m2_k),
            log_std: LOG_STD.hypot(RADIATION_RELATIVE_STD * of_radiation / h_w_m2_k),
            body: *body,
            flow: *flow,
            temperature_c,
            correlation,
            numbers,
        })
    }

    /// The range that holds 95 % of such time constants, s.
    pub fn range_95_s(&self) -> [f64; 2] {
        self.around(self.time_constant_s)
    }

    /// What 95 % of such sensors are within if `time_constant_s` is expected, s.
    fn around(&self, time_constant_s: f64) -> [f64; 2] {
        let factor = (DEVIATIONS_95 * self.log_std).exp();
        [time_constant_s / factor, time_constant_s * factor]
    }

    /// What a time constant of `time_constant_s` would take.
    pub fn would_take(&self, time_constant_s: f64) -> WouldTake {
        let of = |body: Body, flow: Flow| Self::of(&body, &flow, self.temperature_c).ok().map(|e| e.time_constant_s);
        let (body, flow) = (self.body, self.flow);
        let ends_s = self.around(time_constant_s);
        let range = |within, start, time_constant: &dyn Fn(f64) -> Option<f64>| {
            let [one, other] = ends_s.map(|end_s| solved(end_s, within, start, time_constant));
            one.zip(other).map(|(one, other)| [one.min(other), one.max(other)])
        };
        WouldTake {
            diameter_m: range(DIAMETERS_M, body.diameter_m, &|diameter_m| of(Body { diameter_m, ..body }, flow)),
            speed_m_s: range(SPEEDS_M_S, flow.speed_m_s, &|speed_m_s| of(body, Flow { speed_m_s, ..flow })),
        }
    }
}

/// The argument at which `time_constant` is `wanted_s`; `None` where it is not `within` these, or `time_constant` not known there.
///
/// - `start`: an argument at which it is known
fn solved(wanted_s: f64, within: [f64; 2], start: f64, time_constant: &dyn Fn(f64) -> Option<f64>) -> Option<f64> {
    // The time constant rises or falls with the argument all along, so the farthest known argument to each side bounds it.
    let ends = within.map(|end| {
        let step = (end / start).powf(1.0 / f64::from(REACH_STEPS));
        let known = (0..=REACH_STEPS).map(|k| start * step.powi(k)).take_while(|at| time_constant(*at).is_some());
        known.last().unwrap_or(start)
    });
    let root = Root { wanted_s, time_constant };
    let [low, high] = ends.map(f64::ln);
    let is_between = root.excess(low)? * root.excess(high)? <= 0.0;
    if !is_between {
        return None;
    }
    let solver = BrentRoot::new(low, high, 1e-12);
    let found = Executor::new(root, solver).configure(|state| state.max_iters(100)).run().ok()?;
    found.state.best_param.map(f64::exp)
}

/// How far the time constant at the logarithm of an argument is from the one that is wanted.
struct Root<'a> {
    wanted_s: f64,
    time_constant: &'a dyn Fn(f64) -> Option<f64>,
}

impl Root<'_> {
    fn excess(&self, log_argument: f64) -> Option<f64> {
        (self.time_constant)(log_argument.exp()).map(|s| (s / self.wanted_s).ln())
    }
}

impl CostFunction for Root<'_> {
    type Param = f64;
    type Output = f64;

    fn cost(&self, log_argument: &f64) -> Result<f64, ArgminError> {
        self.excess(*log_argument).ok_or_else(|| ArgminError::msg("outside of the correlation"))
    }
}
