//! Results can be shared between threads and handed from one to another: it compiles, so it holds.

use twinlag_study::{
    Forest, Header, Moments, Options, Outcome, Part, Progress, Quantity, Rate, Results, Shard, Sketch, StudyError,
    Tally, Values,
};

const fn is_send_and_sync<T: Send + Sync>() {}

const _: () = {
    is_send_and_sync::<Forest<Tally>>();
    is_send_and_sync::<Header>();
    is_send_and_sync::<Moments>();
    is_send_and_sync::<Options>();
    is_send_and_sync::<Outcome>();
    is_send_and_sync::<Part>();
    is_send_and_sync::<Progress>();
    is_send_and_sync::<Quantity>();
    is_send_and_sync::<Rate>();
    is_send_and_sync::<Results>();
    is_send_and_sync::<Shard>();
    is_send_and_sync::<Sketch>();
    is_send_and_sync::<StudyError>();
    is_send_and_sync::<Tally>();
    is_send_and_sync::<Values>();
};
