//! The usage, the version, and what is said if there is nothing to write.

use crate::{assert_fails, folder, quarc, stream};

/// Check for success without messages, and return the output.
fn said(arguments: &[&str]) -> String {
    let output = quarc(arguments);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}");
    assert!(output.stderr.is_empty(), "{arguments:?}");
    String::from_utf8(output.stdout).expect("UTF-8")
}

#[test]
fn the_version_is_that_of_the_package() {
    let due = format!("quarc {}\n", env!("CARGO_PKG_VERSION"));
    assert_eq!(said(&["--version"]), due);
    assert_eq!(said(&["-V"]), due);
}

#[test]
fn the_usage_names_every_command_and_option() {
    let usage = said(&["--help"]);
    for name in ["verify FILE", "info FILE [--json]", "decode FILE -o DIR", "conformance"] {
        assert!(usage.contains(&format!("\n  quarc {name} ")), "{name}: {usage}");
    }
    for option in ["--start F", "--stop F", "--recover", "--jobs", "--capabilities"] {
        assert!(usage.contains(option), "{option}: {usage}");
    }
    assert!(usage.ends_with('\n'));
    for arguments in [&[][..], &["-h"], &["decode", "a", "-h"], &["conformance", "--help"]] {
        assert_eq!(said(arguments), usage, "{arguments:?}");
    }
}

#[test]
fn frames_that_the_stream_does_not_have_are_an_error() {
    let made = folder("absent").join("frames");
    for (name, options) in [
        ("journey", &["--start", "9"][..]),
        ("journey", &["--stop", "0"]),
        ("journey", &["--start", "5", "--stop", "5"]),
        ("journey", &["--start", "9", "--recover"]),
        ("no-frames", &[]),
    ] {
        let mut arguments = vec!["decode".into(), stream(name).into_os_string(), "-o".into()];
        arguments.push(made.clone().into_os_string());
        arguments.extend(options.iter().map(Into::into));
        let says = format!("{name}.quarc: the stream has none of the requested frames\n");
        assert_fails(&quarc(&arguments), 2, &says);
        assert!(!made.exists(), "{name} {options:?}");
    }
}
