import pytest
import torch

from quarc_ref.encoder.training.torch_settings import fixed_torch_settings


def _sum_in_pieces(threads):
    """Return the thread count within the context, and a sum that depends on the count."""
    torch.set_num_threads(threads)
    numbers = torch.rand(1 << 20, generator=torch.Generator().manual_seed(0))
    with fixed_torch_settings():
        return torch.get_num_threads(), float(numbers.sum())


@pytest.fixture(autouse=True)
def _restore_thread_count():
    thread_count = torch.get_num_threads()
    yield
    torch.set_num_threads(thread_count)


def test_sums_do_not_depend_on_the_threads_of_torch():
    assert len({_sum_in_pieces(threads) for threads in (1, 2, 3, 4)}) == 1


def test_the_threads_of_torch_are_restored():
    torch.set_num_threads(3)
    with pytest.raises(KeyboardInterrupt), fixed_torch_settings():
        raise KeyboardInterrupt

    assert torch.get_num_threads() == 3


def test_convolutions_do_not_use_tf32():
    with fixed_torch_settings():
        assert not torch.backends.cudnn.allow_tf32

    assert torch.backends.cudnn.allow_tf32
