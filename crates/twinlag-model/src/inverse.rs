//! The inverse of a plant: from both channels' readings to the gas temperatures that they imply.

use crate::chain::{Along, Chain, Curves, Delay};
use crate::number::{Number, Real, is_exactly};
use crate::observations::Cut;
use crate::plant::{Place, Plant, Sensor};
use crate::rows::Rows;

/// Both inferred gas temperatures of a stretch with what carries the noise, in memory that is used again.
#[derive(Clone, Debug)]
pub(crate) struct Inverse<T> {
    pub(crate) chains: [Chain<T>; 2],
    /// The path of noise of the gas: the factors that both sensors have.
    pub(crate) gas: Chain<T>,
    /// Time constants along the record.
    tau_s: Vec<T>,
    /// Which of the chains are computed: of one that a parameter does not move the derivative is zero.
    pub(crate) has: [bool; 2],
}

impl<T: Real> Inverse<T> {
    pub(crate) fn empty() -> Self {
        Self { chains: [Chain::empty(), Chain::empty()], gas: Chain::empty(), tau_s: Vec::new(), has: [true; 2] }
    }

    /// Takes readings through the inverse of `plant`.
    pub(crate) fn invert(&mut self, plant: &Plant, cut: Cut<'_>, period_s: Option<f64>) {
        let has_gas = plant.extra.iter().any(|e| e.place == Place::Gas);
        self.run(plant, cut, period_s, has_gas);
    }

    /// Takes readings through the inverse of `plant`, in those of the chains that a parameter moves.
    pub(crate) fn invert_moved(&mut self, plant: &Plant, cut: Cut<'_>, period_s: Option<f64>, moved: [bool; 2]) {
        self.has = moved;
        self.invert(plant, cut, period_s);
    }

    /// Takes readings through the inverse of `plant`, and finds the path of noise of the gas as well.
    pub(crate) fn invert_with_gas(&mut self, plant: &Plant, cut: Cut<'_>, period_s: Option<f64>) {
        self.run(plant, cut, period_s, true);
    }

    fn run(&mut self, plant: &Plant, cut: Cut<'_>, period_s: Option<f64>, has_gas: bool) {
        let Self { chains, gas, tau_s, has } = self;
        for (i, chain) in chains.iter_mut().enumerate().filter(|(i, _)| has[*i]) {
            chain.begin(cut, i, period_s);
        }
        plant.correct(chains, *has);
        // Of the gas's path nothing but the rows is of interest.
        if has_gas {
            gas.begin(cut, 0, period_s);
        }
        if plant.has_delay() {
            let at_once = |chain: &mut Chain<T>| chain.advance(Delay::Same(T::from(0.0)), plant.reach);
            if has[0] {
                at_once(&mut chains[0]);
            }
            if has[1] {
                let at = |time_s| T::of(plant.delay_at(time_s));
                let (ends_s, middle_s) = (plant.delays_s(), cut.middle_s());
                let is_same = !plant.changes_delay_around(middle_s);
                let delay = if is_same { Delay::Same(at(middle_s)) } else { Delay::Each { at: &at, ends_s } };
                chains[1].advance(delay, plant.reach);
            }
            if has_gas {
                at_once(gas);
            }
        }
        let mut pass = |gas_tau_s: T| {
            if has_gas {
                gas.factor(Along::Same(gas_tau_s), Curves::default());
            }
        };
        for i in 0..2 {
            if let Some(second_tau_s) = plant.sensors[i].second_tau_s {
                let taus_s = [(i, T::of(second_tau_s)), (1 - i, T::from(0.0))];
                for (j, tau_s) in taus_s.into_iter().filter(|(j, _)| has[*j]) {
                    chains[j].factor(Along::Same(tau_s), Curves::default());
                }
                pass(T::from(0.0));
            }
        }
        for i in (0..2).filter(|i| has[*i]) {
            lag(&mut chains[i], plant, i, cut.middle_s(), tau_s);
        }
        pass(T::from(0.0));
        for i in 0..2 {
            if let Some(slow) = plant.sensors[i].slow {
                let direct_tau_s = T::of((-slow.share + 1.0) * slow.tau_s);
                let taus_s = [(i, T::of(slow.tau_s)), (1 - i, direct_tau_s)];
                for (j, tau_s) in taus_s.into_iter().filter(|(j, _)| has[*j]) {
                    chains[j].factor(Along::Same(tau_s), Curves::default());
                }
                pass(direct_tau_s);
            }
        }
    }

    /// Values of the disagreement.
    pub(crate) fn count(&self) -> usize {
        // Both have as many.
        self.chains[usize::from(!self.has[0])].len()
    }

    /// `v[k+1] − ρ v[k]` of all that there is.
    pub(crate) fn difference(&mut self, rho: f64, has_gas: bool) {
        for i in (0..2).filter(|i| self.has[*i]) {
            self.chains[i].difference(rho);
        }
        if has_gas {
            self.gas.difference(rho);
        }
    }

