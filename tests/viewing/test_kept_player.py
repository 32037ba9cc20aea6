"""Tests that the player in the package matches its sources."""

import base64
import gzip
import hashlib
import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
_PACKAGED_PLAYER = ROOT / "quarc_ref" / "viewing" / "player"
_STAMP = json.loads((_PACKAGED_PLAYER / "stamp.json").read_text("utf-8"))
_MAX_BYTES = 155_000  # gzip size; a browser downloads these bytes before playback starts
_SOURCES = json.loads((ROOT / "player" / "sources.json").read_text("utf-8"))


def _digest_sources(kind):
    """Return the digest of the sources of a kind, as computed by player/keep.mjs."""
    paths = [ROOT / name for name in _SOURCES[kind]]
    files = [file for path in paths for file in (path.rglob("*") if path.is_dir() else [path])]
    lines = [
        f"{hashlib.sha256(file.read_bytes()).hexdigest()}  {file.relative_to(ROOT).as_posix()}\n"
        for file in files
        if file.is_file()
    ]
    return hashlib.sha256("".join(sorted(lines)).encode()).hexdigest()


def test_the_kept_player_matches_its_build():
    player = (_PACKAGED_PLAYER / "quarc-player.js").read_bytes()

    assert hashlib.sha256(player).hexdigest() == _STAMP["bytes"]


def test_a_compressing_server_sends_at_most_155_kb():
    player = (_PACKAGED_PLAYER / "quarc-player.js").read_bytes()

    assert len(gzip.compress(player, 9)) <= _MAX_BYTES


def test_the_decoder_contains_no_paths_of_the_machine_that_built_it():
    player = (_PACKAGED_PLAYER / "quarc-player.js").read_bytes()
    module = gzip.decompress(base64.b64decode(re.search(rb"H4sI[A-Za-z0-9+/]+=*", player)[0]))

    assert hashlib.sha256(module).hexdigest() == _STAMP["wasm"]
    assert b".rs" not in module


@pytest.mark.parametrize(
    ("part", "given"), [("std", ["-Zforce-unstable-if-unmarked"]), ("quarc", [])]
)
def test_the_order_of_functions_depends_on_no_number_of_cargo(part, given):
    if shutil.which("sh") is None:
        pytest.skip("core/wasm/rustc.sh needs a shell, which is not installed")
    command = ["sh", "core/wasm/rustc.sh", "echo", *given, "-C", "metadata=0123456789abcdef", "a b"]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)

    assert result.stdout.split() == [*given, "-C", f"metadata={part}", "a", "b"]


@pytest.mark.parametrize("kind", ["player", "core"])
def test_the_sources_are_unchanged_since_the_build(kind):
    assert _digest_sources(kind) == _STAMP[kind], "run `make player` to rebuild the player"


def test_the_decoder_can_be_extracted_for_a_build_without_rust(tmp_path):
    if shutil.which("node") is None:
        pytest.skip("extracting the decoder needs Node, which is not installed")
    path = tmp_path / "quarc-player.wasm"
    command = ["node", "player/keep.mjs", "--extract", str(path)]
    subprocess.run(command, cwd=ROOT, check=True)

    assert hashlib.sha256(path.read_bytes()).hexdigest() == _STAMP["wasm"]


def test_a_new_build_gives_the_same_player():
    if shutil.which("node") is None:
        pytest.skip("building the player needs Node, which is not installed")
    if not (ROOT / "player" / "node_modules" / "esbuild").is_dir():
        pytest.skip("building the player needs esbuild; run npm ci in player/ to install it")
    command = ["node", "player/keep.mjs", "--check"]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)

    assert result.returncode == 0, result.stderr
