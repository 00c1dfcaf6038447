//! Answers, as text for people and as JSON for scripts.

use std::io::{Write, stdout};
use std::path::Path;

use anstream::adapter::strip_str;
use anstream::{AutoStream, ColorChoice};
use serde::Serialize;
use twinlag::diagnosis::{Grade, Judgement, Masked, NEVER_TESTABLE, Value, Verdict};
use twinlag::estimate::IntervalBasis;
use twinlag::record::{Note, Record};
use twinlag::{
    Along, Characterisation, Compensation, Diagnosis, IntervalMethod, NamedCause, NamedEffect, NamedTwin, NoiseSource,
    RecordSummary, SecondLag, SensorEstimate, Status, Track,
};
use twinlag_pages::{parameter_in_words, plausibility_in_words, spacing_in_words, unit_suffix};

use crate::console::Console;
use crate::failure::Failure;
use crate::grades::{graded, reasons};
use crate::if_known;
use crate::output::UntilClosed;
use crate::records;
use crate::settings::usage;

/// Prints exactly one JSON object on standard output.
pub(crate) fn json(value: &impl Serialize) -> Result<(), Failure> {
    let text = serde_json::to_string_pretty(value)
        .map_err(|e| Failure::Other(format!("the answer cannot be written as JSON: {e}")))?;
    on_stdout(&(text + "\n"))
}

/// Prints an answer on standard output. A reader that has closed it has read enough. Colours are left to terminals, and obey
/// `NO_COLOR` and `CLICOLOR_FORCE`.
pub(crate) fn on_stdout(text: &str) -> Result<(), Failure> {
    let text = match AutoStream::choice(&stdout()) {
        ColorChoice::Never => strip_str(text).to_string(),
        _ => text.to_owned(),
    };
    let written = UntilClosed::new(stdout()).write_all(text.as_bytes());
    written.map_err(|e| Failure::Other(format!("standard output: {e}")))
}

/// Prints on standard error how the file was read.
pub(crate) fn notes(record: &Record, console: Console) {
    notes_of(record, None, console);
}

/// Prints on standard error how one of several files was read.
///
/// - `source`: its name, which goes before each note
pub(crate) fn notes_of(record: &Record, source: Option<&str>, console: Console) {
    if !console.quiet {
        let of = source.map_or(String::new(), |source| format!("{source}: "));
        notes_in_words(record).for_each(|note| eprintln!("note: {of}{note}"));
    }
}

/// How a file was read, with the options that say it otherwise.
pub(crate) fn notes_in_words(record: &Record) -> impl Iterator<Item = String> {
    record.notes.iter().map(|note| {
        let option = match note {
            Note::TimeRecognised { .. } => " (option --time-unit s)".to_owned(),
            Note::TimeByClock { .. } => " (options --time-unit, --time)".to_owned(),
            Note::FlowUnused { number, .. } => format!(" (option --flow {number})"),
            _ => String::new(),
        };
        // A name in a file may hold what a terminal takes for a command.
        format!("{note}{option}").replace(|c: char| c.is_control() && c != '\n', "\u{FFFD}")
    })
}

/// Prints a characterisation, as text or as JSON.
pub(crate) fn characterisation(answer: &Characterisation, console: Console) -> Result<(), Failure> {
    if console.json {
        return json(answer);
    }
    let text = text(answer);
    on_stdout(&text)
}

/// The source of a record, its number of samples, and the time from one sample to the next.
fn about_record(record: &RecordSummary) -> String {
    let period_s = digits(record.sample_period_s, 4);
    format!("{}: {} samples, {period_s} s {}", record.source, record.samples, spacing_in_words(record))
}

