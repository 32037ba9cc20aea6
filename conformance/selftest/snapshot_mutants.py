"""Mistakes in snapshots (SPEC 7.9, 8.9, 11)."""

from mutant import Mutant, make_mutant

_PLANES_FILE = "format/coding/snapshot_planes.py"
_FRAMES_FILE = "decoder/frames.py"
_STREAM_FILE = "decoder/stream_decoder.py"
_SEEK_FILE = "streams/seek.py"
_RESYNC_FILE = "streams/resync.py"
_CONTAINER_FILE = "format/container.py"

MUTANTS: tuple[Mutant, ...] = (
    make_mutant(
        "survivors keep the order of the CANO instead of being sorted",
        _PLANES_FILE,
        '    return np.argsort(interleave(offsets), kind="stable")\n',
        "    return np.arange(gaussians.count)\n",
    ),
    make_mutant(
        "new Gaussians are sorted before survivors at the same position",
        _PLANES_FILE,
        '    return np.argsort(interleave(offsets), kind="stable")\n',
        '    return np.argsort(interleave(offsets)[::-1], kind="stable")[::-1]\n',
    ),
    make_mutant(
        "position differences are not relative to the previous survivor",
        _PLANES_FILE,
        "            coded[field, changed] = np.cumsum(steps, axis=1)\n",
        "            coded[field, changed] = steps\n",
    ),
    make_mutant(
        "position differences wrap at 16 bits",
        _PLANES_FILE,
        "            coded[field, changed] = np.cumsum(steps, axis=1)\n",
        "            coded[field, changed] = np.cumsum(steps, axis=1).astype(np.int16)\n",
    ),
    make_mutant(
        "survivors and new Gaussians together may exceed the level",
        _FRAMES_FILE,
        "            raise CountError(message)\n        check_gaussian_count(header, count)\n",
        "            raise CountError(message)\n",
    ),
    make_mutant(
        "rotation components are added even if the rotation index changes",
        _PLANES_FILE,
        "    sums[components, index_changed] = rows[components, index_changed]\n",
        "",
    ),
    make_mutant(
        "the sum of rotation indices is not taken modulo 4",
        _PLANES_FILE,
        "    sums[index] %= 1 << ROTATION_INDEX_BITS\n",
        "    sums[index] = np.minimum(sums[index], 3)\n",
    ),
    make_mutant(
        "the field bits of survivors are all coded in context 0",
        _PLANES_FILE,
        'planes.code(f"survivors, {name}", changed_fields, is_changed)',
        'planes.code(f"survivors, {name}", 0 * changed_fields, is_changed)',
    ),
    make_mutant(
        "the contexts of differences do not depend on earlier differences",
        _PLANES_FILE,
        "        magnitude_sums += np.abs(coded[row_index])\n",
        "",
    ),
    make_mutant(
        "the range of positions in a snapshot is not limited",
        _PLANES_FILE,
        "    if offsets.max(initial=0) >> AXIS_BITS_LIMIT:",
        "    if False:",
    ),
    make_mutant(
        "snapshots without Gaussians are accepted",
        _FRAMES_FILE,
        "        if count == 0:  # [7.9-3]",
        "        if False:",
    ),
    make_mutant(
        "snapshots that refer to another CANO are accepted",
        _STREAM_FILE,
        "        if snapshot.canonical != self.reference.frame:",
        "        if False:",
    ),
    make_mutant(
        "snapshots are coded relative to the previous frame instead of the CANO",
        _STREAM_FILE,
        "        decoded = self._engine.decode_snapshot("
        "self.header, snapshot, self.reference.gaussians)",
        "        from quarc_ref.encoder.requantize import requantize\n"
        "        gaussians = requantize(self._state.scene)\n"
        "        decoded = self._engine.decode_snapshot(self.header, snapshot, gaussians)",
    ),
    make_mutant(
        "seeking to a snapshot decodes the first CANO of the stream",
        _SEEK_FILE,
        "    point = points.find_by_frame(_read_ordinal(reader, header, ORDINAL_BYTES))",
        "    point = points[0]",
    ),
    make_mutant(
        "recovery resumes at a snapshot that refers to another CANO",
        _RESYNC_FILE,
        "        if header.kind == container.SNAP and parse_ordinal(",
        "        if header.kind == b'none' and parse_ordinal(",
    ),
    make_mutant(
        "recovery never resumes at a snapshot",
        _RESYNC_FILE,
        "            return self.canonical is not None and header.length >= 2 * ORDINAL_BYTES\n",
        "            return False\n",
    ),
    make_mutant(
        "recovery resumes at a snapshot that is too short for its reference",
        _RESYNC_FILE,
        "            return self.canonical is not None and header.length >= 2 * ORDINAL_BYTES\n",
        "            return self.canonical is not None and header.length >= ORDINAL_BYTES\n",
    ),
    make_mutant(
        "snapshots are accepted in streams without FEATURE_SNAPSHOTS",
        _CONTAINER_FILE,
        "        is_known = stream_header is not None and stream_header.snapshots\n",
        "        is_known = True\n",
    ),
)
