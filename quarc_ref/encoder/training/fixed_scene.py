"""The scene that newborn come to, which stays as it is, and what each view sees of it."""

from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.trainable import Attributes
from quarc_ref.rendering.rasterizer import Backdrop


class FixedScene:
    """Gaussians that are drawn once for each view, however many come to them.

    Args:
        context: Views and renderer.
        attributes: Of the Gaussians.

    Attributes:
        attributes: Of the Gaussians.
    """

    def __init__(self, context: TrainingContext, attributes: Attributes) -> None:
        self.attributes = attributes
        self._context = context
        self._drawn = attributes.activated()
        self._seen: dict[int, Backdrop] = {}

    def backdrop(self, view: int) -> Backdrop:
        """Return what a view sees."""
        if view not in self._seen:
            self._seen[view] = self._context.render_backdrop(self._drawn, view)
        return self._seen[view]
