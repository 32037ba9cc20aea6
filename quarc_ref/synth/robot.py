"""A robot that steps from side to side, looks around and waves."""

import math
from typing import NamedTuple

import numpy as np

from quarc_ref.synth import texture_kernels as patterns
from quarc_ref.synth.paints import Paint, Palette, mix
from quarc_ref.synth.solids import (
    Matrix,
    Solid,
    ball,
    capsule,
    cylinder,
    ellipsoid,
    rotate_x,
    rotate_y,
    rotate_z,
    translate,
)
from quarc_ref.synth.toys import wave

_STEP_SECONDS = 0.8
_THIGH_LENGTH = 0.21
_HIP_HEIGHT = 0.42
_ANKLE_HEIGHT = 0.07


class _Paints(NamedTuple):
    body: Paint
    face: Paint
    limb: Paint
    joint: Paint
    tip: Paint


def make_robot(time: float, phase: float, palette: Palette) -> list[list[Solid]]:
    """Return the solids of the robot at a time in seconds, grouped into lower and upper body."""
    paints = _choose_paints(time, phase, palette)
    stride = wave(time, _STEP_SECONDS, phase)
    body_pose = translate(0.13 * wave(time, 1.6, phase), 0.0, -0.2) @ rotate_y(
        0.6 * wave(time, 2.4, phase)
    )
    hips = (
        body_pose @ translate(0.0, _HIP_HEIGHT + 0.03 * abs(stride), 0.0) @ rotate_z(-0.05 * stride)
    )
    legs = [solid for side in (-1, 1) for solid in _make_leg(body_pose, hips, side, stride, paints)]
    pelvis = ellipsoid(hips, (0.16, 0.1, 0.13), paints.joint)
    torso = hips @ translate(0.0, 0.25, 0.0) @ rotate_z(0.1 * stride)
    upper_body = [
        ellipsoid(torso, (0.21, 0.25, 0.17), paints.body),
        *_make_head(torso, time, phase, paints),
        *_make_waving_arm(torso, time, phase, paints),
        *_make_swinging_arm(torso, stride, paints),
    ]
    return [[*legs, pelvis], upper_body]


def _choose_paints(time: float, phase: float, palette: Palette) -> _Paints:
    first, second = palette.toy_colors[4], palette.toy_colors[2]
    metal = mix(palette.light, palette.toy_colors[4], 0.25)
    pulse = 0.6 + 0.6 * wave(time, 0.8, phase)
    return _Paints(
        body=Paint(patterns.CHEST, first, palette.light, second, gloss=0.25),
        face=Paint(patterns.FACE, metal, palette.toy_colors[0], palette.dark, gloss=0.2),
        limb=Paint(patterns.STRIPES, metal, first, first, 2.6, 0.5, 0.2),
        joint=Paint(patterns.PLAIN, palette.toy_colors[0], first, first, 0.2, phase, 0.25),
        tip=Paint(patterns.PLAIN, second, second, second, 0.2, glow=pulse),
    )


def _make_leg(
    body_pose: Matrix, hips: Matrix, side: int, stride: float, paints: _Paints
) -> list[Solid]:
    lift = 0.12 * max(0.0, side * stride)
    hip = hips @ translate(0.1 * side, -0.02, 0.0)
    ankle = body_pose @ translate(0.12 * side, _ANKLE_HEIGHT + lift, 0.5 * lift)
    knee = _bend_knee(body_pose, hip, ankle)
    foot = ellipsoid(ankle @ translate(0.0, -0.01, 0.05), (0.085, 0.06, 0.13), paints.joint)
    return [
        capsule(hip, knee, 0.058, paints.limb),
        capsule(knee, ankle, 0.052, paints.limb),
        foot,
    ]


def _bend_knee(body_pose: Matrix, hip: Matrix, ankle: Matrix) -> Matrix:
    """Return the knee's position: in front of hip and ankle, one thigh length away from each."""
    hip_to_ankle = ankle[:3, 3] - hip[:3, 3]
    knee_offset = math.sqrt(max(_THIGH_LENGTH**2 - float(hip_to_ankle @ hip_to_ankle) / 4, 0.0))
    forward = body_pose[:3, 2] - hip_to_ankle * float(body_pose[:3, 2] @ hip_to_ankle) / float(
        hip_to_ankle @ hip_to_ankle
    )
    return translate(
        *(hip[:3, 3] + hip_to_ankle / 2 + knee_offset * forward / np.linalg.norm(forward))
    )


def _make_head(torso: Matrix, time: float, phase: float, paints: _Paints) -> list[Solid]:
    head_rotation = rotate_y(0.35 * wave(time, 1.9, phase)) @ rotate_z(
        0.12 * wave(time, 1.3, phase)
    )
    head = torso @ translate(0.0, 0.24, 0.0) @ head_rotation @ translate(0.0, 0.2, 0.0)
    ears = [
        cylinder(
            head @ translate(0.2 * side, 0.0, 0.0) @ rotate_z(math.pi / 2), 0.06, 0.03, paints.joint
        )
        for side in (-1, 1)
    ]
    return [
        capsule(
            torso @ translate(0.0, 0.2, 0.0), head @ translate(0.0, -0.1, 0.0), 0.06, paints.limb
        ),
        ellipsoid(head, (0.21, 0.18, 0.18), paints.face),
        *ears,
        capsule(
            head @ translate(0.0, 0.16, 0.0), head @ translate(0.0, 0.27, 0.0), 0.018, paints.limb
        ),
        ball(head @ translate(0.0, 0.29, 0.0), 0.045, paints.tip),
    ]


def _make_waving_arm(torso: Matrix, time: float, phase: float, paints: _Paints) -> list[Solid]:
    swing = wave(time, 0.85, phase)
    shoulder = torso @ translate(0.21, 0.12, 0.0) @ rotate_z(2.0 + 0.12 * swing)
    return _make_arm(shoulder, rotate_z(0.75 + 0.6 * swing), paints)


def _make_swinging_arm(torso: Matrix, stride: float, paints: _Paints) -> list[Solid]:
    shoulder = torso @ translate(-0.21, 0.12, 0.0) @ rotate_z(-0.45) @ rotate_x(0.5 * stride)
    return _make_arm(shoulder, rotate_x(-0.7 - 0.3 * stride), paints)


def _make_arm(shoulder: Matrix, elbow_rotation: Matrix, paints: _Paints) -> list[Solid]:
    elbow = shoulder @ translate(0.0, -0.21, 0.0)
    hand = elbow @ elbow_rotation @ translate(0.0, -0.21, 0.0)
    return [
        ball(shoulder, 0.075, paints.joint),
        capsule(shoulder, elbow, 0.047, paints.limb),
        capsule(elbow, hand, 0.043, paints.limb),
        ball(hand, 0.075, paints.joint),
    ]
