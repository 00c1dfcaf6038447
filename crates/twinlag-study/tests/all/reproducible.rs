//! The result of a study has the same bytes however it was run, and what could make it differ is refused.

#![expect(clippy::unwrap_used, reason = "a test may; the lint sees test functions alone, not their helpers")]

use std::fs;
use std::num::NonZeroUsize;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sha2::{Digest as _, Sha256};
use twinlag_study::{
    Failure, Forest, Kind, Options, Outcome, Part, Progress, Quantity, Results, Shard, Study, StudyError, Tally, merge,
    replay, run,
};

/// Numbers of very different size, so that their sums depend on the order of additions; the last block is short.
struct Noise {
    seed: u64,
    pause: Duration,
    /// The trial of cell 1 that goes wrong, and whether by panic.
    bad: Option<(u64, bool)>,
}

const NOISE: Noise = Noise { seed: 7, pause: Duration::ZERO, bad: None };

impl Study for Noise {
    type Scratch = ChaCha8Rng;

    fn plan(&self) -> String {
        format!("noise, seed {}", self.seed)
    }

    fn cells(&self) -> usize {
        3
    }

    fn trials(&self) -> u64 {
        1013
    }

    fn block(&self) -> u64 {
        10
    }

    fn quantities(&self, cell: usize) -> Vec<Quantity> {
        let mut quantities = vec![Quantity::value("x"), Quantity::event("large")];
        if cell == 2 {
            quantities.push(Quantity::value("sometimes"));
        }
        quantities
    }

    fn scratch(&self, cell: usize) -> Result<ChaCha8Rng, Failure> {
        Ok(ChaCha8Rng::seed_from_u64(self.seed + cell as u64))
    }

    fn trial(&self, cell: usize, index: u64, rng: &mut ChaCha8Rng, outcome: &mut Outcome) -> Result<(), Failure> {
        rng.set_stream(index);
        rng.set_word_pos(0);
        if let Some((bad, _)) = self.bad
            && cell == 1
            && index < bad
            && index + 30 > bad
        {
            // The blocks up to the bad one are slow, so that later ones, which go wrong as well, are there first.
            thread::sleep(Duration::from_millis(1));
        }
        if let Some((bad, panics)) = self.bad
            && cell == 1
            && index >= bad
        {
            assert!(!panics, "index {index} is bad");
            return Err(format!("index {index} is bad").into());
        }
        let u: f64 = rng.random();
        let x = (10.0 * u - 5.0).exp() * if index.is_multiple_of(3) { -1.0 } else { 1.0 };
        outcome.value(0, x);
        outcome.event(1, x > 1.0);
        if cell == 2 && u < 0.3 {
            outcome.value(2, if u < 0.1 { f64::NAN } else { u });
        }
        if !self.pause.is_zero() {
            thread::sleep(self.pause);
        }
        Ok(())
    }
}

fn options(threads: usize) -> Options {
    Options { threads: NonZeroUsize::new(threads).unwrap(), program: "1".into(), ..Options::default() }
}

fn go_on<T>(_: T) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

fn reference() -> String {
    run(&NOISE, &options(1), go_on).unwrap().into_results().unwrap().to_json()
}

/// The file of a part, with the hash that it should have.
fn with_hash(part: &str) -> String {
    let part = format!("{part}\n");
    let hash = base16ct::lower::encode_string(&Sha256::digest(&part));
    format!("{{\"schema\":\"twinlag.study-part-file/2\",\"sha256\":\"{hash}\"}}\n{part}")
}

/// An empty directory for one test.
fn directory(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("twinlag-study-{name}"));
    if path.exists() {
        fs::remove_dir_all(&path).unwrap();
    }
    fs::create_dir_all(&path).unwrap();
    path
}

