//! The inverse of a plant: from both channels' readings to the gas temperatures that they imply.

use crate::chain::{Along, Chain, Curves};
use crate::number::{Real, is_exactly};
use crate::observations::Stretch;
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
}

impl<T: Real> Inverse<T> {
    pub(crate) fn empty() -> Self {
        Self { chains: [Chain::empty(), Chain::empty()], gas: Chain::empty(), tau_s: Vec::new() }
    }

    /// Takes the readings of a stretch through the inverse of `plant`.
    pub(crate) fn invert(&mut self, plant: &Plant, stretch: &Stretch, period_s: Option<f64>) {
        let has_gas = plant.extra.iter().any(|e| e.place == Place::Gas);
        self.run(plant, stretch, period_s, has_gas);
    }

    /// Takes the readings of a stretch through the inverse of `plant`, and finds the path of noise of the gas as well.
    pub(crate) fn invert_with_gas(&mut self, plant: &Plant, stretch: &Stretch, period_s: Option<f64>) {
        self.run(plant, stretch, period_s, true);
    }

    fn run(&mut self, plant: &Plant, stretch: &Stretch, period_s: Option<f64>, has_gas: bool) {
        let Self { chains, gas, tau_s } = self;
        for (i, chain) in chains.iter_mut().enumerate() {
            chain.begin(stretch, i, period_s);
        }
        plant.correct(chains);
        // Of the gas's path nothing but the rows is of interest.
        if has_gas {
            gas.begin(stretch, 0, period_s);
        }
        if let Some(delay_s) = plant.delay_s {
            chains[0].advance(T::from(0.0), plant.reach);
            chains[1].advance(T::of(delay_s), plant.reach);
            if has_gas {
                gas.advance(T::from(0.0), plant.reach);
            }
        }
        let mut pass = |gas_tau_s: T| {
            if has_gas {
                gas.factor(Along::Same(gas_tau_s), Curves::default());
            }
        };
        for i in 0..2 {
            if let Some(second_tau_s) = plant.sensors[i].second_tau_s {
                chains[i].factor(Along::Same(T::of(second_tau_s)), Curves::default());
                chains[1 - i].factor(Along::Same(T::from(0.0)), Curves::default());
                pass(T::from(0.0));
            }
        }
        for (chain, sensor) in chains.iter_mut().zip(&plant.sensors) {
            lag(chain, sensor, tau_s);
        }
        pass(T::from(0.0));
        for i in 0..2 {
            if let Some(slow) = plant.sensors[i].slow {
                let direct_tau_s = T::of((-slow.share + 1.0) * slow.tau_s);
                chains[i].factor(Along::Same(T::of(slow.tau_s)), Curves::default());
                chains[1 - i].factor(Along::Same(direct_tau_s), Curves::default());
                pass(direct_tau_s);
            }
        }
    }

    /// Values of the disagreement.
    pub(crate) fn count(&self) -> usize {
        self.chains[0].len().min(self.chains[1].len())
    }

    /// `v[k+1] − ρ v[k]` of all that there is.
    pub(crate) fn difference(&mut self, rho: f64, has_gas: bool) {
        self.chains.iter_mut().for_each(|c| c.difference(rho));
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
    pub(crate) fn correct<T: Real>(&self, chains: &mut [Chain<T>; 2]) {
        self.take_off_crosstalk(chains);
        for (chain, sensor) in chains.iter_mut().zip(&self.sensors) {
            let reading = &sensor.reading;
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
fn lag<T: Real>(chain: &mut Chain<T>, sensor: &Sensor, along: &mut Vec<T>) {
    let curves = Curves { value: sensor.rest.as_ref(), slope: sensor.heat.as_ref() };
    if sensor.changes.is_empty() {
        return chain.factor(Along::Same(T::of(sensor.tau_s)), curves);
    }
    along.clear();
    along.extend((0..chain.after_factor()).map(|k| {
        let factor = sensor.tau_factor_at(chain.time_after_factor_s(k));
        T::of(sensor.tau_s * factor)
    }));
    chain.factor(Along::Each(along), curves);
}
