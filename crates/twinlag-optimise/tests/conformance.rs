//! What every solver of the registry must do, and the traps of the library behind them, each as a test.

use std::cell::Cell;

use twinlag_optimise::{
    Budget, Cost, Derivatives, End, Evaluations, Fit, Minimiser, MultiStart, Optimiser, Problem, ProblemError, Variable,
};

/// A cost from closures, counting its calls.
struct Counted<V, D> {
    value: V,
    derivatives: D,
    calls: Cell<Evaluations>,
}

impl<V: Fn(&[f64]) -> f64, D: Fn(&[f64]) -> Option<Derivatives>> Counted<V, D> {
    fn new(value: V, derivatives: D) -> Self {
        Self { value, derivatives, calls: Cell::default() }
    }
}

impl<V: Fn(&[f64]) -> f64, D: Fn(&[f64]) -> Option<Derivatives>> Cost for Counted<V, D> {
    fn value(&self, x: &[f64]) -> f64 {
        let mut calls = self.calls.get();
        calls.values += 1;
        self.calls.set(calls);
        (self.value)(x)
    }

    fn derivatives(&self, x: &[f64]) -> Option<Derivatives> {
        let mut calls = self.calls.get();
        calls.derivatives += 1;
        self.calls.set(calls);
        (self.derivatives)(x)
    }
}

fn rosenbrock_value(x: &[f64]) -> f64 {
    (1.0 - x[0]).powi(2) + 100.0 * (x[1] - x[0] * x[0]).powi(2)
}

#[expect(clippy::unnecessary_wraps, reason = "the shape of the trait")]
fn rosenbrock_derivatives(x: &[f64]) -> Option<Derivatives> {
    let valley = x[1] - x[0] * x[0];
    Some(Derivatives {
        value: rosenbrock_value(x),
        gradient: vec![-2.0 * (1.0 - x[0]) - 400.0 * x[0] * valley, 200.0 * valley],
        curvature: vec![vec![2.0 - 400.0 * (valley - 2.0 * x[0] * x[0]), -400.0 * x[0]], vec![-400.0 * x[0], 200.0]],
    })
}

fn rosenbrock() -> impl Cost {
    Counted::new(rosenbrock_value, rosenbrock_derivatives)
}

fn box_of(low: f64, high: f64) -> Vec<Variable> {
    vec![Variable::linear("x", 1.0, low, high), Variable::linear("y", 1.0, low, high)]
}

/// Solvers with a line search.
const QUASI_NEWTON: [&str; 2] = ["l-bfgs", "bfgs"];
/// Solvers that get along without derivatives.
const BY_VALUES: [&str; 3] = ["nelder-mead", "particle-swarm", "simulated-annealing"];

/// Evaluations of Rosenbrock's function that solvers may take.
const PINNED: [(&str, u64); 7] = [
    ("nelder-mead", 404),
    ("l-bfgs", 102),
    ("bfgs", 96),
    ("newton-trust-region-steihaug", 53),
    ("newton-trust-region-dogleg", 55),
    ("particle-swarm", 2020),
    ("simulated-annealing", 1120),
];

/// Over all solvers for any number of variables. Brent's takes one alone: `tests/one_variable.rs`.
fn each(mut check: impl FnMut(&str, Optimiser)) {
    for name in Optimiser::NAMES.into_iter().chain(Optimiser::GLOBAL_NAMES) {
        check(name, Optimiser::by_name(name).expect("a registered name"));
    }
}

fn fit(cost: &dyn Cost, variables: Vec<Variable>, optimiser: Optimiser, start: &[f64], budget: Budget) -> Fit {
    let problem = Problem::new(cost, variables).expect("valid problem");
    optimiser.minimise(&problem, start, &budget).expect("valid start")
}

