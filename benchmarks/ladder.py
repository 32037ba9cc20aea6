"""Measures which fields limit the quality of a frame, and how many bytes each field costs.

    python benchmarks/ladder.py CAPTURE [--stream FILE] [--frame T] [--ahead 1 5]
                                [--iterations 300 1000] [--rungs NAME ...] [--out DIR]
                                [--preset P] [--set KEY=VALUE] [--held-out CAMERA] [--seed N]

Training starts from the decoded frame T of a stream, and fits its Gaussians to a later frame of the
capture, in floats and without regularizers. A rung of the ladder is a set of fields that can
change. On the first rung, nothing changes; on the second, only anchors move; on the third, every
Gaussian moves freely. Each of the next rungs adds a field; the last rungs are variations of these.
Without --stream, the frames up to T are encoded first. Rows are kept in DIR, so that an interrupted
run can be resumed.
"""

import sys

from ladder.command import main

if __name__ == "__main__":
    sys.exit(main())
