//! Dates and times of day as loggers write them, to nanoseconds. Zones are applied; a stamp without
//! one stays civil time.

use jiff::civil::{Date, date};

/// A date as written: which of day and month comes first may be open.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Day {
    Sure(Date),
    /// Both smaller than 13 or one of them larger: `[first, second]`, and the year.
    Open([i8; 2], i16),
}

/// A cell with a date, a time of day, or both.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Stamp {
    pub(crate) day: Option<Day>,
    /// Nanoseconds since midnight; may exceed a day for elapsed times such as `25:00:00`.
    pub(crate) time_ns: Option<i64>,
    /// East of Greenwich.
    pub(crate) offset_s: Option<i64>,
    /// Whether the time has two parts, which were taken to be hours and minutes.
    pub(crate) is_short: bool,
}

impl Stamp {
    /// Takes the two parts of a time to be minutes and seconds.
    pub(crate) fn take_as_minutes(&mut self) {
        self.time_ns = self.time_ns.map(|time_ns| time_ns / 60);
    }
}

const NS: i64 = 1_000_000_000;
pub(crate) const DAY_NS: i64 = 86_400 * NS;

/// Days since 1970-01-01.
pub(crate) fn day_number(day: Date) -> i64 {
    day.duration_since(date(1970, 1, 1)).as_hours() / 24
}

/// Reads a stamp: `2026-01-31T10:00:00.5+01:00`, `2026/01/31 10:00`, `31.01.2026 10:00:00`,
/// `01/31/2026 10:00:00 PM`, `31-Jan-2026 10:00:00`, `10:00:00,5`, `2026-01-31`.
pub(crate) fn parse(cell: &str) -> Option<Stamp> {
    let cell = cell.trim();
    if !cell.is_ascii() || !cell.starts_with(|c: char| c.is_ascii_digit()) {
        return None;
    }
    let end = cell.find([' ', 'T', 't']).unwrap_or(cell.len());
    let (head, rest) = (&cell[..end], cell.get(end + 1..).unwrap_or("").trim());
    if head.contains(':') {
        return parse_time(cell);
    }
    let day = Some(parse_day(head)?);
    if end == cell.len() {
        return Some(Stamp { day, ..Stamp::default() });
    }
    Some(Stamp { day, ..parse_time(rest)? })
}

fn parse_day(text: &str) -> Option<Day> {
    let separator = text.chars().find(|c| !c.is_ascii_digit()).filter(|c| "-/.".contains(*c))?;
    let mut parts = text.split(separator);
    let (a, b, c) = (parts.next()?, parts.next()?, parts.next()?);
    if parts.next().is_some() {
        return None;
    }
    if a.len() == 4 {
        return Date::new(digits(a)?, digits(b)?, digits(c)?).ok().map(Day::Sure);
    }
    let year = match c.len() {
        4 => digits(c)?,
        2 => 2000 + digits::<i16>(c)?,
        _ => return None,
    };
    if let Some(month) = month_of(b) {
        return Date::new(year, month, digits(a)?).ok().map(Day::Sure);
    }
    let (a, b) = (digits::<i8>(a)?, digits::<i8>(b)?);
    // Points are the German way, day first; strokes and dashes are used in both orders.
    if separator == '.' {
        return Date::new(year, b, a).ok().map(Day::Sure);
    }
    (Date::new(year, b, a).is_ok() || Date::new(year, a, b).is_ok()).then_some(Day::Open([a, b], year))
}

fn month_of(name: &str) -> Option<i8> {
    const MONTHS: [&str; 12] = ["jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec"];
    let found = MONTHS.iter().position(|month| name.eq_ignore_ascii_case(month))?;
    i8::try_from(found + 1).ok()
}

fn digits<T: std::str::FromStr>(text: &str) -> Option<T> {
    if text.is_empty() || text.len() > 4 || !text.bytes().all(|b| b.is_ascii_digit()) {
        return None;
    }
    text.parse().ok()
}

