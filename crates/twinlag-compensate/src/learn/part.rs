//! What a prior is learned in: single terms, and combs of lines that share a frequency.

use serde::{Deserialize, Serialize};
use twinlag_optimise::Variable;

use crate::prior::Term;

/// The place of a term, and how fast each of its numbers changes in some direction, in the order in which it has them: the
/// standard deviation, the frequency, the quality.
pub(super) type Direction = (usize, [f64; 3]);

/// Bounds of a quality.
const QUALITY_BOUNDS: [f64; 2] = [0.02, 1e4];
/// How far above its lower bound a quality counts as on it: fits end within less.
const ON_BOUND_SHARE: f64 = 1e-3;
/// Lowest frequency, in units of `1/T`: a fiftieth of a cycle in the record is a drift.
const MIN_CYCLES_PER_SPAN: f64 = 0.02;
/// Highest frequency, in units of `1/Ts`: what is sampled.
const MAX_CYCLES_PER_STEP: f64 = 0.5;
/// Least width of the first line of a comb, in units of `1/T`: a hundredth of a bin is no width.
const MIN_WIDTH_CYCLES_PER_SPAN: f64 = 0.01;
/// Largest width of the first line of a comb, as a share of its frequency.
const MAX_WIDTH_SHARE: f64 = 0.2;

/// Rough terms of a turbulent part.
const CASCADE_TERMS: usize = 5;
/// The highest corner of turbulence, in units of half the sampling rate, beyond which turbulence goes on. Above the highest corner the sum
/// falls as `1/f²`: with it at half the sampling rate, a third and more of the variance above that rate was missing.
const FASTEST_PER_NYQUIST: f64 = 8.0;

/// Noise has at least this share of the variance that it was thought to have.
const MIN_NOISE_VARIANCE_SHARE: f64 = 1e-3;

/// A part of the swing this small counts as zero.
const MIN_SWING_SHARE: f64 = 1e-5;

/// What bounds are made from.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    pub(super) swing_k: f64,
    pub(super) span_s: f64,
    pub(super) period_s: f64,
}

impl Limits {
    /// The highest corner of turbulence.
    pub(super) const fn fastest_hz(&self) -> f64 {
        fastest_hz(self.period_s)
    }
}

/// One part of the gas's motion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub(super) enum Part {
    /// No part of the gas: what the variances of both channels' noise are multiplied by.
    #[serde(skip)]
    Noise([f64; 2]),
    Single(Term),
    /// Turbulence, whose spectrum falls as `f^(−5/3)` above a corner (Kolmogorov 1941): rough terms
    /// with corners evenly spaced in their logarithm from that one to one beyond what is sampled,
    /// their variances as `f^(−2/3)`.
    Turbulent {
        std_k: f64,
        corner_hz: f64,
        fastest_hz: f64,
    },
    /// Lines at the multiples of a frequency. Where the phase wanders, the `m`-th is `m²` times as
    /// wide as the first.
    Comb {
        frequency_hz: f64,
        /// Half width of the first line.
        width_hz: f64,
        std_k: Vec<f64>,
        /// Whether there are more beyond the last one that is seen: they then fall as `1/m²`, as
        /// those of a pulse with a kink do, and a band has their power.
        goes_on: bool,
    },
}

impl Part {
    pub(super) fn terms(&self) -> Vec<Term> {
        match self {
            Self::Noise(_) => Vec::new(),
            Self::Single(term) => vec![*term],
            Self::Turbulent { std_k, corner_hz, fastest_hz } => {
                let step = (fastest_hz / corner_hz).powf(1.0 / (CASCADE_TERMS - 1) as f64);
                let shares: [f64; CASCADE_TERMS] = std::array::from_fn(|k| step.powf(-2.0 / 3.0 * k as f64));
                let all: f64 = shares.iter().sum();
                let terms = (0..CASCADE_TERMS as i32).zip(shares);
                terms
                    .map(|(k, share)| Term::Rough {
                        std_k: std_k * (share / all).sqrt(),
                        corner_hz: corner_hz * step.powi(k),
                    })
                    .collect()
            }
            Self::Comb { frequency_hz, width_hz, std_k, goes_on } => {
                let lines = (1..).zip(std_k).map(|(m, std_k)| {
                    let m = f64::from(m);
                    let quality = (0.5 * frequency_hz / (width_hz * m)).max(0.5);
                    Term::Resonance { std_k: *std_k, frequency_hz: m * frequency_hz, quality }
                });
                lines.chain(goes_on.then(|| tail(*frequency_hz, std_k)).flatten()).collect()
            }
        }
    }

