import time
from dataclasses import asdict, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.format import constants, layouts, wire
from quarc_ref.format.errors import (
    EncodeError,
    FieldError,
    TrailingDataError,
    UnsupportedFeatureError,
    UnsupportedVersionError,
)
from quarc_ref.format.records import (
    CanonicalChunk,
    FrameChunk,
    Section,
    SeekPoint,
    StreamHeader,
    Tail,
)
from quarc_ref.format.seek_points import SeekPoints
from tests import strategies
from tests.checks import check_reader
from tests.small_streams import CAMERA

_UINT32 = st.integers(0, (1 << 32) - 1)
_TEXTS = st.dictionaries(st.text(max_size=20), st.text(max_size=50), max_size=4)


def _section(words: list[int]) -> Section:
    return Section(np.array(words, dtype=np.uint32))


def _list_fields(record):
    """Return the fields of a record, with lists instead of arrays."""
    if isinstance(record, Section):
        return record.words.tolist()
    fields = {name: getattr(record, name) for name in record.__dataclass_fields__}
    return {
        name: [_list_fields(item) for item in value]
        if isinstance(value, tuple) and value and isinstance(value[0], Section)
        else _list_fields(value)
        if isinstance(value, Section)
        else value
        for name, value in fields.items()
    }


@given(strategies.headers())
def test_a_header_survives_a_round_trip(header):
    assert wire.parse_stream_header(wire.build_stream_header(header)) == header


def test_a_truncated_or_longer_header_is_rejected():
    header = StreamHeader()
    data = wire.build_stream_header(header)

    assert len(data) == layouts.STREAM_HEADER.sizeof()
    check_reader(wire.parse_stream_header, data, header)


@pytest.mark.parametrize("major", [0, constants.VERSION_MAJOR + 1])
def test_another_major_version_is_rejected_by_its_reject_id(major):
    data = bytearray(wire.build_stream_header(StreamHeader()))
    data[0] = major

    with pytest.raises(UnsupportedVersionError):
        wire.parse_stream_header(bytes(data) + b"fields that this version does not know")


def test_the_version_is_checked_before_any_other_field():
    with pytest.raises(UnsupportedVersionError, match=r"version 2\.3"):
        wire.parse_stream_header(b"\2\3")


def test_a_later_minor_version_is_read():
    data = bytearray(wire.build_stream_header(StreamHeader()))
    data[1] = constants.VERSION_MINOR + 1

    assert wire.parse_stream_header(bytes(data)) == StreamHeader()


def test_an_incompatible_feature_is_rejected_by_its_reject_id():
    data = bytearray(wire.build_stream_header(StreamHeader()))
    data[2] = 1

    with pytest.raises(UnsupportedFeatureError):
        wire.parse_stream_header(bytes(data))


def test_a_compatible_feature_is_accepted():
    data = bytearray(wire.build_stream_header(StreamHeader()))
    data[6] = 1

    assert wire.parse_stream_header(bytes(data)) == StreamHeader()


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("level", 11),
        ("timescale", 0),
        ("frame_ticks", 0),
        ("lattice_exponent", 25),
        ("position_step", 0),
        ("translation_step", 0),
        ("rotation_unity", 257),
        ("rotation_components", 5),
        ("rotation_bits", 15),
        ("log_scale_step", 0.0),
        ("opacity_step", float("nan")),
        ("sh_dc_step", float("inf")),
        ("sh_rest_step", -1.0),
        ("sh_degree", 2),
        ("level_count", 4),
        ("gaussians_per_anchor", 0),
        ("anchor_ratio", 1),
        ("resample_interval", 0),
        ("full_crc_interval", 0),
        ("up_axis", 7),
        ("meters_per_unit", float("nan")),
        ("color_space", 0),
        ("right_handed", 2),
    ],
)
def test_a_header_field_out_of_range_is_rejected(name, value):
    version = {
        "version_major": constants.VERSION_MAJOR,
        "version_minor": constants.VERSION_MINOR,
        "incompatible_features": 0,
        "compatible_features": 0,
    }
    values = asdict(StreamHeader()) | {name: value, "version": version}
    layout = layouts.STREAM_HEADER
    if name == "right_handed":
        data = bytearray(layout.build(values | {name: 1}))
        data[-7] = value
    else:
        data = bytearray(layout.build(values))

    with pytest.raises(FieldError, match=name):
        wire.parse_stream_header(bytes(data))


def test_a_step_that_binary32_cannot_represent_cannot_be_written():
    with pytest.raises(ValueError, match="binary32"):
        replace(StreamHeader(), sh_dc_step=0.01)


def test_a_canonical_chunk_survives_a_round_trip():
    sections = tuple(_section([i, 7]) for i in range(constants.CANONICAL_SECTIONS))
    chunk = CanonicalChunk(3, 5, (-1, 2, -3), 9, sections, 0xDEADBEEF)

    parsed = wire.parse_canonical(wire.build_canonical(chunk))

    assert _list_fields(parsed) == _list_fields(chunk)


def test_a_frame_chunk_survives_a_round_trip():
    chunk = FrameChunk(3, True, 4, 5, _section([1]), _section([]), 12)

    parsed = wire.parse_frame(wire.build_frame(chunk))

    assert _list_fields(parsed) == _list_fields(chunk)


def test_a_frame_chunk_with_updates_survives_a_round_trip():
    chunk = FrameChunk(3, True, 4, 5, _section([1]), _section([]), 12, _section([7, 8]))

    parsed = wire.parse_frame(wire.build_frame(chunk), updates=True)

    assert _list_fields(parsed) == _list_fields(chunk)


