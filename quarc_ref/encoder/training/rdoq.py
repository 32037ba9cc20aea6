"""Chooses the codes of rotations and SH DC by rate and distortion (RDOQ).

Otherwise, every value is rounded to the nearest code. Many Gaussians are so small, faint or round
that other codes give nearly the same pictures, and some of these codes take fewer bits. As in video
encoders, the codes are therefore chosen to minimize distortion plus weighted rate. This happens in
the middle of fine-tuning, so that the remaining iterations adapt all attributes to the choice.

The rate of a code depends on its frequency (`code_rates`); distortion is the squared change of the
pictures (`sensitivity`).
"""

from dataclasses import replace
from functools import partial

import numpy as np
import torch
from numpy.typing import NDArray

from quarc_ref.encoder.rotations import (
    Float64,
    code_quaternions,
    conjugate,
    decode_quaternions,
    multiply,
    rotations_between,
)
from quarc_ref.encoder.training.axes import rename_axes
from quarc_ref.encoder.training.canonical_objective import CanonicalObjective
from quarc_ref.encoder.training.code_rates import CodeRates
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.minimize_costs import Measure, minimize_costs
from quarc_ref.encoder.training.sensitivity import measure_sensitivities
from quarc_ref.encoder.training.trainable import Attributes, Trainer, to_columns, to_rows
from quarc_ref.format.arrays import Int64
from quarc_ref.format.constants import CODE_LIMIT
from quarc_ref.format.errors import EncodeError
from quarc_ref.format.records import StreamHeader

_MIN_COSINE = 0.3  # of half an angle; limits the tangents of large rotations
_CHANGES = (-1, 1, -2, 2)


def choose_codes(
    trainer: Trainer,
    context: TrainingContext,
    objective: CanonicalObjective,
    generator: torch.Generator,
) -> None:
    """Change axes, rotations and SH DC of Gaussians in training so that they take fewer bits.

    Args:
        trainer: Trainer; its Gaussians are modified in place.
        context: Training context, whose training views are rendered.
        objective: Quantization steps and weights.
        generator: Random generator of the pixel signs.

    Raises:
        EncodeError: A rotation, a log-scale or SH DC is not finite, or out of the format's range.
    """
    header = objective.header
    _require_codable(trainer.attributes.detached(), header)
    attributes, axes = rename_axes(trainer.attributes.detached(), header)
    sensitivities = measure_sensitivities(context, attributes.quantized(header), generator)
    rd_lambda = objective.quantize_rd_lambda * sensitivities.median_error
    rotations = choose_rotations(
        to_columns(attributes.rotations), sensitivities.rotations, header.rotation_bits, rd_lambda
    )
    sh_dc = choose_colors(
        to_columns(attributes.sh_dc), sensitivities.colors, header.sh_dc_step, rd_lambda
    )
    chosen = replace(
        attributes,
        rotations=to_rows(rotations, attributes.rotations),
        sh_dc=to_rows(sh_dc, attributes.sh_dc),
    )
    trainer.replace_codes(chosen, axes)


def _require_codable(attributes: Attributes, header: StreamHeader) -> None:
    """Raise EncodeError if a code whose rate is estimated would be out of range."""
    codes = (
        torch.nn.functional.normalize(attributes.rotations.double(), dim=1),
        attributes.log_scales / header.log_scale_step,
        attributes.sh_dc / header.sh_dc_step,
    )
    if not all(bool((code.abs() <= CODE_LIMIT).all()) for code in codes):  # false for NaN
        message = (
            f"an attribute of the first frame is not finite or exceeds {CODE_LIMIT} steps: "
            "training diverged, or a quantization step is too small"
        )
        raise EncodeError(message)


