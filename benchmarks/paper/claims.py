"""Compares the paper's claims about its ablations with the measurements."""

from collections.abc import Iterator, Mapping
from statistics import fmean

from rate.claims import Claim
from studies import Row

_UNQUANTIZED_DB = 0.05
_UNQUANTIZED_SHARE = 0.25
_GATE_SHARE = 0.5
_GATE_DB = 0.1
_KNEE_DB = 0.1
_KNEE_BYTES = 1.5
_FEWER_ANCHORS_DB = 0.2

Rows = Mapping[str, Row]


def list_claims(experiments: Mapping[str, Mapping[str, Row]]) -> list[Claim]:
    """Return the claims that the rows can confirm or refute, without repetition.

    Args:
        experiments: `{experiment: {label: row}}` in the order of the experiments.
    """
    claims: list[Claim] = []
    for name, judge in _JUDGES.items():
        rows = list(experiments.get(name, {}).values())
        if len(rows) > 1:
            claims += judge(rows)
    return list(dict.fromkeys(claims))


def _judge_quantization(rows: list[Row]) -> Iterator[Claim]:
    full, unquantized = rows[0], rows[-1]
    db_lost = _psnr(unquantized) - _psnr(full)
    yield Claim("dB that quantization costs", db_lost, _UNQUANTIZED_DB)
    share = full["bytes"]["kb_per_frame"] / unquantized["bytes"]["kb_per_frame"]
    yield Claim("KB per frame, full method / floats", share, _UNQUANTIZED_SHARE)
    if len(rows) > 2:
        db_lost_in_motion = _psnr(rows[1]) - _psnr(full)
        yield Claim("dB of it in motion and births", db_lost_in_motion, _UNQUANTIZED_DB)


def _judge_gate(rows: list[Row]) -> Iterator[Claim]:
    for with_gate, without_gate in zip(rows[::2], rows[1::2], strict=True):
        births = [fmean(row["births"][1:]) for row in (with_gate, without_gate)]
        share = births[0] / births[1] if births[1] else None
        label = with_gate["label"]
        yield Claim(f"{label}: births / those without", share, _GATE_SHARE)
        yield Claim(f"{label}: dB that it costs", _psnr(without_gate) - _psnr(with_gate), _GATE_DB)


def _judge_step(rows: list[Row]) -> Iterator[Claim]:
    middle = len(rows) // 2
    default = rows[middle]
    db_gained = max(_psnr(row) for row in rows[:middle]) - _psnr(default)
    yield Claim("dB that a finer step gains", db_gained, _KNEE_DB)
    sizes = [row["bytes"]["motion_kb_per_frame"] for row in rows]
    size_ratio = sizes[0] / sizes[middle]
    yield Claim("motion bytes of the finest step / default", size_ratio, _KNEE_BYTES, False)
    db_lost = _psnr(default) - _psnr(rows[-1])
    yield Claim("dB that the widest step loses", db_lost, _KNEE_DB, False)


def _judge_anchors(rows: list[Row]) -> Iterator[Claim]:
    for row in rows[1:]:
        db_lost = _psnr(rows[0]) - _psnr(row)
        yield Claim(f"dB lost with {row['label']}", db_lost, _FEWER_ANCHORS_DB, False)


def _psnr(row: Row) -> float:
    psnr: float = row["quality"]["psnr"]
    return psnr


_JUDGES = {
    "quantization": _judge_quantization,
    "gate": _judge_gate,
    "gradient": _judge_gate,
    "step": _judge_step,
    "anchors": _judge_anchors,
}
