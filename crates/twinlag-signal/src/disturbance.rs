//! What is added to a channel between the sensor and the converter, noise aside: contact, drift,
//! mains, crosstalk.

use rand::Rng;

use crate::Sensor;

impl Sensor {
    /// Contact, drift and mains, in this order.
    ///
    /// - `time_s`: the sample instants, the first 0
    /// - `contact`: drawn from if the contact is intermittent
    pub(crate) fn disturb(&self, time_s: &[f64], readings_c: &mut [f64], contact: &mut impl Rng) {
        if let Some(intermittent) = &self.intermittent_contact {
            intermittent.apply(time_s, readings_c, contact);
        }
        if self.drift_k_per_s != 0.0 {
            let middle_s = 0.5 * time_s.last().copied().unwrap_or_default();
            for (time_s, reading_c) in time_s.iter().zip(&mut *readings_c) {
                *reading_c += self.drift_k_per_s * (time_s - middle_s);
            }
        }
        for mains in &self.mains {
            for (time_s, reading_c) in time_s.iter().zip(&mut *readings_c) {
                *reading_c += mains.at_k(*time_s);
            }
        }
    }
}

/// Adds to each channel its part of the other: both from what they were before.
pub(crate) fn cross_talk(sensors: &[Sensor; 2], readings_c: &mut [Vec<f64>; 2]) {
    let [first, second] = sensors.each_ref().map(|sensor| sensor.crosstalk);
    if first == 0.0 && second == 0.0 {
        return;
    }
    let means_c = readings_c.each_ref().map(|readings_c| readings_c.iter().sum::<f64>() / readings_c.len() as f64);
    // Of the other channel.
    let about_c = [0, 1].map(|i| sensors[i].crosstalk_about_c.unwrap_or(means_c[1 - i]));
    let [one, two] = readings_c;
    for (one_c, two_c) in one.iter_mut().zip(two) {
        let others_k = [*two_c - about_c[0], *one_c - about_c[1]];
        *one_c += first * others_k[0];
        *two_c += second * others_k[1];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Records of one instrument differ in their means, and not in the temperature at which nothing is picked up.
    #[test]
    fn crosstalk_is_about_one_temperature_or_the_mean_of_the_record() {
        let picked_up = |about_c| {
            let mut sensors = [1.0, 2.0].map(|tau_s| Sensor::new("T", tau_s));
            (sensors[0].crosstalk, sensors[0].crosstalk_about_c) = (0.1, about_c);
            let mut readings_c = [vec![100.0, 100.0], vec![110.0, 130.0]];
            cross_talk(&sensors, &mut readings_c);
            readings_c
        };
        assert_eq!(picked_up(None), [[99.0, 101.0], [110.0, 130.0]]);
        assert_eq!(picked_up(Some(20.0)), [[109.0, 111.0], [110.0, 130.0]]);
    }
}
