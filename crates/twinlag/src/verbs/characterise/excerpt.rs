//! What is looked at of a record beside its two lags.

use std::ops::Range;

use twinlag_bias::estimate_noise;
use twinlag_diagnose::{Observations, Policy, Stretch, is_single_tone_in, pieces_of_long};
use twinlag_record::{Record, SamplingKind};

use super::readings;
use crate::error::Error;
use crate::options::Options;

/// Share of a channel's standard deviation that its noise has at least: one that shows none has been rounded or smoothed.
const LEAST_NOISE_PER_SWING: f64 = 1e-5;

/// A record, or pieces of a long one, and whether it is a single tone.
pub(super) struct Excerpt {
    pub(super) observations: Observations,
    pub(super) is_single_tone: bool,
}

impl Excerpt {
    /// Pieces of a long record without a break, all of which is searched for tones; `None` of any other.
    pub(super) fn of_long(record: &Record, options: &Options) -> Result<Option<Self>, Error> {
        let is_unbroken = record.segments.len() == 1 && record.segments[0].len() == record.len();
        let is_whole = is_unbroken && record.flow.is_none() && record.speed_m_s.is_none();
        let is_even = record.sampling.kind != SamplingKind::Irregular;
        let Some(pieces) = pieces_of_long(record.len()).filter(|_| is_whole && is_even) else { return Ok(None) };
        let period_s = record.sampling.period_s;
        let stretch = |rows: Range<usize>| {
            let time_s = rows.clone().map(|row| record.time_s[0] + row as f64 * period_s).collect();
            Stretch::new(time_s, [&record.t1_c, &record.t2_c].map(|channel| channel[rows.clone()].to_vec()))
        };
        let stretches = pieces.into_iter().map(stretch).collect();
        let Ok(observations) = Observations::new(stretches, Some(period_s)) else { return Ok(None) };
        let channels = [&record.t1_c[..], &record.t2_c];
        let swing_k = channels.map(std);
        let livelier = usize::from(swing_k[1] > swing_k[0]);
        let swing_k = swing_k[livelier];
        let Ok(noise) = estimate_noise(&readings(record, options)?) else { return Ok(None) };
        let noise_k = noise[livelier].std_k.max(LEAST_NOISE_PER_SWING * swing_k);
        Ok(Some(Self {
            observations: observations.of_record_with_swing(swing_k),
            is_single_tone: is_single_tone_in(channels[livelier], noise_k, &Policy::default()),
        }))
    }
}

fn std(channel: &[f64]) -> f64 {
    let n = channel.len() as f64;
    let mean = channel.iter().sum::<f64>() / n;
    (channel.iter().map(|y| (y - mean) * (y - mean)).sum::<f64>() / n).sqrt()
}
