# SPDX-FileCopyrightText: 2026 The VoxelPipe authors
# SPDX-License-Identifier: Apache-2.0
"""What the comparisons of this folder share."""
import importlib.metadata


def version(package, module=None):
    """The version of an installed package, under whichever of its names; None if there is none.

    module: what to import and to ask where pip knows of no such package, as for a distribution's OpenVDB.
    """
    for name in (package, f"{package}-cpu"):
        try:
            return importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            pass
    if module is None:
        return None
    try:
        imported = __import__(module)
    except ImportError:
        return None
    found = getattr(imported, "LIBRARY_VERSION", getattr(imported, "__version__", "?"))
    return ".".join(map(str, found)) if isinstance(found, tuple) else str(found)
