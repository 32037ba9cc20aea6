"""Corrects state CRCs after mutations, so that mutants reach the code after the CRC check."""

import contextlib
import zlib
from unittest.mock import patch

from quarc_ref.decoder import frames
from quarc_ref.decoder.digest import state_crc
from quarc_ref.decoder.reference_engine import ReferenceEngine
from quarc_ref.decoder.stream_decoder import StreamDecoder
from quarc_ref.format.constants import CHUNK_CRC_BYTES
from quarc_ref.format.errors import BitstreamError, LimitError
from quarc_ref.streams.chunk_reader import split_chunks

_STATE_CRC_BYTES = 4  # the state CRC is at the end of the payload of a frame


def forge_state_crcs(data: bytes) -> bytes:
    """Return a stream in which the state CRC of each frame matches the decoded state.

    If the stream has another fault, the state CRCs after that fault stay unchanged.

    Args:
        data: A stream, which may be malformed.
    """
    forged = bytearray(data)
    decoder = StreamDecoder(ReferenceEngine())
    with (
        patch.object(frames, "state_crc", lambda _scene: _AlwaysEqualCrc()),
        contextlib.suppress(BitstreamError, LimitError),
    ):
        for chunk in split_chunks(data):
            state = decoder.push(chunk)
            if state is not None:
                crc = state_crc(state.scene).to_bytes(_STATE_CRC_BYTES, "little")
                payload = chunk.payload[:-_STATE_CRC_BYTES] + crc
                trailing_crcs = crc + zlib.crc32(payload).to_bytes(CHUNK_CRC_BYTES, "little")
                end = chunk.offset + chunk.byte_count()
                forged[end - len(trailing_crcs) : end] = trailing_crcs
    return bytes(forged)


class _AlwaysEqualCrc(int):
    """A CRC that compares equal to every number."""

    __hash__ = int.__hash__

    def __eq__(self, _other: object) -> bool:
        return True

    def __ne__(self, _other: object) -> bool:
        return False
