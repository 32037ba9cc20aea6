"""Every number that the trainer chooses, with the paper's value and its place.

A frozen tree of settings; `presets` names whole trees, `--set motion.rate=5e-4`
changes one leaf. What a stream must carry goes into its header from here.
"""

from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Literal

from quarc_ref.encoder.settings.ranges import (
    Amount,
    Checked,
    Count,
    Logit,
    Positive,
    Quality,
    Seed,
    Share,
    Some,
)
from quarc_ref.format import container
from quarc_ref.format.constants import LEVELS
from quarc_ref.format.records import StreamHeader

Price = Literal["l1", "group_log"]
Placement = Literal["gate", "errors"]
WarmStart = Literal["anchors", "projection"]


@dataclass(frozen=True, slots=True)
class StepSettings(Checked):
    """Steps by the capture's own measure (ours), as wide as it is at the scene.

    Attributes:
        position_pixels: Step of canonical and newborn positions; 0 leaves it as
            `stream` has it, in world units (paper).
        translation_change: Step of translation residuals: as far as the pictures
            of frame 0 must shift to change by so much in the mean, in shares of
            white, but at most a pixel; 0 as above.
    """

    position_pixels: Amount = 0.0
    translation_change: Amount = 0.0


@dataclass(frozen=True, slots=True)
class CanonicalSettings(Checked):
    """Canonical frames: training of frame 0 (method of 3DGS; paper section 3), and when again.

    Attributes:
        every: Frames from a canonical frame to the next, which is a point of
            random access; 0 for frame 0 alone (paper).
        snapshot_every: Frames from a snapshot to the next (ours; SPEC 7.9): a point of random
            access as well, coded against the last canonical frame that is none; 0 for none.
        iterations: Paper 15 000.
        initial_gaussians: Initial points taken, at most; the paper takes all.
        max_gaussians: Bound on their number; the paper has none.
        sh_from: Iteration at which SH degree 1 joins (1000).
        dssim: Weight of D-SSIM in the loss, the rest is L1 (0.2).
        noise: Deviation of the noise on positions, world units (0.01).
        axis_noise: Deviation of more noise, along each Gaussian's own axes, in its
            scales; it falls evenly to 0 where fine-tuning begins (ours).
        densify_from: First iteration of densification (500).
        densify_until: Last (5000).
        densify_every: Iterations between two (100).
        densify_gradient: Least mean screen gradient of a Gaussian that is
            cloned or split, NDC (2e-4).
        densify_scale: Scale above which it is split, share of the extent (0.01).
        prune_opacity: Opacity below which a Gaussian goes (0.005).
        keep_opacity: Opacity below which a Gaussian goes when all is trained (0.005).
        halved_until: Iteration up to which pictures have half their width and
            height, while Gaussians are still many to a pixel (0).
        exposure_rate: Share of the way that a camera's gains go in a step to what
            the step finds; 0 takes all cameras for alike (paper).
        exposure_from: Iteration at which that begins.
        opacity_decay: Share of its opacity that a Gaussian loses in every step that
            draws it, from the first densification to fine-tuning (ours; 4C4D: 0.001).
        opacity_price: Weight of the mean opacity in the loss (ours; 3DGS-MCMC: 0.01).
        scale_price: Weight of the mean scale, world units (ours; 3DGS-MCMC: 0.01).
        quantize_from: Share of the iterations after which all pass through
            the quantizer, which is fine-tuning (ours).
        gaussian_price: Squared change of a picture that a Gaussian must be good for
            to stay after densification, and half of it halfway, in medians over the
            Gaussians of the squared error where one shows; 0 keeps all (paper).
        code_price: Weight of the nats that the codes of a Gaussian take, its position
            and opacity left out, in shares of the loss (ours).
        rate_end: Share of the learning rates at the last iteration, by cosine
            over fine-tuning (1).
        position_rate: First learning rate of positions, times the extent (1.6e-4).
        position_rate_end: Last (1.6e-6).
        sh_dc_rate: Learning rate (2.5e-3).
        sh_rest_rate: Learning rate (2.5e-3 / 20).
        opacity_rate: Learning rate (0.05).
        scale_rate: Learning rate (5e-3).
        rotation_rate: Learning rate (1e-3).
    """

    every: Count = 0
    snapshot_every: Count = 0
    iterations: Some = 15_000
    initial_gaussians: Some = 1 << 20
    max_gaussians: Some = 1 << 20
    sh_from: Count = 1000
    dssim: Share = 0.2
    noise: Amount = 0.01
    axis_noise: Amount = 0.0
    densify_from: Count = 500
    densify_until: Count = 5000
    densify_every: Some = 100
    densify_gradient: Amount = 2e-4
    densify_scale: Amount = 0.01
    prune_opacity: Share = 0.005
    keep_opacity: Share = 0.005
    halved_until: Count = 0
    exposure_rate: Share = 0.0
    exposure_from: Count = 200
    opacity_decay: Share = 0.0
    opacity_price: Amount = 0.0
    scale_price: Amount = 0.0
    quantize_from: Share = 0.8
    gaussian_price: Amount = 0.0
    code_price: Amount = 0.0
    rate_end: Share = 1.0
    position_rate: Positive = 1.6e-4
    position_rate_end: Positive = 1.6e-6
    sh_dc_rate: Amount = 2.5e-3
    sh_rest_rate: Amount = 2.5e-3 / 20
    opacity_rate: Amount = 0.05
    scale_rate: Amount = 5e-3
    rotation_rate: Amount = 1e-3

    def kind_due(self, frame: int) -> bytes:
        """Return the type of the chunk that a frame is to have."""
        if frame == 0 or (self.every and frame % self.every == 0):
            return container.CANO
        if self.snapshot_every and frame % self.snapshot_every == 0:
            return container.SNAP
        return container.FRAM


