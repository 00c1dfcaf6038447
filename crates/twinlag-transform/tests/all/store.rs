//! The store of plans, compiled here from its file: it is no part of what the crate offers.

use std::sync::Arc;

#[path = "../../src/kept.rs"]
mod kept;

use kept::{KEPT_SAMPLES, Kept};

#[test]
fn a_plan_is_kept_until_newer_ones_fill_the_store() {
    let mut store: Kept<usize> = Kept(Vec::new());
    let mut made = 0;
    let mut ask = |samples: usize| {
        let mut is_new = false;
        let plan = store.get(samples, || {
            is_new = true;
            made += 1;
            Arc::new(samples)
        });
        assert_eq!(*plan, samples);
        is_new
    };
    assert!(ask(100) && ask(200) && !ask(100));
    // Beside this one there is room for 100 more samples: for the plan asked for last.
    assert!(ask(KEPT_SAMPLES - 150) && !ask(100) && ask(200));
    // One that is larger than the store is kept alone.
    assert!(ask(2 * KEPT_SAMPLES) && !ask(2 * KEPT_SAMPLES) && ask(100));
    assert_eq!(made, 6);
}
