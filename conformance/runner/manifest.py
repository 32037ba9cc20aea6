"""Reads the manifest and its streams, which are files or patches of other streams."""

import hashlib
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

Entry = dict[str, Any]
LEVELS = (10, 20, 30, 31)
LEVEL_OFFSET = 8 + 20 + 10
"""Offset of the level in a stream: after the magic, the header of HEAD and 10 bytes of payload."""


class SuiteError(Exception):
    """The suite cannot be read, differs from its manifest, or has no case to run."""


@dataclass
class Suite:
    """The vectors and unit files of a suite.

    Attributes:
        root: Folder that contains `manifest.json`.
        vectors: Entries of the manifest, by the name of the vector.
        units: Contents of the unit files, which hold known answers.
    """

    root: Path
    vectors: dict[str, Entry]
    units: list[Entry]
    _cache: dict[str, bytes] = field(default_factory=dict)

    @classmethod
    def load(cls, root: Path) -> "Suite":
        """Read the manifest of a folder.

        Raises:
            SuiteError: A file is missing or malformed, or the manifest is empty.
        """
        try:
            manifest = json.loads((root / "manifest.json").read_text("utf-8"))
            units = [json.loads((root / name).read_text("utf-8")) for name in manifest["units"]]
            vectors = {entry["name"]: entry for entry in manifest["vectors"]}
        except (OSError, ValueError, KeyError, TypeError) as error:
            message = f"the suite in {root} cannot be read: {error!r}"
            raise SuiteError(message) from error
        if not vectors:
            message = f"the manifest in {root} lists no vectors"
            raise SuiteError(message)
        return cls(root, vectors, units)

    def read_stream(self, name: str) -> bytes:
        """Return the stream of a vector.

        Raises:
            SuiteError: The file is missing, or its SHA-256 differs from the manifest.
        """
        entry = self.vectors[name]
        if "file" not in entry:
            data = apply_patch(self.read_stream(entry["parent"]), entry["patch"])
        elif name in self._cache:
            return self._cache[name]
        else:
            data = self._cache[name] = self._read(entry["file"])
        if hashlib.sha256(data).hexdigest() != entry["sha256"]:
            message = f"the SHA-256 of {name} differs from the manifest"
            raise SuiteError(message)
        return data

    def read_level(self, name: str) -> int | None:
        """Return the level in the HEAD chunk of a stream; None if there is no such chunk."""
        data = self.read_stream(name)
        is_head = data[12:16] == b"HEAD" and len(data) > LEVEL_OFFSET
        return data[LEVEL_OFFSET] if is_head else None

    def _read(self, file: str) -> bytes:
        try:
            return (self.root / file).read_bytes()
        except OSError as error:
            message = f"{file} cannot be read: {error}"
            raise SuiteError(message) from error


def apply_patch(parent: bytes, patch: list[Entry]) -> bytes:
    """Return the patched stream; the offsets in a patch refer to the parent."""
    data, offset = b"", 0
    for splice in patch:
        data += parent[offset : splice["at"]]
        data += bytes.fromhex(splice["insert"]) * splice.get("count", 1)
        offset = splice["at"] + splice["remove"]
    return data + parent[offset:]