    /// How fast the numbers of its terms change with number `a` of [`Part::values`]; terms that do not are left out.
    pub(super) fn directions(&self, a: usize) -> Vec<Direction> {
        match self {
            Self::Noise(_) => Vec::new(),
            Self::Single(_) => vec![(0, std::array::from_fn(|i| if i == a { 1.0 } else { 0.0 }))],
            Self::Turbulent { std_k, corner_hz, fastest_hz } => {
                // The step between corners is `(F/c)^(1/(n−1))`, and shares of the variance go with `step^(−2k/3)`.
                let by_corner = -1.0 / ((CASCADE_TERMS - 1) as f64 * corner_hz);
                let terms = self.terms();
                let share_by = |k: usize| -2.0 / 3.0 * k as f64 * by_corner;
                let share = |term: &Term| (term.std_k() / std_k).powi(2);
                let mean: f64 = terms.iter().enumerate().map(|(k, term)| share(term) * share_by(k)).sum();
                let of = |(k, term): (usize, &Term)| {
                    let corner_k_hz = corner_hz * (fastest_hz / corner_hz).powf(k as f64 / (CASCADE_TERMS - 1) as f64);
                    let by = match a {
                        0 => [term.std_k() / std_k, 0.0, 0.0],
                        _ => [
                            0.5 * term.std_k() * (share_by(k) - mean),
                            corner_k_hz * (1.0 / corner_hz + k as f64 * by_corner),
                            0.0,
                        ],
                    };
                    (k, by)
                };
                terms.iter().enumerate().map(of).collect()
            }
            Self::Comb { frequency_hz, std_k, .. } => {
                let lines = std_k.len();
                let of = |(k, term): (usize, Term)| {
                    let Term::Resonance { quality, .. } = term else { return None };
                    // A line as wide as its frequency is as wide as a line can be.
                    let is_narrow = quality > 0.5 && k < lines;
                    let by_shared = |by: f64| if is_narrow { by } else { 0.0 };
                    let by = match a {
                        _ if a < lines && k < lines => [if a == k { 1.0 } else { 0.0 }, 0.0, 0.0],
                        _ if a < lines => [tail_by(std_k, a), 0.0, 0.0],
                        _ if a == lines => [0.0, (k + 1) as f64, by_shared(quality / frequency_hz)],
                        _ => [0.0, 0.0, by_shared(-quality / self.values()[lines + 1])],
                    };
                    (by != [0.0; 3]).then_some((k, by))
                };
                self.terms().into_iter().enumerate().filter_map(of).collect()
            }
        }
    }

    /// Whether it has shrunk to less than anything that matters.
    pub(super) fn is_nothing(&self, limits: &Limits) -> bool {
        self.noise().is_none()
            && self.terms().iter().map(|t| t.std_k().powi(2)).sum::<f64>().sqrt() < MIN_SWING_SHARE * limits.swing_k
    }

    /// Whether it is of no lines at all.
    pub(super) fn is_empty(&self) -> bool {
        matches!(self, Self::Comb { std_k, .. } if std_k.is_empty())
    }

    /// This part where the gas is read every `period_s`.
    pub(super) fn read_every(&self, period_s: f64) -> Self {
        match self {
            Self::Turbulent { std_k, corner_hz, .. } => {
                Self::Turbulent { std_k: *std_k, corner_hz: *corner_hz, fastest_hz: fastest_hz(period_s) }
            }
            other => other.clone(),
        }
    }

    /// What the variances of both channels' noise are multiplied by.
    pub(super) const fn noise(&self) -> Option<[f64; 2]> {
        match self {
            Self::Noise(factors) => Some(*factors),
            _ => None,
        }
    }

