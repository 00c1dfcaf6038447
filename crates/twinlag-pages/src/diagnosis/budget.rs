//! What the interval of each time constant consists of.

use twinlag::cross_relation::Z_975;
use twinlag::diagnosis::{Identifier, Limit};
use twinlag_report::{Document, Table, rounded};

use super::Page;
use crate::words::{ABSENT, listed, parameter_in_words, with_unit, words_of};

const NO_COVARIANCE: &str = "not known: nothing says how the parameters go together";

impl Page<'_> {
    /// The uncertainty budget: noise, parameters, hold, model error, calibration.
    pub(super) fn budget(&self, document: Document) -> Document {
        let last = &self.answer.last;
        if last.sensors.iter().all(|sensor| sensor.interval_95_s.is_none() || sensor.known) {
            return document;
        }
        let header = ["source".to_owned(), self.channels()[0].clone(), self.channels()[1].clone(), "how".to_owned()];
        let both = |of: &dyn Fn(usize) -> String| [of(0), of(1)];
        let row = |table: Table, name: &str, [one, two]: [String; 2], how: String| {
            table.row([name.to_owned(), one, two, how])
        };
        let seconds = |half_s: f64| with_unit(&format!("± {}", rounded(half_s, 2)), "s");
        let errors_s = |sensor: usize| {
            let fit = &self.core()?.last;
            // Of a number that is not given none of its parts is.
            last.sensors[sensor].interval_95_s.and(fit.standard_errors_s(sensor))
        };
        let is_known = (0..2).any(|sensor| errors_s(sensor).is_some());
        let mut table = Table::new(header);
        let noise = both(&|i| errors_s(i).map_or(ABSENT.into(), |[alone_s, _]| seconds(Z_975 * alone_s)));
        let how = if is_known { "as if all else were known" } else { NO_COVARIANCE };
        table = row(table, "noise of the readings", noise, how.into());
        let others = |i: usize| {
            errors_s(i).map_or(ABSENT.into(), |[alone_s, all_s]| {
                seconds(Z_975 * (all_s * all_s - alone_s * alone_s).max(0.0).sqrt())
            })
        };
        let how = "what is added since the other time constant, and the parameters of the effects, are found from the same readings";
        table = row(table, "other parameters", both(&others), if is_known { how } else { NO_COVARIANCE }.into());
        let model = |i: usize| {
            let sensor = &last.sensors[i];
            let (Some([low, high]), Some([_, all_s])) = (sensor.interval_95_s, errors_s(i)) else {
                return ABSENT.into();
            };
            let (whole_s, noise_s) = (0.5 * (high - low), Z_975 * all_s);
            // Ends of an interval that is a factor either way are not quite as far as those of a standard error.
            if whole_s < 1.05 * noise_s {
                "nothing".into()
            } else {
                seconds((whole_s * whole_s - noise_s * noise_s).sqrt())
            }
        };
        let mut covers: Vec<String> = Vec::new();
        for covered in last.sensors.iter().flat_map(|s| &s.judgement.interval_covers).map(ToString::to_string) {
            if !covers.contains(&covered) {
                covers.push(covered);
            }
        }
        let how = match covers.join("; ") {
            covers if !covers.is_empty() => covers,
            _ if self.answer.unexplained.is_some() => "what is left over is not covered: see the grades".into(),
            _ => "no test finds any, so the interval is that of noise".into(),
        };
        table = row(table, "model error", both(&model), how);
        let hold = last.hold_sensitivity.or(self.answer.base.hold_sensitivity);
        let of_hold = |i: usize| {
            let (Some(relative), Some(tau_s)) = (hold, last.sensors[i].time_constant_s) else {
                return "not counted".into();
            };
            with_unit(&rounded(relative[i].abs() * tau_s, 2), "s")
        };
        let how = match hold {
            Some(_) => "how far it moves if the gas does the other thing between samples; not in the interval".into(),
            None => format!(
                "the gas is taken to follow a {} between samples; twinlag characterise says what another way would do",
                words_of(&self.answer.last.hold)
            ),
        };
        table = row(table, "gas between samples (hold)", both(&of_hold), how);
        let (calibration, how) = self.calibration();
        table = row(table, "calibration of the channels", [calibration.clone(), calibration], how);
        let whole = |i: usize| {
            let sensor = &last.sensors[i];
            match sensor.interval_95_s {
                _ if sensor.known => "known beforehand".into(),
                Some([low, high]) => seconds(0.5 * (high - low)),
                None => ABSENT.into(),
            }
        };
        table = row(
            table,
            "the interval that is given, half its length",
            both(&whole),
            "in squares, the rows above that are numbers of it".into(),
        );
        document
            .heading("What the intervals consist of")
            .table(table.caption("Parts of the 95 % intervals of both time constants, each as if it were alone."))
    }

    /// Whether gains and offsets take part.
    fn calibration(&self) -> (String, String) {
        let found = self.answer.effects.iter().find(|e| e.effect == Identifier::CALIBRATION);
        if let Some(found) = found {
            let fitted: Vec<String> = found.parameters.iter().map(|p| parameter_in_words(&p.name)).collect();
            let how = format!("fitted, with the effect: {}", listed(&fitted));
            return ("among the other parameters".into(), how);
        }
        let limit = |l: &&Limit<String>| l.effect == Identifier::CALIBRATION;
        let how = self.answer.limits.iter().find(limit).map_or("taken to be equal".to_owned(), |limit| {
            let size = with_unit(&rounded(limit.size, 2), &limit.unit);
            format!(
                "taken to be equal: from {size} on, their {} would have been seen",
                limit.parameter.replace('_', " ")
            )
        });
        ("nothing".into(), how)
    }
}
