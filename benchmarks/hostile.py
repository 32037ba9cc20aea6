"""Decodes mutated streams: each must result in frames or a rejection, within limits.

    python benchmarks/hostile.py --streams 1000000 [--processes P] [--series S] [--json]
    python benchmarks/hostile.py --structured --streams 20000

Structured streams contain hostile values with correct CRCs. The reference and the fast engine both
decode them, and must agree.

An interrupted run resumes. A series and a number identify a stream: `--only N` judges one stream
again, and failures are saved in OUT/failures. The exit code is 1 if a stream took more than 2
seconds of processor time or 512 MiB, or raised an unexpected exception. It is also 1 if the
structured streams did not reach every reject id.
"""

import sys

from hostile.command import main

if __name__ == "__main__":
    sys.exit(main())
