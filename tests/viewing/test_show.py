import threading

import pytest

from quarc_ref.decoder import dequantize
from quarc_ref.format import container
from quarc_ref.streams import BytesSource, decode
from quarc_ref.streams.chunk_reader import split_chunks
from quarc_ref.viewing.outline import outline_stream
from quarc_ref.viewing.show import Show
from tests.small_streams import make_stream, rebuild_stream

MOST_BYTES = 1 << 20


class FakePage:
    """A page that takes note of what happens to it, and ends the show when told so."""

    def __init__(self, ends_after):
        self.frames, self.told, self.warnings, self.playing = [], [], [], []
        self.ended = threading.Event()
        self.playback = None
        self.has_viewers = True
        self._ends_after = ends_after

    def steer(self, playback):
        self.playback = playback

    def show(self, frame, splats):
        self.frames.append((frame, splats.count))
        if len(self.frames) == self._ends_after:
            self.ended.set()

    def tell(self, frame, text):
        self.told.append((frame, text))

    def warn(self, message):
        self.warnings.append(message)
        self.ended.set()

    def show_playing(self, *, on):
        self.playing.append(on)

    def refresh(self):
        self.ended.set()


@pytest.fixture(scope="module")
def made():
    return make_stream(frame_count=4)


def _play(data, page, **options):
    source = BytesSource(data)
    show = Show(source, outline_stream(source), page, **options)
    show.run(dequantize(next(decode(source))), MOST_BYTES, page.ended)


def test_frames_are_shown_in_their_order_and_again(made):
    page = FakePage(ends_after=9)
    _play(made[0], page)

    counts = [state.scene.count for state in made[1]]
    assert page.frames == [(index % 4, counts[index % 4]) for index in range(9)]
    assert page.playing == [True]
    assert page.told[0][0] == 0


def test_without_playing_the_first_frame_stands(made):
    page = FakePage(ends_after=99)
    _play(made[0], page, playing=False)

    assert [frame for frame, _ in page.frames] == [0]
    assert "paused" in page.told[0][1]


def test_a_frame_that_is_refused_is_told_of_and_stops_the_playback(made):
    chunks = [(chunk.kind, chunk.payload) for chunk in split_chunks(made[0])]
    kind, payload = chunks[5]
    assert kind == container.FRAM
    chunks[5] = (kind, payload[:-1] + bytes([payload[-1] ^ 1]))
    page = FakePage(ends_after=99)
    _play(rebuild_stream(chunks), page)

    assert [frame for frame, _ in page.frames] == [0, 1]
    assert len(page.warnings) == 1
    assert page.playing == [True, False]


class LonelyPage(FakePage):
    """A page that nobody has open at first; somebody comes after a few looks."""

    looks = 0
    seen_by_nobody = 0

    @property
    def has_viewers(self):
        if self.frames and self.looks < 4:
            self.looks += 1
            self.seen_by_nobody = len(self.frames)
        return self.looks >= 4

    @has_viewers.setter
    def has_viewers(self, _there):
        pass


def test_nothing_but_the_first_frame_is_played_to_nobody(made):
    page = LonelyPage(ends_after=3)
    _play(made[0], page)

    assert page.seen_by_nobody == 1
    assert [frame for frame, _ in page.frames] == [0, 1, 2]
