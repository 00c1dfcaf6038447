//! HDF5, and MATLAB 7.3, which is HDF5. The datasets of a group that have one length are a group
//! here; a scalar or an attribute that is called a sampling rate or a period gives the time where no
//! dataset does. Attributes are read by the conventions for climate and forecast data. Fields of
//! compound datasets are channels by name.

use hdf5_reader::error::{ByteOrder, Error};
use hdf5_reader::group::Group as Hdf5Group;
use hdf5_reader::{Attribute, Dataset, Datatype, Hdf5File};

use crate::cf::Packing;
use crate::contents::{Group, name_apart};
use crate::fault::Fault;
use crate::format::Format;
use crate::input::Input;
use crate::records::{self, Field, Meaning, Number};
use crate::series::{Loaded, Opened, Series, Values, is_time};
use crate::since::start_ns;
use crate::variables::{Variable, arrange, period_s};

/// Groups within groups, at most: a file whose groups contain themselves is no measurement.
const MAX_DEPTH: usize = 32;

struct Hdf5 {
    version: String,
    groups: Vec<Group>,
    /// The channels of each group: which dataset, and which field of it.
    members: Vec<Vec<Member>>,
    datasets: Vec<Dataset>,
}

#[derive(Clone, Debug)]
struct Member {
    dataset: usize,
    field: Option<Field>,
    packing: Packing,
    variable: Variable,
}

pub(crate) fn open(input: Input, _: Format) -> Result<Box<dyn Opened>, Fault> {
    let bytes = input.bytes()?;
    let file = match input {
        Input::Path(path) => Hdf5File::open(path),
        Input::Bytes(bytes) => Hdf5File::from_vec(bytes),
    };
    let file = file.map_err(fault)?;
    // The library reads what there is: texts that are cut off would become others.
    let end = file.superblock().eof_address;
    if end > bytes {
        return Err(Fault::damaged_at(bytes, format!("{end} bytes, as the file states"), "the end of the file"));
    }
    let version = format!("superblock {}", file.superblock().version);
    let mut opened = Hdf5 { version, groups: Vec::new(), members: Vec::new(), datasets: Vec::new() };
    let root = file.root_group().map_err(fault)?;
    opened.add(&root, "", 0)?;
    name_apart(&mut opened.groups);
    Ok(Box::new(opened))
}

impl Hdf5 {
    fn add(&mut self, group: &Hdf5Group, path: &str, depth: usize) -> Result<(), Fault> {
        if depth > MAX_DEPTH {
            return Err(Fault::damaged(format!("groups within groups, {MAX_DEPTH} deep at most"), "more of them"));
        }
        let (groups, datasets) = group.members().map_err(fault)?;
        let first = self.datasets.len();
        let mut members = Vec::new();
        // What the group says of all its datasets.
        let mut stated: Vec<(String, f64)> = numbers_of(&group.attributes().map_err(fault)?);
        for dataset in datasets {
            let attributes = dataset.attributes();
            stated.extend(numbers_of(&attributes));
            let of_dataset = members_of(&dataset, &attributes, self.datasets.len());
            for member in of_dataset.iter().filter(|member| member.variable.is_scalar()) {
                if let (Some(field), Ok(bytes)) = (member.field, dataset.read_raw_bytes()) {
                    let value = decode(&bytes, 1, bytes.len(), field)?;
                    stated.extend(value.first().map(|value| (member.variable.name.clone(), *value)));
                }
            }
            members.extend(of_dataset);
            self.datasets.push(dataset);
        }
        if self.datasets.len() > first {
            let variables: Vec<Variable> = members.iter().map(|member| member.variable.clone()).collect();
            let period_s = period_s(stated.iter().map(|(name, value)| (name.as_str(), *value)));
            let arranged = arrange(&variables, path, period_s);
            for (mut group, of_group) in arranged.groups.into_iter().zip(arranged.members) {
                let mut times = group.channels.iter().filter(|channel| is_time(&channel.name, &channel.unit));
                group.start_ns = times.find_map(|time| start_ns(&time.unit));
                self.groups.push(group);
                self.members.push(of_group.into_iter().map(|index| members[index].clone()).collect());
            }
        }
        // References of MATLAB's cells and tables lead there.
        for inner in groups.iter().filter(|inner| !inner.name().ends_with("#refs#")) {
            let name = inner.name().trim_matches('/');
            let inner_path = if path.is_empty() { name.to_owned() } else { format!("{path}/{name}") };
            self.add(inner, &inner_path, depth + 1)?;
        }
        Ok(())
    }
}

