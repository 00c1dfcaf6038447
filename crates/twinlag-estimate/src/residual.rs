//! Whether the fit leaves more than noise.

use twinlag_cross_relation::{ResidualTest, TestName, residual_tests};

use crate::error::EstimateError;
use crate::whitened::WhitenedFit;

/// A residual test below this p-value rejects the model: four tests, so one false alarm in a
/// thousand records.
pub const REJECTION_P_VALUE: f64 = 1e-3 / 4.0;

impl<const P: usize> WhitenedFit<'_, P> {
    /// Tests of the residual that parameters `theta` leave, against noise of the levels as they
    /// were given or found; `total-energy` only where these say anything about the residual's size.
    ///
    /// - `tests_calibration`: whether to test gain and offset too, by their score, where they were
    ///   not fitted
    ///
    /// # Errors
    /// [`EstimateError::Cost`] if the levels are not finite and positive.
    /// ```
    #[doc = include_str!("../doc/readings.txt")]
    /// use twinlag_estimate::{Task, WhitenedFit};
    ///
    /// let fit = WhitenedFit::<2>::find(&Task::new(&readings))?;
    /// let right = fit.residual_tests(&fit.theta(), true)?;
    /// let wrong = fit.residual_tests(&[0.03, 0.1], false)?;
    /// assert!(!fit.is_rejected_by(&right) && fit.is_rejected_by(&wrong));
    /// # Ok::<(), twinlag_estimate::EstimateError>(())
    /// ```
    pub fn residual_tests(
        &self,
        theta: &[f64; P],
        tests_calibration: bool,
    ) -> Result<Vec<ResidualTest>, EstimateError> {
        // The size that the estimate rests on may be the residual's own: that is not what the
        // record is tested against.
        let whitened = self.whitened.clone().with_noise(self.levels.std_k)?;
        let level_spread = self.levels.energy_uncertainty(whitened.noise_shares(theta));
        let free = self.free();
        let mut tests = residual_tests(&whitened.residual(theta), free.len(), level_spread);
        if self.levels.are_of_the_residual() {
            tests.retain(|t| t.test != TestName::TotalEnergy);
        }
        if tests_calibration && !self.task.calibrates() {
            let second = |i: usize| theta.get(i).copied().unwrap_or(0.0);
            let at_rest_alike = [theta[0], theta[1], 1.0, 0.0, second(4), second(5)];
            let statistic = if P == 6 {
                whitened.score_test(&at_rest_alike, &free, &[2, 3])
            } else {
                whitened.score_test::<4>(&std::array::from_fn(|i| at_rest_alike[i]), &free, &[2, 3])
            };
            tests.extend(statistic.map(|statistic| ResidualTest {
                test: TestName::Calibration,
                statistic,
                degrees_of_freedom: Some(2.0),
                // Chi-square with two degrees of freedom.
                p_value: (-0.5 * statistic).exp(),
            }));
        }
        Ok(tests)
    }

    /// Whether `tests` reject the model. Where the levels are from the data, too little energy is
    /// no objection.
    pub fn is_rejected_by(&self, tests: &[ResidualTest]) -> bool {
        tests.iter().any(|t| t.can_reject(self.levels.given) && t.p_value < REJECTION_P_VALUE)
    }
}
