//! `twinlag track - --live ROWS --out -`: rows are processed as they arrive.

mod alarms;
mod kept;
mod lines;
mod out;

use std::path::Path;

use twinlag::record::{Record, RowReader};
use twinlag::{Live, LiveOptions, SensorEstimate};

use self::alarms::{Alarms, Bad, Row, to_nanosecond};
use self::kept::{Keeper, Kept, Rows};
use self::lines::Lines;
use self::out::{Out, Written};
use crate::arguments::Track;
use crate::characterise::model;
use crate::console::Console;
use crate::failure::Failure;
use crate::grades;
use crate::output::{self, Views};
use crate::print;

pub(crate) fn run(command: &Track, rows: usize, console: Console) -> Result<u8, Failure> {
    if console.json {
        return Err(Failure::Usage(
            "--live writes rows and --json writes one object at the end: leave out one of them".into(),
        ));
    }
    if let Some(change) = command.change.filter(|c| !(c.is_finite() && *c > 0.0)) {
        return Err(Failure::Usage(format!("--change {change}: expected a fraction above 0, for example 0.1")));
    }
    let kept = command.state.as_deref().map(Kept::read).transpose()?.flatten();
    let to_stdout = check(command, kept.as_ref(), console)?;
    let mut run = match kept {
        Some(Kept { output, rows: Some(rows) }) => Run::resumed(command, to_stdout, output.as_ref(), rows, console)?,
        _ => Run::started(command, rows, to_stdout, console)?,
    };
    let starts = [0, 1].map(|i| run.live.start.sensors[i].judgement.grade);
    let code = grades::exit_code(&starts, &[], false, command.input.method.strict);
    let followed = run.follow(console);
    let kept = run.keep();
    followed.and(kept).map(|()| code)
}

/// Checks the outputs: a file that rows were written to before may be there, and so may the state. Returns whether rows go to standard
/// output.
fn check(command: &Track, kept: Option<&Kept>, console: Console) -> Result<bool, Failure> {
    let Track { input, model, out, state, .. } = command;
    let both = [("--out", Some(out.as_path()).filter(|out| *out != Path::new("-"))), ("--state", state.as_deref())];
    let both: Vec<_> = both.into_iter().filter_map(|(option, path)| Some((option, path?))).collect();
    output::check(&input.file, &both, true)?;
    let goes_on = kept.and_then(|kept| kept.output.as_ref()).is_some_and(|written| output::is_same(&written.file, out));
    let force = command.force || goes_on;
    output::check_data(&input.file, model.as_deref(), out, &Views::default(), force, console)
}

/// Rows on their way from the input to the output.
struct Run<'a> {
    lines: Lines,
    reader: RowReader,
    live: Live,
    out: Out,
    keeper: Option<Keeper<'a>>,
    /// Time of the last row, s.
    last_s: f64,
    bad: Bad,
    alarms: Alarms,
}

impl<'a> Run<'a> {
    /// Learns from so many rows, and puts out what is known at each of them.
    fn started(command: &'a Track, rows: usize, to_stdout: bool, console: Console) -> Result<Self, Failure> {
        let options = LiveOptions {
            characterise: command.input.method.options()?,
            model: command.model.as_deref().map(model).transpose()?,
            change_per_root_s: command.change,
        };
        let selection = command.input.columns.profile()?.selection;
        let mut lines = Lines::open(&command.input.file, command.state.is_some())?;
        let table = lines.start(rows)?;
        let record = Record::from_table(&table, &selection)?;
        print::notes(&record, console);
        let reader = RowReader::after(&table, &selection)?;
        let mut live = Live::start(&record, &options)?;
        let starts = [0, 1].map(|i| live.start.sensors[i].judgement.grade);
        let marked = command.input.method.best_effort().then(|| starts.into_iter().max()).flatten();
        let mut keeper = command.state.as_deref().map(Keeper::of);
        if let Some(keeper) = &mut keeper {
            // A run that is killed before it has a state may leave rows, which the next one may replace.
            let output = (!to_stdout).then(|| Written::nothing_to(&command.out)).transpose()?;
            keeper.keep(&Kept { output, rows: None })?;
        }
        let mut out = Out::open(&command.out, to_stdout, marked)?;
        if let Some(caution) = print::caution(&live.start) {
            console.note(|| caution);
        }
        console.note(|| started(&live));
        for warning in &live.start.warnings {
            console.note(|| format!("warning: {warning}"));
        }
        let missing = |c: f64| c.is_finite().then_some(c);
        for k in 0..record.len() {
            let reading_c = [missing(record.t1_c[k]), missing(record.t2_c[k])];
            out.answer(live.push(Some(record.time_s[k]), reading_c))?;
        }
        let last_s = record.time_s.last().copied().unwrap_or(0.0);
        Ok(Self { lines, reader, live, out, keeper, last_s, bad: Bad::default(), alarms: Alarms::default() })
    }

