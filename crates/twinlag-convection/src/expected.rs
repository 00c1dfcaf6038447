//! The time constant that a sensor should have.

use argmin::core::{CostFunction, Error as ArgminError, Executor, State};
use argmin::solver::brent::BrentRoot;
use serde::{Deserialize, Serialize};

use crate::body::Body;
use crate::correlation::{Correlation, Nusselt};
use crate::error::ConvectionError;
use crate::flow::Flow;

/// Standard deviation of a time constant, as a share of what is expected.
///
/// Measured: the response times of sheathed thermocouples in air that makers list differ from what is expected by 30 % in the mean
/// square (`tests/makers.rs`). Everything is in that: the correlation, which is within 30 % of what was measured; alloys, whose
/// heat capacities differ by 15 %; diameters and speeds as they are named. Of spheres, for which no list was to be had, the
/// correlation is as good.
const RELATIVE_STD: f64 = 0.3;
/// Biot number above which the temperature inside differs from that at the surface, so that the sensor is no first-order lag
/// (the usual limit of lumped heat capacity).
const MAX_BIOT: f64 = 0.1;
/// Diameters (m) and speeds (m/s) in which those that a time constant would take are looked for.
const DIAMETERS_M: [f64; 2] = [1e-7, 1.0];
const SPEEDS_M_S: [f64; 2] = [1e-5, 1e3];

/// The time constant that a body has in a flow, with what it was computed from.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Expected {
    /// Time constant, s.
    pub time_constant_s: f64,
    /// Its standard deviation, s.
    pub std_s: f64,
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

/// What another time constant would take, each with all else as it is; `None` where no such value is within reason.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct WouldTake {
    /// Diameter, m.
    pub diameter_m: Option<f64>,
    /// Speed of the fluid, m/s.
    pub speed_m_s: Option<f64>,
}

impl Expected {
    /// The time constant of `body` in `flow`.
    ///
    /// - `temperature_c`: the mean of the readings, where the flow has no temperature of its own
    ///
    /// # Errors
    /// [`ConvectionError`] where properties or correlation do not reach, or the body has no single temperature.
    pub fn of(body: &Body, flow: &Flow, temperature_c: f64) -> Result<Self, ConvectionError> {
        let temperature_c = flow.temperature_c.unwrap_or(temperature_c);
        let fluid = flow.fluid.properties(temperature_c, flow.pressure_pa)?;
        let correlation = Correlation::of(body.shape);
        let reynolds = flow.speed_m_s * body.diameter_m / fluid.viscosity_m2_s;
        let numbers = correlation.checked(reynolds, fluid.prandtl, flow.speed_m_s)?;
        let h_w_m2_k = numbers.nusselt * fluid.conductivity_w_m_k / body.diameter_m;
        let biot = body.biot(h_w_m2_k);
        if biot > MAX_BIOT {
            return Err(ConvectionError::Biot { biot, limit: MAX_BIOT });
        }
        let time_constant_s = body.time_constant_s(h_w_m2_k);
        let std_s = RELATIVE_STD * time_constant_s;
        Ok(Self { time_constant_s, std_s, body: *body, flow: *flow, temperature_c, correlation, numbers })
    }

    /// What a time constant of `time_constant_s` would take.
    pub fn would_take(&self, time_constant_s: f64) -> WouldTake {
        let of = |body: Body, flow: Flow| Self::of(&body, &flow, self.temperature_c).ok().map(|e| e.time_constant_s);
        let (body, flow) = (self.body, self.flow);
        let diameter = |diameter_m| of(Body { diameter_m, ..body }, flow);
        let speed = |speed_m_s| of(body, Flow { speed_m_s, ..flow });
        WouldTake {
            diameter_m: where_it_is(time_constant_s, DIAMETERS_M, self.body.diameter_m, diameter),
            speed_m_s: where_it_is(time_constant_s, SPEEDS_M_S, self.flow.speed_m_s, speed),
        }
    }
}

/// The argument at which `time_constant` is `wanted_s`; `None` where it is not between `ends`, or `time_constant` not known there.
///
/// - `start`: an argument at which it is known
fn where_it_is(wanted_s: f64, ends: [f64; 2], start: f64, time_constant: impl Fn(f64) -> Option<f64>) -> Option<f64> {
    // The time constant goes with the argument everywhere, so the farthest known argument to each side bounds it.
    let ends = ends.map(|end| {
        let step = (end / start).powf(1.0 / 64.0);
        let known = (0..=64).map(|k| start * step.powi(k)).take_while(|at| time_constant(*at).is_some());
        known.last().unwrap_or(start)
    });
    let root = Root { wanted_s, time_constant };
    let [low, high] = ends.map(f64::ln);
    let is_between = root.excess(low)? * root.excess(high)? < 0.0;
    if !is_between {
        return None;
    }
    let solver = BrentRoot::new(low, high, 1e-12);
    let found = Executor::new(root, solver).configure(|state| state.max_iters(100)).run().ok()?;
    found.state.get_best_param().map(|at| at.exp())
}

/// How far the time constant at the logarithm of an argument is from the one that is wanted.
struct Root<F> {
    wanted_s: f64,
    time_constant: F,
}

impl<F: Fn(f64) -> Option<f64>> Root<F> {
    fn excess(&self, log_argument: f64) -> Option<f64> {
        (self.time_constant)(log_argument.exp()).map(|s| (s / self.wanted_s).ln())
    }
}

impl<F: Fn(f64) -> Option<f64>> CostFunction for Root<F> {
    type Param = f64;
    type Output = f64;

    fn cost(&self, log_argument: &f64) -> Result<f64, ArgminError> {
        self.excess(*log_argument).ok_or_else(|| ArgminError::msg("outside of the correlation"))
    }
}
