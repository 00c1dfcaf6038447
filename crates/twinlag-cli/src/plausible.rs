//! What an answer says of how plausible its time constants are.

use twinlag::{Characterisation, Options, Plausibility, PlausibleTimeConstant};

use crate::failure::Failure;
use crate::print::digits;

/// The answer of `run` to `options` that know what is expected, and how its time constants compare with that. Where an answer gives
/// none of a sensor that something is expected of, the record may contradict it: then it is asked without what is expected.
pub(crate) fn judged<A>(
    plausibility: &Plausibility,
    options: Options,
    run: impl Fn(Options) -> Result<A, Failure>,
    last: impl Fn(&mut A) -> &mut Characterisation,
) -> Result<A, Failure> {
    let mut answer = run(plausibility.with(options.clone())?)?;
    let mut judged = plausibility.judge(&last(&mut answer).sensors);
    if judged.iter().any(|one| one.found_s.is_none()) {
        judged = plausibility.judge(&last(&mut run(options)?).sensors);
    }
    last(&mut answer).plausibility = judged;
    Ok(answer)
}

/// A line for each time constant that something was expected of.
pub(crate) fn lines(answer: &Characterisation) -> Vec<String> {
    answer.plausibility.iter().map(line).collect()
}

fn line(one: &PlausibleTimeConstant) -> String {
    let PlausibleTimeConstant {
        channel,
        expected_s,
        range_95_s: [low, high],
        from,
        found_s,
        is_outside,
        would_take,
        ..
    } = one;
    let expected =
        format!("{} to {} s (around {} s: {from})", digits(*low, 2), digits(*high, 2), digits(*expected_s, 2));
    match (found_s, is_outside) {
        (Some(found_s), Some(true)) => {
            let take = would_take.map_or(String::new(), |take| {
                let diameter = take.diameter_m.map(|m| format!("a diameter of {} mm", digits(m * 1e3, 2)));
                let speed = take.speed_m_s.map(|v| format!("a speed of {} m/s", digits(v, 2)));
                let ways: Vec<String> = [diameter, speed].into_iter().flatten().collect();
                if ways.is_empty() {
                    "; no diameter and no speed within reason would give it".into()
                } else {
                    format!("; it would take {}", ways.join(", or "))
                }
            });
            format!("implausible: {channel} has {} s, outside of {expected}{take}", digits(*found_s, 3))
        }
        (Some(found_s), _) => format!("plausible: {channel} has {} s, expected are {expected}", digits(*found_s, 3)),
        (None, _) => format!("expected of {channel}: {expected}; the record gives no time constant to compare with it"),
    }
}
