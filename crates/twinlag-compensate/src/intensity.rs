//! How strongly the gas is driven along a record: a factor on the driving noise of its prior.
//!
//! A stationary prior takes a gas that rests and then jumps to move a little all the time. Here the
//! logarithm of the intensity is a process of its own, learned from the readings: by the slope and
//! the information of their exact likelihood, which the smoother gives beside the gas.

mod walk;

use walk::{Observed, Walk};

use crate::error::CompensateError;
use crate::prior::Prior;
use crate::readings::Readings;
use crate::reconstruct::score;
use crate::rig::Rig;
use crate::smooth::Score;

/// Standard deviations of the logarithm of the intensity that are tried: from 10 %, which moves no
/// band, to a factor of 90 either way.
const STDS: [f64; 8] = [0.1, 0.3, 0.6, 1.0, 1.5, 2.2, 3.2, 4.5];
/// Its correlation times that are tried, in movements of the gas that the readings resolve. Shorter than
/// two of these it cannot be seen.
const MEMORIES: [f64; 7] = [2.0, 4.0, 8.0, 16.0, 40.0, 100.0, 300.0];
/// Powers of the lines' square rate of change that are tried.
const POWERS: [f64; 6] = [0.0, 0.5, 1.0, 1.5, 2.0, 3.0];
/// What is added to the lines' square rate of change, as a share of its mean: at their turning points
/// the rest of the gas does not stop. Chosen.
const LEAST_RATE_SHARE: f64 = 0.1;
/// Longest correlation time, as a share of the record: what changes more slowly is its mean.
const MAX_MEMORY_SHARE: f64 = 0.25;
/// Times that the intensity is learned anew from what the smoother makes of the one before. Each is
/// close to a factor of `e` at rest; with six, a gas that rests is within a tenth of where more take its
/// bands.
const PASSES: usize = 6;
/// The pass after which an intensity that gains nothing is given up.
const DECIDING_PASS: usize = 2;
/// Most by which the logarithm moves in one pass, and in all.
const MAX_STEP_LN: f64 = 2.0;
const MAX_LN: f64 = 12.0;
/// Resolved movements that a changing intensity needs at least: two of the shortest correlation times
/// twice over.
const MIN_MOVES: f64 = 8.0;
/// Gain of the logarithm of the evidence below which the intensity is constant: odds of twenty to one.
const MIN_GAIN: f64 = 3.0;
/// Samples that correlation time, spread and power are chosen by, at most, in so many stretches.
const MAX_CHOOSING_SAMPLES: usize = 8192;
const CHOOSING_STRETCHES: usize = 4;

/// Factors on the intensity of the gas's driving noise: at each instant on that of the step that
/// leads to it. Lines (resonances of a quality above 10) keep their own, beside other parts.
///
/// ```
/// use twinlag_compensate::{Form, Intensity, Prior, Readings, Rig, Sensor, Term, reconstruct, reconstruct_with};
///
/// // Both sensors rest for the first second, and the gas is known to do so as well.
/// let time_s: Vec<f64> = (0..200).map(|k| 0.01 * f64::from(k)).collect();
/// let readings = Readings::new(time_s, [vec![20.0; 200], vec![20.0; 200]])?;
/// let rig = Rig::new([Sensor::new(0.05, 0.1), Sensor::new(0.2, 0.1)]);
/// let prior = Prior { level_c: 20.0, terms: vec![Term::Rough { std_k: 5.0, corner_hz: 1.0 }] };
/// let intensity = Intensity::new((0..200).map(|k| if k < 100 { 0.01 } else { 1.0 }).collect())?;
///
/// let gas = reconstruct_with(&readings, &rig, &prior, &intensity, Form::Smoother)?;
/// let steady = reconstruct(&readings, &rig, &prior, Form::Smoother)?;
/// assert!(gas.std_k[50] < 0.5 * steady.std_k[50]);
/// assert!((gas.std_k[150] / steady.std_k[150] - 1.0).abs() < 0.01);
/// # Ok::<(), twinlag_compensate::CompensateError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Intensity {
    factors: Vec<f64>,
}

impl Intensity {
    /// One factor for each instant.
    ///
    /// # Errors
    /// [`CompensateError::NotPositive`] for a factor that is not positive and finite.
    pub fn new(factors: Vec<f64>) -> Result<Self, CompensateError> {
        match factors.iter().find(|factor| !(**factor > 0.0 && factor.is_finite())) {
            Some(&got) => Err(CompensateError::NotPositive { what: "the intensity of the gas".into(), got }),
            None => Ok(Self { factors }),
        }
    }