    pub(super) fn kind(&self) -> &'static str {
        match self {
            Self::Noise(_) => "noise",
            Self::Single(Term::Resonance { quality, .. }) if is_line(*quality) => "line",
            Self::Single(Term::Resonance { .. }) => "smooth",
            Self::Single(Term::Rough { .. }) => "rough",
            Self::Turbulent { .. } => "turbulent",
            Self::Comb { goes_on: false, .. } => "comb",
            Self::Comb { goes_on: true, .. } => "endless comb",
        }
    }

    /// Whether it has lines at the multiples of a frequency.
    pub(super) const fn is_comb(&self) -> bool {
        matches!(self, Self::Comb { .. })
    }

    /// Parts that explain nearly the same and continue otherwise: a comb that ends for one that goes on, and the other way about; rough for
    /// turbulent, and the other way about; either for smooth, with its first corner, about `f₀ Q`.
    pub(super) fn otherwise(&self, limits: &Limits) -> Vec<Self> {
        let rough = |std_k, corner_hz| Self::Single(Term::Rough { std_k, corner_hz });
        let turbulent = |std_k, corner_hz| Self::Turbulent { std_k, corner_hz, fastest_hz: limits.fastest_hz() };
        match *self {
            Self::Comb { frequency_hz, width_hz, ref std_k, goes_on } => {
                vec![Self::Comb { frequency_hz, width_hz, std_k: std_k.clone(), goes_on: !goes_on }]
            }
            Self::Single(Term::Rough { std_k, corner_hz }) => vec![turbulent(std_k, corner_hz)],
            Self::Turbulent { std_k, corner_hz, .. } => vec![rough(std_k, corner_hz)],
            Self::Single(Term::Resonance { std_k, frequency_hz, quality }) if !is_line(quality) => {
                let corner_hz = frequency_hz * quality;
                vec![rough(std_k, corner_hz), turbulent(std_k, corner_hz)]
            }
            _ => Vec::new(),
        }
    }

    /// This part with fewer numbers, where one of them says nothing: an oscillator whose quality is on its lower bound has corners at
    /// `f₀ Q` and `f₀/Q`, a factor of 2500 apart, and with the first alone it is first-order noise. The likelihood decides whether
    /// the second is missed.
    pub(super) fn simpler(&self) -> Option<Self> {
        match *self {
            Self::Single(Term::Resonance { std_k, frequency_hz, quality })
                if quality <= (1.0 + ON_BOUND_SHARE) * QUALITY_BOUNDS[0] =>
            {
                Some(Self::Single(Term::Rough { std_k, corner_hz: frequency_hz * quality }))
            }
            _ => None,
        }
    }

    /// The numbers that are fitted.
    pub(super) fn values(&self) -> Vec<f64> {
        match self {
            Self::Noise(factors) => factors.to_vec(),
            Self::Single(Term::Rough { std_k, corner_hz }) | Self::Turbulent { std_k, corner_hz, .. } => {
                vec![*std_k, *corner_hz]
            }
            Self::Single(Term::Resonance { std_k, frequency_hz, quality }) => vec![*std_k, *frequency_hz, *quality],
            Self::Comb { frequency_hz, width_hz, std_k, .. } => {
                std_k.iter().copied().chain([*frequency_hz, *width_hz]).collect()
            }
        }
    }

    pub(super) fn variables(&self, limits: &Limits) -> Vec<Variable> {
        let Limits { swing_k, span_s, period_s } = *limits;
        let std = || Variable::logarithmic("std", 1e-7 * swing_k, 1e3 * swing_k);
        let frequency =
            || Variable::logarithmic("frequency", MIN_CYCLES_PER_SPAN / span_s, MAX_CYCLES_PER_STEP / period_s);
        match self {
            Self::Noise(_) => {
                vec![Variable::logarithmic("noise", MIN_NOISE_VARIANCE_SHARE, 1.0 / MIN_NOISE_VARIANCE_SHARE); 2]
            }
            Self::Single(Term::Rough { .. }) | Self::Turbulent { .. } => vec![std(), frequency()],
            Self::Single(Term::Resonance { .. }) => {
                vec![std(), frequency(), Variable::logarithmic("quality", QUALITY_BOUNDS[0], QUALITY_BOUNDS[1])]
            }
            Self::Comb { frequency_hz, std_k, .. } => {
                let widest = (MAX_WIDTH_SHARE * frequency_hz).max(2.0 * MIN_WIDTH_CYCLES_PER_SPAN / span_s);
                let width = Variable::logarithmic("width", MIN_WIDTH_CYCLES_PER_SPAN / span_s, widest);
                // Another frequency than one nearby would be another comb.
                let near = Variable::logarithmic("frequency", frequency_hz / 1.1, frequency_hz * 1.1);
                std_k.iter().map(|_| std()).chain([near, width]).collect()
            }
        }
    }
}

/// The highest corner of turbulence that is read every `period_s`.
const fn fastest_hz(period_s: f64) -> f64 {
    0.5 * FASTEST_PER_NYQUIST / period_s
}

/// Whether an oscillator counts as a line.
const fn is_line(quality: f64) -> bool {
    quality > 1.0
}

/// How the standard deviation of [`tail`] changes with the `a`-th of those of the lines.
fn tail_by(std_k: &[f64], a: usize) -> f64 {
    let last = std_k.len() - 1;
    let of_neighbour = (last as f64 / (last + 1) as f64).powi(2);
    let is_of_neighbour = last > 0 && std_k[last - 1] * of_neighbour > std_k[last];
    let size = ((last + 1) as f64 / 3.0).sqrt();
    match (is_of_neighbour, last - a) {
        (false, 0) => size,
        (true, 1) => size * of_neighbour,
        _ => 0.0,
    }
}

