//! Cells under each other.

/// Lines of rows whose cells stand under each other, two spaces apart.
///
/// - `is_text`: whether a column holds text, which begins on the left; numbers end on the right
pub(crate) fn columns(rows: &[Vec<String>], is_text: impl Fn(usize) -> bool) -> Vec<String> {
    let width = |i: usize| rows.iter().filter_map(|row| row.get(i)).map(|cell| cell.chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..rows.iter().map(Vec::len).max().unwrap_or(0)).map(width).collect();
    let line = |row: &Vec<String>| {
        let cells =
            row.iter().zip(&widths).enumerate().map(|(i, (cell, width))| {
                if is_text(i) { format!("{cell:<width$}") } else { format!("{cell:>width$}") }
            });
        cells.collect::<Vec<_>>().join("  ").trim_end().to_owned()
    };
    rows.iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_begins_on_the_left_and_numbers_end_on_the_right() {
        let rows = [["τ", "1.5", "a"], ["second", "22", ""]].map(|row| row.map(str::to_owned).to_vec());
        assert_eq!(columns(&rows, |i| i != 1), ["τ       1.5  a", "second   22"]);
    }
}
