//! The models of a plan, fitted to a noisy record: what a record gives of that which was expected.

use twinlag::diagnosis::{Observations, Settings};
use twinlag::model::{Effort, Fitted, Prepared};
use twinlag::signal::Rig;

use crate::error::PlanError;
use crate::expected::Expected;
use crate::rivals::{Rival, rivals};

/// What is expected of a rig, with the models that records of it can be held against.
///
/// ```
/// use twinlag::signal::{Broadband, Gas, Noise, Record, Rig, Sensor, Signal};
/// use twinlag_plan::Rehearsal;
///
/// let mut sensors = [Sensor::new("fine", 0.024), Sensor::new("coarse", 0.117)];
/// sensors.iter_mut().for_each(|sensor| sensor.noise = Some(Noise::white(0.1)));
/// sensors[0].second_time_constant_s = Some(0.008);
/// let gas = Gas::new(300.0, Signal::Broadband(Broadband { std_k: 10.0, corner_hz: 3.0 }));
/// let rig = Rig::new(1, Record::new(1500, 0.004), gas, sensors)?;
/// let rehearsal = Rehearsal::of(&rig)?;
/// let found = rehearsal.held_against(&rehearsal.observations(&rig.simulate()?)?)?;
/// let error = rehearsal.expected().standard_error(1).expect("determined");
/// assert!((found.parameters[1] - rehearsal.expected().value(1)).abs() < 4.0 * error);
/// assert_eq!(found.deviances.len(), rehearsal.deviances().len());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Rehearsal {
    expected: Expected,
    rivals: Vec<Rival>,
    period_s: f64,
}

/// What a noisy record gives.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Rehearsed {
    /// Parameters, time constants first.
    pub parameters: Vec<f64>,
    /// For each rival how much larger `−2 ln L` is than that of the right model, with one unknown factor of both levels of the noise: `n ln` of
    /// the ratio of the energies per residual, as `twinlag diagnose` compares effects.
    pub deviances: Vec<f64>,
}

impl Rehearsal {
    /// What is expected of `rig`.
    ///
    /// # Errors
    /// As [`Expected::of`].
    pub fn of(rig: &Rig) -> Result<Self, PlanError> {
        let expected = Expected::of(rig)?;
        let rivals = rivals(&expected);
        Ok(Self { expected, rivals, period_s: rig.record().sample_period_s })
    }

    /// What a record is expected to determine.
    pub fn expected(&self) -> &Expected {
        &self.expected
    }

    /// The deviance to expect of each rival with one factor of both noise levels fitted again, and with known levels.
    pub fn deviances(&self) -> Vec<[f64; 2]> {
        self.rivals.iter().map(|rival| [rival.deviance, rival.deviance_known_noise]).collect()
    }

    /// The names of the rivals.
    pub fn rivals(&self) -> impl Iterator<Item = &'static str> {
        self.rivals.iter().map(|rival| rival.effect.name())
    }

    /// A simulated record as models take it.
    ///
    /// # Errors
    /// [`PlanError::Model`] for a record that is too short.
    pub fn observations(&self, simulated: &twinlag::signal::Simulated) -> Result<Observations, PlanError> {
        let readings_c = [simulated.t1_c.clone(), simulated.t2_c.clone()];
        let stretch = twinlag::diagnosis::Stretch::new(simulated.time_s.clone(), readings_c);
        Ok(Observations::new(vec![stretch], Some(self.period_s))?)
    }

    /// Fits the right model and each rival to a record, with noise levels from its third differences.
    ///
    /// # Errors
    /// [`PlanError::Model`] for a record in which a channel never changes.
    pub fn held_against(&self, observations: &Observations) -> Result<Rehearsed, PlanError> {
        let settings = Settings { effects: Vec::new(), ..Settings::default() };
        let prepared = Prepared::new(observations, &settings)?;
        let fit = |of: &Fitted| {
            let model = of.model.clone().with_noise(prepared.levels.std_k);
            model.fit(&of.theta, &prepared.observations, &prepared.everything, Effort::Finish)
        };
        let right = fit(&self.expected.fitted);
        let rivals: Vec<Fitted> = self.rivals.iter().map(|rival| fit(rival.fitted())).collect();
        let ratio = |rival: &Fitted| rival.mean_energy() / right.mean_energy().max(f64::MIN_POSITIVE);
        Ok(Rehearsed {
            deviances: rivals.iter().map(|rival| right.count * ratio(rival).ln()).collect(),
            parameters: right.theta,
        })
    }
}
