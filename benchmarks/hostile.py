"""Decodes mutated streams: each must result in frames or a rejection, within limits.

    python benchmarks/hostile.py --streams 1000000 [--processes P] [--series S] [--json]
    python benchmarks/hostile.py --structured --streams 20000

The structured streams have hostile values and correct CRCs. The reference engine and the fast
engine both decode each of them, and must agree.

An interrupted run can be resumed with the same command. A series and a number identify a stream:
`--only N` judges stream N of a series again. Streams that fail are saved in the folder `failures`
of the series. The exit code is 1 if decoding a stream took more than 2 seconds of processor time or
512 MiB of memory, or raised an unexpected exception. It is also 1 if the structured streams did not
reach every reject id.
"""

import sys

from hostile.command import main

if __name__ == "__main__":
    sys.exit(main())
