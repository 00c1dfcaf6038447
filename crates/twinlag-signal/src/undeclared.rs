//! Random rigs with an effect unknown to the reader of the record, for testing a diagnosis.
//!
//! [`undeclared`] draws sampling, gas, two first-order sensors and their noise, and puts the
//! effects asked for into one of the sensors, or into both where that is their nature. What was
//! drawn is known: [`Undeclared::kinds`], the [`rig`](Undeclared::rig) itself, and with it the true
//! gas temperature.
//!
//! | drawn | from |
//! |---|---|
//! | sample period | 0.5, 1, 2 or 5 ms |
//! | samples | 9000 to 18 000 |
//! | fast time constant | 10 to 32 sample periods |
//! | slow time constant | 3.5 to 6.5 times the fast one; either sensor may be the slow one |
//! | gas | mean 150 to 650 °C, standard deviation over the record 15 to 30 K |
//! | characteristic frequency of the gas | 0.07 to 0.2 over the fast time constant |
//! | noise of each channel, white | 0.2 to 3 % of the gas's standard deviation |
//!
//! One seed gives one such rig, whatever the effect: `undeclared(&[Kind::None], ..)` is the same
//! rig without it, in the same gas and the same white noise.
//!
//! The sizes, each log-uniform within its range and then multiplied by the size factor (`scale` is
//! the gas's standard deviation, `noise` that of the channel, `τ` the sensor's time constant):
//!
//! | kind | size | range |
//! |---|---|---|
//! | [`Gain`](Kind::Gain) | gain less 1 | −0.02 to −0.01 or 0.01 to 0.05 |
//! | [`Offset`](Kind::Offset) | offset, K | 1 to 4, either sign |
//! | [`Curvature`](Kind::Curvature) | curvature about the gas's mean, 1/K | such that it adds 0.5 to 2 % of the scale, either sign |
//! | [`SecondOrder`](Kind::SecondOrder) | second time constant, s | 0.1 to 0.4 τ |
//! | [`SlowMode`](Kind::SlowMode) | fraction | 0.03 to 0.12, with 3 to 15 slow time constants |
//! | [`Delay`](Kind::Delay) | delay, s | 0.1 to 0.3 fast time constants |
//! | [`VaryingTimeConstant`](Kind::VaryingTimeConstant) | depth | 0.15 to 0.35, in a period of 0.4 to 1.2 records |
//! | [`TemperatureDependentTimeConstant`](Kind::TemperatureDependentTimeConstant) | exponent | such that τ changes by 10 to 30 % over four standard deviations of the gas, either sign |
//! | [`Radiation`](Kind::Radiation) | coefficient `k`, 1/K³ | such that `4 k T³` is 0.02 to 1.5 in the mean gas; the wall is 50 to 150 K colder |
//! | [`Drift`](Kind::Drift) | drift, K/s | 1 to 4 K over the record, either sign |
//! | [`MainsPickup`](Kind::MainsPickup) | amplitude, K | 1 to 3 noise, at 50 or 60 Hz, or 150 or 180 Hz in fast gas |
//! | [`ColouredNoise`](Kind::ColouredNoise) | standard deviation, K | 1 to 3 noise, correlated over 5 to 30 samples |
//! | [`InputMismatch`](Kind::InputMismatch) | standard deviation, K | 1 to 4 % of the scale, with a corner at 1 to 3 characteristic frequencies |
//! | [`Spikes`](Kind::Spikes) | mean height, K | 10 to 40 noise, in 0.2 to 1 % of the samples |
//! | [`Quantisation`](Kind::Quantisation) | step, K | 2 to 6 noise |
//! | [`Saturation`](Kind::Saturation) | part of the record beyond the limit | 0.03 to 0.1, hottest or coldest |
//! | [`Crosstalk`](Kind::Crosstalk) | part of the other channel | 0.02 to 0.06 |
//! | [`FilmTemperature`](Kind::FilmTemperature) | exponent | as of one sensor's own temperature, for both |
//! | [`Separation`](Kind::Separation) | distance, m | 0.1 to 0.3 fast time constants of the mean stream |
//! | [`OneSidedFlow`](Kind::OneSidedFlow) | exponent of the velocity | −0.7 to −0.2 |
//! | [`Hysteresis`](Kind::Hysteresis) | width, K | 3 to 10 % of the scale |
//! | [`IntermittentContact`](Kind::IntermittentContact) | part lost of the reading above 25 °C | 0.03 to 0.1, in 5 to 20 episodes of 0.3 to 1.5 % of the record |
//! | [`ClockSlip`](Kind::ClockSlip) | slip, s | 0.2 to 0.6 fast time constants, at 30 to 70 % of the record |
//! | [`Replaced`](Kind::Replaced) | new time constant over the old | 1.4 to 2 or the inverse (the excess over 1 is multiplied), at 30 to 70 % of the record |
//!
//! The [stream](crate::Stream) of `IdleStream`, `Separation` and `OneSidedFlow` has a mean velocity of
//! 0.3 to 30 m/s, changing by 20 to 50 % in a period of 0.1 to 1 records.
//!
//! # Example
//!
//! ```
//! use twinlag_signal::undeclared::{Kind, undeclared};
//!
//! let drawn = undeclared(&[Kind::Delay], 1.0, None, 7)?;
//! let record = drawn.simulate()?;
//! assert_eq!(record.t1_c.len(), record.gas_c.len());
//! assert_eq!(drawn.effects(), ["delay"]);
//! # Ok::<(), twinlag_signal::SignalError>(())
//! ```

