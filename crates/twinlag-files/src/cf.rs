//! What attributes say of values, by the conventions for climate and forecast data: missing ones,
//! the valid range, scale and offset. <https://cfconventions.org>, sections 2.5.1 and 8.1.

/// How stored values become physical ones. Limits and marks of missing ones are as stored.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Packing {
    missing: Vec<f64>,
    lowest: f64,
    highest: f64,
    scale: f64,
    offset: f64,
}

impl Packing {
    /// - `attribute`: the numbers of an attribute by name, if there is one
    pub(crate) fn of(attribute: impl Fn(&str) -> Option<Vec<f64>>) -> Self {
        let first = |name: &str| attribute(name).and_then(|values| values.first().copied());
        let range = attribute("valid_range").filter(|range| range.len() == 2);
        let end = |at: usize, name: &str| {
            range.as_ref().map(|range| range[at]).or_else(|| first(name)).filter(|end| !end.is_nan())
        };
        let missing = ["_FillValue", "missing_value"].into_iter().filter_map(&attribute).flatten();
        Self {
            missing: missing.collect(),
            lowest: end(0, "valid_min").unwrap_or(f64::NEG_INFINITY),
            highest: end(1, "valid_max").unwrap_or(f64::INFINITY),
            scale: first("scale_factor").unwrap_or(1.0),
            offset: first("add_offset").unwrap_or(0.0),
        }
    }

    /// With limits and marks of missing values as they are once they have been stored like the values.
    ///
    /// - `stored`: what becomes of a number that is stored and read
    pub(crate) fn with_marks(mut self, stored: impl Fn(f64) -> f64) -> Self {
        let marks = self.missing.iter_mut().chain([&mut self.lowest, &mut self.highest]);
        marks.for_each(|mark| *mark = stored(*mark));
        self
    }

    /// Makes values physical; missing ones become NaN.
    pub(crate) fn apply(&self, values: &mut [f64]) {
        for value in values {
            let is_valid = (self.lowest..=self.highest).contains(value) && !self.missing.contains(value);
            *value = match (is_valid, self.scale == 1.0 && self.offset == 0.0) {
                (false, _) => f64::NAN,
                (true, true) => *value,
                (true, false) => *value * self.scale + self.offset,
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_and_invalid_values_are_told_before_scaling() {
        let attribute = |name: &str| match name {
            "_FillValue" => Some(vec![-99.0]),
            "valid_range" => Some(vec![0.0, 100.0]),
            "scale_factor" => Some(vec![0.5]),
            "add_offset" => Some(vec![-10.0]),
            _ => None,
        };
        let mut values = [-99.0, 0.0, 100.0, 101.0, 4.0];
        Packing::of(attribute).apply(&mut values);
        assert_eq!((values[1], values[2], values[4]), (-10.0, 40.0, -8.0));
        assert!(values[0].is_nan() && values[3].is_nan());
    }

    #[test]
    fn a_limit_that_is_no_number_is_none() {
        let mut values = [-5.0, 5.0];
        Packing::of(|name| (name == "valid_min").then(|| vec![f64::NAN])).apply(&mut values);
        assert_eq!(values, [-5.0, 5.0]);
    }
}