fn text(answer: &Characterisation) -> String {
    let mut lines: Vec<String> = caution(answer).into_iter().collect();
    let record = &answer.record;
    lines.push(about_record(record));
    lines.push(format!("{} estimate, {}, {}", answer.estimator, answer.optimiser, answer.hold));
    lines.push(String::new());
    let width = answer.sensors.iter().map(|s| s.channel.chars().count()).max().unwrap_or(0);
    for sensor in &answer.sensors {
        lines.push(format!("  {:width$}  time constant {}", sensor.channel, time_constant(sensor)));
        if let Some(lag) = &sensor.second_time_constant_s {
            lines.push(format!("  {:width$}  second time constant {}", "", second_lag(lag)));
        }
        lines.push(format!("  {:width$}  noise {}", "", noise(sensor)));
    }
    let difference = &answer.time_constant_difference_s;
    let [a, b] = [&answer.sensors[1].channel, &answer.sensors[0].channel];
    // Of limits on both sides of zero a warning says that nothing is determined.
    if let (None, Some([low, high])) = (difference.value, difference.interval_95_s)
        && low * high > 0.0
    {
        let (how, [least, most]) = if high < 0.0 { ("faster", [-high, -low]) } else { ("slower", [low, high]) };
        lines.push(format!("  {a} {how} than {b} by {} to {} s", digits(least, 3), digits(most, 3)));
    }
    lines.extend(difference_line(answer));
    for (name, estimate, unit) in [("gain", &answer.free.gain, ""), ("offset at 0 °C", &answer.free.offset_k, " K")] {
        if let Some(e) = estimate {
            let channel = &answer.sensors[1].channel;
            let number = interval(e.value, e.interval_95[0], e.interval_95[1], unit);
            lines.push(format!("  {channel}: {name} {}", graded(Some(number), &e.judgement)));
        }
    }
    lines.extend(reasons(asked(answer).chain(free(answer)), "  "));
    lines.extend(answer.plausibility.iter().map(plausibility_in_words));
    lines.extend(records::of_characterisation(answer));
    lines.push(String::new());
    let white = if answer.residual.white { "white" } else { "not white" };
    lines.push(match answer.residual.chi2_per_dof {
        Some(energy) => format!("residual: {} times the energy of the noise, {white}", digits(energy, 4)),
        None => format!("residual: {white}"),
    });
    for test in &answer.residual.tests {
        let p = if test.p_value < 1e-99 { "p < 1e-99".into() } else { format!("p = {:.2e}", test.p_value) };
        lines.push(format!("  {:12} statistic {:>9}  {p}", test.test, digits(test.statistic, 4)));
    }
    let method = match answer.interval_method {
        IntervalMethod::Information => "95 % intervals from the noise levels",
        IntervalMethod::ResidualSpectrum => "95 % intervals from the spectrum of the residual",
        IntervalMethod::Profile => "95 % intervals from every value that the record allows",
        IntervalMethod::Bootstrap => "95 % intervals from simulated records (bootstrap)",
        _ => "no intervals",
    };
    let by_profile = answer.sensors.iter().filter(|s| s.interval_basis == Some(IntervalBasis::Profile));
    let by_profile: Vec<&str> = by_profile.map(|s| s.channel.as_str()).collect();
    let shape = if by_profile.is_empty() { String::new() } else { format!("; {} by profile", by_profile.join(", ")) };
    lines.push(format!("{method}{shape}"));
    lines.push(format!("status: {}", status(answer.status)));
    if !answer.not_identifiable.is_empty() {
        lines.push(format!("not determined by this record: {}", answer.not_identifiable.join(", ")));
    }
    lines.extend(answer.warnings.iter().map(|w| format!("warning: {w}")));
    if !answer.advice.is_empty() {
        let options: Vec<&str> = answer.advice.iter().filter_map(|setting| usage(*setting)).collect();
        lines.push(format!("options to try: {}", options.join(", ")));
    }
    if answer.status == Status::ModelRejected {
        lines.push("to find what the model lacks: twinlag diagnose, with the same files".to_owned());
    }
    lines.push(String::new());
    lines.join("\n")
}

