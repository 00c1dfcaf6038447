//! Bins of a spectrum gathered into bands, in which a function that is smooth in `cos w` is
//! interpolated. Segments of several lengths share the bands of the longest.

use std::ops::Range;

/// Points in each band.
pub(crate) const NODES_PER_BAND: usize = 6;
/// Width of a band in `1 − cos w`.
const BAND_RATIO: f64 = 2.0;

/// How the bins of a segment are gathered. Depends on its length and, where bands are shared, on that of the longest.
#[derive(Debug)]
pub(crate) struct Bands {
    pub(crate) bands: Vec<Band>,
    /// `cos w` at the points of all bands.
    pub(crate) nodes: Vec<f64>,
    /// Lagrange's polynomials at the bins of the bands that are interpolated, in order.
    pub(crate) lagrange: Vec<[f64; NODES_PER_BAND]>,
}

/// Where a function is interpolated in a band.
#[derive(Clone, Copy)]
struct Nodes {
    /// Chebyshev's, from −1 to 1.
    unit: [f64; NODES_PER_BAND],
    middle: f64,
    half_width: f64,
}

impl Nodes {
    /// From the lowest place of the band to the highest.
    fn between(low: f64, high: f64) -> Self {
        let angle = |q: usize| std::f64::consts::PI * (q as f64 + 0.5) / NODES_PER_BAND as f64;
        let unit = std::array::from_fn(|q| angle(q).cos());
        Self { unit, middle: 0.5 * (high + low), half_width: 0.5 * (high - low) }
    }

    const fn lowest(&self) -> f64 {
        self.middle - self.half_width
    }

    fn places(&self) -> [f64; NODES_PER_BAND] {
        self.unit.map(|c| self.middle + self.half_width * c)
    }

    /// Lagrange's polynomials at `x`.
    fn lagrange(&self, x: f64) -> [f64; NODES_PER_BAND] {
        let unit = &self.unit;
        let at = (x - self.middle) / self.half_width;
        std::array::from_fn(|q| {
            (0..NODES_PER_BAND).filter(|&k| k != q).map(|k| (at - unit[k]) / (unit[q] - unit[k])).product()
        })
    }
}

/// Places at which a band of many more bins is summed, each for as many of them: the midpoint rule, off by some `1/24` of the square
/// of their distance in widths of the band, 1e-8.
const PLACES_PER_BAND: usize = 2048;

/// The points of [`Bands::points`] for the bins `cos(π j/n)`, `j = 1 … n−1`, of a long segment of `n` samples, without any bin.
pub(crate) fn points_of_long(samples: usize) -> Vec<(f64, f64)> {
    let cosine = |j: f64| (std::f64::consts::PI * j / samples as f64).cos();
    let mut out = Vec::new();
    let mut first = 1;
    while first < samples {
        let edge = BAND_RATIO * (1.0 - cosine(first as f64));
        let last = ((1.0 - edge).max(-1.0).acos() / std::f64::consts::PI * samples as f64) as usize;
        let bins = (last.clamp(first, samples - 1) + 1) - first;
        if bins <= NODES_PER_BAND {
            out.push((cosine(first as f64), 1.0));
            first += 1;
            continue;
        }
        let (high, low) = (cosine(first as f64), cosine((first + bins - 1) as f64));
        let nodes = Nodes::between(low, high);
        let places = bins.min(PLACES_PER_BAND);
        let each = bins as f64 / places as f64;
        let mut counts = [0.0; NODES_PER_BAND];
        for place in 0..places {
            let lagrange = nodes.lagrange(cosine(first as f64 - 0.5 + (place as f64 + 0.5) * each));
            (0..NODES_PER_BAND).for_each(|q| counts[q] += each * lagrange[q]);
        }
        out.extend(nodes.places().into_iter().zip(counts));
        first += bins;
    }
    out
}

/// Bands for the bins of every segment that is no longer than the longest, each interpolated, however few bins it has.
pub(crate) struct SharedBands {
    /// From slow to fast.
    bands: Vec<Nodes>,
}

impl SharedBands {
    /// - `cosines`: `cos w` of the longest segment's bins, falling, two at least
    pub(crate) fn of_longest(cosines: &[f64]) -> Self {
        let (mut low, end) = (1.0 - cosines[0], 1.0 - cosines[cosines.len() - 1]);
        debug_assert!(low < end, "one bin is no band");
        let mut bands = Vec::new();
        while low < end {
            let high = (BAND_RATIO * low).min(end);
            bands.push(Nodes::between(1.0 - high, 1.0 - low));
            low = high;
        }
        Self { bands }
    }
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Band {
    pub(crate) first_bin: usize,
    pub(crate) bins: usize,
    pub(crate) first_node: usize,
    /// Half width in `cos w`; 0 for a band that is a single bin, kept as it is.
    pub(crate) half_width: f64,
}

impl Bands {
    const NONE: Self = Self { bands: Vec::new(), nodes: Vec::new(), lagrange: Vec::new() };

