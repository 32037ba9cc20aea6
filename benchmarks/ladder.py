"""Measures which fields limit the quality of a frame, and how many bytes each field costs.

    python benchmarks/ladder.py CAPTURE [--stream FILE] [--frame T] [--ahead 1 5]
                                [--iterations 300 1000] [--rungs NAME ...] [--out DIR]
                                [--preset P] [--set KEY=VALUE] [--held-out CAMERA] [--seed N]

Starting from the decoded frame T of a stream, a later frame of the capture is fitted in floats,
without regularizers. A rung of the ladder is a set of fields that can change. On the first rungs,
only anchors move, and then every Gaussian moves freely; each later rung adds a field. Without
--stream, the frames up to T are encoded first. Rows are kept in DIR, so that an interrupted run can
be resumed.
"""

import sys

from ladder.command import main

if __name__ == "__main__":
    sys.exit(main())
