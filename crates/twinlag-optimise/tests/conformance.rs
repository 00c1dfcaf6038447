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

fn each(mut check: impl FnMut(&str, Optimiser)) {
    for name in Optimiser::NAMES {
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

/// The plateau on which quasi-Newton methods were seen to claim convergence: beyond x = 2 this well is flat to rounding.
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
        assert!(!got.end.is_usable(), "{name}: {got:?}");
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
    for name in ["levenberg-marquardt", "nelder-mead"] {
        let optimiser = Optimiser::by_name(name).expect("registered");
        let got = fit(&cost, box_of(-5.0, 5.0), optimiser, &[0.1, -3.0], Budget::default());
        assert_eq!(got.end, End::Converged, "{name}: {got:?}");
        assert!((got.x[0] - 0.5_f64.exp()).abs() < 1e-5, "{name}: {:?}", got.x);
    }
    // The line search of L-BFGS cannot step back from where there is no gradient: it must say that it failed, or arrive.
    let got = fit(
        &cost,
        box_of(-5.0, 5.0),
        Optimiser::by_name("l-bfgs").expect("registered"),
        &[0.1, -3.0],
        Budget::default(),
    );
    assert!(got.value.is_finite() && got.x.iter().all(|x| x.is_finite()), "{got:?}");
    assert!(!got.end.is_usable() || (got.x[0] - 0.5_f64.exp()).abs() < 1e-5, "{got:?}");
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
    let got = fit(
        &cost,
        box_of(-5.0, 5.0),
        Optimiser::by_name("l-bfgs").expect("registered"),
        &[-1.2, 1.0],
        Budget::default(),
    );
    assert!(matches!(got.end, End::Stalled(_) | End::LimitReached | End::OnBound(_)), "{got:?}");
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

#[test]
fn a_cost_without_derivatives_is_refused_by_those_that_need_them() {
    let cost = Counted::new(rosenbrock_value, |_: &[f64]| None);
    let problem = Problem::new(&cost, box_of(-5.0, 5.0)).expect("valid");
    each(|name, optimiser| {
        let got = optimiser.minimise(&problem, &[-1.2, 1.0], &Budget::default());
        if name == "nelder-mead" {
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
    assert!(Optimiser::NAMES.iter().all(|name| message.contains(name)), "{message}");
}

#[test]
fn impossible_problems_are_refused_by_name() {
    let cost = rosenbrock();
    let refuse = |variables: Vec<Variable>| Problem::new(&cost, variables).err().expect("refused").to_string();
    assert!(refuse(vec![Variable::linear("width", 1.0, 2.0, 1.0)]).contains("width"));
    assert!(refuse(vec![Variable::logarithmic("tau", 0.0, 1.0)]).contains("tau"));
    assert!(refuse(vec![Variable::linear("gain", 0.0, 0.0, 1.0)]).contains("gain"));
    assert!(refuse(vec![Variable::linear("x", 1.0, 0.0, 1.0).held_at(0.5)]).contains("held"));
    let problem = Problem::new(&cost, box_of(-1.0, 1.0)).expect("valid");
    for start in [vec![0.0], vec![f64::NAN, 0.0]] {
        assert!(Optimiser::default().minimise(&problem, &start, &Budget::default()).is_err());
    }
}

/// Options are configuration: what a report names can be read back.
#[test]
fn options_survive_being_written_and_read() {
    each(|_, optimiser| {
        let text = serde_json::to_string(&optimiser).expect("serialisable");
        assert_eq!(serde_json::from_str::<Optimiser>(&text).expect("readable"), optimiser, "{text}");
    });
}
