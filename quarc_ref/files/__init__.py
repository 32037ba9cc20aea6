"""Writes files and folders atomically, without touching files of other programs.

    with atomic_file(Path("a.bin")) as sink:            # visible only after the block ends
        sink.write(data)
    with written_folder(Path("frames")) as folder:      # also visible only after the block ends
        folder.write("frame_0000.ply", data)

Output is written next to its target under a hidden random name, is locked while the writing process
runs, and is removed after an error. If a process is killed, the next process that writes the same
target removes the temporary files. Every output folder contains a marker, which is a file that
lists the other files of the folder. In an output folder, only the
listed files, their temporary files and the marker are ever deleted.
"""

from quarc_ref.files.atomic import atomic_file, sync_file, sync_folder, write_file
from quarc_ref.files.errors import OutputPathError, name_full_disk
from quarc_ref.files.folders import growing_folder, written_folder
from quarc_ref.files.leftovers import remove_leftovers
from quarc_ref.files.logs import open_log
from quarc_ref.files.marker import MARKER_NAME
from quarc_ref.files.output_folder import OutputFolder

__all__ = [
    "MARKER_NAME",
    "OutputFolder",
    "OutputPathError",
    "atomic_file",
    "growing_folder",
    "name_full_disk",
    "open_log",
    "remove_leftovers",
    "sync_file",
    "sync_folder",
    "write_file",
    "written_folder",
]
