"""Runs single functions of the decoder on the unit vectors of conformance/unit.

Each function takes the input fields of a test case as keyword arguments and calls the code
that decodes streams. Integers may be decimal strings.
"""

import zlib
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from quarc_ref.decoder.anchors import count_anchors, sample_anchors
from quarc_ref.decoder.binding import bind, bind_exhaustively
from quarc_ref.decoder.dequantize import dequantize
from quarc_ref.decoder.digest import compute_digest, compute_state_crc
from quarc_ref.decoder.philox import philox
from quarc_ref.decoder.reconstruct import choose_deaths
from quarc_ref.decoder.rotation import expand_rotations, normalize_sums, rotate
from quarc_ref.decoder.scene import Scene
from quarc_ref.format import arithmetic
from quarc_ref.format.arrays import Int32, Int64
from quarc_ref.format.coding import values
from quarc_ref.format.coding.contexts import ContextCounts
from quarc_ref.format.coding.entropy import make_bit_decoder
from quarc_ref.format.coding.gaussian_planes import code_ascending
from quarc_ref.format.coding.planes import PlaneReader
from quarc_ref.format.coding.probability import weight_of_probability_code
from quarc_ref.format.constants import ROTATION_ONE
from quarc_ref.format.morton import interleave
from quarc_ref.format.records import OPACITY, Section, StreamHeader

_JsonValue = Any  # JSON values
_MODEL = "n"


