//! Pictures of numerical experiments as small, deterministic SVG: charts, cost surfaces, grouped
//! bars; and pages of them with text and tables, as one HTML file each.
//!
//! This crate is for anyone who has numbers and wants a figure for a report, without a plotting
//! environment. It has error bars and intervals, logarithmic axes, reference lines, contour lines,
//! one colour-blind-safe palette, and a legend that hides no data. Equal data give equal bytes, so
//! figures can be kept under version control and compared. A [`Document`] puts figures, tables and
//! text on a page that needs no network; [`plus_minus`] and its like round the numbers. On a page
//! that may have a script its traces can be enlarged. There is nothing in three dimensions, and no
//! filled contours. For those, or for another kind of chart, use [kuva](https://docs.rs/kuva).
//!
//! ```
//! use twinlag_report::{Axis, Chart, Figure, Mark, Reference, Series, Surface};
//!
//! let noise_k = [0.01, 0.03, 0.1, 0.3];
//! let bias = Chart::new("Bias", Axis::logarithmic("noise (K)"), Axis::linear("bias of τ₁ (%)"))
//!     .series(Series::line("plain", noise_k, [-0.02, -0.2, -1.9, -11.0]).errors([0.01, 0.04, 0.1, 0.4]))
//!     .series(Series::line("whitened", noise_k, [0.0, 0.01, -0.1, f64::NAN]).errors([0.01, 0.04, 0.1, 0.4]))
//!     .reference(Reference::horizontal(0.0).label("no bias"));
//!
//! let tau_s: Vec<f64> = (0..40).map(|i| 0.01 * 1.06_f64.powi(i)).collect();
//! let cost: Vec<f64> = tau_s
//!     .iter()
//!     .flat_map(|t2| tau_s.iter().map(move |t1| 0.1 + (t1 / 0.023).ln().powi(2) + (t2 / 0.05).ln().powi(2)))
//!     .collect();
//! let axes = [Axis::logarithmic("τ₁ (s)"), Axis::logarithmic("τ₂ (s)"), Axis::logarithmic("cost (K²)")];
//! let cost = Surface::new("Cost", axes, tau_s.clone(), tau_s, cost).mark(Mark::cross("truth", 0.023, 0.05));
//!
//! let svg = Figure::new("Two thermocouples").panel(bias).panel(cost).to_svg()?;
//! assert!(svg.starts_with("<svg") && svg.len() < 60_000);
//! # Ok::<(), twinlag_report::ReportError>(())
//! ```

mod axes;
mod axis;
mod block;
mod canvas;
mod chart;
mod chart_drawing;
mod contour;
mod csv;
mod decimate;
mod document;
mod error;
mod escape;
mod figure;
mod inline;
mod live;
mod number;
mod palette;
mod styles;
mod surface;
mod surface_drawing;
mod table;

pub use axis::Axis;
pub use block::{KeyNumber, Tone};
pub use chart::{Chart, Reference, Series};
pub use decimate::decimate;
pub use document::{Document, policy_hash};
pub use error::ReportError;
pub use figure::{Figure, Panel};
pub use number::{between, plus_minus, probability, rounded};
pub use palette::Colour;
pub use surface::{Mark, Surface};
pub use table::Table;

/// Figures and documents may go to any thread, and be read by several.
const _: () = {
    const fn is_send_and_sync<T: Send + Sync>() {}
    is_send_and_sync::<(Axis, Chart, Colour, Document, Figure, KeyNumber, Mark, Panel, Reference, ReportError, Series)>(
    );
    is_send_and_sync::<(Surface, Table, Tone)>();
};
