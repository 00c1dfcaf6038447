//! netCDF: classic and 4. The variables of one dimension are a group, the coordinate variable of the
//! dimension its time; a variable of two dimensions has a channel for each place along the second.
//! Missing values, valid range, scale and offset are those of the attributes, and where no fill
//! value is stated the usual ones are missing.

use netcdf_reader::{Error, NcFile, NcFormat, NcGroup, NcType, NcVariable};

use crate::contents::{Channel, Group, name_apart};
use crate::fault::Fault;
use crate::format::Format;
use crate::input::Input;
use crate::series::{Loaded, Opened, Series, Values, is_time};
use crate::since::start_ns;

/// Values that fill what was never written, of `float`, `double`, `short`, `int` (netcdf.h).
const USUAL_FILL: f64 = 9.969_209_968_386_869e36;
const USUAL_FILL_SHORT: f64 = -32_767.0;
const USUAL_FILL_INT: f64 = -2_147_483_647.0;

/// A variable with more places along its second dimension is no set of channels.
const MAX_COLUMNS: u64 = 1000;

struct NetCdf {
    file: NcFile,
    groups: Vec<Group>,
    members: Vec<Vec<Member>>,
}

/// A variable of a group.
struct Member {
    path: String,
    unit: String,
    /// Length of its second dimension.
    columns: usize,
    fill: Option<f64>,
    is_time: bool,
    is_read: bool,
}

pub(crate) fn open(input: Input, _: Format) -> Result<Box<dyn Opened>, Fault> {
    let file = match input {
        Input::Path(path) => NcFile::open(path),
        Input::Bytes(bytes) => NcFile::from_vec(bytes),
    };
    let file = file.map_err(fault)?;
    let (mut groups, mut members) = (Vec::new(), Vec::new());
    add(file.root_group().map_err(fault)?, "", &mut groups, &mut members);
    name_apart(&mut groups);
    Ok(Box::new(NetCdf { file, groups, members }))
}

fn add(nc: &NcGroup, path: &str, groups: &mut Vec<Group>, members: &mut Vec<Vec<Member>>) {
    let first = groups.len();
    for variable in &nc.variables {
        let Some(dimension) = variable.dimensions.first() else { continue };
        let name = format!("{path}{}", dimension.name);
        let at = (first..groups.len()).find(|&at| groups[at].name == name).unwrap_or_else(|| {
            groups.push(Group { name, rows: dimension.size as usize, ..Group::default() });
            members.push(Vec::new());
            groups.len() - 1
        });
        let (member, channels) = describe(variable, path);
        if member.is_time && groups[at].start_ns.is_none() {
            groups[at].start_ns = start_ns(&member.unit);
        }
        groups[at].channels.extend(channels);
        members[at].push(member);
    }
    for inner in &nc.groups {
        add(inner, &format!("{path}{}/", inner.name), groups, members);
    }
}

fn describe(variable: &NcVariable, path: &str) -> (Member, Vec<Channel>) {
    let text =
        |name: &str| variable.attribute(name).and_then(|attribute| attribute.value.as_string()).unwrap_or_default();
    let unit = text("units").trim().to_owned();
    let obstacle = match (variable.dimensions.len(), variable.dtype.is_primitive() && !is_text(&variable.dtype)) {
        (_, false) => Some("its values are no numbers".to_owned()),
        (1, true) => None,
        (2, true) if variable.dimensions[1].size <= MAX_COLUMNS => None,
        (2, true) => Some(format!("it has {} places along its second dimension", variable.dimensions[1].size)),
        (sides, true) => Some(format!("it has {sides} dimensions")),
    };
    let columns = variable.dimensions.get(1).filter(|_| obstacle.is_none()).map_or(1, |second| second.size as usize);
    let title =
        |column: usize| if columns == 1 { variable.name.clone() } else { format!("{} {column}", variable.name) };
    let channel = |column| Channel { name: title(column), unit: unit.clone(), obstacle: obstacle.clone() };
    let channels = (1..=columns).map(channel).collect();
    let is_coordinate = variable.is_coordinate_variable() || text("standard_name") == "time" || text("axis") == "T";
    let fill = match variable.dtype {
        _ if variable.attribute("_FillValue").is_some() => None,
        NcType::Float | NcType::Double => Some(USUAL_FILL),
        NcType::Short => Some(USUAL_FILL_SHORT),
        NcType::Int => Some(USUAL_FILL_INT),
        _ => None,
    };
    let member = Member {
        path: format!("{path}{}", variable.name),
        is_time: is_coordinate && columns == 1 && is_time(&variable.name, &unit),
        is_read: obstacle.is_none(),
        unit,
        columns,
        fill,
    };
    (member, channels)
}

fn is_text(kind: &NcType) -> bool {
    matches!(kind, NcType::Char | NcType::String)
}

impl Opened for NetCdf {
    fn version(&self) -> String {
        match self.file.format() {
            NcFormat::Classic => "classic (CDF-1)",
            NcFormat::Offset64 => "classic with 64-bit offsets (CDF-2)",
            NcFormat::Cdf5 => "classic with 64-bit data (CDF-5)",
            NcFormat::Nc4 => "version 4",
            NcFormat::Nc4Classic => "version 4, classic model",
        }
        .to_owned()
    }

    fn groups(&self) -> &[Group] {
        &self.groups
    }

    fn load(&mut self, group: usize) -> Result<Loaded, Fault> {
        let mut loaded = Loaded::default();
        let mut titles = self.groups[group].channels.iter();
        for member in &self.members[group] {
            let names: Vec<&str> = titles.by_ref().take(member.columns).map(|channel| channel.name.as_str()).collect();
            if !member.is_read {
                continue;
            }
            let values = self.values(member)?;
            if member.is_time {
                loaded.time = Some(loaded.series.len());
            }
            for (column, name) in names.into_iter().enumerate() {
                let column = values.iter().skip(column).step_by(member.columns).copied().collect();
                loaded.series.push(Series {
                    name: name.to_owned(),
                    unit: member.unit.clone(),
                    values: Values::Numbers(column),
                });
            }
        }
        Ok(loaded)
    }
}

impl NetCdf {
    fn values(&self, member: &Member) -> Result<Vec<f64>, Fault> {
        // What was never written has to be told before scale and offset make it look like a value.
        let never_written = match member.fill {
            Some(fill) => {
                let stored = self.file.read_variable_as_f64(&member.path).map_err(fault)?;
                stored.iter().enumerate().filter(|(_, value)| **value == fill).map(|(at, _)| at).collect()
            }
            None => Vec::new(),
        };
        let array = self.file.read_variable_unpacked_masked(&member.path).map_err(fault)?;
        let mut values = array.into_raw_vec_and_offset().0;
        for at in never_written {
            if let Some(value) = values.get_mut(at) {
                *value = f64::NAN;
            }
        }
        Ok(values)
    }
}

fn fault(error: Error) -> Fault {
    let text = error.to_string();
    match error {
        Error::Io(error) => Fault::Io(error),
        Error::UnexpectedEof { offset, needed, available } => {
            Fault::damaged_at(offset, format!("{needed} bytes"), available)
        }
        Error::UnsupportedFeature(_) | Error::UnsupportedVersion(_) => Fault::unsupported(
            format!("has what is not read ({text})"),
            "write it as netCDF-4 with deflate, or classic",
        ),
        // Deeper in the reader it has no variant of its own.
        _ if text.contains("unsupported filter") => {
            Fault::unsupported(format!("has what is not read ({text})"), "write it with deflate or without compression")
        }
        _ => Fault::damaged("what the format prescribes", text),
    }
}
