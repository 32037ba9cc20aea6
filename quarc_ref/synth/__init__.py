"""A synthetic capture: a playroom, ray-traced, in the layout of Neural 3D Video.

    write_synthetic_capture(Path("playroom"), SynthOptions())

The room, its toys and their motions are closed formulas of the time, so that
every frame of every camera shows one and the same scene.
"""

from quarc_ref.synth.options import SynthOptions
from quarc_ref.synth.write_capture import fill_synthetic_capture, write_synthetic_capture

__all__ = ["SynthOptions", "fill_synthetic_capture", "write_synthetic_capture"]
