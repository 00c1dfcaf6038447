//! What a record says of the size of an effect that a model lacks.
//!
//! Near a size `s` the energy of the residual, all other parameters at their best, is `E + 2 g (s' − s) + h (s' − s)²`. The
//! curvature `h` is not that of the linearised residual: derivatives of a residual with noise have noise in them, whose products say
//! nothing of the parameters, and in loud records are most of it. The variance of the estimate `s − g/h` is `b/h²`, where `b` is the
//! variance of `g` under white noise.

use std::f64::consts::TAU;

use statrs::distribution::{ContinuousCDF, Normal};
use twinlag_model::{Beside, Effect, Fitted, Linearised, ModelError, NormalEquations, Parameter, Shared, dense};

use crate::candidates::Search;

/// Difference of two whitened residuals, which are of order one, up to which they are the same: that of rounding.
const SAME_RESIDUAL: f64 = 1e-9;
/// Standard deviations below zero at which a truncated normal is as an exponential distribution.
const FAR_BELOW_ZERO: f64 = -8.0;

/// A fitted model near its best fit, and along the size of each effect that it lacks.
pub(crate) struct Around<'a> {
    pub(crate) fitted: &'a Fitted,
    pub(crate) lin: Linearised,
    /// Candidates that the model lacks, noise among them.
    pub(crate) candidates: usize,
    /// Those of them that have a size.
    pub(crate) sized: Vec<Shared>,
    /// Those of these that were asked for.
    pub(crate) lacking: Vec<Lacking>,
}

/// An effect that a model lacks.
pub(crate) struct Lacking {
    pub(crate) effect: Shared,
    /// Which of its parameters is its size.
    pub(crate) main: usize,
    /// For each set of values that its other parameters may begin with, the energy along its size near none; `None` where the
    /// parameters of the model are not determined beside it.
    pub(crate) along: Vec<Option<Profile>>,
}

/// Where a model was linearised.
struct Point<'a> {
    fitted: &'a Fitted,
    lin: &'a Linearised,
    normal: &'a NormalEquations,
    /// Half the second derivatives of the energy.
    second: &'a [Vec<f64>],
    /// Whether they do for the parameters of the model beside any effect, by [`Point::second_beside`].
    is_enough: bool,
}

impl Point<'_> {
    /// Half the second derivatives of the energy by the parameters of the model, beside an effect of no size which whitens the
    /// residual once more: products of first derivatives as they are there, with what noise adds to them, residual by residual,
    /// as it is here.
    ///
    /// With derivatives that are taken there, none of 480 numbers of two lags (299 records of random rigs with small effects, 2000 to
    /// 100 000 samples) has another grade, and the conditions of eight name other effects.
    ///
    /// - `beside`: the normal equations with the effect
    fn second_beside(&self, beside: &NormalEquations) -> Vec<Vec<f64>> {
        let (there, here) = (&beside.products, &self.normal.products);
        let share = beside.count as f64 / self.normal.count as f64;
        let at = |i: usize, j: usize| there[i][j] + share * (self.second[i][j] - here[i][j]);
        (0..here.len()).map(|i| (0..here.len()).map(|j| at(i, j)).collect()).collect()
    }
}

