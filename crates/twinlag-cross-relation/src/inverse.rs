//! The difference of the two inferred gas temperatures as one short filter on each channel.
//!
//! A sensor obeys `A_i y_i = B_i x`. Multiplying sensor 1's equation by `B2` and sensor 2's by `B1`
//! removes `x`: `u = B2 A1 y1 − B1 A2 y2'`, `y2' = (y2 − o)/g`. A factor that `B1` and `B2` share
//! (the delay of the zero-order hold, the `1 + z⁻¹` of the bilinear rule) is left off, and both
//! filters are scaled to unit gain at rest, so that `u` is in kelvin of gas temperature: for
//! first-order sensors and those two holds it is `f1 − f2` of the theory,
//! `f_i[k] = (y_i[k+1] − a_i y_i[k])/(1 − a_i)`.
//!
//! Noise that is autoregressive, `Φ_i n_i = e_i`, is made white by multiplying the whole equation
//! by `Φ1 Φ2`: the channels pass `Φ1 Φ2` times their filter, and the white `e_1` passes `Φ2` times
//! it, `e_2` `Φ1`. What is left of the noise is a moving average again, exactly, without anything
//! to be known of the noise before the record.

use num_dual::{DualNum, DualSVec64};
use twinlag_sensor::Discretisation;

use crate::noise_model::HoldAndNoise;
use crate::parameters::Pair;
use crate::polynomial::Polynomial;

/// The filters of `u[k] = Σ_j d1[j] y1[k+j] − Σ_j d2[j] (y2[k+j] − o)`, the gain of channel 2
/// inside `d2`, and those that the white noise of each channel passes on its way into `u`. Oldest
/// sample first; both `data` filters are equally long.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row<D> {
    pub(crate) data: [Polynomial<D>; 2],
    pub(crate) noise: [Polynomial<D>; 2],
}

/// Whether there is a difference equation to invert.
pub(crate) fn has_inverse(hold: Discretisation) -> bool {
    hold != Discretisation::BandLimited
}

/// Whether each `u[k]` takes but two neighbouring samples of each channel, and noise is white: what
/// uneven steps and the sine transform need.
pub(crate) fn is_one_step<D>(model: &HoldAndNoise, pair: &Pair<D>) -> bool {
    matches!(model.hold, Discretisation::ZeroOrderHold | Discretisation::Bilinear)
        && pair.second_tau_s.iter().all(Option::is_none)
        && model.is_white()
}

/// The filters for samples `step_s` apart. The hold must have a difference equation.
pub(crate) fn row<const P: usize>(model: &HoldAndNoise, pair: &Pair<DualSVec64<P>>, step_s: f64) -> Row<DualSVec64<P>> {
    let sensors = [0, 1].map(|i| Sensor::new(model.hold, pair.tau_s[i], pair.second_tau_s[i], step_s));
    let [s1, s2] = sensors;
    // A bilinear second-order sensor has one factor 1 + z⁻¹ more than one of first order.
    let (mut b1, mut b2) = (s1.numerator, s2.numerator);
    if model.hold == Discretisation::Bilinear {
        let shared = usize::from(s1.is_second && s2.is_second);
        b1 = b1.without_sums(shared);
        b2 = b2.without_sums(shared);
    }
    // Each filter is scaled by its own sum: the sums are equal where the numerators are part of
    // them, and the scale of a one-step filter is that of its own sensor alone.
    let scaled = |sensor: &Sensor<DualSVec64<P>>, other: &Polynomial<_>| {
        sensor.denominator.times(other).scaled((sensor.at_rest * other.sum()).recip())
    };
    let white = [scaled(&s1, &b2), scaled(&s2, &b1)];
    let white = [white[0], white[1].scaled(pair.gain.recip())];
    if model.is_white() {
        return Row { data: white, noise: white };
    }
    let [phi1, phi2] = [0, 1].map(|i| Polynomial::oldest_first(model.whitener(i).map(DualSVec64::from_re)));
    let noise = [white[0].times(&phi2), white[1].times(&phi1)];
    Row { data: [noise[0].times(&phi1), noise[1].times(&phi2)], noise }
}

/// One sensor's difference equation, oldest sample first, the delay or one factor `1 + z⁻¹` taken
/// out of the numerator.
#[derive(Clone, Copy)]
struct Sensor<D> {
    numerator: Polynomial<D>,
    denominator: Polynomial<D>,
    /// The sum of the denominator, as that of the whole numerator, which equals it at unit gain: `1 − a` has lost the digits of `a` that
    /// `Ts/τ` is small by.
    at_rest: D,
    is_second: bool,
}

impl<D: DualNum<Primitive = f64> + Copy> Sensor<D> {
    fn new(hold: Discretisation, tau_s: D, second_tau_s: Option<D>, step_s: f64) -> Self {
        let known = "checked when the cost was built";
        let backwards = |c: &[D]| Polynomial::oldest_first(c.iter().copied());
        let Some(second) = second_tau_s else {
            let c = hold.first_order(tau_s, step_s).expect(known);
            let numerator = match hold {
                Discretisation::FirstOrderHold => backwards(&c.numerator),
                _ => backwards(&c.numerator[1..]),
            };
            let at_rest = c.numerator[0] + c.numerator[1];
            return Self { numerator, denominator: backwards(&c.denominator), at_rest, is_second: false };
        };
        let c = hold.second_order(tau_s, second, step_s).expect(known);
        let numerator = match hold {
            Discretisation::FirstOrderHold => backwards(&c.numerator),
            Discretisation::Bilinear => backwards(&[c.numerator[0], c.numerator[0]]),
            _ => backwards(&c.numerator[1..]),
        };
        let at_rest = c.numerator.iter().fold(D::from(0.0), |sum, part| sum + *part);
        Self { numerator, denominator: backwards(&c.denominator), at_rest, is_second: true }
    }
}