    /// The factors of some of the `readings` that they are of, found by their instants: of an instant between two of theirs that of
    /// the later one.
    ///
    /// # Errors
    /// [`CompensateError::Lengths`] for another number of factors than of readings.
    pub fn of_part(&self, readings: &Readings, part: &Readings) -> Result<Self, CompensateError> {
        self.check(readings)?;
        let place = |time_s: &f64| readings.time_s().partition_point(|t| t < time_s).min(self.factors.len() - 1);
        Ok(Self { factors: part.time_s().iter().map(|t| self.factors[place(t)]).collect() })
    }

    /// The factors.
    pub fn factors(&self) -> &[f64] {
        &self.factors
    }

    pub(crate) fn check(&self, readings: &Readings) -> Result<(), CompensateError> {
        let (expected, got) = (readings.len(), self.factors.len());
        if got == expected { Ok(()) } else { Err(CompensateError::Lengths { expected, got }) }
    }
}

/// Estimates how the intensity of the gas changes along `readings`, all of them: for a smoother, not
/// for a filter. `None` where a constant one is as probable.
///
/// The logarithm is a first-order process about a mean, which in a gas with lines rises with how fast
/// these move. Its spread, correlation time and that power are those that make the readings most
/// probable.
///
/// # Errors
/// As [`crate::reconstruct()`].
pub fn learn_intensity(readings: &Readings, rig: &Rig, prior: &Prior) -> Result<Option<Intensity>, CompensateError> {
    let time_s = readings.time_s();
    let n = readings.len();
    let mut intensity = Intensity { factors: vec![1.0; n] };
    let steady = score(readings, rig, prior, None)?;
    let moves: f64 = steady.expected.iter().sum();
    if moves.is_nan() || moves < MIN_MOVES {
        return Ok(None);
    }
    // Without the time between pieces of a record.
    let span_s = n as f64 * readings.period_s();
    let worth = worth(readings, rig, prior);
    let of_memory = |moved: f64| (moved * span_s / moves).min(MAX_MEMORY_SHARE * span_s);
    let mut logarithm = vec![0.0; n];
    let mut now = steady.clone();
    for pass in 0..PASSES {
        let activity = activity(&now, n);
        let observed = Observed::of(time_s, &activity, &logarithm, &now, worth);
        let walk = if pass == 0 {
            Walk { std: STDS[4], memory_s: of_memory(MEMORIES[2]), power: 0.0 }
        } else {
            let (walk, evidence) = chosen(&observed, of_memory, !now.lines_k.is_empty());
            let gain = now.log_likelihood - steady.log_likelihood + evidence;
            if (pass == DECIDING_PASS || pass + 1 == PASSES) && (gain < MIN_GAIN || walk.is_steady(STDS[0])) {
                return Ok(None);
            }
            walk
        };
        let smoothed = walk.smoothed(&observed);
        for (u, to) in logarithm.iter_mut().zip(smoothed) {
            *u = (*u + (to - *u).clamp(-MAX_STEP_LN, MAX_STEP_LN)).clamp(-MAX_LN, MAX_LN);
        }
        intensity.factors = logarithm.iter().map(|u| u.exp()).collect();
        if pass + 1 < PASSES {
            now = score(readings, rig, prior, Some(&intensity.factors))?;
        }
    }
    Ok(Some(intensity))
}

/// The most probable process, and the logarithm of its evidence over that of the intensity that was
/// observed.
fn chosen(observed: &Observed<'_>, of_memory: impl Fn(f64) -> f64, has_lines: bool) -> (Walk, f64) {
    let powers = if has_lines { &POWERS[..] } else { &POWERS[..1] };
    let stretches = observed.stretches(MAX_CHOOSING_SAMPLES, CHOOSING_STRETCHES);
    let share = stretches.iter().map(|s| s.len() as f64).sum::<f64>() / observed.len() as f64;
    let walks = powers.iter().flat_map(|&power| {
        let of_memory = &of_memory;
        STDS.iter()
            .flat_map(move |&std| MEMORIES.iter().map(move |&memory| Walk { std, memory_s: of_memory(memory), power }))
    });
    let scored = walks.map(|walk| {
        let evidence: f64 = stretches.iter().map(|part| walk.log_evidence(part, observed)).sum();
        (walk, evidence / share)
    });
    let steady = (Walk { std: STDS[0], memory_s: of_memory(MEMORIES[0]), power: 0.0 }, f64::NEG_INFINITY);
    scored.fold(steady, |best, other| if other.1 > best.1 { other } else { best })
}

