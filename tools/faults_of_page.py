"""Faults to plant in the page in the browser."""

from __future__ import annotations

from fault import Fault

APP = "tests/app/test_"

PAGE = (
    Fault(
        "page: change not in percent",
        "app/_charts.py",
        "panel.points(at, 100 * change)",
        "panel.points(at, change)",
        (APP + "charts.py",),
    ),
    Fault(
        "page: partners for displacements",
        "app/_saved_result.py",
        'change.point("partner", 3)',
        'change.point("displacement", 3)',
        (APP + "saved_result.py",),
    ),
    Fault(
        "page: groups with another seed",
        "app/_groupings.py",
        "rng=seed, **options",
        "rng=0, **options",
        (APP + "groupings.py",),
    ),
    Fault(
        "page: counts clustered again and again",
        "app/_groupings.py",
        "if count not in found:",
        "if True:",
        (APP + "groupings.py",),
    ),
    Fault(
        "page: factor 0 hides what dips",
        "app/_painting.py",
        "if factor > 0 else samples.margin",
        "if factor >= 0 else samples.margin",
        (APP + "painting.py",),
    ),
    Fault(
        "page: the child's children outlive it",
        "app/_job_child.py",
        "        _end_children()\n        shutil.rmtree(scratch",
        "        shutil.rmtree(scratch",
        (APP + "jobs.py",),
    ),
    Fault(
        "page: half-written folders stay after a kill",
        "app/_jobs.py",
        "                tidy(self._out, before)",
        "                pass",
        (APP + "jobs.py",),
    ),
    Fault(
        "page: the time left is not scaled",
        "app/_jobs.py",
        "seconds * (1 - done) / done",
        "seconds * (1 - done)",
        (APP + "jobs.py",),
    ),
    Fault(
        "page: a sibling counts as inside",
        "app/_uploads.py",
        "not path.is_relative_to(folder)",
        "not str(path).startswith(str(folder))",
        (APP + "uploads.py",),
    ),
    Fault(
        "page: the root element is not asked for",
        "app/_uploads.py",
        'before + rb"<VTKFile',
        'rb".*<VTKFile',
        (APP + "uploads.py",),
    ),
    Fault(
        "page: the stride shrinks the preview",
        "app/_opened_field.py",
        "(index * stride - middle)",
        "(index - middle)",
        (APP + "opened_field.py",),
    ),
    Fault(
        "page: a preview inside out",
        "app/_opened_field.py",
        "points[:, ::-1], triangles[:, ::-1]",
        "points[:, ::-1], triangles",
        (APP + "opened_field.py",),
    ),
    Fault(
        "page: the exported command differs",
        "app/_dimple_history.py",
        "            base = Surface(base.points, base.triangles)",
        "            pass",
        (APP + "dimple_history.py",),
    ),
    Fault(
        "page: redo after a new push",
        "app/_dimple_history.py",
        "pushes=(*self.done, new)",
        "pushes=(*self.pushes, new)",
        (APP + "dimple_history.py",),
    ),
    Fault(
        "page: another local port counts as ours",
        "app/_locks.py",
        '_OWN_SITE = ("same-origin", "none")',
        '_OWN_SITE = ("same-origin", "none", "same-site")',
        (APP + "gateway.py",),
    ),
    Fault(
        "page: a websocket needs no Origin",
        "app/_locks.py",
        "(needed and not given)",
        "False",
        (APP + "gateway.py",),
    ),
    Fault(
        "page: an upload is not cut off",
        "app/_receiving.py",
        "if written > room:",
        "if False:",
        (APP + "gateway.py",),
    ),
    Fault(
        "page: downloads follow links",
        "app/_gateway.py",
        "(folder / name).is_symlink()",
        "False",
        (APP + "gateway.py",),
    ),
    Fault(
        "page: messages go to the wrong page",
        "app/_sessions.py",
        "client = session.clients.get(frame.client)",
        "client = next(iter(session.clients.values()), None)",
        (APP + "gateway.py",),
    ),
)