/// The curved valley of Rosenbrock, minimum 0 at (1, 1). The simplex stops when its corners agree to 1e-14 of the cost at
/// the start, about 24: values below 2.4e-13 are one to it, and the valley floor (curvature 0.4) is √(2·2.4e-13/0.4) = 1e-6
/// wide there; 1e-5 for all.
#[test]
fn every_solver_finds_the_end_of_the_curved_valley() {
    each(|name, optimiser| {
        let got = fit(&rosenbrock(), box_of(-5.0, 5.0), optimiser, &[-1.2, 1.0], Budget::default());
        assert_eq!(got.end, End::Converged, "{name}");
        assert!(got.x.iter().all(|x| (x - 1.0).abs() < 1e-5), "{name}: {:?}", got.x);
        assert_eq!(got.optimiser, name);
    });
}

/// argmin's tolerances are absolute: it would call any point of a cost of size 1e-12 a minimum, and none of one of size 1e12.
/// The tolerance is that of the test above.
#[test]
fn a_small_cost_is_minimised_as_a_large_one_is() {
    for size in [1e-12, 1e12] {
        let cost = Counted::new(
            |x: &[f64]| size * rosenbrock_value(x),
            |x: &[f64]| {
                rosenbrock_derivatives(x).map(|mut d| {
                    d.value *= size;
                    d.gradient.iter_mut().chain(d.curvature.iter_mut().flatten()).for_each(|v| *v *= size);
                    d
                })
            },
        );
        each(|name, optimiser| {
            let got = fit(&cost, box_of(-5.0, 5.0), optimiser, &[-1.2, 1.0], Budget::default());
            assert_eq!(got.end, End::Converged, "{name}, {size:e}: {got:?}");
            assert!(got.x.iter().all(|x| (x - 1.0).abs() < 1e-5), "{name}, {size:e}: {:?}", got.x);
        });
    }
}

/// argmin has no bounds. With `x ≤ 0.5` the lowest point of Rosenbrock's function is (0.5, 0.25).
#[test]
fn every_solver_stays_inside_the_bounds_and_says_when_it_ends_on_one() {
    each(|name, optimiser| {
        let variables = vec![Variable::linear("x", 1.0, -2.0, 0.5), Variable::linear("y", 1.0, -2.0, 2.0)];
        let got = fit(&rosenbrock(), variables, optimiser, &[-1.2, 1.0], Budget::default());
        assert_eq!(got.end, End::OnBound(vec![0]), "{name}: {got:?}");
        assert!((got.x[0] - 0.5).abs() < 1e-6 && (got.x[1] - 0.25).abs() < 1e-4, "{name}: {:?}", got.x);
        assert!(!got.end.is_usable());
    });
}

/// argmin reports a run that ran out of iterations as a success, and has no limit unless given one.
#[test]
fn an_exhausted_budget_is_reported_as_such_and_kept() {
    each(|name, optimiser| {
        for budget in [Budget { iterations: 2, evaluations: 1000 }, Budget { iterations: 1000, evaluations: 5 }] {
            let got = fit(&rosenbrock(), box_of(-5.0, 5.0), optimiser, &[-1.2, 1.0], budget);
            assert_eq!(got.end, End::LimitReached, "{name}, {budget:?}: {got:?}");
            assert!(got.iterations <= budget.iterations, "{name}: {got:?}");
            assert!(got.evaluations.values + got.evaluations.derivatives <= budget.evaluations, "{name}: {got:?}");
        }
    });
}

/// Whatever the budget, it is kept to the evaluation, the one for the verdict included, and the count is what the cost saw.
/// argmin has no limit on evaluations: a simplex of infinite corners, or a swarm, goes on for as many iterations as it is
/// allowed, here for ever.
#[test]
fn every_budget_is_kept_exactly() {
    each(|name, optimiser| {
        for limit in (1..60).chain([100, 1000, 1001]) {
            let cost = Counted::new(rosenbrock_value, rosenbrock_derivatives);
            let budget = Budget { iterations: u64::MAX, evaluations: limit };
            let got = fit(&cost, box_of(-5.0, 5.0), optimiser, &[-1.2, 1.0], budget);
            assert_eq!(got.evaluations, cost.calls.get(), "{name}, {limit}");
            let spent = got.evaluations.values + got.evaluations.derivatives;
            assert!(spent <= limit, "{name}: {spent} of {limit}");
            assert!(spent == limit || got.end != End::LimitReached, "{name}: {got:?} with {limit}");
            assert!(got.value <= rosenbrock_value(&[-1.2, 1.0]) && got.value == rosenbrock_value(&got.x), "{name}");
        }
    });
}