/// Writes all shards of `of` and gives their paths.
fn shards(dir: &Path, study: &Noise, of: u64) -> Vec<PathBuf> {
    let one = |index| {
        let path = dir.join(format!("{index}-{of}.json"));
        let shard = Shard::new(index, of).unwrap();
        let options = Options { shard, checkpoint: Some(path.clone()), ..options(1 + index as usize % 3) };
        assert!(run(study, &options, go_on).unwrap().is_complete());
        path
    };
    (0..of).map(one).collect()
}

#[test]
fn the_bytes_do_not_depend_on_the_number_of_threads() {
    let want = reference();
    for threads in [1, 2, 7] {
        let got = run(&NOISE, &options(threads), go_on).unwrap().into_results().unwrap();
        assert!(got.to_json() == want, "{threads} threads gave other bytes");
        assert_eq!(serde_json::from_str::<Results>(&want).unwrap(), got);
    }
}

/// Without this the tests of equal bytes would show nothing: the same trials, added in one go, differ in the last digits.
#[test]
fn the_order_of_additions_does_matter_to_this_study() {
    let results = run(&NOISE, &options(1), go_on).unwrap().into_results().unwrap();
    let mut serial = Tally::new(&NOISE.quantities(0));
    (0..NOISE.trials()).for_each(|index| serial.push(&replay(&NOISE, 0, index).unwrap()));
    let [got, want] = [&results.cells()[0], &serial].map(|t| *t.values("x").unwrap().moments());
    assert_ne!(got, want);
    // Rounding: n u = 1e-13 relative, to about ten digits less one for cancellation in the mean.
    let (a, b) = (got.mean().unwrap(), want.mean().unwrap());
    assert!((a - b).abs() < 1e-12 * want.max().unwrap(), "got {a:e}, want {b:e}");
    assert_eq!(results.cells()[0].rate("large"), serial.rate("large"));
    assert_eq!(results.cells()[0].values("x").unwrap().sketch(), serial.values("x").unwrap().sketch());
}

#[test]
fn every_trial_runs_once_and_absences_are_counted() {
    let results = run(&NOISE, &options(3), go_on).unwrap().into_results().unwrap();
    let mut generator = NOISE.scratch(2).unwrap();
    let (mut given, mut refused) = (0, 0);
    for index in 0..NOISE.trials() {
        generator.set_stream(index);
        generator.set_word_pos(0);
        let u: f64 = generator.random();
        given += u64::from((0.1..0.3).contains(&u));
        refused += u64::from(u < 0.1);
    }
    let cell = &results.cells()[2];
    let sometimes = cell.values("sometimes").unwrap();
    assert_eq!((cell.trials(), sometimes.moments().count(), sometimes.refused()), (1013, given, refused));
    assert_eq!(cell.column("sometimes").unwrap().absent(), 1013 - given - refused);
}

/// The crate draws no random numbers, so no generator of another version can change a study: a trial gets its index, and
/// seeds itself from that.
#[test]
fn no_generator_is_a_dependency_of_the_engine() {
    let manifest = include_str!("../../Cargo.toml");
    let dependencies = manifest.split("[dependencies]").nth(1).unwrap().split("\n[").next().unwrap();
    assert!(!dependencies.contains("rand"), "{dependencies}");
}

