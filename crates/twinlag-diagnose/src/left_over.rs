//! What a model leaves over that is not noise: where in frequency and in time.

use twinlag_model::{ModelFit, Policy};

use crate::diagnosis::Unexplained;

/// Half the width of a band as a factor of its frequency: an eighth of an octave.
const HALF_BAND_FACTOR: f64 = 1.090_871_211_463_571;

/// What is left, if more than noise is.
pub(crate) fn what_is_left(fit: &ModelFit, policy: &Policy) -> Option<Unexplained> {
    // Less than noise is no effect: the level of the noise is overestimated.
    let fails = fit.tests.iter().filter(|t| t.p_value < policy.rejection_p_value() && !t.finds_too_little_energy());
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
        worst_s: fit.trace.worst.map(|part| part.ends_s),
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
