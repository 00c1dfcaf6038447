//! What a simulation returns: the record without noise, and with it.

use rand::Rng;
use serde::{Deserialize, Serialize};

use crate::Sensor;

/// A record before noise and ADC, from which any number of noisy ones can be drawn.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Clean {
    /// Sample instants, s, `[n]`; the first is 0.
    pub time_s: Vec<f64>,
    /// True gas temperature at the sample instants, °C, `[n]`. Of a held gas, the value that holds from there on.
    pub gas_c: Vec<f64>,
    /// Both sensors' readings with gain and offset, before noise and ADC, °C, `[n]` each.
    pub readings_c: [Vec<f64>; 2],
    pub(crate) sensors: [Sensor; 2],
}

/// A simulated record with its truth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Simulated {
    /// Sample instants, s, `[n]`; the first is 0.
    pub time_s: Vec<f64>,
    /// Readings of the first channel, °C, `[n]`.
    pub t1_c: Vec<f64>,
    /// Readings of the second channel, °C, `[n]`.
    pub t2_c: Vec<f64>,
    /// True gas temperature at the sample instants, °C, `[n]`. Of a held gas, the value that holds from there on.
    pub gas_c: Vec<f64>,
    /// Names of the two channels.
    pub channels: [String; 2],
}

impl Clean {
    /// Adds each channel's noise and passes it through its ADC.
    ///
    /// - `noise`: one generator per channel, such as [`Rig::noise_streams`](crate::Rig::noise_streams); one number per
    ///   sample is drawn from it, none if the channel has no noise
    pub fn with_noise(&self, noise: &mut [impl Rng; 2]) -> Simulated {
        let [first, second] = noise;
        Simulated {
            time_s: self.time_s.clone(),
            t1_c: read(&self.sensors[0], &self.readings_c[0], first),
            t2_c: read(&self.sensors[1], &self.readings_c[1], second),
            gas_c: self.gas_c.clone(),
            channels: [self.sensors[0].channel.clone(), self.sensors[1].channel.clone()],
        }
    }
}

fn read(sensor: &Sensor, clean_c: &[f64], rng: &mut impl Rng) -> Vec<f64> {
    let mut readings_c = clean_c.to_vec();
    if let Some(noise) = &sensor.noise {
        noise.add_to(&mut readings_c, rng);
    }
    if let Some(adc) = &sensor.adc {
        for reading_c in &mut readings_c {
            *reading_c = adc.convert(*reading_c);
        }
    }
    readings_c
}
