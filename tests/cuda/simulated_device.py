"""A simulated CUDA device, which tests code for GPUs on machines without one.

Its tensors claim to be on `cuda:0`, but their values are in main memory. Like a real device, it
rejects operations on tensors of different devices, and conversions to NumPy without `cpu()`. It
has no kernels and no speed of its own.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
import torch
from torch import Tensor
from torch.autograd import Function
from torch.overrides import TorchFunctionMode
from torch.utils._python_dispatch import TorchDispatchMode

_DEVICE = torch.device("cuda", 0)
_CPU = torch.device("cpu")
_COPIES = (torch.ops.aten._to_copy.default, torch.ops.aten.copy_.default)
_INDEXING = (
    torch.ops.aten.index.Tensor,
    torch.ops.aten.index_put.default,
    torch.ops.aten.index_put_.default,
)


class CudaTensor(Tensor):
    """A tensor on the simulated device.

    Autograd sees a tensor on torch's device `meta`, because this build of torch may lack CUDA.
    """

    values: Tensor

    @staticmethod
    def __new__(cls, values: Tensor) -> "CudaTensor":
        tensor = torch.Tensor._make_wrapper_subclass(
            cls,
            values.size(),
            strides=values.stride(),
            storage_offset=values.storage_offset(),
            dtype=values.dtype,
            device="meta",
        )
        tensor.values = values
        return tensor

    __torch_function__ = torch._C._disabled_torch_function_impl

    @property
    def device(self) -> torch.device:
        return _DEVICE

    @property
    def is_cuda(self) -> bool:
        return True

    def __repr__(self, **_: Any) -> str:
        return f"CudaTensor({self.values})"

    @classmethod
    def __torch_dispatch__(cls, func, types, args=(), kwargs=None):
        return _run(func, args, kwargs or {})


class _Upload(Function):
    """A copy from main memory to the device, with the gradient of the identity."""

    @staticmethod
    def forward(_: Any, values: Tensor) -> Tensor:
        return CudaTensor(values.detach().clone())

    @staticmethod
    def backward(_: Any, gradient: Tensor) -> Tensor:
        return gradient.cpu()


class _SimulatedDevice(TorchFunctionMode):
    """Handles what the dispatcher of torch does not see: devices, and access to values."""

    def __torch_function__(self, func, types, args=(), kwargs=None):
        kwargs = kwargs or {}
        first = args[0] if args else None
        if isinstance(first, CudaTensor) and func in _ACCESSES:
            return _ACCESSES[func](first, *args[1:], **kwargs)
        if func is Tensor.to and any(isinstance(other, CudaTensor) for other in args[1:]):
            args = (first, _DEVICE, args[1].dtype)
        has_device = any(map(_is_device, args)) or any(map(_is_device, kwargs.values()))
        if func is torch.device or not has_device:
            return func(*args, **kwargs)
        if isinstance(first, CudaTensor):
            args = [argument for argument in args if not _is_device(argument)]
            kwargs = {name: value for name, value in kwargs.items() if not _is_device(value)}
            return func(*args, **kwargs) if len(args) + len(kwargs) > 1 else first
        args = [_CPU if _is_device(argument) else argument for argument in args]
        kwargs = {name: _CPU if _is_device(value) else value for name, value in kwargs.items()}
        result = func(*args, **kwargs)
        if isinstance(first, Tensor):  # `to`
            return _Upload.apply(result)
        return CudaTensor(result.detach()).requires_grad_(result.requires_grad)


def _reject_numpy(_: CudaTensor) -> None:
    message = "can't convert cuda:0 device type tensor to numpy"
    raise TypeError(message)


def _create_like(tensor: CudaTensor, values: Any, **options: Any) -> CudaTensor:
    return CudaTensor(torch.tensor(values, **{"dtype": tensor.dtype, **options}))


_ACCESSES = {
    Tensor.numpy: _reject_numpy,
    Tensor.tolist: lambda tensor: tensor.values.tolist(),
    Tensor.new_tensor: _create_like,
}


class _CreatedTensors(TorchDispatchMode):
    """Puts the tensors that torch itself creates, such as scalars and zeros, on the device."""

    def __torch_dispatch__(self, func, types, args=(), kwargs=None):
        return _run(func, args, kwargs or {})


@contextmanager
def simulate_cuda(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Make the device `cuda` available within the context."""
    monkeypatch.setattr(torch.cuda, "synchronize", lambda _: None)
    with _SimulatedDevice(), _CreatedTensors():
        yield


def _run(func: Any, args: tuple[Any, ...], kwargs: dict[str, Any]) -> Any:
    """Run an operation in main memory; its results are on the device of its arguments."""
    inputs: list[Tensor] = []
    values = [_unwrap(argument, inputs) for argument in args]
    named_values = {name: _unwrap(value, inputs) for name, value in kwargs.items()}
    is_on_device = any(isinstance(tensor, CudaTensor) for tensor in inputs)
    if kwargs.get("device") is not None:
        is_on_device = kwargs["device"].type == "meta"
        named_values["device"] = _CPU
    elif is_on_device and func not in _COPIES:
        is_indexing = func in _INDEXING and isinstance(args[0], CudaTensor)
        _check_devices(func, inputs[:1] if is_indexing else inputs)
    result = func(*values, **named_values)
    if not is_on_device:
        return result
    changed = {}
    if func._schema.is_mutable:
        changed = {id(leaf.values): leaf for leaf in inputs if isinstance(leaf, CudaTensor)}
    return _wrap(result, changed)


def _unwrap(argument: Any, inputs: list[Tensor]) -> Any:
    """Return an argument with tensors in main memory, and append the original tensors to a list."""
    if isinstance(argument, list | tuple):
        return [_unwrap(item, inputs) for item in argument]
    if isinstance(argument, Tensor):
        inputs.append(argument)
    return argument.values if isinstance(argument, CudaTensor) else argument


def _wrap(result: Any, changed: dict[int, "CudaTensor"]) -> Any:
    """Return a result with tensors on the device; changed arguments are returned themselves."""
    if isinstance(result, list | tuple):
        return type(result)([_wrap(item, changed) for item in result])
    if isinstance(result, Tensor):
        return changed[id(result)] if id(result) in changed else CudaTensor(result)
    return result


def _check_devices(func: Any, tensors: list[Tensor]) -> None:
    """Reject tensors in main memory, except scalars."""
    if any(not isinstance(tensor, CudaTensor) and tensor.dim() > 0 for tensor in tensors):
        message = f"{func}: expected all tensors to be on the same device, cuda:0 and cpu"
        raise RuntimeError(message)


def _is_device(value: Any) -> bool:
    if isinstance(value, torch.device):
        return value.type == _DEVICE.type
    return isinstance(value, str) and value.split(":")[0] == _DEVICE.type
