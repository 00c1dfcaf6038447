//! netCDF: classic and 4. The variables of one dimension are a group, the coordinate variable of the
//! dimension its time; a variable of two dimensions has a channel for each place along the second.
//! Missing values, valid range, scale and offset are those of the attributes, and where no fill
//! value is stated the usual ones are missing.

use netcdf_reader::unpack::SignParams;
use netcdf_reader::{Error, NcFile, NcFormat, NcGroup, NcType, NcVariable};

use crate::cf::Packing;
use crate::contents::{Channel, Group, name_apart};
use crate::fault::Fault;
use crate::format::Format;
use crate::input::Input;
use crate::records::Number;
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
    /// How its numbers are stored; `None` where it is not read.
    number: Option<Number>,
    /// Where `_Unsigned` contradicts the type that whole numbers are stored as.
    sign: Option<SignParams>,
    packing: Packing,
    is_time: bool,
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
    let number = number(&variable.dtype);
    let obstacle = match variable.dimensions.len() {
        _ if number.is_none() => Some("its values are no numbers".to_owned()),
        1 => None,
        2 if variable.dimensions[1].size <= MAX_COLUMNS => None,
        2 => Some(format!("it has {} places along its second dimension", variable.dimensions[1].size)),
        sides => Some(format!("it has {sides} dimensions")),
    };
    let columns = variable.dimensions.get(1).filter(|_| obstacle.is_none()).map_or(1, |second| second.size as usize);
    let title =
        |column: usize| if columns == 1 { variable.name.clone() } else { format!("{} {column}", variable.name) };
    let channel = |column| Channel { name: title(column), unit: unit.clone(), obstacle: obstacle.clone() };
    let channels = (1..=columns).map(channel).collect();
    let is_coordinate = variable.is_coordinate_variable() || text("standard_name") == "time" || text("axis") == "T";
    let sign = SignParams::from_variable(variable);
    let member = Member {
        path: format!("{path}{}", variable.name),
        is_time: is_coordinate && columns == 1 && is_time(&variable.name, &unit),
        number: number.filter(|_| obstacle.is_none()),
        sign,
        packing: number.map_or_else(|| Packing::of(|_| None), |number| packing(variable, number, sign)),
        unit,
        columns,
    };
    (member, channels)
}

/// How numbers of a type are stored; `None` of texts and types that a file defines.
fn number(kind: &NcType) -> Option<Number> {
    Some(match kind {
        NcType::Byte => Number::Int(1),
        NcType::Short => Number::Int(2),
        NcType::Int => Number::Int(4),
        NcType::Int64 => Number::Int(8),
        NcType::UByte => Number::Unsigned(1),
        NcType::UShort => Number::Unsigned(2),
        NcType::UInt => Number::Unsigned(4),
        NcType::UInt64 => Number::Unsigned(8),
        NcType::Float => Number::Single,
        NcType::Double => Number::Double,
        _ => return None,
    })
}

/// What the attributes of a variable say of its values; where no fill value is stated, the usual one of its type is missing.
fn packing(variable: &NcVariable, number: Number, sign: Option<SignParams>) -> Packing {
    let usual_fill = match variable.dtype {
        _ if variable.attribute("_FillValue").is_some() => None,
        NcType::Float | NcType::Double => Some(USUAL_FILL),
        NcType::Short => Some(USUAL_FILL_SHORT),
        NcType::Int => Some(USUAL_FILL_INT),
        _ => None,
    };
    let numbers = |name: &str| match variable.attribute(name) {
        Some(attribute) => attribute.value.as_f64_vec(),
        None => usual_fill.filter(|_| name == "_FillValue").map(|fill| vec![fill]),
    };
    Packing::of(numbers).with_marks(|mark| sign.map_or(number.stored(mark), |sign| sign.reinterpret(mark)))
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
            let Some(number) = member.number else { continue };
            let mut values = self.stored(member, number)?;
            if let Some(sign) = member.sign {
                values.iter_mut().for_each(|value| *value = sign.reinterpret(*value));
            }
            member.packing.apply(&mut values);
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
    /// The numbers of a variable as they are stored. Bytes of version 4 take the same way as those of HDF5.
    fn stored(&self, member: &Member, number: Number) -> Result<Vec<f64>, Fault> {
        if let Some(classic) = self.file.as_classic() {
            return Ok(classic.read_variable_as_f64(&member.path).map_err(fault)?.into_raw_vec_and_offset().0);
        }
        let bytes = self.file.read_variable_native_bytes(&member.path).map_err(fault)?;
        Ok(number.values(&bytes, cfg!(target_endian = "big")).collect())
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