/// The channels of a dataset: one, or its fields.
fn members_of(dataset: &Dataset, attributes: &[Attribute], index: usize) -> Vec<Member> {
    let named = |name: &str| attributes.iter().find(|attribute| attribute.name == name);
    let text = |name: &str| named(name).and_then(|attribute| attribute.read_string().ok());
    let unit = ["units", "unit", "Unit", "Units", "unit_string"].into_iter().find_map(text).unwrap_or_default();
    let packing = Packing::of(|name| named(name).map(numbers));
    // Texts and references of MATLAB are stored as numbers.
    let class = text("MATLAB_class").unwrap_or_default();
    let is_number = !["char", "cell", "function_handle", "struct"].contains(&class.trim_matches('\0'));
    let name = dataset.name().rsplit('/').next().unwrap_or_default();
    let member = |name: &str, datatype: &Datatype, offset: usize, shape: &[u64]| {
        let field = number(datatype).filter(|_| is_number).map(|(number, is_big_endian)| Field {
            offset,
            bytes: number.bytes(),
            meaning: Meaning::Number(number),
            is_big_endian,
        });
        let obstacle = field.is_none().then(|| "its values are no numbers".to_owned());
        let variable = Variable {
            name: name.to_owned(),
            unit: unit.trim_matches(['\0', ' ']).to_owned(),
            shape: shape.to_vec(),
            obstacle,
        };
        let packing = match field.map(|field| field.meaning) {
            Some(Meaning::Number(number)) => packing.clone().with_marks(|mark| number.stored(mark)),
            _ => packing.clone(),
        };
        Member { dataset: index, field, packing, variable }
    };
    match dataset.dtype() {
        Datatype::Compound { fields, .. } => fields
            .iter()
            .map(|field| member(&field.name, &field.datatype, field.byte_offset as usize, dataset.shape()))
            .collect(),
        datatype => vec![member(name, datatype, 0, dataset.shape())],
    }
}

/// How a number is stored, and whether its first byte weighs most.
fn number(datatype: &Datatype) -> Option<(Number, bool)> {
    let (number, order) = match datatype {
        Datatype::FixedPoint { size: size @ 1..=8, signed: true, byte_order } => {
            (Number::Int((*size).into()), byte_order)
        }
        Datatype::FixedPoint { size: size @ 1..=8, byte_order, .. } => (Number::Unsigned((*size).into()), byte_order),
        Datatype::FloatingPoint { size: 4, byte_order } => (Number::Single, byte_order),
        Datatype::FloatingPoint { size: 8, byte_order } => (Number::Double, byte_order),
        Datatype::Enum { base, .. } => return number(base),
        _ => return None,
    };
    Some((number, *order == ByteOrder::BigEndian))
}

/// The numbers of an attribute; none if it is text.
fn numbers(attribute: &Attribute) -> Vec<f64> {
    let Some((number, is_big_endian)) = number(&attribute.datatype) else { return Vec::new() };
    number.values(&attribute.raw_data, is_big_endian).collect()
}

/// Attributes that are one number each.
fn numbers_of(attributes: &[Attribute]) -> Vec<(String, f64)> {
    let one = |attribute: &Attribute| match numbers(attribute)[..] {
        [value] => Some((attribute.name.clone(), value)),
        _ => None,
    };
    attributes.iter().filter_map(one).collect()
}

fn decode(bytes: &[u8], rows: usize, record_bytes: usize, field: Field) -> Result<Vec<f64>, Fault> {
    let mut columns = [field.empty()];
    records::read(&mut &*bytes, rows as u64, record_bytes, &[field], &mut columns)?;
    let [Values::Numbers(values)] = columns else { return Ok(Vec::new()) };
    Ok(values)
}

impl Opened for Hdf5 {
    fn version(&self) -> String {
        self.version.clone()
    }

    fn groups(&self) -> &[Group] {
        &self.groups
    }

    fn load(&mut self, group: usize) -> Result<Loaded, Fault> {
        let mut loaded = Loaded::default();
        // Fields of one dataset follow each other: its bytes are read once.
        let mut last: Option<(usize, Vec<u8>)> = None;
        for member in &self.members[group] {
            let Some(field) = member.field else { continue };
            if last.as_ref().is_none_or(|(dataset, _)| *dataset != member.dataset) {
                drop(last.take());
                let bytes = self.datasets[member.dataset].read_raw_bytes().map_err(fault)?;
                last = Some((member.dataset, bytes));
            }
            let bytes = last.as_ref().map_or(&[][..], |(_, bytes)| bytes);
            let record_bytes = self.datasets[member.dataset].raw_element_size().map_err(fault)?;
            let rows = bytes.len().checked_div(record_bytes).unwrap_or(0);
            let mut values = decode(bytes, rows, record_bytes, field)?;
            member.packing.apply(&mut values);
            loaded.series.extend(member.variable.series(values));
        }
        loaded.add_clock(0.0, self.groups[group].period_s);
        loaded.time = loaded.time.or_else(|| declared_time(&loaded.series));
        Ok(loaded)
    }
}

/// A time whose unit says from when it counts.
fn declared_time(series: &[Series]) -> Option<usize> {
    series.iter().position(|series| is_time(&series.name, &series.unit) && start_ns(&series.unit).is_some())
}

fn fault(error: Error) -> Fault {
    let text = error.to_string();
    match error {
        Error::Io(error) => Fault::Io(error),
        Error::UnexpectedEof { offset, needed, available } => {
            Fault::damaged_at(offset, format!("{needed} bytes"), available)
        }
        Error::OffsetOutOfBounds(offset) => Fault::damaged_at(offset, "a place within the file", "none"),
        // Deeper in the reader a filter has no variant of its own.
        error
            if matches!(
                error,
                Error::UnsupportedFilter(_) | Error::UnsupportedEncoding(_) | Error::ResourceLimit(_)
            ) || text.contains("unsupported filter") =>
        {
            Fault::unsupported(format!("has what is not read ({text})"), "write it with gzip or without compression")
        }
        _ => Fault::damaged("what the format prescribes", text),
    }
}
