"""Make the demonstration data in src/isovary/data from an npz of electron densities.

    python tools/make_demo_data.py h2o_bond_density.npz

The npz holds densities ``s`` (member, x, y, z) in e/bohr^3, the bond lengths ``param``
in angstrom, and ``spacing`` and ``origin`` in bohr.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkIOXML import vtkXMLImageDataWriter

LENGTHS = (0.95, 1.00)
ISOVALUE = 0.002  # lowest isovalue that must stay inside the box
MARGIN = 6  # voxels around it
FOLDER = Path(__file__).parents[1] / "src" / "isovary" / "data"


def box(densities: np.ndarray) -> tuple[slice, ...]:
    """The smallest box that holds the isovalue in every member, plus the margin.

    Along x and y it is cut by the same number of voxels at both ends, because the grid is
    centred on the molecule there.
    """
    inside = np.argwhere(densities >= ISOVALUE)[:, 1:]
    shape = np.array(densities.shape[1:])
    low, high = inside.min(axis=0) - MARGIN, inside.max(axis=0) + MARGIN + 1
    cut = np.minimum(low, shape - high)[:2]
    low[:2], high[:2] = cut, shape[:2] - cut
    return tuple(slice(int(a), int(b)) for a, b in zip(low, high, strict=True))


def write(path: Path, values: np.ndarray, spacing: np.ndarray, origin: np.ndarray) -> None:
    """Write a VTK image: float32, zlib, raw appended data."""
    image = vtkImageData()
    image.SetDimensions(values.shape)
    image.SetSpacing(spacing.tolist())
    image.SetOrigin(origin.tolist())
    data = numpy_to_vtk(values.astype(np.float32).ravel(order="F"), deep=True)  # type: ignore[no-untyped-call]
    data.SetName("electron_density")
    image.GetPointData().SetScalars(data)
    writer = vtkXMLImageDataWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(image)
    writer.SetCompressorTypeToZLib()
    writer.SetCompressionLevel(9)
    writer.SetEncodeAppendedData(False)
    if not writer.Write():
        raise OSError(f"{path}: VTK did not write it")


def main(source: str) -> None:
    """Cut two members out of the family and write them."""
    with np.load(source, allow_pickle=False) as file:
        members = [int(np.argmin(abs(file["param"] - length))) for length in LENGTHS]
        densities, spacing, origin = file["s"][members], file["spacing"], file["origin"]
    cut = box(densities)
    corner = origin + spacing * [part.start for part in cut]
    for length, values in zip(LENGTHS, densities, strict=True):
        path = FOLDER / f"water_oh_{length:.2f}.vti"
        write(path, values[cut], spacing, corner)
        print(path.name, values[cut].shape, corner, path.stat().st_size)


if __name__ == "__main__":
    main(sys.argv[1])
