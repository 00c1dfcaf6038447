//! What was learned of a gas in one record, to begin with in another.

use serde::{Deserialize, Serialize};

use super::part::Part;
use crate::error::CompensateError;

/// The parts in which a gas was learned: those of the likeliest prior first, and then others that were nearly as likely. Of
/// [`crate::Learned`], for [`crate::learn_from`] and [`crate::learn_with_noise`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(try_from = "Vec<Vec<Part>>", into = "Vec<Vec<Part>>")]
pub struct GasParts(Vec<Vec<Part>>);

impl GasParts {
    /// Noise is no part of the gas.
    pub(super) fn of<'a>(all: impl Iterator<Item = &'a [Part]>) -> Self {
        Self(all.map(|parts| parts.iter().filter(|p| p.noise().is_none()).cloned().collect()).collect())
    }

    /// These for a record that is read every `period_s`, those that have no more than so many states.
    pub(super) fn within(&self, period_s: f64, room: usize) -> Vec<Vec<Part>> {
        let all = self.0.iter().map(|parts| parts.iter().map(|part| part.read_every(period_s)).collect::<Vec<Part>>());
        all.filter(|parts| super::has_gas(parts) && super::states(parts) <= room).collect()
    }
}

impl TryFrom<Vec<Vec<Part>>> for GasParts {
    type Error = CompensateError;

    fn try_from(all: Vec<Vec<Part>>) -> Result<Self, CompensateError> {
        let values = all.iter().flatten().flat_map(Part::values);
        match values.into_iter().find(|x| !(x.is_finite() && *x > 0.0)) {
            Some(got) => Err(CompensateError::NotPositive { what: "a number of a part of the gas".into(), got }),
            None if all.iter().flatten().any(Part::is_empty) => {
                Err(CompensateError::NotPositive { what: "the number of lines of a comb".into(), got: 0.0 })
            }
            None => Ok(Self(all)),
        }
    }
}

impl From<GasParts> for Vec<Vec<Part>> {
    fn from(parts: GasParts) -> Self {
        parts.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prior::Term;

    fn comb(std_k: Vec<f64>) -> Part {
        Part::Comb { frequency_hz: 8.0, width_hz: 0.1, std_k, goes_on: true }
    }

    /// A cascade goes on to four times the rate at which its record is read; what needs more states than there are is left out, and so is
    /// noise, with which nothing of the gas is left.
    #[test]
    fn parts_are_fitted_to_the_record_at_hand() {
        let turbulent = |fastest_hz| Part::Turbulent { std_k: 3.0, corner_hz: 1.0, fastest_hz };
        let noise = Part::Noise([1.0, 1.1]);
        let all = [vec![turbulent(500.0), noise.clone()], vec![comb(vec![1.0; 8])], vec![noise]];
        let parts = GasParts::of(all.iter().map(|parts| &parts[..]));
        assert_eq!(parts.within(0.01, 16), [vec![turbulent(400.0)]]);
        assert_eq!(parts.within(0.01, 18).len(), 2);
    }

    #[test]
    fn numbers_that_no_gas_has_are_refused() {
        let rough = |std_k| Part::Single(Term::Rough { std_k, corner_hz: 1.0 });
        assert!(GasParts::try_from(vec![vec![rough(2.0)], vec![comb(vec![1.0])]]).is_ok());
        for part in [rough(0.0), rough(-1.0), rough(f64::NAN), rough(f64::INFINITY), comb(Vec::new())] {
            assert!(GasParts::try_from(vec![vec![part.clone()]]).is_err(), "{part:?}");
        }
    }
}
