//! Records can be shared between threads and handed from one to another: it compiles, so it holds.

use twinlag_record::{
    Channels, Column, Grid, NamedColumn, Note, Record, RecordError, RowReader, Sampling, Selection, Stretch, Table,
    Unit,
};

const fn is_send_and_sync<T: Send + Sync>() {}

const _: () = {
    is_send_and_sync::<Channels>();
    is_send_and_sync::<Column>();
    is_send_and_sync::<Grid>();
    is_send_and_sync::<NamedColumn>();
    is_send_and_sync::<Note>();
    is_send_and_sync::<Record>();
    is_send_and_sync::<RecordError>();
    is_send_and_sync::<RowReader>();
    is_send_and_sync::<Sampling>();
    is_send_and_sync::<Selection>();
    is_send_and_sync::<Stretch>();
    is_send_and_sync::<Table>();
    is_send_and_sync::<Unit>();
};