mod base;
mod draw;
mod kind;
mod place;

use serde::Serialize;

use crate::check::positive;
use crate::streams::{Purpose, stream};
use crate::{Rig, SignalError, Simulated};
use base::Base;
use place::Draft;

pub use kind::{GasKind, Kind};

/// A random rig and what is in it.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Undeclared {
    /// The rig, valid and ready to simulate.
    pub rig: Rig,
    /// The kinds asked for, in that order.
    pub kinds: Vec<Kind>,
    /// The sensor that has the first of them: 0 or 1; none if both have it, or if there is none.
    pub channel: Option<usize>,
    /// Size of the first of them, in [`Kind::unit`]; the table of [the module](self) says of what.
    /// 0 if there is none.
    pub size: f64,
    /// Every one of them, in the order of `kinds`.
    pub placed: Vec<Placed>,
    /// Kind of the gas.
    pub gas: GasKind,
    /// Standard deviation of the gas over the record, K.
    pub scale_k: f64,
    /// Characteristic frequency of the gas, Hz.
    pub frequency_hz: f64,
}

/// One effect of a random rig.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Placed {
    /// What it is.
    pub kind: Kind,
    /// The sensor that has it, 0 or 1; none if both have it.
    pub channel: Option<usize>,
    /// Its size, in [`Kind::unit`].
    pub size: f64,
}

impl Undeclared {
    /// Trial 0 of the rig.
    ///
    /// # Errors
    /// As [`Rig::simulate`]; no error is expected at a size factor of about 1.
    pub fn simulate(&self) -> Result<Simulated, SignalError> {
        self.rig.simulate()
    }

    /// What a library of effects calls those that are in the rig ([`Kind::effect`]), each once, in
    /// the order of [`Undeclared::kinds`].
    pub fn effects(&self) -> Vec<&'static str> {
        let mut effects: Vec<&'static str> = Vec::new();
        for effect in self.kinds.iter().filter_map(|kind| kind.effect()) {
            if !effects.contains(&effect) {
                effects.push(effect);
            }
        }
        effects
    }
}

/// A random rig with the given effects; the tables of [the module](self) say what is drawn.
///
/// - `kinds`: what it has; a kind named twice counts once, [`Kind::None`] and an empty list are no
///   effect
/// - `size_factor`: multiplies every size, positive; sizes that would have no meaning (a fraction
///   above 1, a lag too short to integrate) stay at the limit
/// - `gas`: the kind of gas, drawn if none
/// - `seed`: the same seed gives the same rig and record; its highest bit is ignored
///
/// # Errors
/// [`SignalError::NotPositive`], if the size factor is not finite and positive. Anything that
/// [`Rig::new`] refuses, at size factors far above 1.
pub fn undeclared(
    kinds: &[Kind],
    size_factor: f64,
    gas: Option<GasKind>,
    seed: u64,
) -> Result<Undeclared, SignalError> {
    positive("undeclared", "size_factor", size_factor)?;
    // TOML has no whole numbers above.
    let rig_seed = seed & (u64::MAX >> 1);
    let base = Base::draw(gas, rig_seed, &mut stream(rig_seed, 0, Purpose::RandomRig))?;
    let (gas, scale_k, frequency_hz) = (base.gas_kind, base.scale_k, base.frequency_hz);
    let mut draft = Draft { base, flow: None, stream: None, mismatch: None, rig_seed };

    let mut wanted: Vec<Kind> = Vec::new();
    for &kind in kinds {
        if !wanted.contains(&kind) {
            wanted.push(kind);
        }
    }
    let mut order = wanted.clone();
    order.sort_by_key(|&kind| kind == Kind::Saturation); // stable: it comes last, and the others stay in order
    let mut placed = Vec::with_capacity(order.len());
    for kind in order {
        // A stream for each kind: what one draws does not depend on the others.
        let mut rng = stream(rig_seed, 1 + kind as u64, Purpose::RandomRig);
        placed.push(draft.place(kind, size_factor, &mut rng)?);
    }
    placed.sort_by_key(|effect| wanted.iter().position(|&kind| kind == effect.kind));
    let (channel, size) = placed.first().map_or((None, 0.0), |first| (first.channel, first.size));
    Ok(Undeclared { rig: draft.rig()?, kinds: wanted, channel, size, placed, gas, scale_k, frequency_hz })
}
