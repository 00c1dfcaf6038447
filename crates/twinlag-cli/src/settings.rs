//! What the library's settings are called here.

use twinlag::Setting;
use twinlag::record::Setting as ReaderSetting;

/// The options for a setting of a verb.
pub(crate) fn options(setting: Setting) -> &'static [&'static str] {
    match setting {
        Setting::Channels => &["--t1", "--t2"],
        Setting::Flow => &["--flow", "--position"],
        Setting::Sampling => &["--sampling"],
        Setting::Estimator => &["--estimator"],
        Setting::Optimiser => &["--optimiser"],
        Setting::Hold => &["--hold"],
        Setting::Noise => &["--noise"],
        Setting::NoiseRatio => &["--noise-ratio"],
        Setting::QuietSegment => &["--quiet-segment"],
        Setting::NoiseColour => &["--noise-colour"],
        Setting::Free => &["--free"],
        Setting::SecondOrder => &["--second-order"],
        Setting::Known => &["--known"],
        Setting::Typical => &["--sensor"],
        Setting::Fluid => &["--fluid"],
        Setting::Discard => &["--discard"],
        Setting::Intervals => &["--intervals"],
        Setting::Replicates => &["--replicates"],
        Setting::Model => &["--model"],
        Setting::Window => &["--window"],
        Setting::Live => &["--live"],
        _ => &[],
    }
}

/// The option for a setting of the reader.
pub(crate) fn reader_option(setting: ReaderSetting) -> Option<&'static str> {
    Some(match setting {
        ReaderSetting::Time => "--time",
        ReaderSetting::TimeUnit => "--time-unit",
        ReaderSetting::T1 => "--t1",
        ReaderSetting::T2 => "--t2",
        ReaderSetting::Reference => "--reference",
        ReaderSetting::Flow => "--flow",
        ReaderSetting::Position => "--position",
        ReaderSetting::Period => "--period",
        ReaderSetting::Sampling => "--sampling",
        _ => return None,
    })
}

/// How a setting is tried, where the program can say that.
pub(crate) fn usage(setting: Setting) -> Option<&'static str> {
    Some(match setting {
        Setting::Free => "--free gain,offset",
        Setting::NoiseColour => "--noise-colour autoregressive",
        Setting::Known => "--known NAME=VALUE",
        Setting::SecondOrder => "--second-order (without this sensor)",
        _ => return None,
    })
}
