import pytest

from paper.claims import list_claims


def _make_row(psnr, kilobytes=1.0, births=(0, 10, 10), label=""):
    return {
        "label": label,
        "quality": {"psnr": psnr},
        "bytes": {"kb_per_frame": kilobytes, "motion_kb_per_frame": kilobytes},
        "births": list(births),
    }


def _list_claims(name, *rows):
    rows_by_experiment = {name: {f"{number}": row for number, row in enumerate(rows)}}
    return [(round(claim.value, 6), claim.holds) for claim in list_claims(rows_by_experiment)]


def test_the_claim_about_quantization_holds_or_not():
    full_row, motion_row, float_row = _make_row(30.0), _make_row(30.02, 40), _make_row(30.04, 50)

    assert _list_claims("quantization", full_row, motion_row, float_row) == [
        (0.04, True),
        (0.02, True),
        (0.02, True),
    ]
    assert _list_claims("quantization", full_row, motion_row, _make_row(31, 2)) == [
        (1, False), (0.5, False), (0.02, True),
    ]  # fmt: skip


def test_the_claim_about_the_gate_holds_or_not():
    gate_row, no_gate_row = _make_row(30.0, births=(0, 4, 4)), _make_row(30.05, births=(0, 10, 10))

    assert _list_claims("gate", gate_row, no_gate_row) == [(0.4, True), (0.05, True)]
    assert _list_claims("gate", _make_row(29.0), no_gate_row) == [(1.0, False), (1.05, False)]
    assert _list_claims("gate", _make_row(29.0), no_gate_row, gate_row, no_gate_row)[2:] == [
        (0.4, True),
        (0.05, True),
    ]


def test_a_claim_shared_by_two_experiments_is_listed_once():
    rows = {"change gate": _make_row(30.0, label="change gate"), "no gate": _make_row(30.0)}

    assert len(list_claims({"gate": rows, "gradient": rows})) == 2


def test_a_sweep_has_a_knee_if_finer_steps_gain_nothing_and_coarser_ones_lose():
    sizes, psnr = (4, 3, 2, 1, 1, 1, 1), (30.05, 30, 30, 30, 29.9, 29.5, 29)
    knee_rows = [_make_row(*figures) for figures in zip(psnr, sizes, strict=True)]
    flat_rows = [_make_row(30 + 0.2 * number) for number in range(7)]

    assert _list_claims("step", *knee_rows) == [(0.05, True), (4, True), (1, True)]
    assert _list_claims("step", *flat_rows) == [(-0.2, True), (1, False), (-0.6, False)]


@pytest.mark.parametrize("name", ["quantization", "gate", "gradient", "step", "anchors"])
def test_sizes_and_births_of_later_frames_are_not_measured_in_a_stream_of_one_frame(name):
    rows = [_make_row(30.0, kilobytes=0, births=(0,), label=f"{number}") for number in range(4)]

    claims = list_claims({name: {row["label"]: row for row in rows}})

    assert {claim.value for claim in claims} <= {0.0, None}


def test_an_incomplete_experiment_makes_no_claims():
    assert (
        list_claims(
            {
                "gate": {"change gate": _make_row(30)},
                "levels": {"1": _make_row(1), "2": _make_row(2)},
            }
        )
        == []
    )
