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
use std::path::Path;

use clap::{Command, CommandFactory};
use toml::{Table, Value};

use crate::arguments::Arguments;
use crate::failure::Failure;

/// The arguments with what the file of their `--config` adds; without that option as they are.
pub(crate) fn with_config(mut arguments: Vec<OsString>) -> Result<Vec<OsString>, Failure> {
    let Some(file) = value_of(&arguments, "config") else { return Ok(arguments) };
    let file = Path::new(&file);
    let wrong = |what: String| Failure::File(format!("{}: {what}", file.display()));
    let text = std::fs::read_to_string(file).map_err(|error| wrong(format!("cannot be read: {error}")))?;
    let keys: Table = toml::from_str(&text).map_err(|error| wrong(format!("expected options as TOML: {error}")))?;
    let program = Arguments::command();
    let Some(command) = command_of(&program, &arguments) else { return Ok(arguments) };
    for (key, value) in &keys {
        match value {
            // Options of one command.
            Value::Table(own) => {
                let named = program.find_subcommand(key);
                let named = named.ok_or_else(|| wrong(format!("expected the name of a command, found [{key}]")))?;
                for (key, value) in own {
                    if !has_option(named, key) {
                        return Err(wrong(format!("[{}] has no option --{key}", named.get_name())));
                    }
                    if named.get_name() == command.get_name() {
                        add(&mut arguments, key, value).map_err(wrong)?;
                    }
                }
            }
            value => {
                if !program.get_subcommands().any(|command| has_option(command, key)) {
                    return Err(wrong(format!("no command has an option --{key}")));
                }
                let is_own = matches!(keys.get(command.get_name()), Some(Value::Table(own)) if own.contains_key(key));
                if has_option(command, key) && !is_own {
                    add(&mut arguments, key, value).map_err(wrong)?;
                }
            }
        }
    }
    Ok(arguments)
}

/// The command that the arguments name.
fn command_of<'a>(program: &'a Command, arguments: &[OsString]) -> Option<&'a Command> {
    arguments.iter().skip(1).find_map(|argument| program.find_subcommand(argument))
}

fn has_option(command: &Command, name: &str) -> bool {
    command.get_arguments().any(|argument| argument.get_long() == Some(name)) || ["json", "quiet"].contains(&name)
}

/// The value that an option has on the command line; empty for one that needs no value.
fn value_of(arguments: &[OsString], name: &str) -> Option<OsString> {
    let option = format!("--{name}");
    arguments.iter().enumerate().find_map(|(place, argument)| {
        let argument = argument.to_string_lossy();
        if *argument == option {
            return Some(arguments.get(place + 1).cloned().unwrap_or_default());
        }
        argument.strip_prefix(&format!("{option}=")).map(OsString::from)
    })
}

/// Adds an option with its value or its values, unless it is given already.
fn add(arguments: &mut Vec<OsString>, name: &str, value: &Value) -> Result<(), String> {
    if value_of(arguments, name).is_some() {
        return Ok(());
    }
    let mut put = |value: &Value| {
        let text = match value {
            Value::String(text) => text.clone(),
            Value::Integer(_) | Value::Float(_) => value.to_string(),
            other => return Err(format!("{name}: expected a text, a number, true, or a list of these, found {other}")),
        };
        arguments.push(format!("--{name}={text}").into());
        Ok(())
    };
    match value {
        Value::Boolean(true) => arguments.push(format!("--{name}").into()),
        Value::Boolean(false) => {}
        Value::Array(values) => values.iter().try_for_each(put)?,
        value => put(value)?,
    }
    Ok(())
}
