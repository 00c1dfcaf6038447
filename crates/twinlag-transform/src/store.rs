//! Plans that are kept, for all threads together.

use std::sync::{Arc, Mutex, PoisonError};

use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};

/// Samples of all plans of one direction that are kept; what was asked for longest ago goes first.
/// A plan holds some 20 bytes for each sample.
const KEPT_SAMPLES: usize = 1 << 22;

/// Plans by length, what was asked for last in front.
struct Store<P: ?Sized>(Vec<(usize, Arc<P>)>);

impl<P: ?Sized> Store<P> {
    fn get(&mut self, samples: usize, plan: impl FnOnce() -> Arc<P>) -> Arc<P> {
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

/// The plan to transform `samples` values. What panics while it plans leaves the store as it was: a
/// poisoned lock is no harm.
pub(crate) fn forward(samples: usize) -> Arc<dyn RealToComplex<f64>> {
    static KEPT: Mutex<Store<dyn RealToComplex<f64>>> = Mutex::new(Store(Vec::new()));
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    kept.get(samples, || RealFftPlanner::new().plan_fft_forward(samples))
}

/// The plan back to `samples` values.
pub(crate) fn inverse(samples: usize) -> Arc<dyn ComplexToReal<f64>> {
    static KEPT: Mutex<Store<dyn ComplexToReal<f64>>> = Mutex::new(Store(Vec::new()));
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    kept.get(samples, || RealFftPlanner::new().plan_fft_inverse(samples))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plan_is_kept_until_newer_ones_fill_the_store() {
        let mut store: Store<usize> = Store(Vec::new());
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
}
