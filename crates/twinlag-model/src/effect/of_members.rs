//! An effect that belongs to a record, in a model of several records of one rig: it has parameters of its own in each.

use std::ops::Range;
use std::sync::Arc;

use super::{Effect, Parameter, Seat, Shared};
use crate::directions::{Part, Parts};
use crate::number::{Number, TimeFunction};
use crate::plant::{Plant, TimeConstantChange};
use crate::records::Member;

/// One effect in each of several records.
struct OfMembers {
    /// The effect of each record.
    own: Vec<(Member, Shared)>,
    /// The first of the parameters of each, and their number at the end.
    first: Vec<usize>,
    seat: Seat,
}

/// The effect that has `own` parameters in each record: those of all, one after the other. `None` of no record.
fn joined(own: Vec<(Member, Shared)>) -> Option<Shared> {
    let seat = own.first()?.1.seat();
    let parameters: Vec<Parameter> = own.iter().flat_map(|(_, effect)| effect.parameters().iter().cloned()).collect();
    let seat = Seat::new(seat.identifier, seat.channel, parameters);
    let ends = own.iter().scan(0, |end, (_, effect)| {
        *end += effect.parameters().len();
        Some(*end)
    });
    let first = std::iter::once(0).chain(ends).collect();
    Some(Arc::new(OfMembers { own, first, seat }))
}

/// What stands for one of these candidates in every record: the one of its form.
///
/// - `of_member`: the candidates of each record
pub(crate) fn in_each(candidate: &Shared, of_member: &[(Member, Vec<Shared>)]) -> Option<Shared> {
    let is_alike = |other: &&Shared| {
        let names = |effect: &Shared| effect.parameters().iter().map(|p| p.name).collect::<Vec<_>>();
        other.channel() == candidate.channel() && names(other) == names(candidate)
    };
    let of = |(member, all): &(Member, Vec<Shared>)| Some((member.clone(), all.iter().find(is_alike)?.clone()));
    joined(of_member.iter().map(of).collect::<Option<Vec<_>>>()?)
}

impl OfMembers {
    /// The parameters of the record in place `place`.
    fn range(&self, place: usize) -> Range<usize> {
        self.first[place]..self.first[place + 1]
    }

    /// Each record's values.
    fn each<'a, T>(&'a self, values: &'a [T]) -> impl Iterator<Item = (&'a Member, &'a Shared, &'a [T])> {
        self.own.iter().enumerate().map(|(place, (member, own))| (member, own, &values[self.range(place)]))
    }

    /// Another form of the effect of each record.
    fn mapped(&self, form: impl Fn(usize, &Shared) -> Option<Shared>) -> Option<Shared> {
        let of = |(place, (member, own)): (usize, &(Member, Shared))| Some((member.clone(), form(place, own)?));
        joined(self.own.iter().enumerate().map(of).collect::<Option<Vec<_>>>()?)
    }
}

/// What `install` puts into the model acts while the record lasts: functions of time, and offsets, which become such functions.
fn install_within(member: &Member, plant: &mut Plant, install: impl FnOnce(&mut Plant)) {
    let before = plant
        .sensors
        .each_ref()
        .map(|sensor| (sensor.reading.offset_k, sensor.reading.disturbances.len(), sensor.changes.len()));
    install(plant);
    let [from_s, to_s] = member.ends_s;
    let within = |function: &TimeFunction| -> TimeFunction {
        let function = function.clone();
        Arc::new(move |time_s| if (from_s..=to_s).contains(&time_s) { function(time_s) } else { Number::from(0.0) })
    };
    for (sensor, (offset_k, disturbances, changes)) in plant.sensors.iter_mut().zip(before) {
        let own_k = sensor.reading.offset_k - offset_k;
        sensor.reading.offset_k = offset_k;
        if own_k.re != 0.0 || own_k.eps != 0.0 {
            sensor.reading.disturbances.push(Arc::new(move |_| own_k));
        }
        sensor.reading.disturbances[disturbances..].iter_mut().for_each(|function| *function = within(function));
        sensor.changes[changes..]
            .iter_mut()
            .for_each(|change| *change = TimeConstantChange::of_time(within(&change.at)));
    }
}

