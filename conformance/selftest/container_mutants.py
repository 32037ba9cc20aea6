"""Mistakes in reading the container, in seeking and in recovery (SPEC 5, 11)."""

from mutant import make_mutant

_CONTAINER_FILE = "format/container.py"
_READER_FILE = "streams/chunk_reader.py"
_STREAM_FILE = "decoder/stream_decoder.py"
_WIRE_FILE = "format/wire.py"
_CAMERAS_FILE = "format/cameras.py"
_UNKNOWN_TYPE_CODE = "if not is_known and not header.is_ancillary:"

MUTANTS = (
    make_mutant(
        "payload CRCs are not checked",
        _CONTAINER_FILE,
        'if crc != int.from_bytes(stored_crc, "little"):',
        "if crc is None:",
    ),
    make_mutant(
        "header CRCs are not checked",
        _CONTAINER_FILE,
        "if not is_header_crc_valid(data):",
        "if False:",
    ),
    make_mutant(
        "bytes at the end that are not a sync word are reported as truncated",
        _CONTAINER_FILE,
        "if not data.startswith(SYNC[: len(data)]):",
        "if len(data) >= CHUNK_HEADER_BYTES and not data.startswith(SYNC):",
        only_category="damaged",
    ),
    make_mutant(
        "sequence numbers are not checked",
        _READER_FILE,
        "if header.sequence != self.sequence:",
        "if False:",
    ),
    make_mutant(
        "unknown critical chunks are accepted", _CONTAINER_FILE, _UNKNOWN_TYPE_CODE, "if False:"
    ),
    make_mutant(
        "unknown ancillary chunks are rejected",
        _CONTAINER_FILE,
        _UNKNOWN_TYPE_CODE,
        "if not is_known:",
    ),
    make_mutant(
        "unknown compatible features are rejected",
        _WIRE_FILE,
        "if version.incompatible_features & ~",
        "if (version.incompatible_features | version.compatible_features) & ~",
        only_category="streams",
    ),
    make_mutant(
        "the case of the third letter of a chunk type is not checked",
        _CONTAINER_FILE,
        "for letter in (kind[0], *kind[2:])",
        "for letter in (kind[0], *kind[3:])",
        only_category="invalid",
    ),
    make_mutant(
        "bytes after TAIL are ignored",
        _READER_FILE,
        "if self.source.read(self.offset, 1):",
        "if False:",
    ),
    make_mutant(
        "bytes after the last field of a payload are ignored",
        _WIRE_FILE,
        "if parsed.end != len(payload):",
        "if False:",
    ),
    make_mutant(
        "the fields of TAIL are not checked",
        _STREAM_FILE,
        "if self._is_complete and tail != expected:",
        "if False:",
    ),
    make_mutant(
        "the fields of INDX are not checked",
        _STREAM_FILE,
        "if self._is_complete and index != self._skipped_points.with_appended(self._points):",
        "if False:",
    ),
    make_mutant(
        "the length of a chunk is checked only after its payload has been read",
        _READER_FILE,
        "        container.check_length(header.length, self._stream_header, self.offset)  #",
        "        if self._stream_header is None:\n"
        "            container.check_length(header.length, self._stream_header, self.offset)  #",
    ),
    make_mutant(
        "a quantization step of 0 is accepted",
        "format/records.py",
        "not 0 < value <= constants.STEP_LIMIT",
        "not 0 <= value <= constants.STEP_LIMIT",
    ),
    make_mutant(
        "unknown major versions are accepted",
        _WIRE_FILE,
        "if len(payload) > 1 and payload[0] != constants.VERSION_MAJOR:",
        "if False:",
    ),
    make_mutant(
        "recovery resumes at a TAIL that is not at the end of the stream",
        "streams/resync.py",
        "return not source.read(header.end, 1)",
        "return True",
        only_category="damaged",
    ),
    make_mutant(
        "recovery resumes at a frame that is earlier than expected",
        "streams/resync.py",
        "return parse_ordinal(payload) >= self.frame",
        "return True",
    ),
    make_mutant(
        "lost frames are counted from frame 0 if the first frame is lost",
        "streams/recover.py",
        "        if self._first_frame is None:\n            return None\n"
        "        return self._first_frame +",
        "        return (self._first_frame or 0) +",
        only_category="damaged",
    ),
    make_mutant(
        "recovery resumes at a sequence number that is lower than expected",
        "streams/resync.py",
        "if header.sequence < self.sequence or header.length > self.max_payload_bytes:",
        "if header.length > self.max_payload_bytes:",
        only_category="damaged",
    ),
    make_mutant(
        "recovery resumes at a TAIL of any length",
        "streams/resync.py",
        "return header.length == TAIL_BYTES",
        "return True",
        only_category="damaged",
    ),
    make_mutant(
        "a negative number of lost frames is reported",
        "streams/recover.py",
        "or self._next_frame is None or self._next_frame < expected_frame:",
        "or self._next_frame is None:",
        only_category="damaged",
    ),
    make_mutant(
        "a frame that is rejected after recovery has resumed is not counted as lost",
        "streams/recover.py",
        "        return self._next_frame - expected_frame\n",
        "        self._next_frame += 1\n        return self._next_frame - 1 - expected_frame\n",
        only_category="damaged",
    ),
    make_mutant(
        "damaged ancillary chunks are counted as lost frames",
        "streams/recover.py",
        "elif header is not None and header.is_ancillary and",
        "elif False and header is not None and",
    ),
    make_mutant(
        "lost frames before TAIL are counted from frame 0",
        "streams/recover.py",
        "        return self._first_frame + wire",
        "        return wire",
    ),
    make_mutant(
        "recovery also searches the payload of a chunk whose content is rejected",
        "streams/recover.py",
        "            offset=self._reader.offset,\n",
        "            offset=offset,\n",
    ),
    make_mutant(
        "recovery does not report the bytes after TAIL",
        "streams/recover.py",
        "            yield _make_gap(error, offset, size, None)\n",
        "            del size\n",
    ),
    make_mutant(
        "recovery resumes after an unknown critical chunk that follows a gap",
        "streams/recover.py",
        "        except UnknownCriticalError:\n            raise\n",
        "",
        "        except BitstreamError as error:\n            yield from",
        "        except BitstreamError as error:\n"
        "            if isinstance(error, UnknownCriticalError) and self._decoder._is_complete:\n"
        "                raise\n"
        "            yield from",
    ),
    make_mutant(
        "a search continues after a header at which decoding does not resume",
        "streams/resync.py",
        "        offset = window.find(SYNC, offset + 1)\n",
        "        offset = window.find(SYNC, offset + CHUNK_HEADER_BYTES)\n",
    ),
    make_mutant(
        "INDX need not end where TAIL begins",
        "streams/seek.py",
        "if index is None or reader.offset != tail_offset:",
        "if index is None:",
    ),
    make_mutant(
        "seek points are not compared with their frames",
        _STREAM_FILE,
        "if seek_target not in (None, point):",
        "if False:",
    ),
    make_mutant(
        "cameras may have a height of 0",
        _CAMERAS_FILE,
        "min(self.width, self.height, self.fx, self.fy, self.near) <= 0",
        "min(self.width, self.fx, self.fy, self.near) <= 0",
        only_category="invalid",
    ),
    make_mutant(
        "cameras may have a vertical focal length of 0",
        _CAMERAS_FILE,
        "min(self.width, self.height, self.fx, self.fy, self.near) <= 0",
        "min(self.width, self.height, self.fx, self.near) <= 0",
        only_category="invalid",
    ),
    make_mutant(
        "rotations of cameras may contain NaN",
        _CAMERAS_FILE,
        "self.cx, self.cy, *self.rotation,",
        "self.cx, self.cy,",
        only_category="invalid",
    ),
    make_mutant(
        "cameras may have an infinite cy",
        _CAMERAS_FILE,
        "self.cx, self.cy, *self.rotation,",
        "self.cx, *self.rotation,",
        only_category="invalid",
    ),
    make_mutant(
        "decoding resumes at a CANO that is too short for a frame number",
        "streams/resync.py",
        "return header.kind == container.CANO and header.length >= ORDINAL_BYTES",
        "return header.kind == container.CANO",
        only_category="damaged",
    ),
)
