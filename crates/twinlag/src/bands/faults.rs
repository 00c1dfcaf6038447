//! What a gas temperature cannot be, whatever it is: by laws of two lags that need no prior.

use std::fmt;

use serde::{Deserialize, Serialize};
use twinlag_compensate::{Readings, Rig};

const ABSOLUTE_ZERO_C: f64 = -273.15;
/// Windows in which sensors are at rest, in units of all their time constants together.
const WINDOW_LAGS: f64 = 5.0;
/// Samples of a window, at least.
const MIN_WINDOW_SAMPLES: usize = 32;
/// Standard deviations by which the gas may be off in the mean over a window: neighbouring errors go together, so the
/// mean may err as much as each.
const MAX_DEVIATIONS: f64 = 5.0;
/// Share of the reading's mean square change that the gas has at least. One at an infinite record; the rest is room for its
/// ends. Chosen.
const MIN_CHANGE_SHARE: f64 = 0.8;
/// Standard errors of the noise's mean square by which the change may fall short beside that.
const MAX_CHANGE_ERRORS: f64 = 5.0;

/// Something in a gas temperature that shows that the model is wrong.
///
/// ```
/// use twinlag::GasFault;
///
/// let fault = GasFault::Widened { factor: 1.4 };
/// assert!(fault.to_string().contains("1.40 times"));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(tag = "kind", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum GasFault {
    /// The gas is far from two sensors that are at rest and agree.
    FarAtRest {
        /// Middle of the window in which it is farthest, s.
        time_s: f64,
        /// Mean of the gas less that of the nearer sensor, K.
        #[serde(rename = "away_K")]
        away_k: f64,
        /// What bands, movement and disagreement of the sensors allow, K.
        #[serde(rename = "allowed_K")]
        allowed_k: f64,
    },
    /// The gas changes less than the reading of the faster sensor, which no lag can make of it.
    Smoother {
        /// Root mean square change of the gas over the time constant of the faster sensor, K.
        #[serde(rename = "gas_change_K")]
        gas_change_k: f64,
        /// That of the sensor, without its noise, K.
        #[serde(rename = "sensor_change_K")]
        sensor_change_k: f64,
    },
    /// The gas is colder than anything can be.
    BelowAbsoluteZero {
        /// Where it is coldest, s.
        time_s: f64,
        /// What it is there, °C.
        #[serde(rename = "gas_C")]
        gas_c: f64,
    },
    /// Readings are farther from their predictions than noise explains.
    Widened {
        /// How many times as far: what bands were multiplied by.
        factor: f64,
    },
}

impl fmt::Display for GasFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::FarAtRest { time_s, away_k, allowed_k } => write!(
                f,
                "at {time_s:.4} s both sensors are at rest and agree, and the gas temperature is {away_k:+.3} K from \
                 them, where {allowed_k:.3} K can be explained"
            ),
            Self::Smoother { gas_change_k, sensor_change_k } => write!(
                f,
                "the gas temperature changes by {gas_change_k:.3} K within the faster sensor's time constant, and that \
                 sensor by {sensor_change_k:.3} K: no lag makes a reading move more than the gas"
            ),
            Self::BelowAbsoluteZero { time_s, gas_c } => {
                write!(f, "at {time_s:.4} s the gas temperature is {gas_c:.1} °C, below absolute zero")
            }
            Self::Widened { factor } => {
                write!(f, "readings deviate from their predictions {factor:.2} times as far as noise explains")
            }
        }
    }
}

/// What is wrong with a gas temperature `gas_c` that `std_k` goes with.
///
/// - `scale`: gain and offset (K) from the readings' scale to that of the gas
pub(super) fn of(
    readings: &Readings,
    rig: &Rig,
    scale: [f64; 2],
    gas_c: &[f64],
    std_k: &[f64],
    widened_by: f64,
) -> Vec<GasFault> {
    let seen = Seen { readings, rig, scale, gas_c, std_k };
    let widened = (widened_by > 1.0).then_some(GasFault::Widened { factor: widened_by });
    [seen.far_at_rest(), seen.smoother(), seen.below_absolute_zero(), widened].into_iter().flatten().collect()
}

struct Seen<'a> {
    readings: &'a Readings,
    rig: &'a Rig,
    scale: [f64; 2],
    gas_c: &'a [f64],
    std_k: &'a [f64],
}