/// Logarithm of how fast the lines of the gas move at each instant; zero without lines. They are known
/// from all of their cycles, so that what happened at one instant has little part in it.
fn activity(score: &Score, samples: usize) -> Vec<f64> {
    let lines_k = &score.lines_k;
    let Some(last) = lines_k.len().checked_sub(1) else { return vec![0.0; samples] };
    let rates: Vec<f64> =
        (0..=last).map(|k| (lines_k[(k + 1).min(last)] - lines_k[k.saturating_sub(1)]).powi(2)).collect();
    let mean = rates.iter().sum::<f64>() / rates.len() as f64;
    if mean > 0.0 {
        rates.iter().map(|rate| (rate / mean + LEAST_RATE_SHARE).ln()).collect()
    } else {
        vec![0.0; samples]
    }
}

/// Fisher's information of `ln w` is half the sum of squares of the shares `S/(S + N)` that readings
/// determine of each movement; the smoother gives their sum. Their ratio, by the spectra.
fn worth(readings: &Readings, rig: &Rig, prior: &Prior) -> f64 {
    const POINTS: i32 = 2000;
    let period_s = readings.period_s();
    let shares = (0..POINTS).map(|k| {
        let hz = (f64::from(k) + 0.5) / f64::from(POINTS) * 0.5 / period_s;
        let power = prior.density_k2_per_hz(hz);
        power / (power + rig.noise_density_k2_per_hz(hz, period_s))
    });
    let (one, two) = shares.fold((0.0, 0.0), |(one, two), share| (one + share, two + share * share));
    if one > 0.0 { two / one } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Coloured, Sensor, Term};

    /// Central differences of the logarithm of the likelihood over 1e-4 in `ln w` are off by a sixth of the third derivative, which
    /// is of the size of the slope's terms (at most some tens), times 1e-8, and by rounding, 1e-16 of a likelihood of hundreds over
    /// 1e-4: together below 1e-6. With noise of the sensors driven beside the gas, a line that keeps its intensity, and a delay.
    #[test]
    fn the_slope_is_that_of_the_likelihood() {
        let time_s: Vec<f64> = (0..120).map(|k| 0.01 * f64::from(k) + 0.002 * (1.3 * f64::from(k)).sin()).collect();
        let wave = |lag_s: f64| time_s.iter().map(|t| 20.0 + 5.0 * (9.0 * (t - lag_s)).sin()).collect::<Vec<f64>>();
        let readings = Readings::new(time_s.clone(), [wave(0.02), wave(0.1)]).expect("good readings");
        let mut rig = Rig::new([Sensor::new(0.02, 0.3), Sensor::new(0.1, 0.2)]);
        rig.sensors[0].coloured = Some(Coloured { std_k: 0.4, correlation_s: 0.05 });
        rig.delay_s = 0.004;
        let rough = Term::Rough { std_k: 3.0, corner_hz: 2.0 };
        let line = Term::Resonance { std_k: 2.0, frequency_hz: 1.5, quality: 30.0 };
        for terms in [vec![rough], vec![rough, line], vec![line]] {
            let prior = Prior { level_c: 20.0, terms };
            let factors: Vec<f64> = (0..120).map(|k| (0.05 * f64::from(k)).sin().exp()).collect();
            let got = score(&readings, &rig, &prior, Some(&factors)).expect("a good rig");
            for k in [5, 40, 41, 118] {
                let at = |by: f64| {
                    let mut factors = factors.clone();
                    factors[k] *= by.exp();
                    score(&readings, &rig, &prior, Some(&factors)).expect("a good rig").log_likelihood
                };
                let want = (at(1e-4) - at(-1e-4)) / 2e-4;
                let got = 0.5 * (got.seen[k] - got.expected[k]);
                assert!((got - want).abs() < 1e-6 * (1.0 + want.abs()), "{prior:?} at {k}: {got}, want {want}");
            }
        }
    }
}
