"""A PLY in another program's format, by the library gaussforge."""

from quarc_ref.export.errors import ExportError


def convert_ply(data: bytes, form: str, **options: int) -> bytes:
    """Return a 3DGS PLY as a file of another format.

    Args:
        data: The PLY.
        form: `spz` or `sog`.
        options: Of the library.

    Raises:
        ExportError: The library refuses it.
    """
    from gaussforge import GaussForge

    result = GaussForge().convert(data, "ply", form, **options)
    if "error" in result:
        message = f"gaussforge makes no {form.upper()} of the frame: {result['error']}"
        raise ExportError(message)
    converted: bytes = result["data"]
    return converted
