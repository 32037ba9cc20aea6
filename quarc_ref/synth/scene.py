"""The synthetic scene at any time, which is a playroom or a variant of it.

A ball bounces in front of a dancing robot, between a crate on a turntable and a blob on a
stool. A train drives around these objects, below a mobile. In the background, the door of a
cabinet slides open and a screen changes its picture. Only the door and the screen
reveal new content; all other objects only move. The variants `bright-stage` and `dark-stage`
show only the robot in a hall.
"""

from dataclasses import dataclass

from quarc_ref.synth.furniture import (
    compute_opening,
    make_cabinet,
    make_floor_objects,
    make_room,
    make_screen,
    make_wall_objects,
)
from quarc_ref.synth.hall import make_hall, make_small_lamps
from quarc_ref.synth.options import draw_uniform
from quarc_ref.synth.paints import Palette, choose_palette
from quarc_ref.synth.robot import make_robot
from quarc_ref.synth.scene_arrays import SceneArrays, pack_scene_arrays
from quarc_ref.synth.solids import Solid
from quarc_ref.synth.toys import (
    make_ball,
    make_balloon,
    make_blob,
    make_crate,
    make_mobile,
    make_train,
)
from quarc_ref.synth.variants import PLAYROOM, Variant

_BASE_TEMPO = 0.75  # seconds in the scene per second of the video
_MAX_DELAY_SECONDS = 0.1  # maximum random delay of the door; that of the screen is twice as long


@dataclass(frozen=True, slots=True)
class Scene:
    """A scene with its randomly chosen palette and phases.

    Attributes:
        palette: Colors of the scene.
        phases: Phases, in turns, of ball, crate, blob, mobile, train, robot, door, screen and
            patterns, in this order.
        variant: Variant of the playroom.
    """

    palette: Palette
    phases: tuple[float, ...]
    variant: Variant

    def at_time(self, time: float) -> SceneArrays:
        """Return the arrays of the scene at a given time of the video, in seconds."""
        time = _BASE_TEMPO * self.variant.tempo * time
        return self._build_hall(time) if self.variant.is_hall else self._build_playroom(time)

    def background(self) -> SceneArrays:
        """Return the arrays of a hall without the robot, at any time."""
        return self._fill_hall([])

    def _build_hall(self, time: float) -> SceneArrays:
        return self._fill_hall(make_robot(time, self.phases[5], self.palette))

    def _fill_hall(self, subject: list[list[Solid]]) -> SceneArrays:
        pattern_phase, groups = self.phases[8], [*subject, make_small_lamps()]
        hall = make_hall(pattern_phase, self.palette, is_dark=self.variant.is_dark)
        return pack_scene_arrays(groups, hall)

    def _build_playroom(self, time: float) -> SceneArrays:
        palette = self.palette
        (
            ball_phase,
            crate_phase,
            blob_phase,
            mobile_phase,
            train_phase,
            robot_phase,
            door_phase,
            screen_phase,
            pattern_phase,
        ) = self.phases
        groups = [
            *make_robot(time, robot_phase, palette),
            make_ball(time, ball_phase, palette),
            make_crate(time, crate_phase, palette),
            make_blob(time, blob_phase, palette),
            *make_train(time, train_phase, palette),
            make_mobile(time, mobile_phase, palette),
            make_cabinet(
                compute_opening(time, _MAX_DELAY_SECONDS * door_phase), pattern_phase, palette
            ),
            make_screen(compute_opening(time, _MAX_DELAY_SECONDS * (1 + screen_phase)), palette),
            *make_wall_objects(pattern_phase, palette),
            *make_floor_objects(pattern_phase, palette),
            *self._build_balloon(time),
        ]
        return pack_scene_arrays(groups, make_room(pattern_phase, palette))

    def _build_balloon(self, time: float) -> list[list[Solid]]:
        return [make_balloon(time, self.palette)] if self.variant.has_balloon else []


def make_scene(seed: int, variant: Variant = PLAYROOM) -> Scene:
    """Return the scene that a seed and a variant define."""
    return Scene(choose_palette(seed), tuple(draw_uniform(seed, "phases", 9).tolist()), variant)