/// The verdict takes an evaluation where the best point was seen without derivatives. Without budget for it the fit is out of
/// budget, and not `Unchecked`: that is for costs that cannot be checked.
#[test]
fn a_budget_without_room_for_the_verdict_is_exhausted() {
    each(|name, optimiser| {
        let within = |evaluations: u64| {
            let budget = Budget { evaluations, ..Budget::default() };
            fit(&rosenbrock(), box_of(-5.0, 5.0), optimiser, &[-1.2, 1.0], budget)
        };
        let whole = within(5000);
        let spent = whole.evaluations.values + whole.evaluations.derivatives;
        assert_eq!(within(spent), whole, "{name}");
        assert_eq!(within(spent - 1).end, End::LimitReached, "{name}");
    });
}

/// A start without finite derivatives is a bad start and no error: it was evaluated, and the evaluations are counted.
#[test]
fn evaluations_are_counted_where_derivatives_are_not_finite() {
    each(|name, optimiser| {
        let cost = Counted::new(rosenbrock_value, |x: &[f64]| {
            rosenbrock_derivatives(x).map(|d| if x[0] < 0.0 { Derivatives { value: f64::NAN, ..d } } else { d })
        });
        let got = fit(&cost, box_of(-5.0, 5.0), optimiser, &[-1.2, 1.0], Budget::default());
        assert_eq!(got.evaluations, cost.calls.get(), "{name}");
        assert!(got.value <= rosenbrock_value(&[-1.2, 1.0]), "{name}: {got:?}");
        if !BY_VALUES.contains(&name) {
            assert!(matches!(&got.end, End::Stalled(why) if why.contains("finite")), "{name}: {got:?}");
        }
    });
}

/// A cost that falls for ever towards the bound: no solver may hang or claim a minimum.
#[test]
fn a_cost_without_a_minimum_ends_on_the_bound() {
    let cost = Counted::new(
        |x: &[f64]| (-x[0]).exp() + x[1] * x[1],
        |x: &[f64]| {
            let e = (-x[0]).exp();
            Some(Derivatives {
                value: e + x[1] * x[1],
                gradient: vec![-e, 2.0 * x[1]],
                curvature: vec![vec![e, 0.0], vec![0.0, 2.0]],
            })
        },
    );
    each(|name, optimiser| {
        let got = fit(&cost, box_of(-3.0, 6.0), optimiser, &[0.0, 1.0], Budget::default());
        assert_eq!(got.end, End::OnBound(vec![0]), "{name}: {got:?}");
    });
}

/// The plateau on which quasi-Newton methods were seen to claim convergence: beyond x = 2 this well is flat to rounding. Solvers
/// that search the whole of the bounds may come upon the well, and then have found its bottom.
#[test]
fn a_plateau_is_never_called_a_minimum() {
    let well = |x: &[f64]| 1.0 - (-40.0 * (x[0] * x[0] + x[1] * x[1])).exp();
    let cost = Counted::new(well, move |x: &[f64]| {
        let e = (-40.0 * (x[0] * x[0] + x[1] * x[1])).exp();
        let bend = |i: usize, j: usize| 80.0 * e * (f64::from(u8::from(i == j)) - 80.0 * x[i] * x[j]);
        Some(Derivatives {
            value: 1.0 - e,
            gradient: vec![80.0 * e * x[0], 80.0 * e * x[1]],
            curvature: vec![vec![bend(0, 0), bend(0, 1)], vec![bend(1, 0), bend(1, 1)]],
        })
    });
    each(|name, optimiser| {
        let got = fit(&cost, box_of(-9.0, 9.0), optimiser, &[3.0, 4.0], Budget::default());
        assert!(!got.end.is_usable() || got.x.iter().all(|x| x.abs() < 1e-5), "{name}: {got:?}");
    });
}

