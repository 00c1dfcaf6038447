//! Profiles: what to read from a file and how, as TOML.
//!
//! The keys are those of the options: `time`, `time_unit`, `t1`, `t2`, `reference`, `flow`, `position`, `period_s`, `sampling`, and under
//! `[file]` `group` and `join`, for formats with several groups of channels.

use std::path::Path;

use serde::{Deserialize, Serialize};
use twinlag::record::Selection;
use twinlag_files::Choice;

use crate::failure::Failure;

/// What to read, and how.
#[derive(Clone, Debug, Default)]
pub(crate) struct Profile {
    pub(crate) selection: Selection,
    /// The group of channels, by name, of a file with several.
    pub(crate) group: Option<String>,
    /// Whether the groups of channels are joined.
    pub(crate) join: bool,
}

/// The key of what chooses a group of channels.
const FILE: &str = "file";

/// What a profile says of a file with several groups.
#[derive(Debug, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct OfFile {
    #[serde(skip_serializing_if = "Option::is_none")]
    group: Option<String>,
    join: bool,
}

impl Profile {
    /// Reads a profile.
    pub(crate) fn read(path: &Path) -> Result<Self, Failure> {
        let wrong = |what: String| Failure::File(format!("{}: {what}", path.display()));
        let text = std::fs::read_to_string(path).map_err(|e| wrong(format!("cannot be read: {e}")))?;
        let parsed = || -> Result<Self, toml::de::Error> {
            let mut keys: toml::Table = toml::from_str(&text)?;
            let OfFile { group, join } = keys.remove(FILE).map_or(Ok(OfFile::default()), toml::Value::try_into)?;
            Ok(Self { selection: keys.try_into()?, group, join })
        };
        parsed()
            .map_err(|e| wrong(format!("expected a profile as `twinlag inspect FILE --save-profile` writes it: {e}")))
    }

    /// Which group to read. If none is named, the group that alone has the channels named as T1 and T2.
    pub(crate) fn choice(&self) -> Choice {
        Choice { group: self.group.clone(), join: self.join, ..Choice::of(&self.selection) }
    }

    /// This profile, and where it says nothing what the other one says.
    pub(crate) fn or(self, other: Self) -> Self {
        Self {
            selection: self.selection.or(other.selection),
            group: self.group.or(other.group),
            join: self.join || other.join,
        }
    }

    /// The text of the profile.
    pub(crate) fn text(&self) -> Result<String, Failure> {
        let wrong = |e: toml::ser::Error| Failure::Other(format!("the profile cannot be written as TOML: {e}"));
        let mut keys = toml::Table::try_from(&self.selection).map_err(wrong)?;
        if self.group.is_some() || self.join {
            let of_file = OfFile { group: self.group.clone(), join: self.join };
            keys.insert(FILE.into(), toml::Value::try_from(of_file).map_err(wrong)?);
        }
        let lines = toml::to_string(&keys).map_err(wrong)?;
        Ok(format!(
            "# How twinlag reads files like the one that this was made for: twinlag VERB FILE --profile THIS.\n{lines}"
        ))
    }
}
