//! What the solvers for one variable must do: the conformance tests that make sense for them, on a line.

use std::cell::Cell;

use twinlag_optimise::{Budget, Cost, Derivatives, End, Fit, Minimiser, Optimiser, Problem, ProblemError, Variable};

/// A cost of one variable, by values alone unless `derivatives` are given, counting its calls.
struct Line<V> {
    value: V,
    derivatives: Option<fn(f64) -> [f64; 2]>,
    calls: Cell<u64>,
}

impl<V: Fn(f64) -> f64> Line<V> {
    fn new(value: V, derivatives: Option<fn(f64) -> [f64; 2]>) -> Self {
        Self { value, derivatives, calls: Cell::new(0) }
    }
}

impl<V: Fn(f64) -> f64> Cost for Line<V> {
    fn value(&self, x: &[f64]) -> f64 {
        self.calls.set(self.calls.get() + 1);
        (self.value)(x[0])
    }

    fn derivatives(&self, x: &[f64]) -> Option<Derivatives> {
        self.calls.set(self.calls.get() + 1);
        let [first, second] = self.derivatives?(x[0]);
        Some(Derivatives { value: (self.value)(x[0]), gradient: vec![first], curvature: vec![vec![second]] })
    }
}

fn fit(cost: &dyn Cost, variable: Variable, start: f64, budget: Budget) -> Fit {
    let problem = Problem::new(cost, vec![variable]).expect("valid problem");
    Optimiser::by_name("brent").expect("registered").minimise(&problem, &[start], &budget).expect("valid start")
}

fn unit(low: f64, high: f64) -> Variable {
    Variable::linear("x", 1.0, low, high)
}

/// `cosh(x − 1)` has its minimum, 1, at 1; values agree to rounding, 1e-16, within √(2·1e-16) = 1.5e-8 of it.
#[test]
fn brent_finds_a_minimum_inside_and_has_it_checked() {
    let cosh = |x: f64| (x - 1.0).cosh();
    let checked = Line::new(cosh, Some(|x| [(x - 1.0).sinh(), (x - 1.0).cosh()]));
    for (cost, end) in [(&checked, End::Converged), (&Line::new(cosh, None), End::Unchecked)] {
        let got = fit(cost, unit(-3.0, 7.0), 5.0, Budget::default());
        assert_eq!(got.end, end, "{got:?}");
        assert!((got.x[0] - 1.0).abs() < 1e-7, "{got:?}");
        assert!(got.evaluations.values <= 40, "{got:?}");
        assert_eq!(got.evaluations.values + got.evaluations.derivatives, cost.calls.replace(0));
        assert_eq!(got.optimiser, "brent");
    }
}

/// argmin's search never looks at the ends of its interval, and stops as far from them as the tolerance goes, which is
/// relative to the coordinate: here 1e-5, a tenth of a typical change.
#[test]
fn brent_ends_on_the_bound_itself() {
    for (slope, want) in [(1.0, -1000.0), (-1.0, 700.0)] {
        let cost = Line::new(|x: f64| slope * x, Some(if slope > 0.0 { |_| [1.0, 0.0] } else { |_| [-1.0, 0.0] }));
        let got = fit(&cost, unit(-1000.0, 700.0), 5.0, Budget::default());
        assert_eq!((got.x[0], &got.end), (want, &End::OnBound(vec![0])), "{got:?}");
    }
}

/// A start that is better than where the search ends is the answer.
#[test]
fn brent_keeps_the_best_point_it_was_shown() {
    let pit = Line::new(|x: f64| if x == 3.0 { -1.0 } else { (x - 1.0).cosh() }, None);
    let got = fit(&pit, unit(-3.0, 7.0), 3.0, Budget::default());
    assert_eq!((got.x[0], got.value), (3.0, -1.0), "{got:?}");
}

/// Through three points of which one is infinite there is no parabola: argmin's search then asks for points that are not
/// numbers until its iterations are used up. `ln x` is none left of zero, where the search begins.
#[test]
fn brent_steps_over_values_that_are_not_numbers() {
    let log = Line::new(|x: f64| x.ln().powi(2), None);
    let got = fit(&log, unit(-20.0, 5.0), 4.0, Budget::default());
    assert_eq!(got.end, End::Unchecked, "{got:?}");
    assert!((got.x[0] - 1.0).abs() < 1e-7, "{got:?}");
}

#[test]
fn brent_keeps_every_budget_exactly() {
    for evaluations in 1..50 {
        let cost = Line::new(|x: f64| (x - 1.0).cosh(), Some(|x| [(x - 1.0).sinh(), (x - 1.0).cosh()]));
        let got = fit(&cost, unit(-3.0, 7.0), 5.0, Budget { iterations: u64::MAX, evaluations });
        let spent = got.evaluations.values + got.evaluations.derivatives;
        assert_eq!(spent, cost.calls.get());
        assert!(spent <= evaluations && (spent == evaluations || got.end == End::Converged), "{got:?}");
    }
    let cost = Line::new(|x: f64| (x - 1.0).cosh(), None);
    let got = fit(&cost, unit(-3.0, 7.0), 5.0, Budget { iterations: 3, evaluations: 100 });
    assert_eq!((got.end, got.iterations), (End::LimitReached, 3));
}

/// A plateau is flat whoever looks at it.
#[test]
fn brent_never_calls_a_plateau_a_minimum() {
    let flat = Line::new(|_| 1.0, Some(|_| [0.0, 0.0]));
    let got = fit(&flat, unit(-3.0, 7.0), 5.0, Budget::default());
    assert!(!got.end.is_usable(), "{got:?}");
}

/// A search between two numbers cannot go on a plane, and says which variables are too many; held, they are not.
#[test]
fn brent_refuses_several_free_variables_by_name() {
    let cost = Line::new(|x: f64| (x - 1.0).cosh(), None);
    let variables = |last: Variable| vec![unit(-3.0, 7.0), Variable::linear("offset", 1.0, -1.0, 1.0), last];
    let brent = Optimiser::by_name("brent").expect("registered");
    let three = Problem::new(&cost, variables(Variable::logarithmic("tau", 0.1, 1.0))).expect("valid");
    let refused = brent.minimise(&three, &[0.0, 0.0, 0.5], &Budget::default()).expect_err("three are free");
    let free = ["x", "offset", "tau"].map(String::from).to_vec();
    assert_eq!(refused, ProblemError::OneVariable { optimiser: "brent".into(), free });
    let text = refused.to_string();
    assert!(text.contains("3 are free here (x, offset, tau)"), "{text}");
    let held = vec![unit(-3.0, 7.0), Variable::linear("offset", 1.0, -1.0, 1.0).held_at(0.5)];
    let one = Problem::new(&cost, held).expect("valid");
    let got = brent.minimise(&one, &[0.0, 0.0], &Budget::default()).expect("one is free");
    assert!((got.x[0] - 1.0).abs() < 1e-7 && got.x[1] == 0.5, "{got:?}");
}

#[test]
fn options_for_one_variable_survive_being_written_and_read() {
    for name in Optimiser::ONE_VARIABLE_NAMES {
        let optimiser = Optimiser::by_name(name).expect("registered");
        let text = serde_json::to_string(&optimiser).expect("serialisable");
        assert_eq!(serde_json::from_str::<Optimiser>(&text).expect("readable"), optimiser, "{text}");
        assert_eq!(optimiser.name(), name);
    }
}