/// `h:mm[:ss[.f]]`, `h:mm:ss:fff`, or `mm:ss.f`; then perhaps AM or PM; then perhaps a zone.
fn parse_time(text: &str) -> Option<Stamp> {
    let end = text.find(|c: char| !(c.is_ascii_digit() || ":.,".contains(c))).unwrap_or(text.len());
    let (clock, rest) = (&text[..end], text[end..].trim());
    let (whole, fraction) = match clock.find(['.', ',']) {
        Some(point) => (&clock[..point], &clock[point + 1..]),
        // Milliseconds behind another colon, as some programs of cameras and oscilloscopes write them.
        None => match clock.rsplit_once(':') {
            Some((whole, milliseconds)) if milliseconds.len() == 3 && whole.matches(':').count() == 2 => {
                (whole, milliseconds)
            }
            _ => (clock, ""),
        },
    };
    let mut nanos = 0;
    let mut unit = NS;
    for digit in fraction.bytes() {
        unit /= 10;
        nanos += i64::from(digit.checked_sub(b'0').filter(|d| *d < 10)?) * unit;
    }
    let mut parts = whole.split(':');
    let (a, b, c) = (digits::<i64>(parts.next()?)?, digits::<i64>(parts.next()?)?, parts.next());
    if parts.next().is_some() {
        return None;
    }
    let (mut hours, minutes, seconds) = match c {
        Some(c) => (a, b, digits::<i64>(c)?),
        None if fraction.is_empty() => (a, b, 0),
        None => (0, a, b),
    };
    if minutes > 59 || seconds > 59 {
        return None;
    }
    let mut zone = rest;
    for (word, shift) in [("am", 0), ("pm", 12)] {
        if rest.get(..2).is_some_and(|start| start.eq_ignore_ascii_case(word)) {
            if !(1..=12).contains(&hours) {
                return None;
            }
            hours = hours % 12 + shift;
            zone = rest[2..].trim();
        }
    }
    let time_ns = ((hours * 60 + minutes) * 60 + seconds) * NS + nanos;
    let is_short = c.is_none() && fraction.is_empty() && rest.is_empty();
    Some(Stamp { day: None, time_ns: Some(time_ns), offset_s: parse_zone(zone)?, is_short })
}

/// `Z`, `UTC`, `+01:00`, `+0100`, `+01`; the inner `None` is no zone.
#[expect(clippy::option_option, reason = "outer: not a zone; inner: none given")]
fn parse_zone(text: &str) -> Option<Option<i64>> {
    if text.is_empty() {
        return Some(None);
    }
    if ["z", "utc", "gmt"].iter().any(|word| text.eq_ignore_ascii_case(word)) {
        return Some(Some(0));
    }
    let (sign, rest) = match text.split_at_checked(1)? {
        ("+", rest) => (1, rest),
        ("-", rest) => (-1, rest),
        _ => return None,
    };
    let (hours, minutes) = match rest.split_once(':') {
        Some((hours, minutes)) => (hours, minutes),
        None if rest.len() == 4 => rest.split_at(2),
        None => (rest, "0"),
    };
    let (hours, minutes) = (digits::<i64>(hours)?, digits::<i64>(minutes)?);
    (hours < 24 && minutes < 60).then_some(Some(sign * (hours * 60 + minutes) * 60))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn ns(cell: &str) -> Option<i64> {
        let stamp = parse(cell)?;
        let day = match stamp.day? {
            Day::Sure(day) => day_number(day),
            Day::Open(..) => return None,
        };
        Some(day * DAY_NS + stamp.time_ns? - stamp.offset_s.unwrap_or(0) * NS)
    }

    proptest! {
        /// Oracle: jiff prints an instant in a zone, and this module finds its nanosecond again.
        #[test]
        fn what_jiff_prints_is_read_to_the_nanosecond(second in 0_i64..4_000_000_000, nano in 0_i64..NS, hours in -12_i8..13) {
            let want = second * NS + nano;
            let at = jiff::Timestamp::from_nanosecond(i128::from(want)).unwrap();
            let offset = jiff::tz::Offset::constant(hours);
            prop_assert_eq!(ns(&at.to_string()), Some(want));
            prop_assert_eq!(ns(&at.display_with_offset(offset).to_string()), Some(want));
        }
    }

    #[test]
    fn one_moment_is_read_from_every_way_of_writing_it() {
        let want = ns("2026-01-31T22:00:05.25Z");
        for cell in [
            "2026-01-31 22:00:05.25",
            "2026/01/31 22:00:05,25",
            "31.01.2026 22:00:05.250",
            "31.01.26 22:00:05.250",
            "31-Jan-2026 22:00:05.25",
            "2026-01-31 10:00:05.25 PM",
            "2026-01-31 22:00:05:250",
            "2026-01-31T23:00:05.25+01:00",
            "2026-01-31T23:00:05.25+0100",
        ] {
            assert_eq!(ns(cell), want, "{cell}");
        }
    }

    #[test]
    fn times_of_day_and_dates_stand_alone() {
        assert_eq!(parse("10:00:00.5").unwrap().time_ns, Some(36_000 * NS + NS / 2));
        assert_eq!(parse("01:30.5").unwrap().time_ns, Some(90 * NS + NS / 2));
        assert_eq!(parse("12:30 AM").unwrap().time_ns, Some(1800 * NS));
        assert_eq!(parse("2026-01-31").unwrap().time_ns, None);
        assert_eq!(parse("03/04/2026").unwrap().day, Some(Day::Open([3, 4], 2026)));
    }

    #[test]
    fn what_is_no_time_is_none() {
        for cell in ["", "x", "20.1", "2026-13-01", "30.02.2026", "10:61:00", "10:00:00 XM", "1.2.3.4", "10::00", "T1"]
        {
            assert_eq!(parse(cell), None, "{cell}");
        }
    }
}
