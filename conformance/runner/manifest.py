"""The manifest and its streams, committed or generated from their parents."""

import hashlib
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

Entry = dict[str, Any]


class SuiteError(Exception):
    """The suite differs from its manifest, or there is none."""


@dataclass
class Suite:
    """Vectors and unit files.

    Attributes:
        root: Folder of the suite.
        vectors: Entries of the manifest by name.
        units: Contents of the files of known answers.
    """

    root: Path
    vectors: dict[str, Entry]
    units: list[Entry]
    _made: dict[str, bytes] = field(default_factory=dict)

    @classmethod
    def load(cls, root: Path) -> "Suite":
        """Read the manifest of a folder.

        Raises:
            SuiteError: The manifest is missing, or empty.
        """
        try:
            manifest = json.loads((root / "manifest.json").read_text("utf-8"))
            units = [json.loads((root / name).read_text("utf-8")) for name in manifest["units"]]
        except (OSError, ValueError, KeyError) as error:
            message = f"no suite in {root}: {error}"
            raise SuiteError(message) from error
        if not manifest["vectors"]:
            message = f"the manifest in {root} names no vector"
            raise SuiteError(message)
        return cls(root, {entry["name"]: entry for entry in manifest["vectors"]}, units)

    def stream(self, name: str) -> bytes:
        """Return the bytes of a vector.

        Raises:
            SuiteError: They are missing, or differ from the manifest.
        """
        entry = self.vectors[name]
        if "file" not in entry:
            data = apply_patch(self.stream(entry["parent"]), entry["patch"])
        elif name in self._made:
            return self._made[name]
        else:
            data = self._made[name] = self._read(entry["file"])
        if hashlib.sha256(data).hexdigest() != entry["sha256"]:
            message = f"{name} differs from the stream in the manifest"
            raise SuiteError(message)
        return data

    def _read(self, file: str) -> bytes:
        try:
            return (self.root / file).read_bytes()
        except OSError as error:
            message = f"{file} cannot be read: {error}"
            raise SuiteError(message) from error


def apply_patch(parent: bytes, patch: list[Entry]) -> bytes:
    """Return a parent with replaced bytes; offsets are those of the parent."""
    data, place = b"", 0
    for splice in patch:
        data += parent[place : splice["at"]]
        data += bytes.fromhex(splice["insert"]) * splice.get("count", 1)
        place = splice["at"] + splice["remove"]
    return data + parent[place:]
