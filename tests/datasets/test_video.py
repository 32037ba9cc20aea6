import gc
from fractions import Fraction

import av
import cv2
import numpy as np
import pytest
from av.video.reformatter import ColorRange, Colorspace

from quarc_ref.datasets.errors import MissingFileError, TruncatedVideoError, UnreadableVideoError
from quarc_ref.datasets.orientation import rotate_upright
from quarc_ref.datasets.stills import read_still
from quarc_ref.datasets.video import VideoReader
from quarc_ref.datasets.video_writer import VideoFormat, write_video_file
from tests.datasets import forgeries, scenes

FRAME_COUNT = scenes.VIDEO_FRAME_COUNT


def test_no_frame_stays_in_memory_until_garbage_is_collected(video):
    reader = VideoReader(video)
    gc.collect()
    gc.disable()
    try:
        frames_before = _count_frames_in_memory()
        for frame in [*range(1, FRAME_COUNT)] * 4:
            reader.read(frame)
        # The threads of the decoder hold a few frames.
        assert _count_frames_in_memory() - frames_before < 2 * FRAME_COUNT
    finally:
        gc.enable()


def _count_frames_in_memory():
    return sum(type(item) is av.VideoFrame for item in gc.get_objects())


def test_size_rate_and_count_are_those_of_the_video(video):
    reader = VideoReader(video)

    assert (reader.width, reader.height, reader.frame_count) == (48, 32, FRAME_COUNT)
    assert reader.frames_per_second == scenes.FRAMES_PER_SECOND


@pytest.mark.parametrize("last_duration", [1, 500, 2000])
def test_the_duration_of_the_last_frame_does_not_change_the_rate(
    tmp_path, decoded_frames, last_duration
):
    path = tmp_path / "cam00.mp4"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("mpeg4", rate=scenes.FRAMES_PER_SECOND)
        stream.height, stream.width = decoded_frames[0].shape[:2]
        stream.codec_context.time_base = Fraction(1, 1000 * scenes.FRAMES_PER_SECOND)
        packets = []
        for index, picture in enumerate(decoded_frames):
            frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
            frame.pts, frame.time_base = 1000 * index, stream.codec_context.time_base
            packets += stream.encode(frame)
        packets += stream.encode()
        packets[-1].duration = last_duration
        for packet in packets:
            container.mux(packet)

    assert VideoReader(path).frames_per_second == pytest.approx(scenes.FRAMES_PER_SECOND)


@pytest.mark.parametrize(
    "frame_order",
    [range(FRAME_COUNT), reversed(range(FRAME_COUNT)), [6, 0, 10, 3, 3, 9, 5, 4, 1, 8]],
    ids=["onward", "backward", "any"],
)
def test_a_frame_does_not_depend_on_the_order_of_reading(video, decoded_frames, frame_order):
    reader = VideoReader(video)

    for frame in frame_order:
        assert np.array_equal(reader.read(frame), decoded_frames[frame])


@pytest.mark.parametrize("frame", range(FRAME_COUNT))
def test_a_frame_does_not_depend_on_the_order_if_blocks_are_refreshed_little_by_little(
    tmp_path, decoded_frames, frame
):
    path = tmp_path / "cam00.mp4"
    options = {"x264-params": "intra-refresh=1:keyint=4:bframes=0"}
    scenes.write_video(path, decoded_frames, codec_options=options)

    assert np.array_equal(VideoReader(path).read(frame), scenes.read_video(path)[frame])


def test_a_picture_stays_valid_after_the_next_read(video, decoded_frames):
    reader = VideoReader(video)
    first = reader.read(0)
    reader.read(1)

    assert np.array_equal(first, decoded_frames[0])


@pytest.mark.parametrize("frame", [-1, FRAME_COUNT])
def test_a_missing_frame_is_rejected(video, frame):
    with pytest.raises(TruncatedVideoError, match=f"has no frame {frame}"):
        VideoReader(video).read(frame)


def test_a_picture_that_is_attached_to_a_video_is_no_frame(tmp_path, decoded_frames):
    is_encoded, jpeg = cv2.imencode(".jpg", np.full((32, 48, 3), 99, np.uint8))
    path = tmp_path / "cam00.mp4"
    scenes.write_video(path, decoded_frames)
    expected_frames = scenes.read_video(path)
    path.write_bytes(forgeries.attach_picture(path.read_bytes(), jpeg.tobytes()))

    assert is_encoded
    assert np.array_equal(VideoReader(path).read(3), expected_frames[3])


