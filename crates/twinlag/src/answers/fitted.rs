//! A fit of the model of a rig as a characterisation.

use twinlag_cross_relation::{Parameter, TestName};
use twinlag_diagnose::{Identifier, Judgements, ModelFit, TimeConstant};
use twinlag_estimate::{IntervalBasis, Known, NoiseSource};
use twinlag_record::{Record, SamplingKind};

use crate::answers::{
    Characterisation, Difference, Estimated, FreeParameters, IntervalMethod, MadeBy, NamedEffect, RecordSummary,
    Residual, SensorEstimate, Status,
};
use crate::options::Options;

/// Name of the estimator: maximum likelihood of the whitened disagreement under a model of the
/// whole rig, with the gas as a spline between samples.
const ESTIMATOR: &str = "whitened";

/// A fit of the model of a rig, and what it is of.
pub(crate) struct FittedAnswer<'a> {
    pub(crate) record: &'a Record,
    pub(crate) fit: &'a ModelFit,
    pub(crate) options: &'a Options,
    /// Whether the levels of the noise were given, by the options or a model.
    pub(crate) is_noise_given: bool,
    /// Whether the difference of the time constants is a total delay, the same wherever on its valley the fit ends.
    pub(crate) is_total_delay: bool,
    /// Grades of the numbers.
    pub(crate) judgements: Judgements,
}

impl FittedAnswer<'_> {
    /// Whether both time constants are determined.
    pub(crate) fn is_determined(&self) -> bool {
        self.fit.time_constants.iter().all(|t| t.value_s.is_some())
    }

    /// The characterisation with the numbers of this fit and of no other: what it does not say is
    /// `None`.
    pub(crate) fn characterisation(&self, status: Status) -> Characterisation {
        let Self { record, fit, options, .. } = *self;
        let undetermined = (0..2).filter(|&i| fit.time_constants[i].value_s.is_none());
        let mut out = Characterisation {
            schema: Characterisation::SCHEMA.into(),
            record: RecordSummary::of(record),
            estimator: ESTIMATOR.into(),
            optimiser: fit.fit.optimiser.clone(),
            hold: if record.sampling.kind == SamplingKind::Irregular { "bilinear" } else { "cubic-spline" }.into(),
            hold_sensitivity: None,
            sensors: [self.sensor(0), self.sensor(1)],
            time_constant_difference_s: Difference {
                value: fit.difference.value_s,
                interval_95_s: fit.difference.interval_95_s,
                includes_delay: self.is_total_delay,
                judgement: self.judgements.difference.clone(),
            },
            free: FreeParameters { gain: None, offset_k: None },
            residual: Residual {
                chi2_per_dof: Some(fit.chi2_per_dof),
                white: fit
                    .tests
                    .iter()
                    .find(|t| t.test == TestName::Whiteness)
                    .is_none_or(|t| t.p_value >= fit.rejection_p_value),
                tests: fit.tests.clone(),
            },
            interval_method: if fit.is_weighted_by_residual {
                IntervalMethod::ResidualSpectrum
            } else {
                IntervalMethod::Information
            },
            status,
            not_identifiable: undetermined.map(|i| Known::NAMES[i].to_owned()).collect(),
            model_remarks: Vec::new(),
            records: Vec::new(),
            transfer: None,
            plausibility: Vec::new(),
            warnings: Vec::new(),
            advice: Vec::new(),
            fit: fit.fit.clone(),
            starts: None,
            notes: record.notes.iter().map(ToString::to_string).collect(),
            made_by: MadeBy::with(options),
        };
        if !self.is_total_delay {
            out.drop_difference_on_bound();
        }
        if !options.best_effort {
            out.withhold();
        }
        out
    }

    fn sensor(&self, i: usize) -> SensorEstimate {
        let TimeConstant { value_s, standard_error_s, interval_95_s, .. } = self.fit.time_constants[i];
        SensorEstimate {
            channel: self.record.channels[i].clone(),
            time_constant_s: value_s,
            standard_error_s,
            interval_95_s,
            interval_basis: interval_95_s.map(|_| IntervalBasis::StandardError),
            second_time_constant_s: None,
            noise_std_k: self.fit.noise_std_k[i],
            noise_standard_error_k: None,
            noise_ar1: None,
            noise_from: Some(match (self.is_noise_given, self.fit.is_noise_of_residual) {
                (true, _) => NoiseSource::Given,
                (false, true) => NoiseSource::Residual,
                (false, false) => NoiseSource::ThirdDifferences,
            }),
            known: self.options.known(Parameter::ALL[i]).is_some_and(|k| k.std.is_none()),
            judgement: self.judgements.time_constants[i].clone(),
        }
    }
}

impl FreeParameters {
    /// Gain and offset among the parameters of effects.
    pub(crate) fn among(effects: &[NamedEffect]) -> Self {
        let free = |name: &str| {
            let of_calibration = effects.iter().filter(|e| e.effect == Identifier::CALIBRATION);
            let p = of_calibration.flat_map(|e| &e.parameters).find(|p| p.name == name)?;
            let (value, interval_95, judgement) = (p.value?, p.interval_95?, p.judgement.clone());
            Some(Estimated { value, standard_error: p.standard_error, interval_95, judgement })
        };
        Self { gain: free("gain"), offset_k: free("offset") }
    }
}