#[test]
fn an_interruption_anywhere_changes_no_byte() {
    let want = reference();
    let dir = directory("interrupted");
    for stops in [[0, 0, 1], [1, 30, 200], [3, 299, 300], [150, 151, 302]] {
        let path = dir.join(format!("{stops:?}.json"));
        for (i, blocks) in stops.into_iter().enumerate() {
            let threads = [3, 1, 7][(i + blocks) % 3];
            let options = Options { checkpoint: Some(path.clone()), resume: true, ..options(threads) };
            let part = run(&NOISE, &options, |progress| {
                let enough = progress.done >= blocks as u64 * NOISE.block();
                if enough { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
            });
            assert_eq!(Part::read(&path).unwrap(), part.unwrap());
        }
        let options = Options { checkpoint: Some(path.clone()), resume: true, ..options(2) };
        run(&NOISE, &options, go_on).unwrap();
        assert!(merge([&path]).unwrap().to_json() == want, "stops after {stops:?} blocks gave other bytes");
        // Going on from what is complete runs nothing and changes nothing.
        let mut calls = 0;
        let again = run(&NOISE, &options, |p| {
            calls += u32::from(p.done < p.total);
            ControlFlow::Continue(())
        });
        assert!(again.unwrap().into_results().unwrap().to_json() == want && calls == 0);
    }
}

const CHILD: &str = "TWINLAG_STUDY_CHILD";

/// Not a test of its own: what the next test starts as a process, and kills.
#[test]
fn child_process() {
    if let Some(path) = std::env::var_os(CHILD) {
        let study = Noise { pause: Duration::from_micros(100), ..NOISE };
        // A checkpoint after every block, so that many a kill falls into the writing of one.
        let options = Options { checkpoint: Some(path.into()), resume: true, every: Duration::ZERO, ..options(3) };
        run(&study, &options, go_on).unwrap();
    }
}

/// The moments are what the scheduler makes of 5 to 60 ms after the start. The process is killed until the study is
/// complete, or left to end after 200 attempts.
#[cfg(unix)]
#[test]
fn a_killed_process_leaves_a_part_to_go_on_from() {
    let dir = directory("killed");
    let path = dir.join("part.json");
    let (mut kills, mut attempt) = (0, 0_u64);
    loop {
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "reproducible::child_process", "--test-threads=1"])
            .env(CHILD, &path)
            .stdout(std::process::Stdio::null())
            .spawn()
            .unwrap();
        attempt += 1;
        if attempt < 200 {
            thread::sleep(Duration::from_millis(5 + attempt * 37 % 56));
            child.kill().unwrap(); // SIGKILL
        }
        let status = child.wait().unwrap();
        let part = path.exists().then(|| Part::read(&path).expect("whole at every moment"));
        if status.success() {
            break;
        }
        kills += 1;
        if part.is_some_and(|part| part.is_complete()) {
            break;
        }
    }
    assert!(kills > 0, "the study was complete before the first kill");
    assert!(merge([&path]).unwrap().to_json() == reference(), "{kills} kills gave other bytes");
}

#[test]
fn shards_in_any_order_give_the_same_bytes() {
    let want = reference();
    let dir = directory("shards");
    for of in [1, 3, 7] {
        let mut paths = shards(&dir, &NOISE, of);
        let mut generator = ChaCha8Rng::seed_from_u64(of);
        for _ in 0..5 {
            for i in (1..paths.len()).rev() {
                paths.swap(i, generator.random_range(0..=i));
            }
            assert!(merge(&paths).unwrap().to_json() == want, "{paths:?} gave other bytes");
        }
    }
    // More shards than blocks: some have nothing to do.
    assert!(merge(shards(&dir, &NOISE, 400)).unwrap().to_json() == want);
}

#[test]
fn a_missing_shard_is_named_and_can_be_made_up_for_by_smaller_ones() {
    let dir = directory("missing");
    let mut paths = shards(&dir, &NOISE, 3);
    // Of 3 × 102 blocks, shard 1/3 has exactly those of cell 1.
    paths.remove(1);
    let error = merge(&paths).unwrap_err();
    assert_eq!(error.to_string(), "the study is not complete: missing shard 1/3: cell 1 blocks 0 to 101");
    assert!(matches!(&error, StudyError::Incomplete { shards, .. } if shards == &[Shard::new(1, 3).unwrap()]));
    paths.extend_from_slice(&shards(&dir, &NOISE, 6)[2..4]);
    assert!(merge(&paths).unwrap().to_json() == reference());
    assert!(matches!(merge(&paths[..0]), Err(StudyError::NoParts)));
}