def choose_rotations(
    quaternions: Float64, forms: Float64, rotation_bits: int, rd_lambda: float
) -> Float64:
    """Return quaternions `[4, n]` whose codes have the least distortion plus weighted rate.

    Quaternions whose nearest code is the best are returned unchanged.

    Args:
        quaternions: `[4, n]` quaternions of any norm.
        forms: `[n, 3, 3]` sensitivities of the rotations (see `Sensitivities`).
        rotation_bits: Fraction bits of the codes.
        rd_lambda: Squared change of a picture that is worth a bit.
    """
    norms = np.linalg.norm(quaternions, axis=0)
    nearest_codes = code_quaternions(quaternions / norms, rotation_bits)
    nearest = decode_quaternions(nearest_codes, rotation_bits)

    def measure_distortions(codes: Int64) -> Float64:
        is_valid = (codes[1:] ** 2).sum(axis=0) <= 1 << (2 * rotation_bits)  # [7.2-6]
        expanded = decode_quaternions(np.where(is_valid, codes, nearest_codes), rotation_bits)
        differences = rotations_between(nearest, expanded)
        changes = differences[1:] / differences[0].clip(_MIN_COSINE)
        distortions = _evaluate_forms(forms, changes)
        distortions[~is_valid] = np.inf
        return distortions

    def remove_twist(codes: Int64, axis: int) -> Int64:
        untwisted = _remove_twist(decode_quaternions(codes, rotation_bits), axis)
        return code_quaternions(untwisted, rotation_bits)

    moves = [partial(remove_twist, axis=axis) for axis in range(3)]
    moves += [partial(_add, rows=[row], change=change) for row in (1, 2, 3) for change in _CHANGES]
    moves += [partial(_zero, row=row) for row in (1, 2, 3)]
    codes = minimize_costs(
        nearest_codes, moves, measure_distortions, lambda codes: CodeRates(codes).bits, rd_lambda
    )
    is_changed = (codes != nearest_codes).any(axis=0)
    return np.where(is_changed, decode_quaternions(codes, rotation_bits) * norms, quaternions)


def choose_colors(sh_dc: Float64, forms: Float64, step: float, rd_lambda: float) -> Float64:
    """Return SH DC coefficients `[3, n]` whose codes have the least distortion plus weighted rate.

    Coefficients whose nearest code is the best are returned unchanged.

    Args:
        sh_dc: `[3, n]` coefficients of red, green and blue.
        forms: `[n, 3, 3]` sensitivities of the colors (see `Sensitivities`).
        step: Quantization step.
        rd_lambda: Squared change of a picture that is worth a bit.
    """
    nearest_codes = np.rint(sh_dc / step).astype(np.int64)

    def measure_distortions(codes: Int64) -> Float64:
        return _evaluate_forms(forms, (codes - nearest_codes) * step)

    moves = [
        partial(_add, rows=rows, change=change)
        for rows in ([0], [1], [2], [0, 1, 2])
        for change in (-1, 1)
    ]
    codes = minimize_costs(nearest_codes, moves, measure_distortions, _fit_color_rates, rd_lambda)
    return np.where(codes != nearest_codes, codes * step, sh_dc)


def _evaluate_forms(forms: Float64, changes: NDArray[np.floating]) -> Float64:
    """Return the `[n]` values of quadratic forms `[n, k, k]` for changes `[k, n]`."""
    values: Float64 = np.einsum("in,nij,jn->n", changes, forms, changes)
    return values


def _remove_twist(quaternions: Float64, axis: int) -> Float64:
    """Return unit quaternions `[4, n]` without their rotation about an axis of the Gaussian."""
    twists = np.zeros_like(quaternions)
    twists[[0, 1 + axis]] = quaternions[[0, 1 + axis]]
    norms = np.linalg.norm(twists, axis=0)
    twists[0, norms == 0] = 1
    return multiply(quaternions, conjugate(twists / np.where(norms, norms, 1)))


def _add(codes: Int64, rows: list[int], change: int) -> Int64:
    changed = codes.copy()
    changed[rows] += change
    return changed


def _zero(codes: Int64, row: int) -> Int64:
    changed = codes.copy()
    changed[row] = 0
    return changed


def _fit_color_rates(codes: Int64) -> Measure:
    rates = CodeRates(_subtract_green(codes))
    return lambda others: rates.bits(_subtract_green(others))


def _subtract_green(codes: Int64) -> list[Int64]:
    """Return green, red minus green, and blue minus green, as in a canonical frame (SPEC 8.5)."""
    red, green, blue = codes
    return [green, red - green, blue - green]
