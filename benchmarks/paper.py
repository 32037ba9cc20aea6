"""Runs the experiments of the QuARC-GS paper on one or several captures.

    python benchmarks/paper.py CAPTURE... --out DIR [--preset P] [--frames N] [--only full,step]
                               [--workers N | --ray ADDRESS] [--lpips WEIGHTS] [--set KEY=VALUE]

Writes a page (DIR/index.html), tables as CSV and Markdown, and plots. Finished rows and streams are
kept in DIR, so the same command resumes an interrupted run. If several captures are given, each has
its own folder in DIR, and DIR/scenes.md and DIR/scenes.csv list the results of all captures with
their means.
"""

import sys

from paper.command import main

if __name__ == "__main__":
    sys.exit(main())
