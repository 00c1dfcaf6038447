//! A second opinion on an effect, from the readings themselves with the gas in the state.
//!
//! The whitened residual knows nothing of the gas: above the frequencies that the gas has, noise of one channel meets noise of the other
//! in it, and what turns the phase of one of them (a delay, a second lag) can pick the angle at which they happen to cancel. The
//! likelihood of the readings with the gas as one process, its spectrum learned from them, has no such term: where the gas is not,
//! it does not depend on the sensors.

use twinlag_compensate::{Form, learn, reconstruct};
use twinlag_model::{Extended, Fitted, Identifier, Observations};

use crate::search::{FALSE_ALARM, FAR_OFF, threshold};

/// Whether `effect` with `added` parameters, which takes `without` to `with`, makes the readings more probable, and by more than chance
/// does, where that might have brought it about.
pub(crate) fn is_confirmed(
    effect: Identifier,
    added: usize,
    without: &Fitted,
    with: &Fitted,
    observations: &Observations,
) -> bool {
    if !effect.about().turns_phases || without.mean_energy() > FAR_OFF {
        return true;
    }
    let [before, after] = std::thread::scope(|scope| {
        let all = [without, with].map(|fitted| scope.spawn(move || log_likelihood(fitted, observations)));
        all.map(|one| one.join().expect("no thread panics"))
    });
    // What has no such likelihood is judged without.
    before.zip(after).is_none_or(|(before, after)| 2.0 * (after - before) > threshold(added, FALSE_ALARM))
}

/// Logarithm of the likelihood of the readings, up to what is the same for all models of a record.
fn log_likelihood(fitted: &Fitted, observations: &Observations) -> Option<f64> {
    let (readings, rig) = Extended::new(fitted, observations).rig(&fitted.theta).ok()?;
    let prior = learn(&readings, &rig).ok()?.prior;
    let gas = reconstruct(&readings, &rig, &prior, Form::Filter).ok()?;
    // Of the readings as they were before they were taken back through a gain.
    let noise_std_k = fitted.model.noise_std_k();
    let gains = (0..2).map(|i| (rig.sensors[i].noise_std_k / noise_std_k[i]).ln()).sum::<f64>();
    Some(gas.log_likelihood + 0.5 * gas.innovations as f64 * gains)
}
