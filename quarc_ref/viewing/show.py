"""A stream on a page: decoding, timeline and page put together."""

import time
from collections import deque
from collections.abc import Collection
from threading import Event

import numpy as np

from quarc_ref.decoder import Splats
from quarc_ref.format import container
from quarc_ref.format.errors import QuarcError
from quarc_ref.inspection.stream_summary import KILOBYTE
from quarc_ref.playback import Frame, Player
from quarc_ref.streams import Source
from quarc_ref.viewing.frame_feed import FrameFeed
from quarc_ref.viewing.outline import Outline
from quarc_ref.viewing.page import Page, Program
from quarc_ref.viewing.playback import Playback
from quarc_ref.viewing.ready_frame import Preparer, ReadyFrame, describe_frame
from quarc_ref.viewing.shared_source import SharedSource
from quarc_ref.viewing.splat_frame import choose_unit
from quarc_ref.viewing.vantage import Vector, find_up, stand_at

_PATIENCE = 0.1
_SECONDS_BETWEEN_FIGURES = 0.25
_SHOWS_COUNTED = 30


def open_page(
    outline: Outline,
    first: Splats,
    title: str,
    address: tuple[str, int],
    names: Collection[str] = (),
) -> Page:
    """Open a page for a stream.

    Args:
        outline: Of the stream.
        first: Its first frame.
        title: What the stream is called.
        address: Host and port.
        names: More hosts that browsers may know the page by.

    Raises:
        OSError: The address cannot be listened at.
    """
    up = find_up(outline.cameras, outline.header.up_axis)
    vantages = {camera.name: stand_at(camera, up, first.positions) for camera in outline.cameras}
    frames = range(outline.first_frame, outline.stop)
    return Page(Program(title, frames, _chart(outline), vantages, up), address, names)


def _chart(outline: Outline) -> tuple[Vector, Vector]:
    """Return the ordinals of the frames that are not canonical, and KB of each."""
    numbered = enumerate(outline.chunks, outline.first_frame)
    moved = [(frame, chunk) for frame, chunk in numbered if chunk.kind == container.FRAM]
    sizes = [(chunk.end - chunk.offset) / KILOBYTE for _, chunk in moved]
    return np.array([float(frame) for frame, _ in moved]), np.array(sizes)


class Show:
    """Plays a stream on a page.

    Args:
        source: The stream, which can be read again; nobody else reads it meanwhile.
        outline: Of the stream.
        page: Where it is shown.
        playing: Whether to begin at once.
    """

    def __init__(
        self, source: Source, outline: Outline, page: Page, *, playing: bool = True
    ) -> None:
        self._source, self._outline, self._page = source, outline, page
        self._pace = outline.header.frames_per_second
        self._playback = Playback(outline.first_frame, outline.stop, self._pace)
        self._times: deque[float] = deque(maxlen=_SHOWS_COUNTED)
        self._figures_due = 0.0
        page.steer(self._playback)
        self._play(on=playing)

    def run(self, first: Splats, most_bytes: int, ended: Event) -> None:
        """Play until it is ended.

        Args:
            first: First frame of the stream.
            most_bytes: Of decoded frames that are kept.
            ended: Is set from elsewhere.
        """
        kinds = enumerate(chunk.kind for chunk in self._outline.chunks)
        begin = self._outline.first_frame
        canonical = [begin + index for index, kind in kinds if kind in container.CANONICAL]
        source, stop = SharedSource(self._source), self._outline.stop
        prepare = Preparer(source, self._outline, choose_unit(first))
        with (
            Player(source) as player,
            FrameFeed(player.frames, canonical, stop, prepare, most_bytes) as feed,
        ):
            while not ended.is_set():
                if self._page.has_viewers or not self._times:
                    self._go_on(feed)
                else:
                    ended.wait(_PATIENCE)

    def _go_on(self, feed: FrameFeed[Frame, ReadyFrame]) -> None:
        """Show the next frame when it is due, or wait a little for that."""
        frame = self._playback.await_frame(_PATIENCE)
        if frame is None:
            self._page.refresh()
            return
        try:
            ready = feed.get(frame, _PATIENCE)
        except QuarcError as error:
            self._page.warn(str(error))
            self._play(on=False)
            self._playback.mark_shown(frame)
            return
        if ready is not None:
            self._page.show(frame, ready.splats)
            self._playback.mark_shown(frame)
            self._tell(ready)

    def _play(self, *, on: bool) -> None:
        self._playback.play(on=on)
        self._page.show_playing(on=on)

    def _tell(self, ready: ReadyFrame) -> None:
        """Tell of a frame, but not so often that nobody can read it."""
        now = time.monotonic()
        if not self._playback.is_playing:
            self._times.clear()
        self._times.append(now)
        if self._playback.is_playing and now < self._figures_due:
            return
        self._figures_due = now + _SECONDS_BETWEEN_FIGURES
        self._page.tell(ready.frame, describe_frame(ready, self._rate(), self._pace))

    def _rate(self) -> float | None:
        if len(self._times) < 2:
            return None
        return (len(self._times) - 1) / max(1e-9, self._times[-1] - self._times[0])
