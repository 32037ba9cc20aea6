"""Mutated streams, decoded: whatever the bytes, there come frames or a rejection, soon.

    python benchmarks/hostile.py --streams 1000000 [--processes P] [--series S] [--json]
    python benchmarks/hostile.py --structured --streams 20000

Structured streams have hostile values coded anew, with CRCs that hold; each is
decoded by the reference and by the fast engine, which must agree.

A run that is ended goes on where it was. A stream is named by its series and number:
`--only N` judges one again, and what failed is in OUT/failures. The exit code is
1 if any decoded for more than 2 seconds of the processor, took more than 512 MiB,
or ended in anything but frames and rejections, and if no structured stream came to
one of the reject ids.
"""

import sys

from hostile.command import main

if __name__ == "__main__":
    sys.exit(main())
