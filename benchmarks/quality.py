"""Measures picture quality over captures, held-out sets and seeds, to resolve 0.2 dB.

    python benchmarks/quality.py --out DIR [--real DIR] [--still DIR] [--variants A,B] [--frames N]
                                 [--seeds N] [--preset P] [--set KEY=VALUE] [--lpips WEIGHTS]
                                 [--workers N | --ray ADDRESS]
    python benchmarks/quality.py --out DIR --against OTHER

Writes tables, CSV, JSON and a plot into DIR. Rows and streams are kept there, so that an
interrupted run resumes. The second form compares two finished studies.
"""

import sys

from quality.command import main

if __name__ == "__main__":
    sys.exit(main())
