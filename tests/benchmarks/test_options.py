import argparse

import pytest

from options import make_pool, parse_count, parse_positive
from quarc_ref.jobs import WorkerPool


def test_numbers_from_the_minimum_on_are_accepted():
    assert (parse_count("0"), parse_positive("1"), parse_positive("30")) == (0, 1, 30)


@pytest.mark.parametrize(
    ("parse", "text", "minimum"),
    [(parse_count, "-1", 0), (parse_positive, "0", 1), (parse_positive, "many", 1)],
)
def test_other_numbers_and_texts_are_rejected(parse, text, minimum):
    message = f"'{text}' is not a whole number of at least {minimum}"

    with pytest.raises(argparse.ArgumentTypeError, match=message):
        parse(text)


@pytest.mark.parametrize(("device", "gpus"), [("cuda", 1.0), ("cpu", 0.0), ("auto", 0.0)])
def test_a_job_occupies_a_gpu_of_the_cluster_if_it_trains_on_cuda(device, gpus):
    options = argparse.Namespace(workers=2, threads=3, ray="auto", device=device)

    assert make_pool(options) == WorkerPool(2, 3, "auto", gpus)