def answer_unit(function: str, inputs: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield the answer to one test case.

    Raises:
        BitstreamError: The input is invalid.
    """
    yield {"output": UNITS[function](**inputs)}


def _make_column(numbers: list[Any]) -> Int64:
    return np.array([int(number) for number in numbers], dtype=np.int64)[:, None]


def _flatten(numbers: Int64 | Int32) -> list[int]:
    flat_numbers: list[int] = numbers.reshape(-1).tolist()
    return flat_numbers


def _compute_crc(**fields: str) -> int:
    return zlib.crc32(bytes.fromhex(fields["bytes"]))


def _divide_round(n: int | str, d: int) -> int:
    return int(arithmetic.divide_round(np.array([int(n)]), int(d))[0])


def _philox(counter: list[int], key: list[int]) -> list[int]:
    return _flatten(philox(_make_column(counter).astype(np.uint64), key[0] | key[1] << 32))


def _count_anchors(gaussians: int, **header: int) -> list[int]:
    return list(count_anchors(gaussians, StreamHeader(**header)))  # type: ignore[arg-type]


def _sample_anchors(
    ids: list[int], positions: list[list[int]], seed: int | str, phase: int, **header: int
) -> list[list[int]]:
    stream_header = StreamHeader(seed=int(seed), sh_degree=0, **header)  # type: ignore[arg-type]
    anchors = sample_anchors(_make_scene(stream_header, ids, positions, phase))
    return [_flatten(level.owners) for level in anchors.levels]


def _bind_positions(positions: list[list[int]], anchors: list[list[int]]) -> list[int]:
    gaussian_positions = np.array(positions, dtype=np.int32).T
    anchor_positions = np.array(anchors, dtype=np.int32).T
    nearest = bind(gaussian_positions, anchor_positions, 0)
    if not np.array_equal(nearest, bind_exhaustively(gaussian_positions, anchor_positions)):
        message = "`bind` and `bind_exhaustively` found different nearest anchors"
        raise AssertionError(message)
    return _flatten(nearest)


def _choose_deaths(opacities: list[int], count: int) -> list[int]:
    scene = _make_scene(
        StreamHeader(sh_degree=0),
        range(len(opacities)),
        [[0, 0, 0]] * len(opacities),
        opacities=opacities,
    )
    return sorted(_flatten(choose_deaths(scene, count)))


def _make_scene(
    header: StreamHeader,
    ids: Any,  # noqa: ANN401
    positions: list[list[int]],
    phase: int = 1,
    opacities: list[int] | int = 0,
) -> Scene:
    rotations = np.zeros((4, len(positions)), dtype=np.int32)
    rotations[0] = ROTATION_ONE
    codes = np.zeros((header.code_planes, len(positions)), dtype=np.int16)
    codes[OPACITY.start] = opacities
    position_planes = np.array(positions, dtype=np.int32).T
    return Scene(
        header, phase, phase, np.array(ids, dtype=np.int64), position_planes, rotations, codes
    )


def _expand_rotation(rotation_bits: int, j: int, abc: list[int]) -> list[int]:
    return _flatten(expand_rotations(_make_column([j, *abc]), rotation_bits))


def _rotate(rotation: list[int], sums: list[int]) -> list[int]:
    return _flatten(
        rotate(_make_column(rotation).astype(np.int32), normalize_sums(_make_column(sums)))
    )


def _compute_weight_from_counts(zeros: int, ones: int) -> int:
    return int(_make_counts((zeros, ones)).compute_weights(_MODEL, np.array([0]))[0])


def _add_plane_to_counts(counts_before: list[int], zeros: int, ones: int) -> list[int]:
    counts = _make_counts(tuple(counts_before))
    counts.add_bits(_MODEL, np.array([0]), np.array([zeros]), np.array([ones]))
    return _flatten(counts.look_up_counts(_MODEL, np.array([0])))


def _make_counts(counted_bits: tuple[int, ...]) -> ContextCounts:
    counts = ContextCounts()
    counts.add_bits(_MODEL, np.array([0]), np.array([counted_bits[0]]), np.array([counted_bits[1]]))
    return counts


def _decode_bits(words: list[int], weights: list[int]) -> list[int]:
    bit_decoder = make_bit_decoder(np.array(words, dtype=np.uint32))
    bits = [int(bit_decoder.take(1, weight)[0]) for weight in weights]
    bit_decoder.finish()
    return bits


def _make_plane_reader(words: list[int]) -> PlaneReader:
    return PlaneReader(Section(np.array(words, dtype=np.uint32)), ContextCounts())


def _make_value_unit(code_values: Callable[..., Int64]) -> Callable[..., list[int]]:
    def decode_values(words: list[int], contexts: list[int], width: int) -> list[int]:
        reader, context_array = _make_plane_reader(words), np.array(contexts, dtype=np.int64)
        numbers = code_values(reader, _MODEL, context_array, width, np.zeros_like(context_array))
        reader.finish()
        return _flatten(numbers)

    return decode_values


def _read_ascending(words: list[int], count: int) -> list[int]:
    reader = _make_plane_reader(words)
    numbers = code_ascending(reader, _MODEL, np.zeros(count, dtype=np.int64))
    reader.finish()
    return _flatten(numbers)


def _dequantize_opacity(code: int, step: str) -> str:
    step_value = np.array([int(step, 16)], dtype="<u4").view("<f4")[0]
    header = StreamHeader(sh_degree=0, opacity_step=float(step_value))
    scene = _make_scene(header, [0], [[0, 0, 0]], opacities=code)
    return f"{dequantize(scene).opacities.astype('<f4').view('<u4')[0]:08x}"


def _compute_digests(
    phase: int, ids: list[int], *, positions: list[Any], rotations: list[Any], codes: list[Any]
) -> dict[str, Any]:
    position_planes, rotation_planes = (
        np.array(field, dtype=np.int32).T for field in (positions, rotations)
    )
    code_planes = np.array(codes, dtype=np.int16).T
    sh_degree = int(len(codes[0]) > StreamHeader(sh_degree=0).code_planes)
    header = StreamHeader(sh_degree=sh_degree)
    scene = Scene(
        header,
        phase,
        phase,
        np.array(ids, dtype=np.int64),
        position_planes,
        rotation_planes,
        code_planes,
    )
    return {
        "crc_all": compute_state_crc(scene, all_fields=True),
        "crc_without_codes": compute_state_crc(scene, all_fields=False),
        "sha256": compute_digest(scene),
    }


UNITS: dict[str, Callable[..., _JsonValue]] = {
    "crc": _compute_crc,
    "divide_round": _divide_round,
    "isqrt": lambda v: int(arithmetic.isqrt(np.array([int(v)]))[0]),
    "bit_length": lambda v: int(arithmetic.bit_length(np.array([int(v)]))[0]),
    "morton": lambda position: int(interleave(_make_column(position))[0]),
    "dequantize": _dequantize_opacity,
    "normalize": lambda vector: _flatten(normalize_sums(_make_column(vector))),
    "expand": _expand_rotation,
    "turn": _rotate,
    "philox": _philox,
    "anchor_counts": _count_anchors,
    "sample": _sample_anchors,
    "bind": _bind_positions,
    "deaths": _choose_deaths,
    "weight_of_code": weight_of_probability_code,
    "weight_by_counts": _compute_weight_from_counts,
    "counts": lambda before, plane: _add_plane_to_counts(before, *plane),
    "decode_bits": _decode_bits,
    "fixed": _make_value_unit(values.code_fixed),
    "unsigned": _make_value_unit(values.code_unsigned),
    "signed": _make_value_unit(values.code_signed),
    "ascending": _read_ascending,
    "digest": _compute_digests,
}
