"""Like tests of flipped bits in `tests/decoder`, but for the command."""

from quarc_ref.format.constants import CHUNK_HEADER_BYTES
from quarc_ref.format.errors import BitstreamError
from quarc_ref.streams.chunk_reader import split_chunks
from tests.cli.commands import run
from tests.small_streams import make_stream

_DATA, _ = make_stream(gaussian_count=6, frame_count=2)
_IDS = set()


def _list_ids(kind):
    for child in kind.__subclasses__():
        _list_ids(child)
    if kind.reject_id:
        _IDS.add(kind.reject_id)


_list_ids(BitstreamError)


def _verify_damaged(path):
    """The exit code of `verify`, and the reject id in its message."""
    result = run("verify", path, "-q")
    return result.exit_code, result.stderr.removeprefix("quarc-ref: the stream is rejected: ")


def _list_unnoticed(places, mask, path):
    """The bytes whose damage `verify` does not reject by name."""
    unnoticed = []
    for place in places:
        damaged = bytearray(_DATA)
        damaged[place] ^= mask
        path.write_bytes(damaged)
        code, message = _verify_damaged(path)
        if code != 1 or message.partition(" ")[0].rstrip(":") not in _IDS:
            unnoticed.append((place, code, message))
    return unnoticed


def test_a_flipped_byte_anywhere_ends_the_command_with_1_and_a_reject_id(tmp_path):
    assert _list_unnoticed(range(len(_DATA)), 0xFF, tmp_path / "damaged.quarc") == []


def test_a_letter_of_the_other_case_does_not_give_another_chunk_type(tmp_path):
    framing = [
        chunk.offset + place for chunk in split_chunks(_DATA) for place in range(CHUNK_HEADER_BYTES)
    ]

    assert _list_unnoticed(framing, 0x20, tmp_path / "damaged.quarc") == []


def test_damage_is_reported_by_name(tmp_path):
    chunk = list(split_chunks(_DATA))[1]
    places = {
        0: "bad-magic",
        chunk.offset: "bad-sync",
        chunk.offset + 4: "header-crc",
        chunk.offset + 20: "payload-crc",
        chunk.offset + chunk.byte_count() - 1: "payload-crc",
        len(_DATA) - 1: "payload-crc",
    }
    for place, reject_id in places.items():
        damaged = bytearray(_DATA)
        damaged[place] ^= 1
        (tmp_path / "damaged.quarc").write_bytes(damaged)

        code, message = _verify_damaged(tmp_path / "damaged.quarc")

        assert code == 1
        assert message.startswith(f"{reject_id} at byte ")


def test_the_intact_stream_is_not_rejected(tmp_path):
    (tmp_path / "whole.quarc").write_bytes(_DATA)

    assert run("verify", tmp_path / "whole.quarc").exit_code == 0
