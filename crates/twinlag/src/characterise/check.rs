//! Whether a question can be put as it stands: options that contradict each other, estimators that
//! cannot take what is asked.

use twinlag_cross_relation::{Parameter, Readings};
use twinlag_estimate::{Bootstrap, Estimator, Intervals, Known, NoiseColour};

use crate::error::Error;
use crate::options::Options;

/// What takes evenly spaced samples.
pub(super) fn check_sampling(readings: &Readings, options: &Options) -> Result<(), Error> {
    let wants = [
        (options.has_second_lag() != [false; 2], "--second-order"),
        (options.noise_colour == NoiseColour::Autoregressive, "--noise-colour autoregressive"),
        (matches!(options.intervals, Intervals::Bootstrap(_)), "--intervals bootstrap"),
    ];
    match wants.into_iter().find(|(is_asked, _)| *is_asked) {
        Some((_, option)) if readings.even_period_s().is_none() => Err(Error::Option {
            option,
            expected: "a record with evenly spaced samples; if the stamps are only ragged, --sampling uniform".into(),
            got: "uneven time stamps".into(),
        }),
        _ => Ok(()),
    }
}

/// Whether `options` go together.
pub(super) fn check(options: &Options) -> Result<(), Error> {
    check_noise(options)?;
    check_estimator(options)?;
    if options.estimator != Estimator::Whitened && options.known.iter().any(|k| k.std.is_some()) {
        return Err(Error::WhitenedOnly {
            what: "a known value with an uncertainty (--known NAME=VALUE+-SD)",
            estimator: options.estimator.name().into(),
        });
    }
    check_known(options)
}

/// Whether what is known of parameters goes together, and with what is fitted.
fn check_known(options: &Options) -> Result<(), Error> {
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
            Parameter::SecondTau1 => options.second_order[0],
            Parameter::SecondTau2 => options.second_order[1],
            Parameter::Tau1 | Parameter::Tau2 => false,
        };
        if known.std.is_none() && is_freed {
            let expected =
                "a standard deviation (NAME=VALUE+-SD) for what --free or --second-order lets float, or not both";
            return Err(wrong(expected));
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
    for (first, second) in [(Parameter::Tau1, Parameter::SecondTau1), (Parameter::Tau2, Parameter::SecondTau2)] {
        if let (Some(first), Some(second)) = (options.known(first), options.known(second))
            && second.value > first.value
        {
            return Err(Error::Option {
                option: "--known",
                expected: format!("a second time constant that is the smaller one, at most {}", first.value),
                got: second.value.to_string(),
            });
        }
    }
    Ok(())
}

/// Whether what is said of the noise goes together.
fn check_noise(options: &Options) -> Result<(), Error> {
    let wrong = |option, expected: &str, got: String| Err(Error::Option { option, expected: expected.into(), got });
    let is_sound = |s: f64| s.is_finite() && s > 0.0;
    if let Some([a, b]) = options.noise_std_k
        && !(is_sound(a) && is_sound(b))
    {
        return wrong("--noise", "two positive numbers, S1,S2 in K", format!("{a},{b}"));
    }
    if let Some(ratio) = options.noise_ratio {
        if !is_sound(ratio) {
            return wrong("--noise-ratio", "a positive number, S2/S1", ratio.to_string());
        }
        if options.noise_std_k.is_some() || !options.quiet_segments_s.is_empty() {
            let expected = "no --noise and no --quiet-segment beside it: levels have a ratio already";
            return wrong("--noise-ratio", expected, ratio.to_string());
        }
    }
    if options.noise_colour == NoiseColour::Autoregressive
        && (options.noise_std_k.is_some() || options.noise_ratio.is_some())
    {
        let expected =
            "white where --noise or --noise-ratio says what the noise is: colour and levels are found together";
        return wrong("--noise-colour", expected, "autoregressive".into());
    }
    for &[from_s, to_s] in &options.quiet_segments_s {
        if !(from_s.is_finite() && to_s.is_finite() && from_s < to_s) {
            return wrong("--quiet-segment", "FROM..TO in seconds, FROM the smaller", format!("{from_s}..{to_s}"));
        }
    }
    Ok(())
}

/// Whether the estimator can be asked this.
fn check_estimator(options: &Options) -> Result<(), Error> {
    let name = options.estimator.name();
    if options.estimator.is_closed_form() {
        let asked = [
            (options.free_gain || options.free_offset, "--free"),
            (options.has_second_lag() != [false; 2], "--second-order"),
            (!options.known.is_empty(), "--known"),
        ];
        if let Some((_, what)) = asked.into_iter().find(|(is_asked, _)| *is_asked) {
            return Err(Error::NotInClosedForm { what, estimator: name.into() });
        }
    }
    match options.intervals {
        Intervals::Profile if options.estimator != Estimator::Whitened => {
            Err(Error::WhitenedOnly { what: "--intervals profile", estimator: name.into() })
        }
        Intervals::Bootstrap(bootstrap) => {
            if bootstrap.replicates < Bootstrap::MIN_REPLICATES {
                return Err(Error::Option {
                    option: "--replicates",
                    expected: format!("at least {}", Bootstrap::MIN_REPLICATES),
                    got: bootstrap.replicates.to_string(),
                });
            }
            if options.calibrates() || !options.known.is_empty() {
                return Err(Error::Option {
                    option: "--intervals",
                    expected: "auto or profile with --free or --known, which the bootstrap does not simulate".into(),
                    got: "bootstrap".into(),
                });
            }
            Ok(())
        }
        _ => Ok(()),
    }
}
