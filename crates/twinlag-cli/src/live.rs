//! `twinlag track - --live ROWS --out -`: rows are processed as they arrive.

use std::fs::File;
use std::io::{BufRead, BufReader, BufWriter, ErrorKind, Read, Write, stdin, stdout};
use std::path::Path;

use twinlag::diagnosis::Grade;
use twinlag::record::{Record, RecordError, RowReader, Table};
use twinlag::{Live, LiveAnswer, LiveOptions, SensorEstimate};

use crate::arguments::Track;
use crate::characterise::model;
use crate::console::Console;
use crate::failure::Failure;
use crate::grades;
use crate::print;

const HEADER: &str = "time_s,gas_C,gas_std_K,tau1_s,tau1_low_s,tau1_high_s,tau2_s,tau2_low_s,tau2_high_s";
/// Longest line that is read, in bytes: that of fifty thousand columns. What sends no line breaks would otherwise fill the memory.
const MAX_LINE_BYTES: usize = 1 << 20;
/// Number of warnings about bad rows that are printed one by one.
const MAX_WARNINGS: usize = 5;

pub(crate) fn run(command: &Track, rows: usize, to_stdout: bool, console: Console) -> Result<u8, Failure> {
    if console.json {
        return Err(Failure::Usage(
            "--live writes rows and --json writes one object at the end: leave out one of them".into(),
        ));
    }
    if let Some(change) = command.change.filter(|c| !(c.is_finite() && *c > 0.0)) {
        return Err(Failure::Usage(format!("--change {change}: expected a fraction above 0, for example 0.1")));
    }
    let options = LiveOptions {
        characterise: command.input.method.options()?,
        model: command.model.as_deref().map(model).transpose()?,
        change_per_root_s: command.change,
    };
    let selection = command.input.columns.profile()?.selection;
    let mut lines = Lines::open(&command.input.file)?;
    let table = lines.start(rows)?;
    let record = Record::from_table(&table, &selection)?;
    print::notes(&record, console);
    let mut reader = RowReader::after(&table, &selection)?;
    let mut live = Live::start(&record, &options)?;
    let starts = [0, 1].map(|i| live.start.sensors[i].judgement.grade);
    let code = grades::exit_code(&starts, &[], false, command.input.method.strict);
    let marked = command.input.method.best_effort().then(|| starts.into_iter().max()).flatten();
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
        if !out.answer(live.push(Some(record.time_s[k]), reading_c))? {
            return Ok(code);
        }
    }
    // What was read so far is out before the next row is waited for.
    out.flush()?;
    let source = table.source();
    let mut bad = Bad::default();
    let mut last_s = record.time_s.last().copied().unwrap_or(0.0);
    let mut alarms = Alarms::default();
    while let Some((number, line)) = lines.next()? {
        let (time_s, reading_c) = match reader.read(&line, number) {
            Ok(None) => continue,
            Ok(Some(row)) => (row.time_s, row.reading_c),
            Err(error) => {
                bad.say(&error, console);
                (None, [None, None])
            }
        };
        let answer = live.push(time_s, reading_c);
        if answer.is_none() {
            let [before, now] = [last_s, time_s.unwrap_or(last_s)].map(to_nanosecond);
            bad.say(
                &format!(
                    "{source}: line {number}: expected a time shortly after that of the previous row, {before} s from the \
                     start, got {now} s ('{}'); this row is left out",
                    line.trim_end()
                ),
                console,
            );
        }
        if let Some(now) = &answer {
            alarms.say(now, last_s, number, console);
            last_s = now.time_s;
        }
        if !out.answer(answer)? || !out.flush()? {
            return Ok(code);
        }
    }
    bad.sum(console);
    Ok(code)
}

/// What has been said of rows that are not as the start was.
#[derive(Default)]
struct Alarms {
    is_beyond: bool,
    is_wider: bool,
}

impl Alarms {
    /// Says what is new: of a pause each time, of the rest once.
    fn say(&mut self, now: &LiveAnswer, last_s: f64, line: usize, console: Console) {
        if now.is_resumed {
            let [before, after] = [last_s, now.time_s].map(to_nanosecond);
            console.note(|| {
                format!(
                    "warning: line {line}: the clock goes on from {after} s after {before} s, as after a pause or where it was set"
                )
            });
        }
        if now.is_beyond && !self.is_beyond {
            self.is_beyond = true;
            console.note(|| {
                format!(
                    "warning: at {} s the time constants may have left the range that is tracked, 0.4 to 2.5 times their \
                     values at the start: restart from there",
                    print::digits(now.time_s, 6)
                )
            });
        }
        if now.widened_by > 1.0 && !self.is_wider {
            self.is_wider = true;
            console.note(|| {
                format!(
                    "warning: at {} s the readings deviate from their predictions {:.1} times as far as expected: the gas \
                     or a sensor has changed since the start; while this lasts the bands are widened, and time constants \
                     that are no longer determined are left empty",
                    print::digits(now.time_s, 6),
                    now.widened_by
                )
            });
        }
    }
}

/// The last bits are of the conversion to seconds.
fn to_nanosecond(time_s: f64) -> f64 {
    (time_s * 1e9).round() / 1e9
}

