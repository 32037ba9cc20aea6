"""The byte layout of every chunk: one `construct.Struct` per table of SPEC 5."""

import numpy as np
from construct import (
    Array,
    Bytes,
    Const,
    Float32l,
    Int8ul,
    Int16ul,
    Int32sl,
    Int32ul,
    Int64ul,
    OneOf,
    PascalString,
    PrefixedArray,
    Struct,
    Tell,
    this,
)

from quarc_ref.format import constants

# SPEC 5.2
CHUNK_HEADER = Struct(
    "sync" / Const(constants.SYNC),
    "type" / Bytes(4),
    "sequence" / Int32ul,
    "length" / Int32ul,
    "header_crc" / Int32ul,
)
# Compiled for speed: a damaged stream may contain millions of possible headers.
COMPILED_CHUNK_HEADER = CHUNK_HEADER.compile()

# SPEC 5.3
VERSION = Struct(
    "version_major" / Int8ul,
    "version_minor" / Int8ul,
    "incompatible_features" / Int32ul,
    "compatible_features" / Int32ul,
)
STREAM_HEADER = Struct(
    "version" / VERSION,
    "level" / Int8ul,
    "timescale" / Int32ul,
    "frame_ticks" / Int32ul,
    "lattice_exponent" / Int8ul,
    "position_step" / Int16ul,
    "translation_step" / Int16ul,
    "rotation_unity" / Int16ul,
    "rotation_components" / Int8ul,
    "rotation_bits" / Int8ul,
    "log_scale_step" / Float32l,
    "opacity_step" / Float32l,
    "sh_dc_step" / Float32l,
    "sh_rest_step" / Float32l,
    "sh_degree" / Int8ul,
    "level_count" / Int8ul,
    "gaussians_per_anchor" / Int16ul,
    "anchor_ratio" / Int16ul,
    "resample_interval" / Int16ul,
    "full_crc_interval" / Int16ul,
    "seed" / Int64ul,
    "right_handed" / OneOf(Int8ul, (0, 1)),
    "up_axis" / Int8ul,
    "meters_per_unit" / Float32l,
    "color_space" / Int8ul,
)

# SPEC 5.4, 5.5, 5.10, 8.1
SECTION = Struct(
    "word_count" / Int32ul,
    "words" / Bytes(this.word_count * (constants.WORD_BITS // 8)),
)
CANONICAL = Struct(
    "frame" / Int32ul,
    "gaussian_count" / Int32ul,
    "origin" / Array(3, Int32sl),
    "axis_bits" / Int8ul,
    "sections" / Array(constants.CANONICAL_SECTIONS, SECTION),
    "state_crc" / Int32ul,
)
SNAPSHOT = Struct(
    "frame" / Int32ul,
    "canonical" / Int32ul,
    "newborn_count" / Int32ul,
    "origin" / Array(3, Int32sl),
    "axis_bits" / Int8ul,
    "survivors" / SECTION,
    "sections" / Array(constants.CANONICAL_SECTIONS, SECTION),
    "state_crc" / Int32ul,
)
FRAME = Struct(
    "phase" / Int32ul,
    "previous_contexts" / OneOf(Int8ul, (0, 1)),
    "death_count" / Int32ul,
    "birth_count" / Int32ul,
    "motion" / SECTION,
    "births" / SECTION,
    "state_crc" / Int32ul,
)
FRAME_WITH_UPDATES = Struct(*FRAME.subcons[:5], "updates" / SECTION, *FRAME.subcons[5:])

# SPEC 5.6
CAMERA = Struct(
    "name" / PascalString(Int8ul, "utf8"),
    "held_out" / OneOf(Int8ul, (0, 1)),
    "width" / Int32ul,
    "height" / Int32ul,
    "fx" / Float32l,
    "fy" / Float32l,
    "cx" / Float32l,
    "cy" / Float32l,
    "rotation" / Array(9, Float32l),
    "translation" / Array(3, Float32l),
    "near" / Float32l,
)
CAMERAS = Struct("cameras" / PrefixedArray(Int16ul, CAMERA))
COMPILED_CAMERAS = Struct("body" / CAMERAS, "end" / Tell).compile()  # for up to 65535 cameras
# size of a camera with an empty name
MIN_CAMERA_BYTES = 1 + sum(field.sizeof() for field in CAMERA.subcons[1:])

# SPEC 5.7
ENTRY = Struct("key" / PascalString(Int8ul, "utf8"), "value" / PascalString(Int32ul, "utf8"))
METADATA = Struct("entries" / PrefixedArray(Int16ul, ENTRY))

# SPEC 5.8
TAIL = Struct("frame_count" / Int32ul, "canonical_count" / Int32ul, "index_offset" / Int64ul)

# SPEC 5.9
SEEK_POINT = Struct("offset" / Int64ul, "sequence" / Int32ul, "frame" / Int32ul)
INDEX = Struct("count" / Int32ul, "points" / Bytes(this.count * SEEK_POINT.sizeof()))
SEEK_POINT_DTYPE = np.dtype([(field.name, f"<u{field.sizeof()}") for field in SEEK_POINT.subcons])
