//! A place for files, the program run in it, what it answered, and records made here, by arithmetic that shares nothing
//! with the crates under test.

use std::fmt::Write as _;
use std::fs;
use std::io::Write as _;
use std::panic::Location;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde_json::Value;

/// A study of a few trials of one method.
pub(crate) const STUDY: &str = r#"
name = "mine"
title = "A few trials"
seed = 1
trials = 30
block = 10
samples = [300]
noise_percent = [5]
[[gases]]
name = "sine"
gas = { kind = "sine", mean_c = 50.5, amplitude_k = 16.5, frequency_hz = 10.0, hold = "zero-order" }
[[methods]]
name = "whitened"
estimator = "whitened"
"#;

/// Two thermocouples in turbulence, the second read 2 K too hot, 3000 samples.
pub(crate) const RIG: &str = r#"
seed = 5

[record]
samples = 3000
sample_period_s = 0.01

[gas]
kind = "turbulence"
mean_c = 300.0
std_k = 15.0
corner_hz = 0.5
cutoff_hz = 45.0

[[sensors]]
channel = "T1"
time_constant_s = 0.12
noise = { std_k = 0.1 }

[[sensors]]
channel = "T2"
time_constant_s = 0.45
offset_k = 2.0
noise = { std_k = 0.1 }
"#;

/// Two thermocouples with nothing missing: the first lags as a wire of some 0.05 mm does in air of 300 °C at 20 m/s. 1500 samples.
pub(crate) const FAST_RIG: &str = r#"
seed = 1
[record]
samples = 1500
sample_period_s = 0.004
[gas]
kind = "broadband"
mean_c = 300.0
std_k = 10.0
corner_hz = 3.0
[[sensors]]
channel = "fine"
time_constant_s = 0.024
noise = { std_k = 0.1 }
[[sensors]]
channel = "coarse"
time_constant_s = 0.117
noise = { std_k = 0.1 }
"#;

/// An empty directory for the files of one test; the program runs inside it, so that messages hold bare file names.
pub(crate) struct Bench {
    dir: PathBuf,
}

impl Bench {
    /// `test` must be the name of the test: two of one name in one module would share the directory.
    #[track_caller]
    pub(crate) fn new(test: &str) -> Self {
        let module = Path::new(Location::caller().file()).file_stem().expect("a module has a file");
        let dir = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(module).join(test);
        let _ = fs::remove_dir_all(&dir);
        fs::create_dir_all(&dir).expect("the target directory can be written");
        Self { dir }
    }

    #[track_caller]
    pub(crate) fn with(test: &str, file: &str, content: impl AsRef<[u8]>) -> Self {
        let bench = Self::new(test);
        bench.write(file, content);
        bench
    }

    /// With the record of `rig` in `run.csv`.
    #[track_caller]
    pub(crate) fn simulated(test: &str, rig: &str) -> Self {
        let bench = Self::with(test, "rig.toml", rig);
        let answer = bench.run(&["simulate", "rig.toml", "--out", "run.csv", "--quiet"]);
        assert_eq!(answer.code, 0, "{answer:#?}");
        bench
    }

    pub(crate) fn write(&self, file: &str, content: impl AsRef<[u8]>) {
        fs::write(self.dir.join(file), content).expect("the target directory can be written");
    }

    pub(crate) fn path(&self, file: &str) -> PathBuf {
        self.dir.join(file)
    }

    pub(crate) fn read(&self, file: &str) -> Vec<u8> {
        fs::read(self.dir.join(file)).expect("the program wrote this file")
    }

    pub(crate) fn has(&self, file: &str) -> bool {
        self.dir.join(file).exists()
    }

    pub(crate) fn run(&self, arguments: &[&str]) -> Answer {
        self.run_with_input(arguments, b"")
    }

    pub(crate) fn run_with_input(&self, arguments: &[&str], input: &[u8]) -> Answer {
        self.run_with(arguments, input, &[])
    }

    pub(crate) fn run_in_environment(&self, arguments: &[&str], variables: &[(&str, &str)]) -> Answer {
        self.run_with(arguments, b"", variables)
    }

