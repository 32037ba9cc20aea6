from paper.claims import list_claims


def _row(psnr, kilobytes=1.0, births=(0, 10, 10), label=""):
    return {
        "label": label,
        "quality": {"psnr": psnr},
        "bytes": {"kb_per_frame": kilobytes, "motion_kb_per_frame": kilobytes},
        "births": list(births),
    }


def _judge(name, *rows):
    listed = {name: {f"{place}": row for place, row in enumerate(rows)}}
    return [(round(claim.value, 6), claim.holds) for claim in list_claims(listed)]


def test_the_claim_about_quantization_holds_or_not():
    full, motion, floats = _row(30.0), _row(30.02, 40), _row(30.04, 50)

    assert _judge("quantization", full, motion, floats) == [
        (0.04, True),
        (0.02, True),
        (0.02, True),
    ]
    assert _judge("quantization", full, motion, _row(31, 2)) == [
        (1, False), (0.5, False), (0.02, True),
    ]  # fmt: skip


def test_the_claim_about_the_gate_holds_or_not():
    gated, opened = _row(30.0, births=(0, 4, 4)), _row(30.05, births=(0, 10, 10))

    assert _judge("gate", gated, opened) == [(0.4, True), (0.05, True)]
    assert _judge("gate", _row(29.0), opened) == [(1.0, False), (1.05, False)]
    assert _judge("gate", _row(29.0), opened, gated, opened)[2:] == [(0.4, True), (0.05, True)]


def test_a_claim_shared_by_two_experiments_is_listed_once():
    rows = {"change gate": _row(30.0, label="change gate"), "no gate": _row(30.0)}

    assert len(list_claims({"gate": rows, "gradient": rows})) == 2


def test_a_sweep_has_a_knee_if_finer_steps_gain_nothing_and_coarser_ones_lose():
    sizes, psnr = (4, 3, 2, 1, 1, 1, 1), (30.05, 30, 30, 30, 29.9, 29.5, 29)
    knee = [_row(*each) for each in zip(psnr, sizes, strict=True)]
    flat = [_row(30 + 0.2 * place) for place in range(7)]

    assert _judge("step", *knee) == [(0.05, True), (4, True), (1, True)]
    assert _judge("step", *flat) == [(-0.2, True), (1, False), (-0.6, False)]


def test_an_incomplete_experiment_makes_no_claims():
    assert (
        list_claims({"gate": {"change gate": _row(30)}, "levels": {"1": _row(1), "2": _row(2)}})
        == []
    )
