"""The page: a viser server with the splats, a timeline, cameras and figures.

The only importer of viser. All who have the page open share it but for where
they stand. viser draws a Gaussian in one color, from wherever it is seen: the
colors are those that the eye sees which moved last.
"""

import io
import time
from collections.abc import Collection, Mapping
from contextlib import redirect_stdout
from dataclasses import dataclass

import numpy as np
import viser
from viser import uplot

from quarc_ref.viewing.doorkeeper import Doorkeeper
from quarc_ref.viewing.free_port import find_free_port
from quarc_ref.viewing.playback import Playback
from quarc_ref.viewing.splat_frame import SplatFrame
from quarc_ref.viewing.vantage import Vantage, Vector

_SPEEDS = {"0.25": 0.25, "0.5": 0.5, "1": 1.0, "2": 2.0}
_BRAND = (72, 138, 222)
_REST_SECONDS = 0.2
_HEADROOM = 1.1


@dataclass(frozen=True, slots=True, eq=False)
class Program:
    """What a page has to offer.

    Attributes:
        title: What the stream is called.
        frames: Ordinals of its frames.
        chart: Ordinals of some frames, and KB of each.
        vantages: By the cameras' names, the one to begin at first.
        up: `[3]` direction up.
    """

    title: str
    frames: range
    chart: tuple[Vector, Vector]
    vantages: Mapping[str, Vantage]
    up: Vector


class _Server(viser.ViserServer):
    """A server that is not made public over somebody else's, whatever a browser asks for."""

    def request_share_url(self, verbose: bool = True) -> None:
        """Do nothing."""