/// A value that is not a number stops argmin's simplex with an error; here it is infinitely bad, and the fit goes on.
#[test]
fn not_a_number_is_a_bad_point_and_no_end() {
    let log = |x: &[f64]| (x[0].ln() - 0.5).powi(2) + (x[1] - 1.0).powi(2);
    let cost = Counted::new(log, move |x: &[f64]| {
        let l = x[0].ln() - 0.5;
        Some(Derivatives {
            value: log(x),
            gradient: vec![2.0 * l / x[0], 2.0 * (x[1] - 1.0)],
            curvature: vec![vec![2.0 * (1.0 - l) / (x[0] * x[0]), 0.0], vec![0.0, 2.0]],
        })
    });
    each(|name, optimiser| {
        let got = fit(&cost, box_of(-5.0, 5.0), optimiser, &[0.1, -3.0], Budget::default());
        assert!(got.value.is_finite() && got.x.iter().all(|x| x.is_finite()), "{name}: {got:?}");
        // The line search cannot step back from where there is no gradient: it must say that it failed, or arrive.
        if !QUASI_NEWTON.contains(&name) || got.end.is_usable() {
            assert_eq!(got.end, End::Converged, "{name}: {got:?}");
            assert!((got.x[0] - 0.5_f64.exp()).abs() < 1e-5, "{name}: {:?}", got.x);
        }
    });
}

/// The Moré-Thuente search aborts where the direction is none of descent: a gradient of the wrong sign provokes it.
#[test]
fn a_failed_line_search_is_a_stalled_fit_with_its_reason() {
    let cost = Counted::new(rosenbrock_value, |x: &[f64]| {
        rosenbrock_derivatives(x).map(|mut d| {
            d.gradient.iter_mut().for_each(|g| *g = -*g);
            d
        })
    });
    for name in QUASI_NEWTON {
        let optimiser = Optimiser::by_name(name).expect("registered");
        let got = fit(&cost, box_of(-5.0, 5.0), optimiser, &[-1.2, 1.0], Budget::default());
        assert!(matches!(got.end, End::Stalled(_) | End::LimitReached | End::OnBound(_)), "{name}: {got:?}");
    }
}

/// argmin's own counts are off by default; ours must be what the cost saw, the look that judges the end included.
#[test]
fn evaluations_are_counted_as_the_cost_saw_them() {
    each(|name, optimiser| {
        let cost = Counted::new(rosenbrock_value, rosenbrock_derivatives);
        let problem = Problem::new(&cost, box_of(-5.0, 5.0)).expect("valid");
        let got = optimiser.minimise(&problem, &[-1.2, 1.0], &Budget::default()).expect("valid start");
        let seen = cost.calls.get();
        assert_eq!(got.evaluations.values, seen.values, "{name}");
        assert_eq!(got.evaluations.derivatives, seen.derivatives, "{name}");
    });
}

/// The work that the default solver needs on a standard problem: more means that a change made it worse.
#[test]
fn levenberg_marquardt_needs_few_evaluations() {
    let got = fit(&rosenbrock(), box_of(-5.0, 5.0), Optimiser::default(), &[-1.2, 1.0], Budget::default());
    assert!(got.evaluations.derivatives <= 40, "{got:?}");
}

/// The same for the others, with a tenth to spare over what they took when this was written, for roundings that differ
/// between machines.
#[test]
fn the_others_need_no_more_evaluations_than_they_did() {
    for (name, most) in PINNED {
        let optimiser = Optimiser::by_name(name).expect("registered");
        let got = fit(&rosenbrock(), box_of(-5.0, 5.0), optimiser, &[-1.2, 1.0], Budget::default());
        let work = got.evaluations.values + got.evaluations.derivatives;
        assert!(work <= most, "{name}: {work} evaluations, at most {most} wanted");
    }
}