/// What speaks against the use of the model that was given: the first line of an answer.
pub(crate) fn caution(answer: &Characterisation) -> Option<String> {
    (!answer.model_remarks.is_empty()).then(|| format!("caution: {}", answer.model_remarks.join("; ")))
}

/// Both time constants, their second lags and the difference, as they are called here.
fn asked(answer: &Characterisation) -> impl Iterator<Item = (String, &Judgement)> {
    let [one, two] = &answer.sensors;
    let sensors = [one, two].into_iter().flat_map(|sensor| {
        let lag = sensor.second_time_constant_s.as_ref().filter(|lag| lag.value.is_some());
        let lag = lag.map(|lag| (format!("second lag of {}", sensor.channel), &lag.judgement));
        [Some((sensor.channel.clone(), &sensor.judgement)), lag].into_iter().flatten()
    });
    let difference = &answer.time_constant_difference_s;
    // What is not known of both is not known of the difference, and is said once.
    let is_news = difference.value.is_some() || sensors.clone().all(|(_, judgement)| judgement.grade == Grade::Go);
    let name = if difference.includes_delay { "total delay" } else { "difference" };
    sensors.chain(is_news.then(|| (name.to_owned(), &difference.judgement)))
}

/// Gain and offset, where they were fitted.
fn free(answer: &Characterisation) -> impl Iterator<Item = (String, &Judgement)> {
    let both = [("gain", &answer.free.gain), ("offset", &answer.free.offset_k)];
    both.into_iter().filter_map(|(name, e)| Some((name.to_owned(), &e.as_ref()?.judgement)))
}

/// How much later channel 2 is, where that is given.
fn difference_line(answer: &Characterisation) -> Option<String> {
    let difference = &answer.time_constant_difference_s;
    let value = difference.value?;
    let [a, b] = [&answer.sensors[1].channel, &answer.sensors[0].channel];
    let (how, size) = match (difference.includes_delay, value < 0.0) {
        (true, true) => ("ahead of", -value),
        (true, false) => ("later than", value),
        (false, true) => ("faster than", -value),
        (false, false) => ("slower than", value),
    };
    let [low, high] = difference.interval_95_s?;
    let ends = if value < 0.0 { [-high, -low] } else { [low, high] };
    // Which of both is slower is not known.
    if low <= 0.0 && high >= 0.0 && !difference.includes_delay {
        return Some(format!("  {a} − {b}: {}", graded(Some(interval(value, low, high, " s")), &difference.judgement)));
    }
    let what = if difference.includes_delay { " in all, time constants and delay together" } else { "" };
    let number = interval(size, ends[0], ends[1], " s");
    Some(format!("  {a} {how} {b} by {}{what}", graded(Some(number), &difference.judgement)))
}

/// Prints a diagnosis, as text or as JSON.
pub(crate) fn diagnosis(answer: &Diagnosis, console: Console) -> Result<(), Failure> {
    if console.json {
        return json(answer);
    }
    let text = diagnosis_text(answer);
    on_stdout(&text)
}

/// Prints a summary of the gas temperature, as text or as JSON. The text goes to standard error if
/// the table itself goes to standard output.
pub(crate) fn compensation(
    answer: &Compensation,
    out: &Path,
    to_stdout: bool,
    console: Console,
) -> Result<(), Failure> {
    if console.json {
        return json(answer);
    }
    about(&compensation_text(answer, out), to_stdout, console)
}

