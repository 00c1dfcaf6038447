//! Delays that fit as well as the one that was found: where the gas repeats itself, all that are a period more or less.

use twinlag_cross_relation::Z_975;
use twinlag_model::{Effort, Fitted, Observations, Selection};

use crate::candidates::Search;

/// The delay of a fit, s; `None` where the model has none.
pub(crate) fn delay_s(fitted: &Fitted) -> Option<f64> {
    place_of_delay(fitted).map(|at| fitted.theta[at])
}

/// Its place among the parameters.
fn place_of_delay(fitted: &Fitted) -> Option<usize> {
    fitted.model.parameters().position(|parameter| parameter.is_lateness).map(|place| 2 + place)
}

impl Search<'_> {
    /// The fits that are as good as the best one over all delays, each with its delay in s, the shortest first; `fitted`, the best or not, is
    /// among those that are compared. None where the model has no delay.
    ///
    /// As good: the energies differ by at most 1.96 standard deviations of their difference by chance.
    pub(crate) fn delays(&self, fitted: &Fitted) -> Vec<(f64, Fitted)> {
        let Some(at) = place_of_delay(fitted) else { return Vec::new() };
        let step_s = self.observations.step_s();
        let mut all = vec![(fitted.theta[at], fitted.clone())];
        for theta in Scan::new(fitted, at, self.excerpt()).promising() {
            let other = fitted.model.fit(&theta, self.observations, self.selection, Effort::Compare);
            let delay_s = other.theta[at];
            if other.end.is_usable() && all.iter().all(|(known_s, _)| (known_s - delay_s).abs() > step_s) {
                all.push((delay_s, other));
            }
        }
        let best = all.iter().min_by(|a, b| a.1.chi2.total_cmp(&b.1.chi2)).map(|(_, best)| best.clone());
        let Some(best) = best.filter(|_| all.len() > 1) else { return all };
        let is_as_good = |(_, other): &(f64, Fitted)| {
            let by_chance = std_of_difference(&best, &other.theta, self.observations, self.selection);
            other.chi2 - best.chi2 <= Z_975 * by_chance
        };
        all.retain(is_as_good);
        all.sort_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
        all
    }
}

/// The standard deviation by which the energies at a fit and at `theta` differ by chance, where both leave nothing but white noise:
/// `2 v √(n (1 − ρ²))`, for residuals of `n` degrees of freedom, of variance `v` and with correlation `ρ`.
fn std_of_difference(fitted: &Fitted, theta: &[f64], observations: &Observations, selection: &Selection) -> f64 {
    let rho = fitted.model.residual_correlation([&fitted.theta, theta], observations, selection);
    // This is `v n`, of an excerpt as of the whole.
    let energy = fitted.model.energy(&fitted.theta, observations, selection);
    2.0 * (fitted.mean_energy() * energy * (1.0 - rho * rho).max(0.0)).sqrt()
}

/// How much more energy than the best fit a minimum may have whose other parameters are not fitted yet, in the differences up to which
/// fits are as good. Chosen.
const UNFITTED_DIFFERENCES: f64 = 2.0;

/// The energy of an excerpt over the delay, sample period by sample period, all other parameters as they are.
struct Scan<'a> {
    fitted: &'a Fitted,
    at: usize,
    observations: &'a Observations,
    selection: &'a Selection,
    energy: Vec<f64>,
}

impl<'a> Scan<'a> {
    fn new(fitted: &'a Fitted, at: usize, (observations, selection): &'a (Observations, Selection)) -> Self {
        let mut out = Self { fitted, at, observations, selection, energy: Vec::new() };
        out.energy = (0..=2 * out.most_periods()).map(|i| out.energy(&out.moved(i as f64))).collect();
        out
    }

    /// The longest delay, in sample periods.
    fn most_periods(&self) -> usize {
        let delay = self.fitted.model.parameters().nth(self.at - 2);
        delay.map_or(0.0, |delay| delay.variable.upper / self.observations.step_s()) as usize
    }

    /// The parameters with the delay at a place of the grid.
    fn moved(&self, place: f64) -> Vec<f64> {
        let mut theta = self.fitted.theta.clone();
        theta[self.at] = (place - self.most_periods() as f64) * self.observations.step_s();
        theta
    }

    fn energy(&self, theta: &[f64]) -> f64 {
        self.fitted.model.energy(theta, self.observations, self.selection)
    }

    /// The minima, between the samples by the parabola through three of them, that may be as good as the fit.
    fn promising(&self) -> Vec<Vec<f64>> {
        let here = self.energy(&self.fitted.theta);
        let is_promising = |theta: &Vec<f64>| {
            let by_chance = std_of_difference(self.fitted, theta, self.observations, self.selection);
            self.energy(theta) - here <= UNFITTED_DIFFERENCES * Z_975 * by_chance
        };
        let neighbours = self.energy.windows(3).enumerate().filter(|(_, e)| e.iter().all(|e| e.is_finite()));
        let minima = neighbours.filter(|(_, e)| e[1] < e[0] && e[1] <= e[2]);
        let vertex = |(i, e): (usize, &[f64])| i as f64 + 1.0 + 0.5 * (e[0] - e[2]) / (e[0] - 2.0 * e[1] + e[2]);
        minima.map(|minimum| self.moved(vertex(minimum))).filter(is_promising).collect()
    }
}
