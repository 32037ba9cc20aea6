"""Files of single frames from one format to another, by the library gaussforge."""

from quarc_ref.export.errors import ExportError


def convert(data: bytes, source: str, target: str, **options: int) -> bytes:
    """Return a file of Gaussians in another format.

    Args:
        data: The file.
        source: Its format: `ply`, `spz` or `sog`.
        target: The format to make.
        options: Of the library.

    Raises:
        ExportError: The library rejects it.
        ImportError: The library is not installed.
    """
    from gaussforge import GaussForge

    result = GaussForge().convert(data, source, target, **options)
    if "error" in result:
        message = f"gaussforge makes no {target.upper()} of it: {result['error']}"
        raise ExportError(message)
    converted: bytes = result["data"]
    return converted
