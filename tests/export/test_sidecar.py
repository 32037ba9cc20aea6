"""Tests of `sequence.json`: what it says of a sequence, and which contents are rejected."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.export.clip import Clip
from quarc_ref.export.sidecar import Sidecar, build_sidecar, parse_sidecar, rotate_sidecar_upright
from quarc_ref.format.records import StreamHeader
from tests.small_streams import CAMERA

_CLIP = Clip(
    StreamHeader(timescale=25, up_axis=5, meters_per_unit=0.5), (CAMERA,), {"title": "small"}
)


@given(
    up_axis=st.integers(0, 6),
    right_handed=st.booleans(),
    meters_per_unit=st.floats(0, 1e3, width=32),
)
def test_a_sidecar_has_the_axes_and_the_scale_of_the_header(up_axis, right_handed, meters_per_unit):
    header = StreamHeader(
        up_axis=up_axis, right_handed=right_handed, meters_per_unit=meters_per_unit
    )

    sidecar = parse_sidecar(build_sidecar(Clip(header), "", 0))

    assert (sidecar.up_axis, sidecar.right_handed) == (up_axis, right_handed)
    assert sidecar.meters_per_unit == meters_per_unit


@pytest.mark.parametrize(
    ("original", "changed"),
    [
        ('"width": 64', '"width": -1'),
        ('"near": 0.5', '"near": "x"'),
        ('"frames_per_second": 25.0', '"frames_per_second": NaN'),
        ('"first_frame": 0', '"first_frame": -1'),
        ('"cameras"', '"kameras"'),
        ('"up": "+z"', '"up": "z"'),
        ('"title": "small"', '"title": 1'),
        ('"title": "small"', '"title": "\\ud800"'),
        ('"title": "small"', f'"{"t" * 256}": "small"'),
        ('"name": "cam00"', f'"name": "{"é" * 128}"'),
        ('"near": 0.5', '"near": 1e-60'),  # 0 in the stream
        ('"fx": 50.0', '"fx": 1e300'),
        ('"meters_per_unit": 0.5', '"meters_per_unit": -1'),
        ('"frames_per_second": 25.0', '"frames_per_second": 1e-9'),
    ],
)
def test_a_modified_sidecar_is_rejected(original, changed):
    text = build_sidecar(_CLIP, "", 0).decode()
    assert original in text

    with pytest.raises(ValueError, match="not a valid sequence"):
        parse_sidecar(text.replace(original, changed).encode())


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[]", "the content, which must be a JSON object, is invalid"),
        ("{}", "the key 'schema' is missing"),
        ('{"schema": "other"}', "schema is invalid"),
    ],
)
def test_an_invalid_sidecar_is_rejected_with_the_reason(text, message):
    with pytest.raises(ValueError, match=f"{message}$"):
        parse_sidecar(text.encode())


@pytest.mark.parametrize(
    ("original", "changed", "message"),
    [
        ('"first_frame": 0', '"first_frame": 1.5', "first_frame is not an integer"),
        ('"first_frame": 0', '"first_frame": true', "first_frame is not an integer"),
        ('"frames_per_second": 25.0', '"frames_per_second": "25"', "second is not a number"),
        ('"right_handed": true', '"right_handed": "false"', "right_handed is not true or false"),
        ('"files": "f"', '"files": null', "files is not a string"),
        ('"metadata": {', '"metadata": [], "other": {', "metadata is not an object"),
        ('"title": "small"', '"title": 1', "title is not a string"),
        ('"cameras": [', '"cameras": null, "other": [', "cameras is not a list"),
        ('"cameras": [', '"cameras": [1], "other": [', "an item of cameras is invalid"),
        ('"fx": 50.0', '"fx": [50.0]', "fx is not a number"),
        ('"rotation": [', '"rotation": ["1"], "other": [', "a number of rotation is not a number"),
    ],
)
def test_a_value_of_another_type_is_named_with_its_type(original, changed, message):
    text = build_sidecar(_CLIP, "f", 0).decode()
    assert original in text

    with pytest.raises(ValueError, match=f"{message}$"):
        parse_sidecar(text.replace(original, changed).encode())


@pytest.mark.parametrize(
    ("up", "rotated_up"), [("0 -0.8 0.6", "0.000000 0.800000 -0.600000"), ("up", "up")]
)
def test_an_up_direction_in_metadata_is_rotated_with_spz_frames(up, rotated_up):
    sidecar = rotate_sidecar_upright(Sidecar(metadata={"up": up}))

    assert sidecar.metadata["up"] == rotated_up
    assert sidecar.up_axis == (3 if up == "up" else 0)