fn compensation_text(answer: &Compensation, out: &Path) -> String {
    let record = &answer.last.record;
    let mut lines: Vec<String> = caution(&answer.last).into_iter().collect();
    lines.push(about_record(record));
    lines.extend(answer.verdict.map(|v| format!("model: {}", verdict(v))));
    for effect in &answer.effects {
        let place = effect.channel.as_ref().map_or(String::new(), |c| format!(" in {c}"));
        lines.push(format!("  {}{place}", effect.effect));
    }
    for sensor in &answer.last.sensors {
        lines.push(format!("  {}: time constant {}", sensor.channel, time_constant(sensor)));
    }
    lines.extend(answer.last.plausibility.iter().map(plausibility_in_words));
    lines.extend(reasons(asked(&answer.last), "  "));
    if let Some(gas) = &answer.gas {
        lines.push(String::new());
        let written = format!("written to {}, {} samples", out.display(), answer.gas_c.len());
        lines.push(format!("gas temperature: {}", graded(Some(written), &answer.judgement)));
        lines.extend(reasons([("gas temperature".to_owned(), &answer.judgement)], "  "));
        lines.push(format!("  standard deviation {} K (median)", digits(gas.median_std_k, 3)));
        lines.push(format!(
            "  of which {} K from the uncertainty of the model's parameters",
            digits(gas.parameter_std_k, 3)
        ));
        lines.push(match gas.bandwidth_hz {
            Some(hz) => format!("  determined by the readings up to {} Hz", digits(hz, 3)),
            None => "  determined by the readings at no frequency: the gas moves less than the noise".into(),
        });
        if let Some(reference) = &gas.reference {
            lines.push(format!(
                "  error against the reference: {} K rms ({} K for the uncorrected faster sensor); {:.1} % of the \
                 reference lies inside the 95 % band",
                digits(reference.rmse_k, 3),
                digits(reference.raw_rmse_k, 3),
                100.0 * reference.inside_95
            ));
        }
    }
    lines.extend(answer.warnings.iter().map(|w| format!("warning: {w}")));
    lines.push(String::new());
    lines.join("\n")
}

/// Prints a summary of the time constants along the record, as text or as JSON. The text goes to
/// standard error if the table itself goes to standard output.
pub(crate) fn track(answer: &Track, out: &Path, to_stdout: bool, console: Console) -> Result<(), Failure> {
    if console.json {
        return json(answer);
    }
    about(&track_text(answer, out), to_stdout, console)
}

fn track_text(answer: &Track, out: &Path) -> String {
    let record = &answer.last.record;
    let mut lines: Vec<String> = caution(&answer.last).into_iter().collect();
    lines.push(about_record(record));
    let is_given = !answer.time_s.is_empty();
    let change = match (answer.change.as_str(), answer.coefficients, &answer.step) {
        ("smooth", Some(size), _) => format!("both time constants change smoothly: {size} coefficients"),
        ("step", _, Some(step)) => format!(
            "both time constants change by a factor of {} at {}",
            digits(step.factor, 4),
            interval(step.at_s, step.interval_95_s[0], step.interval_95_s[1], " s")
        ),
        ("windows", _, _) => format!("{} windows", answer.time_s.len()),
        _ => "no change of the time constants is detected".into(),
    };
    let change = graded(is_given.then_some(change), &answer.judgement);
    lines.push(if is_given { change } else { format!("time constants along the record: {change}") });
    let of = match answer.change.as_str() {
        "windows" => "time constant of the whole record",
        "smooth" => "mean time constant",
        "step" => "time constant before",
        _ => "time constant",
    };
    for (sensor, along) in answer.last.sensors.iter().zip(&answer.sensors) {
        // What is wrong with the whole is said once.
        if is_given || sensor.judgement != answer.judgement {
            lines.push(format!("  {}: {of} {}", sensor.channel, time_constant(sensor)));
        }
        if let Some([least, most]) = extremes(along).filter(|_| answer.change != "constant") {
            lines.push(format!("    between {least} and {most}"));
        }
    }
    // That nothing changes is not claimed under a model that is contradicted.
    if let Some(ratio) = answer.ratio.filter(|ratio| ratio.stays && answer.judgement.grade != Grade::NoGo) {
        lines.push(format!("  their ratio shows no change: p = {:.2e}", ratio.test.p_value));
    }
    let whole = [("time constants along the record".to_owned(), &answer.judgement)];
    lines.extend(reasons(whole.into_iter().chain(asked(&answer.last)), "  "));
    lines.push(format!("status: {}", status(answer.status)));
    if is_given {
        lines.push(format!("time constants written to {}: {} instants", out.display(), answer.time_s.len()));
    }
    lines.extend(answer.warnings.iter().map(|w| format!("warning: {w}")));
    lines.push(String::new());
    lines.join("\n")
}

