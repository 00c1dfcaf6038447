//! What a user may rely on: the same bytes from the same data, gaps where values are missing, errors instead of panics.

use twinlag_report::{Axis, Chart, Colour, Figure, Mark, Reference, ReportError, Series, Surface};

fn chart(series: impl IntoIterator<Item = Series>) -> Chart {
    let chart = Chart::new("chart", Axis::linear("x (s)"), Axis::linear("y (K)"));
    series.into_iter().fold(chart, Chart::series)
}

fn svg(chart: Chart) -> Result<String, ReportError> {
    Figure::new("").panel(chart).to_svg()
}

fn surface(z: Vec<f64>) -> Surface {
    let axes = [Axis::logarithmic("τ₁ (s)"), Axis::logarithmic("τ₂ (s)"), Axis::linear("cost (K²)")];
    Surface::new("surface", axes, [0.01, 0.02, 0.04], [0.1, 0.2, 0.4], z)
}

/// Number of strokes begun by the one line in a colour: each gap begins another.
fn strokes(svg: &str, colour: Colour) -> usize {
    let line = svg
        .split("<path")
        .find(|p| p.contains(&format!("stroke=\"{}\"", colour.hex())) && p.contains("fill=\"none\""))
        .unwrap_or_default();
    line.matches('M').count()
}

#[test]
fn the_same_figure_gives_the_same_bytes() {
    let figure = || {
        let x: Vec<f64> = (0..5000).map(f64::from).collect();
        let y: Vec<f64> = x.iter().map(|x| (x / 300.0).sin()).collect();
        let low: Vec<f64> = y.iter().map(|y| y - 0.2).collect();
        let high: Vec<f64> = y.iter().map(|y| y + 0.2).collect();
        Figure::new("figure")
            .panel(chart([
                Series::trace("trace", x, y).band(low, high),
                Series::line("line", [0.0, 9.0, 4000.0], [1.0, 2.0, 0.5]).errors([0.1, 0.2, 0.3]).dashed(),
            ]))
            .panel(surface((0..9).map(f64::from).collect()).mark(Mark::dot("minimum", 0.01, 0.1)))
            .to_svg()
            .expect("a good figure")
    };
    let svg = figure();
    assert_eq!(svg, figure());
    // 5000 points and a heat map: without thinning, the trace and its band alone would be 150 kB.
    assert!(svg.len() < 60_000, "{} bytes", svg.len());
    assert!(!svg.contains("NaN") && !svg.contains("inf"), "not a number in the picture");
}

#[test]
fn values_that_are_not_finite_are_gaps() {
    let x: Vec<f64> = (0..9).map(f64::from).collect();
    let mut y = vec![1.0, 2.0, 3.0, 2.0, 1.0, 2.0, 3.0, 4.0, 5.0];
    assert_eq!(strokes(&svg(chart([Series::trace("", x.clone(), y.clone())])).expect("good"), Colour::Blue), 1);
    y[3] = f64::NAN;
    y[6] = f64::INFINITY;
    let gaps = svg(chart([Series::trace("", x.clone(), y.clone())])).expect("good");
    assert_eq!(strokes(&gaps, Colour::Blue), 3);
    assert!(!gaps.contains("NaN") && !gaps.contains("inf"));
    // On a logarithmic axis, what is not positive is a gap as well.
    y[1] = -1.0;
    let logarithmic = Chart::new("", Axis::linear("x"), Axis::logarithmic("y")).series(Series::trace("", x, y));
    // Left are 0 alone, which is no stroke; 2 alone likewise; 4 and 5; 7 and 8.
    assert_eq!(strokes(&svg(logarithmic).expect("good"), Colour::Blue), 2);
    let mut z: Vec<f64> = (0..9).map(f64::from).collect();
    z[4] = f64::NAN;
    let holed = Figure::new("").panel(surface(z)).to_svg().expect("good");
    assert!(!holed.contains("NaN"));
}

