import csv
import io

from rate.claims import Claim
from rate.hull import Point
from rate.rows import Row
from rate.tables import (
    format_claims,
    format_csv,
    format_points,
    format_rows,
    list_claim_records,
    list_point_records,
    list_row_records,
)

ROWS = [
    Row("plane", "main", "the file", 2048, 3072, 0, 512, 0, 512, 5632, 30.0, 29.5),
    Row("plane", "main", "SOG", remark="unavailable: npm is not installed"),
]
CLAIMS = {"plane": [Claim("less", 0.5, 0.6), Claim("more", 1.0, 2.0, False), Claim("?", None, 1)]}
POINTS = {"plane": [Point("", 2.0, 30.0), Point("rd_lambda=2", 1.0, 28.0), Point("x", 3, 29)]}


def _split_cells(table):
    return [[cell.strip() for cell in line.split("|")[1:-1]] for line in table.splitlines()]


def test_sizes_are_in_kilobytes_and_motion_per_moved_frame():
    header_cells, separator_cells, file_cells, missing_cells = _split_cells(
        format_rows(ROWS, {("plane", "main"): 3})
    )

    assert len(header_cells) == len(separator_cells) == len(file_cells) == len(missing_cells)
    assert file_cells[3:11] == [
        "2.0",
        "0.0",
        "1.000",
        "0.167",
        "0.000",
        "0.50",
        "5.5",
        "30.00 / 29.50",
    ]
    assert missing_cells[3:11] == [""] * 8
    assert missing_cells[11] == "unavailable: npm is not installed"


def test_a_stream_without_moved_frames_has_no_figures_per_frame():
    file_cells = _split_cells(format_rows(ROWS[:1], {("plane", "main"): 0}))[2]

    assert file_cells[3:7] == ["2.0", "0.0", "", ""]


def test_claims_say_whether_they_hold():
    _, _, *lines = _split_cells(format_claims(CLAIMS))

    assert lines == [
        ["plane", "less", "0.500", "at most 0.6", "yes"],
        ["plane", "more", "1.000", "at least 2", "**no**"],
        ["plane", "?", "", "at most 1", "not measured"],
    ]


def test_points_say_whether_they_are_on_the_hull():
    _, _, *lines = _split_cells(format_points(POINTS))

    assert [(line[1], line[4]) for line in lines] == [
        ("the default", "yes"),
        ("rd_lambda=2", "yes"),
        ("x", ""),
    ]


def test_records_survive_a_round_trip_through_csv():
    for records in (list_row_records(ROWS), list_claim_records(CLAIMS), list_point_records(POINTS)):
        read_records = list(csv.DictReader(io.StringIO(format_csv(records).decode())))

        expected = [
            {key: "" if value is None else str(value) for key, value in record.items()}
            for record in records
        ]
        assert read_records == expected


def test_no_records_make_an_empty_csv():
    assert format_csv([]) == b"\n"
