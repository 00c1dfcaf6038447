//! What flows past the sensors, and what it does to their first time constants.

use crate::{Flow, Sensor, Stream};

/// A flow that multiplies both first time constants alike, and a stream, which multiplies each by its own power of the relative velocity.
#[derive(Clone, Copy)]
pub(crate) struct Surroundings<'a> {
    pub(crate) flow: Option<&'a Flow>,
    pub(crate) stream: Option<&'a Stream>,
}

impl Surroundings<'_> {
    /// What the first time constant of `sensor` is multiplied with at a time after the first sample.
    pub(crate) fn factor(self, sensor: &Sensor, time_s: f64) -> f64 {
        let of_flow = self.flow.map_or(1.0, |flow| flow.factor(time_s));
        let of_stream = self.stream.map_or(1.0, |stream| stream.relative_velocity(time_s).powf(sensor.stream_exponent));
        of_flow * of_stream
    }

    /// Bounds between which the factor stays: low, high.
    pub(crate) fn range(self, sensor: &Sensor) -> [f64; 2] {
        let of_flow = self.flow.map_or([1.0; 2], Flow::range);
        let at_ends =
            self.stream.map_or([1.0; 2], Stream::relative_velocity_range).map(|v| v.powf(sensor.stream_exponent));
        let [low, high] = [at_ends[0].min(at_ends[1]), at_ends[0].max(at_ends[1])];
        [of_flow[0] * low, of_flow[1] * high]
    }
}
