//! `quarc info`: the contents of a stream, chunk by chunk, without decoding frames.

use crate::failure::Failure;
use crate::files;
use quarc::chunks::{kind_name, CAME, CANO, FRAM, HEAD, INDX, META, SNAP, TAIL};
use quarc::error::Error;
use quarc::reader::{Chunk, ChunkReader};
use quarc::records::Header;
use quarc::source::Source;
use quarc::wire::{self, Camera, Metadata};
use serde_json::{json, Value};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

/// The summary of a stream.
#[derive(Default)]
struct Summary {
    header: Option<Header>,
    cameras: Vec<Camera>,
    metadata: Metadata,
    kinds: BTreeMap<String, Sum>,
    first_frame: Option<u32>,
    bytes: u64,
}

/// Totals of the chunks of one type.
#[derive(Clone, Copy, Default)]
struct Sum {
    count: u64,
    bytes: u64,
}

/// Print a summary of a stream, as text or JSON.
pub fn info(path: &Path, json: bool) -> Result<(), Failure> {
    let summary = Summary::of(files::open_source(path)?);
    let name = path.display().to_string();
    let summary = summary.map_err(|error| Failure::Stream(name.clone(), error))?;
    let text = if json { format!("{:#}\n", summary.as_json()) } else { summary.as_text(&name) };
    files::print(&text)
}

impl Summary {
    fn of(source: impl Source) -> Result<Self, Error> {
        let mut reader = ChunkReader::new(source)?;
        let mut summary = Summary::default();
        while let Some(chunk) = reader.read_chunk()? {
            summary.add(&chunk).map_err(|error| error.at(chunk.header.offset))?;
            if let (HEAD, Some(header)) = (chunk.header.kind, &summary.header) {
                reader.order.keep_to(header);
            }
        }
        summary.bytes = reader.order.offset;
        Ok(summary)
    }

    fn add(&mut self, chunk: &Chunk) -> Result<(), Error> {
        let payload = &chunk.payload;
        let updates = self.header.as_ref().is_some_and(|header| header.updates);
        let mut frame = None;
        match chunk.header.kind {
            HEAD => self.header = Some(wire::parse_header(payload)?),
            CAME => self.cameras = wire::parse_cameras(payload)?,
            META => self.metadata = wire::parse_metadata(payload)?,
            CANO => frame = Some(wire::parse_canonical(payload)?.frame),
            SNAP => frame = Some(wire::parse_snapshot(payload)?.frame),
            FRAM => drop(wire::parse_frame(payload, updates)?),
            INDX => drop(wire::parse_index(payload)?),
            TAIL => drop(wire::parse_tail(payload)?),
            _ => {}
        }
        self.first_frame = self.first_frame.or(frame);
        let sum = self.kinds.entry(kind_name(chunk.header.kind)).or_default();
        sum.count += 1;
        sum.bytes += chunk.header.end() - chunk.header.offset;
        Ok(())
    }

    fn count(&self, kinds: &[[u8; 4]]) -> u64 {
        let names = kinds.iter().map(|&kind| kind_name(kind));
        names.filter_map(|name| self.kinds.get(&name)).map(|sum| sum.count).sum()
    }

    fn seconds(&self) -> f64 {
        let header = self.header.as_ref();
        let frame = header
            .map_or(0.0, |header| f64::from(header.frame_ticks) / f64::from(header.timescale));
        self.count(&[CANO, SNAP, FRAM]) as f64 * frame
    }

    fn as_json(&self) -> Value {
        let chunks: BTreeMap<_, _> = self
            .kinds
            .iter()
            .map(|(kind, sum)| (kind, json!({ "count": sum.count, "bytes": sum.bytes })))
            .collect();
        let names = |held_out: bool| -> Vec<&str> {
            let those = self.cameras.iter().filter(|camera| !held_out || camera.held_out);
            those.map(|camera| camera.name.as_str()).collect()
        };
        let metadata: BTreeMap<_, _> = self.metadata.iter().cloned().collect();
        json!({
            "schema": "quarc/info/1", // changes with the keys
            "header": self.header.as_ref().map(describe_header),
            "frames": self.count(&[CANO, SNAP, FRAM]),
            "canonical_frames": self.count(&[CANO, SNAP]),
            "first_frame": self.first_frame,
            "seconds": self.seconds(),
            "bytes": self.bytes,
            "chunks": chunks,
            "cameras": names(false),
            "held_out": names(true),
            "metadata": metadata,
        })
    }

    fn as_text(&self, name: &str) -> String {
        let mut text = format!("{name}\n");
        let frames = self.count(&[CANO, SNAP, FRAM]);
        let canonical = self.count(&[CANO, SNAP]);
        let first = self.first_frame.map_or_else(String::new, |first| format!(", from {first} on"));
        let mut say = |what: &str, value: String| {
            let _ = writeln!(text, "  {what:<11} {value}"); // writing to a String cannot fail
        };
        if let Some(header) = &self.header {
            let Header { level, sh_degree, level_count, .. } = header;
            say("level", format!("{}.{}", level / 10, level % 10));
            say("features", describe_features(header).join(", "));
            say("gaussians", format!("SH degree {sh_degree}, {level_count} anchor levels"));
        }
        say("frames", format!("{frames}, of which {canonical} canonical{first}"));
        say("seconds", format!("{:.3}", self.seconds()));
        say("bytes", self.bytes.to_string());
        for (kind, Sum { count, bytes }) in &self.kinds {
            say(kind, format!("{count} in {bytes} bytes"));
        }
        say("cameras", self.cameras.len().to_string());
        for (key, value) in &self.metadata {
            say(&key.escape_debug().to_string(), value.escape_debug().to_string());
        }
        text
    }
}

fn describe_features(header: &Header) -> Vec<&'static str> {
    let known = [("updates", header.updates), ("snapshots", header.snapshots)];
    let used: Vec<_> = known.iter().filter(|(_, used)| *used).map(|(name, _)| *name).collect();
    if used.is_empty() {
        vec!["none"]
    } else {
        used
    }
}

fn describe_header(header: &Header) -> Value {
    json!({
        "level": header.level,
        "timescale": header.timescale,
        "frame_ticks": header.frame_ticks,
        "lattice_exponent": header.lattice_exponent,
        "position_step": header.position_step,
        "translation_step": header.translation_step,
        "rotation_unity": header.rotation_unity,
        "rotation_components": header.rotation_components,
        "rotation_bits": header.rotation_bits,
        "log_scale_step": header.log_scale_step,
        "opacity_step": header.opacity_step,
        "sh_dc_step": header.sh_dc_step,
        "sh_rest_step": header.sh_rest_step,
        "sh_degree": header.sh_degree,
        "level_count": header.level_count,
        "gaussians_per_anchor": header.gaussians_per_anchor,
        "anchor_ratio": header.anchor_ratio,
        "resample_interval": header.resample_interval,
        "full_crc_interval": header.full_crc_interval,
        "seed": header.seed,
        "right_handed": header.right_handed,
        "up_axis": header.up_axis,
        "meters_per_unit": header.meters_per_unit,
        "color_space": header.color_space,
        "updates": header.updates,
        "snapshots": header.snapshots,
    })
}
