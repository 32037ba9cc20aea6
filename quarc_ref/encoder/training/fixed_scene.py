"""The fixed scene behind new Gaussians, rendered once per view."""

from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.trainable import Attributes
from quarc_ref.rendering.rasterizer import Backdrop


class FixedScene:
    """Gaussians that are rendered once per view, whatever is added to them later.

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
        """The scene in a view."""
        if view not in self._seen:
            self._seen[view] = self._context.render_backdrop(self._drawn, view)
        return self._seen[view]
