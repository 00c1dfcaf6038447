//! Two temperature sensors' time constants from their readings alone.

mod characterisation;
mod characterise;
mod error;
mod objective;
mod options;
mod profile;
mod starts;

pub use characterisation::{
    Characterisation, Difference, Estimate, FreeParameters, IntervalMethod, MadeBy, RecordSummary, Residual,
    SensorEstimate, Status,
};
pub use characterise::{characterise, readings};
pub use error::Error;
pub use options::{Estimator, Hold, Known, Options};

pub use twinlag_bias as bias;
pub use twinlag_cross_relation as cross_relation;
pub use twinlag_optimise as optimise;
pub use twinlag_record as record;
pub use twinlag_sensor as sensor;
pub use twinlag_signal as signal;
