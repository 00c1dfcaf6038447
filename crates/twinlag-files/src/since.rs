//! Units of time that say from which instant they count: `seconds since 2026-01-01 10:00:00`.

use jiff::Timestamp;
use jiff::civil::{Date, DateTime};
use jiff::tz::TimeZone;

/// The instant, in nanoseconds since 1970-01-01, UTC, where a zone is not stated.
pub(crate) fn start_ns(unit: &str) -> Option<i64> {
    let (_, since) = unit.split_once(" since ")?;
    let since = since.trim();
    if let Ok(instant) = since.parse::<Timestamp>() {
        return i64::try_from(instant.as_nanosecond()).ok();
    }
    // `2026-01-01 10:00:0.0 UTC`, `2026-01-01 00:00`, `2026-1-1`.
    let bare = since.trim_end_matches("UTC").trim_end_matches('Z').trim();
    let bare = bare.strip_suffix("+00:00").or_else(|| bare.strip_suffix("+0:00")).unwrap_or(bare).trim();
    let (day, time) = bare.split_once([' ', 'T']).unwrap_or((bare, "0"));
    let civil = civil(day, time)?;
    let instant = civil.to_zoned(TimeZone::UTC).ok()?.timestamp();
    i64::try_from(instant.as_nanosecond()).ok()
}

fn civil(day: &str, time: &str) -> Option<DateTime> {
    let mut parts = day.split('-');
    let mut part = || parts.next();
    let day = Date::new(part()?.parse().ok()?, part()?.parse().ok()?, part()?.parse().ok()?).ok()?;
    let mut parts = time.trim().split(':');
    let mut part = || parts.next().unwrap_or("0");
    let (hour, minute, seconds): (i8, i8, f64) = (part().parse().ok()?, part().parse().ok()?, part().parse().ok()?);
    let ns = (seconds.fract() * 1e9).round() as i32;
    day.at(0, 0, 0, 0)
        .checked_add(jiff::Span::new().hours(hour).minutes(minute))
        .ok()?
        .checked_add(jiff::SignedDuration::new(seconds.trunc() as i64, ns))
        .ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 2026-01-31T10:00:00Z is 20 484 days and 10 hours after 1970-01-01.
    #[test]
    fn instants_are_read_as_they_are_met() {
        const NS: i64 = (20_484 * 24 + 10) * 3_600_000_000_000;
        for unit in [
            "seconds since 2026-01-31 10:00:00",
            "days since 2026-01-31T10:00:00Z",
            "hours since 2026-01-31 10:00:0.0",
            "s since 2026-1-31 10:00 UTC",
            "seconds since 2026-01-31 10:00:00 +00:00",
            "seconds since 2026-01-31T11:00:00+01:00",
        ] {
            assert_eq!(start_ns(unit), Some(NS), "{unit}");
        }
        assert_eq!(start_ns("seconds"), None);
        assert_eq!(start_ns("seconds since the flood"), None);
    }
}