#[test]
fn what_cannot_be_drawn_is_an_error_that_names_it() {
    let empty: [f64; 0] = [];
    let two = [0.0, 1.0];
    let name = || "s".to_owned();
    assert_eq!(Figure::new("f").to_svg(), Err(ReportError::NoPanels { figure: "f".to_owned() }));
    assert_eq!(svg(chart([])), Err(ReportError::NoSeries { chart: "chart".to_owned() }));
    assert_eq!(svg(chart([Series::line("s", empty, empty)])), Err(ReportError::EmptySeries { series: name() }));
    assert_eq!(svg(chart([Series::bars("s", empty)])), Err(ReportError::EmptySeries { series: name() }));
    let mismatch = |quantity| Err(ReportError::LengthMismatch { series: name(), quantity, expected: 2, got: 1 });
    assert_eq!(svg(chart([Series::line("s", two, [1.0])])), mismatch("y"));
    assert_eq!(svg(chart([Series::line("s", two, two).errors([1.0])])), mismatch("the lower ends of the error bars"));
    assert_eq!(svg(chart([Series::line("s", two, two).band(two, [1.0])])), mismatch("the upper edge of the band"));
    assert_eq!(
        svg(chart([Series::line("s", two, [f64::NAN; 2])])),
        Err(ReportError::NothingToShow { chart: "chart".to_owned() })
    );
    let bad = Chart::new("", Axis::linear("x").range(1.0, 0.0), Axis::linear("y")).series(Series::line("s", two, two));
    assert_eq!(svg(bad), Err(ReportError::Range { axis: "x".to_owned(), low: 1.0, high: 0.0 }));

    let of = |surface: Surface| Figure::new("").panel(surface).to_svg();
    let axes = || [Axis::linear("x"), Axis::linear("y"), Axis::linear("z")];
    let name = || "g".to_owned();
    assert_eq!(
        of(Surface::new("g", axes(), empty, empty, empty)),
        Err(ReportError::EmptyGrid { surface: name(), columns: 0, rows: 0 })
    );
    assert_eq!(
        of(Surface::new("g", axes(), two, two, two)),
        Err(ReportError::GridSize { surface: name(), expected: 4, got: 2 })
    );
    assert_eq!(
        of(Surface::new("g", axes(), two, [1.0, 0.0], [0.0; 4])),
        Err(ReportError::GridOrder { surface: name(), axis: "y" })
    );
    assert_eq!(
        of(Surface::new("g", axes(), two, two, [f64::NAN; 4])),
        Err(ReportError::BlankSurface { surface: name() })
    );
    assert!(matches!(
        Figure::new("").panel(chart([Series::line("s", two, two)])).panel_size(f64::NAN, 300.0).to_svg(),
        Err(ReportError::PanelSize { .. })
    ));
}

#[test]
fn a_name_has_one_colour_in_all_panels() {
    let x = [0.0, 1.0];
    let with = |names: &[&str]| chart(names.iter().map(|n| Series::trace(*n, x, [0.0, 1.0])));
    let count = |svg: &str, colour: Colour| svg.matches(&format!("stroke=\"{}\"", colour.hex())).count();
    let svg = Figure::new("").panel(with(&["a"])).panel(with(&["b"])).panel(with(&["b", "a"])).to_svg().expect("good");
    // Alone there is no legend: one stroke each; together two lines and two samples.
    assert_eq!((count(&svg, Colour::Blue), count(&svg, Colour::Vermilion)), (3, 3));
}

/// Flat data, a single point, a constant surface, a tiny panel, labels that need escaping, values far outside the range:
/// none of these may panic or write a number that is none.
#[test]
fn odd_data_are_drawn() {
    let one = [1.0];
    let charts = [
        chart([Series::line("one", one, one)]),
        chart([Series::line("zero", [0.0, 1.0], [0.0, 0.0]), Series::points("<&\"$x$>\u{0}\n", one, one)]),
        chart([Series::steps("huge", [0.0, 1.0, 2.0], [-1e300, 1e300, 0.0])]),
        chart([Series::steps("tiny", [0.0, 1.0, 2.0], [-1e-300, 1e-300, 0.0])]),
        Chart::new("cut", Axis::linear("x").range(0.0, 1.0), Axis::linear("y").range(0.0, 1e-3))
            .series(Series::line("", [-5.0, 5.0], [-1e9, 1e9]).errors([1e12, 1e12]).band([-1e9, -1e9], [1e9, 1e9]))
            .reference(Reference::vertical(7.0).label("outside"))
            .reference(Reference::horizontal(f64::NAN).label("nowhere")),
        Chart::new("bars", Axis::categories("", ["a", "b"]), Axis::logarithmic("y"))
            .series(Series::bars("p", [1e-3, 0.0]).interval([0.0, 0.0], [1e-2, 1.0]))
            .series(Series::bars("a rather long name of a series, in fact too long for the panel", [10.0, f64::NAN])),
    ];
    for chart in charts {
        let title = format!("{chart:?}");
        for size in [(440.0, 330.0), (160.0, 120.0)] {
            let svg = Figure::new("").panel(chart.clone()).panel_size(size.0, size.1).to_svg().expect("drawable");
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{title}");
            assert!(!svg.contains('\0'), "{title}: XML has no such character");
        }
    }
    let flat =
        Figure::new("").panel(surface(vec![2.0; 9]).levels([f64::NAN, 2.0]).mark(Mark::cross("", f64::NAN, 1.0)));
    assert!(!flat.to_svg().expect("drawable").contains("NaN"));
}
