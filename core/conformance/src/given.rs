//! The input of a test case: JSON fields, in which large integers may be strings.

use quarc::error::{Error, Result};
use serde_json::Value;

/// Access to JSON fields by name.
pub struct Given<'a>(pub &'a Value);

impl Given<'_> {
    /// An integer.
    pub fn number<T: TryFrom<i128>>(&self, name: &str) -> Result<T> {
        read_number(&self.0[name]).ok_or_else(|| missing(name))
    }

    /// Integers.
    pub fn numbers<T: TryFrom<i128>>(&self, name: &str) -> Result<Vec<T>> {
        read_numbers(&self.0[name]).ok_or_else(|| missing(name))
    }

    /// `N` integers.
    pub fn array<T: TryFrom<i128>, const N: usize>(&self, name: &str) -> Result<[T; N]> {
        self.numbers(name)?.try_into().map_err(|_| missing(name))
    }

    /// Transpose lists of integers of equal length: result i has element i of each list.
    pub fn columns<T: TryFrom<i128> + Copy>(&self, name: &str) -> Result<Vec<Vec<T>>> {
        let read = |lists: &Vec<Value>| lists.iter().map(read_numbers).collect();
        let rows: Option<Vec<Vec<T>>> = self.0[name].as_array().and_then(read);
        let rows = rows.ok_or_else(|| missing(name))?;
        let width = rows.first().map_or(0, Vec::len);
        if rows.iter().any(|row| row.len() != width) {
            return Err(missing(name));
        }
        Ok((0..width).map(|column| rows.iter().map(|row| row[column]).collect()).collect())
    }

    /// Bytes in hexadecimal.
    pub fn bytes(&self, name: &str) -> Result<Vec<u8>> {
        let text = self.0[name].as_str().ok_or_else(|| missing(name))?;
        let byte =
            |place| text.get(place..place + 2).and_then(|byte| u8::from_str_radix(byte, 16).ok());
        (0..text.len()).step_by(2).map(|place| byte(place).ok_or_else(|| missing(name))).collect()
    }

    /// A binary32 in hexadecimal, most significant digit first.
    pub fn binary32(&self, name: &str) -> Result<f32> {
        let bytes = self.bytes(name)?.try_into().map_err(|_| missing(name))?;
        Ok(f32::from_be_bytes(bytes))
    }
}

fn read_numbers<T: TryFrom<i128>>(value: &Value) -> Option<Vec<T>> {
    value.as_array()?.iter().map(read_number).collect()
}

fn read_number<T: TryFrom<i128>>(value: &Value) -> Option<T> {
    let number = match value {
        Value::String(text) => text.parse().ok(),
        Value::Number(number) => number.to_string().parse().ok(),
        _ => None,
    };
    number.and_then(|number: i128| T::try_from(number).ok())
}

/// A malformed test case, which says nothing about a stream.
fn missing(name: &str) -> Error {
    Error::Source(format!("the test case has no valid {name}"))
}
