//! The flow at which the numbers of an effect hold: given beside them, and read from a model that was saved.

use std::sync::Arc;

use crate::effect::{Context, Derived, KnownEffect};
use crate::error::ModelError;
use crate::flow::{Flow, FlowKind};

/// The reference of `flow`, as a number beside the parameters.
pub(crate) fn derived(flow: &Flow) -> Derived {
    let unit = match flow.kind() {
        FlowKind::Flow => "its unit",
        FlowKind::Motion => "m/s",
    };
    Derived::constant(flow.kind().reference_name(), unit, flow.reference())
}

/// The flow of this record relative to the reference of `known`; relative to its own mean where `known` has none.
///
/// # Errors
/// [`ModelError::NeedsFlow`] without a flow, and with a speed where `known` has the reference of a flow, or the other way round;
/// [`ModelError::Parameter`] for a reference that is not finite and positive.
pub(crate) fn restored(known: &KnownEffect, context: &Context) -> Result<Arc<Flow>, ModelError> {
    let flow = context.flow.as_ref().ok_or(ModelError::NeedsFlow)?;
    let kind = flow.kind();
    let other = if kind == FlowKind::Flow { FlowKind::Motion } else { FlowKind::Flow };
    match [kind, other].map(|kind| known.parameter(kind.reference_name())) {
        [None, Some(_)] => Err(ModelError::NeedsFlow),
        [None, None] => Ok(Arc::clone(flow)),
        [Some(reference), _] if reference.is_finite() && reference > 0.0 => {
            Ok(Arc::new(flow.as_ref().clone().relative_to(reference)))
        }
        [Some(got), _] => {
            let (effect, name, expected) = (known.effect.name(), kind.reference_name(), "a finite positive number");
            Err(ModelError::Parameter { effect, name, got, expected })
        }
    }
}
