//! Both time constants of several records of one rig.

use twinlag_diagnose::{Settings, Verdict};
use twinlag_record::Record;

use crate::answers::Characterisation;
use crate::error::Error;
use crate::options::Options;
use crate::rows::settings_of;
use crate::verbs::characterise::judge_unseen;
use crate::verbs::diagnose::{DiagnoseOptions, unused, with_effects};
use crate::verbs::several::Several;
use crate::watch::{Stop, UNWATCHED, Watch};

/// Both time constants of several records of one rig, one pair for all of them: [`Characterisation::records`] says what each
/// record has for itself and whether it agrees, [`Characterisation::transfer`] how well the time constants of the others fit one
/// that is left out. Where the records differ by more than their noise, the intervals cover that.
///
/// The gas between samples is a spline, the noise of each record is found in it, and nothing but the time constants is fitted:
/// gain, offset and second lags of several records are found by [`crate::diagnose_records()`].
///
/// # Errors
/// As [`crate::diagnose_records()`]; [`Error::Setting`] for an option that is of a single record.
///
/// ```
#[doc = include_str!("../example.txt")]
/// # let level = |seed| channels(seed).map(|mut record| { record.t2_c.iter_mut().for_each(|c| *c -= 2.0); record });
/// # let record = Record::from_channels(level(1)?, SamplingChoice::Auto)?;
/// # let tuesday = Record::from_channels(level(2)?, SamplingChoice::Auto)?;
/// // The offset of the second channel has been taken off both records.
/// let answer = twinlag::characterise_records(&[record, tuesday], &Options::default())?;
/// assert_eq!(answer.status, Status::Ok);
/// assert!(answer.records.iter().all(|record| record.agrees == Some(true)));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn characterise_records(records: &[Record], options: &Options) -> Result<Characterisation, Error> {
    characterise_records_watched(records, options, UNWATCHED)
}

/// [`characterise_records`], with `watch` called as it goes on.
///
/// # Errors
/// As [`characterise_records`]; [`Error::Cancelled`].
pub fn characterise_records_watched(
    records: &[Record],
    options: &Options,
    watch: Watch<'_>,
) -> Result<Characterisation, Error> {
    options.check()?;
    if let [first, others @ ..] = &unused(options)[..] {
        return Err(Error::Setting {
            setting: *first,
            expected: "one record beside it (for several, only noise levels and known time constants can be given; a diagnosis finds \
                       what else they share)"
                .into(),
            got: format!("{} records", records.len()),
            also: others.to_vec(),
        });
    }
    let settings = settings_of(options);
    let (several, core) = Several::of(records, &Settings { effects: Vec::new(), ..settings }, watch)?;
    let asked = DiagnoseOptions { characterise: options.clone(), ..DiagnoseOptions::default() };
    let mut out = with_effects(&several.joined, &asked, &core, &[]);
    out.records = several.answers(&out, &[]);
    out.transfer = Some(several.transfer());
    if core.verdict != Verdict::Refused {
        judge_unseen(&mut out, &several.observations()?, options, &Stop::new(watch))?;
    }
    Ok(out)
}
