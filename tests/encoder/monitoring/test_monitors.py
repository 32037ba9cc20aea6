import io
from dataclasses import replace

from quarc_ref.encoder import EncodeOptions, encode
from quarc_ref.encoder.monitoring.monitor import MonitorGroup
from quarc_ref.encoder.settings.frames import UpdateSettings
from quarc_ref.inspection.inspect_stream import inspect_stream
from tests.encoder.toys import SMALL, make_capture


class _RecordingMonitor:
    """A monitor that records its calls, and requests all optional values."""

    def __init__(self):
        self.plans, self.estimates, self.steps, self.frames, self.ends = [], [], [], [], 0

    def begin(self, plan, estimate):
        self.plans.append(plan)
        self.estimates.append(estimate())

    def step(self, step):
        self.steps.append((step.stage, step.frame, step.step, step.loss(), step.psnr()))

    def frame(self, frame):
        self.frames.append(frame)

    def end(self):
        self.ends += 1


def _encode(monitor=None, config=SMALL):
    sink = io.BytesIO()
    options = {} if monitor is None else {"monitor": monitor}
    encode(make_capture(3), sink, EncodeOptions(config, 3, "cpu", **options))
    return sink.getvalue()


def test_monitors_are_called_for_every_event_and_change_no_byte():
    first, second = _RecordingMonitor(), _RecordingMonitor()
    data = _encode(MonitorGroup([first, second]))

    assert data == _encode()
    assert first.plans == second.plans
    assert first.estimates == second.estimates
    assert first.estimates[0].seconds > 0
    assert first.estimates[0].byte_count > 0
    assert [frame.frame for frame in first.frames] == [0, 1, 2]
    assert first.frames[-1].total_bytes < len(data)
    assert first.ends == second.ends == 1
    stages = {(stage, frame) for stage, frame, *_ in first.steps}
    assert {("canonical", 0), ("motion", 1), ("motion", 2)} <= stages
    assert all(0 < psnr < 100 and loss > 0 for *_, loss, psnr in first.steps)
    canonical = [step for stage, _, step, *_ in first.steps if stage == "canonical"]
    assert canonical == list(range(1, SMALL.canonical.iterations + 1))


def test_monitors_receive_all_deaths_including_those_by_updates():
    stream = replace(SMALL.stream, updates=True)
    updates = UpdateSettings(lr=0.9, rd_lambda=0.0, quantize_rd_lambda=0.0, death_opacity=0.4)
    monitor = _RecordingMonitor()

    data = _encode(monitor, replace(SMALL, stream=stream, updates=updates))

    deaths = [frame.deaths for frame in inspect_stream(data).frames]
    assert [frame.deaths for frame in monitor.frames] == deaths
    assert sum(deaths) > sum(frame.births for frame in monitor.frames)
