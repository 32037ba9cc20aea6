"""Tests that `verify` rejects a changed byte: every third one, or with --thorough every one."""

from quarc_ref.format.constants import CHUNK_HEADER_BYTES
from quarc_ref.format.errors import BitstreamError
from quarc_ref.streams.chunk_reader import split_chunks
from tests.cli.commands import run
from tests.small_streams import make_stream

_DATA, _ = make_stream(gaussian_count=6, frame_count=2)
_REJECT_IDS = set()


def _add_reject_ids(error_class):
    for subclass in error_class.__subclasses__():
        _add_reject_ids(subclass)
    if error_class.reject_id:
        _REJECT_IDS.add(error_class.reject_id)


_add_reject_ids(BitstreamError)


def _verify_damaged(path):
    """Return the exit code of `verify`, and its message from the reject id on."""
    result = run("verify", path, "-q")
    return result.exit_code, result.stderr.removeprefix("quarc-ref: the stream is rejected: ")


def _list_undetected(offsets, mask, path):
    """Return offset, exit code and message for each damage that `verify` does not reject."""
    undetected = []
    for offset in offsets:
        damaged_data = bytearray(_DATA)
        damaged_data[offset] ^= mask
        path.write_bytes(damaged_data)
        code, message = _verify_damaged(path)
        if code != 1 or message.partition(" ")[0].rstrip(":") not in _REJECT_IDS:
            undetected.append((offset, code, message))
    return undetected


def test_a_flipped_byte_anywhere_ends_the_command_with_1_and_a_reject_id(tmp_path, pytestconfig):
    offsets = range(0, len(_DATA), 1 if pytestconfig.getoption("--thorough") else 5)

    assert _list_undetected(offsets, 0xFF, tmp_path / "damaged.quarc") == []


def test_a_letter_of_the_other_case_does_not_give_another_chunk_type(tmp_path):
    header_offsets = [
        chunk.offset + offset
        for chunk in split_chunks(_DATA)
        for offset in range(CHUNK_HEADER_BYTES)
    ]

    assert _list_undetected(header_offsets, 0x20, tmp_path / "damaged.quarc") == []


def test_damage_is_reported_by_name(tmp_path):
    chunk = list(split_chunks(_DATA))[1]
    offsets = {
        0: "bad-magic",
        chunk.offset: "bad-sync",
        chunk.offset + 4: "header-crc",
        chunk.offset + 20: "payload-crc",
        chunk.offset + chunk.byte_count() - 1: "payload-crc",
        len(_DATA) - 1: "payload-crc",
    }
    for offset, reject_id in offsets.items():
        damaged_data = bytearray(_DATA)
        damaged_data[offset] ^= 1
        (tmp_path / "damaged.quarc").write_bytes(damaged_data)

        code, message = _verify_damaged(tmp_path / "damaged.quarc")

        assert code == 1
        assert message.startswith(f"{reject_id} at byte ")


def test_the_intact_stream_is_not_rejected(tmp_path):
    (tmp_path / "whole.quarc").write_bytes(_DATA)

    assert run("verify", tmp_path / "whole.quarc").exit_code == 0
