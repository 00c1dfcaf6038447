//! Contour lines by marching squares, linear between grid points; the two ambiguous cases are
//! distinguished by the mean of the four corners. Exact for a plane.

use std::collections::BTreeMap;

/// An edge of the grid: from point `(column, row)` to the right (`false`) or upwards (`true`).
type Edge = (usize, usize, bool);

/// Lines along which `z` is `level`, in units of grid steps: `(0, 0)` is the first grid point.
/// Cells with a corner that is not finite are left out. `z[row * columns + column]`.
pub(crate) fn contour(z: &[f64], columns: usize, level: f64) -> Vec<Vec<(f64, f64)>> {
    let rows = z.len() / columns;
    let at = |i: usize, j: usize| z[j * columns + i] - level;
    let mut next: BTreeMap<Edge, Vec<Edge>> = BTreeMap::new();
    for j in 0..rows.saturating_sub(1) {
        for i in 0..columns.saturating_sub(1) {
            // Counterclockwise from the lower left; side `k` lies between corners `k` and `k + 1`.
            let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            if corners.iter().any(|c| !c.is_finite()) {
                continue;
            }
            let sides: [Edge; 4] = [(i, j, false), (i + 1, j, true), (i, j + 1, false), (i, j, true)];
            let crossed: Vec<Edge> =
                (0..4).filter(|&k| (corners[k] < 0.0) != (corners[(k + 1) % 4] < 0.0)).map(|k| sides[k]).collect();
            let mut join = |a: Edge, b: Edge| {
                next.entry(a).or_default().push(b);
                next.entry(b).or_default().push(a);
            };
            match crossed[..] {
                [a, b] => join(a, b),
                [a, b, c, d] => {
                    // A saddle. If the middle is on the side of the first corner, that corner and
                    // the third are joined, and the strokes cut off the second and the fourth.
                    if (corners.iter().sum::<f64>() < 0.0) == (corners[0] < 0.0) {
                        join(a, b);
                        join(c, d);
                    } else {
                        join(a, d);
                        join(b, c);
                    }
                }
                _ => {}
            }
        }
    }
    let place = |(i, j, up): Edge| {
        let a = at(i, j);
        let b = if up { at(i, j + 1) } else { at(i + 1, j) };
        let t = a / (a - b);
        if up { (i as f64, j as f64 + t) } else { (i as f64 + t, j as f64) }
    };
    let mut lines = Vec::new();
    // Open lines first, from their ends, which have one neighbour; what is left then is closed.
    for open in [true, false] {
        let starts: Vec<Edge> = next.iter().filter(|(_, to)| !open || to.len() == 1).map(|(edge, _)| *edge).collect();
        for start in starts {
            let mut line = vec![place(start)];
            let mut here = start;
            while let Some(to) = next.get_mut(&here).and_then(Vec::pop) {
                if let Some(back) = next.get_mut(&to)
                    && let Some(k) = back.iter().position(|edge| *edge == here)
                {
                    back.swap_remove(k);
                }
                line.push(place(to));
                here = to;
            }
            if line.len() > 1 {
                lines.push(line);
            }
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::contour;

    /// Oracle: the circle. Linear interpolation on a grid of step 1 errs by at most `1/(8 r)` of
    /// the sagitta for a distance function of radius `r`, here 0.016; a misplaced corner errs by
    /// tenths.
    #[test]
    fn the_contour_of_a_distance_is_one_closed_circle() {
        let n = 25;
        let z: Vec<f64> = (0..n * n).map(|k| ((k % n) as f64 - 12.2).hypot((k / n) as f64 - 11.7)).collect();
        let lines = contour(&z, n, 8.0);
        assert_eq!(lines.len(), 1);
        assert_eq!(lines[0].first(), lines[0].last());
        for (x, y) in &lines[0] {
            let got = (x - 12.2).hypot(y - 11.7);
            assert!((got - 8.0).abs() < 0.02, "got radius {got}, want 8 ± 0.02");
        }
    }

    #[test]
    fn the_contour_of_a_plane_is_one_straight_line_and_stops_at_gaps() {
        let mut z: Vec<f64> = (0..36).map(|k| f64::from(k % 6) + 0.5 * f64::from(k / 6)).collect();
        let lines = contour(&z, 6, 2.3);
        assert_eq!(lines.len(), 1);
        assert!(lines[0].iter().all(|(x, y)| (x + 0.5 * y - 2.3).abs() < 1e-12));
        z[2 * 6 + 1] = f64::NAN;
        assert_eq!(contour(&z, 6, 2.3).len(), 2);
        assert!(contour(&z, 6, 99.0).is_empty());
    }
}
