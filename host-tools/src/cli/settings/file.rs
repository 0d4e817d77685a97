//! A settings file: TOML with the names of options.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::Path;

use toml::{Spanned, Value};

use super::Setting;
use crate::cli::failure::{Failure, OrHint};
use heightfield::regular_file;

/// Size limit of a settings file, bytes.
const MAX_BYTES: u64 = 1 << 20;

/// Reads a settings file. `is_known` returns true for a valid key.
pub(super) fn read(path: &Path, is_known: impl Fn(&str) -> bool) -> Result<Vec<Setting>, Failure> {
    let name = path.display();
    let other = "correct the file, or leave it out with --settings none";
    let text = regular_file::read_text(path, MAX_BYTES)
        .map_err(|why| format!("{name}: {why}"))
        .or_hint("name another file with --settings")?;
    let table: BTreeMap<String, Spanned<Value>> = toml::from_str(&text)
        .map_err(|why| format!("{name}: {}", why.to_string().trim_end()))
        .or_hint(other)?;
    let line_of = |at: usize| 1 + text.bytes().take(at).filter(|byte| *byte == b'\n').count();
    let settings = table.into_iter().map(|(key, value)| {
        let place = format!("{name}, line {}", line_of(value.span().start));
        if !is_known(&key) {
            return Err(format!("{place}: no command has an option --{key}")).or_hint(other);
        }
        let values = match value.into_inner() {
            // The surface is in this file.
            Value::Table(_) if key == "surface" => Some(vec![path.into()]),
            Value::Array(values) => values.iter().map(argument).collect(),
            value => argument(&value).map(|word| vec![word]),
        };
        let values = values
            .ok_or_else(|| format!("{place}: {key} is a text, a number, true, false or a list"))
            .or_hint(other)?;
        Ok(Setting {
            name: key,
            values,
            place,
        })
    });
    settings.collect()
}

/// Converts a value to its form on the command line.
fn argument(value: &Value) -> Option<OsString> {
    match value {
        Value::String(text) => Some(text.into()),
        Value::Integer(number) => Some(number.to_string().into()),
        Value::Float(number) => Some(number.to_string().into()),
        Value::Boolean(flag) => Some(flag.to_string().into()),
        Value::Datetime(_) | Value::Array(_) | Value::Table(_) => None,
    }
}