/// The smallest and the largest time constant along a record, each with its interval; `None` where there are none.
fn extremes(along: &Along) -> Option<[String; 2]> {
    let given = || (0..along.tau_s.len()).filter(|&k| along.tau_s[k].is_finite());
    let by_size = |a: &usize, b: &usize| along.tau_s[*a].total_cmp(&along.tau_s[*b]);
    let ends = [given().min_by(by_size)?, given().max_by(by_size)?];
    Some(ends.map(|k| interval(along.tau_s[k], along.low_s[k], along.high_s[k], " s")))
}

/// Prints a summary of data: on standard output if the data are in a file, else on standard error.
fn about(text: &str, to_stdout: bool, console: Console) -> Result<(), Failure> {
    if !to_stdout {
        return on_stdout(text);
    }
    if !console.quiet {
        eprint!("{text}");
    }
    Ok(())
}

fn diagnosis_text(answer: &Diagnosis) -> String {
    let record = &answer.base.record;
    let mut lines = vec![format!("verdict: {}", verdict_of(answer)), about_record(record), String::new()];
    for sensor in &answer.last.sensors {
        lines.push(format!("  {}: time constant {}", sensor.channel, time_constant(sensor)));
    }
    lines.extend(difference_line(&answer.last));
    lines.extend(reasons(asked(&answer.last).chain(of_effects(&answer.effects)), "  "));
    lines.extend(answer.last.plausibility.iter().map(plausibility_in_words));
    lines.extend(answer.effects.iter().flat_map(effect_lines));
    lines.extend(before_and_after(answer));
    lines.extend(records::of_diagnosis(answer));
    lines.extend(answer.if_known.iter().flat_map(if_known::lines));
    lines.push(String::new());
    if let Some(left) = &answer.unexplained {
        lines.push(format!("left over: {}", left.description));
    }
    lines.extend(answer.remarks.iter().map(|r| format!("note: {r}")));
    if !answer.last.not_identifiable.is_empty() {
        lines.push(format!("not determined by this record: {}", answer.last.not_identifiable.join(", ")));
    }
    if answer.limits.is_empty() && matches!(answer.verdict, Verdict::PartlyExplained | Verdict::Unexplained) {
        lines.push("nothing can be excluded: what is left over may hide an effect of any size".into());
    }
    // What no record reveals is said once, by `explain`.
    let of_record = answer.not_testable.iter().filter(|what| !NEVER_TESTABLE.contains(&what.as_str()));
    lines.extend(of_record.map(|what| format!("this record cannot reveal: {what}")));
    lines.push("what two sensors can never reveal: twinlag explain two-sensors".into());
    lines.push(String::new());
    lines.join("\n")
}

/// The parameters of effects that are printed, as they are called beside the time constants.
fn of_effects(effects: &[NamedEffect]) -> impl Iterator<Item = (String, &Judgement)> {
    effects.iter().flat_map(|effect| {
        let name = |p: &str| format!("{} of {}", parameter_in_words(p), effect.effect);
        effect.parameters.iter().take(MAX_PARAMETERS).map(move |p| (name(&p.name), &p.judgement))
    })
}

