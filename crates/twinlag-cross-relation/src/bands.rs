//! Bins of a spectrum gathered into bands, in which a function that is smooth in `cos w` is
//! interpolated.

/// Points in each band.
pub(crate) const NODES_PER_BAND: usize = 6;
/// Width of a band in `1 − cos w`.
const BAND_RATIO: f64 = 2.0;

/// How the bins of a segment are gathered. Depends on its length alone.
pub(crate) struct Bands {
    pub(crate) bands: Vec<Band>,
    /// `cos w` at the points of all bands.
    pub(crate) nodes: Vec<f64>,
    /// Lagrange's polynomials at the bins of the bands that are interpolated, in order.
    pub(crate) lagrange: Vec<[f64; NODES_PER_BAND]>,
    /// How many bins each point stands for: Lagrange's polynomials summed.
    counts: Vec<f64>,
}

#[derive(Clone, Copy)]
pub(crate) struct Band {
    pub(crate) first_bin: usize,
    pub(crate) bins: usize,
    pub(crate) first_node: usize,
    /// Half width in `cos w`; 0 for a band that is a single bin, kept as it is.
    pub(crate) half_width: f64,
}

impl Bands {
    /// - `cosines`: `cos w` of the bins, falling
    pub(crate) fn new(cosines: &[f64]) -> Self {
        let mut out = Self { bands: Vec::new(), nodes: Vec::new(), lagrange: Vec::new(), counts: Vec::new() };
        let mut first_bin = 0;
        while first_bin < cosines.len() {
            let edge = BAND_RATIO * (1.0 - cosines[first_bin]);
            let bins = cosines[first_bin..].partition_point(|x| 1.0 - x <= edge).max(1);
            let first_node = out.nodes.len();
            if bins <= NODES_PER_BAND {
                out.bands.push(Band { first_bin, bins: 1, first_node, half_width: 0.0 });
                out.nodes.push(cosines[first_bin]);
                out.counts.push(1.0);
                first_bin += 1;
                continue;
            }
            let (high, low) = (cosines[first_bin], cosines[first_bin + bins - 1]);
            let (middle, half_width) = (0.5 * (high + low), 0.5 * (high - low));
            let angle = |q: usize| std::f64::consts::PI * (q as f64 + 0.5) / NODES_PER_BAND as f64;
            let unit: [f64; NODES_PER_BAND] = std::array::from_fn(|q| angle(q).cos());
            out.nodes.extend(unit.iter().map(|c| middle + half_width * c));
            out.bands.push(Band { first_bin, bins, first_node, half_width });
            let mut counts = [0.0; NODES_PER_BAND];
            for x in &cosines[first_bin..first_bin + bins] {
                let at = (x - middle) / half_width;
                let lagrange: [f64; NODES_PER_BAND] = std::array::from_fn(|q| {
                    (0..NODES_PER_BAND).filter(|&k| k != q).map(|k| (at - unit[k]) / (unit[q] - unit[k])).product()
                });
                (0..NODES_PER_BAND).for_each(|q| counts[q] += lagrange[q]);
                out.lagrange.push(lagrange);
            }
            out.counts.extend(counts);
            first_bin += bins;
        }
        out
    }

    /// Points `x = cos w` and how many bins each stands for: `Σ_j f(x_j)` over all bins, for an `f`
    /// that is smooth in `x`.
    pub(crate) fn points(&self) -> impl Iterator<Item = (f64, f64)> {
        self.nodes.iter().copied().zip(self.counts.iter().copied())
    }
}
