"""Decodes mutated streams; each must give frames or a rejection, with limited time and memory.

    python benchmarks/hostile.py --streams 1000000 [--processes P] [--series S] [--json]
    python benchmarks/hostile.py --both-engines --streams 1000000 [...]
    python benchmarks/hostile.py --structured --streams 20000

The structured streams have hostile values and correct CRCs. With `--both-engines` or
`--structured`, each stream is decoded by the reference engine and by the fast engine, which must
agree; otherwise, most streams are decoded by one engine.

An interrupted run can be resumed with the same command. A series and a number identify a stream:
`--series S --only N` decodes stream N of series S again. Streams that fail are saved in the folder
`failures` of the series. The exit code is 1 if decoding a stream took more than 2 seconds of
processor time or 512 MiB of memory, or raised an unexpected exception. With `--structured`, the
exit code is also 1 if some reject ids never occurred.
"""

import sys

from hostile.command import main

if __name__ == "__main__":
    sys.exit(main())
