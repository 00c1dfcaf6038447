//! What each value of the first time constant would make of the record, as a table.

use twinlag::diagnosis::{Held, IfKnown};
use twinlag_pages::{parameter_in_words, unit_suffix};

use crate::columns::columns;
use crate::print::{decimals_of, digits};

/// Rows at most.
const MAX_ROWS: usize = 8;
/// Digits of time constants: intervals beside them may be as short as a thousandth.
const VALUE_DIGITS: i32 = 4;
/// Parameters of effects, which are columns, at most.
const MAX_PARAMETERS: usize = 2;

/// The table, after an empty line.
pub(crate) fn lines(answer: &IfKnown<String>) -> Vec<String> {
    let IfKnown { held, fitted, values, .. } = answer;
    let excludes = if values.iter().any(|v| v.is_excluded.is_none()) {
        "something else is left over, so none is excluded"
    } else {
        "x: the record excludes it"
    };
    let mut lines =
        vec![String::new(), format!("if the time constant of {held} were known, with these effects ({excludes}):")];
    let mut header = vec![held.clone(), "deviance".into(), fitted.clone()];
    header.extend(["its 95 % interval", "grade", "gas moves by"].map(str::to_owned));
    let first = values.first();
    let of_effects = |v: &Held<String>| -> Vec<(String, String)> {
        let parameters = v.effects.iter().filter(|e| !e.effect.is_noise()).filter_map(|e| e.parameters.first());
        parameters
            .take(MAX_PARAMETERS)
            .map(|p| {
                let unit = unit_suffix(&p.unit);
                (parameter_in_words(&p.name), format!("{}{unit}", digits(p.value, 3)))
            })
            .collect()
    };
    header.extend(first.iter().flat_map(|v| of_effects(v)).map(|(name, _)| name));
    let every = values.len().div_ceil(MAX_ROWS).max(1);
    let rows = values.iter().step_by(every).map(|v| {
        let mut row = vec![
            format!("{} s", digits(v.time_constant_s, VALUE_DIGITS)),
            digits(v.deviance, 2),
            v.other.value_s.map_or("-".into(), |t| format!("{} s", digits(t, VALUE_DIGITS))),
            v.other.interval_95_s.map_or("-".into(), interval),
            v.judgement.grade.to_string(),
            format!("{} K", digits(v.gas_change_k, 2)),
        ];
        row.extend(of_effects(v).into_iter().map(|(_, value)| value));
        (if v.is_excluded == Some(true) { "x" } else { " " }, row)
    });
    let (marks, rows): (Vec<&str>, Vec<Vec<String>>) = [(" ", header)].into_iter().chain(rows).unzip();
    lines.extend(marks.iter().zip(columns(&rows, |_| false)).map(|(mark, row)| format!("  {mark} {row}")));
    lines.push("  a value from a data sheet settles it if its row is not no-go, as with --known T1=0.5s, or --known T1=0.5s+-20%".into());
    lines
}

/// From where to where, or how much at most, in seconds.
fn interval([low, high]: [f64; 2]) -> String {
    if low == 0.0 {
        return format!("at most {} s", digits(high, 2));
    }
    let decimals = decimals_of([low, high]);
    format!("{low:.decimals$} to {high:.decimals$} s")
}
