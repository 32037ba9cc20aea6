"""Runs all tests and measurements that need a CUDA GPU, by default in at most ten minutes.

    python benchmarks/gpu.py --out DIR [--wheels DIR] [--minutes M] [--dry-run]
    python benchmarks/gpu.py --fetch DIR [--python 3.12]

The first form writes a table to `gpu.md` and `gpu.json` in DIR after every step, so an interrupted
run leaves the rows of all completed steps there. If a step fails or takes too long, its row states
the reason, and its output is kept in DIR, in a file such as `frame_0.log`. `--dry-run` runs all
steps on the CPU with tiny sizes.

If the GPU machine lacks packages and has no network, run the second form on another machine: it
downloads the wheels for the given Python version, which must be that of the GPU machine, and builds
that of the fast engine (needs cargo). Copy the folder to the GPU machine; `--wheels DIR` then
installs the missing packages into a subfolder of DIR that only this command uses.
"""

from gpu.command import main

if __name__ == "__main__":
    raise SystemExit(main())
