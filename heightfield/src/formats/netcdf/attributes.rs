//! Attributes of a variable.

use netcdf_reader::NcVariable;

/// An attribute that is a number.
pub(super) fn number(variable: &NcVariable, attribute: &str) -> Option<f64> {
    variable.attribute(attribute)?.value.as_f64()
}

/// An attribute that is a text.
pub(super) fn text(variable: &NcVariable, attribute: &str) -> Option<String> {
    variable.attribute(attribute)?.value.as_string()
}

/// An attribute that is a list of numbers, or one.
pub(super) fn numbers(variable: &NcVariable, attribute: &str) -> Vec<f64> {
    let values = variable.attribute(attribute);
    let values = values.and_then(|attribute| attribute.value.as_f64_vec());
    values.unwrap_or_default()
}
