//! The minimum Rust versions that the crates state.

use serde_json::Value;
use std::env;
use std::process::Command;

/// The output of `cargo metadata` for the locked dependencies.
fn metadata() -> Value {
    let mut cargo = Command::new(env::var_os("CARGO").expect("cargo runs the tests"));
    let manifest = concat!(env!("CARGO_MANIFEST_DIR"), "/../Cargo.toml");
    cargo.args(["metadata", "--format-version=1", "--locked"]);
    let output = cargo.args(["--manifest-path", manifest]).output().expect("it starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

fn list<'a>(value: &'a Value, key: &str) -> &'a [Value] {
    value[key].as_array().map_or(&[], Vec::as_slice)
}

/// Major and minor version of Rust that a package states.
fn rust_version(package: &Value) -> Option<(u32, u32)> {
    let mut numbers = package["rust_version"].as_str()?.split('.').map(|part| part.parse().ok());
    numbers.next().flatten().zip(numbers.next().flatten())
}

/// Features of a crate may need more: no member uses those of its dependencies by default.
#[test]
fn dependencies_support_the_versions_of_rust_that_the_crates_state() {
    let all = metadata();
    let find = |key: &str, name: &Value| {
        let found = list(&all, "packages").iter().find(|package| package[key] == *name);
        found.expect("a package")
    };
    let mut compared = 0;
    for member in list(&all, "workspace_members") {
        let member = find("id", member);
        let Some(own) = rust_version(member) else { continue };
        for dependency in list(member, "dependencies") {
            if dependency["kind"].is_null() && dependency["optional"] == false {
                let needed = find("name", &dependency["name"]);
                let most = rust_version(needed).unwrap_or_default();
                assert!(most <= own, "{} needs {most:?}: {}", needed["name"], member["name"]);
                compared += 1;
            }
        }
    }
    assert!(compared > 8, "{compared} dependencies");
}
