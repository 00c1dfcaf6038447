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
    /// True gas temperature at the sample instants, °C, `[n]`. For a held gas it is the value that
    /// holds from then on.
    pub gas_c: Vec<f64>,
    /// Velocity of the stream at the sample instants, m/s, `[n]`, if the rig has one.
    pub velocity_m_per_s: Option<Vec<f64>>,
    /// Both sensors' readings with calibration and disturbances, before noise, spikes and ADC, °C,
    /// `[n]` each.
    pub readings_c: [Vec<f64>; 2],
    pub(crate) sensors: [Sensor; 2],
    pub(crate) sample_period_s: f64,
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
    /// True gas temperature at the sample instants, °C, `[n]`. For a held gas it is the value that
    /// holds from then on.
    pub gas_c: Vec<f64>,
    /// Velocity of the stream at the sample instants, m/s, `[n]`, if the rig has one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub velocity_m_per_s: Option<Vec<f64>>,
    /// Names of the two channels.
    pub channels: [String; 2],
}

impl Clean {
    /// Adds each channel's noise and spikes and passes it through its ADC.
    ///
    /// - `noise`: one generator per channel, such as
    ///   [`Rig::noise_streams`](crate::Rig::noise_streams); first one number per sample is drawn
    ///   from it for the noise, then one for the coloured noise, then one or two for the spikes;
    ///   none for what the channel does not have. So coloured noise does not move the other noise,
    ///   nor spikes either
    pub fn with_noise(&self, noise: &mut [impl Rng; 2]) -> Simulated {
        let [first, second] = noise;
        Simulated {
            time_s: self.time_s.clone(),
            t1_c: self.read(0, first),
            t2_c: self.read(1, second),
            gas_c: self.gas_c.clone(),
            velocity_m_per_s: self.velocity_m_per_s.clone(),
            channels: [self.sensors[0].channel.clone(), self.sensors[1].channel.clone()],
        }
    }

    fn read(&self, channel: usize, rng: &mut impl Rng) -> Vec<f64> {
        let sensor = &self.sensors[channel];
        let mut readings_c = self.readings_c[channel].clone();
        if let Some(noise) = &sensor.noise {
            noise.add_to(&mut readings_c, rng);
        }
        if let Some(noise) = &sensor.coloured_noise {
            noise.add_to(&mut readings_c, self.sample_period_s, rng);
        }
        if let Some(spikes) = &sensor.spikes {
            spikes.add_to(&mut readings_c, rng);
        }
        if let Some(adc) = &sensor.adc {
            for reading_c in &mut readings_c {
                *reading_c = adc.convert(*reading_c);
            }
        }
        readings_c
    }
}
