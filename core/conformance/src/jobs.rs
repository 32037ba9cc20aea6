//! Many streams in one process: lines of JSON, each optionally followed by the bytes of a stream.

use crate::given::Given;
use crate::lines::{Lines, Numbers};
use crate::{units, Said};
use serde_json::{json, Value};
use std::io::{BufRead, Error, ErrorKind, Read, Write};

/// Do jobs until the input ends.
pub fn answer<W: Write>(requests: &mut impl BufRead, lines: &mut Lines<W>) -> Said<()> {
    let mut request = Vec::new();
    while requests.read_until(b'\n', &mut request)? > 0 {
        let job: Value = serde_json::from_slice(&request)?;
        let stream = read_stream(requests, job["bytes"].as_u64().unwrap_or(0))?;
        answer_job(&job, &stream, lines)?;
        lines.say(&json!({ "done": true }))?;
        request.clear();
    }
    Ok(())
}

fn read_stream(requests: &mut impl BufRead, count: u64) -> Said<Vec<u8>> {
    let mut stream = Vec::new();
    requests.by_ref().take(count).read_to_end(&mut stream)?;
    if (stream.len() as u64) < count {
        return Err(Error::new(
            ErrorKind::UnexpectedEof,
            "the input ends inside the stream of a job",
        ));
    }
    Ok(stream)
}

/// Do a job.
pub fn answer_job<W: Write>(job: &Value, mut stream: &[u8], lines: &mut Lines<W>) -> Said<()> {
    let is_set = |key: &str| job[key].as_bool() == Some(true);
    let numbers = match (is_set("values"), is_set("numbers")) {
        (true, _) => Numbers::Values,
        (false, true) => Numbers::Digest,
        (false, false) => Numbers::None,
    };
    let kind = job["job"].as_str().unwrap_or_default();
    let start = job["start"].as_u64();
    let said = match (kind, start) {
        ("decode", None) => lines.stream(&mut stream, numbers),
        ("decode", Some(start)) => {
            lines.seek(stream, u32::try_from(start).unwrap_or(u32::MAX), numbers)
        }
        ("recover", _) => lines.recovery(stream),
        ("unit", _) => match units::find(job["function"].as_str().unwrap_or_default()) {
            Some(unit) => lines.unit(unit(&Given(&job["input"]))),
            None => lines.say(&json!({ "unsupported": job["function"] })).map(|()| 0),
        },
        _ => lines.say(&json!({ "unsupported": kind })).map(|()| 0),
    };
    said.map(drop)
}
