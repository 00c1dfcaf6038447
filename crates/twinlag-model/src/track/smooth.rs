//! The smooth change under which a record is most likely.
//!
//! The change is a spline whose curvature is white noise beforehand, of a strength that is found as well. At the minimum of one
//! strength, the energy is a parabola of the parameters, from which the minimum and the likelihood with any other strength follow
//! (O'Sullivan 1986): so a fit is made for the likeliest strength alone, and again where it shows another one to be likelier.

use super::local::{Curve, Prior, prior};
use super::{LARGEST_MOVE, Tracker};
use crate::dense;
use crate::effect::{Context, varying};
use crate::error::ModelError;
use crate::fit::{Effort, Fitted};
use crate::model::Model;
use crate::normal::NormalEquations;
use crate::settings::{Watch, report};

/// Fewest coefficients of the shared change.
const LEAST_COEFFICIENTS: usize = 3;
/// Strengths of its curvature that are tried: the least lets it change by a tenth along the record, each is twice the one before.
const LEAST_CURVATURE: f64 = 0.25;
const CURVATURES: usize = 12;

/// A smooth change.
pub(super) struct Smooth {
    /// Coefficients that the record determines.
    pub(super) coefficients: f64,
    pub(super) fitted: Fitted,
    /// The spline, where it was fitted from columns of [`super::local::Local`].
    pub(super) local: Option<Curve>,
    strength: usize,
}

/// The strength of this place among those that are tried.
fn curvature(strength: usize) -> f64 {
    LEAST_CURVATURE * (1_u64 << strength) as f64
}

/// The energy about a point, without what is known of the shape beforehand, and the rows of that for the least strength.
struct Expansion {
    normal: NormalEquations,
    prior: Vec<Prior>,
    theta: Vec<f64>,
    /// Where the coefficients begin.
    first: usize,
}

/// The likeliest parameters with a strength.
struct Proposal {
    /// `−2 ln` of the likelihood with the coefficients integrated out (Laplace's approximation), but for a constant.
    evidence: f64,
    /// Coefficients that the record determines: all but the trace of the prior's share of the information.
    coefficients: f64,
    /// How far away they are.
    by: Vec<f64>,
}

struct Search<'a> {
    tracker: &'a Tracker<'a>,
    constant: &'a Fitted,
    size: usize,
    curve: Curve,
    is_local: bool,
}

/// The smooth change under which the record is most likely; `None` of a record that is too short for one.
pub(super) fn smooth(tracker: &Tracker<'_>, constant: &Fitted, watch: Watch<'_>) -> Result<Option<Smooth>, ModelError> {
    let Context { ends_s, samples, .. } = tracker.prepared.context;
    let size = varying::MAX_COEFFICIENTS.min(samples / varying::SAMPLES_PER_COEFFICIENT);
    if size < LEAST_COEFFICIENTS {
        return Ok(None);
    }
    let curve = Curve { effect: constant.model.effects.len(), ends_s, of_ratio: false };
    let is_local = tracker.is_local(constant, ends_s, size);
    Search { tracker, constant, size, curve, is_local }.run(watch)
}