def test_a_file_that_is_not_a_video_is_unreadable(tmp_path):
    path = tmp_path / "cam00.mp4"
    path.write_text("no video")

    with pytest.raises(UnreadableVideoError, match=r"cam00.mp4 cannot be opened"):
        VideoReader(path)


def test_a_missing_video_is_named(tmp_path):
    with pytest.raises(MissingFileError, match=r"cam00.mp4 is missing"):
        VideoReader(tmp_path / "cam00.mp4")


def test_sound_without_video_is_unreadable(tmp_path):
    path = tmp_path / "sound.mp4"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("aac", rate=8000, layout="mono")
        frame = av.AudioFrame.from_ndarray(np.zeros((1, 1024), np.float32), "fltp", "mono")
        frame.sample_rate = 8000
        container.mux(stream.encode(frame))
        container.mux(stream.encode())

    with pytest.raises(UnreadableVideoError, match="contains no video"):
        VideoReader(path)


def zero_packet(video, path, ordinal, kept_bytes):
    """Copy a video, and overwrite the packet of a frame with zeros after `kept_bytes` bytes."""
    data = bytearray(video.read_bytes())
    with av.open(str(video)) as container:
        packets = sorted((p.pts, p.pos, p.size) for p in container.demux(video=0) if p.size)
    _, position, size = packets[ordinal]
    data[position + kept_bytes : position + size] = bytes(size - kept_bytes)
    path.write_bytes(data)
    return path


@pytest.mark.parametrize("kept_bytes", [0, 5])
def test_a_damaged_frame_is_rejected_and_the_others_are_read(
    video, tmp_path, decoded_frames, kept_bytes
):
    reader = VideoReader(zero_packet(video, tmp_path / "damaged.mp4", 5, kept_bytes))

    with pytest.raises(UnreadableVideoError, match=r"frame 5 of .*damaged.mp4"):
        reader.read(5)
    assert np.array_equal(reader.read(0), decoded_frames[0])
    assert np.array_equal(reader.read(1), decoded_frames[1])


def test_frames_after_a_lost_one_are_read_from_the_next_key_frame(video, tmp_path, decoded_frames):
    reader = VideoReader(zero_packet(video, tmp_path / "damaged.mp4", 3, 0))
    rejected_frames = []
    for frame in range(FRAME_COUNT):
        try:
            assert np.array_equal(reader.read(frame), decoded_frames[frame])
        except UnreadableVideoError:
            rejected_frames.append(frame)

    assert 3 in rejected_frames
    assert not {0, 8, 9, 10} & set(rejected_frames)


def test_a_frame_with_concealed_errors_is_rejected(video, tmp_path, decoded_frames):
    data = bytearray(video.read_bytes())
    with av.open(str(video)) as container:
        packets = sorted((p.pts, p.pos, p.size) for p in container.demux(video=0) if p.size)
    _, position, size = packets[8]
    middle = position + size // 2
    data[middle : middle + 6] = bytes(byte ^ 0xA5 for byte in data[middle : middle + 6])
    path = tmp_path / "damaged.mp4"
    path.write_bytes(data)
    reader = VideoReader(path)

    with pytest.raises(UnreadableVideoError, match=r"frame 8 of .*damaged.mp4 is damaged"):
        reader.read(8)
    assert np.array_equal(reader.read(7), decoded_frames[7])


def test_a_video_without_its_first_key_frame_is_rejected(video, tmp_path):
    with pytest.raises(UnreadableVideoError, match=r"damaged.mp4 has .* start with a key"):
        VideoReader(zero_packet(video, tmp_path / "damaged.mp4", 0, 0))


@pytest.mark.parametrize("channels", [1, 3, 4])
def test_levels_of_16_bits_are_rounded(tmp_path, channels):
    levels = np.arange(256, dtype=np.uint16)[None, :, None].repeat(8, axis=0)
    errors = np.array([-128, 0, 0, 0, 0, 0, 0, 128])[:, None, None]
    deep_levels = np.clip(257 * levels.astype(int) + errors, 0, 65535).astype(np.uint16)
    assert cv2.imwrite(str(tmp_path / "deep.png"), deep_levels.repeat(channels, axis=2))

    assert np.array_equal(read_still(tmp_path / "deep.png"), levels.repeat(3, axis=2))


