//! A cost over two parameters: heat map, contour lines, marked points.

use crate::ReportError;
use crate::axis::Axis;

/// A point marked on a [`Surface`].
#[derive(Clone, Debug, PartialEq)]
pub struct Mark {
    pub(crate) label: String,
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) cross: bool,
}

impl Mark {
    /// A cross, for what is given: the truth.
    pub fn cross(label: impl Into<String>, x: f64, y: f64) -> Self {
        Self { label: label.into(), x, y, cross: true }
    }

    /// A dot, for what was found: a minimum, an estimate.
    pub fn dot(label: impl Into<String>, x: f64, y: f64) -> Self {
        Self { label: label.into(), x, y, cross: false }
    }
}

/// A function on a grid of two parameters, drawn as a heat map with contour lines.
///
/// The contours are those of the ticks on the colour bar, unless [`Surface::levels`] names others,
/// which the bar then marks. Values that are not finite (or not positive, on a logarithmic scale)
/// stay white.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    pub(crate) title: String,
    pub(crate) x: Axis,
    pub(crate) y: Axis,
    pub(crate) value: Axis,
    pub(crate) xs: Vec<f64>,
    pub(crate) ys: Vec<f64>,
    pub(crate) z: Vec<f64>,
    pub(crate) levels: Option<Vec<f64>>,
    pub(crate) marks: Vec<Mark>,
}

impl Surface {
    /// - `x`, `y`: the axes; `value`: that of the colour bar
    /// - `xs`, `ys`: the grid, `[nx]` and `[ny]`, increasing
    /// - `z`: the values, `[nx·ny]`; at `(xs[i], ys[j])` it is `z[j·nx + i]`
    ///
    /// ```
    /// use twinlag_report::{Axis, Figure, Mark, ReportError, Surface};
    ///
    /// // `x² + y²` on three columns and two rows, row by row.
    /// let axes = ["x", "y", "x² + y²"].map(Axis::linear);
    /// let bowl = Surface::new("", axes.clone(), [0.0, 1.0, 2.0], [0.0, 1.0], [0.0, 1.0, 4.0, 1.0, 2.0, 5.0]);
    /// let svg = Figure::new("").panel(bowl.levels([1.0, 3.0]).mark(Mark::dot("minimum", 0.0, 0.0))).to_svg()?;
    /// assert!(svg.contains("minimum"));
    /// // A value too few is a mistake, which the figure reports.
    /// let short = Surface::new("", axes, [0.0, 1.0, 2.0], [0.0, 1.0], [0.0; 5]);
    /// let error = Figure::new("").panel(short).to_svg();
    /// assert_eq!(error, Err(ReportError::GridSize { surface: String::new(), expected: 6, got: 5 }));
    /// # Ok::<(), ReportError>(())
    /// ```
    pub fn new(
        title: impl Into<String>,
        [x, y, value]: [Axis; 3],
        xs: impl Into<Vec<f64>>,
        ys: impl Into<Vec<f64>>,
        z: impl Into<Vec<f64>>,
    ) -> Self {
        let (xs, ys, z) = (xs.into(), ys.into(), z.into());
        Self { title: title.into(), x, y, value, xs, ys, z, levels: None, marks: Vec::new() }
    }

    /// Contour lines at these values.
    #[must_use]
    pub fn levels(self, levels: impl Into<Vec<f64>>) -> Self {
        Self { levels: Some(levels.into()), ..self }
    }

    /// Adds a marked point; one outside the grid, or not finite, is not drawn.
    #[must_use]
    pub fn mark(mut self, mark: Mark) -> Self {
        self.marks.push(mark);
        self
    }

    /// The ranges of `x`, `y` and the values.
    pub(crate) fn limits(&self) -> Result<[(f64, f64); 3], ReportError> {
        let surface = || self.title.clone();
        let (columns, rows) = (self.xs.len(), self.ys.len());
        if columns < 2 || rows < 2 {
            return Err(ReportError::EmptyGrid { surface: surface(), columns, rows });
        }
        let (expected, got) = (columns * rows, self.z.len());
        if expected != got {
            return Err(ReportError::GridSize { surface: surface(), expected, got });
        }
        for (name, axis, grid) in [("x", &self.x, &self.xs), ("y", &self.y, &self.ys)] {
            if !grid.iter().all(|v| axis.shows(*v)) || !grid.windows(2).all(|pair| pair[0] < pair[1]) {
                return Err(ReportError::GridOrder { surface: surface(), axis: name });
            }
        }
        let blank = || ReportError::BlankSurface { surface: surface() };
        let x = self.x.limits(self.xs.iter().copied(), 0.0, None)?.ok_or_else(blank)?;
        let y = self.y.limits(self.ys.iter().copied(), 0.0, None)?.ok_or_else(blank)?;
        let value = self.value.limits(self.z.iter().copied(), 0.0, None)?.ok_or_else(blank)?;
        Ok([x, y, value])
    }
}
