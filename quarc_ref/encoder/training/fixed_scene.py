"""The fixed part of a scene, which is rendered once per view while new Gaussians are trained."""

from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.trainable import Attributes
from quarc_ref.rendering.rasterizer import Backdrop


class FixedScene:
    """Fixed Gaussians, whose rendering of each view is cached.

    Args:
        context: Views and renderer.
        attributes: Attributes of the Gaussians.

    Attributes:
        attributes: Attributes of the Gaussians.
    """

    def __init__(self, context: TrainingContext, attributes: Attributes) -> None:
        self.attributes = attributes
        self._context = context
        self._drawn = attributes.activated()
        self._seen: dict[int, Backdrop] = {}

    def backdrop(self, view: int) -> Backdrop:
        """Return the cached rendering of a view."""
        if view not in self._seen:
            self._seen[view] = self._context.render_backdrop(self._drawn, view)
        return self._seen[view]
