//! Plans that are kept for the next time.

use std::sync::Arc;

/// Samples of all plans of one direction that are kept; what was asked for longest ago goes first.
/// A plan holds some 20 bytes for each sample.
pub(crate) const KEPT_SAMPLES: usize = 1 << 21;

/// Plans by length, what was asked for last in front.
pub(crate) struct Kept<P: ?Sized>(pub(crate) Vec<(usize, Arc<P>)>);

impl<P: ?Sized> Kept<P> {
    /// The plan for `samples`, made by `plan` if it is not kept.
    pub(crate) fn get(&mut self, samples: usize, plan: impl FnOnce() -> Arc<P>) -> Arc<P> {
        if let Some(place) = self.0.iter().position(|(n, _)| *n == samples) {
            self.0[..=place].rotate_right(1);
        } else {
            self.0.insert(0, (samples, plan()));
            let mut sum = 0;
            let fits = self.0.iter().take_while(|(n, _)| {
                sum += n;
                sum <= KEPT_SAMPLES
            });
            let fits = fits.count().max(1);
            self.0.truncate(fits);
        }
        self.0[0].1.clone()
    }
}
