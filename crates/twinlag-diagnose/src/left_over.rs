//! What a model leaves over that is not noise: where in frequency and in time.

use std::ops::Range;

use twinlag_cross_relation::{ResidualTest, TestName};
use twinlag_model::{ModelFit, Policy};

use crate::diagnosis::Unexplained;

/// Parts of the record of which the one with most of it is named.
const RECORD_PARTS: usize = 10;
/// Half the width of a band as a factor of its frequency: an eighth of an octave.
const HALF_BAND_FACTOR: f64 = 1.090_871_211_463_571;

/// What is left, if more than noise is.
pub(crate) fn what_is_left(fit: &ModelFit, policy: &Policy) -> Option<Unexplained> {
    // Less than noise is no effect: the level of the noise is overestimated.
    let is_less = |t: &ResidualTest| t.test == TestName::TotalEnergy && t.statistic < 1.0;
    let fails = fit.tests.iter().filter(|t| t.p_value < policy.rejection_p_value() && !is_less(t));
    let names: Vec<&str> = fails.map(|t| t.test.name()).collect();
    if names.is_empty() {
        return None;
    }
    let excess = |band: &[f64; 3]| (band[1] - 1.0) * band[2];
    let worst_band = fit.trace.bands.iter().max_by(|a, b| excess(a).total_cmp(&excess(b)));
    let [hz, ratio, _] = worst_band.copied().unwrap_or([0.0, 1.0, 1.0]);
    let place = match hz {
        0.0 => "at the lowest frequencies".to_owned(),
        hz if hz < 1e-3 => format!("around {hz:.1e} Hz"),
        hz => format!("around {hz:.4} Hz"),
    };
    let where_most = if ratio > 1.0 {
        format!("; most of the excess lies {place}, {ratio:.2} times the noise there")
    } else {
        String::new()
    };
    Some(Unexplained {
        description: format!("the residual is not noise ({}){where_most}", names.join(", ")),
        band_hz: Some(band_hz(fit, hz)),
        energy_ratio: ratio,
        worst_s: worst_part(fit),
    })
}

/// Ends of the band around `hz`; of the lowest one, up to the next.
fn band_hz(fit: &ModelFit, hz: f64) -> [f64; 2] {
    if hz > 0.0 {
        return [hz / HALF_BAND_FACTOR, hz * HALF_BAND_FACTOR];
    }
    let others = fit.trace.bands.iter().map(|band| band[0]).filter(|other| *other > 0.0);
    [0.0, others.reduce(f64::min).unwrap_or(0.0)]
}

/// Ends of the part of the record with most of it, s.
fn worst_part(fit: &ModelFit) -> Option<[f64; 2]> {
    let (time_s, residual) = (&fit.trace.time_s, &fit.trace.residual);
    let range = worst_range(residual)?;
    Some([time_s[range.start], time_s[range.end - 1]])
}

/// The one of [`RECORD_PARTS`] parts, equal but for a value, with the largest mean square; `None` of no values.
fn worst_range(residual: &[f64]) -> Option<Range<usize>> {
    let n = residual.len();
    let parts =
        (0..RECORD_PARTS).map(|i| i * n / RECORD_PARTS..(i + 1) * n / RECORD_PARTS).filter(|part| !part.is_empty());
    let energy = |part: &Range<usize>| residual[part.clone()].iter().map(|r| r * r).sum::<f64>() / part.len() as f64;
    parts.max_by(|a, b| energy(a).total_cmp(&energy(b)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Parts are tenths whatever the length: the last few values are no part of their own.
    #[test]
    fn the_worst_part_is_a_tenth() {
        let mut residual = vec![1.0; 1009];
        residual[1008] = 3.0;
        residual[300..400].fill(2.0);
        assert_eq!(worst_range(&residual), Some(302..403));
        assert_eq!(worst_range(&[1.0, 2.0]).map(|part| part.len()), Some(1));
        assert_eq!(worst_range(&[]), None);
    }
}