class Page:
    """A page for browsers. Use as a context.

    Args:
        program: What there is to see.
        address: Host and port; the next one that is free where this one is taken.
        names: More hosts that browsers may know the page by.

    Raises:
        OSError: The address cannot be listened at.
    """

    def __init__(
        self, program: Program, address: tuple[str, int], names: Collection[str] = ()
    ) -> None:
        self._vantages = program.vantages
        host, port = address[0], find_free_port(*address)
        self._doorkeeper = Doorkeeper(host, names)
        # The command says where the page is.
        with redirect_stdout(io.StringIO()), self._doorkeeper.watching():
            self._server = _Server(host, port, label=program.title, verbose=False)
        self._handle: viser.GaussianSplatHandle | None = None
        self._shown: SplatFrame | None = None
        self._shaded_for = self._eye = np.zeros(3, dtype=np.float32)
        self._moved_at = 0.0
        self._begin(next(iter(self._vantages.values()), None), program.up)
        self._add_controls(program)
        self._server.on_client_connect(self._follow)

    def __enter__(self) -> "Page":
        return self

    def __exit__(self, *_fault: object) -> None:
        with redirect_stdout(io.StringIO()):
            self._server.stop()

    @property
    def url(self) -> str:
        """Where the page is, for who is to see it."""
        host, port = self._server.get_host(), self._server.get_port()
        return f"http://{f'[{host}]' if ':' in host else host}:{port}/?key={self._doorkeeper.key}"

    def steer(self, playback: Playback) -> None:
        """Have the controls steer a playback."""
        self._play.on_click(lambda _: self._toggle(playback))
        self._speed.on_update(lambda _: playback.set_speed(_SPEEDS[self._speed.value]))

        @self._frame.on_update
        def _(event: viser.GuiEvent[viser.GuiSliderHandle[int]]) -> None:
            if event.client is not None:
                playback.seek(event.target.value)

    @property
    def has_viewers(self) -> bool:
        """Whether anybody has the page open."""
        return bool(self._server.get_clients())

    def show(self, frame: int, splats: SplatFrame) -> None:
        """Show a frame."""
        self._shown = splats
        with self._server.atomic():
            self._frame.value = frame  # type: ignore[misc]  # its setter is not where mypy looks
            self._draw(splats)
        self._server.flush()

    def refresh(self) -> None:
        """Color the frame anew if an eye has moved and come to rest."""
        if self._shown is None or time.monotonic() < self._moved_at + _REST_SECONDS:
            return
        if self._shown.sh.shape[0] > 1 and not np.array_equal(self._eye, self._shaded_for):
            self._draw(self._shown)

    def show_playing(self, *, on: bool) -> None:
        """Have the button offer to pause, or to play."""
        self._play.label = "Pause" if on else "Play"
        self._play.icon = viser.Icon.PLAYER_PAUSE if on else viser.Icon.PLAYER_PLAY

    def tell(self, frame: int, text: str) -> None:
        """Show figures of a frame, in Markdown, and its place in the chart."""
        self._figures.content = text
        if self._chart is not None:
            places, kilobytes, _ = self._chart.data
            self._chart.data = (places, kilobytes, np.where(places == frame, kilobytes, 0))

    def warn(self, message: str) -> None:
        """Show a message in every browser, until it is clicked away."""
        for client in self._server.get_clients().values():
            client.add_notification("The stream is refused", message, color="red")

    def _begin(self, vantage: Vantage | None, up: Vector) -> None:
        self._server.scene.set_up_direction(up)
        self._server.scene.set_background_image(np.zeros((2, 2, 3), dtype=np.uint8))
        if vantage is None:
            return
        self._eye = vantage.position.astype(np.float32)
        first = self._server.initial_camera
        first.position, first.look_at, first.up = vantage.position, vantage.target, vantage.up
        first.fov, first.near, first.far = vantage.view_angle, vantage.near, vantage.far

    def _add_controls(self, program: Program) -> None:
        gui, frames = self._server.gui, program.frames
        gui.configure_theme(
            dark_mode=True, show_logo=False, show_share_button=False, brand_color=_BRAND
        )
        self._frame = gui.add_slider("Frame", frames.start, frames.stop - 1, 1, frames.start)
        self._play = gui.add_button("Play", icon=viser.Icon.PLAYER_PLAY)
        self._speed = gui.add_dropdown("Speed", tuple(_SPEEDS), initial_value="1")
        names = tuple(self._vantages)
        if names:
            camera = gui.add_dropdown("Camera", names, initial_value=names[0])
            camera.on_update(lambda event: self._move(event.client, camera.value))
        with gui.add_folder("Figures"):
            self._figures = gui.add_markdown("decoding ...")
            self._chart = self._add_chart(*program.chart)

    def _add_chart(self, places: Vector, kilobytes: Vector) -> viser.GuiUplotHandle | None:
        if not places.size:
            return None
        series: tuple[uplot.Series, ...] = (
            uplot.Series(label="frame"),
            uplot.Series(label="KB", stroke="#488ade", fill="#488ade40", width=1),
            uplot.Series(label="shown", stroke="#ffffff", fill="#ffffff", width=1),
        )
        # Told, for what the page finds by itself may be 0 to 1, with one frame in it.
        across = (float(places.min()) - 0.5, float(places.max()) + 0.5)
        up = (0.0, _HEADROOM * float(kilobytes.max()))
        return self._server.gui.add_uplot(
            (places, kilobytes, np.zeros_like(kilobytes)),
            series,
            title="KB per frame, canonical ones left out",
            scales={"x": uplot.Scale(time=False, range=across), "y": uplot.Scale(range=up)},
            legend=uplot.Legend(show=False),
            height=150,
        )

    def _toggle(self, playback: Playback) -> None:
        playback.play(on=not playback.is_playing)
        self.show_playing(on=playback.is_playing)

    def _move(self, client: viser.ClientHandle | None, name: str) -> None:
        """Let a viewer stand where a camera does."""
        if client is None:
            return
        vantage, camera = self._vantages[name], client.camera
        with client.atomic():
            camera.up_direction = vantage.up
            camera.position, camera.look_at = vantage.position, vantage.target
            camera.fov, camera.near, camera.far = vantage.view_angle, vantage.near, vantage.far

    def _follow(self, client: viser.ClientHandle) -> None:
        """Take note of wherever a viewer goes."""

        @client.camera.on_update
        def _(camera: viser.CameraHandle) -> None:
            self._eye = camera.position.astype(np.float32)
            self._moved_at = time.monotonic()

    def _draw(self, splats: SplatFrame) -> None:
        self._shaded_for = eye = self._eye
        arrays = splats.centers, splats.covariances, splats.shade(eye), splats.opacities
        if self._handle is None:
            add = self._server.scene.add_gaussian_splats
            self._handle = add("/splats", *arrays, scale=splats.unit)
        else:
            self._handle.set_gaussians(*arrays)