def test_a_stream_without_updates_has_version_1_0():
    plain, update_head = (wire.build_stream_header(StreamHeader(updates=u)) for u in (False, True))

    assert (plain[:6], update_head[:6]) == (bytes([1, 0, 0, 0, 0, 0]), bytes([1, 1, 2, 0, 0, 0]))
    assert plain[6:] == update_head[6:]
    assert not wire.parse_stream_header(plain).updates
    assert wire.parse_stream_header(update_head).updates


def test_axis_bits_beyond_a_key_are_rejected():
    section = _section([])
    chunk = CanonicalChunk(0, 1, (0, 0, 0), 20, (section,) * constants.CANONICAL_SECTIONS, 0)
    data = bytearray(wire.build_canonical(chunk))
    data[20] = 21

    with pytest.raises(FieldError, match="axis_bits"):
        wire.parse_canonical(bytes(data))


def test_a_section_of_four_billion_words_is_rejected_at_once():
    data = bytearray(wire.build_frame(FrameChunk(1, False, 0, 0, *[_section([])] * 2, 0)))
    data[13:17] = b"\xff" * 4

    with pytest.raises(FieldError):
        wire.parse_frame(bytes(data))


def test_cameras_survive_a_round_trip_in_binary32():
    payload = wire.build_cameras((CAMERA, replace(CAMERA, name="zweite Kamera ö", held_out=False)))

    cameras = wire.parse_cameras(payload)

    assert cameras[0] == CAMERA
    assert [camera.name for camera in cameras] == ["cam00", "zweite Kamera ö"]
    assert [camera.held_out for camera in cameras] == [True, False]


def test_truncated_or_longer_cameras_are_rejected():
    check_reader(wire.parse_cameras, wire.build_cameras((CAMERA,)), (CAMERA,))


def test_the_number_of_cameras_is_checked_before_parsing():
    data = bytearray(wire.build_cameras((replace(CAMERA, name="a"),)))
    data[0], data[3] = 2, 0xFF  # the name is not UTF-8

    with pytest.raises(FieldError, match="2 cameras of at least 78 bytes each do not fit"):
        wire.parse_cameras(bytes(data))


@pytest.mark.parametrize("value", [float("nan"), float("inf"), 0.0, -1.0])
def test_a_camera_with_an_impossible_near_bound_is_rejected(value):
    data = bytearray(wire.build_cameras((CAMERA,)))
    data[-4:] = np.array([value], dtype="<f4").tobytes()

    with pytest.raises(FieldError):
        wire.parse_cameras(bytes(data))


@given(_TEXTS)
def test_metadata_survives_a_round_trip(metadata):
    assert wire.parse_metadata(wire.build_metadata(metadata)) == metadata


def test_truncated_or_longer_metadata_is_rejected():
    metadata = {"a": "1", "ß": "two"}

    check_reader(wire.parse_metadata, wire.build_metadata(metadata), metadata)


def test_the_message_about_metadata_that_is_not_utf8_does_not_repeat_it():
    data = wire.build_metadata({"key": "x" * 100_000}).replace(b"x", b"\xff")

    with pytest.raises(FieldError, match=r"^field: a text is not valid UTF-8$"):
        wire.parse_metadata(data)


@pytest.mark.parametrize(
    ("payload", "name"), [(b"", "version_major"), (b"\1\0" + b"\0" * 10, "timescale")]
)
def test_the_message_about_a_missing_field_gives_its_name(payload, name):
    with pytest.raises(FieldError, match=f"^field: the payload ends before the end of {name}$"):
        wire.parse_stream_header(payload)


def test_a_truncated_or_longer_tail_is_rejected():
    check_reader(wire.parse_tail, wire.build_tail(Tail(7, 1, 1 << 40)), Tail(7, 1, 1 << 40))


def test_the_length_of_a_tail_matches_the_specification():
    assert len(wire.build_tail(Tail(1, 1, 0))) == constants.TAIL_BYTES == layouts.TAIL.sizeof()
    assert layouts.STREAM_HEADER.sizeof() <= constants.HEAD_BYTES_LIMIT


@given(st.lists(st.builds(SeekPoint, st.integers(0, (1 << 64) - 1), _UINT32, _UINT32), max_size=3))
def test_a_truncated_or_longer_index_is_rejected(points):
    check_reader(wire.parse_index, wire.build_index(points), SeekPoints.from_records(points))
    assert list(wire.parse_index(wire.build_index(points))) == points


def test_an_index_of_four_billion_points_is_rejected_at_once():
    with pytest.raises(FieldError):
        wire.parse_index(b"\xff" * 36)


def test_an_index_of_a_million_points_is_parsed_at_once():
    count = (1 << 20) - 1
    payload = count.to_bytes(4, "little") + bytes(range(16)) * count
    start_time = time.monotonic()
    points = wire.parse_index(payload)

    assert time.monotonic() - start_time < 2
    assert len(points) == count
    assert points[-1] == SeekPoint(0x0706050403020100, 0x0B0A0908, 0x0F0E0D0C)


def test_a_count_beyond_its_field_cannot_be_written():
    with pytest.raises(EncodeError):
        wire.build_tail(Tail(1 << 32, 0, 0))


def test_bytes_after_the_last_field_have_their_own_reject_id():
    with pytest.raises(TrailingDataError):
        wire.parse_tail(wire.build_tail(Tail(1, 1, 0)) + b"\0")
