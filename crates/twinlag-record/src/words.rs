//! The words of a name.

/// The words of a name in lower case, set apart by anything but letters and digits.
pub(crate) fn words(text: &str) -> impl Iterator<Item = String> {
    text.split(|c: char| !c.is_alphanumeric()).filter(|word| !word.is_empty()).map(str::to_lowercase)
}

/// A name with a blank where nothing but a capital sets two words apart: `elapsed Millis`, `Zeit MS`, but `mSek`, which is one.
pub(crate) fn apart(name: &str) -> String {
    let mut out = String::new();
    // Letters of the word so far.
    let mut letters = 0;
    let mut before = ' ';
    for c in name.chars() {
        if c.is_uppercase() && before.is_lowercase() && letters > 1 {
            out.push(' ');
            letters = 0;
        }
        letters = if c.is_alphabetic() { letters + 1 } else { 0 };
        before = c;
        out.push(c);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::{apart, words};

    #[test]
    fn capitals_set_words_apart_behind_a_word() {
        for (name, want) in [
            ("elapsedMillis", "elapsed millis"),
            ("ZeitMS", "zeit ms"),
            ("timeMs", "time ms"),
            ("Zeit mSek", "zeit msek"),
            ("T1_fineWire", "t1 fine wire"),
            ("UPTIME", "uptime"),
            ("", ""),
        ] {
            assert_eq!(words(&apart(name)).collect::<Vec<_>>().join(" "), want, "{name}");
        }
    }
}