#[test]
fn overlapping_shards_are_refused() {
    let dir = directory("overlap");
    let mut paths = shards(&dir, &NOISE, 3);
    paths.push(paths[1].clone());
    let error = merge(&paths).unwrap_err().to_string();
    assert!(error.ends_with("1-3.json repeats cell 1 blocks 0 to 101, which is also in another part"), "{error}");
    paths[3] = shards(&dir, &NOISE, 7)[6].clone();
    assert!(matches!(merge(&paths), Err(StudyError::Twice { gap, .. }) if gap.cell == 2));
}

#[test]
fn a_part_of_another_study_is_refused() {
    let dir = directory("other");
    let mut paths = shards(&dir, &NOISE, 2);
    let other = Noise { seed: 8, ..NOISE };
    let options = Options { checkpoint: Some(paths[0].clone()), resume: true, ..options(2) };
    let error = run(&other, &options, go_on).unwrap_err().to_string();
    assert!(error.ends_with("0-2.json has another plan: expected noise, seed 8, got noise, seed 7"), "{error}");
    let error = run(&NOISE, &options, go_on).unwrap_err().to_string();
    assert!(error.ends_with("0-2.json has another shard: expected 0/1, got 0/2"), "{error}");

    fs::create_dir(dir.join("8")).unwrap();
    paths[1] = shards(&dir.join("8"), &other, 2)[1].clone();
    assert!(matches!(merge(&paths), Err(StudyError::OtherStudy { what: "plan", .. })));

    // Another program may compute something else by the same plan.
    let options = Options { shard: Shard::new(0, 2).unwrap(), program: "2".into(), ..options };
    let error = run(&NOISE, &options, go_on).unwrap_err().to_string();
    assert!(error.ends_with("0-2.json has another program: expected 2, got 1"), "{error}");

    let text = fs::read_to_string(&paths[0]).unwrap();
    let part = text.lines().nth(1).unwrap();
    let version = part.replacen(&format!("\"version\":\"{}\"", env!("CARGO_PKG_VERSION")), "\"version\":\"0.0.0\"", 1);
    for (file, what) in [
        (with_hash(&version), "version of twinlag-study"),
        // A format of which nothing but its number is known.
        (text.replacen("study-part-file/2", "study-part-file/3", 1), "format"),
        // The first one had no hash.
        (format!("{part}\n"), "format"),
    ] {
        assert_ne!(file, text);
        fs::write(&paths[0], file).unwrap();
        let options = Options { shard: Shard::new(0, 2).unwrap(), ..options.clone() };
        let error = run(&NOISE, &options, go_on).unwrap_err();
        assert!(matches!(&error, StudyError::OtherStudy { what: got, .. } if *got == what), "{what}: {error}");
    }
}

#[test]
fn an_existing_part_is_not_overwritten_unasked() {
    let dir = directory("exists");
    let path = shards(&dir, &NOISE, 1).remove(0);
    let before = fs::read(&path).unwrap();
    let options = Options { checkpoint: Some(path.clone()), ..options(1) };
    assert!(matches!(run(&NOISE, &options, go_on), Err(StudyError::Exists { .. })));
    assert_eq!(fs::read(&path).unwrap(), before);
    let nowhere = Options { checkpoint: Some(dir.join("no/such/part.json")), ..options };
    assert!(matches!(run(&NOISE, &nowhere, |_| panic!("nothing should run")), Err(StudyError::Write { .. })));
}