    /// The rows by which noise of a reading enters `x₁ − x₂`: through its own chain, and through crosstalk as well.
    pub(crate) fn disagreement_rows(&self, plant: &Plant, channel: usize, out: &mut Rows<T>) {
        let [one, two] = [&self.chains[0].rows, &self.chains[1].rows];
        let shares = [0, 1].map(|i| T::of(plant.sensors[i].reading.crosstalk));
        // x₁ − x₂ = B₁ (y₁ − ε₁ y₂) − B₂ (y₂ − ε₂ y₁).
        let (own, other, share) = if channel == 0 { (one, two, shares[1]) } else { (two, one, shares[0]) };
        if is_exactly(share.number(), 0.0) {
            out.copy(own);
        } else {
            out.sum(own, other, share, self.count());
        }
        if channel == 1 {
            out.scale(T::from(-1.0));
        }
    }
}

impl Plant {
    /// Takes off what is added to, and done to, the sensors' temperatures.
    ///
    /// - `has`: which of the chains there are; both with crosstalk
    pub(crate) fn correct<T: Real>(&self, chains: &mut [Chain<T>; 2], has: [bool; 2]) {
        self.take_off_crosstalk(chains);
        for i in (0..2).filter(|i| has[*i]) {
            let (chain, reading) = (&mut chains[i], &self.sensors[i].reading);
            let offset_k = T::of(reading.offset_k);
            if !is_exactly(reading.offset_k, 0.0) || !reading.disturbances.is_empty() {
                chain.add(|t| -(offset_k + T::of(reading.disturbance_at(t))));
            }
            if !is_exactly(reading.gain, 1.0) {
                chain.scale(T::of(reading.gain).recip());
            }
            if let Some(curve) = &reading.straighten {
                chain.map(curve);
            }
        }
    }

    /// Whether [`Self::correct`] leaves readings as they are.
    pub(crate) fn leaves_readings(&self) -> bool {
        self.sensors.iter().all(|sensor| {
            let reading = &sensor.reading;
            is_exactly(reading.crosstalk, 0.0)
                && is_exactly(reading.offset_k, 0.0)
                && is_exactly(reading.gain, 1.0)
                && reading.disturbances.is_empty()
                && reading.straighten.is_none()
        })
    }

    /// Which of the chains have a derivative.
    ///
    /// - `functions`: in which of the sensors functions may have one
    pub(crate) fn moved(&self, functions: [bool; 2]) -> [bool; 2] {
        let moves = |number: Number| number.eps != 0.0;
        let has_crosstalk = self.sensors.iter().any(|s| !is_exactly(s.reading.crosstalk, 0.0));
        let slow_moves = |s: &Sensor| s.slow.is_some_and(|slow| moves(slow.share) || moves(slow.tau_s));
        let own = [0, 1].map(|i| {
            let sensor = &self.sensors[i];
            let numbers = [sensor.reading.gain, sensor.reading.offset_k, sensor.tau_s];
            let apart = self.separation.as_ref().map(|separation| separation.delay_s);
            let later = self.delay_s.into_iter().chain(apart).filter(|_| i == 1);
            functions[i] || numbers.into_iter().chain(sensor.second_tau_s).chain(later).any(moves)
        });
        // A slow path of one sensor is a factor of the other's chain as well.
        let is_shared = has_crosstalk || self.sensors.iter().any(slow_moves);
        own.map(|moves| moves || is_shared)
    }

    /// `y₁ − ε₁ (y₂ − m₁)` and `y₂ − ε₂ (y₁ − m₂)`, with the channels as they were read.
    fn take_off_crosstalk<T: Real>(&self, chains: &mut [Chain<T>; 2]) {
        let readings = [0, 1].map(|i| &self.sensors[i].reading);
        if readings.iter().all(|r| is_exactly(r.crosstalk, 0.0)) {
            return;
        }
        let shares = readings.map(|r| T::of(r.crosstalk));
        let abouts_c = readings.map(|r| r.crosstalk_about_c);
        let [one, two] = chains;
        for (a, b) in one.value.iter_mut().zip(&mut two.value) {
            let (first, second) = (*a, *b);
            *a = first - shares[0] * (second - abouts_c[0]);
            *b = second - shares[1] * (first - abouts_c[1]);
        }
    }
}

/// The first-order factor of a sensor.
///
/// - `middle_s`: the instant in the middle of the stretch
fn lag<T: Real>(chain: &mut Chain<T>, plant: &Plant, channel: usize, middle_s: f64, along: &mut Vec<T>) {
    let sensor = &plant.sensors[channel];
    let curves = Curves { value: sensor.rest.as_ref(), slope: sensor.heat.as_ref() };
    let tau_at = |time_s: f64| T::of(sensor.tau_s * plant.tau_factor_at(channel, time_s));
    if !plant.changes_tau_around(channel, middle_s) {
        return chain.factor(Along::Same(tau_at(middle_s)), curves);
    }
    along.clear();
    along.extend((0..chain.after_factor()).map(|k| tau_at(chain.time_after_factor_s(k))));
    chain.factor(Along::Each(along), curves);
}
