"""Adam with torch's fused kernel, without `torch.optim.Adam`.

That class calls the same kernel, but imports torch's compiler first, which takes two seconds.
"""

from collections.abc import Iterable

import torch
from torch import Tensor
from torch.optim.adam import adam

ADAM_EPSILON = 1e-15
ADAM_STATE_KEYS = ("step", "exp_avg", "exp_avg_sq")


class Adam:
    """Takes optimizer steps, and keeps their state.

    Attributes:
        state: State of each tensor that has taken a step, by the names in `ADAM_STATE_KEYS`.
    """

    def __init__(self) -> None:
        self.state: dict[Tensor, dict[str, Tensor]] = {}

    @torch.no_grad()
    def step(
        self,
        leaves: Iterable[Tensor],
        gradients: Iterable[Tensor | None],
        learning_rates: Iterable[float],
    ) -> None:
        """Take a step with a gradient and a learning rate for each leaf; None skips the leaf.

        On a CPU, the fused kernel ignores the strides of gradients. The gradients of tensors that
        were concatenated, such as `sh_dc` and `sh_rest`, are not contiguous, and must be copied.
        """
        for leaf, gradient, learning_rate in zip(leaves, gradients, learning_rates, strict=True):
            if gradient is None:
                continue
            if leaf not in self.state:
                self.state[leaf] = make_initial_state(leaf)
            state = self.state[leaf]
            adam(
                [leaf], [gradient.contiguous()], [state["exp_avg"]], [state["exp_avg_sq"]],
                [], [state["step"]], fused=True, amsgrad=False, beta1=0.9, beta2=0.999,
                lr=learning_rate, weight_decay=0, eps=ADAM_EPSILON, maximize=False,
            )  # fmt: skip


def make_initial_state(leaf: Tensor) -> dict[str, Tensor]:
    """Return the state of a tensor before its first step."""
    moments = (torch.zeros_like(leaf, requires_grad=False) for _ in range(2))
    return dict(zip(ADAM_STATE_KEYS, (torch.zeros((), device=leaf.device), *moments), strict=True))
