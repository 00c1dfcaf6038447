//! Options from a file, `--config lab.toml`, where the command line does not give them.
//!
//! Keys are the names of options without the dashes; those at the top go for every command that has such an option, those in a table
//! of a command's name for that command alone:
//!
//! ```toml
//! profile = "logger.toml"
//! [diagnose]
//! known = ["T1=0.5s"]
//! ```

use std::ffi::OsString;
use std::fmt;
use std::path::{Path, PathBuf};

use clap::{Arg, Command, CommandFactory};
use toml::{Table, Value};

use crate::arguments::Arguments;
use crate::failure::Failure;

/// The options that a file has added to a command line.
pub(crate) struct Added {
    file: PathBuf,
    options: Vec<OsString>,
}

/// What a message about an option says besides, since the user did not type it.
impl fmt::Display for Added {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let options: Vec<_> = self.options.iter().map(|option| option.to_string_lossy()).collect();
        write!(f, "(options from {}: {})", self.file.display(), options.join(" "))
    }
}

/// The arguments with what the file of their `--config` adds, and what that is; without that option as they are. Paths in the file are
/// relative to the folder in which the program runs, as on the command line.
pub(crate) fn with_config(mut arguments: Vec<OsString>) -> Result<(Vec<OsString>, Option<Added>), Failure> {
    let Some(file) = take_value(&mut arguments, "config") else { return Ok((arguments, None)) };
    let file = Path::new(&file);
    let wrong = |what: String| Failure::File(format!("{}: {what}", file.display()));
    let text = std::fs::read_to_string(file).map_err(|error| wrong(format!("cannot be read: {error}")))?;
    let keys: Table = toml::from_str(&text).map_err(|error| wrong(format!("expected options as TOML: {error}")))?;
    let program = Arguments::command();
    let globals: Vec<&str> = program.get_arguments().filter(|a| a.is_global_set()).filter_map(Arg::get_long).collect();
    let has = |command: &Command, name: &str| has_option(command, name) || globals.contains(&name);
    // What the command line asks decides which options there are.
    let is_excluded = |command: &Command, name: &str| {
        let named = |name: &str| command.get_arguments().find(|argument| argument.get_long() == Some(name));
        let Some(option) = named(name) else { return false };
        let given =
            command.get_arguments().filter(|other| other.get_long().is_some_and(|name| is_given(&arguments, name)));
        given.into_iter().any(|given| {
            let excludes = |one: &Arg, other: &Arg| {
                command.get_arg_conflicts_with(one).iter().any(|a| a.get_id() == other.get_id())
            };
            excludes(given, option) || excludes(option, given)
        })
    };
    // Of a command within another, as `study run`, each has a name.
    let mut path: Vec<(usize, &Command)> = Vec::new();
    for (place, argument) in arguments.iter().enumerate().skip(1) {
        let within = path.last().map_or(&program, |(_, command)| command);
        match within.find_subcommand(argument) {
            Some(command) => path.push((place, command)),
            None if argument.to_string_lossy().starts_with('-') => {}
            None => break,
        }
    }
    let Some(&(place, command)) = path.last() else { return Ok((arguments, None)) };
    let is_asked = |named: &Command| path.iter().any(|(_, command)| command.get_name() == named.get_name());
    let mut added = Vec::new();
    for (key, value) in &keys {
        match value {
            // Options of one command.
            Value::Table(own) => {
                let named = program.find_subcommand(key);
                let named = named.ok_or_else(|| wrong(format!("expected the name of a command, found [{key}]")))?;
                for (key, value) in own {
                    if !has(named, key) {
                        return Err(wrong(format!("[{}] has no option --{key}", named.get_name())));
                    }
                    if is_asked(named) && has(command, key) && !is_excluded(command, key) {
                        add(&mut added, &arguments, key, value).map_err(wrong)?;
                    }
                }
            }
            value => {
                if !has(&program, key) {
                    return Err(wrong(format!("no command has an option --{key}")));
                }
                let own = path.iter().filter_map(|(_, command)| keys.get(command.get_name())?.as_table());
                let is_own = own.into_iter().any(|own| own.contains_key(key));
                if has(command, key) && !is_own && !is_excluded(command, key) {
                    add(&mut added, &arguments, key, value).map_err(wrong)?;
                }
            }
        }
    }
    let behind = place + 1;
    arguments.splice(behind..behind, added.iter().cloned());
    let added = (!added.is_empty()).then(|| Added { file: file.to_owned(), options: added });
    Ok((arguments, added))
}

/// Whether a command, or one within it, has an option of that name.
fn has_option(command: &Command, name: &str) -> bool {
    command.get_arguments().any(|argument| argument.get_long() == Some(name))
        || command.get_subcommands().any(|within| has_option(within, name))
}

/// Takes an option with its value out of the arguments; an empty value where there is none.
fn take_value(arguments: &mut Vec<OsString>, name: &str) -> Option<OsString> {
    let option = format!("--{name}");
    let with_value = format!("{option}=");
    let place = arguments.iter().position(|argument| {
        let argument = argument.to_string_lossy();
        *argument == option || argument.starts_with(&with_value)
    })?;
    let taken = arguments.remove(place);
    match taken.to_string_lossy().strip_prefix(&with_value) {
        Some(value) => Some(value.into()),
        None if place < arguments.len() => Some(arguments.remove(place)),
        None => Some(OsString::new()),
    }
}

/// Whether an option is on the command line.
fn is_given(arguments: &[OsString], name: &str) -> bool {
    let option = format!("--{name}");
    arguments.iter().any(|argument| {
        let argument = argument.to_string_lossy();
        *argument == option || argument.starts_with(&format!("{option}="))
    })
}

/// Adds an option with its value or its values, unless it is given already.
fn add(added: &mut Vec<OsString>, given: &[OsString], name: &str, value: &Value) -> Result<(), String> {
    if is_given(given, name) {
        return Ok(());
    }
    let mut put = |value: &Value| {
        let text = match value {
            Value::String(text) => text.clone(),
            Value::Integer(_) | Value::Float(_) => value.to_string(),
            other => return Err(format!("{name}: expected a text, a number, true, or a list of these, found {other}")),
        };
        added.push(format!("--{name}={text}").into());
        Ok(())
    };
    match value {
        Value::Boolean(true) => added.push(format!("--{name}").into()),
        Value::Boolean(false) => {}
        Value::Array(values) => values.iter().try_for_each(put)?,
        value => put(value)?,
    }
    Ok(())
}
