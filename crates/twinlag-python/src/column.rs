//! Numbers in a row as NumPy has them.

use std::convert::Infallible;

use numpy::PyArray1;
use pyo3::prelude::*;

/// Numbers that become a NumPy array of their own.
pub(crate) struct Column<'a>(pub(crate) &'a [f64]);

impl<'py> IntoPyObject<'py> for Column<'_> {
    type Target = PyArray1<f64>;
    type Output = Bound<'py, Self::Target>;
    type Error = Infallible;

    #[cfg(feature = "stubs")]
    const OUTPUT_TYPE: pyo3::inspect::PyStaticExpr = pyo3::type_hint_subscript!(
        pyo3::type_hint_identifier!("numpy.typing", "NDArray"),
        pyo3::type_hint_identifier!("numpy", "float64")
    );

    fn into_pyobject(self, py: Python<'py>) -> Result<Self::Output, Self::Error> {
        Ok(PyArray1::from_slice(py, self.0))
    }
}