/// What is said of an effect, after an empty line.
fn effect_lines(effect: &NamedEffect) -> Vec<String> {
    let about = effect.effect.about();
    let mut lines = vec![String::new()];
    let place = match (&effect.channel, &effect.fitted_in) {
        (Some(channel), _) => format!(" in {channel}"),
        (None, Some(channel)) => format!(" in {channel}, or in the other channel with other numbers"),
        (None, None) => String::new(),
    };
    lines.push(format!("  {}{place}: {}", effect.effect, about.explanation));
    if let Some(seen) = &effect.seen {
        lines.push(format!("    {seen}"));
    }
    if !effect.masked.is_empty() {
        let shown: Vec<String> = effect.masked.iter().take(MAX_MASKED).map(masked).collect();
        let more = effect.masked.len() - shown.len();
        let rest = if more > 0 { format!(" and {more} more places (see --json)") } else { String::new() };
        lines.push(format!(
            "    left out of {}: rows {}{rest}",
            effect.channel.as_deref().unwrap_or("the fit"),
            shown.join(", ")
        ));
    }
    for p in effect.parameters.iter().take(MAX_PARAMETERS) {
        let unit = unit_suffix(&p.unit);
        let number = p.value.map(|value| match p.interval_95 {
            Some([low, high]) => interval(value, low, high, &unit),
            None => format!("{}{unit}", digits(value, 4)),
        });
        lines.push(format!("    {} {}", parameter_in_words(&p.name), graded(number, &p.judgement)));
    }
    if effect.parameters.len() > MAX_PARAMETERS {
        lines.push(format!("    and {} more parameters (see --json)", effect.parameters.len() - MAX_PARAMETERS));
    }
    if let Some(e) = &effect.evidence {
        let plural = if e.dof == 1 { "" } else { "s" };
        let sign = if e.held_out_gain_nats < 0.0 { "" } else { "+" };
        lines.push(format!(
            "    evidence: likelihood-ratio statistic {} ({} parameter{plural}); held-out log-likelihood {sign}{} nats",
            digits(e.statistic, 3),
            e.dof,
            digits(e.held_out_gain_nats, 3)
        ));
    }
    if !effect.alternatives.is_empty() {
        let names: Vec<&str> = effect.alternatives.iter().map(|a| a.name()).collect();
        lines.push(format!("    equally well explained by: {}", names.join(", ")));
    }
    lines.extend(effect.exact_twins.iter().map(twin_line));
    lines.extend(effect.other_causes.iter().map(cause_line));
    lines.extend(effect.first_state.iter().map(|first_state| format!("    {first_state}")));
    lines.push(format!("    at the rig: {}", about.advice));
    lines
}

/// A number with its name and its interval.
fn named_number(number: &Value) -> String {
    let unit = unit_suffix(&number.unit);
    let Some([low, high]) = number.interval_95 else {
        return format!("{} {}{unit}", number.name, digits(number.value, 4));
    };
    let decimals = decimals_of([low, high]);
    format!("{} {:.decimals$}{unit} [{low:.decimals$}, {high:.decimals$}]", number.name, number.value)
}

/// What the time constants are if another effect is the cause.
fn cause_line(cause: &NamedCause) -> String {
    let place = cause.of.channel.as_ref().map_or(String::new(), |channel| format!(" in {channel}"));
    let [t1, t2] = cause.time_constants.each_ref().map(named_number);
    format!("    with {}{place} instead: {t1}, {t2}, each with its 95 % interval", cause.of.effect)
}

/// What the numbers are if an exact twin is the cause.
fn twin_line(twin: &NamedTwin) -> String {
    let channel = twin.of.channel.as_deref().unwrap_or_default();
    let [parameter, t1, t2] = [&twin.parameter, &twin.time_constants[0], &twin.time_constants[1]].map(named_number);
    format!(
        "    {} in {channel} would look the same: {parameter}, and then {t1}, {t2}, each with its 95 % interval",
        twin.of.effect
    )
}

