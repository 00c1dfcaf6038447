//! What stands in the brackets of a header and is no unit: the size of a wire, the type of a
//! thermocouple, the place of a probe.
//!
//! Only what is recognised counts. Any other text may be a unit that this program does not know,
//! and a column in an unknown unit is refused, never taken to be in °C.

/// Units of length, in which sensors are sold.
const LENGTHS: [&str; 13] =
    ["mm", "\u{b5}m", "\u{3bc}m", "um", "nm", "cm", "m", "in", "inch", "mil", "mils", "micron", "microns"];
/// Wires by number: `AWG 30`, `30 ga`.
const GAUGES: [&str; 4] = ["awg", "swg", "ga", "gauge"];
/// The letters of standard thermocouples.
const TYPES: [&str; 9] = ["b", "c", "e", "j", "k", "n", "r", "s", "t"];
/// Words about a sensor, its make and its place.
const WORDS: &str = "type typ thermocouple thermoelement tc rtd ntc pt wire bead probe sensor junction \
    fine coarse thin thick fast slow bare sheathed shielded small large big \
    left right top bottom front back rear inner outer upper lower middle centre center \
    inlet outlet upstream downstream channel ch no avg mean diameter";

/// Whether the text describes a sensor and is no unit: `0.5 mm`, `type K`, `K-type`, `fine`,
/// `ch 2`, `Ø 50 µm, bare`.
pub(crate) fn is_description(text: &str) -> bool {
    let text = text.to_lowercase();
    let words: Vec<&str> = text
        .split(|c: char| !(c.is_alphanumeric() || c == '.'))
        .filter(|word| !word.is_empty())
        .flat_map(parts)
        .collect();
    let is_type = words.iter().any(|word| ["type", "typ"].contains(word));
    let is_number =
        |word: &str| word.starts_with(|c: char| c.is_ascii_digit() || c == '.') && word.parse::<f64>().is_ok();
    let is_length =
        |at: usize| LENGTHS.contains(&words[at]) && at.checked_sub(1).is_some_and(|before| is_number(words[before]));
    let is_gauge = |word: &str| GAUGES.contains(&word) && words.len() > 1;
    let is_known = |at: usize| {
        let word = words[at];
        is_number(word)
            || WORDS.split(' ').any(|known| known == word)
            // A length is one behind a number only: `mm` alone is a unit, of something else.
            || is_length(at)
            || is_gauge(word)
            || (["ø", "⌀", "d"].contains(&word) && at + 1 < words.len() && is_number(words[at + 1]))
            || (is_type && TYPES.contains(&word))
    };
    !words.is_empty() && (0..words.len()).all(is_known)
}

/// A word in its number and its letters: `0.5mm`, `pt100`.
fn parts(word: &str) -> impl Iterator<Item = &str> {
    let is_of_number = |c: char| c.is_ascii_digit() || c == '.';
    let starts_with_number = word.starts_with(is_of_number);
    let at = word.find(|c: char| is_of_number(c) != starts_with_number).unwrap_or(word.len());
    let (first, rest) = word.split_at(at);
    [first, rest].into_iter().filter(|part| !part.is_empty())
}

#[cfg(test)]
mod tests {
    use super::is_description;

    #[test]
    fn sizes_types_and_places_are_descriptions() {
        for text in [
            "0.5 mm",
            "0,25mm",
            "50 um",
            "50 µm",
            "Ø 0.5 mm",
            "d = 0.5 mm",
            "30 AWG",
            "AWG30",
            "1",
            "2 m",
            "type K",
            "Type-K",
            "K-type",
            "Typ K",
            "k type thermocouple",
            "Pt100",
            "PT 1000",
            "fine",
            "thin wire, 0.1 mm",
            "ch 2",
            "#3",
            "top",
        ] {
            assert!(is_description(text), "{text}");
        }
    }

    /// Each of these is a unit, known or not, or a scale of one.
    #[test]
    fn units_are_no_descriptions() {
        for text in [
            "",
            "mm",
            "m",
            "K",
            "C",
            "°C",
            "degC",
            "mV",
            "counts",
            "V",
            "%",
            "bar",
            "m/s",
            "0.1 °C",
            "1e-3 K",
            "1/10 K",
            "raw",
            "ADC",
            "kPa",
            "s",
            "10 ms",
            "ITS-90, deg C",
        ] {
            assert!(!is_description(text), "{text}");
        }
    }
}