/// Where the lines go on: `Σ_{m > M} s² (M/m)⁴` is `s² M/3`, most of it just above the last one, of
/// which `s` is the larger of it and its neighbour.
fn tail(frequency_hz: f64, std_k: &[f64]) -> Option<Term> {
    let last = std_k.len().checked_sub(1)?;
    let line_k = std_k[last].max(std_k[last.saturating_sub(1)] * (last as f64 / (last + 1) as f64).powi(2));
    let std_k = line_k * ((last + 1) as f64 / 3.0).sqrt();
    Some(Term::Resonance { std_k, frequency_hz: (last as f64 + 2.0) * frequency_hz, quality: 2.0 })
}

/// Parts of the same kinds with other numbers.
pub(super) fn with(like: &[Part], x: &[f64]) -> Vec<Part> {
    let mut rest = x;
    like.iter()
        .map(|part| {
            let (own, others) = rest.split_at(part.values().len());
            rest = others;
            match part {
                Part::Noise(_) => Part::Noise([own[0], own[1]]),
                Part::Single(Term::Rough { .. }) => Part::Single(Term::Rough { std_k: own[0], corner_hz: own[1] }),
                Part::Single(Term::Resonance { .. }) => {
                    Part::Single(Term::Resonance { std_k: own[0], frequency_hz: own[1], quality: own[2] })
                }
                Part::Turbulent { fastest_hz, .. } => {
                    Part::Turbulent { std_k: own[0], corner_hz: own[1], fastest_hz: *fastest_hz }
                }
                Part::Comb { std_k, goes_on, .. } => {
                    let (std_k, shared) = own.split_at(std_k.len());
                    let [frequency_hz, width_hz] = [shared[0], shared[1]];
                    Part::Comb { frequency_hz, width_hz, std_k: std_k.to_vec(), goes_on: *goes_on }
                }
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prior::Prior;

    /// Above any frequency a spectrum `f^(−5/3)` has 3/2 of that frequency times the spectrum there, and one that goes on as `1/f²` two thirds of
    /// that. Of what is above half the sampling rate a quarter is above eight times half that rate. The bounds are those of spectra that change
    /// their slope at once; a sum of first-order noises stays inside for a corner far below half the sampling rate.
    #[test]
    fn turbulence_goes_on_beyond_what_is_sampled() {
        let limits = Limits { swing_k: 3.0, span_s: 1000.0, period_s: 0.01 };
        let turbulent = Part::Turbulent { std_k: 3.0, corner_hz: 0.1, fastest_hz: limits.fastest_hz() };
        let prior = Prior { level_c: 0.0, terms: turbulent.terms() };
        let above = prior.variance_above_k2(50.0) / (2.0 * 50.0 * prior.density_k2_per_hz(50.0));
        assert!((1.5 * (1.0 - 0.25 / 3.0)..1.5).contains(&above), "{above}");
    }

    #[test]
    fn a_broad_part_is_exchanged_for_one_with_its_corner() {
        let limits = Limits { swing_k: 3.0, span_s: 1000.0, period_s: 0.01 };
        let smooth = Part::Single(Term::Resonance { std_k: 3.0, frequency_hz: 5.0, quality: 0.4 });
        let rough = Part::Single(Term::Rough { std_k: 3.0, corner_hz: 2.0 });
        let turbulent = Part::Turbulent { std_k: 3.0, corner_hz: 2.0, fastest_hz: 400.0 };
        assert_eq!(smooth.otherwise(&limits), [rough.clone(), turbulent.clone()]);
        let [of_rough, of_turbulent] = [&rough, &turbulent].map(|part| part.otherwise(&limits));
        assert_eq!(of_rough, [turbulent]);
        assert_eq!(of_turbulent, [rough]);
        let line = Part::Single(Term::Resonance { std_k: 3.0, frequency_hz: 5.0, quality: 4.0 });
        assert_eq!(line.otherwise(&limits), []);
    }

    /// Below the second corner, `f₀/Q`, both spectra agree within `(f Q/f₀)²`, and at rest within `Q²`.
    #[test]
    fn an_oscillator_without_quality_is_first_order_noise() {
        let resonance = Term::Resonance { std_k: 3.0, frequency_hz: 40.0, quality: QUALITY_BOUNDS[0] };
        let Some(Part::Single(rough)) = Part::Single(resonance).simpler() else { panic!("it is simpler") };
        for hz in [0.01, 0.1, 1.0, 10.0, 100.0] {
            let off = resonance.density_k2_per_hz(hz) / rough.density_k2_per_hz(hz) - 1.0;
            let allowed = 2.0 * ((hz * QUALITY_BOUNDS[0] / 40.0).powi(2) + QUALITY_BOUNDS[0].powi(2));
            assert!(off.abs() < allowed, "{hz} Hz: {off}, {allowed} allowed");
        }
        let sharp = Term::Resonance { std_k: 3.0, frequency_hz: 40.0, quality: 0.03 };
        assert_eq!(Part::Single(sharp).simpler(), None);
    }
}
