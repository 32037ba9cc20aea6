"""Names what differs between an interrupted encode and the encode that is to resume it."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from quarc_ref.format.errors import ResumeError

_DESCRIPTIONS = {
    "cameras": "cameras (--downscale, --held-out)",
    "fingerprint": "fingerprint (of the capture's files, including masks)",
    "encoder": "encoder (the version of quarc-ref or of a library)",
}


@contextmanager
def name_stream(path: Path) -> Iterator[None]:
    """Add the path of a stream to the message of a ResumeError."""
    try:
        yield
    except ResumeError as error:
        message = f"{path}: {error}"
        raise ResumeError(message) from error


def make_resume_error(what: str, differences: list[str]) -> ResumeError:
    """Return the error for an encode that cannot be resumed.

    Args:
        what: What was found, such as "the partial stream was encoded".
        differences: Names of entries and settings that differ.
    """
    names = ", ".join(_DESCRIPTIONS.get(name, name) for name in differences)
    return ResumeError(
        f"{what} with different inputs; these differ: {names}; encode to another file, or use "
        "--force without --resume to replace the stream"
    )


def compare_metadata(existing_metadata: dict[str, str], new_metadata: dict[str, str]) -> list[str]:
    """Return the names of metadata entries and settings that differ."""
    differing_names = [
        name
        for name in {**existing_metadata, **new_metadata}
        if existing_metadata.get(name) != new_metadata.get(name)
    ]
    if "settings" in differing_names:
        differing_names.remove("settings")
        changed_items = {*existing_metadata.get("settings", "").split()} ^ {
            *new_metadata.get("settings", "").split()
        }
        differing_names += sorted(
            {item.partition("=")[0] for item in changed_items if "=" in item}
        ) or ["settings"]
    return differing_names
