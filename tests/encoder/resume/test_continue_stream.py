import io

from hypothesis import given
from hypothesis import strategies as st

from quarc_ref.encoder.resume.continue_stream import OverwritingSink


class _File(io.BytesIO):
    """A file that notes whether it became shorter."""

    is_cut = False

    def truncate(self, size=None):
        self.is_cut = True
        return super().truncate(size)


@given(st.lists(st.binary(max_size=5)), st.binary(max_size=20), st.integers(0, 30))
def test_equal_bytes_are_overwritten_and_others_removed(pieces, other_bytes, kept_bytes):
    data = b"".join(pieces)
    rest = data[:kept_bytes] + other_bytes
    for existing_bytes in (data[:kept_bytes], rest):
        file = _File(b"frame" + existing_bytes)
        file.seek(5)
        sink = OverwritingSink(file)
        for piece in pieces:
            sink.write(piece)

        assert file.getvalue().startswith(b"frame" + data)
        assert file.is_cut == (not data.startswith(existing_bytes[: len(data)]))
        if file.is_cut:
            assert file.getvalue() == b"frame" + data