    fn run_with(&self, arguments: &[&str], input: &[u8], variables: &[(&str, &str)]) -> Answer {
        let mut child = Command::new(env!("CARGO_BIN_EXE_twinlag"))
            .args(arguments)
            .current_dir(&self.dir)
            .envs(variables.iter().copied())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("cargo built the program");
        let mut pipe = child.stdin.take().expect("piped above");
        let output = std::thread::scope(|scope| {
            // A program that refuses its arguments does not read: the pipe may be closed, which is no error here. One that answers
            // while it reads wants to be read.
            scope.spawn(move || pipe.write_all(input));
            child.wait_with_output().expect("the program was started")
        });
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("the program writes UTF-8");
        let answer = Answer {
            asked: arguments.join(" "),
            code: output.status.code().expect("the program ended by itself, by no signal"),
            stdout: text(output.stdout),
            stderr: text(output.stderr),
        };
        assert!(!answer.stderr.contains("panicked"), "{answer:#?}");
        answer
    }

    /// Asserts that the program refuses, with this exit code, no answer, and a message that holds all `words`; with
    /// `--json` too.
    pub(crate) fn refuses(&self, code: i32, arguments: &[&str], words: &[&str]) {
        for arguments in [arguments.to_vec(), [arguments, &["--json"]].concat()] {
            let answer = self.run(&arguments);
            assert_eq!(answer.code, code, "{answer:#?}");
            assert_eq!(answer.stdout, "", "{answer:#?}");
            answer.says(words);
        }
    }

    /// `twinlag characterise FILE --json` with further arguments.
    pub(crate) fn characterise(&self, file: &str, further: &[&str]) -> Answer {
        self.run(&[&["characterise", file, "--json"], further].concat())
    }
}

/// What the program answered.
#[derive(Debug)]
pub(crate) struct Answer {
    #[expect(dead_code, reason = "printed where a test fails")]
    pub(crate) asked: String,
    pub(crate) code: i32,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Answer {
    /// Asserts that standard error holds all words, whatever their case.
    pub(crate) fn says(&self, words: &[&str]) {
        let lower = self.stderr.to_lowercase();
        for word in words {
            assert!(lower.contains(&word.to_lowercase()), "no \"{word}\" in standard error: {self:#?}");
        }
    }

    /// The one JSON object on standard output; asserts that there is nothing else, that exit code and status agree, and
    /// that what is unknown is null.
    pub(crate) fn json(&self) -> Value {
        let value: Value = serde_json::from_str(&self.stdout).unwrap_or_else(|e| panic!("{e}: {self:#?}"));
        assert!(value.is_object(), "{self:#?}");
        for word in ["NaN", "Infinity", "\"inf\"", "\"-inf\""] {
            assert!(!self.stdout.contains(word), "{word} in {self:#?}");
        }
        if value["schema"] == "twinlag.characterisation/1" {
            assert_eq!(self.code, if value["status"] == "ok" { 0 } else { 4 }, "{self:#?}");
            self.unknown_is_null(&value);
        }
        value
    }

    fn unknown_is_null(&self, value: &Value) {
        let unknown = |name: &str| value["not_identifiable"].as_array().expect("a list").iter().any(|n| n == name);
        for (i, name) in ["T1.time_constant_s", "T2.time_constant_s"].into_iter().enumerate() {
            let sensor = &value["sensors"][i];
            let is_known = !sensor["time_constant_s"].is_null();
            assert!(!(unknown(name) && is_known), "{name}: {self:#?}");
            // What is not given says why.
            assert_eq!(sensor["grade"] == "no-go", !is_known, "{name}: {self:#?}");
            assert!(sensor["because"].as_str().is_some_and(|why| !why.is_empty()), "{name}: {self:#?}");
            for field in ["standard_error_s", "interval_95_s"] {
                assert!(is_known || sensor[field].is_null(), "{name} is unknown, its {field} is not: {self:#?}");
            }
        }
        if value["status"] == "ok" {
            assert!(value["not_identifiable"].as_array().expect("a list").is_empty(), "{self:#?}");
        } else {
            let warnings = value["warnings"].as_array().expect("a list");
            assert!(!warnings.is_empty(), "a status other than ok without a word of why: {self:#?}");
        }
    }

    /// As [`Self::json`], after asserting that the status is one of these.
    pub(crate) fn status(&self, allowed: &[&str]) -> Value {
        let value = self.json();
        let status = value["status"].as_str().expect("a text");
        assert!(allowed.contains(&status), "status {status}, expected one of {allowed:?}: {self:#?}");
        value
    }
}

pub(crate) fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("expected a number, got {value}"))
}

/// Two numbers, lower first.
pub(crate) fn interval(value: &Value) -> [f64; 2] {
    let pair = [number(&value[0]), number(&value[1])];
    assert!(pair[0] < pair[1], "not an interval: {pair:?}");
    pair
}

