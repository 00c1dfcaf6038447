//! Whether the numbers of a characterisation may be used.

use twinlag_cross_relation::{Influences, PartScatter, sandwich};
use twinlag_diagnose::{Basis, Grade, Judgement, Number, Policy, Reason};
use twinlag_estimate::{Estimator, REJECTION_P_VALUE};

use super::conclude::Conclusion;
use crate::answers::{Characterisation, Status};
use crate::verbs::given::given;

impl<const P: usize> Conclusion<'_, '_, P> {
    /// Grades every number of `out`, and widens its interval to what it has to cover.
    ///
    /// - `covariance`: that the intervals rest on; `None` where there is none
    pub(super) fn judge(&self, out: &mut Characterisation, covariance: Option<&[[f64; P]; P]>) {
        let policy = Policy::default();
        let basis = self.basis(out);
        let most_s = policy.longest_given_share * self.span_s();
        let scatter = covariance.filter(|_| self.is_whitened()).map(|c| Scattering::of(self, c));
        let of = |sum: &[(usize, f64)]| scatter.as_ref().and_then(|s| s.between_parts(sum));
        let judged = |value: Option<f64>, interval_95, scatter, is_positive, limit_s: f64| {
            let Some(value) = value else { return (Judgement::of(&[Reason::NotDetermined]), interval_95) };
            let own = if value.abs() > limit_s { vec![Reason::TooLong { most_s: limit_s }] } else { Vec::new() };
            Number { value, standard_error: None, interval_95, scatter, between: None, is_positive }
                .judged(own, &basis, &policy)
        };
        for i in 0..2 {
            let sensor = &mut out.sensors[i];
            if sensor.known && sensor.time_constant_s.is_some() {
                sensor.judgement = Judgement::of_given(&basis);
            } else {
                (sensor.judgement, sensor.interval_95_s) =
                    judged(sensor.time_constant_s, sensor.interval_95_s, of(&[(i, 1.0)]), true, most_s);
            }
            if let Some(lag) = &mut sensor.second_time_constant_s {
                (lag.judgement, lag.interval_95) = if lag.known {
                    (Judgement::of_given(&basis), lag.interval_95)
                } else {
                    judged(lag.value, lag.interval_95, of(&[(4 + i, 1.0)]), true, most_s)
                };
            }
        }
        let difference = &mut out.time_constant_difference_s;
        (difference.judgement, difference.interval_95_s) =
            judged(difference.value, difference.interval_95_s, of(&[(0, -1.0), (1, 1.0)]), false, most_s);
        let level = self.fit.readings().level();
        let sums = [vec![(2, 1.0)], vec![(3, 1.0), (2, -level)]];
        for (free, sum) in [&mut out.free.gain, &mut out.free.offset_k].into_iter().zip(sums) {
            let Some(estimated) = free else { continue };
            let (judgement, interval) =
                judged(Some(estimated.value), Some(estimated.interval_95), of(&sum), false, f64::INFINITY);
            (estimated.judgement, estimated.interval_95) = (judgement, interval.unwrap_or(estimated.interval_95));
        }
    }

    /// What all numbers rest on.
    fn basis(&self, out: &Characterisation) -> Basis {
        let mut basis = Basis::default();
        let options = self.asked.options;
        if self.judged.is_rejected || out.status == Status::ModelRejected {
            let is_of_energy =
                out.residual.tests.iter().any(|t| t.finds_too_little_energy() && t.p_value < REJECTION_P_VALUE);
            let energy = out.residual.chi2_per_dof.filter(|_| is_of_energy && options.noise_std_k.is_some());
            basis.reasons.push(match energy {
                Some(energy) => {
                    let what = format!(
                        "the residual has {energy:.3} of the energy of the noise that is known beforehand: these levels are too \
                         high, and the estimate and its interval rest on them"
                    );
                    Reason::Fault { what, grade: Grade::NoGo }
                }
                // What is missing and goes with a time constant is not in the residual, so that bounds nothing here.
                None if options.known.is_empty() => Reason::LeftOver,
                None => Reason::LeftOverAside,
            });
        }
        let is_biased = matches!(
            options.estimator,
            Estimator::CrossRelation | Estimator::DifferenceEquationLs | Estimator::DifferenceEquationTls
        );
        if is_biased {
            basis.reasons.push(Reason::Biased);
        }
        basis.reasons.extend(self.contradictions.iter().cloned());
        basis.reasons.extend(options.known.iter().map(|known| Reason::Given { what: given(known) }));
        basis
    }

    fn span_s(&self) -> f64 {
        let time_s = &self.asked.record.time_s;
        time_s.last().zip(time_s.first()).map_or(0.0, |(last, first)| last - first)
    }
}

/// What each residual does to the parameters.
struct Scattering<'c, const P: usize> {
    influences: Influences<P>,
    /// Inverse of the sum of products of the derivatives.
    inverse: Option<[[f64; P]; P]>,
    covariance: &'c [[f64; P]; P],
}

impl<'c, const P: usize> Scattering<'c, P> {
    fn of(conclusion: &Conclusion<'_, '_, P>, covariance: &'c [[f64; P]; P]) -> Self {
        let influences = conclusion.fit.whitened().influences(&conclusion.solved.theta);
        let mut products = influences.products();
        for prior in conclusion.fit.knowledge() {
            products[prior.index][prior.index] += prior.std.powi(-2);
        }
        let inverse = sandwich(&products, &products, &conclusion.fit.free());
        Self { influences, inverse, covariance }
    }

    /// How far a sum of parameters, each by its index and its factor, moves between parts of the record.
    fn between_parts(&self, sum: &[(usize, f64)]) -> Option<PartScatter> {
        let inverse = self.inverse.as_ref().filter(|_| sum.iter().all(|(i, _)| *i < P))?;
        let pairs = sum.iter().flat_map(|a| sum.iter().map(move |b| (a, b)));
        let variance: f64 = pairs.map(|((i, s), (j, t))| s * t * self.covariance[*i][*j]).sum();
        let weights: [f64; P] = std::array::from_fn(|i| sum.iter().map(|(j, t)| inverse[i][*j] * t).sum());
        self.influences.scatter(&weights, variance.max(0.0).sqrt())
    }
}
