//! What the book's chapter says of a diagnosed record: a row of the table, a section, a picture.

use std::fmt::Write as _;

use anyhow::Result;
use twinlag::diagnosis::Grade;
use twinlag::{Diagnosis, EffectNumber};
use twinlag_pages::{residual_picture, unit_suffix};

/// Everything that is written of the records.
#[derive(Default)]
pub(super) struct Page {
    pub(super) table: String,
    pub(super) sections: String,
    /// Instruments, with several records each; empty where none were asked for.
    pub(super) campaigns: String,
    /// Names of files, and SVG.
    pub(super) pictures: Vec<(String, String)>,
}

impl Page {
    pub(super) fn new() -> Self {
        Self {
            table: "| record | channels | known | verdict | grades: T1, T2, difference | effects | held-out rms before | after |\n\
                    |---|---|---|---|---|---|---|---|\n"
                .into(),
            ..Self::default()
        }
    }

    /// Adds a record; its row of the table.
    pub(super) fn add(&mut self, file: &str, channels: [&str; 2], known: &str, answer: &Diagnosis) -> Result<&str> {
        let effects: Vec<String> = answer.effects.iter().map(|e| named(e, false)).collect();
        let effects = if effects.is_empty() { "none".to_owned() } else { effects.join(", ") };
        let verdict = serde_json::to_value(answer.verdict)?;
        let verdict = verdict.as_str().unwrap_or("?");
        let rms = answer.error.budget.held_out_normalised_rms;
        let from = self.table.len();
        let _ = writeln!(
            self.table,
            "| `{file}` | {}, {} | {known} | {verdict} | {} | {effects} | {:.2} | {:.2} |",
            channels[0],
            channels[1],
            answer.last.grades().map(|grade: Grade| grade.to_string()).join(", "),
            rms.before,
            rms.after
        );
        self.section(file, channels, known, verdict, answer)?;
        Ok(self.table[from..].trim_end())
    }

    fn section(
        &mut self,
        file: &str,
        [one, two]: [&str; 2],
        known: &str,
        verdict: &str,
        answer: &Diagnosis,
    ) -> Result<()> {
        let with = if known.is_empty() { String::new() } else { format!(", with `{known}`") };
        let mut lines = vec![format!("### `{file}`: {one} and {two}{with}"), String::new()];
        lines.push(format!("Verdict: **{verdict}**."));
        lines.push(String::new());
        for effect in &answer.effects {
            lines.push(format!("- {}", named(effect, true)));
        }
        for (name, fit) in [("two lags", &answer.base), ("with the effects", &answer.last)] {
            let sensors: Vec<String> = fit
                .sensors
                .iter()
                .map(|s| match (s.time_constant_s, s.interval_95_s) {
                    (Some(tau_s), Some([low, high])) if s.judgement.grade != Grade::NoGo => {
                        let ends = format!("[{}, {}]", number(low), number(high));
                        format!("{} {} s {ends} ({})", s.channel, number(tau_s), s.judgement.grade)
                    }
                    (Some(tau_s), None) => format!("{} {} s, known", s.channel, number(tau_s)),
                    _ => format!("{} not given ({})", s.channel, s.judgement.because),
                })
                .collect();
            lines.push(format!("- time constants, {name}: {}", sensors.join(", ")));
        }
        let error = &answer.error.budget;
        lines.push(format!(
            "- residual, rms on held-out blocks: {} before, {} after; energy per degree of freedom {} before, {} after; \
             rms difference of the inferred gas temperatures {} K before, {} K after",
            number(error.held_out_normalised_rms.before),
            number(error.held_out_normalised_rms.after),
            number(error.chi2_per_dof.before),
            number(error.chi2_per_dof.after),
            number(error.held_out_input_difference_k.before),
            number(error.held_out_input_difference_k.after),
        ));
        lines.push(match &answer.unexplained {
            Some(left) => format!("- unexplained: {}", left.description),
            None => "- no test finds more than noise in the residual".into(),
        });
        lines.push(String::new());
        if let Some(svg) = residual_picture(answer)? {
            let stem = |text: &str| text.replace(['/', '_', '.', '='], "-").to_lowercase();
            let name = format!(
                "{}-{}{}.svg",
                stem(file.trim_end_matches(".csv")),
                stem(two),
                if known.is_empty() { "" } else { "-known" }
            );
            lines.push(format!("![Power of the residual before and after](images/measured/{name})"));
            lines.push(String::new());
            self.pictures.push((name, svg));
        }
        self.sections.push_str(&lines.join("\n"));
        self.sections.push('\n');
        Ok(())
    }
}

/// An effect with its first parameters, `whole` with all and their intervals.
pub(super) fn named(effect: &twinlag::NamedEffect, whole: bool) -> String {
    let parameter = |p: &EffectNumber| {
        let name = p.name.replace('_', " ");
        let Some(value) = p.value.filter(|_| p.judgement.grade != Grade::NoGo) else {
            return format!("{name} not given");
        };
        match p.interval_95.filter(|_| whole) {
            Some([low, high]) => {
                let unit = unit_suffix(&p.unit);
                format!("{name} {} [{}, {}]{unit}", number(value), number(low), number(high))
            }
            None => format!("{name} {}", number(value)),
        }
    };
    let most = if whole { usize::MAX } else { 3 };
    let mut inside: Vec<String> = effect.parameters.iter().take(most).map(parameter).collect();
    inside.extend(effect.seen.clone().filter(|_| whole));
    if whole && !effect.alternatives.is_empty() {
        let others: Vec<&str> = effect.alternatives.iter().map(|a| a.name()).collect();
        inside.push(format!("equally well explained by {}", others.join(", ")));
    }
    let channel = effect.channel.as_ref().map_or(String::new(), |c| format!(" in {c}"));
    let inside = if inside.is_empty() { String::new() } else { format!(" ({})", inside.join(", ")) };
    format!("{}{channel}{inside}", effect.effect)
}

/// Four digits, with an exponent where it is small.
fn number(x: f64) -> String {
    if x != 0.0 && x.abs() < 1e-3 { format!("{x:.1e}") } else { format!("{x:.4}") }
}
