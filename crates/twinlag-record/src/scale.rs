//! In which unit a column of time counts, where its header names none.
//!
//! A factor of 1000 in time is a factor of 1000 in every time constant. Recognised are, by size *and* step, instants of today in seconds,
//! milliseconds, microseconds or nanoseconds since 1970, and serial days as spreadsheets and MATLAB count them. Other numbers are taken for
//! seconds where they rise by less than one: rows and milliseconds are hardly ever counted in fractions. Steps of one and more may be those
//! of rows, milliseconds, minutes or seconds, and steps that are no decimals in seconds but a usual period in minutes, hours or days may be
//! these: such a column is refused. What stays a guess are steps such as 0.5, which may be half minutes.

use crate::sampling::{self, Clock};
use crate::selection::SamplingChoice;

/// What a column without a unit counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Reading {
    /// Seconds.
    Seconds,
    /// This, by size and step.
    Recognised(Counter),
    /// More than one thing, or nothing that is known.
    Unclear {
        /// From stamp to stamp, in the unit that is sought.
        step: f64,
    },
}

/// A way to count time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Counter {
    /// The unit, as in a header.
    pub(crate) symbol: &'static str,
    pub(crate) seconds: f64,
    /// In words.
    pub(crate) name: &'static str,
    /// From stamp to stamp, s.
    pub(crate) step_s: f64,
}

/// Records that are analysed here are of this time: from 1990 to 2100, in seconds since 1970.
const EPOCH_S: [f64; 2] = [631_152_000.0, 4_102_444_800.0];
const DAY_S: f64 = 86_400.0;
/// Serial days from 1990 to 2100. The first range is those of spreadsheets (since 1899-12-30, from 32 874) or modified
/// Julian days (since 1858-11-17, to 88 069).
const DAY_COUNTS: [([f64; 2], &str); 3] = [
    ([32_874.0, 88_069.0], "serial days of a spreadsheet"),
    ([726_834.0, 767_011.0], "serial days of MATLAB"),
    ([2_447_892.5, 2_488_070.0], "Julian days"),
];
const EPOCH_COUNTS: [(&str, f64, &str); 3] = [
    ("ms", 1e-3, "milliseconds since 1970"),
    ("us", 1e-6, "microseconds since 1970"),
    ("ns", 1e-9, "nanoseconds since 1970"),
];
/// The shortest step of a clock of days that may as well be one of seconds: 10 kHz. The fastest thermometers,
/// wires of some µm, answer in a tenth of a millisecond and more, so that nobody stamps one more
/// often in seconds.
const SHORTEST_STEP: f64 = 1e-4;
/// The shortest period between readings of any thermometer: 100 kHz.
const SHORTEST_PERIOD_S: f64 = 1e-5;
/// The longest period between serial days that are taken to be such: what is read once an hour shows no
/// dynamics of a thermometer.
const LONGEST_PERIOD_S: f64 = 3600.0;
/// Up to here any period is that of a logger; beyond it, those that divide the hour or the day.
const MINUTE_S: f64 = 60.0;
/// How far, as a fraction, a step may be from a round number: clocks are off by 1e-4 at most.
const OFF: f64 = 2e-4;
/// Periods that loggers offer, s.
const USUAL_PERIODS_S: [f64; 14] =
    [1.0, 2.0, 5.0, 10.0, 15.0, 20.0, 30.0, 60.0, 120.0, 300.0, 600.0, 900.0, 1800.0, 3600.0];
/// The shortest step of numbers without a unit that may be those of rows, or of milliseconds.
const COUNTED_STEP: f64 = 1.0;
/// The longest step of numbers that may be those of rows, which rise by one.
const ROW_STEP: f64 = 1.5;
/// Digits of a step that was chosen in seconds.
const STEP_DIGITS: i32 = 3;
/// How far, as a fraction, the clock of a board may be off: the resonator of a cheap one is by half of this.
const CLOCK_ERROR: f64 = 0.01;
/// How far, as a fraction, a counter may be from what passes by a clock, however coarse that is. Units are a factor of 60 and more apart.
pub(crate) const MAX_CLOCK_ERROR: f64 = 0.1;

