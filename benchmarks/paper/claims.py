"""Compares measurements with what the paper claims about its ablations."""

from collections.abc import Iterator, Mapping

from rate.claims import Claim, divide, mean
from studies import Row

_MAX_QUANTIZATION_LOSS_DB = 0.05
_MAX_SIZE_RATIO_TO_FLOATS = 0.25
_MAX_GATE_BIRTH_RATIO = 0.5
_MAX_GATE_LOSS_DB = 0.1
_MAX_FINER_STEP_GAIN_DB = 0.1
_MIN_FINEST_STEP_SIZE_RATIO = 1.5
_MIN_LARGEST_STEP_LOSS_DB = 0.1
_MIN_FEWER_ANCHORS_LOSS_DB = 0.2

Rows = Mapping[str, Row]


def list_claims(experiments: Mapping[str, Mapping[str, Row]]) -> list[Claim]:
    """Return the claims that the rows can confirm or refute, without duplicates.

    Args:
        experiments: Rows of each experiment: `{experiment: {label: row}}`.
    """
    claims: list[Claim] = []
    for name, list_experiment_claims in _CLAIMS_BY_EXPERIMENT.items():
        rows = list(experiments.get(name, {}).values())
        if len(rows) > 1:
            claims += list_experiment_claims(rows)
    return list(dict.fromkeys(claims))


def _list_quantization_claims(rows: list[Row]) -> Iterator[Claim]:
    quantized, all_floats = rows[0], rows[-1]
    psnr_loss = _get_psnr(all_floats) - _get_psnr(quantized)
    yield Claim("PSNR loss caused by quantization, dB", psnr_loss, _MAX_QUANTIZATION_LOSS_DB)
    size_ratio = divide(quantized["bytes"]["kb_per_frame"], all_floats["bytes"]["kb_per_frame"])
    name = f"KB per frame, {quantized['label']} / all in floats"
    yield Claim(name, size_ratio, _MAX_SIZE_RATIO_TO_FLOATS)
    if len(rows) > 2:
        psnr_loss = _get_psnr(rows[1]) - _get_psnr(quantized)
        name = "PSNR loss caused by quantization of motion and births, dB"
        yield Claim(name, psnr_loss, _MAX_QUANTIZATION_LOSS_DB)


def _list_gate_claims(rows: list[Row]) -> Iterator[Claim]:
    for with_gate, without_gate in zip(rows[::2], rows[1::2], strict=True):
        birth_ratio = divide(*(mean(row["births"][1:]) for row in (with_gate, without_gate)))
        label = with_gate["label"]
        name = f"{label}: births with the gate / births without the gate"
        yield Claim(name, birth_ratio, _MAX_GATE_BIRTH_RATIO)
        psnr_loss = _get_psnr(without_gate) - _get_psnr(with_gate)
        yield Claim(f"{label}: PSNR loss caused by the gate, dB", psnr_loss, _MAX_GATE_LOSS_DB)


def _list_step_claims(rows: list[Row]) -> Iterator[Claim]:
    default_index = len(rows) // 2
    default = rows[default_index]
    psnr_gain = max(_get_psnr(row) for row in rows[:default_index]) - _get_psnr(default)
    yield Claim("PSNR gain of the best finer step, dB", psnr_gain, _MAX_FINER_STEP_GAIN_DB)
    sizes = [row["bytes"]["motion_kb_per_frame"] for row in rows]
    size_ratio = divide(sizes[0], sizes[default_index])
    name = "motion bytes, finest step / default step"
    yield Claim(name, size_ratio, _MIN_FINEST_STEP_SIZE_RATIO, is_maximum=False)
    psnr_loss = _get_psnr(default) - _get_psnr(rows[-1])
    name = "PSNR loss of the largest step, dB"
    yield Claim(name, psnr_loss, _MIN_LARGEST_STEP_LOSS_DB, is_maximum=False)


def _list_anchors_claims(rows: list[Row]) -> Iterator[Claim]:
    for row in rows[1:]:
        psnr_loss = _get_psnr(rows[0]) - _get_psnr(row)
        name = f"PSNR loss with {row['label']}, dB"
        yield Claim(name, psnr_loss, _MIN_FEWER_ANCHORS_LOSS_DB, is_maximum=False)


def _get_psnr(row: Row) -> float:
    psnr: float = row["quality"]["psnr"]
    return psnr


_CLAIMS_BY_EXPERIMENT = {
    "quantization": _list_quantization_claims,
    "gate": _list_gate_claims,
    "gradient": _list_gate_claims,
    "step": _list_step_claims,
    "anchors": _list_anchors_claims,
}
