//! The first state of a slow body, such as a sensor's support: the temperature that it had as a record began.

use std::fmt;

use serde::{Deserialize, Serialize};
use twinlag_model::{Effort, Fitted, Prepared, Value, covariance};
use twinlag_optimise::End;

use crate::naming::numbers;
use crate::remark::to_digits_of;

/// Power of ten of the odds beyond which they are beyond doubt: what they are there says nothing more.
const BEYOND_DOUBT_LOG_10: f64 = 9.0;

/// What was taken of the first state of a slow body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum FirstStateChoice {
    /// It may have had any temperature.
    Free,
    /// It had the temperature of the gas as each record began.
    Equilibrium,
}

/// The first state of a slow body. Both cases were tried.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct FirstState {
    /// What the numbers of the effect rest on.
    pub choice: FirstStateChoice,
    /// Logarithm of the odds for equilibrium with the gas against any other first temperature that the gas has had.
    pub equilibrium_log_odds_nats: f64,
    /// Numbers of the effect in the other case; none where they may not be used.
    pub otherwise: Vec<Value>,
}

/// Tries both first states of the slow body of each effect of a finished fit, and keeps equilibrium where the odds for it are clear:
/// the model that is kept, and what there is to say of each effect.
///
/// - `is_noise_left`: whether nothing but noise is left over; what else is left may decay as slowly as the body does
pub(crate) fn choose(free: Fitted, prepared: &Prepared, is_noise_left: bool) -> (Fitted, Vec<Option<FirstState>>) {
    let mut said = vec![None; free.model.effects.len()];
    let mut kept = free;
    for (index, said) in said.iter_mut().enumerate().filter(|_| is_noise_left) {
        let Some((in_equilibrium, first_state)) = tried(index, &kept, prepared) else { continue };
        if first_state.choice == FirstStateChoice::Equilibrium {
            kept = in_equilibrium;
        }
        *said = Some(first_state);
    }
    (kept, said)
}

/// The model with the body of effect `index` in equilibrium, and what there is to say of both cases; `None` of an effect that holds no
/// body.
fn tried(index: usize, free: &Fitted, prepared: &Prepared) -> Option<(Fitted, FirstState)> {
    let (observations, everything) = (&prepared.observations, &prepared.everything);
    let (effect, log_odds) = free.in_equilibrium(index, observations, everything)?;
    let model = free.model.replaced(index, effect);
    let in_equilibrium = model.fit(&free.theta, observations, everything, Effort::Finish);
    let in_equilibrium = in_equilibrium.with_bias_as(free, observations, everything);
    let is_usable = in_equilibrium.end.is_usable() && !matches!(in_equilibrium.end, End::OnBound(_));
    let is_kept = is_usable && log_odds > prepared.policy.first_state_odds.ln();
    let (choice, other) =
        if is_kept { (FirstStateChoice::Equilibrium, free) } else { (FirstStateChoice::Free, &in_equilibrium) };
    let otherwise = if is_usable {
        let covariance = covariance(other, observations, everything, false);
        numbers(&other.model.effects[index], other.model.range(index), other, covariance.as_deref())
    } else {
        Vec::new()
    };
    let first_state = FirstState { choice, equilibrium_log_odds_nats: log_odds, otherwise };
    Some((in_equilibrium, first_state))
}

/// In words, with the numbers of the other case.
impl fmt::Display for FirstState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (taken, other) = match self.choice {
            FirstStateChoice::Equilibrium => ("had the temperature of the gas", "if it may have had another"),
            FirstStateChoice::Free => ("may have had another temperature than the gas", "if it had that of the gas"),
        };
        let log_10 = self.equilibrium_log_odds_nats / std::f64::consts::LN_10;
        let odds = if log_10 < -BEYOND_DOUBT_LOG_10 {
            format!("less than 10^-{BEYOND_DOUBT_LOG_10:.0} to 1")
        } else if log_10 > 0.0 && self.choice == FirstStateChoice::Free {
            format!("10^{log_10:.1} to 1, too low to count on")
        } else {
            format!("10^{log_10:.1} to 1")
        };
        write!(f, "as a record began, the slow body {taken} (odds that it had that of the gas: {odds})")?;
        let numbers: Vec<String> = self.otherwise.iter().filter_map(with_interval).collect();
        if numbers.is_empty() { Ok(()) } else { write!(f, "; {other}: {}", numbers.join(", ")) }
    }
}

/// A number with its interval, in words; `None` of one without.
fn with_interval(number: &Value) -> Option<String> {
    let [low, high] = number.interval_95?;
    let [value, low, high] = [number.value, low, high].map(|x| to_digits_of(high - low, x));
    let unit = if number.unit == "1" { String::new() } else { format!(" {}", number.unit) };
    Some(format!("{} {value}{unit} [{low}, {high}]", number.name.replace('_', " ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_choices_are_said_with_the_numbers_of_the_other() {
        let share = Value {
            name: "share".into(),
            value: 0.0613,
            standard_error: Some(0.001),
            interval_95: Some([0.0593, 0.0633]),
            unit: "1".into(),
        };
        let said = |choice, log_10: f64, otherwise: &[Value]| {
            let equilibrium_log_odds_nats = log_10 * std::f64::consts::LN_10;
            FirstState { choice, equilibrium_log_odds_nats, otherwise: otherwise.to_vec() }.to_string()
        };
        assert_eq!(
            said(FirstStateChoice::Free, -2.0, std::slice::from_ref(&share)),
            "as a record began, the slow body may have had another temperature than the gas (odds that it had that of the \
             gas: 10^-2.0 to 1); if it had that of the gas: share 0.06130 [0.05930, 0.06330]"
        );
        let is_said = |log_10, odds: &str| said(FirstStateChoice::Free, log_10, &[]).ends_with(odds);
        assert!(is_said(1.2, "(odds that it had that of the gas: 10^1.2 to 1, too low to count on)"));
        assert!(is_said(-991.4, "(odds that it had that of the gas: less than 10^-9 to 1)"));
        assert_eq!(
            said(FirstStateChoice::Equilibrium, 1.5, &[]),
            "as a record began, the slow body had the temperature of the gas (odds that it had that of the gas: 10^1.5 to 1)"
        );
    }
}
