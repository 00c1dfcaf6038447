//! The question that a record is asked first: both time constants.

use twinlag_cross_relation::{Parameter, Readings, Segment, Steps};
use twinlag_record::{Record, SamplingKind};

use crate::characterisation::Characterisation;
use crate::error::Error;
use crate::options::{Estimator, Known, Options};
use crate::question::{Levels, Question};

/// Both time constants of `record`, with intervals, noise levels and residual tests.
///
/// # Errors
/// [`Error`] if the question cannot be put: options that contradict each other, an estimator that cannot take the record's
/// sampling, too few samples to tell noise from signal. A fit that ran is never an error: its [`Status`](crate::Status) says what it is
/// worth.
pub fn characterise(record: &Record, options: &Options) -> Result<Characterisation, Error> {
    check(options)?;
    let readings = readings(record, options)?;
    let levels = Levels::of(&readings, options)?;
    if options.calibrates() {
        Question::<4>::new(record, &readings, options, levels).answer()
    } else {
        Question::<2>::new(record, &readings, options, levels).answer()
    }
}

/// The channels of a record as the costs take them, cut where samples are missing.
///
/// The level taken off is the mean, or 0 °C where an offset is known or excluded: it is stated there.
///
/// # Errors
/// [`Error::Cost`] for a record without usable samples, which its constructors do not let through.
pub fn readings(record: &Record, options: &Options) -> Result<Readings, Error> {
    let segments = record.segments.iter().map(|rows| {
        let steps = match record.sampling.kind {
            SamplingKind::Irregular => Steps::Uneven(record.steps_s(rows)),
            _ => Steps::Even(record.sampling.period_s),
        };
        Segment::new(record.t1_c[rows.clone()].to_vec(), record.t2_c[rows.clone()].to_vec(), steps)
    });
    let segments = segments.collect::<Result<_, _>>()?;
    let offset_is_stated = !options.free_offset || options.known(Parameter::Offset).is_some();
    Ok(if options.calibrates() && offset_is_stated {
        Readings::about(segments, 0.0)?
    } else {
        Readings::new(segments)?
    })
}

fn check(options: &Options) -> Result<(), Error> {
    if options.estimator != Estimator::Whitened && options.known.iter().any(|k| k.std.is_some()) {
        return Err(Error::WhitenedOnly {
            what: "a known value with an uncertainty (--known NAME=VALUE+-SD)",
            estimator: options.estimator.name().into(),
        });
    }
    for (i, known) in options.known.iter().enumerate() {
        let name = Known::NAMES[Parameter::ALL.iter().position(|p| *p == known.parameter).unwrap_or(0)];
        let wrong = |expected: &str| Error::Option {
            option: "--known",
            expected: expected.into(),
            got: format!("{name}={}", known.value),
        };
        if options.known[..i].iter().any(|k| k.parameter == known.parameter) {
            return Err(wrong("each parameter once"));
        }
        let is_freed = match known.parameter {
            Parameter::Gain => options.free_gain,
            Parameter::Offset => options.free_offset,
            _ => false,
        };
        if known.std.is_none() && is_freed {
            return Err(wrong("a standard deviation (NAME=VALUE+-SD) for what --free lets float, or no --free"));
        }
    }
    let is_held = |p| options.known(p).is_some_and(|k| k.std.is_none());
    if is_held(Parameter::Tau1) && is_held(Parameter::Tau2) {
        return Err(Error::Option {
            option: "--known",
            expected: "at least one time constant to find: leave one out, or give it a standard deviation".into(),
            got: format!("{} and {}", Known::NAMES[0], Known::NAMES[1]),
        });
    }
    if let Some([a, b]) = options.noise_std_k
        && !(a.is_finite() && b.is_finite() && a > 0.0 && b > 0.0)
    {
        return Err(Error::Option {
            option: "--noise",
            expected: "two positive numbers, S1,S2 in K".into(),
            got: format!("{a},{b}"),
        });
    }
    Ok(())
}