fn started(live: &Live) -> String {
    let line =
        |sensor: &SensorEstimate| format!("  {}: time constant {}\n", sensor.channel, print::time_constant(sensor));
    let sensors: String = live.start.sensors.iter().map(line).collect();
    format!("started:\n{sensors}rows are now processed as they arrive")
}

/// Lines of a file or of standard input, as they arrive.
struct Lines {
    from: Box<dyn BufRead>,
    name: String,
    number: usize,
}

impl Lines {
    fn open(file: &Path) -> Result<Self, Failure> {
        if file == Path::new("-") {
            return Ok(Self { from: Box::new(BufReader::new(stdin())), name: "standard input".into(), number: 0 });
        }
        let name = file.display().to_string();
        let opened = File::open(file);
        let opened = opened.map_err(|e| RecordError::CannotRead { file: name.clone(), reason: e.to_string() })?;
        Ok(Self { from: Box::new(BufReader::new(opened)), name, number: 0 })
    }

    fn bytes(&mut self, to: &mut Vec<u8>) -> Result<bool, Failure> {
        let read = (&mut self.from).take(MAX_LINE_BYTES as u64 + 1).read_until(b'\n', to);
        let read = read.map_err(|e| RecordError::CannotRead { file: self.name.clone(), reason: e.to_string() })?;
        self.number += usize::from(read > 0);
        if read > MAX_LINE_BYTES {
            let (name, number) = (&self.name, self.number);
            return Err(Failure::File(format!(
                "{name}: line {number} is longer than {MAX_LINE_BYTES} bytes: expected rows of text, each ended by a line break"
            )));
        }
        Ok(read > 0)
    }

    /// Reads lines until `rows` of them hold data.
    fn start(&mut self, rows: usize) -> Result<Table, Failure> {
        let mut text = Vec::new();
        let mut wanted = rows;
        loop {
            let mut goes_on = true;
            for _ in 0..wanted {
                goes_on = self.bytes(&mut text)?;
            }
            let table = Table::read(&text, &self.name)?;
            if table.rows() >= rows {
                return Ok(table);
            }
            if !goes_on {
                let (name, got) = (&self.name, table.rows());
                return Err(Failure::File(format!(
                    "{name}: --live needs {rows} rows to start, but there are only {got}: ask for fewer, or leave out --live"
                )));
            }
            wanted = rows - table.rows();
        }
    }

    /// The next line with its number, from 1.
    fn next(&mut self) -> Result<Option<(usize, String)>, Failure> {
        let mut line = Vec::new();
        let is_one = self.bytes(&mut line)?;
        Ok(is_one.then(|| (self.number, String::from_utf8_lossy(&line).into_owned())))
    }
}

/// The output for the rows of the answer.
struct Out {
    to: Box<dyn Write>,
    name: String,
    /// The grade of the start, where rows show it.
    grade: Option<Grade>,
}

impl Out {
    fn open(path: &Path, to_stdout: bool, grade: Option<Grade>) -> Result<Self, Failure> {
        let name = if to_stdout { "standard output".to_owned() } else { path.display().to_string() };
        let to: Box<dyn Write> = if to_stdout {
            Box::new(BufWriter::new(stdout()))
        } else {
            let file = File::create(path).map_err(|e| Failure::Other(format!("{name}: cannot be written: {e}")))?;
            Box::new(BufWriter::new(file))
        };
        let mut out = Self { to, name, grade };
        out.line(&format!("{HEADER}{}", if grade.is_some() { ",grade" } else { "" }))?;
        Ok(out)
    }

    /// Writes one line by one call: `BufWriter` does not split what fits its buffer, so that a run that is killed leaves whole lines.
    /// `false` if the reader has closed the pipe.
    fn line(&mut self, line: &str) -> Result<bool, Failure> {
        let written = self.to.write_all(format!("{line}\n").as_bytes());
        self.done(written)
    }

    fn flush(&mut self) -> Result<bool, Failure> {
        let flushed = self.to.flush();
        self.done(flushed)
    }

    fn answer(&mut self, answer: Option<LiveAnswer>) -> Result<bool, Failure> {
        let Some(now) = answer else { return Ok(true) };
        let gas = [now.time_s, now.gas_c, now.gas_std_k].map(Some);
        let tau = [0, 1].into_iter().flat_map(|i| {
            let [low, high] = now.tau_95_s[i].map_or([None; 2], |band| band.map(Some));
            [now.tau_s[i], low, high]
        });
        let numbers = gas.into_iter().chain(tau).map(|v| v.map_or(String::new(), |v| v.to_string()));
        let cells: Vec<String> = numbers.chain(self.grade.map(|grade| grade.to_string())).collect();
        self.line(&cells.join(","))
    }

    fn done(&self, written: std::io::Result<()>) -> Result<bool, Failure> {
        match written {
            Ok(()) => Ok(true),
            Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(false),
            Err(error) => Err(Failure::Other(format!("{}: {error}", self.name))),
        }
    }
}

/// Count of the rows that could not be used.
#[derive(Default)]
struct Bad {
    count: usize,
}

impl Bad {
    fn say(&mut self, what: &impl ToString, console: Console) {
        self.count += 1;
        if self.count <= MAX_WARNINGS {
            console.note(|| format!("warning: {}", what.to_string()));
        }
    }

    fn sum(&self, console: Console) {
        if self.count > MAX_WARNINGS {
            console.note(|| format!("warning: {} rows could not be used", self.count));
        }
    }
}