/// argmin's trust region never stops by itself: on a converged fit it goes on until its iterations are used up. Where it should
/// stop is here: the last step is below 1e-9, and Newton's method gets there from far in a few dozen steps.
#[test]
fn a_trust_region_stops_when_it_has_arrived() {
    for name in ["newton-trust-region-steihaug", "newton-trust-region-dogleg"] {
        let budget = Budget { iterations: u64::MAX, evaluations: u64::MAX };
        let optimiser = Optimiser::by_name(name).expect("registered");
        let got = fit(&rosenbrock(), box_of(-5.0, 5.0), optimiser, &[-1.2, 1.0], budget);
        assert_eq!(got.end, End::Converged, "{name}: {got:?}");
        assert!(got.evaluations.values + got.evaluations.derivatives <= 80, "{name}: {got:?}");
        // At the minimum itself, where the step is zero and the region does not shrink.
        let got = fit(&rosenbrock(), box_of(-5.0, 5.0), optimiser, &[1.0, 1.0], budget);
        assert_eq!((got.end, got.iterations), (End::Converged, 2), "{name}");
    }
}

/// A value at the start that vanishes beside its slope, as a difference may: in its unit derivatives overflow, line searches
/// fail, and no gradient is ever small enough. The minimum is at (−½, 0).
#[test]
fn a_start_where_the_value_happens_to_vanish_is_a_start_like_others() {
    for vanishing in [0.0, 1e-250, 1e-12] {
        let tilted = |x: &[f64]| vanishing + x[0] + x[0] * x[0] + x[1] * x[1];
        let cost = Counted::new(tilted, |x: &[f64]| {
            Some(Derivatives {
                value: tilted(x),
                gradient: vec![1.0 + 2.0 * x[0], 2.0 * x[1]],
                curvature: vec![vec![2.0, 0.0], vec![0.0, 2.0]],
            })
        });
        each(|name, optimiser| {
            let got = fit(&cost, box_of(-3.0, 3.0), optimiser, &[0.0, 0.0], Budget::default());
            assert!((got.x[0] + 0.5).abs() < 1e-5 && got.x[1].abs() < 1e-5, "{name}: {got:?}");
            // By values alone there is no slope to tell: the simplex goes on as long as it may.
            assert!(got.end == End::Converged || name == "nelder-mead", "{name}: {got:?}");
        });
    }
}

/// A saddle at the start: the curvature is negative along x, and the Newton point is the saddle itself, uphill.
#[test]
fn a_trust_region_leaves_a_saddle() {
    let saddle = |x: &[f64]| (x[0] * x[0] - 1.0).powi(2) + x[1] * x[1];
    let cost = Counted::new(saddle, move |x: &[f64]| {
        Some(Derivatives {
            value: saddle(x),
            gradient: vec![4.0 * x[0] * (x[0] * x[0] - 1.0), 2.0 * x[1]],
            curvature: vec![vec![12.0 * x[0] * x[0] - 4.0, 0.0], vec![0.0, 2.0]],
        })
    });
    for name in ["newton-trust-region-steihaug", "newton-trust-region-dogleg", "levenberg-marquardt"] {
        let optimiser = Optimiser::by_name(name).expect("registered");
        let got = fit(&cost, box_of(-3.0, 3.0), optimiser, &[0.1, 1.0], Budget::default());
        assert_eq!(got.end, End::Converged, "{name}: {got:?}");
        assert!((got.x[0] - 1.0).abs() < 1e-6 && got.x[1].abs() < 1e-6, "{name}: {got:?}");
    }
}