@dataclass(frozen=True, slots=True)
class MotionSettings(Checked):
    """Stage 1 of a frame: the anchors' residuals.

    Attributes:
        iterations: Paper 100.
        rate: Learning rate of residuals at level 1, world units (5e-4).
        step_rate: That of translations, in their steps, so that it follows from
            the capture as they do (ours); 0 for `rate`.
        level_rate: Factor of the rate from a level to the next coarser (1).
        rate_end: Share of the rate at the last iteration, by cosine (1).
        dssim: Weight of D-SSIM in the loss, the rest is L1 (0.2).
        price: What residuals cost: `l1`, the mean of their magnitudes in units
            (paper), or `group_log`, the mean over anchors of
            ln(1 + norm of the anchor's symbols).
        price_weight: Of the price in the loss (1 with `l1`); that of `group_log` in
            shares of the loss that frame 0 has when it is decoded.
        warm_start: Where residuals start: `anchors`, the last frame's residual
            of the anchor, or of its three nearest (paper), or `projection`,
            each Gaussian's last motion handed down from coarse to fine.
        momentum: Share of the last motion that is taken over (0.6).
    """

    iterations: Count = 100
    rate: Amount = 5e-4
    step_rate: Amount = 0.0
    level_rate: Amount = 1.0
    rate_end: Share = 1.0
    dssim: Share = 0.2
    price: Price = "l1"
    price_weight: Amount = 1.0
    warm_start: WarmStart = "anchors"
    momentum: Amount = 0.6


