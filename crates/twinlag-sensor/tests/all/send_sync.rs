//! Sensors can be shared between threads and handed from one to another: it compiles, so it holds.

use twinlag_sensor::{
    DifferenceEquation, Discretisation, EquationResponder, FirstOrder, FirstOrderInverter, FirstOrderResponder,
    ModelError, SecondOrder, SlowMode,
};

const fn is_send_and_sync<T: Send + Sync>() {}

const _: () = {
    is_send_and_sync::<DifferenceEquation>();
    is_send_and_sync::<Discretisation>();
    is_send_and_sync::<EquationResponder>();
    is_send_and_sync::<FirstOrder>();
    is_send_and_sync::<FirstOrderInverter>();
    is_send_and_sync::<FirstOrderResponder>();
    is_send_and_sync::<ModelError>();
    is_send_and_sync::<SecondOrder>();
    is_send_and_sync::<SlowMode>();
};
