"""What binds the picture of a frame, field by field, and what each field would cost.

    python benchmarks/ladder.py CAPTURE [--stream FILE] [--frame T] [--ahead 1 5]
                                [--iterations 300 1000] [--rungs NAME ...] [--out DIR]
                                [--preset P] [--set KEY=VALUE] [--held-out CAMERA] [--seed N]

From the decoded frame T of a stream, standing still, a later frame of the capture is
fitted in floats and at no price: first with anchors alone, then with every Gaussian on its
own and one field more on every rung. Without --stream, the frames up to T are encoded
first. Rows are kept in DIR, so that a run that was interrupted goes on.
"""

import sys

from ladder.command import main

if __name__ == "__main__":
    sys.exit(main())
