//! The numbers of an answer, and what goes with each.

use twinlag_cross_relation::{Parameter, TestName, Z_975, log_normal_interval_95};
use twinlag_diagnose::Judgement;
use twinlag_estimate::{Estimator, IntervalBasis, Intervals, Known, NoiseColour, REJECTION_P_VALUE, TauIntervals};
use twinlag_sensor::Discretisation;

use super::conclude::Conclusion;
use crate::answers::{
    Characterisation, Difference, Estimated, FreeParameters, IntervalMethod, MadeBy, RecordSummary, Residual,
    SecondLag, SensorEstimate, Status,
};
use crate::setting::Setting;

/// Share of a standard error that the choice of hold may cost without a word: half of one widens
/// the interval by an eighth.
const NOTICEABLE_STANDARD_ERRORS: f64 = 0.5;
/// Standard error of an estimate with one hold, over how far the other one moves it. A gas does something between the two: evenly
/// spread from one to the other, the mean square of the distance from one is a third of the square of its longest.
const HOLD_STANDARD_ERRORS: f64 = 0.577_350_269_189_625_8;
/// Standard deviations from a known value beyond which the record contradicts it: by chance once in
/// 370.
pub(super) const CONTRADICTING_STANDARD_DEVIATIONS: f64 = 3.0;

impl<const P: usize> Conclusion<'_, '_, P> {
    /// Everything but the estimates.
    pub(super) fn skeleton(&self, status: Status) -> Characterisation {
        let tests = self.judged.tests.clone();
        let total = tests.iter().find(|t| t.test == TestName::TotalEnergy).map(|t| t.statistic);
        let chi2_per_dof = self.levels.energy_as_found.or(total);
        Characterisation {
            schema: Characterisation::SCHEMA.into(),
            record: RecordSummary::of(self.asked.record),
            estimator: self.asked.options.estimator.name().into(),
            optimiser: self.best.optimiser.clone(),
            hold: hold_name(self.fit.whitened().hold()).into(),
            hold_sensitivity: self.moved_by_hold,
            sensors: [self.unknown_sensor(0), self.unknown_sensor(1)],
            time_constant_difference_s: Difference::default(),
            free: FreeParameters::default(),
            residual: Residual {
                chi2_per_dof,
                white: tests.iter().all(|t| t.test != TestName::Whiteness || t.p_value >= REJECTION_P_VALUE),
                tests,
            },
            interval_method: IntervalMethod::None,
            status,
            not_identifiable: Vec::new(),
            model_remarks: Vec::new(),
            records: Vec::new(),
            transfer: None,
            plausibility: Vec::new(),
            warnings: Vec::new(),
            advice: Vec::new(),
            fit: self.best.clone(),
            starts: Some(self.solved.starts),
            notes: self.asked.record.notes.iter().map(ToString::to_string).collect(),
            made_by: MadeBy::with(self.asked.options),
        }
    }

    /// Sensor `i` without its time constant.
    fn unknown_sensor(&self, i: usize) -> SensorEstimate {
        let is_coloured = self.asked.options.noise_colour == NoiseColour::Autoregressive;
        let known = self.asked.options.known(Parameter::ALL[4 + i]).filter(|k| k.std.is_none()).map(|k| k.value);
        let second = SecondLag {
            value: known,
            standard_error: None,
            interval_95: None,
            known: known.is_some(),
            judgement: Judgement::default(),
        };
        SensorEstimate {
            channel: self.asked.record.channels[i].clone(),
            time_constant_s: None,
            standard_error_s: None,
            interval_95_s: None,
            interval_basis: None,
            second_time_constant_s: self.asked.options.has_second_lag()[i].then_some(second),
            noise_std_k: self.levels.std_k[i],
            noise_standard_error_k: self.levels.standard_error_k()[i],
            noise_ar1: is_coloured.then_some(self.levels.ar1[i]),
            noise_from: Some(self.levels.source[i]),
            known: self.fit.is_held(i),
            judgement: Judgement::default(),
        }
    }

    /// Estimates and intervals of both time constants and of their difference.
    pub(super) fn fill(&mut self, out: &mut Characterisation, covariance: &[[f64; P]; P], intervals: &TauIntervals) {
        let theta = self.solved.theta;
        let moved: [f64; 2] = self.moved_by_hold.map_or([0.0; 2], |moved| [0, 1].map(|i| moved[i] * theta[i]));
        for i in 0..2 {
            let sensor = &mut out.sensors[i];
            sensor.time_constant_s = Some(theta[i]);
            if sensor.known {
                continue;
            }
            let noise = covariance[i][i].sqrt();
            sensor.standard_error_s = Some(noise.hypot(HOLD_STANDARD_ERRORS * moved[i]));
            // Its interval with the other hold is as long, and lies around the other value.
            let relative = 1.0 + moved[i] / theta[i];
            let [low, high] = intervals.interval_95_s[i];
            sensor.interval_95_s = Some([low * relative.min(1.0), high * relative.max(1.0)]);
            sensor.interval_basis = Some(intervals.basis[i]);
            if moved[i].abs() > NOTICEABLE_STANDARD_ERRORS * noise {
                self.warnings.push(format!(
                    "{}: the assumption about the gas between samples changes the time constant by \
                     {:.2} %, which is part of the interval; sample faster",
                    sensor.channel,
                    100.0 * self.moved_by_hold.map_or(0.0, |moved| moved[i]).abs()
                ));
            }
        }
        let difference = theta[1] - theta[0];
        let variance = covariance[0][0] + covariance[1][1] - 2.0 * covariance[0][1];
        let (width, difference_moved) = (Z_975 * variance.sqrt(), moved[1] - moved[0]);
        out.time_constant_difference_s = Difference {
            value: Some(difference),
            interval_95_s: Some([
                difference - width + difference_moved.min(0.0),
                difference + width + difference_moved.max(0.0),
            ]),
            includes_delay: false,
            judgement: Judgement::default(),
        };
    }

