//! Which effects no record distinguishes: the derivatives of the residual by their parameters are parallel.

use std::collections::BTreeSet;

use twinlag_model::{Context, Freedom, Identifier, Linearised, Model, Shared, candidates};
use twinlag_optimise::Scale;

use crate::turbulent::{NOISE_K, TAU_S, record};

/// Share of the energy of a score that is left of it beside those of a twin: rounding of 1e-16 in each of two scores whose parts in
/// common are some 1e4 times what differs between two effects leaves up to 1e-24.
const PARALLEL: f64 = 1e-24;

/// Effects whose numbers are those of a rig. What follows the gas needs an estimate of it, and what lies at one frequency a line.
fn of_rigs(context: &Context) -> Vec<Shared> {
    let all = Identifier::ALL.into_iter().filter(|id| {
        let about = id.about();
        !about.is_noise && !about.is_defect && !about.is_narrow && !about.follows_gas && !about.changes_time_constants
    });
    let mut context = context.clone();
    context.tau_s = TAU_S;
    candidates(&all.collect::<Vec<_>>(), &context)
}

/// Values with which an effect changes next to nothing.
fn next_to_nothing(effect: &Shared) -> Vec<f64> {
    let values = effect.parameters().iter().zip(effect.starts().remove(0)).map(|(parameter, start)| {
        match (parameter.name, &parameter.variable.scale) {
            ("gain", _) => 1.0,
            ("offset", _) => 0.0,
            (_, Scale::Logarithmic) => 1e-2 * start,
            _ => 1e-6 * start,
        }
    });
    values.collect()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Share of the energy of the score of an effect's main parameter that scores of another model do not account for.
///
/// - `before`: parameters of that model, which come first
fn left_of_main(scores: &Linearised, before: usize, effect: &Shared) -> Option<f64> {
    let without = |v: &[f64], basis: &[Vec<f64>]| {
        let mut out = v.to_vec();
        // Once more takes off what rounding has left.
        for q in basis.iter().chain(basis) {
            let along = dot(&out, q);
            out.iter_mut().zip(q).for_each(|(v, q)| *v -= along * q);
        }
        out
    };
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for score in &scores.columns[..before] {
        let left = without(score, &basis);
        let norm = dot(&left, &left).sqrt();
        if norm > 1e-12 * dot(score, score).sqrt() {
            basis.push(left.iter().map(|v| v / norm).collect());
        }
    }
    let score = &scores.columns[before + effect.main()?];
    let left = without(score, &basis);
    Some(dot(&left, &left) / dot(score, score))
}

/// With the values of a twin the whitened residual is what it was, to rounding, but for its sign.
#[test]
fn a_twin_has_the_same_residual() {
    let prepared = record();
    let all = of_rigs(&prepared.context);
    let residual = |effect: &Shared, tau_s: [f64; 2], value: f64| {
        let model = Model::new(&[], [NOISE_K; 2]).with(effect.clone());
        let theta = [tau_s[0], tau_s[1], value];
        (model.linearised(&theta, &prepared.observations, &prepared.everything).residual, model.twins(0, &theta))
    };
    let of = |id: Identifier, channel: usize, parameter: &str| {
        let is_it = |effect: &&Shared| {
            let names: Vec<&str> = effect.parameters().iter().map(|parameter| parameter.name).collect();
            effect.identifier() == id && effect.channel() == Some(channel) && names == [parameter]
        };
        // The first crosstalk of a channel is about 0 °C, as a gain without an offset is.
        all.iter().find(is_it).expect("an effect of the library")
    };
    let ones = [
        (Identifier::CALIBRATION, 1, "gain", 1.04),
        (Identifier::CROSSTALK, 0, "share", 0.03),
        (Identifier::CROSSTALK, 1, "share", -0.05),
    ];
    for (id, channel, parameter, value) in ones {
        let (want, twins) = residual(of(id, channel, parameter), TAU_S, value);
        assert_eq!(twins.len(), 2, "{id}");
        for twin in twins {
            let effect = of(twin.effect, twin.channel, twin.parameter);
            let (got, _) = residual(effect, twin.time_constants_s, twin.value);
            let differences = |sign: f64| got.iter().zip(&want).map(|(a, b)| (a - sign * b).powi(2)).sum::<f64>();
            let off = differences(1.0).min(differences(-1.0)) / dot(&want, &want);
            // As the scores, by parts that are some 1e4 times what differs.
            assert!(off < PARALLEL, "{id} in {channel}: {twin:?} off by {off:e}");
        }
    }
}

/// Of all pairs the library calls those twins whose scores are parallel to rounding, and no others: beside an effect of some size and
/// both time constants, the score of another effect is a sum of theirs.
#[test]
fn twins_are_those_whose_scores_are_parallel() {
    let prepared = record();
    let all = of_rigs(&prepared.context);
    let two_lags = Model::new(&[], [NOISE_K; 2]);
    let (mut parallel, mut twins) = (BTreeSet::new(), BTreeSet::new());
    for one in &all {
        let theta = [&TAU_S[..], &one.starts()[0]].concat();
        let model = two_lags.with(one.clone());
        let name = |effect: Identifier, channel: Option<usize>| (effect.name(), channel);
        let named = name(one.identifier(), one.channel());
        twins.extend(model.twins(0, &theta).into_iter().map(|twin| (named, name(twin.effect, Some(twin.channel)))));
        // A form of the same effect in the same channel is no twin of it, and an offset none of an effect that has one.
        let numbers: Vec<Freedom> = one.parameters().iter().filter_map(|parameter| parameter.determines).collect();
        let is_another = |other: &&Shared| {
            let main = other.main().map(|main| &other.parameters()[main]);
            let is_in_it = main.and_then(|main| main.determines).is_some_and(|number| numbers.contains(&number));
            name(other.identifier(), other.channel()) != named && !is_in_it
        };
        for other in all.iter().filter(is_another) {
            let both = [&theta[..], &next_to_nothing(other)].concat();
            let scores = model.with(other.clone()).linearised(&both, &prepared.observations, &prepared.everything);
            if left_of_main(&scores, theta.len(), other).is_some_and(|left| left < PARALLEL) {
                parallel.insert((named, name(other.identifier(), other.channel())));
            }
        }
    }
    assert_eq!(parallel, twins);
}
