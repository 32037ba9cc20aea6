"""Ray-traces a synthetic capture of a playroom in the layout of Neural 3D Video.

    write_synthetic_capture(Path("playroom"), SynthOptions())

The room, its toys and their motions are closed-form functions of time, so all cameras show
exactly the same moving scene.
"""

from quarc_ref.synth.options import SynthOptions
from quarc_ref.synth.write_capture import fill_synthetic_capture, write_synthetic_capture

__all__ = ["SynthOptions", "fill_synthetic_capture", "write_synthetic_capture"]