/// Both time constants and their standard errors, s.
pub(crate) fn estimates(value: &Value) -> [(f64, f64); 2] {
    [0, 1].map(|i| {
        let sensor = &value["sensors"][i];
        (number(&sensor["time_constant_s"]), number(&sensor["standard_error_s"]))
    })
}

/// Asserts that both time constants are within four of their standard errors of `truth_s`: beyond by chance once in 16 000.
pub(crate) fn recovers(value: &Value, truth_s: [f64; 2]) {
    for ((got, error), want) in estimates(value).into_iter().zip(truth_s) {
        assert!((got - want).abs() <= 4.0 * error, "got {got}, want {want} ± 4 × {error}: {value:#}");
    }
}

/// The gas of a [`Trace`], constant from one sample to the next.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Gas {
    /// First-order noise with a corner at 5 Hz and a standard deviation of 30 K.
    Random,
    /// 30 K at 3 Hz.
    Sine,
    /// Nothing happens.
    Still,
}

/// Two first-order sensors in one gas. The gas holds its value between the samples, for which `y[k+1] = a y[k] +
/// (1 − a) x[k]`, `a = exp(−Ts/τ)`, is exact.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Trace {
    pub(crate) samples: usize,
    pub(crate) period_s: f64,
    pub(crate) tau_s: [f64; 2],
    pub(crate) noise_k: [f64; 2],
    pub(crate) gas: Gas,
    pub(crate) seed: u64,
    /// Each step is this share longer or shorter than the period, at random.
    pub(crate) jitter: f64,
}

impl Trace {
    /// 4 s at 500 Hz of sensors of 23.8 ms and 116.8 ms; everything is identifiable.
    pub(crate) const GOOD: Self = Self {
        samples: 2000,
        period_s: 0.002,
        tau_s: [0.0238, 0.1168],
        noise_k: [0.3, 0.3],
        gas: Gas::Random,
        seed: 1,
        jitter: 0.0,
    };

    /// Rows of time and both readings.
    pub(crate) fn rows(&self) -> Vec<[f64; 3]> {
        let mut random = Random(self.seed);
        let settle = (12.0 * self.tau_s[0].max(self.tau_s[1]) / self.period_s).ceil() as usize;
        let (mut time_s, mut x, mut y) = (-(settle as f64) * self.period_s, 0.0, [0.0; 2]);
        let mut rows = Vec::with_capacity(self.samples);
        for k in 0..settle + self.samples {
            let step_s = self.period_s * (1.0 + self.jitter * (2.0 * random.uniform() - 1.0));
            x = match self.gas {
                Gas::Random => {
                    let kept = (-std::f64::consts::TAU * 5.0 * step_s).exp();
                    kept * x + (1.0 - kept * kept).sqrt() * 30.0 * random.normal()
                }
                Gas::Sine => 30.0 * (std::f64::consts::TAU * 3.0 * time_s).sin(),
                Gas::Still => 0.0,
            };
            if k == settle {
                time_s = 0.0;
            }
            if k >= settle {
                let [t1, t2] = [0, 1].map(|i| 80.0 + y[i] + self.noise_k[i] * random.normal());
                rows.push([time_s, t1, t2]);
            }
            for (y, tau_s) in y.iter_mut().zip(self.tau_s) {
                let a = (-step_s / tau_s).exp();
                *y = a * *y + (1.0 - a) * x;
            }
            time_s += step_s;
        }
        rows
    }

    pub(crate) fn csv(&self) -> String {
        csv(&self.rows())
    }

    /// The lines of the file, the header first, to spoil one of them.
    pub(crate) fn lines(&self) -> Vec<String> {
        self.csv().lines().map(str::to_owned).collect()
    }
}

pub(crate) fn csv(rows: &[[f64; 3]]) -> String {
    let mut text = String::from("time_s,T1,T2\n");
    for [t, t1, t2] in rows {
        writeln!(text, "{t:.6},{t1:.6},{t2:.6}").expect("a string takes everything");
    }
    text
}

/// `SplitMix64`: a few lines, the same numbers everywhere.
struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Standard normal, by Box and Muller.
    fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

/// The file `name` of `tests/data` in the workspace.
pub(crate) fn reference(name: &str) -> String {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../tests/data").join(name);
    path.to_str().expect("the workspace's path is text").to_owned()
}