impl Search<'_> {
    fn run(&self, watch: Watch<'_>) -> Result<Option<Smooth>, ModelError> {
        let start: Vec<f64> = self.constant.theta.iter().copied().chain(vec![0.0; self.size]).collect();
        let Some(mut at) = self.expansion(&start) else { return Ok(None) };
        let mut tried = [false; CURVATURES];
        let mut best: Option<(f64, Smooth)> = None;
        for done in 0..tried.len() {
            report(watch, "smooth changes", done, tried.len())?;
            let likely = (0..tried.len()).filter_map(|strength| Some((strength, at.proposal(strength, self.size)?)));
            // A strength whose fit was of no use is as if it were not there.
            let is_open = |strength: usize| !tried[strength] || best.as_ref().is_some_and(|b| b.1.strength == strength);
            let likeliest = likely.filter(|(s, _)| is_open(*s)).min_by(|a, b| a.1.evidence.total_cmp(&b.1.evidence));
            let Some((strength, proposal)) = likeliest.filter(|(strength, _)| !tried[*strength]) else { break };
            tried[strength] = true;
            let fitted = self.fit(strength, &at.moved(&proposal.by));
            let Some(there) = self.expansion(&fitted.theta) else { break };
            let Some(Proposal { evidence, coefficients, .. }) = there.proposal(strength, self.size) else { break };
            if !fitted.end.is_usable() {
                continue;
            }
            at = there;
            if best.as_ref().is_none_or(|(so_far, _)| evidence < *so_far) {
                let local = self.is_local.then_some(self.curve);
                best = Some((evidence, Smooth { coefficients, fitted, local, strength }));
            }
        }
        Ok(best.map(|(_, smooth)| smooth))
    }

    /// The model with a change of this strength; `None` of a record that is too short for it.
    fn model(&self, strength: usize) -> Option<Model> {
        let Context { ends_s, samples, .. } = self.tracker.prepared.context;
        let effect = varying::smooth(self.size, ends_s, samples, curvature(strength))?;
        Some(self.constant.model.with(effect))
    }

    fn expansion(&self, theta: &[f64]) -> Option<Expansion> {
        let model = self.model(0)?;
        let prior = prior(&model, theta);
        let normal = if self.is_local {
            self.tracker.local(&model, vec![self.curve]).normal(theta)
        } else {
            let (observations, selection) = (&self.tracker.prepared.observations, self.tracker.selection);
            let lin = model.linearised(theta, observations, selection);
            NormalEquations::of(&lin, lin.residual.len() - prior.len())
        };
        Some(Expansion { normal, prior, theta: theta.to_vec(), first: theta.len() - self.size })
    }

    fn fit(&self, strength: usize, start: &[f64]) -> Fitted {
        let model = self.model(strength).expect("the record is long enough for the least one");
        if self.is_local {
            return self.tracker.local(&model, vec![self.curve]).fit(start);
        }
        model.fit(start, &self.tracker.prepared.observations, self.tracker.selection, Effort::Finish)
    }
}

impl Expansion {
    fn proposal(&self, strength: usize, size: usize) -> Option<Proposal> {
        let (p, curvature) = (self.theta.len(), curvature(strength));
        let share = (LEAST_CURVATURE / curvature).powi(2);
        let NormalEquations { products, slope, energy, .. } = &self.normal;
        let (mut all, mut slope, mut least) = (products.clone(), slope.clone(), *energy);
        for row in &self.prior {
            least += share * row.value * row.value;
            for (a, x) in row.slope.iter().enumerate() {
                slope[a] += share * x * row.value;
                all[a].iter_mut().zip(&row.slope).for_each(|(sum, y)| *sum += share * x * y);
            }
        }
        let inverse = dense::inverse(&all)?;
        let by: Vec<f64> = dense::times(&inverse, &slope).into_iter().map(|x| -x).collect();
        least += dense::dot(&slope, &by);
        // Time constants that are held have no column.
        let free: Vec<usize> = (0..p).filter(|&i| all[i][i] > 0.0).collect();
        let of_free = free.iter().map(|&a| free.iter().map(|&b| all[a][b]).collect()).collect::<Vec<Vec<f64>>>();
        // A straight line has no curvature: its coefficient has no prior.
        let of_prior = 2.0 * (size - 1) as f64 * curvature.ln();
        let evidence = least + dense::log_determinant(&of_free)? + of_prior;
        let known = |row: &Prior| share * dense::dot(&dense::times(&inverse, &row.slope), &row.slope);
        Some(Proposal { evidence, coefficients: size as f64 - self.prior.iter().map(known).sum::<f64>(), by })
    }

    /// The parameters moved, no farther than the parabola may hold.
    fn moved(&self, by: &[f64]) -> Vec<f64> {
        let (of_tau, of_change) = (&by[..2], &by[self.first..]);
        let shares = of_tau.iter().zip(&self.theta).map(|(by, tau_s)| by / tau_s);
        let largest = shares.chain(of_change.iter().copied()).fold(0.0, |largest: f64, x| largest.max(x.abs()));
        let times = (LARGEST_MOVE / largest).min(1.0);
        self.theta.iter().zip(by).map(|(x, by)| x + times * by).collect()
    }
}
