//! The unit vectors of the conformance suite, read by a minimal JSON parser.

#![allow(dead_code)] // each test program uses only some of it

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A JSON value; numbers are integers.
#[derive(Clone, Debug, PartialEq)]
pub enum Json {
    Null,
    Bool(bool),
    Number(i128),
    Text(String),
    List(Vec<Json>),
    Object(BTreeMap<String, Json>),
}

impl Json {
    pub fn get(&self, name: &str) -> &Json {
        self.find(name).unwrap_or_else(|| panic!("{self:?} has no {name}"))
    }

    pub fn find(&self, name: &str) -> Option<&Json> {
        match self {
            Json::Object(fields) => fields.get(name),
            _ => None,
        }
    }

    pub fn text(&self) -> &str {
        match self {
            Json::Text(text) => text,
            other => panic!("{other:?} is not a text"),
        }
    }

    pub fn list(&self) -> &[Json] {
        match self {
            Json::List(items) => items,
            other => panic!("{other:?} is not a list"),
        }
    }

    /// A number; those that do not fit a double are written as texts.
    pub fn number(&self) -> i128 {
        match self {
            Json::Number(number) => *number,
            Json::Text(text) => text.parse().expect("a number"),
            other => panic!("{other:?} is not a number"),
        }
    }

    pub fn u32s(&self) -> Vec<u32> {
        self.list().iter().map(|item| item.number() as u32).collect()
    }

    pub fn i32s(&self) -> Vec<i32> {
        self.list().iter().map(|item| item.number() as i32).collect()
    }
}

/// A file of the conformance suite.
pub fn suite_file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../conformance").join(name)
}

/// A JSON file of the conformance suite.
pub fn read_json(name: &str) -> Json {
    let path = suite_file(name);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path:?}: {e}"));
    Parser { bytes: text.as_bytes(), place: 0 }.value()
}

/// The cases of a function: pairs of input and output.
pub fn known_answers(function: &str) -> Vec<(Json, Json)> {
    let json = read_json(&format!("unit/{function}.json"));
    let cases: Vec<(Json, Json)> = json
        .get("cases")
        .list()
        .iter()
        .map(|case| (case.get("input").clone(), case.get("output").clone()))
        .collect();
    assert!(!cases.is_empty());
    cases
}

struct Parser<'a> {
    bytes: &'a [u8],
    place: usize,
}

impl Parser<'_> {
    fn value(&mut self) -> Json {
        match self.peek() {
            b'{' => Json::Object(self.items(b'}', Self::field).into_iter().collect()),
            b'[' => Json::List(self.items(b']', Self::value)),
            b'"' => Json::Text(self.text()),
            _ => self.word(),
        }
    }

    fn peek(&mut self) -> u8 {
        while self.bytes[self.place].is_ascii_whitespace() {
            self.place += 1;
        }
        self.bytes[self.place]
    }

    fn items<T>(&mut self, end: u8, item: fn(&mut Self) -> T) -> Vec<T> {
        let mut items = Vec::new();
        self.place += 1;
        while self.peek() != end {
            items.push(item(self));
            if self.peek() == b',' {
                self.place += 1;
            }
        }
        self.place += 1;
        items
    }

    fn field(&mut self) -> (String, Json) {
        self.peek();
        let name = self.text();
        assert_eq!(self.peek(), b':');
        self.place += 1;
        (name, self.value())
    }

    fn text(&mut self) -> String {
        let rest = &self.bytes[self.place + 1..];
        let length = rest.iter().position(|&byte| byte == b'"').expect("the end of a text");
        self.place += length + 2;
        let text = String::from_utf8(rest[..length].to_vec()).expect("UTF-8");
        assert!(!text.contains('\\'), "unit vectors have no escapes");
        text
    }

    fn word(&mut self) -> Json {
        let rest = &self.bytes[self.place..];
        let ends = |byte: &u8| byte.is_ascii_whitespace() || b",]}".contains(byte);
        let length = rest.iter().position(ends).expect("the end of a word");
        self.place += length;
        match std::str::from_utf8(&rest[..length]).expect("UTF-8") {
            "null" => Json::Null,
            "true" => Json::Bool(true),
            "false" => Json::Bool(false),
            number => Json::Number(number.parse().expect("an integer")),
        }
    }
}
