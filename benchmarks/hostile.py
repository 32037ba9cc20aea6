"""Mutated streams, decoded: whatever the bytes, there come frames or a refusal, soon.

    python benchmarks/hostile.py --streams 1000000 [--processes P] [--series S] [--json]

A run that is ended goes on where it was. A mutant is told by series and
number: `--only N` judges one again, and what failed is in OUT/failures. The
exit code is 1 if any decoded for more than 2 seconds of the processor, took
more than 512 MiB, or ended in anything but frames and refusals.
"""

import sys

from hostile.command import main

if __name__ == "__main__":
    sys.exit(main())
