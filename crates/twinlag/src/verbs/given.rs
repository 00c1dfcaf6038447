//! Time constants that were given beforehand, against those that a record has without them.

use twinlag_cross_relation::Parameter;
use twinlag_diagnose::{Grade, Reason, Remark};
use twinlag_estimate::Known;

/// Difference between a time constant that was given and the record's own, in standard deviations of it, beyond which they contradict
/// each other: by chance once in 10⁴, as in a test of the residual.
const CONTRADICTING_DEVIATIONS: f64 = 3.89;

/// What was given, for the reader.
pub(super) fn given(known: &Known) -> String {
    let spread = known.std.map_or(String::new(), |std| format!(" ± {std}"));
    let name = known.name();
    let (name, unit) = name.strip_suffix(".time_constant_s").map_or((name, ""), |sensor| (sensor, " s"));
    format!("{name} = {}{spread}{unit}", known.value)
}

/// The sensor, 0 or 1, whose time constant was given; `None` if another parameter was.
pub(crate) fn sensor_of(known: &Known) -> Option<usize> {
    match known.parameter {
        Parameter::Tau1 => Some(0),
        Parameter::Tau2 => Some(1),
        _ => None,
    }
}

/// A time constant that was given, and is not that of the record.
pub(super) struct Contradiction {
    pub(super) reason: Reason,
    pub(super) remark: Remark,
}

impl Contradiction {
    /// `None` where the two agree within chance, and for a parameter that is no time constant.
    ///
    /// - `own_s`, `error_s`: the time constant by a fit without what was given, and its standard error
    /// - `grade`: the best grade that a number can then have
    pub(super) fn of(known: &Known, own_s: f64, error_s: f64, grade: Grade) -> Option<Self> {
        let name = ["T1", "T2"][sensor_of(known)?];
        let deviations = (own_s - known.value).abs() / error_s.hypot(known.std.unwrap_or(0.0));
        (deviations > CONTRADICTING_DEVIATIONS).then(|| {
            let what = given(known);
            let instead = Remark::time_constant(name, own_s, Some(error_s));
            let reason = Reason::Contradicted { what: what.clone(), deviations, grade };
            Self { reason, remark: Remark::Contradicted { what, instead, deviations } }
        })
    }
}