    /// - `cosines`: `cos w` of the bins, falling
    pub(crate) fn new(cosines: &[f64]) -> Self {
        let mut out = Self::NONE;
        let mut first_bin = 0;
        while first_bin < cosines.len() {
            let edge = BAND_RATIO * (1.0 - cosines[first_bin]);
            let bins = cosines[first_bin..].partition_point(|x| 1.0 - x <= edge).max(1);
            if bins <= NODES_PER_BAND {
                out.bands.push(Band { first_bin, bins: 1, first_node: out.nodes.len(), half_width: 0.0 });
                out.nodes.push(cosines[first_bin]);
                first_bin += 1;
                continue;
            }
            let (high, low) = (cosines[first_bin], cosines[first_bin + bins - 1]);
            out.interpolate(&Nodes::between(low, high), cosines, first_bin..first_bin + bins);
            first_bin += bins;
        }
        out
    }

    /// Gathers the bins of one segment in `shared` bands.
    ///
    /// - `cosines`: `cos w` of the bins, falling
    pub(crate) fn sharing(shared: &SharedBands, cosines: &[f64]) -> Self {
        let mut out = Self::NONE;
        let mut first_bin = 0;
        for (index, band) in shared.bands.iter().enumerate() {
            // The last takes what is left: rounding must not lose a bin.
            let is_last = index + 1 == shared.bands.len();
            let bins = cosines[first_bin..].partition_point(|x| is_last || *x >= band.lowest());
            out.interpolate(band, cosines, first_bin..first_bin + bins);
            first_bin += bins;
        }
        out
    }

    /// Adds a band in which the `bins` of `cosines` are interpolated.
    fn interpolate(&mut self, nodes: &Nodes, cosines: &[f64], bins: Range<usize>) {
        let (first_node, half_width) = (self.nodes.len(), nodes.half_width);
        self.bands.push(Band { first_bin: bins.start, bins: bins.len(), first_node, half_width });
        self.nodes.extend(nodes.places());
        self.lagrange.extend(cosines[bins].iter().map(|x| nodes.lagrange(*x)));
    }

    /// Points `x = cos w` and how many bins each stands for: `Σ_j f(x_j)` over all bins, for an `f`
    /// that is smooth in `x`.
    pub(crate) fn points(&self) -> Vec<(f64, f64)> {
        let mut out: Vec<(f64, f64)> = self.nodes.iter().map(|x| (*x, 0.0)).collect();
        let mut lagrange = self.lagrange.iter();
        for band in &self.bands {
            if band.half_width == 0.0 {
                out[band.first_node].1 = 1.0;
                continue;
            }
            for weights in lagrange.by_ref().take(band.bins) {
                out[band.first_node..].iter_mut().zip(weights).for_each(|((_, bins), weight)| *bins += weight);
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A spectrum that falls from 1 within a thousandth of the band, as noise through the inverse of a slow sensor: exact sums over a
    /// million bins. The interpolation is off by 5e-5 of any value at most, and in both alike.
    #[test]
    fn points_of_long_segments_are_those_of_their_bins() {
        let samples = 1_000_000;
        let cosines: Vec<f64> =
            (1..samples).map(|j| (std::f64::consts::PI * j as f64 / samples as f64).cos()).collect();
        let falls = |x: f64| 1.0 / (1.0 + 2e5 * (1.0 - x));
        let exact: f64 = cosines.iter().map(|x| falls(*x)).sum();
        let of_bins: f64 = Bands::new(&cosines).points().into_iter().map(|(x, bins)| bins * falls(x)).sum();
        let of_long: f64 = points_of_long(samples).into_iter().map(|(x, bins)| bins * falls(x)).sum();
        assert!(
            (of_bins / exact - 1.0).abs() < 5e-5 && (of_long / of_bins - 1.0).abs() < 1e-6,
            "{exact} {of_bins} {of_long}"
        );
        let bins: f64 = points_of_long(samples).iter().map(|point| point.1).sum();
        assert!((bins - (samples - 1) as f64).abs() < 1e-6 * bins, "{bins}");
    }
}
