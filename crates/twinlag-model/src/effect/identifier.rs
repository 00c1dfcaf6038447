//! Names of effects.

use std::cmp::Ordering;
use std::fmt;
use std::hash::{Hash, Hasher};
use std::str::FromStr;

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

use super::{
    About, calibration, coloured_noise, crosstalk, delay, drift, input_mismatch, mains_pickup, quantisation, radiation,
    saturation, second_order, separation, slow_mode, spikes, temperature_dependence, varying,
};
use crate::error::ModelError;

/// An effect by its name, with what is known of it before any record.
///
/// Two are equal if their names are. They are ordered by how often they occur. As text they are their names; read back,
/// a name must be one of [`Identifier::ALL`].
///
/// ```
/// use twinlag_model::Identifier;
///
/// let radiation: Identifier = "radiation".parse()?;
/// assert_eq!(radiation, Identifier::RADIATION);
/// assert!(radiation.resembles(Identifier::CALIBRATION)); // both are a disagreement at rest
/// assert!(!radiation.about().advice.is_empty());
/// let error = "friction".parse::<Identifier>().expect_err("there is none of that name");
/// assert!(error.to_string().contains("slow-mode"), "{error}"); // it lists those that there are
/// # Ok::<(), twinlag_model::ModelError>(())
/// ```
#[derive(Clone, Copy)]
pub struct Identifier(&'static About);

impl Identifier {
    /// A reading that saturates.
    pub const SATURATION: Self = Self(&saturation::ABOUT);
    /// A converter coarser than the noise.
    pub const QUANTISATION: Self = Self(&quantisation::ABOUT);
    /// Isolated wrong readings.
    pub const SPIKES: Self = Self(&spikes::ABOUT);
    /// Sinusoids in a reading.
    pub const MAINS_PICKUP: Self = Self(&mains_pickup::ABOUT);
    /// Relative gain, offset, static curvature.
    pub const CALIBRATION: Self = Self(&calibration::ABOUT);
    /// One channel later than the other.
    pub const DELAY: Self = Self(&delay::ABOUT);
    /// A second lag in series.
    pub const SECOND_ORDER: Self = Self(&second_order::ABOUT);
    /// A slow parallel path.
    pub const SLOW_MODE: Self = Self(&slow_mode::ABOUT);
    /// A share of one channel in the other.
    pub const CROSSTALK: Self = Self(&crosstalk::ABOUT);
    /// Time constants that change along the record.
    pub const VARYING_TIME_CONSTANT: Self = Self(&varying::ABOUT);
    /// Time constants that change with temperature.
    pub const TEMPERATURE_DEPENDENT_TIME_CONSTANT: Self = Self(&temperature_dependence::ABOUT);
    /// Radiation to walls.
    pub const RADIATION: Self = Self(&radiation::ABOUT);
    /// An offset that changes with time.
    pub const DRIFT: Self = Self(&drift::ABOUT);
    /// Noise of a reading that is not white.
    pub const COLOURED_NOISE: Self = Self(&coloured_noise::ABOUT);
    /// Sensors that do not see the same gas.
    pub const INPUT_MISMATCH: Self = Self(&input_mismatch::ABOUT);

    /// Sensors that stand apart along a flow or a motion.
    pub const SEPARATION: Self = Self(&separation::ABOUT);

    /// Those of this library, the most frequent first.
    pub const ALL: [Self; 16] = [
        Self::SATURATION,
        Self::QUANTISATION,
        Self::SPIKES,
        Self::MAINS_PICKUP,
        Self::CALIBRATION,
        Self::DELAY,
        Self::SECOND_ORDER,
        Self::SLOW_MODE,
        Self::CROSSTALK,
        Self::VARYING_TIME_CONSTANT,
        Self::TEMPERATURE_DEPENDENT_TIME_CONSTANT,
        Self::RADIATION,
        Self::DRIFT,
        Self::COLOURED_NOISE,
        Self::INPUT_MISMATCH,
        Self::SEPARATION,
    ];

    /// The identifier of an effect, of this library or of another crate.
    pub const fn of(about: &'static About) -> Self {
        Self(about)
    }

    /// Whether it is one of [`Identifier::ALL`], and not another one of that name.
    pub(crate) fn is_of_this_library(self) -> bool {
        Self::ALL.iter().any(|e| std::ptr::eq(e.0, self.0))
    }

    /// What is known of it before any record.
    pub const fn about(self) -> &'static About {
        self.0
    }

    /// The name that scripts use.
    pub const fn name(self) -> &'static str {
        self.0.name
    }

    /// Whether it is a model of noise, fitted by the likelihood of the residual and not by its energy.
    pub const fn is_noise(self) -> bool {
        self.0.is_noise
    }

    /// Whether either looks like the other where it is small, or where the gas says little.
    pub fn resembles(self, other: Self) -> bool {
        self.0.imitates.contains(&other.name()) || other.0.imitates.contains(&self.name())
    }

    /// Whether both cannot be in one model.
    pub fn excludes(self, other: Self) -> bool {
        self.0.excludes.contains(&other.name()) || other.0.excludes.contains(&self.name())
    }

    /// Effects of this library that it looks like where it is small, or where the gas says little.
    pub fn imitates(self) -> impl Iterator<Item = Self> {
        self.0.imitates.iter().filter_map(|name| name.parse().ok())
    }
}

impl fmt::Debug for Identifier {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl PartialEq for Identifier {
    fn eq(&self, other: &Self) -> bool {
        self.name() == other.name()
    }
}

impl Eq for Identifier {}

impl Hash for Identifier {
    fn hash<H: Hasher>(&self, state: &mut H) {
        self.name().hash(state);
    }
}

impl PartialOrd for Identifier {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Identifier {
    fn cmp(&self, other: &Self) -> Ordering {
        (self.0.rank, self.name()).cmp(&(other.0.rank, other.name()))
    }
}

impl fmt::Display for Identifier {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Identifier {
    type Err = ModelError;

    fn from_str(text: &str) -> Result<Self, ModelError> {
        Self::ALL
            .into_iter()
            .find(|e| e.name() == text)
            .ok_or_else(|| ModelError::UnknownEffect { name: text.into(), known: Self::ALL.map(Self::name).join(", ") })
    }
}

impl Serialize for Identifier {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl<'de> Deserialize<'de> for Identifier {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(de::Error::custom)
    }
}

#[cfg(feature = "schema")]
impl schemars::JsonSchema for Identifier {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Identifier".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({"type": "string", "enum": Self::ALL.map(Self::name)})
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The order of the list is that of the ranks, so that neither can be changed alone.
    #[test]
    fn the_most_frequent_come_first() {
        let ranks: Vec<u8> = Identifier::ALL.iter().map(|e| e.about().rank).collect();
        assert_eq!(ranks, (0..16).collect::<Vec<u8>>());
    }

    #[test]
    fn a_name_is_read_back_as_the_effect() {
        for effect in Identifier::ALL {
            let json = serde_json::to_string(&effect).expect("a string");
            assert_eq!(serde_json::from_str::<Identifier>(&json).expect("a known name"), effect);
        }
        let error = "dealy".parse::<Identifier>().expect_err("no such effect");
        assert!(error.to_string().contains("delay"), "{error}");
    }
}
