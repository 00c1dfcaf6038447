//! An amplifier of one channel that warms up: its zero starts off by `A` and settles as `A exp(−t/T)`.

use std::sync::Arc;

use twinlag_model::{About, Context, DualNum, Effect, Identifier, Number, Parameter, Plant, Seat, Shared, Variable};

/// What is known of it before any record.
static ABOUT: About = About::new("warm-up", 20, candidates)
    .in_words(
        "the zero of one channel's amplifier settles after it is switched on",
        "switch the amplifier on half an hour before the record",
        "an amplifier that settles much more slowly than the record is long",
    )
    .imitating(&["drift", "calibration"]);

/// Its name in settings and answers.
pub(crate) const WARM_UP: Identifier = Identifier::of(&ABOUT);

struct WarmUp {
    seat: Seat,
    begin_s: f64,
    span_s: f64,
}

/// The effect as it may be added to a model of a record: in channel 2, against channel 1.
fn candidates(context: &Context) -> Vec<Shared> {
    let (span_s, swing_k) = (context.span_s(), context.swing_k);
    let start = Variable::linear("start", context.typical_k(1), -3.0 * swing_k, 3.0 * swing_k);
    let settling = Variable::logarithmic("settling time", 0.01 * span_s, span_s);
    let parameters = vec![Parameter::new("start", "K", start), Parameter::new("settling_time", "s", settling)];
    let seat = Seat::new(WARM_UP, Some(1), parameters);
    vec![Arc::new(WarmUp { seat, begin_s: context.ends_s[0], span_s })]
}

impl Effect for WarmUp {
    fn seat(&self) -> &Seat {
        &self.seat
    }

    /// From nothing, fast and slow.
    fn starts(&self) -> Vec<Vec<f64>> {
        [0.05, 0.3].into_iter().map(|share| vec![0.0, share * self.span_s]).collect()
    }

    fn install(&self, values: &[Number], plant: &mut Plant) {
        let (start_k, settling_s, begin_s) = (values[0], values[1], self.begin_s);
        let disturbance = move |time_s: f64| start_k * (settling_s.recip() * (begin_s - time_s)).exp();
        plant.sensors[1].reading.disturbances.push(Arc::new(disturbance));
    }

    /// It began when this record did: another record has its own.
    fn is_of_the_record(&self) -> bool {
        true
    }
}