impl Search<'_> {
    /// What a fitted model is like near its best fit.
    ///
    /// # Errors
    /// [`ModelError::Cancelled`] if the watch says so.
    pub(crate) fn around<'a>(&self, fitted: &'a Fitted) -> Result<Around<'a>, ModelError> {
        self.around_along(fitted, |_| true, false)
    }

    /// As [`Self::around`], along the sizes of those effects alone that are `wanted`, in half the time where two lags alone are
    /// fitted.
    pub(crate) fn quickly_around<'a>(
        &self,
        fitted: &'a Fitted,
        wanted: impl Fn(&Shared) -> bool,
    ) -> Result<Around<'a>, ModelError> {
        self.around_along(fitted, wanted, true)
    }

    fn around_along<'a>(
        &self,
        fitted: &'a Fitted,
        wanted: impl Fn(&Shared) -> bool,
        is_enough: bool,
    ) -> Result<Around<'a>, ModelError> {
        let Fitted { model, theta, .. } = fitted;
        let lin = model.linearised(theta, self.observations, self.selection);
        let normal = model.normal_equations(theta, self.observations, self.selection, None);
        let second = model.second_derivatives(theta, self.observations, self.selection, &normal, &[]);
        let point = Point { fitted, lin: &lin, normal: &normal, second: &second, is_enough };
        let all = self.unseen_candidates(model);
        let sized: Vec<(&Shared, usize)> = all
            .iter()
            .filter(|effect| !effect.is_noise())
            .filter_map(|effect| Some((effect, effect.main()?)))
            .collect();
        let asked: Vec<(&Shared, usize)> = sized.iter().filter(|(effect, _)| wanted(effect)).copied().collect();
        let lacking = self.each(&asked, |&(effect, main)| {
            let starts = starts_beside_size(effect.as_ref(), main);
            let along = starts.iter().map(|start| self.near_none(&point, effect, main, start)).collect();
            Lacking { effect: effect.clone(), main, along }
        })?;
        let sized = sized.into_iter().map(|(effect, _)| effect.clone()).collect();
        Ok(Around { fitted, lin, candidates: all.len(), sized, lacking })
    }

    /// The energy along the size of an effect, from where it changes nothing, or from the least size that it can have; `None`
    /// where the other parameters are not determined.
    ///
    /// - `start`: values of the parameters that have no neutral one, beside the size; they are held
    fn near_none(&self, point: &Point<'_>, effect: &Shared, main: usize, start: &[f64]) -> Option<Profile> {
        let Point { fitted, lin: without, second, is_enough, .. } = *point;
        let (observations, selection, count) = (self.observations, self.selection, fitted.theta.len());
        let parameters = effect.parameters();
        let is_held = |i: usize| i != main && parameters[i].neutral().is_none();
        let mut theta = fitted.theta.clone();
        theta.extend((0..start.len()).map(|i| if is_held(i) { start[i] } else { least_size(&parameters[i]) }));
        let model = fitted.model.with(effect.clone());
        // A delay takes samples away, and a second lag filters the residual once more.
        let beside = Beside { without, max_difference: SAME_RESIDUAL };
        let mut normal = model.scored_normal_equations(&theta, observations, selection, Some(beside));
        (0..start.len()).filter(|i| is_held(*i)).for_each(|i| normal.hold(count + i));
        let known = match (normal.is_beside, is_enough) {
            (true, _) => second.to_vec(),
            (false, true) => point.second_beside(&normal),
            (false, false) => Vec::new(),
        };
        let second = model.second_derivatives(&theta, observations, selection, &normal, &known);
        Profile::along(count + main, &normal, &second, fitted.mean_energy().max(1.0))
    }
}

/// The value of a parameter at which it changes nothing, or as little as it can.
pub(crate) fn least_size(parameter: &Parameter) -> f64 {
    parameter.neutral().unwrap_or(parameter.variable.lower)
}

/// The starts of `effect` that differ where it has no size, `main`: in parameters without a neutral value. Without such
/// parameters one start stands for all.
fn starts_beside_size(effect: &dyn Effect, main: usize) -> Vec<Vec<f64>> {
    let mut starts = effect.starts();
    if effect.parameters().iter().enumerate().all(|(i, p)| i == main || p.neutral().is_some()) {
        starts.truncate(1);
    }
    starts
}

/// The energy of a residual along the size of an effect, the other parameters at their best, in units of that of the noise.
pub(crate) struct Profile {
    /// Half its first derivative.
    slope: f64,
    /// Half its second one.
    curvature: f64,
    /// Variance of `slope`, where the noise is white.
    slope_variance: f64,
    /// How far each parameter goes with the size; of the size itself 1.
    pub(crate) follow: Vec<f64>,
}

impl Profile {
    /// Along the parameter `at`; `None` where the others are not determined beside it.
    ///
    /// - `second`: half the second derivatives of the energy
    /// - `noise`: energy of the noise for each residual
    fn along(at: usize, normal: &NormalEquations, second: &[Vec<f64>], noise: f64) -> Option<Self> {
        let products = &normal.products;
        let is_convex = (0..products.len()).all(|i| i == at || products[i][i] <= 0.0 || second[i][i] > 0.0);
        let without = |matrix: &[Vec<f64>]| {
            let mut out = matrix.to_vec();
            for i in 0..out.len() {
                out[i][at] = 0.0;
                out[at][i] = 0.0;
            }
            dense::inverse(&out)
        };
        // As the covariance of a fit does.
        let inverse = without(second).filter(|_| is_convex).or_else(|| without(products))?;
        let mut follow: Vec<f64> = dense::times(&inverse, &second[at]).iter().map(|x| -x).collect();
        follow[at] = 1.0;
        Some(Self {
            slope: dense::dot(&follow, &normal.slope) / noise,
            curvature: dense::dot(&follow, &second[at]) / noise,
            slope_variance: dense::dot(&follow, &dense::times(&normal.slope_covariance, &follow)) / noise,
            follow,
        })
    }

