import pytest

from quarc_ref.inspection.stolen_time import ProcessorTime, read_processor_time

STATISTICS = "cpu  100 20 30 4000 5 6 7 50 8 9\ncpu0 1 2 3 4 5 6 7 8 9 10\n"


def test_waiting_for_a_disk_or_for_work_does_not_count_as_work(tmp_path):
    path = tmp_path / "stat"
    path.write_text(STATISTICS)

    assert read_processor_time(path) == ProcessorTime(busy=163, stolen=50)


@pytest.mark.parametrize("text", ["", "cpu 1 2 3 4", "cpu a b c d e f g h"])
def test_a_system_without_this_information_is_supported(tmp_path, text):
    path = tmp_path / "stat"
    path.write_text(text)

    assert read_processor_time(path) is None
    assert read_processor_time(tmp_path / "missing") is None


def test_the_share_is_relative_to_the_time_needed():
    earlier = ProcessorTime(busy=1000, stolen=100)

    assert ProcessorTime(1300, 200).stolen_share(earlier) == 0.25
    assert earlier.stolen_share(earlier) == 0