impl Seen<'_> {
    fn reading_c(&self, channel: usize, k: usize) -> Option<f64> {
        Some(self.scale[0] * self.readings.reading_c(channel, k)? + self.scale[1])
    }

    fn noise_k(&self, channel: usize) -> f64 {
        let sensor = &self.rig.sensors[channel];
        let coloured_k = sensor.coloured.map_or(0.0, |noise| noise.std_k);
        self.scale[0].abs() * sensor.noise_std_k.hypot(coloured_k)
    }

    /// All time constants of a sensor together: the lag of a slow mean.
    fn lag_s(&self, channel: usize) -> f64 {
        let sensor = &self.rig.sensors[channel];
        sensor.tau_s
            + sensor.second_tau_s.unwrap_or(0.0)
            + sensor.slow.map_or(0.0, |slow| slow.share.abs() * slow.tau_s)
    }

    /// In windows: a lag `τ dT/dt = x − T` means `x̄ − T̄ = τ ΔT/L`, exactly, whatever the gas does.
    fn far_at_rest(&self) -> Option<GasFault> {
        let n = self.gas_c.len();
        let window_s = WINDOW_LAGS * (self.lag_s(0) + self.lag_s(1)) + self.rig.delay_s.abs();
        let length = ((window_s / self.readings.period_s()).ceil() as usize).max(MIN_WINDOW_SAMPLES);
        let windows = (0..n / length).filter_map(|w| self.window(w * length, (w + 1) * length));
        let far = windows.filter(|(_, away_k, allowed_k)| away_k.abs() > *allowed_k);
        let worst = far.max_by(|a, b| (a.1.abs() / a.2).total_cmp(&(b.1.abs() / b.2)));
        worst.map(|(time_s, away_k, allowed_k)| GasFault::FarAtRest { time_s, away_k, allowed_k })
    }

    /// The middle of a window, how far the gas is from the nearer sensor, and how far it may be.
    fn window(&self, from: usize, to: usize) -> Option<(f64, f64, f64)> {
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let times = self.readings.time_s();
        let length_s = times[to - 1] - times[from];
        let mut means = [0.0; 2];
        let mut moving_k = 0.0_f64;
        for channel in 0..2 {
            let read: Option<Vec<f64>> = (from..to).map(|k| self.reading_c(channel, k)).collect();
            let read = read?;
            let quarter = read.len() / 4;
            // Means over a quarter at each end: with noise in them, they are apart by three quarters.
            let moved_k = mean(&read[read.len() - quarter..]) - mean(&read[..quarter]);
            let swing = read.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], c| [a.min(*c), b.max(*c)]);
            let is_at_rest = swing[1] - swing[0] <= 2.0 * MAX_DEVIATIONS * self.noise_k(channel);
            if !is_at_rest {
                return None;
            }
            means[channel] = mean(&read);
            moving_k =
                moving_k.max(self.lag_s(channel) * (moved_k.abs() / 0.75 + 2.0 * self.noise_k(channel)) / length_s);
        }
        let apart_k = (means[0] - means[1]).abs();
        let gas_c = mean(&self.gas_c[from..to]);
        let away = means.map(|sensor_c| gas_c - sensor_c);
        let nearer_k = if away[0].abs() < away[1].abs() { away[0] } else { away[1] };
        let allowed_k = MAX_DEVIATIONS * mean(&self.std_k[from..to]) + apart_k + moving_k;
        Some((0.5 * (times[from] + times[to - 1]), nearer_k, allowed_k))
    }

    fn below_absolute_zero(&self) -> Option<GasFault> {
        let (coldest, gas_c) = self.gas_c.iter().enumerate().min_by(|a, b| a.1.total_cmp(b.1))?;
        let limit_c = ABSOLUTE_ZERO_C - MAX_DEVIATIONS * self.std_k[coldest];
        (*gas_c < limit_c)
            .then(|| GasFault::BelowAbsoluteZero { time_s: self.readings.time_s()[coldest], gas_c: *gas_c })
    }

    /// A lag passes no frequency more than the gas has it, `|H| ≤ 1`, so the mean square change over any time is no more than
    /// that of the gas. What the estimate leaves out of that is in its variance.
    fn smoother(&self) -> Option<GasFault> {
        let faster = usize::from(self.rig.sensors[1].tau_s < self.rig.sensors[0].tau_s);
        let (n, tau_s) = (self.gas_c.len(), self.rig.sensors[faster].tau_s);
        let apart = ((tau_s / self.readings.period_s()).round() as usize).max(1);
        let changes = (0..n.saturating_sub(apart)).filter_map(|k| {
            let changed_k = self.reading_c(faster, k + apart)? - self.reading_c(faster, k)?;
            let gas_k = self.gas_c[k + apart] - self.gas_c[k];
            let open = self.std_k[k].powi(2) + self.std_k[k + apart].powi(2);
            Some([changed_k * changed_k, gas_k * gas_k, open])
        });
        let (sums, count) = changes
            .fold(([0.0; 3], 0.0_f64), |(sums, count), change| ([0, 1, 2].map(|i| sums[i] + change[i]), count + 1.0));
        if count < MIN_WINDOW_SAMPLES as f64 {
            return None;
        }
        let [read, gas, open] = sums.map(|sum| sum / count);
        let noise = 2.0 * self.noise_k(faster).powi(2);
        // Squares of differences of white noise scatter by √3 times their mean, neighbours counted.
        let sensor = read - noise * (1.0 + MAX_CHANGE_ERRORS * (3.0 / count).sqrt());
        (gas + open < MIN_CHANGE_SHARE * sensor)
            .then(|| GasFault::Smoother { gas_change_k: gas.sqrt(), sensor_change_k: sensor.sqrt() })
    }
}

