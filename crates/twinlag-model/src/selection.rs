//! Which residuals count, and which of their frequencies.

use crate::disagreement::Piece;
use crate::weighting::Weighting;

/// The residuals that count, by the sample in the middle of their reach.
#[derive(Clone, Debug)]
pub struct Selection {
    /// Whether a sample counts.
    pub counts: Vec<bool>,
    /// The weights of the frequencies.
    pub weighting: Weighting,
}

impl Selection {
    /// Whether a sample counts.
    pub fn holds(&self, sample: usize) -> bool {
        self.counts.get(sample).copied().unwrap_or(false)
    }

    /// Appends those of `values` that count, filtered, to `out`.
    ///
    /// - `values`: one for each residual of `pieces`
    /// - `filtered`: memory for the filtered values
    pub(crate) fn pick(&self, values: &[f64], pieces: &[Piece], filtered: &mut Vec<f64>, out: &mut Vec<f64>) {
        let mut from = 0;
        for piece in pieces {
            self.weighting.apply_into(&values[from..from + piece.count], filtered);
            let counts = self.counts.get(piece.first_sample..).unwrap_or(&[]);
            out.extend(filtered.iter().zip(counts).filter(|(_, counts)| **counts).map(|(r, _)| *r));
            from += piece.count;
        }
    }

    /// Samples of the residuals of `pieces` that count.
    pub(crate) fn samples(&self, pieces: &[Piece]) -> Vec<usize> {
        let of_piece = |p: &Piece| p.first_sample..p.first_sample + p.count;
        pieces.iter().flat_map(of_piece).filter(|sample| self.holds(*sample)).collect()
    }
}
