import numpy as np
import pytest

from quarc_ref.encoder.checks.moved_cameras import find_moved_cameras
from quarc_ref.encoder.checks.recording import GrayFrames, Recording
from tests.encoder.checks.shaken_scenes import film, move

_NAMES = ("cam00", "cam01", "cam02", "cam03")


def _find(changed, others=None, start=0):
    """Return the findings about a recording of cam02 and others that stand still."""
    still = others or [film(len(changed.samples.frames), seed=seed) for seed in (1, 2, 3)]
    return list(find_moved_cameras(_NAMES, [*still[:2], changed, still[2]], start))


def _during(first, last, change):
    """Return a change of the pictures from one frame to another."""
    return lambda frame, picture: change(picture) if first <= frame <= last else picture


def test_still_cameras_have_no_findings():
    assert _find(film()) == []
    assert _find(film(12)) == []


@pytest.mark.parametrize("pixels", [1, 3, 10, 40])
def test_a_camera_that_was_pushed_is_found(pixels):
    x, y = -0.8 * pixels / 4, 0.6 * pixels / 4

    (finding,) = _find(film(change=_during(17, 40, lambda picture: move(picture, x, y))))

    assert (finding.kind, finding.cameras) == ("camera-moved", ("cam02",))
    assert "from frame 17 on" in finding.message
    assert finding.message.endswith(
        'add "ignored_frames": {"cam02": [[17, null]]} to quarc-capture.json, so that only the '
        "other cameras are used"
    )
    stated_pixels = float(finding.message.split("shifted by ")[1].split(" pixels")[0])
    assert stated_pixels == pytest.approx(pixels, rel=0.15)


def test_a_shift_below_half_a_pixel_is_not_reported():
    assert _find(film(change=_during(17, 40, lambda picture: move(picture, 0.1, 0)))) == []


def test_a_short_shift_ends():
    shaken = film(60, _during(22, 37, lambda picture: move(picture, 2, 1)))

    (finding,) = _find(shaken, start=100)

    assert "in frames 122 to 137" in finding.message
    assert "[[122, 137]]" in finding.message


def test_a_single_odd_window_is_ignored():
    assert _find(film(60, _during(25, 29, lambda picture: move(picture, 2, 1)))) == []


@pytest.mark.parametrize("level", [2, 100])
def test_a_camera_without_a_picture_is_found(level):
    covered = film(change=_during(12, 40, lambda picture: np.full_like(picture, level)))
    covered.samples.pictures[12:] = level * 128  # the person does not show either

    (finding,) = _find(covered)

    assert (finding.kind, finding.cameras) == ("camera-covered", ("cam02",))
    assert "shows almost nothing from frame 12 on" in finding.message
    assert "[[12, null]]" in finding.message


def test_cameras_in_the_dark_are_neither_covered_nor_moved():
    dim = _during(20, 40, lambda picture: picture * 0.05)

    assert _find(film(change=dim), [film(change=dim, seed=seed) for seed in (1, 2, 3)]) == []


def test_brighter_pictures_are_not_shifted():
    assert _find(film(change=lambda frame, picture: picture * (1 - 0.01 * frame))) == []


def test_a_rig_that_moves_has_a_single_finding():
    def drift(frame, picture):
        return move(picture, frame / 20, 0)

    (finding,) = _find(film(change=drift), [film(change=drift, seed=seed) for seed in (1, 2, 3)])

    assert (finding.kind, finding.cameras) == ("camera-moved", _NAMES)
    assert "use cameras that stand still" in finding.message
    assert float(finding.message.split("by up to ")[1].split(" pixels")[0]) == pytest.approx(7, 0.2)


def test_frames_between_samples_are_ignored_too():
    frames = np.linspace(0, 3900, 40).astype(int)
    still = [film(frames=frames, seed=seed) for seed in (1, 2, 3)]
    pushed = film(frames=frames, change=_during(1650, 2600, lambda picture: move(picture, 2, 1)))

    (finding,) = _find(pushed, still)

    assert "in frames 1601 to 2699" in finding.message


def test_unusable_samples_are_left_out():
    changed = film(change=_during(20, 40, lambda picture: move(picture, 2, 1)))
    samples = changed.samples
    samples.pictures[18:21] = 0
    samples.is_usable[18:21] = False

    (finding,) = _find(changed)

    assert "from frame 18 on" in finding.message  # the last usable frame before is 17


def _push_twice(frame, picture):
    return move(picture, 2, 1) if 20 <= frame < 30 or frame >= 45 else picture


def test_all_spans_in_which_a_camera_is_moved_are_reported():
    (finding,) = _find(film(60, _push_twice))

    assert "in frames 20 to 29 and from frame 45 on" in finding.message
    assert '{"cam02": [[20, 29], [45, null]]}' in finding.message


@pytest.mark.parametrize(("ignored", "first"), [(slice(18, 32), 45), (slice(0, 11), 20)])
def test_a_camera_with_windows_without_usable_samples_is_still_examined(ignored, first):
    pushed = film(60, _push_twice)
    pushed.samples.pictures[ignored] = 0
    pushed.samples.is_usable[ignored] = False

    (finding,) = _find(pushed)

    assert f'{{"cam02": [[{first}, ' in finding.message


@pytest.mark.parametrize("rows", [1, 7])
def test_cameras_with_very_wide_pictures_are_not_examined(rows):
    samples = film().samples
    low = GrayFrames(samples.frames, samples.pictures[:, :rows], samples.is_usable)

    assert _find(Recording(4, low, low, {})) == []


def test_cameras_without_texture_or_frames_are_not_examined():
    flat = GrayFrames(
        np.arange(40), np.full((40, 54, 96), 12_800, np.uint16), np.ones(40, dtype=bool)
    )
    never_usable = GrayFrames(flat.frames, flat.pictures, np.zeros(40, dtype=bool))
    pushed = film(change=_during(17, 40, lambda picture: move(picture, 2, 1)))
    others = [Recording(4, frames, frames, {}) for frames in (flat, never_usable)]

    findings = _find(pushed, [*others, film(seed=3)])

    assert [finding.cameras for finding in findings] == [("cam02",)]
    assert _find(film(9), [film(9, seed=seed) for seed in (1, 2, 3)]) == []
    assert _find(others[0], [others[0]] * 3) == []