#[cfg(test)]
mod tests {
    use twinlag_compensate::Sensor;

    use super::*;

    const NOISE_K: f64 = 0.1;

    /// 4000 samples, 10 ms apart, of two exact lags of a gas, each step with the gas constant.
    fn readings(gas_c: &[f64], tau_s: [f64; 2]) -> Readings {
        let follows = |tau_s: f64| -> Vec<f64> {
            let share = (-0.01 / tau_s).exp();
            gas_c
                .iter()
                .scan(gas_c[0], |at, gas| {
                    *at = gas + (*at - gas) * share;
                    Some(*at)
                })
                .collect()
        };
        let time_s = (0..gas_c.len()).map(|k| 0.01 * k as f64).collect();
        Readings::new(time_s, tau_s.map(follows)).expect("good readings")
    }

    fn faults(gas_c: &[f64], given_c: &[f64]) -> Vec<GasFault> {
        let tau_s = [0.1, 0.4];
        let rig = Rig::new(tau_s.map(|tau_s| Sensor::new(tau_s, NOISE_K)));
        of(&readings(gas_c, tau_s), &rig, [1.0, 0.0], given_c, &vec![0.5; given_c.len()], 1.0)
    }

    /// Rests for 10 s, and swings from there on.
    fn gas() -> Vec<f64> {
        (0..4000).map(|k| 300.0 + if k < 1000 { 0.0 } else { 20.0 * (0.03 * f64::from(k - 1000)).sin() }).collect()
    }

    /// A wrong reading at the end that nothing has found makes such a gas.
    #[test]
    fn a_gas_below_absolute_zero_is_a_fault() {
        let mut cold = gas();
        cold[3990] = -1000.0;
        let found = faults(&gas(), &cold);
        let is_cold =
            |fault: &GasFault| matches!(fault, GasFault::BelowAbsoluteZero { gas_c, .. } if *gas_c == -1000.0);
        assert!(found.iter().any(is_cold), "{found:?}");
    }

    #[test]
    fn the_gas_itself_has_no_fault() {
        assert_eq!(faults(&gas(), &gas()), []);
    }

    #[test]
    fn a_gas_far_from_sensors_at_rest_is_one() {
        let away: Vec<f64> = gas().iter().map(|c| c + 300.0).collect();
        let [GasFault::FarAtRest { time_s, away_k, allowed_k }] = faults(&gas(), &away)[..] else {
            panic!("one fault")
        };
        assert!(time_s < 10.0 && (away_k - 300.0).abs() < 1e-6 && allowed_k < 5.0, "{time_s} {away_k} {allowed_k}");
    }

    /// A tenth of the swing, where the faster sensor passes `1/√(1 + (3 × 0.1)²)`, 96 % of it.
    #[test]
    fn a_gas_that_is_smoother_than_the_reading_is_one() {
        let smooth: Vec<f64> = gas().iter().map(|c| 300.0 + 0.1 * (c - 300.0)).collect();
        let [GasFault::Smoother { gas_change_k, sensor_change_k }] = faults(&gas(), &smooth)[..] else {
            panic!("one fault")
        };
        assert!((gas_change_k / sensor_change_k - 0.1 / 0.96).abs() < 0.01, "{gas_change_k} and {sensor_change_k}");
    }
}