/// The table of both models, after an empty line.
fn before_and_after(answer: &Diagnosis) -> Vec<String> {
    let mut lines = vec![String::new()];
    let mut row = |name: &str, before: &str, after: &str| {
        lines.push(format!("  {name:34} {before:>24}  {after:>24}"));
    };
    row("", "two lags", "with effects");
    let number = |x: f64| digits(x, 4);
    for i in 0..2 {
        let noise = |c: &Characterisation| format!("{} K", digits(c.sensors[i].noise_std_k, 3));
        row(&format!("noise {}", answer.base.sensors[i].channel), &noise(&answer.base), &noise(&answer.last));
    }
    let e = &answer.error.budget;
    row("residual energy / noise energy", &number(e.chi2_per_dof.before), &number(e.chi2_per_dof.after));
    let rms = e.held_out_normalised_rms;
    row("rms residual, held out", &number(rms.before), &number(rms.after));
    let k = |x: f64| format!("{} K", digits(x, 3));
    let inputs = e.held_out_input_difference_k;
    row("rms input difference, held out", &k(inputs.before), &k(inputs.after));
    // What was found as noise is no part of these models.
    let on_blocks = answer.on_blocks_left_out().map(|rms| [number(rms.before), number(rms.after)]);
    if let Some([before, after]) = on_blocks.filter(|[before, after]| before != after) {
        row("rms residual, blocks left out", &before, &after);
    }
    if let Some(r) = answer.error.reference_rmse_k {
        row("rms gas error against reference", &k(r.before), &k(r.after));
    }
    lines.extend(answer.what_got_worse().iter().map(|why| format!("  {why}")));
    let sources = [&answer.base, &answer.last].map(|c| c.sensors[0].noise_from.map(noise_source));
    lines.push(match sources {
        [Some(before), Some(after)] if before != after => format!("  noise levels: {before}; with effects: {after}"),
        [before, after] => format!("  noise levels: {}", after.or(before).unwrap_or("not stated")),
    });
    lines
}

/// Places of masked readings of one effect that are printed.
const MAX_MASKED: usize = 5;

/// `120-134 (12.0-13.4 s)`.
fn masked(run: &Masked) -> String {
    let ([first, last], [from_s, to_s]) = (run.rows, run.time_s);
    let seconds = |t: f64| format!("{t:.4}").trim_end_matches('0').trim_end_matches('.').to_owned();
    if first == last {
        format!("{first} ({} s)", seconds(from_s))
    } else {
        format!("{first}-{last} ({}-{} s)", seconds(from_s), seconds(to_s))
    }
}

/// Number of parameters of one effect that are printed.
const MAX_PARAMETERS: usize = 4;

/// The verdict, with how much is left over where it counts as complete all the same.
fn verdict_of(answer: &Diagnosis) -> String {
    match answer.explained_to.filter(|share| *share > 0.0) {
        Some(share) => {
            let name = if answer.verdict == Verdict::Adequate { "adequate" } else { "explained" };
            let but = nothing_determined(&answer.last);
            let model = if answer.verdict == Verdict::Adequate { "two first-order lags" } else { "these effects" };
            let percent = digits(100.0 * share, 2);
            format!(
                "{name} to {percent} %{but}: beside noise {model} leave {percent} % of its energy, which intervals cover"
            )
        }
        None => match verdict(answer.verdict).split_once(": ") {
            Some((name, meaning)) if matches!(answer.verdict, Verdict::Adequate | Verdict::Explained) => {
                format!("{name}{}: {meaning}", nothing_determined(&answer.last))
            }
            _ if answer.verdict == Verdict::PartlyExplained && answer.unexplained.is_none() => {
                "partly-explained: with these effects only noise is left where they were fitted, but they are not known to be the cause (see the reasons below)"
                    .into()
            }
            _ => verdict(answer.verdict).into(),
        },
    }
}

/// What to add to a verdict on the model where the record determines neither time constant.
fn nothing_determined(answer: &Characterisation) -> &'static str {
    let is_any = answer.sensors.iter().any(|s| s.time_constant_s.is_some());
    match answer.time_constant_difference_s.value {
        _ if is_any || answer.status == Status::ModelRejected => "",
        None => ", but no time constant is determined",
        Some(_) => ", but only the difference of the time constants is determined",
    }
}

fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Adequate => "adequate: two first-order lags leave only noise in the residual",
        Verdict::Explained => "explained: with these effects only noise is left in the residual",
        Verdict::PartlyExplained => {
            "partly-explained: these effects explain part of the residual, but more than noise is left"
        }
        Verdict::Unexplained => "unexplained: more than noise is left, and no known effect explains it",
        Verdict::Refused => "refused: this record cannot be diagnosed",
        _ => "unknown",
    }
}

fn status(status: Status) -> &'static str {
    match status {
        Status::Ok => "ok",
        Status::AtBound => "at-bound",
        Status::NotIdentifiable => "not-identifiable",
        Status::ModelRejected => "model-rejected",
        _ => "unknown",
    }
}

/// A time constant with its interval and its grade, or why it is not given.
pub(crate) fn time_constant(sensor: &SensorEstimate) -> String {
    let number = match (sensor.time_constant_s, sensor.interval_95_s) {
        (Some(value), Some([low, high])) => Some(interval(value, low, high, " s")),
        (Some(value), None) if sensor.known => return format!("{} s (known beforehand)", digits(value, 5)),
        (None, Some([0.0, most_s])) => return format!("at most {} s (95 %)", digits(most_s, 2)),
        _ => None,
    };
    graded(number, &sensor.judgement)
}

fn second_lag(lag: &SecondLag) -> String {
    match (lag.value, lag.interval_95) {
        (Some(value), Some([low, high])) => graded(Some(interval(value, low, high, " s")), &lag.judgement),
        (Some(value), None) => format!("{} s (known beforehand)", digits(value, 5)),
        (None, Some([0.0, high])) => format!("not detected, at most {} s", digits(high, 3)),
        (None, Some([low, high])) => format!("not determined, from {} to {} s", digits(low, 3), digits(high, 3)),
        (None, None) => "not determined by this record".into(),
    }
}

fn noise(sensor: &SensorEstimate) -> String {
    let error = sensor.noise_standard_error_k.map_or(String::new(), |e| format!(" ± {}", digits(e, 2)));
    let colour = sensor.noise_ar1.map_or(String::new(), |phi| format!(", autoregressive {phi:.2}"));
    let source = sensor.noise_from.map_or(String::new(), |from| format!(" ({})", noise_source(from)));
    format!("{}{error} K{colour}{source}", digits(sensor.noise_std_k, 3))
}

fn noise_source(from: NoiseSource) -> &'static str {
    match from {
        NoiseSource::Given => "known beforehand",
        NoiseSource::QuietSegment => "quiet segment",
        NoiseSource::ThirdDifferences => "third differences",
        NoiseSource::InferredInputs => "inferred inputs",
        NoiseSource::Residual => "residual",
        _ => "unknown source",
    }
}

pub(crate) fn interval(value: f64, low: f64, high: f64, unit: &str) -> String {
    let decimals = decimals_of([low, high]);
    format!("{value:.decimals$}{unit}  [{low:.decimals$}, {high:.decimals$}] (95 %)")
}

/// Decimals of the ends of an interval: two digits more than its width has.
pub(crate) fn decimals_of([low, high]: [f64; 2]) -> usize {
    let width = (high - low).abs();
    if width > 0.0 { (2.0 - width.log10().floor()).clamp(0.0, 12.0) as usize } else { 6 }
}

/// `value` to `significant` digits, without an exponent.
pub(crate) fn digits(value: f64, significant: i32) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    if !(1e-9..1e12).contains(&value.abs()) {
        let decimals = significant.max(1) as usize - 1;
        return format!("{value:.decimals$e}");
    }
    let decimals = (f64::from(significant - 1) - value.abs().log10().floor()).clamp(0.0, 15.0) as usize;
    format!("{value:.decimals$}")
}
