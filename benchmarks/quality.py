"""Picture quality over captures, held-out sets and seeds, so that 0.2 dB can be seen.

    python benchmarks/quality.py --out DIR [--real DIR] [--still DIR] [--variants A,B] [--frames N]
                                 [--seeds N] [--preset P] [--set KEY=VALUE] [--lpips WEIGHTS]
                                 [--workers N | --ray ADDRESS]
    python benchmarks/quality.py --out DIR --against OTHER

Writes tables, CSV, JSON and a plot into DIR; rows and streams are kept there, so that a
run that was interrupted goes on. The second form compares two finished studies.
"""

import sys

from quality.command import main

if __name__ == "__main__":
    sys.exit(main())