/// An engine that has lost sight of a machine starts a shard again while the first process still runs.
#[test]
fn two_processes_do_not_write_one_part() {
    let path = directory("busy").join("part.json");
    let options = Options { checkpoint: Some(path.clone()), resume: true, every: Duration::ZERO, ..options(2) };
    let mut refused = 0;
    let again = |_: Progress| {
        let error = run(&NOISE, &options, |_| panic!("nothing should run")).unwrap_err();
        assert!(matches!(&error, StudyError::Busy { path: busy } if *busy == path), "{error}");
        refused += 1;
        ControlFlow::Continue(())
    };
    let part = run(&NOISE, &options, again).unwrap();
    assert!(refused > 0 && part.into_results().unwrap().to_json() == reference());
    // It can be taken up again, and nothing is left beside it.
    assert!(run(&NOISE, &options, go_on).is_ok());
    assert_eq!(fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
}

/// What says how far a shard is reads its part as that of the study that is asked for.
#[test]
fn a_part_is_read_as_one_of_its_study() {
    let dir = directory("read-of");
    let paths = shards(&dir, &NOISE, 2);
    let shard = |index| Shard::new(index, 2).unwrap();
    assert!(Part::read_of(&NOISE, shard(0), "1", &paths[0]).unwrap().is_complete());
    let other = Noise { seed: 8, ..NOISE };
    for (read, is) in [
        (Part::read_of(&other, shard(0), "1", &paths[0]), "plan"),
        (Part::read_of(&NOISE, shard(1), "1", &paths[0]), "shard"),
        (Part::read_of(&NOISE, shard(0), "2", &paths[0]), "program"),
    ] {
        assert!(matches!(read, Err(StudyError::OtherStudy { what, .. }) if what == is), "{is}");
    }
}

#[test]
fn a_damaged_part_is_refused_wherever_it_is_cut_and_whatever_was_edited() {
    let dir = directory("damaged");
    let path = shards(&dir, &NOISE, 2).remove(0);
    let text = fs::read_to_string(&path).unwrap();
    let refused = |bytes: &[u8], what: &str| {
        fs::write(&path, bytes).unwrap();
        let error = Part::read(&path).expect_err(what);
        assert!(matches!(error, StudyError::Damaged { .. }), "{what}: {error}");
        assert!(error.to_string().contains("0-2.json is not part of a study, or is damaged"), "{error}");
    };
    for cut in (0..text.len() - 1).step_by(text.len() / 97).chain([text.len() - 1]) {
        refused(&text.as_bytes()[..cut], "cut");
    }
    refused(&[0xff, 0xfe, 0, 1], "garbage");
    refused(b"{}", "another JSON");
    for (from, to) in [
        ("\"first\":0", "\"first\":3"),
        ("\"level\":7", "\"level\":6"),
        ("\"trials\":1013,\"columns\"", "\"trials\":1012,\"columns\""),
        ("\"name\":\"x\",\"absent\"", "\"name\":\"y\",\"absent\""),
        ("\"blocks\":102", "\"blocks\":101"),
        ("\"shard\":\"0/2\"", "\"shard\":\"2/2\""),
        ("\"block\":10", "\"block\":0"),
    ] {
        assert!(text.contains(from), "{from} is not in the file");
        let edited = text.replacen(from, to, 1);
        refused(edited.as_bytes(), to);
        // What does not fit together is refused also where the hash fits.
        refused(with_hash(edited.lines().nth(1).unwrap()).as_bytes(), to);
    }
}

#[test]
fn a_trial_that_cannot_run_is_named_the_first_one_on_any_number_of_threads() {
    for threads in [1, 2, 7] {
        for panics in [false, true] {
            let dir = directory(&format!("bad-{threads}-{panics}"));
            let path = dir.join("part.json");
            let study = Noise { bad: Some((456, panics)), ..NOISE };
            let options = Options { checkpoint: Some(path.clone()), ..options(threads) };
            let error = run(&study, &options, go_on).unwrap_err();
            let what = if panics { "it panicked: index 456 is bad" } else { "index 456 is bad" };
            assert_eq!(error.to_string(), format!("cell 1, trial 456 could not run: {what}"));
            // What was done before is kept: all of cell 0, and the 45 blocks of cell 1 before the bad one.
            let part = Part::read(&path).unwrap();
            assert_eq!(part.missing()[0].blocks, 45..102);
            assert_eq!((part.missing()[0].cell, part.cells()[0].root().is_some()), (1, true));
        }
    }
}

#[test]
fn a_study_that_is_none_is_refused() {
    struct Odd(usize, u64, u64);
    impl Study for Odd {
        type Scratch = ();
        fn plan(&self) -> String {
            String::new()
        }
        fn cells(&self) -> usize {
            self.0
        }
        fn trials(&self) -> u64 {
            self.1
        }
        fn block(&self) -> u64 {
            self.2
        }
        fn quantities(&self, _: usize) -> Vec<Quantity> {
            vec![Quantity::value("a"), Quantity { name: "a".into(), kind: Kind::Event }]
        }
        fn scratch(&self, cell: usize) -> Result<(), Failure> {
            Err(format!("no {cell}").into())
        }
        fn trial(&self, _: usize, _: u64, (): &mut (), _: &mut Outcome) -> Result<(), Failure> {
            Ok(())
        }
    }
    for odd in [Odd(0, 1, 1), Odd(1, 0, 1), Odd(1, 1, 0)] {
        assert!(matches!(run(&odd, &options(1), go_on), Err(StudyError::Empty { .. })));
    }
    for odd in [Odd(1, u64::MAX, 1), Odd(8, 1 << 60, 1), Odd(1, u64::MAX - 1, u64::MAX / 2)] {
        assert!(matches!(run(&odd, &options(1), go_on), Err(StudyError::TooLarge { .. })));
    }
    assert!(matches!(run(&Odd(1, 1, 1), &options(1), go_on), Err(StudyError::SameName { cell: 0, .. })));
    for text in ["3/3", "1", "-1/2", "0/0", "a/b"] {
        assert!(matches!(text.parse::<Shard>(), Err(StudyError::NoSuchShard { .. })), "{text} was accepted");
    }
    assert_eq!("2/3".parse::<Shard>().unwrap().to_string(), "2/3");
}

/// Progress never falls, begins with what earlier runs did, and ends with all.
#[test]
fn progress_counts_trials() {
    let (last, calls) = (AtomicU64::new(0), AtomicU32::new(0));
    run(&NOISE, &options(2), |progress| {
        assert!(progress.done >= last.swap(progress.done, Ordering::Relaxed));
        assert_eq!((progress.total, progress.restored), (3 * 1013, 0));
        calls.fetch_add(1, Ordering::Relaxed);
        ControlFlow::Continue(())
    })
    .unwrap();
    assert_eq!(last.into_inner(), 3 * 1013);
    assert!(calls.into_inner() >= 3 * 102);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn any_order_of_blocks_gives_the_same_bytes(
        (order, shards) in (1_usize..30).prop_flat_map(|blocks| (
            Just((0..blocks as u64).collect::<Vec<_>>()).prop_shuffle(),
            prop::collection::vec(0_usize..3, blocks),
        ))
    ) {
        let tally = |block: u64| {
            let mut tally = Tally::new(&NOISE.quantities(2));
            (4 * block..4 * block + 4).for_each(|index| tally.push(&replay(&NOISE, 2, index).unwrap()));
            tally
        };
        let blocks = order.len() as u64;
        let mut in_order = Forest::new(blocks);
        (0..blocks).for_each(|block| in_order.insert(block, tally(block)).unwrap());
        let mut parts = vec![Forest::new(blocks); 3];
        for (&block, &shard) in order.iter().zip(&shards) {
            parts[shard].insert(block, tally(block)).unwrap();
        }
        let mut whole = Forest::new(blocks);
        for part in parts.into_iter().rev() {
            let text = serde_json::to_string(&part).unwrap();
            whole.join(serde_json::from_str(&text).unwrap()).unwrap();
        }
        let [got, want] = [&whole, &in_order].map(|forest| serde_json::to_string(forest.root().unwrap()).unwrap());
        prop_assert_eq!(got, want);
    }
}
