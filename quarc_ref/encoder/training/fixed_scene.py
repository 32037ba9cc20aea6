"""Fixed Gaussians, which are rendered once per view while new Gaussians are trained."""

from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.trainable import Attributes
from quarc_ref.rendering.rasterizer import Backdrop


class FixedScene:
    """Fixed Gaussians, and a cache of their rendering in each view.

    Args:
        context: Views and renderer.
        attributes: Attributes of the Gaussians.

    Attributes:
        attributes: Attributes of the Gaussians.
    """

    def __init__(self, context: TrainingContext, attributes: Attributes) -> None:
        self.attributes = attributes
        self._context = context
        self._gaussians = attributes.activated()
        self._backdrops: dict[int, Backdrop] = {}

    def backdrop(self, view: int) -> Backdrop:
        """Return the rendering of a view, which is computed only once."""
        if view not in self._backdrops:
            self._backdrops[view] = self._context.render_backdrop(self._gaussians, view)
        return self._backdrops[view]
