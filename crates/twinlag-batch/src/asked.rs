//! Questions that are the same, or not.

use serde_json::{Map, Value};

/// The name of the first setting in which two questions differ, those within a setting behind it; `None` of equal ones.
pub(crate) fn difference(was: &Value, is: &Value) -> Option<String> {
    let name = first_that_differs(was, is)?;
    Some(if name.is_empty() { "the whole question".to_owned() } else { name })
}

/// As [`difference`]; empty where they have no settings.
fn first_that_differs(was: &Value, is: &Value) -> Option<String> {
    if was == is {
        return None;
    }
    let (Value::Object(was), Value::Object(is)) = (was, is) else { return Some(String::new()) };
    let mut names = was.keys().chain(is.keys());
    names.find_map(|name| {
        let of = |asked: &Map<String, Value>| asked.get(name).cloned().unwrap_or(Value::Null);
        let within = first_that_differs(&of(was), &of(is))?;
        Some(if within.is_empty() { name.clone() } else { format!("{name}.{within}") })
    })
}
