"""The evaluator of a scene: what a plan keeps, and what it says of the rest."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from fiberjax._types import Floats, Reals, choice, floats, last_axis
from fiberjax.along import Along
from fiberjax.energy import albedo_model
from fiberjax.expenses import costs
from fiberjax.farfield import evaluate_model, pdf_model
from fiberjax.fiber import Fiber, cast
from fiberjax.model import Model
from fiberjax.planned import as_data, from_data
from fiberjax.rules import Rule
from fiberjax.sampling import GRADIENTS, Sample, clamped, sample_model
from fiberjax.scenes import Scene
from fiberjax.table import replace

FORMAT = 1
"""Of files: another number means rules that compute something else by these names."""

HEAD = "part", "what becomes of it", "bound", "before", "after"


class Row(NamedTuple):
    """What became of a part, and the error that may come of it over the peak."""

    part: str
    decision: str
    bound: float


@dataclass(frozen=True)
class Plan:
    """A model with what a scene does not need left out.

    Static and hashable. `evaluate`, `pdf`, `sample` and `albedo` take what those of
    `fiberjax` take, for fibers and directions of the scene, and are compiled with
    nothing but what is kept; outside the scene the tolerance is not promised
    (`plan.scene.check`). Derivatives are those of what is kept. `print(plan)` is a
    table.

    Fields:
        scene: what was asked for.
        model: lobes, rules and the form of M of `evaluate`, `sample` and `albedo`.
        density: the rule of `pdf`.
        rows: what became of each part.
        albedo_bound: largest error of the albedo, over it.
        pdf_bound: largest error of the density, over its peak.
    """

    scene: Scene
    model: Model
    density: Rule
    rows: tuple[Row, ...]
    albedo_bound: float
    pdf_bound: float

    def evaluate(
        self, fiber: Fiber, theta_i: Reals, theta_o: Reals, phi: Reals
    ) -> Floats:
        """`fiberjax.evaluate` to the tolerance of the scene.

        Raises:
            ValueError: angles of another dtype than the scene's; a fiber with an
                effect that the scene has not; and as `fiberjax.evaluate`.
        """
        fiber, angles = self._prepare(fiber, theta_i, theta_o, phi)
        return _evaluate(self.model, fiber, *angles)

    def pdf(self, fiber: Fiber, theta_i: Reals, theta_o: Reals, phi: Reals) -> Floats:
        """The density of `sample`, to the tolerance times its peak; errors as there."""
        fiber, angles = self._prepare(fiber, theta_i, theta_o, phi)
        model = Model(
            self.model.lobes,
            self.model.rest,
            self.density,
            self.model.detector,
            self.model.incidence,
        )
        return _pdf(model, self.scene.strategy, fiber, *angles)

    def sample(
        self,
        fiber: Fiber,
        theta_i: Reals,
        u: Reals,
        *,
        gradient: str = "reparameterized",
        clamp: float | None = None,
    ) -> Sample:
        """`fiberjax.sample` of the lobes that are kept; errors as in `evaluate`."""
        choice("gradient", gradient, GRADIENTS)
        last_axis(5, u=u)
        clamp = clamped(clamp)
        fiber, (theta_i, u) = self._prepare(fiber, theta_i, u)
        what = self.model, self.scene.strategy, gradient
        return _sample(*what, fiber, theta_i, u, clamp)

    def albedo(self, fiber: Fiber, theta_i: Reals) -> Floats:
        """`fiberjax.albedo` to the tolerance times itself; errors as in `evaluate`."""
        fiber, (theta_i,) = self._prepare(fiber, theta_i)
        return _albedo(self.model, fiber, theta_i)

    def _prepare(self, fiber: Fiber, *given: Reals) -> tuple[Fiber, list[Floats]]:
        self.scene.check_absent(fiber)
        wanted = jnp.dtype(self.scene.dtype)
        arrays = floats(given, (jnp.zeros((), wanted),))[: len(given)]
        found = arrays[0].dtype
        if found != wanted:
            raise ValueError(f"the angles are {found}: must be {wanted}, as the scene")
        return cast(fiber, wanted), arrays

    @property
    def bound(self) -> float:
        """The sum of all bounds, which is at most the tolerance."""
        return sum(row.bound for row in self.rows)

    def report(self) -> list[dict[str, Any]]:
        """The rows of the table as data, with operations counted.

        Each is {"part", "decision", "bound", "before", "after"}: the last two are flops
        of a value of a lobe by itself, in one color, in the full model and in the plan;
        None for what is in the lobes.
        """
        counted = costs(self.scene, self.model)
        found = []
        for row in self.rows:
            before, after = counted.get(row.part, (None, None))
            found.append({**row._asdict(), "before": before, "after": after})
        return found

    def __str__(self) -> str:
        rows = self.report()
        cells = [HEAD, *map(_cells, rows), self._total(rows)]
        widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
        lines = [_line(row, widths) for row in cells]
        lines.insert(1, "-" * len(lines[0]))
        return "\n".join(
            [
                *lines,
                f"albedo within {self.albedo_bound:.1e}, pdf within "
                f"{self.pdf_bound:.1e} of its peak",
            ]
        )

    def _total(self, rows: list[dict[str, Any]]) -> Sequence[str]:
        whole = (sum(row[k] or 0 for row in rows) for k in ("before", "after"))
        said = f"tolerance {self.scene.tolerance:.1e}"
        return "all", said, f"{self.bound:.1e}", *(f"{x:.0f}" for x in whole)

    def save(self, path: str | Path) -> None:
        """Write the plan as JSON, whole or not at all."""
        model = self.model
        found = {
            "format": FORMAT,
            "scene": self.scene.as_dict(),
            "lobes": model.lobes,
            "rest": model.rest,
            "rule": as_data(model.rule),
            "along": None if model.along is None else asdict(model.along),
            "density": as_data(self.density),
            "rows": [row._asdict() for row in self.rows],
            "albedo_bound": self.albedo_bound,
            "pdf_bound": self.pdf_bound,
        }
        text = json.dumps(found, indent=1, allow_nan=False) + "\n"
        replace(Path(path), lambda file: file.write_text(text))

    @classmethod
    def load(cls, path: str | Path) -> "Plan":
        """The plan that `save` wrote, equal to it.

        Raises:
            ValueError: not the file of a plan, or one of another format.
        """
        try:
            found = json.loads(Path(path).read_text())
            written = found["format"]
            if written == FORMAT:
                return cls._of(found)
        except (KeyError, TypeError, ValueError) as error:
            raise ValueError(f"path = {path}: must be the file of a plan") from error
        raise ValueError(
            f"path = {path}: has format {written}, must have {FORMAT}; plan the scene "
            "again"
        )

    @classmethod
    def _of(cls, found: dict[str, Any]) -> "Plan":
        """The plan that JSON has."""
        scene, along = Scene.from_dict(found["scene"]), found["along"]
        model = Model(
            tuple(found["lobes"]),
            found["rest"],
            from_data(found["rule"]),
            scene.detector,
            scene.incidence,
            None if along is None else Along(**along),
        )
        rows = tuple(Row(**row) for row in found["rows"])
        rest = found["albedo_bound"], found["pdf_bound"]
        return cls(scene, model, from_data(found["density"]), rows, *rest)


def _cells(row: dict[str, Any]) -> Sequence[str]:
    bound = f"{row['bound']:.1e}" if row["bound"] else "0"
    counted = ("" if row[k] is None else f"{row[k]:.0f}" for k in ("before", "after"))
    return row["part"], row["decision"], bound, *counted


def _line(row: Sequence[str], widths: Sequence[int]) -> str:
    left, right = row[:2], row[2:]
    cells = [x.ljust(w) for x, w in zip(left, widths[:2], strict=True)]
    cells += [x.rjust(w) for x, w in zip(right, widths[2:], strict=True)]
    return " | ".join(cells).rstrip()


_evaluate = jax.jit(evaluate_model, static_argnames="model")


_pdf = jax.jit(pdf_model, static_argnames=("model", "strategy"))
_sample = jax.jit(sample_model, static_argnames=("model", "strategy", "gradient"))


@partial(jax.jit, static_argnames="model")
def _albedo(model: Model, fiber: Fiber, theta_i) -> Floats:
    return albedo_model(model, fiber, theta_i, False)