    /// Relative calibration, where it was fitted.
    pub(super) fn fill_calibration(&self, out: &mut Characterisation, covariance: &[[f64; P]; P]) {
        let theta = self.solved.theta;
        if P > 2 {
            let estimate = |value: f64, variance: f64| {
                let error = variance.sqrt();
                Estimated {
                    value,
                    standard_error: Some(error),
                    interval_95: [value - Z_975 * error, value + Z_975 * error],
                    judgement: Judgement::default(),
                }
            };
            let (gain, offset, level) = (theta[2], theta[3], self.fit.readings().level());
            if !self.fit.is_held(2) {
                out.free.gain = Some(estimate(gain, covariance[2][2]));
            }
            if !self.fit.is_held(3) {
                // The costs have it at the level m of the readings: o(0 °C) = o − (g − 1) m.
                let at_zero = covariance[3][3] - 2.0 * level * covariance[2][3] + level * level * covariance[2][2];
                out.free.offset_k = Some(estimate(offset - (gain - 1.0) * level, at_zero));
            }
        }
    }

    /// Second lags: as found, or how large they may be.
    pub(super) fn fill_second_lags(&mut self, out: &mut Characterisation, covariance: &[[f64; P]; P]) {
        let theta = self.solved.theta;
        let always = self.asked.options.intervals == Intervals::Profile;
        for sensor in 0..2 {
            let (i, name) = (4 + sensor, Known::NAMES[4 + sensor]);
            let Some(mut lag) = out.sensors[sensor].second_time_constant_s.clone().filter(|lag| !lag.known) else {
                continue;
            };
            let channel = out.sensors[sensor].channel.clone();
            if let Some(unseen) = self.fit.unseen()[sensor] {
                out.not_identifiable.push(name.into());
                let allowed = match unseen.at_most_s {
                    Some(limit_s) => {
                        lag.interval_95 = Some([0.0, limit_s]);
                        format!("the record allows at most {limit_s:.3e} s")
                    }
                    None => "as far as the record shows, it may be as large as the first one".into(),
                };
                self.warnings.push(format!(
                    "{channel}: no second lag is detected; {allowed}. The time constants are those \
                     without it, and their intervals cover any second lag that is allowed; do not fit \
                     one, or give a known value of {name}"
                ));
                out.advice.extend([Setting::SecondOrder, Setting::Known]);
            } else if self.fit.is_vague(i, &theta, Some(covariance)) {
                out.not_identifiable.push(name.into());
                if self.asked.options.estimator == Estimator::Whitened {
                    lag.interval_95 = Some(self.fit.interval(i, covariance, true));
                }
                self.warnings.push(format!(
                    "{channel}: the record needs a second lag but does not determine its size; a \
                     data-sheet value may help, as a known value of {name}"
                ));
                out.advice.push(Setting::Known);
            } else {
                let error = covariance[i][i].sqrt();
                lag.value = Some(theta[i]);
                lag.standard_error = Some(error);
                lag.interval_95 = Some(if self.asked.options.estimator == Estimator::Whitened {
                    self.fit.interval(i, covariance, always)
                } else {
                    log_normal_interval_95(theta[i], error)
                });
            }
            out.sensors[sensor].second_time_constant_s = Some(lag);
        }
        for unseen in self.fit.unseen().iter().flatten() {
            widen(out, &theta, &unseen.moves);
        }
    }

    /// A fit that leaves what was known beforehand far behind is worth a word.
    pub(super) fn hold_against_knowledge(&mut self) {
        let theta = self.solved.theta;
        // Time constants have a comparison of their own.
        for prior in self.fit.knowledge().iter().filter(|prior| prior.index >= 2) {
            let away = (theta[prior.index] - prior.mean) / prior.std;
            if away.abs() > CONTRADICTING_STANDARD_DEVIATIONS {
                self.warnings.push(format!(
                    "the record contradicts the known value of {}: the estimate lies {:.1} of its \
                     standard deviations away",
                    Known::NAMES[prior.index],
                    away.abs()
                ));
            }
        }
    }
}

/// Widens intervals to what they would be around the parameters that each of `moves` makes of
/// `here`, too.
fn widen<const P: usize>(out: &mut Characterisation, here: &[f64; P], moves: &[f64; P]) {
    for (i, sensor) in out.sensors.iter_mut().enumerate() {
        let union = |[low, high]: [f64; 2], factor: f64| [low.min(low * factor), high.max(high * factor)];
        if let Some(interval) = &mut sensor.interval_95_s {
            let wider = union(*interval, moves[i]);
            if wider != *interval {
                (*interval, sensor.interval_basis) = (wider, Some(IntervalBasis::Profile));
            }
        }
        if let Some(SecondLag { value: Some(_), interval_95: Some(interval), .. }) = &mut sensor.second_time_constant_s
        {
            *interval = union(*interval, moves[4 + i]);
        }
    }
    let moved = (moves[1] - 1.0) * here[1] - (moves[0] - 1.0) * here[0];
    if let Some([low, high]) = &mut out.time_constant_difference_s.interval_95_s {
        (*low, *high) = (low.min(*low + moved), high.max(*high + moved));
    }
}

fn hold_name(hold: Discretisation) -> &'static str {
    match hold {
        Discretisation::ZeroOrderHold => "zero-order-hold",
        Discretisation::FirstOrderHold => "first-order-hold",
        Discretisation::Bilinear => "bilinear",
        _ => "band-limited",
    }
}
