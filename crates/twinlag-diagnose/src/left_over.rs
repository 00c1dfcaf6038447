//! What a model leaves over that is not noise: where in frequency and in time.

use twinlag_cross_relation::ResidualTest;
use twinlag_model::{ModelFit, Policy};

use crate::diagnosis::Unexplained;

/// Parts of the record of which the one with most of it is named.
const PARTS: usize = 10;
/// Half the width of a band as a factor of its frequency: an eighth of an octave.
const HALF_BAND: f64 = 1.090_871_211_463_571;

/// What is left, if more than noise is.
pub(crate) fn what_is_left(fit: &ModelFit, policy: &Policy) -> Option<Unexplained> {
    // Less than noise is no effect: the level of the noise is overestimated.
    let is_less = |t: &ResidualTest| t.test == "total-energy" && t.statistic < 1.0;
    let fails = fit.tests.iter().filter(|t| t.p_value < policy.rejection_p_value() && !is_less(t));
    let names: Vec<&str> = fails.map(|t| t.test.as_str()).collect();
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
        band_hz: Some([hz / HALF_BAND, hz * HALF_BAND]),
        energy_ratio: ratio,
        worst_s: worst_part(fit),
    })
}

/// Ends of the part of the record with most of it, s.
fn worst_part(fit: &ModelFit) -> Option<[f64; 2]> {
    let part = (fit.trace.residual.len() / PARTS).max(1);
    let energy = |chunk: &[f64]| chunk.iter().map(|r| r * r).sum::<f64>() / chunk.len().max(1) as f64;
    let chunks = fit.trace.residual.chunks(part).enumerate();
    let (index, chunk) = chunks.max_by(|a, b| energy(a.1).total_cmp(&energy(b.1)))?;
    let first = index * part;
    Some([fit.trace.time_s[first], fit.trace.time_s[first + chunk.len() - 1]])
}
