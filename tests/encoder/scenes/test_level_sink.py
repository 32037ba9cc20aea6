"""The level of a stream is as low as its frames allow, and is raised if a later frame needs it."""

import io

import numpy as np
import pytest

from quarc_ref.encoder import GivenFrame, encode_scenes
from quarc_ref.format.constants import LEVELS
from quarc_ref.format.errors import EncodeError
from quarc_ref.streams import decode
from tests.encoder.scenes.encoding import OPTIONS, assert_close, encode
from tests.encoder.scenes.given import make_splats, move, select_rows


class _Pipe(io.BytesIO):
    def seekable(self):
        return False


@pytest.fixture
def low_level(monkeypatch):
    """Let level 10 allow only 500 Gaussians and 64 births."""
    monkeypatch.setitem(LEVELS, 10, LEVELS[10]._replace(gaussians=500, births=64))


@pytest.mark.usefixtures("low_level")
@pytest.mark.parametrize("counts", [(200, 200, 200, 600), (200, 240, 280, 320, 500, 501)])
def test_the_level_is_raised_if_the_number_of_gaussians_grows(counts):
    all_splats = make_splats(max(counts))
    scenes = [select_rows(all_splats, np.arange(count)) for count in counts]
    sink = io.BytesIO(b"before")
    sink.seek(0, io.SEEK_END)
    encode_scenes(scenes, sink, OPTIONS)
    data = sink.getvalue().removeprefix(b"before")

    assert_close(data, scenes)
    assert next(iter(decode(data))).header.level == 20


@pytest.mark.usefixtures("low_level")
def test_the_level_is_as_low_as_the_first_frames_allow():
    scenes = [make_splats(250)] * 3
    data, _ = encode(scenes)

    assert next(iter(decode(data))).header.level == 10


@pytest.mark.usefixtures("low_level")
def test_the_level_of_a_pipe_or_an_appended_file_cannot_be_raised(tmp_path):
    all_splats = make_splats(600)
    scenes = [select_rows(all_splats, np.arange(count)) for count in (200, 200, 200, 600)]
    path = tmp_path / "a.quarc"
    with path.open("ab") as appended_file:
        for sink in (_Pipe(), appended_file):
            with pytest.raises(EncodeError, match=r"frame 3: 600 Gaussians exceed level 10.*file"):
                encode_scenes(scenes, sink, OPTIONS)


@pytest.mark.usefixtures("low_level")
def test_a_frame_that_replaces_too_many_gaussians_by_births_is_canonical():
    first_splats = make_splats()
    # No update can turn a Gaussian by 180 degrees.
    second_splats = move(first_splats, (0, 0, 0), angle=np.pi, fraction=0.4)
    frames = [GivenFrame(splats, np.arange(200)) for splats in (first_splats, second_splats)]
    data, _ = encode(frames)

    assert_close(data, [first_splats, second_splats])
    assert [scene.phase for scene in decode(data)] == [0, 0]
    assert next(iter(decode(data))).header.level == 10


def test_the_level_is_raised_if_a_chunk_is_too_long(monkeypatch):
    monkeypatch.setitem(LEVELS, 10, LEVELS[10]._replace(chunk_bytes=2000))
    splats = make_splats()
    data, _ = encode([splats])

    assert_close(data, [splats])
    assert next(iter(decode(data))).header.level == 20