@pytest.mark.parametrize("pixel_format", ["yuv420p10le", "yuv422p10le", "yuv444p10le"])
def test_the_levels_of_10_bit_video_are_those_that_were_encoded(tmp_path, pixel_format):
    blocks = np.random.default_rng(0).integers(16, 240, (4, 8, 3), dtype=np.uint8)
    picture = blocks.repeat(16, axis=0).repeat(16, axis=1)
    format_ = VideoFormat(128, 64, Fraction(30), {"qp": "0"}, pixel_format)
    with (tmp_path / "cam00.mp4").open("wb") as file:
        write_video_file(file, [picture], format_)

    decoded = VideoReader(tmp_path / "cam00.mp4").read(0)
    centers = (slice(8, None, 16), slice(8, None, 16))
    assert np.abs(decoded[centers].astype(int) - picture[centers]).max() <= 1


@pytest.mark.parametrize("pixel_format", ["yuv420p10le", "yuv422p10le", "yuv444p12le"])
def test_deep_levels_of_the_full_range_are_rounded(pixel_format):
    frame = av.VideoFrame(1024, 16, pixel_format)
    frame.color_range, frame.colorspace = ColorRange.JPEG, Colorspace.ITU709
    max_level = (1 << frame.format.components[0].bits) - 1
    gray_chroma = (max_level + 1) // 2
    grays = np.linspace(0, max_level, 1024).round().astype(np.uint16)
    for plane, levels in zip(frame.planes, (grays, gray_chroma, gray_chroma), strict=True):
        np.frombuffer(plane, np.uint16).reshape(plane.height, -1)[:] = levels

    errors = rotate_upright(frame) - (grays * (255 / max_level))[:, None]
    assert (np.abs(errors).max(), errors.mean()) == pytest.approx((0.5, 0), abs=0.06)


@pytest.mark.parametrize("suffix", ["h264", "avi", "ts", "flv"])
def test_a_video_in_another_container_is_rejected_by_name(tmp_path, decoded_frames, suffix):
    path = tmp_path / f"cam00.{suffix}"
    scenes.write_video(path, decoded_frames)

    with pytest.raises(UnreadableVideoError, match=rf"{suffix} cannot be opened as mp4, mov, mkv"):
        VideoReader(path)


@pytest.mark.parametrize(
    ("suffix", "codec"), [("mkv", "libx264"), ("mov", "libx264"), ("webm", "libvpx-vp9")]
)
def test_other_containers_are_read(tmp_path, decoded_frames, suffix, codec):
    path = tmp_path / f"cam00.{suffix}"
    scenes.write_video(path, decoded_frames, codec=codec)
    reader, expected = VideoReader(path), scenes.read_video(path)

    assert reader.frame_count == FRAME_COUNT
    for frame in (9, 2, 3, 10, 0):
        assert np.array_equal(reader.read(frame), expected[frame])


@pytest.mark.parametrize("codec", ["libx264", "mpeg4", "mjpeg"])
def test_a_video_trimmed_without_recoding_is_complete(tmp_path, decoded_frames, codec):
    path = tmp_path / "trimmed.mp4"
    trimmed_count = 3
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=scenes.FRAMES_PER_SECOND)
        stream.height, stream.width = decoded_frames[0].shape[:2]
        stream.pix_fmt = "yuvj420p" if codec == "mjpeg" else "yuv420p"
        frames = [av.VideoFrame.from_ndarray(picture, format="rgb24") for picture in decoded_frames]
        for packet in [packet for frame in [*frames, None] for packet in stream.encode(frame)]:
            step = int(1 / (scenes.FRAMES_PER_SECOND * packet.time_base))
            packet.pts -= trimmed_count * step
            packet.dts -= trimmed_count * step
            container.mux(packet)
    reader = VideoReader(path)
    remaining_frames = scenes.read_video(path)

    assert reader.frame_count == len(remaining_frames) == FRAME_COUNT - trimmed_count
    for frame in (4, 0, 7):
        assert np.array_equal(reader.read(frame), remaining_frames[frame])
