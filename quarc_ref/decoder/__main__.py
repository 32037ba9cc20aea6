"""The contract of conformance tests: `python -m quarc_ref.decoder < stream`.

Bytes come in on standard input; a JSON line goes out for every frame, with the
SHA-256 of its state, and one that names the refusal if there is one.
"""

import json
import sys

from quarc_ref.decoder.decode_stream import decode
from quarc_ref.decoder.digest import compute_digest
from quarc_ref.decoder.sources import PipeSource
from quarc_ref.format.errors import BitstreamError


def main() -> int:
    """Decode standard input; return 0, or 1 if the stream is refused."""
    try:
        for scene in decode(PipeSource(sys.stdin.buffer)):
            line = {"frame": scene.frame, "gaussians": scene.count, "sha256": compute_digest(scene)}
            sys.stdout.write(json.dumps(line) + "\n")
    except BitstreamError as error:
        sys.stdout.write(json.dumps({"refused": error.reject_id, "message": str(error)}) + "\n")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
