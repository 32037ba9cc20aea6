"""Mistakes in snapshots (SPEC 7.9, 8.9, 11)."""

from mutant import Mutant, mutant

_PLANES = "format/coding/snapshot_planes.py"
_FRAMES = "decoder/frames.py"
_STREAM = "decoder/stream_decoder.py"
_SEEK = "streams/seek.py"
_RESYNC = "streams/resync.py"
_CONTAINER = "format/container.py"

MUTANTS: tuple[Mutant, ...] = (
    mutant(
        "survivors kept in the order of the CANO",
        _PLANES,
        '    return np.argsort(interleave(offsets), kind="stable")\n',
        "    return np.arange(gaussians.count)\n",
    ),
    mutant(
        "new Gaussians sorted before survivors at the same position",
        _PLANES,
        '    return np.argsort(interleave(offsets), kind="stable")\n',
        '    return np.argsort(interleave(offsets)[::-1], kind="stable")[::-1]\n',
    ),
    mutant(
        "position differences not relative to the previous survivor",
        _PLANES,
        "            coded[field, changed] = np.cumsum(steps, axis=1)\n",
        "            coded[field, changed] = steps\n",
    ),
    mutant(
        "rotation components added even if the rotation index changes",
        _PLANES,
        "    sums[components, index_changed] = rows[components, index_changed]\n",
        "",
    ),
    mutant(
        "sum of rotation indices not taken modulo 4",
        _PLANES,
        "    sums[index] %= 1 << ROTATION_INDEX_BITS\n",
        "    sums[index] = np.minimum(sums[index], 3)\n",
    ),
    mutant(
        "field bits of survivors coded without contexts",
        _PLANES,
        'planes.code(f"survivors, {name}", changed_fields, is_changed)',
        'planes.code(f"survivors, {name}", 0 * changed_fields, is_changed)',
    ),
    mutant(
        "differences of survivors coded without contexts",
        _PLANES,
        "        magnitude_sums += np.abs(coded[row_index])\n",
        "",
    ),
    mutant(
        "extent of positions in snapshots not limited",
        _PLANES,
        "    if offsets.max(initial=0) >> AXIS_BITS_LIMIT:",
        "    if False:",
    ),
    mutant(
        "snapshots without Gaussians accepted",
        _FRAMES,
        "    if snapshot.gaussians.count == 0:",
        "    if False:",
    ),
    mutant(
        "snapshots that refer to another CANO accepted",
        _STREAM,
        "        if snapshot.canonical != self.reference.frame:",
        "        if False:",
    ),
    mutant(
        "snapshots coded relative to the previous snapshot",
        _STREAM,
        "        gaussians = self.reference.gaussians\n",
        "        from quarc_ref.encoder.requantize import requantize\n"
        "        gaussians = requantize(self._state.scene)\n",
    ),
    mutant(
        "seeking to a snapshot decodes the first CANO of the stream",
        _SEEK,
        "    point = points.find_by_frame(_read_frame_number(reader, header, _FRAME_BYTES))",
        "    point = points[0]",
    ),
    mutant(
        "recovery resumes at a snapshot that refers to another CANO",
        _RESYNC,
        "        if header.kind == container.SNAP and parse_frame_number(",
        "        if header.kind == b'none' and parse_frame_number(",
    ),
    mutant(
        "recovery never resumes at a snapshot",
        _RESYNC,
        "            return self.canonical is not None and header.length >= 2 * _FRAME_BYTES\n",
        "            return False\n",
    ),
    mutant(
        "snapshots accepted in streams without the feature",
        _CONTAINER,
        "        is_known = stream_header is not None and stream_header.snapshots\n",
        "        is_known = True\n",
    ),
)
