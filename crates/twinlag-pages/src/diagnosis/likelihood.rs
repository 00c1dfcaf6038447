//! The likelihood over both time constants, and the slower sensor as the faster one predicts it.

use twinlag::model::{DevianceSurface, Prediction};
use twinlag_report::{Axis, Document, Figure, Mark, ReportError, Surface, rounded};

use super::Page;
use crate::figures::{AFTER, CHANNELS, WIDTH_PX, chart, robust_axis, trace};
use crate::words::{short, with_unit};

/// Deviances of the contour lines: the 95 % point of chi-square with two degrees of freedom, and multiples of it by ten.
const LEVELS: [f64; 5] = [5.99, 59.9, 599.0, 5.99e3, 5.99e4];
/// Deviances from which on they are drawn, so that a logarithm has a beginning.
const LEAST: f64 = 0.6;

impl Page<'_> {
    /// The valley of the likelihood; nothing of an answer without its model.
    pub(super) fn likelihood(&self, document: Document) -> Result<Document, ReportError> {
        let surface = self.core().and_then(|core| {
            let model = core.last.extended.as_ref()?;
            DevianceSurface::of(model, core.last.covariance.as_deref())
        });
        let Some(DevianceSurface { tau_s: [one_s, two_s], deviance, fitted_s, samples, of_samples, .. }) = surface
        else {
            return Ok(document);
        };
        let drawn: Vec<f64> = deviance.iter().map(|d| d.max(LEAST)).collect();
        let most = drawn.iter().copied().filter(|d| d.is_finite()).fold(LEAST, f64::max);
        if most < 2.0 * LEAST {
            return Ok(document);
        }
        let axis = |i: usize| Axis::logarithmic(format!("time constant of {} (s)", short(&self.channels()[i])));
        let axes = [axis(0), axis(1), Axis::logarithmic("deviance")];
        let surface = Surface::new("Likelihood of both time constants", axes, one_s, two_s, drawn)
            .levels(LEVELS.into_iter().filter(|level| *level < most).collect::<Vec<f64>>())
            .mark(Mark::dot("fit", fitted_s[0], fitted_s[1]));
        let part = if samples < of_samples {
            format!(
                " Of {samples} of the {of_samples} samples, in pieces all along the record, so the fit to all need not lie at their minimum."
            )
        } else {
            String::new()
        };
        document.heading("How well the record determines both").drawing(
            Figure::new("").panel_size(640.0, 430.0).panel(surface),
            format!(
                "How much worse other time constants explain the record, as −2 ln L beyond the best, the effects as they were fitted; \
                 what is left over is the unit where it is more than noise. The first line is at 5.99: inside it lies the truth in 95 % \
                 of all cases. A valley from lower left to upper right means that the record knows the difference better than either \
                 time constant.{part}"
            ),
        )
    }

    /// The slower sensor's reading, as measured and as predicted.
    pub(super) fn prediction(&self, document: Document) -> Result<Document, ReportError> {
        let model = self.core().and_then(|core| core.last.extended.as_ref());
        let Some(prediction) = model.and_then(Prediction::of) else { return Ok(document) };
        let record = self.record;
        let slow = prediction.channel;
        let name = short(&self.channels()[slow]);
        let measured_c = [&record.t1_c, &record.t2_c][slow];
        let (axis, outside) = robust_axis("temperature (°C)", measured_c.iter().copied());
        let line = &prediction.predicted_c;
        let series = [
            trace(format!("{name}, measured"), &record.time_s, measured_c, CHANNELS[slow]),
            trace(format!("{name}, predicted"), &line.time_s, &line.value, AFTER).map(twinlag_report::Series::dashed),
        ];
        let title = format!("{name} from {}{outside}", short(&self.channels()[1 - slow]));
        let Some(chart) = chart(title, [Axis::linear("time (s)"), axis], series) else { return Ok(document) };
        let fit = prediction.fit_percent.map_or(String::new(), |fit| format!(" Fit: {} %.", rounded(fit, 4)));
        document.drawing(
            Figure::new("").panel_size(WIDTH_PX, 280.0).panel(chart).live(),
            format!(
                "The slower sensor as the model predicts it from the faster one alone.{fit} They differ by {} root mean square. The fit \
                 is 100 % less the error over the deviation from the mean.",
                with_unit(&rounded(prediction.rms_k, 3), "K")
            ),
        )
    }
}
