//! How much of a series a fast length leaves out.

use twinlag_transform::fast_length;

/// Of 1874 values the next fast length below is 1800.
#[test]
fn little_is_lost() {
    for n in 1000..40_000 {
        let fast = fast_length(n);
        assert!(fast <= n && 25 * (n - fast) < n, "{n}: {fast}");
    }
    assert_eq!([0, 1, 11, 13].map(fast_length), [0, 1, 10, 12]);
}
