"""Measures picture quality on several captures and held-out sets, with several seeds.

    python benchmarks/quality.py --out DIR [--real DIR] [--still DIR] [--variants A,B] [--frames N]
                                 [--seeds N] [--preset P] [--set KEY=VALUE] [--lpips WEIGHTS]
                                 [--workers N | --ray ADDRESS]
    python benchmarks/quality.py --out DIR --against OTHER

The first form writes tables, CSV, JSON and a plot into DIR. It also keeps rows and streams there,
so that an interrupted run can be resumed. The second form compares two finished studies. The study
resolves differences of 0.2 dB.
"""

import sys

from quality.command import main

if __name__ == "__main__":
    sys.exit(main())