/// Judges the numbers of a column, all of them finite.
pub(crate) fn judge(values: &[f64]) -> Reading {
    let (Some(&first), Some(&last)) = (values.first(), values.last()) else { return Reading::Seconds };
    // Stamps that do not rise are refused later on, with their place.
    if values.len() < 2 || !values.windows(2).all(|pair| pair[1] > pair[0]) {
        return Reading::Seconds;
    }
    let is_within = |range: [f64; 2]| range[0] <= first && last <= range[1];
    let steps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let step = sampling::median(&steps);
    let are_whole = values.iter().all(|value| value.fract() == 0.0);
    for (symbol, seconds, name) in EPOCH_COUNTS {
        if is_within(EPOCH_S.map(|s| s / seconds)) {
            let step_s = step * seconds;
            let fits = step_s >= SHORTEST_PERIOD_S && is_loggers_period(step_s);
            let counter = Counter { symbol, seconds, name, step_s };
            return if fits { Reading::Recognised(counter) } else { Reading::Unclear { step } };
        }
    }
    let is_epoch_s = is_within(EPOCH_S);
    // A program that waits for a minute between readings takes a second more for them.
    if is_epoch_s && (is_loggers_period(step) || step <= LONGEST_PERIOD_S) {
        return Reading::Seconds;
    }
    if let Some((_, name)) = DAY_COUNTS.into_iter().find(|(range, _)| is_within(*range) && !are_whole) {
        // Days of few decimals have steps that differ: their mean is what shows the period.
        let relative: Vec<f64> = values.iter().map(|value| value - first).collect();
        let step = sampling::judge(&relative, Some(Clock { unit_s: 1.0, first }), SamplingChoice::Auto).period_s;
        return of_days(step, Counter { symbol: "d", seconds: DAY_S, name, step_s: step * DAY_S });
    }
    let mean = (last - first) / steps.len() as f64;
    let is_counted = step > COUNTED_STEP * (1.0 - OFF);
    if is_counted || [step, mean].into_iter().any(is_of_longer_unit) {
        Reading::Unclear { step }
    } else {
        Reading::Seconds
    }
}

/// A number of the size of today's serial days with a fraction: days, or seconds of a day or of an
/// uptime.
fn of_days(step: f64, days: Counter) -> Reading {
    let is_rate = |step: f64| is_round(step) || is_round(1.0 / step) || is_power_of_two(step);
    let as_seconds = is_rate(step);
    // Slower than hourly is no record of a sensor's dynamics.
    let is_slow = days.step_s > LONGEST_PERIOD_S * (1.0 + OFF);
    let as_days =
        !is_slow && if days.step_s <= MINUTE_S { is_rate(days.step_s) } else { is_loggers_period(days.step_s) };
    match (as_seconds, as_days) {
        (false, true) => Reading::Recognised(days),
        (false, false) if step < SHORTEST_STEP => Reading::Recognised(days),
        (true, false) => Reading::Seconds,
        (false, false) if is_slow => Reading::Seconds,
        _ => Reading::Unclear { step },
    }
}

/// Whether a step is no decimal, and a usual period where it is of minutes, hours or days: a sixtieth may be a second in minutes.
fn is_of_longer_unit(step: f64) -> bool {
    let is_period = |unit_s: f64| USUAL_PERIODS_S.iter().any(|period_s| (step * unit_s / period_s - 1.0).abs() <= OFF);
    !has_digits(step, STEP_DIGITS) && [60.0, 3600.0, DAY_S].into_iter().any(is_period)
}

/// The unit of a counter that rises by `rise` while `duration_s` passes by a clock: seconds, milliseconds or microseconds. `None` of any
/// other rise, and of whole numbers that may be those of rows.
///
/// - `step`: from number to number, the median
/// - `are_whole`: whether all numbers are whole
/// - `resolution_s`: how far the clock may be off
pub(crate) fn counter_of(rise: f64, step: f64, are_whole: bool, duration_s: f64, resolution_s: f64) -> Option<Counter> {
    let tolerance_s = (CLOCK_ERROR * duration_s + resolution_s).min(MAX_CLOCK_ERROR * duration_s);
    let units = [("s", 1.0, "seconds"), ("ms", 1e-3, "milliseconds"), ("us", 1e-6, "microseconds")];
    let is_unit = |(_, seconds, _): &(&str, f64, &str)| (rise * seconds - duration_s).abs() <= tolerance_s;
    let (symbol, seconds, name) = units.into_iter().find(is_unit).filter(|_| step > ROW_STEP || !are_whole)?;
    Some(Counter { symbol, seconds, name, step_s: step * seconds })
}

