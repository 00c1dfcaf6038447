//! The line of each row: rows follow each other line by line but for comments and blanks, so that only where they do not is kept.

/// Line of each row in the file, from 1.
#[derive(Clone, Debug, Default)]
pub(crate) struct RowLines {
    /// A row and its line, wherever it is not on the line after the row before.
    runs: Vec<(usize, usize)>,
    rows: usize,
}

impl RowLines {
    /// Takes the line of the next row.
    pub(crate) fn push(&mut self, line: usize) {
        let follows = self.runs.last().is_some_and(|(row, first)| first + (self.rows - row) == line);
        if !follows {
            self.runs.push((self.rows, line));
        }
        self.rows += 1;
    }

    /// Number of rows.
    pub(crate) fn len(&self) -> usize {
        self.rows
    }

    /// The line of a row. Panics if there is no such row.
    pub(crate) fn of(&self, row: usize) -> usize {
        assert!(row < self.rows, "row {row} of {}", self.rows);
        let (first, line) = self.runs[self.runs.partition_point(|run| run.0 <= row) - 1];
        line + (row - first)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_keeps_its_line() {
        let lines = [3, 4, 5, 7, 8, 12, 13, 20];
        let mut kept = RowLines::default();
        lines.iter().for_each(|line| kept.push(*line));
        assert_eq!((0..kept.len()).map(|row| kept.of(row)).collect::<Vec<_>>(), lines);
    }
}
