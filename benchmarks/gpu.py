"""Runs all tests and measurements that need a CUDA GPU, by default in at most ten minutes.

    python benchmarks/gpu.py --out DIR [--wheels DIR] [--minutes M] [--dry-run]
    python benchmarks/gpu.py --fetch DIR [--python 3.12]

The first form writes a table to `gpu.md` and `gpu.json` in DIR after every step, so an interrupted
run leaves the rows of the completed steps. The row of a step that fails or takes too long has the
reason. `--dry-run` runs all steps on the CPU in tiny sizes.

If the machine with the GPU lacks packages and has no network, fetch their wheels elsewhere with the
second form, for that machine's version of Python, and copy the folder. `--wheels` installs missing
packages into a subfolder that only this command uses.
"""

from gpu.command import main

if __name__ == "__main__":
    raise SystemExit(main())
