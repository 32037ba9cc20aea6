from encode import format_table
from steady_timer import SteadyTimer


def test_frames_are_counted_from_the_third_on():
    steady_timer = SteadyTimer()

    for stage, step in [("canonical", 1), ("canonical", 2), ("frames", 1), ("motion", 1)]:
        steady_timer.advance(stage, step, 2)
    assert steady_timer.canonical_seconds == 0
    for stage, step in [("frames", 2), ("motion", 1), ("motion", 2), ("frames", 3)]:
        steady_timer.advance(stage, step, 2)

    assert steady_timer.canonical_seconds > 0
    assert set(steady_timer.stage_timer.seconds) == {"anchors", "motion", "commit"}


def test_the_table_has_a_column_for_every_stage():
    row = {
        "capture": "plane",
        "gaussians": 12345,
        "seconds_canonical": 1.5,
        "seconds_per_frame": 2.25,
        "seconds_per_frame_by_stage": {"motion": 2.0, "births": 0.25},
    }

    header_line, separator, row_line = format_table(row).splitlines()

    assert header_line == (
        "| capture | Gaussians | seconds for frame 0 | seconds per frame | motion | births |"
    )
    assert separator.count("---") == 6
    assert row_line == "| plane | 12,345 | 1.50 | 2.25 | 2.00 | 0.25 |"
