"""Coverage-guided fuzzing: `python -m fuzz TARGET [options of libFuzzer]`.

    pip install -e '.[fuzz]'
    python -m fuzz ply -max_total_time=60
    python -m fuzz streams crash-0123abcd        # run one input

Targets are in `fuzz.targets`. The corpus of a target is in out/fuzz/TARGET; each run extends it.
"""

import os
import sys
from pathlib import Path

os.environ["QUARC_REF_ENGINE"] = "reference"  # the engine that is instrumented
sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))

import atheris

with atheris.instrument_imports(include=["quarc_ref"]):
    from fuzz.targets import TARGETS, list_seeds
from hostile.mutations import join_chunks, split_stream
from quarc_ref.format.errors import BitstreamError

_CORPUS_ROOT = Path("out/fuzz")


def main() -> None:
    """Fuzz a target until an input fails or a limit of libFuzzer is reached."""
    target = sys.argv[1] if len(sys.argv) > 1 else ""
    if target not in TARGETS:
        sys.exit(f"{__doc__}\nTargets: {', '.join(TARGETS)}")
    arguments = [sys.argv[0], *sys.argv[2:]]
    if not any(Path(word).is_file() for word in sys.argv[2:]):
        arguments.append(str(_prepare_corpus(target)))
    mutators = {"custom_mutator": _mutate_stream} if target in ("container", "streams") else {}
    atheris.Setup(arguments, TARGETS[target], **mutators)
    atheris.Fuzz()


def _prepare_corpus(target: str) -> Path:
    """Return the folder with the corpus of a target, including the seeds."""
    folder = _CORPUS_ROOT / target
    folder.mkdir(parents=True, exist_ok=True)
    for number, seed in enumerate(list_seeds(target)):
        (folder / f"seed_{number}").write_bytes(seed)
    return folder


def _mutate_stream(data: bytes, max_size: int, seed: int) -> bytes:
    """Mutate a payload and correct the CRCs.

    For one seed in four, or if the data is not a stream of chunks, mutate arbitrary bytes instead.
    """
    try:
        chunks = split_stream(data) if seed % 4 else []
    except BitstreamError:
        chunks = []
    if not chunks:
        mutated: bytes = atheris.Mutate(data, max_size)
        return mutated
    index = seed // 4 % len(chunks)
    kind, payload = chunks[index]
    chunks[index] = (kind, atheris.Mutate(payload, max(1, len(payload) + 64)))
    return join_chunks(chunks)[:max_size]


if __name__ == "__main__":
    main()