    /// That of a record which says nothing of the size.
    #[cfg(test)]
    pub(crate) fn unseen() -> Self {
        Self { slope: 0.0, curvature: 0.0, slope_variance: 0.0, follow: Vec::new() }
    }

    /// Variance of the estimated size; infinite where the energy has no minimum.
    pub(crate) fn variance(&self) -> f64 {
        if self.curvature > 0.0 { self.slope_variance / self.curvature.powi(2) } else { f64::INFINITY }
    }

    /// What is known of the size, which was normal beforehand, with zero mean.
    ///
    /// - `usual`: standard deviation beforehand
    /// - `is_positive`: whether it is known to be positive
    pub(crate) fn posterior(&self, usual: f64, is_positive: bool) -> Posterior {
        let is_seen = self.curvature > 0.0 && self.slope_variance > 0.0;
        let weight = if is_seen { self.curvature / self.slope_variance } else { 0.0 };
        let precision = weight * self.curvature + usual.powi(-2);
        let mean = -weight * self.slope / precision;
        let (std, in_std) = (precision.sqrt().recip(), mean * precision.sqrt());
        if is_positive && in_std < FAR_BELOW_ZERO {
            let density = 1.0 / (in_std.abs() * TAU.sqrt());
            let sizes = Sizes::Exponential { mean: std / in_std.abs() };
            return Posterior { bayes_factor: 2.0 * density * std / usual, sizes };
        }
        let factor = if is_positive { 2.0 * Normal::standard().cdf(in_std) } else { 1.0 };
        let bayes_factor = factor * (0.5 * in_std * in_std).exp() * std / usual;
        Posterior { bayes_factor, sizes: Sizes::Normal { mean, std, is_positive } }
    }
}

/// What is known of the size of an effect after a record.
pub(crate) struct Posterior {
    /// How much more probable the record is with an effect of such sizes than without one.
    pub(crate) bayes_factor: f64,
    sizes: Sizes,
}

/// How the size of an effect is distributed.
enum Sizes {
    /// Normally; of positive ones alone where these are known to be.
    Normal { mean: f64, std: f64, is_positive: bool },
    /// As the far tail of a normal.
    Exponential { mean: f64 },
}

