"""Break each operator, signature and mesher on purpose, and see its tests fail.

A test that cannot fail is decoration. Each fault below is planted alone into a copy of the
package, the tests named beside it are run on that copy, and one of them must fail. Run by
`make teeth`; ends with 1 if a fault survives, or if a line to break is not there any more.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from fault import Fault
from faults_of_carrying import CARRYING
from faults_of_groups import GROUPS
from faults_of_making import MAKING
from faults_of_page import PAGE

ROOT = Path(__file__).parents[1]
OPERATORS = "tests/contracts/test_laplacian.py"
GRAPHS = "tests/test_laplacian_graphs.py"
SIGNATURES = "tests/contracts/test_signature.py"
BOUNDARIES = "tests/test_boundaries.py"
EXACT = "tests/test_exact.py"
METHODS = "tests/test_methods.py"
SPECTRUM = "tests/test_spectrum.py"
MESHERS = "tests/contracts/test_meshing.py"
EDITS = "tests/test_mesh_edits.py"
SIZING = "tests/test_sizing.py"
RIMS = "tests/test_mesh_rims.py"


FAULTS = (
    Fault(
        "fem: area of the element missing",
        "laplacian/_fem.py",
        "measure = root * (weights / 2)",
        "measure = np.ones_like(root) * (weights / 2)",
        (OPERATORS,),
    ),
    Fault(
        "fem: one-point mass",
        "laplacian/_fem.py",
        'mass = np.einsum("mq,qi,qj->mij", measure, values, values, optimize=True)',
        "mass = measure.sum(axis=1)[:, None, None] * "
        "np.full((values.shape[1],) * 2, values.shape[1] ** -2.0)",
        (OPERATORS, EXACT),
    ),
    Fault(
        "fem: metric not inverted",
        "laplacian/_fem.py",
        "adjugate = metric[..., ::-1, ::-1] * [[1.0, -1.0], [-1.0, 1.0]]",
        "adjugate = metric",
        (OPERATORS,),
    ),
    Fault(
        "fem: lumped in equal shares",
        "laplacian/_fem.py",
        'diagonal = np.einsum("mii->mi", mass)',
        "diagonal = np.ones(mass.shape[:2])",
        (BOUNDARIES,),
    ),
    Fault(
        "Dirichlet: the first rim node stays free",
        "laplacian/_boundary.py",
        "fixed[chosen] = True",
        "fixed[chosen[1:]] = True",
        (BOUNDARIES, EXACT),
    ),
    Fault(
        "Dirichlet: area of the free nodes only",
        "laplacian/_boundary.py",
        "laplacian.nodes, laplacian.area)",
        "laplacian.nodes)",
        (BOUNDARIES,),
    ),
    Fault(
        "cotangent: full weights",
        "laplacian/_cotangent.py",
        "cotangents.T.ravel() / 2",
        "cotangents.T.ravel()",
        (OPERATORS,),
    ),
    Fault(
        "cotangent: obtuse triangles like others",
        "laplacian/_cotangent.py",
        "obtuse = products < 0",
        "obtuse = products < -np.inf",
        (OPERATORS, GRAPHS),
    ),
    Fault(
        "graphs: scale without the factor 2",
        "laplacian/_graph.py",
        "(2 * sites.area / energy)",
        "(sites.area / energy)",
        (OPERATORS, GRAPHS),
    ),
    Fault(
        "graphs: random walk without degrees",
        "laplacian/_graph.py",
        "graph.sum(axis=1) if random_walk else",
        "np.ones(len(sites.points)) if random_walk else",
        (OPERATORS, GRAPHS),
    ),
    Fault(
        "graphs: heat weights of distances, not of squares",
        "laplacian/_graph.py",
        "np.exp(-squares / (heat * squares.mean()))",
        "np.exp(-np.sqrt(squares / (heat * squares.mean())))",
        (OPERATORS, GRAPHS),
    ),
    Fault(
        "uniform graph: every other edge twice",
        "laplacian/_uniform_graph.py",
        "graph = weighted_graph(edges, np.ones(len(edges)), size)",
        "graph = weighted_graph(edges, 1.0 + np.arange(len(edges)) % 2, size)",
        (OPERATORS, GRAPHS),
    ),
    Fault(
        "kNN graph: one neighbour less",
        "laplacian/_knn_graph.py",
        "tree.query(points, count + 1)",
        "tree.query(points, count)",
        (OPERATORS, GRAPHS),
    ),
    Fault(
        "epsilon graph: radius squared",
        "laplacian/_epsilon_graph.py",
        "pairs = pairs_within(sites.points, reach)",
        "pairs = pairs_within(sites.points, reach**2)",
        (OPERATORS, GRAPHS),
    ),
    Fault(
        "Belkin: kernel exp(-d^2 / 2h)",
        "laplacian/_heat_kernel.py",
        "/ (4 * time)) /",
        "/ (2 * time)) /",
        (OPERATORS, GRAPHS),
    ),
    Fault(
        "Belkin: area of one end only",
        "laplacian/_heat_kernel.py",
        "sites.areas[pairs].prod(axis=1)",
        "sites.areas[pairs[:, 0]] * sites.areas.mean()",
        (OPERATORS, GRAPHS),
    ),
    Fault(
        "point cloud: cells a third too large",
        "laplacian/_sites.py",
        "areas: Floats = cells * reach**2",
        "areas: Floats = cells * reach**2 * 4 / 3",
        (OPERATORS, GRAPHS),
    ),
    Fault(
        "robust: mass not scaled back",
        "laplacian/_robust.py",
        "csr_array(mass * size**2)",
        "csr_array(mass)",
        (OPERATORS, GRAPHS),
    ),
    Fault(
        "robust: weights twice",
        "laplacian/_robust.py",
        "weights = -(stiffness + stiffness.T).tocsr() / 2",
        "weights = -(stiffness + stiffness.T).tocsr()",
        (OPERATORS, GRAPHS),
    ),
    Fault(
        "differential coordinates: area for degree",
        "laplacian/_differential_coordinates.py",
        "if per_area else",
        "if not per_area else",
        (OPERATORS, GRAPHS),
    ),
    Fault(
        "heat kernel signature: first power of the eigenvector",
        "signature/_heat_kernel.py",
        "pairs.vectors**2",
        "np.abs(pairs.vectors)",
        (SIGNATURES,),
    ),
    Fault(
        "heat kernel signature: twice the time",
        "signature/_heat_kernel.py",
        "decay = np.exp(-np.outer(",
        "decay = np.exp(-2 * np.outer(",
        (SIGNATURES,),
    ),
    Fault(
        "wave kernel signature: exp(-d^2 / sigma^2)",
        "signature/_wave_kernel.py",
        "distance**2) / 2)",
        "distance**2))",
        (SIGNATURES,),
    ),
    Fault(
        "wave kernel signature: not divided by the weights' sum",
        "signature/_wave_kernel.py",
        "(weights / weights.sum(axis=0))",
        "weights",
        (SIGNATURES,),
    ),
    Fault(
        "scale-invariant signature: window cut off below",
        "signature/_scale_invariant.py",
        "    spectrum += slope[:, :1] * ratio / (1 - ratio)\n",
        "",
        (SIGNATURES,),
    ),
    Fault(
        "global point signature: divided by the eigenvalue",
        "signature/_global_point.py",
        "np.sqrt(pairs.values[index])",
        "pairs.values[index]",
        (SIGNATURES,),
    ),
    Fault(
        "heat kernel: squared at both ends",
        "signature/_kernel.py",
        "(pairs.vectors * pairs.vectors[node])",
        "(pairs.vectors * pairs.vectors[node]) ** 2",
        (SIGNATURES,),
    ),
    Fault(
        "implied curvature: without the 3",
        "signature/_reading.py",
        "3 * (4 * np.pi",
        "(4 * np.pi",
        (SIGNATURES,),
    ),
    Fault(
        "unit area: vectors not scaled",
        "records.py",
        "vectors = self.vectors * np.sqrt(ratio)",
        "vectors = self.vectors",
        (BOUNDARIES,),
    ),
    Fault(
        "compare: every component divided by the whole's mean",
        "methods.py",
        "node_components(surface.triangles) * self.by_component",
        "node_components(surface.triangles) * 0",
        (METHODS,),
    ),
    Fault(
        "compare: noise floor of another operator",
        "levels.py",
        "            laplacian=methods.laplacian,\n",
        "",
        (METHODS,),
    ),
    Fault(
        "compare: noise floor of the surface's order",
        "levels.py",
        "there, order=order)",
        "there, order=self.base.order)",
        (METHODS,),
    ),
    Fault(
        "eigensolve: the next shift forgets the ones before",
        "spectrum/_lanczos.py",
        "few = max((pair for pair in tried",
        "few = max((pair for pair in tried[-1:]",
        (SPECTRUM,),
    ),
    Fault(
        "eigensolve: times beyond the last heat",
        "spectrum/_accuracy.py",
        "times[values.min() * times <= _COOLED]",
        "times",
        (BOUNDARIES,),
    ),
    Fault(
        "rim: half the diffusion radius",
        "rims.py",
        "radius = 2 * np.sqrt(",
        "radius = np.sqrt(",
        (BOUNDARIES, EXACT),
    ),
    Fault(
        "edits: edges collapse whatever their ends share",
        "meshing/_edits.py",
        "(shared == opposite) & more & along_rim",
        "more & along_rim",
        (EDITS,),
    ),
    Fault(
        "edits: a lone tetrahedron collapses",
        "meshing/_edits.py",
        "(shared == opposite) & more & along_rim",
        "(shared == opposite) & along_rim",
        (EDITS,),
    ),
    Fault(
        "edits: two rims are drawn together",
        "meshing/_edits.py",
        "along_rim = (low == 0) | (high == 0) | edges.on_rim",
        "along_rim = low >= 0",
        (EDITS,),
    ),
    Fault(
        "edits: an end inside may keep its place before one on a rim",
        "meshing/_edits.py",
        "keep = np.where(rank[low] >= rank[high], low, high)",
        "keep = low",
        (EDITS,),
    ),
    Fault(
        "edits: collapses make edges of any length",
        "meshing/_edits.py",
        "bad |= length > np.minimum(",
        "bad |= length > np.inf * np.minimum(",
        (EDITS,),
    ),
    Fault(
        "edits: collapses turn triangles over",
        "meshing/_edits.py",
        "good[owner[bad]] = False",
        "good[owner[bad]] = True",
        (EDITS,),
    ),
    Fault(
        "edits: flips away from Delaunay",
        "meshing/_edits.py",
        "good = ((gain > 1e-9) | turned)",
        "good = (gain < -1e-9) | turned",
        (EDITS,),
    ),
    Fault(
        "edits: flips make an edge that is there",
        "meshing/_edits.py",
        " & ~_there(edges.ends, c, d)",
        "",
        (EDITS,),
    ),
    Fault(
        "edits: half of a split triangle turned over",
        "meshing/_edits.py",
        "np.stack([m, b, c], axis=1)",
        "np.stack([b, m, c], axis=1)",
        (EDITS,),
    ),
    Fault(
        "edits: more edges split than asked",
        "meshing/_edits.py",
        '(-excess[chosen], kind="stable")[:most]]',
        '(-excess[chosen], kind="stable")]',
        (EDITS,),
    ),
    Fault(
        "curvature: not divided by the gradient",
        "meshing/_curvature.py",
        "hessian, flat) / slope[:, None, None]",
        "hessian, flat)",
        (SIZING,),
    ),
    Fault(
        "curvature: hollows for bumps",
        "meshing/_curvature.py",
        "shape = -np.einsum",
        "shape = np.einsum",
        (SIZING,),
    ),
    Fault(
        "sizing: sum of the curvatures' squares, not their mean",
        "meshing/_sizing.py",
        "** 2).mean(axis=1))",
        "** 2).sum(axis=1))",
        (SIZING,),
    ),
    Fault(
        "sizing: growth squared",
        "meshing/_sizing_field.py",
        "way = growth * np.linalg.norm",
        "way = growth**2 * np.linalg.norm",
        (SIZING,),
    ),
    Fault(
        "sizing: mean curvature for the greatest",
        "meshing/_sizing_field.py",
        "np.abs(principal_curvatures(fine.points, field)).max(axis=1)",
        "np.abs(principal_curvatures(fine.points, field)).mean(axis=1)",
        (SIZING,),
    ),
    Fault(
        "sizing: rim edges not counted",
        "meshing/_sizing_field.py",
        "triangles / 2 + rim_edges / 2 + euler",
        "triangles / 2 + euler",
        (SIZING,),
    ),
    Fault(
        "remeshing: edges between two rims are held on the face",
        "meshing/_remesh.py",
        " & edges.on_rim[halved, None]",
        "",
        (RIMS,),
    ),
    Fault(
        "moves: centroids whatever the wanted length",
        "meshing/_moves.py",
        "weight = areas / lengths[triangles].mean(axis=1) ** 3",
        "weight = areas",
        (RIMS,),
    ),
    Fault(
        "moves: no bars to mirror images",
        "meshing/_moves.py",
        "scale * lengths[tip])",
        "0 * lengths[tip])",
        (RIMS,),
    ),
    Fault(
        "meshes: midpoints leave the face",
        "meshing/_finish.py",
        "held_between(points, held, *edges.T) & (counts == 1)[:, None]",
        "held_between(points, held, *edges.T) & False",
        (RIMS,),
    ),
    Fault(
        "meshes: midpoints of inner edges are held on the face",
        "meshing/_finish.py",
        "held_between(points, held, *edges.T) & (counts == 1)[:, None]",
        "held_between(points, held, *edges.T)",
        (RIMS,),
    ),
    Fault(
        "meshes: distorted triangles stay",
        "meshing/_finish.py",
        "_LEAST_JACOBIAN = 0.1",
        "_LEAST_JACOBIAN = -9.0",
        (RIMS,),
    ),
    Fault(
        "meshes: triangles may face inward",
        "meshing/_finish.py",
        " & outward",
        "",
        (RIMS,),
    ),
    Fault(
        "projection: what is held is not asked",
        "projection.py",
        "if held is None else held",
        "if held is None or True else held",
        (RIMS,),
    ),
    Fault(
        "meshes: no word about more vertices than wanted",
        "meshing/_start.py",
        "sizes.vertices > 1.02 * vertices",
        "sizes.vertices > 99 * vertices",
        (f"{MESHERS}::test_a_tiny_component_stays_with_few_vertices",),
    ),
    Fault(
        "rims: curvature of a section without its unit",
        "meshing/_curvature.py",
        "tangent, hessian, tangent)) / slope",
        "tangent, hessian, tangent))",
        (SIZING,),
    ),
    Fault(
        "rims: edges between opposite faces are held by both",
        "meshing/_draft.py",
        "held[i] & held[j] & (points[i] == points[j])",
        "held[i] & held[j]",
        (RIMS,),
    ),
    Fault(
        "moves: rims rest at another grading",
        "meshing/_moves.py",
        "distance / lengths[ends].mean(axis=1) ** 2",
        "distance / lengths[ends].mean(axis=1)",
        (RIMS,),
    ),
    Fault(
        "smoothing: reflected at the box",
        "scalar_field.py",
        'mode="nearest"',
        'mode="reflect"',
        ("tests/test_smoothing.py",),
    ),
    Fault(
        "smoothing: widths are added",
        "scalar_field.py",
        "np.hypot(self.smoothing, width)",
        "self.smoothing + width",
        ("tests/test_smoothing.py",),
    ),
    Fault(
        "noise floor: two equal meshes",
        "levels.py",
        "if coarse.vertices > _COARSER * level.vertices:",
        "if False:",
        ("tests/test_methods.py",),
    ),
    Fault(
        "quality: the sizing of the comparison is not asked",
        "comparison.py",
        "isovalue, sizing=sizing)",
        "isovalue)",
        ("tests/test_methods.py",),
    ),
    Fault(
        "particles: other sheets are seen",
        "meshing/_particle_energy.py",
        'close &= np.einsum("nd,nd->n", normals[i], normals[j]) > 0',
        "pass",
        ("tests/test_particles.py",),
    ),
    Fault(
        "particles: no walls at rims",
        "meshing/_particle_energy.py",
        "energies[near] += value",
        "energies[near] += 0 * value",
        ("tests/test_particles.py",),
    ),
    Fault(
        "quality: angles at the wrong corners",
        "quality.py",
        "np.arctan2(height, (ahead * back).sum(axis=2))",
        "np.arctan2(height, -(ahead * back).sum(axis=2))",
        ("tests/test_mesh_quality.py",),
    ),
    *CARRYING,
    *GROUPS,
    *MAKING,
    *PAGE,
)


def survives(fault: Fault, folder: Path) -> str:
    """Nothing if a test failed on the broken copy, else what happened."""
    source = (ROOT / "src" / "isovary" / fault.file).read_text("utf-8")
    if source.count(fault.before) != 1:
        return f"the line stands there {source.count(fault.before)} times"
    broken = folder / "isovary"
    shutil.copytree(ROOT / "src" / "isovary", broken, ignore=shutil.ignore_patterns("__pycache__"))
    (broken / fault.file).write_text(source.replace(fault.before, fault.after), "utf-8")
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", *fault.tests]
    done = subprocess.run(
        command,
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(folder), "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    failed = re.search(r"^FAILED (\S+)", done.stdout, re.MULTILINE)
    if failed is None:
        return f"pytest ended with {done.returncode}: {done.stdout.strip()[-200:]}"
    print(f"found: {fault.what}\n       by {failed[1]}", flush=True)
    return ""


def main() -> None:
    """Plant every fault; arguments choose those whose description holds one of them."""
    chosen = [
        fault
        for fault in FAULTS
        if not sys.argv[1:] or any(word in fault.what for word in sys.argv[1:])
    ]
    alive = 0
    for fault in chosen:
        with tempfile.TemporaryDirectory() as folder:
            problem = survives(fault, Path(folder))
        if problem:
            alive += 1
            print(f"NOT FOUND: {fault.what}\n       {problem}", flush=True)
    print(f"{len(chosen) - alive} of {len(chosen)} planted faults found")
    sys.exit(alive > 0)


if __name__ == "__main__":
    main()