    /// Goes on from where an earlier run was.
    ///
    /// - `written`: the file that it wrote
    fn resumed(
        command: &'a Track,
        to_stdout: bool,
        written: Option<&Written>,
        rows: Rows,
        console: Console,
    ) -> Result<Self, Failure> {
        let Rows { live, reader, input, grade, last_s } = rows;
        let lines = Lines::open(&command.input.file, true)?.behind(&input)?;
        let reader = reader.of_source(lines.name());
        let live = Live::resume(live)?;
        let same = written.filter(|written| output::is_same(&written.file, &command.out));
        let out = match same {
            // Rows of this file come again, those of a pipe do not.
            Some(written) => Out::behind(written, lines.goes_on_from(&input), grade)?,
            None => Out::open(&command.out, to_stdout, grade)?,
        };
        console.note(|| resumed(&live, command.state.as_deref(), last_s));
        let keeper = command.state.as_deref().map(Keeper::of);
        Ok(Self { lines, reader, live, out, keeper, last_s, bad: Bad::default(), alarms: Alarms::default() })
    }

    /// Answers rows until there are no more, or nobody reads the answers.
    fn follow(&mut self, console: Console) -> Result<(), Failure> {
        // What was read so far is out before the next row is waited for.
        while self.out.flush()? {
            if self.keeper.as_ref().is_some_and(Keeper::is_due) {
                self.keep()?;
            }
            let Some((line, text)) = self.lines.next()? else { break };
            self.row(line, &text, console)?;
        }
        self.bad.sum(console);
        Ok(())
    }

    fn row(&mut self, line: usize, text: &str, console: Console) -> Result<(), Failure> {
        let (time_s, reading_c) = match self.reader.read(text, line) {
            Ok(None) => return Ok(()),
            Ok(Some(row)) => (row.time_s, row.reading_c),
            Err(error) => {
                self.bad.say(&error, console);
                (None, [None, None])
            }
        };
        let answer = self.live.push(time_s, reading_c);
        match &answer {
            None => {
                let [before, now] = [self.last_s, time_s.unwrap_or(self.last_s)].map(to_nanosecond);
                self.bad.say(
                    &format!(
                        "{}: line {line}: expected a time shortly after that of the previous row, {before} s from the \
                         start, got {now} s ('{}'); this row is left out",
                        self.lines.name(),
                        text.trim_end()
                    ),
                    console,
                );
            }
            Some(now) => {
                let channels = self.live.start.sensors.each_ref().map(|sensor| sensor.channel.as_str());
                let is_read = reading_c.map(|reading_c| reading_c.is_some());
                self.alarms.say(&Row { now, last_s: self.last_s, line, channels, is_read }, console);
                self.last_s = now.time_s;
            }
        }
        self.out.answer(answer)?;
        Ok(())
    }

    /// Writes what another run can go on from, where that is asked for.
    fn keep(&mut self) -> Result<(), Failure> {
        let Some(keeper) = &mut self.keeper else { return Ok(()) };
        let output = self.out.written()?;
        let (live, reader, input) = (self.live.state(), self.reader.clone(), self.lines.position().clone());
        let rows = Rows { live, reader, input, grade: self.out.grade(), last_s: self.last_s };
        keeper.keep(&Kept { output, rows: Some(rows) })
    }
}

fn started(live: &Live) -> String {
    format!("started:\n{}rows are now processed as they arrive", sensors(live))
}

fn resumed(live: &Live, state: Option<&Path>, last_s: f64) -> String {
    let state = state.unwrap_or(Path::new("")).display();
    format!(
        "resumed at {} s, as {state} has it; options of the start are not used again:\n{}rows are now processed as they arrive",
        to_nanosecond(last_s),
        sensors(live)
    )
}

/// Both time constants of the start.
fn sensors(live: &Live) -> String {
    let line =
        |sensor: &SensorEstimate| format!("  {}: time constant {}\n", sensor.channel, print::time_constant(sensor));
    live.start.sensors.iter().map(line).collect()
}