impl Effect for OfMembers {
    fn seat(&self) -> &Seat {
        &self.seat
    }

    fn starts(&self) -> Vec<Vec<f64>> {
        let starts: Vec<Vec<Vec<f64>>> = self.own.iter().map(|(_, own)| own.starts()).collect();
        let most = starts.iter().map(Vec::len).max().unwrap_or(0);
        (0..most).map(|i| starts.iter().flat_map(|of| of[i.min(of.len() - 1)].clone()).collect()).collect()
    }

    fn install(&self, values: &[Number], plant: &mut Plant) {
        for (member, own, values) in self.each(values) {
            install_within(member, plant, |plant| own.install(values, plant));
        }
    }

    /// Each part acts in one record at most.
    fn parts(&self, values: &[f64]) -> Option<Parts> {
        let (mut parts, mut of_parameters) = (Vec::new(), Vec::new());
        for (place, (member, own, own_values)) in self.each(values).enumerate() {
            let first = parts.len();
            let own_parts = own.parts(own_values).unwrap_or_else(|| by_parameter(own, own_values));
            for part in own_parts.parts {
                let (all, values) = (self.own.clone(), self.all_values(values));
                let install = move |plant: &mut Plant| {
                    for (other, (member, effect)) in all.iter().enumerate() {
                        install_within(member, plant, |plant| {
                            if other == place { (part.install)(plant) } else { effect.install(&values[other], plant) }
                        });
                    }
                };
                let [from_s, to_s] = part.support_s.unwrap_or(member.ends_s);
                let support_s = [from_s.max(member.ends_s[0]), to_s.min(member.ends_s[1])];
                parts.push(Part::new(Some(support_s), Arc::new(install)));
            }
            of_parameters.extend(
                own_parts.of_parameters.into_iter().map(|own| own.into_iter().map(|(k, w)| (first + k, w)).collect()),
            );
        }
        Some(Parts::new(parts, of_parameters))
    }

    fn main(&self) -> Option<usize> {
        None
    }

    fn sizes(&self) -> Vec<Shared> {
        let most = self.own.iter().map(|(_, own)| own.sizes().len()).max().unwrap_or(0);
        (0..most).filter_map(|size| self.mapped(|_, own| own.sizes().into_iter().nth(size))).collect()
    }

    fn extended(&self, values: &[f64]) -> Option<(Shared, Vec<f64>)> {
        let of = |place: usize| self.own[place].1.extended(&values[self.range(place)]);
        let starts: Vec<f64> =
            (0..self.own.len()).map(|place| Some(of(place)?.1)).collect::<Option<Vec<_>>>()?.concat();
        Some((self.mapped(|place, _| Some(of(place)?.0))?, starts))
    }

    fn is_of_the_record(&self) -> bool {
        true
    }

    fn prior(&self, values: &[Number]) -> Vec<Number> {
        self.each(values).flat_map(|(_, own, values)| own.prior(values)).collect()
    }

    fn record_of(&self, parameter: usize) -> Option<usize> {
        let place = self.first.partition_point(|first| *first <= parameter).checked_sub(1)?;
        Some(self.own.get(place)?.0.number)
    }

    fn in_record(&self, number: usize) -> Option<(Shared, Range<usize>)> {
        let place = self.own.iter().position(|(member, _)| member.number == number)?;
        Some((self.own[place].1.clone(), self.range(place)))
    }
}

impl OfMembers {
    /// Values of all records, without a derivative.
    fn all_values(&self, values: &[f64]) -> Vec<Vec<Number>> {
        self.each(values).map(|(_, _, own)| own.iter().copied().map(Number::from).collect()).collect()
    }
}

/// A part for each parameter of an effect.
fn by_parameter(effect: &Shared, values: &[f64]) -> Parts {
    let part = |parameter: usize| {
        let effect = effect.clone();
        let mut values: Vec<Number> = values.iter().copied().map(Number::from).collect();
        values[parameter].eps = 1.0;
        Part::new(None, Arc::new(move |plant: &mut Plant| effect.install(&values, plant)))
    };
    Parts::new((0..values.len()).map(part).collect(), (0..values.len()).map(|k| vec![(k, 1.0)]).collect())
}
