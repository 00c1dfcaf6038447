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
    /// The fits at other minima over the delay that are as good as `fitted`, each with its delay in s, the shortest first: two whose energies differ by no
    /// more than 1.96 standard deviations of what they differ by chance.
    pub(crate) fn other_delays(&self, fitted: &Fitted) -> Vec<(f64, Fitted)> {
        let Some(at) = place_of_delay(fitted) else { return Vec::new() };
        let step_s = self.observations.step_s();
        let mut out: Vec<(f64, Fitted)> = Vec::new();
        for theta in Minima::new(fitted, at, self.excerpt()).as_good() {
            let other = fitted.model.fit(&theta, self.observations, self.selection, Effort::Compare);
            let delay_s = other.theta[at];
            let is_new = out
                .iter()
                .map(|(known_s, _)| *known_s)
                .chain([fitted.theta[at]])
                .all(|known_s| (known_s - delay_s).abs() > step_s);
            let most = Z_975 * std_of_difference(fitted, &other.theta, self.observations, self.selection);
            if is_new && other.end.is_usable() && other.chi2 - fitted.chi2 <= most {
                out.push((delay_s, other));
            }
        }
        out.sort_by(|a, b| a.0.abs().total_cmp(&b.0.abs()));
        out
    }
}

/// The standard deviation by which the energies at the best fit and at `theta` differ by chance, where both leave nothing but noise:
/// `2 v √(n (1 − ρ²))`, for residuals of `n` degrees of freedom, of variance `v` and with correlation `ρ`.
fn std_of_difference(fitted: &Fitted, theta: &[f64], observations: &Observations, selection: &Selection) -> f64 {
    let model = &fitted.model;
    let rho = model.residual_correlation([&fitted.theta, theta], observations, selection);
    let energy = model.energy(&fitted.theta, observations, selection);
    2.0 * (fitted.mean_energy() * energy * (1.0 - rho * rho)).sqrt()
}

/// The energy of an excerpt over the delay, sample period by sample period, all other parameters as they are.
struct Minima<'a> {
    fitted: &'a Fitted,
    at: usize,
    observations: &'a Observations,
    selection: &'a Selection,
    energy: Vec<f64>,
}

impl<'a> Minima<'a> {
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

    /// The minima, between the samples by the parabola through three of them, that may be as good as the fit: their other parameters are
    /// not fitted yet, so that twice the difference is allowed.
    fn as_good(&self) -> Vec<Vec<f64>> {
        let here = self.energy(&self.fitted.theta);
        let is_as_good = |theta: &Vec<f64>| {
            let most = 2.0 * Z_975 * std_of_difference(self.fitted, theta, self.observations, self.selection);
            self.energy(theta) - here <= most
        };
        let neighbours = self.energy.windows(3).enumerate();
        let minima = neighbours.filter(|(_, e)| e[1] < e[0] && e[1] <= e[2]);
        let vertex = |(i, e): (usize, &[f64])| i as f64 + 1.0 + 0.5 * (e[0] - e[2]) / (e[0] - 2.0 * e[1] + e[2]);
        minima.map(|minimum| self.moved(vertex(minimum))).filter(is_as_good).collect()
    }
}
