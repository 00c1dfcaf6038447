//! What candidates are made from.

use std::sync::Arc;

use crate::flow::Flow;
use crate::gas::Gas;
use crate::records::Member;

/// What is known of a record, and of the model so far, when effects are looked for.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Context {
    /// Ends of the record, s; of several those of all of them together.
    pub ends_s: [f64; 2],
    /// The records, one or several.
    pub members: Vec<Member>,
    /// Mean time from sample to sample, s.
    pub step_s: f64,
    /// Whether samples are evenly spaced.
    pub is_even: bool,
    /// Number of samples.
    pub samples: usize,
    /// Samples that a delay may reach.
    pub reach: usize,
    /// Mean of each channel, °C.
    pub mean_c: [f64; 2],
    /// Mean in °C, variance in K², and third central moment over variance in K, of the mean of both channels.
    pub moments: [f64; 3],
    /// Standard deviation of the livelier channel, K.
    pub swing_k: f64,
    /// White noise of the channels, K.
    pub noise_std_k: [f64; 2],
    /// Channels whose converter is coarse beside the noise.
    pub is_coarse: [bool; 2],
    /// Time constants of the model so far, s.
    pub tau_s: [f64; 2],
    /// Flow, where it was measured.
    pub flow: Option<Arc<Flow>>,
    /// The gas temperature as the model so far has it, where it makes a difference.
    pub gas: Option<Arc<Gas>>,
    /// Lines that stand out of the residual: frequency in Hz, and the channel that shows them, 0 or 1.
    pub lines: Vec<(f64, usize)>,
}

/// Share of the swing that a step of a solver may change a temperature by.
const TYPICAL_SWING_SHARE: f64 = 0.1;
/// The smallest change of temperature to consider where nothing moves, K.
const LEAST_TYPICAL_K: f64 = 1e-9;

impl Context {
    /// A temperature that a step of a solver may change, K: not so small that a large offset is far away.
    pub fn typical_k(&self, channel: usize) -> f64 {
        (TYPICAL_SWING_SHARE * self.swing_k).max(self.noise_std_k[channel]).max(LEAST_TYPICAL_K)
    }

    /// Time from the first to the last sample, s; of several records that of the longest.
    pub fn span_s(&self) -> f64 {
        self.members.iter().map(|member| member.ends_s[1] - member.ends_s[0]).fold(0.0, f64::max)
    }

    /// Halfway between the ends of the record, s.
    pub fn middle_s(&self) -> f64 {
        0.5 * (self.ends_s[0] + self.ends_s[1])
    }

    /// The flow, where it changes: along the record, or from record to record.
    pub(crate) fn changing_flow(&self) -> impl Iterator<Item = &Arc<Flow>> {
        self.flow.iter().filter(|flow| flow.changes())
    }

    /// What is known of each of several records by itself.
    pub(crate) fn each_member(&self) -> impl Iterator<Item = (Member, Self)> + '_ {
        self.members.iter().map(|member| {
            let (ends_s, samples) = (member.ends_s, member.samples.len());
            (member.clone(), Self { ends_s, samples, members: vec![member.clone()], ..self.clone() })
        })
    }
}