/// Any step up to a minute; beyond it half minutes that divide the hour, and hours that divide the
/// day.
fn is_loggers_period(step_s: f64) -> bool {
    let is_part = |part_s: f64, whole_s: f64| is_whole(step_s / part_s) && is_whole(whole_s / step_s);
    step_s <= MINUTE_S * (1.0 + OFF) || is_part(30.0, 3600.0) || is_part(3600.0, DAY_S)
}

fn is_whole(ratio: f64) -> bool {
    ratio > 0.5 && (ratio - ratio.round()).abs() <= OFF * ratio
}

/// A number of two significant digits.
fn is_round(value: f64) -> bool {
    has_digits(value, 2)
}

/// Whether a number has no more than so many significant digits.
fn has_digits(value: f64, count: i32) -> bool {
    let whole = value / 10_f64.powi(value.log10().floor() as i32 + 1 - count);
    (whole - whole.round()).abs() <= OFF * whole
}

fn is_power_of_two(value: f64) -> bool {
    // A fraction of the value is the same fraction of 1/ln 2 in its logarithm.
    (value.log2() - value.log2().round()).abs() <= OFF * std::f64::consts::LOG2_E
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROWS: usize = 400;

    fn stamps(first: f64, step: f64) -> Vec<f64> {
        (0..ROWS).map(|k| first + step * k as f64).collect()
    }

    fn symbol(reading: Reading) -> &'static str {
        match reading {
            Reading::Seconds => "s",
            Reading::Recognised(counter) => counter.symbol,
            Reading::Unclear { .. } => "?",
        }
    }

    /// 2026-01-31T10:00:00Z is 1 769 853 600 s after 1970, and 46 053.416 67 days after 1899-12-30.
    #[test]
    fn instants_of_today_are_recognised_by_size_and_step() {
        let epoch_s = 1_769_853_600.0;
        for period_s in [1e-3, 0.01, 1.0 / 24.0, 0.1, 1.0, 3.86, 60.0, 900.0, 3600.0] {
            for (seconds, want) in [(1.0, "s"), (1e-3, "ms"), (1e-6, "us"), (1e-9, "ns")] {
                let got = judge(&stamps(epoch_s / seconds, period_s / seconds));
                assert_eq!(symbol(got), want, "{period_s} s in {want}: {got:?}");
            }
        }
        // A step of 1000 s is none of a logger, and 1 ms in a counter of nanoseconds.
        assert_eq!(judge(&stamps(1.8e12, 1e6)), Reading::Unclear { step: 1e6 });
        // 2.8 h in seconds since 1970, or 10 ms in a counter of microseconds.
        assert_eq!(symbol(judge(&stamps(1.8e9, 1e4))), "?");
    }

    /// Days of spreadsheets, of MATLAB and of astronomers. Doubles near them lie 6e-7, 1e-5 and 4e-5 s
    /// apart.
    #[test]
    fn serial_days_are_recognised_by_size_and_step() {
        for (first, name) in [
            (46_053.416_67, "serial days of a spreadsheet"),
            (740_012.416_67, "serial days of MATLAB"),
            (2_461_071.916_67, "Julian days"),
        ] {
            for period_s in
                [0.01, 0.04, 1.0 / 24.0, 0.1, 0.5, 1.0, 2.0, 3.86, 5.0, 10.0, 15.0, 30.0, 60.0, 300.0, 600.0]
            {
                let got = judge(&stamps(first, period_s / DAY_S));
                let Reading::Recognised(counter) = got else { panic!("{name}, {period_s} s: {got:?}") };
                assert_eq!((counter.symbol, counter.name), ("d", name));
                assert!((counter.step_s - period_s).abs() < OFF * period_s, "{period_s} s: {got:?}");
            }
        }
        // Cut to five decimals, which are 0.864 s.
        let cut: Vec<f64> = stamps(46_053.416_67, 1.0 / DAY_S).iter().map(|d| (d * 1e5).round() / 1e5).collect();
        assert_eq!(symbol(judge(&cut)), "d");
    }

    /// Seconds of a day, or of an uptime, of the size of serial days.
    #[test]
    fn seconds_of_the_size_of_days_stay_seconds() {
        for rate_hz in [
            1.0, 2.0, 5.0, 10.0, 20.0, 25.0, 30.0, 40.0, 50.0, 60.0, 100.0, 128.0, 200.0, 250.0, 500.0, 512.0, 1000.0,
            5000.0,
        ] {
            let got = judge(&stamps(45_296.5, 1.0 / rate_hz));
            assert_eq!(symbol(got), "s", "{rate_hz} Hz: {got:?}");
        }
    }

    #[test]
    fn numbers_that_may_count_another_unit_are_unclear() {
        for (first, step, want) in [
            // 24 Hz is a step of an hour in days, 96 Hz one of a quarter of an hour.
            (45_296.5, 1.0 / 24.0, "?"),
            (45_296.5, 1.0 / 96.0, "?"),
            // 10.03 s in days is no round number, but neither is 8614 Hz.
            (45_296.5, 10.03 / DAY_S, "?"),
            // Rows, milliseconds, minutes or seconds.
            (0.0, 1.0, "?"),
            (0.5, 1.0, "?"),
            (0.0, 10.0, "?"),
            (123.0, 2.0, "?"),
            (0.0, 60.0, "?"),
            (0.0, 75.0, "?"),
            (0.0, 90.0, "?"),
            (0.0, 120.0, "?"),
            (0.0, DAY_S, "?"),
            (0.0, 500.0, "?"),
            (0.0, 1e6, "?"),
            (0.0, 16.67, "?"),
            // A second in minutes and in hours, ten seconds in days.
            (0.0, 1.0 / 60.0, "?"),
            (0.0, 1.0 / 3600.0, "?"),
            (0.0, 10.0 / DAY_S, "?"),
            (0.0, 0.5, "s"),
            (0.0, 0.25, "s"),
            (0.0, 0.1, "s"),
            (3.2, 1.0 / 50.0, "s"),
            (0.0, 1.0 / 128.0, "s"),
            (0.0, 1e-3, "s"),
            // A second more than a minute, in seconds since 1970.
            (1_769_853_600.0, 61.0, "s"),
        ] {
            let got = judge(&stamps(first, step));
            assert_eq!(symbol(got), want, "{step} from {first}: {got:?}");
        }
        // Whole milliseconds that jitter by one; seconds in minutes of two decimals.
        let jitter: Vec<f64> = (0..ROWS).map(|k| (100 * k + k % 3) as f64).collect();
        assert_eq!(symbol(judge(&jitter)), "?");
        let minutes: Vec<f64> = stamps(0.0, 2.0 / 60.0).iter().map(|min| (min * 100.0).round() / 100.0).collect();
        assert_eq!(symbol(judge(&minutes)), "?");
    }

    /// The clock of a board may be off by 0.5 %. One that ticks 1024 times a second counts no milliseconds.
    #[test]
    fn a_counter_beside_stamps_has_the_unit_that_passes() {
        let unit = |rise: f64| counter_of(rise, 100.0, true, 20.0, 0.1).map(|counter| counter.symbol);
        assert_eq!(unit(20.1), Some("s"));
        assert_eq!(unit(20_100.0), Some("ms"));
        assert_eq!(unit(20_100_000.0), Some("us"));
        for rise in [15.0, 20_480.0, 25_000.0, 2e8] {
            assert_eq!(unit(rise), None, "{rise}");
        }
        // Whole seconds may be off by one, but not by more than a tenth in all.
        assert_eq!(counter_of(20_900.0, 100.0, true, 20.0, 1.0).map(|counter| counter.symbol), Some("ms"));
        assert_eq!(counter_of(2_400.0, 100.0, true, 2.0, 1.0), None);
        // Rows of a logger of 1 kHz.
        assert_eq!(counter_of(20_000.0, 1.0, true, 20.0, 0.1), None);
        // Seconds of a sketch that divides its milliseconds.
        assert_eq!(counter_of(20.1, 0.1, false, 20.0, 0.1).map(|counter| counter.symbol), Some("s"));
    }
}
