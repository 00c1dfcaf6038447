//! When there is something to read, in the order of time.

use crate::readings::Readings;
use crate::rig::Rig;

/// What comes at one instant.
#[derive(Clone, Copy, Debug)]
pub(super) struct Event {
    pub(super) time_s: f64,
    /// The sample that the answer for this instant belongs to.
    pub(super) answers: Option<usize>,
    /// The sample of the reading of each channel.
    pub(super) reads: [Option<usize>; 2],
}

impl Event {
    /// The sample that it is of.
    pub(super) fn sample(&self) -> usize {
        self.answers.or(self.reads[0]).or(self.reads[1]).unwrap_or(0)
    }
}

/// All events of a record, in the time of the first channel, whose reading is not late.
pub(super) struct Events<'a> {
    readings: &'a Readings,
    delay_s: f64,
    clock: usize,
    /// Where one channel is later than the other, the sample and channel of each event, `2 k + i`; empty where both are read at
    /// once.
    order: Vec<usize>,
}

impl<'a> Events<'a> {
    pub(super) fn new(readings: &'a Readings, rig: &Rig) -> Self {
        let mut out = Self { readings, delay_s: rig.delay_s, clock: rig.clock, order: Vec::new() };
        if rig.delay_s != 0.0 {
            let mut order: Vec<usize> = (0..2 * readings.len()).collect();
            order.sort_by(|a, b| out.time_s(*a).total_cmp(&out.time_s(*b)));
            out.order = order;
        }
        out
    }

    pub(super) fn len(&self) -> usize {
        if self.order.is_empty() { self.readings.len() } else { self.order.len() }
    }

    /// Events after which, in an even record, the same comes again.
    pub(super) fn cycle(&self) -> usize {
        if self.order.is_empty() { 1 } else { 2 }
    }

    pub(super) fn at(&self, j: usize) -> Event {
        let both = |k: usize| [0, 1].map(|i| self.readings.reading_c(i, k).map(|_| k));
        let Some(&place) = self.order.get(j) else {
            return Event { time_s: self.readings.time_s()[j], answers: Some(j), reads: both(j) };
        };
        let (k, channel) = (place / 2, place % 2);
        let mut reads = both(k);
        reads[1 - channel] = None;
        Event { time_s: self.time_s(place), answers: (self.clock == channel).then_some(k), reads }
    }

    fn time_s(&self, place: usize) -> f64 {
        self.readings.time_s()[place / 2] - if place % 2 == 1 { self.delay_s } else { 0.0 }
    }
}