/// argmin seeds its swarm and its annealing from the operating system: no two runs would be the same. Here the seed is an
/// option: the same one gives the same bytes, another one another way.
#[test]
fn the_same_seed_gives_the_same_bytes_and_another_another_way() {
    let cost = rosenbrock();
    let problem = Problem::new(&cost, box_of(-5.0, 5.0)).expect("valid");
    let way = |optimiser: Optimiser| {
        let mut way = Vec::new();
        let fit = optimiser
            .minimise_observed(&problem, &[-1.2, 1.0], &Budget::default(), &mut |p| way.push(p.clone()))
            .expect("valid start");
        assert_eq!(fit.end, End::Converged);
        serde_json::to_string(&(fit, way)).expect("serialisable")
    };
    for name in Optimiser::GLOBAL_NAMES {
        let by_seed = |seed: u64| {
            let mut options =
                serde_json::to_value(Optimiser::by_name(name).expect("registered")).expect("serialisable");
            options["seed"] = seed.into();
            serde_json::from_value::<Optimiser>(options).expect("valid options")
        };
        assert_eq!(way(by_seed(5)), way(by_seed(5)), "{name}");
        assert_ne!(way(by_seed(5)), way(by_seed(6)), "{name}");
    }
}

/// Two wells, the start in the higher one, with a barrier of 1 between: a local solver stays, a global one does not. Wells at
/// ±1 with values ±0.2, nearly, in a box of ±4.
#[test]
fn a_global_solver_leaves_the_higher_well() {
    let two = |x: &[f64]| (x[0] * x[0] - 1.0).powi(2) + 0.2 * x[0] + x[1] * x[1];
    let cost = Counted::new(two, |_: &[f64]| None);
    for name in Optimiser::GLOBAL_NAMES {
        let optimiser = Optimiser::by_name(name).expect("registered");
        let got = fit(&cost, box_of(-4.0, 4.0), optimiser, &[1.0, 0.0], Budget::default());
        assert!(got.end == End::Unchecked && got.x[0] < -1.0, "{name}: {got:?}");
    }
    let local = fit(
        &cost,
        box_of(-4.0, 4.0),
        Optimiser::by_name("nelder-mead").expect("registered"),
        &[1.0, 0.0],
        Budget::default(),
    );
    assert!(local.x[0] > 0.9, "{local:?}");
}

/// At a bound against which the cost presses, solvers that follow gradients see the slope of the wall, not that of the cost:
/// they come to rest there and go on along the bound, with no more work than the bound saves them. Without that they arrive
/// as well, but from a start at the bound after 25 to 95 evaluations. The lowest point with x ≤ 0.5 is (0.5, 0.25), as above; the curvature
/// along y is 200, and a gradient of 1e-9 of the start's 24 leaves 1e-10 of y.
#[test]
fn along_a_bound_the_rest_is_still_minimised() {
    for name in ["levenberg-marquardt", "l-bfgs", "bfgs", "newton-trust-region-steihaug", "newton-trust-region-dogleg"]
    {
        let variables = vec![Variable::linear("x", 1.0, -2.0, 0.5), Variable::linear("y", 1.0, -2.0, 2.0)];
        let optimiser = Optimiser::by_name(name).expect("registered");
        for start in [[-1.2, 1.0], [0.5, -1.0], [0.5, 2.0]] {
            let got = fit(&rosenbrock(), variables.clone(), optimiser, &start, Budget::default());
            assert_eq!(got.end, End::OnBound(vec![0]), "{name}: {got:?}");
            assert!((got.x[1] - 0.25).abs() < 1e-6, "{name} from {start:?}: {got:?}");
            let work = got.evaluations.values + got.evaluations.derivatives;
            assert!(start != [0.5, 2.0] || work <= 12, "{name}: {work} evaluations");
        }
    }
}

