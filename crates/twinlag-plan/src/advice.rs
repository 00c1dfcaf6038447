//! Advice in words, from the numbers of a plan and nothing else.

use crate::change::{Change, LONGEST_FACTOR};
use crate::plan::{Plan, PlannedNumber, PlannedRecord, PlannedRival};

/// Errors that differ by less are as good as equal: chosen.
const NOTICEABLE_SHARE: f64 = 0.1;
/// Smallest exponent of the length with which a longer record helps: below, half an interval takes more than a hundredfold length.
const LEAST_EXPONENT: f64 = 0.15;

/// What to change, and by how much.
pub(crate) fn advice(plan: &Plan) -> Vec<String> {
    let mut out = vec![length(plan)];
    out.extend(rate(plan));
    out.extend(best(plan));
    let ties = plan.as_it_is.rivals.iter().enumerate();
    out.extend(ties.map(|(place, rival)| tie(plan, place, rival)));
    out
}

/// The record with a change.
fn with(plan: &Plan, is_it: impl Fn(&Change) -> bool) -> Option<&PlannedRecord> {
    plan.changed.iter().find(|record| record.change.as_ref().is_some_and(&is_it))
}

/// The time constants of a record.
fn time_constants(record: &PlannedRecord) -> impl Iterator<Item = &PlannedNumber> {
    record.numbers.iter().take(2)
}

/// The larger of the ratios of both standard errors to those of now.
fn over_now(record: &PlannedRecord) -> Option<f64> {
    time_constants(record).map(|n| n.over_now).try_fold(0.0_f64, |worst, ratio| Some(worst.max(ratio?)))
}

/// How much longer a record has to be for half the intervals.
fn length(plan: &Plan) -> String {
    let longer = with(plan, |change| *change == Change::Length { factor: LONGEST_FACTOR });
    let Some(ratio) = longer.and_then(over_now) else {
        return "length: the record as it is does not determine both time constants, so nothing can be halved; see which change \
                determines them"
            .into();
    };
    let exponent = -ratio.ln() / LONGEST_FACTOR.ln();
    if exponent < LEAST_EXPONENT {
        return format!(
            "length: {LONGEST_FACTOR} times the length leaves the intervals of both time constants {:.0} % of what they are; change something \
             else",
            100.0 * ratio
        );
    }
    let factor = 2_f64.powf(1.0 / exponent);
    format!("length: for half the intervals of both time constants the record has to be {factor:.1} times as long")
}

/// Which rate is enough.
fn rate(plan: &Plan) -> Option<String> {
    let of = |factor: f64| over_now(with(plan, |change| *change == Change::Rate { factor })?);
    let now = 1.0 / plan.as_it_is.sample_period_s;
    let (half, twice) = (of(0.5), of(2.0)?);
    Some(if half.is_some_and(|ratio| ratio < 1.0 + NOTICEABLE_SHARE) {
        format!("rate: half the rate is enough, {} Hz, in the same time", hertz(0.5 * now))
    } else if twice > 1.0 - NOTICEABLE_SHARE {
        format!("rate: {} Hz is enough; twice the rate narrows no interval by a tenth", hertz(now))
    } else {
        format!(
            "rate: twice the rate, {} Hz, makes the intervals {:.0} % of what they are, if the noise of a reading stays the same",
            hertz(2.0 * now),
            100.0 * twice
        )
    })
}

/// A frequency to four digits.
fn hertz(frequency_hz: f64) -> String {
    let text = format!("{frequency_hz:.*}", decimals(frequency_hz, 4.0));
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// The change of gas and sensors that narrows the intervals most.
fn best(plan: &Plan) -> Option<String> {
    let is_of_rig = |record: &&PlannedRecord| {
        matches!(record.change, Some(Change::Excitation { .. } | Change::GasAround { .. } | Change::Pair { .. }))
    };
    // An interval is compared with the value that it is of, which another pair changes.
    let now = plan.as_it_is.largest_relative_error();
    let candidates = plan.changed.iter().filter(is_of_rig).map(|record| (record.largest_relative_error(), record));
    let (least, record) = candidates.min_by(|a, b| a.0.total_cmp(&b.0))?;
    if !least.is_finite() {
        return None;
    }
    let what = &record.description;
    Some(if !now.is_finite() {
        format!(
            "gas and sensors: {what} determines both time constants, the less certain one within {}",
            percent(least)
        )
    } else if least < (1.0 - NOTICEABLE_SHARE) * now {
        format!(
            "gas and sensors: {what} helps most: the less certain time constant has a standard error of {} instead of {}",
            percent(least),
            percent(now)
        )
    } else {
        "gas and sensors: none of the changes narrows the wider interval by a tenth".into()
    })
}

/// A share in per cent, to two digits.
fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    format!("{percent:.*} %", decimals(percent, 2.0))
}

/// Decimals that show so many digits of a number, none of them of one that is larger.
fn decimals(value: f64, digits: f64) -> usize {
    (digits - 1.0 - value.log10().floor()).clamp(0.0, 9.0) as usize
}

/// What breaks a tie.
fn tie(plan: &Plan, place: usize, rival: &PlannedRival) -> String {
    let pair = format!("{} or {}", rival.effect_in_words(), rival.rival_in_words());
    if rival.is_distinguished {
        return format!("{pair}: the record as it is distinguishes them");
    }
    let breaks = |record: &&PlannedRecord| record.rivals.get(place).is_some_and(|rival| rival.is_distinguished);
    let breaking: Vec<&str> = plan.changed.iter().filter(breaks).map(|record| record.description.as_str()).collect();
    if !breaking.is_empty() {
        return format!("{pair}: distinguished with {}", breaking.join("; or with "));
    }
    let clearer = plan.changed.iter().filter_map(|record| Some((record.rivals.get(place)?.deviance, record)));
    match clearer.max_by(|a, b| a.0.total_cmp(&b.0)).filter(|(deviance, _)| *deviance > rival.deviance) {
        Some((deviance, record)) => format!(
            "{pair}: none of the changes alone distinguishes them; nearest is {}, with an expected deviance of {deviance:.1}",
            record.description
        ),
        None => format!(
            "{pair}: none of the changes distinguishes them; inspect the rig, or measure one of the two by itself"
        ),
    }
}
