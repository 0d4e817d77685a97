//! Numbers in text files and tags, in the notations of many programs.

/// Reads a number, also with a decimal comma, with Fortran's exponent (`5.0D+02`), or as NaN or
/// infinity in the notation of Microsoft's C library (`-1.#IND`, `1.#QNAN`, `1.#INF`).
pub(super) fn number(word: &str) -> Option<f64> {
    let word = word.trim();
    let parsed = |word: &str| word.parse::<f64>().ok();
    parsed(word)
        .or_else(|| not_a_number(word))
        .or_else(|| {
            let one_comma = word.matches(',').count() == 1 && !word.contains('.');
            parsed(&word.replace(',', ".")).filter(|_| one_comma)
        })
        .or_else(|| {
            let is_decimal = word.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
            parsed(&word.replace(['d', 'D'], "e")).filter(|_| is_decimal)
        })
}

/// Reads NaN and infinity as C libraries print them.
fn not_a_number(word: &str) -> Option<f64> {
    let lower = word.to_ascii_lowercase();
    let size = lower.trim_start_matches(['+', '-']);
    let begins = |words: &[&str]| words.iter().any(|word| size.starts_with(word));
    if begins(&["1.#qnan", "1.#snan", "1.#ind", "nan("]) {
        return Some(f64::NAN);
    }
    let infinity = match lower.starts_with('-') {
        true => f64::NEG_INFINITY,
        false => f64::INFINITY,
    };
    begins(&["1.#inf"]).then_some(infinity)
}

/// Returns the beginning of a text from a file, for a remark.
pub(super) fn beginning(text: &str) -> String {
    const MAX: usize = 40;
    let shown = |c: char| if c.is_control() { '?' } else { c };
    let mut beginning: String = text.chars().take(MAX).map(shown).collect();
    if text.chars().nth(MAX).is_some() {
        beginning.push('…');
    }
    beginning
}

/// A no-data value from a file's text, with a remark if it is not a plain number.
#[derive(Debug, Default, PartialEq)]
pub(super) struct NoDataText {
    /// The value, if the text has one.
    pub(super) value: Option<f64>,
    /// A remark for the user.
    pub(super) remark: Option<String>,
}

/// Reads a no-data value. If the text is a list of `bands` values, the value of `band` (from 0) is
/// used; of a list of another length, the first.
pub(super) fn no_data(text: &str, band: usize, bands: usize) -> NoDataText {
    if let Some(value) = number(text) {
        return NoDataText {
            value: Some(value),
            remark: None,
        };
    }
    let words: Vec<&str> = text
        .split(|c: char| c.is_whitespace() || ";[](){}".contains(c))
        .map(|word| word.trim_matches(','))
        .filter(|word| !word.is_empty())
        .collect();
    let own = if words.len() == bands { band } else { 0 };
    let value = words.get(own).and_then(|word| number(word));
    let text = beginning(text);
    let remark = match value {
        Some(value) => format!("its no-data value is the text '{text}': {value} is used"),
        None => format!(
            "its no-data value is the text '{text}', which is no number: it is not used (state it: --input no-data=VALUE)"
        ),
    };
    NoDataText {
        value,
        remark: Some(remark),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_in_every_common_spelling() {
        for (word, value) in [
            ("-9999", -9999.0),
            ("-9999,0", -9999.0),
            ("5.0000D+02", 500.0),
            ("-3.4e38", -3.4e38),
            ("1.#INF", f64::INFINITY),
            ("-1.#INF00", f64::NEG_INFINITY),
            ("inf", f64::INFINITY),
        ] {
            assert_eq!(number(word), Some(value), "{word}");
        }
        let nan = ["nan", "-nan", "NaN", "-nan(ind)", "1.#QNAN", "-1.#IND00"];
        for word in nan {
            assert!(number(word).is_some_and(f64::is_nan), "{word}");
        }
        for word in ["", "None", "null", "D5", "1,000,000", "1.0,5", "deed"] {
            assert_eq!(number(word), None, "{word}");
        }
    }

    #[test]
    fn list_of_no_data_values_has_one_for_each_band() {
        let value = |text, band, bands| no_data(text, band, bands).value;
        assert_eq!(value("-9999 -9999", 0, 1), Some(-9999.0));
        assert_eq!(value("-9999 -32768 0", 1, 3), Some(-32768.0));
        assert_eq!(value("-9999, -32768", 1, 3), Some(-9999.0));
        assert_eq!(value("[-9999.0]", 0, 1), Some(-9999.0));
        assert_eq!(value("-9999 (void)", 0, 1), Some(-9999.0));
        assert_eq!(value("None", 0, 1), None);
        assert_eq!(no_data("-9999,0", 0, 1).remark, None);
        let remark = no_data("None", 0, 1).remark.expect("a remark");
        assert!(remark.contains("'None'") && remark.contains("--input no-data"));
    }
}