/// Whoever watches is told of the start, then of every iteration; the best point never gets worse, and the last one told is
/// the answer. Watching changes nothing.
#[test]
fn a_watched_fit_is_the_same_fit() {
    each(|name, optimiser| {
        let cost = rosenbrock();
        let problem = Problem::new(&cost, box_of(-5.0, 5.0)).expect("valid");
        let mut told = Vec::new();
        let got = optimiser
            .minimise_observed(&problem, &[-1.2, 1.0], &Budget::default(), &mut |p| told.push(p.clone()))
            .expect("valid start");
        assert_eq!(got, optimiser.minimise(&problem, &[-1.2, 1.0], &Budget::default()).expect("valid start"), "{name}");
        assert_eq!(told[0].x, [-1.2, 1.0], "{name}");
        assert_eq!(told.len() as u64, got.iterations + 1, "{name}");
        assert!(told.iter().enumerate().all(|(i, p)| p.iteration == i as u64), "{name}");
        let last = told.last().expect("told");
        assert_eq!((&last.x, last.value), (&got.x, got.value), "{name}");
        let work = |p: &Evaluations| p.values + p.derivatives;
        for pair in told.windows(2) {
            assert!(pair[1].value <= pair[0].value, "{name}: {pair:?}");
            assert!(work(&pair[1].evaluations) >= work(&pair[0].evaluations), "{name}: {pair:?}");
        }
    });
}

/// A solver from outside need not know of watchers: of its fit the end is told.
#[test]
fn a_solver_from_outside_tells_its_end() {
    struct Outsider;
    impl Minimiser for Outsider {
        fn name(&self) -> String {
            "outsider".into()
        }
        fn minimise(&self, problem: &Problem<'_>, start: &[f64], budget: &Budget) -> Result<Fit, ProblemError> {
            Optimiser::default().minimise(problem, start, budget)
        }
    }
    let cost = rosenbrock();
    let problem = Problem::new(&cost, box_of(-5.0, 5.0)).expect("valid");
    let mut told = Vec::new();
    let got = Outsider
        .minimise_observed(&problem, &[-1.2, 1.0], &Budget::default(), &mut |p| told.push(p.clone()))
        .expect("valid start");
    assert_eq!(told.len(), 1);
    assert_eq!((&told[0].x, told[0].value, told[0].iteration), (&got.x, got.value, got.iterations));
}

#[test]
fn a_cost_without_derivatives_is_refused_by_those_that_need_them() {
    let cost = Counted::new(rosenbrock_value, |_: &[f64]| None);
    let problem = Problem::new(&cost, box_of(-5.0, 5.0)).expect("valid");
    each(|name, optimiser| {
        let got = optimiser.minimise(&problem, &[-1.2, 1.0], &Budget::default());
        if BY_VALUES.contains(&name) {
            assert_eq!(got.expect("values are enough").end, End::Unchecked);
        } else {
            assert_eq!(got, Err(ProblemError::NeedsDerivatives { optimiser: name.into() }));
        }
    });
}

#[test]
fn a_held_variable_stays_and_the_rest_is_fitted() {
    each(|name, optimiser| {
        let variables = vec![Variable::linear("x", 1.0, -5.0, 5.0).held_at(0.7), Variable::linear("y", 1.0, -5.0, 5.0)];
        let got = fit(&rosenbrock(), variables, optimiser, &[3.0, 3.0], Budget::default());
        assert_eq!(got.end, End::Converged, "{name}: {got:?}");
        assert!(got.x[0] == 0.7 && (got.x[1] - 0.49).abs() < 1e-5, "{name}: {:?}", got.x);
    });
}

/// Two wells: `(x² − 1)² + x/5`, the left one lower. One start finds the right one, two find the better.
#[test]
fn the_lowest_of_several_ends_is_the_answer() {
    let two = |x: &[f64]| (x[0] * x[0] - 1.0).powi(2) + 0.2 * x[0];
    let cost = Counted::new(two, move |x: &[f64]| {
        Some(Derivatives {
            value: two(x),
            gradient: vec![4.0 * x[0] * (x[0] * x[0] - 1.0) + 0.2],
            curvature: vec![vec![12.0 * x[0] * x[0] - 4.0]],
        })
    });
    let problem = Problem::new(&cost, vec![Variable::linear("x", 1.0, -4.0, 4.0)]).expect("valid");
    let starts = [vec![1.5], vec![-1.5]];
    let all = MultiStart::run(&problem, &Optimiser::default(), &starts, &Budget::default()).expect("valid starts");
    assert!(all.best().x[0] < -1.0 && all.fits()[1].x[0] > 0.9, "{all:?}");
    assert_eq!(MultiStart::run(&problem, &Optimiser::default(), &[], &Budget::default()), Err(ProblemError::NoStart));
}