impl Posterior {
    /// Probability that the size is further than `distance` from none.
    pub(crate) fn beyond(&self, distance: f64) -> f64 {
        let normal = Normal::standard();
        match self.sizes {
            Sizes::Exponential { mean } => (-distance / mean).exp(),
            Sizes::Normal { mean, std, is_positive: true } => {
                normal.cdf((mean - distance) / std) / normal.cdf(mean / std)
            }
            Sizes::Normal { mean, std, is_positive: false } => {
                normal.cdf((mean - distance) / std) + normal.cdf((-mean - distance) / std)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    use twinlag_model::{Effort, Identifier, Model, Observations, Prepared, Settings, Stretch};
    use twinlag_signal::{Gas, Noise, Record, Rig, Sensor, Signal, Turbulence};

    use super::*;

    fn profile([slope, curvature, slope_variance]: [f64; 3]) -> Profile {
        Profile { slope, curvature, slope_variance, follow: Vec::new() }
    }

    /// Bayes factor, and the probability to be further than `distance` from none, by a sum over sizes, of an estimate −g/h with
    /// variance b/h².
    fn summed(usual: f64, is_positive: bool, [slope, curvature, slope_variance]: [f64; 3], distance: f64) -> [f64; 2] {
        let weight = curvature / slope_variance;
        let step = 1e-4 * usual;
        let first = if is_positive { 0 } else { -100_000 };
        let (mut sum, mut far, mut prior) = (0.0, 0.0, 0.0);
        for k in first..100_000 {
            let size = step * (f64::from(k) + 0.5);
            let before = (-0.5 * (size / usual).powi(2)).exp();
            let likelihood = (-weight * (slope * size + 0.5 * curvature * size * size)).exp();
            prior += before;
            sum += before * likelihood;
            far += if size.abs() > distance { before * likelihood } else { 0.0 };
        }
        [sum / prior, far / sum]
    }

    /// Sums over steps of a ten-thousandth of the usual size are exact to its square, far beyond the bound.
    #[test]
    fn posteriors_are_those_of_a_sum_over_sizes() {
        for is_positive in [false, true] {
            for energy in [[0.0, 1.0, 1.0], [-3.0, 2.0, 2.5], [2.0, 2.0, 4.0], [-0.5, 0.01, 0.02]] {
                for distance in [0.0, 0.21, 0.7] {
                    let got = profile(energy).posterior(0.7, is_positive);
                    let [factor, far] = summed(0.7, is_positive, energy, distance);
                    assert!((got.bayes_factor / factor - 1.0).abs() < 1e-6, "{energy:?} {is_positive}");
                    assert!((got.beyond(distance) / far - 1.0).abs() < 1e-6, "{energy:?} {is_positive} {distance}");
                }
            }
        }
    }

    /// At 22 standard deviations below zero the exponential distribution is exact to three times the inverse square of that.
    #[test]
    fn a_positive_size_that_seems_negative_is_small_and_improbable() {
        let energy = [45.0, 2.0, 2.0];
        for distance in [0.0, 0.02] {
            let got = profile(energy).posterior(0.7, true);
            let [factor, far] = summed(0.7, true, energy, distance);
            let [of_factor, of_far] = [got.bayes_factor / factor, got.beyond(distance) / far];
            assert!((of_factor - 1.0).abs() < 6.2e-3 && (of_far - 1.0).abs() < 6.2e-3, "{of_factor} {of_far}");
        }
    }

    /// A record that says nothing leaves what was known before: one size of three is further from none than a standard deviation.
    #[test]
    fn nothing_seen_leaves_the_usual_size() {
        let one_in_three = 2.0 * Normal::standard().cdf(-1.0);
        for is_positive in [false, true] {
            let nothing = profile([0.3, -1.0, 1.0]).posterior(2.0, is_positive);
            assert!((nothing.bayes_factor - 1.0).abs() < 1e-12 && (nothing.beyond(2.0) - one_in_three).abs() < 1e-12);
        }
    }

    /// Turbulence of 20 K that sensors of 12 and 60 ms read, 12 and 60 samples, in noise of 2 K.
    fn loud_record() -> Observations {
        let gas = Gas::new(300.0, Signal::Turbulence(Turbulence { std_k: 20.0, corner_hz: 2.4, cutoff_hz: 200.0 }));
        let mut sensors = [Sensor::new("T1", 0.012), Sensor::new("T2", 0.060)];
        sensors.iter_mut().for_each(|sensor| sensor.noise = Some(Noise::white(2.0)));
        let record = Rig::new(20, Record::new(3000, 0.001), gas, sensors).expect("a valid rig").simulate();
        let record = record.expect("a rig of finite numbers");
        let time_s = (0..3000).map(|k| f64::from(k) * 0.001).collect();
        Observations::new(vec![Stretch::new(time_s, [record.t1_c, record.t2_c])], Some(0.001)).expect("finite and long")
    }

    /// Along the size of a delay the energy bends as its profile says, where products of first derivatives say more.
    ///
    /// Over a standard error the bend changes by less than a half, and the change goes with the square of the step: 1/800 over a
    /// twentieth. The derivatives are averages over up to a third of a standard error: 1/18.
    #[test]
    fn a_profile_bends_as_the_energy_does_in_a_loud_record() {
        let settings = Settings::default();
        let prepared = Prepared::new(&loud_record(), &settings).expect("a record that can be fitted");
        let (observations, selection) = (&prepared.observations, &prepared.searched);
        let model = Model::new(&settings.known, prepared.levels.std_k);
        let fitted = model.fit(&[0.012, 0.060], observations, selection, Effort::Finish);
        let watch = |_: &str, _, _| ControlFlow::Continue(());
        let search = Search::of(&prepared, &settings, &watch);
        let around = search.around(&fitted).expect("not cancelled");
        let is_it = |l: &&Lacking| l.effect.identifier() == Identifier::DELAY;
        let delay = around.lacking.iter().find(is_it).expect("a delay is tried");
        let along = delay.along[0].as_ref().expect("two lags are determined beside a delay");

        let noise = fitted.mean_energy().max(1.0);
        let model = fitted.model.with(delay.effect.clone());
        let h = along.variance().sqrt() / 20.0;
        let theta = |h: f64| -> Vec<f64> {
            let here = fitted.theta.iter().chain([&0.0]);
            here.zip(&along.follow).map(|(x, w)| x + h * w).collect()
        };
        let at = |h: f64| model.energy(&theta(h), observations, selection);
        let bent = (at(h) - 2.0 * at(0.0) + at(-h)) / (2.0 * h * h * noise);
        assert!((bent / along.curvature - 1.0).abs() < 1.0 / 18.0 + 1.0 / 800.0, "{bent} {}", along.curvature);

        let normal = model.normal_equations(&theta(0.0), observations, selection, None);
        let inverse = dense::inverse(&normal.products).expect("all three are determined");
        let of_products = 1.0 / (inverse[2][2] * noise);
        assert!(of_products > 1.5 * along.curvature, "{of_products} {}", along.curvature);
    }
}