@dataclass(frozen=True, slots=True)
class BirthSettings(Checked):
    """Stage 2 of a frame: new Gaussians where the change gate opens.

    Attributes:
        iterations: Paper 100; 0 leaves the stage out.
        placement: Where newborn start: `gate`, clones that the change gate lets
            through (paper), or `errors`, on the pixels farthest from the truth.
        gate_views: Training views of the change gate (4); 0 leaves it open.
        gradient: Least gated statistic of a parent, NDC (1.5e-4).
        error: Least error of a pixel that gets a newborn, mean over its colors.
        error_reach: Pixels to each side among which such a pixel must be the worst.
        deaths_below: Opacity below which a Gaussian may die for a newborn; at 1
            all may, so that their number stays what it was (paper).
        max_births: Bound on the newborn of a frame; the paper has none.
        parent_scale: Largest scale of a parent, share of the extent (0.01).
        spread: Deviation of a newborn's place, in scales of its parent (2).
        opacity_logit: At birth (0.1).
        rate_factor: Of the canonical learning rates (15).
        rate_end: Share of the rates at the last iteration, by cosine (1).
        split_at: Iterations at which large newborn are split (40, 80).
        prune_opacity: Opacity below which a newborn goes (0.01).
        prune_radius: Screen radius above which it goes, pixels (20).
        prune_scale: Scale above which it goes, share of the extent (0.1).
        must_pay: Keep the newborn only if the training views gain by them (ours).
        byte_price: What a byte of newborn must take off the mean loss of the
            training views, in shares of the loss that frame 0 has when it is
            decoded, times the number of Gaussians (ours).
    """

    iterations: Count = 100
    placement: Placement = "gate"
    gate_views: Count = 4
    gradient: Amount = 1.5e-4
    error: Amount = 0.08
    error_reach: Count = 1
    deaths_below: Share = 1.0
    max_births: Count = 1 << 12
    parent_scale: Amount = 0.01
    spread: Amount = 2.0
    opacity_logit: Logit = 0.1
    rate_factor: Amount = 15.0
    rate_end: Share = 1.0
    split_at: tuple[int, ...] = (40, 80)
    prune_opacity: Share = 0.01
    prune_radius: Amount = 20.0
    prune_scale: Amount = 0.1
    must_pay: bool = False
    byte_price: Amount = 0.0


@dataclass(frozen=True, slots=True)
class UpdateSettings(Checked):
    """Updates of single Gaussians, in streams that have them (ours; SPEC 7.8).

    Attributes:
        rate: Learning rate of residuals, in their steps; 0 leaves updates out.
        price_weight: Of the mean over Gaussians of ln(1 + norm of its residuals in steps)
            in the loss, in shares of the loss that frame 0 has when it is decoded.
        chosen_at: Share of the iterations after which updates are chosen.
        least_gain: What an update must take off the mean loss of the training views, in
            shares of the loss that frame 0 has, times the number of Gaussians.
        dies_below: Opacity below which a Gaussian that an update fades leaves.
    """

    rate: Amount = 0.12
    price_weight: Amount = 0.2
    chosen_at: Share = 0.5
    least_gain: Amount = 0.5
    dies_below: Share = 0.02


@dataclass(frozen=True, slots=True)
class EncoderConfig(Checked):
    """All settings of an encode.

    Attributes:
        stream: What the header carries. Clock, level and seed are set by the
            encoder.
        steps: What of it is to follow from the capture.
        canonical: Of frame 0.
        motion: Of stage 1 of every later frame.
        updates: Of single Gaussians, with stage 1, where `stream.updates` is set.
        births: Of stage 2.
        quality: The dial of quality against bytes, 0 to 100 (`--quality`): 20 more
            halve every price on bytes.
        rate_weight: Bytes are so many times as dear as the other settings say:
            the factor of every price on them (`--lambda`).
        target_kb_per_frame: KB (1024 bytes) that a frame after the canonical one
            is to have in the mean; 0 for no target.
        seed: Of every draw: sampler, views, noise, places of the newborn.
    """

    stream: StreamHeader = field(default_factory=StreamHeader)
    steps: StepSettings = field(default_factory=StepSettings)
    canonical: CanonicalSettings = field(default_factory=CanonicalSettings)
    motion: MotionSettings = field(default_factory=MotionSettings)
    updates: UpdateSettings = field(default_factory=UpdateSettings)
    births: BirthSettings = field(default_factory=BirthSettings)
    quality: Quality = 50.0
    rate_weight: Positive = 1.0
    target_kb_per_frame: Amount = 0.0
    seed: Seed = 0


def make_header(
    config: EncoderConfig, frames_per_second: float, gaussian_count: int
) -> StreamHeader:
    """Return the header of a stream.

    Args:
        config: Its `stream` is carried over, but for clock, level, seed and snapshots.
        frames_per_second: Of the capture.
        gaussian_count: Of the canonical frame; the level also bears its births.
    """
    clock = Fraction(frames_per_second).limit_denominator(_CLOCK_LIMIT)
    most = gaussian_count + config.births.max_births
    return replace(
        config.stream,
        level=min(level for level, limits in LEVELS.items() if most <= limits.gaussians),
        timescale=clock.numerator,
        frame_ticks=clock.denominator,
        seed=config.seed,
        snapshots=config.canonical.snapshot_every > 0,
    )


_CLOCK_LIMIT = 1001