#[test]
fn a_solver_that_does_not_exist_is_named_with_those_that_do() {
    let message = Optimiser::by_name("gradient-descent").expect_err("not registered").to_string();
    assert!(Optimiser::names().all(|name| message.contains(name)), "{message}");
    assert_eq!(Optimiser::names().count(), 9);
}

#[test]
fn impossible_problems_are_refused_by_name() {
    let cost = rosenbrock();
    let refuse = |variables: Vec<Variable>| Problem::new(&cost, variables).expect_err("refused").to_string();
    assert!(refuse(vec![Variable::linear("width", 1.0, 2.0, 1.0)]).contains("width"));
    assert!(refuse(vec![Variable::logarithmic("tau", 0.0, 1.0)]).contains("tau"));
    assert!(refuse(vec![Variable::linear("gain", 0.0, 0.0, 1.0)]).contains("gain"));
    assert!(refuse(vec![Variable::linear("x", 1.0, 0.0, 1.0).held_at(0.5)]).contains("held"));
    let problem = Problem::new(&cost, box_of(-1.0, 1.0)).expect("valid");
    for start in [vec![0.0], vec![f64::NAN, 0.0]] {
        assert!(Optimiser::default().minimise(&problem, &start, &Budget::default()).is_err());
    }
}

/// Options can be written by hand. Whatever they say, the fit ends within its budget and reports.
#[test]
fn senseless_options_neither_panic_nor_hang() {
    for bad in [-1.0, 0.0, f64::MAX] {
        for optimiser in [
            Optimiser::LevenbergMarquardt { step_tolerance: bad },
            Optimiser::NelderMead { spread_tolerance: bad, edge: 0.3 },
            Optimiser::NelderMead { spread_tolerance: 1e-14, edge: bad },
            Optimiser::LBfgs { memory: 0, gradient_tolerance: bad },
            Optimiser::Bfgs { gradient_tolerance: bad },
            Optimiser::NewtonTrustRegionSteihaug { step_tolerance: bad },
            Optimiser::NewtonTrustRegionDogleg { step_tolerance: bad },
            Optimiser::ParticleSwarm { particles: usize::MAX, generations: u64::MAX, seed: 0 },
            Optimiser::ParticleSwarm { particles: 0, generations: 0, seed: 0 },
            Optimiser::SimulatedAnnealing {
                sweeps: u64::MAX,
                moves: u64::MAX,
                temperature: bad,
                cooling: bad,
                seed: 0,
            },
            Optimiser::SimulatedAnnealing { sweeps: 0, moves: 0, temperature: bad, cooling: bad, seed: 0 },
            Optimiser::SimulatedAnnealing { sweeps: 5, moves: 5, temperature: bad, cooling: 0.1, seed: 0 },
        ] {
            let budget = Budget { iterations: 10_000, evaluations: 3_000 };
            let got = fit(&rosenbrock(), box_of(-5.0, 5.0), optimiser, &[-1.2, 1.0], budget);
            assert!(got.evaluations.values + got.evaluations.derivatives <= 3_000, "{optimiser:?}: {got:?}");
            assert!(got.value <= rosenbrock_value(&[-1.2, 1.0]), "{optimiser:?}: {got:?}");
        }
    }
}

/// Options are configuration: what a report names can be read back.
#[test]
fn options_survive_being_written_and_read() {
    each(|name, optimiser| {
        let text = serde_json::to_string(&optimiser).expect("serialisable");
        assert!(text.contains(&format!("\"name\":\"{name}\"")), "{text}");
        assert_eq!(serde_json::from_str::<Optimiser>(&text).expect("readable"), optimiser, "{text}");
    });
}
